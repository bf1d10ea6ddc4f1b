//! Matrices of double-doubles, and the little linear algebra that the iteration needs.

use crate::double_double::{self as dd, Double};
use crate::vectorized::vectorized;

/// High and low parts, column by column. A vector is a matrix with one column.
#[derive(Clone, Debug, Default)]
pub(super) struct Matrix {
    pub h: Vec<f64>,
    pub l: Vec<f64>,
}

impl Matrix {
    pub fn zeros(len: usize) -> Self {
        Self { h: vec![0.0; len], l: vec![0.0; len] }
    }

    pub fn of(values: &[f64]) -> Self {
        Self { h: values.to_vec(), l: vec![0.0; values.len()] }
    }

    #[inline(always)]
    pub fn get(&self, at: usize) -> Double {
        Double { h: self.h[at], l: self.l[at] }
    }

    #[inline(always)]
    pub fn set(&mut self, at: usize, value: Double) {
        (self.h[at], self.l[at]) = (value.h, value.l);
    }

    pub fn fill_zero(&mut self) {
        self.h.fill(0.0);
        self.l.fill(0.0);
    }

    pub fn copy_from(&mut self, other: &Self) {
        self.h.copy_from_slice(&other.h);
        self.l.copy_from_slice(&other.l);
    }

    /// self ← self + a·other.
    pub fn add_multiple(&mut self, a: Double, other: &Self) {
        axpy(a, [&other.h, &other.l], [&mut self.h, &mut self.l]);
    }

    /// ½(M + Mᵀ) in place of an n × n matrix.
    pub fn symmetrize(&mut self, n: usize) {
        for j in 0..n {
            for i in 0..j {
                let sum = dd::accumulate(self.get(i + j * n), self.get(j + i * n));
                let half = Double { h: 0.5 * sum.h, l: 0.5 * sum.l };
                self.set(i + j * n, half);
                self.set(j + i * n, half);
            }
        }
    }

    /// The Frobenius norm, to the precision of `f64`.
    pub fn norm(&self) -> f64 {
        crate::dense::norm(&self.h)
    }
}

/// Σ aᵢbᵢ.
pub(super) fn dot(a: &Matrix, b: &Matrix) -> Double {
    inner_product([&a.h, &a.l], [&b.h, &b.l])
}

/// Partial sums of an inner product.
const LANES: usize = 8;

vectorized! {
    fn inner_product<'a>(a: [&'a [f64]; 2], b: [&'a [f64]; 2]) -> Double {
        let (mut h, mut l) = ([0.0; LANES], [0.0; LANES]);
        let whole = a[0].len() / LANES * LANES;
        for at in (0..whole).step_by(LANES) {
            let [ah, al] = a.map(|a| &a[at..at + LANES]);
            let [bh, bl] = b.map(|b| &b[at..at + LANES]);
            for k in 0..LANES {
                let product = dd::multiply(Double { h: ah[k], l: al[k] }, Double { h: bh[k], l: bl[k] });
                let sum = dd::accumulate(Double { h: h[k], l: l[k] }, product);
                (h[k], l[k]) = (sum.h, sum.l);
            }
        }
        let mut sum = Double::default();
        for at in whole..a[0].len() {
            let product = dd::multiply(Double { h: a[0][at], l: a[1][at] }, Double { h: b[0][at], l: b[1][at] });
            sum = dd::accumulate(sum, product);
        }
        for k in 0..LANES {
            sum = dd::accumulate(sum, Double { h: h[k], l: l[k] });
        }
        sum
    }
}

/// y ← y + a·x.
#[inline(always)]
fn add_scaled(a: Double, [xh, xl]: [&[f64]; 2], [yh, yl]: [&mut [f64]; 2]) {
    for (((yh, yl), xh), xl) in yh.iter_mut().zip(yl).zip(xh).zip(xl) {
        let product = dd::multiply(Double { h: *xh, l: *xl }, a);
        let sum = dd::accumulate(Double { h: *yh, l: *yl }, product);
        (*yh, *yl) = (sum.h, sum.l);
    }
}

/// Columns that are added at once.
const WIDTH: usize = 4;

/// y ← y + Σ aₖxₖ. Low parts are only put in order at the end.
#[inline(always)]
fn add_several(a: [Double; WIDTH], x: [[&[f64]; 2]; WIDTH], [yh, yl]: [&mut [f64]; 2]) {
    let len = yh.len();
    let yl = &mut yl[..len];
    let x = x.map(|[h, l]| [&h[..len], &l[..len]]);
    for i in 0..len {
        let (mut h, mut l) = (yh[i], yl[i]);
        for k in 0..WIDTH {
            let ([xh, xl], a) = (x[k], a[k]);
            let product = dd::two_product(xh[i], a.h);
            let sum = dd::two_sum(h, product.h);
            h = sum.h;
            l += sum.l + xl[i].mul_add(a.h, xh[i].mul_add(a.l, product.l));
        }
        let sum = dd::fast_two_sum(h, l);
        (yh[i], yl[i]) = (sum.h, sum.l);
    }
}

