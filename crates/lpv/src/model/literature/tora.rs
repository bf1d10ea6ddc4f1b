//! TORA, also called RTAC: a cart on a spring that an eccentric rotor stabilises, in normalised coordinates:
//!
//! ẍ₁ + x₁ = ε(θ̇² sin θ − θ̈ cos θ) and θ̈ + ε ẍ₁ cos θ = u.

use super::constant::ConstantError;
use super::parameter::LiteratureParameter;
use crate::math::scalar::Scalar;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_4;

pub const SOURCE: &str = "R. T. Bupp, D. S. Bernstein, V. T. Coppola, A benchmark problem for nonlinear control design, \
    Int. J. Robust Nonlinear Control 8:307-310, 1998; qLPV form and grid of the TP Tool example (P. Baranyi et al.)";

/// Constants of TORA.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ToraParameters {
    /// ε, the coupling of translation and rotation, 0 < ε < 1.
    pub coupling: f64,
}

impl Default for ToraParameters {
    fn default() -> Self {
        Self { coupling: 0.2 }
    }
}

pub fn parameters() -> Vec<LiteratureParameter> {
    vec![
        LiteratureParameter { name: "theta", unit: "rad", range: [-FRAC_PI_4, FRAC_PI_4], grid_points: 23 },
        LiteratureParameter { name: "theta_dot", unit: "1", range: [-0.5, 0.5], grid_points: 23 },
    ]
}

impl ToraParameters {
    pub(super) fn check(&self) -> Result<(), ConstantError> {
        let holds = self.coupling > 0.0 && self.coupling < 1.0;
        ConstantError::unless(holds, "coupling", self.coupling, "it has to lie between 0 and 1")
    }

    /// S at ρ = (θ, θ̇), state (x₁, ẋ₁, θ, θ̇), row after row.
    pub(super) fn over<S: Scalar>(&self, rho: &[S]) -> Vec<S> {
        let [zero, one] = [0.0, 1.0].map(S::from);
        let (sin, cos) = rho[0].sin_cos();
        let centrifugal = rho[1] * self.coupling * sin;
        let coupling = cos * self.coupling;
        let determinant = one - coupling * coupling;
        [
            [zero, one, zero, zero, zero],
            [-one / determinant, zero, zero, centrifugal / determinant, -coupling / determinant],
            [zero, zero, zero, one, zero],
            [coupling / determinant, zero, zero, -centrifugal * coupling / determinant, one / determinant],
        ]
        .concat()
    }
}
