//! `report.html`: the web page with the run's data put into it.

use crate::designs::{CheckedDesign, Undesigned, file_name};
use crate::failure::Failure;
use crate::flown::Flown;
use crate::scenario::{ControllerPlan, Scenario};
use crate::stay::StepStay;
use crate::step_bounds::while_rate;
use lpv::certificate::{BoundOf, Claim, ClaimKind, Member, Motion, Of, StepBound, Subject, UnmetCondition, Verdict};
use lpv::math::decimal::{Rounding, at_most, decimal};
use lpv::math::eigen::largest_singular_value;
use lpv::model::BoxWeights;
use lpv::plant::{Description, Scene};
use lpv::sim::{Outcome, Trajectory};
use lpv::synthesis::{Design, Method};
use serde::Serialize;
use std::path::Path;

/// The page, built from `studio/` (or the plain page where npm was missing).
const PAGE: &str = include_str!(concat!(env!("OUT_DIR"), "/report.html"));
/// What the data take the place of.
const PLACEHOLDER: &str = "/*LPV_REPORT_DATA*/";
/// Samples that the page shows, at most: more than a screen has columns.
const SAMPLES: usize = 1500;

type Series = Vec<Option<f64>>;

#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    title: &'a str,
    scenario: &'a str,
    description: &'a str,
    version: &'static str,
    seed: u64,
    /// Between samples the controllers hold their inputs.
    sample_time_s: f64,
    plant: PlantData<'a>,
    scheduling: SchedulingData,
    time: Vec<f64>,
    reference: Vec<Option<Series>>,
    steps: Vec<StepData<'a>>,
    runs: Vec<RunData<'a>>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct PlantData<'a> {
    name: &'a str,
    states: &'a [lpv::plant::Signal],
    inputs: &'a [lpv::plant::Signal],
    outputs: &'a [lpv::plant::Signal],
    /// Whether its linear model leaves nothing out.
    linear: bool,
    scene: Option<&'a Scene>,
}

#[derive(Serialize)]
struct SchedulingData {
    parameter: String,
    unit: String,
    weights: Vec<String>,
}

#[derive(Serialize)]
struct StepData<'a> {
    time_s: f64,
    label: &'a str,
}

#[derive(Serialize)]
struct RunData<'a> {
    id: &'a str,
    label: &'a str,
    color_index: usize,
    controller: String,
    verdict: Verdict,
    claims: Vec<&'a Claim>,
    /// What proves the claims about the design again.
    certify_command: String,
    /// [`largest_gain`]
    largest_gain: f64,
    /// [`proved_rate`]
    proved_rate: Option<f64>,
    outcome: OutcomeData,
    /// Of the plant as it flies.
    guaranteed_cost: Option<f64>,
    /// Of the nonlinear plant with a controller in continuous time.
    plant_cost_bound: Option<f64>,
    /// Of the LPV model with a controller in continuous time.
    model_cost_bound: Option<f64>,
    guaranteed_cost_verdict: Verdict,
    guaranteed_cost_note: String,
    /// Which system the bound is of.
    guaranteed_cost_of: BoundOf,
    actual_cost: Option<f64>,
    settling_time_s: Option<f64>,
    peak_input: f64,
    saturated_share: f64,
    input_limits: Vec<LimitData>,
    states: Vec<Series>,
    inputs: Vec<Series>,
    weights: Vec<Series>,
    cost: Series,
    /// Per state, where there is a governor: the reference that it made; none where it rests all the time.
    governed: Option<Vec<Option<Series>>>,
    /// V/γ, of a controller that watches its certified sets.
    set_share: Option<Series>,
    measurement: Option<Vec<Series>>,
    estimation: Option<EstimationData>,
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
enum OutcomeData {
    Completed,
    Diverged { time_s: f64, state: String, detail: String },
}

#[derive(Serialize)]
struct LimitData {
    min: Option<f64>,
    max: Option<f64>,
}

#[derive(Serialize)]
struct EstimationData {
    error: Vec<Series>,
    sigma3: Vec<Series>,
    inside_share: Vec<f64>,
}

