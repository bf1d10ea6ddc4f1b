//! Claims as sentences. They are made from kind and subject and never read back.

use super::{ClaimKind, Motion, Witness};
use crate::math::decimal::{about, at_least, at_most};

/// Names of the parameter and its unit in sentences.
#[derive(Clone, Debug, Default)]
pub struct Words {
    /// The parameter; empty where there is none.
    pub parameter: String,
    /// Its unit.
    pub unit: String,
    /// How V is written: "x'P x", or "V".
    pub lyapunov: &'static str,
}

impl ClaimKind {
    /// The statement, every number rounded so that it follows from what was proved.
    pub(super) fn sentence(&self, words: &Words) -> String {
        let Words { parameter, unit, lyapunov: v } = words;
        let every = if parameter.is_empty() { String::new() } else { format!(" for every {parameter}") };
        let fixed = if parameter.is_empty() { String::new() } else { format!("{every}, fixed") };
        let moving = |motion: &Motion| match motion {
            Motion::None => String::new(),
            Motion::AtRest => format!("{every}, at rest"),
            Motion::Bounded { rate } => format!(" for |d{parameter}/dt| <= {} {unit}/s{every}", at_least(*rate)),
            Motion::Hull => {
                " for every motion of the parameter in the polytope with rates in the hull of rate_vertices".into()
            }
            Motion::Any => " for every motion of the parameter in the polytope".into(),
            Motion::WithinRanges => format!(" for every motion of {parameter}"),
        };
        match self {
            Self::Weights => "Q is positive semidefinite and R is positive definite".into(),
            Self::LyapunovDefinite => format!("P is positive definite{every}"),
            Self::Unsaturated { level } => {
                format!("the low gain does not saturate on {v} <= {}{every}", at_least(*level))
            }
            Self::Decrease { motion } => format!("{v} decreases{}", moving(motion)),
            Self::Invariance { level, motion } => {
                format!("the set {v} <= {} is invariant{}", at_least(*level), moving(motion))
            }
            Self::Cost { factor, level, motion } => {
                let from = level.map_or(String::new(), |level| format!(" from {v} <= {}", at_least(level)));
                format!("the cost is at most {} {}{from}{}", at_most(*factor), of_the_start(v), moving(motion))
            }
            Self::TransformationError { a, b } => format!(
                "the tensor-product model differs from the model by at most {} in A and {} in B (Frobenius norm){every}",
                at_most(*a),
                at_most(*b)
            ),
            Self::StatesInRange { level, states } => {
                format!(
                    "on {v} <= {} the states stay in the ranges of their parameters: {}",
                    at_least(*level),
                    states.join(", ")
                )
            }
            Self::SampledStability { sample_time_s } => {
                format!("the loop sampled with zero-order hold is stable at T = {sample_time_s} s{fixed}")
            }
            Self::SampledInvariance { level, sample_time_s } => format!(
                "the saturated loop sampled at T = {sample_time_s} s keeps {v} <= {} invariant{fixed}",
                at_least(*level)
            ),
            Self::SampledCost { factor, level, sample_time_s } => {
                let from = level.map_or(String::new(), |level| format!(" from {v} <= {}", at_least(level)));
                let bound = match factor.is_finite() {
                    true => format!("at most {} {}", at_most(*factor), of_the_start(v)),
                    false => format!("bounded by a multiple of {}", of_the_start(v)),
                };
                format!("the cost of the saturated loop sampled at T = {sample_time_s} s is {bound}{from}")
            }
            Self::GovernedMotion { states, farthest } => format!(
                "the governed reference moves as the model does (moves of {} by up to {farthest}, of angles by half a turn)",
                states.join(", ")
            ),
            Self::InducedGain { gain, motion } => {
                let motion = match motion {
                    Motion::Bounded { rate } => format!("every parameter with |rate| <= {}", at_least(*rate)),
                    _ => "every motion of the parameter".into(),
                };
                format!("the induced L2 norm is at most {} for {motion}", at_most(*gain))
            }
            Self::AsAsked { what, asked, proved } => match proved {
                Some(proved) => format!("the {what} {asked} was asked for, and {} is proved", at_least(*proved)),
                None => format!("the {what} {asked} was asked for, and none is proved"),
            },
            Self::GridInequalities => "matrix inequalities hold at every grid point".into(),
            Self::FrozenStability => format!("the closed loop is stable{fixed}"),
            Self::StepCost { step, time_s, bound } => {
                format!("step {step} at t = {time_s} s costs at most {}", at_most(*bound))
            }
            Self::StepStays { step, time_s } => format!("step {step} at t = {time_s} s stays in the certified set"),
            Self::RateKept { parameter } => {
                format!("{parameter} keeps to the rate for which V is proved to decrease")
            }
            Self::Provable => "something can be proved".into(),
        }
    }
}

/// V at the start, in the words of V.
fn of_the_start(v: &str) -> &'static str {
    if v == "V" { "V(x(0))" } else { "x(0)'P x(0)" }
}

/// Where a claim is broken.
pub(super) fn at_witness(witness: &Witness) -> String {
    let Witness { parameter, rate, vertex_weights, vertex_rates, .. } = witness;
    let mut text = match vertex_weights.is_empty() {
        true => format!(" at parameter {}", about(*parameter)),
        false => format!(" at vertex weights {vertex_weights:?}"),
    };
    if *rate != 0.0 {
        text += &format!(" with rate {}", about(*rate));
    }
    if !vertex_rates.is_empty() {
        text += &format!(" with rates {vertex_rates:?}");
    }
    text
}

/// What the motion of a witness does.
pub(super) fn witness_words(kind: &ClaimKind) -> &'static str {
    match kind {
        ClaimKind::LyapunovDefinite => "V is not positive at the state of the witness",
        ClaimKind::Unsaturated { .. } => "a limit is passed at a multiple of the state of the witness, inside the set",
        ClaimKind::Decrease { .. } => "V grows from the state of the witness",
        ClaimKind::Invariance { .. } => "the motion from the state of the witness leaves the set",
        ClaimKind::SampledInvariance { .. } => "the next sample after the state of the witness is outside the set",
        ClaimKind::Cost { .. } => "the motion from a small multiple of the state of the witness costs more",
        ClaimKind::FrozenStability | ClaimKind::SampledStability { .. } => {
            "the motion from the state of the witness does not come to rest"
        }
        _ => "see the witness",
    }
}
