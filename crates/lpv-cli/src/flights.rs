//! Flights of a scenario: simulation of each controller, held against what is proved of it.

use crate::contradiction::contradiction_of;
use crate::flown::{Certified, Flown};
use crate::scenario::{ControllerPlan, Scenario};
use crate::stay::step_stays;
use crate::step_bounds::step_bounds;
use lpv::certificate::{rests_exactly, unrest};
use lpv::sim::{Performance, Simulation, performance};
use lpv::synthesis::Design;
use rayon::prelude::*;
use std::time::Instant;

/// Fly every controller with its design, in parallel.
pub fn fly_all(scenario: &Scenario, designs: &[Certified]) -> Vec<Flown> {
    let bar = crate::progress::bar("fly", designs.len());
    let flights = (scenario.controllers.par_iter().zip(designs))
        .map(|(plan, certified)| {
            let flown = fly(scenario, plan, certified);
            bar.inc(1);
            flown
        })
        .collect();
    bar.finish_and_clear();
    flights
}

fn fly(scenario: &Scenario, plan: &ControllerPlan, certified: &Certified) -> Flown {
    let started = Instant::now();
    let &Certified { design, supervised, proofs } = certified;
    let simulation = simulation(scenario, plan);
    let flight = simulation.fly(&design.controller);
    let performance = performance(scenario.plant.description(), &scenario.reference, &flight);
    let seconds = started.elapsed().as_secs_f64();
    let is_governed = !flight.trajectory.governed.is_empty();
    let (bounds, mut claims) = match is_governed {
        true => (Vec::new(), Vec::new()),
        false => step_bounds(scenario, plan, design, proofs, &performance, &flight.trajectory),
    };
    let stays = step_stays(scenario, plan, design, supervised, &flight, &performance);
    claims.extend(stays.iter().map(|stay| stay.claim.clone()));
    let steps_are_all = steps_are_all(scenario, design, &performance);
    let contradiction = None;
    let mut flown = Flown { flight, performance, bounds, steps_are_all, contradiction, stays, claims, seconds };
    flown.contradiction = contradiction_of(&flown, scenario, plan, &simulation, certified);
    flown
}

/// The flight of a controller.
fn simulation<'a>(scenario: &'a Scenario, plan: &ControllerPlan) -> Simulation<'a> {
    Simulation {
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
    }
}

/// Whether the costs of the steps are the cost of the flight. The reference rests until the first one, and every change of it is a step that the
/// flight reached.
fn steps_are_all(scenario: &Scenario, design: &Design, performance: &Performance) -> bool {
    let is_step = |time_s: f64| performance.steps.iter().any(|step| step.time_s == time_s);
    let reference = &scenario.reference;
    let first = performance.steps.first().map_or(f64::INFINITY, |step| step.time_s);
    let input = &design.controller.operating_input;
    let start = reference.at(0.0);
    let rests_before = first == 0.0
        || match scenario.is_linear() {
            true => rests_exactly(&*scenario.plant, &start, input),
            false => unrest(&*scenario.plant, &start, input).is_none(),
        };
    let is_unchanged = |time_s: f64| time_s == 0.0 || reference.at(time_s) == reference.at(time_s - 1e-6);
    rests_before && reference.step_times().into_iter().all(|time_s| is_step(time_s) || is_unchanged(time_s))
}
