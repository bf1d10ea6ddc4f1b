//! Problem files of `lpv design`: an LPV model as matrices or a plant by name, weights, and a method with its settings.
//! Everything that can be wrong with a file is met here.

mod file;
pub mod gain;
mod solve;

use crate::failure::Failure;
use crate::scenario::door::Door;
use crate::scenario::{file as scenario_file, weights};
use file::{DesignTable, LyapunovName, Matrices, MethodName, ModelTable, ObjectiveName, ProblemFile};
use lpv::math::Mat;
use lpv::math::matrix::{from_rows, inverse_spd, is_symmetric};
use lpv::model::{FrozenModel, GridModel, Polytope, linearize};
use lpv::synthesis::polytopic::{BackOff, HighGain, InputBounds, Lyapunov, Objective, rate_box_vertices};
use lpv::synthesis::{CostWeights, HighGainOptions};
pub use solve::solve;
use std::path::Path;

/// Vertices of a polytope; each pair of them is an inequality for each rate vertex.
const MOST_VERTICES: usize = 64;
/// Inequalities of a problem.
const MOST_BLOCKS: usize = 4096;
/// States of a model.
const MOST_STATES: usize = 60;
/// Inputs of a high-gain design: there are 2^m mixtures.
const MOST_HIGH_GAIN_INPUTS: usize = 10;
/// Convex weights sum to one, and rates to zero, up to this.
const SUM_TOLERANCE: f64 = 1e-9;

/// A problem, ready to solve.
pub struct ProblemPlan {
    /// What the vertices or grid points are called in the answer.
    pub places: Vec<String>,
    /// Names of the states, where the plant has them.
    pub states: Vec<String>,
    /// The models: vertices, or points of a frozen design.
    pub models: Vec<FrozenModel>,
    /// How they are used.
    pub scope: Scope,
    /// Q and R; `None` for stabilisation.
    pub weights: Option<CostWeights>,
    /// σ and γ.
    pub saturation: Option<InputBounds>,
    /// Choice of a high gain.
    pub high_gain: Option<HighGain>,
    /// What is optimised.
    pub objective: Objective,
    /// How much of the optimum is given back for a gain that can be applied.
    pub back_off: BackOff,
    /// The objective is the reach along its states.
    pub region: bool,
    /// State whose cost is bounded, with the model (for frozen designs) or the weights of its parameter.
    pub initial: Option<Initial>,
}

/// An initial state and where the parameter starts.
pub struct Initial {
    /// x(0)
    pub state: Vec<f64>,
    /// Convex weights of ρ(0) over the vertices; `None`: P does not depend on it.
    pub parameter: Option<Vec<f64>>,
    /// The model at ρ(0), of a frozen design.
    pub model: Option<FrozenModel>,
}

/// What the Lyapunov function is for.
pub enum Scope {
    /// The polytope of the models.
    Polytope(Lyapunov),
    /// Each model by itself.
    Frozen,
}

impl ProblemPlan {
    /// Whether the text of a file is a problem rather than a scenario: it has a table `[design]`.
    pub fn is_problem(text: &str) -> bool {
        toml::from_str::<toml::Table>(text).is_ok_and(|table| table.contains_key("design"))
    }

