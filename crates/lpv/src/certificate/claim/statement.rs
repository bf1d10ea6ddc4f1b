//! A claim with its verdict.

use super::kind::ClaimKind;
use super::subject::{ClaimId, Member, Of, Subject};
use super::verdict::Verdict;
use super::witness::Witness;
use super::words::{Words, at_witness, witness_words};
use serde::Serialize;

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
