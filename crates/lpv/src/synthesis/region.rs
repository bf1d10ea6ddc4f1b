//! How large the certified set of a saturated design has to be to cover a given error.

use super::{CostWeights, SynthesisError, slpvqr};
use crate::math::matrix::quadratic_form;
use crate::model::FrozenModel;

/// The least γ ≥ `from`, to 1 %, for which the design of Theorem 5.3 (or 5.4: the two have the same P) covers `error`,
/// eᵀPe ≤ γ; `None` when no γ up to 10⁶ does.
///
/// P depends on γ, so this designs anew at each trial. The certified set grows with γ, and bisection on log γ finds the
/// least.
///
/// # Errors
/// A trial design that fails.
pub fn covering_level(
    model: &FrozenModel,
    weights: &CostWeights,
    sigma: &[f64],
    error: &[f64],
    from: f64,
) -> Result<Option<f64>, SynthesisError> {
    let covers = |gamma: f64| {
        slpvqr::frozen(model, weights, sigma, gamma).map(|design| quadratic_form(&design.p, error) <= gamma)
    };
    let (mut low, mut high) = (from, from);
    while !covers(high)? {
        low = high;
        high *= 10.0;
        if high > 1e6 {
            return Ok(None);
        }
    }
    while high / low > 1.01 {
        let middle = (high * low).sqrt();
        if covers(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(Some(high))
}
