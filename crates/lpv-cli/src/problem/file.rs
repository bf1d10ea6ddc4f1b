//! The TOML tables of a problem, as they stand in the file.

use crate::scenario::file::{Diagonal, Rows};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemFile {
    #[serde(default)]
    pub model: ModelTable,
    pub plant: Option<toml::Table>,
    pub weights: Option<WeightsTable>,
    pub design: DesignTable,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelTable {
    #[serde(rename = "A")]
    pub a: Option<Matrices>,
    #[serde(rename = "B")]
    pub b: Option<Matrices>,
    /// Points of the polytope, as convex weights, for frozen designs.
    pub grid: Option<Vec<Vec<f64>>>,
    /// A plant by name, short for the table `[plant]`.
    pub plant: Option<String>,
    /// Points over the range of the plant's parameter.
    pub grid_points: Option<usize>,
    /// Part of the range of the plant's parameter.
    pub range: Option<Vec<f64>>,
    /// Path of a tensor-product model: a model file of `lpv tp`, or what it wrote.
    pub tensor_product: Option<String>,
}

/// One matrix as rows, or a list of them.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a matrix as a list of rows of numbers, or a list of such matrices")]
pub enum Matrices {
    One(Vec<Vec<f64>>),
    Each(Vec<Vec<Vec<f64>>>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeightsTable {
    #[serde(rename = "Q")]
    pub q: Rows,
    #[serde(rename = "Q_diag")]
    pub q_diag: Diagonal,
    #[serde(rename = "R")]
    pub r: Rows,
    #[serde(rename = "R_diag")]
    pub r_diag: Diagonal,
}

#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    Lqr,
    Stabilize,
    Lpvqr,
    Slqr,
    Slpvqr,
}

#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LyapunovName {
    Common,
    ParameterDependent,
    Frozen,
}

#[derive(Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObjectiveName {
    /// Largest Σ tr Yᵢ.
    #[default]
    Trace,
    /// Least cost bound of the initial state.
    InitialState,
    /// Least cost bound of the worst of `initial_states`, or of `ellipsoid`.
    WorstCase,
    /// Farthest reach of the certified set along `directions`.
    Region,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DesignTable {
    pub method: MethodName,
    pub lyapunov: Option<LyapunovName>,
    pub rate_vertices: Option<Vec<Vec<f64>>>,
    pub rate_bound: Option<f64>,
    pub lyapunov_order: Option<u32>,
    pub sigma: Option<Vec<f64>>,
    pub gamma: Option<f64>,
    #[serde(default)]
    pub high_gain: bool,
    pub sample_time_s: Option<f64>,
    pub recovery: Option<f64>,
    pub gain_margin: Option<f64>,
    pub back_off: Option<f64>,
    #[serde(default)]
    pub objective: ObjectiveName,
    pub initial_state: Option<Vec<f64>>,
    pub initial_parameter: Option<Vec<f64>>,
    pub initial_states: Option<Vec<Vec<f64>>>,
    pub ellipsoid: Option<Vec<Vec<f64>>>,
    pub directions: Option<Vec<Vec<f64>>>,
}
