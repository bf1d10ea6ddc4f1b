//! Does the supervisor that flies belong to the designs that are proved? A proof is about the designs of the file; what the
//! controller watches and switches to has to be the same.

use super::supervision::governed_states;
use super::validation::{DesignError, SAME, function, refuse};
use super::{CostWeights, Design};
use crate::controller::{CertifiedSet, Governor, Motion, Schedule, Supervisor};
use crate::math::Mat;
use crate::math::matrix::to_row_vec;
use crate::model::{GridModel, MatrixFunction};
use crate::plant::Plant;

/// Values of the parameter at which the governor's rate is compared with the plant's.
const FLOW_POINTS: usize = 64;

impl Design {
    /// Check the inner designs, and the controller's supervisor against them.
    pub(super) fn validate_supervisor(&self, plant: &dyn Plant) -> Result<(), DesignError> {
        for (k, inner) in self.inner.iter().enumerate() {
            let key = |part: &str| format!("inner[{k}].{part}");
            inner.validate().map_err(|error| match error {
                DesignError::Part { key: part, found, expected } => {
                    DesignError::Part { key: key(&part), found, expected }
                }
                other => other,
            })?;
            let rate = |design: &Design| design.rate_bounded.as_ref().map(|bounded| bounded.rate);
            let same = [
                ("plant", inner.plant == self.plant),
                ("weights", same_weights(&inner.weights, &self.weights)),
                ("sample_time_s", inner.sample_time_s == self.sample_time_s),
                ("controller.limits", inner.controller.limits == self.controller.limits),
                ("rate_bounded.rate", rate(inner) == rate(self)),
            ];
            if let Some((part, _)) = same.into_iter().find(|(_, same)| !same) {
                return refuse(key(part), "differs from the outer design's", "the same");
            }
            if !inner.inner.is_empty() || inner.controller.supervisor.is_some() {
                return refuse(key("inner"), "has members of its own", "without");
            }
        }
        match &self.controller.supervisor {
            None if self.inner.is_empty() => Ok(()),
            None => refuse("controller.supervisor", "is missing", "there for a design with inner designs"),
            Some(supervisor) => self.validate_members(supervisor, plant),
        }
    }

    fn validate_members(&self, supervisor: &Supervisor, plant: &dyn Plant) -> Result<(), DesignError> {
        if supervisor.inner.len() != self.inner.len() {
            let found = format!("has {} members", supervisor.inner.len());
            return refuse(
                "controller.supervisor.inner",
                found,
                format!("{}, one for each inner design", self.inner.len()),
            );
        }
        let sets = std::iter::once(&supervisor.set).chain(supervisor.inner.iter().map(|member| &member.set));
        for (k, (set, design)) in sets.zip(std::iter::once(self).chain(&self.inner)).enumerate() {
            let key = match k {
                0 => "controller.supervisor.set".to_owned(),
                _ => format!("controller.supervisor.inner[{}].set", k - 1),
            };
            let n = design.weights.q.nrows();
            function(&format!("{key}.y"), &set.y, n, n)?;
            match design.certified_set() {
                Ok(expected) if same_set(set, &expected, design.rate_bounded.is_some()) => {}
                Ok(_) => return refuse(key, "is not the set that the design is certified on", "its Y and γ"),
                Err(error) => return refuse(key, "is there", format!("absent: {error}")),
            }
        }
        for (k, (member, design)) in supervisor.inner.iter().zip(&self.inner).enumerate() {
            if !same_schedule(&member.schedule, &design.controller.schedule) {
                let key = format!("controller.supervisor.inner[{k}].schedule");
                return refuse(key, "differs from the inner design's", "the same gains");
            }
        }
        supervisor.governor.as_ref().map_or(Ok(()), |governor| self.validate_governor(governor, plant))
    }

    fn validate_governor(&self, governor: &Governor, plant: &dyn Plant) -> Result<(), DesignError> {
        let key = |part: &str| format!("controller.supervisor.governor.{part}");
        let rate = self.rate_bounded.as_ref().map_or(0.0, |bounded| bounded.rate);
        let expected = governed_states(plant, rate);
        if governor.set_point_states != expected || expected.is_empty() {
            return refuse(key("set_point_states"), "are not where the plant can rest", format!("{expected:?}"));
        }
        let rest = plant.trim(0.0).state;
        let same = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME * (1.0 + b.abs());
        if governor.operating_state.len() != rest.len() || !governor.operating_state.iter().zip(&rest).all(same) {
            return refuse(key("operating_state"), "is not where the plant rests", format!("{rest:?}"));
        }
        if !(governor.level_share > 0.0 && governor.level_share < 1.0) {
            return refuse(key("level_share"), format!("is {}", governor.level_share), "above 0 and below 1");
        }
        let moves_parameter = self.controller.scheduling_state.is_some_and(|state| expected.contains(&state));
        match governor.parameter_rate {
            Some(found) if moves_parameter && found > 0.0 && found <= rate => {}
            None if !moves_parameter => {}
            found => {
                let expected = format!("positive and at most {rate} if the scheduling state is moved, else null");
                return refuse(key("parameter_rate"), format!("is {found:?}"), expected);
            }
        }
        governor.motion.as_ref().map_or(Ok(()), |motion| self.validate_motion(governor, motion, plant, rate))
    }

