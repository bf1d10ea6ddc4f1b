//! `lpv design`: synthesis alone, of a problem file or of the controllers of a scenario.

use crate::designs::{self, DesignSummary, Undesigned};
use crate::failure::Failure;
use crate::folder::{ResultFile, ResultFolder};
use crate::output::{OutputArguments, print};
use crate::problem::{ProblemPlan, gain, solve, solve_with_trade_off, trade_off};
use crate::run::outcome;
use crate::scenario::{Scenario, read_text};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `lpv design`.
#[derive(Args)]
pub struct DesignArguments {
    /// Problem file (with a [design] table), or scenario file
    file: PathBuf,
    /// Draw what each share of the optimum that is given back buys, gain against optimum, to FILE.svg; with a table
    #[arg(long, value_name = "FILE.svg")]
    trade_off: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Solve the problem, or design every controller of the scenario.
pub fn run(arguments: &DesignArguments) -> Result<(), Failure> {
    let text = read_text(&arguments.file)?;
    let is_curve = ProblemPlan::is_problem(&text) && !gain::is_gain(&text);
    if arguments.trade_off.is_some() && !is_curve {
        return trade_off::refuse(&arguments.file, "is for a problem with a design over models or a polytope");
    }
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
    let picture = match &arguments.trade_off {
        Some(place) => {
            trade_off::check(&plan, &arguments.file)?;
            Some(ResultFile::begin_for("--trade-off", place, arguments.output.force)?)
        }
        None => None,
    };
    let report = match picture {
        Some(_) => solve_with_trade_off(&plan, &arguments.file)?,
        None => solve(&plan, &arguments.file)?,
    };
    if let (Some(picture), Some(curve)) = (picture, &report.trade_off) {
        let title = arguments.file.file_stem().unwrap_or_default().to_string_lossy();
        picture.finish(curve.figure(&title).svg(true).as_bytes())?;
    }
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
    let mut scenario = Scenario::read(&arguments.file)?;
    let place = arguments.output.out.clone().unwrap_or_else(|| scenario.designs_folder());
    let folder = ResultFolder::begin(&place, arguments.output.force)?;
    let (checked, undesigned) = designs::design_all(&mut scenario)?;
    designs::write_all(&scenario, &checked, &folder)?;
    let place = folder.finish()?;
    if arguments.output.json {
        let designed = checked.iter().map(|checked| DesignLine::Designed(checked.summary()));
        let lines: Vec<DesignLine> = designed.chain(undesigned.iter().map(DesignLine::Undesigned)).collect();
        let json = serde_json::to_string_pretty(&lines).map_err(|error| Failure::serialisation(&error))?;
        print(&json)?;
    } else {
        for (plan, checked) in scenario.controllers.iter().zip(&checked) {
            print(&designs::text(&plan.label, checked.verdict(), &checked.claims))?;
        }
        for undesigned in &undesigned {
            print(&format!("{}: not designed\n  {}\n", undesigned.label, undesigned.source))?;
        }
        print(&place.display().to_string())?;
    }
    outcome(&scenario, &checked, undesigned)
}

/// A controller of a scenario, for machines.
#[derive(Serialize)]
#[serde(untagged)]
enum DesignLine<'a> {
    Designed(DesignSummary<'a>),
    Undesigned(&'a Undesigned),
}
