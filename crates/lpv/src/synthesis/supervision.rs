//! Supervised designs: a family of nested certified sets, and a reference governor, around one design.
//!
//! The theory is in [`crate::controller`] (`nested`, `governor`, `motion`). Here the family is designed, member by member with
//! the same request but its own γ, and for a governor with moving references the actuators are divided: the feedback is
//! designed, and later proved, for the share 1 − φ of the symmetric input bounds, and the reference's input gets φ.

use super::flatness::{motion, set_point_states};
use super::{Design, DesignRequest, Method, SynthesisError, design};
use crate::controller::{CertifiedSet, Governor, InputLimits, Member, REFERENCE_SHARE_OF_RATE, Supervisor};
use crate::math::matrix::inverse_spd;
use crate::model::MatrixFunction;
use crate::plant::{Plant, PlantSpec};

/// What the shares of feedback and reference leave to rounding.
const ROUNDING: f64 = 1e-12;

/// What a supervised controller is asked for beyond its design.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Supervision {
    /// Levels γ of inner members, each below the design's own; in any order.
    pub inner_levels: Vec<f64>,
    /// How the reference is moved; `None`: it is the set point.
    pub governor: Option<GovernorOptions>,
}

/// What a reference governor is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct GovernorOptions {
    /// β in (0, 1): the share of the level up to which it lets V come.
    pub level_share: f64,
    /// φ in (0, 1): moving references, with this share of the input bounds; `None`: static references.
    pub feedforward: Option<f64>,
    /// Bounds on the states of a moving reference that are no set points, as deviations from where the plant rests.
    pub state_bounds: Vec<Option<f64>>,
}

/// Why a design cannot be supervised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SupervisionError {
    /// LPVQR knows no certified set.
    #[error("the method knows no certified set; choose a saturated method")]
    NoCertifiedSet,
    /// A frozen design is certified for a parameter at rest only.
    #[error("the design is made for frozen parameters; give it a rate bound")]
    Frozen,
    /// The plant rests nowhere but at its operating point.
    #[error("the plant has no states that can rest at any value")]
    NoSetPoints,
    /// Motions are interpolated over a circle only.
    #[error("the scheduling parameter is not periodic; use static references")]
    NotPeriodic,
    /// No chain of at most four derivatives leads from this state to the inputs.
    #[error(
        "state {state} cannot be moved exactly by the inputs through at most four derivatives; use static references"
    )]
    NotFlat {
        /// Index of the state.
        state: usize,
    },
}

impl GovernorOptions {
    /// The limits for which the feedback is designed: what the reference's share leaves of `actuators` around
    /// `operating_input`.
    pub fn feedback_limits(&self, actuators: &InputLimits, operating_input: &[f64]) -> InputLimits {
        let left = 1.0 - self.feedforward.unwrap_or(0.0);
        let shrink = |limits: &[Option<f64>]| {
            let one =
                |(limit, operating): (&Option<f64>, &f64)| limit.map(|limit| operating + left * (limit - operating));
            limits.iter().zip(operating_input).map(one).collect()
        };
        match self.feedforward {
            None => actuators.clone(),
            Some(_) => InputLimits { min: shrink(&actuators.min), max: shrink(&actuators.max) },
        }
    }
}

impl Supervision {
    /// Whether nothing is asked for.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The limits for which the feedback is designed.
    pub fn feedback_limits(&self, actuators: &InputLimits, operating_input: &[f64]) -> InputLimits {
        self.governor.as_ref().map_or_else(|| actuators.clone(), |g| g.feedback_limits(actuators, operating_input))
    }
}

impl Design {
    /// The certified set that its controller can watch.
    ///
    /// # Errors
    /// [`SupervisionError::NoCertifiedSet`], [`SupervisionError::Frozen`].
    pub fn certified_set(&self) -> Result<CertifiedSet, SupervisionError> {
        let level = self.method.gamma().ok_or(SupervisionError::NoCertifiedSet)?;
        let y = match (&self.rate_bounded, self.controller.scheduling_state) {
            (Some(bounded), _) => bounded.y.clone(),
            (None, None) => {
                inverse_spd(&self.points[0].p).map(MatrixFunction::constant).ok_or(SupervisionError::Frozen)?
            }
            (None, Some(_)) => return Err(SupervisionError::Frozen),
        };
        Ok(CertifiedSet { level, y })
    }

    /// Whether its controller is supervised as `supervision` asks, on actuators with limits `actuators`.
    pub fn is_supervised_as(&self, supervision: &Supervision, actuators: &InputLimits) -> bool {
        let mut levels = supervision.inner_levels.clone();
        levels.sort_by(|a, b| b.total_cmp(a));
        let found_levels: Vec<f64> = self.inner.iter().filter_map(|inner| inner.method.gamma()).collect();
        let limits = supervision.feedback_limits(actuators, &self.controller.operating_input);
        let found = self.controller.supervisor.as_ref().and_then(|supervisor| supervisor.governor.as_ref());
        let same_governor = match (found, &supervision.governor) {
            (None, None) => true,
            (Some(found), Some(options)) => {
                let same_motion = match (&found.motion, options.feedforward) {
                    (None, None) => true,
                    (Some(motion), Some(_)) => motion.state_bounds == options.state_bounds,
                    _ => false,
                };
                found.level_share == options.level_share && same_motion
            }
            _ => false,
        };
        let same_actuators = self.controller.actuators() == actuators && self.controller.limits == limits;
        found_levels == levels && same_governor && same_actuators
    }
}

