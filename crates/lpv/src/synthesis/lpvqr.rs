//! LPVQR: the quadratic regulator at each frozen parameter, Theorem 4.5 (Theorem 2.1 for a plant without parameter).

use super::inequality::{InverseWeights, performance, solve};
use super::{CostWeights, FrozenDesign, SynthesisError};
use crate::math::Mat;
use crate::math::matrix::{inverse_spd, trace};
use crate::math::riccati;
use crate::model::FrozenModel;
use lmi::Problem;

/// Theorem 2.1 by linear matrix inequality: max tr Y subject to the performance inequality. Returns (Y, L).
///
/// # Errors
/// Infeasible, unbounded or inaccurate, with the parameter.
pub fn lqr_by_inequality(
    model: &FrozenModel,
    weights: &CostWeights,
) -> Result<(Mat<f64>, Mat<f64>, usize), SynthesisError> {
    let (n, m) = (model.a.nrows(), model.b.ncols());
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", n);
    let l = problem.rectangular("L", m, n);
    problem.positive_definite("performance", performance(&y, &l, model, &InverseWeights::new(weights)));
    problem.maximize(&y.trace());
    let answer = solve(&problem, model.rho)?;
    Ok((answer.value(&y), answer.value(&l), answer.iterations.len()))
}

/// Theorem 4.5 at one parameter value. The inequality's optimum is the Riccati solution, which gives the gain; the two
/// are both computed, and how far their traces differ is kept in the result where the solver reaches it.
pub(super) fn frozen(model: &FrozenModel, weights: &CostWeights) -> Result<FrozenDesign, SynthesisError> {
    let regulator = riccati::solve(&model.a, &model.b, &weights.q, &weights.r)
        .map_err(|source| SynthesisError::Riccati { rho: model.rho, source })?;
    let reason = || "P of the Riccati equation is not positive definite after rounding".to_owned();
    let y = inverse_spd(&regulator.p).ok_or_else(|| SynthesisError::Inaccurate { rho: model.rho, reason: reason() })?;
    let trace_y = trace(&y);
    // the solver may stop short where weights or states differ much in size; the gain does not need it
    let by_inequality = lqr_by_inequality(model, weights).ok();
    Ok(FrozenDesign {
        rho: model.rho,
        gain: regulator.k,
        auxiliary_gain: None,
        p: regulator.p,
        trace_y,
        riccati_difference: by_inequality.as_ref().map(|(y, ..)| (trace(y) / trace_y - 1.0).abs()),
        iterations: by_inequality.map_or(0, |(.., iterations)| iterations),
    })
}