    /// Read and check the problem `text` of the file at `path`.
    pub fn read(path: &Path, text: &str) -> Result<Self, Failure> {
        let door = Door { file: path };
        let file: ProblemFile = toml::from_str(text).map_err(|error| Failure::Unreadable {
            file: path.to_owned(),
            message: scenario_file::toml_message(text, &error),
        })?;
        let design = file.design;
        let lyapunov = lyapunov(&door, &design, &file.model, file.plant.is_some())?;
        let source = models(&door, file.model, file.plant, lyapunov)?;
        let (n, m) = (source.models[0].a.nrows(), source.models[0].b.ncols());
        if n > MOST_STATES {
            return door.refuse("model", format!("has {n} states: allowed are up to {MOST_STATES}"));
        }
        if matches!(design.method, MethodName::Lqr | MethodName::Slqr) && source.models.len() > 1 {
            let message = format!(
                "is for a model of one vertex, and this one has {}: choose \"lpvqr\" or \"slpvqr\"",
                source.models.len()
            );
            return door.refuse("design.method", message);
        }

        let weights = cost_weights(&door, file.weights, design.method, n, m)?;
        let saturation = saturation(&door, &design, m)?;
        let high_gain = high_gain(&door, &design, m)?;
        let (objective, region) = objective(&door, &design, n, saturation.is_some())?;
        let scope = match lyapunov {
            LyapunovName::Frozen => Scope::Frozen,
            LyapunovName::Common => Scope::Polytope(Lyapunov::Common),
            LyapunovName::ParameterDependent => Scope::Polytope(Lyapunov::ParameterDependent {
                rate_vertices: rate_vertices(&door, &design, source.models.len())?,
            }),
        };
        if !matches!(lyapunov, LyapunovName::ParameterDependent) {
            for (key, given) in
                [("rate_vertices", design.rate_vertices.is_some()), ("rate_bound", design.rate_bound.is_some())]
            {
                if given {
                    return door.refuse(format!("design.{key}"), "belongs to lyapunov = \"parameter-dependent\" only");
                }
            }
        }
        let initial = initial(&door, &design, &source, lyapunov)?;
        let mut plan = Self {
            states: source.plant.as_ref().map_or(Vec::new(), |plant| {
                plant.description().states.iter().map(|state| state.name.clone()).collect()
            }),
            places: source.places,
            models: source.models,
            scope,
            weights,
            saturation,
            high_gain,
            objective,
            back_off: back_off(&door, design.back_off)?,
            region,
            initial,
        };
        if let (Objective::States { parameter, .. }, Some(Initial { parameter: given, .. })) =
            (&mut plan.objective, &plan.initial)
            && design.objective == ObjectiveName::InitialState
        {
            parameter.clone_from(given);
        }
        plan.check_size(&door)?;
        Ok(plan)
    }

    fn check_size(&self, door: &Door) -> Result<(), Failure> {
        let count = self.models.len();
        let (pairs, rates) = match &self.scope {
            Scope::Frozen => (0, 1),
            Scope::Polytope(Lyapunov::Common) => (count * (count - 1) / 2, 1),
            Scope::Polytope(Lyapunov::ParameterDependent { rate_vertices }) => {
                (count * (count - 1) / 2, rate_vertices.len())
            }
        };
        let blocks = (count + pairs) * rates;
        if matches!(self.scope, Scope::Polytope(_)) && (count > MOST_VERTICES || blocks > MOST_BLOCKS) {
            return door.refuse(
                "model",
                format!("has {count} vertices, which makes {blocks} inequalities: allowed are {MOST_VERTICES} vertices and {MOST_BLOCKS} inequalities"),
            );
        }
        Ok(())
    }
}

/// The models of a file, before it is known what for.
struct Source {
    models: Vec<FrozenModel>,
    places: Vec<String>,
    /// Of matrices: the polytope, of which the models may be points.
    polytope: Option<Polytope>,
    plant: Option<Box<dyn lpv::plant::Plant>>,
}

fn lyapunov(door: &Door, design: &DesignTable, model: &ModelTable, has_plant: bool) -> Result<LyapunovName, Failure> {
    let is_plant = has_plant || model.plant.is_some();
    let lyapunov = design.lyapunov.unwrap_or(if is_plant { LyapunovName::Frozen } else { LyapunovName::Common });
    if design.lyapunov_order.is_some() {
        return door.refuse(
            "design.lyapunov_order",
            "is for controllers of a scenario: over a polytope Y is affine in ρ; remove it",
        );
    }
    if model.grid.is_some() && lyapunov != LyapunovName::Frozen {
        return door.refuse("model.grid", "belongs to lyapunov = \"frozen\" only");
    }
    Ok(lyapunov)
}

