//! Input that makes no sense: one clear message with file, key and what is allowed, the right exit code, nothing written.

use crate::program::{DOUBLE_INTEGRATOR, Place, QUADROTOR, edited};
use serde_json::{Value, json};
use std::fs;

/// `lpv run` refuses the scenario `text` with `code` and `words`, and leaves nothing behind.
#[track_caller]
fn refused(text: impl AsRef<[u8]>, code: i32, words: &[&str]) {
    let place = Place::with(text);
    let before = place.files();
    let ended = place.lpv("run scenario.toml --out result");
    ended.refuses(code, words);
    assert_eq!(ended.out, "");
    assert_eq!(place.list("."), ["scenario.toml"], "nothing is written");
    assert!(place.files() == before);
}

/// Each edit of the double integrator's scenario is bad input; the message names file, key and what is allowed.
#[track_caller]
fn each_refused(edits: &[(&str, &str, &[&str])]) {
    for (from, to, words) in edits {
        let words: Vec<&str> = words.iter().copied().chain(["scenario.toml"]).collect();
        refused(edited(DOUBLE_INTEGRATOR, from, to), 2, &words);
    }
}

const PLANT: &str = "name = \"double-integrator\"";
const LPVQR: &str = "method = \"lpvqr\"";
const SLPVQR: &str = "method = \"slpvqr\"\ngamma = 2";
const STEP: &str = "time_s = 0.5\nx_1 = 0.5";

/// Nested sets and the governor: what they need, and what they allow.
#[test]
fn supervision() {
    let with = |keys: &str| format!("{SLPVQR}\n{keys}");
    let governed = |options: &str| with(&format!("governor = {{ {options} }}"));
    let lpvqr = format!("{LPVQR}\nnested = [1]");
    let cases: [(String, &[&str]); 13] = [
        (with("nested = [3]"), &["controller[2].nested[1]", "is 3", "between 0 and gamma = 2"]),
        (with("nested = [-1]"), &["controller[2].nested[1]", "is -1"]),
        (with("nested = [1, 1]"), &["controller[2].nested[2]", "keep one"]),
        (with("nested = []"), &["controller[2].nested", "has 0 levels", "1 to 8"]),
        (governed("levl = 0.5"), &["unknown key `levl`", "`level`"]),
        (governed("reference = \"fast\""), &["`moving` or `static`"]),
        (governed("level = 1.5"), &["controller[2].governor.level", "is 1.5", "above 0 and below 1"]),
        (governed("feedforward = 0"), &["controller[2].governor.feedforward", "is 0", "above 0 and below 1"]),
        (
            governed("reference = \"static\", feedforward = 0.5"),
            &["controller[2].governor.feedforward", "moving references only"],
        ),
        (governed("bounds = { x_2 = 0 }"), &["controller[2].governor.bounds.x_2", "positive"]),
        (governed("bounds = { x_1 = 1 }"), &["controller[2].governor.bounds.x_1", "set points move"]),
        (governed("bounds = { x_3 = 1 }"), &["controller[2].governor.bounds.x_3", "allowed are x_1, x_2"]),
        (format!("{SLPVQR}\nlimits = {{}}\ngovernor = {{}}"), &["controller[2].limits", "a limit on every input"]),
    ];
    for (to, words) in &cases {
        each_refused(&[(SLPVQR, to, words)]);
    }
    each_refused(&[(LPVQR, &lpvqr, &["controller[1].nested", "needs a certified set"])]);
    let moved = edited(DOUBLE_INTEGRATOR, STEP, "time_s = 0.5\nx_2 = 0.5");
    let words = ["scenario.toml", "controller[2].governor", "set point 1 moves x_2", "a governor moves x_1"];
    refused(edited(&moved, SLPVQR, &governed("")), 2, &words);
    let frozen = edited(QUADROTOR, "name = \"saturated\"\n", "name = \"saturated\"\ngovernor = {}\n");
    refused(frozen, 2, &["governor", "needs rate_bound", "psi"]);
}