/// The page for a run whose designs lie in `folder`.
pub fn html(
    scenario: &Scenario,
    designs: &[CheckedDesign],
    undesigned: &[Undesigned],
    flights: &[Flown],
    folder: &Path,
) -> Result<String, Failure> {
    let report = report(scenario, designs, undesigned, flights, folder);
    let data = serde_json::to_string(&report).map_err(|error| Failure::serialisation(&error))?;
    if !PAGE.contains(PLACEHOLDER) {
        return Err(Failure::Defect("the report page has no place for its data".into()));
    }
    // "</script" and "<!--" inside a string would end the element that holds the data, or never let it end; "<" stands
    // in strings only
    Ok(PAGE.replacen(PLACEHOLDER, &data.replace('<', "\\u003c"), 1))
}

fn report<'a>(
    scenario: &'a Scenario,
    designs: &'a [CheckedDesign],
    undesigned: &[Undesigned],
    flights: &'a [Flown],
    folder: &Path,
) -> Report<'a> {
    let description = scenario.plant.description();
    let samples = (scenario.duration_s / scenario.sample_time_s).round() as usize + 1;
    let shown: Vec<usize> = (0..samples).step_by(samples.div_ceil(SAMPLES)).collect();
    let time: Vec<f64> = shown.iter().map(|&k| significant(k as f64 * scenario.sample_time_s)).collect();
    let moved = scenario.reference.moved_states();
    let references: Vec<Vec<f64>> = time.iter().map(|&t| scenario.reference.at(t)).collect();
    let weights = description.scheduling.as_ref().map(|scheduling| BoxWeights::new(&scheduling.features));
    let mut runs: Vec<RunData> = (scenario.controllers.iter().zip(designs).zip(flights).enumerate())
        .map(|(k, ((plan, checked), flown))| RunData {
            certify_command: certify_command(folder, &plan.request.name),
            ..run(scenario, &shown, weights.as_ref(), k, plan, checked, flown)
        })
        .collect();
    // what is proved leads: flight and all, then the design alone. Letters follow; colours stay those of the scenario
    runs.sort_by_key(|run| (!is_proved_throughout(&run.claims), run.verdict < Verdict::Proved));
    Report {
        schema: "lpv-report/1",
        title: &scenario.title,
        scenario: &scenario.name,
        description: &scenario.description,
        version: env!("CARGO_PKG_VERSION"),
        seed: scenario.seed,
        sample_time_s: scenario.sample_time_s,
        plant: PlantData {
            name: &description.name,
            states: &description.states,
            inputs: &description.inputs,
            outputs: &description.outputs,
            linear: scenario.is_linear(),
            scene: description.scene.as_ref(),
        },
        scheduling: SchedulingData {
            parameter: description.scheduling.as_ref().map_or(String::new(), |s| s.parameter.clone()),
            unit: description.scheduling.as_ref().map_or(String::new(), |s| s.unit.clone()),
            weights: (1..=weights.as_ref().map_or(0, |w| w.corners.len())).map(|i| format!("rho_{i}")).collect(),
        },
        reference: (0..description.states.len())
            .map(|i| {
                let shown = is_output(description, i) || moved.contains(&i);
                shown.then(|| references.iter().map(|reference| Some(significant(reference[i]))).collect())
            })
            .collect(),
        time,
        steps: (scenario.reference.set_points().iter().zip(&scenario.set_point_labels))
            .map(|(set_point, label)| StepData { time_s: set_point.time_s, label })
            .collect(),
        runs,
        notes: notes(scenario, designs, undesigned, flights),
    }
}

/// Whether a state is measured under its own name: those are the ones whose reference is worth a line in a plot.
fn is_output(description: &Description, state: usize) -> bool {
    description.outputs.iter().any(|output| output.name == description.states[state].name)
}

