//! Matrices that a schedule makes of those at its vertices, M(ρ) = Σ wᵥ(ρ)Mᵥ, as Taylor forms on the cells of its grid.
//!
//! The weights are linear in each ρₖ between grid points, so that M is multilinear on a cell, and with tₖ ∈ [0, 1] across it
//!
//! ```text
//! M = M₀₀ + t₁(M₁₀ − M₀₀) + t₂(M₀₁ − M₀₀) + t₁t₂(M₁₁ − M₁₀ − M₀₁ + M₀₀),
//! ```
//!
//! with the values Mᵢⱼ at its corners. The sum over vertices, which may lie far apart, would be wide over a cell; these differences are small.

use super::matrix::TaylorMatrix;
use super::mean_value::BoxCell;
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::taylor::Taylor;
use crate::model::tensor_product::TensorProductSchedule;

/// M(ρ).
pub(super) struct Scheduled<'a> {
    schedule: &'a TensorProductSchedule,
    rows: usize,
    columns: usize,
    /// Enclosures of the values at the grid points, in row order, the last parameter running fastest.
    values: Vec<Vec<Interval>>,
}

impl<'a> Scheduled<'a> {
    /// From the matrices at the vertices.
    pub fn new(schedule: &'a TensorProductSchedule, matrices: &[Mat<f64>]) -> Self {
        let (rows, columns) = (matrices[0].nrows(), matrices[0].ncols());
        let entries: Vec<Vec<f64>> = matrices
            .iter()
            .map(|matrix| (0..rows * columns).map(|at| matrix[(at / columns, at % columns)]).collect())
            .collect();
        // the products of the weights at every grid point
        let weights = schedule.parameters.iter().fold(vec![vec![Interval::point(1.0)]], |points, parameter| {
            let with = |point: &Vec<Interval>, row: &Vec<f64>| {
                point.iter().flat_map(|&weight| row.iter().map(move |&own| weight * own)).collect::<Vec<_>>()
            };
            points
                .iter()
                .flat_map(|point| parameter.weights.iter().map(|row| with(point, row)).collect::<Vec<_>>())
                .collect()
        });
        let value = |weights: &Vec<Interval>| {
            let terms = entries.iter().map(Vec::as_slice).zip(weights.iter().copied());
            Interval::weighted_sums(rows * columns, terms)
        };
        Self { schedule, rows, columns, values: weights.iter().map(value).collect() }
    }

    /// M over `rho` of a cell.
    pub fn at(&self, cell: &BoxCell, rho: &[Taylor]) -> TaylorMatrix {
        let parameters = &self.schedule.parameters;
        // corners, the last parameter running fastest
        let corners = parameters.iter().zip(&cell.grid).fold(vec![0], |corners, (parameter, k)| {
            let count = parameter.grid.points.len();
            corners.iter().flat_map(|corner| [corner * count + k, corner * count + k + 1]).collect()
        });
        let constant = |point: &usize| self.values[*point].iter().map(|&x| Taylor::constant(x)).collect();
        let mut values: Vec<Vec<Taylor>> = corners.iter().map(constant).collect();
        for ((parameter, &k), &rho) in parameters.iter().zip(&cell.grid).zip(rho).rev() {
            let points = &parameter.grid.points;
            let width = Interval::point(points[k + 1]) - points[k];
            let t = (rho - points[k]) / Taylor::constant(width);
            let across = |(&from, &to): (&Taylor, &Taylor)| from + t * (to - from);
            values = values.chunks(2).map(|ends| ends[0].iter().zip(&ends[1]).map(across).collect()).collect();
        }
        TaylorMatrix::new(self.rows, self.columns, values.swap_remove(0))
    }
}
