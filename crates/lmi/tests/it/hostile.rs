//! Data that no one should send: an outcome or an error, never a panic, a NaN that is called solved, or an endless loop.

use lmi::sdpa::{BlockShape, Coefficient, Sdp};
use lmi::{Answer, Error, Options, Outcome};
use proptest::prelude::*;
use std::time::Duration;

fn options() -> Options {
    Options { time_limit: Some(Duration::from_secs(20)), ..Options::default() }
}

fn entry(unknown: Option<usize>, block: usize, row: usize, column: usize, value: f64) -> Coefficient {
    Coefficient { unknown, block, row, column, value }
}

/// What holds of every answer.
fn sane(answer: &Answer) {
    if let Outcome::Solved = answer.outcome {
        assert!(answer.objective.is_finite() && answer.gap.is_finite());
        assert!(answer.residuals.gap <= 1e-7 && answer.residuals.primal <= 1e-7);
    }
    assert!(answer.iterations.len() <= 200);
}

#[test]
fn one_by_one() {
    // minimise x with x − 2 ⪰ 0.
    let coefficients = vec![entry(None, 0, 0, 0, 2.0), entry(Some(0), 0, 0, 0, 1.0)];
    for shape in [BlockShape::Symmetric(1), BlockShape::Diagonal(1)] {
        let problem = Sdp { objective: vec![1.0], blocks: vec![shape], coefficients: coefficients.clone() };
        let answer = problem.solve(&options()).unwrap();
        assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
        assert!((answer.objective - 2.0).abs() < 1e-7);
    }
}

#[test]
fn zero_blocks_and_zero_matrices() {
    // A block that is zero for every x, one that is zero in all but one unknown.
    let problem = Sdp {
        objective: vec![1.0, 0.0],
        blocks: vec![BlockShape::Symmetric(2), BlockShape::Symmetric(2)],
        coefficients: vec![
            entry(Some(0), 1, 0, 0, 1.0),
            entry(Some(0), 1, 1, 1, 1.0),
            entry(Some(1), 1, 0, 1, 0.0),
            entry(None, 1, 0, 0, 1.0),
        ],
    };
    let answer = problem.solve(&options()).unwrap();
    sane(&answer);
    assert!((answer.objective - 1.0).abs() < 1e-4, "{} {:?}", answer.objective, answer.outcome);
}

#[test]
fn repeated_entries_add_up() {
    let problem = Sdp {
        objective: vec![1.0],
        blocks: vec![BlockShape::Symmetric(2)],
        coefficients: vec![
            entry(Some(0), 0, 0, 0, 0.5),
            entry(Some(0), 0, 0, 0, 0.5),
            entry(Some(0), 0, 1, 1, 1.0),
            entry(None, 0, 0, 1, 1.0),
            entry(None, 0, 1, 0, 2.0),
        ],
    };
    let answer = problem.solve(&options()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
    assert!((answer.objective - 3.0).abs() < 1e-6);
}

#[test]
fn no_block_or_a_place_that_does_not_exist() {
    let solve = |blocks: Vec<BlockShape>, c: Coefficient| {
        Sdp { objective: vec![1.0], blocks, coefficients: vec![c] }.solve(&options())
    };
    let square = vec![BlockShape::Symmetric(2)];
    assert!(matches!(solve(vec![], entry(None, 0, 0, 0, 1.0)), Err(Error::NoConstraint)));
    for c in [entry(None, 1, 0, 0, 1.0), entry(Some(1), 0, 0, 0, 1.0), entry(None, 0, 0, 2, 1.0)] {
        assert!(matches!(solve(square.clone(), c), Err(Error::BadCoefficient { .. })));
    }
    let diagonal = vec![BlockShape::Diagonal(2)];
    assert!(matches!(solve(diagonal, entry(None, 0, 0, 1, 1.0)), Err(Error::BadCoefficient { .. })));
    assert!(matches!(solve(square.clone(), entry(None, 0, 0, 0, f64::NAN)), Err(Error::NotFinite { .. })));
    assert!(matches!(solve(square, entry(Some(0), 0, 0, 0, f64::INFINITY)), Err(Error::NotFinite { .. })));
    let objective = Sdp { objective: vec![f64::NAN], blocks: vec![BlockShape::Diagonal(1)], coefficients: vec![] };
    assert!(matches!(objective.solve(&options()), Err(Error::NotFinite { .. })));
    let large = Sdp { objective: vec![0.0; 30_000], blocks: vec![BlockShape::Diagonal(1)], coefficients: vec![] };
    assert!(matches!(large.solve(&options()), Err(Error::TooLarge { unknowns: 30_000, .. })));
}

#[test]
fn no_interior() {
    // [x, 1; 1, 0] ⪰ 0 has no solution but comes arbitrarily close: no witness exists, and Solved would be wrong.
    let problem = Sdp {
        objective: vec![1.0],
        blocks: vec![BlockShape::Symmetric(2)],
        coefficients: vec![entry(Some(0), 0, 0, 0, 1.0), entry(None, 0, 0, 1, -1.0)],
    };
    let answer = problem.solve(&options()).unwrap();
    assert!(!matches!(answer.outcome, Outcome::Solved | Outcome::Unbounded(_)), "{:?}", answer.outcome);
    // [x, y; y, 0] ⪰ 0 has solutions (y = 0) but no interior.
    let problem = Sdp {
        objective: vec![1.0, 1.0],
        blocks: vec![BlockShape::Symmetric(2)],
        coefficients: vec![entry(Some(0), 0, 0, 0, 1.0), entry(Some(1), 0, 0, 1, 1.0)],
    };
    sane(&problem.solve(&options()).unwrap());
}

fn any_scale() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0,
        1 => Just(0.0),
        1 => prop::num::f64::NORMAL,
        1 => (-12_i32..12).prop_map(|e| 10.0_f64.powi(e)),
        1 => Just(f64::MAX),
        1 => Just(f64::MIN_POSITIVE),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, ..ProptestConfig::default() })]

    #[test]
    fn any_finite_data(
        objective in prop::collection::vec(any_scale(), 1..5),
        sizes in prop::collection::vec((1_usize..5, any::<bool>()), 1..3),
        entries in prop::collection::vec((0_usize..5, 0_usize..3, 0_usize..5, 0_usize..5, any_scale()), 0..25),
    ) {
        let blocks: Vec<BlockShape> = sizes
            .iter()
            .map(|&(n, diagonal)| if diagonal { BlockShape::Diagonal(n) } else { BlockShape::Symmetric(n) })
            .collect();
        let coefficients = entries
            .iter()
            .map(|&(unknown, block, row, column, value)| {
                let block = block % blocks.len();
                let n = blocks[block].size();
                let column = if matches!(blocks[block], BlockShape::Diagonal(_)) { row } else { column };
                let unknown = (unknown % (objective.len() + 1)).checked_sub(1);
                entry(unknown, block, row % n, column % n, value)
            })
            .collect();
        let problem = Sdp { objective, blocks, coefficients };
        sane(&problem.solve(&options()).unwrap());
    }
}
