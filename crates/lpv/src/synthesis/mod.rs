//! Synthesis: LPV model and weights in, [`Design`] out. One file a method.
//!
//! | file | method | thesis |
//! |---|---|---|
//! | `lpvqr` | quadratic regulator at each frozen parameter | Theorems 2.1, 4.5 |
//! | `slpvqr` | the same under input saturation, low gain | Theorems 5.1, 5.3 |
//! | `high_gain` | the same under input saturation, high gain | Theorems 5.2, 5.4 |
//!
//! | [`polytopic`] | stabilisation and regulators over a polytope, any model | Theorems 2.1, 4.1-4.4, 5.1-5.4 |
//!
//! By themselves the first three are *frozen-parameter* designs: each grid point is solved as if the parameter stood still there.
//! Their bounds hold for a parameter at rest; for a moving one nothing is claimed here. With a rate bound
//! (`rate_bounded`, [`RateBoundedOptions`]) one Lyapunov matrix Y(ρ), smooth in the parameter, serves the whole range, and
//! the bounds are for every motion within that rate.
//!
//! `supervision` puts a family of nested certified sets and a reference governor around a design; `flatness` finds the motions
//! that a governed reference can make.
//!
//! To add a method: one file with its inequalities, one variant in [`Method`].

mod back_off;
pub mod bounded_real;
mod design;
mod flatness;
mod high_gain;
mod inequality;
mod lpvqr;
mod moving;
pub mod polytopic;
mod rate_bounded;
mod region;
mod slpvqr;
mod supervision;
mod supervision_validation;
mod units;
mod validation;

pub use design::{CostWeights, Design, DesignRequest, FrozenDesign, Method, ScheduleKind, design};
pub use high_gain::HighGainOptions;
pub use lpvqr::lqr_by_inequality;
pub use rate_bounded::{RateBounded, RateBoundedOptions};
pub use region::covering_level;
pub use supervision::{GovernorOptions, Supervision, SupervisionError, design_supervised, governed_states, governor};
pub use validation::DesignError;

/// Why there is no design.
#[derive(Debug, thiserror::Error)]
pub enum SynthesisError {
    /// The Riccati equation has no stabilising solution.
    #[error("no regulator was found at parameter {rho:.6}: {source}")]
    Riccati {
        /// Parameter value.
        rho: f64,
        /// The reason.
        source: crate::math::riccati::RiccatiError,
    },
    /// The inequalities contradict each other, which is proved.
    #[error("the inequalities have no solution at parameter {rho:.6}; the contradiction is carried by: {}", carriers.join(", "))]
    Infeasible {
        /// Parameter value.
        rho: f64,
        /// The inequalities with the largest multipliers, largest first, with their share.
        carriers: Vec<String>,
    },
    /// The solver saw no bound of the objective.
    #[error(
        "tr Y grows without end at parameter {rho:.6}, as far as the solver sees: some state costs too little; give it a larger weight in Q"
    )]
    Unbounded {
        /// Parameter value.
        rho: f64,
    },
    /// The solver stopped short of the accuracy asked for.
    #[error(
        "the solver stopped short at parameter {rho:.6} ({reason}); try weights, γ and limits of less different size"
    )]
    Inaccurate {
        /// Parameter value.
        rho: f64,
        /// Why.
        reason: String,
    },
    /// An inequality problem that makes no sense was posed: a defect of this program.
    #[error("ill-posed inequality problem: {0}")]
    Problem(#[from] lmi::Error),
    /// A saturated method needs a bound on every input.
    #[error("input {input} has no limits, or limits that exclude its operating value")]
    UnlimitedInput {
        /// Index of the input.
        input: usize,
    },
    /// The inequalities hold on the grid of a rate-bounded design, but not between its points.
    #[error(
        "with {points} grid points the inequalities of the rate-bounded design still fail between them; try a higher order of its Lyapunov matrix, more grid_points, or a smaller rate"
    )]
    BetweenGridPoints {
        /// Points of the grid.
        points: usize,
    },
    /// The design cannot be supervised as asked.
    #[error("no supervised controller: {0}")]
    Supervision(#[from] SupervisionError),
    /// No gain on the high-gain segment is stable at the controller's sample time.
    #[error(
        "no gain from the low one to R⁻¹BᵀP is stable with the margin asked for at parameter {rho:.6} and a sample time of {sample_time_s:?} s; sample faster, or ask for less gain_margin"
    )]
    SampleTime {
        /// Parameter value.
        rho: f64,
        /// The sample time.
        sample_time_s: f64,
    },
}

impl SynthesisError {
    /// The same error at another parameter value.
    pub fn moved_to(mut self, parameter: f64) -> Self {
        if let SynthesisError::Riccati { rho, .. }
        | SynthesisError::Infeasible { rho, .. }
        | SynthesisError::Unbounded { rho }
        | SynthesisError::Inaccurate { rho, .. }
        | SynthesisError::SampleTime { rho, .. } = &mut self
        {
            *rho = parameter;
        }
        self
    }
}
