//! Do the parts of a design fit together and with its plant? A design may come from a file that was edited, or from another
//! tool.

use super::{Design, FrozenDesign, Method, RateBounded};
use crate::controller::Schedule;
use crate::math::Mat;
use crate::math::decimal::about;
use crate::math::definite::{Definiteness, asymmetry, definiteness, smallest_eigenvalue_about};
use crate::math::matrix::is_finite;
use crate::model::{BasisFunction, BoxWeights, MatrixFunction, parameter_grid};
use crate::plant::{Plant, PlantParameterError, Scheduling};

/// Relative difference up to which numbers of a file count as equal: what printing and reading elsewhere may leave.
pub(super) const SAME: f64 = 1e-9;

/// A design whose parts do not fit together.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum DesignError {
    /// The plant cannot be built.
    #[error("plant: {0}")]
    Plant(#[from] PlantParameterError),
    /// A part that is not what the plant or the method needs.
    #[error("{key} {found}; it has to be {expected}")]
    Part {
        /// Which part, dotted.
        key: String,
        /// What it is.
        found: String,
        /// What it has to be.
        expected: String,
    },
}

pub(super) fn refuse(
    key: impl Into<String>,
    found: impl Into<String>,
    expected: impl Into<String>,
) -> Result<(), DesignError> {
    Err(DesignError::Part { key: key.into(), found: found.into(), expected: expected.into() })
}

impl Design {
    /// Check that sizes, signs and parameters fit together and with the plant.
    ///
    /// # Errors
    /// The first thing that does not fit.
    pub fn validate(&self) -> Result<(), DesignError> {
        let plant = self.plant.build()?;
        let fingerprint = self.plant.fingerprint();
        if let Some(hash) = self.model_hash.as_ref().filter(|&hash| *hash != fingerprint) {
            let found = format!("is {hash:?}, and the plant of the file has {fingerprint:?}");
            return refuse("model_hash", found, "the same: the design was made for another plant");
        }
        let description = plant.description();
        let (n, m) = (description.states.len(), description.inputs.len());
        let scheduling = description.scheduling.as_ref();
        if !(self.sample_time_s > 0.0 && self.sample_time_s.is_finite()) {
            return refuse("sample_time_s", format!("is {}", self.sample_time_s), "positive and finite");
        }
        definite("weights.q", &self.weights.q, n, true)?;
        definite("weights.r", &self.weights.r, m, false)?;
        if let Some(gamma) = self.method.gamma().filter(|gamma| !(*gamma > 0.0 && gamma.is_finite())) {
            return refuse("method.gamma", format!("is {gamma}"), "positive and finite");
        }

        let count = self.points.len();
        if count == 0 || (scheduling.is_some() && count < 4) {
            return refuse("points", format!("has {count} entries"), "at least 4, or 1 for a plant without parameter");
        }
        let grid: Vec<f64> = self.points.iter().map(|point| point.rho).collect();
        same_grid("points[].rho", &grid, scheduling)?;
        let is_high_gain = matches!(self.method, Method::HighGainSlpvqr { .. });
        for (k, point) in self.points.iter().enumerate() {
            shape(&format!("points[{k}].gain"), &point.gain, m, n)?;
            definite(&format!("points[{k}].p"), &point.p, n, false)?;
            match &point.auxiliary_gain {
                Some(gain) if is_high_gain => shape(&format!("points[{k}].auxiliary_gain"), gain, m, n)?,
                None if !is_high_gain => {}
                _ => {
                    return refuse(
                        format!("points[{k}].auxiliary_gain"),
                        "does not fit the method",
                        "there for high gain only",
                    );
                }
            }
        }
        if let Some(bounded) = &self.rate_bounded {
            self.validate_rate_bounded(bounded, scheduling, m, n)?;
        }
        self.validate_controller(&*plant, m, n)?;
        self.validate_supervisor(&*plant)
    }

