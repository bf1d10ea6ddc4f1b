//! What a bound on the cost is worth for one step of a flight.
//!
//! A step starts at the state x with the reference x_ref, and costs at most κ V(x − x_ref) if it starts in the certified set, the reference rests,
//! the parameter keeps to a rate and no noise acts. κ, set and rate are those of what is proved of the design ([`BoundBasis`]): of the loop as it
//! flies where the plant is linear; of the nonlinear plant with a controller in continuous time where that is proved and the step starts in its
//! small set; else of the LPV model, in continuous time too. V is bounded from above in interval arithmetic.
//! That the parameter keeps to its rate no proof can know beforehand: the bound holds while it does.

use super::claim::{ClaimKind, Of, Verdict};
use super::proof::{Proofs, SampledCost};
use super::rest::{Unrest, rests_exactly, unrest};
use super::{LyapunovFunction, unsaturated_level};
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::matrix::quadratic_form;
use crate::plant::Plant;
use crate::synthesis::Design;
use serde::Serialize;

/// A parameter rate up to this, per second, is rest: what the solver's accuracy, a relative 1e-6 in the gains, leaves of a
/// heading that nothing turns.
const REST_RATE: f64 = 1e-5;
/// More than rounding takes from a sum of a few hundred products.
const ROUNDING: f64 = 1e-12;

/// How a step was flown, as far as the bound asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepConditions<'a> {
    /// x at its start; the parameter is the one that it holds.
    pub state: &'a [f64],
    /// x_ref
    pub reference: &'a [f64],
    /// Least and largest value of the parameter during the step; zeros without one.
    pub parameter_range: [f64; 2],
    /// Largest rate of the parameter during the step, per second.
    pub peak_parameter_rate: f64,
    /// Whether noise acted on the plant or its measurements.
    pub noise: bool,
}

/// A condition of the cost bound that a step does not meet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum UnmetCondition {
    /// It starts outside the certified set: V > level.
    Outside {
        /// Level of the set.
        level: f64,
        /// V/level, rounded up.
        share: f64,
    },
    /// The parameter moves faster than the design is for; a frozen design is for a parameter at rest.
    ParameterMoves {
        /// At up to this rate, per second.
        rate: f64,
    },
    /// The parameter leaves the range that the design is for.
    ParameterOutside {
        /// A value of it outside.
        value: f64,
    },
    /// Noise acts, of which the bound knows nothing.
    Noise,
    /// The reference is no point of rest: its state of this index moves.
    ReferenceMoves {
        /// Index of the state.
        state: usize,
        /// At this rate, per second.
        rate: f64,
    },
    /// The reference rests where the plant is another than the model.
    ReferenceElsewhere,
    /// The input that holds the reference lies outside the limits of this input.
    InputOutside {
        /// Index of the input.
        input: usize,
    },
}

/// Which system a bound is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BoundOf {
    /// The LPV model with a controller in continuous time.
    Model,
    /// The nonlinear plant with a saturating controller in continuous time: all but the sampling.
    PlantInContinuousTime,
    /// The plant as it flies: the loop that is sampled with zero-order hold and saturated.
    Plant,
}

/// What a bound rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundBasis {
    /// κ
    pub factor: f64,
    /// Level of the set that a step has to start in; `None`: anywhere.
    pub level: Option<f64>,
    /// Largest rate of the parameter, per second, 0 at rest; `None`: whatever it is on the set.
    pub rate: Option<f64>,
    /// The system.
    pub of: BoundOf,
}

impl BoundBasis {
    /// From the proof of the sampled loop of a linear plant; `None` where that found no bound, or other gains fly too.
    pub fn of_flight(design: &Design, sampled: &SampledCost) -> Option<Self> {
        let flies = design.controller.supervisor.is_none() && design.inner.is_empty();
        let factor = sampled.factor.filter(|_| flies)?;
        Some(Self { factor, level: sampled.level, rate: Some(0.0), of: BoundOf::Plant })
    }

