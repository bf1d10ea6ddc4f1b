//! Proofs over the continuous range of the parameter, between grid points too, with every rounding accounted for.
//!
//! The range is cut into cells. On each cell the matrix of a claim is enclosed by its Taylor form of second order in
//! interval arithmetic: the plant's equations, their Jacobians, the schedule that flies and the Lyapunov function are all
//! evaluated over intervals, none is sampled. Gershgorin's theorem after a congruence then proves it definite on the whole
//! cell, or an eigenvector in interval arithmetic refutes it in the middle, or narrower cells take its place. The claims are affine in
//! the parameter's rate, so that both ends of its interval are enough.
//!
//! The solver is not asked, and no number but P (or Y), the gains and the model enters. `docs/proved.md` says what is proved
//! and what is not.

mod cells;
mod claims;
mod closed_loop;
mod decrease;
mod difference;
mod enclosed;
mod gain;
mod interpolated;
mod matrix;
mod mean_value;
mod motion;
mod nonlinear;
mod place;
mod polytopic;
mod proofs;
pub(super) mod record;
mod rowwise;
mod sampled;
mod sampled_constant;
mod sampled_cost;
mod sampled_loop;
mod sampled_saturated;
mod sampled_spectrum;
mod sampled_witness;
mod scheduled;
mod sought;
mod value;
mod weights;
mod witness;

pub(super) use claims::words;
pub(super) use closed_loop::Form;
pub use closed_loop::Unprovable;
pub use gain::prove_gain;
pub use motion::MotionProof;
pub(super) use motion::prove_motion;
pub use nonlinear::NonlinearProof;
pub use polytopic::{PolytopicClaim, PolytopicLyapunov, prove_polytopic};
pub use proofs::{ProofOptions, Proofs};
pub use sampled_cost::{SampledCost, prove_sampled_cost};
pub use scheduled::{MOST_CELLS, ScheduledClaim, prove_scheduled};
pub use sought::{COST_INFLATION, COST_INFLATION_RATE_BOUNDED};

use super::claim::{Claim, ClaimKind, Of, Verdict, Witness, settle};
use crate::mutant;
use crate::plant::Plant;
use crate::synthesis::Design;
use cells::Attempt;
use claims::{definite, unsaturated};
use closed_loop::ClosedLoop;
use decrease::DecreaseProof;
use std::time::Instant;

