//! `lpv design PROBLEM.toml`: the shipped problems, the answer for machines, and everything that can be wrong with a file.

use crate::program::{Place, edited, parsed};
use serde_json::Value;
use std::fs;

const PENDULUM: &str = include_str!("../../../../problems/pendulum.toml");
const DOUBLE_INTEGRATOR: &str = include_str!("../../../../problems/double-integrator.toml");

fn answer(text: &str) -> Value {
    let place = Place::with(text);
    serde_json::from_str(&place.succeed("design scenario.toml --json")).unwrap()
}

/// Of a problem that is solved and whose verdict is `undecided`: what was asked is not answered.
fn undecided(text: &str, words: &[&str]) -> Value {
    let ended = Place::with(text).lpv("design scenario.toml --json");
    ended.refuses(4, words);
    let answer: Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!((&answer["status"], &answer["verdict"]), (&"solved".into(), &"undecided".into()));
    answer
}

fn close(value: &Value, expected: f64, tolerance: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - expected).abs() < tolerance, "{value} is not {expected}");
}

#[test]
fn parameter_dependent_regulator() {
    let answer = answer(PENDULUM);
    assert_eq!(answer["status"], "solved");
    assert_eq!(answer["verdict"], "proved");
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
    let answer = undecided(&edited(DOUBLE_INTEGRATOR, "gamma = 60", "gamma = 1"), &["outside the certified set"]);
    close(&answer["guaranteed_cost"], 5.92367, 1e-4);
    assert_eq!(answer["inside_certified_set"], false);
}

/// An infeasible problem ends with code 3, its witness and the reason; the answer is printed all the same. The hull of the yaw circle
/// holds its centre, where roll and pitch have no input.
#[test]
fn infeasible() {
    for grid_points in [4, 5, 8] {
        let text = format!(
            "[model]\nplant = \"quadrotor\"\ngrid_points = {grid_points}\n[design]\nmethod = \"stabilize\"\nlyapunov = \"common\"\n"
        );
        let place = Place::with(&text);
        let ended = place.lpv("design scenario.toml --json");
        ended.refuses(3, &["infeasible", "no input moves ", "that the polytope holds"]);
        let answer: Value = serde_json::from_str(&ended.out).unwrap();
        assert_eq!((&answer["status"], &answer["verdict"]), (&"infeasible".into(), &"refuted".into()));
        assert!(answer["K"].is_null() && !answer["explanation"]["carriers"].as_array().unwrap().is_empty());
        assert!(!answer["witness"].as_array().unwrap().is_empty());
        let direction: Vec<f64> = serde_json::from_value(answer["unstabilizable_point"]["direction"].clone()).unwrap();
        assert!((0..12).all(|i| matches!(i, 9 | 10) || direction[i] == 0.0), "{direction:?}");
        assert_eq!(answer["unstabilizable_point"]["proved"], true);
    }
}

/// A pair (A, B) that no input stabilises is an outcome, for every Lyapunov function.
#[test]
fn a_model_without_stabilising_input() {
    for lyapunov in ["common", "frozen"] {
        let text = edited(DOUBLE_INTEGRATOR, "A = [[0, 1], [0, 0]]", "A = [[1, 0], [0, -1]]");
        let text = edited(&text, "method = \"slqr\"", &format!("method = \"slqr\"\nlyapunov = \"{lyapunov}\""));
        Place::with(&text)
            .lpv("design scenario.toml")
            .refuses(3, &["infeasible", "no input moves x1,", "(λ = 1)", "needs an input"]);
        let text = edited(&text, "A = [[1, 0], [0, -1]]\nB = [[0], [1]]", "A = [[0, 2], [-2, 0]]\nB = [[0], [0]]");
        Place::with(&text).lpv("design scenario.toml").refuses(3, &["infeasible", "λ = 0 ± 2i"]);
    }
}

/// A sampler so slow that no gain is stable, and one that leaves the low gain alone.
#[test]
fn slow_sampling() {
    let sampled = |time: &str| {
        edited(DOUBLE_INTEGRATOR, "high_gain = true", &format!("high_gain = true\nsample_time_s = {time}"))
    };
    for time in ["100", "1e308"] {
        Place::with(sampled(time))
            .lpv("design scenario.toml")
            .refuses(3, &["no gain", "sample faster", "operating point"]);
    }
    let [fast, slow] = ["0.001", "2"].map(|time| answer(&sampled(time))["s"][0].as_f64().unwrap());
    assert!(fast > 1e-3 && slow < 1e-4, "{fast}, {slow}");
}

