//! The bounded-real inequality over the whole range of its parameter, between grid points too.

use super::cells::{Attempt, Cells, LEAST_HALF};
use super::matrix::{CellMatrix, TaylorMatrix};
use super::place::Place;
use crate::certificate::claim::{Claim, ClaimKind, Motion, Of, Verdict, Words};
use crate::math::decimal::{about, at_least};
use crate::math::interval::Interval;
use crate::math::taylor::Taylor;
use crate::model::MatrixFunction;
use crate::synthesis::bounded_real::{GainBound, InputOutputModel};
use std::time::Instant;

/// Pieces that the range is cut into at first.
const PIECES: usize = 16;
/// γ of the grid times the least of these for which it can be proved is claimed: between grid points a little is lost.
const FACTORS: [f64; 8] = [1.0, 1.000_001, 1.0001, 1.001, 1.003, 1.01, 1.03, 1.1];

/// Parts of the inequality on a cell: constant + ρ̇ rate + γ size ≻ 0, and P.
struct GainCell {
    constant: CellMatrix,
    rate: CellMatrix,
    size: CellMatrix,
    p: CellMatrix,
}

/// Prove ‖z‖₂ ≤ γ‖w‖₂ for every motion of the parameter in its range with the bound's rate, for the least γ of a few just
/// above that of the grid.
pub fn prove_gain(model: &InputOutputModel, bound: &GainBound) -> Claim {
    let started = Instant::now();
    let [low, high] = model.range;
    let step = (Interval::point(high) - low) / PIECES as f64;
    let enclose = |place: &Place| {
        let Place { middle, half, .. } = *place;
        let parts = |t: Taylor| parts(model, &bound.p, t * Taylor::constant(step) + low);
        let over = parts(Taylor::variable(Interval::new(middle - half, middle + half)));
        let at_middle = parts(Taylor::variable_of_first_order(Interval::point(middle)));
        let cell = |k: usize| CellMatrix::new(&at_middle[k], &over[k]);
        GainCell { constant: cell(0), rate: cell(1), size: cell(2), p: cell(3) }
    };
    let mut cells = Cells::new(PIECES, 1, enclose);
    let rates = match bound.rate {
        Some(rate) if rate > 0.0 && !crate::mutant::is("gain-rate-dropped") => vec![-rate, rate],
        _ => vec![0.0],
    };
    let mut first = None;
    for factor in FACTORS {
        let gain = factor * bound.gain;
        let attempt = cells.prove(LEAST_HALF, &|cell: &GainCell, half| {
            let of_rate = |&rate: &f64| {
                let terms = [(1.0, &cell.constant), (rate, &cell.rate), (gain, &cell.size)];
                (rate, CellMatrix::combination(&terms).is_positive(half))
            };
            std::iter::once((0.0, cell.p.is_positive(half))).chain(rates.iter().map(of_rate)).collect()
        });
        let proved = matches!(attempt, Attempt::Proved(_));
        if proved || first.is_none() {
            first = Some((gain, attempt));
        }
        if proved {
            break;
        }
    }
    let (gain, attempt) =
        first.unwrap_or((bound.gain, Attempt::Open { place: Place { piece: 0, variant: 0, middle: 0.0, half: 1.0 } }));
    let motion = bound.rate.map_or(Motion::Any, |rate| Motion::Bounded { rate });
    let parameter = |place: &Place| low + place.middle * step.middle();
    let gain = if crate::mutant::is("gain-lowered") { bound.gain } else { gain };
    let mut claim = Claim::new(ClaimKind::InducedGain { gain, motion }, Of::Model, &Words::default());
    match attempt {
        Attempt::Proved(margin) => {
            (claim.verdict, claim.margin) = (Verdict::Proved, margin);
            claim.detail = format!("relative margin {}, {} cells", at_least(margin), cells.len());
        }
        // another P may do
        Attempt::Refuted { place, rate, value, .. } => {
            (claim.margin, claim.at) = (value, Some(parameter(&place)));
            let place = about(parameter(&place));
            claim.detail = format!("this P does not show it at parameter {place} with rate {}", about(rate));
        }
        Attempt::Open { place } => {
            claim.at = Some(parameter(&place));
            claim.detail = format!("open at parameter {}", about(parameter(&place)));
        }
    }
    claim.cells = cells.len();
    claim.seconds = started.elapsed().as_secs_f64();
    claim
}

/// The constant part, what ρ̇ multiplies, what γ multiplies, and P.
fn parts(model: &InputOutputModel, p: &MatrixFunction, rho: Taylor) -> [TaylorMatrix; 4] {
    let [a, b, c, d] =
        [&model.a, &model.b, &model.c, &model.d].map(|function| TaylorMatrix::of_function(function, rho));
    let [value, slope] = TaylorMatrix::of_function_and_derivative(p, rho);
    let ((n, m), outputs) = (model.b.shape(), model.c.shape().0);
    let flow = value.times(&a);
    let (flow, pb) = (flow.plus(&flow.transpose()), value.times(&b));
    let zero = Taylor::from(0.0);
    let size = n + m + outputs;
    // blocks of x, w and z
    let constant = TaylorMatrix::from_fn(size, size, |i, j| match (i.min(j), i.max(j)) {
        (i, j) if j < n => -flow.at(i, j),
        (i, j) if i < n && j < n + m => -pb.at(i, j - n),
        (i, j) if i < n => -c.at(j - n - m, i),
        (i, j) if i < n + m && j >= n + m => -d.at(j - n - m, i - n),
        _ => zero,
    });
    let rate = TaylorMatrix::from_fn(size, size, |i, j| if i < n && j < n { -slope.at(i, j) } else { zero });
    let one = TaylorMatrix::from_fn(size, size, |i, j| if i == j && i >= n { Taylor::from(1.0) } else { zero });
    [constant, rate, one, value]
}