#[test]
fn misspelt_keys() {
    each_refused(&[
        ("name = \"cart\"", "nmae = \"cart\"", &["line 1", "unknown key `nmae`", "`name`"]),
        ("[limits]", "[limit]", &["unknown key `limit`", "`limits`"]),
        ("Q_diag", "Qdiag", &["unknown key `Qdiag`", "`Q_diag`"]),
        ("sample_time_s", "sample_time", &["unknown key `sample_time`", "`sample_time_s`"]),
        (PLANT, "name = \"double-integrator\"\nmass = 1", &["plant.mass", "no parameters"]),
        (LPVQR, "method = \"lpvqr\"\ngama = 2", &["unknown key `gama`", "`gamma`"]),
        (
            SLPVQR,
            "method = \"high-gain-slpvqr\"\ngamma = 2\nhigh_gain = { recover = 0.1 }",
            &["unknown key `recover`", "`recovery` or `gain_margin`"],
        ),
        ("measurement_diag", "measurements_diag", &["unknown key `measurements_diag`"]),
        (STEP, "time = 0.5\nx_1 = 0.5", &["set_point[1].time", "allowed are x_1, x_2"]),
    ]);
    let text = edited(QUADROTOR, "name = \"quadrotor\"", "name = \"quadrotor\"\nmas_kg = 2.0");
    refused(text, 2, &["scenario.toml", "plant", "unknown key `mas_kg`", "`mass_kg`"]);
}

#[test]
fn wrong_types() {
    each_refused(&[
        ("name = \"cart\"", "name = 3", &["name = 3", "expected a string"]),
        ("[1, 1]", "\"x\"", &["Q_diag", "expected a list"]),
        ("[1, 1]", "[1, \"x\"]", &["Q_diag", "expected a number"]),
        ("[plant]\nname = ", "plant = ", &["plant", "expected a table"]),
        (PLANT, "name = 1", &["plant.name", "integer", "\"double-integrator\""]),
        (PLANT, "name = \"cart\"", &["plant.name", "\"double-integrator\""]),
        (PLANT, "", &["plant.name", "is missing", "\"double-integrator\""]),
        ("duration_s = 3.0", "duration_s = \"3\"", &["duration_s", "expected a number"]),
        ("duration_s = 3.0\n", "", &["missing key `duration_s`"]),
        ("seed = 7", "seed = -1", &["seed", "a whole number, zero or more"]),
        ("seed = 7", "seed = 1.5", &["seed", "a whole number, zero or more"]),
        ("min = -1.0", "min = \"x\"", &["min", "expected a number for all inputs, or a list"]),
        ("[[set_point]]", "[set_point]", &["set_point", "expected a list"]),
        (LPVQR, "method = \"lqr\"", &["method", "unknown value `lqr`", "`lpvqr`, `slpvqr`"]),
        (LPVQR, "", &["missing key `method`"]),
        (LPVQR, "method = \"lpvqr\"\nschedule = \"x\"", &["`grid` or `vertices`"]),
        (LPVQR, "method = \"lpvqr\"\nrequire = \"sure\"", &["`numerical`, `proved`"]),
        ("estimator = \"ekf\"", "estimator = \"ukf\"", &["estimator", "expected `ekf`"]),
    ]);
    let text = edited(QUADROTOR, "name = \"quadrotor\"", "name = \"quadrotor\"\nmass_kg = \"2\"");
    refused(text, 2, &["scenario.toml", "plant", "mass_kg", "expected a number"]);
    let text = edited(QUADROTOR, "name = \"quadrotor\"", "name = \"quadrotor\"\nmass_kg = -2.0");
    refused(text, 2, &["scenario.toml", "plant", "mass_kg is -2", "positive"]);
}

#[test]
fn files_that_are_no_scenario() {
    refused("", 2, &["scenario.toml", "missing key `name`"]);
    refused("name = ", 2, &["scenario.toml", "line 1, column 8"]);
    refused("{\"name\": \"cart\"}", 2, &["scenario.toml", "line 1"]);
    refused(b"name = \"\xff\xfe\"", 2, &["scenario.toml", "byte 9 is not UTF-8"]);
    refused(vec![0; 5000], 2, &["scenario.toml", "line 1"]);
    refused(format!("x = {}", "[".repeat(100_000)), 2, &["scenario.toml", "line 1"]);
    refused(format!("[{}a]", "a.".repeat(50_000)), 2, &["scenario.toml"]);
    refused(format!("{DOUBLE_INTEGRATOR}\n[plant]\n"), 2, &["scenario.toml", "duplicate key"]);

    let place = Place::with("");
    place.lpv("run absent.toml").refuses(2, &["absent.toml", "cannot be read", "No such file"]);
    place.lpv("run .").refuses(2, &["cannot be read", "directory"]);
    place.lpv("simulate absent.toml").refuses(2, &["absent.toml"]);
    place.lpv("design absent.toml").refuses(2, &["absent.toml"]);
    place.lpv("certify absent.json").refuses(2, &["absent.json"]);
    assert_eq!(place.list("."), ["scenario.toml"]);
}