    fn validate_motion(
        &self,
        governor: &Governor,
        motion: &Motion,
        plant: &dyn Plant,
        rate: f64,
    ) -> Result<(), DesignError> {
        let key = |part: &str| format!("controller.supervisor.governor.motion.{part}");
        let (n, m, d) = (self.weights.q.nrows(), self.weights.r.nrows(), governor.set_point_states.len());
        let order = motion.inputs.len();
        let sizes = (1..=crate::controller::MOST_ORDER).contains(&order)
            && motion.states.len() + 1 == order
            && (motion.inputs_by_rate.is_empty() || motion.inputs_by_rate.len() == motion.states.len())
            && motion.input_budget.len() == m
            && motion.state_bounds.len() == n
            && motion.actuators.min.len() == m
            && motion.actuators.max.len() == m;
        if !sizes {
            return refuse(key("states"), "and the other parts do not fit in number", "K − 1 states, K ≤ 4 inputs");
        }
        let each = |name: &str, functions: &[MatrixFunction], rows: usize, columns: usize| {
            functions
                .iter()
                .enumerate()
                .try_for_each(|(k, f)| function(&key(&format!("{name}[{k}]")), f, rows, columns))
        };
        each("states", &motion.states, n, d)?;
        each("inputs", &motion.inputs, m, d)?;
        each("inputs_by_rate", &motion.inputs_by_rate, m, d)?;
        each("parameter_flow", motion.parameter_flow.as_slice(), 1, n)?;
        if motion.parameter_flow.is_some() != self.controller.scheduling_state.is_some() {
            return refuse(key("parameter_flow"), "does not fit the plant", "there exactly if it has a parameter");
        }
        self.validate_flow(motion, plant)?;
        if !(motion.parameter_rate >= 0.0 && motion.parameter_rate <= rate) {
            let found = format!("is {}", motion.parameter_rate);
            return refuse(key("parameter_rate"), found, format!("from 0 to the certified rate {rate}"));
        }
        if motion.state_bounds.iter().flatten().any(|&bound| bound.is_nan() || bound <= 0.0) {
            return refuse(key("state_bounds"), "has an entry that is not positive", "positive or null");
        }
        match governor.authority_is_divided(&self.controller.limits, &self.controller.operating_input) {
            true => Ok(()),
            false => refuse(
                key("input_budget"),
                "and the feedback's limits together exceed the actuators",
                "what controller.limits leaves of motion.actuators, at most",
            ),
        }
    }
}

impl Design {
    /// The row that the governor takes for ρ̇ is the plant's.
    fn validate_flow(&self, motion: &Motion, plant: &dyn Plant) -> Result<(), DesignError> {
        let (Some(flow), Some(state)) = (&motion.parameter_flow, self.controller.scheduling_state) else {
            return Ok(());
        };
        for point in GridModel::of_plant(plant, FLOW_POINTS).points {
            let n = point.a.ncols();
            let expected = Mat::from_fn(1, n, |_, j| point.a[(state, j)]);
            if (flow.at(&[point.rho]) - &expected).norm_max() > SAME * expected.norm_max().max(f64::MIN_POSITIVE) {
                let key = "controller.supervisor.governor.motion.parameter_flow";
                let found = format!("differs from the plant's at parameter {}", point.rho);
                return refuse(key, found, "the row of A for the parameter's rate");
            }
        }
        Ok(())
    }
}

fn same_matrix(a: &Mat<f64>, b: &Mat<f64>) -> bool {
    (a.nrows(), a.ncols()) == (b.nrows(), b.ncols()) && (a - b).norm_max() <= SAME * b.norm_max()
}

fn same_weights(a: &CostWeights, b: &CostWeights) -> bool {
    to_row_vec(&a.q) == to_row_vec(&b.q) && to_row_vec(&a.r) == to_row_vec(&b.r)
}

/// Exactly the same where the file holds Y twice; a Y that was computed from P may differ by rounding from one processor to
/// another.
fn same_set(a: &CertifiedSet, b: &CertifiedSet, exactly: bool) -> bool {
    let same = |a: &Mat<f64>, b: &Mat<f64>| same_matrix(a, b) && (!exactly || to_row_vec(a) == to_row_vec(b));
    let functions = a.y.coefficients.iter().zip(&b.y.coefficients);
    a.level == b.level
        && a.y.basis == b.y.basis
        && a.y.coefficients.len() == b.y.coefficients.len()
        && functions.into_iter().all(|(a, b)| same(a, b))
}

fn same_schedule(a: &Schedule, b: &Schedule) -> bool {
    let same = |a: &[Mat<f64>], b: &[Mat<f64>]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| to_row_vec(a) == to_row_vec(b) && a.nrows() == b.nrows())
    };
    match (a, b) {
        (Schedule::Constant { gain: a }, Schedule::Constant { gain: b }) => {
            same(std::slice::from_ref(a), std::slice::from_ref(b))
        }
        (
            Schedule::Grid { parameters, period, gains },
            Schedule::Grid { parameters: parameters_b, period: period_b, gains: gains_b },
        ) => parameters == parameters_b && period == period_b && same(gains, gains_b),
        (Schedule::Vertices { weights, gains }, Schedule::Vertices { weights: weights_b, gains: gains_b }) => {
            weights == weights_b && same(gains, gains_b)
        }
        _ => false,
    }
}
