//! Solves `.dat-s` files and prints one line for each, after the iterations with `--log`:
//! `cargo run --release -p lmi --example solve -- [--log] FILE.dat-s …`

use std::fs::File;
use std::io::BufReader;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (flags, paths): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(|a| a.starts_with("--"));
    for path in paths {
        let started = Instant::now();
        let problem = lmi::sdpa::read(BufReader::new(File::open(&path)?))?;
        let answer = problem.solve(&lmi::Options::default())?;
        if flags.iter().any(|flag| flag == "--log") {
            for (k, i) in answer.iterations.iter().enumerate() {
                println!(
                    "{k:3} mu {:.2e} objective {:.10e} dual {:.10e} residuals {:.1e} {:.1e} {:.1e} sigma {:.1e} steps {:.4} {:.4}",
                    i.complementarity,
                    i.objective,
                    i.dual_objective,
                    i.residuals.primal,
                    i.residuals.dual,
                    i.residuals.uncertainty,
                    i.centring,
                    i.primal_step,
                    i.dual_step
                );
            }
        }
        let outcome = format!("{:?}", answer.outcome);
        let outcome = outcome.split('{').next().unwrap_or_default();
        let proved = answer.blocks.iter().map(|block| block.verified_lower_bound).fold(f64::INFINITY, f64::min);
        let smallest = answer.blocks.iter().map(|block| block.smallest_eigenvalue).fold(f64::INFINITY, f64::min);
        let bound = answer.optimum_bound.map_or("none".to_owned(), |bound| format!("{:.9e}", bound.value));
        println!(
            "{path}: {outcome}, objective {:.9e}, dual {:.9e}, proved bound {bound}, gap {:.1e}, residuals {:.1e} {:.1e}, smallest eigenvalue {smallest:.1e}, proved {proved:.1e}, \
             {} iterations, {:.3} s",
            answer.objective,
            answer.dual_objective,
            answer.residuals.gap,
            answer.residuals.primal,
            answer.residuals.dual,
            answer.iterations.len(),
            started.elapsed().as_secs_f64()
        );
    }
    Ok(())
}
