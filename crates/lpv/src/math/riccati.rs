//! The continuous algebraic Riccati equation Aᵀ P + P A − P B R⁻¹ Bᵀ P + Q = 0, thesis (2.31).

use super::matrix::{blocks_2x2, identity, inverse, inverse_spd, is_finite, least_squares, symmetric_part};
use super::stabilizability::{Mode, Stabilizability, stabilizability};
use super::{Mat, lyapunov};

/// The stabilising solution of the Riccati equation and the gain that it gives.
#[derive(Clone, Debug)]
pub struct Regulator {
    /// P = Pᵀ ≻ 0, n × n: the least cost from x₀ is x₀ᵀ P x₀.
    pub p: Mat<f64>,
    /// K = R⁻¹ Bᵀ P, m × n, for u = −K x (2.32).
    pub k: Mat<f64>,
}

/// Why a Riccati equation has no stabilising solution.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum RiccatiError {
    /// R is not symmetric positive definite.
    #[error("the input weight R is not positive definite")]
    InputWeight,
    /// (A, B) is not stabilisable, which is decided exactly.
    #[error("the pair (A, B) is not stabilisable: no input moves {0}, which does not decay by itself")]
    Unstabilizable(Mode),
    /// The Hamiltonian matrix has eigenvalues on the imaginary axis, or too close to it for its arithmetic.
    #[error(
        "the Hamiltonian matrix has eigenvalues on the imaginary axis, to rounding: a mode of A there costs nothing (weigh it \
         in Q), or the problem is too badly conditioned"
    )]
    ImaginaryAxis,
    /// The solution that was found does not stabilise, after rounding.
    #[error(
        "the Riccati equation is too badly conditioned: its solution does not stabilise after rounding; scale states and inputs"
    )]
    IllConditioned,
}

/// Solve the Riccati equation for A (n × n), B (n × m), Q = Qᵀ ⪰ 0, R = Rᵀ ≻ 0.
///
/// The stable invariant subspace of the Hamiltonian comes from its matrix sign (Roberts 1980, Byers 1987); Newton's
/// method (Kleinman 1968) then polishes P down to rounding.
///
/// # Errors
/// See [`RiccatiError`].
pub fn solve(a: &Mat<f64>, b: &Mat<f64>, q: &Mat<f64>, r: &Mat<f64>) -> Result<Regulator, RiccatiError> {
    let n = a.nrows();
    let r_inverse = inverse_spd(r).ok_or(RiccatiError::InputWeight)?;
    if let Stabilizability::Unstabilizable(mode) = stabilizability(a, b) {
        return Err(RiccatiError::Unstabilizable(mode));
    }
    let g = b * &r_inverse * b.transpose();
    let minus = |m: &Mat<f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| -m[(i, j)]);
    let minus_a_transposed = minus(&a.transpose().to_owned());
    let hamiltonian = blocks_2x2(a.as_ref(), minus(&g).as_ref(), minus(q).as_ref(), minus_a_transposed.as_ref());
    let sign = matrix_sign(hamiltonian).ok_or(RiccatiError::ImaginaryAxis)?;

    // (sign + I)[I; P] = 0: 2n × n equations for P
    let left = Mat::from_fn(2 * n, n, |i, j| sign[(i, n + j)] + if i == n + j { 1.0 } else { 0.0 });
    let right = Mat::from_fn(2 * n, n, |i, j| -sign[(i, j)] - if i == j { 1.0 } else { 0.0 });
    let mut p = symmetric_part(&least_squares(&left, &right).ok_or(RiccatiError::ImaginaryAxis)?);

    for _ in 0..3 {
        let closed_loop = a - &g * &p;
        let cost = q + &p * &g * &p;
        match lyapunov::solve(&closed_loop, &cost) {
            Some(next) => p = next,
            None => return Err(RiccatiError::IllConditioned),
        }
    }
    let k = r_inverse * b.transpose() * &p;
    Ok(Regulator { p, k })
}

