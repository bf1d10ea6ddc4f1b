//! Files on which a false word was once said, or a true one withheld: `tests/cases/soundness`.

use crate::program::{Place, parsed};
use serde_json::Value;
use std::path::Path;

/// A place with the case file, under its own name.
fn place(file: &str) -> Place {
    let place = Place::with("");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases/soundness").join(file);
    place.write(file, std::fs::read(path).unwrap());
    place
}

/// What `lpv certify FILE OPTIONS --json` says: exit code, and (id, verdict) of every claim.
fn certified(file: &str, options: &str) -> (i32, Vec<(String, String)>, Value) {
    let ended = place(file).lpv(&format!("certify {file} {options} --json"));
    let certificate = parsed(&ended.out);
    let word = |claim: &Value, key: &str| claim[key].as_str().unwrap().to_owned();
    let claims = certificate["claims"].as_array().unwrap();
    (ended.code, claims.iter().map(|claim| (word(claim, "id"), word(claim, "verdict"))).collect(), certificate)
}

fn verdict<'a>(claims: &'a [(String, String)], id: &str) -> &'a str {
    claims.iter().find(|claim| claim.0 == id).map_or("absent", |claim| &claim.1)
}

/// One input gives ±1, the other is unlimited: nothing holds everywhere, everything on a set that is found.
#[test]
fn one_unlimited_input_does_not_switch_limits_off() {
    let (code, claims, certificate) = certified("partly_limited.json", "");
    assert_eq!(code, 0, "{claims:?}");
    assert_eq!(verdict(&claims, "decrease"), "absent");
    for id in ["unsaturated", "invariance", "cost"] {
        assert_eq!(verdict(&claims, id), "proved", "{claims:?}");
    }
    let level = |id: &str| {
        let claim = certificate["claims"].as_array().unwrap().iter().find(|claim| claim["id"] == id).unwrap().clone();
        claim["level"].as_f64().unwrap()
    };
    // |3 x₁| ≤ 1 on 3 x₁² ≤ γ for γ ≤ 1/3
    assert!(level("cost") <= 1.0 / 3.0 && level("unsaturated") > 0.32, "{certificate}");
    for file in ["partly_limited.toml", "partly_inf.toml"] {
        let place = place(file);
        place.lpv(&format!("design {file} --out designs"));
        let text = place.succeed("certify designs/design-lqr.json");
        assert!(text.contains("from x'P x <= "), "{text}");
    }
}

#[test]
fn what_is_not_symmetric_to_the_bit_is_refused() {
    for file in ["asym_P_exit0.json", "asym_P_unstable.json"] {
        let words = ["points[0].p", "row 2, column 3", "row 3, column 2", "symmetric"];
        place(file).lpv(&format!("certify {file}")).refuses(2, &words);
    }
}

#[test]
fn a_weight_that_is_no_cost_is_refused() {
    place("q_indefinite.json").lpv("certify q_indefinite.json").refuses(2, &["weights.Q", "semidefinite", "-20"]);
}

#[test]
fn nothing_rests_on_a_false_premise() {
    let (code, claims, _) = certified("poly_not_definite.json", "");
    assert_eq!((code, verdict(&claims, "lyapunov-definite")), (4, "refuted"));
    assert_eq!((verdict(&claims, "decrease"), verdict(&claims, "cost")), ("undecided", "undecided"));
    let (code, claims, certificate) = certified("design-slqr-1.json", "--region 1000");
    assert_eq!((code, verdict(&claims, "unsaturated")), (4, "refuted"));
    assert_eq!((verdict(&claims, "invariance"), verdict(&claims, "cost")), ("undecided", "undecided"));
    let invariance =
        certificate["claims"].as_array().unwrap().iter().find(|claim| claim["id"] == "invariance").unwrap();
    assert_eq!(invariance["premises"], serde_json::json!(["lyapunov-definite", "unsaturated"]));
    assert!(invariance["detail"].as_str().unwrap().contains("does not saturate on x'P x <= 1000"), "{invariance}");
}

