//! Certificates: multipliers that exclude every x, directions of x without end.

use super::{Iteration, Status, nan_max};
use crate::dense::{dot, norm};
use crate::direction::BlockState;
use crate::schur::Schur;
use faer::{Mat, Side};

/// Largest change of the blocks along a ray against that of the objective.
const RAY: f64 = 1e-8;
/// Most unknowns for which an eigendecomposition of the Gram matrix is taken.
const MOST_FOR_NULL_SPACE: usize = 500;

impl Iteration<'_> {
    /// How far the multipliers, scaled to a dual objective of 1 without the objective c, are from excluding every x.
    pub(super) fn witness_residual(&self, status: &Status) -> f64 {
        if self.feasible || status.dual_objective.is_nan() || status.dual_objective <= 0.0 {
            return f64::INFINITY;
        }
        let residual = self.az.iter().fold(0.0, |m: f64, a| nan_max(m, a.abs()));
        residual / status.dual_objective
    }

    /// A direction of x without end: x itself, grown large.
    pub(super) fn ray(&self, status: &Status) -> Option<Vec<f64>> {
        if status.objective.is_nan() || status.objective >= 0.0 || status.residuals.dual <= 1e-6 {
            return None;
        }
        let far = -status.objective;
        // F(x) − F(0) = S + R − C, and S is positive definite.
        let defect = self.blocks.iter().zip(&self.constant_norms).map(|(b, c)| (norm(&b.residual) + c) / far);
        (defect.fold(0.0, nan_max) <= RAY).then(|| self.x.iter().map(|x| x / far).collect())
    }

    /// Moves Z by the smallest F(y) that gives A(Z) = 0. True when it stays positive definite and its dual objective positive: Z is then an
    /// exact witness. Otherwise Z is as before.
    pub(super) fn complete_witness(&mut self) -> bool {
        if self.gram().is_none() {
            return false;
        }
        let Some(gram) = &mut self.gram else {
            return false;
        };
        gram.solve(&self.az, &mut self.change);
        self.change.iter_mut().for_each(|y| *y = -*y);
        super::product(self.scale, &self.change, &mut self.unscaled);
        let mut definite = true;
        for (state, block) in self.blocks.iter_mut().zip(self.operators) {
            state.propose_dual(block, &self.unscaled);
            definite = definite && state.try_dual(1.0, &mut self.scratch);
        }
        let objective = |state: &BlockState, c: &[f64], step: f64| -dot(c, &state.z) - step * dot(c, &state.dz);
        let total: f64 = self.blocks.iter().zip(self.operators).map(|(s, b)| objective(s, b.constant(), 1.0)).sum();
        let before: f64 = self.blocks.iter().zip(self.operators).map(|(s, b)| objective(s, b.constant(), 0.0)).sum();
        let done = definite && total > 0.5 * before;
        for state in &mut self.blocks {
            if done {
                state.advance(0.0, 1.0);
            } else {
                state.try_dual(0.0, &mut self.scratch);
            }
        }
        done
    }

    /// A direction d with F(d) = F(0) and cᵀd < 0, where the coefficient matrices are linearly dependent in a way that c is not: minus
    /// the projection of c on the null space of the Gram matrix.
    pub(super) fn ray_in_null_space(&mut self) -> Option<Vec<f64>> {
        let objective = self.objective;
        let n = objective.len();
        if n > MOST_FOR_NULL_SPACE {
            return None;
        }
        let gram = &self.gram()?.matrix;
        let gram = Mat::from_fn(n, n, |i, j| gram[i.max(j) + i.min(j) * n]);
        let eigen = gram.self_adjoint_eigen(Side::Lower).ok()?;
        let (values, vectors) = (eigen.S().column_vector(), eigen.U());
        let largest = values[n.checked_sub(1)?];
        let mut ray = vec![0.0; n];
        for k in (0..n).filter(|&k| values[k] <= 1e-12 * largest) {
            let share: f64 = (0..n).map(|i| vectors[(i, k)] * objective[i]).sum();
            (0..n).for_each(|i| ray[i] -= share * vectors[(i, k)]);
        }
        (norm(&ray) > 1e-6 * norm(objective)).then_some(ray)
    }

    /// The matrix of A(F(y)): entries ⟨F_i, F_j⟩.
    fn gram(&mut self) -> Option<&mut Schur> {
        if self.gram.is_none() {
            let unknowns = self.x.len();
            let mut gram = Schur::new(unknowns);
            for (index, (state, block)) in self.blocks.iter_mut().zip(self.operators).enumerate() {
                let identity = state.identity();
                let matrix = &mut gram.matrix;
                block.schur(index, [&identity; 2], &mut self.assembly, matrix, unknowns, &mut state.operator);
            }
            self.assembly.add(&mut gram.matrix, unknowns);
            gram.scale_by(self.scale);
            if !gram.factorize(0.0) {
                return None;
            }
            self.gram = Some(gram);
        }
        self.gram.as_mut()
    }
}
