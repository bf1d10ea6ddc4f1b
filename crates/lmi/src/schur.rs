//! The Schur complement system `M dx = r`, `M_ij = Σ_b tr(F_{b,i} S_b⁻¹ F_{b,j} Z_b)`: symmetric, positive semidefinite,
//! definite when the coefficient matrices are linearly independent.

use crate::aligned::Aligned;
use crate::cholesky::{self, solve_with_factor};
use crate::dense::{self, Scratch, axpy, dot, norm};
use crate::vectorized::vectorized;
use faer::{Mat, Side};

/// Rounds of refinement at most.
const ROUNDS: usize = 4;
/// An eigenvalue that is more negative than this, the diagonal being 1, does not come from the rounding of the factorisation.
const INDEFINITE: f64 = 1e-3;

/// M with its factorisation.
pub(crate) struct Schur {
    n: usize,
    /// The lower triangle of M, column by column.
    pub matrix: Vec<f64>,
    /// The lower triangle of the factor, columns `stride` apart.
    factor: Aligned,
    stride: usize,
    /// 1/√M_ii: the factorised matrix is scaled to a unit diagonal. Zero for unknowns that stay where they are.
    scale: Vec<f64>,
    scratch: Scratch,
    residual: Vec<f64>,
    correction: Vec<f64>,
    /// What was added to the unit diagonal to make the factorisation exist.
    pub regularization: f64,
}

impl Schur {
    pub fn new(n: usize) -> Self {
        let (stride, packed) = if n <= cholesky::MOST { (cholesky::stride(n), 0) } else { (n, n) };
        Self {
            n,
            matrix: vec![0.0; n * n],
            factor: Aligned::zeros(n * stride),
            stride,
            scale: vec![0.0; n],
            scratch: Scratch::new(packed),
            residual: vec![0.0; n],
            correction: vec![0.0; n],
            regularization: 0.0,
        }
    }

    /// The lower triangle of M ← 0; the upper one is not looked at.
    pub fn clear(&mut self) {
        let n = self.n;
        (0..n).for_each(|j| self.matrix[j * n + j..(j + 1) * n].fill(0.0));
    }

    /// M ← diag(s) M diag(s).
    pub fn scale_by(&mut self, s: &[f64]) {
        let n = self.n;
        if s.iter().all(|s| *s == 1.0) {
            return;
        }
        scale_columns(n, s, &mut self.matrix);
    }

    /// Factorises M. Unknowns that appear nowhere stay where they are; linearly dependent coefficient matrices
    /// are met by adding to the (unit) diagonal, from `regularization` or rounding level upwards. Where that is not enough, unknowns
    /// whose entries are nothing but rounding errors stay where they are, too. False when M is not finite.
    pub fn factorize(&mut self, regularization: f64) -> bool {
        let n = self.n;
        for i in 0..n {
            let diagonal = self.matrix[i + i * n];
            if !diagonal.is_finite() {
                return false;
            }
            self.scale[i] = if diagonal > f64::MIN_POSITIVE { 1.0 / diagonal.sqrt() } else { 0.0 };
        }
        self.regularization = regularization;
        loop {
            scaled(n, self.stride, &self.matrix, &self.scale, 1.0 + self.regularization, &mut self.factor);
            let done = if n <= cholesky::MOST {
                cholesky::factorize(n, &mut self.factor)
            } else {
                dense::cholesky(n, &mut self.factor, &mut self.scratch)
            };
            if done {
                return true;
            }
            self.regularization = if self.regularization == 0.0 { 1e-16 } else { self.regularization * 4.0 };
            if self.regularization > INDEFINITE {
                let Some(noise) = self.noise() else { return false };
                self.scale[noise] = 0.0;
                self.regularization = regularization;
            }
        }
    }

