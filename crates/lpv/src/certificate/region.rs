//! What a design's bound is worth for one step of a flight.

use super::Verdict;
use crate::controller::cubic_weights;
use crate::math::Mat;
use crate::math::matrix::{inverse_spd, quadratic_form};
use crate::plant::Scheduling;
use crate::synthesis::Design;
use serde::Serialize;

/// A parameter rate up to this, per second, is rest: what the solver's accuracy, a relative 1e-6 in the gains, leaves of a
/// heading that nothing turns.
const REST_RATE: f64 = 1e-5;

/// How a step was flown, as far as the bound asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepConditions<'a> {
    /// x − x_ref at its start.
    pub error: &'a [f64],
    /// Scheduling parameter at its start.
    pub parameter: f64,
    /// Largest rate of the parameter during the step, per second.
    pub peak_parameter_rate: f64,
    /// Whether noise acted on the plant or its measurements.
    pub noise: bool,
}

/// A condition of the cost bound that a step does not meet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum UnmetCondition {
    /// It starts outside the certified set: eᵀPe > level.
    Outside {
        /// Level of the set.
        level: f64,
    },
    /// The parameter moves faster than the design is for; a frozen design is for a parameter at rest.
    ParameterMoves {
        /// At up to this rate, per second.
        rate: f64,
    },
    /// Noise acts, of which the bound knows nothing.
    Noise,
}

/// The cost bound of a step, and what it is worth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepBound {
    /// eᵀP(ρ)e: the bound on the cost of the step, if every condition is met.
    pub bound: f64,
    /// Level of the certified set; `None` where inputs are not limited and the set is everything.
    pub level: Option<f64>,
    /// The conditions that are not met.
    pub unmet: Vec<UnmetCondition>,
}

impl StepBound {
    /// Whether the step starts inside the certified set.
    pub fn is_inside(&self) -> bool {
        !self.unmet.iter().any(|condition| matches!(condition, UnmetCondition::Outside { .. }))
    }

    /// `numerical` if every condition is met, else `undecided`: a bound out of its conditions says nothing.
    pub fn verdict(&self) -> Verdict {
        if self.unmet.is_empty() { Verdict::Numerical } else { Verdict::Undecided }
    }
}

/// The bound of a step flown with `design`; `scheduling` is the plant's.
///
/// The level is γ for the saturated methods; for LPVQR with limited inputs it is [`unsaturated_level`]. Between grid
/// points P is interpolated as a [`crate::controller::Schedule::Grid`] is.
pub fn step_bound(design: &Design, scheduling: Option<&Scheduling>, step: &StepConditions) -> StepBound {
    let p = lyapunov_matrix(design, scheduling, step.parameter);
    let level = design.method.gamma().or_else(|| {
        let sigma = design.controller.limits.room(&design.controller.operating_input);
        sigma.iter().any(|sigma| sigma.is_finite()).then_some(())?;
        let schedule = &design.controller.schedule;
        let at_rest = unsaturated_level(&p, &schedule.gain_matrix(step.parameter), &sigma);
        // where the parameter may move the state has to stay inside at every value of it
        let moving = design.points.iter().filter(|_| design.rate_bounded.is_some());
        Some(moving.fold(at_rest, |level, point| {
            level.min(unsaturated_level(&point.p, &schedule.gain_matrix(point.rho), &sigma))
        }))
    });
    let bound = quadratic_form(&p, step.error);
    let outside = level.filter(|&level| bound.is_nan() || bound > level).map(|level| UnmetCondition::Outside { level });
    let rate = step.peak_parameter_rate;
    let allowed = design.rate_bounded.as_ref().map_or(REST_RATE, |bounded| bounded.rate);
    let moves = (rate.is_nan() || rate > allowed).then_some(UnmetCondition::ParameterMoves { rate });
    let noise = step.noise.then_some(UnmetCondition::Noise);
    StepBound { bound, level, unmet: [outside, moves, noise].into_iter().flatten().collect() }
}

/// When a flight was beyond what a bound is for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Excursion {
    /// First time beyond.
    pub from_s: f64,
    /// Last time beyond.
    pub to_s: f64,
    /// Time beyond in between, altogether.
    pub total_s: f64,
}

/// The excursion over samples at `times`, each of which stands for the time up to the next; `None` if none `is_beyond`.
pub fn excursion(times: &[f64], is_beyond: impl Fn(usize) -> bool) -> Option<Excursion> {
    let mut found: Option<Excursion> = None;
    for k in (0..times.len()).filter(|&k| is_beyond(k)) {
        let until = times.get(k + 1).copied().unwrap_or(times[k]);
        let so_far = found.get_or_insert(Excursion { from_s: times[k], to_s: until, total_s: 0.0 });
        so_far.to_s = until;
        so_far.total_s += until - times[k];
    }
    found
}

/// V = eᵀP(ρ)e for the error e, with P between the grid points as in [`step_bound`].
pub fn lyapunov_value(design: &Design, scheduling: Option<&Scheduling>, rho: f64, error: &[f64]) -> f64 {
    quadratic_form(&lyapunov_matrix(design, scheduling, rho), error)
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

/// P(ρ): of a frozen design interpolated, of a rate-bounded one its inverse.
fn lyapunov_matrix(design: &Design, scheduling: Option<&Scheduling>, rho: f64) -> Mat<f64> {
    if let Some(p) = design.rate_bounded.as_ref().and_then(|bounded| bounded.p(rho)) {
        return p;
    }
    let parameters: Vec<f64> = design.points.iter().map(|point| point.rho).collect();
    let period = scheduling.filter(|s| s.periodic).map(|s| s.range[1] - s.range[0]);
    let n = design.points[0].p.nrows();
    cubic_weights(&parameters, period, rho).fold(Mat::zeros(n, n), |sum, (k, weight)| {
        let p = &design.points[k].p;
        Mat::from_fn(n, n, |i, j| sum[(i, j)] + weight * p[(i, j)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excursions_say_when_and_for_how_long() {
        let times = [0.0, 0.5, 1.0, 1.5, 2.0];
        assert_eq!(excursion(&times, |_| false), None);
        let beyond = excursion(&times, |k| k == 1 || k == 3).unwrap();
        assert_eq!(beyond, Excursion { from_s: 0.5, to_s: 2.0, total_s: 1.0 });
    }
}
