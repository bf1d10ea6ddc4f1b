//! Weighting functions of one parameter: from the singular vectors of its unfolding to convex weights.
//!
//! The rows of U are points, one for each grid value. In coordinates P = [1 Y] whose columns are orthogonal, W = PT for a
//! simplex T around them (or products of intervals, for a box), and the simplex is what distinguishes SN, SNNN, NO, CNO, INO
//! and INO-RNO.

use super::error::TensorProductError;
use super::minimum_volume::minimum_volume;
use super::sampling::ParameterGrid;
use super::simplex::{column_maxima, column_minima, inscribed, log_determinant, regular, relaxed, scaled, touching};
use crate::math::Mat;
use crate::math::hosvd::right_singular;
use crate::math::matrix::{inverse, rows};
use serde::{Deserialize, Serialize};

/// Kind of the weighting functions w₁(ρ) … w_k(ρ) of a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weighting {
    /// Sum normalised: Σ wᵢ = 1; weights may be negative. A regular simplex of the points' mean size.
    Sn,
    /// Sum normalised and non-negative: the regular simplex, as large as the points need.
    Snnn,
    /// Normal: Σ wᵢ = 1 and max wᵢ = 1: vertices are values of the model. The simplex of largest volume among the points; its
    /// weights are non-negative only if the points have no other corners (always for two weights).
    No,
    /// Close to normal: the tightest hull, Σ wᵢ = 1 and wᵢ ≥ 0 on the simplex of least volume.
    #[default]
    Cno,
    /// Inverse normal: Σ wᵢ = 1, wᵢ ≥ 0 and min wᵢ = 0: every face of the simplex around the inscribed one touches.
    Ino,
    /// Inverse and relaxed normal: INO, and all weights have the same maximum.
    InoRno,
    /// Products of the weights of an interval for each coordinate of the points: 2^(k−1) weights, the bounding box.
    Box,
}

impl Weighting {
    /// All kinds with their names in files.
    pub const ALL: [(&'static str, Self); 7] = [
        ("sn", Self::Sn),
        ("snnn", Self::Snnn),
        ("no", Self::No),
        ("cno", Self::Cno),
        ("ino", Self::Ino),
        ("ino-rno", Self::InoRno),
        ("box", Self::Box),
    ];

    /// Whether the weights of this kind are never negative.
    pub fn is_convex(self) -> bool {
        !matches!(self, Self::Sn | Self::No)
    }
}

/// What the hull of one parameter's weights is like, at the points that it is made to hold: the grid points, and those between
/// them that were asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HullQuality {
    /// The smallest value of each weight.
    pub minima: Vec<f64>,
    /// The largest value of each weight.
    pub maxima: Vec<f64>,
    /// max |Σ wᵢ − 1|
    pub sum_error: f64,
    /// Volume of the hull over that of the largest simplex among the points: 1 is the tightest possible. For SN it can be less.
    pub volume_ratio: f64,
}

/// The weighting functions of one parameter.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct WeightFunctions {
    /// The parameter and its grid.
    pub grid: ParameterGrid,
    /// Their kind.
    pub kind: Weighting,
    /// Their values, one row for each grid point.
    #[serde(with = "rows")]
    pub values: Mat<f64>,
    /// What the hull is like.
    pub hull: HullQuality,
    /// The points P = [1 Y] of the grid; Y has mean 0 and YᵀY = I₁·I.
    #[serde(with = "rows")]
    pub(super) points: Mat<f64>,
    /// From coordinates to weights.
    shape: Shape,
}

/// The hull that weights are coordinates in.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Shape {
    Simplex(#[serde(with = "rows")] Mat<f64>),
    /// Ends of the interval of each coordinate but the constant.
    Box(Vec<[f64; 2]>),
}

impl Shape {
    /// The weights at a point (1, y).
    fn weights(&self, point: &[f64]) -> Vec<f64> {
        match self {
            Shape::Simplex(t) => {
                (0..t.ncols()).map(|j| point.iter().enumerate().map(|(i, p)| p * t[(i, j)]).sum()).collect()
            }
            Shape::Box(intervals) => intervals.iter().zip(&point[1..]).fold(vec![1.0], |weights, ([low, high], y)| {
                let upper = (y - low) / (high - low);
                weights.iter().flat_map(|weight| [weight * (1.0 - upper), weight * upper]).collect()
            }),
        }
    }

