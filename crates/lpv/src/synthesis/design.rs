//! The design: what synthesis gives back, and the map over the parameter grid that makes it.

use super::{HighGainOptions, SynthesisError, high_gain, lpvqr, slpvqr};
use crate::controller::{Controller, InputLimits, Schedule};
use crate::math::Mat;
use crate::math::matrix::{rows, rows_option};
use crate::model::{BoxWeights, FrozenModel, GridModel};
use crate::plant::{Plant, PlantSpec};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Weights of the cost J = ∫ (x − x_ref)ᵀQ(x − x_ref) + (u − u*)ᵀR(u − u*) dt (2.30).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CostWeights {
    /// Q = Qᵀ ≻ 0, n × n. Definite, because the inequalities hold Q⁻¹.
    #[serde(with = "rows")]
    pub q: Mat<f64>,
    /// R = Rᵀ ≻ 0, m × m.
    #[serde(with = "rows")]
    pub r: Mat<f64>,
}

/// A synthesis method with its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "kebab-case")]
pub enum Method {
    /// Theorem 4.5: no regard to saturation.
    Lpvqr,
    /// Theorem 5.3: unsaturated on the certified set.
    Slpvqr {
        /// Level γ of the certified set xᵀPx ≤ γ.
        gamma: f64,
    },
    /// Theorem 5.4: may saturate on the certified set.
    HighGainSlpvqr {
        /// Level γ of the certified set xᵀPx ≤ γ.
        gamma: f64,
        /// How the gain is chosen.
        high_gain: HighGainOptions,
    },
}

impl Method {
    /// The level γ of the certified set; `None` for a method that knows no saturation.
    pub fn gamma(&self) -> Option<f64> {
        match *self {
            Method::Lpvqr => None,
            Method::Slpvqr { gamma } | Method::HighGainSlpvqr { gamma, .. } => Some(gamma),
        }
    }
}

/// How gains are carried from the grid to every parameter value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScheduleKind {
    /// Piecewise cubic interpolation over the grid.
    #[default]
    Grid,
    /// Gains at the vertices of the features' box, fitted to the grid (6.3)-(6.7).
    Vertices,
}

/// The design at one grid point.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrozenDesign {
    /// Parameter value.
    pub rho: f64,
    /// K, m × n, for u = u* − sat(K(x − x_ref)).
    #[serde(with = "rows")]
    pub gain: Mat<f64>,
    /// F, m × n: the auxiliary gain that stays unsaturated on the certified set; only of high-gain designs.
    #[serde(with = "rows_option", default)]
    pub auxiliary_gain: Option<Mat<f64>>,
    /// P = Y⁻¹ ≻ 0, n × n: the bound is xᵀPx, the certified set xᵀPx ≤ γ.
    #[serde(with = "rows")]
    pub p: Mat<f64>,
    /// tr Y, the objective.
    pub trace_y: f64,
    /// Relative difference between tr Y of the inequality and of the Riccati equation; only where both are solved.
    #[serde(default)]
    pub riccati_difference: Option<f64>,
    /// Interior-point iterations.
    pub iterations: usize,
}

/// A finished design: plain data that certification and simulation start from.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Design {
    /// Name, unique within a scenario; `design-<name>.json`.
    pub name: String,
    /// The sign convention, for readers of the file.
    pub convention: String,
    /// The plant that it was made for.
    pub plant: PlantSpec,
    /// How it was made.
    pub method: Method,
    /// Cost weights.
    pub weights: CostWeights,
    /// Time between two samples of the controller.
    pub sample_time_s: f64,
    /// The controller that flies.
    pub controller: Controller,
    /// Largest difference of an entry between the scheduled gain and the design at a grid point.
    pub schedule_error: f64,
    /// The frozen designs, in ascending order of the parameter.
    pub points: Vec<FrozenDesign>,
}

/// What a design is asked for.
#[derive(Clone, Debug)]
pub struct DesignRequest {
    /// Name of the design.
    pub name: String,
    /// Method and its parameters.
    pub method: Method,
    /// Cost weights; Q and R are symmetric positive definite, of the plant's sizes.
    pub weights: CostWeights,
    /// Number of grid points (ignored for a plant without scheduling parameter).
    pub grid_points: usize,
    /// How gains are carried to every parameter value.
    pub schedule: ScheduleKind,
    /// Actuator limits.
    pub limits: InputLimits,
    /// Time between two samples of the controller.
    pub sample_time_s: f64,
}

