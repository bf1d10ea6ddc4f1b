//! What a solved problem is worth, in words: verdicts with their reasons, and failures in the names of the file.

use super::plan::{ProblemPlan, Scope};
use crate::failure::Failure;
use lmi::Outcome;
use lpv::certificate::Verdict;
use lpv::math::decimal::{about, at_least};
use lpv::math::riccati::RiccatiError;
use lpv::math::stabilizability::Mode;
use lpv::synthesis::SynthesisError;
use lpv::synthesis::polytopic::{Lyapunov, PolytopicDesign, Separation, UnstabilizablePoint};

/// A failure of synthesis, which counts the places from zero, in the words of the file.
pub(super) fn failure_at(plan: &ProblemPlan, path: &std::path::Path, error: SynthesisError) -> Failure {
    let place = |rho: f64| plan.places.get(rho as usize).map_or("the initial parameter", String::as_str);
    let message = match &error {
        SynthesisError::SampleTime { rho, sample_time_s } => format!(
            "no gain from the low one to R⁻¹BᵀP is stable with the margin asked for when sampled every {sample_time_s:?} s, at {}; \
             sample faster, or ask for less gain_margin",
            place(*rho)
        ),
        SynthesisError::Riccati { rho, source } => {
            let mode = |mode: &Mode| format!("{} (λ = {})", mode.combination(&plan.states), mode.eigenvalue_words());
            let why = match source {
                RiccatiError::Unstabilizable(of) => {
                    format!(
                        "the pair (A, B) is not stabilisable: no input moves {}, which does not decay by itself",
                        mode(of)
                    )
                }
                RiccatiError::Unweighted(of) => {
                    format!("{} costs nothing and does not decay by itself; give it a positive weight in Q", mode(of))
                }
                other => other.to_string(),
            };
            format!("no regulator was found at {}: {why}", place(*rho))
        }
        SynthesisError::Unbounded { rho } => format!(
            "tr Y grows without end at {}, as far as the solver sees: some state costs too little; give it a larger weight in Q",
            place(*rho)
        ),
        _ => return Failure::Synthesis { controller: path.display().to_string(), source: error },
    };
    Failure::NoOptimum(format!("{}: {message}", path.display()))
}

/// What a solved design is worth: its inequalities are verified for the Y and L that were found; what flies is K = LY⁻¹,
/// rounded.
pub(super) fn verdict(plan: &ProblemPlan, design: &PolytopicDesign, inside: Option<bool>) -> (Verdict, String) {
    if let Some(point) = design.unstabilizable.as_ref().filter(|point| point.is_proved) {
        return (Verdict::Refuted, unstabilizable(plan, point));
    }
    if let Some(separation) = &design.separation {
        return (Verdict::Refuted, no_common_function(plan, separation));
    }
    if let Some(motion) = &design.undetectable {
        let words = format!(
            "the objective grows without end: the motion {} does not decay by itself (λ = {}) and costs nothing, so that no gain is the best; give it a positive weight in Q",
            motion.combination(&plan.states),
            motion.eigenvalue_words()
        );
        return (Verdict::Undecided, words);
    }
    let solved = design.is_solved();
    match (&design.answer.outcome, &plan.scope, inside) {
        (_, _, Some(false)) if solved => {
            (Verdict::Undecided, "the initial state is outside the certified set: x(0)'P x(0) > gamma, and nothing is claimed from there".into())
        }
        (_, Scope::Frozen, _) if solved && plan.models.len() > 1 => (
            Verdict::Undecided,
            "frozen design: the inequalities hold at each point for a parameter at rest; nothing is claimed once it moves".into(),
        ),
        (_, Scope::Polytope(Lyapunov::ParameterDependent { .. }), _) if solved => (
            Verdict::Numerical,
            "verified for Y and L at all vertices, for every parameter in the polytope with a rate in the hull of the rate vertices".into(),
        ),
        _ if solved && design.riccati.is_some() => (
            Verdict::Numerical,
            format!(
                "verified for Y and L at all vertices; K is the gain of the Riccati equation, and its P is made strict by the share {}",
                about(design.riccati.unwrap_or(0.0))
            ),
        ),
        _ if solved => {
            (Verdict::Numerical, "verified for Y and L at all vertices, for every motion of the parameter in the polytope".into())
        }
        (Outcome::Solved | Outcome::SolvedToTolerance(_), _, _) => {
            (Verdict::Undecided, "the point that was found misses an inequality by a rounding error".into())
        }
        (Outcome::Inaccurate(reason), _, _) => {
            let seems = (design.unstabilizable.as_ref())
                .map_or(String::new(), |point| format!("; as far as rounding tells, {}", unstabilizable(plan, point)));
            (Verdict::Undecided, format!("the solver stopped short: {reason}{seems}"))
        }
        (Outcome::Infeasible(_), _, _) => {
            (Verdict::Refuted, "no solution exists: the witness contradicts the inequalities".into())
        }
        (Outcome::InfeasibleWithin(witness), _, _) => (
            Verdict::Undecided,
            format!(
                "no solution was found, and none exists with entries up to {} times the problem's units",
                at_least(witness.excluded_radius)
            ),
        ),
        (Outcome::Unbounded(_) | Outcome::UnboundedToTolerance(_), _, _) => {
            (Verdict::Undecided, "the objective grows without end, as far as the solver sees: some state costs too little; give it a larger weight in Q".into())
        }
    }
}

/// Which vertices exclude a common Lyapunov function, in words.
fn no_common_function(plan: &ProblemPlan, separation: &Separation) -> String {
    let near: Vec<String> = (separation.shares.iter().zip(&plan.places))
        .filter(|&(&share, _)| share > 1e-3)
        .map(|(share, place)| format!("{place} ({:.0} %)", 100.0 * share))
        .collect();
    format!("no common Lyapunov function exists, which is proved: {} exclude it together", near.join(", "))
}

/// Why a point of the polytope excludes every design, in words.
fn unstabilizable(plan: &ProblemPlan, point: &UnstabilizablePoint) -> String {
    let near: Vec<String> = (point.weights.iter().zip(&plan.places))
        .filter(|&(&weight, _)| weight > 1e-3)
        .map(|(weight, place)| format!("{weight:.4} × {place}"))
        .collect();
    let mode = point.mode();
    let which = format!(
        "no input moves {}, a mode that does not decay by itself (λ = {})",
        mode.combination(&plan.states),
        mode.eigenvalue_words()
    );
    match plan.scope {
        _ if point.weights.len() == 1 => format!("{which}: no gain stabilises it"),
        _ if near.len() == 1 => {
            format!("{which}, at {}: no gain stabilises it there", near[0].trim_start_matches("1.0000 × "))
        }
        _ => format!(
            "{which}, at a point that the polytope holds, {}: no gain stabilises it there, and no finer division of the polytope helps",
            near.join(" + ")
        ),
    }
}