/// The answer names its theorem.
#[test]
fn theorems() {
    let common = edited(PENDULUM, "lyapunov = \"parameter-dependent\"", "lyapunov = \"common\"");
    let common = edited(&common, "rate_bound = 0.87236364", "#");
    let varying = edited(&common, "B = [[[0], [1]]]", "B = [[[0], [1]], [[0], [2]]]");
    for (text, theorem) in [
        (PENDULUM, "Theorem 4.4"),
        (&common, "Corollary 4.1"),
        (&varying, "Theorem 4.3"),
        (DOUBLE_INTEGRATOR, "Theorem 5.2"),
    ] {
        assert_eq!(answer(text)["theorem"], theorem);
    }
    let frozen = undecided(&edited(&common, "\"common\"", "\"frozen\""), &["frozen design"]);
    assert_eq!(frozen["theorem"], "Theorem 4.5");
}

/// The gain that is returned meets the inequality of every mixture, at both vertices, with a general R too.
#[test]
fn mixtures_of_a_high_gain() {
    let text = "[model]\nA = [[[0, 1, 0], [0, 0, 1], [-0.5, 0, 0]], [[0, 1, 0], [0, 0, 1], [0.3, 0, 0]]]\nB = [[[0, 0.3], [1, 0], [0, 1]]]\n\
        [weights]\nQ_diag = [1, 2, 3]\nR = [[0.1, 0.05], [0.05, 0.2]]\n\
        [design]\nmethod = \"slpvqr\"\nsigma = [1, 0.5]\ngamma = 1\nhigh_gain = true\n";
    let answer = answer(text);
    let mixtures = answer["mixtures"].as_object().unwrap();
    assert_eq!(mixtures.len(), 8);
    assert!(mixtures.values().all(|margin| margin.as_f64().unwrap() > 0.0), "{mixtures:?}");
}

/// A plant between its linearisations as vertices, at a bounded rate of their weights.
#[test]
fn plant_at_a_bounded_rate() {
    let text = "[model]\nplant = \"quadrotor\"\ngrid_points = 2\nrange = [0.5, 1.5]\n\
        [weights]\nQ_diag = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\nR_diag = [1, 1, 1, 1]\n\
        [design]\nmethod = \"lpvqr\"\nlyapunov = \"parameter-dependent\"\nrate_bound = 0.5\n\
        initial_state = [0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0]\ninitial_parameter = [0.75]\n";
    let slow = answer(text);
    let fast = answer(&edited(text, "rate_bound = 0.5", "rate_bound = 5"));
    assert_eq!(slow["theorem"], "Theorem 4.4");
    assert!(slow["objective"].as_f64().unwrap() > fast["objective"].as_f64().unwrap());
    let outside = edited(text, "initial_parameter = [0.75]", "initial_parameter = [0.25]");
    Place::with(&outside).lpv("design scenario.toml").refuses(2, &["design.initial_parameter", "0.5", "1.5"]);
}

/// Of frozen designs each point has the least bound of the initial state that it can have.
#[test]
fn frozen_designs_for_an_initial_state() {
    let frozen =
        edited(PENDULUM, "lyapunov = \"parameter-dependent\"", "lyapunov = \"frozen\"\nobjective = \"initial-state\"");
    let answer = undecided(&edited(&frozen, "rate_bound = 0.87236364", "# rate_bound"), &["frozen design"]);
    close(&answer["guaranteed_cost"], 55.865797, 1e-5);
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
    let at_the_vertices = undecided(&frozen, &["frozen design", "nothing is claimed once it moves"]);
    close(&at_the_vertices["guaranteed_cost"], 55.865797, 1e-5);
    let between = edited(&frozen, "[weights]", "grid = [[1, 0], [0.75, 0.25], [0.5, 0.5]]\n[weights]");
    let between = undecided(&between, &["frozen design"]);
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
        ("[model]", "[model]\nplant = \"quadrotor\"", ["model", "keep one"]),
        ("A = [[[0, 1], [1, -0.1]], [[0, 1], [0, -0.1]]]", "A = 3", ["expected a matrix", "list of such matrices"]),
        ("method = \"lpvqr\"", "method = 3", ["method = 3", "one of the words"]),
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
    let claims = certificate["claims"].as_array().unwrap();
    let decrease = claims.iter().find(|claim| claim["id"] == "decrease").unwrap();
    assert_eq!(decrease["witness"]["vertex_weights"], serde_json::json!([1.0, 0.0]));
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

/// A file that `lpv design` wrote without a design says why, and how it ended counts.
#[test]
fn an_answer_without_a_design_is_told_as_such() {
    let infeasible = edited(DOUBLE_INTEGRATOR, "A = [[0, 1], [0, 0]]", "A = [[1, 0], [0, -1]]");
    let open = "[model]\nA = [[1, 1e-300], [0, -1]]\nB = [[0], [1]]\n[design]\nmethod = \"stabilize\"\n";
    let undetectable = "[model]\nA = [[0, 0], [0, -1]]\nB = [[1], [1]]\n[weights]\nQ_diag = [0, 1]\nR = [[1]]\n[design]\nmethod = \"lpvqr\"\n";
    for (text, code, status, reason) in [
        (&*infeasible, 3, "infeasible", "no input moves x1"),
        (undetectable, 3, "unbounded", "costs nothing"),
        (open, 4, "inaccurate", "stopped short"),
    ] {
        let place = Place::with(text);
        assert_eq!(place.lpv("design scenario.toml -o design.json").code, code);
        let ended = place.lpv("certify design.json --record design.jsonl");
        ended.refuses(code, &["design.json", "holds no design", &format!("\"{status}\""), reason]);
        assert_eq!(place.list("."), ["design.json", "scenario.toml"], "nothing is recorded");
        // an edited file is no better off, and a message is one line
        let mut answer = place.json("design.json");
        answer["verdict_reason"] = "a\nb".into();
        place.write("design.json", answer.to_string());
        place.lpv("certify design.json").refuses(code, &["a b"]);
        answer["status"] = "solved".into();
        place.write("design.json", answer.to_string());
        place.lpv("certify design.json").refuses(2, &["is missing: without it there is nothing to certify"]);
    }
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
    // a cubic P on three points fits them and nothing between
    Place::with(edited(COMMUTATOR, "grid_points = 10", "grid_points = 3"))
        .lpv("design scenario.toml")
        .refuses(4, &["grid points"]);
    Place::with(edited(COMMUTATOR, "range = [-1, 1]", "range = [1, -1]"))
        .lpv("design scenario.toml")
        .refuses(2, &["model.range", "ascend"]);
}

/// A case file of others' trackers, answered.
fn case(file: &str) -> (Place, String) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases/public").join(file);
    let text = std::fs::read_to_string(path).unwrap();
    (Place::with(&text), text)
}

