//! What a design says about each set-point step of its flight, in words and as claims.

use crate::flown::Flown;
use crate::scenario::{ControllerPlan, Scenario};
use lpv::certificate::{
    BoundBasis, BoundOf, Claim, ClaimId, ClaimKind, Excursion, LyapunovFunction, Member, Of, Proofs, StepBound,
    StepConditions, Subject, UnmetCondition, Verdict, Words, excursion, prove_sampled_cost, step_bound,
};
use lpv::math::decimal::{about, at_least, at_most};
use lpv::model::linearize;
use lpv::plant::Signal;
use lpv::sim::{Performance, StepResponse, Trajectory};
use lpv::synthesis::{Design, covering_level};

/// Time between the samples at which it is looked whether a flight is beyond what its bound is for.
const EXCURSION_STEP_S: f64 = 0.01;

/// The bound of each step, with a claim that says which of its conditions are met.
pub fn step_bounds(
    scenario: &Scenario,
    plan: &ControllerPlan,
    design: &Design,
    proofs: Option<&Proofs>,
    performance: &Performance,
    trajectory: &Trajectory,
) -> (Vec<StepBound>, Vec<Claim>) {
    let scheduling = scenario.plant.description().scheduling.as_ref();
    let states = &scenario.plant.description().states;
    let Bases { bases, mut claims, reason } = bases(scenario, design, proofs);
    let bound = |(k, step): (usize, &StepResponse)| {
        let sample = |time_s: f64| trajectory.time_s.partition_point(|&t| t < time_s - 1e-9);
        let start = sample(step.time_s);
        let end = performance.steps.get(k + 1).map_or(f64::INFINITY, |next| next.time_s);
        let within = start..sample(end).max(start + 1);
        let parameters = scheduling.iter().flat_map(|s| trajectory.states[within.clone()].iter().map(|x| x[s.state]));
        let parameter_range = match scheduling {
            None => [0.0; 2],
            Some(_) => parameters
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]),
        };
        let conditions = StepConditions {
            state: &trajectory.states[start],
            reference: &trajectory.references[start],
            parameter_range,
            peak_parameter_rate: step.peak_parameter_rate,
            noise: plan.noise,
        };
        let bound = step_bound(design, &*scenario.plant, &bases, &conditions);
        let inside = match bound.level {
            None => "inputs are not limited, so the certified set is everything".to_owned(),
            Some(level) if bound.is_inside() => format!("inside the certified set of level {}", at_least(level)),
            Some(level) => {
                let cover = cover(scenario, design, step, level);
                let share = at_most(bound.share.unwrap_or(f64::NAN));
                format!("outside the certified set of level {}, V = {share} times that{cover}", at_least(level))
            }
        };
        let others = bound.unmet.iter().filter_map(|condition| match condition {
            UnmetCondition::Outside { .. } => None,
            UnmetCondition::ParameterMoves { rate } => {
                let (parameter, unit) = scheduling.map_or(("", ""), |s| (s.parameter.as_str(), s.unit.as_str()));
                let allowed = match bound.while_rate {
                    None | Some(0.0) => "a parameter at rest".to_owned(),
                    Some(rate) => format!("rates up to {} {unit}/s", at_least(rate)),
                };
                Some(format!(
                    "; {parameter} moves at up to {} {unit}/s, and the bound is for {allowed}",
                    at_most(*rate)
                ))
            }
            UnmetCondition::ParameterOutside { value } => {
                let parameter = scheduling.map_or("", |s| s.parameter.as_str());
                Some(format!("; {parameter} = {} is outside the range that the design is for", about(*value)))
            }
            UnmetCondition::InputOutside { input } => {
                let name = &scenario.plant.description().inputs[*input].name;
                Some(format!("; the input that holds the reference is outside the limits of {name}"))
            }
            UnmetCondition::Noise => Some("; noise acts, of which the bound knows nothing".into()),
            UnmetCondition::ReferenceMoves { state, rate } => {
                let Signal { name, unit, .. } = &states[*state];
                Some(format!("; the reference is not at rest: {name} moves at {} {unit}/s", about(*rate)))
            }
            UnmetCondition::ReferenceElsewhere => {
                Some("; the reference rests where the plant is not the one of the model".into())
            }
        });
        let beyond = excursions(scenario, design, trajectory, [step.time_s, end], bound.level);
        let kind = ClaimKind::StepCost { step: k + 1, time_s: step.time_s, bound: bound.bound };
        let of = match bound.of {
            BoundOf::Plant => "; of the loop as it flies, sampled and saturated",
            BoundOf::PlantInContinuousTime => {
                "; of the nonlinear plant with a controller in continuous time, which knows nothing of the sampling"
            }
            BoundOf::Model if scenario.is_linear() => {
                "; a bound of the loop in continuous time, which knows nothing of the sampling"
            }
            BoundOf::Model => {
                "; a bound of the LPV model in continuous time, which knows nothing of what linearisation leaves out"
            }
        };
        let holds = while_rate(scenario, &bound).map_or(String::new(), |rate| format!("; holds {rate}"));
        let worth = match bound.verdict {
            Verdict::Numerical => "; evaluated in floating point",
            _ => "",
        };
        let of = reason
            .as_ref()
            .map_or(of.to_owned(), |reason| format!("{of} (of the sampled loop none is proved: {reason})"));
        let claim = Claim::new(kind, Of::Model, &Words::default()).decided(
            bound.verdict,
            bound.level.map_or(f64::INFINITY, |level| level - bound.value),
            inside + &of + worth + &holds + &others.collect::<String>() + &beyond,
        );
        let claim = if bound.of == BoundOf::Model { claim } else { claim.of_plant() };
        let claim = Claim { premises: premises(&bases, bound.of), ..claim };
        (bound, claim)
    };
    let (bounds, of_steps): (Vec<StepBound>, Vec<Claim>) = performance.steps.iter().enumerate().map(bound).unzip();
    claims.extend(of_steps);
    (bounds, claims)
}