    /// The vertices, one row (1, v) each: P = WV.
    fn vertices(&self) -> Mat<f64> {
        match self {
            Shape::Simplex(t) => inverse(t),
            Shape::Box(intervals) => {
                let bits = intervals.len();
                Mat::from_fn(1 << bits, bits + 1, |i, j| match j {
                    0 => 1.0,
                    _ => intervals[j - 1][i >> (bits - j) & 1],
                })
            }
        }
    }
}

/// Two directions of the points are one when the second singular value is below this part of √I.
const FLAT: f64 = 1e-8;
/// Starts of the searches for CNO and INO-RNO, besides the inscribed simplex.
const STARTS: usize = 12;
/// Weights of a CNO hull: the search takes steps in k(k − 1) unknowns.
const MOST_TIGHTENED: usize = 12;
/// Coordinates of a box; there are two to this power vertices.
const MOST_BOX_COORDINATES: usize = 10;

/// The points P = [1 Y] of the rows u of U: y = uD − b.
pub(super) struct Coordinates {
    /// P, I × k.
    pub points: Mat<f64>,
    /// D
    pub axes: Mat<f64>,
    /// b
    pub offset: Vec<f64>,
}

impl Coordinates {
    /// The constant and the principal axes of the centred rows, all of mean square 1. An axis shorter than `tolerance` is
    /// dropped: then 1 lies in the range of U up to it, and no weight has to be added. `None` if the decomposition does not
    /// converge.
    pub fn of(left: &Mat<f64>, tolerance: f64) -> Option<Self> {
        let (count, rank) = (left.nrows(), left.ncols());
        let mean: Vec<f64> = (0..rank).map(|j| (0..count).map(|i| left[(i, j)]).sum::<f64>() / count as f64).collect();
        let centred = Mat::from_fn(count, rank, |i, j| left[(i, j)] - mean[j]);
        let (lengths, directions) = right_singular(&centred)?;
        let kept: Vec<usize> = (0..lengths.len()).filter(|&j| lengths[j] > tolerance.max(FLAT)).collect();
        let scale = (count as f64).sqrt();
        let axes = Mat::from_fn(rank, kept.len(), |i, j| scale * directions[(i, kept[j])] / lengths[kept[j]]);
        let offset = (0..kept.len()).map(|j| (0..rank).map(|i| mean[i] * axes[(i, j)]).sum()).collect();
        let varying = centred * &axes;
        let points = Mat::from_fn(count, kept.len() + 1, |i, j| if j == 0 { 1.0 } else { varying[(i, j - 1)] });
        Some(Self { points, axes, offset })
    }
}

impl WeightFunctions {
    /// The weights of `kind` over the `grid_points` (rows of P), in a hull that holds these and the points `between` them.
    ///
    /// # Errors
    /// A box of more than ten coordinates, CNO of more than twelve weights, an INO-RNO simplex that is not found.
    pub(super) fn new(
        grid: ParameterGrid,
        kind: Weighting,
        grid_points: Mat<f64>,
        between: &[Vec<f64>],
    ) -> Result<Self, TensorProductError> {
        let (count, k) = (grid_points.nrows(), grid_points.ncols());
        let points =
            Mat::from_fn(
                count + between.len(),
                k,
                |i, j| {
                    if i < count { grid_points[(i, j)] } else { between[i - count][j] }
                },
            );
        let inscribed = inscribed(&points);
        let starts =
            || std::iter::once(inscribed.clone()).chain((0..STARTS).map(|s| rotated(k, s))).collect::<Vec<_>>();
        let shape = match kind {
            _ if k == 1 => Shape::Simplex(Mat::identity(1, 1)),
            Weighting::Sn => Shape::Simplex(regular(k)),
            Weighting::Snnn => Shape::Simplex(scaled(&points, &regular(k))),
            Weighting::No => Shape::Simplex(inscribed.clone()),
            // an interval is the only simplex with two vertices that touches
            Weighting::Ino => Shape::Simplex(touching(&points, &inscribed)),
            Weighting::Cno | Weighting::InoRno if k == 2 => Shape::Simplex(touching(&points, &inscribed)),
            Weighting::Cno if k > MOST_TIGHTENED => {
                return Err(TensorProductError::HullTooLarge { parameter: grid.name.clone(), weights: k });
            }
            Weighting::Cno => Shape::Simplex(minimum_volume(&points, &starts())),
            Weighting::InoRno => Shape::Simplex(
                relaxed(&points, &starts())
                    .ok_or_else(|| TensorProductError::NotRelaxed { parameter: grid.name.clone() })?,
            ),
            Weighting::Box if k > MOST_BOX_COORDINATES + 1 => {
                return Err(TensorProductError::BoxTooLarge { parameter: grid.name.clone(), coordinates: k - 1 });
            }
            Weighting::Box => {
                let (minima, maxima) = (column_minima(&points), column_maxima(&points));
                Shape::Box((1..k).map(|j| [minima[j], maxima[j]]).collect())
            }
        };
        let shape = ordered(&grid_points, shape);
        let weights: Vec<Vec<f64>> =
            (0..points.nrows()).map(|i| convex(kind, shape.weights(&row(&points, i)))).collect();
        let all = Mat::from_fn(points.nrows(), weights[0].len(), |i, j| weights[i][j]);
        let sum_error = weights.iter().map(|row| (row.iter().sum::<f64>() - 1.0).abs()).fold(0.0, f64::max);
        let volume = match &shape {
            Shape::Simplex(t) => -log_determinant(t),
            // of a simplex in the same units: (k − 1)! times the volume
            Shape::Box(intervals) => {
                let factorial: f64 = (1..k).map(|j| (j as f64).ln()).sum();
                factorial + intervals.iter().map(|[low, high]| (high - low).ln()).sum::<f64>()
            }
        };
        let hull = HullQuality {
            minima: column_minima(&all),
            maxima: column_maxima(&all),
            sum_error,
            volume_ratio: (volume + log_determinant(&inscribed)).exp(),
        };
        let values = all.subrows(0, count).to_owned();
        Ok(Self { grid, kind, values, hull, points: grid_points, shape })
    }

