//! From the transformation to the design in one file: problems whose model is a tensor-product model, proved for the LPV model that it stands for
//! and for the nonlinear plant; what is said where that is not so; and files that make no sense.

use crate::program::{Place, edited};
use lpv::math::Mat;
use lpv::math::matrix::from_rows;
use lpv::model::literature::LiteratureModel;
use lpv::model::tensor_product::TensorProductSchedule;
use serde_json::{Value, json};
use std::fs;

fn shipped(name: &str) -> String {
    fs::read_to_string(format!("{}/../../{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// A folder with a shipped problem and its model.
fn place(problem: &str, model: &str) -> Place {
    let place = Place::with(shipped(&format!("problems/{problem}.toml")).replace("../models/", ""));
    place.write(&format!("{model}.toml"), shipped(&format!("models/{model}.toml")));
    place
}

/// The claims of `lpv certify` about `design.json`, whatever it ends with.
fn claims(place: &Place) -> Value {
    serde_json::from_str(&place.lpv("certify design.json --json").out).unwrap()
}

fn verdict<'a>(certificate: &'a Value, id: &str) -> &'a Value {
    let claims = certificate["claims"].as_array().unwrap();
    &claims.iter().find(|claim| claim["id"] == id).unwrap_or_else(|| panic!("no claim {id}"))["verdict"]
}

/// A shipped problem, its model and what its name is in the library; the largest gain; a flight's start, how long it lasts, by when ‖x‖ stays
/// below 2 % of the start and what |u| stays below.
type Shipped = (&'static str, [&'static str; 2], f64, [f64; 4], [f64; 3]);

const SHIPPED: [Shipped; 9] = [
    ("tora", ["tora", "tora"], 5.3, [0.05, 0.0, 0.0, 0.0], [30.0, 23.9, 0.216]),
    ("tora-saturated", ["tora", "tora"], 10.8, [0.05, 0.0, 0.0, 0.0], [30.0, 18.6, 0.4]),
    ("tora-high-gain", ["tora", "tora"], 1.71, [0.05, 0.0, 0.0, 0.0], [60.0, 46.5, 0.0477]),
    ("nata", ["nata-narrow", "nata"], 21.3, [0.005, 0.02, 0.0, 0.0], [3.0, 1.56, 0.361]),
    ("nata-saturated", ["nata-narrow", "nata"], 14.8, [0.005, 0.02, 0.0, 0.0], [3.0, 1.7, 0.268]),
    ("nata-high-gain", ["nata-narrow", "nata"], 13.8, [0.005, 0.02, 0.0, 0.0], [3.0, 1.71, 0.2]),
    ("pendulum-cart", ["pendulum-cart-narrow", "pendulum-cart"], 727.0, [0.0, 0.08, 0.0, 0.0], [12.0, 7.4, 51.8]),
    (
        "pendulum-cart-saturated",
        ["pendulum-cart-narrow", "pendulum-cart"],
        1137.0,
        [0.0, 0.08, 0.0, 0.0],
        [12.0, 7.6, 86.1],
    ),
    (
        "pendulum-cart-high-gain",
        ["pendulum-cart-narrow", "pendulum-cart"],
        2616.0,
        [0.0, 0.08, 0.0, 0.0],
        [12.0, 7.2, 60.0],
    ),
];

/// Every shipped problem of a tensor-product model: every claim is proved, of the polytope, of the LPV model and of the nonlinear plant, with gains
/// that one can apply; and the nonlinear plant, in Runge–Kutta steps, settles as the table of docs/tensor_product.md says (U = 20 m/s).
#[test]
fn shipped_problems_are_proved_for_the_model_and_the_plant() {
    let mut slower = Vec::new();
    for (problem, [model, name], largest_gain, start, [duration_s, settled_s, peak]) in SHIPPED {
        let place = place(problem, model);
        place.succeed("design scenario.toml -o design.json");
        let design = place.json("design.json");
        assert_eq!((&design["status"], &design["verdict"]), (&json!("solved"), &json!("proved")), "{problem}");
        assert!(design["largest_gain"].as_f64().unwrap() <= largest_gain, "{problem}: {}", design["largest_gain"]);
        assert!(design["verdict_reason"].as_str().unwrap().contains("for the LPV model itself"));
        let certificate = claims(&place);
        assert_eq!(certificate["verdict"], "proved", "{problem}");
        for id in ["polytope.cost", "transformation-error", "cost", "states-in-range", "plant.invariance", "plant.cost"]
        {
            assert_eq!(verdict(&certificate, id), "proved", "{problem}: {id}");
        }
        let flown = fly(&design, name, start, duration_s);
        if flown[0] > settled_s || flown[1] > peak {
            slower.push(format!("{problem}: settles in {} s, |u| up to {}", flown[0], flown[1]));
        }
    }
    assert!(slower.is_empty(), "{slower:#?}");
}

