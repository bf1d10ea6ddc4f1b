//! The tensor-product (TP) model transformation (2.7): a matrix-valued function of several parameters as
//!
//! S(ρ) ≈ Σ w₁ᵢ₁(ρ₁) … w_Nᵢ_N(ρ_N) S_{i₁…i_N},
//!
//! found from samples by higher-order singular value decomposition (P. Baranyi, "TP model transformation as a way to
//! LMI-based controller design", IEEE Trans. Industrial Electronics 51(2), 2004; P. Baranyi, Y. Yam and P. Várlaki, "Tensor
//! Product Model Transformation in Polytopic Model-Based Control", CRC Press, 2013). The function may be an LPV model
//! [A(ρ) B(ρ)] or a scheduled gain K(ρ) (4.2.3).
//!
//! Nothing is said here about stability, and the error between grid points is measured, not bounded.

mod error;
mod minimum_volume;
mod sampling;
mod schedule;
mod simplex;
mod weighting;

pub use error::TensorProductError;
pub use sampling::{MatrixOf, ParameterGrid};
pub use schedule::{ScheduleError, ScheduledParameter, TensorProductSchedule};
pub use weighting::{HullQuality, WeightFunctions, Weighting};

use crate::math::Mat;
use crate::math::hosvd::{ModeDecomposition, decompose_mode};
use crate::math::tensor::Tensor;
use sampling::{dependencies, point, sample};
use serde::{Deserialize, Serialize};
use weighting::Coordinates;

/// How many singular values of a parameter are kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RankRule {
    /// Those above this part of the largest.
    Tolerance(f64),
    /// This many, or all if there are fewer.
    Count(usize),
}

/// Options of [`TensorProductModel::of`].
#[derive(Clone, Debug, PartialEq)]
pub struct TensorProductOptions {
    /// One for each parameter; the last goes on for those after it.
    pub ranks: Vec<RankRule>,
    /// One for each parameter; the last goes on for those after it.
    pub weightings: Vec<Weighting>,
    /// Points within each grid cell that the hull has to hold besides the grid points; they are sampled for it. A hull of the
    /// grid points alone leaves out a little of the curve between them.
    pub hull_points: usize,
    /// Points between grid points at which the error is measured, at most.
    pub error_points: usize,
}

impl Default for TensorProductOptions {
    /// Exact rank (singular values above 10⁻¹² of the largest), CNO around the grid points, 2000 points.
    fn default() -> Self {
        Self {
            ranks: vec![RankRule::Tolerance(1e-12)],
            weightings: vec![Weighting::Cno],
            hull_points: 0,
            error_points: 2000,
        }
    }
}

/// How far a TP model is from its function.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Accuracy {
    /// Bound of the Frobenius norm of the error over all grid points: (Σₙ ‖F − F ×ₙ Πₙ‖²)^½ with the orthogonal projectors Πₙ
    /// on the spaces of the weights. If the constant lies in the range of the kept singular vectors, this is the bound Σₙ Σ_{discarded} σ² of De Lathauwer et al.
    pub bound: f64,
    /// The Frobenius norm of the error over all grid points.
    pub grid_norm: f64,
    /// The largest error of an entry at the grid points.
    pub grid_max: f64,
    /// The largest error of an entry at points between the grid points.
    pub between_max: f64,
    /// Root mean square error of the entries there.
    pub between_rms: f64,
    /// Where between the grid points the error is largest.
    pub between_at: Vec<f64>,
    /// How many points that is of.
    pub between_points: usize,
}

/// A tensor-product model.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TensorProductModel {
    /// Rows and columns of the matrices.
    pub size: [usize; 2],
    /// All singular values of the unfolding of each parameter.
    pub singular_values: Vec<Vec<f64>>,
    /// How many of them are kept.
    pub ranks: Vec<usize>,
    /// The weighting functions of each parameter.
    pub weights: Vec<WeightFunctions>,
    /// Vertex matrices, k₁ × … × k_N × rows × columns.
    pub core: Tensor,
    /// For each entry of the matrix, in row order: which parameters it depends on.
    pub dependencies: Vec<Vec<bool>>,
    /// How far it is from the function.
    pub accuracy: Accuracy,
    /// From new samples to the points of the weights.
    #[serde(skip)]
    projections: Vec<Projection>,
}

