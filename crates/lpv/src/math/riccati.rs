//! The continuous algebraic Riccati equation Aᵀ P + P A − P B R⁻¹ Bᵀ P + Q = 0, thesis (2.31).

use super::balance::balance;
use super::matrix::{blocks_2x2, identity, inverse, inverse_spd, is_finite, least_squares, symmetric_part};
use super::stabilizability::{Mode, Stabilizability, detectability, stabilizability};
use super::{Mat, eigen, lyapunov};

/// The stabilising solution of the Riccati equation and the gain that it gives.
#[derive(Clone, Debug)]
pub struct Regulator {
    /// P = Pᵀ ⪰ 0, n × n: the least cost of a stable loop from x₀ is x₀ᵀ P x₀.
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
    /// A mode on the imaginary axis costs nothing, which is decided exactly: there is no stabilising solution.
    #[error("no solution stabilises: {0} costs nothing and does not decay by itself; give it a positive weight in Q")]
    Unweighted(Mode),
    /// The Hamiltonian matrix has eigenvalues on the imaginary axis, or too close to it for its arithmetic.
    #[error(
        "the Riccati equation could not be solved: to rounding its Hamiltonian matrix has eigenvalues on the imaginary axis; scale \
         states and inputs, or give modes that decay slowly a larger weight in Q"
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
/// P is the one solution with a stable A − BK; it is singular where a motion that decays by itself costs nothing. The Hamiltonian is
/// balanced by a symplectic scaling by powers of two (P. Benner 2001), its stable invariant subspace comes from its matrix sign (Roberts 1980,
/// Byers 1987), and Newton's method (Kleinman 1968) then polishes P down to rounding.
///
/// # Errors
/// See [`RiccatiError`].
pub fn solve(a: &Mat<f64>, b: &Mat<f64>, q: &Mat<f64>, r: &Mat<f64>) -> Result<Regulator, RiccatiError> {
    let r_inverse = inverse_spd(r).ok_or(RiccatiError::InputWeight)?;
    if let Stabilizability::Unstabilizable(mode) = stabilizability(a, b) {
        return Err(RiccatiError::Unstabilizable(mode));
    }
    if let Stabilizability::Unstabilizable(mode) = detectability(a, q)
        && mode.is_on_axis
    {
        return Err(RiccatiError::Unweighted(mode));
    }
    let scaling = Scaling::of(a, &(b * &r_inverse * b.transpose()), q);
    let p = scaling.lyapunov_matrix(&scaling.solve()?);
    let k = r_inverse * b.transpose() * &p;
    Ok(Regulator { p, k })
}

/// P + εX with X ≻ 0 and (A − BK)ᵀX + X(A − BK) = −‖Q + PGP‖I in balanced coordinates: a strict and definite neighbour of a solution, of which
/// P may be singular. `None` where A − BK is not stable.
pub fn strict(
    (a, b): (&Mat<f64>, &Mat<f64>),
    (q, r): (&Mat<f64>, &Mat<f64>),
    Regulator { p, k }: &Regulator,
    epsilon: f64,
) -> Option<Mat<f64>> {
    let n = a.nrows();
    let scaling = Scaling::of(a, &(b * &inverse_spd(r)? * b.transpose()), q);
    let Scaling { exponents: d, .. } = &scaling;
    let of_loop = a - b * k;
    let closed_loop = Mat::from_fn(n, n, |i, j| of_loop[(i, j)] * 2.0_f64.powi(d[j] - d[i]));
    let of_scaled = Mat::from_fn(n, n, |i, j| p[(i, j)] * 2.0_f64.powi(d[i] + d[j] - scaling.size));
    let size = (&scaling.q + &of_scaled * &scaling.g * &of_scaled).norm_max().max(f64::MIN_POSITIVE);
    let x = lyapunov::solve(&closed_loop, &Mat::from_fn(n, n, |i, j| if i == j { size } else { 0.0 }))?;
    let x = scaling.lyapunov_matrix(&x);
    Some(symmetric_part(&Mat::from_fn(n, n, |i, j| p[(i, j)] + epsilon * x[(i, j)])))
}

/// The equation for P′ = 2⁻ʳ D P D, D = diag(2^d): A′ = D⁻¹AD, G′ = 2ʳD⁻¹GD⁻¹, Q′ = 2⁻ʳDQD, exactly.
struct Scaling {
    exponents: Vec<i32>,
    size: i32,
    a: Mat<f64>,
    g: Mat<f64>,
    q: Mat<f64>,
}

impl Scaling {
    fn of(a: &Mat<f64>, g: &Mat<f64>, q: &Mat<f64>) -> Self {
        let n = a.nrows();
        let e = balance(&hamiltonian(a, g, q));
        // the nearest diag(2^d, 2^(r − d))
        let size = ((0..2 * n).map(|i| e[i]).sum::<i32>() as f64 / n.max(1) as f64).round() as i32;
        let d: Vec<i32> = (0..n).map(|i| (e[i] - e[n + i] + size).div_euclid(2)).collect();
        let scaled = |m: &Mat<f64>, shift: &dyn Fn(usize, usize) -> i32| {
            Mat::from_fn(n, n, |i, j| m[(i, j)] * 2.0_f64.powi(shift(i, j)))
        };
        Self {
            a: scaled(a, &|i, j| d[j] - d[i]),
            g: scaled(g, &|i, j| size - d[i] - d[j]),
            q: scaled(q, &|i, j| d[i] + d[j] - size),
            exponents: d,
            size,
        }
    }

