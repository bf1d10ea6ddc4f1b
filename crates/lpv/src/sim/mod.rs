//! Closed-loop simulation on the nonlinear plant: plant + controller + estimator + saturation + noise.
//!
//! The controller samples and holds; between two samples the plant, the filter and the cost are integrated as one system
//! by Runge–Kutta steps. `adaptive` integrates the feedback law itself to a tolerance, for costs to compare with the
//! literature's; `optimal` finds the least cost that any controller can reach. Nothing here designs: a [`crate::controller::Controller`] is all it needs.

mod adaptive;
mod closed_loop;
mod noise;
mod optimal;
mod performance;
mod reference;
mod runge_kutta;
mod stay;

pub use adaptive::{AdaptiveOptions, ContinuousFlight, IntegrationError, fly_continuously};
pub use closed_loop::{FARTHEST, Flight, Outcome, Simulation, Trajectory};
pub use noise::{Channel, NoiseStream};
pub use optimal::{OptimalError, OptimalTrajectory, optimal_trajectory};
pub use performance::{Performance, StepResponse, performance};
pub use reference::{Reference, SetPoint};
pub use runge_kutta::RungeKutta4;
pub use stay::{SetStay, set_stay};
