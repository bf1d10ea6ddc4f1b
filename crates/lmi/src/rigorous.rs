//! Proofs that symmetric matrices are positive definite, every rounding error accounted for.
//!
//! A matrix F known up to a radius, `|F − F̃| ≤ R` entry by entry, satisfies `F ⪰ cI` when the floating-point Cholesky factorisation
//! of `D(F̃ − cI)D − diag(τ)` runs to its end, D diagonal with powers of two that bring the diagonal of F̃ near 1 and
//!
//! ```text
//! τᵢ ≥ Σⱼ dᵢ Rᵢⱼ dⱼ + n · κ · maxⱼ dⱼ² F̃ⱼⱼ,     κ = γ/(1 − γ),  γ = (n + 1)υ/(1 − (n + 1)υ)
//! ```
//!
//! for arithmetic of unit roundoff υ: a factorisation that ends is that of a matrix which differs by at most `κ√(bᵢᵢbⱼⱼ)`
//! from the one given (Demmel 1989; Higham, Accuracy and Stability of Numerical Algorithms, Theorem 10.3; Rump, BIT 46, 2006), and
//! `diag(Σⱼ Eᵢⱼ)` exceeds any symmetric matrix with entries of at most Eᵢⱼ. The arithmetic is double-double (υ = 2⁻¹⁰⁰), so
//! that matrices are proved definite whose smallest eigenvalue is far below the rounding errors of `f64`.
//!
//! Nothing here is shared with the solver, except that both may compute in double-double.

mod factor;

use crate::Mat;
use crate::double_double::{self as dd, Double, UNIT};
use crate::expression::{Expr, Shape, Unknown};
use crate::vectorized::vectorized;
use crate::verification::Spectrum;
use factor::Factor;

/// Absolute error that underflow may leave in an entry, against the largest factor in its terms.
const UNDERFLOW: f64 = 1e-290;
/// Least amount by which a negative bound stays below the estimate.
const LEAST_ROUNDING: f64 = 1e-280;
/// Halvings of the first guess when a lower bound is looked for.
const HALVINGS: i32 = 120;

/// A matrix with bounds on its entries. Column by column; of a diagonal matrix, the diagonal.
#[derive(Clone, Debug)]
pub(crate) struct Enclosure {
    n: usize,
    diagonal: bool,
    high: Vec<f64>,
    low: Vec<f64>,
    /// Sum of the absolute values of the terms of each entry.
    magnitude: Vec<f64>,
    /// Most roundings that one term has been through.
    roundings: f64,
    /// Largest absolute factor in any term.
    factor: f64,
}

impl Enclosure {
    /// The n × n zero matrix.
    pub fn zeros(n: usize, diagonal: bool) -> Self {
        let len = if diagonal { n } else { n * n };
        let zero = || vec![0.0; len];
        Self { n, diagonal, high: zero(), low: zero(), magnitude: zero(), roundings: 4.0, factor: 1.0 }
    }

