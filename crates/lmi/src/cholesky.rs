//! The Cholesky factorisation of matrices of middling size, too large for registers and too small for the packing that general products
//! begin with: column by column from the left, four columns at a time.

use crate::aligned::PADDING;
use crate::dense::dot;
use crate::vectorized::{arch, vectorized};

/// Most rows.
pub(crate) const MOST: usize = 256;
/// Columns that are formed at once.
const PANEL: usize = 4;

/// How far apart the padded columns begin: an odd number of cache lines, so that a row is not all in the same few sets of the cache.
pub(crate) fn stride(n: usize) -> usize {
    let lines = n.div_ceil(PADDING);
    (lines + 1 - lines % 2) * PADDING
}

/// Memory for the padded columns of matrices up to n rows.
pub(crate) fn memory(n: usize) -> usize {
    n.min(MOST) * stride(n.min(MOST))
}

/// Replaces the lower triangle of `a`, columns a [`stride`] apart, by its Cholesky factor. False when `a` is not positive definite (or
/// not finite).
pub(crate) fn factorize(n: usize, a: &mut [f64]) -> bool {
    arch().dispatch(Cholesky { n, a })
}

struct Cholesky<'a> {
    n: usize,
    a: &'a mut [f64],
}

impl pulp::WithSimd for Cholesky<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> bool {
        let Self { n, a } = self;
        let stride = stride(n);
        // What is above the diagonal in its vector goes along with the rows below.
        a.chunks_exact_mut(stride).enumerate().for_each(|(j, column)| column[j - j % PADDING..j].fill(0.0));
        let filled = n.div_ceil(S::F64_LANES);
        // As many accumulators as there are registers for.
        let most = if S::F64_LANES == 8 { 4 } else { 3 };
        for first in (0..n).step_by(PANEL) {
            let width = PANEL.min(n - first);
            let (done, rest) = a.split_at_mut(first * stride);
            for start in (first / S::F64_LANES..filled).step_by(most) {
                let rows = Rows { stride, first, start, done };
                match (width, most.min(filled - start)) {
                    (PANEL, 1) => rows.subtract::<S, 1, PANEL>(simd, rest),
                    (PANEL, 2) => rows.subtract::<S, 2, PANEL>(simd, rest),
                    (PANEL, 3) => rows.subtract::<S, 3, PANEL>(simd, rest),
                    (PANEL, 4) => rows.subtract::<S, 4, PANEL>(simd, rest),
                    (_, count) => {
                        for (j, column) in rest.chunks_exact_mut(stride).enumerate().take(width) {
                            for start in start..start + count {
                                Rows { first: first + j, start, ..rows }.subtract::<S, 1, 1>(simd, column);
                            }
                        }
                    }
                }
            }
            if !factorize_panel(simd, rest, stride, first..first + width, filled) {
                return false;
            }
        }
        true
    }
}

/// Some vectors of rows of the finished columns.
#[derive(Clone, Copy)]
struct Rows<'a> {
    stride: usize,
    /// The first unfinished column.
    first: usize,
    /// The first of the vectors.
    start: usize,
    done: &'a [f64],
}

impl Rows<'_> {
    /// Takes from M vectors of N columns their part in the finished ones.
    #[inline(always)]
    fn subtract<S: pulp::Simd, const M: usize, const N: usize>(self, simd: S, columns: &mut [f64]) {
        let Self { stride, first, start, done } = self;
        let range = start * S::F64_LANES..(start + M) * S::F64_LANES;
        let mut sums = [[simd.splat_f64s(0.0); M]; N];
        for l in done.chunks_exact(stride) {
            let left: &[S::f64s] = S::as_simd_f64s(&l[range.clone()]).0;
            let left: [S::f64s; M] = std::array::from_fn(|i| left[i]);
            let right = &l[first..first + N];
            for j in 0..N {
                let factor = simd.splat_f64s(right[j]);
                for i in 0..M {
                    sums[j][i] = simd.mul_add_e_f64s(factor, left[i], sums[j][i]);
                }
            }
        }
        for (sums, column) in sums.iter().zip(columns.chunks_exact_mut(stride)) {
            let column = S::as_mut_simd_f64s(&mut column[range.clone()]).0;
            for i in 0..M {
                column[i] = simd.sub_f64s(column[i], sums[i]);
            }
        }
    }
}

/// Finishes the columns of a panel, which lack nothing but each other's part.
#[inline(always)]
fn factorize_panel<S: pulp::Simd>(
    simd: S,
    panel: &mut [f64],
    stride: usize,
    columns: std::ops::Range<usize>,
    filled: usize,
) -> bool {
    let vectors = columns.start / S::F64_LANES..filled;
    for (k, j) in columns.clone().enumerate() {
        let (done, rest) = panel.split_at_mut(k * stride);
        let column = &mut rest[..stride];
        for l in done.chunks_exact(stride) {
            let (factor, l) = (simd.splat_f64s(-l[j]), &S::as_simd_f64s(l).0[vectors.clone()]);
            for (x, l) in S::as_mut_simd_f64s(column).0[vectors.clone()].iter_mut().zip(l) {
                *x = simd.mul_add_e_f64s(factor, *l, *x);
            }
        }
        let pivot = column[j];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        let inverse = simd.splat_f64s(1.0 / pivot.sqrt());
        for x in &mut S::as_mut_simd_f64s(column).0[vectors.clone()] {
            *x = simd.mul_f64s(*x, inverse);
        }
    }
    true
}

vectorized! {
    /// x ← (L Lᵀ)⁻¹ x for the lower triangle L, columns `stride` apart.
    pub(crate) fn solve_with_factor<'a>(n: usize, stride: usize, l: &'a [f64], x: &'a mut [f64]) {
        for first in (0..n).step_by(PANEL) {
            let end = (first + PANEL).min(n);
            for j in first..end {
                let known: f64 = (first..j).map(|k| l[j + k * stride] * x[k]).sum();
                x[j] = (x[j] - known) / l[j + j * stride];
            }
            if end < n {
                let (known, rest) = x.split_at_mut(end);
                let columns: [&[f64]; PANEL] = std::array::from_fn(|k| &l[(first + k) * stride + end..(first + k) * stride + n]);
                let factors: [f64; PANEL] = std::array::from_fn(|k| known[first + k]);
                for (i, x) in rest.iter_mut().enumerate() {
                    *x -= (0..PANEL).map(|k| factors[k] * columns[k][i]).sum::<f64>();
                }
            }
        }
        for first in (0..n).step_by(PANEL).rev() {
            let end = (first + PANEL).min(n);
            if end < n {
                let (unknown, known) = x.split_at_mut(end);
                for (k, x) in unknown[first..].iter_mut().enumerate() {
                    *x -= dot(&l[(first + k) * stride + end..(first + k) * stride + n], known);
                }
            }
            for j in (first..end).rev() {
                let known: f64 = (j + 1..end).map(|k| l[k + j * stride] * x[k]).sum();
                x[j] = (x[j] - known) / l[j + j * stride];
            }
        }
    }
}
