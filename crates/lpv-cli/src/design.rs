//! `lpv design`: synthesis alone, of a problem file or of the controllers of a scenario.

use crate::designs::{self, DesignSummary};
use crate::failure::Failure;
use crate::folder::{ResultFile, ResultFolder};
use crate::output::{OutputArguments, print};
use crate::problem::{ProblemPlan, gain, solve};
use crate::run::required_verdicts;
use crate::scenario::{Scenario, read_text};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `lpv design`.
#[derive(Args)]
pub struct DesignArguments {
    /// Problem file (with a [design] table), or scenario file
    file: PathBuf,
    #[command(flatten)]
    output: OutputArguments,
}

/// Solve the problem, or design every controller of the scenario.
pub fn run(arguments: &DesignArguments) -> Result<(), Failure> {
    let text = read_text(&arguments.file)?;
    match ProblemPlan::is_problem(&text) {
        true if gain::is_gain(&text) => run_gain(arguments, &text),
        true => run_problem(arguments, &text),
        false => run_scenario(arguments),
    }
}

/// The answer goes to standard output, and as JSON to the file of `--out`.
fn run_problem(arguments: &DesignArguments, text: &str) -> Result<(), Failure> {
    let plan = ProblemPlan::read(&arguments.file, text)?;
    let place =
        arguments.output.out.as_deref().map(|place| ResultFile::begin(place, arguments.output.force)).transpose()?;
    let report = solve(&plan, &arguments.file)?;
    let json = serde_json::to_string_pretty(&report).map_err(|error| Failure::serialisation(&error))?;
    if let Some(place) = place {
        place.finish(json.as_bytes())?;
    }
    print(&if arguments.output.json { json } else { report.text() })?;
    report.failure(&arguments.file).map_or(Ok(()), Err)
}

/// As [`run_problem`], for a bound on the induced L2 norm.
fn run_gain(arguments: &DesignArguments, text: &str) -> Result<(), Failure> {
    let place =
        arguments.output.out.as_deref().map(|place| ResultFile::begin(place, arguments.output.force)).transpose()?;
    let report = gain::solve(&arguments.file, text)?;
    let json = serde_json::to_string_pretty(&report).map_err(|error| Failure::serialisation(&error))?;
    if let Some(place) = place {
        place.finish(json.as_bytes())?;
    }
    print(&if arguments.output.json { json } else { report.text() })?;
    report.failure(&arguments.file).map_or(Ok(()), Err)
}

fn run_scenario(arguments: &DesignArguments) -> Result<(), Failure> {
    let scenario = Scenario::read(&arguments.file)?;
    let place = arguments.output.out.clone().unwrap_or_else(|| scenario.designs_folder());
    let folder = ResultFolder::begin(&place, arguments.output.force)?;
    let checked = designs::design_all(&scenario)?;
    designs::write_all(&scenario, &checked, &folder)?;
    let place = folder.finish()?;
    if arguments.output.json {
        let summaries: Vec<DesignSummary> = checked.iter().map(|checked| checked.summary()).collect();
        let json = serde_json::to_string_pretty(&summaries).map_err(|error| Failure::serialisation(&error))?;
        print(&json)?;
    } else {
        for (plan, checked) in scenario.controllers.iter().zip(&checked) {
            print(&designs::text(&plan.label, checked.verdict(), &checked.claims))?;
        }
        print(&place.display().to_string())?;
    }
    required_verdicts(&scenario, &checked)
}