vectorized! {
    fn axpy<'a>(a: Double, x: [&'a [f64]; 2], y: [&'a mut [f64]; 2]) {
        add_scaled(a, x, y);
    }
}

vectorized! {
    /// c ← c + A·B for A of `rows` rows, B of `inner` rows, of which column j holds row `picked[k]` of A's columns at place k; B is given transposed,
    /// `columns` entries for each k.
    fn add_product_of_columns<'a>(
        rows: usize,
        columns: usize,
        a: [&'a [f64]; 2],
        picked: &'a [usize],
        b: [&'a [f64]; 2],
        c: [&'a mut [f64]; 2],
    ) {
        let [ch, cl] = c;
        for j in 0..columns {
            let column = j * rows..(j + 1) * rows;
            let of_a = |at: usize| [&a[0][at * rows..(at + 1) * rows], &a[1][at * rows..(at + 1) * rows]];
            let factor = |k: usize| Double { h: b[0][j + k * columns], l: b[1][j + k * columns] };
            let whole = picked.len() / WIDTH * WIDTH;
            for first in (0..whole).step_by(WIDTH) {
                let factors = std::array::from_fn(|k| factor(first + k));
                let of_a = std::array::from_fn(|k| of_a(picked[first + k]));
                add_several(factors, of_a, [&mut ch[column.clone()], &mut cl[column.clone()]]);
            }
            for (k, &at) in picked.iter().enumerate().skip(whole) {
                add_scaled(factor(k), of_a(at), [&mut ch[column.clone()], &mut cl[column.clone()]]);
            }
        }
    }
}

/// `Σ_k A[:, picked_k] B[:, k]ᵀ` for n × n matrices A and an n × |picked| matrix B.
pub(super) fn outer(n: usize, a: &Matrix, picked: &[usize], b: &Matrix, out: &mut Matrix) {
    out.fill_zero();
    add_product_of_columns(n, n, [&a.h, &a.l], picked, [&b.h, &b.l], [&mut out.h, &mut out.l]);
}

/// out ← AB for symmetric B, n × n.
pub(super) fn multiply(n: usize, a: &Matrix, b: &Matrix, out: &mut Matrix) {
    let all: Vec<usize> = (0..n).collect();
    outer(n, a, &all, b, out);
}

/// The lower triangular factor in place of a symmetric n × n matrix, of which the lower triangle is read; the upper triangle becomes zero. False
/// where there is none.
pub(super) fn cholesky(n: usize, m: &mut Matrix) -> bool {
    for j in 0..n {
        for i in 0..j {
            m.set(i + j * n, Double::default());
        }
    }
    factorize(n, &mut m.h, &mut m.l)
}

vectorized! {
    fn factorize<'a>(n: usize, high: &'a mut [f64], low: &'a mut [f64]) -> bool {
        for first in (0..n).step_by(WIDTH) {
            let last = (first + WIDTH).min(n);
            for k in first..last {
                let pivot = Double { h: high[k + k * n], l: low[k + k * n] };
                if !(pivot.h > 0.0 && pivot.h.is_finite()) {
                    return false;
                }
                let inverse = dd::reciprocal(dd::square_root(pivot));
                for i in k..n {
                    let entry = dd::multiply(Double { h: high[i + k * n], l: low[i + k * n] }, inverse);
                    (high[i + k * n], low[i + k * n]) = (entry.h, entry.l);
                }
                let (done_high, left_high) = high.split_at_mut((k + 1) * n);
                let (done_low, left_low) = low.split_at_mut((k + 1) * n);
                let (lh, ll) = (&done_high[k * n..], &done_low[k * n..]);
                for j in k + 1..last {
                    let factor = Double { h: -lh[j], l: -ll[j] };
                    let to = (j - k - 1) * n + j..(j - k) * n;
                    add_scaled(factor, [&lh[j..], &ll[j..]], [&mut left_high[to.clone()], &mut left_low[to]]);
                }
            }
            let (done_high, left_high) = high.split_at_mut(last * n);
            let (done_low, left_low) = low.split_at_mut(last * n);
            for j in last..n {
                // A whole panel: it is not the last one.
                let column = |k: usize| (first + k) * n + j..(first + k + 1) * n;
                let factors = std::array::from_fn(|k| {
                    let at = column(k).start;
                    Double { h: -done_high[at], l: -done_low[at] }
                });
                let columns = std::array::from_fn(|k| [&done_high[column(k)], &done_low[column(k)]]);
                let to = (j - last) * n + j..(j - last + 1) * n;
                add_several(factors, columns, [&mut left_high[to.clone()], &mut left_low[to]]);
            }
        }
        true
    }
}

/// L⁻¹ of a lower triangular matrix, lower triangular.
pub(super) fn inverse_of_factor(n: usize, l: &Matrix, out: &mut Matrix) {
    out.fill_zero();
    for j in 0..n {
        out.set(j + j * n, Double { h: 1.0, l: 0.0 });
        let column = j * n..(j + 1) * n;
        solve_lower(n, j, [&l.h, &l.l], [&mut out.h[column.clone()], &mut out.l[column]]);
    }
}

/// L⁻ᵀL⁻¹ from L⁻¹.
pub(super) fn inverse(n: usize, factor_inverse: &Matrix, transposed: &mut Matrix, out: &mut Matrix) {
    transpose(n, factor_inverse, transposed);
    // L⁻ᵀ L⁻¹ = Σ_k (L⁻ᵀ)[:, k] (L⁻ᵀ)[:, k]ᵀ.
    let all: Vec<usize> = (0..n).collect();
    outer(n, transposed, &all, transposed, out);
}

pub(super) fn transpose(n: usize, m: &Matrix, out: &mut Matrix) {
    for j in 0..n {
        for i in 0..n {
            out.set(j + i * n, m.get(i + j * n));
        }
    }
}

vectorized! {
    /// x ← L⁻¹x for an x that begins with `first` zeros.
    fn solve_lower<'a>(n: usize, first: usize, l: [&'a [f64]; 2], x: [&'a mut [f64]; 2]) {
        let [xh, xl] = x;
        for k in first..n {
            let pivot = Double { h: l[0][k + k * n], l: l[1][k + k * n] };
            let solved = dd::multiply(Double { h: xh[k], l: xl[k] }, dd::reciprocal(pivot));
            (xh[k], xl[k]) = (solved.h, solved.l);
            let below = k * n + k + 1..(k + 1) * n;
            let factor = Double { h: -solved.h, l: -solved.l };
            add_scaled(factor, [&l[0][below.clone()], &l[1][below]], [&mut xh[k + 1..n], &mut xl[k + 1..n]]);
        }
    }
}

