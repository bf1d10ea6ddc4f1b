//! Tensors of any order, as far as the higher-order singular value decomposition needs them: unfoldings and n-mode
//! products (De Lathauwer, De Moor and Vandewalle, "A multilinear singular value decomposition", SIAM J. Matrix Anal.
//! Appl. 21(4), 2000).

use super::Mat;
use serde::{Deserialize, Serialize};

/// A real tensor F of size I₁ × … × I_N, entries in row order: the last index runs fastest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tensor {
    shape: Vec<usize>,
    entries: Vec<f64>,
}

impl Tensor {
    /// The tensor of size `shape` with `entries` in row order.
    ///
    /// # Panics
    /// If the number of entries is not the product of the sizes.
    pub fn new(shape: Vec<usize>, entries: Vec<f64>) -> Self {
        assert_eq!(entries.len(), shape.iter().product::<usize>(), "a tensor of size {shape:?}");
        Self { shape, entries }
    }

    /// I₁ … I_N
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// The entries in row order.
    pub fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// The Frobenius norm √(Σ f²).
    pub fn norm(&self) -> f64 {
        // scaled, so that large entries do not overflow
        let largest = self.norm_max();
        match largest > 0.0 && largest.is_finite() {
            true => largest * self.entries.iter().map(|entry| (entry / largest).powi(2)).sum::<f64>().sqrt(),
            false => largest,
        }
    }

    /// max |f|
    pub fn norm_max(&self) -> f64 {
        self.entries.iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()))
    }

    /// (outer, I_n, inner): the entry with index i in mode n stands at (o·I_n + i)·inner + j.
    fn strides(&self, mode: usize) -> (usize, usize, usize) {
        let product = |sizes: &[usize]| sizes.iter().product();
        (product(&self.shape[..mode]), self.shape[mode], product(&self.shape[mode + 1..]))
    }

    /// The transposed unfolding F₍ₙ₎ᵀ: one column for each index of `mode` (from 0), one row for each choice of the others,
    /// in row order.
    ///
    /// # Panics
    /// If there is no such mode.
    pub fn unfolding_transposed(&self, mode: usize) -> Mat<f64> {
        let (outer, size, inner) = self.strides(mode);
        Mat::from_fn(outer * inner, size, |row, i| self.entries[(row / inner * size + i) * inner + row % inner])
    }

    /// F ×ₙ M: every fibre f along `mode` (from 0) replaced by Mf. M is J × Iₙ.
    ///
    /// # Panics
    /// If there is no such mode or M has another number of columns.
    pub fn mode_product(&self, mode: usize, matrix: &Mat<f64>) -> Self {
        let (outer, size, inner) = self.strides(mode);
        assert_eq!(matrix.ncols(), size, "columns of the matrix and size of mode {mode}");
        let mut shape = self.shape.clone();
        shape[mode] = matrix.nrows();
        let mut entries = vec![0.0; outer * matrix.nrows() * inner];
        for o in 0..outer {
            for j in 0..matrix.nrows() {
                let row = &mut entries[(o * matrix.nrows() + j) * inner..][..inner];
                for i in 0..size {
                    let fibre = &self.entries[(o * size + i) * inner..][..inner];
                    row.iter_mut().zip(fibre).for_each(|(sum, entry)| *sum += matrix[(j, i)] * entry);
                }
            }
        }
        Self { shape, entries }
    }
}
