//! `report.html`: the web page with the run's data put into it.

use crate::designs::CheckedDesign;
use crate::failure::Failure;
use crate::flights::Flown;
use crate::record::bound_verdict;
use crate::scenario::{ControllerPlan, Scenario};
use crate::stay::StepStay;
use lpv::certificate::{Claim, StepBound, UnmetCondition, Verdict};
use lpv::model::BoxWeights;
use lpv::plant::{Description, Scene};
use lpv::sim::{Outcome, Trajectory};
use lpv::synthesis::Method;
use serde::Serialize;

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
    outcome: OutcomeData,
    guaranteed_cost: Option<f64>,
    guaranteed_cost_verdict: Verdict,
    guaranteed_cost_note: String,
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

/// The page for a run.
pub fn html(scenario: &Scenario, designs: &[CheckedDesign], flights: &[Flown]) -> Result<String, Failure> {
    let data =
        serde_json::to_string(&report(scenario, designs, flights)).map_err(|error| Failure::serialisation(&error))?;
    if !PAGE.contains(PLACEHOLDER) {
        return Err(Failure::Defect("the report page has no place for its data".into()));
    }
    // "</script" and "<!--" inside a string would end the element that holds the data, or never let it end; "<" stands
    // in strings only
    Ok(PAGE.replacen(PLACEHOLDER, &data.replace('<', "\\u003c"), 1))
}

fn report<'a>(scenario: &'a Scenario, designs: &'a [CheckedDesign], flights: &'a [Flown]) -> Report<'a> {
    let description = scenario.plant.description();
    let samples = (scenario.duration_s / scenario.sample_time_s).round() as usize + 1;
    let shown: Vec<usize> = (0..samples).step_by(samples.div_ceil(SAMPLES)).collect();
    let time: Vec<f64> = shown.iter().map(|&k| significant(k as f64 * scenario.sample_time_s)).collect();
    let moved = scenario.reference.moved_states();
    let references: Vec<Vec<f64>> = time.iter().map(|&t| scenario.reference.at(t)).collect();
    let weights = description.scheduling.as_ref().map(|scheduling| BoxWeights::new(&scheduling.features));
    Report {
        schema: "lpv-report/1",
        title: &scenario.title,
        scenario: &scenario.name,
        description: &scenario.description,
        version: env!("CARGO_PKG_VERSION"),
        seed: scenario.seed,
        plant: PlantData {
            name: &description.name,
            states: &description.states,
            inputs: &description.inputs,
            outputs: &description.outputs,
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
        runs: (scenario.controllers.iter().zip(designs).zip(flights).enumerate())
            .map(|(k, ((plan, checked), flown))| run(description, &shown, weights.as_ref(), k, plan, checked, flown))
            .collect(),
        notes: notes(scenario, designs, flights),
    }
}

/// Whether a state is measured under its own name: those are the ones whose reference is worth a line in a plot.
fn is_output(description: &Description, state: usize) -> bool {
    description.outputs.iter().any(|output| output.name == description.states[state].name)
}

fn run<'a>(
    description: &Description,
    shown: &[usize],
    weights: Option<&BoxWeights>,
    index: usize,
    plan: &'a ControllerPlan,
    checked: &'a CheckedDesign,
    flown: &'a Flown,
) -> RunData<'a> {
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
        guaranteed_cost_verdict: bound_verdict(checked, flown),
        guaranteed_cost_note: bound_note(flown),
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
pub fn bound_note(flown: &Flown) -> String {
    if flown.bounds.is_empty() && !flown.stays.is_empty() {
        // below a governor: no bound on the cost, but a certificate of where the error stays
        let steps = flown.stays.iter().enumerate();
        let spell = |(k, step): (usize, &StepStay)| match step.verdict {
            Verdict::Proved => format!("step {} certified (V ≤ {:.2} γ)", k + 1, step.stay.peak_share),
            _ => format!("step {} not certified (V ≤ {:.2} γ)", k + 1, step.stay.peak_share),
        };
        return steps.map(spell).collect::<Vec<_>>().join("; ");
    }
    let worth = |bound: &StepBound| {
        let unmet: Vec<&str> = (bound.unmet.iter())
            .map(|condition| match condition {
                UnmetCondition::Outside { .. } => "outside",
                UnmetCondition::ParameterMoves { .. } => "parameter moves",
                UnmetCondition::Noise => "noise",
            })
            .collect();
        unmet.join(", ")
    };
    match flown.bounds.as_slice() {
        [] => "no step".into(),
        [one] => worth(one),
        steps => {
            let spell = |(k, bound): (usize, &StepBound)| match bound.verdict() {
                Verdict::Numerical | Verdict::Proved => {
                    format!("step {} ≤ {:.4} {}", k + 1, bound.bound, bound.verdict().word())
                }
                Verdict::Undecided | Verdict::Refuted => format!("step {} {}", k + 1, worth(bound)),
            };
            steps.iter().enumerate().map(spell).collect::<Vec<_>>().join("; ")
        }
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

fn notes(scenario: &Scenario, designs: &[CheckedDesign], flights: &[Flown]) -> Vec<String> {
    let mut notes = vec![
        "Sign convention: u = u* − sat(K(ρ)(x − x_ref)).".to_string(),
        "Bounds on costs are numerical: they hold in floating point at the grid points, for a parameter at rest, or within the rate that a design was made for.".into(),
    ];
    if designs.iter().any(|checked| checked.proofs.is_some()) {
        notes.push("A certified step is proved for the LPV model: every claim of the design holds for every parameter value at the rate used, and this flight of the nonlinear plant stayed in the set and within the rate. The proof does not cover what linearisation leaves out; V/γ shows how much room that took.".into());
    }
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
