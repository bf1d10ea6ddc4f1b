//! Kernels on matrices of up to [`MOST`] rows, whose columns fit a few vector registers. Column by column in slices; inner loops run
//! over columns that are padded to whole vectors.

use crate::aligned::PADDING;
use crate::vectorized::arch;

/// Most rows.
pub(crate) const MOST: usize = 40;

/// Numbers of scratch memory for matrices up to n rows: as many columns of at most [`MOST`] vectors of two, or fewer of longer ones.
pub(crate) fn scratch(n: usize) -> usize {
    n.min(MOST) * MOST * 2
}

/// c = a · b.
pub(crate) fn multiply(n: usize, a: &[f64], b: &[f64], c: &mut [f64], padded: &mut [f64]) {
    arch().dispatch(Multiply { n, a, b, c, padded });
}

/// (L Lᵀ)⁻¹ as a full symmetric matrix, from the lower triangle L.
pub(crate) fn inverse_from_factor(n: usize, l: &[f64], out: &mut [f64], padded: &mut [f64]) {
    arch().dispatch(Inverse { n, l, out, padded });
}

/// Replaces the lower triangle of `a` by its Cholesky factor. False when `a` is not positive definite (or not finite).
pub(crate) fn cholesky(n: usize, a: &mut [f64], padded: &mut [f64]) -> bool {
    arch().dispatch(Cholesky { n, a, padded })
}

/// Calls a method with the number of vectors in a column known to the compiler, so that they stay in registers.
macro_rules! with_height {
    ($kernel:expr, $simd:expr, $set:ident) => {
        with_height!($kernel, $simd, $set, 1 2 3 4 5 6 8 10)
    };
    ($kernel:expr, $simd:expr, $set:ident, $($known:literal)*) => {
        match $kernel.n.next_multiple_of(PADDING) / $set::F64_LANES {
            $($known => $kernel.with_height::<$set, $known>($simd),)*
            _ => $kernel.with_height::<$set, MOST>($simd),
        }
    };
}

struct Multiply<'a> {
    n: usize,
    a: &'a [f64],
    b: &'a [f64],
    c: &'a mut [f64],
    padded: &'a mut [f64],
}

impl pulp::WithSimd for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Self { n, a, b, c, padded } = self;
        let stride = n.next_multiple_of(PADDING);
        for (to, from) in padded.chunks_exact_mut(stride).zip(a.chunks_exact(n)) {
            to[..n].copy_from_slice(from);
            to[n..].fill(0.0);
        }
        let (columns, _) = S::as_simd_f64s(&padded[..n * stride]);
        let height = stride / S::F64_LANES;
        // As many accumulators as there are registers for.
        let panel = if S::F64_LANES == 8 { 4 } else { 3 };
        // The padding may end with vectors that hold no row.
        let filled = n.div_ceil(S::F64_LANES);
        for first in (0..filled).step_by(panel).rev() {
            let rows = panel.min(filled - first);
            let panel = Panel { n, height, first, columns };
            let mut column = 0;
            while column + 4 <= n {
                panel.multiply_rows::<S, 4>(simd, rows, b, column, c);
                column += 4;
            }
            while column < n {
                panel.multiply_rows::<S, 1>(simd, rows, b, column, c);
                column += 1;
            }
        }
    }
}

/// Some vectors of every column of a matrix.
struct Panel<'a, V> {
    n: usize,
    /// Vectors in a column.
    height: usize,
    first: usize,
    columns: &'a [V],
}

impl<V: Copy> Panel<'_, V> {
    #[inline(always)]
    fn multiply_rows<S: pulp::Simd<f64s = V>, const N: usize>(
        &self,
        simd: S,
        rows: usize,
        b: &[f64],
        column: usize,
        c: &mut [f64],
    ) {
        match rows {
            1 => self.multiply::<S, 1, N>(simd, b, column, c),
            2 => self.multiply::<S, 2, N>(simd, b, column, c),
            3 => self.multiply::<S, 3, N>(simd, b, column, c),
            _ => self.multiply::<S, 4, N>(simd, b, column, c),
        }
    }

    /// M vectors of N columns of the product, from `column` on.
    #[inline(always)]
    fn multiply<S: pulp::Simd<f64s = V>, const M: usize, const N: usize>(
        &self,
        simd: S,
        b: &[f64],
        column: usize,
        c: &mut [f64],
    ) {
        let n = self.n;
        let right: [&[f64]; N] = std::array::from_fn(|j| &b[(column + j) * n..(column + j + 1) * n]);
        let mut sums = [[simd.splat_f64s(0.0); M]; N];
        for (k, vectors) in self.columns.chunks_exact(self.height).enumerate() {
            let left: [V; M] = std::array::from_fn(|i| vectors[self.first + i]);
            for j in 0..N {
                let factor = simd.splat_f64s(right[j][k]);
                for i in 0..M {
                    sums[j][i] = simd.mul_add_e_f64s(left[i], factor, sums[j][i]);
                }
            }
        }
        for (j, sums) in sums.iter().enumerate() {
            store::<S, M>(sums, c, (column + j) * n + self.first * S::F64_LANES, (column + j + 1) * n);
        }
    }
}

