//! The feedback that flies, and the certified sets that it knows of.

use super::certified_set::CertifiedSet;
use super::governor::Governor;
use super::limits::InputLimits;
use super::nested::Member;
use super::schedule::Schedule;
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