/// Prove what can be proved of `design`, for the plant that it names:
///
/// 1. Q ⪰ 0, R ≻ 0 and P(ρ) ≻ 0;
/// 2. on {V ≤ γ} no limited input of the low gain (K, or F of high gain) saturates;
/// 3. V falls along every motion of the LPV model with |ρ̇| ≤ r, under every mixture of saturated rows, so that {V ≤ γ} is
///    invariant;
/// 4. the cost is at most V(x(0)) times a factor for |ρ̇| ≤ r;
/// 5. the loop with zero-order hold at the design's sample time is stable at every fixed ρ, while no input saturates;
/// 6. of a plant without a parameter, the cost of the saturated loop with zero-order hold is at most κ V(x(0)), for the least κ found;
/// 7. where it is asked for, the largest set {V ≤ c} that is invariant for the nonlinear plant.
pub fn prove(design: &Design, plant: &dyn Plant, options: &ProofOptions) -> Result<Proofs, Unprovable> {
    let closed_loop = ClosedLoop::new(design, plant)?;
    let words = words(plant);
    let mut claims = vec![weights::claim(&design.weights, &words), definite(&closed_loop, &words)];
    let asked_level = options.level.or(design.method.gamma());
    // a frozen design claims its level at the grid points, and what is proved between them is a finding
    let is_claimed = options.level.is_some() || design.rate_bounded.is_some() || !closed_loop.has_parameter;
    let level = unsaturated(&closed_loop, &words, asked_level, is_claimed, &mut claims);

    let started = Instant::now();
    let mut decrease = DecreaseProof::new(&closed_loop);
    let own = design.rate_bounded.as_ref().map(|bounded| bounded.rate);
    let asked = if closed_loop.has_parameter { options.rate.or(own) } else { Some(0.0) };
    let cost_factor = match (closed_loop.has_parameter, own) {
        (false, _) => 1.0,
        (true, Some(_)) => COST_INFLATION_RATE_BOUNDED,
        (true, None) => COST_INFLATION,
    };
    let mut reached = [None, None];
    for (place, (cost, factor)) in [(0.0, 1.0), (1.0, cost_factor)].into_iter().enumerate() {
        let (rate, attempt) = match asked {
            Some(rate) => (rate, decrease.at(rate, [factor, cost])),
            None => decrease.largest_rate([factor, cost]),
        };
        if let Attempt::Proved(_) = attempt {
            reached[place] = Some(rate);
        }
        let motion = closed_loop.motion(rate);
        let kind = match (place, level) {
            (0, None) => ClaimKind::Decrease { motion },
            (0, Some(level)) => ClaimKind::Invariance { level, motion },
            _ if mutant::is("cost-factor-lowered") => ClaimKind::Cost { factor: 1.0, level, motion },
            _ => ClaimKind::Cost { factor, level, motion },
        };
        let premises: &[&str] = match (place, level) {
            (0, None) => &["lyapunov-definite"],
            (0, Some(_)) => &["lyapunov-definite", "unsaturated"],
            (_, None) => &["weights", "lyapunov-definite"],
            (_, Some(_)) => &["weights", "lyapunov-definite", "unsaturated", "invariance"],
        };
        let witness = match (&attempt, place) {
            (Attempt::Refuted { .. }, 0) => closed_loop.leaves(&attempt, level),
            // only a claim about the cost is refuted by a cost
            (Attempt::Refuted { place, .. } | Attempt::Open { place, .. }, 1) => closed_loop.costs_more(place, factor),
            _ => None,
        };
        let mut claim = words.claim(kind, attempt, &closed_loop, decrease.cells(), started).resting_on(premises);
        claim = claim.refuted_by(witness);
        if asked.is_none() && claim.verdict == Verdict::Refuted {
            // nobody claimed it: with the gain between the grid points this P is no bound even at rest, another may be
            claim.verdict = Verdict::Undecided;
            claim.detail = format!("no rate could be proved: {}", claim.detail);
        }
        claims.push(claim);
    }
    if let (Some(rate), None) = (options.rate.filter(|_| closed_loop.has_parameter), reached[0]) {
        let (found, attempt) = decrease.largest_rate([1.0, 0.0]);
        let proved = matches!(attempt, Attempt::Proved(_)).then_some(found);
        claims.push(Claim::new(ClaimKind::AsAsked { what: "rate", asked: rate, proved }, Of::Model, &words));
    }
    claims.push(sampled::prove(&closed_loop, &words, design.sample_time_s));
    if let Some(level) = level {
        let is_founded = claims.iter().all(|c| c.id.name != "unsaturated" || c.verdict == Verdict::Proved);
        claims.push(sampled_saturated::prove(&closed_loop, &words, level, design.sample_time_s, is_founded));
    }
    if !closed_loop.has_parameter {
        claims.push(sampled_cost::claim(&closed_loop, &words, level, design.sample_time_s));
    }
    let mut nonlinear = None;
    if options.nonlinear {
        let (found, proof) = nonlinear::prove(&closed_loop, &words, level);
        claims.extend(found);
        nonlinear = proof;
    }
    settle(&mut claims);
    // what a claim rests on is part of what is reached
    let holds = |name: &str| claims.iter().filter(|c| c.id.name == name).all(|c| c.verdict == Verdict::Proved);
    let stable_up_to = reached[0].filter(|_| holds("decrease") && holds("invariance"));
    let cost_up_to = reached[1].filter(|_| holds("cost"));
    Ok(Proofs { asked: asked.is_some(), stable_up_to, cost_up_to, cost_factor, level, nonlinear, claims })
}

/// The witness that the frozen loop is not stable at `rho`, where that can be proved.
pub(super) fn unstable_at(design: &Design, plant: &dyn Plant, rho: f64) -> Option<Witness> {
    ClosedLoop::new(design, plant).ok()?.does_not_rest(rho)
}

/// V of the claims; `None` where nothing can be proved.
pub(super) fn lyapunov_form(design: &Design, plant: &dyn Plant) -> Option<Form> {
    Some(ClosedLoop::new(design, plant).ok()?.form)
}

/// P(ρ) of the Lyapunov function that [`prove`] is about; `None` where there is none.
pub fn lyapunov_matrix(design: &Design, plant: &dyn Plant, rho: f64) -> Option<crate::math::Mat<f64>> {
    ClosedLoop::new(design, plant).ok()?.form.p(rho)
}