    /// Of an indefinite M, scaled to a unit diagonal: the unknown with the largest part in the eigenvector of the smallest eigenvalue.
    ///
    /// Where a multiplier comes to vanish along a coefficient matrix, as in problems whose optimal set is unbounded, that unknown's
    /// entries of M are differences of large numbers, and the scaling raises them to the level of all others.
    fn noise(&self) -> Option<usize> {
        let (n, m, s) = (self.n, &self.matrix, &self.scale);
        let entry = |i: usize, j: usize| m[i.max(j) + i.min(j) * n] * s[i] * s[j];
        let scaled = Mat::from_fn(n, n, |i, j| if i == j { 1.0 } else { entry(i, j) });
        let spectrum = scaled.self_adjoint_eigen(Side::Lower).ok()?;
        let vector = spectrum.U().col(0);
        let worst = (0..n).max_by(|&i, &j| vector[i].abs().total_cmp(&vector[j].abs()))?;
        (spectrum.S()[0] < 0.0 && s[worst] > 0.0).then_some(worst)
    }

    /// Solves M x = r by the factor and iterative refinement against M itself.
    ///
    /// Directions in which M is small against its own rounding errors are left alone: a solver that insists on them
    /// (conjugate gradients, say) follows noise.
    pub fn solve(&mut self, r: &[f64], x: &mut [f64]) {
        x.fill(0.0);
        self.residual.copy_from_slice(r);
        let target = 1e-14 * norm(r);
        let mut last = f64::INFINITY;
        for round in 0..ROUNDS {
            self.correction.copy_from_slice(&self.residual);
            self.solve_factored();
            axpy(1.0, &self.correction, x);
            self.update_residual(r, x);
            let size = norm(&self.residual);
            if size.is_nan() || (round > 0 && size >= last) {
                axpy(-1.0, &self.correction, x);
                break;
            }
            last = size;
            if size <= target {
                break;
            }
        }
    }

    /// Solves M x = r by the factor alone.
    pub fn solve_once(&mut self, r: &[f64], x: &mut [f64]) {
        self.correction.copy_from_slice(r);
        self.solve_factored();
        x.copy_from_slice(&self.correction);
    }

    fn solve_factored(&mut self) {
        let n = self.n;
        self.correction.iter_mut().zip(&self.scale).for_each(|(c, s)| *c *= s);
        solve_with_factor(n, self.stride, &self.factor, &mut self.correction);
        self.correction.iter_mut().zip(&self.scale).for_each(|(c, s)| *c *= s);
    }

    /// residual = r − M x from the lower triangle.
    fn update_residual(&mut self, r: &[f64], x: &[f64]) {
        subtract_product(self.n, &self.matrix, r, x, &mut self.residual);
        self.residual.iter_mut().zip(&self.scale).filter(|(_, s)| **s == 0.0).for_each(|(r, _)| *r = 0.0);
    }
}

vectorized! {
    /// M ← diag(s) M diag(s), lower triangle.
    fn scale_columns<'a>(n: usize, s: &'a [f64], m: &'a mut [f64]) {
        for (j, column) in m.chunks_exact_mut(n.max(1)).enumerate() {
            column[j..].iter_mut().zip(&s[j..]).for_each(|(m, i)| *m *= i * s[j]);
        }
    }
}

vectorized! {
    /// out = diag(s) M diag(s) for the lower triangle of a symmetric M, with another diagonal; columns of `out` are `stride` apart.
    fn scaled<'a>(n: usize, stride: usize, m: &'a [f64], s: &'a [f64], diagonal: f64, out: &'a mut [f64]) {
        for (j, (out, column)) in out.chunks_exact_mut(stride.max(1)).zip(m.chunks_exact(n.max(1))).enumerate() {
            for ((out, entry), other) in out[j..].iter_mut().zip(&column[j..]).zip(&s[j..]) {
                *out = entry * s[j] * other;
            }
            out[j] = diagonal;
        }
    }
}

vectorized! {
    /// out = r − M x for the lower triangle of a symmetric M.
    fn subtract_product<'a>(n: usize, m: &'a [f64], r: &'a [f64], x: &'a [f64], out: &'a mut [f64]) {
        out.copy_from_slice(r);
        for (j, column) in m.chunks_exact(n.max(1)).enumerate() {
            axpy(-x[j], &column[j..], &mut out[j..]);
            out[j] -= dot(&column[j + 1..], &x[j + 1..]);
        }
    }
}
