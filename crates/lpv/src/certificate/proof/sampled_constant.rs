//! The sampled loop with one matrix X for all of a cell, which a record can hold: with −(EᵀX + XE + TEᵀXE) ≻ 0 and X ≻ 0 every
//! eigenvalue of I + TE is inside the unit circle. Simpler to check than what `sampled` does, and not as sharp.

use super::cells::{Attempt, Cells, LEAST_HALF};
use super::closed_loop::ClosedLoop;
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix};
use super::place::Place;
use super::sampled_loop::{decrease, increment};
use crate::math::Mat;
use crate::math::hold::discretize;
use crate::math::interval::Interval;
use crate::math::lyapunov;
use crate::math::matrix::{identity, inverse};
use crate::math::taylor::Taylor;
use crate::model::linearize;

/// X, and what has to be definite with it.
pub(super) struct SampledCell {
    pub x: CellMatrix,
    decrease: CellMatrix,
}

/// The cells with their X, and what they prove.
pub(super) fn prove_cells<'a>(
    closed_loop: &'a ClosedLoop<'a>,
    sample_time_s: f64,
) -> (Cells<'a, SampledCell>, Attempt) {
    let mut cells = Cells::new(closed_loop.pieces, 1, move |place: &Place| cell(closed_loop, place, sample_time_s));
    let attempt = cells.prove(LEAST_HALF, &|cell: &SampledCell, half| {
        // that this X does not do says nothing of others
        let open = |definiteness| match definiteness {
            Definiteness::Refuted { .. } => Definiteness::Open { fits: 0.0 },
            other => other,
        };
        [&cell.x, &cell.decrease].map(|matrix| (0.0, open(matrix.is_positive(half)))).to_vec()
    });
    (cells, attempt)
}

fn cell(closed_loop: &ClosedLoop, place: &Place, sample_time_s: f64) -> SampledCell {
    let Place { piece, middle, half, .. } = *place;
    let n = closed_loop.weights.q.nrows();
    let Some(x) = lyapunov_matrix(closed_loop, middle, sample_time_s) else {
        return SampledCell { x: CellMatrix::unbounded(n), decrease: CellMatrix::unbounded(n) };
    };
    let x = TaylorMatrix::constant(&x);
    let over = Taylor::variable(Interval::new(middle - half, middle + half));
    let at_middle = Taylor::variable_of_first_order(Interval::point(middle));
    let unscaled = vec![0; n];
    let [middle, over] = [at_middle, over]
        .map(|t| decrease(&x, &increment(closed_loop, piece, t, sample_time_s, &unscaled), sample_time_s));
    SampledCell { x: CellMatrix::new(&x, &x), decrease: CellMatrix::new(&middle, &over) }
}

/// X of the sampled loop in the middle of a cell, as numbers: FᵀX + XF + Q = 0 for the Cayley transform F of x₊ = A_c x.
fn lyapunov_matrix(closed_loop: &ClosedLoop, t: f64, sample_time_s: f64) -> Option<Mat<f64>> {
    let model = linearize(closed_loop.plant, closed_loop.parameter(t));
    let k = closed_loop.gain(t);
    let (a, b) = discretize(&model.a, &model.b, sample_time_s);
    let sampled = a - b * k;
    let one = identity(sampled.nrows());
    let cayley = (2.0 / sample_time_s) * ((&sampled - &one) * inverse(&(&sampled + &one)));
    let x = lyapunov::solve(&cayley, &closed_loop.weights.q)?;
    // one that is exactly symmetric
    Some(Mat::from_fn(x.nrows(), x.ncols(), |i, j| if i <= j { x[(i, j)] } else { x[(j, i)] }))
}