fn models(
    door: &Door,
    model: ModelTable,
    plant: Option<toml::Table>,
    lyapunov: LyapunovName,
) -> Result<Source, Failure> {
    let table = match (plant, &model.plant) {
        (Some(_), Some(_)) => return door.refuse("model.plant", "and the table [plant] are both given; keep one"),
        (Some(table), None) => Some(table),
        (None, Some(name)) => Some(toml::Table::from_iter([("name".to_owned(), toml::Value::String(name.clone()))])),
        (None, None) => None,
    };
    match (table, model.a.is_some() || model.b.is_some()) {
        (Some(_), true) => door.refuse("model", "has matrices and a plant; keep one"),
        (None, false) => door.refuse("model", "is empty: give the matrices A and B, or plant = \"…\""),
        (Some(table), false) => plant_models(door, model, table),
        (None, true) => matrix_models(door, model, lyapunov),
    }
}

fn matrix_models(door: &Door, model: ModelTable, lyapunov: LyapunovName) -> Result<Source, Failure> {
    for (key, given) in [("grid_points", model.grid_points.is_some()), ("range", model.range.is_some())] {
        if given {
            return door.refuse(format!("model.{key}"), "belongs to a plant; a model of matrices has its vertices");
        }
    }
    let matrices = |key: &str, given: Option<Matrices>| -> Result<Vec<Mat<f64>>, Failure> {
        let each = match given {
            None => {
                return door
                    .refuse(format!("model.{key}"), "is missing: give it as rows, or a list of such for the vertices");
            }
            Some(Matrices::One(rows)) => vec![rows],
            Some(Matrices::Each(each)) => each,
        };
        each.iter().enumerate().map(|(i, rows)| matrix(door, &format!("model.{key}[{}]", i + 1), rows)).collect()
    };
    let (a, b) = (matrices("A", model.a)?, matrices("B", model.b)?);
    let polytope = Polytope::new(a, b).or_else(|error| door.refuse("model", error.to_string()))?;
    let count = polytope.len();
    let (models, places) = match (&model.grid, lyapunov) {
        (Some(grid), LyapunovName::Frozen) => {
            if grid.is_empty() {
                return door.refuse("model.grid", "is empty: give at least one list of weights");
            }
            for (k, weights) in grid.iter().enumerate() {
                convex_weights(door, &format!("model.grid[{}]", k + 1), weights, count)?;
            }
            let place = |weights: &Vec<f64>| format!("rho = {weights:?}");
            (grid.iter().map(|weights| polytope.at(weights)).collect(), grid.iter().map(place).collect())
        }
        _ => {
            let place = |i: usize| if count == 1 { "the operating point".into() } else { format!("vertex {}", i + 1) };
            ((0..count).map(|i| polytope.vertex(i)).collect::<Vec<_>>(), (0..count).map(place).collect::<Vec<_>>())
        }
    };
    Ok(Source { models, places, polytope: Some(polytope), plant: None })
}