/// Design over the whole grid, in parallel. `progress` is called with the number of finished points; it may be called
/// from any thread.
///
/// # Errors
/// The first failure in grid order.
pub fn design(
    spec: &PlantSpec,
    plant: &dyn Plant,
    request: &DesignRequest,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Design, SynthesisError> {
    let model = GridModel::of_plant(plant, request.grid_points);
    let operating_input = plant.trim(model.points[0].rho).input;
    let sigma = || symmetric_bound(&request.limits, &operating_input);
    let weights = &request.weights;
    let done = AtomicUsize::new(0);
    let count = |_: &_| progress(done.fetch_add(1, Ordering::Relaxed) + 1);

    let points = match request.method {
        Method::Lpvqr => map_grid(&model, |point| lpvqr::frozen(point, weights).inspect(count))?,
        Method::Slpvqr { gamma } => {
            let sigma = sigma()?;
            map_grid(&model, |point| {
                slpvqr::frozen(point, weights, &sigma, gamma).inspect(count)
            })?
        }
        Method::HighGainSlpvqr {
            gamma,
            high_gain: options,
        } => {
            let sigma = sigma()?;
            let segments = map_grid(&model, |point| {
                let segment = high_gain::segment(point, weights, &sigma, gamma)?;
                let s = segment.choose(point, weights, request.sample_time_s, &options)?;
                progress(done.fetch_add(1, Ordering::Relaxed) + 1);
                Ok((segment, s))
            })?;
            let least = segments
                .iter()
                .map(|&(_, s)| s)
                .fold(f64::INFINITY, f64::min);
            (segments.into_iter().zip(&model.points))
                .map(|((segment, _), point)| segment.into_design(point, weights, least))
                .collect()
        }
    };

    let schedule = schedule(&model, &points, request.schedule);
    let schedule_error = (points.iter())
        .map(|point| (schedule.gain_matrix(point.rho) - &point.gain).norm_max())
        .fold(0.0, f64::max);
    Ok(Design {
        name: request.name.clone(),
        convention: "u = u* - sat(K(rho) (x - x_ref))".into(),
        plant: spec.clone(),
        method: request.method,
        weights: weights.clone(),
        sample_time_s: request.sample_time_s,
        controller: Controller {
            schedule,
            scheduling_state: model.scheduling.as_ref().map(|scheduling| scheduling.state),
            operating_input,
            limits: request.limits.clone(),
        },
        schedule_error,
        points,
    })
}

/// σ of every input, or which input has none.
fn symmetric_bound(
    limits: &InputLimits,
    operating_input: &[f64],
) -> Result<Vec<f64>, SynthesisError> {
    let unlimited = || SynthesisError::UnlimitedInput {
        input: (0..operating_input.len())
            .find(|&i| limits.min[i].is_none() && limits.max[i].is_none())
            .unwrap_or(0),
    };
    let sigma = limits
        .symmetric_bound(operating_input)
        .ok_or_else(unlimited)?;
    match sigma.iter().position(|&bound| bound <= 0.0) {
        Some(input) => Err(SynthesisError::UnlimitedInput { input }),
        None => Ok(sigma),
    }
}

fn map_grid<T: Send>(
    model: &GridModel,
    solve: impl Fn(&FrozenModel) -> Result<T, SynthesisError> + Sync + Send,
) -> Result<Vec<T>, SynthesisError> {
    // collected in full first: rayon's early exit would report whichever point failed first in time
    let results: Vec<_> = model.points.par_iter().map(solve).collect();
    results.into_iter().collect()
}

fn schedule(model: &GridModel, points: &[FrozenDesign], kind: ScheduleKind) -> Schedule {
    let Some(scheduling) = model.scheduling.as_ref().filter(|_| points.len() > 1) else {
        return Schedule::Constant {
            gain: points[0].gain.clone(),
        };
    };
    let parameters: Vec<f64> = points.iter().map(|point| point.rho).collect();
    match kind {
        ScheduleKind::Grid => Schedule::Grid {
            parameters,
            period: scheduling
                .periodic
                .then(|| scheduling.range[1] - scheduling.range[0]),
            gains: points.iter().map(|point| point.gain.clone()).collect(),
        },
        ScheduleKind::Vertices => {
            let weights = BoxWeights::new(&scheduling.features);
            let (gains, _) = weights.fit(
                &parameters,
                &points.iter().map(|point| &point.gain).collect::<Vec<_>>(),
            );
            Schedule::Vertices { weights, gains }
        }
    }
}

/// A design file whose parts do not fit together.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum DesignError {
    /// The plant cannot be built.
    #[error("plant: {0}")]
    Plant(#[from] crate::plant::PlantParameterError),
    /// There are no grid points.
    #[error("points: there has to be at least one")]
    NoPoints,
    /// A matrix of the wrong size.
    #[error(
        "{matrix} is {rows} × {columns}; for this plant it has to be {expected_rows} × {expected_columns}"
    )]
    Shape {
        /// Which matrix.
        matrix: String,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// Rows it has to have.
        expected_rows: usize,
        /// Columns it has to have.
        expected_columns: usize,
    },
    /// A list of the wrong length.
    #[error("{list} has {length} entries; for this plant it has to have {expected}")]
    Length {
        /// Which list.
        list: &'static str,
        /// Its length.
        length: usize,
        /// The length it has to have.
        expected: usize,
    },
    /// Grid points that are not ascending and equidistant.
    #[error("points: the parameters of the grid have to be ascending and equidistant")]
    Grid,
    /// A sample time that is not positive.
    #[error("sample_time_s is {0}: it has to be positive")]
    SampleTime(f64),
}

