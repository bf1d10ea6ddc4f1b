//! Random polytopes whose truth another solver found: every feasible one gets a design that is proved and that one can apply, every other
//! one is called infeasible, with every method.

use crate::program::Place;
use lpv::math::eigen::symmetric_eigenvalues;
use lpv::math::matrix::from_rows;
use serde::Deserialize;
use serde_json::Value;

const POLYTOPES: &str = include_str!("../cases/polytopes/polytopes.json");
/// Others of the same kind, which were drawn when the first were designed.
const MORE: &str = include_str!("../cases/polytopes/polytopes-20261128.json");

#[derive(Deserialize)]
struct Polytope {
    #[serde(rename = "A")]
    a: Value,
    #[serde(rename = "B")]
    b: Vec<Vec<f64>>,
    feasible: Option<bool>,
    #[serde(rename = "tr_Y")]
    trace: Option<f64>,
    gain_at_90_percent: Option<f64>,
}

impl Polytope {
    fn problem(&self, method: &str) -> String {
        let (n, m) = (self.b.len(), self.b[0].len());
        let ones = |count: usize| format!("{:?}", vec![1.0; count]);
        let weights = match method {
            "stabilize" => String::new(),
            _ => format!("[weights]\nQ_diag = {}\nR_diag = {}\n", ones(n), ones(m)),
        };
        let limits = format!("method = \"slpvqr\"\nsigma = {}\ngamma = 1\n", ones(m));
        let method = match method {
            "slpvqr" => limits,
            "high-gain" => limits + "high_gain = true\n",
            other => format!("method = \"{other}\"\n"),
        };
        format!("[model]\nA = {}\nB = {:?}\n{weights}[design]\nlyapunov = \"common\"\n{method}", self.a, self.b)
    }

    /// Why the answer of `method` is of no use; `None` if it is. `moderate` says the largest moderate gain, from that of the outside design.
    fn complaint(&self, method: &str, moderate: &(dyn Fn(f64) -> f64 + Sync)) -> Option<String> {
        let place = Place::with(self.problem(method));
        let ended = place.lpv("design scenario.toml -o design.json");
        if self.feasible != Some(true) {
            return (self.feasible == Some(false) && ended.code != 3).then_some(ended.err);
        }
        if ended.code != 0 {
            return Some(ended.err);
        }
        let design = place.json("design.json");
        let certificate: Value = serde_json::from_str(&place.succeed("certify design.json --json")).unwrap();
        let matrices: Vec<Vec<Vec<f64>>> = serde_json::from_value(design["K"].clone()).unwrap();
        let gain = |k: &Vec<Vec<f64>>| {
            let k = from_rows(k);
            symmetric_eigenvalues(&(&k * k.transpose())).into_iter().fold(0.0, f64::max).sqrt()
        };
        let gain = matrices.iter().map(gain).fold(0.0, f64::max);
        let outside = self.gain_at_90_percent.unwrap();
        let most = if method == "lpvqr" { 5.0 * outside } else { moderate(outside) };
        let achieved = design["achieved"].as_f64().unwrap();
        let least = if method == "lpvqr" { 0.8 * self.trace.unwrap() } else { 0.0 };
        let proved = certificate["verdict"] == "proved" && design["verdict"] == "proved";
        (!proved || gain > most || achieved < least)
            .then(|| format!("proved {proved}, gain {gain:e} of {most:e}, objective {achieved} of {least}"))
    }
}

#[test]
fn every_polytope_is_designed_or_refuted() {
    all_are_designed_or_refuted(POLYTOPES, (88, 12), &|_| 1e4);
}

#[test]
fn so_is_every_polytope_of_another_seed() {
    // of one of them the outside design has a gain of 7e4
    all_are_designed_or_refuted(MORE, (84, 16), &|outside| outside.max(1e4));
}

/// So many are feasible, and so many are not.
fn all_are_designed_or_refuted(corpus: &str, counts: (usize, usize), moderate: &(dyn Fn(f64) -> f64 + Sync)) {
    let polytopes: Vec<Polytope> = serde_json::from_str(corpus).unwrap();
    let count = |feasible| polytopes.iter().filter(|polytope| polytope.feasible == Some(feasible)).count();
    assert_eq!((count(true), count(false)), counts);
    let methods = ["lpvqr", "slpvqr", "high-gain", "stabilize"];
    std::thread::scope(|scope| {
        let each = |method: &'static str| {
            let polytopes = &polytopes;
            scope.spawn(move || {
                let complaints = polytopes.iter().enumerate().filter_map(|(i, polytope)| {
                    polytope.complaint(method, moderate).map(|complaint| format!("{method}, polytope {i}: {complaint}"))
                });
                complaints.collect::<Vec<_>>()
            })
        };
        let threads = methods.map(each);
        let complaints: Vec<String> = threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect();
        assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    });
}

