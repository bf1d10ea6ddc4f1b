//! What is to be proved of a design, and what is.

use super::nonlinear::NonlinearProof;
use crate::certificate::claim::{Claim, ClaimKind, Verdict};

/// What is to be proved of a design.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProofOptions {
    /// The parameter's largest rate; `None`: the design's own, and for a frozen design the largest that can be proved.
    pub rate: Option<f64>,
    /// Level of the set {V ≤ γ}; `None`: the design's.
    pub level: Option<f64>,
    /// Also look for the largest set that is invariant for the nonlinear plant.
    pub nonlinear: bool,
}

/// What is proved of a design: its claims, and the conditions under which its cost bounds hold.
#[derive(Clone, Debug)]
pub struct Proofs {
    /// The claims, in the order in which they build on each other.
    pub claims: Vec<Claim>,
    /// Whether the rate was asked for, by the caller or by the design: then a claim that is not proved is a failure.
    pub asked: bool,
    /// Largest rate of the parameter for which stability (and invariance of the set) is proved.
    pub stable_up_to: Option<f64>,
    /// Largest rate for which the cost bound is proved, inflated by `cost_factor`.
    pub cost_up_to: Option<f64>,
    /// The cost is at most this times V(x(0)).
    pub cost_factor: f64,
    /// Level of the set that the claims are about; `None` where they hold everywhere.
    pub level: Option<f64>,
    /// What is proved of the nonlinear plant, if it was asked for and anything is.
    pub nonlinear: Option<NonlinearProof>,
}

impl Proofs {
    /// Whether the claim counts in the verdict on the design: all that the design, or the caller, claims. What is looked for beyond that
    /// is a finding, and counts if it is proved.
    pub fn is_counted(&self, claim: &Claim) -> bool {
        // that a set found between grid points is not kept by the sampled loop takes nothing from a design that does not claim it
        let is_found = matches!(claim.kind, ClaimKind::SampledInvariance { .. });
        let is_decided = claim.verdict == Verdict::Proved || claim.verdict == Verdict::Refuted && !is_found;
        // a factor is looked for, none is claimed
        let is_asked = self.asked && !matches!(claim.kind, ClaimKind::SampledCost { .. });
        is_asked || is_decided || matches!(claim.kind, ClaimKind::AsAsked { .. })
    }
}
