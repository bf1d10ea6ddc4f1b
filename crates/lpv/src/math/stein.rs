//! The discrete Lyapunov equation X − MᵀXM = W, named after Stein.

use super::Mat;
use super::eigen::{Eigenvectors, eigenvectors};
use super::matrix::{diagonal, identity, is_finite, quadratic_form, symmetric_part};

/// Doublings after which the powers of M have vanished unless its eigenvalues are within 2⁻⁷⁰ of the circle.
const MOST_DOUBLINGS: usize = 80;
/// Powers of M beyond which it is taken for unstable.
const MOST_POWER: f64 = 1e100;

/// X = Σ (Mᵀ)ᵏ W Mᵏ for M = I + N with all eigenvalues inside the unit circle; `None` where the sum does not converge.
///
/// Doubling (Smith 1968): X ← X + MᵀXM, M ← M². Of M² − I = 2N + N² no digit is lost where M is near I, as it is for short sample times.
/// `w` is symmetric, and so is X.
pub fn solve(increment: &Mat<f64>, w: &Mat<f64>) -> Option<Mat<f64>> {
    let one = identity(w.nrows());
    let (mut x, mut n) = (w.clone(), increment.clone());
    for _ in 0..MOST_DOUBLINGS {
        let m = &one + &n;
        let size = m.norm_max();
        if !is_finite(&x) || size.is_nan() || size > MOST_POWER {
            return None;
        }
        let added = symmetric_part(&(m.transpose() * &x * &m));
        x = &x + &added;
        if added.norm_max() <= 1e-17 * x.norm_max() {
            return is_finite(&x).then_some(x);
        }
        n = 2.0 * &n + &n * &n;
    }
    None
}

/// X with −(EᵀX + XE + TEᵀXE) ≈ V⁻ᴴV⁻¹ ≻ 0 for the eigenvectors V of E, and a state z with zᵀXz < 0, where I + TE has an eigenvalue
/// outside the unit circle; `None` where numbers say that there is none, or one on it.
///
/// With Ev = μv the form vᴴ(EᴴX + XE + TEᴴXE)v is xᵥ(2 Re μ + T|μ|²), and X = V⁻ᴴ diag(xᵥ) V⁻¹ with xᵥ = −1/(2 Re μ + T|μ|²).
pub fn indefinite(e: &Mat<f64>, sample_time_s: f64) -> Option<(Mat<f64>, Vec<f64>)> {
    let n = e.nrows();
    if !is_finite(e) {
        return None;
    }
    let Eigenvectors { values, vectors, inverse: [re, im] } = eigenvectors(e)?;
    let growth: Vec<f64> = values.iter().map(|&(re, im)| 2.0 * re + sample_time_s * (re * re + im * im)).collect();
    let largest = (0..n).max_by(|&a, &b| growth[a].total_cmp(&growth[b])).filter(|&k| growth[k] > 0.0)?;
    let weights = diagonal(&growth.iter().map(|growth| -1.0 / growth).collect::<Vec<f64>>());
    let x = symmetric_part(&(re.transpose() * &weights * &re + im.transpose() * &weights * &im));
    let direction = |part: &Mat<f64>| (0..n).map(|i| part[(i, largest)]).collect::<Vec<f64>>();
    let parts = vectors.map(|part| direction(&part));
    let best = parts.into_iter().min_by(|a, b| quadratic_form(&x, a).total_cmp(&quadratic_form(&x, b)))?;
    is_finite(&x).then_some((x, best))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::from_rows;

    #[test]
    fn residual_vanishes_near_the_circle() {
        let n = from_rows(&[vec![-1e-9, 1e-5], vec![0.0, -2.0 + 1e-7]]);
        let m = identity(2) + &n;
        let w = from_rows(&[vec![1.0, 0.5], vec![0.5, -3.0]]);
        let x = solve(&n, &w).unwrap();
        let residual = &x - m.transpose() * &x * &m - &w;
        assert!(residual.norm_max() < 1e-6 * x.norm_max() * 1e-6, "{}", residual.norm_max());
    }

    #[test]
    fn unstable_and_unusable_matrices_have_no_solution() {
        for bad in [1e-3, -2.1, f64::NAN, f64::INFINITY, 1e300] {
            assert!(solve(&diagonal(&[-0.5, bad]), &identity(2)).is_none(), "{bad}");
        }
        assert_eq!(solve(&Mat::zeros(0, 0), &Mat::zeros(0, 0)).map(|x| x.nrows()), Some(0));
    }
}