fn run<'a>(
    scenario: &'a Scenario,
    shown: &[usize],
    weights: Option<&BoxWeights>,
    index: usize,
    plan: &'a ControllerPlan,
    checked: &'a CheckedDesign,
    flown: &'a Flown,
) -> RunData<'a> {
    let description = scenario.plant.description();
    let trajectory = &flown.flight.trajectory;
    let limits = &plan.request.limits;
    let (states, inputs, outputs) = (description.states.len(), description.inputs.len(), description.outputs.len());
    RunData {
        id: &plan.request.name,
        label: &plan.label,
        color_index: index,
        controller: controller_line(plan),
        verdict: checked.verdict(),
        claims: checked.claims.iter().chain(&flown.claims).collect(),
        certify_command: String::new(),
        largest_gain: significant(largest_gain(&checked.design)),
        proved_rate: proved_rate(checked),
        outcome: match flown.flight.outcome {
            Outcome::Completed => OutcomeData::Completed,
            Outcome::EstimatorDiverged { time_s } => OutcomeData::Diverged {
                time_s,
                state: "estimate".into(),
                detail: "the estimate or its covariance left all bounds".into(),
            },
            Outcome::Diverged { time_s, state, value } => OutcomeData::Diverged {
                time_s,
                state: description.states[state].name.clone(),
                detail: format!(
                    "{} reached {value:.4} {}",
                    description.states[state].name, description.states[state].unit
                ),
            },
        },
        guaranteed_cost: flown.guaranteed_cost(),
        plant_cost_bound: flown.plant_cost_bound(),
        model_cost_bound: flown.model_cost_bound(),
        guaranteed_cost_verdict: flown.bound_verdict(),
        guaranteed_cost_note: bound_note(scenario, flown),
        guaranteed_cost_of: flown.bounds_are_of(),
        actual_cost: flown.performance.actual_cost,
        settling_time_s: flown.performance.settling_time_s,
        peak_input: flown.performance.peak_input,
        saturated_share: flown.performance.saturated_share,
        input_limits: limits.min.iter().zip(&limits.max).map(|(&min, &max)| LimitData { min, max }).collect(),
        states: series(shown, &trajectory.states, states),
        inputs: series(shown, &trajectory.inputs, inputs),
        weights: weights.map_or(Vec::new(), |weights| {
            let parameter = description.scheduling.as_ref().map_or(0, |scheduling| scheduling.state);
            let values: Vec<Vec<f64>> = trajectory.states.iter().map(|x| weights.at(x[parameter])).collect();
            series(shown, &values, weights.corners.len())
        }),
        cost: sampled(shown, trajectory.cost.len(), |k| trajectory.cost[k]),
        governed: (!trajectory.governed.is_empty()).then(|| {
            let moves =
                |i: usize| trajectory.governed.iter().any(|reference| reference[i] != trajectory.governed[0][i]);
            (0..states)
                .map(|i| moves(i).then(|| sampled(shown, trajectory.governed.len(), |k| trajectory.governed[k][i])))
                .collect()
        }),
        set_share: (!trajectory.set_shares.is_empty())
            .then(|| sampled(shown, trajectory.set_shares.len(), |k| trajectory.set_shares[k])),
        measurement: (!trajectory.measurements.is_empty()).then(|| series(shown, &trajectory.measurements, outputs)),
        estimation: flown.flight.consistency.as_ref().map(|consistency| EstimationData {
            error: estimation_errors(description, shown, trajectory),
            sigma3: (0..states)
                .map(|i| sampled(shown, trajectory.deviations.len(), |k| 3.0 * trajectory.deviations[k][i]))
                .collect(),
            inside_share: consistency.inside_three_sigma.clone(),
        }),
    }
}

/// What proves the claims about a controller's design in `folder` again.
fn certify_command(folder: &Path, controller: &str) -> String {
    let file = folder.join(file_name(controller)).display().to_string();
    // a file is no option
    let file = if file.starts_with('-') { format!("./{file}") } else { file };
    match file.chars().all(|c| c.is_alphanumeric() || "/._-+=:@%,".contains(c)) {
        true => format!("lpv certify {file}"),
        false => format!("lpv certify '{}'", file.replace('\'', "'\\''")),
    }
}

/// Largest singular value of the gains at the grid points, of the design and of those of its inner sets. A design on a grid gives no share of its optimum
/// back for a smaller gain: the factor by which its P is strict is no such share.
fn largest_gain(design: &Design) -> f64 {
    let each = std::iter::once(design).chain(&design.inner).flat_map(|design| &design.points);
    each.map(|point| largest_singular_value(&point.gain)).fold(0.0, f64::max)
}

/// The largest rate of the parameter for which every set of the design is proved invariant (or V to decrease) and the
/// cost bound from it is proved; 0 is at rest. `None` where one of these is not proved, or there is no parameter.
fn proved_rate(checked: &CheckedDesign) -> Option<f64> {
    let mut members = std::iter::once(Member::Outer).chain((0..checked.design.inner.len()).map(Member::Inner));
    let least = members.try_fold(f64::INFINITY, |least, member| Some(least.min(member_rate(&checked.claims, member)?)));
    least.filter(|rate| rate.is_finite())
}

