//! SLPVQR: the quadratic regulator under input saturation, low gain, Theorem 5.3 (Theorem 5.1 without parameter).

use super::inequality::{InverseWeights, performance, solve, unsaturated};
use super::units::in_own_units;
use super::{CostWeights, FrozenDesign, SynthesisError};
use crate::math::matrix::{inverse_spd, symmetric_part, trace};
use crate::model::FrozenModel;
use lmi::Problem;

/// Theorem 5.3 at one parameter value: the largest tr Y such that u = −Kx meets the cost bound xᵀPx and does not
/// saturate, |kᵢx| ≤ σᵢ, on the ellipsoid xᵀPx ≤ γ.
pub(super) fn frozen(
    model: &FrozenModel,
    weights: &CostWeights,
    sigma: &[f64],
    gamma: f64,
) -> Result<FrozenDesign, SynthesisError> {
    in_own_units(model, weights, (sigma, gamma), in_its_units, |units, design| FrozenDesign {
        gain: units.gain(&design.gain),
        p: units.strict_p(&design.p),
        trace_y: units.strict_trace(design.trace_y),
        ..design
    })
}

/// The problem as it stands, whatever the size of its numbers.
fn in_its_units(
    model: &FrozenModel,
    weights: &CostWeights,
    sigma: &[f64],
    gamma: f64,
) -> Result<FrozenDesign, SynthesisError> {
    let (n, m) = (model.a.nrows(), model.b.ncols());
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", n);
    let l = problem.rectangular("L", m, n);
    problem.positive_definite("performance", performance(&y, &l, model, &InverseWeights::new(weights)));
    for (i, &bound) in sigma.iter().enumerate() {
        problem.positive_definite(format!("input {} unsaturated", i + 1), unsaturated(&y, l.row(i), bound, gamma));
    }
    problem.maximize(&y.trace());
    let answer = solve(&problem, model.rho)?;

    let y = symmetric_part(&answer.value(&y));
    let p = inverse_spd(&y).ok_or_else(|| not_definite(model.rho))?;
    Ok(FrozenDesign {
        rho: model.rho,
        gain: answer.value(&l) * &p,
        auxiliary_gain: None,
        trace_y: trace(&y),
        p,
        riccati_difference: None,
        iterations: answer.iterations.len(),
    })
}

/// Y of a solved problem is positive definite by the inequalities; anything else is an inaccuracy.
pub(super) fn not_definite(rho: f64) -> SynthesisError {
    SynthesisError::Inaccurate { rho, reason: "Y is not positive definite".into() }
}
