//! `lpv run`: the whole job.

use crate::program::{DOUBLE_INTEGRATOR, Place, QUADROTOR, edited};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The data inside a report page.
fn report_data(page: &str) -> Value {
    let (_, rest) = page.split_once(r#"id="report-data">"#).unwrap();
    let (data, _) = rest.split_once("</script>").unwrap();
    serde_json::from_str(data).unwrap()
}

/// The rows of a CSV file as numbers, below its header.
fn rows(csv: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = csv.lines();
    let header: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect();
    for row in &rows {
        assert_eq!(row.len(), header.len());
        assert!(row.iter().all(|value| value.is_finite()), "{row:?}");
    }
    (header, rows)
}

/// `run.json` without what may differ from run to run.
fn without_timings(record: &mut Value) {
    match record {
        Value::Object(map) => {
            map.retain(|key, _| !key.ends_with("seconds") && key != "threads");
            map.values_mut().for_each(without_timings);
        }
        Value::Array(list) => list.iter_mut().for_each(without_timings),
        _ => {}
    }
}

/// The files of the result folder `name`, `run.json` without its timings, the report without the folder's name.
fn result(place: &Place, name: &str) -> BTreeMap<String, Vec<u8>> {
    let prefix = format!("{name}/");
    let mut files: BTreeMap<String, Vec<u8>> = (place.files().into_iter())
        .filter_map(|(path, bytes)| Some((path.strip_prefix(&prefix)?.to_owned(), bytes)))
        .collect();
    let mut record: Value = serde_json::from_slice(&files["run.json"]).unwrap();
    without_timings(&mut record);
    files.insert("run.json".into(), record.to_string().into_bytes());
    let page = String::from_utf8(files["report.html"].clone()).unwrap();
    let nameless = page.replace(&format!("lpv certify {prefix}"), "lpv certify ");
    assert_ne!(page, nameless, "the report says how to prove its claims again");
    files.insert("report.html".into(), nameless.into_bytes());
    files
}

#[test]
fn writes_a_whole_result() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    let table = place.succeed("run scenario.toml");
    assert_eq!(place.list("."), ["out", "scenario.toml"]);
    assert_eq!(place.list("out"), ["cart"]);
    assert_eq!(
        place.list("out/cart"),
        [
            "design-filtered.json",
            "design-high-gain.json",
            "design-regulator.json",
            "design-saturated.json",
            "model.json",
            "report.html",
            "run.json",
            "trajectory-filtered.csv",
            "trajectory-high-gain.csv",
            "trajectory-regulator.csv",
            "trajectory-saturated.csv",
        ]
    );
    for word in [
        "controller",
        "cost bound (verdict)",
        "actual cost",
        "settling",
        "peak input",
        "saturated",
        "High gain, γ = 2",
        "numerical",
        "out/cart/report.html",
    ] {
        assert!(table.contains(word), "{word}: {table}");
    }
    assert!(!table.contains("NaN") && !table.contains("inf"), "{table}");
}

