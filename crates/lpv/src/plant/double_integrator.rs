//! The double integrator of thesis chapter V, equation (5.4).

use super::{Description, Equations, Signal};
use crate::math::scalar::Scalar;

/// ẋ₁ = x₂, ẋ₂ = u + w, with the position measured.
pub struct DoubleIntegrator {
    description: Description,
}

impl Default for DoubleIntegrator {
    fn default() -> Self {
        let description = Description {
            name: "double-integrator".into(),
            states: Signal::list(&[("x_1", "m"), ("x_2", "m/s")]),
            inputs: Signal::list(&[("u", "m/s²")]),
            disturbances: Signal::list(&[("w", "m/s²")]),
            outputs: Signal::list(&[("x_1", "m")]),
            scheduling: None,
            state_limits: vec![None; 2],
            scene: None,
        };
        Self { description }
    }
}

impl Equations for DoubleIntegrator {
    fn description(&self) -> &Description {
        &self.description
    }

    /// The origin, at rest.
    fn trim<S: Scalar>(&self, _rho: S) -> (Vec<S>, Vec<S>) {
        (vec![S::from(0.0); 2], vec![S::from(0.0)])
    }

    fn dynamics<S: Scalar>(&self, x: &[S], u: &[S], w: &[S], dx: &mut [S]) {
        dx[0] = x[1];
        dx[1] = u[0] + w[0];
    }

    fn measurement<S: Scalar>(&self, x: &[S], v: &[S], y: &mut [S]) {
        y[0] = x[0] + v[0];
    }
}
