//! Linearisation at an operating point, and a grid of them over the scheduling parameter.

use crate::math::Mat;
use crate::math::matrix::{from_row_slice, rows};
use crate::plant::{OperatingPoint, Plant, Scheduling};
use serde::{Deserialize, Serialize};

/// A plant linearised at one value of its scheduling parameter.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrozenModel {
    /// Value of the scheduling parameter ρ (zero for a plant without one).
    pub rho: f64,
    /// A = ∂f/∂x at the operating point, n × n.
    #[serde(with = "rows")]
    pub a: Mat<f64>,
    /// B = ∂f/∂u at the operating point, n × m.
    #[serde(with = "rows")]
    pub b: Mat<f64>,
    /// Where the plant rests.
    pub operating_point: OperatingPoint,
}

/// The linearisation of `plant` at its operating point for parameter `rho` (3.27)-(3.32), by dual numbers.
pub fn linearize(plant: &dyn Plant, rho: f64) -> FrozenModel {
    let description = plant.description();
    let (n, m) = (description.states.len(), description.inputs.len());
    let operating_point = plant.trim(rho);
    let (x, u, w) = (&operating_point.state, &operating_point.input, vec![0.0; description.disturbances.len()]);
    let (mut a, mut b) = (vec![0.0; n * n], vec![0.0; n * m]);
    plant.dynamics_by_state(x, u, &w, &mut a);
    plant.dynamics_by_input(x, u, &w, &mut b);
    FrozenModel { rho, a: from_row_slice(n, n, &a), b: from_row_slice(n, m, &b), operating_point }
}

/// Linearisations over a grid of the scheduling parameter; one point for a plant without a parameter.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GridModel {
    /// The parameter, if the plant has one.
    pub scheduling: Option<Scheduling>,
    /// The linearisations, in ascending order of the parameter.
    pub points: Vec<FrozenModel>,
}

impl GridModel {
    /// `count` equidistant points over the range of the plant's parameter. A periodic range does not repeat its end.
    pub fn of_plant(plant: &dyn Plant, count: usize) -> Self {
        let scheduling = plant.description().scheduling.clone();
        let points = parameter_grid(scheduling.as_ref(), count).into_iter().map(|rho| linearize(plant, rho)).collect();
        Self { scheduling, points }
    }
}

/// `count` equidistant values over the range of a parameter, without the repeated end of a periodic one; `[0]` where
/// there is no parameter.
pub fn parameter_grid(scheduling: Option<&Scheduling>, count: usize) -> Vec<f64> {
    let Some(Scheduling { range: [low, high], periodic, .. }) = scheduling else {
        return vec![0.0];
    };
    let intervals = if *periodic { count } else { count.saturating_sub(1).max(1) };
    (0..count).map(|k| low + (high - low) * k as f64 / intervals as f64).collect()
}