    fn validate_rate_bounded(
        &self,
        bounded: &RateBounded,
        scheduling: Option<&Scheduling>,
        m: usize,
        n: usize,
    ) -> Result<(), DesignError> {
        if scheduling.is_none() {
            return refuse("rate_bounded", "is there", "absent for a plant without parameter");
        }
        if !(bounded.rate >= 0.0 && bounded.rate.is_finite()) {
            return refuse("rate_bounded.rate", format!("is {}", bounded.rate), "finite, zero or more");
        }
        function("rate_bounded.y", &bounded.y, n, n)?;
        for (k, coefficient) in bounded.y.coefficients.iter().enumerate() {
            symmetric(&format!("rate_bounded.y.coefficients[{k}]"), coefficient, n)?;
        }
        if let Some(l) = &bounded.l {
            function("rate_bounded.l", l, m, n)?;
        }
        if bounded.l.is_some() != self.method.gamma().is_some() {
            return refuse("rate_bounded.l", "does not fit the method", "there for the saturated methods only");
        }
        // the Lyapunov function of the design and the matrices of its points are the same
        for (k, point) in self.points.iter().enumerate() {
            let same = bounded.p(point.rho).is_some_and(|p| (&p - &point.p).norm_max() <= 1e-6 * point.p.norm_max());
            if !same {
                return refuse(format!("points[{k}].p"), "differs from rate_bounded", "the inverse of its Y there");
            }
        }
        Ok(())
    }

    fn validate_controller(&self, plant: &dyn Plant, m: usize, n: usize) -> Result<(), DesignError> {
        let controller = &self.controller;
        let scheduling = plant.description().scheduling.as_ref();
        let operating = plant.trim(self.points[0].rho).input;
        if controller.operating_input != operating {
            return refuse(
                "controller.operating_input",
                "is not where the plant rests",
                format!("{operating:?}, to the last digit"),
            );
        }
        let state = scheduling.map(|scheduling| scheduling.state);
        if controller.scheduling_state != state {
            let expected = state.map_or("null".to_owned(), |state| state.to_string());
            return refuse("controller.scheduling_state", "is not the plant's", expected);
        }
        let limits = &controller.limits;
        if limits.min.len() != m || limits.max.len() != m {
            return refuse("controller.limits", "has the wrong length", format!("{m} numbers or nulls each"));
        }
        let encloses = |i: usize| {
            limits.min[i].is_none_or(|min| min <= operating[i]) && limits.max[i].is_none_or(|max| max >= operating[i])
        };
        if !(0..m).all(encloses) {
            return refuse("controller.limits", "exclude the operating input", "on either side of it");
        }
        let gains = match (&controller.schedule, scheduling) {
            (Schedule::Constant { gain }, None) => vec![gain],
            (Schedule::Grid { parameters, period, gains }, Some(scheduling)) => {
                same_grid("controller.schedule.parameters", parameters, Some(scheduling))?;
                let expected = scheduling.periodic.then(|| scheduling.range[1] - scheduling.range[0]);
                if *period != expected || gains.len() != parameters.len() {
                    return refuse(
                        "controller.schedule",
                        "does not fit the grid",
                        "a gain for each parameter, with the plant's period",
                    );
                }
                gains.iter().collect()
            }
            (Schedule::Vertices { weights, gains }, Some(scheduling)) => {
                if *weights != BoxWeights::new(&scheduling.features) || gains.len() != weights.corners.len() {
                    return refuse(
                        "controller.schedule.weights",
                        "are not the plant's",
                        "a gain for each corner of its features",
                    );
                }
                gains.iter().collect()
            }
            _ => {
                return refuse(
                    "controller.schedule",
                    "does not fit the plant",
                    "constant exactly if it has no parameter",
                );
            }
        };
        let key = |k: usize| match &controller.schedule {
            Schedule::Constant { .. } => "controller.schedule.gain".to_owned(),
            _ => format!("controller.schedule.gains[{k}]"),
        };
        gains.iter().enumerate().try_for_each(|(k, gain)| shape(&key(k), gain, m, n))?;

        // the schedule flies, the points say where it came from: they may differ by what the design says, no more
        let scale = self.points.iter().map(|point| point.gain.norm_max()).fold(0.0, f64::max);
        let difference = |point: &FrozenDesign| (controller.schedule.gain_matrix(point.rho) - &point.gain).norm_max();
        let found = self.points.iter().map(difference).fold(0.0, f64::max);
        if found > self.schedule_error * (1.0 + SAME) + SAME * scale {
            let found = format!("differs from points[].gain by {found:.3e}");
            return refuse(
                "controller.schedule",
                found,
                format!("within schedule_error = {:.3e}", self.schedule_error),
            );
        }
        Ok(())
    }
}