    /// The number of weights.
    pub fn count(&self) -> usize {
        self.values.ncols()
    }

    /// The weights at `value`, interpolated between the grid points (convex weights stay convex) and clamped to the range.
    pub fn interpolated(&self, value: f64) -> Vec<f64> {
        let (k, t) = self.grid.cell(value);
        (0..self.count()).map(|j| (1.0 - t) * self.values[(k, j)] + t * self.values[(k + 1, j)]).collect()
    }

    /// The weights at the point (1, y) of the model's values. Between grid points a curve can leave the hull of the grid
    /// points by a little: negative weights of a convex kind are set to zero and the rest scaled to the sum one.
    pub(super) fn at_point(&self, point: &[f64]) -> Vec<f64> {
        convex(self.kind, self.shape.weights(point))
    }

    /// The rows (1, v) of the vertices.
    pub(super) fn vertices(&self) -> Mat<f64> {
        self.shape.vertices()
    }
}

/// Negative parts of the weights of a convex kind cut off: rounding at the grid points, more between them.
fn convex(kind: Weighting, mut weights: Vec<f64>) -> Vec<f64> {
    if kind.is_convex() && weights.iter().any(|weight| *weight < 0.0) {
        weights.iter_mut().for_each(|weight| *weight = weight.max(0.0));
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
    }
    weights
}

pub(super) fn row(matrix: &Mat<f64>, i: usize) -> Vec<f64> {
    (0..matrix.ncols()).map(|j| matrix[(i, j)]).collect()
}

/// The vertices of a simplex numbered by where along the parameter their weights peak.
fn ordered(points: &Mat<f64>, shape: Shape) -> Shape {
    let Shape::Simplex(simplex) = shape else { return shape };
    let weights = points * &simplex;
    let peak =
        |j: usize| (0..weights.nrows()).fold(0, |best, i| if weights[(i, j)] > weights[(best, j)] { i } else { best });
    let mut order: Vec<usize> = (0..simplex.ncols()).collect();
    order.sort_by_key(|&j| peak(j));
    Shape::Simplex(Mat::from_fn(simplex.nrows(), simplex.ncols(), |i, j| simplex[(i, order[j])]))
}

/// The regular simplex turned by multiples of the golden angle in every plane: spread evenly, and the same on every run.
fn rotated(k: usize, multiple: usize) -> Mat<f64> {
    let golden = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let mut simplex = regular(k);
    for (plane, (p, q)) in (1..k).flat_map(|p| (p + 1..k).map(move |q| (p, q))).enumerate() {
        let (sin, cos) = (golden * (multiple * (plane + 1)) as f64).sin_cos();
        let before = simplex.clone();
        for j in 0..k {
            simplex[(p, j)] = cos * before[(p, j)] - sin * before[(q, j)];
            simplex[(q, j)] = sin * before[(p, j)] + cos * before[(q, j)];
        }
    }
    simplex
}
