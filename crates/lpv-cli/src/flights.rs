//! Flights of a scenario: simulation of each controller, and what its design says about each set-point step.

use crate::scenario::{ControllerPlan, Scenario};
use lpv::certificate::{CertifiedStep, Claim, Verdict, certified_step};
use lpv::model::linearize;
use lpv::sim::{Flight, Performance, Simulation, performance};
use lpv::synthesis::{Design, covering_level};
use rayon::prelude::*;
use std::time::Instant;

/// A parameter rate below this, per second, is rest: what rounding leaves of a heading that nothing turns.
const REST_RATE: f64 = 1e-9;

/// A flown controller.
pub struct Flown {
    /// The flight.
    pub flight: Flight,
    /// Its figures of merit.
    pub performance: Performance,
    /// What the design says of each set-point step that was reached.
    pub steps: Vec<CertifiedStep>,
    /// Claims about this flight.
    pub claims: Vec<Claim>,
    /// Seconds that it took.
    pub seconds: f64,
}

impl Flown {
    /// Sum of the steps' cost bounds, if every step starts inside the certified set.
    pub fn guaranteed_cost(&self) -> Option<f64> {
        (self.steps.iter().all(CertifiedStep::is_inside) && !self.steps.is_empty())
            .then(|| self.steps.iter().map(|step| step.bound).sum())
    }
}

/// Fly every controller with its design, in parallel.
pub fn fly_all(scenario: &Scenario, designs: &[Design]) -> Vec<Flown> {
    let bar = crate::progress::bar("fly", designs.len());
    let flights = (scenario.controllers.par_iter().zip(designs))
        .map(|(plan, design)| {
            let flown = fly(scenario, plan, design);
            bar.inc(1);
            flown
        })
        .collect();
    bar.finish_and_clear();
    flights
}

fn fly(scenario: &Scenario, plan: &ControllerPlan, design: &Design) -> Flown {
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
    let (steps, mut claims) = step_claims(scenario, design, &flight);
    claims.extend(rate_claim(scenario, &performance));
    Flown {
        flight,
        performance,
        steps,
        claims,
        seconds,
    }
}

/// Whether each set-point step starts inside the certified set, and if not, the γ that would cover it.
fn step_claims(
    scenario: &Scenario,
    design: &Design,
    flight: &Flight,
) -> (Vec<CertifiedStep>, Vec<Claim>) {
    let description = scenario.plant.description();
    let scheduling = description.scheduling.as_ref();
    let mut error = vec![0.0; description.states.len()];
    let (mut steps, mut claims) = (Vec::new(), Vec::new());
    for (k, set_point) in scenario.reference.set_points().iter().enumerate() {
        let sample = flight
            .trajectory
            .time_s
            .partition_point(|&t| t < set_point.time_s - 1e-9);
        let Some(state) = flight.trajectory.states.get(sample) else {
            break;
        };
        description.state_error(state, &scenario.reference.at(set_point.time_s), &mut error);
        let rho = scheduling.map_or(0.0, |scheduling| state[scheduling.state]);
        let step = certified_step(design, scheduling, rho, &error);
        let claim = format!(
            "step {} at t = {} s starts inside the certified set",
            k + 1,
            set_point.time_s
        );
        let bound = format!("eᵀPe = {:.4}", step.bound);
        claims.push(match step.level {
            None => Claim {
                claim,
                verdict: Verdict::Numerical,
                margin: f64::INFINITY,
                detail: format!("{bound}; inputs are not limited, so the set is everything"),
            },
            Some(level) => {
                let inside = step.is_inside();
                let cover = if inside {
                    String::new()
                } else {
                    cover(scenario, design, rho, &error, level)
                };
                Claim {
                    claim,
                    verdict: if inside {
                        Verdict::Numerical
                    } else {
                        Verdict::Undecided
                    },
                    margin: level - step.bound,
                    detail: format!(
                        "{bound} {} level {level:.4}{cover}",
                        if inside { "≤" } else { ">" }
                    ),
                }
            }
        });
        steps.push(step);
    }
    (steps, claims)
}

/// Which γ would cover the step. It is advice: a trial design that fails takes nothing from the flight.
fn cover(scenario: &Scenario, design: &Design, rho: f64, error: &[f64], level: f64) -> String {
    let controller = &design.controller;
    let Some(sigma) = controller
        .limits
        .symmetric_bound(&controller.operating_input)
    else {
        return String::new();
    };
    let from = design.method.gamma().unwrap_or(level);
    let model = linearize(&*scenario.plant, rho);
    match covering_level(&model, &design.weights, &sigma, error, from) {
        Ok(Some(gamma)) => format!("; SLPVQR with γ = {gamma:.4} would cover it"),
        Ok(None) => "; no γ up to 1e6 covers it".into(),
        Err(error) => format!("; which γ would cover it is not known: {error}"),
    }
}

/// A frozen design claims nothing while its parameter moves.
fn rate_claim(scenario: &Scenario, performance: &Performance) -> Option<Claim> {
    let scheduling = scenario.plant.description().scheduling.as_ref()?;
    let rate = performance.peak_parameter_rate?;
    let at_rest = rate <= REST_RATE;
    Some(Claim {
        claim: format!(
            "{} rests during the flight, as the frozen design assumes",
            scheduling.parameter
        ),
        verdict: if at_rest {
            Verdict::Numerical
        } else {
            Verdict::Undecided
        },
        margin: -rate,
        detail: if at_rest {
            "the bound applies".into()
        } else {
            format!(
                "it moves at up to {rate:.3} {}/s: the bound holds for a parameter at rest only",
                scheduling.unit
            )
        },
    })
}