/// Writes vectors from `start` on, to `end` or beyond: columns are written in their order, the lowest rows of all of them first, so that what
/// follows is not lost. Behind the last column there is nothing to write to.
#[inline(always)]
fn store<S: pulp::Simd, const M: usize>(vectors: &[S::f64s; M], target: &mut [f64], start: usize, end: usize) {
    let whole = start + M * S::F64_LANES;
    if whole <= target.len() {
        S::as_mut_simd_f64s(&mut target[start..whole]).0.copy_from_slice(vectors);
        return;
    }
    let values: &[f64] = pulp::bytemuck::cast_slice(&vectors[..]);
    target[start..end].copy_from_slice(&values[..end - start]);
}

struct Inverse<'a> {
    n: usize,
    l: &'a [f64],
    out: &'a mut [f64],
    padded: &'a mut [f64],
}

impl pulp::WithSimd for Inverse<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        with_height!(self, simd, S)
    }
}

impl Inverse<'_> {
    /// For columns of at most H vectors.
    #[inline(always)]
    fn with_height<S: pulp::Simd, const H: usize>(self, simd: S) {
        let Self { n, l, out, padded } = self;
        let stride = H * S::F64_LANES;
        let (rows, _) = S::as_mut_simd_f64s(&mut padded[..n * stride]);
        // X = L⁻¹ row by row, from L X = I.
        for k in 0..n {
            let (done, row) = rows.split_at_mut(k * H);
            let mut sums = [simd.splat_f64s(0.0); H];
            for (j, above) in done.chunks_exact(H).enumerate() {
                let factor = simd.splat_f64s(-l[k + j * n]);
                for i in 0..H {
                    sums[i] = simd.mul_add_e_f64s(factor, above[i], sums[i]);
                }
            }
            let pivot = 1.0 / l[k + k * n];
            let scale = simd.splat_f64s(pivot);
            for i in 0..H {
                row[i] = simd.mul_f64s(sums[i], scale);
            }
            let row: &mut [f64] = pulp::bytemuck::cast_slice_mut(&mut row[..H]);
            row[k] = pivot;
        }
        // XᵀX, two columns at a time: column i = Σ_{k ≥ i} X[k, i] X[k, ..].
        let mut column = 0;
        while column < n {
            let second = (column + 1).min(n - 1);
            let mut sums = [[simd.splat_f64s(0.0); H]; 2];
            for x in rows.chunks_exact(H).skip(column) {
                let entries: &[f64] = pulp::bytemuck::cast_slice(x);
                let factors = [simd.splat_f64s(entries[column]), simd.splat_f64s(entries[second])];
                for i in 0..H {
                    sums[0][i] = simd.mul_add_e_f64s(factors[0], x[i], sums[0][i]);
                    sums[1][i] = simd.mul_add_e_f64s(factors[1], x[i], sums[1][i]);
                }
            }
            for (at, sums) in [column, second].into_iter().zip(&sums) {
                store::<S, H>(sums, out, at * n, (at + 1) * n);
            }
            column += 2;
        }
    }
}

struct Cholesky<'a> {
    n: usize,
    a: &'a mut [f64],
    padded: &'a mut [f64],
}

impl pulp::WithSimd for Cholesky<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> bool {
        with_height!(self, simd, S)
    }
}

impl Cholesky<'_> {
    /// For columns of at most H vectors: each column less its part in those before, whole columns at a time.
    #[inline(always)]
    fn with_height<S: pulp::Simd, const H: usize>(self, simd: S) -> bool {
        let Self { n, a, padded } = self;
        let stride = H * S::F64_LANES;
        for (j, (to, from)) in padded.chunks_exact_mut(stride).zip(a.chunks_exact_mut(n)).enumerate() {
            to[..n].copy_from_slice(from);
            to[n..].fill(0.0);
            to[..j].fill(0.0);
        }
        for j in 0..n {
            let (done, rest) = padded.split_at_mut(j * stride);
            let column = S::as_mut_simd_f64s(&mut rest[..stride]).0;
            // Two sums, so that one product need not wait for the other.
            let mut sums = [[simd.splat_f64s(0.0); H]; 2];
            for (k, l) in done.chunks_exact(stride).enumerate() {
                let (factor, l) = (simd.splat_f64s(-l[j]), S::as_simd_f64s(l).0);
                for i in 0..H {
                    sums[k % 2][i] = simd.mul_add_e_f64s(factor, l[i], sums[k % 2][i]);
                }
            }
            for i in 0..H {
                column[i] = simd.add_f64s(column[i], simd.add_f64s(sums[0][i], sums[1][i]));
            }
            let pivot = rest[j];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return false;
            }
            let column = S::as_mut_simd_f64s(&mut rest[..stride]).0;
            let inverse = simd.splat_f64s(1.0 / pivot.sqrt());
            for entry in column {
                *entry = simd.mul_f64s(*entry, inverse);
            }
            a[j * n + j..(j + 1) * n].copy_from_slice(&rest[j..n]);
        }
        true
    }
}