/// The same of one member; infinite where no rate matters.
fn member_rate(claims: &[Claim], member: Member) -> Option<f64> {
    let subject = Subject { of: Of::Model, member };
    let proved = || claims.iter().filter(|claim| claim.id.subject == subject && claim.verdict == Verdict::Proved);
    let rate = |motion: &Motion| match motion {
        Motion::AtRest => 0.0,
        Motion::Bounded { rate } => *rate,
        Motion::None | Motion::Hull | Motion::Any | Motion::WithinRanges => f64::INFINITY,
    };
    let stays = |claim: &Claim| match &claim.kind {
        ClaimKind::Invariance { level, motion } => Some((Some(*level), rate(motion))),
        ClaimKind::Decrease { motion } => Some((None, rate(motion))),
        _ => None,
    };
    let costs = |claim: &Claim| match &claim.kind {
        ClaimKind::Cost { level, motion, .. } => Some((*level, rate(motion))),
        _ => None,
    };
    // both of one set
    let of_set = |(level, bounded): (Option<f64>, f64)| {
        let kept = proved().filter_map(stays).filter(move |(other, _)| *other == level);
        kept.map(move |(_, rate)| rate.min(bounded))
    };
    proved().filter_map(costs).flat_map(of_set).reduce(f64::max)
}

/// Whether every claim is proved, of the design and of each step. That a flight kept to its rate is looked up, never
/// proved.
fn is_proved_throughout(claims: &[&Claim]) -> bool {
    let mut proofs = claims.iter().filter(|claim| !matches!(claim.kind, ClaimKind::RateKept { .. })).peekable();
    proofs.peek().is_some() && proofs.all(|claim| claim.verdict == Verdict::Proved)
}

fn estimation_errors(description: &Description, shown: &[usize], trajectory: &Trajectory) -> Vec<Series> {
    let errors: Vec<Vec<f64>> = (trajectory.estimates.iter().zip(&trajectory.states))
        .map(|(estimate, state)| {
            let mut error = vec![0.0; state.len()];
            description.state_error(state, estimate, &mut error);
            error
        })
        .collect();
    series(shown, &errors, description.states.len())
}

/// What the bound of a flight is worth, in a few words: step by step where there are several.
pub fn bound_note(scenario: &Scenario, flown: &Flown) -> String {
    if flown.bounds.is_empty() && !flown.stays.is_empty() {
        // below a governor: no bound on the cost, but a certificate of where the error stays
        let steps = flown.stays.iter().enumerate();
        let share = |step: &StepStay| decimal(step.stay.peak_share, 3, Rounding::Up);
        let spell = |(k, step): (usize, &StepStay)| match step.verdict {
            Verdict::Proved => format!("step {} certified (V ≤ {} γ)", k + 1, share(step)),
            _ => format!("step {} not certified (V ≤ {} γ)", k + 1, share(step)),
        };
        return steps.map(spell).collect::<Vec<_>>().join("; ");
    }
    // under which motion, what is not met, and whether the flight did better
    let remarks = |k: usize| -> Vec<String> {
        let bound = &flown.bounds[k];
        let holds = (bound.verdict == Verdict::Proved).then(|| while_rate(scenario, bound)).flatten();
        let beyond = flown.exceeds(k).then(|| "exceeded by the flight".to_owned());
        holds.into_iter().chain(bound.unmet.iter().map(unmet_words)).chain(beyond).collect()
    };
    match flown.bounds.as_slice() {
        [] => "no step".into(),
        [_] => remarks(0).join(", "),
        steps => {
            let spell = |(k, bound): (usize, &StepBound)| {
                let system = system_word(bound.of);
                let remarks = remarks(k).join(", ");
                match bound.verdict {
                    Verdict::Undecided | Verdict::Refuted => format!("step {} {remarks}", k + 1),
                    verdict if remarks.is_empty() => {
                        format!("step {} {system} {} {}", k + 1, at_most(bound.bound), verdict.word())
                    }
                    verdict => format!("step {} {system} {} {} {remarks}", k + 1, at_most(bound.bound), verdict.word()),
                }
            };
            steps.iter().enumerate().map(spell).collect::<Vec<_>>().join("; ")
        }
    }
}

