//! What a scenario says of a controller.

use lpv::certificate::Verdict;
use lpv::synthesis::{DesignRequest, Supervision};

/// A controller to design and fly.
pub struct ControllerPlan {
    /// What the report calls it.
    pub label: String,
    /// What to design.
    pub request: DesignRequest,
    /// What is put around the design: nested certified sets, a reference governor.
    pub supervision: Supervision,
    /// Fly with noise.
    pub noise: bool,
    /// Feed back the estimate of an extended Kalman filter.
    pub estimator: bool,
    /// The verdict that the design has to reach, if any.
    pub require: Option<Verdict>,
}
