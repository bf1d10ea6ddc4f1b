//! The weights of a TP model as a controller evaluates them: of each parameter on its grid, linear in between.
//!
//! With wₙ,ᵢ(ρₙ) piecewise linear and the vertices numbered with the last parameter running fastest, a schedule at ρ is
//! K(ρ) = Σ w₁,ᵢ₁(ρ₁) ⋯ w_N,ᵢ_N(ρ_N) K_{i₁…i_N}: multilinear on every cell of the grid, and convex if the numbers on the grid are.

use super::ParameterGrid;
use crate::math::Mat;
use crate::math::matrix::to_rows;
use serde::{Deserialize, Serialize};

/// Weights sum to one up to this; a proof evaluates them as they are.
const SUM_TOLERANCE: f64 = 1e-9;

/// The weights of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScheduledParameter {
    /// Symbol, unit and grid points; the first and the last are the range.
    #[serde(flatten)]
    pub grid: ParameterGrid,
    /// One row of weights for each grid point.
    pub weights: Vec<Vec<f64>>,
}

/// The weights of all parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TensorProductSchedule {
    /// In order.
    pub parameters: Vec<ScheduledParameter>,
}

/// Why weights are no schedule.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScheduleError {
    /// No parameter.
    #[error("there is no parameter")]
    Empty,
    /// A grid that is no grid.
    #[error("the grid of {parameter} has to hold at least two finite points in ascending order")]
    Grid {
        /// Of which parameter.
        parameter: String,
    },
    /// Not one row for each grid point, or rows of different lengths.
    #[error("the weights of {parameter} have to be {points} rows, one for each grid point, of equally many numbers")]
    Shape {
        /// Of which parameter.
        parameter: String,
        /// Its grid points.
        points: usize,
    },
    /// A weight below zero, or that is no number, or weights with another sum.
    #[error(
        "the weights of {parameter} at grid point {point} are not convex: each has to be zero or more, and their sum one"
    )]
    NotConvex {
        /// Of which parameter.
        parameter: String,
        /// From 1.
        point: usize,
    },
}

impl TensorProductSchedule {
    /// Whether the numbers are convex weights on grids.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), ScheduleError> {
        if self.parameters.is_empty() {
            return Err(ScheduleError::Empty);
        }
        for ScheduledParameter { grid, weights } in &self.parameters {
            let (parameter, points) = (grid.name.clone(), grid.points.len());
            let ascends = grid.points.windows(2).all(|ends| ends[0] < ends[1]);
            if points < 2 || !ascends || grid.points.iter().any(|point| !point.is_finite()) {
                return Err(ScheduleError::Grid { parameter });
            }
            let count = weights.first().map_or(0, Vec::len);
            if count == 0 || weights.len() != points || weights.iter().any(|row| row.len() != count) {
                return Err(ScheduleError::Shape { parameter, points });
            }
            let is_convex = |row: &Vec<f64>| {
                row.iter().all(|weight| *weight >= 0.0) && (row.iter().sum::<f64>() - 1.0).abs() <= SUM_TOLERANCE
            };
            if let Some(at) = weights.iter().position(|row| !is_convex(row)) {
                return Err(ScheduleError::NotConvex { parameter, point: at + 1 });
            }
        }
        Ok(())
    }

    /// The number of vertices.
    pub fn vertices(&self) -> usize {
        self.parameters.iter().map(ScheduledParameter::count).product()
    }

    /// The number of the weight of each parameter at a vertex, from 0.
    pub fn numbers(&self, vertex: usize) -> Vec<usize> {
        let mut numbers = vec![0; self.parameters.len()];
        let mut rest = vertex;
        for (number, parameter) in numbers.iter_mut().zip(&self.parameters).rev() {
            *number = rest % parameter.count();
            rest /= parameter.count();
        }
        numbers
    }

    /// The weights of the vertices at ρ, clamped to the ranges, in floating point.
    pub fn at(&self, rho: &[f64]) -> Vec<f64> {
        self.parameters.iter().zip(rho).fold(vec![1.0], |weights, (parameter, value)| {
            let own = parameter.at(*value);
            weights.iter().flat_map(|weight| own.iter().map(move |w| weight * w)).collect()
        })
    }

    /// Σ wᵥMᵥ at ρ.
    ///
    /// # Panics
    /// If there are not as many matrices as vertices.
    pub fn combine(&self, matrices: &[Mat<f64>], rho: &[f64]) -> Mat<f64> {
        assert_eq!(matrices.len(), self.vertices(), "one matrix for each vertex");
        let weights = self.at(rho);
        Mat::from_fn(matrices[0].nrows(), matrices[0].ncols(), |i, j| {
            weights.iter().zip(matrices).map(|(weight, matrix)| weight * matrix[(i, j)]).sum()
        })
    }
}

impl ScheduledParameter {
    /// The weights on the grid as a matrix.
    pub fn new(grid: ParameterGrid, weights: &Mat<f64>) -> Self {
        Self { grid, weights: to_rows(weights) }
    }

    /// How many weights there are.
    pub fn count(&self) -> usize {
        self.weights.first().map_or(0, Vec::len)
    }

    fn at(&self, value: f64) -> Vec<f64> {
        let (k, t) = self.grid.cell(value);
        self.weights[k].iter().zip(&self.weights[k + 1]).map(|(a, b)| (1.0 - t) * a + t * b).collect()
    }
}