    /// Of a symmetric expression at the unknowns given, its symmetric part.
    pub fn of_expression<'a>(expression: &Expr, value_of: &dyn Fn(Unknown) -> &'a Mat<f64>) -> Self {
        Self::of_terms(Self::of_entries(&expression.constant), expression, value_of)
    }

    /// Of the expression without its known part.
    pub fn of_change<'a>(expression: &Expr, value_of: &dyn Fn(Unknown) -> &'a Mat<f64>) -> Self {
        Self::of_terms(Self::zeros(expression.nrows(), false), expression, value_of)
    }

    fn of_terms<'a>(mut sum: Self, expression: &Expr, value_of: &dyn Fn(Unknown) -> &'a Mat<f64>) -> Self {
        for term in expression.terms.iter() {
            sum.add_term(&term.shape, value_of(term.unknown));
        }
        sum.symmetrize();
        sum
    }

    /// Of a known matrix, its symmetric part.
    pub fn of_matrix(matrix: &Mat<f64>) -> Self {
        let mut sum = Self::of_entries(matrix);
        sum.symmetrize();
        sum
    }

    /// Of a known square matrix as it is.
    fn of_entries(matrix: &Mat<f64>) -> Self {
        let high = columns(matrix);
        let magnitude = high.iter().map(|entry| entry.abs()).collect();
        let factor = crate::verification::largest_entry(matrix).max(1.0);
        Self { high, magnitude, factor, ..Self::zeros(matrix.nrows(), false) }
    }

    /// Adds products a·b to entries (i, j), given as (i, j, a, b).
    pub fn add_products(&mut self, mut products: impl Iterator<Item = (usize, usize, f64, f64)>) {
        add_products(self, &mut products);
    }

    fn add_term(&mut self, shape: &Shape, x: &Mat<f64>) {
        let n = self.n;
        let largest = crate::verification::largest_entry;
        match shape {
            Shape::Product { left, transposed, right } => {
                let (r, c) = if *transposed { (x.ncols(), x.nrows()) } else { (x.nrows(), x.ncols()) };
                let size = |m: &Mat<f64>| largest(m).max(1.0);
                let [a, b, d] = [left, x, right].map(size);
                self.factor = self.factor.max(a * b).max(b * d).max(d * a);
                let middle = if *transposed { columns(x) } else { rows(x) };
                let (left, right) = (columns(left), columns(right));
                triple_product(
                    [n, n],
                    [r, c],
                    [&left, &middle, &right],
                    [&mut self.high, &mut self.low, &mut self.magnitude],
                );
                self.roundings += (r + c + 4) as f64;
            }
            Shape::Scaled { weights, matrix } => {
                let sum = SumOfProducts::of(columns(weights).into_iter().zip(columns(x)));
                add_multiple(sum, &columns(matrix), [&mut self.high, &mut self.low, &mut self.magnitude]);
                self.factor = self.factor.max(largest(weights)).max(largest(x)).max(largest(matrix));
                self.roundings += (weights.nrows() * weights.ncols() + 4) as f64;
            }
        }
    }

    fn symmetrize(&mut self) {
        let n = self.n;
        for j in 0..n {
            for i in 0..j {
                let (a, b) = (i + j * n, j + i * n);
                let sum = dd::add(
                    Double { h: 0.5 * self.high[a], l: 0.5 * self.low[a] },
                    Double { h: 0.5 * self.high[b], l: 0.5 * self.low[b] },
                );
                let magnitude = 0.5 * (self.magnitude[a] + self.magnitude[b]);
                for at in [a, b] {
                    (self.high[at], self.low[at], self.magnitude[at]) = (sum.h, sum.l, magnitude);
                }
            }
        }
        self.roundings += 1.0;
    }

    /// The one entry of a 1 × 1 matrix, rounded, with a bound on its error.
    pub fn scalar(&self) -> (f64, f64) {
        let value = self.high[0] + self.low[0];
        (value, 1.001 * self.radius(0) + 2.0 * f64::EPSILON * value.abs())
    }

    /// The rows and columns given.
    pub fn part(&self, rows: &[usize]) -> Self {
        let n = self.n;
        let pick = |of: &[f64]| -> Vec<f64> {
            if self.diagonal {
                return rows.iter().map(|&i| of[i]).collect();
            }
            rows.iter().flat_map(|&j| rows.iter().map(move |&i| of[i + j * n])).collect()
        };
        let [high, low, magnitude] = [&self.high, &self.low, &self.magnitude].map(|of| pick(of));
        Self { n: rows.len(), high, low, magnitude, ..*self }
    }

    /// The entries as they were computed, of a diagonal matrix its diagonal as a column.
    pub fn approximate(&self) -> Mat<f64> {
        let columns = if self.diagonal { 1 } else { self.n };
        Mat::from_fn(self.n, columns, |i, j| self.high[i + j * self.n])
    }

    /// Upper bounds on the absolute entries, of a diagonal matrix those of its diagonal.
    pub fn absolute_bounds(&self) -> Vec<f64> {
        let bound = |at: usize| 1.001 * (self.high[at].abs() + self.low[at].abs() + self.radius(at));
        (0..self.high.len()).map(bound).collect()
    }

    /// Bound on the distance of an entry from its true value: γ_k Σ|terms|, rounded up.
    fn radius(&self, at: usize) -> f64 {
        2.0 * self.roundings * UNIT * self.magnitude[at] + UNDERFLOW * self.factor * self.roundings
    }

    /// A proved lower bound on the smallest eigenvalue, −∞ where none is found.
    ///
    /// The closer the estimate, the fewer the factorisations; a wrong one costs time or sharpness, never truth.
    pub fn smallest_eigenvalue_bound(&self, estimate: &Spectrum) -> f64 {
        if self.n == 0 {
            return f64::INFINITY;
        }
        if self.diagonal {
            return self.smallest_entry();
        }
        let Spectrum { smallest, rounding, .. } = *estimate;
        if !(smallest.is_finite() && rounding.is_finite()) {
            return f64::NEG_INFINITY;
        }
        let cautious = smallest - 0.5 * rounding;
        if cautious > 0.5 * smallest && self.exceeds(cautious) {
            return cautious;
        }
        // The estimate is lost in rounding errors, but perhaps not to a factorisation: otherwise halve until the proof succeeds.
        let top = smallest.abs().max(rounding).max(f64::MIN_POSITIVE);
        let shift = |halvings: i32| top * 0.5_f64.powi(halvings);
        if let Some(factor) = self.factor(shift(HALVINGS)) {
            let near = factor.smallest_eigenvalue();
            let close = [0.95, 0.5].map(|share| share * near).into_iter();
            if let Some(bound) = close.filter(|&bound| bound > shift(HALVINGS)).find(|&bound| self.exceeds(bound)) {
                return bound;
            }
            let (mut fails, mut holds) = (-1, HALVINGS);
            while holds - fails > 1 {
                let middle = (holds + fails) / 2;
                if self.exceeds(shift(middle)) { holds = middle } else { fails = middle }
            }
            return shift(holds);
        }
        // What is not known of the entries may exceed what rounding did to the eigenvalue.
        let row = |i: usize| (0..self.n).map(|j| self.radius(i + j * self.n)).sum::<f64>();
        let unknown = (0..self.n).map(row).fold(0.0, f64::max);
        let step = rounding.max(2.0 * unknown).max(LEAST_ROUNDING);
        let below = [1.0, 2.0, 8.0].map(|factor| smallest.min(0.0) - factor * step);
        below.into_iter().find(|&shift| self.exceeds(shift)).unwrap_or(f64::NEG_INFINITY)
    }

    /// Whether the matrix minus `shift`·I is proved to be positive definite.
    pub fn exceeds(&self, shift: f64) -> bool {
        if self.diagonal { self.smallest_entry() > shift } else { self.factor(shift).is_some() }
    }

    /// A lower bound on the entries of a diagonal matrix, −∞ where there is none.
    fn smallest_entry(&self) -> f64 {
        let entry = |at: usize| {
            let (value, radius) = (self.high[at] + self.low[at], self.radius(at));
            value - radius - 4.0 * f64::EPSILON * (value.abs() + radius)
        };
        let smallest = (0..self.n).map(entry).fold(f64::INFINITY, |m, e| if e.is_nan() { f64::NAN } else { m.min(e) });
        if smallest.is_nan() { f64::NEG_INFINITY } else { smallest }
    }

    /// The factor that proves the matrix minus `shift`·I to be positive definite; `None` where it is not proved.
    fn factor(&self, shift: f64) -> Option<Factor> {
        let n = self.n;
        let mut exponents = Vec::with_capacity(n);
        for i in 0..n {
            let entry = self.high[i + i * n] - shift.min(0.0);
            if !(entry > 0.0 && entry.is_finite() && shift.is_finite()) {
                return None;
            }
            exponents.push((-0.5 * entry.log2()).round() as i32);
        }
        let mut high = vec![0.0; n * n];
        let mut low = vec![0.0; n * n];
        let mut errors = vec![0.0; n];
        let powers = powers(&exponents);
        for j in 0..n {
            let column = j * n..(j + 1) * n;
            if let Some(powers) = &powers {
                for ((at, errors), power) in column.zip(&mut errors).zip(powers) {
                    let factor = power * powers[j];
                    (high[at], low[at]) = (self.high[at] * factor, self.low[at] * factor);
                    *errors += self.radius(at) * factor + UNDERFLOW;
                }
            } else {
                for (i, at) in column.enumerate() {
                    let exponent = exponents[i] + exponents[j];
                    (high[at], low[at]) = (scaled(self.high[at], exponent), scaled(self.low[at], exponent));
                    errors[i] += scaled(self.radius(at), exponent) + UNDERFLOW;
                }
            }
            // A shift that exceeds the diagonal is caught by the factorisation.
            let at = j + j * n;
            let shift = scaled(shift, 2 * exponents[j]);
            let entry = dd::add(Double { h: high[at], l: low[at] }, Double { h: -shift, l: 0.0 });
            errors[j] += 2.0 * UNIT * (entry.h.abs() + shift.abs()) + UNDERFLOW;
            (high[at], low[at]) = (entry.h, entry.l);
        }
        let largest = (0..n).map(|i| high[i + i * n]).fold(1.0, f64::max);
        let gamma = (n + 1) as f64 * UNIT;
        // n κ max b, doubled for the rounding of this line and of the subtraction below.
        let backward = 2.0 * n as f64 * gamma / (1.0 - 4.0 * gamma) * largest + 4.0 * UNIT * largest;
        for (i, error) in errors.iter().enumerate() {
            let at = i + i * n;
            let tau = 1.001 * (error + backward);
            let entry = dd::add(Double { h: high[at], l: low[at] }, Double { h: -tau, l: 0.0 });
            if !entry.h.is_finite() {
                return None;
            }
            (high[at], low[at]) = (entry.h, entry.l);
        }
        Factor::new(n, exponents, high, low)
    }
}

