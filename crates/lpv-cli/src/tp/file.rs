//! The TOML tables of a model to transform, as they stand in the file.

use crate::scenario::file::WeightsTable;
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// A literature model by name with its constants, or samples.
    pub model: Option<toml::Table>,
    /// A plant by name with its parameters, as in a scenario.
    pub plant: Option<toml::Table>,
    /// Of a plant: the regulator's gain is transformed instead of the model.
    pub weights: Option<WeightsTable>,
    #[serde(default)]
    pub parameter: Vec<ParameterTable>,
    #[serde(default)]
    pub transformation: TransformationTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterTable {
    pub name: String,
    pub unit: Option<String>,
    pub range: Option<Vec<f64>>,
    pub grid_points: Option<usize>,
    /// Grid points in full, instead of range and number.
    pub values: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SamplesTable {
    /// One matrix for each grid point, the last parameter running fastest.
    pub samples: Vec<Vec<Vec<f64>>>,
}

/// One for all parameters, or a list with one for each.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected one value for all parameters, or a list with one for each")]
pub enum Each<T> {
    All(T),
    Each(Vec<T>),
}

impl<T> Each<T> {
    pub fn list(self) -> Vec<T> {
        match self {
            Each::All(one) => vec![one],
            Each::Each(list) => list,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransformationTable {
    /// Singular values above this part of the largest are kept.
    pub tolerance: Option<Each<f64>>,
    /// This many are kept.
    pub ranks: Option<Each<usize>>,
    pub weights: Option<Each<String>>,
    /// Points within each grid cell that the hull holds too.
    pub hull_points: Option<usize>,
    pub error_points: Option<usize>,
}
