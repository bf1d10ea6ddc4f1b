//! The program `lpv`: from a nonlinear plant to a checked gain-scheduled controller and its flight.
//!
//! Each subcommand is a file; what several share is beside them:
//! `scenario`, `problem` and `tp` read TOML, `designs` runs synthesis and checks, `flights` simulates, `flown` and `step_bounds` say what is known of a flight, `contradiction` holds flights against what is proved, `report` and `record` write results,
//! `table` lays them out, `output` prints, `folder` keeps results whole, `failure` is every way to end that is not success.

mod certify;
mod contradiction;
mod design;
mod designs;
mod failure;
mod figure;
mod flights;
mod flown;
mod folder;
mod output;
mod problem;
mod progress;
mod record;
mod report;
mod run;
mod scenario;
mod sdp;
mod simulate;
mod stay;
mod step_bounds;
mod table;
mod thesis;
mod tp;

use clap::{Parser, Subcommand};
use std::io::Write;
use std::process::ExitCode;

/// Gain-scheduled control of nonlinear plants with saturating actuators, with bounds that say how far they are proved.
///
/// Exit codes: 0 done and certified as asked; 2 bad input; 3 infeasible; 4 not certified or undecided; 1 a defect of lpv.
#[derive(Parser)]
#[command(version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// The whole job: design, check, fly, report
    Run(run::RunArguments),
    /// Solve a synthesis problem, or design the controllers of a scenario and check them
    Design(design::DesignArguments),
    /// Check a saved design again, from the plant alone
    Certify(certify::CertifyArguments),
    /// Fly saved designs through a scenario
    Simulate(simulate::SimulateArguments),
    /// Recompute every table and figure of the thesis, in one report
    Thesis(thesis::ThesisArguments),
    /// Solve a semidefinite program from an SDPA sparse file
    Sdp(sdp::SdpArguments),
    /// Transform an LPV model to tensor-product form
    Tp(tp::TpArguments),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Design(arguments) => design::run(&arguments),
        Command::Certify(arguments) => certify::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Thesis(arguments) => thesis::run(&arguments),
        Command::Sdp(arguments) => sdp::run(&arguments),
        Command::Tp(arguments) => tp::run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            // nobody is left to tell when standard error is gone too; the exit code still says it
            let _ = writeln!(std::io::stderr(), "lpv: {failure}");
            ExitCode::from(failure.exit_code())
        }
    }
}