#[test]
fn what_editors_leave_in_a_file_is_no_error() {
    for text in [DOUBLE_INTEGRATOR.replace('\n', "\r\n"), format!("\u{feff}{DOUBLE_INTEGRATOR}")] {
        Place::with(text).succeed("design scenario.toml");
    }
}

#[test]
fn arguments() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    for arguments in ["", "fly", "run", "run scenario.toml --fast", "run scenario.toml other.toml", "certify"] {
        let ended = place.lpv(arguments);
        assert_eq!(ended.code, 2, "lpv {arguments}: {}", ended.err);
        assert!(ended.err.contains("Usage: lpv"), "{}", ended.err);
    }
    for arguments in ["--help", "--version", "run --help"] {
        place.succeed(arguments);
    }
    assert_eq!(place.list("."), ["scenario.toml"]);
}

#[test]
fn matrices() {
    each_refused(&[
        ("Q_diag = [1, 1]", "Q = [[1, 0], [0]]", &["weights.Q", "2 rows with 2, 1", "2 × 2"]),
        ("Q_diag = [1, 1]", "Q = [[1, 0]]", &["weights.Q", "1 rows with 2", "2 × 2"]),
        ("Q_diag = [1, 1]", "Q = []", &["weights.Q", "no rows", "2 × 2"]),
        ("Q_diag = [1, 1]", "Q_diag = [1, 1, 1]", &["weights.Q_diag", "3 numbers", "needs 2"]),
        ("Q_diag = [1, 1]", "Q_diag = [1, 1]\nQ = [[1, 0], [0, 1]]", &["weights.Q", "keep one"]),
        ("Q_diag = [1, 1]\n", "", &["weights.Q", "is missing", "2 rows of 2 numbers", "Q_diag"]),
        ("Q_diag = [1, 1]", "Q = [[1, 0.5], [0.4, 1]]", &["weights.Q", "not symmetric"]),
        ("Q_diag = [1, 1]", "Q = [[1, 2], [2, 1]]", &["weights.Q", "not positive definite", "above zero"]),
        ("Q_diag = [1, 1]", "Q = [[1, 1], [1, 1]]", &["weights.Q", "not positive definite", "above zero"]),
        ("Q_diag = [1, 1]", "Q_diag = [1, 0]", &["weights.Q_diag", "not positive definite", "above zero"]),
        ("Q_diag = [1, 1]", "Q_diag = [1, nan]", &["weights.Q_diag", "not finite"]),
        ("Q_diag = [1, 1]", "Q_diag = [1, inf]", &["weights.Q_diag", "not finite"]),
        ("Q_diag = [1, 1]", "Q_diag = [1, 1e-320]", &["weights.Q_diag", "too small", "scale it up"]),
        ("R_diag = [0.1]", "R_diag = [-0.1]", &["weights.R_diag", "not positive definite", "-1.000000e-1"]),
        ("R_diag = [0.1]", "R = [[0.1, 0], [0, 0.1]]", &["weights.R", "1 × 1"]),
        ("process_diag = [1e-6]", "process_diag = [-1e-6]", &["noise.process_diag", "semidefinite"]),
        ("process_diag = [1e-6]", "process_diag = [nan]", &["noise.process_diag", "not finite"]),
        ("process_diag = [1e-6]\n", "", &["noise.process", "is missing"]),
        ("measurement_diag = [1e-4]", "measurement_diag = [0]", &["noise.measurement_diag", "definite"]),
        ("measurement_diag = [1e-4]", "measurement_diag = [1, 1]", &["noise.measurement_diag", "needs 1"]),
    ]);
}