/// Map from a slice s of samples at one value of a parameter to its point: y = sM − b.
#[derive(Clone, Debug)]
struct Projection {
    /// M, (slice entries) × (k − 1).
    map: Mat<f64>,
    /// b
    offset: Vec<f64>,
}

impl TensorProductModel {
    /// The TP model of `function` over the grids of its parameters.
    ///
    /// # Errors
    /// Grids or rules that make no sense, a function that is not finite, zero, or whose size changes.
    pub fn of(
        function: MatrixOf,
        parameters: &[ParameterGrid],
        options: &TensorProductOptions,
    ) -> Result<Self, TensorProductError> {
        let size = check(function, parameters, options)?;
        let grids: Vec<Vec<f64>> = parameters.iter().map(|parameter| parameter.points.clone()).collect();
        let samples = sample(function, &grids, size);
        let entries = size.0 * size.1;
        if let Some(index) = samples.entries().iter().position(|entry| !entry.is_finite()) {
            let rho = point(&grids, index / entries);
            return Err(TensorProductError::Value { rows: size.0, cols: size.1, rho });
        }
        if samples.norm_max() == 0.0 {
            return Err(TensorProductError::Zero);
        }
        let mut model = Self::of_samples(function, &samples, parameters, options, size)?;
        model.measure(function, &samples, options.error_points);
        Ok(model)
    }

