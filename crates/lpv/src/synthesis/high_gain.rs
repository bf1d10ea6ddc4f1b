//! High-gain SLPVQR: the quadratic regulator under input saturation that is allowed to saturate, Theorem 5.4
//! (Theorem 5.2 without parameter).
//!
//! An auxiliary gain F = MY⁻¹ stays unsaturated on the ellipsoid; the gain K = LY⁻¹ itself may saturate there, as long as
//! every mixture S(v, K, F), row i of K where vᵢ = 1 and of F where vᵢ = 0, meets the cost bound.
//!
//! # Which gain
//!
//! The objective tr Y does not see L, so the inequalities leave the gain open. Three facts decide:
//!
//! * The gain of least norm among the optimal designs is F itself, the low gain: K = F satisfies all 2^m inequalities.
//!   Least norm alone gives back Theorem 5.3 and nothing is won.
//! * With diagonal R every gain K_s = F + s(R⁻¹BᵀP − F), 0 ≤ s ≤ 1, satisfies them: the inequality's left side with row i
//!   of K_s instead of F grows by rᵢ(1 − (1 − s)²)(fᵢ − kᵢ*)ᵀ(fᵢ − kᵢ*) ⪰ 0 for k* = R⁻¹BᵀP.
//! * At s = 1 the gains are far too high for a controller that samples: on the quadrotor 10⁵, spectral radius 45 at 2 ms.
//!
//! So the design is the least-norm gain on the segment K_s that is as good as high gain can be where it counts, near the
//! set point. Its cost there without saturation, averaged over the level set of the unsaturated regulator,
//! c(s) = tr(X_s P₀⁻¹)/n with X_s the cost matrix of K_s and P₀ the Riccati solution, falls steeply from s = 0, is flat
//! around its least value and rises slowly again. The least s with c(s) ≤ (1 + [`recovery`](HighGainOptions::recovery))
//! min c is taken, among those s whose sampled loop is stable with the gain margin
//! [`gain_margin`](HighGainOptions::gain_margin). All grid points get the smallest of their s, so that K is smooth in ρ;
//! each mixture is then verified at it.

use super::back_off::mixtures_hold;
use super::inequality::{InverseWeights, performance, solve, unsaturated};
use super::slpvqr::{self, not_definite};
use super::units::in_own_units;
use super::{CostWeights, FrozenDesign, RateBounded, SynthesisError};
use crate::math::eigen::spectral_radius;
use crate::math::hold::discretize;
use crate::math::matrix::{inverse_spd, is_diagonal, symmetric_part, trace};
use crate::math::{Mat, lyapunov, riccati};
use crate::model::FrozenModel;
use lmi::{Expr, Problem};
use serde::{Deserialize, Serialize};

/// How the gain of a high-gain design is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HighGainOptions {
    /// Fraction by which the unsaturated cost may exceed its least value on the segment, for the sake of a smaller gain.
    pub recovery: f64,
    /// Factor by which the gain may grow before the sampled loop loses stability, at least.
    pub gain_margin: f64,
}

impl Default for HighGainOptions {
    fn default() -> Self {
        Self { recovery: 0.05, gain_margin: 2.0 }
    }
}

/// What Theorem 5.4 leaves: the certified P, the auxiliary gain and the other end of the segment.
pub(super) struct Segment {
    rho: f64,
    p: Mat<f64>,
    /// Ṗ at the largest rate, where the parameter may move.
    p_rate: Option<Mat<f64>>,
    /// F = K_0
    low: Mat<f64>,
    /// R⁻¹BᵀP = K_1
    high: Mat<f64>,
    trace_y: f64,
    iterations: usize,
}

/// The rows of L where `v` is set and of M elsewhere: S(v, L, M) (5.11).
pub(super) fn mixture(vertex: usize, l: &Expr, m: &Expr) -> Expr {
    let selector = |bit: usize| {
        Mat::from_fn(l.nrows(), l.nrows(), |i, j| if i == j && (vertex >> i & 1) == bit { 1.0 } else { 0.0 })
    };
    selector(1) * l + selector(0) * m
}