/// When ‖x‖ falls below 2 % of the start for good, and the largest |u|.
fn fly(design: &Value, name: &str, start: [f64; 4], duration_s: f64) -> [f64; 2] {
    let schedule: TensorProductSchedule =
        serde_json::from_value(design["tensor_product"]["parameters"].clone()).unwrap();
    let gains: Vec<Vec<Vec<f64>>> = serde_json::from_value(design["K"].clone()).unwrap();
    let gains: Vec<Mat<f64>> = gains.iter().map(|rows| from_rows(rows)).collect();
    let sigma = design["sigma"][0].as_f64().unwrap_or(f64::INFINITY);
    let model = LiteratureModel::named(name).unwrap();
    let rho = |x: &[f64; 4]| model.parameter_states().iter().map(|i| i.map_or(20.0, |i| x[i])).collect::<Vec<f64>>();
    let input = |x: &[f64; 4]| {
        let k = schedule.combine(&gains, &rho(x));
        (0..4).map(|j| -k[(0, j)] * x[j]).sum::<f64>().clamp(-sigma, sigma)
    };
    let rate = |x: &[f64; 4]| {
        let (at, u) = (model.at(&rho(x)), input(x));
        [0, 1, 2, 3].map(|i| (0..4).map(|j| at[(i, j)] * x[j]).sum::<f64>() + at[(i, 4)] * u)
    };
    let moved = |x: &[f64; 4], k: &[f64; 4], h: f64| [0, 1, 2, 3].map(|i| x[i] + h * k[i]);
    let norm = |x: &[f64; 4]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (h, mut x, mut settled_s, mut peak) = (0.002, start, 0.0, 0.0_f64);
    for step in 0..(duration_s / h) as usize {
        peak = peak.max(input(&x).abs());
        let k1 = rate(&x);
        let k2 = rate(&moved(&x, &k1, 0.5 * h));
        let k3 = rate(&moved(&x, &k2, 0.5 * h));
        let k4 = rate(&moved(&x, &k3, h));
        let mean = [0, 1, 2, 3].map(|i| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0);
        x = moved(&x, &mean, h);
        if norm(&x) > 0.02 * norm(&start) {
            settled_s = (step + 1) as f64 * h;
        }
    }
    [settled_s, peak]
}

/// The TP Tool's design for TORA (its example, as in github.com/zggl/ATPPDC, TORAATPPDC/ToraSim_NoSimlink.m) asks for |u| ≤ 8 while |x| ≤ 1 and
/// for |x(t)| < c exp(−0.05 t); its gains are not printed. The gain here is a convex combination of the Kᵢ, so that |u| ≤ max ‖Kᵢ‖ |x|, and the
/// eigenvalues of the loop at rest, over the grid, say how it decays.
#[test]
fn tora_beside_the_design_of_the_tp_tool() {
    let place = place("tora", "tora");
    place.succeed("design scenario.toml -o design.json");
    let design = place.json("design.json");
    assert!(design["largest_gain"].as_f64().unwrap() < 8.0);
    let schedule: TensorProductSchedule =
        serde_json::from_value(design["tensor_product"]["parameters"].clone()).unwrap();
    let gains: Vec<Vec<Vec<f64>>> = serde_json::from_value(design["K"].clone()).unwrap();
    let gains: Vec<Mat<f64>> = gains.iter().map(|rows| from_rows(rows)).collect();
    let tora = LiteratureModel::named("tora").unwrap();
    let mut slowest = f64::NEG_INFINITY;
    for theta in &schedule.parameters[0].grid.points {
        for speed in &schedule.parameters[1].grid.points {
            let (at, k) = (tora.at(&[*theta, *speed]), schedule.combine(&gains, &[*theta, *speed]));
            let closed = Mat::from_fn(4, 4, |r, c| at[(r, c)] - at[(r, 4)] * k[(0, c)]);
            slowest = slowest.max(lpv::math::eigen::spectral_abscissa(&closed));
        }
    }
    println!("TORA: largest gain {}, slowest eigenvalue {slowest}", design["largest_gain"]);
    assert!(slowest < -0.05, "{slowest}");
}

