//! The function that a model file names, with the grids of its parameters: everything that can be wrong with the file is met
//! here.

use super::file::{ModelFile, ParameterTable, SamplesTable, TransformationTable};
use crate::failure::Failure;
use crate::scenario::door::Door;
use crate::scenario::file::{WeightsTable, engineers_words, plant, toml_message};
use crate::scenario::weights::definite;
use lpv::math::Mat;
use lpv::math::matrix::from_rows;
use lpv::math::riccati;
use lpv::model::literature::LiteratureModel;
use lpv::model::tensor_product::{ParameterGrid, RankRule, TensorProductOptions, Weighting};
use lpv::model::{ModelSource, linearize};
use std::path::Path;

/// Numbers that the samples may hold: 400 MB.
const MOST_NUMBERS: usize = 50_000_000;
/// Grid points of one parameter.
const MOST_GRID_POINTS: usize = 2001;
/// Grid points of a parameter that the file says nothing about.
const GRID_POINTS: usize = 101;
/// Points within each grid cell that a hull has to hold.
const MOST_HULL_POINTS: usize = 20;
/// Points between grid points at which the error is measured.
const MOST_ERROR_POINTS: usize = 100_000;

/// Name, unit, range and number of grid points.
type Known = (String, String, [f64; 2], usize);
/// S(ρ)
type Function = Box<dyn Fn(&[f64]) -> Mat<f64> + Sync>;

/// A transformation, ready to make.
pub struct TransformationPlan {
    /// What is transformed, in words.
    pub title: String,
    /// Where a literature model is from.
    pub source: Option<&'static str>,
    /// The LPV model that is transformed; `None` of samples, and of a regulator.
    pub lpv_model: Option<ModelSource>,
    /// What is transformed is a regulator's gain and no model.
    pub is_gain: bool,
    /// The matrix-valued function.
    pub function: Function,
    /// Its parameters.
    pub grids: Vec<ParameterGrid>,
    /// How.
    pub options: TensorProductOptions,
}

/// A function with the grids that its file need not give.
struct Source {
    title: String,
    source: Option<&'static str>,
    lpv_model: Option<ModelSource>,
    is_gain: bool,
    function: Function,
    /// The parameters; `None` for samples, whose grids stand in the file.
    parameters: Option<Vec<Known>>,
    /// How many samples there are.
    samples: Option<usize>,
}

impl TransformationPlan {
    /// Read and check the model `text` of the file at `path`.
    ///
    /// # Errors
    /// Whatever is wrong with it.
    pub fn read(path: &Path, text: &str) -> Result<Self, Failure> {
        let door = Door { file: path };
        let file: ModelFile = toml::from_str(text)
            .map_err(|error| Failure::Unreadable { file: path.to_owned(), message: toml_message(text, &error) })?;
        let (model, plant, parameters) = (file.model, file.plant, &file.parameter);
        let source = match (model, plant) {
            (Some(_), Some(_)) => return door.refuse("plant", "and the table [model] are both given; keep one"),
            (None, None) => {
                return door.refuse("model", format!("is missing: give {}, samples, or a [plant]", names()));
            }
            (Some(_), None) if file.weights.is_some() => {
                return door.refuse("weights", "belongs to a [plant], whose regulator is then transformed; remove it");
            }
            (None, Some(table)) => of_plant(&door, table, file.weights)?,
            (Some(table), None) if table.contains_key("samples") => of_samples(&door, table, parameters)?,
            (Some(table), None) => of_literature(&door, table)?,
        };
        let grids = match source.parameters {
            Some(known) => known_grids(&door, known, parameters)?,
            None => own_grids(&door, parameters)?,
        };
        let count = grids.iter().try_fold(1usize, |count, grid| count.checked_mul(grid.points.len()));
        if let (Some(count), Some(samples)) = (count, source.samples)
            && count != samples
        {
            return door.refuse("model.samples", format!("holds {samples} matrices: the grids have {count} points"));
        }
        let first: Vec<f64> = grids.iter().map(|grid| grid.points[0]).collect();
        let matrix = (source.function)(&first);
        let entries = matrix.nrows() * matrix.ncols();
        match count.and_then(|count| count.checked_mul(entries)) {
            Some(numbers) if numbers <= MOST_NUMBERS => {}
            _ => {
                return door.refuse(
                    "parameter",
                    format!("the samples would hold more than {MOST_NUMBERS} numbers: take fewer grid_points"),
                );
            }
        }
        let options = options(&door, file.transformation, grids.len())?;
        let Source { title, source, lpv_model, is_gain, function, .. } = source;
        Ok(Self { title, source, lpv_model, is_gain, function, grids, options })
    }
}

