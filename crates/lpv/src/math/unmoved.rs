//! Is there a point of a polytope at which a given combination of states is moved by no input? Decided exactly.
//!
//! For a given w the conditions wᵀA(ρ) = λwᵀ, wᵀB(ρ) = 0, Σρᵢ = 1 are linear in (ρ, λ). On integers they are solved without fractions (`elimination.rs`):
//! unknowns that the equations leave free take the values of a guess, and the others follow. ρ ≥ 0 and λ ≥ 0 are then signs of integers.

use super::Mat;
use super::elimination::Elimination;
use super::hurwitz::Integers;
use super::stabilizability::{integers, quotient};
use num_bigint::{BigInt, Sign};

/// A weight of the guess below this counts as zero.
const SMALL: f64 = 1e-9;
/// Bits behind the point of the guess.
const GUESS_BITS: i32 = 60;
/// Bits of an entry times rows times columns.
const MOST_BITS: u64 = 2_000_000;

/// The vertices (Aᵢ, Bᵢ) of a polytope.
pub type Vertices<'a> = [(&'a Mat<f64>, &'a Mat<f64>)];

/// ρ and λ of a point near `weights` where wᵀA(ρ) = λwᵀ and wᵀB(ρ) = 0 with λ ≥ 0, which is proved of `w` as it is given and some ρ, λ that
/// the numbers returned are the rounded values of. `None` where there is none near, or it cannot be told.
pub fn unmoved_point(vertices: &Vertices, weights: &[f64], w: &[f64]) -> Option<(Vec<f64>, f64)> {
    [false, true].into_iter().find_map(|at_rest| Equations::new(vertices, w, at_rest)?.solve(weights))
}

/// Whether doubles sum to zero, exactly.
pub fn sum_is_zero(values: &[f64]) -> bool {
    let row = Mat::from_fn(1, values.len(), |_, j| values[j]);
    integers(&row, |_, _| 0).is_some_and(|(row, _)| row[0].iter().sum::<BigInt>().sign() == Sign::NoSign)
}

/// Rows of coefficients of λ and of the ρᵢ, and of right sides.
struct Equations {
    rows: Integers,
    /// Exponent that A was scaled by.
    scale: i64,
}

impl Equations {
    /// With λ = 0 where the parameter is `at_rest`.
    fn new(vertices: &Vertices, w: &[f64], at_rest: bool) -> Option<Self> {
        let (n, m) = (w.len(), vertices.first()?.1.ncols());
        let count = vertices.len();
        let (w, _) = integers(&Mat::from_fn(1, n, |_, j| w[j]), |_, _| 0)?;
        let all_a = Mat::from_fn(count * n, n, |i, j| vertices[i / n].0[(i % n, j)]);
        let all_b = Mat::from_fn(count * n, m, |i, j| vertices[i / n].1[(i % n, j)]);
        let (a, scale) = integers(&all_a, |_, _| 0)?;
        let (b, _) = integers(&all_b, |_, _| 0)?;
        let along = |matrix: &Integers, vertex: usize, j: usize| -> BigInt {
            (0..n).map(|i| &w[0][i] * &matrix[vertex * n + i][j]).sum()
        };
        let row = |matrix: &Integers, j: usize, of_lambda: BigInt| -> Vec<BigInt> {
            let lambda = if at_rest { BigInt::from(0) } else { of_lambda };
            let of_vertices = (0..count).map(|vertex| along(matrix, vertex, j));
            std::iter::once(lambda).chain(of_vertices).chain([BigInt::from(0)]).collect()
        };
        let mut rows: Integers = (0..n).map(|j| row(&a, j, -&w[0][j])).collect();
        rows.extend((0..m).map(|j| row(&b, j, BigInt::from(0))));
        rows.push((0..count + 2).map(|k| BigInt::from(u8::from(k > 0))).collect());
        let bits = rows.iter().flatten().map(BigInt::bits).max().unwrap_or(0);
        (bits * (rows.len() * (count + 2)) as u64 <= MOST_BITS).then_some(Self { rows, scale })
    }