#[test]
fn linear_plants() {
    for (matrices, words) in [
        ("A = [[0, 1]]\nB = [[0], [1]]", ["A is 1 × 2", "square"]),
        ("A = []\nB = []", ["A is 0 × 0", "at least one row"]),
        ("A = [[0, 1], [0, 0]]\nB = [[1]]", ["B is 1 × 1", "2 × m"]),
        ("A = [[0, 1], [0, 0]]\nB = [[], []]", ["B is 2 × 0", "2 × m"]),
        ("A = [[0, 1], [0, 0]]\nB = [[0], [1]]\nC = [[1]]", ["C is 1 × 1", "p × 2"]),
        ("A = [[0, nan], [0, 0]]\nB = [[0], [1]]", ["A has an entry", "not finite"]),
        ("A = [[0, 1], [0, 0]]", ["missing key `B`", "plant"]),
        ("A = [[1, 0], [0, -1]]\nB = [[0], [1]]", ["not stabilisable: no input moves x_1,", "λ = 1)"]),
        ("A = [[0, 1], [0, 0]]\nB = [[1], [0]]", ["not stabilisable: no input moves x_2,", "λ = 0)"]),
    ] {
        let text = edited(DOUBLE_INTEGRATOR, PLANT, &format!("name = \"linear\"\n{matrices}"));
        refused(text, 2, &[words[0], words[1], "scenario.toml: plant: "]);
    }
}

#[test]
fn limits() {
    each_refused(&[
        ("min = -1.0", "min = 0.0", &["limits.min", "0.0 for u", "exclude the operating input 0"]),
        ("max = 1.0", "max = -0.5", &["limits.max", "-0.5 for u", "exclude the operating input 0"]),
        ("max = 1.0", "max = nan", &["limits.max", "strictly between min and max"]),
        ("min = -1.0", "min = inf", &["limits.min", "strictly between min and max"]),
        ("max = 1.0", "max = [1.0, 1.0]", &["limits.max", "2 numbers", "1 inputs"]),
        ("min = -1.0\nmax = 1.0", "min = -1e300\nmax = 1e300", &["controller[2].gamma", "limit²/γ"]),
        ("min = -1.0\nmax = 1.0", "", &["controller[2].limits", "a limit on every input"]),
        (
            SLPVQR,
            "method = \"slpvqr\"\ngamma = 2\nunlimited = true",
            &["controller[2].limits", "a limit on every input"],
        ),
        (LPVQR, "method = \"lpvqr\"\nlimits = { min = 1 }", &["controller[1].limits.min", "operating input"]),
        (
            LPVQR,
            "method = \"lpvqr\"\nunlimited = true\nlimits = { min = -1 }",
            &["controller[1].unlimited", "keep one"],
        ),
    ]);
    for (from, to, key) in [
        ("min = 0.0", "min = 5.0", "limits.min"),
        ("min = 0.0", "min = 4.9035", "limits.min"),
        ("max = 9.807", "max = 4.0", "limits.max"),
        ("max = 9.807", "max = [9.8, 9.8, 4.9, 9.8]", "limits.max"),
    ] {
        refused(edited(QUADROTOR, from, to), 2, &["scenario.toml", key, "exclude the operating input 4.9035 N"]);
    }
}

#[test]
fn times_and_steps() {
    each_refused(&[
        ("duration_s = 3.0", "duration_s = -3.0", &["simulation.duration_s", "positive"]),
        ("duration_s = 3.0", "duration_s = inf", &["simulation.duration_s", "positive, finite"]),
        ("duration_s = 3.0", "duration_s = 0.001", &["simulation.duration_s", "sample_time_s = 0.01"]),
        ("duration_s = 3.0", "duration_s = 1e9", &["simulation.duration_s", "GB", "allowed are 0.8 GB"]),
        ("duration_s = 3.0", "duration_s = 1e300", &["simulation.duration_s", "GB"]),
        ("sample_time_s = 0.01", "sample_time_s = 0", &["simulation.sample_time_s", "positive"]),
        ("sample_time_s = 0.01", "sample_time_s = -0.01", &["simulation.sample_time_s", "positive"]),
        ("sample_time_s = 0.01", "sample_time_s = nan", &["simulation.sample_time_s", "positive"]),
        ("sample_time_s = 0.01", "sample_time_s = 1e-300", &["simulation.duration_s", "sample slower"]),
        ("record_interval_s = 0.05", "record_interval_s = inf", &["simulation.record_interval_s", "finite"]),
        ("record_interval_s = 0.05", "record_interval_s = nan", &["simulation.record_interval_s", "finite"]),
        ("record_interval_s = 0.05", "record_interval_s = -1", &["simulation.record_interval_s", "sample_time_s"]),
        ("seed = 7", "steps_per_sample = 0", &["simulation.steps_per_sample", "1 to 1000"]),
        ("seed = 7", "steps_per_sample = 1001", &["simulation.steps_per_sample", "1 to 1000"]),
        ("seed = 7", "steps_per_sample = -1", &["steps_per_sample", "a whole number"]),
    ]);
    for points in ["3", "0", "5000"] {
        let text = edited(QUADROTOR, "grid_points = 4", &format!("grid_points = {points}"));
        refused(text, 2, &["scenario.toml", "model.grid_points", "4 to 4096"]);
    }
}