/// A sum of products of two numbers, with a bound on its error.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SumOfProducts {
    sum: Double,
    /// Σ|terms|.
    pub magnitude: f64,
    terms: usize,
    factor: f64,
}

impl SumOfProducts {
    /// Of a·b for every pair.
    pub fn of(mut pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        sum_of_products(&mut pairs)
    }

    /// The sum, rounded.
    pub fn value(&self) -> f64 {
        self.sum.h
    }

    /// Bound on the error of the rounded sum.
    pub fn error(&self) -> f64 {
        let roundings = (self.terms + 4) as f64;
        let tail = 2.0 * roundings * UNIT * self.magnitude + UNDERFLOW * self.factor.max(1.0) * roundings;
        1.001 * (self.sum.l.abs() + tail)
    }
}

/// The gradient of `Σ_b⟨F_b, Z_b⟩` with respect to each matrix unknown, with bounds on its errors.
pub(crate) struct Gradient {
    /// Approximate gradients, one matrix per unknown.
    pub values: Vec<Mat<f64>>,
    /// By how much they may be wrong.
    pub radii: Vec<Mat<f64>>,
}

impl Gradient {
    /// Of `Σ_b⟨F_b, Z_b⟩` for symmetric Z_b.
    pub fn new<'a>(unknowns: &[Unknown], terms: impl Iterator<Item = (&'a Expr, &'a Mat<f64>)>) -> Self {
        let zero = || -> Vec<Vec<f64>> { unknowns.iter().map(|u| vec![0.0; u.rows * u.cols]).collect() };
        let (mut high, mut low, mut magnitude) = (zero(), zero(), zero());
        let (mut roundings, mut factor) = (8.0, 1.0_f64);
        for (expression, z) in terms {
            let size = crate::verification::largest_entry;
            for term in expression.terms.iter() {
                let at = term.unknown.index;
                let sums = [&mut high[at][..], &mut low[at][..], &mut magnitude[at][..]];
                let n = z.nrows();
                match &term.shape {
                    Shape::Product { left, transposed, right } => {
                        // ⟨Z, U X V⟩ = ⟨Uᵀ Z Vᵀ, X⟩ and ⟨Z, U Xᵀ V⟩ = ⟨V Z U, X⟩.
                        let (outer, u, v) = if *transposed {
                            ([right.nrows(), left.ncols()], columns(right), columns(left))
                        } else {
                            ([left.ncols(), right.nrows()], rows(left), rows(right))
                        };
                        let [a, b, c] = [left, z, right].map(size);
                        factor = factor.max(a * c).max(b * c).max(a * b);
                        // Of a symmetric Z rows are columns.
                        triple_product(outer, [n, n], [&u, &columns(z), &v], sums);
                        roundings += (2 * n + 4) as f64;
                    }
                    Shape::Scaled { weights, matrix } => {
                        let sum = SumOfProducts::of(columns(matrix).into_iter().zip(columns(z)));
                        add_multiple(sum, &columns(weights), sums);
                        factor = factor.max(size(weights)).max(size(matrix)).max(size(z));
                        roundings += (n * n + 4) as f64;
                    }
                }
            }
        }
        let matrix = |u: &Unknown, m: &[f64]| Mat::from_fn(u.rows, u.cols, |i, j| m[i + j * u.rows]);
        let values = unknowns.iter().zip(&high).map(|(u, m)| matrix(u, m)).collect();
        let radii = unknowns.iter().zip(high.iter().zip(&low).zip(&magnitude)).map(|(u, ((h, l), m))| {
            // The rounding of sums of two entries of a symmetric unknown included.
            let radius = |k: usize| {
                2.0 * roundings * UNIT * m[k]
                    + UNDERFLOW * factor * roundings
                    + l[k].abs()
                    + 4.0 * f64::EPSILON * h[k].abs()
            };
            Mat::from_fn(u.rows, u.cols, |i, j| radius(i + j * u.rows))
        });
        let radii = radii.collect();
        Self { values, radii }
    }
}

