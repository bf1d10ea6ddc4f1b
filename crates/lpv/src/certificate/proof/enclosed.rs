//! Matrices known up to a radius in every entry: their sums and products, and what a congruence makes of the rows of symmetric ones.
//!
//! Rounding is accounted for once, not at every operation. For a triangular F of n rows the two products of `F M Fᵀ`, in whatever order
//! they are summed, are together wrong by at most `c |F||M||F|ᵀ` in every entry, `c = (2n + 4)υ`, υ = 2⁻⁵³ (Higham, Accuracy and Stability of
//! Numerical Algorithms, section 3.5), so that for `|M − M̃| ≤ R`
//!
//! ```text
//! Σⱼ |F M Fᵀ − X|ᵢⱼ ≤ Σⱼ |fl(F M̃ Fᵀ) − X|ᵢⱼ + (|F| (R + c|M̃|) |F|ᵀ 1)ᵢ,
//! ```
//!
//! and the last term takes three products with vectors.

use crate::math::Mat;
use crate::math::interval::Interval;

/// υ, the relative error of one operation.
fn unit() -> f64 {
    if crate::mutant::is("rounding-off") { 0.0 } else { 0.5 * f64::EPSILON }
}
/// More than all that sums and products of up to a million terms that are not negative lose to rounding.
const ROUNDED_UP: f64 = 1.0 + 1e-9;
/// More than what underflow takes from a product.
const UNDERFLOW: f64 = f64::MIN_POSITIVE;

/// |M − middle| ≤ radius, in row order; but for products, square and symmetric.
#[derive(Clone, Debug)]
pub(super) struct Enclosed {
    columns: usize,
    middle: Vec<f64>,
    radius: Vec<f64>,
}

impl Enclosed {
    /// From enclosures of the entries in row order.
    pub fn of_entries(columns: usize, entries: impl Iterator<Item = Interval>) -> Self {
        let (middle, radius) = entries.map(Interval::middle_and_radius).unzip();
        Self { columns, middle, radius }
    }

    /// n × n, from enclosures of the entries.
    pub fn new(n: usize, entry: impl Fn(usize, usize) -> Interval) -> Self {
        Self::of_entries(n, (0..n * n).map(|at| entry(at / n, at % n)))
    }

    /// Nothing is known.
    pub fn unbounded(n: usize) -> Self {
        Self { columns: n, middle: vec![0.0; n * n], radius: vec![f64::INFINITY; n * n] }
    }