    /// P of P′.
    fn lyapunov_matrix(&self, p: &Mat<f64>) -> Mat<f64> {
        let d = &self.exponents;
        Mat::from_fn(p.nrows(), p.ncols(), |i, j| p[(i, j)] * 2.0_f64.powi(self.size - d[i] - d[j]))
    }

    fn solve(&self) -> Result<Mat<f64>, RiccatiError> {
        let Self { a, g, q, .. } = self;
        let n = a.nrows();
        let sign = matrix_sign(hamiltonian(a, g, q)).ok_or(RiccatiError::ImaginaryAxis)?;
        // (sign + I)[I; P] = 0: 2n × n equations for P
        let left = Mat::from_fn(2 * n, n, |i, j| sign[(i, n + j)] + if i == n + j { 1.0 } else { 0.0 });
        let right = Mat::from_fn(2 * n, n, |i, j| -sign[(i, j)] - if i == j { 1.0 } else { 0.0 });
        let mut p = symmetric_part(&least_squares(&left, &right).ok_or(RiccatiError::ImaginaryAxis)?);
        let mut last_change = f64::INFINITY;
        // quadratic, and then rounding: it ends where it gets no better
        for step in 0..MOST_STEPS {
            let closed_loop = a - g * &p;
            let cost = symmetric_part(&(q + &p * g * &p));
            let next = lyapunov::solve(&closed_loop, &cost).ok_or(RiccatiError::IllConditioned)?;
            let change = (&next - &p).norm_l2();
            p = next;
            if step >= 2 && change >= 0.5 * last_change {
                break;
            }
            last_change = change;
        }
        match eigen::spectral_abscissa(&(a - g * &p)) < 0.0 {
            true => Ok(p),
            false => Err(RiccatiError::IllConditioned),
        }
    }
}

/// Newton's steps after which what is reached is taken.
const MOST_STEPS: usize = 30;

/// [[A, −G], [−Q, −Aᵀ]]
fn hamiltonian(a: &Mat<f64>, g: &Mat<f64>, q: &Mat<f64>) -> Mat<f64> {
    let minus = |m: &Mat<f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| -m[(i, j)]);
    let minus_a_transposed = minus(&a.transpose().to_owned());
    blocks_2x2(a.as_ref(), minus(g).as_ref(), minus(q).as_ref(), minus_a_transposed.as_ref())
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

