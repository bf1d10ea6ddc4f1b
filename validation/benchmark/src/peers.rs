//! The solvers as processes, one thread each, and how to read what they print.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Where a solver says it ended.
pub struct Point {
    pub objective: f64,
    pub dual_objective: f64,
    /// Absent where a solver does not print it.
    pub x: Option<Vec<f64>>,
}

pub enum Solver {
    /// `lpv sdp`.
    Lpv,
    /// The quadrotor designs as modelled in expressions.
    Modelled {
        low_gain: bool,
    },
    Csdp,
    Sdpa,
    Clarabel,
}

impl Solver {
    /// Those that apply to a problem.
    pub fn all(problem: &str) -> Vec<Self> {
        let modelled = match problem {
            "quadrotor-low-gain" => Some(Self::Modelled { low_gain: true }),
            "quadrotor-high-gain" => Some(Self::Modelled { low_gain: false }),
            _ => None,
        };
        std::iter::once(Self::Lpv).chain(modelled).chain([Self::Csdp, Self::Sdpa, Self::Clarabel]).collect()
    }

    pub fn name(&self) -> &'static str {
        match self {
            Self::Lpv => "lpv sdp",
            Self::Modelled { .. } => "lmi, from expressions",
            Self::Csdp => "CSDP",
            Self::Sdpa => "SDPA",
            Self::Clarabel => "Clarabel",
        }
    }

    pub fn command(&self, file: &Path, scratch: &Path) -> Command {
        let built = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/release").join(name);
        let mut command = match self {
            Self::Lpv => {
                let mut command = Command::new(built("lpv"));
                command.arg("sdp").arg(file).arg("--json");
                command
            }
            Self::Modelled { low_gain } => {
                let mut command = Command::new(built("examples/saturated_regulator"));
                command.args(low_gain.then_some("--low-gain"));
                command
            }
            Self::Csdp => {
                let mut command = Command::new("csdp");
                command.arg(file).arg(solution(scratch));
                command
            }
            Self::Sdpa => {
                let mut command = Command::new("sdpa");
                command.arg("-ds").arg(file).arg("-o").arg(solution(scratch)).args(["-numThreads", "1"]);
                command
            }
            Self::Clarabel => {
                let mut command = Command::new(std::env::current_exe().unwrap_or_default());
                command.arg("clarabel").arg(file);
                command
            }
        };
        command.env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1").env("RAYON_NUM_THREADS", "1");
        command
    }

    /// The point of the run that has just ended.
    pub fn point(&self, output: &str, scratch: &Path) -> Option<Point> {
        match self {
            Self::Lpv | Self::Clarabel => {
                let record: serde_json::Value = serde_json::from_str(output).ok()?;
                let x = record["x"].as_array()?.iter().map(|x| x.as_f64()).collect::<Option<Vec<f64>>>()?;
                let number = |key: &str| record[key].as_f64();
                Some(Point { objective: number("objective")?, dual_objective: number("dual_objective")?, x: Some(x) })
            }
            Self::Modelled { .. } => {
                // `Solved: tr Y = 5.08…, gap 1e-9`, and min −tr Y in the file.
                let objective = -number_after(output, "tr Y =")?;
                let gap = number_after(output, "gap")?;
                Some(Point { objective, dual_objective: objective - gap * (1.0 + 2.0 * objective.abs()), x: None })
            }
            Self::Csdp => {
                // The first line of the solution file is its y, our x.
                let text = std::fs::read_to_string(solution(scratch)).ok()?;
                let x = text.lines().next()?.split_whitespace().map(|x| x.parse().ok()).collect::<Option<Vec<f64>>>();
                Some(Point {
                    objective: number_after(output, "Dual objective value:")?,
                    dual_objective: number_after(output, "Primal objective value:")?,
                    x,
                })
            }
            Self::Sdpa => {
                let text = std::fs::read_to_string(solution(scratch)).ok()?;
                let start = text.find("xVec =")?;
                let list = text[start..].split('{').nth(1)?.split('}').next()?;
                let x = list.split(',').map(|x| x.trim().parse().ok()).collect::<Option<Vec<f64>>>();
                Some(Point {
                    objective: number_after(output, "objValPrimal =")?,
                    dual_objective: number_after(output, "objValDual   =")?,
                    x,
                })
            }
        }
    }
}

fn solution(scratch: &Path) -> PathBuf {
    scratch.join("solution")
}

fn number_after(text: &str, key: &str) -> Option<f64> {
    let rest = &text[text.rfind(key)? + key.len()..];
    rest.split_whitespace().next()?.trim_end_matches(',').parse().ok()
}
