//! `lpv design --trade-off`: the curve of gain against optimum, as a table, as data and as a picture.

use crate::program::{Place, edited, parsed};
use serde_json::Value;

const PENDULUM: &str = include_str!("../../../../problems/pendulum.toml");
const DOUBLE_INTEGRATOR: &str = include_str!("../../../../problems/double-integrator.toml");
const TWO_MASSES: &str = include_str!("../../../../problems/two-masses.toml");
/// One of the random polytopes whose optimum is approached by ever larger gains.
const POLYTOPES: &str = include_str!("../cases/polytopes/polytopes.json");

const SHARES: [f64; 9] = [0.0, 0.001, 0.003, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4];

fn polytope(method: &str) -> String {
    let all: Vec<Value> = serde_json::from_str(POLYTOPES).unwrap();
    let (states, inputs) = (all[0]["B"].as_array().unwrap().len(), all[0]["B"][0].as_array().unwrap().len());
    let weights = match method {
        "stabilize" => String::new(),
        _ => format!("[weights]\nQ_diag = {:?}\nR_diag = {:?}\n", vec![1.0; states], vec![1.0; inputs]),
    };
    format!(
        "[model]\nA = {}\nB = {}\n{weights}[design]\nlyapunov = \"common\"\nmethod = \"{method}\"\n",
        all[0]["A"], all[0]["B"]
    )
}

/// The answer with its curve; text, data and picture agree in what they hold.
fn curve(text: &str) -> (Value, String) {
    let place = Place::with(text);
    let json = place.succeed("design scenario.toml --trade-off curve.svg --json -o design.json");
    let answer = parsed(&json);
    assert_eq!(answer, place.json("design.json"), "the file holds the same");
    let picture = place.read("curve.svg");
    assert!(picture.starts_with("<svg") && picture.ends_with("</svg>\n"), "{picture}");
    assert!(!picture.contains("NaN") && !picture.contains("inf"), "{picture}");
    // the design of the answer is that of an answer without the curve
    let alone = parsed(&place.succeed("design scenario.toml --json"));
    for key in ["status", "verdict", "K", "P", "back_off", "achieved", "objective"] {
        assert_eq!(alone[key], answer[key], "{key}");
    }
    // and the file is certified as without it
    assert_eq!(parsed(&place.succeed("certify design.json --json"))["verdict"], "proved");
    (answer["trade_off"].clone(), picture)
}

fn rows(curve: &Value) -> Vec<Value> {
    curve["points"].as_array().unwrap().clone()
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} of {row}"))
}

/// Every method with a second stage: the effort falls as more is given back, each design keeps to its share, and the design of the answer is marked.
#[test]
fn gain_against_optimum() {
    for text in [&*polytope("lpvqr"), &polytope("stabilize"), PENDULUM, DOUBLE_INTEGRATOR, TWO_MASSES] {
        let (curve, picture) = curve(text);
        let rows = rows(&curve);
        let given: Vec<f64> = rows.iter().map(|row| number(row, "back_off")).collect();
        assert!(SHARES.iter().all(|share| given.contains(share)) && given.is_sorted(), "{given:?}");
        let chosen = number(&curve, "chosen");
        assert_eq!(rows.iter().filter(|row| number(row, "back_off") == chosen && row["status"] == "solved").count(), 1);
        let solved: Vec<&Value> = rows.iter().filter(|row| row["status"] == "solved").collect();
        // those of the double integrator keep their claims too, but its initial state leaves the certified set
        assert!(solved.len() >= 7, "{curve}");
        let optimum = number(&curve, "optimum");
        for row in &solved {
            let lost = (optimum - number(row, "achieved")).abs() / optimum.abs();
            assert!(lost <= number(row, "back_off") + 1e-5, "{row} of {optimum}");
        }
        // what is taken beyond the least effort, where gains are large, is a factor of two of √τ
        for pair in solved.windows(2) {
            assert!(number(pair[1], "effort") <= 2.01 * number(pair[0], "effort"), "{pair:?}");
        }
        assert!(picture.contains("largest gain") && picture.contains("the design: "), "{picture}");
    }
}

