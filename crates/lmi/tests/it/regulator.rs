//! The linear quadratic regulator as an LMI, against the closed form of its Riccati equation.

use crate::plants::{diagonal, matrix};
use lmi::{Expr, Options, Outcome, Problem};

/// ẍ = u with Q = diag(q², 0)-like weights: for Q = diag(q₁, q₂), R = r the Riccati equation of the double integrator gives
/// p₁₂ = √(q₁ r), p₂₂ = √(r (q₂ + 2 p₁₂)), p₁₁ = p₁₂ p₂₂ / r.
#[test]
fn double_integrator_matches_the_riccati_equation() {
    let (q1, q2, r) = (1.0_f64, 0.5_f64, 0.1_f64);
    let p12 = (q1 * r).sqrt();
    let p22 = (r * (q2 + 2.0 * p12)).sqrt();
    let p11 = p12 * p22 / r;
    let (a, b) = (matrix([[0.0, 1.0], [0.0, 0.0]]), matrix([[0.0], [1.0]]));

    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 2);
    let l = problem.rectangular("L", 1, 2);
    let s = &a * &y - &b * &l;
    problem.positive_definite(
        "Riccati",
        Expr::symmetric_blocks(vec![
            vec![-(&s + s.t())],
            vec![y.clone(), Expr::constant(diagonal(&[1.0 / q1, 1.0 / q2]))],
            vec![l.clone(), Expr::zeros(1, 2), Expr::constant(matrix([[1.0 / r]]))],
        ]),
    );
    problem.maximize(&y.trace());
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);

    // Y P = I to the square root of the gap: the objective is flat at the optimum.
    let y = answer.value(&y);
    let p = matrix([[p11, p12], [p12, p22]]);
    let product = &y * &p;
    for i in 0..2 {
        for j in 0..2 {
            let identity = if i == j { 1.0 } else { 0.0 };
            assert!((product[(i, j)] - identity).abs() < 1e-5, "Y P = {product:?}");
        }
    }
    let trace = (p11 + p22) / (p11 * p22 - p12 * p12);
    assert!((answer.objective - trace).abs() < 1e-7 * trace, "{} {trace}", answer.objective);
    // K = L Y⁻¹ = R⁻¹BᵀP.
    let k = answer.value(&l) * &p;
    assert!((k[(0, 0)] - p12 / r).abs() < 1e-3 && (k[(0, 1)] - p22 / r).abs() < 1e-3, "{k:?}");
}
