//! Sampling of a matrix-valued function over a rectangular grid, and which entry depends on which parameter.

use crate::math::Mat;
use crate::math::tensor::Tensor;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A scheduling parameter and its grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterGrid {
    /// Symbol.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Grid points in ascending order; the first and the last are the range.
    pub points: Vec<f64>,
}

impl ParameterGrid {
    /// `count` equidistant points over `range`.
    pub fn equidistant(name: &str, unit: &str, [low, high]: [f64; 2], count: usize) -> Self {
        let last = count.saturating_sub(1).max(1) as f64;
        let point = |k: usize| if k + 1 == count { high } else { low + (high - low) * k as f64 / last };
        Self { name: name.into(), unit: unit.into(), points: (0..count).map(point).collect() }
    }

    /// `value`, or the end of the range that it is beyond.
    pub fn clamp(&self, value: f64) -> f64 {
        let (low, high) = (self.points[0], self.points[self.points.len() - 1]);
        if value < low { low } else { value.min(high) }
    }

    /// The cell [k, k + 1] of grid points that holds `value`, clamped to the range, and where in it, 0 to 1.
    pub fn cell(&self, value: f64) -> (usize, f64) {
        let value = self.clamp(value);
        let k = self.points.partition_point(|point| *point <= value).clamp(1, self.points.len() - 1) - 1;
        (k, (value - self.points[k]) / (self.points[k + 1] - self.points[k]))
    }
}

/// A matrix-valued function S(ρ) of the parameters: an LPV model [A(ρ) B(ρ)], or a scheduled gain K(ρ).
pub type MatrixOf<'a> = &'a (dyn Fn(&[f64]) -> Mat<f64> + Sync);

/// The tensor of samples, I₁ × … × I_N × rows × columns.
pub(super) fn sample(function: MatrixOf, grids: &[Vec<f64>], (rows, cols): (usize, usize)) -> Tensor {
    let sizes: Vec<usize> = grids.iter().map(Vec::len).collect();
    let count: usize = sizes.iter().product();
    let entries = (0..count)
        .into_par_iter()
        .flat_map_iter(|index| {
            let matrix = function(&point(grids, index));
            // a matrix of another size has no entries that could be compared
            let fits = (matrix.nrows(), matrix.ncols()) == (rows, cols);
            (0..rows * cols).map(move |e| if fits { matrix[(e / cols, e % cols)] } else { f64::NAN })
        })
        .collect();
    Tensor::new(sizes.into_iter().chain([rows, cols]).collect(), entries)
}

/// The parameters of grid point `index`, the last parameter running fastest.
pub(super) fn point(grids: &[Vec<f64>], mut index: usize) -> Vec<f64> {
    let mut rho = vec![0.0; grids.len()];
    for (value, grid) in rho.iter_mut().zip(grids).rev() {
        *value = grid[index % grid.len()];
        index /= grid.len();
    }
    rho
}

/// An entry counts as constant while it varies by less than this part of its own largest magnitude: some hundred roundings.
const CONSTANT: f64 = 1e-13;

/// For each entry of the matrix, in row order, and each parameter: whether the entry changes when this parameter alone
/// moves over its grid, the others anywhere on theirs.
pub(super) fn dependencies(samples: &Tensor, parameters: usize) -> Vec<Vec<bool>> {
    let shape = samples.shape();
    let entries: usize = shape[parameters..].iter().product();
    let values = samples.entries();
    let mut largest = vec![0.0f64; entries];
    values.iter().enumerate().for_each(|(k, value)| largest[k % entries] = largest[k % entries].max(value.abs()));
    let mut depends = vec![vec![false; parameters]; entries];
    for n in 0..parameters {
        let inner: usize = shape[n + 1..].iter().product();
        for (k, value) in values.iter().enumerate() {
            // the same fibre at its first index
            let first = k / (shape[n] * inner) * shape[n] * inner + k % inner;
            let entry = k % entries;
            depends[entry][n] |= (value - values[first]).abs() > CONSTANT * largest[entry];
        }
    }
    depends
}
