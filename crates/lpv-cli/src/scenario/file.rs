//! The TOML tables of a scenario, as they stand in the file.

use super::door::Door;
use crate::failure::Failure;
use lpv::certificate::Verdict;
use lpv::plant::{LinearParameters, PlantSpec, QuadrotorParameters};
use lpv::synthesis::{HighGainOptions, ScheduleKind};
use serde::Deserialize;
use serde::de::DeserializeOwned;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    pub name: String,
    pub title: Option<String>,
    #[serde(default)]
    pub description: String,
    pub plant: toml::Table,
    #[serde(default)]
    pub model: ModelTable,
    pub weights: WeightsTable,
    pub limits: Option<LimitsTable>,
    pub simulation: SimulationTable,
    pub noise: Option<NoiseTable>,
    #[serde(default)]
    pub set_point: Vec<toml::Table>,
    #[serde(default)]
    pub controller: Vec<ControllerTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelTable {
    /// Grid of the scheduling parameter.
    pub grid_points: usize,
}

impl Default for ModelTable {
    fn default() -> Self {
        Self { grid_points: 32 }
    }
}

/// A square matrix: in full, or its diagonal.
pub type Rows = Option<Vec<Vec<f64>>>;
pub type Diagonal = Option<Vec<f64>>;

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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseTable {
    pub process: Rows,
    pub process_diag: Diagonal,
    pub measurement: Rows,
    pub measurement_diag: Diagonal,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number for all inputs, or a list with one for each")]
pub enum Bound {
    All(f64),
    Each(Vec<f64>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitsTable {
    pub min: Option<Bound>,
    pub max: Option<Bound>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulationTable {
    pub duration_s: f64,
    pub sample_time_s: f64,
    #[serde(default = "one")]
    pub steps_per_sample: usize,
    pub record_interval_s: Option<f64>,
    #[serde(default)]
    pub seed: u64,
    #[serde(default)]
    pub initial_state: toml::Table,
}

fn one() -> usize {
    1
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    Lpvqr,
    Slpvqr,
    HighGainSlpvqr,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorName {
    Ekf,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerTable {
    pub name: String,
    pub label: Option<String>,
    pub method: MethodName,
    pub gamma: Option<f64>,
    pub high_gain: Option<HighGainOptions>,
    pub rate_bound: Option<f64>,
    pub lyapunov_order: Option<u32>,
    pub region: Option<toml::Table>,
    pub nested: Option<Vec<f64>>,
    pub governor: Option<GovernorTable>,
    #[serde(default)]
    pub schedule: ScheduleKind,
    pub limits: Option<LimitsTable>,
    #[serde(default)]
    pub unlimited: bool,
    #[serde(default)]
    pub noise: bool,
    pub estimator: Option<EstimatorName>,
    pub require: Option<Verdict>,
}

#[derive(Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GovernorReference {
    #[default]
    Moving,
    Static,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GovernorTable {
    #[serde(default)]
    pub reference: GovernorReference,
    pub level: Option<f64>,
    pub feedforward: Option<f64>,
    pub bounds: Option<toml::Table>,
}

/// The plant of the `[plant]` table: its `name`, the rest are its parameters.
pub(crate) fn plant(door: &Door, mut table: toml::Table) -> Result<PlantSpec, Failure> {
    const NAMES: &str = "\"quadrotor\", \"pendulum\", \"double-integrator\", \"linear\"";
    let name = match table.remove("name") {
        Some(toml::Value::String(name)) => name,
        Some(other) => {
            return door.refuse("plant.name", format!("is of type {}: allowed are {NAMES}", other.type_str()));
        }
        None => return door.refuse("plant.name", format!("is missing: allowed are {NAMES}")),
    };
    match name.as_str() {
        "quadrotor" => Ok(PlantSpec::Quadrotor(parameters::<QuadrotorParameters>(door, table)?)),
        "linear" => Ok(PlantSpec::Linear(parameters::<LinearParameters>(door, table)?)),
        "pendulum" | "double-integrator" => match table.keys().next() {
            Some(key) => door.refuse(format!("plant.{key}"), format!("plant \"{name}\" has no parameters; remove it")),
            None if name == "pendulum" => Ok(PlantSpec::Pendulum {}),
            None => Ok(PlantSpec::DoubleIntegrator {}),
        },
        _ => door.refuse("plant.name", format!("\"{name}\" is not a plant: allowed are {NAMES}")),
    }
}

fn parameters<T: DeserializeOwned>(door: &Door, table: toml::Table) -> Result<T, Failure> {
    table.try_into().or_else(|error: toml::de::Error| {
        let message = engineers_words(error.to_string().trim_end());
        door.refuse("plant", message.replace('\n', " "))
    })
}

/// What is wrong with a file that is not the TOML of a scenario, and where: one line.
pub(crate) fn toml_message(text: &str, error: &toml::de::Error) -> String {
    /// Characters of the line that are shown.
    const SHOWN: usize = 60;
    let message = engineers_words(error.message());
    let Some(before) = error.span().and_then(|span| text.get(..span.start)) else {
        return message;
    };
    let start = before.rfind('\n').map_or(0, |end| end + 1);
    let line = text[start..].lines().next().unwrap_or("").trim();
    let mut shown: String = line.chars().take(SHOWN).collect();
    if shown.len() < line.len() {
        shown.push('…');
    }
    format!(
        "line {}, column {}: `{shown}`: {message}",
        before.matches('\n').count() + 1,
        before[start..].chars().count() + 1
    )
}

/// A parser's message in the words of the file instead of Rust's.
pub fn engineers_words(message: &str) -> String {
    [
        ("unknown field", "unknown key"),
        ("missing field", "missing key"),
        ("unknown variant", "unknown value"),
        ("expected usize", "expected a whole number, zero or more"),
        ("expected u64", "expected a whole number, zero or more"),
        ("expected f64", "expected a number"),
        ("wanted string or table", "expected one of the words allowed, in quotes"),
        ("expected struct", "expected the table"),
        ("expected a sequence", "expected a list"),
        ("expected a map", "expected a table"),
        ("invalid type: map", "invalid type: table"),
        ("invalid type: sequence", "invalid type: list"),
    ]
    .into_iter()
    .fold(message.to_owned(), |message, (theirs, ours)| message.replace(theirs, ours))
}
