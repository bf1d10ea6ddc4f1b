//! Scenario files: TOML → plain values → ready objects. Everything that can be wrong with a file is met here, with the
//! file, the key, the value and what is allowed.

mod controller;
pub(crate) mod door;
pub(crate) mod file;
mod plan;
mod request;
mod set_point;
mod supervision;
pub(crate) mod weights;

use crate::failure::Failure;
use controller::controller;
use door::{Door, file_name_part};
use file::ScenarioFile;
pub use file::engineers_words;
use lpv::estimator::NoiseCovariance;
use lpv::math::stabilizability::{Stabilizability, stabilizability};
use lpv::model::{GridModel, LpvModel};
use lpv::plant::{Description, Plant, PlantSpec};
use lpv::sim::{Reference, SetPoint};
use lpv::synthesis::CostWeights;
pub use plan::ControllerPlan;
use request::RequestDefaults;
use set_point::{set_point, state_value};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Numbers that the flights of a scenario may keep in memory: 0.8 GB.
const MOST_NUMBERS: f64 = 1e8;
/// Bytes of a file that is read: a design of thousands of grid points has tens of megabytes.
const LARGEST_FILE: u64 = 1 << 28;

/// A scenario, ready to design and fly.
pub struct Scenario {
    /// Name of the result folder.
    pub name: String,
    /// Title of the report.
    pub title: String,
    /// What it shows.
    pub description: String,
    /// The file, as text, for the record.
    pub text: String,
    /// The plant as data.
    pub plant_spec: PlantSpec,
    /// The plant.
    pub plant: Box<dyn Plant>,
    /// The LPV model that the controllers are designed on.
    pub model: LpvModel,
    /// Cost weights.
    pub weights: CostWeights,
    /// Initial state.
    pub initial_state: Vec<f64>,
    /// Set points.
    pub reference: Reference,
    /// What each set point is called in the report.
    pub set_point_labels: Vec<String>,
    /// End of the flight.
    pub duration_s: f64,
    /// Time between samples.
    pub sample_time_s: f64,
    /// Integration steps per sample.
    pub steps_per_sample: usize,
    /// Time between rows of the trajectory files.
    pub record_interval_s: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// Noise of the runs that have it.
    pub noise: Option<NoiseCovariance>,
    /// The controllers, in file order.
    pub controllers: Vec<ControllerPlan>,
}

impl Scenario {
    /// Whether the LPV model leaves nothing of the plant out, so that its bounds are the plant's.
    pub fn is_linear(&self) -> bool {
        matches!(self.plant_spec, PlantSpec::Linear(_) | PlantSpec::DoubleIntegrator {})
    }

    /// Read and check the scenario at `path`.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let text = read_text(path)?;
        let door = Door { file: path };
        let file: ScenarioFile = toml::from_str(&text).map_err(|error| Failure::Unreadable {
            file: path.to_owned(),
            message: file::toml_message(&text, &error),
        })?;

        file_name_part(&door, "name", &file.name)?;
        let plant_spec = file::plant(&door, file.plant)?;
        let plant = match plant_spec.build() {
            Ok(plant) => plant,
            Err(error) => return door.refuse("plant", error.to_string()),
        };
        let description = plant.description();
        let (n, m) = (description.states.len(), description.inputs.len());

        let weights = CostWeights {
            q: weights::definite(&door, "weights.Q", file.weights.q, file.weights.q_diag, n)?,
            r: weights::definite(&door, "weights.R", file.weights.r, file.weights.r_diag, m)?,
        };
        let grid_points = grid_points(&door, file.model.grid_points, &*plant)?;
        let model = LpvModel::of_plant(&plant_spec, &*plant, grid_points);
        stabilizable(&door, &model.grid, description)?;

