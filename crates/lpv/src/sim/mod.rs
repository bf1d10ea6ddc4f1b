//! Closed-loop simulation on the nonlinear plant: plant + controller + estimator + saturation + noise.
//!
//! The controller samples and holds; between two samples the plant, the filter and the cost are integrated as one system
//! by Runge–Kutta steps. Nothing here designs: a [`crate::controller::Controller`] is all it needs.

mod closed_loop;
mod noise;
mod performance;
mod reference;
mod runge_kutta;

pub use closed_loop::{FARTHEST, Flight, Outcome, Simulation, Trajectory};
pub use noise::{Channel, NoiseStream};
pub use performance::{Performance, StepResponse, performance};
pub use reference::{Reference, SetPoint};
pub use runge_kutta::RungeKutta4;
