//! `lpv design PROBLEM.toml`: the shipped problems, the answer for machines, and everything that can be wrong with a file.

use crate::program::{Place, edited};
use serde_json::Value;
use std::fs;

const PENDULUM: &str = include_str!("../../../../problems/pendulum.toml");
const DOUBLE_INTEGRATOR: &str = include_str!("../../../../problems/double-integrator.toml");

fn answer(text: &str) -> Value {
    let place = Place::with(text);
    serde_json::from_str(&place.succeed("design scenario.toml --json")).unwrap()
}

fn close(value: &Value, expected: f64, tolerance: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - expected).abs() < tolerance, "{value} is not {expected}");
}

#[test]
fn parameter_dependent_regulator() {
    let answer = answer(PENDULUM);
    assert_eq!(answer["status"], "solved");
    assert_eq!(answer["verdict"], "numerical");
    close(&answer["guaranteed_cost"], 68.7353, 1e-4);
    close(&answer["objective"], 1.45152117, 1e-7);
    for key in ["Y", "P", "L", "K"] {
        assert_eq!(answer[key].as_array().unwrap().len(), 2, "{key} at both vertices");
    }
    let residuals = answer["residuals"].as_object().unwrap();
    assert_eq!(residuals.len(), 8, "{residuals:?}");
    assert!(residuals.values().all(|margin| margin.as_f64().unwrap() > 0.0));
}

#[test]
fn high_gain_regulator() {
    let answer = answer(DOUBLE_INTEGRATOR);
    close(&answer["guaranteed_cost"], 59.6849, 1e-3);
    assert_eq!(answer["inside_certified_set"], true);
    let [k, f] = ["K", "F"].map(|key| answer[key][0][0][0].as_f64().unwrap());
    assert!(k > f && answer["s"][0].as_f64().unwrap() > 0.0);
}

/// Outside the certified set the bound is printed, and that nothing is guaranteed.
#[test]
fn initial_state_outside_the_set() {
    let answer = answer(&edited(DOUBLE_INTEGRATOR, "gamma = 60", "gamma = 1"));
    close(&answer["guaranteed_cost"], 5.92367, 1e-4);
    assert_eq!((&answer["inside_certified_set"], &answer["verdict"]), (&false.into(), &"undecided".into()));
}

/// An infeasible problem ends with code 3, its witness and what to relax; the answer is printed all the same.
#[test]
fn infeasible() {
    let text =
        "[model]\nplant = \"quadrotor\"\ngrid_points = 4\n[design]\nmethod = \"stabilize\"\nlyapunov = \"common\"\n";
    let place = Place::with(text);
    let ended = place.lpv("design scenario.toml --json");
    ended.refuses(3, &["infeasible", "relax several", "stability at vertex 1"]);
    let answer: Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(answer["status"], "infeasible");
    assert!(answer["K"].is_null() && answer["explanation"]["distance"].as_f64().unwrap() > 0.0);
    assert!(!answer["witness"].as_array().unwrap().is_empty());
}

/// A quadrotor that yaws within 30° can be stabilised by one Lyapunov function.
#[test]
fn plant_on_an_arc() {
    let text = "[model]\nplant = \"quadrotor\"\ngrid_points = 5\nrange = [-0.5236, 0.5236]\n[design]\nmethod = \"stabilize\"\nlyapunov = \"common\"\n";
    let answer = answer(text);
    assert_eq!(answer["status"], "solved");
    assert!((answer["objective"].as_f64().unwrap() - 0.5115).abs() < 1e-4);
}

/// Theorem 4.5 at points of the polytope, and the bound at ρ(0) that is none of them.
#[test]
fn frozen_regulator() {
    let frozen = edited(PENDULUM, "lyapunov = \"parameter-dependent\"", "lyapunov = \"frozen\"");
    let frozen = edited(&frozen, "rate_bound = 0.87236364", "# rate_bound");
    let at_the_vertices = answer(&frozen);
    close(&at_the_vertices["guaranteed_cost"], 55.865797, 1e-5);
    assert_eq!(at_the_vertices["verdict"], "undecided");
    let between = edited(&frozen, "[weights]", "grid = [[1, 0], [0.75, 0.25], [0.5, 0.5]]\n[weights]");
    let between = answer(&between);
    assert_eq!(between["K"].as_array().unwrap().len(), 3);
    close(&between["guaranteed_cost"], 55.865797, 1e-5);
}