#[test]
fn record_holds_inputs_versions_seed_timings_verdicts_and_costs() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("run scenario.toml");
    let record = place.json("out/cart/run.json");
    assert_eq!(record["schema"], "lpv-run/1");
    assert_eq!(record["scenario_toml"], DOUBLE_INTEGRATOR);
    assert_eq!(record["lpv_version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(record["seed"], 7);
    assert!(record["seconds"].as_f64().unwrap() > 0.0);
    let controllers = record["controllers"].as_array().unwrap();
    let names: Vec<&str> = (controllers.iter()).map(|controller| controller["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["regulator", "saturated", "high-gain", "filtered"]);
    for controller in controllers {
        assert_eq!(controller["verdict"], "numerical");
        assert_eq!(controller["outcome"]["kind"], "completed");
        let claims = controller["design_claims"].as_array().unwrap();
        assert!(claims.iter().all(|claim| claim["margin"].as_f64().unwrap() > 0.0));
        for timing in ["design_seconds", "check_seconds", "flight_seconds"] {
            assert!(controller[timing].as_f64().unwrap() >= 0.0);
        }
        assert!(controller["actual_cost"].as_f64().unwrap() > 0.0);
    }
    // the step lies inside the certified set of the saturated design, so that its bound holds: of the plant, which is linear
    let saturated = &controllers[1];
    assert_eq!(saturated["guaranteed_cost_verdict"], "proved");
    let cost = |key: &str| saturated[key].as_f64().unwrap();
    assert!(cost("actual_cost") <= cost("guaranteed_cost"));
    assert_eq!(saturated["saturated_share"], 0.0);
    // ... and outside that of the regulator: no number, and a claim that says so
    assert_eq!(controllers[0]["guaranteed_cost"], Value::Null);
    let of_flight = controllers[0]["flight_claims"].as_array().unwrap();
    assert_eq!(of_flight.iter().find(|claim| claim["kind"] == "step-cost").unwrap()["verdict"], "undecided");
    assert!(controllers[3]["estimator_consistency"]["inside_three_sigma"][0].as_f64().unwrap() > 0.9);
}

#[test]
fn report_holds_the_data_and_loads_nothing() {
    let text = edited(
        DOUBLE_INTEGRATOR,
        "title = \"A cart\"",
        "title = \"A <b>cart</b>\"\ndescription = '<!-- <script> </script> /*LPV_REPORT_DATA*/'",
    );
    let place = Place::with(text);
    place.succeed("run scenario.toml");
    let page = place.read("out/cart/report.html");
    let data = report_data(&page);
    assert_eq!(data["schema"], "lpv-report/1");
    assert_eq!(data["title"], "A <b>cart</b>");
    assert_eq!(data["description"], "<!-- <script> </script> /*LPV_REPORT_DATA*/");
    let samples = data["time"].as_array().unwrap().len();
    assert_eq!(samples, 301);
    let runs = data["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 4);
    // the largest singular value of K over the grid, which for one input is its length; nothing is said of a share of the optimum
    for run in runs {
        let design = place.json(&format!("out/cart/design-{}.json", run["id"].as_str().unwrap()));
        let gain: Vec<f64> = serde_json::from_value(design["points"][0]["gain"][0].clone()).unwrap();
        let length = gain.iter().map(|k| k * k).sum::<f64>().sqrt();
        assert!((run["largest_gain"].as_f64().unwrap() / length - 1.0).abs() < 1e-5, "{length}");
        assert!(run["back_off"].is_null());
    }
    for run in runs {
        for series in ["states", "inputs"] {
            for values in run[series].as_array().unwrap() {
                assert_eq!(values.as_array().unwrap().len(), samples);
                assert!(values.as_array().unwrap().iter().all(Value::is_f64));
            }
        }
    }
    assert!(runs[3]["estimation"]["error"].is_array() && runs[0]["estimation"].is_null());
    for loads in [
        "<script src",
        "<script type=\"module\" src",
        "<link rel=\"stylesheet\"",
        "<iframe",
        "<img",
        "@import",
        "url(http",
        "url(//",
        "src=\"http",
        "href=\"http",
        "src=\"//",
        "src='http",
    ] {
        assert!(!page.contains(loads), "the page has \"{loads}\"");
    }
}

#[test]
fn trajectories_have_units_and_one_row_an_interval() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("run scenario.toml");
    let (header, table) = rows(&place.read("out/cart/trajectory-saturated.csv"));
    assert_eq!(
        header,
        ["t [s]", "x_1 [m]", "x_2 [m/s]", "reference x_1 [m]", "reference x_2 [m/s]", "u [m/s²]", "limited", "cost"]
    );
    assert_eq!(table.len(), 61, "3 s at 0.05 s, both ends");
    for (k, row) in table.iter().enumerate() {
        assert!((row[0] - 0.05 * k as f64).abs() < 1e-9);
        assert_eq!(row[3], if k < 10 { 0.0 } else { 0.5 }, "the step at 0.5 s");
        assert!((-1.0..=1.0).contains(&row[5]), "the limits");
    }
    assert_eq!(table[0][1..3], [0.0, 0.0]);
    assert!(table.windows(2).all(|pair| pair[1][7] >= pair[0][7]), "cost only grows");

    let (header, _) = rows(&place.read("out/cart/trajectory-filtered.csv"));
    for column in ["measured x_1 [m]", "estimated x_2 [m/s]", "sigma x_1 [m]"] {
        assert!(header.iter().any(|name| name == column), "{column}: {header:?}");
    }
}

#[test]
fn quadrotor_flies_from_file_to_report() {
    let place = Place::with(QUADROTOR);
    place.succeed("run scenario.toml --out flown");
    let data = report_data(&place.read("flown/report.html"));
    assert_eq!(data["plant"]["scene"]["kind"], "rigid-body");
    assert_eq!(data["scheduling"]["weights"].as_array().unwrap().len(), 4);
    for run in data["runs"].as_array().unwrap() {
        assert_eq!(run["outcome"]["kind"], "completed");
        // it moves: yaw is the fastest, and the regulator spends all its thrust on it
        let psi_rad = run["states"][11].as_array().unwrap().last().unwrap();
        assert!(psi_rad.as_f64().unwrap() > 1e-3, "{psi_rad}");
    }
    let (header, table) = rows(&place.read("flown/trajectory-regulator.csv"));
    assert_eq!(header.len(), 1 + 12 + 12 + 4 + 2);
    assert_eq!(table.len(), 26, "0.5 s at ten samples of 2 ms, both ends");
    assert!(table.iter().all(|row| row[25..29].iter().all(|force| (0.0..=9.807).contains(force))));
    let record = place.json("flown/run.json");
    for controller in record["controllers"].as_array().unwrap() {
        assert_eq!(controller["trace_y"].as_array().unwrap().len(), 4, "one a grid point");
    }
}

#[test]
fn same_seed_gives_the_same_bytes_whatever_the_threads() {
    for scenario in [DOUBLE_INTEGRATOR, QUADROTOR] {
        let place = Place::with(scenario);
        place.succeed("run scenario.toml --out first");
        for threads in ["1", "3"] {
            let out = format!("threads-{threads}");
            let mut command = place.command(&format!("run scenario.toml --out {out}"));
            assert!(command.env("RAYON_NUM_THREADS", threads).output().unwrap().status.success());
            let (first, again) = (result(&place, "first"), result(&place, &out));
            for (name, bytes) in &first {
                assert!(bytes == &again[name], "{name} differs with {threads} threads");
            }
            assert_eq!(first.len(), again.len());
        }
    }
}

#[test]
fn another_seed_gives_other_noise_and_the_same_designs() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("run scenario.toml --out first");
    place.write("scenario.toml", edited(DOUBLE_INTEGRATOR, "seed = 7", "seed = 8"));
    place.succeed("run scenario.toml --out second");
    let (first, second) = (result(&place, "first"), result(&place, "second"));
    for (name, bytes) in &first {
        let noisy = ["trajectory-filtered.csv", "report.html", "run.json"].contains(&name.as_str());
        assert_eq!(bytes != &second[name], noisy, "{name}");
    }
}

#[test]
fn force_replaces_and_nothing_else_does() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("run scenario.toml");
    let before = place.files();
    place.lpv("run scenario.toml").refuses(2, &["out/cart", "earlier result", "--force", "--out"]);
    assert!(place.files() == before, "the earlier result is untouched");

    // a scenario of one controller less: nothing of the earlier result stays
    let (shorter, _) = DOUBLE_INTEGRATOR.split_once("[[controller]]\nname = \"filtered\"").unwrap();
    place.write("scenario.toml", shorter);
    place.succeed("run scenario.toml --force");
    assert_eq!(place.list("out"), ["cart"]);
    assert!(!place.path("out/cart/trajectory-filtered.csv").exists());
    assert_eq!(place.json("out/cart/run.json")["scenario_toml"], shorter);
}

#[test]
fn an_empty_folder_is_a_place_for_a_result() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    std::fs::create_dir(place.path("here")).unwrap();
    place.succeed("run scenario.toml --out here");
    assert!(place.path("here/report.html").is_file());
}

