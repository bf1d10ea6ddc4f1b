//! Dense kernels on symmetric and triangular matrices, n × n, column by column in a slice.

use crate::vectorized::vectorized;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::matmul as faer_matmul;
use faer::{Accum, MatMut, MatRef, Par, Spec};

/// Up to this size plain column loops beat the blocked algorithms' set-up.
const SMALL: usize = 40;

/// Scratch memory for the factorisations.
pub(crate) struct Scratch {
    buffer: MemBuffer,
    matrix: Vec<f64>,
}

impl Scratch {
    /// Enough for matrices up to `n` × `n`.
    pub fn new(n: usize) -> Self {
        let factor = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Spec::default());
        let inverse = llt::inverse::inverse_scratch::<f64>(n, Par::Seq);
        let solve = llt::solve::solve_in_place_scratch::<f64>(n, 1, Par::Seq);
        Self { buffer: MemBuffer::new(factor.or(inverse).or(solve)), matrix: vec![0.0; SMALL * SMALL] }
    }
}

/// c = a · b.
pub(crate) fn multiply(n: usize, a: &[f64], b: &[f64], c: &mut [f64]) {
    faer_matmul(
        MatMut::from_column_major_slice_mut(c, n, n),
        Accum::Replace,
        MatRef::from_column_major_slice(a, n, n),
        MatRef::from_column_major_slice(b, n, n),
        1.0,
        Par::Seq,
    );
}

/// c = aᵀ · b for a, b with `k` rows and `n` columns, row by row in the slices.
pub(crate) fn multiply_transposed(k: usize, n: usize, a: &[f64], b: &[f64], c: &mut [f64]) {
    faer_matmul(
        MatMut::from_column_major_slice_mut(c, n, n),
        Accum::Replace,
        MatRef::from_column_major_slice(a, n, k),
        MatRef::from_row_major_slice(b, k, n),
        1.0,
        Par::Seq,
    );
}

/// Replaces the lower triangle of `a` by its Cholesky factor. False when `a` is not positive definite (or not finite).
pub(crate) fn cholesky(n: usize, a: &mut [f64], scratch: &mut Scratch) -> bool {
    if n > SMALL {
        let stack = MemStack::new(&mut scratch.buffer);
        let matrix = MatMut::from_column_major_slice_mut(a, n, n);
        let done = llt::factor::cholesky_in_place(
            matrix,
            llt::factor::LltRegularization::default(),
            Par::Seq,
            stack,
            Spec::default(),
        );
        return done.is_ok() && (0..n).all(|j| a[j + j * n].is_finite() && a[j + j * n] > 0.0);
    }
    cholesky_by_columns(n, a)
}

vectorized! {
    fn cholesky_by_columns<'a>(n: usize, a: &'a mut [f64]) -> bool {
        for j in 0..n {
            let (head, tail) = a.split_at_mut((j + 1) * n);
            let column = &mut head[j * n..];
            let pivot = column[j];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return false;
            }
            let inverse = 1.0 / pivot.sqrt();
            for entry in &mut column[j..] {
                *entry *= inverse;
            }
            for (k, target) in tail.chunks_exact_mut(n).enumerate() {
                let k = j + 1 + k;
                axpy(-column[k], &column[k..], &mut target[k..]);
            }
        }
        true
    }
}

/// (L Lᵀ)⁻¹ as a full symmetric matrix, from the lower triangle L.
pub(crate) fn inverse_from_factor(n: usize, l: &[f64], out: &mut [f64], scratch: &mut Scratch) {
    if n > SMALL {
        let stack = MemStack::new(&mut scratch.buffer);
        llt::inverse::inverse(
            MatMut::from_column_major_slice_mut(out, n, n),
            MatRef::from_column_major_slice(l, n, n),
            Par::Seq,
            stack,
        );
        mirror_lower(n, out);
        return;
    }
    inverse_by_columns(n, l, &mut scratch.matrix[..n * n], out);
}