    /// From the proofs about the nonlinear plant; `None` where its cost bound is not proved, or other gains fly too.
    pub fn of_plant(design: &Design, proofs: &Proofs) -> Option<Self> {
        let flies = design.controller.supervisor.is_none() && design.inner.is_empty();
        proofs.claims.iter().filter(|claim| flies && claim.verdict == Verdict::Proved).find_map(|claim| {
            match (claim.of, &claim.kind) {
                (Of::Plant, &ClaimKind::Cost { factor, level: Some(level), .. }) => {
                    Some(Self { factor, level: Some(level), rate: None, of: BoundOf::PlantInContinuousTime })
                }
                _ => None,
            }
        })
    }

    /// From the proofs about the LPV model; `None` where its cost bound is not proved, or other gains fly too.
    pub fn of_model(design: &Design, proofs: &Proofs) -> Option<Self> {
        let flies = design.controller.supervisor.is_none() && design.inner.is_empty();
        let rate =
            proofs.cost_up_to.zip(proofs.stable_up_to).map(|(cost, stable)| cost.min(stable)).filter(|_| flies)?;
        Some(Self { factor: proofs.cost_factor, level: proofs.level, rate: Some(rate), of: BoundOf::Model })
    }

    /// What a design says of itself, in floating point.
    fn unproved(design: &Design, plant: &dyn Plant, p: &Mat<f64>, rho: f64) -> Self {
        let level = design.method.gamma().or_else(|| {
            let sigma = design.controller.limits.room(&design.controller.operating_input);
            sigma.iter().any(|sigma| sigma.is_finite()).then_some(())?;
            let schedule = &design.controller.schedule;
            let at_rest = unsaturated_level(p, &schedule.gain_matrix(rho), &sigma);
            // where the parameter may move the state has to stay inside at every value of it
            let moving = design.points.iter().filter(|_| design.rate_bounded.is_some());
            let level = moving.fold(at_rest, |level, point| {
                level.min(unsaturated_level(&point.p, &schedule.gain_matrix(point.rho), &sigma))
            });
            Some(level * (1.0 - ROUNDING))
        });
        let rate = match plant.description().scheduling {
            Some(_) => design.rate_bounded.as_ref().map_or(0.0, |bounded| bounded.rate),
            None => 0.0,
        };
        Self { factor: 1.0, level, rate: Some(rate), of: BoundOf::Model }
    }
}

/// The cost bound of a step, and what it is worth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepBound {
    /// κV at its start, rounded up: the bound on the cost of the step, if every condition is met.
    pub bound: f64,
    /// V at its start, rounded up.
    pub value: f64,
    /// κ
    pub factor: f64,
    /// The system that it is of.
    pub of: BoundOf,
    /// Level of the certified set; `None` where inputs are not limited and the set is everything.
    pub level: Option<f64>,
    /// V/level, rounded up.
    pub share: Option<f64>,
    /// The bound holds while the parameter keeps to this rate, per second; `None` without a parameter, or whatever its rate.
    pub while_rate: Option<f64>,
    /// The conditions that are not met.
    pub unmet: Vec<UnmetCondition>,
    /// `proved`: every condition is met, and the bound is a theorem about the system it is of. `numerical`: met, and the bound was
    /// evaluated in floating point.
    pub verdict: Verdict,
}

impl StepBound {
    /// Whether the step starts inside the certified set, to a reference at rest: without that there is no bound.
    pub fn is_inside(&self) -> bool {
        let takes_it_away = |condition: &UnmetCondition| {
            use UnmetCondition::{InputOutside, Outside, ParameterOutside, ReferenceElsewhere, ReferenceMoves};
            matches!(
                condition,
                Outside { .. }
                    | ReferenceMoves { .. }
                    | ReferenceElsewhere
                    | InputOutside { .. }
                    | ParameterOutside { .. }
            )
        };
        !self.unmet.iter().any(takes_it_away)
    }

    /// Whether it is proved of the plant that flies, as it flies.
    pub fn is_guaranteed(&self) -> bool {
        self.verdict == Verdict::Proved && self.of == BoundOf::Plant
    }
}

