//! Zero-order hold: the exact discrete model of a linear plant behind a digital controller.

use super::Mat;
use super::matrix::{identity, solve};

/// A_d = e^{AT} and B_d = ∫₀ᵀ e^{As} ds B for ẋ = Ax + Bu with u constant over T seconds.
///
/// One exponential of [[A, B], [0, 0]]·T (Van Loan 1978).
pub fn discretize(a: &Mat<f64>, b: &Mat<f64>, sample_time_s: f64) -> (Mat<f64>, Mat<f64>) {
    let (n, m) = (a.nrows(), b.ncols());
    let augmented = Mat::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => sample_time_s * a[(i, j)],
        (true, false) => sample_time_s * b[(i, j - n)],
        _ => 0.0,
    });
    let e = exponential(&augmented);
    (e.submatrix(0, 0, n, n).to_owned(), e.submatrix(0, n, n, m).to_owned())
}

/// e^M by scaling and squaring with the diagonal [6/6] Padé approximant (Higham 2005); NaN where M is beyond the range of numbers.
fn exponential(m: &Mat<f64>) -> Mat<f64> {
    const DEGREE: usize = 6;
    let n = m.nrows();
    if !m.norm_l2().is_finite() {
        return Mat::from_fn(n, n, |_, _| f64::NAN);
    }
    let squarings = (m.norm_l2() / 0.5).log2().ceil().max(0.0) as i32;
    let x = Mat::from_fn(n, n, |i, j| m[(i, j)] * 0.5f64.powi(squarings));
    let (mut numerator, mut denominator, mut power) = (identity(n), identity(n), identity(n));
    let mut coefficient = 1.0;
    for k in 1..=DEGREE {
        coefficient *= (DEGREE - k + 1) as f64 / ((2 * DEGREE - k + 1) * k) as f64;
        power = &power * &x;
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        for j in 0..n {
            for i in 0..n {
                numerator[(i, j)] += coefficient * power[(i, j)];
                denominator[(i, j)] += sign * coefficient * power[(i, j)];
            }
        }
    }
    let mut result = solve(&denominator, &numerator);
    for _ in 0..squarings {
        result = &result * &result;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::from_rows;

    #[test]
    fn double_integrator_by_hand() {
        let a = from_rows(&[vec![0.0, 1.0], vec![0.0, 0.0]]);
        let b = from_rows(&[vec![0.0], vec![1.0]]);
        let (ad, bd) = discretize(&a, &b, 0.5);
        assert!((ad - from_rows(&[vec![1.0, 0.5], vec![0.0, 1.0]])).norm_max() < 1e-15);
        assert!((bd - from_rows(&[vec![0.125], vec![0.5]])).norm_max() < 1e-15);
    }

    /// Squaring would take 2³¹ products.
    #[test]
    fn exponent_beyond_the_range_of_numbers() {
        let (ad, _) = discretize(&from_rows(&[vec![1e200]]), &from_rows(&[vec![1.0]]), 1e200);
        assert!(ad[(0, 0)].is_nan());
    }

    #[test]
    fn large_exponent_is_squared_up() {
        let (ad, _) = discretize(&from_rows(&[vec![-3.0]]), &from_rows(&[vec![1.0]]), 10.0);
        assert!((ad[(0, 0)] / (-30f64).exp() - 1.0).abs() < 1e-11);
    }
}
