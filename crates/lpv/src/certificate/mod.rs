//! Checks a [`Design`] from the plant alone: the model is derived again, every inequality is computed anew from K and P,
//! and the solver that made the design is not asked.
//!
//! A claim gets one of four verdicts ([`Verdict`]). Nothing here is a proof yet, so the best verdict given is `numerical`:
//! the claim holds at the points that were checked, in floating point.

mod inequality;
mod region;
mod stability;

pub use inequality::{BlockMargin, block_margins};
pub use region::{StepBound, StepConditions, UnmetCondition, step_bound, unsaturated_level};
pub use stability::{StabilityMargin, frozen_stability};

use crate::plant::Plant;
use crate::synthesis::Design;
use serde::{Deserialize, Serialize};

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

/// A statement about a design and what is known of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Claim {
    /// The statement.
    pub claim: String,
    /// What is known of it.
    pub verdict: Verdict,
    /// By how much it holds (positive) or fails (negative), in the unit that the detail names.
    pub margin: f64,
    /// Where the margin is attained, or what stopped the check.
    pub detail: String,
}

/// Number of parameter values at which frozen stability is computed, for each grid point of the design.
pub const FINE_POINTS_PER_GRID_POINT: usize = 8;

/// Check everything that can be said of `design` without a flight:
///
/// 1. every block of every inequality of its method is positive definite at every grid point,
/// 2. the frozen closed loop ẋ = (A(ρ) − B(ρ)K(ρ))x is stable on a fine grid, with the gain that flies,
/// 3. so is the sampled loop with zero-order hold at the design's sample time.
///
/// `plant` is the plant that `design.plant` describes.
pub fn check(design: &Design, plant: &dyn Plant) -> Vec<Claim> {
    let mut claims = vec![inequalities_claim(design, plant)];
    let count = FINE_POINTS_PER_GRID_POINT * design.points.len();
    let stability = frozen_stability(design, plant, count);
    let at = |rho: f64| match &plant.description().scheduling {
        Some(scheduling) => format!("at {} = {rho:.4} {}", scheduling.parameter, scheduling.unit),
        None => "at the operating point".into(),
    };
    let verdict = |margin: f64| {
        if margin > 0.0 { Verdict::Numerical } else { Verdict::Refuted }
    };
    claims.push(Claim {
        claim: "frozen closed loop is stable".into(),
        verdict: verdict(-stability.abscissa),
        margin: -stability.abscissa,
        detail: format!(
            "max Re λ = {:.4} 1/s {}, {count} parameter values",
            stability.abscissa,
            at(stability.abscissa_at)
        ),
    });
    claims.push(Claim {
        claim: format!("sampled closed loop is stable at T = {} s", design.sample_time_s),
        verdict: verdict(1.0 - stability.radius),
        margin: 1.0 - stability.radius,
        detail: format!("max |λ| = {:.6} {}, {count} parameter values", stability.radius, at(stability.radius_at)),
    });
    claims
}

fn inequalities_claim(design: &Design, plant: &dyn Plant) -> Claim {
    let margins = block_margins(design, plant);
    let claim = "matrix inequalities hold at every grid point".to_string();
    let worst = margins.iter().min_by(|a, b| nan_first(a.smallest_eigenvalue, b.smallest_eigenvalue));
    match worst {
        None => {
            Claim { claim, verdict: Verdict::Undecided, margin: f64::NAN, detail: "the design has no points".into() }
        }
        Some(block) => Claim {
            claim,
            verdict: if block.smallest_eigenvalue > 0.0 { Verdict::Numerical } else { Verdict::Refuted },
            margin: block.smallest_eigenvalue,
            detail: format!(
                "least λ_min = {:.3e} of {} blocks, in \"{}\" at parameter {:.4}",
                block.smallest_eigenvalue,
                margins.len(),
                block.name,
                block.parameter
            ),
        },
    }
}

/// Order of margins in which NaN, a margin that could not be computed, is the worst.
fn nan_first(a: f64, b: f64) -> std::cmp::Ordering {
    b.is_nan().cmp(&a.is_nan()).then(a.total_cmp(&b))
}
