//! How far one can go from a positive definite matrix along a symmetric direction.
//!
//! The largest α with `S + αD ⪰ 0` is −1/λ for λ the smallest eigenvalue of S⁻¹D, when that is negative. S⁻¹D is self-adjoint in
//! the inner product of S, so that the Lanczos iteration in that inner product needs products with D and S⁻¹ only:
//! two matrix-vector products a step, no eigendecomposition. (Toh, SIAM J. Optim. 12, 2002, for the bound.)

use crate::dense::{apply, axpy, dot};
use crate::vectorized::arch;

/// Minors below this are scaled up, so that none vanishes for want of exponents.
const TINY: f64 = 1e-100;
/// Most steps of one estimate. The result is safe-guarded by a Cholesky factorisation, so that few suffice.
const STEPS: usize = 30;

/// Scratch memory for matrices up to a size.
#[derive(Debug)]
pub(crate) struct Lanczos {
    v: Vec<f64>,
    sv: Vec<f64>,
    sv_before: Vec<f64>,
    w: Vec<f64>,
    u: Vec<f64>,
}

impl Lanczos {
    pub fn new(n: usize) -> Self {
        Self { v: vec![0.0; n], sv: vec![0.0; n], sv_before: vec![0.0; n], w: vec![0.0; n], u: vec![0.0; n] }
    }

    /// An estimate from below, to the relative `accuracy`, of the largest α with `S + αD ⪰ 0`; infinite when the estimate finds no end.
    ///
    /// Given are S itself, its inverse and D, symmetric n × n.
    pub fn step(&mut self, n: usize, [s, s_inverse, d]: [&[f64]; 3], accuracy: f64) -> f64 {
        arch().dispatch(LongestStep { lanczos: self, n, s, s_inverse, d, accuracy })
    }
}

struct LongestStep<'a> {
    lanczos: &'a mut Lanczos,
    n: usize,
    s: &'a [f64],
    s_inverse: &'a [f64],
    d: &'a [f64],
    accuracy: f64,
}

impl pulp::WithSimd for LongestStep<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> f64 {
        let Self { lanczos, n, s, s_inverse, d, accuracy } = self;
        let Lanczos { v, sv, sv_before, w, u } = lanczos;
        let (v, sv, sv_before) = (&mut v[..n], &mut sv[..n], &mut sv_before[..n]);
        let (w, u) = (&mut w[..n], &mut u[..n]);
        // A fixed start without pattern.
        for (i, v) in v.iter_mut().enumerate() {
            *v = 1.0 + 0.5 * ((i * i + 3 * i + 1) % 7) as f64 / 7.0 - if i % 2 == 1 { 0.3 } else { 0.0 };
        }
        apply(simd, n, s, v, sv);
        let length = dot(v, sv).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return 0.0;
        }
        v.iter_mut().chain(sv.iter_mut()).for_each(|x| *x /= length);
        sv_before.fill(0.0);
        let (mut alphas, mut betas) = ([0.0; STEPS], [0.0; STEPS]);
        let mut smallest = f64::NAN;
        for k in 0..STEPS.min(n) {
            apply(simd, n, d, v, w);
            if k > 0 {
                axpy(-betas[k - 1], sv_before, w);
            }
            let alpha = dot(w, v);
            axpy(-alpha, sv, w);
            apply(simd, n, s_inverse, w, u);
            let square = dot(u, w);
            if !(alpha.is_finite() && square.is_finite()) {
                return 0.0;
            }
            let beta = square.max(0.0).sqrt();
            alphas[k] = alpha;
            betas[k] = beta;
            let last = k + 1 == STEPS.min(n) || beta <= 1e-12 * alphas[0].abs();
            if last || (k >= 3 && k % 2 == 1) {
                let (value, component) = smallest_of_tridiagonal(&alphas[..=k], &betas[..k], 0.02 * accuracy);
                // Some eigenvalue lies within `residual` of the Ritz value.
                let residual = if k + 1 == n { 0.0 } else { beta * component };
                smallest = value - residual;
                if last || residual <= accuracy * value.abs() || (value > -1e-1 && smallest > -0.5) {
                    break;
                }
            }
            sv_before.copy_from_slice(sv);
            let inverse = 1.0 / beta;
            v.iter_mut().zip(u.iter()).for_each(|(v, u)| *v = u * inverse);
            sv.iter_mut().zip(w.iter()).for_each(|(sv, w)| *sv = w * inverse);
        }
        if smallest < 0.0 { -1.0 / smallest } else { f64::INFINITY }
    }
}

