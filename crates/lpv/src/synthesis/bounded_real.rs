//! The induced L2 norm of an LPV system with a bounded parameter rate: the bounded-real inequality as an analysis.
//!
//! For ẋ = A(ρ)x + B(ρ)w, z = C(ρ)x + D(ρ)w and V = xᵀP(ρ)x, P(ρ) = Σ fₖ(ρ)Pₖ ≻ 0 with
//!
//! ```text
//!   ⎡ ρ̇ ∂P/∂ρ + PA + AᵀP   PB    Cᵀ ⎤
//! − ⎢ BᵀP                  −γI   Dᵀ ⎥ ≻ 0
//!   ⎣ C                     D   −γI ⎦
//! ```
//!
//! at every ρ and |ρ̇| ≤ r gives ‖z‖₂ ≤ γ‖w‖₂ from x(0) = 0 (F. Wu, X. H. Yang, A. Packard and G. Becker, 1996; the inequality of
//! LPVTools' `lpvnorm`). For an unbounded rate P is constant. The inequalities are imposed on a grid of ρ; what lies between
//! its points is for [`crate::certificate`] to prove.

use super::SynthesisError;
use super::inequality::solve;
use crate::math::Mat;
use crate::math::matrix::symmetric_part;
use crate::math::scalar::{derivative, dual};
use crate::model::{BasisFunction, MatrixFunction};
use lmi::{Expr, Problem};
use serde::{Deserialize, Serialize};

/// ẋ = A(ρ)x + B(ρ)w, z = C(ρ)x + D(ρ)w with one parameter ρ in a range.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct InputOutputModel {
    /// A, n × n.
    pub a: MatrixFunction,
    /// B, n × m.
    pub b: MatrixFunction,
    /// C, p × n.
    pub c: MatrixFunction,
    /// D, p × m.
    pub d: MatrixFunction,
    /// Least and largest ρ.
    pub range: [f64; 2],
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainOptions {
    /// r ≥ 0; `None`: the parameter may jump.
    pub rate: Option<f64>,
    /// Degree of the polynomial P(ρ); 0 for an unbounded rate.
    pub degree: u32,
    /// Equidistant points of the range at which the inequality is imposed, at least 2.
    pub grid_points: usize,
}

/// A bound on the induced L2 norm, and the P(ρ) that shows it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GainBound {
    /// γ at the grid points.
    pub gain: f64,
    /// P(ρ) ≻ 0.
    pub p: MatrixFunction,
    /// r; `None`: any motion.
    pub rate: Option<f64>,
    /// Interior-point iterations.
    pub iterations: usize,
}

/// The least γ of the inequality on the grid.
///
/// # Errors
/// Infeasible (the system is not stable with such a P), unbounded or inaccurate.
///
/// # Panics
/// If the sizes of A, B, C and D do not fit.
pub fn induced_gain(model: &InputOutputModel, options: &GainOptions) -> Result<GainBound, SynthesisError> {
    let ((n, m), outputs) = (model.b.shape(), model.c.shape().0);
    assert!(model.a.shape() == (n, n) && model.c.shape() == (outputs, n) && model.d.shape() == (outputs, m));
    let degree = if options.rate.is_some() { options.degree } else { 0 };
    let basis = BasisFunction::powers(0, degree);
    let mut problem = Problem::new();
    let p: Vec<Expr> = (0..basis.len()).map(|k| problem.symmetric(format!("P{k}"), n)).collect();
    let gain = problem.scalar("gamma");
    let combine = |factor: &dyn Fn(&BasisFunction) -> f64| {
        basis.iter().zip(&p).fold(Expr::zeros(n, n), |sum, (function, p)| sum + factor(function) * p)
    };
    let [low, high] = model.range;
    for k in 0..options.grid_points {
        let rho = low + (high - low) * k as f64 / (options.grid_points.max(2) - 1) as f64;
        let [a, b, c, d] = [&model.a, &model.b, &model.c, &model.d].map(|function| function.at(&[rho]));
        let p = combine(&|function| function.at(&[rho]));
        let slope = combine(&|function| derivative(&function.at(&[dual(rho, Some(0))]), 0));
        for rate in ends(options.rate) {
            let flow = &p * &a;
            let block = Expr::symmetric_blocks(vec![
                vec![-1.0 * (rate * &slope + &flow + flow.t())],
                vec![-1.0 * (b.transpose().to_owned() * &p), gain.times(&Mat::identity(m, m))],
                vec![Expr::constant(-&c), Expr::constant(-&d), gain.times(&Mat::identity(outputs, outputs))],
            ]);
            problem.positive_definite(format!("gain at {rho:.4}, rate {rate:+}"), block);
        }
        problem.positive_definite(format!("P definite at {rho:.4}"), p);
    }
    problem.minimize(&gain);
    let answer = solve(&problem, low)?;
    let coefficients = p.iter().map(|p| symmetric_part(&answer.value(p))).collect();
    Ok(GainBound {
        gain: answer.value(&gain)[(0, 0)],
        p: MatrixFunction { basis, coefficients },
        rate: options.rate,
        iterations: answer.iterations.len(),
    })
}

fn ends(rate: Option<f64>) -> Vec<f64> {
    match rate {
        Some(rate) if rate > 0.0 => vec![-rate, rate],
        _ => vec![0.0],
    }
}
