//! Motions of the LPV model that a reference can make, exactly: x_ref and the input u_ref that carries it.
//!
//! Let Δ be the displacement from one set point to another: a combination of states in whose directions the plant rests
//! anywhere, A(ρ)eⱼ = 0. A motion along Δ by a scalar profile s(t) is
//!
//! ```text
//! x_ref = x₀ + Σ_k s⁽ᵏ⁾ Z_k(ρ)Δ   (k = 0 … K − 1),     u_ref = Σ_k s⁽ᵏ⁾ (U_k(ρ) + ρ̇ V_k(ρ))Δ   (k = 1 … K),
//! ```
//!
//! with Z₀ = [eⱼ]. It satisfies ẋ_ref = A(ρ)(x_ref − x*) + B(ρ)u_ref for every ρ(t) and every s, if for each k
//!
//! ```text
//! A Z_{k+1} + B U_{k+1} = Z_k,   Z_K = 0,     B V_k = ∂Z_k/∂ρ:
//! ```
//!
//! the first collects s⁽ᵏ⁺¹⁾, the second ρ̇ s⁽ᵏ⁾. This is the model's differential flatness, found by linear algebra: for the
//! quadrotor position → velocity → tilt → body rates, K = 4, with nothing said about quadrotors.
//!
//! The error e = x − x_ref then obeys ė = A(ρ)e − B(ρ)(u_ref-shifted saturation of K(ρ)e): the motion of the reference is no disturbance
//! to it. `governor` says what follows.

use super::InputLimits;
use super::profile::{MOST_ORDER, Profile};
use crate::model::MatrixFunction;
use serde::{Deserialize, Serialize};

/// Four times as slow, every sum of four derivatives is within the bound of each: s⁽ᵏ⁾ falls by the k-th power. A little more, for
/// rounding.
const MOST_SLOWING: f64 = MOST_ORDER as f64 * (1.0 + 1e-9);
/// Halvings when that factor is sought.
const HALVINGS: usize = 40;

/// The motions, and how much of inputs and states they may use.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Motion {
    /// Z₁ … Z_{K−1}, n × d for d set-point states.
    pub states: Vec<MatrixFunction>,
    /// U₁ … U_K, m × d.
    pub inputs: Vec<MatrixFunction>,
    /// V₁ … V_{K−1}, m × d; empty where no Z depends on ρ.
    pub inputs_by_rate: Vec<MatrixFunction>,
    /// The row of A(ρ) that gives ρ̇ from x − x*, 1 × n; `None` without a parameter.
    pub parameter_flow: Option<MatrixFunction>,
    /// r: |ρ̇| that the bounds below are kept for.
    pub parameter_rate: f64,
    /// |u_ref,i| ≤ this.
    pub input_budget: Vec<f64>,
    /// |x_ref,i − x*_i| ≤ this, for states that are no set points; `None` is no bound.
    pub state_bounds: Vec<Option<f64>>,
    /// What the actuators can do; the controller's own limits are what is left to the feedback.
    pub actuators: InputLimits,
}

impl Motion {
    /// The fastest profile for the displacement `delta` that keeps inputs and states within their bounds for every ρ and
    /// |ρ̇| ≤ r, with |s′| ≤ `speed`.
    pub fn profile(&self, delta: &[f64], speed: f64) -> Profile {
        let none = [0.0; MOST_ORDER];
        // [coefficients of |s⁽ᵏ⁾|], bound: one row for each input and bounded state
        let input_row = |i: usize| {
            let mut row = none;
            for (k, function) in self.inputs.iter().enumerate() {
                row[k] += function.bound_of_product(delta, i);
            }
            for (k, function) in self.inputs_by_rate.iter().enumerate() {
                row[k] += self.parameter_rate * function.bound_of_product(delta, i);
            }
            (row, self.input_budget[i])
        };
        let state_row = |i: usize| {
            let mut row = none;
            for (k, function) in self.states.iter().enumerate() {
                row[k] = function.bound_of_product(delta, i);
            }
            (row, self.state_bounds[i].unwrap_or(f64::INFINITY))
        };
        let rows = || (0..self.input_budget.len()).map(input_row).chain((0..self.state_bounds.len()).map(state_row));

        let mut bounds = [speed, f64::INFINITY, f64::INFINITY, f64::INFINITY];
        for (row, limit) in rows() {
            for (bound, coefficient) in bounds.iter_mut().zip(row) {
                if coefficient > 0.0 {
                    *bound = bound.min(limit / coefficient);
                }
            }
        }
        let fastest = Profile::fastest(bounds);
        // the bounds on single derivatives do not bound their sums
        let fits = |factor: f64| {
            let peaks = fastest.slower(factor).peaks();
            rows().all(|(row, limit)| row.iter().zip(&peaks).map(|(c, p)| c * p).sum::<f64>() <= limit)
        };
        if fits(1.0) {
            return fastest;
        }
        let (mut low, mut high) = (1.0, MOST_SLOWING);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if fits(middle) { high = middle } else { low = middle }
        }
        fastest.slower(high)
    }

    /// Add Σ_{k≥1} s⁽ᵏ⁾ Z_kΔ to `reference`.
    pub(super) fn add_states(&self, rho: f64, delta: &[f64], s: &[f64; MOST_ORDER + 1], reference: &mut [f64]) {
        for (function, s) in self.states.iter().zip(&s[1..]) {
            function.add_product(rho, delta, *s, reference);
        }
    }

    /// Add u_ref to `input`, with ρ̇ from the deviation x − x*.
    pub(super) fn add_inputs(
        &self,
        rho: f64,
        delta: &[f64],
        s: &[f64; MOST_ORDER + 1],
        deviation: &[f64],
        input: &mut [f64],
    ) {
        for (function, s) in self.inputs.iter().zip(&s[1..]) {
            function.add_product(rho, delta, *s, input);
        }
        if let Some(flow) = &self.parameter_flow {
            let mut rate = [0.0];
            flow.add_product(rho, deviation, 1.0, &mut rate);
            let rate = rate[0].clamp(-self.parameter_rate, self.parameter_rate);
            for (function, s) in self.inputs_by_rate.iter().zip(&s[1..]) {
                function.add_product(rho, delta, rate * s, input);
            }
        }
    }
}