/// Of which system a bound is, in front of it.
pub fn system_word(of: BoundOf) -> &'static str {
    match of {
        BoundOf::Plant => "≤",
        BoundOf::PlantInContinuousTime => "plant in continuous time: ≤",
        BoundOf::Model => "model: ≤",
    }
}

fn unmet_words(condition: &UnmetCondition) -> String {
    match condition {
        UnmetCondition::Outside { share, .. } => format!("outside (V = {} γ)", decimal(*share, 3, Rounding::Up)),
        UnmetCondition::ParameterMoves { .. } => "parameter moves".into(),
        UnmetCondition::ParameterOutside { .. } => "parameter outside its range".into(),
        UnmetCondition::Noise => "noise".into(),
        UnmetCondition::ReferenceMoves { .. } | UnmetCondition::ReferenceElsewhere => "reference not at rest".into(),
        UnmetCondition::InputOutside { .. } => "held by an input outside its limits".into(),
    }
}

/// A controller in one line.
fn controller_line(plan: &ControllerPlan) -> String {
    let method = match plan.request.method {
        Method::Lpvqr => "LPVQR at frozen parameters (Theorem 4.5)".to_string(),
        Method::Slpvqr { gamma } => format!("SLPVQR, γ = {gamma} (Theorem 5.3)"),
        Method::HighGainSlpvqr { gamma, .. } => {
            format!("high-gain SLPVQR, γ = {gamma} (Theorem 5.4)")
        }
    };
    let method = match &plan.request.rate_bounded {
        Some(bounded) => {
            format!("{} for parameter rates up to {}", method.replace(" at frozen parameters", ""), bounded.rate)
        }
        None => method,
    };
    let supervision = supervision_words(plan);
    let limits = if plan.request.limits.is_none() { "; inputs not limited" } else { "" };
    let feedback = match (plan.noise, plan.estimator) {
        (_, true) => "; noise, extended Kalman filter",
        (true, false) => "; process noise, state feedback",
        (false, false) => "; state feedback",
    };
    format!("{method}{limits}{supervision}{feedback}")
}

/// What is put around the design, in words.
fn supervision_words(plan: &ControllerPlan) -> String {
    let supervision = &plan.supervision;
    let mut words = String::new();
    if !supervision.inner_levels.is_empty() {
        let levels: Vec<String> = supervision.inner_levels.iter().map(f64::to_string).collect();
        words.push_str(&format!("; inner sets of level {}", levels.join(", ")));
    }
    match supervision.governor.as_ref().map(|governor| governor.feedforward) {
        None => {}
        Some(None) => words.push_str("; governor, static references"),
        Some(Some(share)) => {
            words.push_str(&format!("; governor, moving references with {:.0} % of the inputs", 100.0 * share));
        }
    }
    words
}

fn notes(scenario: &Scenario, designs: &[CheckedDesign], undesigned: &[Undesigned], flights: &[Flown]) -> Vec<String> {
    let mut notes = vec![
        "Sign convention: u = u* − sat(K(ρ)(x − x_ref)).".to_string(),
        match scenario.is_linear() {
            true => "A guaranteed cost is proved of the loop as it flies, sampled with zero-order hold and saturated. A bound of the model is one of the loop in continuous time, which does not cover the sampling.",
            false => "A bound of the model is one of the LPV model with a controller in continuous time: it covers neither what linearisation leaves out nor the sampling. It holds for a parameter at rest, or within the rate that is named; where it is not called proved it was evaluated in floating point at the grid points.",
        }
        .to_owned(),
    ];
    if designs.iter().any(|checked| checked.proofs.is_some()) {
        notes.push("A certified step is proved for the LPV model: every claim of the design holds for every parameter value at the rate used, and this flight of the nonlinear plant stayed in the set and within the rate. The proof does not cover what linearisation leaves out; V/γ shows how much room that took.".into());
    }
    notes.extend(undesigned.iter().map(|Undesigned { label, source, .. }| format!("{label}: not designed: {source}.")));
    for ((plan, checked), flown) in scenario.controllers.iter().zip(designs).zip(flights) {
        for claim in checked.claims.iter().chain(&flown.claims).filter(|claim| claim.verdict < Verdict::Numerical) {
            notes.push(format!("{}: {}: {}. {}", plan.label, claim.verdict.word(), claim.claim, claim.detail));
        }
    }
    notes
}