/// A failing sufficient condition says nothing of the claim.
#[test]
fn a_bad_auxiliary_matrix_refutes_nothing() {
    for file in ["poly_bad_F.json", "bad_F_plant.json"] {
        let (code, claims, _) = certified(file, "");
        assert_eq!(code, 4, "{claims:?}");
        assert!(claims.iter().all(|claim| claim.1 != "refuted"), "{claims:?}");
        assert_eq!(verdict(&claims, "invariance"), "undecided");
    }
    let (code, claims, _) = certified("poly_refuted_cost.json", "");
    // V does grow; the bound holds all the same, and this P does not show it
    assert_eq!((code, verdict(&claims, "decrease"), verdict(&claims, "cost")), (4, "refuted", "undecided"));
}

/// V̇ = −2x₂² ≤ 0: the set is invariant, which no strict inequality shows; that the cost is more than V refutes the cost alone.
#[test]
fn an_undecided_decrease_is_not_refuted_by_the_cost() {
    let (code, claims, _) = certified("undecided_decrease.json", "");
    assert_eq!((code, verdict(&claims, "invariance")), (4, "undecided"), "{claims:?}");
}

#[test]
fn bounds_are_printed_to_the_safe_side() {
    let text = place("design-rate-s1.json").lpv("certify design-rate-s1.json --rate 5.34836").out;
    assert!(text.contains("is invariant for |dpsi/dt| <= 5.3483 rad/s"), "{text}");
    assert!(!text.contains("<= 5.3484"), "{text}");
    let text = place("l2_small.toml").succeed("design l2_small.toml");
    let claim = text.lines().find(|line| line.starts_with("proved: ")).unwrap();
    let printed = claim.split("at most ").nth(1).unwrap().split(' ').next().unwrap();
    // |C (s − A)⁻¹ B| is 1e-8 at s = 0
    assert!((1e-8..1.2e-8).contains(&printed.parse::<f64>().unwrap()), "{text}");
    assert!(!text.contains("0.000000"), "{text}");
}

/// A smaller level than asked for is not an answer to the question.
#[test]
fn what_was_asked_is_what_is_answered() {
    let (code, claims, certificate) = certified("design-rate-s20.json", "--region 22.2");
    assert_eq!((code, verdict(&claims, "level-as-asked")), (4, "undecided"));
    let claims = certificate["claims"].as_array().unwrap();
    let asked = claims.iter().find(|claim| claim["id"] == "level-as-asked").unwrap();
    let proved = asked["proved"].as_f64().unwrap();
    assert!(asked["asked"] == 22.2 && proved < 22.2 && proved > 19.0, "{asked}");
    let words = asked["claim"].as_str().unwrap();
    assert!(words.contains("22.2") && words.contains("19.98"), "{words}");
}

#[test]
fn a_governor_that_forgets_the_parameters_motion_is_refused() {
    place("gov_flow0.json").lpv("certify gov_flow0.json").refuses(2, &["parameter_flow", "the plant's"]);
}

/// Stiff states beside slow ones: a tolerance took the rank for deficient. In units of its own the low gain is found, and all of it is proved.
#[test]
fn a_badly_scaled_plant_is_not_called_unstabilisable() {
    let place = place("stabilisable.toml");
    place.succeed("run stabilisable.toml");
    let certificate = parsed(&place.succeed("certify out/stabilisable/design-low.json --json"));
    assert_eq!(certificate["verdict"], "proved", "{certificate}");
    let text = place.read("stabilisable.toml").replace("slpvqr", "lpvqr").replace("gamma = 1\n", "");
    place.write("regulator.toml", text);
    // its bound of the cost is tight to rounding; that the gain stabilises is not
    place.lpv("design regulator.toml --out designs");
    let certificate = parsed(&place.lpv("certify designs/design-low.json --json").out);
    let claims = certificate["claims"].as_array().unwrap();
    for id in ["lyapunov-definite", "invariance", "sampled-stability"] {
        let claim = claims.iter().find(|claim| claim["id"] == id);
        assert_eq!(claim.unwrap()["verdict"], "proved", "{certificate}");
    }
}
