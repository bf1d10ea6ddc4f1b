//! `lpv run`: design → check → fly → report.

use crate::contradiction;
use crate::designs::{self, CheckedDesign, Undesigned};
use crate::failure::Failure;
use crate::flights;
use crate::flown::Certified;
use crate::folder::ResultFolder;
use crate::output::{OutputArguments, print};
use crate::record::{RunRecord, trajectory_csv, trajectory_file_name};
use crate::scenario::Scenario;
use crate::step_bounds;
use crate::{report, table};
use clap::Args;
use lpv::certificate::Verdict;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `lpv run`.
#[derive(Args)]
pub struct RunArguments {
    /// Scenario file
    scenario: PathBuf,
    /// Also prove the designs over the whole range of the parameter, and compare the proved rates with the flown ones
    #[arg(long)]
    prove: bool,
    /// The same, and of the nonlinear plant on the largest set that can be proved (takes longer)
    #[arg(long)]
    nonlinear: bool,
    #[command(flatten)]
    output: OutputArguments,
}

/// Do the whole job.
pub fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let started = Instant::now();
    let mut scenario = Scenario::read(&arguments.scenario)?;
    let place = scenario.result_folder(arguments.output.out.as_deref());
    let folder = ResultFolder::begin(&place, arguments.output.force)?;
    let (mut checked, undesigned) = designs::design_all(&mut scenario)?;
    let proofs = match arguments.prove || arguments.nonlinear {
        true => designs::prove_all(&scenario, &mut checked, arguments.nonlinear),
        false => checked.iter().map(|checked| Some(checked.proofs.as_ref()?.members[0].clone())).collect(),
    };
    let certified: Vec<Certified> = (checked.iter().zip(&proofs))
        .map(|(checked, proofs)| Certified {
            design: &checked.design,
            supervised: checked.proofs.as_ref(),
            proofs: proofs.as_ref(),
        })
        .collect();
    let mut flown = flights::fly_all(&scenario, &certified);
    for (flown, proofs) in flown.iter_mut().zip(&proofs) {
        if let Some(proofs) = proofs {
            step_bounds::compare_with_proofs(&scenario, flown, proofs);
        }
    }

    designs::write_all(&scenario, &checked, &folder)?;
    for (plan, flown) in scenario.controllers.iter().zip(&flown) {
        folder.write(&trajectory_file_name(&plan.request.name), trajectory_csv(&scenario, flown).as_bytes())?;
    }
    folder.write("report.html", report::html(&scenario, &checked, &undesigned, &flown, &place)?.as_bytes())?;
    let seconds = started.elapsed().as_secs_f64();
    let record = RunRecord::new(&scenario, &checked, &undesigned, &flown, seconds).to_json()?;
    folder.write("run.json", record.as_bytes())?;
    let place = folder.finish()?;

    if arguments.output.json {
        print(&record)?;
    } else {
        print(&format!(
            "{}\n{} in {seconds:.1} s",
            table::comparison(&scenario, &checked, &undesigned, &flown),
            place.join("report.html").display()
        ))?;
    }
    let replay = format!("lpv run {} --force", arguments.scenario.display());
    contradiction::no_contradiction(&scenario, &flown, &replay)?;
    outcome(&scenario, &checked, undesigned)
}

/// Whether every controller was designed and has the verdict that the scenario requires.
pub fn outcome(scenario: &Scenario, checked: &[CheckedDesign], undesigned: Vec<Undesigned>) -> Result<(), Failure> {
    match undesigned.into_iter().next() {
        Some(first) => Err(first.into()),
        None => required_verdicts(scenario, checked),
    }
}

/// The verdicts that the scenario requires; a refuted design is never what was asked for.
fn required_verdicts(scenario: &Scenario, checked: &[CheckedDesign]) -> Result<(), Failure> {
    let missed: Vec<String> = (scenario.controllers.iter().zip(checked))
        .filter_map(|(plan, checked)| {
            let (required, reached) = (plan.require.unwrap_or(Verdict::Undecided), checked.verdict());
            (reached < required)
                .then(|| format!("\"{}\" is {}, required is {}", plan.request.name, reached.word(), required.word()))
        })
        .collect();
    if missed.is_empty() { Ok(()) } else { Err(Failure::NotCertified(missed.join("; "))) }
}
