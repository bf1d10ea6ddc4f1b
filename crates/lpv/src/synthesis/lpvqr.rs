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
/// are both computed, and how far their traces differ is kept in the result.
pub(super) fn frozen(model: &FrozenModel, weights: &CostWeights) -> Result<FrozenDesign, SynthesisError> {
    let (y_inequality, _, iterations) = lqr_by_inequality(model, weights)?;
    let regulator = riccati::solve(&model.a, &model.b, &weights.q, &weights.r)
        .map_err(|source| SynthesisError::Riccati { rho: model.rho, source })?;
    let y = inverse_spd(&regulator.p).ok_or(SynthesisError::Unbounded { rho: model.rho })?;
    let trace_y = trace(&y);
    Ok(FrozenDesign {
        rho: model.rho,
        gain: regulator.k,
        auxiliary_gain: None,
        p: regulator.p,
        trace_y,
        riccati_difference: Some((trace(&y_inequality) / trace_y - 1.0).abs()),
        iterations,
    })
}
