//! The sampled loop: u is held for T seconds between samples, the parameter is fixed.
//!
//! With Φ = Σ_{k≥0} (AT)ᵏ/(k + 1)!, x₊ = e^{AT}x − ∫₀ᵀ e^{As}ds BKx = (I + TE)x for E = Φ(A − BK), because e^{AT} = I + TΦA. For
//! any X ≻ 0, X − (I + TE)ᵀX(I + TE) = −T(EᵀX + XE + TEᵀXE): where −(EᵀX + XE + TEᵀXE) ≻ 0, every eigenvalue of I + TE is
//! inside the unit circle. X is found by numbers in the middle of a cell and serves all of the cell; the series is cut off
//! with a bound on what is left out, and on its derivatives.

use super::closed_loop::{ClosedLoop, Place};
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix};
use super::{Attempt, Cells, LEAST_HALF};
use crate::certificate::claim::{Claim, ClaimKind, Words};
use crate::math::Mat;
use crate::math::hold::discretize;
use crate::math::interval::Interval;
use crate::math::lyapunov;
use crate::math::matrix::{identity, inverse};
use crate::math::taylor::Taylor;
use crate::model::linearize;
use std::time::Instant;

/// Terms of the series after which the rest is bounded; it is if ‖AT‖ is at most half of this.
const TERMS: usize = 20;

/// X, and what has to be definite with it.
pub(super) struct SampledCell {
    pub x: CellMatrix,
    decrease: CellMatrix,
}

/// The claim that the loop, sampled every `sample_time_s` seconds, is stable at every fixed value of the parameter.
pub(super) fn prove(closed_loop: &ClosedLoop, words: &Words, sample_time_s: f64) -> Claim {
    let started = Instant::now();
    let (cells, attempt) = prove_cells(closed_loop, sample_time_s);
    let kind = ClaimKind::SampledStability { sample_time_s };
    let mut claim = words.claim(kind, attempt.clone(), closed_loop, cells.len(), started);
    if let Attempt::Open { place } = attempt {
        claim.detail = format!("no proof was found around parameter {:.6}", closed_loop.parameter(place.middle));
    }
    claim
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
    let [middle, over] = [at_middle, over].map(|t| {
        let e = increment(closed_loop, piece, t, sample_time_s);
        let xe = x.times(&e);
        let second = e.transpose().times(&xe);
        let second = TaylorMatrix::from_fn(n, n, |i, j| second.at(i, j) * sample_time_s);
        xe.plus(&xe.transpose()).plus(&second).negated()
    });
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

/// E = Φ(A − BK) as a function of `t`.
fn increment(closed_loop: &ClosedLoop, piece: usize, t: Taylor, sample_time_s: f64) -> TaylorMatrix {
    let (a, b, gain) = closed_loop.model_and_gain(piece, t);
    let n = closed_loop.weights.q.nrows();
    let at = TaylorMatrix::from_fn(n, n, |i, j| a.at(i, j) * sample_time_s);
    let mut power = TaylorMatrix::constant(&identity(n));
    let mut series = power.clone();
    for k in 1..=TERMS {
        power = power.times(&at);
        power = TaylorMatrix::from_fn(n, n, |i, j| power.at(i, j) / (k + 1) as f64);
        // of a nilpotent A the series ends
        if (0..n * n).all(|entry| power.at(entry / n, entry % n).is_zero()) {
            return series.times(&a.minus(&b.times(&gain)));
        }
        series = series.plus(&power);
    }
    let rest = rest(&at, n);
    series = TaylorMatrix::from_fn(n, n, |i, j| series.at(i, j) + rest);
    series.times(&a.minus(&b.times(&gain)))
}

/// A bound on every entry of Σ_{k>N} (AT)ᵏ/(k + 1)!, N = [`TERMS`], and on its first two derivatives. With μ, μ′, μ″ the row-sum
/// norms of AT and of its derivatives, and sums that fall at least by halves for μ ≤ N/2, they are at most
/// 2μᴺ⁺¹/(N + 2)!, 2μ′μᴺ/(N + 1)! and 2μ′²μᴺ⁻¹/N! + 2μ″μᴺ/(N + 1)!.
fn rest(at: &TaylorMatrix, n: usize) -> Taylor {
    let norm = |of: &dyn Fn(Taylor) -> Interval| {
        let row = |i: usize| (0..n).fold(Interval::point(0.0), |sum, j| sum + of(at.at(i, j)).magnitude());
        Interval::point((0..n).map(|i| row(i).hi()).fold(0.0, f64::max))
    };
    let has_bend = at.at(0, 0).bend.is_some();
    let value = norm(&|entry| entry.value);
    let slope = norm(&|entry| entry.slope);
    let bend = norm(&|entry| entry.bend.unwrap_or(Interval::point(0.0)));
    if !(value.hi() <= 0.5 * TERMS as f64 && slope.hi().is_finite() && bend.hi().is_finite()) {
        let bend = has_bend.then_some(Interval::ENTIRE);
        return Taylor { value: Interval::ENTIRE, slope: Interval::ENTIRE, bend };
    }
    // 2 μᵏ/(k + ...)!
    let ratio = |power: usize, factorial: usize| {
        let powers = (0..power).fold(Interval::point(2.0), |product, _| product * value);
        (1..=factorial).fold(powers, |product, k| product / k as f64)
    };
    let around = |bound: Interval| Interval::new(-bound.hi(), bound.hi());
    Taylor {
        value: around(ratio(TERMS + 1, TERMS + 2)),
        slope: around(slope * ratio(TERMS, TERMS + 1)),
        bend: has_bend.then(|| around(slope.square() * ratio(TERMS - 1, TERMS) + bend * ratio(TERMS, TERMS + 1))),
    }
}
