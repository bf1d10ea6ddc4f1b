//! Dense kernels on symmetric and triangular matrices, n × n, column by column in a slice.

use crate::aligned::Aligned;
use crate::cholesky as middling;
use crate::small;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::matmul as faer_matmul;
use faer::{Accum, MatMut, MatRef, Par, Spec};

/// Up to this size plain loops beat the blocked algorithms' set-up.
const SMALL: usize = small::MOST;

/// Scratch memory for the factorisations.
pub(crate) struct Scratch {
    buffer: MemBuffer,
    /// Of matrices up to [`SMALL`] rows, or of the factorisation of those up to [`middling::MOST`].
    padded: Aligned,
}

impl Scratch {
    /// Enough for matrices up to `n` × `n`.
    pub fn new(n: usize) -> Self {
        let factor = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Spec::default());
        let inverse = llt::inverse::inverse_scratch::<f64>(n, Par::Seq);
        let of_middling = if n > SMALL { middling::memory(n) } else { 0 };
        let padded = small::scratch(n).max(of_middling);
        Self { buffer: MemBuffer::new(factor.or(inverse)), padded: Aligned::zeros(padded) }
    }
}

/// c = a · b.
pub(crate) fn multiply(n: usize, a: &[f64], b: &[f64], c: &mut [f64], scratch: &mut Scratch) {
    if n <= SMALL {
        small::multiply(n, a, b, c, &mut scratch.padded);
        return;
    }
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
    if n > SMALL && n <= middling::MOST {
        let stride = middling::stride(n);
        let padded = &mut scratch.padded[..n * stride];
        let columns = |j: usize| (j * stride + j..j * stride + n, j * n + j..(j + 1) * n);
        (0..n).map(columns).for_each(|(padded_column, column)| padded[padded_column].copy_from_slice(&a[column]));
        let done = middling::factorize(n, padded);
        (0..n).map(columns).for_each(|(padded_column, column)| a[column].copy_from_slice(&padded[padded_column]));
        return done;
    }
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
    n == 0 || small::cholesky(n, a, &mut scratch.padded)
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
    small::inverse_from_factor(n, l, out, &mut scratch.padded);
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
pub(crate) fn apply<S: pulp::Simd>(simd: S, n: usize, a: &[f64], x: &[f64], y: &mut [f64]) {
    let whole = n / S::F64_LANES * S::F64_LANES;
    let mut row = 0;
    // Four vectors of y stay in registers while the columns pass.
    while row + 4 * S::F64_LANES <= whole {
        rows::<S, 4>(simd, n, a, x, row, y);
        row += 4 * S::F64_LANES;
    }
    while row + S::F64_LANES <= whole {
        rows::<S, 1>(simd, n, a, x, row, y);
        row += S::F64_LANES;
    }
    if row < n {
        let mut sum = simd.splat_f64s(0.0);
        for (column, x) in a.chunks_exact(n).zip(x) {
            sum = simd.mul_add_e_f64s(simd.partial_load_f64s(&column[row..]), simd.splat_f64s(*x), sum);
        }
        simd.partial_store_f64s(&mut y[row..n], sum);
    }
}

/// M vectors of A x, from `row` on.
#[inline(always)]
fn rows<S: pulp::Simd, const M: usize>(simd: S, n: usize, a: &[f64], x: &[f64], row: usize, y: &mut [f64]) {
    let end = row + M * S::F64_LANES;
    let mut sums = [simd.splat_f64s(0.0); M];
    for (column, x) in a.chunks_exact(n).zip(x) {
        let (column, _) = S::as_simd_f64s(&column[row..end]);
        let x = simd.splat_f64s(*x);
        for (sum, entry) in sums.iter_mut().zip(column) {
            *sum = simd.mul_add_e_f64s(*entry, x, *sum);
        }
    }
    let (target, _) = S::as_mut_simd_f64s(&mut y[row..end]);
    target.copy_from_slice(&sums);
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
    use crate::vectorized::tests::with_every_instruction_set;

    /// A = 2I + ones·onesᵀ/n, A⁻¹ = I/2 − ones·onesᵀ/(6n).
    #[test]
    fn factor_and_inverse_of_every_size() {
        with_every_instruction_set(|| {
            (1..=SMALL + 2).chain([70, 126, 127, middling::MOST + 1]).for_each(factor_and_inverse)
        });
    }

    fn factor_and_inverse(n: usize) {
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
        multiply(n, &a, &inverse, &mut product, &mut scratch);
        (0..n).for_each(|i| product[i + i * n] -= 1.0);
        assert!(norm(&product) < 1e-13, "{n}");
        let mut x: Vec<f64> = (0..n).map(|i| i as f64 - 3.0).collect();
        let right = x.clone();
        crate::cholesky::solve_with_factor(n, n, &factor, &mut x);
        let mean = right.iter().sum::<f64>() / size;
        assert!(x.iter().zip(&right).all(|(x, r)| (x - 0.5 * r + mean / 6.0).abs() < 1e-13 * size), "{n}");
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