pub(super) fn shape(key: &str, matrix: &Mat<f64>, rows: usize, columns: usize) -> Result<(), DesignError> {
    if (matrix.nrows(), matrix.ncols()) != (rows, columns) {
        return refuse(key, format!("is {} × {}", matrix.nrows(), matrix.ncols()), format!("{rows} × {columns}"));
    }
    if is_finite(matrix) { Ok(()) } else { refuse(key, "has an entry that is not finite", "finite") }
}

pub(super) fn function(key: &str, function: &MatrixFunction, rows: usize, columns: usize) -> Result<(), DesignError> {
    let (basis, coefficients) = (function.basis.len(), function.coefficients.len());
    if basis == 0 || basis != coefficients {
        let found = format!("has {basis} basis functions and {coefficients} coefficients");
        return refuse(key, found, "one coefficient for each of at least one function");
    }
    if let Some(parameter) = function.basis.iter().filter_map(BasisFunction::parameter).find(|&parameter| parameter > 0)
    {
        return refuse(format!("{key}.basis"), format!("has parameter {parameter}"), "of parameter 0");
    }
    let each = |(i, matrix)| shape(&format!("{key}.coefficients[{i}]"), matrix, rows, columns);
    function.coefficients.iter().enumerate().try_for_each(each)
}

/// A proof reads the numbers of the file: they have to be symmetric to the bit.
pub(super) fn symmetric(key: &str, matrix: &Mat<f64>, size: usize) -> Result<(), DesignError> {
    shape(key, matrix, size, size)?;
    let Some((i, j)) = asymmetry(matrix) else { return Ok(()) };
    refuse(
        key,
        format!(
            "has {} in row {}, column {}, and {} in row {}, column {}",
            matrix[(i, j)],
            i + 1,
            j + 1,
            matrix[(j, i)],
            j + 1,
            i + 1
        ),
        "symmetric, the two the same number to the last digit",
    )
}

/// Symmetric and ≻ 0, or ⪰ 0 where that is enough.
fn definite(key: &str, matrix: &Mat<f64>, size: usize, or_singular: bool) -> Result<(), DesignError> {
    symmetric(key, matrix, size)?;
    let found = |what: &str| {
        format!("is {what}: its smallest eigenvalue is about {}", about(smallest_eigenvalue_about(matrix)))
    };
    match definiteness(matrix) {
        Some(Definiteness::Positive) => Ok(()),
        Some(Definiteness::Semidefinite) if or_singular => Ok(()),
        Some(Definiteness::Semidefinite) => refuse(key, found("singular"), "positive definite"),
        Some(Definiteness::Indefinite) if or_singular => refuse(key, found("indefinite"), "positive semidefinite"),
        Some(Definiteness::Indefinite) => refuse(key, found("indefinite"), "positive definite"),
        None => refuse(key, "has entries of too different sizes to tell its definiteness", "positive definite"),
    }
}

/// The grid has to be the plant's of as many points, which a design covers its whole range with.
fn same_grid(key: &str, found: &[f64], scheduling: Option<&Scheduling>) -> Result<(), DesignError> {
    let expected = parameter_grid(scheduling, found.len());
    if expected.len() != found.len() {
        return refuse(
            key,
            format!("has {} values", found.len()),
            format!("as many as the plant's grid, {}", expected.len()),
        );
    }
    match expected.iter().zip(found).position(|(a, b)| a != b) {
        Some(at) => refuse(
            key,
            format!("is not the plant's grid: number {} is {}", at + 1, found[at]),
            format!("equidistant over the range of its parameter, here {}", expected[at]),
        ),
        None => Ok(()),
    }
}
