//! Checks a [`Design`] from the plant alone: the model is derived again, every inequality is computed anew from K and P,
//! and the solver that made the design is not asked.
//!
//! A claim gets one of four verdicts ([`Verdict`]). [`check`] computes at points, in floating point, and its best verdict is
//! `numerical`; [`prove`] proves over the whole range of the parameter.

mod inequality;
mod proof;
mod region;
mod stability;
mod supervised;

pub use inequality::{BlockMargin, block_margins};
pub use proof::{
    COST_INFLATION, MotionProof, NonlinearProof, PolytopicClaim, PolytopicLyapunov, ProofOptions, Proofs, Record,
    RecordError, Unprovable, lyapunov_matrix, prove, prove_gain, prove_polytopic,
};
pub use region::{
    Excursion, StepBound, StepConditions, UnmetCondition, excursion, lyapunov_value, step_bound, unsaturated_level,
};
pub use stability::{StabilityMargin, frozen_stability};
pub use supervised::{SupervisedProofs, prove_supervised};

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
    /// What breaks a refuted claim, where it was found by a proof.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub witness: Option<Witness>,
    /// Cells of the parameter's range that a proof took; 0 where nothing was to be proved.
    #[serde(default)]
    pub cells: usize,
    /// Seconds that it took.
    #[serde(default)]
    pub seconds: f64,
}

impl Claim {
    /// A claim that was checked at points, without a proof.
    pub fn checked(claim: impl Into<String>, verdict: Verdict, margin: f64, detail: impl Into<String>) -> Self {
        let (claim, detail) = (claim.into(), detail.into());
        Self { claim, verdict, margin, detail, witness: None, cells: 0, seconds: 0.0 }
    }
}

/// A motion that breaks a claim: at this parameter and rate the quadratic form of the claim is on the wrong side of zero
/// along `state`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Witness {
    /// ρ
    pub parameter: f64,
    /// ρ̇
    pub rate: f64,
    /// ρ as convex weights of the vertices, over a polytope.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vertex_weights: Vec<f64>,
    /// ρ̇ of these weights.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vertex_rates: Vec<f64>,
    /// The direction in state space (of a bordered matrix, with the border first).
    pub state: Vec<f64>,
    /// Proved bound on the form, which is negative where the claim asks for positive.
    pub value: f64,
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
    let witness = |margin: f64, parameter: f64| {
        (verdict(margin) == Verdict::Refuted).then(|| Witness { parameter, value: margin, ..Witness::default() })
    };
    let frozen = Claim::checked(
        "frozen closed loop is stable",
        verdict(-stability.abscissa),
        -stability.abscissa,
        format!("max Re λ = {:.4} 1/s {}, {count} parameter values", stability.abscissa, at(stability.abscissa_at)),
    );
    claims.push(Claim { witness: witness(-stability.abscissa, stability.abscissa_at), ..frozen });
    let sampled = Claim::checked(
        format!("sampled closed loop is stable at T = {} s", design.sample_time_s),
        verdict(1.0 - stability.radius),
        1.0 - stability.radius,
        format!("max |λ| = {:.6} {}, {count} parameter values", stability.radius, at(stability.radius_at)),
    );
    claims.push(Claim { witness: witness(1.0 - stability.radius, stability.radius_at), ..sampled });
    claims
}

fn inequalities_claim(design: &Design, plant: &dyn Plant) -> Claim {
    let margins = block_margins(design, plant);
    let claim = "matrix inequalities hold at every grid point".to_string();
    let worst = margins.iter().min_by(|a, b| nan_first(a.smallest_eigenvalue, b.smallest_eigenvalue));
    match worst {
        None => Claim::checked(claim, Verdict::Undecided, f64::NAN, "the design has no points"),
        Some(block) => Claim::checked(
            claim,
            if block.smallest_eigenvalue > 0.0 { Verdict::Numerical } else { Verdict::Refuted },
            block.smallest_eigenvalue,
            format!(
                "least λ_min = {:.3e} of {} blocks, in \"{}\" at parameter {:.4}",
                block.smallest_eigenvalue,
                margins.len(),
                block.name,
                block.parameter
            ),
        ),
    }
}

/// Order of margins in which NaN, a margin that could not be computed, is the worst.
fn nan_first(a: f64, b: f64) -> std::cmp::Ordering {
    b.is_nan().cmp(&a.is_nan()).then(a.total_cmp(&b))
}