fn plant_models(door: &Door, model: ModelTable, table: toml::Table) -> Result<Source, Failure> {
    let spec = scenario_file::plant(door, table)?;
    let plant = spec.build().or_else(|error| door.refuse("plant", error.to_string()))?;
    let scheduling = plant.description().scheduling.clone();
    let Some(scheduling) = scheduling else {
        for (key, given) in [("grid_points", model.grid_points.is_some()), ("range", model.range.is_some())] {
            if given {
                return door.refuse(format!("model.{key}"), "the plant has no scheduling parameter; remove it");
            }
        }
        let models = vec![linearize(&*plant, 0.0)];
        return Ok(Source { models, places: vec!["the operating point".into()], polytope: None, plant: Some(plant) });
    };
    let count = model.grid_points.unwrap_or(8);
    if !(2..=512).contains(&count) {
        return door.refuse("model.grid_points", format!("is {count}: allowed are 2 to 512"));
    }
    let models = match model.range.as_deref() {
        None => GridModel::of_plant(&*plant, count).points,
        Some(&[low, high]) => {
            let [least, most] = scheduling.range;
            let inside =
                low < high && (scheduling.periodic || (low >= least && high <= most)) && high - low <= most - least;
            if !(low.is_finite() && high.is_finite() && inside) {
                return door.refuse(
                    "model.range",
                    format!(
                        "is [{low}, {high}]: it has to ascend and lie in the range of {}, [{least}, {most}]",
                        scheduling.parameter
                    ),
                );
            }
            (0..count).map(|k| linearize(&*plant, low + (high - low) * k as f64 / (count - 1) as f64)).collect()
        }
        Some(other) => {
            return door
                .refuse("model.range", format!("has {} numbers: it has two, the least and the largest", other.len()));
        }
    };
    let places = models.iter().map(|model| format!("{} = {:.6}", scheduling.parameter, model.rho)).collect();
    Ok(Source { models, places, polytope: None, plant: Some(plant) })
}

/// A matrix of finite numbers from its rows.
fn matrix(door: &Door, key: &str, rows: &[Vec<f64>]) -> Result<Mat<f64>, Failure> {
    let width = rows.first().map_or(0, Vec::len);
    if width == 0 {
        return door.refuse(key, "is empty: give rows of numbers");
    }
    if let Some(row) = rows.iter().position(|row| row.len() != width) {
        return door.refuse(key, format!("row {} has {} numbers, and row 1 has {width}", row + 1, rows[row].len()));
    }
    if rows.iter().flatten().any(|entry| !entry.is_finite()) {
        return door.refuse(key, "has an entry that is not finite");
    }
    Ok(from_rows(rows))
}

fn convex_weights(door: &Door, key: &str, weights: &[f64], count: usize) -> Result<(), Failure> {
    if weights.len() != count {
        return door.refuse(key, format!("has {} numbers: the model has {count} vertices", weights.len()));
    }
    let sum: f64 = weights.iter().sum();
    match weights.iter().all(|&weight| weight >= 0.0) && (sum - 1.0).abs() <= SUM_TOLERANCE {
        true => Ok(()),
        false => {
            door.refuse(key, format!("is {weights:?}: the weights of the vertices are zero or more and sum to one"))
        }
    }
}

fn cost_weights(
    door: &Door,
    table: Option<file::WeightsTable>,
    method: MethodName,
    n: usize,
    m: usize,
) -> Result<Option<CostWeights>, Failure> {
    match (table, method) {
        (None, MethodName::Stabilize) => Ok(None),
        (Some(_), MethodName::Stabilize) => door.refuse("weights", "method \"stabilize\" has no cost; remove them"),
        (None, _) => door.refuse("weights", "are missing: give [weights] with Q and R"),
        (Some(table), _) => {
            let q = weights::semidefinite(door, "weights.Q", table.q, table.q_diag, n)?;
            if q.norm_max() == 0.0 {
                return door.refuse("weights.Q", "is zero: some state has to cost something");
            }
            Ok(Some(CostWeights { q, r: weights::definite(door, "weights.R", table.r, table.r_diag, m)? }))
        }
    }
}

