//! Bounded-real inequalities of 99 plants of COMPleib with their H∞ norms (`tests/data/README.md`).
//!
//! Minimise g over −[AᵀP + PA + CᵀC, PB; BᵀP, −gI] ⪰ 0: the optimum is the square of the norm of C(sI − A)⁻¹B.

use lmi::{Answer, Expr, Mat, Options, Problem, sdpa};
use serde_json::Value;
use std::path::Path;

/// A plant with its norm.
struct Plant {
    name: String,
    norm: f64,
    a: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
}

fn plants() -> Vec<Plant> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bounded-real.json");
    let file: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let matrix = |value: &Value| {
        let rows: Vec<&Vec<Value>> = value.as_array().unwrap().iter().map(|row| row.as_array().unwrap()).collect();
        Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j].as_f64().unwrap())
    };
    let plant = |entry: &Value| Plant {
        name: entry["plant"].as_str().unwrap().to_owned(),
        norm: entry["norm"].as_f64().unwrap(),
        a: matrix(&entry["A"]),
        b: matrix(&entry["B"]),
        c: matrix(&entry["C"]),
    };
    file.as_array().unwrap().iter().map(plant).collect()
}

fn problem(Plant { a, b, c, .. }: &Plant) -> Problem {
    let (n, m) = (a.nrows(), b.ncols());
    let mut problem = Problem::new();
    let (p, g) = (problem.symmetric("P", n), problem.scalar("g"));
    let flow = a.transpose().to_owned() * &p + &p * a + Expr::constant(c.transpose() * c);
    let bounded = Expr::symmetric_blocks(vec![vec![-flow], vec![-(b.transpose().to_owned() * &p), g.times(&Mat::identity(m, m))]]);
    problem.positive_definite_by("bounded real", bounded, 0.0);
    problem.minimize(&g);
    problem
}

/// Whether the answer is called solved, to tolerance if need be, and the norm is right to 10⁻⁶.
fn right(plant: &Plant, answer: &Answer, form: &str) -> bool {
    let error = answer.objective.max(0.0).sqrt() / plant.norm - 1.0;
    let right = answer.outcome.is_optimal() && error.abs() <= 1e-6;
    println!(
        "{} {form:11} {:10} n {:2} {:?} error {error:9.1e} {:?} iterations {} attained {:?} bound {:?}",
        if right { "     " } else { "WRONG" },
        plant.name,
        plant.a.nrows(),
        answer.outcome,
        answer.residuals,
        answer.iterations.len(),
        answer.attained,
        answer.optimum_bound
    );
    right
}

#[test]
fn norms_of_plants() {
    let plants = plants();
    let mut counts = [0; 2];
    let mut words = std::collections::BTreeMap::new();
    for plant in &plants {
        let problem = problem(plant);
        let answer = problem.solve(&Options::default()).unwrap();
        *words.entry(answer.outcome.word()).or_insert(0) += 1;
        counts[0] += usize::from(right(plant, &answer, "expressions"));
        let mut file = Vec::new();
        sdpa::write(&problem.to_sdp(&Options::default()).unwrap(), &mut file).unwrap();
        let answer = sdpa::read(&file[..]).unwrap().solve(&Options::default()).unwrap();
        counts[1] += usize::from(right(plant, &answer, "file"));
    }
    println!("{counts:?} of {} {words:?}", plants.len());
    assert_eq!(counts, [plants.len(); 2]);
}
