//! Files of every format with something wrong in them, a character or a number: never a panic, exit codes as
//! documented, and never the word `proved` for what the changed numbers make false.

use crate::program::{DOUBLE_INTEGRATOR, Ended, Place, QUADROTOR};
use lpv::math::Mat;
use lpv::math::eigen::smallest_eigenvalue;
use lpv::math::matrix::from_rows;
use serde_json::{Value, json};
use std::path::Path;

/// A stream of numbers from a seed.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % count
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }
}

fn stored(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

fn case(name: &str) -> String {
    stored(&format!("tests/cases/soundness/{name}"))
}

/// A character or a stretch of the text changed.
fn misspelt(numbers: &mut Numbers, text: &str) -> String {
    let characters: Vec<char> = text.chars().collect();
    let at = numbers.below(characters.len());
    let upto = (at + 1 + numbers.below(12)).min(characters.len());
    let (before, rest): (String, &[char]) = (characters[..at].iter().collect(), &characters[at..]);
    let after: String = characters[upto..].iter().collect();
    match numbers.below(6) {
        0 => before,
        1 => before + &rest[1..].iter().collect::<String>(),
        2 => before + &after,
        3 => {
            before
                + numbers.of(&["\0", "\u{feff}", "é", "\"", "[", "]", "{", "=", ",", "-", "e", "9"])
                + &rest[1..].iter().collect::<String>()
        }
        4 => before + &rest[..upto - at].iter().collect::<String>() + &rest.iter().collect::<String>(),
        _ => before + numbers.of(&["nan", "inf", "1e999", "-1", "null", "\"x\"", "[]", "0x10"]) + &after,
    }
}

/// Paths of the numbers (and nulls) of a value.
fn leaves(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, item)| leaves(item, &format!("{path}/{i}"), found))
        }
        Value::Object(map) => map.iter().for_each(|(key, item)| leaves(item, &format!("{path}/{key}"), found)),
        Value::Number(_) | Value::Null => found.push(path.to_owned()),
        _ => {}
    }
}

/// One number changed.
fn miscounted(numbers: &mut Numbers, value: &Value) -> Value {
    let (mut changed, mut paths) = (value.clone(), Vec::new());
    leaves(value, "", &mut paths);
    let path = &paths[numbers.below(paths.len())];
    let leaf = changed.pointer_mut(path).unwrap();
    let x = leaf.as_f64().unwrap_or(1.0);
    let size = 0.5_f64.powi(numbers.below(40) as i32);
    *leaf = match numbers.below(9) {
        0 => json!(-x),
        1 => json!(x * (1.0 + size)),
        2 => json!(x * (1.0 - size)),
        3 => json!(x.next_up()),
        4 => json!(x + size),
        5 => json!(numbers.of(&[0.0, -0.0, 5e-324, 1e-300, 1e300, -1e300, 1e154])),
        6 => json!(10.0 * x),
        7 => Value::Null,
        _ => json!(numbers.of(&["NaN", "1"])),
    };
    changed
}

/// What every run of the program keeps to.
#[track_caller]
fn keeps_the_contract(ended: &Ended, what: &str) {
    assert!([0, 2, 3, 4].contains(&ended.code), "exit code {}: {}\n{what}", ended.code, ended.err);
    assert!(!ended.err.contains("panicked") && !ended.err.contains("a defect of lpv"), "{}\n{what}", ended.err);
    assert_eq!(
        ended.code != 0,
        ended.err.starts_with("lpv: ") || ended.err.contains("\nlpv: "),
        "{}\n{what}",
        ended.err
    );
}

fn matrix(value: &Value) -> Mat<f64> {
    let number = |x: &Value| x.as_f64().unwrap_or(f64::NAN);
    let rows: Vec<Vec<f64>> =
        value.as_array().unwrap().iter().map(|row| row.as_array().unwrap().iter().map(number).collect()).collect();
    from_rows(&rows)
}

/// One matrix, or one for each vertex.
fn matrices(value: &Value, count: usize) -> Vec<Mat<f64>> {
    if value[0][0].is_array() {
        value.as_array().unwrap().iter().map(matrix).collect()
    } else {
        vec![matrix(value); count]
    }
}

/// A loop with constant matrices.
struct Loop {
    a: Mat<f64>,
    b: Mat<f64>,
    k: Mat<f64>,
    f: Option<Mat<f64>>,
    p: Mat<f64>,
    weights: Option<[Mat<f64>; 2]>,
    /// σᵢ
    sigma: Vec<f64>,
}

