//! The reference governor: moves the reference toward the set point so that the error never leaves the certified set.
//!
//! A design is certified for errors in {V(e, ρ) ≤ γ}, e = x − x_ref; a set point far away makes an error outside. The governor
//! puts between set point and controller a reference that starts where the plant is (so that e(0) is small) and moves. Any
//! set point is then reached with the certificate intact. Two kinds:
//!
//! # Static references
//!
//! The scalar governor of E. G. Gilbert and I. Kolmanovsky ("Nonlinear tracking control in the presence of state and control
//! constraints: a generalized reference governor", Automatica 38, 2002; A. Bemporad, "Reference governor for constrained
//! nonlinear systems", IEEE TAC 43, 1998) with the certified set as its invariant set. x_ref is a point of rest. At every sample
//! it moves by the largest λ ∈ [0, 1] toward the set point, x_ref + λΔ, that keeps
//!
//! ```text
//! V(e − λΔ) = V(e) − 2λ eᵀPΔ + λ² ΔᵀPΔ ≤ β γ,    0 < β < 1,
//! ```
//!
//! the larger root of a quadratic. *Invariance*: after the move e is in the set, and between samples the reference rests, so
//! that V̇ < 0 under the certified controller. *Convergence*: at a reference that rests V falls to zero, so that λ > 0 again
//! after finite time as long as Δ ≠ 0, by at least a step with √V(λΔ) = √(βγ) − √V(e); the reference is at the set point
//! after finitely many of them, and e → 0. The price is speed: in cruise V is at βγ all the time, with the error that
//! this level allows.
//!
//! # Moving references
//!
//! x_ref is a motion of the LPV model itself, see `motion`: ẋ_ref = A(ρ)(x_ref − x*) + B(ρ)u_ref for the actual ρ(t). With
//! u = sat(u* + u_ref − Ke) the error obeys
//!
//! ```text
//! ė = A(ρ)e + B(ρ)(sat(u* + u_ref − Ke) − u* − u_ref).
//! ```
//!
//! Let the actuators allow |u − u*| ≤ σ and let |u_ref,i| ≤ φσᵢ (the share φ is `feedforward`). As a function of Ke, the last
//! bracket is a saturation of −Ke whose limits lie at or beyond ±(1 − φ)σ. Let F be the gain that does not saturate
//! on {V ≤ γ} *with limits (1 − φ)σ* (F = K of the low-gain method). Each component of the bracket lies between −fᵢe and −kᵢe, or
//! is −kᵢe: the mixtures of rows of K and F over which the certificate proves V̇ < 0. So:
//!
//! *A design that is made and proved for the limits (1 − φ)σ keeps {V(x − x_ref, ρ) ≤ γ} invariant along every motion of the
//! reference with |u_ref| ≤ φσ, at every speed*, as long as |ρ̇| ≤ r. The speed of the reference is bounded by inputs and by the
//! range in which the model stands for the plant (bounds on states such as the tilt), not by the certificate.
//!
//! *Convergence*: a motion is a rest-to-rest profile of finite duration; then the set point is a point of rest, and e → 0.
//! A set point that comes while the reference moves waits until it rests; a motion starts only with V(e) ≤ βγ.
//!
//! *Rate*: where the scheduling state is itself a set point, its reference moves at no more than
//! [`REFERENCE_SHARE_OF_RATE`] of r; the rest is left to the error. Starting from e = 0 the error of the LPV model stays zero, and
//! the rate is that of the reference.

use super::InputLimits;
use super::certified_set::{CertifiedSet, SetEvaluator};
use super::motion::Motion;
use super::profile::Profile;
use serde::{Deserialize, Serialize};

/// The share of the certified parameter rate that the reference may use.
pub const REFERENCE_SHARE_OF_RATE: f64 = 0.8;

/// Relative distance to a set point that counts as none.
const ARRIVED: f64 = 1e-12;