fn saturation(door: &Door, design: &DesignTable, m: usize) -> Result<Option<InputBounds>, Failure> {
    let saturated = matches!(design.method, MethodName::Slqr | MethodName::Slpvqr);
    match (&design.sigma, design.gamma, saturated) {
        (None, None, false) => Ok(None),
        (Some(_), _, false) => door.refuse("design.sigma", "belongs to the methods \"slqr\" and \"slpvqr\" only"),
        (_, Some(_), false) => door.refuse("design.gamma", "belongs to the methods \"slqr\" and \"slpvqr\" only"),
        (None, _, true) => door.refuse("design.sigma", format!("is missing: the bound of each of the {m} inputs")),
        (_, None, true) => door.refuse("design.gamma", "is missing: the level γ > 0 of the certified set"),
        (Some(sigma), Some(gamma), true) => {
            let gamma = door.positive("design.gamma", gamma)?;
            if sigma.len() != m {
                return door.refuse("design.sigma", format!("has {} numbers: the model has {m} inputs", sigma.len()));
            }
            for (i, &bound) in sigma.iter().enumerate() {
                door.positive(&format!("design.sigma[{}]", i + 1), bound)?;
                if !(bound * bound / gamma).is_normal() {
                    let message =
                        format!("is {gamma:e}: sigma²/γ is too large or too small a number to calculate with");
                    return door.refuse("design.gamma", message);
                }
            }
            Ok(Some(InputBounds { sigma: sigma.clone(), gamma }))
        }
    }
}

fn high_gain(door: &Door, design: &DesignTable, m: usize) -> Result<Option<HighGain>, Failure> {
    let saturated = matches!(design.method, MethodName::Slqr | MethodName::Slpvqr);
    if !design.high_gain {
        let settings = [
            ("sample_time_s", design.sample_time_s.is_some()),
            ("recovery", design.recovery.is_some()),
            ("gain_margin", design.gain_margin.is_some()),
        ];
        return match settings.into_iter().find(|(_, given)| *given) {
            Some((key, _)) => door.refuse(format!("design.{key}"), "belongs to high_gain = true only"),
            None => Ok(None),
        };
    }
    if !saturated {
        return door.refuse("design.high_gain", "belongs to the methods \"slqr\" and \"slpvqr\" only");
    }
    if m > MOST_HIGH_GAIN_INPUTS {
        return door
            .refuse("design.high_gain", format!("is for up to {MOST_HIGH_GAIN_INPUTS} inputs; the model has {m}"));
    }
    let default = HighGainOptions::default();
    let recovery = design.recovery.unwrap_or(default.recovery);
    if !(recovery >= 0.0 && recovery.is_finite()) {
        return door.refuse("design.recovery", format!("is {recovery}: it has to be a fraction, zero or more"));
    }
    let gain_margin = design.gain_margin.unwrap_or(default.gain_margin);
    if !(gain_margin >= 1.0 && gain_margin.is_finite()) {
        return door.refuse("design.gain_margin", format!("is {gain_margin}: it has to be a factor of at least 1"));
    }
    let sample_time_s = match design.sample_time_s {
        Some(time) => Some(door.positive("design.sample_time_s", time)?),
        None => None,
    };
    Ok(Some(HighGain { options: HighGainOptions { recovery, gain_margin }, sample_time_s }))
}

/// The share of the optimum that is given back: the knee where the file does not say, nothing for 0.
fn back_off(door: &Door, share: Option<f64>) -> Result<BackOff, Failure> {
    match share {
        None => Ok(BackOff::Knee),
        Some(0.0) => Ok(BackOff::Nothing),
        Some(share) if (1e-6..=0.9).contains(&share) => Ok(BackOff::Share(share)),
        Some(share) => {
            let message = "a share of the optimum: 0 for the bare optimum, or 1e-6 to 0.9";
            door.refuse("design.back_off", format!("is {share}: it has to be {message}"))
        }
    }
}