impl Loop {
    /// The loops of a file over a polytope, at its vertices; with one Lyapunov function.
    fn of_polytope(file: &Value) -> Vec<Self> {
        let count = ["A", "B"].map(|key| matrices(&file["model"][key], 1).len()).into_iter().max().unwrap();
        let [mut a, mut b] = ["A", "B"].map(|key| matrices(&file["model"][key], count));
        if a.len() < count {
            a = vec![a[0].clone(); count];
        }
        if b.len() < count {
            b = vec![b[0].clone(); count];
        }
        let each = |key: &str| matrices(&file[key], count);
        let sigma = file["sigma"].as_array().map(|s| s.iter().map(|x| x.as_f64().unwrap_or(f64::INFINITY)).collect());
        let of_vertex = |i: usize| Self {
            a: a[i].clone(),
            b: b[i].clone(),
            k: each("K")[i % each("K").len()].clone(),
            f: file["F"].is_array().then(|| each("F")[i % each("F").len()].clone()),
            p: each("P")[i % each("P").len()].clone(),
            weights: file["weights"].is_object().then(|| ["Q", "R"].map(|key| matrix(&file["weights"][key]))),
            sigma: sigma.clone().unwrap_or(vec![f64::INFINITY; b[i].ncols()]),
        };
        (0..count).map(of_vertex).collect()
    }

    /// That of a design file of a linear plant.
    fn of_design(file: &Value) -> Self {
        let (a, b) = match file["plant"]["name"].as_str().unwrap() {
            "double-integrator" => (from_rows(&[vec![0.0, 1.0], vec![0.0, 0.0]]), from_rows(&[vec![0.0], vec![1.0]])),
            _ => (matrix(&file["plant"]["A"]), matrix(&file["plant"]["B"])),
        };
        let limits = &file["controller"]["limits"];
        let side = |key: &str, i: usize| limits[key][i].as_f64().map_or(f64::INFINITY, f64::abs);
        let point = &file["points"][0];
        Self {
            k: matrix(&file["controller"]["schedule"]["gain"]),
            f: point["auxiliary_gain"].is_array().then(|| matrix(&point["auxiliary_gain"])),
            p: matrix(&point["p"]),
            weights: Some(["q", "r"].map(|key| matrix(&file["weights"][key]))),
            sigma: (0..b.ncols()).map(|i| side("min", i).min(side("max", i))).collect(),
            a,
            b,
        }
    }

    /// λ_min of a claim's condition against the size of what it is the sum of, for every mixture of rows.
    fn decrease(&self, factor: f64, with_cost: bool) -> f64 {
        let (m, n) = (self.k.nrows(), self.k.ncols());
        let of_mixture = |bits: usize| {
            let s = Mat::from_fn(m, n, |i, j| match &self.f {
                Some(f) if bits >> i & 1 == 0 && self.sigma[i].is_finite() => f[(i, j)],
                _ => self.k[(i, j)],
            });
            let flow = &self.p * (&self.a - &self.b * &s);
            let mut sum = factor * (&flow + flow.transpose());
            let mut size = flow.norm_max();
            if let (true, Some([q, r])) = (with_cost, &self.weights) {
                let stage = q + s.transpose() * r * &s;
                size += stage.norm_max();
                sum += stage;
            }
            smallest_eigenvalue(&Mat::from_fn(n, n, |i, j| -0.5 * (sum[(i, j)] + sum[(j, i)]))) / size
        };
        (0..1_usize << m).map(of_mixture).fold(f64::INFINITY, f64::min)
    }

    /// Whether the claim can be true, up to rounding; what is not looked at can.
    fn allows(&self, claim: &Value) -> bool {
        const ROUNDING: f64 = 1e-9;
        match claim["kind"].as_str().unwrap() {
            "lyapunov-definite" => {
                let n = self.p.nrows();
                (0..n).all(|i| (0..n).all(|j| self.p[(i, j)] == self.p[(j, i)]))
                    && smallest_eigenvalue(&self.p) > -ROUNDING * self.p.norm_max()
            }
            "weights" => {
                let Some([q, r]) = &self.weights else { return false };
                smallest_eigenvalue(q) >= -ROUNDING * q.norm_max() && smallest_eigenvalue(r) >= -ROUNDING * r.norm_max()
            }
            "unsaturated" => {
                let level = claim["level"].as_f64().unwrap();
                let low = self.f.as_ref().unwrap_or(&self.k);
                let n = low.ncols();
                (0..low.nrows()).filter(|&i| self.sigma[i].is_finite()).all(|i| {
                    let share = level / (self.sigma[i] * self.sigma[i]);
                    let ball = Mat::from_fn(n, n, |r, c| self.p[(r, c)] - share * low[(i, r)] * low[(i, c)]);
                    smallest_eigenvalue(&ball) > -ROUNDING * self.p.norm_max()
                })
            }
            "decrease" | "invariance" => self.decrease(1.0, false) > -ROUNDING,
            "cost" => self.decrease(claim["factor"].as_f64().unwrap(), true) > -ROUNDING,
            _ => true,
        }
    }
}

