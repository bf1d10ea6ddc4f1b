//! What a plant is, as plain data: signals, scheduling parameter, and how it is drawn.

use crate::math::scalar::Scalar;
use serde::{Deserialize, Serialize};

/// Name and unit of one component of a state, input, disturbance or output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// The symbol, for example `r_x`.
    pub name: String,
    /// SI unit; `rad` for angles.
    pub unit: String,
    /// An angle that means the same after a full turn: its errors are wrapped to [−π, π).
    pub wraps: bool,
}

impl Signal {
    /// Signals from pairs (name, unit); none of them wraps.
    pub fn list(pairs: &[(&str, &str)]) -> Vec<Signal> {
        pairs.iter().map(|&(name, unit)| Signal { name: name.into(), unit: unit.into(), wraps: false }).collect()
    }
}

/// A function of the scheduling parameter that the LPV model is affine in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Feature {
    /// sin ρ, in [−1, 1]
    Sin,
    /// cos ρ, in [−1, 1]
    Cos,
}

impl Feature {
    /// The value at parameter `rho`.
    pub fn value<S: Scalar>(self, rho: S) -> S {
        let (sin, cos) = rho.sin_cos();
        match self {
            Feature::Sin => sin,
            Feature::Cos => cos,
        }
    }
}

/// The scheduling parameter of a plant: a state component that the linearisation depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scheduling {
    /// Name of the parameter, for example `psi`.
    pub parameter: String,
    /// Unit of the parameter.
    pub unit: String,
    /// Index of the state component that is the parameter.
    pub state: usize,
    /// Least and largest value.
    pub range: [f64; 2],
    /// Least and largest rate, unit per second, that the plant is meant for.
    pub rate: [f64; 2],
    /// The two ends of the range are the same point.
    pub periodic: bool,
    /// What the model is affine in: the box of their ranges is the polytope.
    pub features: Vec<Feature>,
}

/// How to draw a plant in three dimensions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Scene {
    /// A rigid body with rotors that push along its z axis.
    RigidBody {
        /// State indices of the position in the Earth frame.
        position: [usize; 3],
        /// State indices of the Euler angles φ, θ, ψ of R_xyz (3.10).
        euler_xyz: [usize; 3],
        /// Distance from the centre to each rotor.
        arm_length_m: f64,
        /// Rotor positions in the body frame, in the order of the inputs.
        rotors: Vec<[f64; 3]>,
    },
}

/// What a plant is, as plain data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// Name in the catalogue.
    pub name: String,
    /// State x.
    pub states: Vec<Signal>,
    /// Input u.
    pub inputs: Vec<Signal>,
    /// Process noise w.
    pub disturbances: Vec<Signal>,
    /// Measurement y; the measurement noise v has the same components.
    pub outputs: Vec<Signal>,
    /// Scheduling parameter, if the linearisation depends on one.
    pub scheduling: Option<Scheduling>,
    /// The equations hold for |xᵢ| < limitᵢ (Euler angles have a singular attitude); `None` is no limit.
    pub state_limits: Vec<Option<f64>>,
    /// How to draw it, if it has a body.
    pub scene: Option<Scene>,
}

impl Description {
    /// Index of the state called `name`.
    pub fn state(&self, name: &str) -> Option<usize> {
        self.states.iter().position(|signal| signal.name == name)
    }

    /// The difference `x` − `reference`, angles that wrap taken to [−π, π).
    pub fn state_error(&self, x: &[f64], reference: &[f64], error: &mut [f64]) {
        for (i, signal) in self.states.iter().enumerate() {
            let difference = x[i] - reference[i];
            error[i] = if signal.wraps { crate::math::angle::wrap(difference) } else { difference };
        }
    }
}