/// The bare optimum of a random polytope has a gain that nobody can apply, is not proved, and is drawn as such.
#[test]
fn a_bare_optimum_without_proof_is_marked() {
    let text = polytope("lpvqr");
    let (curve, picture) = curve(&text);
    let bare = rows(&curve).remove(0);
    assert!(number(&bare, "back_off") == 0.0 && number(&bare, "largest_gain") > 1e6, "{bare}");
    assert_eq!((&bare["status"], &bare["verdict"]), (&"inaccurate".into(), &"undecided".into()));
    assert!(picture.contains("not proved"), "{picture}");
    let out = Place::with(&text).succeed("design scenario.toml --trade-off curve.svg");
    let line = |start: &str| out.lines().find(|line| line.trim_start().starts_with(start)).unwrap().to_owned();
    assert!(line("nothing").contains("not proved") && line("5 %").contains("<- the knee"), "{out}");
}

/// A row says what an answer with its share says.
#[test]
fn a_row_is_an_answer() {
    let text = polytope("lpvqr");
    let (curve, _) = curve(&text);
    for row in rows(&curve).iter().filter(|row| [0.01, 0.2].contains(&number(row, "back_off"))) {
        let text = format!("{text}back_off = {}\n", row["back_off"]);
        let answer = parsed(&Place::with(text).succeed("design scenario.toml --json"));
        assert_eq!((&answer["status"], &answer["verdict"]), (&row["status"], &row["verdict"]));
        for key in ["achieved", "largest_gain"] {
            assert!((number(&answer, key) / number(row, key) - 1.0).abs() < 1e-3, "{key}: {} {row}", answer[key]);
        }
    }
    // a share of one's own stands among the others
    let own = edited(&text, "method = ", "back_off = 0.15\nmethod = ");
    let place = Place::with(own);
    let answer = parsed(&place.succeed("design scenario.toml --trade-off curve.svg --json"));
    assert_eq!(answer["trade_off"]["chosen"], 0.15);
    assert_eq!(answer["trade_off"]["points"].as_array().unwrap().len(), SHARES.len() + 1);
}

/// Nothing to trade, no optimum, or no place: said so, and nothing is written.
#[test]
fn refusals() {
    let lqr = "[model]\nA = [[0, 1], [0, 0]]\nB = [[0], [1]]\n[weights]\nQ_diag = [1, 1]\nR = [[1]]\n[design]\nmethod = \"lqr\"\n";
    let commutator = include_str!("../../../../problems/commutator.toml");
    for text in [
        lqr,
        &edited(lqr, "\"lqr\"", "\"lpvqr\"\nlyapunov = \"frozen\""),
        commutator,
        crate::program::DOUBLE_INTEGRATOR,
    ] {
        let place = Place::with(text);
        place.lpv("design scenario.toml --trade-off curve.svg").refuses(2, &["scenario.toml", "--trade-off", "is for"]);
        assert_eq!(place.list("."), ["scenario.toml"]);
    }
    let infeasible = edited(DOUBLE_INTEGRATOR, "A = [[0, 1], [0, 0]]", "A = [[1, 0], [0, -1]]");
    let place = Place::with(infeasible);
    place.lpv("design scenario.toml --trade-off curve.svg").refuses(3, &["infeasible"]);
    assert_eq!(place.list("."), ["scenario.toml"]);
    let place = Place::with(DOUBLE_INTEGRATOR);
    place
        .lpv("design scenario.toml --trade-off none/curve.svg")
        .refuses(2, &["none/curve.svg", "--trade-off another file"]);
    place.succeed("design scenario.toml --trade-off curve.svg");
    place.lpv("design scenario.toml --trade-off curve.svg").refuses(2, &["curve.svg", "--force"]);
    place.succeed("design scenario.toml --trade-off curve.svg --force");
}
