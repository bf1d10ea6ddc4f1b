//! Checks a [`Design`] from the plant alone: the model is derived again, every inequality is computed anew from K and P,
//! and the solver that made the design is not asked.
//!
//! A [`Claim`] gets one of four verdicts ([`Verdict`]). [`check`] computes at points, in floating point, and its best verdict is
//! `numerical`; [`prove`] proves over the whole range of the parameter.

mod claim;
mod excursion;
mod inequality;
mod lyapunov;
mod proof;
mod rest;
mod stability;
mod step;
mod supervised;

pub use claim::{Claim, ClaimId, ClaimKind, Member, Motion, Of, Subject, Verdict, Witness, Words, settle, worst};
pub use excursion::{Excursion, excursion};
pub use inequality::{BlockMargin, block_margins};
pub use lyapunov::{LyapunovFunction, unsaturated_level};
pub use proof::record::{Record, RecordError};
pub use proof::{
    COST_INFLATION, MOST_CELLS, MotionProof, NonlinearProof, PolytopicClaim, PolytopicLyapunov, ProofOptions, Proofs,
    SampledCost, ScheduledClaim, Unprovable, lyapunov_matrix, prove, prove_gain, prove_polytopic, prove_sampled_cost,
    prove_scheduled,
};
pub use rest::{Unrest, rests_exactly, unrest};
pub use stability::{StabilityMargin, frozen_stability};
pub use step::{BoundBasis, BoundOf, StepBound, StepConditions, UnmetCondition, step_bound};
pub use supervised::{SupervisedProofs, prove_supervised};

use crate::math::decimal::{Rounding, about, decimal};
use crate::plant::Plant;
use crate::synthesis::Design;
use proof::unstable_at;

/// Number of parameter values at which frozen stability is computed, for each grid point of the design.
pub const FINE_POINTS_PER_GRID_POINT: usize = 8;

/// Check everything that can be said of `design` without a flight or a proof, in floating point:
///
/// 1. every block of every inequality of its method is positive definite at every grid point,
/// 2. the frozen closed loop ẋ = (A(ρ) − B(ρ)K(ρ))x is stable on a fine grid, with the gain that flies,
/// 3. so is the sampled loop with zero-order hold at the design's sample time.
///
/// The best verdict is `numerical`. A check that fails is `undecided`, because a sufficient condition refutes nothing and an
/// eigenvalue in floating point is no witness; a frozen loop that is proved to be unstable is `refuted`.
/// `plant` is the plant that `design.plant` describes.
pub fn check(design: &Design, plant: &dyn Plant) -> Vec<Claim> {
    let words = proof::words(plant);
    let count = FINE_POINTS_PER_GRID_POINT * design.points.len();
    let stability = frozen_stability(design, plant, count);
    let at = |rho: f64| match &plant.description().scheduling {
        Some(scheduling) => format!("at {} = {} {}", scheduling.parameter, about(rho), scheduling.unit),
        None => "at the operating point".into(),
    };
    let checked = |kind, margin: f64, detail: String| {
        let verdict = if margin > 0.0 { Verdict::Numerical } else { Verdict::Undecided };
        Claim::new(kind, Of::Model, &words).decided(verdict, margin, detail)
    };
    let mut frozen = checked(
        ClaimKind::FrozenStability,
        -stability.abscissa,
        format!("max Re λ = {} 1/s {}, {count} parameter values", about(stability.abscissa), at(stability.abscissa_at)),
    );
    if frozen.verdict == Verdict::Undecided {
        frozen = frozen.refuted_by(unstable_at(design, plant, stability.abscissa_at));
    }
    let sampled = checked(
        ClaimKind::SampledStability { sample_time_s: design.sample_time_s },
        1.0 - stability.radius,
        format!(
            "max |λ| = {} {}, {count} parameter values",
            decimal(stability.radius, 9, Rounding::Nearest),
            at(stability.radius_at)
        ),
    );
    vec![inequalities_claim(design, plant, &words), frozen, sampled]
}

/// The claims of [`check`] and of a proof as one certificate: a check of what is proved (or decided otherwise) as a whole is left out,
/// so that a design all of whose claims are proved is proved.
pub fn merged(checked: Vec<Claim>, proved: Vec<Claim>) -> Vec<Claim> {
    let known = |claim: &Claim, names: &[&str]| {
        let of_member = proved.iter().filter(|other| other.id.subject == claim.id.subject);
        let mut named = of_member.filter(|other| names.contains(&other.id.name)).peekable();
        named.peek().is_some() && named.all(|other| other.verdict == Verdict::Proved)
    };
    let is_implied = |claim: &Claim| match claim.kind {
        ClaimKind::FrozenStability => known(claim, &["decrease", "invariance"]),
        ClaimKind::GridInequalities => {
            known(claim, &["cost"])
                && known(claim, &["decrease", "invariance"])
                && !has_open(&proved, claim, "unsaturated")
        }
        _ => proved.iter().any(|other| other.id == claim.id),
    };
    // what the proof could not decide, with what was found at points
    let with_points = |claim: &Claim| match checked.iter().find(|other| other.id == claim.id) {
        Some(points) if claim.verdict == Verdict::Undecided => {
            Claim { detail: format!("{}; {}", claim.detail, points.detail), ..claim.clone() }
        }
        _ => claim.clone(),
    };
    let told: Vec<Claim> = proved.iter().map(with_points).collect();
    checked.into_iter().filter(|claim| !is_implied(claim)).chain(told).collect()
}

fn has_open(proved: &[Claim], claim: &Claim, name: &str) -> bool {
    let same = |other: &&Claim| other.id.subject == claim.id.subject && other.id.name == name;
    proved.iter().filter(same).any(|other| other.verdict != Verdict::Proved)
}

fn inequalities_claim(design: &Design, plant: &dyn Plant, words: &Words) -> Claim {
    let margins = block_margins(design, plant);
    let claim = Claim::new(ClaimKind::GridInequalities, Of::Model, words);
    let worst = margins.iter().min_by(|a, b| nan_first(a.smallest_eigenvalue, b.smallest_eigenvalue));
    match worst {
        None => claim.decided(Verdict::Undecided, f64::NAN, "the design has no points"),
        Some(block) => claim.decided(
            if block.smallest_eigenvalue > 0.0 { Verdict::Numerical } else { Verdict::Undecided },
            block.smallest_eigenvalue,
            format!(
                "least λ_min = {} of {} blocks, in \"{}\" at parameter {}",
                about(block.smallest_eigenvalue),
                margins.len(),
                block.name,
                about(block.parameter)
            ),
        ),
    }
}

/// Order of margins in which NaN, a margin that could not be computed, is the worst.
fn nan_first(a: f64, b: f64) -> std::cmp::Ordering {
    b.is_nan().cmp(&a.is_nan()).then(a.total_cmp(&b))
}