#[test]
fn set_points_and_initial_states() {
    each_refused(&[
        (STEP, "time_s = 0.5\nx_3 = 0.5", &["set_point[1].x_3", "allowed are x_1, x_2"]),
        (STEP, "time_s = 0.5\nx_1_deg = 5", &["set_point[1].x_1_deg", "allowed are x_1, x_2"]),
        (STEP, "x_1 = 0.5", &["set_point[1].time_s", "is missing", "in seconds"]),
        (STEP, "time_s = 3.0\nx_1 = 0.5", &["set_point[1].time_s", "from 0 to below 3 s"]),
        (STEP, "time_s = -0.1\nx_1 = 0.5", &["set_point[1].time_s", "from 0 to below 3 s"]),
        (STEP, "time_s = nan\nx_1 = 0.5", &["set_point[1].time_s", "from 0 to below 3 s"]),
        (STEP, "time_s = \"0\"\nx_1 = 0.5", &["set_point[1].time_s", "of type string", "seconds"]),
        (STEP, "time_s = 0.5\nlabel = 1\nx_1 = 0.5", &["set_point[1].label", "a string"]),
        (STEP, "time_s = 0.5\nx_1 = true", &["set_point[1].x_1", "of type boolean", "a number"]),
        (STEP, "time_s = 0.5\nx_1 = nan", &["set_point[1].x_1", "finite"]),
        (STEP, "time_s = 0.5\nx_1 = 1e300", &["set_point[1].x_1", "between -1000000 and 1000000 m"]),
        (STEP, "time_s = 0.5", &["set_point[1]", "moves no state", "x_1 = 1.0"]),
        (
            STEP,
            "time_s = 0.5\nx_1 = 1\n[[set_point]]\ntime_s = 0.5\nx_2 = 1",
            &["set_point", "time_s = 0.5", "join them"],
        ),
        ("seed = 7", "initial_state = { v = 1 }", &["simulation.initial_state.v", "allowed are x_1, x_2"]),
        ("seed = 7", "initial_state = { x_1 = \"0\" }", &["simulation.initial_state.x_1", "a number"]),
        ("seed = 7", "initial_state = { x_1 = -inf }", &["simulation.initial_state.x_1", "finite"]),
        ("seed = 7", "initial_state = { x_1 = -1e7 }", &["simulation.initial_state.x_1", "-1000000"]),
    ]);
    for (from, to, words) in [
        ("psi_deg = 20", "r_x_deg = 20", ["set_point[1].r_x_deg", "psi, psi_deg"]),
        ("psi_deg = 20", "psi = 1\npsi_deg = 20", ["set_point[1].psi", "keep one"]),
        ("psi_deg = 20", "phi_deg = 90", ["set_point[1].phi_deg", "between -1.570796 and 1.570796 rad"]),
        ("seed = 1", "initial_state = { theta_deg = -100 }", ["simulation.initial_state.theta_deg", "1.570796 rad"]),
        ("seed = 1", "initial_state = { psi = 1, psi_deg = 1 }", ["simulation.initial_state.psi", "keep one"]),
    ] {
        refused(edited(QUADROTOR, from, to), 2, &[words[0], words[1], "scenario.toml"]);
    }
}