    /// Σ wₖMₖ.
    pub fn combination<'a>(n: usize, terms: impl Iterator<Item = (f64, &'a Self)> + Clone) -> Self {
        let terms = terms.filter(|(weight, _)| *weight != 0.0);
        let (mut middle, mut radius) = (vec![0.0; n * n], vec![0.0; n * n]);
        // of the products and sums of the middles
        let lost = 2.0 * (terms.clone().count() + 1) as f64 * unit();
        for (weight, matrix) in terms {
            for at in 0..n * n {
                let term = weight * matrix.middle[at];
                middle[at] += term;
                // what underflows to nothing is not forgotten
                let underflow = if matrix.middle[at] == 0.0 && matrix.radius[at] == 0.0 { 0.0 } else { UNDERFLOW };
                radius[at] += weight.abs() * matrix.radius[at] + lost * term.abs() + underflow;
            }
        }
        radius.iter_mut().for_each(|radius| *radius *= ROUNDED_UP);
        Self { columns: n, middle, radius }
    }

    /// Σ w F G for factors w that are powers of two, entry by entry in row order. For entries in f ± r and g ± q a product is in
    /// fg ± (|f|q + r(|g| + q)); that and all sums are rounded as in [`Interval::weighted_sums`]. Exact zeros of F are passed over.
    pub fn sum_of_products(terms: &[(&Self, &Self, f64)]) -> Vec<Interval> {
        let (left, right, _) = terms[0];
        let (inner, columns) = (left.columns, right.columns);
        let rows = left.middle.len() / inner;
        let lost = (terms.len() * inner + 4) as f64 * 2.0 * unit();
        let mut sums = vec![Interval::point(0.0); rows * columns];
        // of the right factors: |g| and what is multiplied by |f|
        let sizes: Vec<(Vec<f64>, Vec<f64>)> = (terms.iter())
            .map(|(_, right, _)| {
                let size = |(g, q): (&f64, &f64)| ((g.abs() + q) * ROUNDED_UP, q * ROUNDED_UP + g.abs() * lost);
                right.middle.iter().zip(&right.radius).map(size).unzip()
            })
            .collect();
        let (mut middles, mut radii) = (vec![0.0; columns], vec![0.0; columns]);
        for i in 0..rows {
            middles.fill(0.0);
            radii.fill(0.0);
            for ((left, right, factor), (whole, spread)) in terms.iter().zip(&sizes) {
                for k in 0..inner {
                    let (f, r) = (factor * left.middle[i * inner + k], factor * left.radius[i * inner + k]);
                    if f == 0.0 && r == 0.0 {
                        continue;
                    }
                    let row = k * columns..(k + 1) * columns;
                    let entries = right.middle[row.clone()].iter().zip(&whole[row.clone()]).zip(&spread[row]);
                    for ((sum, radius), ((g, whole), spread)) in middles.iter_mut().zip(&mut radii).zip(entries) {
                        *sum += f * g;
                        // 0 · ∞ is no number, and makes the sum the whole line
                        *radius += f.abs() * spread + r * whole + if *whole == 0.0 { 0.0 } else { UNDERFLOW };
                    }
                }
            }
            for ((sum, middle), radius) in sums[i * columns..(i + 1) * columns].iter_mut().zip(&middles).zip(&radii) {
                *sum = if radius.is_nan() { Interval::ENTIRE } else { Interval::around(*middle, *radius) };
            }
        }
        sums
    }

    /// The middle, as numbers.
    pub fn middle(&self) -> Mat<f64> {
        Mat::from_fn(self.columns, self.columns, |i, j| self.middle[i * self.columns + j])
    }

    /// An entry.
    pub fn at(&self, i: usize, j: usize) -> Interval {
        let (middle, radius) = (self.middle[i * self.columns + j], self.radius[i * self.columns + j]);
        Interval::around(middle, radius)
    }

    /// Exactly zero.
    pub fn is_zero(&self) -> bool {
        self.middle.iter().chain(&self.radius).all(|entry| *entry == 0.0)
    }

    /// Upper bounds on Σⱼ|F M Fᵀ − sI|ᵢⱼ for a lower triangular F in row order and a number s.
    pub fn row_sums_of_congruence(&self, factor: &[f64], s: f64) -> Vec<f64> {
        let n = self.columns;
        if self.is_zero() {
            return vec![s.abs(); n];
        }
        // F M, then its product with Fᵀ
        let (mut left, mut row) = (vec![0.0; n * n], vec![0.0; n]);
        for i in 0..n {
            let target = &mut left[i * n..(i + 1) * n];
            for k in 0..=i {
                let f = factor[i * n + k];
                let source = &self.middle[k * n..(k + 1) * n];
                target.iter_mut().zip(source).for_each(|(sum, entry)| *sum += f * entry);
            }
        }
        // |F|ᵀ1, (R + c|M|) of it, |F| of that
        let lost = (2 * n + 4) as f64 * unit() * ROUNDED_UP;
        let (mut columns, mut largest) = (vec![0.0; n], 0.0_f64);
        for i in 0..n {
            for (sum, f) in columns.iter_mut().zip(&factor[i * n..=i * n + i]) {
                *sum += f.abs();
                largest = largest.max(f.abs());
            }
        }
        let errors: Vec<f64> = (0..n)
            .map(|i| {
                let entries = self.middle[i * n..(i + 1) * n].iter().zip(&self.radius[i * n..(i + 1) * n]);
                entries.zip(&columns).map(|((m, r), column)| (r + lost * m.abs()) * column).sum()
            })
            .collect();
        // each of the n² products of an entry, and n of a row
        let underflow = (n * n * n) as f64 * (1.0 + largest) * (1.0 + largest) * UNDERFLOW;
        (0..n)
            .map(|i| {
                let lefts = &left[i * n..(i + 1) * n];
                for (j, value) in row.iter_mut().enumerate() {
                    let sum: f64 = lefts.iter().zip(&factor[j * n..=j * n + j]).map(|(a, f)| a * f).sum();
                    *value = (sum - if i == j { s } else { 0.0 }).abs();
                }
                let error: f64 = factor[i * n..=i * n + i].iter().zip(&errors).map(|(f, e)| f.abs() * e).sum();
                let bound = (row.iter().sum::<f64>() + error) * ROUNDED_UP + underflow;
                if bound.is_nan() { f64::INFINITY } else { bound }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// F M Fᵀ − sI in interval arithmetic, its row sums.
    fn by_intervals(n: usize, factor: &[f64], s: f64, entry: impl Fn(usize, usize) -> Interval) -> Vec<f64> {
        let at = |i: usize, j: usize| {
            let mut sum = Interval::point(0.0);
            for k in 0..=i {
                for l in 0..=j {
                    sum = sum + entry(k, l) * factor[i * n + k] * factor[j * n + l];
                }
            }
            sum - if i == j { s } else { 0.0 }
        };
        let row = |i: usize| (0..n).fold(Interval::point(0.0), |sum, j| sum + Interval::point(at(i, j).magnitude()));
        (0..n).map(|i| row(i).hi()).collect()
    }

    proptest! {
        /// No member of the enclosure has larger row sums, and the bound is about as sharp as interval arithmetic.
        #[test]
        fn row_sums_bound_every_member(
            n in 1_usize..7,
            numbers in prop::collection::vec(-1.0_f64..1.0, 200),
            scale in -8_i32..8,
            width in prop::sample::select(vec![0.0, 1e-15, 1e-9, 1e-3]),
        ) {
            let size = 10.0_f64.powi(scale);
            let symmetric = |i: usize, j: usize| size * numbers[i.min(j) * 7 + i.max(j)];
            let entry = |i: usize, j: usize| {
                let middle = symmetric(i, j);
                Interval::new(middle - width * middle.abs(), middle + width * middle.abs())
            };
            let factor: Vec<f64> = (0..n * n)
                .map(|at| if at % n > at / n { 0.0 } else { numbers[100 + at] * 10.0_f64.powi(((at % 5) as i32) - 2) })
                .collect();
            let enclosed = Enclosed::new(n, entry);
            let bounds = enclosed.row_sums_of_congruence(&factor, 1.0);
            // members at random corners of the enclosure
            for corner in 0..8_usize {
                let member = |i: usize, j: usize| {
                    let (low, high) = (i.min(j), i.max(j));
                    Interval::point(if (corner >> ((low + 2 * high) % 3)) & 1 == 0 { entry(i, j).lo() } else { entry(i, j).hi() })
                };
                // the exact sums are at most a few units above the lower ends
                for (bound, sum) in bounds.iter().zip(by_intervals(n, &factor, 1.0, member)) {
                    prop_assert!(*bound >= sum * (1.0 - 1e-9) - 1e-300, "{bound} {sum}");
                }
            }
            for (bound, sum) in bounds.iter().zip(by_intervals(n, &factor, 1.0, entry)) {
                let largest = factor.iter().map(|f| f.abs()).fold(0.0, f64::max);
                prop_assert!(*bound <= sum * (1.0 + 1e-6) + 1e-12 * (n * n) as f64 * size * largest * largest, "{bound} {sum}");
            }
        }
    }

    #[test]
    fn what_is_not_known_has_no_bound() {
        let bounds = Enclosed::unbounded(3).row_sums_of_congruence(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], 0.0);
        assert_eq!(bounds, vec![f64::INFINITY; 3]);
        let zero = Enclosed::new(2, |_, _| Interval::point(0.0));
        assert_eq!(zero.row_sums_of_congruence(&[1.0, 0.0, 1.0, 1.0], 1.0), vec![1.0; 2]);
    }
}