vectorized! {
    fn inverse_by_columns<'a>(n: usize, l: &'a [f64], transposed: &'a mut [f64], out: &'a mut [f64]) {
        // L⁻¹ column by column, kept as rows of its transpose so that the product below runs down columns.
        let mut x = [0.0; SMALL];
        for j in 0..n {
            x[j..n].fill(0.0);
            x[j] = 1.0;
            for k in j..n {
                let column = &l[k * n..(k + 1) * n];
                let value = x[k] / column[k];
                x[k] = value;
                axpy(-value, &column[k + 1..], &mut x[k + 1..n]);
                transposed[j + k * n] = value;
            }
        }
        out.fill(0.0);
        for (k, column) in transposed.chunks_exact(n).enumerate() {
            for j in 0..=k {
                axpy(
                    column[j],
                    &column[j..=k],
                    &mut out[j * n + j..j * n + k + 1],
                );
            }
        }
        mirror_lower(n, out);
    }
}

/// Copies the lower triangle to the upper one.
#[inline(always)]
pub(crate) fn mirror_lower(n: usize, a: &mut [f64]) {
    for j in 0..n {
        for i in 0..j {
            a[i + j * n] = a[j + i * n];
        }
    }
}

/// a ← ½(a + aᵀ).
pub(crate) fn symmetrize(n: usize, a: &mut [f64]) {
    for j in 0..n {
        for i in 0..j {
            let mean = 0.5 * (a[i + j * n] + a[j + i * n]);
            a[i + j * n] = mean;
            a[j + i * n] = mean;
        }
    }
}

/// y = A x for a symmetric (or column-wise given) matrix A.
#[inline(always)]
pub(crate) fn apply(n: usize, a: &[f64], x: &[f64], y: &mut [f64]) {
    y.fill(0.0);
    for (column, &x) in a.chunks_exact(n).zip(x) {
        axpy(x, column, y);
    }
}

/// y ← y + factor · x.
#[inline(always)]
pub(crate) fn axpy(factor: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// Σ xᵢ yᵢ, in eight running sums.
#[inline(always)]
pub(crate) fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (xs, ys) = (x.chunks_exact(8), y.chunks_exact(8));
    let tail: f64 = xs.remainder().iter().zip(ys.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in xs.zip(ys) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + tail
}

/// Euclidean norm; of a matrix in a slice, the Frobenius norm.
pub(crate) fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A = 2I + ones·onesᵀ/n, A⁻¹ = I/2 − ones·onesᵀ/(6n).
    #[test]
    fn factor_and_inverse_on_both_sides_of_the_switch() {
        for n in [1, 2, 7, SMALL, SMALL + 1, 70] {
            let size = n as f64;
            let entry = |i: usize, j: usize| if i == j { 2.0 + 1.0 / size } else { 1.0 / size };
            let a: Vec<f64> = (0..n * n).map(|at| entry(at % n, at / n)).collect();
            let mut scratch = Scratch::new(n);
            let (mut factor, mut inverse) = (a.clone(), vec![0.0; n * n]);
            assert!(cholesky(n, &mut factor, &mut scratch));
            inverse_from_factor(n, &factor, &mut inverse, &mut scratch);
            for i in 0..n {
                for j in 0..n {
                    let exact = if i == j { 0.5 } else { 0.0 } - 1.0 / (6.0 * size);
                    assert!((inverse[i + j * n] - exact).abs() < 1e-14, "{n}");
                }
            }
            let mut product = vec![0.0; n * n];
            multiply(n, &a, &inverse, &mut product);
            (0..n).for_each(|i| product[i + i * n] -= 1.0);
            assert!(norm(&product) < 1e-13);
        }
    }

    #[test]
    fn indefinite_and_unfinished_matrices_have_no_factor() {
        for n in [2, SMALL + 2] {
            let mut scratch = Scratch::new(n);
            let mut a = vec![0.0; n * n];
            assert!(!cholesky(n, &mut a, &mut scratch));
            a.fill(f64::NAN);
            assert!(!cholesky(n, &mut a, &mut scratch));
            a.fill(0.0);
            (0..n).for_each(|i| a[i + i * n] = 1.0);
            a[1 + n] = -1.0;
            assert!(!cholesky(n, &mut a, &mut scratch));
        }
    }

    #[test]
    fn dot_counts_every_entry_once() {
        for n in 0..40 {
            let x: Vec<f64> = (0..n).map(f64::from).collect();
            assert_eq!(dot(&x, &vec![1.0; x.len()]), f64::from(n * (n - 1) / 2));
        }
    }
}