/// What `lpv tp` writes is a model as good as its file; its vertices are the same numbers.
#[test]
fn the_json_of_lpv_tp_is_a_model() {
    let place = place("tora", "tora");
    place.succeed("design scenario.toml -o design.json");
    place.succeed("tp tora.toml -o tora.json");
    place.write("from-json.toml", place.read("scenario.toml").replace("tora.toml", "tora.json"));
    place.succeed("design from-json.toml -o from-json.json");
    let [one, other] = ["design.json", "from-json.json"].map(|name| place.json(name));
    for key in ["model", "model_hash", "tensor_product", "K", "P", "verdict"] {
        assert_eq!(one[key], other[key], "{key}");
    }
}

/// Samples say nothing of what lies between them: the polytope is proved, and the model is not.
#[test]
fn samples_are_proved_for_the_polytope_alone() {
    let samples: Vec<String> =
        (0..5).map(|k| format!("[[0.0, 1.0, 0.0], [{}, -0.1, 1.0]]", 0.25 * f64::from(k) - 0.5)).collect();
    let place = Place::with(
        "[model]\ntensor_product = \"samples.toml\"\n[weights]\nQ_diag = [1, 1]\nR = [[1]]\n[design]\nmethod = \"lpvqr\"\n",
    );
    place.write(
        "samples.toml",
        format!(
            "[model]\nsamples = [{}]\n[[parameter]]\nname = \"p\"\nrange = [0, 1]\ngrid_points = 5\n",
            samples.join(", ")
        ),
    );
    let ended = place.lpv("design scenario.toml -o design.json");
    ended.refuses(4, &["of the polytope of the vertices alone"]);
    let design = place.json("design.json");
    assert_eq!((&design["status"], &design["verdict"]), (&json!("solved"), &json!("undecided")));
    assert!(design["verdict_reason"].as_str().unwrap().contains("of the polytope of the vertices alone"));
    let ended = place.lpv("certify design.json --json");
    assert_eq!(ended.code, 4);
    let certificate: Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(
        (verdict(&certificate, "polytope.cost"), verdict(&certificate, "cost")),
        (&json!("proved"), &json!("undecided"))
    );
    let text = place.lpv("certify design.json").out;
    assert!(
        text.contains("the polytope: the cost is at most") && text.contains("known by its samples alone"),
        "{text}"
    );
}

/// Two singular values of a wide range of the pendulum: the error is too large for what was designed over the vertices.
#[test]
fn a_large_error_is_not_proved() {
    let place = place("pendulum-cart", "pendulum-cart-narrow");
    let model =
        place.read("pendulum-cart-narrow.toml").replace("0.5235987755982988", "1.4").replace("[3, 2]", "[1, 1]");
    place.write("pendulum-cart-narrow.toml", model);
    place.lpv("design scenario.toml -o design.json");
    let design = place.json("design.json");
    assert_ne!(design["verdict"], "proved", "{}", design["verdict_reason"]);
}

/// A design file that was changed: each claim is of what the file says now, and nothing false is proved.
#[test]
fn changed_design_files() {
    let place = place("tora", "tora");
    place.succeed("design scenario.toml -o made.json");
    let made = place.json("made.json");
    let certified = |design: &Value| {
        place.write("design.json", design.to_string());
        claims(&place)
    };
    // gains of opposite sign
    let mut design = made.clone();
    design["L"].take();
    for gain in design["K"].as_array_mut().unwrap() {
        for entry in gain[0].as_array_mut().unwrap() {
            *entry = json!(-entry.as_f64().unwrap());
        }
    }
    let changed = certified(&design);
    for id in ["decrease", "cost", "plant.invariance", "plant.cost", "polytope.decrease"] {
        assert_ne!(verdict(&changed, id), "proved", "{id}");
    }
    // another model: the coupling of TORA is 0.9
    let mut design = made.clone();
    design["tensor_product"]["source"]["literature"]["coupling"] = json!(0.9);
    let changed = certified(&design);
    assert_eq!(verdict(&changed, "polytope.cost"), "proved");
    assert_ne!(verdict(&changed, "cost"), "proved");
    // a vertex that was moved without its fingerprint, and with it
    let mut design = made.clone();
    design["model"]["A"][0][1][0] = json!(-3.0);
    place.write("design.json", design.to_string());
    place.lpv("certify design.json").refuses(2, &["design.json", "model_hash"]);
    design.as_object_mut().unwrap().remove("model_hash");
    let changed = certified(&design);
    assert_ne!(verdict(&changed, "polytope.cost"), "proved");
    assert_eq!(verdict(&changed, "cost"), "proved");
    assert_ne!(changed["verdict"], "proved");
    // weights that are not convex, that do not fit, of other parameters
    let refused = |change: &dyn Fn(&mut Value), words: &[&str]| {
        let mut design = made.clone();
        change(&mut design["tensor_product"]);
        place.write("design.json", design.to_string());
        let mut all = vec!["design.json", "tensor_product"];
        all.extend(words);
        place.lpv("certify design.json").refuses(2, &all);
    };
    refused(&|t| t["parameters"][0]["weights"][3][0] = json!(-0.2), &["theta", "grid point 4", "zero or more"]);
    refused(&|t| t["parameters"][1]["points"][1] = json!(7.0), &["theta_dot", "ascending"]);
    refused(&|t| drop(t["parameters"].as_array_mut().unwrap().pop()), &["5 vertices", "10"]);
    refused(&|t| t["parameters"][0]["name"] = json!("phi"), &["phi", "theta, theta_dot"]);
    refused(&|t| t["source"]["literature"] = json!({"name": "nata"}), &["U, alpha"]);
    refused(&|t| t["source"]["literature"]["coupling"] = json!(2.0), &["coupling", "between 0 and 1"]);
}