/// Theorem 5.4 at one parameter value. With diagonal R its optimum is that of Theorem 5.3, with L = M (see the module); else all 2^m mixtures
/// are inequalities.
pub(super) fn segment(
    model: &FrozenModel,
    weights: &CostWeights,
    sigma: &[f64],
    gamma: f64,
) -> Result<Segment, SynthesisError> {
    if is_diagonal(&weights.r) {
        let low = slpvqr::frozen(model, weights, sigma, gamma)?;
        let high = InverseWeights::new(weights).r * model.b.transpose() * &low.p;
        let FrozenDesign { rho, gain, p, trace_y, iterations, .. } = low;
        return Ok(Segment { rho, low: gain, high, trace_y, p, p_rate: None, iterations });
    }
    in_own_units(model, weights, (sigma, gamma), of_mixtures, |units, segment| Segment {
        p: units.strict_p(&segment.p),
        low: units.gain(&segment.low),
        high: units.gain(&segment.high),
        trace_y: units.strict_trace(segment.trace_y),
        ..segment
    })
}

/// All 2^m mixtures, as the problem stands, whatever the size of its numbers.
fn of_mixtures(
    model: &FrozenModel,
    weights: &CostWeights,
    sigma: &[f64],
    gamma: f64,
) -> Result<Segment, SynthesisError> {
    let (n, inputs) = (model.a.nrows(), model.b.ncols());
    let inverse = InverseWeights::new(weights);
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", n);
    let l = problem.rectangular("L", inputs, n);
    let m = problem.rectangular("M", inputs, n);
    for vertex in 0..1usize << inputs {
        let name = format!("performance of mixture {vertex:0inputs$b}");
        problem.positive_definite(&name, performance(&y, &mixture(vertex, &l, &m), model, &inverse));
    }
    for (i, &bound) in sigma.iter().enumerate() {
        problem.positive_definite(format!("input {} unsaturated", i + 1), unsaturated(&y, m.row(i), bound, gamma));
    }
    problem.maximize(&y.trace());
    let answer = solve(&problem, model.rho)?;

    let y = symmetric_part(&answer.value(&y));
    let p = inverse_spd(&y).ok_or_else(|| not_definite(model.rho))?;
    Ok(Segment {
        rho: model.rho,
        low: answer.value(&m) * &p,
        high: &inverse.r * model.b.transpose() * &p,
        trace_y: trace(&y),
        p,
        p_rate: None,
        iterations: answer.iterations.len(),
    })
}

impl Segment {
    /// From the unsaturated gain `low` to R⁻¹BᵀP at one model, for choosing s alone.
    pub(super) fn between(model: &FrozenModel, weights: &CostWeights, p: &Mat<f64>, low: &Mat<f64>) -> Self {
        let r_inverse = inverse_spd(&weights.r).expect("weights are checked to be positive definite");
        Self {
            rho: model.rho,
            low: low.clone(),
            high: r_inverse * model.b.transpose() * p,
            trace_y: f64::NAN,
            p_rate: None,
            p: p.clone(),
            iterations: 0,
        }
    }

    /// The segment of a design for a moving parameter at one value of it. The derivation of the module holds as it stands:
    /// Ṗ is a constant in each inequality.
    pub(super) fn moving(
        model: &FrozenModel,
        weights: &CostWeights,
        lyapunov: &RateBounded,
        iterations: usize,
    ) -> Option<Self> {
        let (p, low) = (lyapunov.p(model.rho)?, lyapunov.unsaturated_gain(model.rho)?);
        let inverse = InverseWeights::new(weights);
        Some(Self {
            rho: model.rho,
            low,
            high: &inverse.r * model.b.transpose() * &p,
            trace_y: trace(&lyapunov.y.at(&[model.rho])),
            p_rate: lyapunov.p_rate(model.rho),
            p,
            iterations,
        })
    }

