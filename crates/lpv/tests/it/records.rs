//! Records of proofs: every number exact, cells without gaps, premises before what rests on them, and nothing that is not proved.

use crate::quadrotor::{designed, limits, plant};
use lpv::certificate::{ProofOptions, Record, prove_supervised};
use lpv::controller::InputLimits;
use lpv::math::matrix::diagonal;
use lpv::plant::{Plant, PlantSpec};
use lpv::synthesis::{CostWeights, Design, DesignRequest, Method, ScheduleKind, design};
use serde_json::Value;

fn record(design: &Design, plant: &dyn Plant, options: &ProofOptions) -> Vec<Value> {
    let proofs = prove_supervised(design, plant, options).unwrap();
    let mut record = Record::default();
    record.add_design(design, plant, &proofs).unwrap();
    record.text().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn kinds(lines: &[Value]) -> Vec<&str> {
    lines.iter().filter_map(|line| line["kind"].as_str()).collect()
}

/// m·2^e of a number as the record writes it.
fn number(value: &Value) -> f64 {
    let text = value.as_str().unwrap();
    let (mantissa, exponent) = text.trim_start_matches('-').trim_start_matches("0x").split_once('p').unwrap();
    let (whole, fraction) = mantissa.split_once('.').unwrap();
    let digits = u64::from_str_radix(&format!("{whole}{fraction}"), 16).unwrap() as f64;
    let size = digits * 2f64.powi(exponent.parse::<i32>().unwrap() - 4 * fraction.len() as i32);
    if text.starts_with('-') { -size } else { size }
}

#[test]
fn cells_follow_each_other_over_the_whole_circle() {
    let plant = plant();
    let design = designed(Method::Lpvqr, limits(), 8, ScheduleKind::Grid);
    let lines = record(&design, &*plant, &ProofOptions { rate: Some(0.1), ..Default::default() });
    assert_eq!(lines[0]["lines"], lines.len() - 1);
    assert_eq!(lines[0]["sha256"].as_str().unwrap().len(), 64);
    assert!(kinds(&lines).starts_with(&["definite", "unsaturated"]));
    for (at, claim) in lines.iter().filter(|line| line.get("claim").is_some()).enumerate() {
        assert_eq!(claim["claim"], at);
        assert!(claim["premises"].as_array().unwrap().iter().all(|premise| premise.as_u64().unwrap() < at as u64));
        for group in claim["groups"].as_array().unwrap() {
            let piece = group["piece"].as_f64().unwrap();
            let cells = group["cells"].as_array().unwrap();
            let mut end = piece;
            for cell in cells {
                assert_eq!(number(&cell[0]), end);
                end = number(&cell[1]);
                assert!(end > number(&cell[0]));
            }
            assert_eq!(end, piece + 1.0);
        }
        // every piece, of every input
        let pieces = claim["groups"].as_array().unwrap().len();
        let is_implied = claim["kind"] == "sampled" && !claim["premises"].as_array().unwrap().is_empty();
        let expected = if is_implied { 0 } else { 8 };
        assert_eq!(pieces, if claim["kind"] == "unsaturated" { 4 * 8 } else { expected });
    }
}

#[test]
fn every_number_is_the_one_of_the_design() {
    let plant = plant();
    let design = designed(Method::Lpvqr, InputLimits::none(4), 8, ScheduleKind::Grid);
    let lines = record(&design, &*plant, &ProofOptions { rate: Some(0.1), ..Default::default() });
    for (point, recorded) in design.points.iter().zip(lines[1]["points"].as_array().unwrap()) {
        assert_eq!(number(&recorded["rho"]), point.rho);
        for (i, j) in (0..4).flat_map(|i| (0..12).map(move |j| (i, j))) {
            assert_eq!(number(&recorded["gain"][i][j]), point.gain[(i, j)]);
        }
    }
}

#[test]
fn what_is_not_proved_is_not_recorded() {
    let spec = PlantSpec::DoubleIntegrator {};
    let plant = spec.build().unwrap();
    let request = DesignRequest {
        name: "slqr".into(),
        method: Method::Slpvqr { gamma: 1.0 },
        weights: CostWeights { q: diagonal(&[1.0; 2]), r: diagonal(&[0.001]) },
        grid_points: 1,
        schedule: ScheduleKind::Grid,
        limits: InputLimits { min: vec![Some(-1.0)], max: vec![Some(1.0)] },
        sample_time_s: 0.001,
        rate_bounded: None,
    };
    let design = design(&spec, &*plant, &request, &|_| {}).unwrap();
    let all = record(&design, &*plant, &ProofOptions::default());
    assert_eq!(kinds(&all), ["definite", "unsaturated", "decrease", "cost", "kept", "sampled", "sampled-cost"]);
    assert_eq!(all[5]["premises"], serde_json::json!([0, 1, 2]));
    // V that falls under every mixture falls under K
    let [kept, sampled] = [&all[6], &all[7]];
    assert_eq!((&kept["premises"], &kept["between"]), (&serde_json::json!([0, 1]), &true.into()));
    assert_eq!((&sampled["premises"], &sampled["groups"]), (&serde_json::json!([4]), &serde_json::json!([])));
    // of a low gain there is one mixture
    let group = serde_json::json!([{"piece": 0, "variant": null, "cells": [["0x0.0p+0", "0x1.0000000000000p+0"]]}]);
    assert_eq!((&all[8]["premises"], &all[8]["groups"]), (&serde_json::json!([0, 1]), &group));
    assert_eq!(number(&all[8]["level"]), number(&all[3]["level"]));
    // the gain saturates on a set that large, and so nothing is known that assumes it does not
    let some = record(&design, &*plant, &ProofOptions { level: Some(1000.0), ..Default::default() });
    let known: Vec<&str> = kinds(&some).into_iter().filter(|kind| !["unsaturated", "kept"].contains(kind)).collect();
    let level = some.iter().find(|line| line["kind"] == "unsaturated").map(|line| number(&line["level"]));
    assert!(known == ["definite", "sampled"] || level.is_some_and(|level| level < 1000.0), "{known:?} {level:?}");
}
