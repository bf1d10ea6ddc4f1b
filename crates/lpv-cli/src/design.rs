//! `lpv design`: synthesis and check alone.

use crate::designs::{self, DesignSummary};
use crate::failure::Failure;
use crate::folder::ResultFolder;
use crate::output::print;
use crate::run::required_verdicts;
use crate::scenario::Scenario;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `lpv design`.
#[derive(Args)]
pub struct DesignArguments {
    /// Scenario file
    scenario: PathBuf,
    /// Folder for the designs [default: out/<name of the scenario>-designs]
    #[arg(long, short)]
    out: Option<PathBuf>,
    /// Replace earlier designs
    #[arg(long)]
    force: bool,
    /// Print a summary of the designs as JSON instead of text
    #[arg(long)]
    json: bool,
}

/// Design every controller of the scenario.
pub fn run(arguments: &DesignArguments) -> Result<(), Failure> {
    let scenario = Scenario::read(&arguments.scenario)?;
    let place = arguments.out.clone().unwrap_or_else(|| scenario.designs_folder());
    let folder = ResultFolder::begin(&place, arguments.force)?;
    let checked = designs::design_all(&scenario)?;
    for checked in &checked {
        folder.write(&designs::file_name(&checked.design.name), &designs::to_json(&checked.design)?)?;
    }
    let place = folder.finish()?;
    if arguments.json {
        let summaries: Vec<DesignSummary> = checked.iter().map(|checked| checked.summary()).collect();
        let json = serde_json::to_string_pretty(&summaries).map_err(|error| Failure::serialisation(&error))?;
        print(&json)?;
    } else {
        for (plan, checked) in scenario.controllers.iter().zip(&checked) {
            print(&designs::text(&plan.label, &checked.claims))?;
        }
        print(&place.display().to_string())?;
    }
    required_verdicts(&scenario, &checked)
}
