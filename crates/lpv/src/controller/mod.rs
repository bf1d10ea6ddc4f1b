//! Controllers as plain data: u = u* − sat(K(ρ)(x − x_ref)).
//!
//! [`Schedule`] carries gains to every parameter value, [`InputLimits`] saturates, [`Controller`] is the two together
//! with the operating input. A [`Supervisor`] makes the certified set part of the controller: a family of gains with
//! nested sets (`nested`), and a reference governor (`governor`) that brings the plant to any set point without leaving
//! them. [`Law`] runs all of it at every sample and allocates nothing there.

mod certified_set;
mod governor;
mod law;
mod limits;
mod motion;
mod nested;
mod profile;
mod schedule;

pub use certified_set::{CertifiedSet, SetEvaluator};
pub use governor::{Governor, REFERENCE_SHARE_OF_RATE};
pub use law::Law;
pub use limits::InputLimits;
pub use motion::Motion;
pub use nested::{ENTER, Member};
pub use profile::{MOST_ORDER, Profile};
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
    /// What the actuators can do; below a governor with moving references, what is left of it to the feedback.
    pub limits: InputLimits,
    /// Certified sets that the controller knows of, and what it does with them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supervisor: Option<Supervisor>,
}

/// The certified sets of a controller, and what it does with them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Supervisor {
    /// The certified set of the controller's own gain: the outermost.
    pub set: CertifiedSet,
    /// Gains for smaller sets, from the largest to the smallest.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inner: Vec<Member>,
    /// Moves the reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub governor: Option<Governor>,
}

impl Controller {
    /// What the actuators can do, all of it.
    pub fn actuators(&self) -> &InputLimits {
        let governor = self.supervisor.as_ref().and_then(|supervisor| supervisor.governor.as_ref());
        governor.and_then(|governor| governor.motion.as_ref()).map_or(&self.limits, |motion| &motion.actuators)
    }
}