/// Under which motion of the parameter a bound holds, in words; `None` without a parameter.
pub fn while_rate(scenario: &Scenario, bound: &StepBound) -> Option<String> {
    let scheduling = scenario.plant.description().scheduling.as_ref()?;
    let (parameter, unit) = (&scheduling.parameter, &scheduling.unit);
    Some(match bound.while_rate? {
        0.0 => format!("while {parameter} is at rest"),
        rate => format!("while |d{parameter}/dt| <= {} {unit}/s", at_least(rate)),
    })
}

/// What the bounds of steps rest on.
struct Bases {
    /// The best first.
    bases: Vec<BoundBasis>,
    /// Claims that they rest on and that are not among those about the design.
    claims: Vec<Claim>,
    /// Why the sampled loop of a linear plant has no bound.
    reason: Option<String>,
}

/// Of a linear plant the proof about the sampled loop, else what is proved of the nonlinear plant and of the LPV model.
fn bases(scenario: &Scenario, design: &Design, proofs: Option<&Proofs>) -> Bases {
    let mut reason = None;
    if scenario.is_linear() {
        match prove_sampled_cost(design, &*scenario.plant) {
            Err(error) => reason = Some(error.to_string()),
            Ok(sampled) => {
                let known = |claim: &Claim| proofs.is_some_and(|proofs| proofs.claims.iter().any(|c| c.id == claim.id));
                if let Some(basis) = BoundBasis::of_flight(design, &sampled) {
                    // how long it took differs from run to run
                    let added = sampled.claims.into_iter().filter(|claim| !known(claim));
                    let claims = added.map(|claim| Claim { seconds: 0.0, ..claim }).collect();
                    return Bases { bases: vec![basis], claims, reason };
                }
                let found = sampled.claims.iter().find(|claim| claim.id.name == "sampled-cost");
                reason = found.map(|claim| match claim.verdict {
                    Verdict::Proved => "other gains fly too".into(),
                    _ => claim.detail.clone(),
                });
            }
        }
    }
    let proved = proofs.map(|proofs| [BoundBasis::of_plant(design, proofs), BoundBasis::of_model(design, proofs)]);
    Bases { bases: proved.into_iter().flatten().flatten().collect(), claims: Vec::new(), reason }
}

/// The claim about the design that a bound of this system rests on, where it rests on one.
fn premises(bases: &[BoundBasis], of: BoundOf) -> Vec<ClaimId> {
    let (name, of_claim) = match of {
        BoundOf::Plant => ("sampled-cost", Of::Model),
        BoundOf::PlantInContinuousTime => ("cost", Of::Plant),
        BoundOf::Model => ("cost", Of::Model),
    };
    let is_proved = bases.iter().any(|basis| basis.of == of);
    let subject = Subject { of: of_claim, member: Member::Outer };
    is_proved.then_some(ClaimId { name, subject }).into_iter().collect()
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
            let [total, from, to] = [beyond.total_s, beyond.from_s, beyond.to_s].map(about);
            format!("; {what} for {total} s between t = {from} s and {to} s")
        }
    };
    let lyapunov = LyapunovFunction::of(design, &*scenario.plant);
    let outside = level.and_then(|level| {
        excursion(&times, |at| {
            let (x, reference) = (&trajectory.states[within[at]], &trajectory.references[within[at]]);
            let mut error = vec![0.0; x.len()];
            description.state_error(x, reference, &mut error);
            let rho = scheduling.map_or(0.0, |scheduling| x[scheduling.state]);
            // rounding at the start of a step is no excursion
            lyapunov.value(rho, &error) > level * (1.0 + 1e-9)
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
        None => (Verdict::Undecided, f64::NAN, format!("none is proved; it moved at up to {} {unit}/s", at_most(peak))),
        Some(rate) => {
            let [up_to, flown_at] = [at_least(rate), at_most(peak)];
            let proved = format!("proved for |d{parameter}/dt| <= {up_to} {unit}/s, flown up to {flown_at} {unit}/s");
            match faster_than(scenario, trajectory, &all, rate) {
                None => (Verdict::Numerical, rate - peak, proved),
                Some(beyond) => (
                    Verdict::Undecided,
                    rate - peak,
                    format!(
                        "{proved}: faster for {} s between t = {} s and {} s, where nothing is proved",
                        about(beyond.total_s),
                        about(beyond.from_s),
                        about(beyond.to_s)
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
        Ok(Some(gamma)) => format!("; SLPVQR with γ = {} would cover it", at_most(gamma)),
        Ok(None) => "; no γ up to 1e6 covers it".into(),
        Err(error) => format!("; which γ would cover it is not known: {error}"),
    }
}
