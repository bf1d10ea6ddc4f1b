//! The HKM direction, block by block.
//!
//! With P = S⁻¹ and R = F(x) − S the step (dx, dS, dZ) satisfies
//!
//! ```text
//! dS = F(dx) − F(0) + R
//! dZ = G − Z − sym(P (F(dx) − F(0)) Z),     G = σμ P − sym(P R Z) − sym(P dSₐ dZₐ)
//! M dx = A(G) − c                           from A(Z + dZ) = c
//! ```
//!
//! where dSₐ, dZₐ is the predictor step (Mehrotra), absent (with σ = 0) from the predictor itself.

use crate::block::{Block, OperatorScratch};
use crate::dense::{self, Scratch};
use crate::lanczos::Lanczos;

/// The variables and working memory of one block. Matrices are n × n column by column; of a diagonal block, diagonals.
#[derive(Debug)]
pub(crate) struct BlockState {
    pub n: usize,
    diagonal: bool,
    pub s: Vec<f64>,
    pub z: Vec<f64>,
    /// Cholesky factors of S and Z (lower triangles).
    s_factor: Vec<f64>,
    z_factor: Vec<f64>,
    pub s_inverse: Vec<f64>,
    z_inverse: Vec<f64>,
    /// R = F(x) − S.
    pub residual: Vec<f64>,
    pub ds: Vec<f64>,
    pub dz: Vec<f64>,
    /// −sym(P R Z), then G; whether that is zero.
    g: Vec<f64>,
    vanishes: bool,
    /// P dS.
    p_ds: Vec<f64>,
    work: Vec<f64>,
    product: Vec<f64>,
    pub operator: OperatorScratch,
}

impl BlockState {
    /// Diagonal S and Z.
    pub fn new(block: &Block, unknowns: usize, s: &[f64], z: &[f64]) -> Self {
        let n = block.size();
        let diagonal = block.is_diagonal();
        let len = block.constant().len();
        let matrix = |entry: &dyn Fn(usize) -> f64| {
            if diagonal {
                return (0..n).map(entry).collect();
            }
            let mut m = vec![0.0; len];
            (0..n).for_each(|i| m[i + i * n] = entry(i));
            m
        };
        let zero = || vec![0.0; len];
        Self {
            n,
            diagonal,
            s: matrix(&|i| s[i]),
            z: matrix(&|i| z[i]),
            s_factor: matrix(&|i| s[i].sqrt()),
            z_factor: matrix(&|i| z[i].sqrt()),
            s_inverse: zero(),
            z_inverse: zero(),
            residual: zero(),
            ds: zero(),
            dz: zero(),
            g: zero(),
            vanishes: true,
            p_ds: zero(),
            work: zero(),
            product: zero(),
            operator: block.scratch(unknowns),
        }
    }

    /// Begins anew at S and Z; false when one of them is not positive definite.
    pub fn begin(&mut self, s: &[f64], z: &[f64], scratch: &mut Scratch) -> bool {
        for (to, from) in [(&mut self.s, s), (&mut self.z, z), (&mut self.s_factor, s), (&mut self.z_factor, z)] {
            to.copy_from_slice(from);
        }
        factorize(self.diagonal, self.n, &mut self.s_factor, scratch)
            && factorize(self.diagonal, self.n, &mut self.z_factor, scratch)
    }

    /// R ← F(x) − S.
    pub fn update_residual(&mut self, block: &Block, x: &[f64]) {
        self.residual.copy_from_slice(block.constant());
        block.apply(x, &mut self.residual, &mut self.operator);
        self.residual.iter_mut().zip(&self.s).for_each(|(r, s)| *r -= s);
    }

    /// Replaces S by F(x) = S + R when that is positive definite; the residual is then zero.
    pub fn close_residual(&mut self, scratch: &mut Scratch) -> bool {
        self.work.iter_mut().zip(&self.s).zip(&self.residual).for_each(|((w, s), r)| *w = s + r);
        self.s_factor.copy_from_slice(&self.work);
        let done = factorize(self.diagonal, self.n, &mut self.s_factor, scratch);
        if done {
            self.s.copy_from_slice(&self.work);
            self.residual.fill(0.0);
        } else {
            self.s_factor.copy_from_slice(&self.s);
            factorize(self.diagonal, self.n, &mut self.s_factor, scratch);
        }
        done
    }

