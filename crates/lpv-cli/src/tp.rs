//! `lpv tp`: the tensor-product transformation of a model.

mod file;
mod model;

use crate::failure::Failure;
use crate::folder::ResultFile;
use crate::output::{OutputArguments, print};
use crate::scenario::read_text;
use clap::Args;
use lpv::math::decimal::{at_most, fixed};
use lpv::math::matrix::to_rows;
use lpv::model::ModelSource;
use lpv::model::tensor_product::{Accuracy, HullQuality, TensorProductError, TensorProductModel, Weighting};
pub use model::TransformationPlan;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `lpv tp`.
#[derive(Args)]
pub struct TpArguments {
    /// Model file: a literature model or a plant by name, or samples
    file: PathBuf,
    #[command(flatten)]
    output: OutputArguments,
}

/// What the JSON says that it is; of another number its keys mean something else.
pub const FORMAT: &str = "lpv tp 1";

#[derive(Serialize)]
struct TpRecord<'a> {
    format: &'static str,
    model: &'a str,
    /// The function that was transformed, where it is an LPV model with a name: what a design is proved for.
    lpv_model: &'a Option<ModelSource>,
    /// It is a regulator's gain and no model.
    is_gain: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    source: Option<&'static str>,
    /// Rows and columns of the matrices.
    size: [usize; 2],
    parameters: Vec<ParameterRecord<'a>>,
    accuracy: &'a Accuracy,
    /// For each entry, row after row: the parameters that it depends on.
    dependencies: Vec<Vec<Vec<&'a str>>>,
    /// Vertex matrices with the number of the weight of each parameter, from 1.
    vertices: Vec<Vertex>,
    seconds: f64,
}

#[derive(Serialize)]
struct ParameterRecord<'a> {
    name: &'a str,
    unit: &'a str,
    grid: &'a [f64],
    singular_values: &'a [f64],
    rank: usize,
    weighting: Weighting,
    hull: &'a HullQuality,
    /// One row for each grid point.
    weights: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct Vertex {
    weights: Vec<usize>,
    matrix: Vec<Vec<f64>>,
}

/// Transform the model; the answer goes to standard output, and as JSON to the file of `--out`.
pub fn run(arguments: &TpArguments) -> Result<(), Failure> {
    let plan = TransformationPlan::read(&arguments.file, &read_text(&arguments.file)?)?;
    let output = &arguments.output;
    let place = output.out.as_deref().map(|place| ResultFile::begin(place, output.force)).transpose()?;
    let started = Instant::now();
    let model = TensorProductModel::of(&*plan.function, &plan.grids, &plan.options)
        .map_err(|error| refusal(&arguments.file, &error))?;
    let record = record(&plan, &model, started.elapsed().as_secs_f64());
    let json = serde_json::to_string_pretty(&record).map_err(|error| Failure::serialisation(&error))?;
    if let Some(place) = place {
        place.finish(json.as_bytes())?;
    }
    print(&if output.json { json } else { text(&record) })
}

/// A transformation that cannot be made, in the words of its file.
pub fn refusal(file: &Path, error: &TensorProductError) -> Failure {
    let key = match error {
        TensorProductError::NoParameter | TensorProductError::Grid { .. } => "parameter",
        TensorProductError::NoRule | TensorProductError::Rank { .. } => "transformation.ranks",
        TensorProductError::BoxTooLarge { .. }
        | TensorProductError::HullTooLarge { .. }
        | TensorProductError::NotRelaxed { .. } => "transformation.weights",
        TensorProductError::Value { .. } | TensorProductError::Zero | TensorProductError::NotConverged { .. } => {
            "model"
        }
    };
    Failure::BadInput { file: file.to_owned(), key: key.into(), message: error.to_string() }
}