/// The entries column by column.
fn columns(m: &Mat<f64>) -> Vec<f64> {
    let mut out = Vec::with_capacity(m.nrows() * m.ncols());
    (0..m.ncols()).for_each(|j| out.extend_from_slice(m.col_as_slice(j)));
    out
}

/// The entries row by row.
fn rows(m: &Mat<f64>) -> Vec<f64> {
    (0..m.nrows()).flat_map(|i| (0..m.ncols()).map(move |j| m[(i, j)])).collect()
}

/// Powers of two that two at a time are multiplied without over- or underflow; `None` where an exponent is too large for that.
fn powers(exponents: &[i32]) -> Option<Vec<f64>> {
    exponents.iter().map(|&e| (e.abs() <= 500).then(|| 2.0_f64.powi(e))).collect()
}

/// value · 2^exponent, without losing bits on the way when the result is a normal number.
fn scaled(value: f64, exponent: i32) -> f64 {
    let half = exponent / 2;
    value * 2.0_f64.powi(half) * 2.0_f64.powi(exponent - half)
}

vectorized! {
    fn add_products<'a>(sum: &'a mut Enclosure, products: &'a mut dyn Iterator<Item = (usize, usize, f64, f64)>) {
        for (i, j, a, b) in products {
            let at = if sum.diagonal { i } else { i + j * sum.n };
            let entry = dd::add(Double { h: sum.high[at], l: sum.low[at] }, dd::two_product(a, b));
            (sum.high[at], sum.low[at]) = (entry.h, entry.l);
            sum.magnitude[at] += (a * b).abs();
            sum.factor = sum.factor.max(a.abs()).max(b.abs());
            // Every entry has fewer terms than all of them together.
            sum.roundings += 1.0;
        }
    }
}