#[test]
fn controllers() {
    each_refused(&[
        (LPVQR, "method = \"lpvqr\"\ngamma = 2", &["controller[1].gamma", "knows no γ"]),
        (SLPVQR, "method = \"slpvqr\"", &["controller[2].gamma", "is missing", "γ > 0"]),
        (SLPVQR, "method = \"slpvqr\"\ngamma = -2", &["controller[2].gamma", "positive"]),
        (SLPVQR, "method = \"slpvqr\"\ngamma = 0", &["controller[2].gamma", "positive"]),
        (SLPVQR, "method = \"slpvqr\"\ngamma = nan", &["controller[2].gamma", "positive"]),
        (LPVQR, "method = \"lpvqr\"\nhigh_gain = {}", &["controller[1].high_gain", "\"high-gain-slpvqr\" only"]),
        (
            SLPVQR,
            "method = \"high-gain-slpvqr\"\ngamma = 2\nhigh_gain = { recovery = -0.1 }",
            &["controller[2].high_gain.recovery", "zero or more"],
        ),
        (
            SLPVQR,
            "method = \"high-gain-slpvqr\"\ngamma = 2\nhigh_gain = { gain_margin = 0.5 }",
            &["controller[2].high_gain.gain_margin", "at least 1"],
        ),
        (LPVQR, "method = \"lpvqr\"\nrate_bound = 1", &["controller[1].rate_bound", "no scheduling parameter"]),
        (LPVQR, "method = \"lpvqr\"\nregion = { x_1 = 1 }", &["controller[1].region", "rate_bound only"]),
        (LPVQR, "method = \"lpvqr\"\nlyapunov_order = 2", &["controller[1].lyapunov_order", "rate_bound only"]),
        (LPVQR, "method = \"lpvqr\"\nestimator = \"ekf\"", &["controller[1].estimator", "noise = true"]),
        ("name = \"saturated\"", "name = \"regulator\"", &["controller[2].name", "already taken"]),
        ("name = \"saturated\"", "name = \"Regulator\"", &["controller[2].name", "already taken"]),
        ("name = \"saturated\"", "name = \"../../x\"", &["controller[2].name", "letters, digits, - and _"]),
        ("name = \"saturated\"", "name = \"a/b\"", &["controller[2].name", "letters, digits, - and _"]),
        ("name = \"saturated\"", "name = \"\"", &["controller[2].name", "letters, digits, - and _"]),
        ("label = \"High gain, γ = 2\"", "label = \"a\\nb\"", &["controller[3].label", "line break"]),
        ("name = \"cart\"", "name = \"../cart\"", &["name", "letters, digits, - and _"]),
        ("name = \"cart\"", "name = \"..\"", &["name", "letters, digits, - and _"]),
    ]);
    let long = edited(DOUBLE_INTEGRATOR, "name = \"cart\"", &format!("name = \"{}\"", "x".repeat(300)));
    refused(long, 2, &["scenario.toml", "name", "1 to 100"]);
    let (none, _) = DOUBLE_INTEGRATOR.split_once("[[controller]]").unwrap();
    refused(none, 2, &["scenario.toml", "controller", "at least one [[controller]]"]);
    let quiet = edited(DOUBLE_INTEGRATOR, "[noise]\nprocess_diag = [1e-6]\nmeasurement_diag = [1e-4]\n", "");
    refused(quiet, 2, &["scenario.toml", "controller[4].noise", "no [noise] table"]);
}

#[test]
fn designs_for_a_moving_parameter() {
    let method = "method = \"lpvqr\"\nschedule = \"vertices\"";
    for (keys, words) in [
        ("rate_bound = -1", ["controller[1].rate_bound", "zero or more"]),
        ("rate_bound = inf", ["controller[1].rate_bound", "psi"]),
        ("rate_bound = 1\nlyapunov_order = 0", ["controller[1].lyapunov_order", "1 to 8"]),
        ("rate_bound = 1\nlyapunov_order = 9", ["controller[1].lyapunov_order", "1 to 8"]),
        ("rate_bound = 1\nregion = { r_q = 1 }", ["controller[1].region.r_q", "not a state"]),
        ("rate_bound = 1\nregion = { r_x = 0 }", ["controller[1].region", "no direction"]),
        ("rate_bound = 1\nregion = {}", ["controller[1].region", "no direction"]),
    ] {
        refused(edited(QUADROTOR, method, &format!("{method}\n{keys}")), 2, &[words[0], words[1], "scenario.toml"]);
    }
}

