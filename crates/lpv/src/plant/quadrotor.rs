//! The quadrotor of the thesis: a rigid body with four rotors, equations (3.26), noise entry (6.8), measurement (6.9).

use super::{Description, Equations, Feature, Scene, Scheduling, Signal};
use crate::math::scalar::Scalar;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Parameters of the quadrotor; the default is Table 6.1 of the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QuadrotorParameters {
    /// Mass m.
    pub mass_kg: f64,
    /// Gravity g.
    pub gravity_m_s2: f64,
    /// Moment of inertia about the body x axis, I_x.
    pub inertia_x_kg_m2: f64,
    /// Moment of inertia about the body y axis, I_y.
    pub inertia_y_kg_m2: f64,
    /// Moment of inertia about the body z axis, I_z.
    pub inertia_z_kg_m2: f64,
    /// Lever ℓ from the centre to each rotor.
    pub arm_length_m: f64,
    /// Ratio d of a rotor's drag torque to its lift.
    pub drag_to_lift_m: f64,
}

impl Default for QuadrotorParameters {
    fn default() -> Self {
        Self {
            mass_kg: 2.0,
            gravity_m_s2: 9.807,
            inertia_x_kg_m2: 1.25,
            inertia_y_kg_m2: 1.25,
            inertia_z_kg_m2: 2.5,
            arm_length_m: 0.3,
            drag_to_lift_m: 0.075,
        }
    }
}

impl QuadrotorParameters {
    /// The parameters by name, in order; each has to be positive.
    pub(super) fn named(&self) -> [(&'static str, f64); 7] {
        [
            ("mass_kg", self.mass_kg),
            ("gravity_m_s2", self.gravity_m_s2),
            ("inertia_x_kg_m2", self.inertia_x_kg_m2),
            ("inertia_y_kg_m2", self.inertia_y_kg_m2),
            ("inertia_z_kg_m2", self.inertia_z_kg_m2),
            ("arm_length_m", self.arm_length_m),
            ("drag_to_lift_m", self.drag_to_lift_m),
        ]
    }
}

/// The quadrotor: x = [v_x v_y v_z r_x r_y r_z p q r φ θ ψ] (3.24), u = [F₁ F₂ F₃ F₄] (3.25).
///
/// v, r: velocity and position in the Earth frame (z up); p q r: angular velocity in the body frame; φ θ ψ: Euler
/// angles of R_xyz = R_z(ψ) R_y(θ) R_x(φ), which takes Earth to body coordinates (3.10). Rotors 1, 2, 3, 4 stand at
/// +x, +y, −x, −y of the body.
pub struct Quadrotor {
    parameters: QuadrotorParameters,
    description: Description,
}

impl Quadrotor {
    /// The quadrotor with the given parameters.
    pub fn new(parameters: QuadrotorParameters) -> Self {
        let mut states = Signal::list(&[
            ("v_x", "m/s"),
            ("v_y", "m/s"),
            ("v_z", "m/s"),
            ("r_x", "m"),
            ("r_y", "m"),
            ("r_z", "m"),
            ("p", "rad/s"),
            ("q", "rad/s"),
            ("r", "rad/s"),
            ("phi", "rad"),
            ("theta", "rad"),
            ("psi", "rad"),
        ]);
        states[11].wraps = true;
        let mut outputs =
            Signal::list(&[("r_x", "m"), ("r_y", "m"), ("r_z", "m"), ("phi", "rad"), ("theta", "rad"), ("psi", "rad")]);
        outputs[5].wraps = true;
        let arm = parameters.arm_length_m;
        let mut state_limits = vec![None; 12];
        // φ = ±90° has the rotors push sideways with no lift left to linearise about; θ = ±90° is the singular attitude
        state_limits[9] = Some(PI / 2.0);
        state_limits[10] = Some(PI / 2.0);
        let description = Description {
            name: "quadrotor".into(),
            states,
            inputs: Signal::list(&[("F_1", "N"), ("F_2", "N"), ("F_3", "N"), ("F_4", "N")]),
            disturbances: Signal::list(&[("w_1", "N"), ("w_2", "N"), ("w_3", "N"), ("w_4", "N")]),
            outputs,
            scheduling: Some(Scheduling {
                parameter: "psi".into(),
                unit: "rad".into(),
                state: 11,
                range: [-PI, PI],
                rate: [-2.0, 2.0],
                periodic: true,
                features: vec![Feature::Sin, Feature::Cos],
            }),
            state_limits,
            scene: Some(Scene::RigidBody {
                position: [3, 4, 5],
                euler_xyz: [9, 10, 11],
                arm_length_m: arm,
                rotors: vec![[arm, 0.0, 0.0], [0.0, arm, 0.0], [-arm, 0.0, 0.0], [0.0, -arm, 0.0]],
            }),
        };
        Self { parameters, description }
    }
}

impl Equations for Quadrotor {
    fn description(&self) -> &Description {
        &self.description
    }

    /// Hover at heading ψ: level, at rest, u* = mg/4 on each rotor (3.30)-(3.31).
    fn trim<S: Scalar>(&self, psi_rad: S) -> (Vec<S>, Vec<S>) {
        let mut state = vec![S::from(0.0); 12];
        state[11] = psi_rad;
        (state, vec![S::from(self.parameters.mass_kg * self.parameters.gravity_m_s2 / 4.0); 4])
    }

    /// (6.8): (3.26) with the process noise wᵢ added to each rotor force.
    fn dynamics<S: Scalar>(&self, x: &[S], u: &[S], w: &[S], dx: &mut [S]) {
        let QuadrotorParameters {
            mass_kg: m,
            gravity_m_s2: g,
            inertia_x_kg_m2: ix,
            inertia_y_kg_m2: iy,
            inertia_z_kg_m2: iz,
            arm_length_m: l,
            drag_to_lift_m: d,
        } = self.parameters;
        let [f1, f2, f3, f4] = [u[0] + w[0], u[1] + w[1], u[2] + w[2], u[3] + w[3]];
        let acceleration = (f1 + f2 + f3 + f4) / m;
        let (p, q, r) = (x[6], x[7], x[8]);
        let (s_phi, c_phi) = x[9].sin_cos();
        let (s_theta, c_theta) = x[10].sin_cos();
        let (s_psi, c_psi) = x[11].sin_cos();

        dx[0] = s_theta * acceleration;
        dx[1] = -(s_phi * c_theta * acceleration);
        dx[2] = c_phi * c_theta * acceleration - g;
        dx[3] = x[0];
        dx[4] = x[1];
        dx[5] = x[2];
        dx[6] = (f2 - f4) * (l / ix) - q * r * ((iz - iy) / ix);
        dx[7] = (f3 - f1) * (l / iy) - p * r * ((ix - iz) / iy);
        dx[8] = (f1 + f3 - f2 - f4) * (d / iz) - p * q * ((iy - ix) / iz);
        let across = p * c_psi - q * s_psi;
        dx[9] = across / c_theta;
        dx[10] = p * s_psi + q * c_psi;
        dx[11] = r - across * (s_theta / c_theta);
    }

    /// (6.9): position and attitude, each with its noise.
    fn measurement<S: Scalar>(&self, x: &[S], v: &[S], y: &mut [S]) {
        for i in 0..3 {
            y[i] = x[3 + i] + v[i];
            y[3 + i] = x[9 + i] + v[3 + i];
        }
    }
}