fn record<'a>(plan: &'a TransformationPlan, model: &'a TensorProductModel, seconds: f64) -> TpRecord<'a> {
    let [rows, cols] = model.size;
    let parameters = model.weights.iter().enumerate().map(|(n, weights)| ParameterRecord {
        name: &weights.grid.name,
        unit: &weights.grid.unit,
        grid: &weights.grid.points,
        singular_values: &model.singular_values[n],
        rank: model.ranks[n],
        weighting: weights.kind,
        hull: &weights.hull,
        weights: to_rows(&weights.values),
    });
    let depends = |i: usize, j: usize| {
        let names = plan.grids.iter().zip(&model.dependencies[i * cols + j]);
        names.filter(|(_, depends)| **depends).map(|(grid, _)| grid.name.as_str()).collect()
    };
    let counts: Vec<usize> = model.weights.iter().map(|weights| weights.count()).collect();
    let matrices = model.core.entries().chunks(rows * cols).enumerate().map(|(mut index, entries)| {
        let mut weights = vec![0; counts.len()];
        for (number, count) in weights.iter_mut().zip(&counts).rev() {
            *number = index % count + 1;
            index /= count;
        }
        Vertex { weights, matrix: entries.chunks(cols).map(<[f64]>::to_vec).collect() }
    });
    TpRecord {
        format: FORMAT,
        model: &plan.title,
        lpv_model: &plan.lpv_model,
        is_gain: plan.is_gain,
        source: plan.source,
        size: model.size,
        parameters: parameters.collect(),
        accuracy: &model.accuracy,
        dependencies: (0..rows).map(|i| (0..cols).map(|j| depends(i, j)).collect()).collect(),
        vertices: matrices.collect(),
        seconds,
    }
}

/// Singular values that the text shows.
const SHOWN: usize = 8;

fn text(record: &TpRecord) -> String {
    let numbers = |values: &[f64]| values.iter().map(|value| fixed(*value, 4)).collect::<Vec<_>>().join(" ");
    let mut text = format!("model            {}, {} x {}\n", record.model, record.size[0], record.size[1]);
    if let Some(source) = record.source {
        text += &format!("source           {source}\n");
    }
    for parameter in &record.parameters {
        let grid = parameter.grid;
        let shown: Vec<String> =
            parameter.singular_values.iter().take(SHOWN).map(|value| format!("{value:.8e}")).collect();
        let more = if parameter.singular_values.len() > SHOWN { " …" } else { "" };
        let hull = parameter.hull;
        text += &format!(
            "\nparameter        {} [{}], {} points over [{:.6}, {:.6}]\nsingular values  {}{more}\nkept             {}\nweights          {} {}\n  least          {}\n  largest        {}\n  sum error      {}\n  volume ratio   {:.6}\n",
            parameter.name,
            parameter.unit,
            grid.len(),
            grid[0],
            grid[grid.len() - 1],
            shown.join(" "),
            parameter.rank,
            hull.minima.len(),
            kind_name(parameter.weighting),
            numbers(&hull.minima),
            numbers(&hull.maxima),
            at_most(hull.sum_error),
            hull.volume_ratio,
        );
    }
    text += &format!("\nvertices         {}\n", record.vertices.len());
    let accuracy = record.accuracy;
    text += &format!(
        "error            {} largest at the grid points; norm {}, bound {}\n",
        at_most(accuracy.grid_max),
        at_most(accuracy.grid_norm),
        at_most(accuracy.bound)
    );
    if accuracy.between_points > 0 {
        text += &format!(
            "between them     {} largest, {} rms at {} points\n",
            at_most(accuracy.between_max),
            at_most(accuracy.between_rms),
            accuracy.between_points
        );
    }
    text += "depends\n";
    for (i, row) in record.dependencies.iter().enumerate() {
        for (j, names) in row.iter().enumerate().filter(|(_, names)| !names.is_empty()) {
            text += &format!("  {:15}{}\n", format!("({}, {})", i + 1, j + 1), names.join(", "));
        }
    }
    text
}

fn kind_name(kind: Weighting) -> &'static str {
    Weighting::ALL.iter().find(|(_, known)| *known == kind).map_or("", |(name, _)| name)
}
