//! Controllers as plain data: u = u* − sat(K(ρ)(x − x_ref)).
//!
//! [`Schedule`] carries gains to every parameter value, [`InputLimits`] saturates, [`Controller`] is the two together
//! with the operating input. A [`Supervisor`] makes the certified set part of the controller: a family of gains with
//! nested sets (`nested`), and a reference governor (`governor`) that brings the plant to any set point without leaving
//! them. [`Law`] runs all of it at every sample and allocates nothing there.

mod certified_set;
mod feedback;
mod governor;
mod law;
mod limits;
mod motion;
mod nested;
mod profile;
mod schedule;

pub use certified_set::{CertifiedSet, SetEvaluator};
pub use feedback::{Controller, Supervisor};
pub use governor::{Governor, REFERENCE_SHARE_OF_RATE};
pub use law::Law;
pub use limits::InputLimits;
pub use motion::Motion;
pub use nested::{ENTER, Member};
pub use profile::{MOST_ORDER, Profile};
pub use schedule::Schedule;
pub(crate) use schedule::cubic_weights;
