//! Backing off from the optimum, so that every inequality holds strictly and for the gain that flies.
//!
//! The optimum of tr Y lies on the boundary of its inequalities, and the scheduled gain is the designed one only up to the
//! error of the schedule. Both are mended by a slightly larger P: for W(P) = P(A − BK) + (A − BK)ᵀP + Q + KᵀRK ⪯ 0
//!
//! ```text
//! W((1 + ε)P) = (1 + ε) W(P) − ε (Q + KᵀRK) ≺ 0,
//! ```
//!
//! and |kx| ≤ σ on xᵀPx ≤ γ becomes strict on (1 + ε)xᵀPx ≤ γ. The price is a cost bound larger, and a certified set
//! smaller, by the factor 1 + ε.

use super::{CostWeights, FrozenDesign, RateBounded};
use crate::controller::Schedule;
use crate::math::Mat;
use crate::math::matrix::{inverse_spd, quadratic_form};
use crate::model::FrozenModel;

/// The ε that are tried, smallest first.
const FACTORS: [f64; 5] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2];
/// The largest ε of a design for a moving parameter: what needs more is met by a finer schedule or a finer grid.
const LARGEST_MOVING: f64 = 1e-3;
/// What is added to the ε of a design for a moving parameter, so that a proof does not need cells without number: what holds by
/// ε on the cell's middle holds on a cell of width √ε.
const PROOF_MARGIN: f64 = 1e-3;

/// Σ of the saturated methods: the bounds σᵢ of the inputs and the level γ.
pub(super) struct Saturation<'a> {
    pub sigma: &'a [f64],
    pub gamma: f64,
}

/// Replace every P by (1 + ε)P with the least ε of 10⁻⁶ … 10⁻² for which all inequalities hold with the scheduled gain, and
/// return it. If none suffices the last is taken; the check of the design then says what fails.
pub(super) fn back_off(
    points: &mut [FrozenDesign],
    models: &[FrozenModel],
    weights: &CostWeights,
    schedule: &Schedule,
    saturation: Option<&Saturation>,
) -> f64 {
    let scaled = |p: &Mat<f64>, factor: f64| Mat::from_fn(p.nrows(), p.ncols(), |i, j| (1.0 + factor) * p[(i, j)]);
    let suffices = |factor: &f64| {
        points.iter().zip(models).all(|(point, model)| {
            let gain = schedule.gain_matrix(point.rho);
            let p = scaled(&point.p, *factor);
            let unsaturated = point.auxiliary_gain.as_ref().unwrap_or(&gain);
            saturation.is_none_or(|saturation| stays_unsaturated(&p, unsaturated, saturation))
                && mixtures_hold(model, weights, &p, &gain, point.auxiliary_gain.as_ref(), None)
        })
    };
    let factor = FACTORS.into_iter().find(suffices).unwrap_or(FACTORS[FACTORS.len() - 1]);
    for point in points {
        point.p = scaled(&point.p, factor);
    }
    factor
}

/// Whether every mixture S of the rows of K and F (K alone without an F) meets the cost bound xᵀPx:
/// P(A − BS) + (A − BS)ᵀP ± Ṗ + Q + SᵀRS ≺ 0 (A.48), by Cholesky factorisation; Ṗ is `p_rate`, zero without it.
pub(super) fn mixtures_hold(
    model: &FrozenModel,
    weights: &CostWeights,
    p: &Mat<f64>,
    k: &Mat<f64>,
    auxiliary: Option<&Mat<f64>>,
    p_rate: Option<&Mat<f64>>,
) -> bool {
    let all = (1usize << k.nrows()) - 1;
    let vertices = if auxiliary.is_some() { 0..all + 1 } else { all..all + 1 };
    let f = auxiliary.unwrap_or(k);
    vertices.into_iter().all(|vertex| {
        let s = Mat::from_fn(k.nrows(), k.ncols(), |i, j| if vertex >> i & 1 == 1 { k[(i, j)] } else { f[(i, j)] });
        let flow = p * (&model.a - &model.b * &s);
        let decrease = &flow + flow.transpose() + &weights.q + s.transpose() * &weights.r * &s;
        let is_negative = |matrix: Mat<f64>| {
            inverse_spd(&Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| -matrix[(i, j)])).is_some()
        };
        match p_rate {
            None => is_negative(decrease),
            Some(rate) => is_negative(&decrease + rate) && is_negative(&decrease - rate),
        }
    })
}

/// [`back_off`] for a parameter that moves, over the linearisations `models` between the grid points too: the least ε for
/// which everything holds with the scheduled gain at both ends of the rate interval; `None` if none of
/// them up to 10⁻³ does.
pub(super) fn back_off_moving(
    lyapunov: &mut RateBounded,
    models: &[FrozenModel],
    weights: &CostWeights,
    schedule: &Schedule,
    is_high_gain: bool,
    saturation: Option<&Saturation>,
) -> Option<f64> {
    let suffices = |factor: &f64| {
        let mut scaled = lyapunov.clone();
        scaled.back_off(1.0 + factor);
        models.iter().all(|model| {
            let (Some(p), Some(p_rate)) = (scaled.p(model.rho), scaled.p_rate(model.rho)) else { return false };
            let gain = schedule.gain_matrix(model.rho);
            let auxiliary = if is_high_gain { scaled.unsaturated_gain(model.rho) } else { None };
            let unsaturated = auxiliary.as_ref().unwrap_or(&gain);
            saturation.is_none_or(|saturation| stays_unsaturated(&p, unsaturated, saturation))
                && mixtures_hold(model, weights, &p, &gain, auxiliary.as_ref(), Some(&p_rate))
        })
    };
    let factor = FACTORS.into_iter().filter(|&factor| factor <= LARGEST_MOVING).find(suffices)?;
    let factor = factor + PROOF_MARGIN;
    lyapunov.back_off(1.0 + factor);
    Some(factor)
}

/// Whether kᵢP⁻¹kᵢᵀ < σᵢ²/γ for every row (Lemma 2.2).
fn stays_unsaturated(p: &Mat<f64>, k: &Mat<f64>, saturation: &Saturation) -> bool {
    let Some(y) = inverse_spd(p) else { return false };
    (0..k.nrows()).all(|i| {
        let row: Vec<f64> = (0..k.ncols()).map(|j| k[(i, j)]).collect();
        quadratic_form(&y, &row) < saturation.sigma[i].powi(2) / saturation.gamma
    })
}
