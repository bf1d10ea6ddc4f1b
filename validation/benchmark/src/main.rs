//! The table of `README.md`: times, objectives, gaps and proved eigenvalues of four solvers.

mod clarabel;
mod peers;
mod quadrotor;

use lmi::sdpa::{self, Sdp};
use peers::{Point, Solver};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

/// A solver that has run for longer than this on a problem is not run again.
const MOST_SECONDS: f64 = 60.0;

/// One row of the table.
struct Row {
    solver: String,
    times: Vec<f64>,
    point: Option<Point>,
}

fn main() -> Result<(), Failure> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [command, file] = &arguments[..]
        && command == "clarabel"
    {
        return clarabel::run(Path::new(file));
    }
    let mut repetitions = 7;
    if arguments.first().is_some_and(|argument| argument == "--repetitions") {
        repetitions = arguments.get(1).ok_or("--repetitions needs a number")?.parse()?;
        arguments.drain(..2);
    }
    let scratch = std::env::temp_dir().join(format!("lmi-benchmark-{}", std::process::id()));
    std::fs::create_dir_all(&scratch)?;
    let mut files: Vec<PathBuf> = arguments.iter().map(PathBuf::from).collect();
    if files.is_empty() {
        files = quadrotor::write(&scratch)?;
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/lmi/tests/data");
        for name in ["control1", "truss1", "truss3", "hinf1", "mcp100"] {
            files.push(data.join(format!("{name}.dat-s")));
        }
    }
    for file in &files {
        compare(file, repetitions, &scratch)?;
    }
    std::fs::remove_dir_all(&scratch)?;
    Ok(())
}

/// Runs all solvers in turn and prints their rows.
fn compare(file: &Path, repetitions: usize, scratch: &Path) -> Result<(), Failure> {
    let sdp = sdpa::read(BufReader::new(File::open(file)?))?;
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let solvers = Solver::all(&name);
    let mut rows: Vec<Row> =
        solvers.iter().map(|s| Row { solver: s.name().to_owned(), times: Vec::new(), point: None }).collect();
    for _ in 0..repetitions {
        for (solver, row) in solvers.iter().zip(&mut rows) {
            if row.times.iter().sum::<f64>() > MOST_SECONDS {
                continue;
            }
            let mut command = solver.command(file, scratch);
            let started = Instant::now();
            let output = command.output().map_err(|error| format!("{}: {error}", solver.name()))?;
            row.times.push(started.elapsed().as_secs_f64());
            if row.point.is_none() {
                row.point = solver.point(&String::from_utf8_lossy(&output.stdout), scratch);
            }
        }
    }
    print(&name, &sdp, &rows);
    Ok(())
}

fn print(name: &str, sdp: &Sdp, rows: &[Row]) {
    println!("\n{name}: {} unknowns, {} blocks", sdp.objective.len(), sdp.blocks.len());
    println!("{:22} {:>10} {:>8} {:>18} {:>9} {:>11}", "", "ms", "ratio", "objective", "gap", "λ_min ≥");
    let base = &rows[0].times;
    for row in rows {
        let time = 1e3 * median(row.times.clone());
        let ratio = median(row.times.iter().zip(base).map(|(time, base)| time / base).collect());
        let rest = match &row.point {
            None => "no answer".to_owned(),
            Some(Point { objective, dual_objective, x }) => {
                let gap = (objective - dual_objective).abs() / (1.0 + objective.abs() + dual_objective.abs());
                let least = x.as_ref().and_then(|x| sdp.verify(x).ok()).map_or("-".to_owned(), |blocks| {
                    let bounds = blocks.iter().map(|block| block.verified_lower_bound);
                    format!("{:.1e}", bounds.fold(f64::INFINITY, f64::min))
                });
                format!("{objective:18.9e} {gap:9.1e} {least:>11}")
            }
        };
        println!("{:22} {time:10.1} {ratio:8.2} {rest}", row.solver);
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