/// A reference governor, as plain data.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Governor {
    /// States whose references the set point moves: A(ρ)eⱼ = 0.
    pub set_point_states: Vec<usize>,
    /// x*: where the reference of the others rests.
    pub operating_state: Vec<f64>,
    /// β: the governor acts so that V ≤ βγ.
    pub level_share: f64,
    /// Largest rate of the reference of the scheduling state, if that is a set-point state.
    pub parameter_rate: Option<f64>,
    /// The motions of a moving reference; `None`: static references.
    pub motion: Option<Motion>,
}

/// Where the reference is; and work space.
#[derive(Clone, Debug)]
pub(super) struct GovernorState {
    /// Where the reference rests, or started from.
    rest: Vec<f64>,
    /// Displacement of the set-point states in the present motion.
    delta: Vec<f64>,
    /// Start of the present motion, and its profile.
    moving: Option<(f64, Profile)>,
    /// The next sample may start a motion.
    ready: bool,
    /// x_ref
    pub reference: Vec<f64>,
    /// u_ref
    pub feedforward: Vec<f64>,
    direction: Vec<f64>,
    error: Vec<f64>,
}

impl Governor {
    /// Whether feedback and reference together stay within the actuators: |u_ref,i| + σᵢ of the feedback's `limits` is at most σᵢ of
    /// the actuators around `operating_input`. Always so for static references.
    pub fn authority_is_divided(&self, limits: &InputLimits, operating_input: &[f64]) -> bool {
        let Some(motion) = &self.motion else { return true };
        let (feedback, all) = (limits.symmetric_bound(operating_input), motion.actuators.room(operating_input));
        // a + b ≤ c of the numbers themselves, not of their rounded sum
        let fits = |budget: f64, feedback: f64, all: f64| {
            let sum = budget + feedback;
            let lost = (budget - (sum - feedback)) + (feedback - (sum - (sum - feedback)));
            sum < all || sum == all && (lost <= 0.0 || sum.is_infinite())
        };
        motion.input_budget.len() == all.len()
            && (0..all.len())
                .all(|i| motion.input_budget[i] >= 0.0 && fits(motion.input_budget[i], feedback[i], all[i]))
    }

    /// The profile of the move `delta` of the set-point states along `motion`, for the plant's scheduling state.
    pub fn profile(&self, motion: &Motion, delta: &[f64], scheduling_state: Option<usize>) -> Profile {
        let moved = self.set_point_states.iter().zip(delta);
        let of_parameter =
            moved.filter(|&(&state, _)| scheduling_state == Some(state)).map(|(_, delta)| delta.abs()).sum::<f64>();
        motion.profile(delta, self.parameter_rate.map_or(f64::INFINITY, |rate| rate / of_parameter))
    }

    /// The reference where the plant is: the set-point states of `x`, the others at rest.
    pub(super) fn start(&self, x: &[f64], inputs: usize) -> GovernorState {
        let mut rest = self.operating_state.clone();
        for &state in &self.set_point_states {
            rest[state] = x[state];
        }
        let (n, d) = (rest.len(), self.set_point_states.len());
        GovernorState {
            reference: rest.clone(),
            rest,
            delta: vec![0.0; d],
            moving: None,
            ready: false,
            feedforward: vec![0.0; inputs],
            direction: vec![0.0; n],
            error: vec![0.0; n],
        }
    }
}

/// What the governor sees at a sample.
pub(super) struct Sample<'a> {
    pub time_s: f64,
    pub sample_time_s: f64,
    pub rho: f64,
    /// Index of the scheduling state.
    pub scheduling_state: Option<usize>,
    pub x: &'a [f64],
    pub set_point: &'a [f64],
    /// States that are angles modulo a turn.
    pub wraps: &'a [bool],
}

impl Sample<'_> {
    fn difference(&self, state: usize, to: f64, from: f64) -> f64 {
        if self.wraps[state] { crate::math::angle::wrap(to - from) } else { to - from }
    }
}

impl GovernorState {
    /// Move the reference. `set` is the outermost certified set, in which static references keep the error.
    pub fn step(&mut self, governor: &Governor, set: &CertifiedSet, evaluator: &mut SetEvaluator, sample: &Sample) {
        match &governor.motion {
            None => self.step_static(governor, set, evaluator, sample),
            Some(motion) => self.step_moving(governor, motion, sample),
        }
    }