fn names() -> String {
    LiteratureModel::all().map(|(name, _)| format!("name = \"{name}\"")).join(", ")
}

fn of_literature(door: &Door, table: toml::Table) -> Result<Source, Failure> {
    match table.get("name") {
        Some(toml::Value::String(name)) if LiteratureModel::named(name).is_some() => {}
        Some(name) => return door.refuse("model.name", format!("is {name}: allowed are {}", names())),
        None => return door.refuse("model.name", format!("is missing: allowed are {}", names())),
    }
    let model: LiteratureModel = table.try_into().or_else(|error: toml::de::Error| {
        door.refuse("model", engineers_words(error.to_string().trim_end()).replace('\n', " "))
    })?;
    let name = LiteratureModel::all().into_iter().find(|(name, _)| model.is(name)).map_or("", |(name, _)| name);
    if let Err(error) = model.check() {
        return door.refuse("model", error.to_string());
    }
    let parameters =
        model.parameters().into_iter().map(|p| (p.name.into(), p.unit.into(), p.range, p.grid_points)).collect();
    Ok(Source {
        title: format!("[A B] of {name}"),
        source: Some(model.source()),
        lpv_model: Some(ModelSource::Literature(model)),
        is_gain: false,
        function: Box::new(move |rho| model.at(rho)),
        parameters: Some(parameters),
        samples: None,
    })
}

fn of_plant(door: &Door, table: toml::Table, weights: Option<WeightsTable>) -> Result<Source, Failure> {
    let spec = plant(door, table)?;
    let plant = spec.build().or_else(|error| door.refuse("plant", error.to_string()))?;
    let description = plant.description();
    let Some(scheduling) = description.scheduling.clone() else {
        let message = format!("\"{}\" has no scheduling parameter: there is nothing to transform", description.name);
        return door.refuse("plant", message);
    };
    let (name, parameters) =
        (description.name.clone(), Some(vec![(scheduling.parameter, scheduling.unit, scheduling.range, GRID_POINTS)]));
    let Some(weights) = weights else {
        let function: Function = Box::new(move |rho| {
            let point = linearize(&*plant, rho[0]);
            let n = point.a.ncols();
            Mat::from_fn(n, n + point.b.ncols(), |i, j| if j < n { point.a[(i, j)] } else { point.b[(i, j - n)] })
        });
        let lpv_model = Some(ModelSource::Plant(spec));
        let title = format!("[A B] of {name}");
        return Ok(Source { title, source: None, lpv_model, is_gain: false, function, parameters, samples: None });
    };
    let (n, m) = (description.states.len(), description.inputs.len());
    let q = definite(door, "weights.Q", weights.q, weights.q_diag, n)?;
    let r = definite(door, "weights.R", weights.r, weights.r_diag, m)?;
    let function: Function = Box::new(move |rho| {
        let point = linearize(&*plant, rho[0]);
        // without a gain there is no number: the transformation says where
        riccati::solve(&point.a, &point.b, &q, &r)
            .map_or_else(|_| Mat::from_fn(m, n, |_, _| f64::NAN), |regulator| regulator.k)
    });
    let title = format!("the regulator K of {name}, u = -Kx");
    Ok(Source { title, source: None, lpv_model: None, is_gain: true, function, parameters, samples: None })
}

