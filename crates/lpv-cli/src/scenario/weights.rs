//! Symmetric matrices of a scenario: weights and covariances.

use super::door::Door;
use super::file::{Diagonal, Rows};
use crate::failure::Failure;
use lpv::math::Mat;
use lpv::math::definite::{Definiteness, definiteness};
use lpv::math::eigen::smallest_eigenvalue;
use lpv::math::matrix::{diagonal, from_rows, inverse_spd, is_finite, is_symmetric};

/// A symmetric positive definite matrix from `key` (in full) or `key_diag`.
pub(crate) fn definite(door: &Door, key: &str, rows: Rows, diag: Diagonal, size: usize) -> Result<Mat<f64>, Failure> {
    let (key, matrix) = square(door, key, rows, diag, size)?;
    // by Cholesky: computed eigenvalues are off by a rounding error of the largest
    match inverse_spd(&matrix) {
        Some(inverse) if is_finite(&inverse) => Ok(matrix),
        Some(_) => door.refuse(key, "is too small to be inverted; scale it up"),
        None => door.refuse(
            key,
            format!(
                "is not positive definite: its smallest eigenvalue is {:.6e}; it has to be above zero, by more than rounding",
                smallest_eigenvalue(&matrix)
            ),
        ),
    }
}

/// A symmetric positive semidefinite matrix from `key` (in full) or `key_diag`.
pub(crate) fn semidefinite(
    door: &Door,
    key: &str,
    rows: Rows,
    diag: Diagonal,
    size: usize,
) -> Result<Mat<f64>, Failure> {
    let (key, matrix) = square(door, key, rows, diag, size)?;
    let least = smallest_eigenvalue(&matrix);
    // a certificate reads the numbers as they are, and so does the door
    let is_semidefinite = match definiteness(&matrix) {
        Some(definiteness) => definiteness != Definiteness::Indefinite,
        None => least >= -1e-12 * matrix.norm_max(),
    };
    match is_semidefinite {
        true => Ok(matrix),
        false => door.refuse(
            key,
            format!("is not positive semidefinite: its smallest eigenvalue is {least:.6e}; it cannot be below zero"),
        ),
    }
}

/// The matrix, and the key that it was given under.
fn square(door: &Door, key: &str, rows: Rows, diag: Diagonal, size: usize) -> Result<(String, Mat<f64>), Failure> {
    let (key, matrix) = match (rows, diag) {
        (Some(_), Some(_)) => {
            return door.refuse(key, format!("both {key} and {key}_diag are given; keep one"));
        }
        (None, None) => {
            return door.refuse(
                key,
                format!("is missing: give {key} as {size} rows of {size} numbers, or {key}_diag as {size} numbers"),
            );
        }
        (None, Some(entries)) => {
            let key = format!("{key}_diag");
            if entries.len() != size {
                return door.refuse(key, format!("has {} numbers: the model needs {size}", entries.len()));
            }
            (key, diagonal(&entries))
        }
        (Some(rows), None) => {
            if rows.is_empty() {
                let message = format!("has no rows: the model needs a {size} × {size} matrix");
                return door.refuse(key, message);
            }
            if rows.len() != size || rows.iter().any(|row| row.len() != size) {
                let widths: Vec<String> = rows.iter().map(|row| row.len().to_string()).collect();
                let message = format!(
                    "has {} rows with {} numbers: the model needs a {size} × {size} matrix",
                    rows.len(),
                    widths.join(", ")
                );
                return door.refuse(key, message);
            }
            (key.to_owned(), from_rows(&rows))
        }
    };
    if (0..size).any(|i| (0..size).any(|j| !matrix[(i, j)].is_finite())) {
        return door.refuse(key, "has an entry that is not finite");
    }
    if !is_symmetric(&matrix, 1e-12) {
        return door.refuse(key, "is not symmetric; entries (i, j) and (j, i) have to be equal");
    }
    Ok((key, matrix))
}