/// 2^m inequalities of a plant with many inputs would fill any memory.
#[test]
fn high_gain_of_many_inputs() {
    let row = vec!["1"; 40].join(", ");
    let plant = format!("name = \"linear\"\nA = [[0, 1], [0, 0]]\nB = [[{row}], [{row}]]");
    let text = edited(DOUBLE_INTEGRATOR, PLANT, &plant);
    let text = edited(&text, "R_diag = [0.1]", &format!("R_diag = [{row}]"));
    let text = edited(&text, "process_diag = [1e-6]", &format!("process_diag = [{row}]"));
    let text = edited(&text, "measurement_diag = [1e-4]", "measurement_diag = [1, 1]");
    refused(text, 2, &["scenario.toml", "controller[3].method", "up to 10 inputs", "\"slpvqr\""]);
}

/// [`DOUBLE_INTEGRATOR`] with its high gains alone, sampled too slowly for any of them.
fn too_slow() -> String {
    let text = edited(DOUBLE_INTEGRATOR, "sample_time_s = 0.01\nrecord_interval_s = 0.05\n", "sample_time_s = 1.5\n");
    let (head, controllers) = text.split_once("[[controller]]").unwrap();
    let (_, high_gains) = controllers.split_once("[[controller]]\nname = \"high-gain\"").unwrap();
    format!("{head}[[controller]]\nname = \"high-gain\"{high_gains}")
}

/// What cannot be reached is no bad input: exit code 3, and what to change.
#[test]
fn infeasible_problems() {
    let text = too_slow();
    refused(text, 3, &["controller \"high-gain\"", "sample time of 1.5 s", "sample faster"]);
}

/// A place that cannot be written is told at once; what stands in the way stays.
#[test]
fn output_folders() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("design scenario.toml --out designs");
    place.write("file", "mine");
    fs::create_dir(place.path("folder")).unwrap();
    place.write("folder/thesis.md", "mine");
    let before = place.files();
    for command in ["run scenario.toml", "design scenario.toml", "simulate scenario.toml --designs designs"] {
        for force in ["", " --force"] {
            for (out, words) in [
                ("file/result", ["file/result", "cannot be written"]),
                ("file", ["file", "is a file"]),
                ("folder", ["folder", "thesis.md"]),
                (".", [".", "is not a folder name"]),
                ("..", ["..", "is not a folder name"]),
            ] {
                let ended = place.lpv(&format!("{command} --out {out}{force}"));
                ended.refuses(2, &[words[0], words[1]]);
                assert!(place.files() == before, "{command} --out {out}{force}");
            }
        }
        place.lpv(&format!("{command} --out designs")).refuses(2, &["designs", "--force", "--out"]);
    }
    assert_eq!(place.list("."), ["designs", "file", "folder", "scenario.toml"]);
    assert!(place.files() == before);
}

/// A run that fails leaves an earlier result as it was, byte by byte, even with --force.
#[test]
fn failed_runs_keep_the_earlier_result() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("run scenario.toml");
    for (text, code) in [
        (edited(DOUBLE_INTEGRATOR, "gamma = 2\nnoise", "gamma = -2\nnoise"), 2),
        (edited(DOUBLE_INTEGRATOR, "record_interval_s = 0.05", "seed_ = 1"), 2),
        (too_slow(), 3),
    ] {
        place.write("scenario.toml", text);
        let before = place.files();
        let ended = place.lpv("run scenario.toml --force");
        ended.refuses(code, &[]);
        assert!(place.files() == before);
        assert_eq!(place.list("out"), ["cart"]);
    }
}

