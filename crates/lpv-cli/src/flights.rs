//! Flights of a scenario: simulation of each controller, and what its design says about each set-point step.

use crate::scenario::{ControllerPlan, Scenario};
use crate::stay::{StepStay, step_stays};
use lpv::certificate::{Claim, StepBound, StepConditions, SupervisedProofs, UnmetCondition, step_bound};
use lpv::model::linearize;
use lpv::sim::{Flight, Performance, Simulation, StepResponse, performance};
use lpv::synthesis::{Design, covering_level};
use rayon::prelude::*;
use std::time::Instant;

/// A flown controller.
pub struct Flown {
    /// The flight.
    pub flight: Flight,
    /// Its figures of merit.
    pub performance: Performance,
    /// What the design guarantees for each step that was reached; empty below a governor, whose steps have no bound on their
    /// cost.
    pub bounds: Vec<StepBound>,
    /// Whether each step stayed in the certified sets; empty of a controller that does not watch them.
    pub stays: Vec<StepStay>,
    /// A claim for each of these.
    pub claims: Vec<Claim>,
    /// Seconds that it took.
    pub seconds: f64,
}

impl Flown {
    /// Sum of the steps' cost bounds, if every step starts inside the certified set.
    pub fn guaranteed_cost(&self) -> Option<f64> {
        (self.bounds.iter().all(StepBound::is_inside) && !self.bounds.is_empty())
            .then(|| self.bounds.iter().map(|bound| bound.bound).sum())
    }
}

/// Fly every controller with its design, in parallel; with what is proved of supervised ones.
pub fn fly_all(scenario: &Scenario, designs: &[(&Design, Option<&SupervisedProofs>)]) -> Vec<Flown> {
    let bar = crate::progress::bar("fly", designs.len());
    let flights = (scenario.controllers.par_iter().zip(designs))
        .map(|(plan, (design, proofs))| {
            let flown = fly(scenario, plan, design, *proofs);
            bar.inc(1);
            flown
        })
        .collect();
    bar.finish_and_clear();
    flights
}

fn fly(scenario: &Scenario, plan: &ControllerPlan, design: &Design, proofs: Option<&SupervisedProofs>) -> Flown {
    let started = Instant::now();
    let simulation = Simulation {
        plant: &*scenario.plant,
        initial_state: scenario.initial_state.clone(),
        reference: scenario.reference.clone(),
        duration_s: scenario.duration_s,
        sample_time_s: scenario.sample_time_s,
        steps_per_sample: scenario.steps_per_sample,
        state_weight: &scenario.weights.q,
        input_weight: &scenario.weights.r,
        noise: scenario.noise.as_ref().filter(|_| plan.noise),
        estimate: plan.estimator,
        seed: scenario.seed,
        run: 0,
    };
    let flight = simulation.fly(&design.controller);
    let performance = performance(scenario.plant.description(), &scenario.reference, &flight);
    let seconds = started.elapsed().as_secs_f64();
    let is_governed = !flight.trajectory.governed.is_empty();
    let (bounds, mut claims) = match is_governed {
        true => (Vec::new(), Vec::new()),
        false => step_bounds(scenario, plan, design, &performance),
    };
    let stays = step_stays(scenario, plan, design, proofs, &flight, &performance);
    claims.extend(stays.iter().map(|stay| stay.claim.clone()));
    Flown { flight, performance, bounds, stays, claims, seconds }
}

/// The bound of each step, with a claim that says which of its conditions are met.
fn step_bounds(
    scenario: &Scenario,
    plan: &ControllerPlan,
    design: &Design,
    performance: &Performance,
) -> (Vec<StepBound>, Vec<Claim>) {
    let scheduling = scenario.plant.description().scheduling.as_ref();
    let bound = |(k, step): (usize, &StepResponse)| {
        let conditions = StepConditions {
            error: &step.error,
            parameter: step.parameter,
            peak_parameter_rate: step.peak_parameter_rate,
            noise: plan.noise,
        };
        let bound = step_bound(design, scheduling, &conditions);
        let inside = match bound.level {
            None => "inputs are not limited, so the certified set is everything".to_owned(),
            Some(level) if bound.is_inside() => format!("inside the certified set of level {}", digits(level)),
            Some(level) => {
                let cover = cover(scenario, design, step, level);
                format!("outside the certified set of level {}{cover}", digits(level))
            }
        };
        let others = bound.unmet.iter().filter_map(|condition| match condition {
            UnmetCondition::Outside { .. } => None,
            UnmetCondition::ParameterMoves { rate } => {
                let (parameter, unit) = scheduling.map_or(("", ""), |s| (s.parameter.as_str(), s.unit.as_str()));
                let allowed = match &design.rate_bounded {
                    None => "a parameter at rest".to_owned(),
                    Some(bounded) => format!("rates up to {} {unit}/s", bounded.rate),
                };
                Some(format!("; {parameter} moves at up to {rate:.2e} {unit}/s, and the bound is for {allowed}"))
            }
            UnmetCondition::Noise => Some("; noise acts, of which the bound knows nothing".into()),
        });
        let claim = Claim::checked(
            format!("step {} at t = {} s costs at most {}", k + 1, step.time_s, digits(bound.bound)),
            bound.verdict(),
            bound.level.map_or(f64::INFINITY, |level| level - bound.bound),
            inside + &others.collect::<String>(),
        );
        (bound, claim)
    };
    performance.steps.iter().enumerate().map(bound).unzip()
}

/// Which γ would cover the step. It is advice: a trial design that fails takes nothing from the flight.
fn cover(scenario: &Scenario, design: &Design, step: &StepResponse, level: f64) -> String {
    let controller = &design.controller;
    let Some(sigma) = controller.limits.symmetric_bound(&controller.operating_input) else {
        return String::new();
    };
    let from = design.method.gamma().unwrap_or(level);
    let model = linearize(&*scenario.plant, step.parameter);
    match covering_level(&model, &design.weights, &sigma, &step.error, from) {
        Ok(Some(gamma)) => format!("; SLPVQR with γ = {} would cover it", digits(gamma)),
        Ok(None) => "; no γ up to 1e6 covers it".into(),
        Err(error) => format!("; which γ would cover it is not known: {error}"),
    }
}

/// Four decimals, or the exponent form where those would say nothing.
fn digits(value: f64) -> String {
    if value == 0.0 || (0.01..1e6).contains(&value.abs()) { format!("{value:.4}") } else { format!("{value:.3e}") }
}