    /// The inverses of S and Z from their factors.
    pub fn invert(&mut self, scratch: &mut Scratch) {
        if self.diagonal {
            self.s_inverse.iter_mut().zip(&self.s).for_each(|(p, s)| *p = 1.0 / s);
            self.z_inverse.iter_mut().zip(&self.z).for_each(|(p, z)| *p = 1.0 / z);
            return;
        }
        dense::inverse_from_factor(self.n, &self.s_factor, &mut self.s_inverse, scratch);
        dense::inverse_from_factor(self.n, &self.z_factor, &mut self.z_inverse, scratch);
    }

    /// G of the predictor: −sym(P R Z), zero when there is no residual.
    pub fn begin_predictor(&mut self, feasible: bool, scratch: &mut Scratch) {
        self.vanishes = feasible;
        if feasible {
            self.g.fill(0.0);
            return;
        }
        if self.diagonal {
            for (((g, p), r), z) in self.g.iter_mut().zip(&self.s_inverse).zip(&self.residual).zip(&self.z) {
                *g = -p * r * z;
            }
            return;
        }
        dense::multiply(self.n, &self.s_inverse, &self.residual, &mut self.work, scratch);
        dense::multiply(self.n, &self.work, &self.z, &mut self.g, scratch);
        dense::symmetrize(self.n, &mut self.g);
        self.g.iter_mut().for_each(|g| *g = -*g);
    }

    /// G of the corrector: adds σμ P − sym(P dSₐ dZₐ) to the predictor's G, for the predictor step in `ds`, `dz`.
    pub fn begin_corrector(&mut self, sigma_mu: f64, scratch: &mut Scratch) {
        self.vanishes = false;
        if self.diagonal {
            for i in 0..self.g.len() {
                self.g[i] += self.s_inverse[i] * (sigma_mu - self.ds[i] * self.dz[i]);
            }
            return;
        }
        dense::multiply(self.n, &self.p_ds, &self.dz, &mut self.work, scratch);
        dense::symmetrize(self.n, &mut self.work);
        for ((g, p), w) in self.g.iter_mut().zip(&self.s_inverse).zip(&self.work) {
            *g += sigma_mu * p - w;
        }
    }

    /// right side ← right side + A(G).
    pub fn add_right_side(&mut self, block: &Block, out: &mut [f64]) {
        if !self.vanishes {
            block.adjoint(1.0, &self.g, out, &mut self.operator);
        }
    }

    /// dS and dZ from dx.
    pub fn complete(&mut self, block: &Block, dx: &[f64], feasible: bool, scratch: &mut Scratch) {
        self.ds.fill(0.0);
        block.apply(dx, &mut self.ds, &mut self.operator);
        if self.diagonal {
            for i in 0..self.ds.len() {
                self.dz[i] = self.g[i] - self.z[i] - self.s_inverse[i] * self.ds[i] * self.z[i];
                self.ds[i] += self.residual[i];
            }
            return;
        }
        dense::multiply(self.n, &self.s_inverse, &self.ds, &mut self.p_ds, scratch);
        dense::multiply(self.n, &self.p_ds, &self.z, &mut self.dz, scratch);
        dense::symmetrize(self.n, &mut self.dz);
        for ((dz, g), z) in self.dz.iter_mut().zip(&self.g).zip(&self.z) {
            *dz = g - z - *dz;
        }
        if !feasible {
            self.ds.iter_mut().zip(&self.residual).for_each(|(ds, r)| *ds += r);
            dense::multiply(self.n, &self.s_inverse, &self.ds, &mut self.p_ds, scratch);
        }
    }

    /// out ← out − A(Z + dZ).
    pub fn subtract_dual(&mut self, block: &Block, out: &mut [f64]) {
        self.work.iter_mut().zip(&self.z).zip(&self.dz).for_each(|((w, z), dz)| *w = z + dz);
        block.adjoint(-1.0, &self.work, out, &mut self.operator);
    }