#[test]
fn problems_that_make_no_sense() {
    let place = place("tora", "tora");
    let problem = place.read("scenario.toml");
    let refused = |text: String, words: &[&str]| {
        place.write("scenario.toml", text);
        place.lpv("design scenario.toml").refuses(2, words);
    };
    let file = |name: &str| problem.replace("tora.toml", name);
    refused(
        file("missing.toml"),
        &["scenario.toml", "model.tensor_product", "missing.toml", "cannot be read", "lpv tp"],
    );
    refused(
        edited(&problem, "[weights]", "A = [[0]]\n\n[weights]"),
        &["scenario.toml", "model.A", "tensor_product", "keep one"],
    );
    refused(edited(&problem, "[weights]", "grid_points = 4\n\n[weights]"), &["scenario.toml", "model.grid_points"]);
    refused(format!("{problem}lyapunov = \"frozen\"\n"), &["scenario.toml", "design.lyapunov", "common"]);
    refused(
        format!("{problem}initial_state = [0.1, 0, 0.9, 0]\n"),
        &["scenario.toml", "design.initial_state[3]", "0.9", "theta", "range"],
    );
    refused(
        format!("{problem}initial_state = [0.1, 0, 0, 0]\ninitial_parameter = [0, 0]\n"),
        &["scenario.toml", "design.initial_parameter", "states", "theta, theta_dot", "remove it"],
    );
    let model = |text: String, words: &[&str]| {
        place.write("model.toml", text);
        refused(file("model.toml"), words);
    };
    let tora = place.read("tora.toml");
    model(tora.replace("name = \"tora\"", "name = \"tori\""), &["model.toml", "model.name", "tori", "tora"]);
    model(tora.replace("\"cno\"", "\"sn\""), &["model.toml", "transformation.weights", "negative", "cno"]);
    model(
        "[plant]\nname = \"quadrotor\"\n[weights]\nQ_diag = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\nR_diag = [1, 1, 1, 1]\n[transformation]\ntolerance = 1e-9\n".into(),
        &["model.toml", "weights", "[A B]"],
    );
    place.succeed("tp tora.toml -o tora.json");
    let made = place.json("tora.json");
    let json = |change: &dyn Fn(&mut Value), words: &[&str]| {
        let mut model = made.clone();
        change(&mut model);
        place.write("model.json", model.to_string());
        let mut all = vec!["model.json"];
        all.extend(words);
        refused(file("model.json"), &all);
    };
    json(&|m| m["format"] = json!("lpv tp 9"), &["format", "lpv tp 9", "lpv tp 1"]);
    json(&|m| drop(m.as_object_mut().unwrap().remove("format")), &["format", "missing", "lpv tp 1"]);
    json(&|m| drop(m.as_object_mut().unwrap().remove("vertices")), &["vertices"]);
    json(&|m| drop(m["vertices"].as_array_mut().unwrap().pop()), &["vertices", "9 matrices", "10"]);
    json(&|m| m["vertices"].as_array_mut().unwrap().swap(0, 1), &["vertices[1]", "[1, 1]"]);
    json(&|m| m["vertices"][2]["matrix"] = json!([[1.0]]), &["vertices[3]", "4 × 5"]);
    json(&|m| m["parameters"][0]["weights"][0][0] = json!(-1.0), &["parameters", "theta", "convex"]);
    json(&|m| m["lpv_model"]["literature"]["name"] = json!("tori"), &["tori"]);
    let truncated = place.read("tora.json");
    place.write("model.json", &truncated[..truncated.len() / 2]);
    refused(file("model.json"), &["model.json"]);
}
