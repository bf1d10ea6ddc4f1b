//! The control law: what runs at every sample.

use super::certified_set::{CertifiedSet, SetEvaluator};
use super::feedback::Controller;
use super::governor::{GovernorState, Sample};
use super::nested::{Active, select};
use crate::plant::Description;

/// A controller with its state and work space.
pub struct Law<'a> {
    controller: &'a Controller,
    wraps: Vec<bool>,
    sample_time_s: f64,
    gain: Vec<f64>,
    error: Vec<f64>,
    /// Of a supervised controller: its sets from the outermost in, and which is active.
    sets: Vec<&'a CertifiedSet>,
    evaluator: SetEvaluator,
    active: Active,
    governor: Option<GovernorState>,
}

impl<'a> Law<'a> {
    /// The control law of `controller` for the plant of `description`, to be called every `sample_time_s`; a governor's
    /// reference starts at the state `x`.
    pub fn new(controller: &'a Controller, description: &Description, sample_time_s: f64, x: &[f64]) -> Self {
        let (n, m) = (description.states.len(), controller.operating_input.len());
        let supervisor = controller.supervisor.as_ref();
        let sets: Vec<&CertifiedSet> = (supervisor.into_iter())
            .flat_map(|supervisor| std::iter::once(&supervisor.set).chain(supervisor.inner.iter().map(|m| &m.set)))
            .collect();
        let governor = supervisor.and_then(|supervisor| supervisor.governor.as_ref());
        Self {
            controller,
            wraps: description.states.iter().map(|signal| signal.wraps).collect(),
            sample_time_s,
            gain: vec![0.0; m * n],
            error: vec![0.0; n],
            sets,
            evaluator: SetEvaluator::new(n),
            active: Active { member: 0, share: 0.0 },
            governor: governor.map(|governor| governor.start(x, m)),
        }
    }

    /// The input u = sat(u* + u_ref − K(ρ)e), e = x − x_ref, for the sample at `time_s`: ρ is the scheduling state of `x`; x_ref
    /// is `set_point`, or what the governor makes of it, with its u_ref. True if an input was limited.
    pub fn step(&mut self, time_s: f64, x: &[f64], set_point: &[f64], input: &mut [f64]) -> bool {
        let rho = self.controller.scheduling_state.map_or(0.0, |state| x[state]);
        let supervisor = self.controller.supervisor.as_ref();
        let governor = supervisor.and_then(|supervisor| Some((&supervisor.set, supervisor.governor.as_ref()?)));
        if let (Some((set, governor)), Some(state)) = (governor, &mut self.governor) {
            let sample = Sample {
                time_s,
                sample_time_s: self.sample_time_s,
                rho,
                scheduling_state: self.controller.scheduling_state,
                x,
                set_point,
                wraps: &self.wraps,
            };
            state.step(governor, set, &mut self.evaluator, &sample);
        }
        let reference = self.governor.as_ref().map_or(set_point, |governor| &governor.reference);
        for (i, error) in self.error.iter_mut().enumerate() {
            let difference = x[i] - reference[i];
            *error = if self.wraps[i] { crate::math::angle::wrap(difference) } else { difference };
        }
        if !self.sets.is_empty() {
            self.active = select(self.active.member, &self.sets, &mut self.evaluator, rho, &self.error);
        }
        if let (Some((_, governor)), Some(state)) = (governor, &mut self.governor) {
            state.observe(governor, self.active.share);
        }

        let schedule = match (self.active.member, supervisor) {
            (0, _) | (_, None) => &self.controller.schedule,
            (member, Some(supervisor)) => &supervisor.inner[member - 1].schedule,
        };
        schedule.gain_at(rho, &mut self.gain);
        for (i, row) in self.gain.chunks_exact(self.error.len()).enumerate() {
            let feedback: f64 = row.iter().zip(&self.error).map(|(k, e)| k * e).sum();
            let feedforward = self.governor.as_ref().map_or(0.0, |governor| governor.feedforward[i]);
            input[i] = self.controller.operating_input[i] + feedforward - feedback;
        }
        self.controller.actuators().saturate(input)
    }

    /// x_ref of the last sample, where a governor made it.
    pub fn governed_reference(&self) -> Option<&[f64]> {
        self.governor.as_ref().map(|governor| governor.reference.as_slice())
    }

    /// Of a supervised controller, at the last sample: the active member (0 is the outermost) and V/γ in its set.
    pub fn set_share(&self) -> Option<(usize, f64)> {
        (!self.sets.is_empty()).then_some((self.active.member, self.active.share))
    }
}
