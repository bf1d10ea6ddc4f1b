//! The prototypical aeroelastic wing section of the NATA wind tunnel: plunge h and pitch α, a trailing-edge flap β,
//! quasi-steady aerodynamics and a polynomial torsional spring,
//!
//! [m, m x_α b; m x_α b, I_α] [ḧ; α̈] + [c_h ḣ; c_α α̇] + [k_h h; k_α(α) α] = [−L; M],
//! L = ρU²b (c_lα e + c_lβ β), M = ρU²b² (c_mα e + c_mβ β), e = α + ḣ/U + (½ − a) b α̇/U.

use super::constant::ConstantError;
use super::parameter::LiteratureParameter;
use crate::math::scalar::Scalar;
use serde::{Deserialize, Serialize};

pub const SOURCE: &str = "J. Ko, A. J. Kurdila, T. W. Strganac, Nonlinear control of a prototypical wing section with \
    torsional nonlinearity, J. Guidance, Control, and Dynamics 20(6):1181-1189, 1997; qLPV form of P. Baranyi, Tensor \
    product model-based control of two-dimensional aeroelastic system, J. Guidance, Control, and Dynamics 29(2), 2006";

/// Constants of the wing section, per metre of span where a span would enter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NataParameters {
    /// m, mass in kg.
    pub mass_kg: f64,
    /// I_α, moment of inertia about the elastic axis in kg m².
    pub inertia_kg_m2: f64,
    /// b, half the chord in m.
    pub semichord_m: f64,
    /// a, distance from midchord to the elastic axis, in semichords.
    pub elastic_axis: f64,
    /// Distance from the leading edge to the centre of mass in m; x_α b is what is left of it behind the elastic axis.
    pub mass_centre_m: f64,
    /// k_h in N/m.
    pub plunge_stiffness_n_per_m: f64,
    /// c_h in N s/m.
    pub plunge_damping_n_s_per_m: f64,
    /// c_α in N m s.
    pub pitch_damping_n_m_s: f64,
    /// Air density ρ in kg/m³.
    pub air_density_kg_per_m3: f64,
    /// c_lα, per radian; c_mα = (½ + a) c_lα.
    pub lift_slope: f64,
    /// c_lβ, per radian.
    pub flap_lift_slope: f64,
    /// c_mβ, per radian.
    pub flap_moment_slope: f64,
    /// k_α(α) = Σ kᵢ αⁱ in N m.
    pub pitch_stiffness_n_m: [f64; 5],
}

impl Default for NataParameters {
    #[expect(clippy::approx_constant, reason = "6.28 is the source's lift slope, to its digits")]
    fn default() -> Self {
        Self {
            mass_kg: 12.387,
            inertia_kg_m2: 0.065,
            semichord_m: 0.135,
            elastic_axis: -0.4,
            mass_centre_m: 0.0873,
            plunge_stiffness_n_per_m: 2844.4,
            plunge_damping_n_s_per_m: 27.43,
            pitch_damping_n_m_s: 0.036,
            air_density_kg_per_m3: 1.225,
            lift_slope: 6.28,
            flap_lift_slope: 3.358,
            flap_moment_slope: -0.635,
            pitch_stiffness_n_m: [1.0, -22.1, 1315.5, -8580.0, 17289.7].map(|factor| 2.82 * factor),
        }
    }
}

pub fn parameters() -> Vec<LiteratureParameter> {
    vec![
        LiteratureParameter { name: "U", unit: "m/s", range: [14.0, 25.0], grid_points: 101 },
        LiteratureParameter { name: "alpha", unit: "rad", range: [-0.3, 0.3], grid_points: 101 },
    ]
}

impl NataParameters {
    /// m x_α b, the static moment about the elastic axis in kg m.
    fn static_moment(&self) -> f64 {
        self.mass_kg * (self.mass_centre_m - (1.0 + self.elastic_axis) * self.semichord_m)
    }

    pub(super) fn check(&self) -> Result<(), ConstantError> {
        ConstantError::unless_positive("mass_kg", self.mass_kg)?;
        ConstantError::unless_positive("inertia_kg_m2", self.inertia_kg_m2)?;
        ConstantError::unless_positive("semichord_m", self.semichord_m)?;
        ConstantError::unless_positive("air_density_kg_per_m3", self.air_density_kg_per_m3)?;
        ConstantError::unless_finite("elastic_axis", self.elastic_axis)?;
        ConstantError::unless_finite("mass_centre_m", self.mass_centre_m)?;
        ConstantError::unless_finite("plunge_stiffness_n_per_m", self.plunge_stiffness_n_per_m)?;
        ConstantError::unless_finite("plunge_damping_n_s_per_m", self.plunge_damping_n_s_per_m)?;
        ConstantError::unless_finite("pitch_damping_n_m_s", self.pitch_damping_n_m_s)?;
        ConstantError::unless_finite("lift_slope", self.lift_slope)?;
        ConstantError::unless_finite("flap_lift_slope", self.flap_lift_slope)?;
        ConstantError::unless_finite("flap_moment_slope", self.flap_moment_slope)?;
        for coefficient in self.pitch_stiffness_n_m {
            ConstantError::unless_finite("pitch_stiffness_n_m", coefficient)?;
        }
        let holds = self.mass_kg * self.inertia_kg_m2 > self.static_moment().powi(2);
        let allowed = "it has to exceed (static moment)²/mass, or the mass matrix is not positive definite";
        ConstantError::unless(holds, "inertia_kg_m2", self.inertia_kg_m2, allowed)
    }

    /// S at ρ = (U, α), state (h, α, ḣ, α̇), input β, row after row.
    pub(super) fn over<S: Scalar>(&self, rho: &[S]) -> Vec<S> {
        let [zero, one] = [0.0, 1.0].map(S::from);
        let (speed, pitch, b) = (rho[0], rho[1], S::from(self.semichord_m));
        let (mass, inertia) = (S::from(self.mass_kg), S::from(self.inertia_kg_m2));
        let static_moment = mass * (S::from(self.mass_centre_m) - (S::from(self.elastic_axis) + 1.0) * b);
        let determinant = mass * inertia - static_moment * static_moment;
        let stiffness = self.pitch_stiffness_n_m.iter().rev().fold(zero, |value, k| value * pitch + *k);
        let moment_slope = (S::from(self.elastic_axis) + 0.5) * self.lift_slope;
        let lift = speed * self.air_density_kg_per_m3 * b; // ρUb
        let arm = (-S::from(self.elastic_axis) + 0.5) * b;
        // generalised force (−L, M) minus spring and damper, by h, α, ḣ, α̇, β
        let plunge = [
            S::from(-self.plunge_stiffness_n_per_m),
            -(lift * speed * self.lift_slope),
            -(lift * self.lift_slope) - self.plunge_damping_n_s_per_m,
            -(lift * arm * self.lift_slope),
            -(lift * speed * self.flap_lift_slope),
        ];
        let torsion = [
            zero,
            lift * speed * b * moment_slope - stiffness,
            lift * b * moment_slope,
            lift * b * arm * moment_slope - self.pitch_damping_n_m_s,
            lift * speed * b * self.flap_moment_slope,
        ];
        let solve = |own: S, force: &[S; 5], coupling: S, other: &[S; 5]| {
            [0, 1, 2, 3, 4].map(|j| (own * force[j] - coupling * other[j]) / determinant)
        };
        [
            [zero, zero, one, zero, zero],
            [zero, zero, zero, one, zero],
            solve(inertia, &plunge, static_moment, &torsion),
            solve(mass, &torsion, static_moment, &plunge),
        ]
        .concat()
    }
}
