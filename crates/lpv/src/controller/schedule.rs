//! Gains as functions of the scheduling parameter.

use crate::math::Mat;
use crate::math::matrix::{rows, rows_list};
use crate::math::scalar::Scalar;
use crate::model::BoxWeights;
use serde::{Deserialize, Serialize};

/// K(ρ), carried from finitely many gains to every ρ.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Schedule {
    /// One gain.
    Constant {
        /// K
        #[serde(with = "rows")]
        gain: Mat<f64>,
    },
    /// Piecewise cubic interpolation over an equidistant grid.
    Grid {
        /// ρ_k, ascending and equidistant.
        parameters: Vec<f64>,
        /// Length of the period, for a periodic parameter.
        period: Option<f64>,
        /// K(ρ_k)
        #[serde(with = "rows_list")]
        gains: Vec<Mat<f64>>,
    },
    /// K(ρ) = Σ wᵢ(ρ) Kᵢ, thesis (6.3)-(6.7).
    Vertices {
        /// wᵢ
        weights: BoxWeights,
        /// Kᵢ: vertex values of the function K, not gains of the vertex systems.
        #[serde(with = "rows_list")]
        gains: Vec<Mat<f64>>,
    },
}

impl Schedule {
    /// The gain at parameter `rho`, in row order.
    pub fn gain_at(&self, rho: f64, gain: &mut [f64]) {
        gain.fill(0.0);
        match self {
            Schedule::Constant { gain: k } => add_scaled(gain, 1.0, k),
            Schedule::Grid { parameters, period, gains } => {
                for (k, weight) in cubic_weights(parameters, *period, rho) {
                    add_scaled(gain, weight, &gains[k]);
                }
            }
            Schedule::Vertices { weights, gains } => {
                for (vertex, k) in gains.iter().enumerate() {
                    add_scaled(gain, weights.weight(vertex, rho), k);
                }
            }
        }
    }

    /// On how many pieces the gain is one formula; 1 where it is the same formula everywhere.
    pub fn pieces(&self) -> usize {
        match self {
            Schedule::Constant { .. } | Schedule::Vertices { .. } => 1,
            Schedule::Grid { parameters, period: Some(_), .. } => parameters.len(),
            Schedule::Grid { parameters, period: None, .. } => parameters.len().saturating_sub(1).max(1),
        }
    }

    /// The formula of one piece, in row order: over a grid at position `position` in units of its step, which lies in
    /// [piece, piece + 1]; else at parameter `rho`.
    pub fn gain_on_piece<S: Scalar>(&self, piece: usize, position: S, rho: S) -> Vec<S> {
        let (weighted, first): (Vec<(usize, S)>, &Mat<f64>) = match self {
            Schedule::Constant { gain } => (vec![(0, S::from(1.0))], gain),
            Schedule::Grid { parameters, period, gains } => {
                let count = parameters.len();
                let width = count.min(4);
                let first = piece as isize - (width as isize - 1) / 2;
                let first = if period.is_some() { first } else { first.clamp(0, (count - width) as isize) };
                (lagrange_weights(first, width, count, position).collect(), &gains[0])
            }
            Schedule::Vertices { weights, gains } => (weights.at(rho).into_iter().enumerate().collect(), &gains[0]),
        };
        let (m, n) = (first.nrows(), first.ncols());
        let mut gain = vec![S::from(0.0); m * n];
        for (k, weight) in weighted {
            let k = match self {
                Schedule::Constant { gain } => gain,
                Schedule::Grid { gains, .. } | Schedule::Vertices { gains, .. } => &gains[k],
            };
            gain.iter_mut().enumerate().for_each(|(at, entry)| *entry = *entry + weight * k[(at / n, at % n)]);
        }
        gain
    }

    /// The gain at parameter `rho` as a matrix.
    pub fn gain_matrix(&self, rho: f64) -> Mat<f64> {
        let first = match self {
            Schedule::Constant { gain } => gain,
            Schedule::Grid { gains, .. } | Schedule::Vertices { gains, .. } => &gains[0],
        };
        let (m, n) = (first.nrows(), first.ncols());
        let mut entries = vec![0.0; m * n];
        self.gain_at(rho, &mut entries);
        crate::math::matrix::from_row_slice(m, n, &entries)
    }
}

fn add_scaled(sum: &mut [f64], factor: f64, matrix: &Mat<f64>) {
    let columns = matrix.ncols();
    for j in 0..columns {
        for i in 0..matrix.nrows() {
            sum[i * columns + j] += factor * matrix[(i, j)];
        }
    }
}

/// Lagrange weights of the four grid points around `rho`: the cubic through them, with error O(h⁴) in a smooth function.
///
/// A periodic grid wraps; otherwise `rho` is clamped to the grid and the window moved inside it. Grids of fewer than four
/// points use all of them.
pub(crate) fn cubic_weights(
    parameters: &[f64],
    period: Option<f64>,
    rho: f64,
) -> impl Iterator<Item = (usize, f64)> + use<> {
    let count = parameters.len();
    let step = if count > 1 { parameters[1] - parameters[0] } else { 1.0 };
    let width = count.min(4);
    // position in units of the step, and the first point of the window
    let (position, first) = match period {
        _ if count == 1 => (0.0, 0),
        Some(period) => {
            let position = (rho - parameters[0]).rem_euclid(period) / step;
            (position, position.floor() as isize - (width as isize - 1) / 2)
        }
        None => {
            let position = ((rho - parameters[0]) / step).clamp(0.0, (count - 1) as f64);
            (position, (position.floor() as isize - (width as isize - 1) / 2).clamp(0, (count - width) as isize))
        }
    };
    lagrange_weights(first, width, count, position)
}

/// Weights of the polynomial through `width` nodes from `first` on, of a grid of `count` that wraps.
fn lagrange_weights<S: Scalar>(
    first: isize,
    width: usize,
    count: usize,
    position: S,
) -> impl Iterator<Item = (usize, S)> {
    (0..width).map(move |i| {
        let node = (first + i as isize) as f64;
        let weight = (0..width).filter(|&j| j != i).fold(S::from(1.0), |product, j| {
            product * (position - (first + j as isize) as f64) / (node - (first + j as isize) as f64)
        });
        ((first + i as isize).rem_euclid(count as isize) as usize, weight)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn periodic_error(count: usize) -> f64 {
        let grid: Vec<f64> = (0..count).map(|k| -PI + TAU * k as f64 / count as f64).collect();
        (0..1000)
            .map(|k| {
                let rho = -4.0 + 0.009 * k as f64;
                let value: f64 = cubic_weights(&grid, Some(TAU), rho).map(|(k, w)| w * grid[k].sin()).sum();
                (value - rho.sin()).abs()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn interpolation_has_order_four() {
        let ratio = periodic_error(16) / periodic_error(32);
        assert!((ratio.log2() - 4.0).abs() < 0.1, "order {}", ratio.log2());
        assert!(periodic_error(32) < 4e-5);
    }

    #[test]
    fn cubics_are_exact_up_to_the_ends_and_constant_beyond() {
        let grid: Vec<f64> = (0..7).map(|k| 0.5 * k as f64).collect();
        let cubic = |x: f64| 1.0 - 2.0 * x + 0.3 * x.powi(3);
        let value = |rho: f64| cubic_weights(&grid, None, rho).map(|(k, w)| w * cubic(grid[k])).sum::<f64>();
        for rho in [0.0, 0.1, 1.3, 2.9, 3.0] {
            assert!((value(rho) - cubic(rho)).abs() < 1e-12);
        }
        assert!((value(5.0) - cubic(3.0)).abs() < 1e-12);
    }
}