#[test]
fn answers_go_to_files_whole_or_not_at_all() {
    let place = Place::with(PENDULUM);
    place.succeed("design scenario.toml -o answer.json");
    assert_eq!(place.json("answer.json")["status"], "solved");
    place.lpv("design scenario.toml -o answer.json").refuses(2, &["answer.json", "--force"]);
    place.succeed("design scenario.toml -o answer.json --force");
    place.lpv("design scenario.toml -o none/answer.json").refuses(2, &["none/answer.json", "folder is not there"]);
    fs::create_dir(place.path("folder")).unwrap();
    place.lpv("design scenario.toml -o folder").refuses(2, &["folder", "is a folder"]);
    assert_eq!(place.list("."), ["answer.json", "folder", "scenario.toml"]);
}

#[test]
fn bad_input() {
    for (from, to, words) in [
        ("A = [[[0, 1], [1, -0.1]], [[0, 1], [0, -0.1]]]", "", ["model.A", "is missing"]),
        ("[[0, 1], [0, -0.1]]]", "[[0, 1], [0]]]", ["model.A[2]", "row 2 has 1 numbers"]),
        ("[[0, 1], [0, -0.1]]]", "[[0, nan], [0, 1]]]", ["model.A[2]", "not finite"]),
        ("[[0, 1], [0, -0.1]]]", "[[0]]]", ["model", "A of vertex 2 is 1 × 1"]),
        ("B = [[[0], [1]]]", "B = [[[0], [1]], [[0], [1]], [[0], [1]]]", ["model", "2 matrices A and 3 matrices B"]),
        ("Q_diag = [4, 4]", "Q_diag = [4]", ["weights.Q_diag", "needs 2"]),
        ("Q_diag = [4, 4]", "Q_diag = [0, 0]", ["weights.Q", "is zero"]),
        ("Q_diag = [4, 4]", "Q_diag = [4, -4]", ["weights.Q_diag", "not positive semidefinite"]),
        ("R = [[1]]", "R = [[0]]", ["weights.R", "not positive definite"]),
        ("method = \"lpvqr\"", "method = \"lqg\"", ["lqg", "`lqr`"]),
        ("method = \"lpvqr\"", "method = \"lqr\"", ["design.method", "one vertex"]),
        ("method = \"lpvqr\"", "method = \"slpvqr\"", ["design.sigma", "is missing"]),
        ("method = \"lpvqr\"", "method = \"slpvqr\"\nsigma = [1]", ["design.gamma", "is missing"]),
        ("method = \"lpvqr\"", "method = \"slpvqr\"\ngamma = 1\nsigma = [-1]", ["design.sigma[1]", "positive"]),
        ("method = \"lpvqr\"", "method = \"slpvqr\"\ngamma = 1\nsigma = [1, 1]", ["design.sigma", "1 inputs"]),
        ("method = \"lpvqr\"", "method = \"lpvqr\"\nsigma = [1]", ["design.sigma", "\"slpvqr\" only"]),
        ("method = \"lpvqr\"", "method = \"lpvqr\"\nhigh_gain = true", ["design.high_gain", "\"slpvqr\" only"]),
        ("method = \"lpvqr\"", "method = \"lpvqr\"\nobjective = \"region\"", ["design.objective", "saturation"]),
        ("method = \"lpvqr\"", "method = \"lpvqr\"\nobjective = \"worst-case\"", ["design.initial_states", "missing"]),
        ("method = \"lpvqr\"", "method = \"lpvqr\"\ndirections = [[1, 0]]", ["design.directions", "\"region\""]),
        ("rate_bound = 0.87236364", "rate_bound = -1", ["design.rate_bound", "zero or more"]),
        ("rate_bound = 0.87236364", "", ["design.rate_vertices", "is missing"]),
        ("rate_bound = 0.87236364", "rate_vertices = [[1, 1]]", ["design.rate_vertices[1]", "sum to zero"]),
        ("rate_bound = 0.87236364", "rate_vertices = [[1, -1, 0]]", ["design.rate_vertices[1]", "2 vertices"]),
        ("lyapunov = \"parameter-dependent\"", "lyapunov = \"common\"", ["design.rate_bound", "parameter-dependent"]),
        ("initial_state = [3.141592653589793, 0]", "initial_state = [1]", ["design.initial_state", "2 states"]),
        ("initial_state = [3.141592653589793, 0]", "", ["design.initial_parameter", "initial_state"]),
        ("initial_parameter = [0, 1]", "", ["design.initial_parameter", "is missing"]),
        ("initial_parameter = [0, 1]", "initial_parameter = [1, 1]", ["design.initial_parameter", "sum to one"]),
        ("initial_parameter = [0, 1]", "initial_parameter = [0, 1]\nsample = 1", ["unknown key `sample`", "line"]),
        ("[model]", "[model]\nplant = \"quadrotor\"", ["design.lyapunov", "rate_bound"]),
    ] {
        let place = Place::with(edited(PENDULUM, from, to));
        let ended = place.lpv("design scenario.toml --json");
        ended.refuses(2, &[words[0], words[1], "scenario.toml"]);
        assert_eq!((&*ended.out, place.list(".")), ("", vec!["scenario.toml".to_owned()]));
    }
}