/// x ← L⁻ᵀL⁻¹x.
pub(super) fn solve(n: usize, l: &Matrix, x: &mut Matrix) {
    solve_lower(n, 0, [&l.h, &l.l], [&mut x.h, &mut x.l]);
    for k in (0..n).rev() {
        let below = k * n + k + 1..(k + 1) * n;
        let sum = inner_product([&l.h[below.clone()], &l.l[below]], [&x.h[k + 1..], &x.l[k + 1..]]);
        let rest = dd::add(x.get(k), Double { h: -sum.h, l: -sum.l });
        x.set(k, dd::multiply(rest, dd::reciprocal(l.get(k + k * n))));
    }
}

/// Adds a multiple of column `from` of the first matrix, of n rows, to column `to` of the second one.
pub(super) fn add_column(n: usize, factor: Double, (a, from): (&Matrix, usize), (b, to): (&mut Matrix, usize)) {
    let (from, to) = (from * n..(from + 1) * n, to * n..(to + 1) * n);
    axpy(factor, [&a.h[from.clone()], &a.l[from]], [&mut b.h[to.clone()], &mut b.l[to]]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectorized::tests::with_every_instruction_set;

    /// A positive definite matrix with entries that no `f64` holds.
    fn definite(n: usize) -> Matrix {
        let mut m = Matrix::zeros(n * n);
        for j in 0..n {
            for i in 0..n {
                let h = if i == j { n as f64 + 1.0 } else { 1.0 / (1 + i + j) as f64 };
                m.set(i + j * n, Double { h, l: h * 3e-17 });
            }
        }
        m
    }

    fn largest_difference(a: &Matrix, b: &Matrix) -> f64 {
        let difference = |at: usize| dd::add(a.get(at), Double { h: -b.h[at], l: -b.l[at] }).h.abs();
        (0..a.h.len()).map(difference).fold(0.0, f64::max)
    }

    /// Sizes around the number of columns that are taken at once.
    #[test]
    fn factors_and_inverses() {
        with_every_instruction_set(|| {
            for n in [1, 2, 3, 4, 5, 8, 11] {
                let m = definite(n);
                let [mut factor, mut inverse, mut work, mut product, mut upper] =
                    [(); 5].map(|()| Matrix::zeros(n * n));
                factor.copy_from(&m);
                assert!(cholesky(n, &mut factor));
                multiply(n, &factor, &factor, &mut product);
                assert!(largest_difference(&product, &m) < 1e-29, "{n}");
                inverse_of_factor(n, &factor, &mut upper);
                super::inverse(n, &upper, &mut work, &mut inverse);
                multiply(n, &m, &inverse, &mut product);
                let identity: Vec<f64> = (0..n * n).map(|at| f64::from(u8::from(at % n == at / n))).collect();
                assert!(largest_difference(&product, &Matrix::of(&identity)) < 1e-29, "{n}");
                let mut x = Matrix::of(&(0..n).map(|i| i as f64 - 1.5).collect::<Vec<_>>());
                let right = x.clone();
                solve(n, &factor, &mut x);
                let row =
                    |i: usize| Matrix { h: m.h[i * n..(i + 1) * n].to_vec(), l: m.l[i * n..(i + 1) * n].to_vec() };
                for i in 0..n {
                    let rest = dd::add(dot(&row(i), &x), Double { h: -right.h[i], l: 0.0 });
                    assert!(rest.h.abs() < 1e-29, "{n}, {i}");
                }
            }
        });
    }

    #[test]
    fn what_is_not_definite_has_no_factor() {
        let mut m = Matrix::of(&[1.0, 1.0, 1.0, 1.0]);
        assert!(!cholesky(2, &mut m));
    }
}
