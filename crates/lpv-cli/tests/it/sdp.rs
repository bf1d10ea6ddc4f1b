//! `lpv sdp` on files of SDPLIB 1.2 (B. Borchers 1999) and on files that are none.

use crate::program::{Place, parsed};

fn data(name: &str) -> String {
    std::fs::read_to_string(format!("{}/../lmi/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// The optima that come with SDPLIB, to the digits it has.
#[test]
fn literature_problems_are_solved() {
    for (name, optimum) in [("control1.dat-s", 17.78463), ("truss1.dat-s", -8.999996), ("mcp100.dat-s", 226.1574)] {
        let place = Place::with("");
        place.write(name, data(name));
        let record = parsed(&place.succeed(&format!("sdp {name} --json")));
        assert_eq!(record["status"], "solved");
        let objective = record["objective"].as_f64().unwrap();
        let bound = record["optimum_bound"].as_f64().unwrap();
        assert!(bound <= objective && objective - bound < 1e-6 * (1.0 + objective.abs()));
        assert!((objective / optimum - 1.0).abs() < 1e-6, "{name}: {objective} is not {optimum}");
        assert!(record["verified_lower_bounds"].as_array().unwrap().iter().all(|value| value.as_f64().unwrap() > 0.0));
        assert!(record["uncertainty"].as_f64().unwrap() < 1e-6 && record["explanation"].is_null());
        assert!(record["smallest_eigenvalues"].as_array().unwrap().iter().all(|value| value.as_f64().unwrap() > 0.0));
        assert!(place.succeed(&format!("sdp {name}")).contains("status           solved"));
    }
}

/// x ≥ 1 and −x ≥ 0 contradict each other; minimising −x over x ≥ 0 has no end.
#[test]
fn problems_without_optimum_end_with_3() {
    let place = Place::with("");
    place.write("infeasible.dat-s", "1\n1\n-2\n1\n0 1 1 1 1\n1 1 1 1 1\n1 1 2 2 -1\n");
    let ended = place.lpv("sdp infeasible.dat-s");
    ended.refuses(3, &["infeasible"]);
    // Each side has to give way by 1/2.
    let record: serde_json::Value = serde_json::from_str(&place.lpv("sdp infeasible.dat-s --json").out).unwrap();
    assert!((record["explanation"]["distance"].as_f64().unwrap() - 0.5).abs() < 1e-6);
    place.write("unbounded.dat-s", "1\n1\n1\n-1\n1 1 1 1 1\n");
    place.lpv("sdp unbounded.dat-s --json").refuses(3, &["unbounded"]);
}

#[test]
fn files_that_are_no_problem() {
    let place = Place::with("");
    let cases = [
        ("", "ends where"),
        ("two\n", "two"),
        ("1\n1\n2\n1\n0 1 1 1 nan\n", "line 5"),
        ("1\n1\n2\n1\n1 1 3 3 1\n", "line 5"),
        ("1\n1\n2\n1\n1 1 1\n", "ends where"),
        ("99999999999\n1\n2\n", "line 1"),
        ("1\n1\n-99999999999\n1\n", "line 3"),
    ];
    for (text, word) in cases {
        place.write("problem.dat-s", text);
        place.lpv("sdp problem.dat-s").refuses(2, &["problem.dat-s", word]);
    }
    place.lpv("sdp missing.dat-s").refuses(2, &["missing.dat-s", "cannot be read"]);
}

/// 1 ≤ x ≤ b: infeasible by 10⁻⁸, an equation, feasible by 10⁻⁸. What is not proved has a softer word and another exit code, and no number is
/// rounded to the wrong side or to zero.
#[test]
fn words_are_no_stronger_than_proofs() {
    let place = Place::with("");
    for (b, allowed, code) in [
        ("0.99999999", &["infeasible", "solved to tolerance", "inaccurate"][..], None),
        ("1", &["solved to tolerance", "inaccurate"], Some(4)),
        ("1.00000001", &["solved", "solved to tolerance"], None),
    ] {
        place.write("interval.dat-s", format!("1\n1\n-2\n1\n0 1 1 1 1\n1 1 1 1 1\n0 1 2 2 -{b}\n1 1 2 2 -1\n"));
        let ended = place.lpv("sdp interval.dat-s --json");
        let record: serde_json::Value = serde_json::from_str(&ended.out).unwrap();
        let status = record["status"].as_str().unwrap();
        assert!(allowed.contains(&status), "{b}: {status}");
        if let Some(code) = code {
            ended.refuses(code, &[]);
        }
        let detail = record["detail"].as_str().unwrap();
        if status == "solved to tolerance" {
            assert!(detail.contains("at most") && !detail.contains("at most 0;"), "{b}: {detail}");
            assert!(!place.lpv("sdp interval.dat-s").out.contains("≥ 0 "), "{b}");
        }
        let attained = record["attained"].as_f64();
        assert!(attained.is_none_or(|p| p >= 1.0) && (b == "1.00000001" || attained.is_none()), "{b}: {attained:?}");
        assert!(record["optimum_bound"].as_f64().is_none_or(|bound| bound <= 1.0), "{b}");
    }
}