/// Certify a changed design; what is proved of it can be true.
fn certify(place: &Place, text: &str) -> i32 {
    place.write("mutated.json", text);
    let ended = place.lpv("certify mutated.json --json");
    keeps_the_contract(&ended, text);
    if ![0, 4].contains(&ended.code) {
        return ended.code;
    }
    let certificate: Value = serde_json::from_str(&ended.out).unwrap_or_else(|_| panic!("{}\n{text}", ended.out));
    let file: Value = serde_json::from_str(text).unwrap();
    let claims = certificate["claims"].as_array().unwrap();
    if file["model"].is_object()
        && file["P"].is_array()
        && file["lyapunov"].as_str().is_none_or(|kind| kind == "common")
    {
        let loops = Loop::of_polytope(&file);
        let is_proved = |claim: &&Value| claim["verdict"] == "proved";
        for claim in claims.iter().filter(is_proved) {
            assert!(loops.iter().all(|of| of.allows(claim)), "{claim}\n{text}");
        }
    } else if ["linear", "double-integrator"].iter().any(|name| file["plant"]["name"] == *name) {
        let of = Loop::of_design(&file);
        for claim in claims.iter().filter(|claim| claim["verdict"] == "proved" && claim["of"] == "model") {
            assert!(claim["id"].as_str().unwrap().contains('.') || of.allows(claim), "{claim}\n{text}");
        }
    }
    ended.code
}

/// Exit codes and how often they came.
fn counted(codes: impl Iterator<Item = i32>) -> std::collections::BTreeMap<i32, usize> {
    codes.fold(Default::default(), |mut counts, code| {
        *counts.entry(code).or_insert(0) += 1;
        counts
    })
}

#[test]
fn designs_with_a_number_changed() {
    let files = [
        "partly_limited.json",
        "design-slqr-1.json",
        "bad_F_plant.json",
        "undecided_decrease.json",
        "poly_bad_F.json",
        "poly_refuted_cost.json",
        "poly_not_definite.json",
    ];
    let (place, mut numbers) = (Place::with(""), Numbers(1));
    let extra = json!({
        "model": {"A": [[[0, 1], [1, -0.1]], [[0, 1], [0, -0.1]]], "B": [[0], [1]]},
        "K": [[3, 3]],
        "P": [[4, 1], [1, 1]],
        "sigma": [2.0],
        "gamma": 0.1,
        "weights": {"Q": [[0.5, 0], [0, 0.5]], "R": [[0.1]]},
    });
    let bases: Vec<Value> =
        files.iter().map(|name| serde_json::from_str(&case(name)).unwrap()).chain([extra]).collect();
    let codes = (0..240).map(|k| certify(&place, &miscounted(&mut numbers, &bases[k % bases.len()]).to_string()));
    let codes = counted(codes);
    assert!(
        [0, 2, 4].iter().all(|code| codes.get(code).is_some_and(|count| *count > 10)),
        "{codes:?}: the test tests something"
    );
}

#[test]
fn designs_with_a_character_changed() {
    let files = [
        "design-slqr-1.json",
        "poly_refuted_cost.json",
        "partly_limited.json",
        "design-rate-s1.json",
        "gov_flow0.json",
    ];
    let (place, mut numbers) = (Place::with(""), Numbers(2));
    let texts: Vec<String> = files.iter().map(|name| case(name)).collect();
    let refused = (0..150).filter(|k| {
        let text = misspelt(&mut numbers, &texts[k % texts.len()]);
        // a whole proof of a gridded design is long: those that would be read are left to other tests
        if k % texts.len() >= 3 && serde_json::from_str::<Value>(&text).is_ok() {
            return false;
        }
        certify(&place, &text) == 2
    });
    let refused = refused.count();
    assert!(refused > 60, "{refused} of 150 refused");
}

/// A governed design as the program writes it, with a number of its supervisor changed.
#[test]
fn governed_designs_with_a_number_changed() {
    let place = Place::with(DOUBLE_INTEGRATOR.replace(
        "gamma = 2\n\n[[controller]]\nname = \"high",
        "gamma = 2\ngovernor = {}\n\n[[controller]]\nname = \"high",
    ));
    place.succeed("design scenario.toml --out designs");
    let base = place.json("designs/design-saturated.json");
    assert!(base["controller"]["supervisor"]["governor"].is_object(), "{base}");
    assert_eq!(certify(&place, &base.to_string()), 0);
    let mut numbers = Numbers(3);
    let codes = (0..60).map(|_| {
        let mut file = base.clone();
        let supervisor = &mut file["controller"]["supervisor"];
        *supervisor = miscounted(&mut numbers, supervisor);
        certify(&place, &file.to_string())
    });
    let codes = counted(codes);
    assert!(codes.get(&2).is_some_and(|count| *count > 20), "{codes:?}");
}