    /// dS and dZ for a small change of dx. Added to what is there rather than formed anew, so that rounding errors
    /// are relative to the change.
    pub fn refine(&mut self, block: &Block, change: &[f64], scratch: &mut Scratch) {
        self.work.fill(0.0);
        block.apply(change, &mut self.work, &mut self.operator);
        dense::axpy(1.0, &self.work, &mut self.ds);
        if self.diagonal {
            for i in 0..self.dz.len() {
                self.dz[i] -= self.s_inverse[i] * self.work[i] * self.z[i];
            }
            return;
        }
        dense::multiply(self.n, &self.s_inverse, &self.work, &mut self.product, scratch);
        dense::multiply(self.n, &self.product, &self.z, &mut self.work, scratch);
        dense::symmetrize(self.n, &mut self.work);
        dense::axpy(-1.0, &self.work, &mut self.dz);
    }

    /// dZ ← dZ + Z (F(y) − F(0)) Z.
    pub fn move_dual(&mut self, block: &Block, y: &[f64], scratch: &mut Scratch) {
        self.work.fill(0.0);
        block.apply(y, &mut self.work, &mut self.operator);
        if self.diagonal {
            for i in 0..self.dz.len() {
                self.dz[i] += self.z[i] * self.work[i] * self.z[i];
            }
            return;
        }
        dense::multiply(self.n, &self.z, &self.work, &mut self.product, scratch);
        dense::multiply(self.n, &self.product, &self.z, &mut self.work, scratch);
        dense::symmetrize(self.n, &mut self.work);
        dense::axpy(1.0, &self.work, &mut self.dz);
    }

    /// The identity, in the block's storage.
    pub fn identity(&self) -> Vec<f64> {
        if self.diagonal {
            return vec![1.0; self.n];
        }
        let mut identity = vec![0.0; self.n * self.n];
        (0..self.n).for_each(|i| identity[i + i * self.n] = 1.0);
        identity
    }

    /// dZ ← F(y) − F(0), dS ← 0.
    pub fn propose_dual(&mut self, block: &Block, y: &[f64]) {
        self.ds.fill(0.0);
        self.dz.fill(0.0);
        block.apply(y, &mut self.dz, &mut self.operator);
    }

    /// Estimates of the longest steps that keep S and Z positive semidefinite.
    pub fn longest_steps(&self, lanczos: &mut Lanczos, accuracy: f64) -> (f64, f64) {
        if self.diagonal {
            let ratio = |value: &[f64], step: &[f64]| {
                let ends = value.iter().zip(step).filter(|(_, step)| **step < 0.0).map(|(v, d)| -v / d);
                ends.fold(f64::INFINITY, f64::min)
            };
            return (ratio(&self.s, &self.ds), ratio(&self.z, &self.dz));
        }
        let primal = lanczos.step(self.n, [&self.s, &self.s_inverse, &self.ds], accuracy);
        let dual = lanczos.step(self.n, [&self.z, &self.z_inverse, &self.dz], accuracy);
        (primal, dual)
    }

    /// ⟨S + α dS, Z + β dZ⟩.
    pub fn complementarity(&self, alpha: f64, beta: f64) -> f64 {
        let Self { s, z, ds, dz, .. } = self;
        dense::dot(s, z) + alpha * dense::dot(ds, z) + beta * dense::dot(s, dz) + alpha * beta * dense::dot(ds, dz)
    }

    /// Whether S + α dS is positive definite; its factor replaces that of S.
    pub fn try_primal(&mut self, alpha: f64, scratch: &mut Scratch) -> bool {
        for ((f, s), ds) in self.s_factor.iter_mut().zip(&self.s).zip(&self.ds) {
            *f = s + alpha * ds;
        }
        factorize(self.diagonal, self.n, &mut self.s_factor, scratch)
    }

    /// Whether Z + β dZ is positive definite; its factor replaces that of Z.
    pub fn try_dual(&mut self, beta: f64, scratch: &mut Scratch) -> bool {
        for ((f, z), dz) in self.z_factor.iter_mut().zip(&self.z).zip(&self.dz) {
            *f = z + beta * dz;
        }
        factorize(self.diagonal, self.n, &mut self.z_factor, scratch)
    }

    /// Takes the step whose factors `try_primal` and `try_dual` left behind.
    pub fn advance(&mut self, alpha: f64, beta: f64) {
        dense::axpy(alpha, &self.ds, &mut self.s);
        dense::axpy(beta, &self.dz, &mut self.z);
    }
}

fn factorize(diagonal: bool, n: usize, a: &mut [f64], scratch: &mut Scratch) -> bool {
    if diagonal {
        return a.iter().all(|a| *a > 0.0 && a.is_finite());
    }
    dense::cholesky(n, a, scratch)
}