fn objective(door: &Door, design: &DesignTable, n: usize, saturated: bool) -> Result<(Objective, bool), Failure> {
    let name = design.objective;
    if design.method == MethodName::Stabilize && name != ObjectiveName::Trace {
        return door.refuse("design.objective", "method \"stabilize\" has its own: the largest margin; remove it");
    }
    for (key, given, belongs) in [
        ("initial_states", design.initial_states.is_some(), ObjectiveName::WorstCase),
        ("ellipsoid", design.ellipsoid.is_some(), ObjectiveName::WorstCase),
        ("directions", design.directions.is_some(), ObjectiveName::Region),
    ] {
        if given && name != belongs {
            let belongs = if belongs == ObjectiveName::Region { "region" } else { "worst-case" };
            return door.refuse(format!("design.{key}"), format!("belongs to objective = \"{belongs}\""));
        }
    }
    let checked = |key: &str, states: &Vec<Vec<f64>>| -> Result<Objective, Failure> {
        if states.is_empty() {
            return door.refuse(format!("design.{key}"), "is empty: give at least one state");
        }
        for (k, x) in states.iter().enumerate() {
            state(door, &format!("design.{key}[{}]", k + 1), x, n)?;
            if x.iter().all(|&value| value == 0.0) {
                return door
                    .refuse(format!("design.{key}[{}]", k + 1), "is zero: its bound is zero whatever the design");
            }
        }
        Ok(Objective::States { states: states.clone(), parameter: None })
    };
    match name {
        ObjectiveName::Trace => Ok((Objective::Trace, false)),
        ObjectiveName::InitialState => match &design.initial_state {
            None => door.refuse("design.initial_state", "is missing: objective = \"initial-state\" is its cost bound"),
            Some(x) => Ok((checked("initial_state", &vec![x.clone()])?, false)),
        },
        ObjectiveName::WorstCase => match (&design.initial_states, &design.ellipsoid) {
            (Some(_), Some(_)) => door.refuse("design.ellipsoid", "and initial_states are both given; keep one"),
            (None, None) => door.refuse(
                "design.initial_states",
                "is missing: objective = \"worst-case\" needs initial_states or ellipsoid",
            ),
            (Some(states), None) => Ok((checked("initial_states", states)?, false)),
            (None, Some(rows)) => {
                let shape = matrix(door, "design.ellipsoid", rows)?;
                if (shape.nrows(), shape.ncols()) != (n, n)
                    || !is_symmetric(&shape, 1e-12)
                    || inverse_spd(&shape).is_none()
                {
                    let message =
                        format!("has to be a symmetric positive definite {n} × {n} matrix S: the states xᵀSx ≤ 1");
                    return door.refuse("design.ellipsoid", message);
                }
                Ok((Objective::Ellipsoid { shape }, false))
            }
        },
        ObjectiveName::Region => match &design.directions {
            _ if !saturated => door.refuse(
                "design.objective",
                "\"region\" is for the methods \"slqr\" and \"slpvqr\": without saturation everything is certified",
            ),
            None => door.refuse("design.directions", "is missing: objective = \"region\" is the reach along them"),
            Some(states) => Ok((checked("directions", states)?, true)),
        },
    }
}

fn state(door: &Door, key: &str, x: &[f64], n: usize) -> Result<(), Failure> {
    if x.len() != n {
        return door.refuse(key, format!("has {} numbers: the model has {n} states", x.len()));
    }
    x.iter().try_for_each(|&value| door.finite(key, value).map(|_| ()))
}

fn rate_vertices(door: &Door, design: &DesignTable, count: usize) -> Result<Vec<Vec<f64>>, Failure> {
    match (&design.rate_vertices, design.rate_bound) {
        (Some(_), Some(_)) => door.refuse("design.rate_bound", "and rate_vertices are both given; keep one"),
        (None, None) => door.refuse(
            "design.rate_vertices",
            "is missing: lyapunov = \"parameter-dependent\" needs the vertices of ρ̇, or rate_bound",
        ),
        (None, Some(bound)) => match bound >= 0.0 && bound.is_finite() {
            // C(12, 6) = 924 vertices
            true if count <= 12 => Ok(rate_box_vertices(count, bound)),
            true => door.refuse(
                "design.rate_bound",
                format!("has too many vertices for {count} of the model: give rate_vertices"),
            ),
            false => door.refuse("design.rate_bound", format!("is {bound}: it has to be finite, zero or more")),
        },
        (Some(vertices), None) => {
            if vertices.is_empty() {
                return door.refuse(
                    "design.rate_vertices",
                    "is empty: give at least one rate; [[0, …]] is a parameter at rest",
                );
            }
            for (k, nu) in vertices.iter().enumerate() {
                let key = format!("design.rate_vertices[{}]", k + 1);
                state_like(door, &key, nu, count)?;
                let largest = nu.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
                if nu.iter().sum::<f64>().abs() > SUM_TOLERANCE * largest {
                    return door.refuse(
                        key,
                        format!("is {nu:?}: it has to sum to zero, because the weights of the vertices sum to one"),
                    );
                }
            }
            Ok(vertices.clone())
        }
    }
}