/// The bound of a step flown with `design` on the plant that it names, on the first of `bases` in whose set it starts, else on the last. Without one
/// nothing is proved of the design: κ = 1, and the level is γ for the saturated methods; for LPVQR with limited inputs it is
/// [`unsaturated_level`], rounded down.
pub fn step_bound(design: &Design, plant: &dyn Plant, bases: &[BoundBasis], step: &StepConditions) -> StepBound {
    let description = plant.description();
    let scheduling = description.scheduling.as_ref();
    let rho = scheduling.map_or(0.0, |scheduling| step.state[scheduling.state]);
    let lyapunov = LyapunovFunction::of(design, plant);
    let proved_value = lyapunov.at_most(description, rho, step.state, step.reference);
    let value = proved_value.unwrap_or_else(|| {
        let p = lyapunov.matrix(rho);
        let mut error = vec![0.0; step.state.len()];
        description.state_error(step.state, step.reference, &mut error);
        let sizes: Vec<f64> = error.iter().map(|e| e.abs()).collect();
        quadratic_form(&p, &error) + ROUNDING * quadratic_form(&absolute(&p), &sizes)
    });
    let unproved = || BoundBasis::unproved(design, plant, &lyapunov.matrix(rho), rho);
    let holds = |basis: &&BoundBasis| basis.level.is_none_or(|level| value <= level);
    let basis = bases.iter().find(holds).or(bases.last());
    let BoundBasis { factor, level, rate, of } = basis.copied().unwrap_or_else(unproved);
    let share = level.map(|level| (Interval::from(value) / level).hi());

    let (limits, input) = (&design.controller.limits, &design.controller.operating_input);
    let is_held =
        |i: usize| limits.min[i].is_none_or(|min| min <= input[i]) && limits.max[i].is_none_or(|max| input[i] <= max);
    let outside_limits = (0..input.len()).find(|&i| !is_held(i)).map(|input| UnmetCondition::InputOutside { input });
    let reference = unrest(plant, step.reference, input).map(|unrest| match unrest {
        Unrest::Moves { state, rate } => UnmetCondition::ReferenceMoves { state, rate },
        Unrest::Elsewhere => UnmetCondition::ReferenceElsewhere,
    });
    let is_within = level.is_none_or(|level| value <= level);
    let outside = level.zip(share).filter(|_| !is_within);
    let outside = outside.map(|(level, share)| UnmetCondition::Outside { level, share });
    // a range that is not periodic ends
    let ends = scheduling.filter(|scheduling| !scheduling.periodic).map(|scheduling| scheduling.range);
    let beyond = |[low, high]: [f64; 2]| {
        let reference = scheduling.map(|scheduling| step.reference[scheduling.state]);
        let values = step.parameter_range.into_iter().chain([rho]).chain(reference);
        values.into_iter().find(|value| !(low <= *value && *value <= high))
    };
    let parameter = ends.and_then(beyond).map(|value| UnmetCondition::ParameterOutside { value });
    let peak = step.peak_parameter_rate;
    let allowed = match rate {
        None => f64::INFINITY,
        Some(0.0) => REST_RATE,
        Some(rate) => rate,
    };
    let moves = (peak.is_nan() || peak > allowed).then_some(UnmetCondition::ParameterMoves { rate: peak });
    let noise = step.noise.then_some(UnmetCondition::Noise);
    let unmet: Vec<UnmetCondition> =
        [reference, outside_limits, outside, parameter, moves, noise].into_iter().flatten().collect();

    // of a model, and of what is derived from it, the reference is a point of rest by what an operating point is; of a linear plant it has to be
    // one exactly
    let is_exact = of != BoundOf::Plant || rests_exactly(plant, step.reference, input);
    let verdict = match (unmet.is_empty(), basis.is_some() && proved_value.is_some() && is_exact) {
        (false, _) => Verdict::Undecided,
        (true, true) => Verdict::Proved,
        (true, false) => Verdict::Numerical,
    };
    StepBound {
        bound: (Interval::from(value) * factor).hi(),
        value,
        factor,
        of,
        level,
        share,
        while_rate: scheduling.and(rate),
        unmet,
        verdict,
    }
}

fn absolute(matrix: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)].abs())
}
