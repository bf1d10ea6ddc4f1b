//! Figures of merit of a flight.

use super::closed_loop::{Flight, Outcome};
use super::reference::Reference;
use crate::plant::Description;
use serde::Serialize;

/// Half width of the settling band, as a fraction of the step.
const BAND: f64 = 0.05;

/// Response to one set-point change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepResponse {
    /// When the set point changed.
    pub time_s: f64,
    /// Time until every stepped state stays within 5 % of its step; `None` if it never does before the next change.
    pub settling_time_s: Option<f64>,
}

/// Figures of merit of a flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Performance {
    /// J over the flight; `None` when it diverged.
    pub actual_cost: Option<f64>,
    /// Each set-point change.
    pub steps: Vec<StepResponse>,
    /// The largest settling time of all steps; `None` if one never settles or the flight diverged.
    pub settling_time_s: Option<f64>,
    /// The largest input applied.
    pub peak_input: f64,
    /// Share of samples at which an input was limited.
    pub saturated_share: f64,
    /// Largest rate of the scheduling parameter, per second, from one sample to the next.
    pub peak_parameter_rate: Option<f64>,
}

/// Measure a flight along `reference`.
pub fn performance(
    description: &Description,
    reference: &Reference,
    flight: &Flight,
) -> Performance {
    let trajectory = &flight.trajectory;
    let completed = flight.outcome == Outcome::Completed;
    let set_points = reference.set_points();
    let mut error = vec![0.0; description.states.len()];
    let steps: Vec<StepResponse> = (set_points.iter().enumerate())
        .map(|(k, set_point)| {
            let start = trajectory
                .time_s
                .partition_point(|&t| t < set_point.time_s - 1e-9);
            let end = set_points
                .get(k + 1)
                .map_or(trajectory.time_s.len(), |next| {
                    trajectory
                        .time_s
                        .partition_point(|&t| t < next.time_s - 1e-9)
                });
            let target = reference.at(set_point.time_s);
            let size = |sample: usize, error: &mut [f64]| {
                description.state_error(&trajectory.states[sample], &target, error);
                set_point
                    .targets
                    .iter()
                    .map(|&(state, _)| error[state].abs())
                    .collect::<Vec<_>>()
            };
            let settled_at = (start < end && (completed || k + 1 < set_points.len())).then(|| {
                let initial = size(start, &mut error);
                let outside = |errors: Vec<f64>| {
                    errors
                        .iter()
                        .zip(&initial)
                        .any(|(e, first)| *e > BAND * first)
                };
                (start..end)
                    .rev()
                    .find(|&sample| outside(size(sample, &mut error)))
                    .map_or(start, |last| last + 1)
            });
            let settling_time_s = settled_at
                .filter(|&at| at < end)
                .map(|at| trajectory.time_s[at] - set_point.time_s);
            StepResponse {
                time_s: set_point.time_s,
                settling_time_s,
            }
        })
        .collect();
    let samples = trajectory.time_s.len().max(1) as f64;
    let settling_time_s = steps
        .iter()
        .map(|step| step.settling_time_s)
        .try_fold(0.0, |largest: f64, time| time.map(|time| largest.max(time)))
        .filter(|_| completed);
    Performance {
        actual_cost: trajectory.cost.last().copied().filter(|_| completed),
        settling_time_s,
        steps,
        peak_input: trajectory
            .inputs
            .iter()
            .flatten()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max),
        saturated_share: trajectory
            .saturated
            .iter()
            .filter(|&&saturated| saturated)
            .count() as f64
            / samples,
        peak_parameter_rate: description.scheduling.as_ref().map(|scheduling| {
            let rate = |pair: (&[Vec<f64>], &[f64])| {
                (pair.0[1][scheduling.state] - pair.0[0][scheduling.state]).abs()
                    / (pair.1[1] - pair.1[0])
            };
            trajectory
                .states
                .windows(2)
                .zip(trajectory.time_s.windows(2))
                .map(rate)
                .fold(0.0, f64::max)
        }),
    }
}
