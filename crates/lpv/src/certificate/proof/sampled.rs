//! The sampled loop: u is held for T seconds between samples, the parameter is fixed.
//!
//! With Φ = Σ_{k≥0} (AT)ᵏ/(k + 1)!, x₊ = e^{AT}x − ∫₀ᵀ e^{As}ds BKx = (I + TE)x for E = Φ(A − BK), because e^{AT} = I + TΦA. For
//! any X ≻ 0, X − (I + TE)ᵀX(I + TE) = −T(EᵀX + XE + TEᵀXE): where −(EᵀX + XE + TEᵀXE) ≻ 0, every eigenvalue of I + TE is
//! inside the unit circle.
//!
//! X is found by numbers, in coordinates balanced by powers of two, as the solution of X − MᵀXM = TI in the middle of a cell, M = I + TE.
//! Over the cell it is X + (t − c)X′ with the derivative X′ of that solution, so that what is to be positive stays TI to second
//! order, however close to the circle the eigenvalues are. Where this does not do, `sampled_spectrum` decides at single parameters.

use super::cells::{Attempt, Cells, LEAST_HALF};
use super::closed_loop::ClosedLoop;
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix, middle as middle_of};
use super::place::Place;
use super::sampled_loop::{decrease, increment, scaling};
use super::sampled_spectrum::{Decision, decide};
use crate::certificate::claim::{Claim, ClaimKind, Verdict, Words};
use crate::math::Mat;
use crate::math::decimal::at_least;
use crate::math::eigen::spectral_radius;
use crate::math::interval::Interval;
use crate::math::matrix::{identity, symmetric_part};
use crate::math::stein;
use crate::math::taylor::Taylor;
use std::time::Instant;

/// X, and what has to be definite with it.
struct SampledCell {
    x: CellMatrix,
    decrease: CellMatrix,
    /// Numbers say that the loop is not stable in the middle.
    looks_unstable: bool,
}

/// The claim that the loop, sampled every `sample_time_s` seconds, is stable at every fixed value of the parameter.
pub(super) fn prove(closed_loop: &ClosedLoop, words: &Words, sample_time_s: f64) -> Claim {
    let started = Instant::now();
    let kind = ClaimKind::SampledStability { sample_time_s };
    let sample_time_s = if crate::mutant::is("sampled-time-halved") { 0.5 * sample_time_s } else { sample_time_s };
    let mut cells = Cells::new(closed_loop.pieces, 1, |place: &Place| cell(closed_loop, place, sample_time_s));
    let attempt = cells.prove(LEAST_HALF, &|cell: &SampledCell, half| {
        if cell.looks_unstable {
            return vec![(0.0, Definiteness::Refuted { direction: Vec::new(), value: f64::NAN })];
        }
        // that this X does not do says nothing of others
        let open = |definiteness| match definiteness {
            Definiteness::Refuted { .. } => Definiteness::Open { fits: 0.0 },
            other => other,
        };
        [&cell.x, &cell.decrease].map(|matrix| (0.0, open(matrix.is_positive(half)))).to_vec()
    });
    let decision = match &attempt {
        Attempt::Proved(_) => None,
        Attempt::Refuted { place, .. } | Attempt::Open { place } => Some(decide(closed_loop, place, sample_time_s)),
    };
    let claim = words.claim(kind, attempt, closed_loop, cells.len(), started);
    let claim = match decision {
        None => claim,
        Some(Decision::Stable { margin, bits }) => {
            let detail = format!(
                "every reflection coefficient of the characteristic polynomial is below 1 by {}, with {bits} bits",
                at_least(margin)
            );
            claim.decided(Verdict::Proved, margin, detail)
        }
        Some(Decision::Unstable { witness, reason }) => {
            let mut claim = claim.refuted_by(Some(witness));
            claim.detail = format!("{} ({reason})", claim.detail);
            claim
        }
        Some(Decision::Open { reason }) => {
            let place = claim.at.map_or(String::new(), |at| format!(" around parameter {at:.6}"));
            claim.decided(Verdict::Undecided, f64::NAN, format!("no proof was found{place}: {reason}"))
        }
    };
    Claim { seconds: started.elapsed().as_secs_f64(), ..claim }
}

fn cell(closed_loop: &ClosedLoop, place: &Place, sample_time_s: f64) -> SampledCell {
    let Place { piece, middle, half, .. } = *place;
    let n = closed_loop.weights.q.nrows();
    let scaling = scaling(closed_loop, middle, sample_time_s);
    let at_middle = Taylor::variable_of_first_order(Interval::point(middle));
    let e = increment(closed_loop, piece, at_middle, sample_time_s, &scaling);
    let Some([x, x_slope]) = lyapunov_matrices(&e, sample_time_s) else {
        let looks_unstable = spectral_radius(&(identity(n) + sample_time_s * middle_of(&e))) > 1.0;
        let nothing = CellMatrix::unbounded(n);
        return SampledCell { x: nothing.clone(), decrease: nothing, looks_unstable };
    };
    let around = Interval::new(-half, half);
    let over = Taylor::variable(Interval::new(middle - half, middle + half));
    let e_over = increment(closed_loop, piece, over, sample_time_s, &scaling);
    let x_of = |distance: Interval| {
        TaylorMatrix::from_fn(n, n, |i, j| Taylor {
            value: distance * x_slope[(i, j)] + x[(i, j)],
            slope: Interval::point(x_slope[(i, j)]),
            bend: Some(Interval::point(0.0)),
        })
    };
    let (x, x_over) = (x_of(Interval::point(0.0)), x_of(around));
    let decrease = CellMatrix::new(&decrease(&x, &e, sample_time_s), &decrease(&x_over, &e_over, sample_time_s));
    SampledCell { x: CellMatrix::new(&x, &x_over), decrease, looks_unstable: false }
}

/// X and X′, as numbers that are exactly symmetric, with X − MᵀXM = TI in the middle of a cell and no derivative of the left-hand side:
/// X′ − MᵀX′M = M′ᵀXM + MᵀXM′. `None` where M = I + TE is not stable.
fn lyapunov_matrices(e: &TaylorMatrix, sample_time_s: f64) -> Option<[Mat<f64>; 2]> {
    let n = e.shape().0;
    let increment = sample_time_s * middle_of(e);
    let x = stein::solve(&increment, &(sample_time_s * identity(n)))?;
    let slope = Mat::from_fn(n, n, |i, j| sample_time_s * e.at(i, j).slope.middle());
    let sampled = identity(n) + &increment;
    let half = slope.transpose() * &x * &sampled;
    let x_slope = stein::solve(&increment, &(2.0 * symmetric_part(&half))).unwrap_or_else(|| Mat::zeros(n, n));
    Some([x, x_slope])
}