    fn solve(self, weights: &[f64]) -> Option<(Vec<f64>, f64)> {
        let count = weights.len();
        let right = count + 1;
        // λ first, then the largest weights: what follows from the rest is what may change least in proportion
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&i, &j| weights[j].total_cmp(&weights[i]));
        let columns = std::iter::once(0).chain(order.iter().map(|i| i + 1));
        let Elimination { rows, rest, pivots, determinant } = Elimination::of(self.rows, columns);
        // a row without unknowns has to be 0 = 0
        if rest.iter().any(|row| row[right].sign() != Sign::NoSign) {
            return None;
        }
        // d x_pivot = right − Σ c x_free, all times 2^bits
        let one = 2.0_f64.powi(GUESS_BITS);
        let guess = |i: usize| if weights[i] < SMALL { 0 } else { (weights[i].min(1.0) * one) as i64 };
        let mut values: Vec<(BigInt, BigInt)> =
            (0..=count).map(|k| (BigInt::from(if k == 0 { 0 } else { guess(k - 1) }), BigInt::from(1))).collect();
        let free: Vec<usize> = (0..=count).filter(|k| !pivots.contains(k)).collect();
        for (row, &column) in rows.iter().zip(&pivots) {
            let fixed: BigInt = free.iter().map(|&k| &row[k] * &values[k].0).sum();
            let numerator = (&row[right] << GUESS_BITS as u64) - fixed;
            let sign = if determinant.sign() == Sign::Minus { -1 } else { 1 };
            values[column] = (numerator * sign, BigInt::from(determinant.magnitude().clone()));
        }
        if values.iter().any(|(numerator, _)| numerator.sign() == Sign::Minus) {
            return None;
        }
        let rounded = |k: usize, e: i64| quotient(&values[k].0, &values[k].1, e - i64::from(GUESS_BITS));
        Some(((1..=count).map(|k| rounded(k, 0)).collect(), rounded(0, -self.scale)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::{diagonal, from_rows};

    /// ẋ₁ = ρ u between ρ = −1/3 (rounded) and 1: somewhere between there is no input.
    #[test]
    fn a_sign_that_changes_between_vertices() {
        let a = Mat::zeros(1, 1);
        let b = [-1.0 / 3.0, 1.0].map(|b| Mat::from_fn(1, 1, |_, _| b));
        let vertices = [(&a, &b[0]), (&a, &b[1])];
        let (weights, eigenvalue) = unmoved_point(&vertices, &[0.7, 0.3], &[1.0]).unwrap();
        assert!((weights[0] - 0.75).abs() < 1e-15 && eigenvalue == 0.0, "{weights:?} {eigenvalue}");
        assert_eq!(unmoved_point(&vertices[1..], &[1.0], &[1.0]), None);
        let same = [(&a, &b[1]), (&a, &b[1])];
        assert_eq!(unmoved_point(&same, &[0.5, 0.5], &[1.0]), None, "it lies outside");
        let decaying = from_rows(&[vec![-f64::from_bits(1)]]);
        let vertices = [(&decaying, &b[0]), (&decaying, &b[1])];
        assert_eq!(unmoved_point(&vertices, &[0.75, 0.25], &[1.0]), None, "it decays");
    }

    #[test]
    fn sums() {
        assert!(sum_is_zero(&[]) && sum_is_zero(&[-0.0]) && sum_is_zero(&[0.5, 1e300, -0.5, -1e300]));
        assert!(!sum_is_zero(&[1e16, 1.0, -1e16]) && !sum_is_zero(&[f64::NAN]) && !sum_is_zero(&[0.1, 0.2, -0.3]));
    }

    /// w has to be right to the last digit.
    #[test]
    fn only_what_is_exact() {
        let a = diagonal(&[0.5, -1.0]);
        let b = from_rows(&[vec![0.0], vec![1.0]]);
        let of = |w: [f64; 2]| unmoved_point(&[(&a, &b)], &[1.0], &w);
        assert_eq!(of([2.0, 0.0]), Some((vec![1.0], 0.5)));
        assert_eq!(of([1.0, 1e-300]), None);
        assert_eq!(of([0.0, 1.0]), None);
    }
}