#[test]
fn a_required_verdict_that_is_missed_is_told_after_the_results() {
    // a frozen design is not proved between its few grid points
    let required = QUADROTOR.replacen("method = \"slpvqr\"", "method = \"slpvqr\"\nrequire = \"proved\"", 1);
    let place = Place::with(required);
    let ended = place.lpv("run scenario.toml");
    ended.refuses(4, &["\"saturated\" is numerical", "required is proved"]);
    assert!(ended.out.contains("report.html"));
    assert!(place.path("out/hop/report.html").is_file());
    let proved = edited(DOUBLE_INTEGRATOR, "method = \"lpvqr\"", "method = \"lpvqr\"\nrequire = \"proved\"");
    let place = Place::with(proved);
    place.succeed("run scenario.toml");

    place.write(
        "scenario.toml",
        edited(DOUBLE_INTEGRATOR, "method = \"lpvqr\"", "method = \"lpvqr\"\nrequire = \"numerical\""),
    );
    place.succeed("run scenario.toml --force");
}

#[test]
fn json_is_the_record_and_nothing_else() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    let out = place.succeed("run scenario.toml --json");
    assert_eq!(out, place.read("out/cart/run.json"));
    let record: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(record["scenario"], "cart");
}

#[test]
fn a_flight_without_set_points_is_regulation() {
    let (start, rest) = DOUBLE_INTEGRATOR.split_once("[[set_point]]").unwrap();
    let (_, controllers) = rest.split_once("\n\n").unwrap();
    let text = edited(start, "[noise]", "[simulation.initial_state]\nx_1 = 0.2\n\n[noise]");
    let place = Place::with(format!("{text}\n{controllers}"));
    let table = place.succeed("run scenario.toml");
    assert!(table.contains("  no step  "), "{table}");
}