impl Design {
    /// Check that sizes fit together and with the plant: a design may come from a file that was edited.
    ///
    /// # Errors
    /// The first thing that does not fit.
    pub fn validate(&self) -> Result<(), DesignError> {
        let plant = self.plant.build()?;
        let description = plant.description();
        let (n, m) = (description.states.len(), description.inputs.len());
        let shape = |matrix: &str, found: &Mat<f64>, rows: usize, columns: usize| {
            if (found.nrows(), found.ncols()) == (rows, columns) {
                return Ok(());
            }
            Err(DesignError::Shape {
                matrix: matrix.into(),
                rows: found.nrows(),
                columns: found.ncols(),
                expected_rows: rows,
                expected_columns: columns,
            })
        };
        shape("weights.q", &self.weights.q, n, n)?;
        shape("weights.r", &self.weights.r, m, m)?;
        if self.points.is_empty() {
            return Err(DesignError::NoPoints);
        }
        for (k, point) in self.points.iter().enumerate() {
            shape(&format!("points[{k}].gain"), &point.gain, m, n)?;
            shape(&format!("points[{k}].p"), &point.p, n, n)?;
            if let Some(auxiliary) = &point.auxiliary_gain {
                shape(&format!("points[{k}].auxiliary_gain"), auxiliary, m, n)?;
            }
        }
        let parameters: Vec<f64> = self.points.iter().map(|point| point.rho).collect();
        let mut gain_count = 1;
        match &self.controller.schedule {
            Schedule::Constant { gain } => shape("controller.schedule.gain", gain, m, n)?,
            Schedule::Grid {
                parameters: grid,
                gains,
                ..
            } => {
                gain_count = grid.len();
                equidistant(grid)?;
                for (k, gain) in gains.iter().enumerate() {
                    shape(&format!("controller.schedule.gains[{k}]"), gain, m, n)?;
                }
                length("controller.schedule.gains", gains.len(), gain_count)?;
            }
            Schedule::Vertices { weights, gains } => {
                gain_count = weights.corners.len();
                for (k, gain) in gains.iter().enumerate() {
                    shape(&format!("controller.schedule.gains[{k}]"), gain, m, n)?;
                }
                length("controller.schedule.gains", gains.len(), gain_count)?;
            }
        }
        if gain_count == 0 {
            return Err(DesignError::NoPoints);
        }
        equidistant(&parameters)?;
        length(
            "controller.operating_input",
            self.controller.operating_input.len(),
            m,
        )?;
        length("controller.limits.min", self.controller.limits.min.len(), m)?;
        length("controller.limits.max", self.controller.limits.max.len(), m)?;
        if let Some(state) = self.controller.scheduling_state.filter(|&state| state >= n) {
            return Err(DesignError::Length {
                list: "controller.scheduling_state",
                length: state,
                expected: n,
            });
        }
        if !(self.sample_time_s > 0.0 && self.sample_time_s.is_finite()) {
            return Err(DesignError::SampleTime(self.sample_time_s));
        }
        Ok(())
    }
}

fn length(list: &'static str, length: usize, expected: usize) -> Result<(), DesignError> {
    if length == expected {
        Ok(())
    } else {
        Err(DesignError::Length {
            list,
            length,
            expected,
        })
    }
}

fn equidistant(parameters: &[f64]) -> Result<(), DesignError> {
    let steps: Vec<f64> = parameters
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .collect();
    let even = steps
        .iter()
        .all(|step| *step > 0.0 && (step - steps[0]).abs() <= 1e-9 * steps[0]);
    if even { Ok(()) } else { Err(DesignError::Grid) }
}