    fn of_samples(
        function: MatrixOf,
        samples: &Tensor,
        parameters: &[ParameterGrid],
        options: &TensorProductOptions,
        size: (usize, usize),
    ) -> Result<Self, TensorProductError> {
        let norm = samples.norm();
        let (mut singular_values, mut ranks, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        let (mut bound, mut projections) = (0.0, Vec::new());
        let mut coefficients = samples.clone();
        for (n, parameter) in parameters.iter().enumerate() {
            let not_converged = || TensorProductError::NotConverged { parameter: parameter.name.clone() };
            let decomposition = decompose_mode(samples, n).ok_or_else(not_converged)?;
            let rank = kept(&decomposition, rule(&options.ranks, n));
            let discarded =
                decomposition.singular_values[rank..].iter().map(|value| (value / norm).powi(2)).sum::<f64>();
            let left = Mat::from_fn(parameter.points.len(), rank, |i, j| decomposition.left[(i, j)]);
            let coordinates = Coordinates::of(&left, discarded.sqrt()).ok_or_else(not_converged)?;
            let projection = Projection::of(&decomposition, &coordinates);
            let between = between(function, parameters, n, options.hull_points, size, &projection);
            let kind = *rule_of(&options.weightings, n);
            let functions = WeightFunctions::new(parameter.clone(), kind, coordinates.points, &between)?;
            projections.push(projection);
            let project = orthogonal(&functions.points);
            bound = f64::hypot(bound, residual(samples, n, &functions.points, &project));
            coefficients = coefficients.mode_product(n, &project);
            singular_values.push(decomposition.singular_values);
            ranks.push(rank);
            weights.push(functions);
        }
        let core = (weights.iter().enumerate())
            .fold(coefficients, |core, (n, functions)| core.mode_product(n, &functions.vertices()));
        let accuracy = Accuracy {
            bound,
            grid_norm: 0.0,
            grid_max: 0.0,
            between_max: 0.0,
            between_rms: 0.0,
            between_at: Vec::new(),
            between_points: 0,
        };
        let dependencies = dependencies(samples, parameters.len());
        Ok(Self { size: [size.0, size.1], singular_values, ranks, weights, core, dependencies, accuracy, projections })
    }

    /// The weights as a controller evaluates them: on the grid, linear in between.
    pub fn schedule(&self) -> TensorProductSchedule {
        let of = |weights: &WeightFunctions| ScheduledParameter::new(weights.grid.clone(), &weights.values);
        TensorProductSchedule { parameters: self.weights.iter().map(of).collect() }
    }

    /// The vertex matrices, the last parameter's weight running fastest.
    pub fn vertices(&self) -> Vec<Mat<f64>> {
        let [rows, cols] = self.size;
        let matrix = |entries: &[f64]| Mat::from_fn(rows, cols, |i, j| entries[i * cols + j]);
        self.core.entries().chunks(rows * cols).map(matrix).collect()
    }

    /// The TP model's matrix for given weights of each parameter: the core contracted with them.
    pub fn combine(&self, weights: &[Vec<f64>]) -> Mat<f64> {
        let row = |w: &Vec<f64>| Mat::from_fn(1, w.len(), |_, j| w[j]);
        let sum = weights.iter().enumerate().fold(self.core.clone(), |core, (n, w)| core.mode_product(n, &row(w)));
        Mat::from_fn(self.size[0], self.size[1], |i, j| sum.entries()[i * self.size[1] + j])
    }

    /// The matrix at ρ from interpolated weights: all that a saved model needs.
    pub fn interpolated(&self, rho: &[f64]) -> Mat<f64> {
        let weights: Vec<Vec<f64>> = self.weights.iter().zip(rho).map(|(w, value)| w.interpolated(*value)).collect();
        self.combine(&weights)
    }

    /// The weights of parameter `n` (from 0) at `value`, re-sampled through `function` (the one the model is of) and clamped to
    /// the range: the slice of the function at this value, over the grids of the others, in the coordinates of the weights.
    ///
    /// A model read from a file has [`interpolated`](WeightFunctions::interpolated) weights only: it answers with those.
    ///
    /// # Panics
    /// If there is no such parameter.
    pub fn weights_at(&self, function: MatrixOf, n: usize, value: f64) -> Vec<f64> {
        let Some(projection) = self.projections.get(n) else {
            return self.weights[n].interpolated(value);
        };
        let mut grids: Vec<Vec<f64>> = self.weights.iter().map(|w| w.grid.points.clone()).collect();
        grids[n] = vec![self.weights[n].grid.clamp(value)];
        let slice = sample(function, &grids, (self.size[0], self.size[1]));
        self.weights[n].at_point(&projection.point(slice.entries()))
    }

    /// The matrix at ρ from re-sampled weights.
    pub fn at(&self, function: MatrixOf, rho: &[f64]) -> Mat<f64> {
        let weights: Vec<Vec<f64>> =
            rho.iter().enumerate().map(|(n, value)| self.weights_at(function, n, *value)).collect();
        self.combine(&weights)
    }

    /// The errors at the grid points and in the interior of at most `most` cells.
    fn measure(&mut self, function: MatrixOf, samples: &Tensor, most: usize) {
        let values = self.weights.iter().map(|w| &w.values);
        let built = values.enumerate().fold(self.core.clone(), |core, (n, w)| core.mode_product(n, w));
        let differences = built.entries().iter().zip(samples.entries()).map(|(a, b)| a - b).collect();
        let error = Tensor::new(samples.shape().to_vec(), differences);
        self.accuracy.grid_norm = error.norm();
        self.accuracy.grid_max = error.norm_max();

        // the golden section is on no equidistant subdivision, whose points a hull may hold
        let inside = (5f64.sqrt() - 1.0) / 2.0;
        let insides: Vec<Vec<f64>> = (self.weights.iter())
            .map(|w| w.grid.points.windows(2).map(|ends| ends[0] + inside * (ends[1] - ends[0])).collect())
            .collect();
        let weights: Vec<Vec<Vec<f64>>> = (insides.iter().enumerate())
            .map(|(n, values)| values.iter().map(|value| self.weights_at(function, n, *value)).collect())
            .collect();
        let cells: usize = insides.iter().map(Vec::len).product();
        let chosen = cells.min(most);
        let mut norm: f64 = 0.0;
        for c in 0..chosen {
            // spread over all cells
            let mut index = (c as u128 * cells as u128 / chosen as u128) as usize;
            let rho = point(&insides, index);
            let mut own = Vec::new();
            for (n, values) in insides.iter().enumerate().rev() {
                own.push(weights[n][index % values.len()].clone());
                index /= values.len();
            }
            own.reverse();
            let difference = self.combine(&own) - function(&rho);
            if difference.norm_max() > self.accuracy.between_max || c == 0 {
                self.accuracy.between_max = difference.norm_max();
                self.accuracy.between_at = rho;
            }
            norm = norm.hypot(difference.norm_l2());
        }
        self.accuracy.between_points = chosen;
        self.accuracy.between_rms = norm / ((chosen.max(1) * self.size[0] * self.size[1]) as f64).sqrt();
    }
}

impl Projection {
    /// The unfolding is F₍ₙ₎ = UΣVᵀ, so a slice s of it has u = sVΣ⁻¹; then to y.
    fn of(decomposition: &ModeDecomposition, coordinates: &Coordinates) -> Self {
        // V itself: F₍ₙ₎ᵀUΣ⁻² is the same, but loses digits with the square of σ₁/σ_r
        let (axes, singular_values) = (&coordinates.axes, &decomposition.singular_values);
        let scaled = Mat::from_fn(axes.nrows(), axes.ncols(), |i, j| axes[(i, j)] / singular_values[i]);
        let map = decomposition.right.subcols(0, axes.nrows()) * scaled;
        Self { map, offset: coordinates.offset.clone() }
    }