#[test]
fn damaged_designs() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("design scenario.toml --out designs");
    let file = "designs/design-regulator.json";
    let whole = place.read(file);
    let design = place.json(file);
    let with = |pointer: &str, value: Value| {
        let mut edited = design.clone();
        *edited.pointer_mut(pointer).unwrap() = value;
        edited.to_string()
    };
    let without = |key: &str| {
        let mut edited = design.clone();
        edited.as_object_mut().unwrap().remove(key);
        edited.to_string()
    };
    let schedule = "/controller/schedule/gain";
    let cases: Vec<(String, &[&str])> = vec![
        (String::new(), &["is not a design", "line 1"]),
        ("[]".into(), &["is not a design"]),
        ("[".repeat(100_000), &["is not a design"]),
        (whole[..whole.len() / 2].into(), &["is not a design", "EOF"]),
        (without("points"), &["missing key `points`"]),
        (with("/method/method", json!("lqr")), &["unknown value `lqr`"]),
        (with("/plant/name", json!("cart")), &["unknown value `cart`"]),
        (with("/points", json!([])), &["points has 0 entries", "at least 4, or 1"]),
        (with("/points/0/gain", json!([[1.0]])), &["points[0].gain is 1 × 1", "1 × 2"]),
        (with("/points/0/p", json!([[1.0, 2.0]])), &["points[0].p is 1 × 2", "2 × 2"]),
        (with("/points/0/p", json!([[1.0, 2.0], [3.0]])), &["row 2 of the matrix has 1 entries"]),
        (with("/points/0/p/0/0", json!(null)), &["expected a number"]),
        (with("/points/0/p/0/0", json!("x")), &["expected a number"]),
        (with("/weights/r", json!([[1.0, 0.0], [0.0, 1.0]])), &["weights.r is 2 × 2", "1 × 1"]),
        (with(schedule, json!([[1.0], [2.0]])), &["schedule.gain is 2 × 1", "1 × 2"]),
        (with("/controller/operating_input", json!([])), &["controller.operating_input", "where the plant rests"]),
        (with("/controller/limits/min", json!([])), &["controller.limits", "1 numbers or nulls"]),
        (with("/controller/scheduling_state", json!(9)), &["controller.scheduling_state"]),
        (with("/sample_time_s", json!(0.0)), &["sample_time_s", "positive"]),
        (with("/name", json!("\u{1b}[31mred")), &["name", "control character"]),
        (whole.replace("0.01", "1e999"), &["is not a design", "out of range"]),
    ];
    for (text, words) in cases {
        place.write(file, &text);
        let words: Vec<&str> = words.iter().copied().chain(["design-regulator.json"]).collect();
        for command in [format!("certify {file}"), "simulate scenario.toml --designs designs".into()] {
            let ended = place.lpv(&command);
            ended.refuses(2, &words);
            assert_eq!(ended.out, "");
        }
    }
    fs::write(place.path(file), b"\xff").unwrap();
    place.lpv(&format!("certify {file}")).refuses(2, &["design-regulator.json", "not UTF-8"]);
    assert_eq!(place.list("."), ["designs", "scenario.toml"]);
}

#[test]
fn plants_of_designs() {
    let place = Place::with(QUADROTOR);
    place.succeed("design scenario.toml --out designs");
    for (key, value) in [("mass_kg", -2.0), ("inertia_x_kg_m2", 0.0)] {
        let mut design = place.json("designs/design-regulator.json");
        design["plant"][key] = value.into();
        place.write("edited.json", design.to_string());
        place.lpv("certify edited.json").refuses(2, &["edited.json", key, "positive"]);
    }
}

/// Designs fly in the scenario that they were made for, and in no other.
#[test]
fn designs_of_another_scenario() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.lpv("simulate scenario.toml").refuses(2, &["design-regulator.json", "cannot be read"]);
    place.lpv("simulate scenario.toml --designs absent").refuses(2, &["absent", "cannot be read"]);
    place.succeed("design scenario.toml --out designs");
    let linear = "name = \"linear\"\nA = [[0, 1], [0, 0]]\nB = [[0], [1]]\nC = [[1, 0]]";
    for (from, to, key) in [
        (PLANT, linear, "plant"),
        ("sample_time_s = 0.01", "sample_time_s = 0.02", "sample_time_s"),
        ("max = 1.0", "max = 2.0", "controller.limits"),
        ("Q_diag = [1, 1]", "Q_diag = [1, 2]", "weights.q"),
        ("R_diag = [0.1]", "R_diag = [0.2]", "weights.r"),
        (SLPVQR, "method = \"slpvqr\"\ngamma = 3", "method"),
    ] {
        place.write("scenario.toml", edited(DOUBLE_INTEGRATOR, from, to));
        let words = [key, ".json", "differs from scenario.toml", "design again"];
        place.lpv("simulate scenario.toml --designs designs --out flights").refuses(2, &words);
        assert_eq!(place.list("."), ["designs", "scenario.toml"]);
    }
}
