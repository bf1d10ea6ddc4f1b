//! Does a set-point step start inside the certified set?

use crate::controller::cubic_weights;
use crate::math::Mat;
use crate::math::matrix::{inverse_spd, quadratic_form};
use crate::plant::Scheduling;
use crate::synthesis::Design;
use serde::Serialize;

/// A set-point step against the certified set of a design.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CertifiedStep {
    /// eᵀP(ρ)e: the bound on the cost of the step, if it is certified.
    pub bound: f64,
    /// Level of the certified set; `None` where inputs are not limited and the set is everything.
    pub level: Option<f64>,
}

impl CertifiedStep {
    /// Whether the step starts inside the certified set.
    pub fn is_inside(&self) -> bool {
        self.level.is_none_or(|level| self.bound <= level)
    }
}

/// The step that starts with error `error` = x − x_ref at parameter `rho`; `scheduling` is the plant's.
///
/// The level is γ for the saturated methods; for LPVQR with limited inputs it is [`unsaturated_level`]. Between grid
/// points P is interpolated as a [`crate::controller::Schedule::Grid`] is.
pub fn certified_step(
    design: &Design,
    scheduling: Option<&Scheduling>,
    rho: f64,
    error: &[f64],
) -> CertifiedStep {
    let p = lyapunov_matrix(design, scheduling, rho);
    let level = design.method.gamma().or_else(|| {
        let sigma = design
            .controller
            .limits
            .symmetric_bound(&design.controller.operating_input)?;
        Some(unsaturated_level(
            &p,
            &design.controller.schedule.gain_matrix(rho),
            &sigma,
        ))
    });
    CertifiedStep {
        bound: quadratic_form(&p, error),
        level,
    }
}

/// The largest γ such that u = −Kx does not saturate, |kᵢx| ≤ σᵢ, on xᵀPx ≤ γ: min σᵢ²/(kᵢP⁻¹kᵢᵀ) (Lemma 2.2).
pub fn unsaturated_level(p: &Mat<f64>, k: &Mat<f64>, sigma: &[f64]) -> f64 {
    let Some(y) = inverse_spd(p) else {
        return f64::NAN;
    };
    let level = |i: usize| {
        let row: Vec<f64> = (0..k.ncols()).map(|j| k[(i, j)]).collect();
        sigma[i] * sigma[i] / quadratic_form(&y, &row)
    };
    (0..k.nrows()).map(level).fold(f64::INFINITY, f64::min)
}

/// P(ρ) of a frozen design.
fn lyapunov_matrix(design: &Design, scheduling: Option<&Scheduling>, rho: f64) -> Mat<f64> {
    let parameters: Vec<f64> = design.points.iter().map(|point| point.rho).collect();
    let period = scheduling
        .filter(|s| s.periodic)
        .map(|s| s.range[1] - s.range[0]);
    let n = design.points[0].p.nrows();
    cubic_weights(&parameters, period, rho).into_iter().fold(
        Mat::zeros(n, n),
        |sum, (k, weight)| {
            let p = &design.points[k].p;
            Mat::from_fn(n, n, |i, j| sum[(i, j)] + weight * p[(i, j)])
        },
    )
}