    fn point(&self, slice: &[f64]) -> Vec<f64> {
        let along = |j: usize| slice.iter().enumerate().map(|(i, entry)| entry * self.map[(i, j)]).sum::<f64>();
        std::iter::once(1.0).chain((0..self.map.ncols()).map(|j| along(j) - self.offset[j])).collect()
    }
}

/// The points (1, y) of parameter `n` at `per_cell` values within each cell of its grid.
fn between(
    function: MatrixOf,
    parameters: &[ParameterGrid],
    n: usize,
    per_cell: usize,
    size: (usize, usize),
    projection: &Projection,
) -> Vec<Vec<f64>> {
    let mut grids: Vec<Vec<f64>> = parameters.iter().map(|parameter| parameter.points.clone()).collect();
    let step = 1.0 / (per_cell + 1) as f64;
    let values = (parameters[n].points.windows(2))
        .flat_map(|ends| (1..=per_cell).map(move |k| ends[0] + k as f64 * step * (ends[1] - ends[0])));
    values
        .map(|value| {
            grids[n] = vec![value];
            projection.point(sample(function, &grids, size).entries())
        })
        // a function that has no value there says so where the error is measured
        .filter(|point| point.iter().all(|coordinate| coordinate.is_finite()))
        .collect()
}

/// Pᵀ/I, the left inverse of P: its columns are orthogonal with squared length I.
fn orthogonal(points: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(points.ncols(), points.nrows(), |i, j| points[(j, i)] / points.nrows() as f64)
}

/// ‖F − F ×ₙ P Pᵀ/I‖
fn residual(samples: &Tensor, mode: usize, points: &Mat<f64>, project: &Mat<f64>) -> f64 {
    let projector = points * project;
    let complement = Mat::<f64>::identity(points.nrows(), points.nrows()) - projector;
    samples.mode_product(mode, &complement).norm()
}

fn rule(rules: &[RankRule], n: usize) -> RankRule {
    *rule_of(rules, n)
}

/// The rule of parameter n; the last goes on. `check` has seen that there is one.
fn rule_of<T>(rules: &[T], n: usize) -> &T {
    &rules[n.min(rules.len() - 1)]
}

/// Singular values below this part of the largest are rounding.
const ZERO: f64 = 1e-13;

fn kept(decomposition: &ModeDecomposition, rule: RankRule) -> usize {
    let values = &decomposition.singular_values;
    let above = |tolerance: f64| values.iter().filter(|value| **value > tolerance * values[0]).count();
    match rule {
        RankRule::Count(count) => count.min(above(ZERO)),
        RankRule::Tolerance(tolerance) => above(tolerance.max(ZERO)),
    }
}

fn check(
    function: MatrixOf,
    parameters: &[ParameterGrid],
    options: &TensorProductOptions,
) -> Result<(usize, usize), TensorProductError> {
    if parameters.is_empty() {
        return Err(TensorProductError::NoParameter);
    }
    if options.ranks.is_empty() || options.weightings.is_empty() {
        return Err(TensorProductError::NoRule);
    }
    for (n, parameter) in parameters.iter().enumerate() {
        let ascending = parameter.points.windows(2).all(|ends| ends[0] < ends[1]);
        if parameter.points.len() < 2 || !ascending || parameter.points.iter().any(|value| !value.is_finite()) {
            return Err(TensorProductError::Grid { parameter: parameter.name.clone() });
        }
        if !match rule(&options.ranks, n) {
            RankRule::Count(count) => count >= 1,
            RankRule::Tolerance(tolerance) => (0.0..1.0).contains(&tolerance),
        } {
            return Err(TensorProductError::Rank { parameter: parameter.name.clone() });
        }
    }
    let first: Vec<f64> = parameters.iter().map(|parameter| parameter.points[0]).collect();
    let matrix = function(&first);
    let (rows, cols) = (matrix.nrows(), matrix.ncols());
    match rows * cols {
        0 => Err(TensorProductError::Value { rows, cols, rho: first }),
        _ => Ok((rows, cols)),
    }
}
