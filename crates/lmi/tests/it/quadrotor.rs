//! The saturated quadratic regulators of a quadrotor, whose optima three other solvers agree on.

use crate::plants::{Plant, diagonal, matrix, quadrotor};
use lmi::{Answer, Expr, Mat, Options, Outcome, Problem};

/// mg/4 in newton.
const SIGMA: f64 = 2.0 * 9.807 / 4.0;

/// [−s − sᵀ, Y, Lᵀ; Y, Q⁻¹, 0; L, 0, R⁻¹] for s = AY − BL.
fn riccati(plant: &Plant, y: &Expr, l: &Expr) -> Expr {
    let (n, m) = (plant.a.nrows(), plant.b.ncols());
    let s = &plant.a * y - &plant.b * l;
    Expr::symmetric_blocks(vec![
        vec![-(&s + s.t())],
        vec![y.clone(), Expr::from(&plant.q_inverse)],
        vec![l.clone(), Expr::zeros(m, n), Expr::from(&plant.r_inverse)],
    ])
}

fn saturation(y: &Expr, row: Expr, gamma: f64) -> Expr {
    let bound = Expr::constant(matrix([[SIGMA * SIGMA / gamma]]));
    Expr::symmetric_blocks(vec![vec![bound], vec![row.t(), y.clone()]])
}

/// The low-gain design: all rows of one L are bounded.
pub fn low_gain(gamma: f64) -> (Problem, Expr) {
    let plant = quadrotor(0.3);
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 12);
    let l = problem.rectangular("L", 4, 12);
    problem.positive_definite("Riccati", riccati(&plant, &y, &l));
    for i in 0..4 {
        problem.positive_definite(format!("saturation {i}"), saturation(&y, l.row(i), gamma));
    }
    problem.maximize(&y.trace());
    (problem, y)
}

/// The high-gain design: every mixture of rows of L and M, the rows of M bounded.
pub fn high_gain(gamma: f64) -> (Problem, Expr) {
    high_gain_at(&quadrotor(0.3), gamma)
}

/// The same for any yaw.
pub fn high_gain_at(plant: &Plant, gamma: f64) -> (Problem, Expr) {
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 12);
    let l = problem.rectangular("L", 4, 12);
    let m = problem.rectangular("M", 4, 12);
    for vertex in 0..16_u32 {
        let v: Vec<f64> = (0..4).map(|i| f64::from(vertex >> i & 1)).collect();
        let s = diagonal(&v) * &l + (Mat::<f64>::identity(4, 4) - diagonal(&v)) * &m;
        problem.positive_definite(format!("Riccati {v:?}"), riccati(plant, &y, &s));
    }
    for i in 0..4 {
        problem.positive_definite(format!("saturation {i}"), saturation(&y, m.row(i), gamma));
    }
    problem.maximize(&y.trace());
    (problem, y)
}

fn check(problem: &Problem, y: &Expr, expected: f64) -> Answer {
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}, {:?}", answer.outcome, answer.residuals);
    // The expected values have six decimals.
    assert!((answer.objective - expected).abs() < 6e-7, "tr Y = {:.9}, {expected} expected", answer.objective);
    assert!((answer.value(&y.trace())[(0, 0)] - answer.objective).abs() < 1e-12);
    assert!(answer.residuals.gap <= 1e-7 && answer.residuals.dual <= 1e-7);
    for block in &answer.blocks {
        assert!(block.smallest_eigenvalue > 0.0, "{block:?}");
    }
    answer
}

#[test]
fn low_gain_optimum_over_gamma() {
    for (gamma, expected) in [(1.0, 5.472401), (10.0, 5.146219), (20.0, 5.087519)] {
        let (problem, y) = low_gain(gamma);
        check(&problem, &y, expected);
    }
}

#[test]
fn high_gain_has_the_same_optimum() {
    for (gamma, expected) in [(1.0, 5.472401), (10.0, 5.146219), (20.0, 5.087519)] {
        let (problem, y) = high_gain(gamma);
        check(&problem, &y, expected);
    }
}
