//! `lpv sdp`: solve a semidefinite program from an SDPA sparse file.

use crate::failure::Failure;
use crate::output::print;
use clap::Args;
use lmi::{Answer, Explanation, Options, Outcome, sdpa};
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
    /// Proved: no x whose entries are at most ten times as large as this one's does better.
    optimum_bound: Option<f64>,
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

/// Solve the problem; every outcome but `solved` is a failure.
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
        Outcome::Inaccurate(_) => {
            Err(Failure::NotCertified(format!("{}: {}", arguments.file.display(), record.detail)))
        }
    }
}

fn record(answer: &Answer, seconds: f64, explanation: Option<Explanation>) -> SdpRecord {
    let (status, detail) = match &answer.outcome {
        Outcome::Solved => ("solved", String::new()),
        Outcome::Infeasible(witness) => (
            "infeasible",
            format!(
                "multipliers Z ⪰ 0 show that no x satisfies the inequalities; they leave a residual of {:.1e}, least eigenvalue {:.1e}",
                witness.residual, witness.smallest_eigenvalue
            ),
        ),
        Outcome::Unbounded(ray) => (
            "unbounded",
            format!(
                "the objective falls without end along a ray, whose blocks have a relative least eigenvalue of {:.1e}",
                ray.smallest_eigenvalue
            ),
        ),
        Outcome::Inaccurate(reason) => ("inaccurate", format!("the solver stopped short: {reason}")),
    };
    SdpRecord {
        status,
        detail,
        objective: answer.objective,
        dual_objective: answer.dual_objective,
        optimum_bound: answer.optimum_bound.map(|bound| bound.value),
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
    let margin = least.map_or(String::new(), |(block, value)| format!("{value:.3e} in block {}", block + 1));
    let rows = [
        ("status", record.status.to_owned()),
        ("detail", record.detail.clone()),
        ("objective", format!("{:.9e}", record.objective)),
        ("dual objective", format!("{:.9e}", record.dual_objective)),
        ("optimum proved ≥", record.optimum_bound.map_or(String::new(), |bound| format!("{bound:.9e}"))),
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