        let simulation = file.simulation;
        let duration_s = door.positive("simulation.duration_s", simulation.duration_s)?;
        let sample_time_s = door.positive("simulation.sample_time_s", simulation.sample_time_s)?;
        if sample_time_s > duration_s {
            let message = format!("is {duration_s}: it cannot be less than sample_time_s = {sample_time_s}");
            return door.refuse("simulation.duration_s", message);
        }
        let samples = (duration_s / sample_time_s).round();
        let last_sample_s = (samples * sample_time_s).min(duration_s);
        if !(1..=1000).contains(&simulation.steps_per_sample) {
            let message = format!("is {}: allowed are 1 to 1000", simulation.steps_per_sample);
            return door.refuse("simulation.steps_per_sample", message);
        }
        let record_interval_s = match simulation.record_interval_s {
            Some(interval) if interval < sample_time_s => {
                return door.refuse(
                    "simulation.record_interval_s",
                    format!("is {interval}: it cannot be less than sample_time_s = {sample_time_s}"),
                );
            }
            Some(interval) => door.finite("simulation.record_interval_s", interval)?,
            None => (10.0 * sample_time_s).min(duration_s),
        };
        let trim = plant.trim(0.0);
        let mut initial_state = trim.state.clone();
        for (key, value) in &simulation.initial_state {
            let (state, value) =
                state_value(&door, &format!("simulation.initial_state.{key}"), description, key, value)?;
            initial_state[state] = value;
            if simulation.initial_state.contains_key(&format!("{key}_deg")) {
                return door.refuse(
                    format!("simulation.initial_state.{key}"),
                    format!("{key} and {key}_deg are both given; keep one"),
                );
            }
        }
        let mut set_points = Vec::new();
        for (k, table) in file.set_point.iter().enumerate() {
            set_points.push(set_point(&door, &format!("set_point[{}]", k + 1), description, table, last_sample_s)?);
        }
        set_points.sort_by(|a: &(SetPoint, String), b| a.0.time_s.total_cmp(&b.0.time_s));
        if let Some(pair) = set_points.windows(2).find(|pair| pair[0].0.time_s == pair[1].0.time_s) {
            return door.refuse("set_point", format!("two set points have time_s = {}; join them", pair[0].0.time_s));
        }
        let (set_points, set_point_labels) = set_points.into_iter().unzip();
        let reference = Reference::new(initial_state.clone(), set_points);

        let noise = match file.noise {
            None => None,
            Some(noise) => Some(NoiseCovariance {
                process: weights::semidefinite(
                    &door,
                    "noise.process",
                    noise.process,
                    noise.process_diag,
                    description.disturbances.len(),
                )?,
                measurement: weights::definite(
                    &door,
                    "noise.measurement",
                    noise.measurement,
                    noise.measurement_diag,
                    description.outputs.len(),
                )?,
            }),
        };

        let moved: Vec<(usize, usize)> = (reference.set_points().iter().enumerate())
            .flat_map(|(k, point)| point.targets.iter().map(move |&(state, _)| (state, k + 1)))
            .collect();
        let defaults = RequestDefaults {
            plant: &*plant,
            set_points: &moved,
            weights: &weights,
            grid_points,
            sample_time_s,
            limits: file.limits.as_ref(),
            description,
            operating_input: &trim.input,
        };
        let mut controllers: Vec<ControllerPlan> = Vec::new();
        if file.controller.is_empty() {
            return door.refuse("controller", "there is none; add at least one [[controller]] table");
        }
        for (k, table) in file.controller.into_iter().enumerate() {
            let key = format!("controller[{}]", k + 1);
            let plan = controller(&door, &key, table, &defaults, noise.is_some())?;
            let name = &plan.request.name;
            // some file systems do not tell "A" from "a"
            if controllers.iter().any(|other| other.request.name.eq_ignore_ascii_case(name)) {
                return door.refuse(
                    format!("{key}.name"),
                    format!("\"{name}\" is already taken; names have to differ, and not in upper and lower case only"),
                );
            }
            controllers.push(plan);
        }
        let numbers = samples * numbers_per_sample(description, &controllers);
        if numbers > MOST_NUMBERS {
            return door.refuse(
                "simulation.duration_s",
                format!(
                    "is {duration_s}: {samples} samples for {} controllers take {:.1} GB; allowed are {:.1} GB: fly shorter, sample slower, or compare fewer controllers",
                    controllers.len(),
                    numbers * 8e-9,
                    MOST_NUMBERS * 8e-9
                ),
            );
        }
        Ok(Self {
            title: file.title.unwrap_or_else(|| file.name.clone()),
            name: file.name,
            description: file.description,
            text,
            plant_spec,
            model,
            weights,
            initial_state,
            reference,
            set_point_labels,
            duration_s,
            sample_time_s,
            steps_per_sample: simulation.steps_per_sample,
            record_interval_s,
            seed: simulation.seed,
            noise,
            controllers,
            plant,
        })
    }

    /// The folder for results: `chosen`, or `out/<name>`.
    pub fn result_folder(&self, chosen: Option<&Path>) -> PathBuf {
        chosen.map_or_else(|| Path::new("out").join(&self.name), Path::to_owned)
    }

    /// The folder of `lpv design`: `out/<name>-designs`.
    pub fn designs_folder(&self) -> PathBuf {
        Path::new("out").join(format!("{}-designs", self.name))
    }

    /// The folder of `lpv simulate`: `out/<name>-flights`.
    pub fn flights_folder(&self) -> PathBuf {
        Path::new("out").join(format!("{}-flights", self.name))
    }
}