fn of_samples(door: &Door, table: toml::Table, parameters: &[ParameterTable]) -> Result<Source, Failure> {
    let SamplesTable { samples } = table.try_into().or_else(|error: toml::de::Error| {
        door.refuse("model", engineers_words(error.to_string().trim_end()).replace('\n', " "))
    })?;
    let rows = samples.first().map_or(0, Vec::len);
    let cols = samples.first().and_then(|matrix| matrix.first()).map_or(0, Vec::len);
    for (k, matrix) in samples.iter().enumerate() {
        let key = format!("model.samples[{}]", k + 1);
        if rows * cols == 0 || matrix.len() != rows || matrix.iter().any(|row| row.len() != cols) {
            return door.refuse(key, "has another size than the first sample, or no entries");
        }
        for value in matrix.iter().flatten() {
            door.finite(&key, *value)?;
        }
    }
    if samples.is_empty() {
        return door.refuse("model.samples", "is empty: give one matrix for each grid point");
    }
    let (count, grids) = (samples.len(), own_grids(door, parameters)?);
    let matrices: Vec<Mat<f64>> = samples.iter().map(|matrix| from_rows(matrix)).collect();
    Ok(Source {
        title: "samples".into(),
        source: None,
        lpv_model: None,
        is_gain: false,
        function: Box::new(move |rho| interpolated(&matrices, &grids, rho)),
        parameters: None,
        samples: Some(count),
    })
}

/// Samples interpolated linearly in each parameter; zero where there are fewer than grid points, which is refused later.
fn interpolated(samples: &[Mat<f64>], grids: &[ParameterGrid], rho: &[f64]) -> Mat<f64> {
    let corners = grids.iter().zip(rho).fold(vec![(0, 1.0)], |corners, (grid, value)| {
        let (k, t) = grid.cell(*value);
        let ends = [(k, 1.0 - t), (k + 1, t)];
        let count = grid.points.len();
        let next = |(index, weight): (usize, f64)| ends.map(|(end, part)| (index * count + end, weight * part));
        corners.into_iter().flat_map(next).filter(|(_, weight)| *weight > 0.0).collect()
    });
    let zero = Mat::zeros(samples[0].nrows(), samples[0].ncols());
    corners
        .into_iter()
        .filter_map(|(index, weight)| samples.get(index).map(|sample| (sample, weight)))
        .fold(zero, |sum, (sample, weight)| {
            Mat::from_fn(sum.nrows(), sum.ncols(), |i, j| sum[(i, j)] + weight * sample[(i, j)])
        })
}

