//! Simplices around a cloud of points. The points are the rows of P = [1 Y], k columns; a simplex is its k × k matrix T:
//! W = PT are the barycentric coordinates of the points, and the rows of T⁻¹ are the vertices. As every row of P begins
//! with 1, the coordinates sum to one exactly when T's columns sum to e₁, and |det T| is inversely proportional to the
//! volume.

use crate::math::Mat;
use crate::math::matrix::{inverse, is_finite};

/// The smallest entry of each column.
pub fn column_minima(matrix: &Mat<f64>) -> Vec<f64> {
    (0..matrix.ncols()).map(|j| (0..matrix.nrows()).map(|i| matrix[(i, j)]).fold(f64::INFINITY, f64::min)).collect()
}

/// The largest entry of each column.
pub fn column_maxima(matrix: &Mat<f64>) -> Vec<f64> {
    (0..matrix.ncols()).map(|j| (0..matrix.nrows()).map(|i| matrix[(i, j)]).fold(f64::NEG_INFINITY, f64::max)).collect()
}

/// A regular simplex around the origin, in the space of the rows of P after their 1. Every coordinate of the points has
/// mean 0 and mean square 1, and so have the simplex's vertices.
pub fn regular(k: usize) -> Mat<f64> {
    // orthonormal rows, the first of them constant: the Helmert matrix; its columns are the vertices of a regular simplex
    let helmert = Mat::from_fn(k, k, |row, column| match row {
        0 => 1.0 / (k as f64).sqrt(),
        _ if column < row => 1.0 / ((row * (row + 1)) as f64).sqrt(),
        _ if column == row => -(row as f64) / ((row * (row + 1)) as f64).sqrt(),
        _ => 0.0,
    });
    helmert / (k as f64).sqrt()
}

/// The same simplex, every face moved along its normal until it touches the points: each weight has minimum 0 (INO).
pub fn touching(points: &Mat<f64>, simplex: &Mat<f64>) -> Mat<f64> {
    let minima = column_minima(&(points * simplex));
    let scale = 1.0 - minima.iter().sum::<f64>();
    // wⱼ ← (wⱼ − minⱼ)/(1 − Σ min), a change of the constant's row only
    Mat::from_fn(simplex.nrows(), simplex.ncols(), |i, j| {
        (simplex[(i, j)] - if i == 0 { minima[j] } else { 0.0 }) / scale
    })
}

/// The same simplex, scaled about its centre until no weight is negative (SNNN).
pub fn scaled(points: &Mat<f64>, simplex: &Mat<f64>) -> Mat<f64> {
    let k = simplex.ncols() as f64;
    let least = column_minima(&(points * simplex)).into_iter().fold(0.0, f64::min);
    let scale = 1.0 - k * least;
    Mat::from_fn(simplex.nrows(), simplex.ncols(), |i, j| (simplex[(i, j)] - if i == 0 { least } else { 0.0 }) / scale)
}

/// The simplex of largest volume with vertices among the points (found by exchanging one vertex at a time, so a local
/// maximum): every weight reaches 1 and lies between −1 and 1 at all points (NO).
pub fn inscribed(points: &Mat<f64>) -> Mat<f64> {
    let (count, k) = (points.nrows(), points.ncols());
    let mut chosen = independent_rows(points);
    // each exchange enlarges the volume, and there are finitely many choices; the bound guards against rounding
    for _ in 0..100 * k {
        let simplex = inverse(&Mat::from_fn(k, k, |i, j| points[(chosen[i], j)]));
        let weights = points * &simplex;
        let mut best = (0, 0, 1.0 + 1e-9);
        for j in 0..k {
            for i in 0..count {
                if weights[(i, j)].abs() > best.2 {
                    best = (i, j, weights[(i, j)].abs());
                }
            }
        }
        if best.2 <= 1.0 + 1e-9 {
            return simplex;
        }
        chosen[best.1] = best.0;
    }
    inverse(&Mat::from_fn(k, k, |i, j| points[(chosen[i], j)]))
}

/// k rows of P that are linearly independent: each the farthest from the span of those before.
fn independent_rows(points: &Mat<f64>) -> Vec<usize> {
    let (count, k) = (points.nrows(), points.ncols());
    let mut rest = points.clone();
    let mut chosen = Vec::with_capacity(k);
    for _ in 0..k {
        let norm = |i: usize| (0..k).map(|j| rest[(i, j)].powi(2)).sum::<f64>();
        let farthest = (0..count).fold(0, |best, i| if norm(i) > norm(best) { i } else { best });
        let length = norm(farthest);
        let direction: Vec<f64> = (0..k).map(|j| rest[(farthest, j)]).collect();
        rest = Mat::from_fn(count, k, |i, j| {
            let along = (0..k).map(|l| rest[(i, l)] * direction[l]).sum::<f64>() / length;
            rest[(i, j)] - along * direction[j]
        });
        chosen.push(farthest);
    }
    chosen
}

/// Alternations until the widths agree; convergence is linear.
const MOST_ALTERNATIONS: usize = 2000;
/// How far the maxima of the weights may differ.
const EQUAL: f64 = 1e-12;

/// A simplex whose faces all touch the points and whose weights all have the same maximum (INO-RNO), the one of least volume
/// that the starts lead to; `None` if there is none.
///
/// A face with normal m gives the weight (mᵀy − min mᵀy)/S with S = −Σ min mⱼᵀy; its maximum is the width of the points
/// along m over S. Wanted are normals of width one that sum to zero; the two conditions are imposed in turn. Normals that
/// do so in opposite pairs bound no simplex.
pub fn relaxed(points: &Mat<f64>, starts: &[Mat<f64>]) -> Option<Mat<f64>> {
    let k = points.ncols();
    let found = starts.iter().filter_map(|start| {
        let mut normals = Mat::from_fn(k, k, |i, j| if i == 0 { 0.0 } else { start[(i, j)] });
        for _ in 0..MOST_ALTERNATIONS {
            let weights = points * &normals;
            let (minima, maxima) = (column_minima(&weights), column_maxima(&weights));
            let widths: Vec<f64> = maxima.iter().zip(&minima).map(|(high, low)| high - low).collect();
            let mean = widths.iter().sum::<f64>() / k as f64;
            if widths.iter().all(|width| (width / mean - 1.0).abs() < EQUAL) {
                let size = -minima.iter().sum::<f64>();
                let simplex =
                    Mat::from_fn(k, k, |i, j| (normals[(i, j)] - if i == 0 { minima[j] } else { 0.0 }) / size);
                return is_simplex(points, &simplex).then_some(simplex);
            }
            // the sum of each row after the first back to zero
            let unit = Mat::from_fn(k, k, |i, j| if i == 0 { 0.0 } else { normals[(i, j)] / widths[j] });
            normals = Mat::from_fn(k, k, |i, j| unit[(i, j)] - (0..k).map(|l| unit[(i, l)]).sum::<f64>() / k as f64);
        }
        None
    });
    found.max_by(|a, b| log_determinant(a).total_cmp(&log_determinant(b)))
}

/// How far weights and vertices may be from giving the points back.
const DEGENERATE: f64 = 1e-9;

/// Whether the vertices with the weights give the points back: not so if the faces meet in no vertex.
fn is_simplex(points: &Mat<f64>, simplex: &Mat<f64>) -> bool {
    let error = points * simplex * inverse(simplex) - points;
    is_finite(&error) && error.norm_max() < DEGENERATE * points.norm_max()
}

/// log|det T|, which grows as the simplex shrinks.
pub fn log_determinant(simplex: &Mat<f64>) -> f64 {
    simplex.determinant().abs().ln()
}
