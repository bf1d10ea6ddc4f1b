//! What is claimed of a design, and what is known of it.
//!
//! A [`Claim`] is identified by its [`ClaimKind`] and the [`Subject`] it is about; the sentence that front ends print is made from
//! these and never read back. A claim rests on other claims, its premises: the cost bound on a set rests on the set's invariance, and
//! that on the inputs that do not saturate there. [`settle`] carries the verdicts on premises over: what rests on something that
//! is not proved is not proved.

use crate::math::decimal::{about, at_least, at_most};
use serde::{Deserialize, Serialize, Serializer};
use std::fmt;

/// What is known of a claim, from worst to best.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// False, with a witness.
    Refuted,
    /// Neither shown nor refuted; the detail says why.
    Undecided,
    /// Holds at the points checked, in floating point; not proved.
    Numerical,
    /// Holds for all parameters, with rounding accounted for.
    Proved,
}

impl Verdict {
    /// The word that reports print.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Proved => "proved",
            Verdict::Numerical => "numerical",
            Verdict::Refuted => "refuted",
            Verdict::Undecided => "undecided",
        }
    }
}

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

/// Which system of equations a claim is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Of {
    /// The LPV model.
    #[default]
    Model,
    /// The nonlinear plant.
    Plant,
}

/// Which part of a design a claim is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Member {
    /// The design itself; of a family the outermost.
    #[default]
    Outer,
    /// The inner design of this number, from 0.
    Inner(usize),
    /// The vertex or grid point of this number, from 0, designed by itself.
    Point(usize),
}

/// What a claim is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub struct Subject {
    /// The system of equations.
    pub of: Of,
    /// The part of the design.
    pub member: Member,
}

/// Name of a claim within a certificate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ClaimId {
    /// [`ClaimKind::name`]
    pub name: &'static str,
    /// What it is about.
    pub subject: Subject,
}

impl fmt::Display for ClaimId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.subject.member {
            Member::Outer => {}
            Member::Inner(k) => write!(f, "inner[{k}].")?,
            Member::Point(k) => write!(f, "point[{k}].")?,
        }
        match self.subject.of {
            Of::Model => {}
            Of::Plant => f.write_str("plant.")?,
        }
        f.write_str(self.name)
    }
}

impl Serialize for ClaimId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A statement about a design and what is known of it.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// Its name in the certificate, by which others rest on it.
    pub id: ClaimId,
    /// What is claimed.
    #[serde(flatten)]
    pub kind: ClaimKind,
    /// The system that it is about.
    pub of: Of,
    /// The statement, for people.
    pub claim: String,
    /// What it rests on.
    pub premises: Vec<ClaimId>,
    /// What is known of it.
    pub verdict: Verdict,
    /// By how much it holds (positive) or fails (negative), in the unit that the detail names; NaN where that is not known.
    pub margin: f64,
    /// Parameter at which the margin is attained, or the check stopped; `None` where there is none.
    pub at: Option<f64>,
    /// Where the margin is attained, or what stopped the check.
    pub detail: String,
    /// What breaks a refuted claim.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub witness: Option<Witness>,
    /// Cells of the parameter's range that a proof took; 0 where nothing was to be proved.
    pub cells: usize,
    /// Seconds that it took.
    pub seconds: f64,
}