/// The grids of a function whose parameters are known: the file may change range and number, by the parameter's name.
fn known_grids(door: &Door, known: Vec<Known>, tables: &[ParameterTable]) -> Result<Vec<ParameterGrid>, Failure> {
    let allowed = known.iter().map(|(name, ..)| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    for (k, table) in tables.iter().enumerate() {
        let key = format!("parameter[{}].name", k + 1);
        if !known.iter().any(|(name, ..)| *name == table.name) {
            return door.refuse(key, format!("\"{}\" is no parameter of the model: allowed are {allowed}", table.name));
        }
        if tables[..k].iter().any(|other| other.name == table.name) {
            return door.refuse(key, format!("\"{}\" is already there; keep one", table.name));
        }
    }
    let grid = |(name, unit, range, count): Known| match tables.iter().enumerate().find(|(_, table)| table.name == name)
    {
        Some((k, table)) => grid(door, &format!("parameter[{}]", k + 1), table, &unit, Some(range), count),
        None => Ok(ParameterGrid::equidistant(&name, &unit, range, count)),
    };
    known.into_iter().map(grid).collect()
}

/// The grids of samples: all in the file.
fn own_grids(door: &Door, tables: &[ParameterTable]) -> Result<Vec<ParameterGrid>, Failure> {
    if tables.is_empty() {
        return door.refuse("parameter", "there is none; samples need a [[parameter]] table for each parameter");
    }
    let own = tables.iter().enumerate().map(|(k, table)| {
        let unit = table.unit.as_deref().unwrap_or("1");
        grid(door, &format!("parameter[{}]", k + 1), table, unit, None, GRID_POINTS)
    });
    own.collect()
}

fn grid(
    door: &Door,
    key: &str,
    table: &ParameterTable,
    unit: &str,
    range: Option<[f64; 2]>,
    count: usize,
) -> Result<ParameterGrid, Failure> {
    let unit = table.unit.as_deref().unwrap_or(unit);
    if let Some(values) = &table.values {
        if table.range.is_some() || table.grid_points.is_some() {
            return door.refuse(format!("{key}.values"), "and range or grid_points are both given; keep one");
        }
        for value in values {
            door.finite(&format!("{key}.values"), *value)?;
        }
        if !(2..=MOST_GRID_POINTS).contains(&values.len()) || values.windows(2).any(|ends| ends[0] >= ends[1]) {
            let message = format!("has to hold 2 to {MOST_GRID_POINTS} numbers in ascending order");
            return door.refuse(format!("{key}.values"), message);
        }
        return Ok(ParameterGrid { name: table.name.clone(), unit: unit.into(), points: values.clone() });
    }
    let (low, high) = match (table.range.as_deref(), range) {
        (Some(&[low, high]), _) | (None, Some([low, high])) => (low, high),
        (Some(other), _) => {
            let message = format!("has {} numbers: it has two, the least and the largest", other.len());
            return door.refuse(format!("{key}.range"), message);
        }
        (None, None) => return door.refuse(key, "has neither values nor a range"),
    };
    if !(low.is_finite() && high.is_finite() && (high - low).is_finite() && low < high) {
        return door.refuse(format!("{key}.range"), format!("is [{low}, {high}]: it has to rise, and be finite"));
    }
    let count = table.grid_points.unwrap_or(count);
    if !(2..=MOST_GRID_POINTS).contains(&count) {
        return door.refuse(format!("{key}.grid_points"), format!("is {count}: allowed are 2 to {MOST_GRID_POINTS}"));
    }
    let grid = ParameterGrid::equidistant(&table.name, unit, [low, high], count);
    match grid.points.windows(2).all(|ends| ends[0] < ends[1]) {
        true => Ok(grid),
        false => door.refuse(format!("{key}.range"), format!("[{low}, {high}] is too narrow for {count} grid points")),
    }
}

fn options(door: &Door, table: TransformationTable, parameters: usize) -> Result<TensorProductOptions, Failure> {
    let defaults = TensorProductOptions::default();
    let fits = |key: &str, count: usize| match count == 1 || count == parameters {
        true => Ok(()),
        false => door.refuse(
            format!("transformation.{key}"),
            format!("has {count} entries: give one, or one for each of the {parameters} parameters"),
        ),
    };
    let ranks = match (table.tolerance, table.ranks) {
        (Some(_), Some(_)) => {
            return door.refuse("transformation.ranks", "and tolerance are both given; keep one");
        }
        (Some(tolerances), None) => {
            let list = tolerances.list();
            fits("tolerance", list.len())?;
            if let Some(bad) = list.iter().find(|value| !(0.0..1.0).contains(*value)) {
                let message = format!("is {bad}: it has to lie in [0, 1), as a part of the largest singular value");
                return door.refuse("transformation.tolerance", message);
            }
            list.into_iter().map(RankRule::Tolerance).collect()
        }
        (None, Some(ranks)) => {
            let list = ranks.list();
            fits("ranks", list.len())?;
            if list.contains(&0) {
                return door.refuse("transformation.ranks", "holds 0: at least one singular value has to be kept");
            }
            list.into_iter().map(RankRule::Count).collect()
        }
        (None, None) => defaults.ranks,
    };
    let weightings = match table.weights {
        None => defaults.weightings,
        Some(weights) => {
            let list = weights.list();
            fits("weights", list.len())?;
            list.iter().map(|name| weighting(door, name)).collect::<Result<_, _>>()?
        }
    };
    let error_points = table.error_points.unwrap_or(defaults.error_points);
    if error_points > MOST_ERROR_POINTS {
        let message = format!("is {error_points}: allowed are 0 to {MOST_ERROR_POINTS}");
        return door.refuse("transformation.error_points", message);
    }
    let hull_points = table.hull_points.unwrap_or(defaults.hull_points);
    if hull_points > MOST_HULL_POINTS {
        let message = format!("is {hull_points}: allowed are 0 to {MOST_HULL_POINTS} in each grid cell");
        return door.refuse("transformation.hull_points", message);
    }
    Ok(TensorProductOptions { ranks, weightings, hull_points, error_points })
}

fn weighting(door: &Door, name: &str) -> Result<Weighting, Failure> {
    match Weighting::ALL.iter().find(|(known, _)| *known == name) {
        Some((_, kind)) => Ok(*kind),
        None => {
            let allowed = Weighting::ALL.map(|(known, _)| format!("\"{known}\"")).join(", ");
            door.refuse("transformation.weights", format!("\"{name}\" is not a kind of weights: allowed are {allowed}"))
        }
    }
}
