//! The plants of COMPleib with up to 24 states: each is designed and proved with every method, or refuted; gains of the regulator are compared with
//! those of a reference of 400 digits.

use crate::program::Place;
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

const COMPLEIB: &str = include_str!("../cases/compleib/compleib.json");

#[derive(Deserialize)]
struct Plant {
    #[serde(rename = "A")]
    a: Vec<Vec<f64>>,
    #[serde(rename = "B")]
    b: Vec<Vec<f64>>,
    /// Of the regulator with Q = I, R = I; `None` where no gain stabilises.
    #[serde(rename = "K")]
    regulator: Option<Vec<Vec<f64>>>,
}

const METHODS: [&str; 5] = ["lqr", "lpvqr", "stabilize", "slpvqr", "high-gain"];

impl Plant {
    fn problem(&self, method: &str) -> String {
        let (n, m) = (self.b.len(), self.b[0].len());
        let weights = match method {
            "stabilize" => String::new(),
            _ => format!("[weights]\nQ_diag = {:?}\nR_diag = {:?}\n", vec![1.0; n], vec![1.0; m]),
        };
        let limits = format!("sigma = {:?}\ngamma = 1\n", vec![1.0; m]);
        let method = match method {
            "slpvqr" => format!("method = \"slpvqr\"\n{limits}"),
            "high-gain" => format!("method = \"slpvqr\"\nhigh_gain = true\n{limits}"),
            other => format!("method = \"{other}\"\n"),
        };
        format!("[model]\nA = {:?}\nB = {:?}\n{weights}[design]\n{method}", self.a, self.b)
    }

    /// Why the answer of `method` is of no use; `None` if it is.
    fn complaint(&self, method: &str) -> Option<String> {
        let place = Place::with(self.problem(method));
        let ended = place.lpv("design scenario.toml -o design.json");
        let Some(regulator) = &self.regulator else { return (ended.code != 3).then_some(ended.err) };
        if ended.code != 0 {
            return Some(ended.err);
        }
        let design = place.json("design.json");
        let certificate: Value = serde_json::from_str(&place.succeed("certify design.json --json")).unwrap();
        if design["verdict"] != "proved" || certificate["verdict"] != "proved" {
            return Some(format!("{}, {}", design["verdict"], certificate["verdict"]));
        }
        if method != "lqr" {
            return None;
        }
        let k: Vec<Vec<Vec<f64>>> = serde_json::from_value(design["K"].clone()).unwrap();
        let largest = regulator.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let apart = k[0].iter().flatten().zip(regulator.iter().flatten()).map(|(x, y)| (x - y).abs());
        let error = apart.fold(0.0, f64::max) / largest;
        (error > 1e-9).then(|| format!("relative error {error:e} of K"))
    }
}

#[test]
fn every_plant_is_designed_or_refuted() {
    let plants: BTreeMap<String, Plant> = serde_json::from_str(COMPLEIB).unwrap();
    assert_eq!((plants.len(), plants.values().filter(|plant| plant.regulator.is_none()).count()), (100, 1));
    std::thread::scope(|scope| {
        let each = |method: &'static str| {
            let plants = &plants;
            scope.spawn(move || {
                let complaint = |(name, plant): (&String, &Plant)| {
                    plant.complaint(method).map(|complaint| format!("{method}, {name}: {complaint}"))
                };
                plants.iter().filter_map(complaint).collect::<Vec<_>>()
            })
        };
        let threads = METHODS.map(each);
        let complaints: Vec<String> = threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect();
        assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    });
}
