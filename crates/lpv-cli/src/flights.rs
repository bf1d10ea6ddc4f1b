//! Flights of a scenario: simulation of each controller, and what its design says about each set-point step.

use crate::scenario::{ControllerPlan, Scenario};
use crate::stay::{StepStay, step_stays};
use lpv::certificate::{
    Claim, ClaimKind, Excursion, Of, Proofs, StepBound, StepConditions, SupervisedProofs, UnmetCondition, Verdict,
    Words, excursion, lyapunov_value, step_bound,
};
use lpv::model::linearize;
use lpv::sim::{Flight, Performance, Simulation, StepResponse, Trajectory, performance};
use lpv::synthesis::{Design, covering_level};
use rayon::prelude::*;
use std::time::Instant;

/// Time between the samples at which it is looked whether a flight is beyond what its bound is for.
const EXCURSION_STEP_S: f64 = 0.01;

/// A flown controller.
pub struct Flown {
    /// The flight.
    pub flight: Flight,
    /// Its figures of merit.
    pub performance: Performance,
    /// What the design says of each step that was reached: a guarantee only where its verdict is `proved`; empty below a
    /// governor, whose steps have no bound on their cost.
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
        false => step_bounds(scenario, plan, design, &performance, &flight.trajectory),
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
    trajectory: &Trajectory,
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
        let end = performance.steps.get(k + 1).map_or(f64::INFINITY, |next| next.time_s);
        let beyond = excursions(scenario, design, trajectory, [step.time_s, end], bound.level);
        let kind = ClaimKind::StepCost { step: k + 1, time_s: step.time_s, bound: bound.bound };
        let claim = Claim::new(kind, Of::Model, &Words::default()).decided(
            bound.verdict(),
            bound.level.map_or(f64::INFINITY, |level| level - bound.bound),
            inside + &others.collect::<String>() + &beyond,
        );
        (bound, claim)
    };
    performance.steps.iter().enumerate().map(bound).unzip()
}

/// When and for how long a step was outside the set of this level, and faster than the rate of the design (a frozen design is
/// for a parameter at rest, and of that the claim speaks already).
fn excursions(
    scenario: &Scenario,
    design: &Design,
    trajectory: &Trajectory,
    [begin, end]: [f64; 2],
    level: Option<f64>,
) -> String {
    let description = scenario.plant.description();
    let scheduling = description.scheduling.as_ref();
    let within: Vec<usize> = (0..trajectory.time_s.len())
        .filter(|&k| (begin..end).contains(&trajectory.time_s[k]))
        .step_by(((EXCURSION_STEP_S / scenario.sample_time_s) as usize).max(1))
        .collect();
    let times: Vec<f64> = within.iter().map(|&k| trajectory.time_s[k]).collect();
    let spell = |what: String, beyond: Option<Excursion>| match beyond {
        None => String::new(),
        Some(beyond) => {
            format!("; {what} for {:.2} s between t = {:.2} s and {:.2} s", beyond.total_s, beyond.from_s, beyond.to_s)
        }
    };
    let outside = level.and_then(|level| {
        excursion(&times, |at| {
            let (x, reference) = (&trajectory.states[within[at]], &trajectory.references[within[at]]);
            let mut error = vec![0.0; x.len()];
            description.state_error(x, reference, &mut error);
            let rho = scheduling.map_or(0.0, |scheduling| x[scheduling.state]);
            // rounding at the start of a step is no excursion
            lyapunov_value(design, scheduling, rho, &error) > level * (1.0 + 1e-9)
        })
    });
    let mut text = spell("outside the set".into(), outside);
    if let (Some(bounded), Some(scheduling)) = (&design.rate_bounded, scheduling) {
        let faster = faster_than(scenario, trajectory, &within, bounded.rate);
        text += &spell(format!("faster than {} {}/s", bounded.rate, scheduling.unit), faster);
    }
    text
}

/// When the parameter moved faster than `rate`, over the samples `within`.
fn faster_than(scenario: &Scenario, trajectory: &Trajectory, within: &[usize], rate: f64) -> Option<Excursion> {
    let state = scenario.plant.description().scheduling.as_ref()?.state;
    let times: Vec<f64> = within.iter().map(|&k| trajectory.time_s[k]).collect();
    excursion(&times, |at| {
        let k = within[at];
        let Some(next) = trajectory.time_s.get(k + 1) else { return false };
        let step = trajectory.states[k + 1][state] - trajectory.states[k][state];
        (step / (next - trajectory.time_s[k])).abs() > rate
    })
}

/// Compare the rate that is proved with the one that the flight had.
pub fn compare_with_proofs(scenario: &Scenario, flown: &mut Flown, proofs: &Proofs) {
    let Some(scheduling) = &scenario.plant.description().scheduling else { return };
    let (parameter, unit) = (&scheduling.parameter, &scheduling.unit);
    let trajectory = &flown.flight.trajectory;
    let stride = ((EXCURSION_STEP_S / scenario.sample_time_s) as usize).max(1);
    let all: Vec<usize> = (0..trajectory.time_s.len()).step_by(stride).collect();
    let peak = flown.performance.steps.iter().map(|step| step.peak_parameter_rate).fold(0.0, f64::max);
    let kind = ClaimKind::RateKept { parameter: parameter.clone() };
    let (verdict, margin, detail) = match proofs.stable_up_to {
        None => (Verdict::Undecided, f64::NAN, format!("none is proved; it moved at up to {peak:.4} {unit}/s")),
        Some(rate) => {
            let proved = format!("proved for |d{parameter}/dt| <= {rate:.4} {unit}/s, flown up to {peak:.4} {unit}/s");
            match faster_than(scenario, trajectory, &all, rate) {
                None => (Verdict::Numerical, rate - peak, proved),
                Some(beyond) => (
                    Verdict::Undecided,
                    rate - peak,
                    format!(
                        "{proved}: faster for {:.2} s between t = {:.2} s and {:.2} s, where nothing is proved",
                        beyond.total_s, beyond.from_s, beyond.to_s
                    ),
                ),
            }
        }
    };
    flown.claims.push(Claim::new(kind, Of::Plant, &Words::default()).decided(verdict, margin, detail));
}

/// Which γ would cover the step. It is advice: a trial design that fails takes nothing from the flight.
fn cover(scenario: &Scenario, design: &Design, step: &StepResponse, level: f64) -> String {
    let controller = &design.controller;
    let sigma = controller.limits.symmetric_bound(&controller.operating_input);
    if !sigma.iter().all(|sigma| sigma.is_finite()) {
        return String::new();
    }
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
