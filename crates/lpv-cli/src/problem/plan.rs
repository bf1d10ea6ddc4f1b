//! A problem as plain data.

use crate::certify::polytopic::Transformed;
use lpv::model::FrozenModel;
use lpv::synthesis::CostWeights;
use lpv::synthesis::polytopic::{BackOff, HighGain, InputBounds, Lyapunov, Objective};

/// A problem, ready to solve.
pub struct ProblemPlan {
    /// What the vertices or grid points are called in the answer.
    pub places: Vec<String>,
    /// Names of the states, where the plant has them.
    pub states: Vec<String>,
    /// Of a tensor-product model: its weights, and the LPV model that it stands for.
    pub transformed: Option<Transformed>,
    /// The models: vertices, or points of a frozen design.
    pub models: Vec<FrozenModel>,
    /// How they are used.
    pub scope: Scope,
    /// Q and R; `None` for stabilisation.
    pub weights: Option<CostWeights>,
    /// σ and γ.
    pub saturation: Option<InputBounds>,
    /// Choice of a high gain.
    pub high_gain: Option<HighGain>,
    /// What is optimised.
    pub objective: Objective,
    /// How much of the optimum is given back for a gain that can be applied.
    pub back_off: BackOff,
    /// The objective is the reach along its states.
    pub region: bool,
    /// State whose cost is bounded, with the model (for frozen designs) or the weights of its parameter.
    pub initial: Option<Initial>,
}

/// An initial state and where the parameter starts.
pub struct Initial {
    /// x(0)
    pub state: Vec<f64>,
    /// Convex weights of ρ(0) over the vertices; `None`: P does not depend on it.
    pub parameter: Option<Vec<f64>>,
    /// The model at ρ(0), of a frozen design.
    pub model: Option<FrozenModel>,
}

/// What the Lyapunov function is for.
pub enum Scope {
    /// The polytope of the models.
    Polytope(Lyapunov),
    /// Each model by itself.
    Frozen,
}