fn state_like(door: &Door, key: &str, values: &[f64], count: usize) -> Result<(), Failure> {
    if values.len() != count {
        return door.refuse(key, format!("has {} numbers: the model has {count} vertices", values.len()));
    }
    values.iter().try_for_each(|&value| door.finite(key, value).map(|_| ()))
}

/// Convex weights of the ascending `grid` at `rho`, of its two neighbours; `None` outside.
fn weights_between(grid: &[f64], rho: f64) -> Option<Vec<f64>> {
    let right = (1..grid.len()).find(|&k| grid[k - 1] <= rho && rho <= grid[k])?;
    let share = (rho - grid[right - 1]) / (grid[right] - grid[right - 1]);
    let weight = |k: usize| match k {
        _ if k == right => share,
        _ if k + 1 == right => 1.0 - share,
        _ => 0.0,
    };
    Some((0..grid.len()).map(weight).collect())
}

fn initial(
    door: &Door,
    design: &DesignTable,
    source: &Source,
    lyapunov: LyapunovName,
) -> Result<Option<Initial>, Failure> {
    let Some(x) = &design.initial_state else {
        return match design.initial_parameter {
            Some(_) => door.refuse("design.initial_parameter", "belongs to initial_state, which is missing"),
            None => Ok(None),
        };
    };
    if design.method == MethodName::Stabilize {
        return door.refuse("design.initial_state", "method \"stabilize\" has no cost to bound; remove it");
    }
    state(door, "design.initial_state", x, source.models[0].a.nrows())?;
    let key = "design.initial_parameter";
    let (parameter, model) = match (&design.initial_parameter, &source.polytope, &source.plant) {
        (None, _, _) if lyapunov == LyapunovName::Common || source.models.len() == 1 => {
            (None, (lyapunov == LyapunovName::Frozen).then(|| source.models[0].clone()))
        }
        (None, _, _) => return door.refuse(key, "is missing: the cost bound depends on the parameter at the start"),
        (Some(weights), Some(polytope), _) => {
            convex_weights(door, key, weights, polytope.len())?;
            let model = (lyapunov == LyapunovName::Frozen).then(|| polytope.at(weights));
            (Some(weights.clone()), model)
        }
        (Some(value), None, Some(plant)) => match (value.as_slice(), &plant.description().scheduling) {
            ([rho], Some(scheduling)) if rho.is_finite() => match lyapunov {
                LyapunovName::Common => (None, None),
                LyapunovName::Frozen => (None, Some(linearize(&**plant, *rho))),
                LyapunovName::ParameterDependent => {
                    let grid: Vec<f64> = source.models.iter().map(|model| model.rho).collect();
                    let Some(weights) = weights_between(&grid, *rho) else {
                        let message = format!(
                            "is {rho}: {} of the model's grid is from {} to {}",
                            scheduling.parameter,
                            grid[0],
                            grid[grid.len() - 1]
                        );
                        return door.refuse(key, message);
                    };
                    (Some(weights), None)
                }
            },
            (_, Some(scheduling)) => {
                return door.refuse(key, format!("has to be one finite number, {}", scheduling.parameter));
            }
            (_, None) => return door.refuse(key, "the plant has no scheduling parameter; remove it"),
        },
        (Some(_), None, None) => return door.refuse(key, "has no model to belong to"),
    };
    Ok(Some(Initial { state: x.clone(), parameter, model }))
}
