//! `lpv design`, `lpv certify` and `lpv simulate`, each from the files of the one before.

use crate::program::{DOUBLE_INTEGRATOR, Place, QUADROTOR, parsed};
use serde_json::Value;

const NAMES: [&str; 4] = ["regulator", "saturated", "high-gain", "filtered"];

#[test]
fn the_stages_give_what_a_run_gives() {
    for (scenario, name) in [(DOUBLE_INTEGRATOR, "cart"), (QUADROTOR, "hop")] {
        let place = Place::with(scenario);
        place.succeed("run scenario.toml");
        let run = place.files();
        place.succeed("design scenario.toml");
        place.succeed("simulate scenario.toml");
        assert_eq!(place.list("out").len(), 3);
        let stages = place.files();
        let mut compared = 0;
        for (path, bytes) in &stages {
            let part = ["-designs/", "-flights/"].iter().find(|part| path.contains(*part));
            if let Some(part) = part {
                let whole = path.replace(&format!("{name}{part}"), &format!("{name}/"));
                assert!(bytes == &run[&whole], "{path} differs from {whole}");
                compared += 1;
            }
        }
        assert_eq!(compared, run.len() - 3, "all but scenario, report and record");
    }
}

#[test]
fn design_prints_its_summary_as_json() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    let designs = parsed(&place.succeed("design scenario.toml --out designs --json"));
    let names: Vec<&str> =
        (designs.as_array().unwrap().iter()).map(|design| design["name"].as_str().unwrap()).collect();
    assert_eq!(names, NAMES);
    for design in designs.as_array().unwrap() {
        assert_eq!(design["verdict"], "numerical");
        assert!(design["convention"].as_str().unwrap().starts_with("u = u* - sat(K"));
        assert_eq!(design["claims"].as_array().unwrap().len(), 3);
    }
    // closed form of the double integrator with Q = I, R = 0.1; Q is raised by 10⁻⁶ to make the inequality strict
    let k = &designs[0]["gain_at_first_parameter"][0];
    let root: f64 = 10.0;
    assert!((k[0].as_f64().unwrap() - root.sqrt()).abs() < 1e-5);
    assert!((k[1].as_f64().unwrap() - (root + 2.0 * root.sqrt()).sqrt()).abs() < 1e-5);
}

#[test]
fn certify_checks_every_saved_design() {
    for scenario in [DOUBLE_INTEGRATOR, QUADROTOR] {
        let place = Place::with(scenario);
        place.succeed("design scenario.toml --out designs");
        for file in place.designs("designs") {
            let text = place.succeed(&format!("certify designs/{file}"));
            assert!(text.contains(": numerical\n") || text.contains(": proved\n"), "{text}");
            let certificate = parsed(&place.succeed(&format!("certify designs/{file} --json")));
            let claims = certificate["claims"].as_array().unwrap();
            // of a frozen design the set between its few grid points is looked for, and the sampled loop may be seen to leave it
            let is_found = |claim: &Value| claim["kind"] == "sampled-invariance" && claim["verdict"] == "refuted";
            assert!(
                claims.iter().all(|claim| {
                    claim["verdict"] == "undecided"
                        || claim["margin"].as_f64().is_some_and(|margin| margin > 0.0)
                        || is_found(claim)
                }),
                "{claims:?}"
            );
        }
    }
}

#[test]
fn simulate_prints_its_flights_as_json() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("design scenario.toml --out designs");
    let flights = parsed(&place.succeed("simulate scenario.toml --designs designs --out flights --json"));
    assert_eq!(flights.as_array().unwrap().len(), 4);
    for (flight, name) in flights.as_array().unwrap().iter().zip(NAMES) {
        assert_eq!(flight["name"], name);
        assert_eq!(flight["outcome"]["kind"], "completed");
        assert!(flight["actual_cost"].as_f64().unwrap() > 0.0);
        assert!(place.path(&format!("flights/trajectory-{name}.csv")).is_file());
    }
}

#[test]
fn simulate_takes_the_designs_of_a_run_where_there_are_no_others() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("run scenario.toml");
    let text = place.succeed("simulate scenario.toml");
    assert!(text.contains("completed") && text.contains("out/cart-flights"), "{text}");
}

