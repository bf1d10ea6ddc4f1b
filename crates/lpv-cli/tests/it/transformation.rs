//! `lpv tp` on the model files that are shipped, on samples, and on files that are no model.

use crate::program::{Place, parsed};

fn shipped(name: &str) -> String {
    std::fs::read_to_string(format!("{}/../../models/{name}.toml", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// The singular values that the TP Tool's TORA example prints, to their eight digits.
#[test]
fn tora_as_published() {
    let place = Place::with("");
    place.write("tora.toml", shipped("tora"));
    let record = parsed(&place.succeed("tp tora.toml --json -o tora.json"));
    assert_eq!(record, place.json("tora.json"));
    let published: [&[f64]; 2] =
        [&[47.155155, 0.67184703, 0.63919983, 0.010340462, 0.0068889706], &[47.159941, 0.63928346]];
    for (parameter, published) in record["parameters"].as_array().unwrap().iter().zip(published) {
        assert_eq!(parameter["rank"], published.len());
        assert_eq!(parameter["weights"].as_array().unwrap().len(), 23);
        for (found, published) in parameter["singular_values"].as_array().unwrap().iter().zip(published) {
            assert!((found.as_f64().unwrap() / published - 1.0).abs() < 5e-8);
        }
    }
    assert_eq!(record["vertices"].as_array().unwrap().len(), 10);
    assert!(record["accuracy"]["grid_max"].as_f64().unwrap() < 1e-10);
    assert_eq!(record["dependencies"][1][3], serde_json::json!(["theta", "theta_dot"]));
    assert_eq!(record["dependencies"][0][1], serde_json::json!([]));
    place.lpv("tp tora.toml -o tora.json").refuses(2, &["tora.json", "--force"]);
}

#[test]
fn shipped_models_are_transformed() {
    for name in ["nata", "pendulum-cart", "quadrotor"] {
        let place = Place::with("");
        place.write("model.toml", shipped(name));
        assert!(place.succeed("tp model.toml").contains("singular values"), "{name}");
    }
}

/// K(ψ) = K(0)T(ψ) of the quadrotor has the constant, sin ψ and cos ψ: rank 3 (thesis 4.2.3).
#[test]
fn regulators_are_transformed() {
    let place = Place::with("");
    place.write("gain.toml", shipped("quadrotor-gain"));
    let record = parsed(&place.succeed("tp gain.toml --json"));
    assert_eq!(record["size"], serde_json::json!([4, 12]));
    assert_eq!(record["parameters"][0]["rank"], 3);
    assert!(record["accuracy"]["grid_max"].as_f64().unwrap() < 1e-6);
    let tora = "[model]\nname = \"tora\"\n[weights]\nQ_diag = [1, 1, 1, 1]\nR_diag = [1]\n";
    place.write("model.toml", tora);
    place.lpv("tp model.toml").refuses(2, &["model.toml", "weights", "plant"]);
    place.write("model.toml", "[plant]\nname = \"quadrotor\"\n[weights]\nQ_diag = [1]\nR_diag = [1, 1, 1, 1]\n");
    place.lpv("tp model.toml").refuses(2, &["model.toml", "weights.Q"]);
}

/// S(p, q) = [pq, q²] has rank 2 in p and in q, and so have its samples on any grid.
#[test]
fn samples_are_transformed() {
    let (p, q) = ([-1.0, 0.5, 2.0], [0.0, 1.0, 3.0, 4.0]);
    let matrices: Vec<String> =
        p.iter().flat_map(|p| q.iter().map(move |q| format!("[[{:.1}, {:.1}]]", p * q, q * q))).collect();
    let text = format!(
        "[model]\nsamples = [{}]\n[[parameter]]\nname = \"p\"\nvalues = {p:?}\n[[parameter]]\nname = \"q\"\nvalues = {q:?}\n",
        matrices.join(", ")
    );
    let place = Place::with("");
    place.write("samples.toml", text);
    let record = parsed(&place.succeed("tp samples.toml --json"));
    let ranks: Vec<u64> =
        record["parameters"].as_array().unwrap().iter().map(|p| p["rank"].as_u64().unwrap()).collect();
    assert_eq!(ranks, [2, 2]);
    assert_eq!(record["dependencies"], serde_json::json!([[["p", "q"], ["q"]]]));
    assert!(record["accuracy"]["grid_max"].as_f64().unwrap() < 1e-10);
}

#[test]
fn files_that_are_no_model() {
    let place = Place::with("");
    let tora = "[model]\nname = \"tora\"\n";
    let cases: [(String, &[&str]); 28] = [
        (String::new(), &["model", "missing", "tora"]),
        ("[model]\nname = \"toro\"\n".into(), &["model.name", "toro", "tora"]),
        ("[model]\nname = 3\n".into(), &["model.name", "3"]),
        ("[model]\nepsilon = 0.2\n".into(), &["model.name", "missing"]),
        (format!("{tora}epsilon = 0.2\n"), &["model", "epsilon"]),
        (format!("{tora}coupling = 1.5\n"), &["model", "coupling", "1.5"]),
        (format!("{tora}coupling = nan\n"), &["model", "coupling"]),
        ("[model]\nname = \"nata\"\nmass_kg = -1.0\n".into(), &["model", "mass_kg"]),
        ("[model]\nname = \"nata\"\ninertia_kg_m2 = 1e-9\n".into(), &["model", "inertia_kg_m2"]),
        (format!("{tora}[plant]\nname = \"quadrotor\"\n"), &["plant", "keep one"]),
        ("[plant]\nname = \"pendulum\"\n".into(), &["plant", "no scheduling parameter"]),
        ("[plant]\nname = \"plane\"\n".into(), &["plant.name", "plane"]),
        (format!("{tora}[[parameter]]\nname = \"phi\"\n"), &["parameter[1].name", "phi", "theta_dot"]),
        (format!("{tora}[[parameter]]\nname = \"theta\"\nrange = [1.0, -1.0]\n"), &["parameter[1].range"]),
        (format!("{tora}[[parameter]]\nname = \"theta\"\nrange = [0.0, inf]\n"), &["parameter[1].range"]),
        (format!("{tora}[[parameter]]\nname = \"theta\"\nrange = [1.0, 1.0000000000000002]\n"), &["too narrow"]),
        (format!("{tora}[[parameter]]\nname = \"theta\"\ngrid_points = 1\n"), &["parameter[1].grid_points"]),
        (
            format!("{tora}[[parameter]]\nname = \"theta\"\nvalues = [0.0, 0.0]\n"),
            &["parameter[1].values", "ascending"],
        ),
        (
            format!("{tora}[[parameter]]\nname = \"theta\"\n[[parameter]]\nname = \"theta\"\n"),
            &["parameter[2].name", "already"],
        ),
        (
            format!(
                "{tora}[[parameter]]\nname = \"theta\"\ngrid_points = 2001\n[[parameter]]\nname = \"theta_dot\"\ngrid_points = 2001\n"
            ),
            &["parameter", "grid_points"],
        ),
        (format!("{tora}[transformation]\nweights = \"normal\"\n"), &["transformation.weights", "normal", "cno"]),
        (format!("{tora}[transformation]\nranks = [3, 2, 1]\n"), &["transformation.ranks", "3 entries"]),
        (format!("{tora}[transformation]\nhull_points = 100\n"), &["transformation.hull_points", "100"]),
        (format!("{tora}[transformation]\nranks = 0\n"), &["transformation.ranks"]),
        (format!("{tora}[transformation]\ntolerance = 1.0\n"), &["transformation.tolerance"]),
        (format!("{tora}[transformation]\ntolerance = 0.1\nranks = 2\n"), &["transformation.ranks", "keep one"]),
        (
            "[model]\nsamples = [[[1.0]], [[2.0, 3.0]]]\n[[parameter]]\nname = \"p\"\nvalues = [0.0, 1.0]\n".into(),
            &["samples[2]"],
        ),
        (
            "[model]\nsamples = [[[1.0]], [[2.0]]]\n[[parameter]]\nname = \"p\"\nvalues = [0.0, 1.0, 2.0]\n".into(),
            &["2 matrices"],
        ),
    ];
    for (text, words) in cases {
        place.write("model.toml", &text);
        let mut all = vec!["model.toml"];
        all.extend(words);
        place.lpv("tp model.toml").refuses(2, &all);
    }
    place.write(
        "zero.toml",
        "[model]\nsamples = [[[0.0]], [[0.0]]]\n[[parameter]]\nname = \"p\"\nvalues = [0.0, 1.0]\n",
    );
    place.lpv("tp zero.toml").refuses(2, &["zero.toml", "zero at every"]);
    place.lpv("tp missing.toml").refuses(2, &["missing.toml", "cannot be read"]);
}
