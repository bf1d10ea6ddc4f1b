//! Controllers as plain data: u = u* − sat(K(ρ)(x − x_ref)).
//!
//! [`Schedule`] carries gains to every parameter value, [`InputLimits`] saturates, [`Controller`] is the two together
//! with the operating input.

mod limits;
mod schedule;

pub use limits::InputLimits;
pub use schedule::Schedule;
pub(crate) use schedule::cubic_weights;

use serde::{Deserialize, Serialize};

/// A gain-scheduled state feedback with saturation.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Controller {
    /// K(ρ), m × n.
    pub schedule: Schedule,
    /// Index of the state component that is the scheduling parameter, if there is one.
    pub scheduling_state: Option<usize>,
    /// u*
    pub operating_input: Vec<f64>,
    /// What the actuators can do.
    pub limits: InputLimits,
}

/// A controller with its work space: what runs at every sample.
pub struct Law<'a> {
    controller: &'a Controller,
    gain: Vec<f64>,
}

impl<'a> Law<'a> {
    /// The control law of `controller` for `states` state components.
    pub fn new(controller: &'a Controller, states: usize) -> Self {
        Self { controller, gain: vec![0.0; controller.operating_input.len() * states] }
    }

    /// The input u = u* − sat(K(ρ) e) for the error e = x − x_ref at parameter ρ; true if an input was limited.
    pub fn input(&mut self, rho: f64, error: &[f64], input: &mut [f64]) -> bool {
        self.controller.schedule.gain_at(rho, &mut self.gain);
        for (i, row) in self.gain.chunks_exact(error.len()).enumerate() {
            let feedback: f64 = row.iter().zip(error).map(|(k, e)| k * e).sum();
            input[i] = self.controller.operating_input[i] - feedback;
        }
        self.controller.limits.saturate(input)
    }
}
