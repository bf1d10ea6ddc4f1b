//! Matrices, weights and states of a file, checked.

use crate::failure::Failure;
use crate::scenario::door::Door;
use lpv::math::Mat;
use lpv::math::matrix::from_rows;

/// Convex weights sum to one, and rates to zero, up to this.
pub(super) const SUM_TOLERANCE: f64 = 1e-9;

/// A matrix of finite numbers from its rows.
pub(super) fn matrix(door: &Door, key: &str, rows: &[Vec<f64>]) -> Result<Mat<f64>, Failure> {
    let width = rows.first().map_or(0, Vec::len);
    if width == 0 {
        return door.refuse(key, "is empty: give rows of numbers");
    }
    if let Some(row) = rows.iter().position(|row| row.len() != width) {
        return door.refuse(key, format!("row {} has {} numbers, and row 1 has {width}", row + 1, rows[row].len()));
    }
    if rows.iter().flatten().any(|entry| !entry.is_finite()) {
        return door.refuse(key, "has an entry that is not finite");
    }
    Ok(from_rows(rows))
}

pub(super) fn convex_weights(door: &Door, key: &str, weights: &[f64], count: usize) -> Result<(), Failure> {
    if weights.len() != count {
        return door.refuse(key, format!("has {} numbers: the model has {count} vertices", weights.len()));
    }
    let sum: f64 = weights.iter().sum();
    match weights.iter().all(|&weight| weight >= 0.0) && (sum - 1.0).abs() <= SUM_TOLERANCE {
        true => Ok(()),
        false => {
            door.refuse(key, format!("is {weights:?}: the weights of the vertices are zero or more and sum to one"))
        }
    }
}

pub(super) fn state(door: &Door, key: &str, x: &[f64], n: usize) -> Result<(), Failure> {
    if x.len() != n {
        return door.refuse(key, format!("has {} numbers: the model has {n} states", x.len()));
    }
    x.iter().try_for_each(|&value| door.finite(key, value).map(|_| ()))
}