/// A gain of the wrong sign in the controller that flies is refuted, if the points are edited to match; where they are not,
/// the file contradicts itself.
#[test]
fn a_negated_gain_is_refuted() {
    for scenario in [DOUBLE_INTEGRATOR, QUADROTOR] {
        let place = Place::with(scenario);
        place.succeed("design scenario.toml --out designs");
        for file in place.designs("designs") {
            let mut design = place.json(&format!("designs/{file}"));
            let schedule = design.pointer_mut("/controller/schedule").unwrap();
            let gain = if schedule["gain"].is_array() { "gain" } else { "gains" };
            negate(&mut schedule[gain]);
            place.write("edited.json", design.to_string());
            place.lpv("certify edited.json").refuses(2, &["controller.schedule differs from points[].gain"]);

            for point in design["points"].as_array_mut().unwrap() {
                negate(&mut point["gain"]);
            }
            place.write("edited.json", design.to_string());
            let ended = place.lpv("certify edited.json");
            ended.refuses(4, &["refuted"]);
            assert!(ended.out.contains("  refuted: "), "{}", ended.out);
            let ended = place.lpv("certify edited.json --json");
            let certificate = parsed(&ended.out);
            assert_eq!((ended.code, &certificate["verdict"]), (4, &Value::from("refuted")));
            assert!(certificate["claims"].as_array().unwrap().iter().any(|claim| claim["verdict"] == "refuted"));
        }
    }
}

fn negate(value: &mut Value) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(negate),
        other => *other = (-other.as_f64().unwrap()).into(),
    }
}

/// Every edit that takes the ground from a claim is refuted.
#[test]
fn an_edited_design_is_refuted() {
    let place = Place::with(DOUBLE_INTEGRATOR);
    place.succeed("design scenario.toml --out designs");
    let edits: [(&str, Value); 5] = [
        ("/method/gamma", 50.0.into()),
        ("/controller/limits/max", vec![0.01].into()),
        ("/points/0/p", vec![vec![0.1, 0.0], vec![0.0, 0.1]].into()),
        ("/weights/q", vec![vec![100.0, 0.0], vec![0.0, 100.0]].into()),
        ("/sample_time_s", 20.0.into()),
    ];
    for (pointer, value) in edits {
        let mut design = place.json("designs/design-saturated.json");
        *design.pointer_mut(pointer).unwrap() = value;
        place.write("edited.json", design.to_string());
        let ended = place.lpv("certify edited.json");
        assert_eq!(ended.code, 4, "{pointer}: {}{}", ended.out, ended.err);
    }
}

/// The thesis's printed K(ψ) is a design file like any other: refuted, with the eigenvalue and where it is.
#[test]
fn the_printed_gain_of_the_thesis_is_refuted() {
    let place = Place::with("");
    place.write("printed.json", include_str!("../../../../scenarios/thesis-printed-gain.json"));
    let ended = place.lpv("certify printed.json --json");
    ended.refuses(4, &["thesis-printed-gain", "refuted"]);
    let certificate = parsed(&ended.out);
    let claims = certificate["claims"].as_array().unwrap();
    let stability = claims.iter().find(|claim| claim["id"] == "frozen-stability").unwrap();
    assert_eq!(stability["verdict"], "refuted");
    assert!((stability["margin"].as_f64().unwrap() + 3.263).abs() < 1e-3);
    assert_eq!(stability["witness"]["parameter"], 0.0);
    for claim in claims {
        let keys: Vec<&String> = claim.as_object().unwrap().keys().collect();
        let always = ["at", "cells", "claim", "detail", "id", "kind", "margin", "of", "premises", "seconds", "verdict"];
        assert!(always.iter().all(|key| keys.iter().any(|found| found == key)), "{keys:?}");
    }
    // at rest it is refuted by a proof with a witness
    let ended = place.lpv("certify printed.json --rate 0 --json");
    let certificate = parsed(&ended.out);
    let refuted = |claim: &&Value| {
        claim["verdict"] == "refuted" && claim["witness"]["state"].as_array().is_some_and(|state| !state.is_empty())
    };
    let claim = certificate["claims"].as_array().unwrap().iter().find(refuted).unwrap();
    assert_eq!(claim["witness"]["state"].as_array().unwrap().len(), 12);
    place.lpv("certify printed.json --rate=-1").refuses(2, &["--rate", "zero or more"]);
    place.lpv("certify printed.json --region 0").refuses(2, &["--region", "above zero"]);
}

/// A design for another plant than the file's is no design.
#[test]
fn a_design_of_another_plant_is_refused() {
    let place = Place::with(QUADROTOR);
    place.succeed("design scenario.toml --out designs");
    let mut design = place.json("designs/design-saturated.json");
    design["plant"]["mass_kg"] = 2.5.into();
    place.write("edited.json", design.to_string());
    place.lpv("certify edited.json").refuses(2, &["model_hash", "another plant"]);
}
