//! The continuous Lyapunov equation Aᵀ X + X A + Q = 0.

use super::matrix::{inverse, is_finite, symmetric_part};
use super::{Mat, eigen};

/// The solution X = Xᵀ of Aᵀ X + X A + Q = 0 for a stable A: X = ∫₀^∞ e^{Aᵀt} Q e^{At} dt, positive semidefinite if Q is.
///
/// Newton's iteration for the matrix sign of [[A, 0], [Q, −Aᵀ]] (Roberts 1980) with determinant scaling:
/// only inverses of n × n matrices, quadratic convergence. `None` when A is not stable.
pub fn solve(a: &Mat<f64>, q: &Mat<f64>) -> Option<Mat<f64>> {
    let n = a.nrows();
    let abscissa = eigen::spectral_abscissa(a);
    if abscissa.is_nan() || abscissa >= 0.0 {
        return None;
    }
    let (mut z, mut w) = (a.clone(), q.clone());
    for _ in 0..100 {
        let z_inverse = inverse(&z);
        if !is_finite(&z_inverse) {
            return None;
        }
        let scale = (z_inverse.norm_l2() / z.norm_l2()).sqrt();
        let z_next = Mat::from_fn(n, n, |i, j| 0.5 * (scale * z[(i, j)] + z_inverse[(i, j)] / scale));
        let congruence = z_inverse.transpose() * &w * &z_inverse;
        w = Mat::from_fn(n, n, |i, j| 0.5 * (scale * w[(i, j)] + congruence[(i, j)] / scale));
        let change = (&z_next - &z).norm_l2();
        z = z_next;
        if change <= 1e-14 * z.norm_l2() * n as f64 {
            break;
        }
    }
    // the sign of a stable A is −I
    let converged = (&z + Mat::<f64>::identity(n, n)).norm_max() < 1e-8;
    converged.then(|| symmetric_part(&Mat::from_fn(n, n, |i, j| 0.5 * w[(i, j)])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::identity;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn residual_vanishes(entries in proptest::collection::vec(-1.0..1.0f64, 36)) {
            // shifted by more than its norm, so stable
            let raw = Mat::from_fn(6, 6, |i, j| entries[6 * i + j]);
            let a = &raw - Mat::from_fn(6, 6, |i, j| if i == j { raw.norm_l2() + 0.1 } else { 0.0 });
            let x = solve(&a, &identity(6)).unwrap();
            let residual = a.transpose() * &x + &x * &a + identity(6);
            prop_assert!(residual.norm_max() < 1e-11);
        }
    }

    #[test]
    fn unstable_matrix_has_no_solution() {
        assert!(solve(&identity(2), &identity(2)).is_none());
    }
}
