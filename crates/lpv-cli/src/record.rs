//! Results as files: trajectories as CSV, the run as JSON.

use crate::designs::{CheckedDesign, Undesigned};
use crate::failure::Failure;
use crate::flown::Flown;
use crate::scenario::Scenario;
use crate::stay::StepStay;
use lpv::certificate::{BoundOf, Claim, StepBound, Verdict};
use lpv::estimator::Consistency;
use lpv::sim::{Outcome, Performance};
use lpv::synthesis::Method;
use serde::Serialize;
use std::fmt::Write;

/// File name of a controller's trajectory.
pub fn trajectory_file_name(controller: &str) -> String {
    format!("trajectory-{controller}.csv")
}

/// A trajectory as CSV: time, states, references, inputs, whether an input was limited, accumulated cost, and where there
/// are any measurements, estimates and their standard deviations, the references that a governor made, and of a
/// controller with certified sets V/γ and the active member, 0 the outermost. Column names carry units.
pub fn trajectory_csv(scenario: &Scenario, flown: &Flown) -> String {
    let description = scenario.plant.description();
    let trajectory = &flown.flight.trajectory;
    let mut csv = String::from("t [s]");
    let mut columns = |prefix: &str, signals: &[lpv::plant::Signal]| {
        for signal in signals {
            let _ = write!(csv, ",{prefix}{} [{}]", signal.name, signal.unit);
        }
    };
    columns("", &description.states);
    columns("reference ", &description.states);
    columns("", &description.inputs);
    let has_measurement = !trajectory.measurements.is_empty();
    let has_estimate = !trajectory.estimates.is_empty();
    if has_measurement {
        columns("measured ", &description.outputs);
    }
    if has_estimate {
        columns("estimated ", &description.states);
        columns("sigma ", &description.states);
    }
    let has_governor = !trajectory.governed.is_empty();
    let has_sets = !trajectory.set_shares.is_empty();
    if has_governor {
        columns("governed ", &description.states);
    }
    csv.push_str(if has_sets { ",V/gamma,member,limited,cost\n" } else { ",limited,cost\n" });

    let stride = (scenario.record_interval_s / scenario.sample_time_s).round().max(1.0) as usize;
    for k in (0..trajectory.time_s.len()).step_by(stride) {
        // sample times are multiples of T: round away what the multiplication left behind
        let _ = write!(csv, "{}", (trajectory.time_s[k] * 1e9).round() / 1e9);
        let mut values = |values: &[f64]| {
            for value in values {
                let _ = write!(csv, ",{value}");
            }
        };
        values(&trajectory.states[k]);
        values(&trajectory.references[k]);
        values(&trajectory.inputs[k]);
        if has_measurement {
            values(&trajectory.measurements[k]);
        }
        if has_estimate {
            values(&trajectory.estimates[k]);
            values(&trajectory.deviations[k]);
        }
        if has_governor {
            values(&trajectory.governed[k]);
        }
        if has_sets {
            let _ = write!(csv, ",{},{}", trajectory.set_shares[k], trajectory.members[k]);
        }
        let _ = writeln!(csv, ",{},{}", u8::from(trajectory.saturated[k]), trajectory.cost[k]);
    }
    csv
}

/// `run.json`: what was asked, with which versions and seed, how long it took, and what came out.
#[derive(Serialize)]
pub struct RunRecord<'a> {
    schema: &'static str,
    lpv_version: &'static str,
    target: String,
    threads: usize,
    scenario: &'a str,
    /// The scenario file, as text.
    scenario_toml: &'a str,
    seed: u64,
    sample_time_s: f64,
    duration_s: f64,
    seconds: f64,
    controllers: Vec<ControllerRecord<'a>>,
    /// Controllers that could not be designed.
    #[serde(skip_serializing_if = "<[Undesigned]>::is_empty")]
    not_designed: &'a [Undesigned],
}

/// One controller of a run.
#[derive(Serialize)]
pub struct ControllerRecord<'a> {
    name: &'a str,
    label: &'a str,
    #[serde(flatten)]
    method: Method,
    /// The worst verdict on the design.
    verdict: Verdict,
    design_claims: &'a [Claim],
    /// Sum of the steps' bounds where each is proved of the plant as it flies, sampled and saturated; else null.
    guaranteed_cost: Option<f64>,
    /// The same where each is proved of the nonlinear plant with a controller in continuous time.
    plant_cost_bound: Option<f64>,
    /// The same of the LPV model with a controller in continuous time; null where a step starts outside the certified set, or one of the
    /// plant is proved.
    model_cost_bound: Option<f64>,
    /// The verdict on the one that there is, for this flight.
    guaranteed_cost_verdict: Verdict,
    /// Which system it is of.
    guaranteed_cost_of: BoundOf,
    flight_claims: &'a [Claim],
    /// The bound of each step, with the conditions that it does not meet.
    step_bounds: &'a [StepBound],
    /// How each step of a supervised controller kept to its certified sets.
    step_stays: &'a [StepStay],
    outcome: &'a Outcome,
    #[serde(flatten)]
    performance: &'a Performance,
    estimator_consistency: Option<&'a Consistency>,
    /// tr Y at each grid point.
    trace_y: Vec<f64>,
    design_seconds: f64,
    check_seconds: f64,
    flight_seconds: f64,
}

impl<'a> RunRecord<'a> {
    /// The record of a run that took `seconds`.
    pub fn new(
        scenario: &'a Scenario,
        designs: &'a [CheckedDesign],
        not_designed: &'a [Undesigned],
        flights: &'a [Flown],
        seconds: f64,
    ) -> Self {
        let controllers = (scenario.controllers.iter().zip(designs).zip(flights))
            .map(|((plan, checked), flown)| ControllerRecord {
                name: &plan.request.name,
                label: &plan.label,
                method: checked.design.method,
                verdict: checked.verdict(),
                design_claims: &checked.claims,
                guaranteed_cost: flown.guaranteed_cost(),
                plant_cost_bound: flown.plant_cost_bound(),
                model_cost_bound: flown.model_cost_bound(),
                guaranteed_cost_verdict: flown.bound_verdict(),
                guaranteed_cost_of: flown.bounds_are_of(),
                flight_claims: &flown.claims,
                step_bounds: &flown.bounds,
                step_stays: &flown.stays,
                outcome: &flown.flight.outcome,
                performance: &flown.performance,
                estimator_consistency: flown.flight.consistency.as_ref(),
                trace_y: checked.design.points.iter().map(|point| point.trace_y).collect(),
                design_seconds: checked.design_seconds,
                check_seconds: checked.check_seconds,
                flight_seconds: flown.seconds,
            })
            .collect();
        Self {
            schema: "lpv-run/1",
            lpv_version: env!("CARGO_PKG_VERSION"),
            target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            threads: rayon::current_num_threads(),
            scenario: &scenario.name,
            scenario_toml: &scenario.text,
            seed: scenario.seed,
            sample_time_s: scenario.sample_time_s,
            duration_s: scenario.duration_s,
            seconds,
            controllers,
            not_designed,
        }
    }

    /// As JSON text.
    pub fn to_json(&self) -> Result<String, Failure> {
        let mut json = serde_json::to_string_pretty(self).map_err(|error| Failure::serialisation(&error))?;
        json.push('\n');
        Ok(json)
    }
}
