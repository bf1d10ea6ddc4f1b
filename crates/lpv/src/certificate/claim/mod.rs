//! What is claimed of a design, and what is known of it.
//!
//! A [`Claim`] is identified by its [`ClaimKind`] and the [`Subject`] it is about; the sentence that front ends print is made from
//! these and never read back. A claim rests on other claims, its premises: the cost bound on a set rests on the set's invariance, and
//! that on the inputs that do not saturate there. [`settle`] carries the verdicts on premises over: what rests on something that
//! is not proved is not proved.

mod kind;
mod premises;
mod words;

pub use kind::{ClaimKind, Motion};
pub use premises::settle;
pub use words::Words;

use serde::{Deserialize, Serialize, Serializer};
use std::fmt;
use words::{at_witness, witness_words};

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

/// Which system of equations a claim is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Of {
    /// The LPV model.
    #[default]
    Model,
    /// The nonlinear plant.
    Plant,
    /// The polytope of the vertices that stand for an LPV model, where the model itself is known.
    Polytope,
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
            Of::Polytope => f.write_str("polytope.")?,
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

impl Claim {
    /// A claim about the whole design, not yet decided.
    pub fn new(kind: ClaimKind, of: Of, words: &Words) -> Self {
        let (name, subject) = (kind.name(), Subject { of, member: Member::Outer });
        let about = match of {
            Of::Model => "",
            Of::Plant => "the nonlinear plant: ",
            Of::Polytope => "the polytope: ",
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

    /// The same about the polytope alone, with the premises in `names`, which are about it too.
    pub fn of_polytope(mut self, names: &[&'static str]) -> Self {
        (self.of, self.id.subject.of) = (Of::Polytope, Of::Polytope);
        let moved = self.premises.iter_mut().filter(|premise| names.contains(&premise.name));
        moved.for_each(|premise| premise.subject.of = Of::Polytope);
        self.claim = format!("the polytope: {}", self.claim);
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

/// The worst verdict of some claims; `undecided` for none.
pub fn worst(claims: &[Claim]) -> Verdict {
    claims.iter().map(|claim| claim.verdict).min().unwrap_or(Verdict::Undecided)
}