/// Problems over polytopes and of the induced norm: what is answered is a design that can be certified, or one line
/// says why not.
#[test]
fn problems_with_something_changed() {
    let (place, mut numbers) = (Place::with(""), Numbers(4));
    let texts =
        ["double-integrator", "pendulum", "commutator"].map(|name| stored(&format!("../../problems/{name}.toml")));
    let codes = (0..90).map(|k| {
        let base = &texts[k % texts.len()];
        let text = if k % 2 == 0 { misspelt(&mut numbers, base) } else { with_a_number_changed(&mut numbers, base) };
        place.write("mutated.toml", &text);
        let ended = place.lpv("design mutated.toml --json");
        keeps_the_contract(&ended, &text);
        if ended.code == 0 {
            let answer: Value = serde_json::from_str(&ended.out).unwrap_or_else(|_| panic!("{}\n{text}", ended.out));
            if answer["model"].is_object() && answer["K"].is_array() {
                certify(&place, &answer.to_string());
            }
        }
        ended.code
    });
    let codes = counted(codes);
    assert!([0, 2].iter().all(|code| codes.get(code).is_some_and(|count| *count > 10)), "{codes:?}");
}

/// A number of a TOML text, by its characters.
fn with_a_number_changed(numbers: &mut Numbers, text: &str) -> String {
    let starts: Vec<usize> = text
        .char_indices()
        .filter(|&(at, c)| {
            c.is_ascii_digit() && !text[..at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '.' || c == '_')
        })
        .map(|(at, _)| at)
        .collect();
    let at = starts[numbers.below(starts.len())];
    let length = text[at..].find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len() - at);
    let value: f64 = text[at..at + length].parse().unwrap_or(1.0);
    let changed = match numbers.below(6) {
        0 => format!("-{value:?}"),
        1 => format!("{:?}", value * 1.01),
        2 => format!("{:?}", value * 100.0),
        3 => numbers.of(&["0", "nan", "inf", "1e300", "1e-300", "\"1\"", "[1]", "true"]).to_owned(),
        4 => "0".into(),
        _ => format!("{:?}", value + 1.0),
    };
    text[..at].to_owned() + &changed + &text[at + length..]
}

#[test]
fn scenarios_with_something_changed() {
    let mut numbers = Numbers(5);
    let codes = (0..80).map(|k| {
        // a quadrotor that is read would be designed at length
        let text = match k % 4 {
            0 => misspelt(&mut numbers, DOUBLE_INTEGRATOR),
            1 => misspelt(&mut numbers, QUADROTOR).replace("grid_points", "grid_pionts"),
            _ => with_a_number_changed(&mut numbers, DOUBLE_INTEGRATOR),
        };
        let place = Place::with(&text);
        let ended = place.lpv("design scenario.toml --out designs");
        keeps_the_contract(&ended, &text);
        if ended.code == 0 {
            for name in place.designs("designs") {
                certify(&place, &place.read(&format!("designs/{name}")));
            }
        }
        ended.code
    });
    let codes = counted(codes);
    assert!([0, 2].iter().all(|code| codes.get(code).is_some_and(|count| *count > 10)), "{codes:?}");
}

/// Semidefinite programs: a bound is never above the objective.
#[test]
fn programs_with_something_changed() {
    let (place, mut numbers) = (Place::with(""), Numbers(6));
    let texts = ["truss1.dat-s", "hinf1.dat-s"].map(|name| stored(&format!("../lmi/tests/data/{name}")));
    let codes = (0..80).map(|k| {
        let base = &texts[if k % 5 == 0 { 1 } else { 0 }];
        let text = if k % 2 == 0 { misspelt(&mut numbers, base) } else { with_a_number_changed(&mut numbers, base) };
        place.write("mutated.dat-s", &text);
        let ended = place.lpv("sdp mutated.dat-s --json");
        keeps_the_contract(&ended, &text);
        if ended.code == 0 {
            let record: Value = serde_json::from_str(&ended.out).unwrap_or_else(|_| panic!("{}\n{text}", ended.out));
            let (objective, bound) = (record["objective"].as_f64(), record["optimum_bound"].as_f64());
            let in_order =
                objective.zip(bound).is_none_or(|(objective, bound)| bound <= objective + 1e-9 * objective.abs());
            assert!(in_order, "{record}\n{text}");
        }
        ended.code
    });
    let codes = counted(codes);
    assert!([0, 2, 4].iter().all(|code| codes.get(code).is_some_and(|count| *count > 5)), "{codes:?}");
}
