//! `lpv simulate`: the closed loop alone, with designs from files.

use crate::contradiction;
use crate::designs;
use crate::failure::Failure;
use crate::flights;
use crate::flown::{Certified, Flown};
use crate::folder::ResultFolder;
use crate::output::{OutputArguments, print};
use crate::record::{trajectory_csv, trajectory_file_name};
use crate::scenario::{Scenario, read_text};
use clap::Args;
use lpv::certificate::Claim;
use lpv::estimator::Consistency;
use lpv::math::decimal::fixed;
use lpv::sim::{Outcome, Performance};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `lpv simulate`.
#[derive(Args)]
pub struct SimulateArguments {
    /// Scenario file
    scenario: PathBuf,
    /// Folder that holds design-NAME.json for each controller [default: where `lpv design` or else `lpv run` wrote them]
    #[arg(long)]
    designs: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

#[derive(Serialize)]
struct FlightSummary<'a> {
    name: &'a str,
    outcome: &'a Outcome,
    #[serde(flatten)]
    performance: &'a Performance,
    guaranteed_cost: Option<f64>,
    plant_cost_bound: Option<f64>,
    model_cost_bound: Option<f64>,
    claims: &'a [Claim],
    estimator_consistency: Option<&'a Consistency>,
    seconds: f64,
}

/// Fly every controller of the scenario with its saved design.
pub fn run(arguments: &SimulateArguments) -> Result<(), Failure> {
    let scenario = Scenario::read(&arguments.scenario)?;
    let source = arguments.designs.clone().unwrap_or_else(|| {
        let designed = scenario.designs_folder();
        if designed.exists() { designed } else { scenario.result_folder(None) }
    });
    let mut loaded = Vec::new();
    for plan in &scenario.controllers {
        let file = source.join(designs::file_name(&plan.request.name));
        let design = designs::from_json(&file, &read_text(&file)?)?;
        let request = &plan.request;
        let same = [
            ("plant", design.plant == scenario.plant_spec),
            ("sample_time_s", design.sample_time_s == scenario.sample_time_s),
            ("method", design.method == request.method),
            ("weights.q", design.weights.q == request.weights.q),
            ("weights.r", design.weights.r == request.weights.r),
            ("controller.limits", *design.controller.actuators() == request.limits),
            ("controller.supervisor", design.is_supervised_as(&plan.supervision, &request.limits)),
        ];
        if let Some((key, _)) = same.into_iter().find(|(_, same)| !same) {
            return Err(Failure::BadInput {
                file,
                key: key.into(),
                message: format!("differs from {}; design again", arguments.scenario.display()),
            });
        }
        loaded.push(design);
    }
    let place = arguments.output.out.clone().unwrap_or_else(|| scenario.flights_folder());
    let folder = ResultFolder::begin(&place, arguments.output.force)?;
    let unproved: Vec<Certified> =
        loaded.iter().map(|design| Certified { design, supervised: None, proofs: None }).collect();
    let flown = flights::fly_all(&scenario, &unproved);
    for (plan, flown) in scenario.controllers.iter().zip(&flown) {
        folder.write(&trajectory_file_name(&plan.request.name), trajectory_csv(&scenario, flown).as_bytes())?;
    }
    let place = folder.finish()?;
    if arguments.output.json {
        let summaries: Vec<FlightSummary> =
            scenario.controllers.iter().zip(&flown).map(|(plan, flown)| summary(&plan.request.name, flown)).collect();
        let json = serde_json::to_string_pretty(&summaries).map_err(|error| Failure::serialisation(&error))?;
        print(&json)?;
    } else {
        for (plan, flown) in scenario.controllers.iter().zip(&flown) {
            let cost = flown.performance.actual_cost.map_or("-".into(), |cost| fixed(cost, 4));
            let settling = flown.performance.settling_time_s.map_or("-".into(), |time| format!("{time:.2} s"));
            let ending = match flown.flight.outcome {
                Outcome::Completed => "completed".into(),
                Outcome::Diverged { time_s, .. } => format!("diverged at {time_s:.2} s"),
                Outcome::EstimatorDiverged { time_s } => format!("the estimator diverged at {time_s:.2} s"),
            };
            print(&format!("{}: {ending}, cost {cost}, settling {settling}", plan.label))?;
        }
        print(&place.display().to_string())?;
    }
    let replay = format!("lpv simulate {} --designs {} --force", arguments.scenario.display(), source.display());
    contradiction::no_contradiction(&scenario, &flown, &replay)
}

fn summary<'a>(name: &'a str, flown: &'a Flown) -> FlightSummary<'a> {
    FlightSummary {
        name,
        outcome: &flown.flight.outcome,
        performance: &flown.performance,
        guaranteed_cost: flown.guaranteed_cost(),
        plant_cost_bound: flown.plant_cost_bound(),
        model_cost_bound: flown.model_cost_bound(),
        claims: &flown.claims,
        estimator_consistency: flown.flight.consistency.as_ref(),
        seconds: flown.seconds,
    }
}
