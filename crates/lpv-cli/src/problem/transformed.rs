//! The model of a problem from a tensor-product model: the file of one, transformed here, or the JSON that `lpv tp` wrote.

use super::source::Source;
use crate::certify::polytopic::Transformed;
use crate::failure::Failure;
use crate::scenario::door::Door;
use crate::scenario::engineers_words;
use crate::tp::{FORMAT, TransformationPlan, refusal};
use lpv::math::Mat;
use lpv::math::matrix::from_rows;
use lpv::model::tensor_product::{ParameterGrid, ScheduledParameter, TensorProductModel, TensorProductSchedule};
use lpv::model::{ModelSource, Polytope};
use lpv::plant::Signal;
use serde::Deserialize;
use std::path::Path;

const KEY: &str = "model.tensor_product";

/// What is read of the JSON of `lpv tp`; the rest is let be.
#[derive(Deserialize)]
struct TransformedFile {
    lpv_model: Option<ModelSource>,
    is_gain: bool,
    size: [usize; 2],
    parameters: Vec<ParameterPart>,
    vertices: Vec<VertexPart>,
}

#[derive(Deserialize)]
struct ParameterPart {
    name: String,
    unit: String,
    grid: Vec<f64>,
    weights: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct VertexPart {
    weights: Vec<usize>,
    matrix: Vec<Vec<f64>>,
}

/// [A B] at the vertices, with their weights.
struct Parts {
    transformed: Transformed,
    matrices: Vec<Mat<f64>>,
    is_gain: bool,
}

/// The vertices of the tensor-product model in the file `name`, which stands beside the problem file unless its path is absolute.
pub(super) fn tensor_product_models(door: &Door, name: &str) -> Result<Source, Failure> {
    let path = door.file.parent().unwrap_or_else(|| Path::new("")).join(name);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) => {
            let allowed =
                "it names a model file of lpv tp (TOML) or the JSON that lpv tp writes, from the folder of this file";
            return door.refuse(KEY, format!("is {name:?}: {} cannot be read ({error}); {allowed}", path.display()));
        }
    };
    let parts = if text.trim_start().starts_with('{') { written(&path, &text)? } else { made(&path, &text)? };
    let file = Door { file: &path };
    if parts.is_gain {
        return file
            .refuse("weights", "make this the model of a regulator's gain K: a design needs [A B]; remove them");
    }
    let (n, width) = (parts.matrices[0].nrows(), parts.matrices[0].ncols());
    if width <= n {
        let message = format!("has matrices of {n} × {width}: [A B] has more columns than rows");
        return door.refuse(KEY, format!("{name:?} {message}"));
    }
    parts.transformed.check(&file, "parameters", parts.matrices.len())?;
    let part = |from: usize, to: usize| {
        let of = |matrix: &Mat<f64>| Mat::from_fn(n, to - from, |i, j| matrix[(i, from + j)]);
        parts.matrices.iter().map(of).collect::<Vec<_>>()
    };
    let polytope = Polytope::new(part(0, n), part(n, width)).or_else(|error| door.refuse(KEY, error.to_string()))?;
    let schedule = &parts.transformed.parameters;
    let place = |vertex: usize| {
        let numbers: Vec<String> = schedule.numbers(vertex).iter().map(|number| (number + 1).to_string()).collect();
        format!("vertex {}", numbers.join(","))
    };
    let states = match &parts.transformed.source {
        Some(source) => source.build().or_else(|error| file.refuse("model", error.to_string()))?.states,
        None => Vec::new(),
    };
    if !states.is_empty() && states.len() != n {
        return file.refuse("lpv_model", format!("has {} states, and the vertices have {n}", states.len()));
    }
    Ok(Source {
        models: (0..polytope.len()).map(|vertex| polytope.vertex(vertex)).collect(),
        places: (0..polytope.len()).map(place).collect(),
        polytope: Some(polytope),
        plant: None,
        states,
        transformed: Some(parts.transformed),
    })
}

/// From a model file: transformed now.
fn made(path: &Path, text: &str) -> Result<Parts, Failure> {
    let plan = TransformationPlan::read(path, text)?;
    let door = Door { file: path };
    for (grid, n) in plan.grids.iter().zip(0..) {
        let kind = plan.options.weightings[n.min(plan.options.weightings.len() - 1)];
        if !kind.is_convex() {
            let message = format!(
                "of {} may be negative: the vertices then hold no model between them; allowed are \"cno\", \"snnn\", \"ino\", \"ino-rno\" and \"box\"",
                grid.name
            );
            return door.refuse("transformation.weights", message);
        }
    }
    let model =
        TensorProductModel::of(&*plan.function, &plan.grids, &plan.options).map_err(|error| refusal(path, &error))?;
    let transformed = Transformed { source: plan.lpv_model, parameters: model.schedule() };
    Ok(Parts { transformed, matrices: model.vertices(), is_gain: plan.is_gain })
}