/// What is given back is said, and can be chosen.
#[test]
fn back_off() {
    let polytopes: Vec<Polytope> = serde_json::from_str(POLYTOPES).unwrap();
    let text = polytopes[0].problem("lpvqr");
    let answer = |back_off: &str| -> Value {
        let place = Place::with(format!("{text}{back_off}"));
        serde_json::from_str(&place.succeed("design scenario.toml --json")).unwrap()
    };
    let number = |answer: &Value, key: &str| answer[key].as_f64().unwrap();
    let knee = answer("");
    assert!(number(&knee, "back_off") > 0.0 && number(&knee, "largest_gain") < 100.0, "{knee}");
    let shares = ["back_off = 0.01\n", "back_off = 0.1\n", "back_off = 0.3\n"].map(answer);
    for (answer, share) in shares.iter().zip([0.01, 0.1, 0.3]) {
        let (optimum, achieved) = (number(answer, "objective"), number(answer, "achieved"));
        assert!(achieved >= (1.0 - share) * optimum * (1.0 - 1e-5) && achieved <= optimum, "{achieved} of {optimum}");
        assert!((optimum / number(&knee, "objective") - 1.0).abs() < 1e-9, "the optimum is the same");
    }
    assert!(number(&shares[2], "largest_gain") < number(&shares[0], "largest_gain"));
    // the bare optimum is not attained, and no gain of it can be applied
    Place::with(format!("{text}back_off = 0\n"))
        .lpv("design scenario.toml")
        .refuses(4, &["cannot be proved", "give more of the optimum back"]);
    for bad in ["-0.1", "1", "nan", "1e-9"] {
        Place::with(format!("{text}back_off = {bad}\n"))
            .lpv("design scenario.toml")
            .refuses(2, &["design.back_off", "a share of the optimum"]);
    }
}

/// As many inputs as states: any decay can be had, and a moderate one is taken.
#[test]
fn an_input_for_every_state() {
    for (a, b) in [("[[1]]", "[[1]]"), ("[[0]]", "[[-2]]"), ("[[1, 2], [3, 4]]", "[[1, 0], [0.5, 1]]")] {
        let place = Place::with(format!("[model]\nA = {a}\nB = {b}\n[design]\nmethod = \"stabilize\"\n"));
        let answer: Value = serde_json::from_str(&place.succeed("design scenario.toml --json")).unwrap();
        assert_eq!((&answer["status"], &answer["verdict"]), (&"solved".into(), &"proved".into()), "{answer}");
        assert!(answer["largest_gain"].as_f64().unwrap() < 100.0, "{answer}");
    }
}

/// Inputs that almost pull together, weak ones and strong ones: V of the design is well conditioned, and the gain is what the plant asks for. The least
/// singular value of B moves x1 alone, so that a gain of ‖A‖ over it is needed, and a few times that is found.
#[test]
fn inputs_of_any_size_and_direction() {
    let asked = |b: [[f64; 2]; 2]| {
        let b_squared = from_rows(&b.map(|row| row.to_vec()));
        let least = symmetric_eigenvalues(&(&b_squared * b_squared.transpose()))[0].sqrt();
        30.0_f64.sqrt() / least
    };
    for b in [
        [[1.0, 0.0], [1e3, 1.0]],
        [[1.0, 0.0], [1e6, 1.0]],
        [[1e-9, 0.0], [1e-6, 1e-9]],
        [[1e-9, 0.0], [0.0, 1e-9]],
        [[1e9, 0.0], [0.0, 1e9]],
        [[1e-9, 0.0], [0.0, 1e9]],
    ] {
        let text = format!("[model]\nA = [[1, 2], [3, 4]]\nB = {b:?}\n[design]\nmethod = \"stabilize\"\n");
        let answer: Value = serde_json::from_str(&Place::with(text).succeed("design scenario.toml --json")).unwrap();
        assert_eq!((&answer["status"], &answer["verdict"]), (&"solved".into(), &"proved".into()), "{answer}");
        assert!(answer["objective"].as_f64().unwrap() > 1.0, "{answer}");
        let gain = answer["largest_gain"].as_f64().unwrap();
        assert!(gain < 10.0 * asked(b), "{b:?}: {gain:e} of {:e}", asked(b));
    }
}

/// What cannot be proved shows no gain.
#[test]
fn no_gain_without_a_proof() {
    let text = "[model]\nA = [[1, 1e-300], [0, -1]]\nB = [[0], [1]]\n[design]\nmethod = \"stabilize\"\n";
    let ended = Place::with(text).lpv("design scenario.toml --json");
    let answer: Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!((ended.code, &answer["status"]), (4, &"inaccurate".into()));
    assert!(["K", "P", "Y", "L"].iter().all(|key| answer[*key].is_null()), "{answer}");
}