fn series(shown: &[usize], samples: &[Vec<f64>], width: usize) -> Vec<Series> {
    (0..width).map(|i| sampled(shown, samples.len(), |k| samples[k][i])).collect()
}

/// The values at the shown samples; none after the end of a flight.
fn sampled(shown: &[usize], available: usize, value: impl Fn(usize) -> f64) -> Series {
    shown.iter().map(|&k| (k < available).then(|| significant(value(k)))).collect()
}

/// Six significant digits: below what a plot resolves, and a third of the file.
fn significant(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lpv::certificate::Words;

    fn claim(kind: ClaimKind, verdict: Verdict) -> Claim {
        Claim::new(kind, Of::Model, &Words::default()).decided(verdict, 1.0, "")
    }

    #[test]
    fn the_proved_rate_is_that_of_set_and_bound() {
        let stays =
            |rate, verdict| claim(ClaimKind::Invariance { level: 1.0, motion: Motion::Bounded { rate } }, verdict);
        let costs = |motion, verdict| claim(ClaimKind::Cost { factor: 1.1, level: Some(1.0), motion }, verdict);
        let bounded = |rate| Motion::Bounded { rate };
        let rate = |claims: &[Claim]| member_rate(claims, Member::Outer);
        use Verdict::{Numerical, Proved, Refuted, Undecided};
        assert_eq!(rate(&[stays(0.37, Proved), costs(bounded(0.2), Proved)]), Some(0.2));
        assert_eq!(rate(&[stays(0.37, Proved), costs(bounded(2.0), Proved)]), Some(0.37));
        assert_eq!(rate(&[stays(0.37, Proved), costs(Motion::AtRest, Proved)]), Some(0.0));
        assert_eq!(rate(&[stays(0.37, Proved)]), None, "no bound");
        for verdict in [Numerical, Undecided, Refuted] {
            assert_eq!(rate(&[stays(0.37, Proved), costs(bounded(0.2), verdict)]), None);
            assert_eq!(rate(&[stays(0.37, verdict), costs(bounded(0.2), Proved)]), None);
        }
        assert_eq!(rate(&[]), None);
        // another member, or the plant, says nothing of this one
        let inner = stays(0.37, Proved).of_member(Member::Inner(0));
        assert_eq!(rate(&[inner, costs(bounded(0.2), Proved)]), None);
        assert_eq!(rate(&[stays(0.37, Proved).of_plant(), costs(bounded(0.2), Proved)]), None);
        // nor does another set
        let elsewhere = claim(ClaimKind::Cost { factor: 1.1, level: Some(0.5), motion: bounded(0.2) }, Proved);
        assert_eq!(rate(&[stays(0.37, Proved), elsewhere.clone()]), None);
        assert_eq!(rate(&[stays(0.37, Proved), elsewhere, costs(bounded(0.1), Proved)]), Some(0.1));
        let decrease = claim(ClaimKind::Decrease { motion: Motion::None }, Proved);
        let everywhere = claim(ClaimKind::Cost { factor: 1.0, level: None, motion: Motion::None }, Proved);
        assert_eq!(rate(&[decrease, everywhere]), Some(f64::INFINITY), "no parameter");
    }

    #[test]
    fn what_is_proved_throughout_leads() {
        let set = |verdict| claim(ClaimKind::Unsaturated { level: 1.0 }, verdict);
        let kept = claim(ClaimKind::RateKept { parameter: "psi".into() }, Verdict::Numerical);
        let (proved, open) = (set(Verdict::Proved), set(Verdict::Numerical));
        assert!(is_proved_throughout(&[&proved, &kept]));
        assert!(!is_proved_throughout(&[&proved, &open]));
        assert!(!is_proved_throughout(&[&kept]) && !is_proved_throughout(&[]), "nothing is proved");
    }

    #[test]
    fn the_command_reaches_the_file_through_a_shell() {
        let command = |folder: &str| certify_command(Path::new(folder), "a");
        assert_eq!(command("out/quadrotor"), "lpv certify out/quadrotor/design-a.json");
        assert_eq!(command("my results"), "lpv certify 'my results/design-a.json'");
        assert_eq!(command("it's; rm"), "lpv certify 'it'\\''s; rm/design-a.json'");
        assert_eq!(command("-x"), "lpv certify ./-x/design-a.json");
    }
}