    fn close(k: &Mat<f64>, expected: &[f64]) {
        for (j, expected) in expected.iter().enumerate() {
            assert!((k[(0, j)] / expected - 1.0).abs() < 1e-9, "{k:?}");
        }
    }

    /// Gains of an inverted pendulum under weights thirty decades apart (boisgera, control-engineering-with-python, issue 15).
    #[test]
    fn weights_of_any_size() {
        let a = from_rows(&[vec![0.0, 1.0], vec![9.81, 0.0]]);
        let b = from_rows(&[vec![0.0], vec![1.0]]);
        for (weight, expected) in [
            (1e15, [31622786.411685, 31622777.601684]),
            (1e-15, [19.62, 6.2641839053]),
            (1e-200, [19.62, 6.2641839053]),
        ] {
            close(&solve(&a, &b, &diagonal(&[weight, weight]), &identity(1)).unwrap().k, &expected);
        }
    }

    /// Q is singular and does not see every motion, those that it does not see decay: P is singular (Drake, issue 19222).
    #[test]
    fn detectable_and_not_observable() {
        let a = from_rows(&[vec![0.0, 1.0, 0.0], vec![0.0, 0.0, 1.0], vec![-1.0, -1.0, -1.0]]);
        let b = from_rows(&[vec![0.0], vec![0.0], vec![1.0]]);
        let q = from_rows(&[vec![1.0, 1.0, 0.0], vec![1.0, 1.0, 0.0], vec![0.0; 3]]);
        let regulator = solve(&a, &b, &q, &identity(1)).unwrap();
        close(&regulator.k, &[2.0_f64.sqrt() - 1.0, 1.3243932834975, 0.91017972112445]);
        let p = strict((&a, &b), (&q, &identity(1)), &regulator, 1e-6).unwrap();
        let flow = &p * (&a - &b * &regulator.k);
        let decrease = &flow + flow.transpose() + &q + regulator.k.transpose() * &regulator.k;
        let eigenvalues = |m: &Mat<f64>| eigen::symmetric_eigenvalues(m);
        assert!(eigenvalues(&p)[0] > 1e-9 && eigenvalues(&decrease)[2] < -1e-8);
        // the pole at −1 alone would be seen by a Q that sees a motion on the axis no more
        let idle = diagonal(&[0.0, 0.0, -1.0]);
        let error = solve(&idle, &identity(3), &diagonal(&[1.0, 0.0, 0.0]), &identity(3)).unwrap_err();
        assert!(matches!(&error, RiccatiError::Unweighted(mode) if mode.states() == [1]), "{error}");
    }

    /// What costs nothing and grows has to be stabilised all the same.
    #[test]
    fn growing_modes_without_weight() {
        let regulator = solve(&identity(1), &identity(1), &Mat::zeros(1, 1), &identity(1)).unwrap();
        assert!((regulator.k[(0, 0)] - 2.0).abs() < 1e-12);
    }

    /// COMPleib's PAS, stiff beside slow: the residual is that of rounding, and the loop is stable.
    #[test]
    fn badly_scaled_plant() {
        let a = from_rows(&[
            vec![0.0, 1.0, 0.0, 0.0, 0.0],
            vec![-274921.63, -73.2915, -274921.63, 0.0, 0.0],
            vec![0.0, 0.0, -0.9597, 0.0, 0.0],
            vec![1.0, 0.0, 0.0, 0.0, 0.0],
            vec![0.0, 0.0, 0.0, 1.0, 0.0],
        ]);
        let b = from_rows(&[vec![0.0], vec![0.12841], vec![-3.39561e-07], vec![0.0], vec![0.0]]);
        let regulator = solve(&a, &b, &identity(5), &identity(1)).unwrap();
        assert!(eigen::spectral_abscissa(&(&a - &b * &regulator.k)) < 0.0);
        assert!(residual(&a, &b, &identity(5), &identity(1), &regulator.p) < 1e-9);
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