/// K of the case, its inequalities verified, and the file proved.
fn regulator(file: &str, expected: &[f64]) {
    let (place, _) = case(file);
    let answer = parsed(&place.succeed("design scenario.toml --json"));
    assert_eq!((&answer["status"], &answer["verdict"]), (&"solved".into(), &"proved".into()), "{file}");
    assert!(answer["residuals"].as_object().unwrap().values().all(|margin| margin.as_f64().unwrap() > 0.0), "{answer}");
    for (j, expected) in expected.iter().enumerate() {
        let found = answer["K"][0][0][j].as_f64().unwrap();
        assert!((found / expected - 1.0).abs() < 1e-9, "{file}: {found} {expected}");
    }
    place.succeed("design scenario.toml -o design.json");
    let certificate = parsed(&place.succeed("certify design.json --json"));
    assert_eq!(certificate["verdict"], "proved", "{file}: {certificate}");
}

#[test]
fn regulators_that_the_solver_does_not_reach() {
    regulator("detectable-q.toml", &[2.0_f64.sqrt() - 1.0, 1.3243932834975, 0.91017972112445]);
    regulator("weights-1e15.toml", &[31622786.411685, 31622777.601684]);
    regulator("weights-1e-15.toml", &[19.62, 6.2641839053]);
    regulator("stabilisable.toml", &[]);
}

/// Yaw costs nothing, and it stays where it is.
#[test]
fn a_motion_that_costs_nothing_is_named() {
    let (place, text) = case("undetectable-yaw.toml");
    place
        .lpv("design scenario.toml")
        .refuses(3, &["unbounded", "the motion x4 does not decay", "(λ = 0)", "weight in Q"]);
    // with a weight there is a regulator
    let start = text.find("Q = [").unwrap();
    let (before, after) = (&text[..start], &text[start..]);
    let (_, rest) = after.split_once("R = ").unwrap();
    let weighed = format!("{before}Q_diag = [10, 10, 10, 1, 0, 0, 0, 0, 0, 0, 0, 0]\nR = {rest}");
    let answer = parsed(&Place::with(&weighed).succeed("design scenario.toml --json"));
    assert_eq!(answer["status"], "solved");
}

/// A coupling of 10⁻³⁰⁰ stabilises, to the letter: that there is no solution is not said.
#[test]
fn what_is_stabilisable_is_not_refuted() {
    for method in ["lqr", "stabilize"] {
        let weights = if method == "lqr" { "[weights]\nQ_diag = [1, 1]\nR_diag = [1]\n" } else { "" };
        let text =
            format!("[model]\nA = [[1, 1e-300], [0, -1]]\nB = [[0], [1]]\n{weights}[design]\nmethod = \"{method}\"\n");
        let ended = Place::with(&text).lpv("design scenario.toml --json");
        let answer: Value = serde_json::from_str(&ended.out).unwrap();
        assert_eq!((&answer["status"], &answer["verdict"]), (&"inaccurate".into(), &"undecided".into()), "{answer}");
    }
}
