//! `lpv sdp`: solve a semidefinite program from an SDPA sparse file.

use crate::failure::Failure;
use crate::output::print;
use clap::Args;
use lmi::{Answer, Explanation, Options, Outcome, sdpa};
use lpv::math::decimal::{Rounding, about, at_least, at_most, decimal};
use serde::Serialize;
use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `lpv sdp`.
#[derive(Args)]
pub struct SdpArguments {
    /// Problem in the SDPA sparse format (.dat-s): minimise cᵀx subject to Σ xᵢFᵢ − F₀ ⪰ 0
    file: PathBuf,
    /// Print JSON instead of text
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct SdpRecord {
    status: &'static str,
    /// Why the solver stopped short, or what proves the outcome.
    detail: String,
    /// cᵀx
    objective: f64,
    dual_objective: f64,
    /// Proved: no x does better whose entries are at most `bound_reach` times as large as this one's.
    optimum_bound: Option<f64>,
    /// Null where the bound holds for every x.
    bound_reach: Option<f64>,
    /// Proved: a feasible x, this one, is as good.
    attained: Option<f64>,
    /// The point that all of this is about.
    x: Vec<f64>,
    gap: f64,
    primal_residual: f64,
    dual_residual: f64,
    /// What the dual residual may take from the dual objective, relative as the gap.
    uncertainty: f64,
    /// Proved lower bounds on the smallest eigenvalues at x, rounding accounted for; null where nothing is proved.
    verified_lower_bounds: Vec<f64>,
    /// The smallest eigenvalue of each block at x, recomputed from the file's data.
    smallest_eigenvalues: Vec<f64>,
    iterations: usize,
    seconds: f64,
    /// Of an infeasible problem: how far from feasible, and which blocks to relax.
    explanation: Option<Explanation>,
}

/// Solve the problem; every outcome but `solved` is a failure: an optimum that is proved not to exist one kind, what is not proved the other.
pub fn run(arguments: &SdpArguments) -> Result<(), Failure> {
    let unreadable = |message: String| Failure::Unreadable { file: arguments.file.clone(), message };
    let file = File::open(&arguments.file).map_err(|error| unreadable(format!("cannot be read: {error}")))?;
    let sdp = sdpa::read(BufReader::new(file)).map_err(|error| unreadable(error.to_string()))?;
    let started = Instant::now();
    let answer = sdp.solve(&Options::default()).map_err(|error| unreadable(error.to_string()))?;
    let seconds = started.elapsed().as_secs_f64();
    let explanation = sdp.explain(&answer, &Options::default()).map_err(|error| unreadable(error.to_string()))?;
    let record = record(&answer, seconds, explanation);

    if arguments.json {
        print(&serde_json::to_string_pretty(&record).map_err(|error| Failure::serialisation(&error))?)?;
    } else {
        print(&text(&record))?;
    }
    match answer.outcome {
        Outcome::Solved => Ok(()),
        Outcome::Infeasible(_) | Outcome::Unbounded(_) => {
            Err(Failure::NoOptimum(format!("{}: {}: {}", arguments.file.display(), record.status, record.detail)))
        }
        Outcome::SolvedToTolerance(_)
        | Outcome::InfeasibleWithin(_)
        | Outcome::UnboundedToTolerance(_)
        | Outcome::Inaccurate(_) => {
            Err(Failure::NotCertified(format!("{}: {}", arguments.file.display(), record.detail)))
        }
    }
}

/// What the outcome says, with its numbers on the safe side.
fn detail(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Solved => String::new(),
        Outcome::SolvedToTolerance(tolerance) if tolerance.violation == 0.0 => format!(
            "the point is proved to be feasible, and its objective to be within {} of the bound, relative; the bound is wider than \
             that of a solved problem, or not one for every x",
            at_most(tolerance.gap)
        ),
        Outcome::SolvedToTolerance(tolerance) => format!(
            "the point violates its inequalities by at most {}; whether there is a feasible one is not proved",
            at_most(tolerance.violation)
        ),
        Outcome::Infeasible(witness) => format!(
            "multipliers Z ⪰ 0 prove that no x satisfies the inequalities; they leave a residual of at most {}",
            at_most(witness.residual)
        ),
        Outcome::InfeasibleWithin(witness) => format!(
            "multipliers Z ⪰ 0 prove that no x with entries up to {} units of the balanced problem satisfies the inequalities; larger ones \
             are not excluded, because the multipliers leave a residual of up to {}",
            at_least(witness.excluded_radius),
            at_most(witness.residual)
        ),
        Outcome::Unbounded(ray) => format!(
            "x is proved to be feasible, and the objective to fall without end along a ray from it, whose blocks have a least eigenvalue of about {}",
            about(ray.smallest_eigenvalue)
        ),
        Outcome::UnboundedToTolerance(ray) => format!(
            "the objective falls along a ray, as far as rounding lets see: its blocks have a least eigenvalue of about {}; that it falls \
             without end from a feasible point is not proved",
            about(ray.smallest_eigenvalue)
        ),
        Outcome::Inaccurate(reason) => format!("the solver stopped short: {reason}"),
    }
}

