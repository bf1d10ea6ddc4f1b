//! Proofs of supervised designs, member by member, and what they say of a flight.
//!
//! A family of nested sets is proved when every claim of every member is; `controller::nested` derives why switching between
//! them adds nothing that would have to be proved. A governor with moving references adds one claim, that the
//! references are motions of the model ([`MotionProof`]).

use super::claim::{Claim, ClaimId, Member, Subject, Verdict, settle, worst};
use super::proof::{MotionProof, ProofOptions, Proofs, Unprovable, prove, prove_motion};
use crate::plant::Plant;
use crate::synthesis::Design;

/// What is proved of a supervised design.
#[derive(Clone, Debug)]
pub struct SupervisedProofs {
    /// Of each member, from the outermost in.
    pub members: Vec<Proofs>,
    /// Of the references of a governor that moves them.
    pub motion: Option<MotionProof>,
    /// The largest rate of the parameter for which every member is proved; infinite without a parameter, `None` if one
    /// is not.
    pub rate: Option<f64>,
    /// γ that is proved against γ that the controller watches, of each member.
    level_shares: Vec<f64>,
    /// All claims, those of inner members with their level.
    pub claims: Vec<Claim>,
}

/// Prove each member of `design`, and the motions of its governor's references.
///
/// # Errors
/// The first member of which nothing can be proved.
pub fn prove_supervised(
    design: &Design,
    plant: &dyn Plant,
    options: &ProofOptions,
) -> Result<SupervisedProofs, Unprovable> {
    let outer = prove(design, plant, options)?;
    let inner_options = ProofOptions { level: None, ..*options };
    let inner = design.inner.iter().map(|inner| prove(inner, plant, &inner_options));
    let members: Vec<Proofs> = std::iter::once(Ok(outer)).chain(inner).collect::<Result<_, _>>()?;
    let designs = || std::iter::once(design).chain(&design.inner);
    let mut claims = members[0].claims.clone();
    for (k, proofs) in members[1..].iter().enumerate() {
        claims.extend(proofs.claims.iter().cloned().map(|claim| claim.of_member(Member::Inner(k))));
    }
    let level = |proofs: &Proofs, design: &Design| proofs.level.or(design.method.gamma()).unwrap_or(f64::NAN);
    let levels: Vec<(&Design, f64)> =
        members.iter().zip(designs()).map(|(proofs, design)| (design, level(proofs, design))).collect();
    let level_shares = levels.iter().map(|(design, level)| level / design.method.gamma().unwrap_or(f64::NAN)).collect();
    let supervisor = design.controller.supervisor.as_ref();
    let governor = supervisor.and_then(|supervisor| supervisor.governor.as_ref());
    let motion = governor.and_then(|governor| Some((governor, governor.motion.as_ref()?)));
    let motion = motion.map(|(governor, motion)| prove_motion(governor, motion, &levels, plant));
    // what the sets absorb follows from the cost bound of each
    let absorbing = |k: usize| {
        let member = if k == 0 { Member::Outer } else { Member::Inner(k - 1) };
        ClaimId { name: "cost", subject: Subject { member, ..Subject::default() } }
    };
    claims.extend(
        motion
            .iter()
            .map(|motion| Claim { premises: (0..members.len()).map(absorbing).collect(), ..motion.claim.clone() }),
    );
    settle(&mut claims);
    let has_parameter = plant.description().scheduling.is_some();
    let rate = members.iter().try_fold(f64::INFINITY, |least, proofs| {
        let reached = proofs.stable_up_to.zip(proofs.cost_up_to).map(|(a, b)| a.min(b))?;
        Some(if has_parameter { least.min(reached) } else { least })
    });
    Ok(SupervisedProofs { members, motion, rate, level_shares, claims })
}

impl SupervisedProofs {
    /// The worst verdict of its claims.
    pub fn verdict(&self) -> Verdict {
        worst(&self.claims)
    }

    /// V/γ with the proved γ, from V/γ with the γ that the controller watches, of member `member`.
    pub fn share(&self, member: usize, watched: f64) -> f64 {
        watched / self.level_shares.get(member).copied().unwrap_or(f64::NAN)
    }
}
