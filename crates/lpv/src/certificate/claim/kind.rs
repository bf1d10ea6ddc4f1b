//! What may be claimed of a design.

use serde::Serialize;

/// How the parameter may move, as far as a claim says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "motion", rename_all = "kebab-case")]
pub enum Motion {
    /// There is no parameter.
    None,
    /// It rests, at any value.
    AtRest,
    /// |ρ̇| is at most this, per second.
    Bounded {
        /// Per second.
        rate: f64,
    },
    /// Its rates are in the hull of the given vertices.
    Hull,
    /// Any motion.
    Any,
    /// Any motion within the ranges of the parameters.
    WithinRanges,
}

/// What is claimed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum ClaimKind {
    /// Q ⪰ 0 and R ≻ 0: the cost is one.
    Weights,
    /// P(ρ) ≻ 0.
    LyapunovDefinite,
    /// On {V ≤ γ} no limited input of the low gain (K, or F of a high gain) reaches its limit.
    Unsaturated {
        /// γ
        level: f64,
    },
    /// V decreases along every motion: there are no limits.
    Decrease {
        /// Of the parameter.
        motion: Motion,
    },
    /// {V ≤ γ} is invariant under the saturated controller, and V decreases in it.
    Invariance {
        /// γ
        level: f64,
        /// Of the parameter.
        motion: Motion,
    },
    /// The cost is at most `factor` V(x(0)), from x(0) in {V ≤ γ} where there is a level.
    Cost {
        /// κ
        factor: f64,
        /// γ; `None` where the bound holds from everywhere.
        level: Option<f64>,
        /// Of the parameter.
        motion: Motion,
    },
    /// The tensor-product model is at most this far from the LPV model, everywhere in the ranges of the parameters.
    TransformationError {
        /// Of ‖A(ρ) − Σ wᵢ(ρ)Aᵢ‖, Frobenius.
        a: f64,
        /// Of ‖B(ρ) − Σ wᵢ(ρ)Bᵢ‖, Frobenius.
        b: f64,
    },
    /// On {V ≤ γ} the states that are parameters stay in the ranges of these.
    StatesInRange {
        /// γ
        level: f64,
        /// Their names.
        states: Vec<String>,
    },
    /// The loop with zero-order hold is stable at every fixed ρ, while no input saturates.
    SampledStability {
        /// T, s.
        sample_time_s: f64,
    },
    /// {V ≤ γ} is invariant, from sample to sample, for the saturated loop with zero-order hold at every fixed ρ.
    SampledInvariance {
        /// γ
        level: f64,
        /// T, s.
        sample_time_s: f64,
    },
    /// With zero-order hold and saturation the cost is at most `factor` V(x(0)), from x(0) in {V ≤ γ} where there is a level: of the loop as
    /// it flies, without a parameter.
    SampledCost {
        /// κ; infinite where none is found.
        factor: f64,
        /// γ; `None` where the bound holds from everywhere.
        level: Option<f64>,
        /// T, s.
        sample_time_s: f64,
    },
    /// The governed reference is a motion of the model, up to what the sets absorb.
    GovernedMotion {
        /// States that it moves.
        states: Vec<String>,
        /// By at most this; an angle by half a turn.
        farthest: f64,
    },
    /// ‖z‖₂ ≤ γ‖w‖₂.
    InducedGain {
        /// γ
        gain: f64,
        /// Of the parameter.
        motion: Motion,
    },
    /// What was asked for is what was answered.
    AsAsked {
        /// Rate, level.
        what: &'static str,
        /// The number that was asked for.
        asked: f64,
        /// The number up to which it is proved; `None`: none.
        proved: Option<f64>,
    },
    /// The matrix inequalities of the method hold at the grid points, in floating point.
    GridInequalities,
    /// A(ρ) − B(ρ)K(ρ) is stable at every fixed ρ.
    FrozenStability,
    /// A step of a flight costs at most this.
    StepCost {
        /// Number of the step, from 1.
        step: usize,
        /// When it begins.
        time_s: f64,
        /// Bound on its cost.
        bound: f64,
    },
    /// A step of a flight stays in the certified set.
    StepStays {
        /// Number of the step, from 1.
        step: usize,
        /// When it begins.
        time_s: f64,
    },
    /// The parameter kept to the rate for which V is proved to decrease.
    RateKept {
        /// Name of the parameter.
        parameter: String,
    },
    /// Something could be proved at all.
    Provable,
}

impl ClaimKind {
    /// Its name, stable across versions: what machines look for.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Weights => "weights",
            Self::LyapunovDefinite => "lyapunov-definite",
            Self::Unsaturated { .. } => "unsaturated",
            Self::Decrease { .. } => "decrease",
            Self::Invariance { .. } => "invariance",
            Self::Cost { .. } => "cost",
            Self::TransformationError { .. } => "transformation-error",
            Self::StatesInRange { .. } => "states-in-range",
            Self::SampledStability { .. } => "sampled-stability",
            Self::SampledInvariance { .. } => "sampled-invariance",
            Self::SampledCost { .. } => "sampled-cost",
            Self::GovernedMotion { .. } => "governed-motion",
            Self::InducedGain { .. } => "induced-gain",
            Self::AsAsked { what, .. } => match *what {
                "level" => "level-as-asked",
                _ => "rate-as-asked",
            },
            Self::GridInequalities => "grid-inequalities",
            Self::FrozenStability => "frozen-stability",
            Self::StepCost { .. } => "step-cost",
            Self::StepStays { .. } => "step-stays",
            Self::RateKept { .. } => "rate-kept",
            Self::Provable => "provable",
        }
    }
}