fn record(answer: &Answer, seconds: f64, explanation: Option<Explanation>) -> SdpRecord {
    let (status, detail) = (answer.outcome.word(), detail(&answer.outcome));
    SdpRecord {
        status,
        detail,
        objective: answer.objective,
        dual_objective: answer.dual_objective,
        optimum_bound: answer.optimum_bound.map(|bound| bound.value),
        bound_reach: answer.optimum_bound.map(|bound| bound.reach).filter(|reach| reach.is_finite()),
        attained: answer.attained,
        x: answer.unknown_values().iter().flat_map(|x| (0..x.nrows()).map(|i| x[(i, 0)])).collect(),
        gap: answer.gap,
        primal_residual: answer.residuals.primal,
        dual_residual: answer.residuals.dual,
        uncertainty: answer.residuals.uncertainty,
        verified_lower_bounds: answer.blocks.iter().map(|block| block.verified_lower_bound).collect(),
        smallest_eigenvalues: answer.blocks.iter().map(|block| block.smallest_eigenvalue).collect(),
        iterations: answer.iterations.len(),
        seconds,
        explanation,
    }
}

fn text(record: &SdpRecord) -> String {
    let least = record.verified_lower_bounds.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    let margin = least.map_or(String::new(), |(block, value)| format!("{} in block {}", at_least(value), block + 1));
    let bound = |bound: f64| {
        let reach = record.bound_reach.map_or(String::new(), |reach| {
            format!("  (for x with entries up to {} times those found)", at_least(reach))
        });
        format!("{}{reach}", decimal(bound, 10, Rounding::Down))
    };
    let rows = [
        ("status", record.status.to_owned()),
        ("detail", record.detail.clone()),
        ("objective", format!("{:.9e}", record.objective)),
        ("dual objective", format!("{:.9e}", record.dual_objective)),
        ("optimum proved ≥", record.optimum_bound.map_or(String::new(), bound)),
        ("and proved ≤", record.attained.map_or(String::new(), |value| decimal(value, 10, Rounding::Up))),
        ("gap", format!("{:.2e}", record.gap)),
        ("residuals", format!("{:.1e} primal, {:.1e} dual", record.primal_residual, record.dual_residual)),
        ("λ_min proved ≥", margin),
        ("iterations", record.iterations.to_string()),
        ("seconds", format!("{:.4}", record.seconds)),
    ];
    let explanation = record.explanation.as_ref().map_or(String::new(), |explanation| format!("{explanation}\n"));
    let rows: String = rows
        .iter()
        .filter(|(_, value)| !value.is_empty())
        .map(|(name, value)| format!("{name:16} {value}\n"))
        .collect();
    rows + &explanation
}
