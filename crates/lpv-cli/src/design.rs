//! `lpv design`: synthesis and check alone.

use crate::designs::{self, DesignSummary};
use crate::failure::Failure;
use crate::folder::ResultFolder;
use crate::output::{OutputArguments, print};
use crate::run::required_verdicts;
use crate::scenario::Scenario;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `lpv design`.
#[derive(Args)]
pub struct DesignArguments {
    /// Scenario file
    scenario: PathBuf,
    #[command(flatten)]
    output: OutputArguments,
}

/// Design every controller of the scenario.
pub fn run(arguments: &DesignArguments) -> Result<(), Failure> {
    let scenario = Scenario::read(&arguments.scenario)?;
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
            print(&designs::text(&plan.label, &checked.claims))?;
        }
        print(&place.display().to_string())?;
    }
    required_verdicts(&scenario, &checked)
}
