//! A pole on a cart that a force u pushes, θ = 0 upright, J = m l²/3 (a uniform pole of length 2l):
//!
//! (M + m) r̈ + m l (θ̈ cos θ − θ̇² sin θ) = u and (4/3) l θ̈ + r̈ cos θ = g sin θ.

use super::constant::ConstantError;
use super::parameter::LiteratureParameter;
use crate::math::scalar::Scalar;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_3;

pub const SOURCE: &str = "H. O. Wang, K. Tanaka, M. F. Griffin, An approach to fuzzy control of nonlinear systems: \
    stability and design issues, IEEE Trans. Fuzzy Systems 4(1):14-23, 1996; with the cart's own motion kept";

/// Constants of pole and cart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PendulumCartParameters {
    /// M in kg.
    pub cart_mass_kg: f64,
    /// m in kg.
    pub pole_mass_kg: f64,
    /// l in m, half the pole's length.
    pub half_length_m: f64,
    /// g in m/s².
    pub gravity_m_per_s2: f64,
}

impl Default for PendulumCartParameters {
    fn default() -> Self {
        Self { cart_mass_kg: 8.0, pole_mass_kg: 2.0, half_length_m: 0.5, gravity_m_per_s2: 9.8 }
    }
}

pub fn parameters() -> Vec<LiteratureParameter> {
    vec![
        LiteratureParameter { name: "theta", unit: "rad", range: [-FRAC_PI_3, FRAC_PI_3], grid_points: 61 },
        LiteratureParameter { name: "theta_dot", unit: "rad/s", range: [-2.0, 2.0], grid_points: 21 },
    ]
}

impl PendulumCartParameters {
    pub(super) fn check(&self) -> Result<(), ConstantError> {
        ConstantError::unless_positive("cart_mass_kg", self.cart_mass_kg)?;
        ConstantError::unless_positive("pole_mass_kg", self.pole_mass_kg)?;
        ConstantError::unless_positive("half_length_m", self.half_length_m)?;
        ConstantError::unless_finite("gravity_m_per_s2", self.gravity_m_per_s2)
    }

    /// S at ρ = (θ, θ̇), state (r, θ, ṙ, θ̇), input u, row after row. sin θ = (sin θ/θ) θ and θ̇² sin θ = (θ̇ sin θ) θ̇.
    pub(super) fn over<S: Scalar>(&self, rho: &[S]) -> Vec<S> {
        let [zero, one] = [0.0, 1.0].map(S::from);
        let (sin, cos) = rho[0].sin_cos();
        let mass = S::from(self.cart_mass_kg) + self.pole_mass_kg;
        let moment = S::from(self.pole_mass_kg) * self.half_length_m;
        let length = S::from(4.0) / 3.0 * self.half_length_m;
        let determinant = mass * length - moment * cos * cos;
        let gravity = rho[0].sinc() * self.gravity_m_per_s2;
        let centrifugal = moment * rho[1] * sin;
        [
            [zero, zero, one, zero, zero],
            [zero, zero, zero, one, zero],
            [
                zero,
                -moment * cos * gravity / determinant,
                zero,
                length * centrifugal / determinant,
                length / determinant,
            ],
            [zero, mass * gravity / determinant, zero, -cos * centrifugal / determinant, -cos / determinant],
        ]
        .concat()
    }
}