/// Numbers that a sample of all flights keeps.
fn numbers_per_sample(description: &Description, controllers: &[ControllerPlan]) -> f64 {
    let (n, m) = (description.states.len(), description.inputs.len());
    let of_one = |plan: &ControllerPlan| {
        let measured = if plan.noise { description.outputs.len() } else { 0 };
        let estimated = if plan.estimator { 2 * n } else { 0 };
        // states, references, inputs; time, cost and the flag of saturation
        let governed = if plan.supervision.governor.is_some() { n } else { 0 };
        let shares = if plan.supervision.is_none() { 0 } else { 2 };
        2 * n + m + 3 + measured + estimated + governed + shares
    };
    controllers.iter().map(of_one).sum::<usize>() as f64
}

/// The text of a file; a file that is not there, too large or not UTF-8 is bad input.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    let unreadable = |message: String| Failure::Unreadable { file: path.to_owned(), message };
    let mut bytes = Vec::new();
    std::fs::File::open(path)
        .and_then(|file| file.take(LARGEST_FILE + 1).read_to_end(&mut bytes))
        .map_err(|error| unreadable(format!("cannot be read: {error}")))?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(unreadable(format!("is too large: allowed are {} MiB", LARGEST_FILE >> 20)));
    }
    String::from_utf8(bytes).map_err(|error| {
        unreadable(format!("is not a text file: byte {} is not UTF-8", error.utf8_error().valid_up_to() + 1))
    })
}

fn grid_points(door: &Door, count: usize, plant: &dyn Plant) -> Result<usize, Failure> {
    match plant.description().scheduling {
        Some(_) if !(4..=4096).contains(&count) => {
            door.refuse("model.grid_points", format!("is {count}: allowed are 4 to 4096"))
        }
        _ => Ok(count),
    }
}

/// Refuse a model that is proved not to be stabilisable; what cannot be told goes on to the design.
fn stabilizable(door: &Door, model: &GridModel, description: &Description) -> Result<(), Failure> {
    let names: Vec<String> = description.states.iter().map(|state| state.name.clone()).collect();
    for point in &model.points {
        if let Stabilizability::Unstabilizable(mode) = stabilizability(&point.a, &point.b) {
            let parameter =
                model.scheduling.as_ref().map_or(String::new(), |s| format!(" at {} = {:.4}", s.parameter, point.rho));
            let message = format!(
                "the pair (A, B) is not stabilisable{parameter}: no input moves {}, a mode that does not decay by itself (λ = {})",
                mode.combination(&names),
                mode.eigenvalue_words()
            );
            return door.refuse("plant", message);
        }
    }
    Ok(())
}