/// Design `request`, and around it what `supervision` asks for; `request.limits` are the actuators'.
///
/// # Errors
/// As [`design()`]; [`SynthesisError::Supervision`] for what the method or the plant does not allow.
pub fn design_supervised(
    spec: &PlantSpec,
    plant: &dyn Plant,
    request: &DesignRequest,
    supervision: &Supervision,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Design, SynthesisError> {
    if supervision.is_none() {
        return design(spec, plant, request, progress);
    }
    let operating = plant.trim(0.0);
    let limits = supervision.feedback_limits(&request.limits, &operating.input);
    let outer_request = DesignRequest { limits, ..request.clone() };
    let governor = match &supervision.governor {
        Some(options) => Some(governor(plant, &outer_request, options, &request.limits)?),
        None => None,
    };

    let mut outer = design(spec, plant, &outer_request, progress)?;
    let set = outer.certified_set()?;
    let mut levels = supervision.inner_levels.clone();
    levels.sort_by(|a, b| b.total_cmp(a));
    let inner = levels.iter().enumerate().map(|(k, &level)| {
        let method = outer_request.method.at_level(level);
        let name = format!("{}-inner-{}", request.name, k + 1);
        design(spec, plant, &DesignRequest { name, method, ..outer_request.clone() }, progress)
    });
    outer.inner = inner.collect::<Result<_, _>>()?;
    let member =
        |design: &Design| Ok(Member { schedule: design.controller.schedule.clone(), set: design.certified_set()? });
    let inner = outer.inner.iter().map(member).collect::<Result<_, SupervisionError>>()?;
    outer.controller.supervisor = Some(Supervisor { set, inner, governor });
    Ok(outer)
}

/// The governor of `options` for a design of `request`, on actuators with limits `actuators`.
///
/// # Errors
/// [`SupervisionError::NoSetPoints`], [`SupervisionError::NotPeriodic`], [`SupervisionError::NotFlat`];
/// [`SupervisionError::NoCertifiedSet`] where an input is not limited.
pub fn governor(
    plant: &dyn Plant,
    request: &DesignRequest,
    options: &GovernorOptions,
    actuators: &InputLimits,
) -> Result<Governor, SupervisionError> {
    let operating = plant.trim(0.0);
    let scheduling_state = plant.description().scheduling.as_ref().map(|scheduling| scheduling.state);
    let rate = request.rate_bounded.as_ref().map_or(0.0, |bounded| bounded.rate);
    let states = governed_states(plant, rate);
    if states.is_empty() {
        return Err(SupervisionError::NoSetPoints);
    }
    let motion = match options.feedforward {
        None => None,
        Some(share) => {
            let mut motion = motion(plant, &states, rate)?;
            let sigma = actuators.symmetric_bound(&operating.input);
            if !sigma.iter().all(|sigma| sigma.is_finite()) {
                return Err(SupervisionError::NoCertifiedSet);
            }
            motion.input_budget = sigma.iter().map(|sigma| share * sigma * (1.0 - ROUNDING)).collect();
            motion.state_bounds.clone_from(&options.state_bounds);
            motion.actuators = actuators.clone();
            Some(motion)
        }
    };
    Ok(Governor {
        parameter_rate: scheduling_state.filter(|state| states.contains(state)).map(|_| REFERENCE_SHARE_OF_RATE * rate),
        set_point_states: states,
        operating_state: operating.state,
        level_share: options.level_share,
        motion,
    })
}

/// The states that a governor of a design for parameter rates up to `rate` can move: those in whose directions the plant
/// rests anywhere, A(ρ)eⱼ = 0 for every ρ, without the scheduling state where it is certified at rest only.
pub fn governed_states(plant: &dyn Plant, rate: f64) -> Vec<usize> {
    let scheduling_state = plant.description().scheduling.as_ref().map(|scheduling| scheduling.state);
    let mut states = set_point_states(plant);
    states.retain(|&state| rate > 0.0 || scheduling_state != Some(state));
    states
}

impl Method {
    /// The same method at another level; LPVQR as it is.
    pub fn at_level(self, level: f64) -> Self {
        match self {
            Method::Lpvqr => Method::Lpvqr,
            Method::Slpvqr { .. } => Method::Slpvqr { gamma: level },
            Method::HighGainSlpvqr { high_gain, .. } => Method::HighGainSlpvqr { gamma: level, high_gain },
        }
    }
}