/// A state whose own motion breaks a claim, at this parameter and rate.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Witness {
    /// ρ
    pub parameter: f64,
    /// ρ̇
    pub rate: f64,
    /// ρ as convex weights of the vertices, over a polytope.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vertex_weights: Vec<f64>,
    /// ρ̇ of these weights.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vertex_rates: Vec<f64>,
    /// The state (of a bordered matrix the direction, with the border first).
    pub state: Vec<f64>,
    /// Proved bound on what the claim asks to be positive, which is negative.
    pub value: f64,
}

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
    /// Its name, stable across versions: what machines look for.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Weights => "weights",
            Self::LyapunovDefinite => "lyapunov-definite",
            Self::Unsaturated { .. } => "unsaturated",
            Self::Decrease { .. } => "decrease",
            Self::Invariance { .. } => "invariance",
            Self::Cost { .. } => "cost",
            Self::SampledStability { .. } => "sampled-stability",
            Self::SampledInvariance { .. } => "sampled-invariance",
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

    /// The statement, every number rounded so that it follows from what was proved.
    fn sentence(&self, words: &Words) -> String {
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
            Self::SampledStability { sample_time_s } => {
                format!("the loop sampled with zero-order hold is stable at T = {sample_time_s} s{fixed}")
            }
            Self::SampledInvariance { level, sample_time_s } => format!(
                "the saturated loop sampled at T = {sample_time_s} s keeps {v} <= {} invariant{fixed}",
                at_least(*level)
            ),
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

impl Claim {
    /// A claim about the whole design, not yet decided.
    pub fn new(kind: ClaimKind, of: Of, words: &Words) -> Self {
        let (name, subject) = (kind.name(), Subject { of, member: Member::Outer });
        let about = match of {
            Of::Model => "",
            Of::Plant => "the nonlinear plant: ",
        };
        Self {
            claim: format!("{about}{}", kind.sentence(words)),
            id: ClaimId { name, subject },
            kind,
            of,
            premises: Vec::new(),
            verdict: Verdict::Undecided,
            margin: f64::NAN,
            at: None,
            detail: String::new(),
            witness: None,
            cells: 0,
            seconds: 0.0,
        }
    }

    /// With this verdict, margin and detail.
    pub fn decided(self, verdict: Verdict, margin: f64, detail: impl Into<String>) -> Self {
        Self { verdict, margin, detail: detail.into(), ..self }
    }

    /// Refuted, where there is a witness.
    pub fn refuted_by(mut self, witness: Option<Witness>) -> Self {
        if let Some(witness) = witness {
            self.verdict = Verdict::Refuted;
            // a margin that is known says more
            self.margin = if self.margin.is_finite() { self.margin } else { witness.value };
            self.detail = format!("false{}: {}", at_witness(&witness), witness_words(&self.kind));
            self.witness = Some(witness);
        }
        self
    }

    /// The same about the nonlinear plant; its premises stay those of the model.
    pub fn of_plant(mut self) -> Self {
        (self.of, self.id.subject.of) = (Of::Plant, Of::Plant);
        self
    }

    /// Resting on the claims of these names about the same member's model.
    pub fn resting_on(mut self, names: &[&'static str]) -> Self {
        let subject = Subject { of: Of::Model, ..self.id.subject };
        self.premises.extend(names.iter().map(|&name| ClaimId { name, subject }));
        self
    }

    /// The same claim about another member of a family.
    pub fn of_member(mut self, member: Member) -> Self {
        let moved = |id: &mut ClaimId| id.subject.member = member;
        moved(&mut self.id);
        self.premises.iter_mut().for_each(moved);
        let part = match member {
            Member::Outer => return self,
            Member::Inner(k) => format!("inner set {}", k + 1),
            Member::Point(k) => format!("at point {} with the parameter at rest", k + 1),
        };
        self.claim = format!("{part}: {}", self.claim);
        self
    }
}

/// Where a claim is broken.
fn at_witness(witness: &Witness) -> String {
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
fn witness_words(kind: &ClaimKind) -> &'static str {
    match kind {
        ClaimKind::LyapunovDefinite => "V is not positive at the state of the witness",
        ClaimKind::Unsaturated { .. } => "a limit is passed at a multiple of the state of the witness, inside the set",
        ClaimKind::Decrease { .. } => "V grows from the state of the witness",
        ClaimKind::Invariance { .. } => "the motion from the state of the witness leaves the set",
        ClaimKind::Cost { .. } => "the motion from a small multiple of the state of the witness costs more",
        ClaimKind::FrozenStability | ClaimKind::SampledStability { .. } => {
            "the motion from the state of the witness does not come to rest"
        }
        _ => "see the witness",
    }
}

/// Carry the verdicts on premises over: a claim is proved only if each of its premises is, and numerical at best if one is; a premise
/// that is refuted, undecided or missing leaves it undecided, and is named.
pub fn settle(claims: &mut [Claim]) {
    if crate::mutant::is("premise-ignored") {
        return;
    }
    // a chain of premises is no longer than there are claims
    for _ in 0..claims.len() {
        let before: Vec<Verdict> = claims.iter().map(|claim| claim.verdict).collect();
        for at in 0..claims.len() {
            let premises = claims[at].premises.clone();
            let known = premises.iter().map(|id| (id, claims.iter().find(|claim| claim.id == *id)));
            let worst = known.min_by_key(|(_, claim)| claim.map(|claim| claim.verdict));
            let Some((id, premise)) = worst else { continue };
            let (verdict, reason) = match premise {
                None => (Verdict::Undecided, format!("it rests on {id}, of which nothing is known")),
                Some(premise) => match premise.verdict {
                    Verdict::Proved => continue,
                    Verdict::Numerical => {
                        (Verdict::Numerical, format!("it rests on a numerical check: {}", premise.claim))
                    }
                    word => (Verdict::Undecided, format!("it rests on what is {}: {}", word.word(), premise.claim)),
                },
            };
            let is_refuted_premise = premise.is_some_and(|premise| premise.verdict == Verdict::Refuted);
            let claim = &mut claims[at];
            // a witness of its own stands, unless what it was evaluated with is false
            let stands = claim.verdict == Verdict::Refuted && !is_refuted_premise;
            if stands || claim.verdict <= verdict && !is_refuted_premise {
                continue;
            }
            if claim.verdict != verdict {
                claim.detail = reason;
                claim.margin = f64::NAN;
                claim.witness = None;
                claim.verdict = verdict;
            }
        }
        if claims.iter().zip(&before).all(|(claim, before)| claim.verdict == *before) {
            return;
        }
    }
}

/// The worst verdict of some claims; `undecided` for none.
pub fn worst(claims: &[Claim]) -> Verdict {
    claims.iter().map(|claim| claim.verdict).min().unwrap_or(Verdict::Undecided)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(kind: ClaimKind, verdict: Verdict, premises: &[&'static str]) -> Claim {
        Claim::new(kind, Of::Model, &Words { lyapunov: "V", ..Words::default() })
            .decided(verdict, 1.0, "")
            .resting_on(premises)
    }

    fn verdicts(claims: &[Claim]) -> Vec<Verdict> {
        claims.iter().map(|claim| claim.verdict).collect()
    }

    #[test]
    fn nothing_is_better_than_what_it_rests_on() {
        use Verdict::{Numerical, Proved, Refuted, Undecided};
        let chain = |first: Verdict, last: Verdict| {
            let mut claims = vec![
                // premises may come after what rests on them
                claim(ClaimKind::Cost { factor: 1.0, level: None, motion: Motion::None }, last, &["invariance"]),
                claim(ClaimKind::Invariance { level: 1.0, motion: Motion::None }, Proved, &["unsaturated"]),
                claim(ClaimKind::Unsaturated { level: 1.0 }, first, &[]),
            ];
            settle(&mut claims);
            verdicts(&claims)
        };
        assert_eq!(chain(Proved, Proved), [Proved, Proved, Proved]);
        assert_eq!(chain(Numerical, Proved), [Numerical, Numerical, Numerical]);
        assert_eq!(chain(Undecided, Proved), [Undecided, Undecided, Undecided]);
        assert_eq!(chain(Refuted, Proved), [Undecided, Undecided, Refuted]);
        // a witness of its own stands
        assert_eq!(chain(Undecided, Refuted), [Refuted, Undecided, Undecided]);
    }

    #[test]
    fn a_missing_premise_is_named() {
        let mut claims = vec![claim(ClaimKind::Decrease { motion: Motion::None }, Verdict::Proved, &["weights"])];
        settle(&mut claims);
        assert_eq!(claims[0].verdict, Verdict::Undecided);
        assert!(claims[0].detail.contains("weights"), "{}", claims[0].detail);
    }

    #[test]
    fn a_refuted_premise_takes_a_refutation_back() {
        let mut claims = vec![
            claim(ClaimKind::LyapunovDefinite, Verdict::Refuted, &[]),
            claim(ClaimKind::Decrease { motion: Motion::None }, Verdict::Refuted, &["lyapunov-definite"]),
        ];
        settle(&mut claims);
        assert_eq!(verdicts(&claims), [Verdict::Refuted, Verdict::Undecided]);
    }
}