/// From what `lpv tp` wrote.
fn written(path: &Path, text: &str) -> Result<Parts, Failure> {
    let door = Door { file: path };
    let unreadable = |message: String| Failure::Unreadable { file: path.to_owned(), message };
    let map: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(text).map_err(|error| unreadable(engineers_words(&error.to_string())))?;
    match map.get("format").and_then(|format| format.as_str()) {
        Some(format) if format == FORMAT => {}
        Some(other) => {
            return door.refuse("format", format!("is {other:?}: allowed is {FORMAT:?}; write it again with lpv tp"));
        }
        None => {
            let message = format!("is missing: allowed is {FORMAT:?}, as lpv tp writes it");
            return door.refuse("format", message);
        }
    }
    let file: TransformedFile = serde_json::from_value(serde_json::Value::Object(map))
        .map_err(|error| unreadable(format!("is not what lpv tp writes: {}", engineers_words(&error.to_string()))))?;
    let parameter = |part: ParameterPart| ScheduledParameter {
        grid: ParameterGrid { name: part.name, unit: part.unit, points: part.grid },
        weights: part.weights,
    };
    let parameters = TensorProductSchedule { parameters: file.parameters.into_iter().map(parameter).collect() };
    if let Err(error) = parameters.check() {
        return door.refuse("parameters", error.to_string());
    }
    if file.vertices.len() != parameters.vertices() {
        let message = format!("has {} matrices: the weights make {}", file.vertices.len(), parameters.vertices());
        return door.refuse("vertices", message);
    }
    let [rows, columns] = file.size;
    let mut matrices = Vec::new();
    for (at, vertex) in file.vertices.iter().enumerate() {
        let key = format!("vertices[{}]", at + 1);
        let numbers: Vec<usize> = parameters.numbers(at).iter().map(|number| number + 1).collect();
        if vertex.weights != numbers {
            let message = format!(
                "is of the weights {:?}: here come those of {numbers:?}, the last parameter first",
                vertex.weights
            );
            return door.refuse(key, message);
        }
        let is_sized =
            rows * columns > 0 && vertex.matrix.len() == rows && vertex.matrix.iter().all(|row| row.len() == columns);
        if !is_sized {
            return door.refuse(key, format!("has to be a {rows} × {columns} matrix, as size says"));
        }
        for value in vertex.matrix.iter().flatten() {
            door.finite(&key, *value)?;
        }
        matrices.push(from_rows(&vertex.matrix));
    }
    Ok(Parts { transformed: Transformed { source: file.lpv_model, parameters }, matrices, is_gain: file.is_gain })
}

/// What an initial state of a model whose parameters are states has to be: within their ranges, where the model is one.
pub(super) fn check_initial(
    door: &Door,
    x: &[f64],
    given: Option<&[f64]>,
    transformed: &Transformed,
    states: &[Signal],
) -> Result<(), Failure> {
    let Some(model) = transformed.source.as_ref().and_then(|source| source.build().ok()) else { return Ok(()) };
    let pairs = || model.parameters.iter().zip(&transformed.parameters.parameters);
    if given.is_some() && model.parameters.iter().any(|parameter| parameter.state.is_some()) {
        let names: Vec<&str> = model.parameters.iter().filter(|p| p.state.is_some()).map(|p| p.name.as_str()).collect();
        let message = format!(
            "is given for a model whose parameters are states ({}): initial_state says where they start; remove it",
            names.join(", ")
        );
        return door.refuse("design.initial_parameter", message);
    }
    for (parameter, ScheduledParameter { grid, .. }) in pairs() {
        let Some(i) = parameter.state else { continue };
        let (low, high) = (grid.points[0], grid.points[grid.points.len() - 1]);
        if !(low <= x[i] && x[i] <= high) {
            let message = format!(
                "is {}: the state {} is a parameter of the model, whose range is [{low}, {high}]",
                x[i], states[i].name
            );
            return door.refuse(format!("design.initial_state[{}]", i + 1), message);
        }
    }
    Ok(())
}
