//! The inverted pendulum of thesis example 4.1, equations (4.37)-(4.38).

use super::{Description, Equations, Signal};
use crate::math::scalar::Scalar;

/// ẋ₁ = x₂, ẋ₂ = −0.1 x₂ + sin x₁ + u + w, with the angle measured.
pub struct Pendulum {
    description: Description,
}

impl Default for Pendulum {
    fn default() -> Self {
        let description = Description {
            name: "pendulum".into(),
            states: Signal::list(&[("x_1", "rad"), ("x_2", "rad/s")]),
            inputs: Signal::list(&[("u", "rad/s²")]),
            disturbances: Signal::list(&[("w", "rad/s²")]),
            outputs: Signal::list(&[("x_1", "rad")]),
            scheduling: None,
            state_limits: vec![None; 2],
            scene: None,
        };
        Self { description }
    }
}

impl Equations for Pendulum {
    fn description(&self) -> &Description {
        &self.description
    }

    /// Upright, at rest.
    fn trim<S: Scalar>(&self, _rho: S) -> (Vec<S>, Vec<S>) {
        (vec![S::from(0.0); 2], vec![S::from(0.0)])
    }

    fn dynamics<S: Scalar>(&self, x: &[S], u: &[S], w: &[S], dx: &mut [S]) {
        let (sin, _) = x[0].sin_cos();
        dx[0] = x[1];
        dx[1] = x[1] * -0.1 + sin + u[0] + w[0];
    }

    fn measurement<S: Scalar>(&self, x: &[S], v: &[S], y: &mut [S]) {
        y[0] = x[0] + v[0];
    }
}