/// The reader of standard output may go away (`lpv run … | head -1`): that is no defect, and no failure.
#[test]
fn a_reader_that_leaves_early_is_no_failure() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    let mut command = place.command("run scenario.toml --json");
    let mut child =
        (command.stdout(std::process::Stdio::piped())).stderr(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    assert!(output.status.success());
    assert!(place.path("out/cart/run.json").is_file());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_standard_output_is_told() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = place.command("run scenario.toml --json").stdout(full).output().unwrap();
    crate::program::Ended::from(output).refuses(2, &["standard output"]);
}

/// The quadrotor's 100 m: every step certified by proofs, settled, with the governed reference and V/γ in the results.
#[test]
fn a_governed_flight_is_certified_and_recorded() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let text = fs::read_to_string(folder.join("quadrotor-governed.toml")).unwrap();
    let place = Place::with(&text);
    let table = place.succeed("run scenario.toml");
    assert!(table.contains("step 1 certified (V ≤ 0."), "{table}");
    assert!(table.contains("step 2 certified (V ≤ 0."), "{table}");
    let record: Value = serde_json::from_str(&place.read("out/quadrotor-governed/run.json")).unwrap();
    let moving = &record["controllers"][0];
    let first = &moving["steps"][0];
    assert!(first["settling_time_s"].as_f64().unwrap() < 10.5, "{first}");
    for stay in moving["step_stays"].as_array().unwrap() {
        assert_eq!(stay["verdict"], "proved");
        assert!(stay["peak_share"].as_f64().unwrap() < 0.5 && stay["outside_s"] == 0.0, "{stay}");
        assert!(stay["peak_rate"].as_f64().unwrap() <= 0.5);
    }
    let claims = moving["design_claims"].as_array().unwrap();
    let proved = claims.iter().filter(|claim| claim["verdict"] == "proved").count();
    assert_eq!(proved, 15, "seven of each member, one of the motions");
    assert_eq!(record["controllers"][1]["outcome"]["kind"], "diverged");

    let (header, rows) = rows(&place.read("out/quadrotor-governed/trajectory-moving.csv"));
    let column = |name: &str| header.iter().position(|found| found == name).unwrap();
    let (governed, set_point, share) = (column("governed r_x [m]"), column("reference r_x [m]"), column("V/gamma"));
    assert!(rows.iter().any(|row| row[governed] > 10.0 && row[governed] < 90.0 && row[set_point] == 100.0));
    assert!(rows.iter().all(|row| row[share] < 0.5));
    let data = report_data(&place.read("out/quadrotor-governed/report.html"));
    assert!(data["runs"][0]["governed"][3].is_array() && data["runs"][0]["set_share"].is_array());
    assert!(data["runs"][1]["governed"].is_null() && data["runs"][1]["set_share"].is_null());
    assert_eq!(data["runs"][0]["proved_rate"], 0.5, "what both sets and their costs are proved for");
    assert!(data["runs"][1]["proved_rate"].is_null());
    let command = "lpv certify out/quadrotor-governed/design-moving.json";
    assert_eq!(data["runs"][0]["certify_command"], command);

    // the saved design flies the same, and is proved again
    let simulated = place.succeed("simulate scenario.toml");
    assert!(simulated.contains("Moving reference: completed"), "{simulated}");
    assert_eq!(
        place.read("out/quadrotor-governed-flights/trajectory-moving.csv"),
        place.read("out/quadrotor-governed/trajectory-moving.csv")
    );
    let certified = place.succeed(command.trim_start_matches("lpv "));
    assert!(certified.contains("proved: the governed reference moves as the model does"), "{certified}");
    assert!(certified.contains("proved: inner set 1: the set x'P x <= 1 is invariant"), "{certified}");
}

