//! Checks on the original expressions, by code that shares nothing with the solver.

use crate::Mat;
use crate::expression::{Shape, Term};

/// The extreme eigenvalues of a symmetric matrix.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spectrum {
    pub smallest: f64,
    pub largest: f64,
    /// How far rounding may have moved an eigenvalue.
    pub rounding: f64,
}

impl Spectrum {
    /// Of the symmetric part of a square matrix; all NaN when it cannot be computed.
    pub fn of(matrix: &Mat<f64>) -> Self {
        let n = matrix.nrows();
        if n == 0 {
            return Self { smallest: f64::INFINITY, largest: f64::NEG_INFINITY, rounding: 0.0 };
        }
        let symmetric = Mat::from_fn(n, n, |i, j| 0.5 * (matrix[(i, j)] + matrix[(j, i)]));
        let failed = Self { smallest: f64::NAN, largest: f64::NAN, rounding: f64::NAN };
        if !largest_entry(&symmetric).is_finite() {
            return failed;
        }
        match symmetric.self_adjoint_eigenvalues(faer::Side::Lower) {
            Ok(values) => {
                let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
                let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let rounding = 4.0 * n as f64 * f64::EPSILON * smallest.abs().max(largest.abs());
                Self { smallest, largest, rounding }
            }
            Err(_) => failed,
        }
    }

    /// Of the diagonal matrix whose diagonal is the column given.
    pub fn of_diagonal(column: &Mat<f64>) -> Self {
        let (mut smallest, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..column.nrows() {
            let entry = column[(i, 0)];
            if entry.is_nan() {
                return Self { smallest: f64::NAN, largest: f64::NAN, rounding: f64::NAN };
            }
            smallest = smallest.min(entry);
            largest = largest.max(entry);
        }
        Self { smallest, largest, rounding: f64::EPSILON * smallest.abs().max(largest.abs()) }
    }
}

/// The gradient of `⟨Z, term(X)⟩` with respect to X, for symmetric or 1 × 1 Z.
pub(crate) fn gradient(term: &Term, z: &Mat<f64>) -> Mat<f64> {
    match &term.shape {
        // ⟨Z, U X V⟩ = ⟨Uᵀ Z Vᵀ, X⟩ and ⟨Z, U Xᵀ V⟩ = ⟨V Zᵀ U, X⟩.
        Shape::Product { left, transposed: false, right } => left.transpose() * z * right.transpose(),
        Shape::Product { left, transposed: true, right } => right * z.transpose() * left,
        Shape::Scaled { weights, matrix } => crate::expression::inner_product(matrix, z) * weights,
    }
}

/// A block of the solver (column by column, or its diagonal alone) as a square matrix.
pub(crate) fn square(block: &[f64], n: usize) -> Mat<f64> {
    if block.len() == n * n {
        return Mat::from_fn(n, n, |i, j| block[i + j * n]);
    }
    Mat::from_fn(n, n, |i, j| if i == j { block[i] } else { 0.0 })
}

/// The largest absolute entry; NaN if there is one.
pub(crate) fn largest_entry(m: &Mat<f64>) -> f64 {
    (0..m.ncols())
        .map(|j| largest(m.col_as_slice(j)))
        .fold(0.0, |most, entry| if entry > most || entry.is_nan() { entry } else { most })
}

/// The largest absolute value; NaN if there is one.
fn largest(values: &[f64]) -> f64 {
    // Eight running maxima, and a sum that is NaN when an entry is: both go without branches.
    let (mut most, mut sum) = ([0.0_f64; 8], [0.0_f64; 8]);
    let chunks = values.chunks_exact(8);
    let rest =
        chunks.remainder().iter().fold(0.0_f64, |most, v| if v.abs() > most || v.is_nan() { v.abs() } else { most });
    for chunk in chunks {
        for k in 0..8 {
            let value = chunk[k].abs();
            most[k] = if value > most[k] { value } else { most[k] };
            sum[k] += value;
        }
    }
    if rest.is_nan() || sum.iter().any(|s| s.is_nan()) {
        return f64::NAN;
    }
    most.iter().fold(rest, |a, b| a.max(*b))
}