/// What `lpv design` prints is certified over the whole polytope, from its numbers alone.
#[test]
fn designs_over_polytopes_are_proved() {
    for problem in [PENDULUM, DOUBLE_INTEGRATOR] {
        let place = Place::with(problem);
        place.succeed("design scenario.toml -o design.json");
        let certificate: Value = serde_json::from_str(&place.succeed("certify design.json --json")).unwrap();
        let claims = certificate["claims"].as_array().unwrap();
        assert!(claims.len() >= 3 && claims.iter().all(|claim| claim["verdict"] == "proved"), "{claims:?}");
        let text = fs::read_to_string(place.path("design.json")).unwrap();
        let mut design: Value = serde_json::from_str(&text).unwrap();
        design["model"]["A"][0][1][0] = 1.5.into();
        place.write("edited.json", design.to_string());
        place.lpv("certify edited.json").refuses(2, &["model_hash", "another model"]);
    }
}

/// K and P from elsewhere, with nothing but the model: proved, refuted with a witness, or refused with the reason.
#[test]
fn gains_from_elsewhere_are_certified() {
    let place = Place::with("");
    let file = |k: &str, p: &str| {
        format!(
            r#"{{"model": {{"A": [[[0, 1], [1, -0.1]], [[0, 1], [0, -0.1]]], "B": [[0], [1]]}}, "K": {k}, "P": {p}}}"#
        )
    };
    place.write("design.json", file("[[3, 3]]", "[[4, 1], [1, 1]]"));
    let text = place.succeed("certify design.json");
    assert!(text.contains("proved: V decreases for every motion of the parameter in the polytope"), "{text}");
    place.write("design.json", file("[[0.5, 3]]", "[[4, 1], [1, 1]]"));
    let ended = place.lpv("certify design.json --json");
    ended.refuses(4, &["refuted"]);
    let certificate: Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(certificate["claims"][1]["witness"]["vertex_weights"], serde_json::json!([1.0, 0.0]));
    for (k, p, words) in [
        ("[[3, 3, 1]]", "[[4, 1], [1, 1]]", "1 × 2"),
        ("[[3, 3]]", "[[4, 1], [2, 1]]", "symmetric"),
        ("[[3, 3]]", "[[[4, 1], [1, 1]], [[4, 1], [1, 2]]]", "differs between vertices"),
    ] {
        place.write("design.json", file(k, p));
        place.lpv("certify design.json").refuses(2, &["design.json", words]);
    }
    place.write("design.json", file("[[3, 3]]", "[[4, 1], [1, 1]]"));
    place.lpv("certify design.json --rate 1").refuses(2, &["--rate", "rate_vertices"]);
}

/// The commutator benchmark of LPVTools with a cubic P on ten grid points.
#[test]
fn the_commutator_has_its_induced_norm() {
    const COMMUTATOR: &str = include_str!("../../../../problems/commutator.toml");
    for (rate, expected) in
        [(Some("0.01"), 0.0100), (Some("0.1"), 0.0993), (Some("1.0"), 0.6624), (Some("4"), 0.8663), (None, 1.0)]
    {
        let line = rate.map_or(String::new(), |rate| format!("rate_bound = {rate}"));
        let text = edited(COMMUTATOR, "rate_bound = 1.0", &line);
        let answer = answer(&text);
        close(&answer["gain"], expected, 1e-4);
        assert_eq!(answer["verdict"], "proved", "{answer}");
    }
    Place::with(edited(COMMUTATOR, "range = [-1, 1]", "range = [1, -1]"))
        .lpv("design scenario.toml")
        .refuses(2, &["model.range", "ascend"]);
}
