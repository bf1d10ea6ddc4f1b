//! What rounding leaves of a direction in the dual equations.

use super::{Iteration, nan_max, product, scale_by};
use crate::Options;
use crate::dense::{axpy, norm};

/// Rounds of refinement of one direction at most.
const REFINEMENTS: usize = 10;
/// Dual residual of a direction, against the tolerance, from which on Z + dZ is projected, and rounds of that.
const MISSED: f64 = 0.1;
const PROJECTIONS: usize = 4;

impl Iteration<'_> {
    /// Iterative refinement of the direction against the dual equations A(Z + dZ) = c themselves: close to the optimum S⁻¹ is
    /// large, and what rounding leaves of the equations in `sym(P F(dx) Z)` would otherwise add up in Z.
    /// Gives the dual residual at Z + dZ.
    pub(super) fn refine(&mut self) -> f64 {
        let Options { feasibility_tolerance, gap_tolerance, .. } = *self.options;
        let enough = (1e-3 * feasibility_tolerance).min(1e-2 * gap_tolerance);
        let mut last = f64::INFINITY;
        for _ in 0..REFINEMENTS {
            let size = self.miss();
            if size.is_nan() || size <= enough || size > 0.9 * last {
                return size;
            }
            last = size;
            self.right_side.iter_mut().for_each(|r| *r = -*r);
            self.schur.solve(&self.right_side, &mut self.change);
            // A correction larger than the direction itself is noise.
            if norm(&self.change) > norm(&self.dx) {
                return size;
            }
            axpy(1.0, &self.change, &mut self.dx);
            product(self.scale, &self.change, &mut self.unscaled);
            for (state, block) in self.blocks.iter_mut().zip(self.operators) {
                state.refine(block, &self.unscaled, &mut self.scratch);
            }
        }
        last
    }

    /// `right_side` ← c − A(Z + dZ); gives its relative size.
    fn miss(&mut self) -> f64 {
        self.right_side.fill(0.0);
        for (state, block) in self.blocks.iter_mut().zip(self.operators) {
            state.subtract_dual(block, &mut self.right_side);
        }
        scale_by(self.scale, &mut self.right_side);
        axpy(1.0, self.objective, &mut self.right_side);
        self.right_side.iter().fold(0.0, |m, r| nan_max(m, r.abs())) / (1.0 + self.objective_norm)
    }

    /// Moves Z + dZ towards A(Z) = c by Z F(y) Z, for a y from the equations with Z in place of S⁻¹: what rounding leaves of the direction
    /// in degenerate problems comes from the large S⁻¹, which has no part in this. Relative to Z the change is small. It takes the place of M.
    pub(super) fn project(&mut self, left: f64) {
        if left <= MISSED * self.options.feasibility_tolerance {
            return;
        }
        self.assemble(|state| [&state.z, &state.z]);
        if !self.schur.factorize(0.0) {
            return;
        }
        let mut last = left;
        for _ in 0..PROJECTIONS {
            self.miss();
            self.schur.solve(&self.right_side, &mut self.change);
            if !norm(&self.change).is_finite() {
                return;
            }
            product(self.scale, &self.change, &mut self.unscaled);
            self.move_dual();
            let size = self.miss();
            if size > last {
                self.unscaled.iter_mut().for_each(|y| *y = -*y);
                self.move_dual();
            }
            if size > 0.5 * last {
                return;
            }
            last = size;
        }
    }

    /// dZ ← dZ + Z F(y) Z for the y in `unscaled`.
    fn move_dual(&mut self) {
        for (state, block) in self.blocks.iter_mut().zip(self.operators) {
            state.move_dual(block, &self.unscaled, &mut self.scratch);
        }
    }
}
