//! V of a design: the one that is proved, at a parameter and an error.

use super::proof::lyapunov_form;
use crate::controller::cubic_weights;
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::matrix::{inverse_spd, quadratic_form};
use crate::plant::{Description, Plant};
use crate::synthesis::Design;
use std::f64::consts::TAU;

/// P(ρ) of a design as its proofs take it; of a frozen design whose P cannot be joined by harmonics (its parameter is not periodic), and of
/// which nothing is proved between the grid points, interpolated as a [`crate::controller::Schedule::Grid`] is.
pub struct LyapunovFunction<'a> {
    design: &'a Design,
    form: Option<super::proof::Form>,
    period: Option<f64>,
}

impl<'a> LyapunovFunction<'a> {
    /// Of a design for the plant that it names.
    pub fn of(design: &'a Design, plant: &dyn Plant) -> Self {
        let scheduling = plant.description().scheduling.as_ref();
        let period = scheduling.filter(|s| s.periodic).map(|s| s.range[1] - s.range[0]);
        Self { design, form: lyapunov_form(design, plant), period }
    }

    /// P(ρ)
    pub fn matrix(&self, rho: f64) -> Mat<f64> {
        if let Some(p) = self.form.as_ref().and_then(|form| form.p(rho)) {
            return p;
        }
        let points = &self.design.points;
        let parameters: Vec<f64> = points.iter().map(|point| point.rho).collect();
        let n = points[0].p.nrows();
        cubic_weights(&parameters, self.period, rho).fold(Mat::zeros(n, n), |sum, (k, weight)| {
            let p = &points[k].p;
            Mat::from_fn(n, n, |i, j| sum[(i, j)] + weight * p[(i, j)])
        })
    }

    /// A proved upper bound on V at the error x − `reference` and the parameter `rho`, exactly these numbers, angles that wrap taken to [−π, π);
    /// `None` where none is proved.
    pub fn at_most(&self, description: &Description, rho: f64, x: &[f64], reference: &[f64]) -> Option<f64> {
        let mut wrapped = vec![0.0; x.len()];
        description.state_error(x, reference, &mut wrapped);
        let exact = |i: usize| {
            let difference = Interval::point(x[i]) - reference[i];
            // the turn that the controller takes away
            let turns = ((difference.middle() - wrapped[i]) / TAU).round();
            if turns == 0.0 { difference } else { difference - Interval::tau() * turns }
        };
        let error: Vec<Interval> = (0..x.len()).map(exact).collect();
        self.form.as_ref()?.at_most(rho, &error)
    }

    /// V = eᵀP(ρ)e
    pub fn value(&self, rho: f64, error: &[f64]) -> f64 {
        quadratic_form(&self.matrix(rho), error)
    }
}

/// The largest γ such that u = −Kx does not saturate, |kᵢx| ≤ σᵢ, on xᵀPx ≤ γ: min σᵢ²/(kᵢP⁻¹kᵢᵀ) (Lemma 2.2).
pub fn unsaturated_level(p: &Mat<f64>, k: &Mat<f64>, sigma: &[f64]) -> f64 {
    let Some(y) = inverse_spd(p) else {
        return f64::NAN;
    };
    let level = |i: usize| {
        let row: Vec<f64> = (0..k.ncols()).map(|j| k[(i, j)]).collect();
        let size = quadratic_form(&y, &row).sqrt();
        // a row of zeros never reaches a limit
        if size == 0.0 { f64::INFINITY } else { (sigma[i] / size).powi(2) }
    };
    (0..k.nrows()).map(level).fold(f64::INFINITY, f64::min)
}