    /// Tell the governor V/γ of the error that its reference left; a motion starts at the next sample only if it is small
    /// enough.
    pub fn observe(&mut self, governor: &Governor, share: f64) {
        self.ready = share <= governor.level_share;
    }

    /// The scheduling state first, as far as its rate allows, then the others: each by the largest λ.
    fn step_static(&mut self, governor: &Governor, set: &CertifiedSet, evaluator: &mut SetEvaluator, sample: &Sample) {
        if !evaluator.at(set, sample.rho) {
            return;
        }
        for of_parameter in [true, false] {
            let mut most: f64 = 1.0;
            self.direction.fill(0.0);
            for &state in &governor.set_point_states {
                let is_parameter = sample.scheduling_state == Some(state);
                if is_parameter == of_parameter {
                    let distance = sample.difference(state, sample.set_point[state], self.rest[state]);
                    self.direction[state] = distance;
                    if let (true, Some(rate)) = (is_parameter, governor.parameter_rate) {
                        most = (rate * sample.sample_time_s / distance.abs()).min(1.0);
                    }
                }
            }
            if self.direction.iter().all(|&component| component == 0.0) {
                continue;
            }
            for (state, error) in self.error.iter_mut().enumerate() {
                *error = sample.difference(state, sample.x[state], self.rest[state]);
            }
            let [v, slope, square] = evaluator.forms(&self.error, &self.direction);
            let level = governor.level_share * set.level;
            // outside the level: to where V is least, which never makes it worse
            let root = if v <= level { (slope * slope + square * (level - v)).sqrt() } else { 0.0 };
            let lambda = ((slope + root) / square).min(most);
            if lambda.is_nan() || lambda <= 0.0 {
                continue;
            }
            for &state in &governor.set_point_states {
                if self.direction[state] != 0.0 {
                    self.rest[state] = match lambda {
                        1.0 => sample.set_point[state],
                        _ => self.rest[state] + lambda * self.direction[state],
                    };
                }
            }
        }
        self.reference.copy_from_slice(&self.rest);
    }

    fn step_moving(&mut self, governor: &Governor, motion: &Motion, sample: &Sample) {
        if let Some((start_s, profile)) = self.moving
            && sample.time_s - start_s >= profile.duration()
        {
            for (&state, delta) in governor.set_point_states.iter().zip(&self.delta) {
                self.rest[state] += delta;
            }
            self.moving = None;
        }
        if self.moving.is_none() && self.ready {
            for (&state, delta) in governor.set_point_states.iter().zip(&mut self.delta) {
                let target = sample.set_point[state];
                *delta = sample.difference(state, target, self.rest[state]);
                // what rounding leaves of a move that has ended is no move
                if delta.abs() <= ARRIVED * (1.0 + target.abs()) {
                    *delta = 0.0;
                }
            }
            if self.delta.iter().any(|&delta| delta != 0.0) {
                let profile = governor.profile(motion, &self.delta, sample.scheduling_state);
                self.moving = Some((sample.time_s, profile));
            }
        }
        self.reference.copy_from_slice(&self.rest);
        self.feedforward.fill(0.0);
        let Some((start_s, profile)) = self.moving else { return };
        let s = profile.at(sample.time_s - start_s);
        for (&state, delta) in governor.set_point_states.iter().zip(&self.delta) {
            self.reference[state] += s[0] * delta;
        }
        for (state, deviation) in self.error.iter_mut().enumerate() {
            *deviation = sample.x[state] - governor.operating_state[state];
        }
        motion.add_states(sample.rho, &self.delta, &s, &mut self.reference);
        // the input is held until the next sample: its value in the middle is nearest to all it stands for
        let s = profile.at(sample.time_s + 0.5 * sample.sample_time_s - start_s);
        motion.add_inputs(sample.rho, &self.delta, &s, &self.error, &mut self.feedforward);
    }
}
