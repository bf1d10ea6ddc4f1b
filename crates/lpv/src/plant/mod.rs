//! Nonlinear plants ẋ = f(x, u, w), y = h(x, v).
//!
//! A plant implements [`Equations`] once, generic over [`Scalar`](crate::math::scalar::Scalar); the blanket
//! implementation then gives it the dyn-safe face [`Plant`] with exact Jacobians from dual numbers. Plants are chosen by
//! name through [`PlantSpec`].
//!
//! To add a plant: one file here with its `Equations`, one variant in [`PlantSpec`].

mod catalogue;
mod description;
mod double_integrator;
mod equations;
mod jacobian;
mod linear;
mod parameter_error;
mod pendulum;
mod quadrotor;

pub use catalogue::PlantSpec;
pub use description::{Description, Feature, Scene, Scheduling, Signal};
pub use double_integrator::DoubleIntegrator;
pub use equations::{Equations, OperatingPoint, Plant};
pub use linear::{Linear, LinearParameters};
pub use parameter_error::PlantParameterError;
pub use pendulum::Pendulum;
pub use quadrotor::{Quadrotor, QuadrotorParameters};