/// The smallest eigenvalue of a symmetric tridiagonal matrix from below, to the relative `accuracy`, and the last component
/// (absolute) of its normalised eigenvector.
///
/// Laguerre's iteration from below the spectrum comes closer from one side, of third order (Parlett, The symmetric eigenvalue problem, 1980).
fn smallest_of_tridiagonal(diagonal: &[f64], off: &[f64], accuracy: f64) -> (f64, f64) {
    let k = diagonal.len();
    let radius = |i: usize| {
        let left = if i > 0 { off[i - 1].abs() } else { 0.0 };
        let right = if i + 1 < k { off[i].abs() } else { 0.0 };
        left + right
    };
    let mut low = (0..k).map(|i| diagonal[i] - radius(i)).fold(f64::INFINITY, f64::min);
    let spread = (0..k).map(|i| (diagonal[i] - low).abs() + radius(i)).fold(f64::MIN_POSITIVE, f64::max);
    let unit = 1.0 / spread;
    let size = k as f64;
    for _ in 0..40 {
        let Some([first, second]) = inverse_powers(diagonal, off, low, unit) else { break };
        let root = ((size - 1.0) * (size * second - first * first)).max(0.0).sqrt();
        let step = spread * size / (first + root);
        low += step;
        if step <= accuracy * low.abs() {
            break;
        }
    }
    // Not above it by what rounding leaves of the minors.
    low -= 4.0 * f64::EPSILON * spread;
    // The eigenvector by its recurrence from the first component on.
    let (mut before, mut now, mut sum) = (0.0, 1.0, 1.0);
    for i in 0..k - 1 {
        let previous = if i > 0 { off[i - 1] * before } else { 0.0 };
        let next = if off[i] != 0.0 { ((low - diagonal[i]) * now - previous) / off[i] } else { 0.0 };
        (before, now) = (now, next);
        sum += now * now;
    }
    let component = if sum.is_finite() { now.abs() / sum.sqrt() } else { 1.0 };
    (low, component)
}

/// Σ 1/(λᵢ − λ) and Σ 1/(λᵢ − λ)² over the eigenvalues λᵢ of `unit` times a tridiagonal matrix, from its leading minors and their
/// derivatives; `None` when λ is not below all of them.
fn inverse_powers(diagonal: &[f64], off: &[f64], lambda: f64, unit: f64) -> Option<[f64; 2]> {
    // The minors p, −p′ and ½p″.
    let mut before = [1.0, 0.0, 0.0];
    let mut minors = [unit * (diagonal[0] - lambda), 1.0, 0.0];
    let mut positive = minors[0] > 0.0;
    for (entry, beta) in diagonal[1..].iter().zip(off) {
        let (entry, square) = (unit * (entry - lambda), (unit * beta).powi(2));
        let mut next = [0.0; 3];
        for d in 0..3 {
            let lower = if d > 0 { minors[d - 1] } else { 0.0 };
            next[d] = entry * minors[d] + lower - square * before[d];
        }
        if next[0].abs() < TINY {
            next.iter_mut().chain(&mut minors).for_each(|minor| *minor /= TINY);
        }
        (before, minors) = (minors, next);
        positive &= minors[0] > 0.0;
    }
    let [value, slope, curvature] = minors;
    let first = slope / value;
    (positive && first.is_finite()).then(|| [first, first * first - 2.0 * curvature / value])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::{Scratch, cholesky, inverse_from_factor};
    use crate::vectorized::tests::with_every_instruction_set;
    use faer::{Mat, Side};

    fn sample(n: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        };
        let m = Mat::from_fn(n, n, |_, _| next());
        let symmetric = &m + m.transpose();
        (0..n * n).map(|at| symmetric[(at % n, at / n)]).collect()
    }

    /// Close to the end that the eigenvalues of S⁻¹D give.
    #[test]
    fn step_agrees_with_eigenvalues() {
        with_every_instruction_set(step_agrees);
    }

    fn step_agrees() {
        for (n, seed) in [(1, 1), (2, 2), (3, 3), (8, 4), (28, 5), (28, 6), (60, 7)] {
            let (mut s, d) = (sample(n, seed), sample(n, seed + 100));
            (0..n).for_each(|i| s[i + i * n] += 4.0 * (n as f64).sqrt());
            let mut factor = s.clone();
            let mut scratch = Scratch::new(n);
            assert!(cholesky(n, &mut factor, &mut scratch));
            let mut inverse = vec![0.0; n * n];
            inverse_from_factor(n, &factor, &mut inverse, &mut scratch);
            let lower = Mat::from_fn(n, n, |i, j| if i >= j { factor[i + j * n] } else { 0.0 });
            let d_matrix = Mat::from_fn(n, n, |i, j| d[i + j * n]);
            let mut half = d_matrix.clone();
            faer::linalg::triangular_solve::solve_lower_triangular_in_place(
                lower.as_ref(),
                half.as_mut(),
                faer::Par::Seq,
            );
            let mut whole = half.transpose().to_owned();
            faer::linalg::triangular_solve::solve_lower_triangular_in_place(
                lower.as_ref(),
                whole.as_mut(),
                faer::Par::Seq,
            );
            let smallest = whole.self_adjoint_eigenvalues(Side::Lower).unwrap()[0];
            let step = Lanczos::new(n).step(n, [&s, &inverse, &d], 0.05);
            if smallest > -0.05 {
                assert!(step > 5.0, "{n}: {step} for {smallest}");
                continue;
            }
            let end = -1.0 / smallest;
            // The residual bound speaks of some eigenvalue, so that a few percent too much are possible; the caller checks.
            assert!(step <= 1.1 * end && step >= 0.8 * end, "{n}: {step} of {end}");
        }
    }

    #[test]
    fn smallest_eigenvalue_of_a_second_difference() {
        let (value, component) = smallest_of_tridiagonal(&[2.0; 5], &[-1.0; 4], 1e-3);
        let exact = 2.0 - 2.0 * (std::f64::consts::PI / 6.0).cos();
        assert!((value - exact).abs() < 1e-3 && value <= exact);
        // The eigenvector is sin(kπ/6)/√3.
        assert!((component - 0.5 / 3.0_f64.sqrt()).abs() < 1e-2);
    }
}