/// Every scenario that comes with the program runs (those without a test of their own are run here), and none of its designs is refuted.
#[test]
fn shipped_scenarios_run() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let has_own_test = path.file_stem().is_some_and(|stem| stem == "quadrotor-governed");
        if has_own_test || path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let text = fs::read_to_string(path).unwrap();
        let place = Place::with(&text);
        place.succeed("run scenario.toml");
        count += 1;
    }
    assert!(count >= 2);
}

/// With `--prove` the claims of the proofs stand beside the others, and the flown rate beside the proved one.
#[test]
fn a_run_proves_what_it_flies() {
    let place = Place::with(QUADROTOR);
    place.succeed("run scenario.toml --prove");
    let record = place.json("out/hop/run.json");
    for run in record["controllers"].as_array().unwrap() {
        let claims = run["design_claims"].as_array().unwrap();
        assert!(claims.iter().any(|claim| claim["verdict"] == "proved"), "{claims:?}");
        let flown = run["flight_claims"].as_array().unwrap();
        let rate = flown.iter().find(|claim| claim["id"] == "plant.rate-kept").unwrap();
        assert!(rate["detail"].as_str().unwrap().contains("rad/s"), "{rate}");
    }
}

/// One controller that cannot be designed takes nothing from the others: they fly, its row says why, and the exit code is its own.
#[test]
fn one_controller_that_cannot_be_designed() {
    let impossible = "method = \"high-gain-slpvqr\"\nhigh_gain = { gain_margin = 1e12 }\ngamma = 2\n\n[[controller]]\nname = \"filtered\"";
    let text = DOUBLE_INTEGRATOR.replacen(
        "method = \"high-gain-slpvqr\"\ngamma = 2\n\n[[controller]]\nname = \"filtered\"",
        impossible,
        1,
    );
    let place = Place::with(&text);
    let ended = place.lpv("run scenario.toml");
    assert_eq!(ended.code, 3, "{}", ended.err);
    assert!(ended.err.contains("\"high-gain\"") && ended.err.contains("gain_margin"), "{}", ended.err);
    assert!(ended.out.contains("not designed") && ended.out.contains("High gain, γ = 2: no gain"), "{}", ended.out);
    let record = place.json("out/cart/run.json");
    let names: Vec<&Value> = record["controllers"].as_array().unwrap().iter().map(|of| &of["name"]).collect();
    assert_eq!(names, ["regulator", "saturated", "filtered"]);
    assert_eq!(record["not_designed"][0]["name"], "high-gain");
    let page = fs::read_to_string(place.path("out/cart/report.html")).unwrap();
    let notes = report_data(&page)["notes"].to_string();
    assert!(notes.contains("High gain, γ = 2: not designed"), "{notes}");
    let designs: Value = serde_json::from_str(&place.lpv("design scenario.toml -o designs --json").out).unwrap();
    assert_eq!(designs.as_array().unwrap().len(), 4);
    assert!(designs[3]["not_designed"].as_str().unwrap().contains("sample faster"));

    // where none is left there is nothing to fly
    let none = text
        .replace("method = \"lpvqr\"", "method = \"high-gain-slpvqr\"\ngamma = 2")
        .replace("method = \"slpvqr\"", "method = \"high-gain-slpvqr\"")
        .replace("gamma = 2\nnoise", "gamma = 2\nhigh_gain = { gain_margin = 1e12 }\nnoise");
    let none = none.replace(
        "method = \"high-gain-slpvqr\"\ngamma = 2\n\n",
        "method = \"high-gain-slpvqr\"\nhigh_gain = { gain_margin = 1e12 }\ngamma = 2\n\n",
    );
    let place = Place::with(&none);
    place.lpv("run scenario.toml").refuses(3, &["gain_margin"]);
    assert!(place.list("out").is_empty());
}

/// The thesis's scenario at 27 g: forces of 0.1 N, inertias of 1e-5 kg m².
#[test]
fn a_vehicle_of_27_grams() {
    let text = include_str!("../cases/public/crazyflie.toml");
    let text = text.replace("grid_points = 32", "grid_points = 4").replace("duration_s = 75.0", "duration_s = 36.0");
    let place = Place::with(text);
    place.succeed("run scenario.toml");
    let record = place.json("out/crazyflie/run.json");
    let controllers = record["controllers"].as_array().unwrap();
    assert_eq!(controllers.len(), 7);
    for controller in controllers {
        // the saturated designs are good as far as they are checked; the others promise nothing at these limits
        let is_saturated = controller["method"] != "lpvqr";
        assert!(
            !is_saturated || controller["verdict"] == "numerical" || controller["verdict"] == "proved",
            "{controller}"
        );
    }
}
