//! The design: what synthesis gives back, and the map over the parameter grid that makes it.

use super::back_off::{Saturation, back_off};
use super::moving;
use super::{HighGainOptions, RateBounded, RateBoundedOptions, SynthesisError, high_gain, lpvqr, slpvqr};
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
    /// P ≻ 0, n × n, (1 + [`Design::back_off`]) Y⁻¹: the bound is xᵀPx, the certified set xᵀPx ≤ γ.
    #[serde(with = "rows")]
    pub p: Mat<f64>,
    /// tr Y of the optimum, before backing off.
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
    /// [`PlantSpec::fingerprint`] of the plant when it was designed; a design from elsewhere may have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_hash: Option<String>,
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
    /// ε: every P is (1 + ε) times the optimal one, so that the inequalities hold strictly with the gain that flies.
    pub back_off: f64,
    /// The designs at the grid points, in ascending order of the parameter.
    pub points: Vec<FrozenDesign>,
    /// The Lyapunov function between the grid points and the rate it is for, of a design for a moving parameter; of a
    /// frozen design nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_bounded: Option<RateBounded>,
    /// The designs of the smaller sets of a family, from the largest to the smallest; each is a whole design, certified by
    /// itself. Their gains fly as members of the controller's supervisor.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inner: Vec<Design>,
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
    /// Design for a parameter that moves; `None` is frozen design at each grid point.
    pub rate_bounded: Option<RateBoundedOptions>,
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

    if let (Some(options), Some(_)) = (&request.rate_bounded, &model.scheduling) {
        let sigma = request.method.gamma().map(|_| sigma()).transpose()?;
        return moving::design(spec, plant, request, options, &model, sigma.as_deref(), progress);
    }
    let mut points: Vec<FrozenDesign> = match request.method {
        Method::Lpvqr => map_grid(&model, |point| lpvqr::frozen(point, weights).inspect(count))?,
        Method::Slpvqr { gamma } => {
            let sigma = sigma()?;
            map_grid(&model, |point| slpvqr::frozen(point, weights, &sigma, gamma).inspect(count))?
        }
        Method::HighGainSlpvqr { gamma, high_gain: options } => {
            let sigma = sigma()?;
            let segments = map_grid(&model, |point| {
                let segment = high_gain::segment(point, weights, &sigma, gamma)?;
                let s = segment.choose(point, weights, Some(request.sample_time_s), &options)?;
                progress(done.fetch_add(1, Ordering::Relaxed) + 1);
                Ok((segment, s))
            })?;
            let least = segments.iter().map(|&(_, s)| s).fold(f64::INFINITY, f64::min);
            (segments.into_iter().zip(&model.points))
                .map(|((segment, _), point)| segment.into_design(point, weights, least))
                .collect()
        }
    };

    let schedule = schedule(&model, &points, request.schedule);
    let bounds = request.method.gamma().map(|gamma| sigma().map(|sigma| (sigma, gamma))).transpose()?;
    let saturation = bounds.as_ref().map(|(sigma, gamma)| Saturation { sigma, gamma: *gamma });
    let back_off = back_off(&mut points, &model.points, weights, &schedule, saturation.as_ref());
    Ok(assemble(spec, request, &model, operating_input, Parts { schedule, points, back_off, rate_bounded: None }))
}

/// What is left to a design once its gains are found.
pub(super) struct Parts {
    pub schedule: Schedule,
    pub points: Vec<FrozenDesign>,
    pub back_off: f64,
    pub rate_bounded: Option<RateBounded>,
}

/// The design of `request` with these `parts`.
pub(super) fn assemble(
    spec: &PlantSpec,
    request: &DesignRequest,
    model: &GridModel,
    operating_input: Vec<f64>,
    parts: Parts,
) -> Design {
    let Parts { schedule, points, back_off, rate_bounded } = parts;
    let schedule_error =
        (points.iter()).map(|point| (schedule.gain_matrix(point.rho) - &point.gain).norm_max()).fold(0.0, f64::max);
    Design {
        name: request.name.clone(),
        convention: "u = u* - sat(K(rho) (x - x_ref))".into(),
        plant: spec.clone(),
        model_hash: Some(spec.fingerprint()),
        method: request.method,
        weights: request.weights.clone(),
        sample_time_s: request.sample_time_s,
        controller: Controller {
            schedule,
            scheduling_state: model.scheduling.as_ref().map(|scheduling| scheduling.state),
            operating_input,
            limits: request.limits.clone(),
            supervisor: None,
        },
        schedule_error,
        back_off,
        points,
        rate_bounded,
        inner: Vec::new(),
    }
}

/// σ of every input, or which input has none.
fn symmetric_bound(limits: &InputLimits, operating_input: &[f64]) -> Result<Vec<f64>, SynthesisError> {
    let sigma = limits.symmetric_bound(operating_input);
    match sigma.iter().position(|&bound| !(bound > 0.0 && bound.is_finite())) {
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

pub(super) fn schedule(model: &GridModel, points: &[FrozenDesign], kind: ScheduleKind) -> Schedule {
    let Some(scheduling) = model.scheduling.as_ref().filter(|_| points.len() > 1) else {
        return Schedule::Constant { gain: points[0].gain.clone() };
    };
    let parameters: Vec<f64> = points.iter().map(|point| point.rho).collect();
    match kind {
        ScheduleKind::Grid => Schedule::Grid {
            parameters,
            period: scheduling.periodic.then(|| scheduling.range[1] - scheduling.range[0]),
            gains: points.iter().map(|point| point.gain.clone()).collect(),
        },
        ScheduleKind::Vertices => {
            let weights = BoxWeights::new(&scheduling.features);
            let (gains, _) = weights.fit(&parameters, &points.iter().map(|point| &point.gain).collect::<Vec<_>>());
            Schedule::Vertices { weights, gains }
        }
    }
}
