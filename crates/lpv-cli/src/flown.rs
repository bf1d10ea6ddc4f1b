//! A flown controller: its flight, what is known of its steps, and what the bounds of its steps say of the whole.

use crate::stay::StepStay;
use lpv::certificate::{BoundOf, Claim, Proofs, StepBound, SupervisedProofs, Verdict};
use lpv::sim::{Flight, Performance, Trajectory};
use lpv::synthesis::Design;

/// More than rounding adds to a cost that is summed up over millions of samples, relative to it.
pub const ROUNDING: f64 = 1e-9;

/// A flown controller.
pub struct Flown {
    /// The flight.
    pub flight: Flight,
    /// Its figures of merit.
    pub performance: Performance,
    /// What is known of each step that was reached; empty below a governor, whose steps have no bound on their cost.
    pub bounds: Vec<StepBound>,
    /// Whether the steps are all of the flight: it rests before the first, and between two of them the reference does not change.
    pub steps_are_all: bool,
    /// A proved bound of the plant that the flight exceeds, in words.
    pub contradiction: Option<String>,
    /// Whether each step stayed in the certified sets; empty of a controller that does not watch them.
    pub stays: Vec<StepStay>,
    /// What the bounds of a linear plant rest on, and a claim for each of bounds and stays.
    pub claims: Vec<Claim>,
    /// Seconds that it took.
    pub seconds: f64,
}

/// The cost of step `k` of a flight, up to the next one or the end: less than its cost to infinity.
pub fn cost_of_step(trajectory: &Trajectory, performance: &Performance, k: usize) -> Option<f64> {
    let at = |time_s: f64| {
        let after = trajectory.time_s.partition_point(|&t| t < time_s - 1e-9);
        trajectory.cost.get(after.min(trajectory.cost.len().checked_sub(1)?)).copied()
    };
    let end = performance.steps.get(k + 1).map_or(f64::INFINITY, |next| next.time_s);
    Some(at(end)? - at(performance.steps.get(k)?.time_s)?)
}

impl Flown {
    /// Whether step `k` costs more than its bound, whose conditions are all met.
    pub fn exceeds(&self, k: usize) -> bool {
        let met = self.bounds.get(k).filter(|bound| bound.unmet.is_empty());
        let cost = cost_of_step(&self.flight.trajectory, &self.performance, k);
        met.zip(cost).is_some_and(|(bound, cost)| cost > bound.bound * (1.0 + ROUNDING))
    }

    /// Sum of the steps' cost bounds, if every step starts inside its certified set, with the worst verdict on them.
    fn bound(&self) -> Option<(f64, Verdict)> {
        let is_whole = self.steps_are_all && !self.bounds.is_empty();
        let sum = || self.bounds.iter().map(|bound| bound.bound).fold(0.0, |sum: f64, bound| (sum + bound).next_up());
        let sum = match self.bounds.as_slice() {
            [one] => one.bound,
            _ => sum(),
        };
        let worst = self.bounds.iter().map(|bound| bound.verdict).min()?;
        (is_whole && self.bounds.iter().all(StepBound::is_inside)).then_some((sum, worst))
    }

    /// The bound that is proved of the plant as it flies, sampled and saturated.
    pub fn guaranteed_cost(&self) -> Option<f64> {
        self.bound().filter(|_| self.bounds.iter().all(StepBound::is_guaranteed)).map(|(bound, _)| bound)
    }

    /// The bound of the nonlinear plant with a controller in continuous time, where that is proved of every step.
    pub fn plant_cost_bound(&self) -> Option<f64> {
        let is_of_plant =
            |bound: &StepBound| bound.verdict == Verdict::Proved && bound.of == BoundOf::PlantInContinuousTime;
        self.bound().filter(|_| self.bounds.iter().all(is_of_plant)).map(|(bound, _)| bound)
    }

    /// The bound of the LPV model with a controller in continuous time, where none is proved of the plant.
    pub fn model_cost_bound(&self) -> Option<f64> {
        let of_plant = self.guaranteed_cost().or(self.plant_cost_bound());
        self.bound().filter(|_| of_plant.is_none()).map(|(bound, _)| bound)
    }

    /// What the one that there is is worth.
    pub fn bound_verdict(&self) -> Verdict {
        self.bound().map_or(Verdict::Undecided, |(_, verdict)| verdict)
    }

    /// Which system the bounds are of: the one that says least, where they are of several.
    pub fn bounds_are_of(&self) -> BoundOf {
        self.bounds.iter().map(|bound| bound.of).min().unwrap_or(BoundOf::Model)
    }
}

/// A design to fly, with what is proved of it.
pub struct Certified<'a> {
    /// The design.
    pub design: &'a Design,
    /// Of each member of a supervised one.
    pub supervised: Option<&'a SupervisedProofs>,
    /// Of the design itself.
    pub proofs: Option<&'a Proofs>,
}
