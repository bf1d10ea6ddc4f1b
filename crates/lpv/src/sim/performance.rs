//! Figures of merit of a flight.

use super::closed_loop::{Flight, Outcome, Trajectory};
use super::reference::Reference;
use crate::plant::Description;
use serde::Serialize;
use std::ops::Range;

/// Half width of the settling band, as a fraction of the step.
const BAND: f64 = 0.05;

/// Response to one step: a set-point change, or the start of a flight away from its reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepResponse {
    /// When it began.
    pub time_s: f64,
    /// x − x_ref just after it began.
    pub error: Vec<f64>,
    /// Scheduling parameter then, zero for a plant without one.
    pub parameter: f64,
    /// Cost from then until the next step; `None` when the flight diverged before that.
    pub actual_cost: Option<f64>,
    /// Time until every state that stepped stays within 5 % of its step; `None` if it never does before the next step.
    pub settling_time_s: Option<f64>,
    /// Largest rate of the scheduling parameter until the next step, per second, from one sample to the next.
    pub peak_parameter_rate: f64,
}

/// Figures of merit of a flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Performance {
    /// J over the flight; `None` when it diverged.
    pub actual_cost: Option<f64>,
    /// Each step that the flight reached.
    pub steps: Vec<StepResponse>,
    /// The largest settling time of all steps; `None` if there is none, one never settles, or the flight diverged.
    pub settling_time_s: Option<f64>,
    /// The largest magnitude of an input applied.
    pub peak_input: f64,
    /// Share of samples at which an input was limited.
    pub saturated_share: f64,
}

/// Measure a flight along `reference`.
pub fn performance(description: &Description, reference: &Reference, flight: &Flight) -> Performance {
    let trajectory = &flight.trajectory;
    let completed = flight.outcome == Outcome::Completed;
    let times = reference.step_times();
    let sample_at = |time_s: f64| trajectory.time_s.partition_point(|&t| t < time_s - 1e-9);
    let steps: Vec<StepResponse> = (times.iter().enumerate())
        .filter_map(|(k, &time_s)| {
            let next = times.get(k + 1).map_or(trajectory.time_s.len(), |&next| sample_at(next));
            let is_whole = completed || next < trajectory.time_s.len();
            step_response(description, reference, trajectory, time_s, sample_at(time_s)..next, is_whole)
        })
        .collect();
    let samples = trajectory.time_s.len().max(1) as f64;
    let settling_time_s = (steps.iter())
        .map(|step| step.settling_time_s)
        .try_fold(0.0, |largest: f64, time| time.map(|time| largest.max(time)))
        .filter(|_| completed && !steps.is_empty());
    Performance {
        actual_cost: trajectory.cost.last().copied().filter(|_| completed),
        settling_time_s,
        steps,
        peak_input: trajectory.inputs.iter().flatten().copied().map(f64::abs).fold(0.0, f64::max),
        saturated_share: trajectory.saturated.iter().filter(|&&saturated| saturated).count() as f64 / samples,
    }
}

/// The response over `samples`, or `None` where there is no step: the flight ended before, or nothing was asked to move.
/// `is_whole` says that the flight did not diverge within it.
fn step_response(
    description: &Description,
    reference: &Reference,
    trajectory: &Trajectory,
    time_s: f64,
    samples: Range<usize>,
    is_whole: bool,
) -> Option<StepResponse> {
    let target = reference.at(time_s);
    let mut error = vec![0.0; description.states.len()];
    description.state_error(trajectory.states.get(samples.start)?, &target, &mut error);
    // a state that is asked for where it already is makes no step, and has no band to settle into
    let mut moved = reference.moved_at(time_s).unwrap_or_else(|| (0..error.len()).collect());
    moved.retain(|&state| error[state] != 0.0);
    if moved.is_empty() {
        return None;
    }

    let mut current = error.clone();
    let outside = |sample: &usize| {
        description.state_error(&trajectory.states[*sample], &target, &mut current);
        moved.iter().any(|&state| current[state].abs() > BAND * error[state].abs())
    };
    let settled_at = samples.clone().rev().find(outside).map_or(samples.start, |last| last + 1);
    let parameter = description.scheduling.as_ref().map(|scheduling| scheduling.state);
    let value = |sample: usize| parameter.map_or(0.0, |state| trajectory.states[sample][state]);
    let rate = |sample: usize| {
        (value(sample) - value(sample - 1)).abs() / (trajectory.time_s[sample] - trajectory.time_s[sample - 1])
    };
    // the cost at the first sample of the next step is the cost at the end of this one
    let end = samples.end.min(trajectory.cost.len() - 1);
    Some(StepResponse {
        time_s,
        parameter: value(samples.start),
        actual_cost: is_whole.then(|| trajectory.cost[end] - trajectory.cost[samples.start]),
        settling_time_s: (is_whole && settled_at < samples.end).then(|| trajectory.time_s[settled_at] - time_s),
        peak_parameter_rate: (samples.start + 1..samples.end).map(rate).fold(0.0, f64::max),
        error,
    })
}