vectorized! {
    fn sum_of_products<'a>(pairs: &'a mut dyn Iterator<Item = (f64, f64)>) -> SumOfProducts {
        let mut all = SumOfProducts::default();
        for (a, b) in pairs {
            let term = dd::two_product(a, b);
            all.sum = dd::add(all.sum, term);
            all.magnitude += term.h.abs();
            all.terms += 1;
            all.factor = all.factor.max(a.abs()).max(b.abs());
        }
        all
    }
}

vectorized! {
    /// sums ← sums + factor · matrix, and the same of absolute values.
    fn add_multiple<'a>(factor: SumOfProducts, matrix: &'a [f64], sums: [&'a mut [f64]; 3]) {
        let [high, low, magnitude] = sums;
        for (((high, low), magnitude), entry) in high.iter_mut().zip(low).zip(magnitude).zip(matrix) {
            let value = dd::add(Double { h: *high, l: *low }, dd::multiply_by(factor.sum, *entry));
            (*high, *low) = (value.h, value.l);
            *magnitude += factor.magnitude * entry.abs();
        }
    }
}

vectorized! {
    /// sum ← sum + L X R for n × r, r × c and c × m matrices, X row by row, and the same of absolute values. L and R mostly select and
    /// place, so that zeros of theirs are passed over.
    fn triple_product<'a>(outer: [usize; 2], inner: [usize; 2], factors: [&'a [f64]; 3], sums: [&'a mut [f64]; 3]) {
        let ([n, m], [r, c]) = (outer, inner);
        let [left, x, right] = factors;
        let [high, low, magnitude] = sums;
        // L X row by row, then column by column.
        let mut rows = vec![0.0; 3 * n * c];
        let (rows_high, rest) = rows.split_at_mut(n * c);
        let (rows_low, rows_magnitude) = rest.split_at_mut(n * c);
        for k in 0..r {
            let x = &x[k * c..(k + 1) * c];
            for (i, &factor) in left[k * n..(k + 1) * n].iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
                let row = i * c..(i + 1) * c;
                let (th, tl, tm) = (&mut rows_high[row.clone()], &mut rows_low[row.clone()], &mut rows_magnitude[row]);
                for l in 0..c {
                    let term = dd::two_product(x[l], factor);
                    let sum = dd::add(Double { h: th[l], l: tl[l] }, term);
                    (th[l], tl[l]) = (sum.h, sum.l);
                    tm[l] += term.h.abs();
                }
            }
        }
        let column_by_column = |rows: &[f64]| -> Vec<f64> { (0..n * c).map(|at| rows[at % n * c + at / n]).collect() };
        let [t_high, t_low, t_magnitude] = [&*rows_high, &*rows_low, &*rows_magnitude].map(column_by_column);
        for j in 0..m {
            let (fh, fl, fm) = (&mut high[j * n..(j + 1) * n], &mut low[j * n..(j + 1) * n], &mut magnitude[j * n..(j + 1) * n]);
            for l in 0..c {
                let factor = right[l + j * c];
                if factor == 0.0 {
                    continue;
                }
                let (th, tl, tm) = (&t_high[l * n..(l + 1) * n], &t_low[l * n..(l + 1) * n], &t_magnitude[l * n..(l + 1) * n]);
                for i in 0..n {
                    let term = dd::multiply_by(Double { h: th[i], l: tl[i] }, factor);
                    let sum = dd::add(Double { h: fh[i], l: fl[i] }, term);
                    (fh[i], fl[i]) = (sum.h, sum.l);
                    fm[i] += tm[i] * factor.abs();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