    /// K_s
    fn gain(&self, s: f64) -> Mat<f64> {
        Mat::from_fn(self.low.nrows(), self.low.ncols(), |i, j| (1.0 - s) * self.low[(i, j)] + s * self.high[(i, j)])
    }

    /// The s that the rule of the module takes at this point alone. Without a sample time the controller is continuous, and
    /// every s is stable.
    pub(super) fn choose(
        &self,
        model: &FrozenModel,
        weights: &CostWeights,
        sample_time_s: Option<f64>,
        options: &HighGainOptions,
    ) -> Result<f64, SynthesisError> {
        let regulator = riccati::solve(&model.a, &model.b, &weights.q, &weights.r)
            .map_err(|source| SynthesisError::Riccati { rho: self.rho, source })?;
        let y0 = inverse_spd(&regulator.p).ok_or(SynthesisError::Unbounded { rho: self.rho })?;
        let sampled = sample_time_s.map(|time| discretize(&model.a, &model.b, time));
        let sampled_is_stable = |k: &Mat<f64>, factor: f64| {
            let Some((ad, bd)) = &sampled else { return true };
            spectral_radius(&Mat::from_fn(ad.nrows(), ad.ncols(), |i, j| {
                ad[(i, j)] - factor * (0..k.nrows()).map(|l| bd[(i, l)] * k[(l, j)]).sum::<f64>()
            })) < 1.0
        };
        let cost = |k: &Mat<f64>| {
            let stage = &weights.q + k.transpose() * &weights.r * k;
            let x = lyapunov::solve(&(&model.a - &model.b * k), &stage)?;
            Some(trace(&(x * &y0)) / y0.nrows() as f64)
        };
        // ten to a decade: the choice is flat, and a grid makes it the same at points that differ by rounding only
        let among = |decades: std::ops::RangeInclusive<i32>| -> Vec<(f64, f64)> {
            decades
                .map(|k| 10f64.powf(f64::from(k) / 10.0))
                .filter_map(|s| {
                    let k = self.gain(s);
                    (sampled_is_stable(&k, 1.0) && sampled_is_stable(&k, options.gain_margin)).then_some((s, cost(&k)?))
                })
                .collect()
        };
        let mut candidates = among(-40..=0);
        if candidates.is_empty() {
            // the largest tr Y says nothing of small eigenvalues of Y, and R⁻¹BᵀY⁻¹ may be 10¹² too high
            candidates = among(-160..=-41);
        }
        // the low gain itself is the last resort of a slow sampler
        let low = self.gain(0.0);
        if sampled_is_stable(&low, 1.0) && sampled_is_stable(&low, options.gain_margin) {
            candidates.splice(0..0, cost(&low).map(|cost| (0.0, cost)));
        }
        let least = candidates.iter().map(|&(_, cost)| cost).fold(f64::INFINITY, f64::min);
        candidates
            .iter()
            .find(|&&(_, cost)| cost <= (1.0 + options.recovery) * least)
            .map(|&(s, _)| s)
            .or(sample_time_s.is_none().then_some(0.0))
            .ok_or(SynthesisError::SampleTime { rho: self.rho, sample_time_s: sample_time_s.unwrap_or(0.0) })
    }

    /// The design with gain K_s, or with the largest s/2^k at which every mixture holds (k = 0 for diagonal R).
    pub(super) fn into_design(self, model: &FrozenModel, weights: &CostWeights, mut s: f64) -> FrozenDesign {
        // s = 0 satisfies the inequalities, so halving ends; 2⁻⁶⁰ of a gain is rounding
        for _ in 0..60 {
            if mixtures_hold(model, weights, &self.p, &self.gain(s), Some(&self.low), self.p_rate.as_ref()) {
                break;
            }
            s *= 0.5;
        }
        FrozenDesign {
            rho: self.rho,
            gain: self.gain(s),
            auxiliary_gain: Some(self.low),
            p: self.p,
            trace_y: self.trace_y,
            riccati_difference: None,
            iterations: self.iterations,
        }
    }
}
