//! The models of a problem: vertices as matrices, or linearisations of a plant.

use super::file::{LyapunovName, Matrices, ModelTable};
use super::source::Source;
use super::transformed::tensor_product_models;
use super::values::{convex_weights, matrix};
use crate::failure::Failure;
use crate::scenario::door::Door;
use crate::scenario::file as scenario_file;
use lpv::math::Mat;
use lpv::model::{GridModel, Polytope, linearize};

/// The models of the tables `[model]` and `[plant]`.
pub(super) fn models(
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
    if let Some(name) = &model.tensor_product {
        return tensor_product(door, name, &model, table.is_some(), lyapunov);
    }
    match (table, model.a.is_some() || model.b.is_some()) {
        (Some(_), true) => door.refuse("model", "has matrices and a plant; keep one"),
        (None, false) => {
            door.refuse("model", "is empty: give the matrices A and B, plant = \"…\", or tensor_product = \"FILE\"")
        }
        (Some(table), false) => plant_models(door, model, table),
        (None, true) => matrix_models(door, model, lyapunov),
    }
}

fn tensor_product(
    door: &Door,
    name: &str,
    model: &ModelTable,
    has_plant: bool,
    lyapunov: LyapunovName,
) -> Result<Source, Failure> {
    for (key, given) in [
        ("model.A", model.a.is_some()),
        ("model.B", model.b.is_some()),
        ("model.plant", has_plant),
        ("model.grid", model.grid.is_some()),
        ("model.grid_points", model.grid_points.is_some()),
        ("model.range", model.range.is_some()),
    ] {
        if given {
            return door.refuse(key, "and tensor_product are both given: its file has the whole model; keep one");
        }
    }
    if lyapunov == LyapunovName::Frozen {
        let message = "is \"frozen\": the vertices of a tensor-product model are no points of it; allowed are \"common\" and \"parameter-dependent\"";
        return door.refuse("design.lyapunov", message);
    }
    tensor_product_models(door, name)
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
    Ok(Source { models, places, polytope: Some(polytope), plant: None, states: Vec::new(), transformed: None })
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
        let places = vec!["the operating point".into()];
        let states = plant.description().states.clone();
        return Ok(Source { models, places, polytope: None, plant: Some(plant), states, transformed: None });
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
    let states = plant.description().states.clone();
    Ok(Source { models, places, polytope: None, plant: Some(plant), states, transformed: None })
}