/// Newton's iteration S ← (cS + (cS)⁻¹)/2 for the matrix sign; `None` if it does not converge, which is so when an
/// eigenvalue lies on the imaginary axis.
fn matrix_sign(mut s: Mat<f64>) -> Option<Mat<f64>> {
    let size = s.nrows();
    let mut last_change = f64::INFINITY;
    for _ in 0..100 {
        let s_inverse = inverse(&s);
        if !is_finite(&s_inverse) {
            return None;
        }
        // scaling speeds up the start; near convergence it is one up to rounding, and would only keep rounding alive
        let scale = if last_change < 1e-2 { 1.0 } else { (s_inverse.norm_l2() / s.norm_l2()).sqrt() };
        let next = Mat::from_fn(size, size, |i, j| 0.5 * (scale * s[(i, j)] + s_inverse[(i, j)] / scale));
        let change = (&next - &s).norm_l2() / next.norm_l2();
        s = next;
        // converged, or down to rounding: quadratic convergence would have squared the change
        if change <= 1e-13 || (change < 1e-6 && change > 0.5 * last_change) {
            let residual = &s * &s - identity(size);
            return (residual.norm_l2() <= 1e-4 * s.norm_l2().powi(2)).then_some(s);
        }
        last_change = change;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::eigen;
    use crate::math::matrix::{diagonal, from_rows};
    use proptest::prelude::*;

    fn residual(a: &Mat<f64>, b: &Mat<f64>, q: &Mat<f64>, r: &Mat<f64>, p: &Mat<f64>) -> f64 {
        let k = inverse_spd(r).unwrap() * b.transpose() * p;
        let residual = a.transpose() * p + p * a - p * b * &k + q;
        residual.norm_l2() / (1.0 + p.norm_l2() * (1.0 + a.norm_l2()))
    }

    proptest! {
        #[test]
        fn riccati_residual_vanishes_and_loop_is_stable(entries in proptest::collection::vec(-2.0..2.0f64, 5 * 7)) {
            let a = Mat::from_fn(5, 5, |i, j| entries[7 * i + j]);
            let b = Mat::from_fn(5, 2, |i, j| entries[7 * i + 5 + j]);
            let (q, r) = (identity(5), diagonal(&[1.0, 0.5]));
            let regulator = solve(&a, &b, &q, &r).unwrap();
            prop_assert!(residual(&a, &b, &q, &r, &regulator.p) < 1e-9);
            prop_assert!(eigen::spectral_abscissa(&(&a - &b * &regulator.k)) < 0.0);
        }
    }

    /// Forty states: the sign iteration ends at rounding, not at a fixed tolerance.
    #[test]
    fn large_random_system() {
        let mut state = 1u64;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
        };
        let a = Mat::from_fn(40, 40, |_, _| draw());
        let b = Mat::from_fn(40, 20, |_, _| draw());
        let regulator = solve(&a, &b, &identity(40), &identity(20)).unwrap();
        assert!(residual(&a, &b, &identity(40), &identity(20), &regulator.p) < 1e-9);
    }

    /// Double integrator, Q = I, R = r: K = [1, √(1 + 2√r)]/√r in closed form (thesis (5.6); corrected digits).
    #[test]
    fn double_integrator_in_closed_form() {
        let a = from_rows(&[vec![0.0, 1.0], vec![0.0, 0.0]]);
        let b = from_rows(&[vec![0.0], vec![1.0]]);
        let regulator = solve(&a, &b, &identity(2), &diagonal(&[0.001])).unwrap();
        assert!((regulator.k[(0, 0)] - 1000f64.sqrt()).abs() < 1e-9);
        assert!((regulator.k[(0, 1)] - (1000.0 + 2.0 * 1000f64.sqrt()).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn failures_are_named() {
        let a = diagonal(&[1.0, -1.0]);
        let b = from_rows(&[vec![0.0], vec![1.0]]);
        let error = solve(&a, &b, &identity(2), &identity(1)).unwrap_err();
        let words = "the pair (A, B) is not stabilisable: no input moves x1 (λ = 1), which does not decay by itself";
        assert_eq!(error.to_string(), words);
        assert_eq!(solve(&a, &b, &identity(2), &diagonal(&[-1.0])).unwrap_err(), RiccatiError::InputWeight);
    }
}
