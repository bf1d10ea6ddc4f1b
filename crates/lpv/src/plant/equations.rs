//! The equations of a plant for every arithmetic, and their dyn-safe face.

use super::description::Description;
use crate::math::scalar::Scalar;
use crate::math::taylor::Taylor;
use serde::{Deserialize, Serialize};

/// A point at which the plant rests: f(x*, u*, 0) = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OperatingPoint {
    /// x*
    pub state: Vec<f64>,
    /// u*
    pub input: Vec<f64>,
}

/// The equations of a plant, written once for every arithmetic.
pub trait Equations: Send + Sync {
    /// What the plant is.
    fn description(&self) -> &Description;

    /// x* and u* at scheduling parameter `rho` (ignored by plants without one): f(x*, u*, 0) = 0.
    fn trim<S: Scalar>(&self, rho: S) -> (Vec<S>, Vec<S>);

    /// ẋ = f(x, u, w), written to `dx`.
    fn dynamics<S: Scalar>(&self, x: &[S], u: &[S], w: &[S], dx: &mut [S]);

    /// y = h(x, v), written to `y`.
    fn measurement<S: Scalar>(&self, x: &[S], v: &[S], y: &mut [S]);
}

/// The dyn-safe face of [`Equations`], with Jacobians. Implemented for every `Equations`; matrices are written in row
/// order.
pub trait Plant: Send + Sync {
    /// What the plant is.
    fn description(&self) -> &Description;

    /// The operating point at scheduling parameter `rho`.
    fn trim(&self, rho: f64) -> OperatingPoint;

    /// ẋ = f(x, u, w).
    fn dynamics(&self, x: &[f64], u: &[f64], w: &[f64], dx: &mut [f64]);

    /// y = h(x, v).
    fn measurement(&self, x: &[f64], v: &[f64], y: &mut [f64]);

    /// A = ∂f/∂x, n × n (2.52).
    fn dynamics_by_state(&self, x: &[f64], u: &[f64], w: &[f64], a: &mut [f64]);

    /// B = ∂f/∂u, n × m (3.29).
    fn dynamics_by_input(&self, x: &[f64], u: &[f64], w: &[f64], b: &mut [f64]);

    /// L = ∂f/∂w, n × n_w (2.53).
    fn dynamics_by_disturbance(&self, x: &[f64], u: &[f64], w: &[f64], l: &mut [f64]);

    /// C = ∂h/∂x, n_y × n (2.54).
    fn measurement_by_state(&self, x: &[f64], v: &[f64], c: &mut [f64]);

    /// x* and u* at the operating points of `rho`, a function of one variable: enclosures of values and derivatives.
    fn trim_over(&self, rho: Taylor) -> (Vec<Taylor>, Vec<Taylor>);

    /// f(x, u, 0) for x and u that are functions of one variable, or constants known to lie in intervals.
    fn dynamics_over(&self, x: &[Taylor], u: &[Taylor]) -> Vec<Taylor>;

    /// A = ∂f/∂x and B = ∂f/∂u at such x and u without disturbance, in row order.
    fn jacobians_over(&self, x: &[Taylor], u: &[Taylor]) -> (Vec<Taylor>, Vec<Taylor>);

    /// (∂f/∂u) `direction` at such x and u without disturbance: n functions, in which terms that cancel along the direction
    /// have cancelled.
    fn input_derivative_over(&self, x: &[Taylor], u: &[Taylor], direction: &[f64]) -> Vec<Taylor>;

    /// M = ∂h/∂v, n_y × n_y (2.55).
    fn measurement_by_noise(&self, x: &[f64], v: &[f64], m: &mut [f64]);
}
