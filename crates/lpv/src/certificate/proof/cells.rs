//! A claim proved on cells that cover the range of the parameter, wide where they can be and narrow where they must.

use super::matrix::Definiteness;
use super::place::Place;
use crate::mutant;
use rayon::prelude::*;

/// Half-widths of cells, in pieces, below which no narrower one is tried: for a claim that is asked for, and while the
/// largest rate is sought.
pub(super) const LEAST_HALF: f64 = 1.0 / 2048.0;
pub(super) const LEAST_HALF_OF_SEARCH: f64 = 1.0 / 1024.0;
/// By how much the next attempt is narrower at most, and how much of the width is taken that a wider cell lets expect.
const MOST_SHRINKAGE: f64 = 8.0;
const FEWER: f64 = 0.95;
/// What the rows of the next cell are to sum to, 1 being too much, and by how much it is wider at most.
const AIM: f64 = 0.8;
const MOST_GROWTH: f64 = 2.0;
/// Cells reach over their ends by this, in pieces: far more than the rounding of their ends, which lie below 2^14.
const OVERLAP: f64 = 1e-10;

/// A cell of the range of the parameter.
pub(super) struct Cell<M> {
    pub place: Place,
    pub matrix: M,
}

/// How a matrix is enclosed on a place.
type Enclose<'a, M> = Box<dyn Fn(&Place) -> M + Sync + 'a>;

/// What is known of a cell's claims from its matrix and half-width, each with the rate that it is for.
type Judgement<'j, M> = dyn Fn(&M, f64) -> Vec<(f64, Definiteness)> + Sync + 'j;

/// Cells of every piece and of every variant of a claim (mixtures, inputs), refined as far as a claim ever needed.
pub(super) struct Cells<'a, M> {
    pub groups: Vec<Vec<Cell<M>>>,
    enclose: Enclose<'a, M>,
}

/// How an attempt to prove a claim on all cells ended.
#[derive(Clone, Debug)]
pub(super) enum Attempt {
    /// With the least margin.
    Proved(f64),
    /// The matrix is not definite in the middle of this place, for this rate.
    Refuted { place: Place, rate: f64, direction: Vec<f64>, value: f64 },
    /// Here.
    Open { place: Place },
}

/// The worse of two.
fn worse(a: Attempt, b: Attempt) -> Attempt {
    match (&a, &b) {
        (Attempt::Refuted { .. }, _) => a,
        (_, Attempt::Refuted { .. }) => b,
        (Attempt::Open { .. }, _) => a,
        (_, Attempt::Open { .. }) => b,
        (Attempt::Proved(x), Attempt::Proved(y)) => Attempt::Proved(x.min(*y)),
    }
}

impl<'a, M: Send + Sync> Cells<'a, M> {
    pub fn new(pieces: usize, variants: usize, enclose: impl Fn(&Place) -> M + Sync + 'a) -> Self {
        let pieces = if mutant::is("last-piece-skipped") && pieces > 1 { pieces - 1 } else { pieces };
        let groups: Vec<(usize, usize)> =
            (0..pieces).flat_map(|piece| (0..variants).map(move |v| (piece, v))).collect();
        let first = |&(piece, variant): &(usize, usize)| {
            let place = Place { piece, variant, middle: piece as f64 + 0.5, half: 0.5 };
            vec![Cell { place, matrix: enclose(&place) }]
        };
        Self { groups: groups.par_iter().map(first).collect(), enclose: Box::new(enclose) }
    }

    pub fn len(&self) -> usize {
        self.groups.iter().map(Vec::len).sum()
    }

    /// Prove `claims` of every cell, with cells of half-width at least `least`.
    pub fn prove(&mut self, least: f64, claims: &Judgement<M>) -> Attempt {
        let of_group = |cells: &mut Vec<Cell<M>>| prove_group(cells, &self.enclose, least, claims);
        self.groups.par_iter_mut().map(of_group).reduce(|| Attempt::Proved(f64::INFINITY), worse)
    }
}

/// Prove `claims` of the cells of one group, from left to right. One that is open makes way for smaller ones, which follow each other
/// like the steps of an integrator: each as wide as the margin of the one before lets expect.
fn prove_group<M>(cells: &mut Vec<Cell<M>>, enclose: &Enclose<M>, least: f64, claims: &Judgement<M>) -> Attempt {
    let mut margin = f64::INFINITY;
    let mut known = std::mem::take(cells).into_iter();
    while let Some(cell) = known.next() {
        let outcome = match judge(claims, &cell) {
            Judged::Proved(found) => {
                margin = margin.min(found);
                cells.push(cell);
                continue;
            }
            Judged::Refuted(refuted) => {
                cells.push(cell);
                Some(refuted)
            }
            Judged::Open { fits } => match step_through(cell, fits, enclose, least, claims, cells) {
                Attempt::Proved(found) => {
                    margin = margin.min(found);
                    None
                }
                other => Some(other),
            },
        };
        if let Some(outcome) = outcome {
            cells.extend(known);
            return outcome;
        }
    }
    Attempt::Proved(margin)
}

/// Prove `claims` on the place of a cell by cells that are narrower, the first of half-width `fits`; they are added to `done`, and where they
/// do not come to the end, a cell for what is left.
fn step_through<M>(
    cell: Cell<M>,
    fits: f64,
    enclose: &Enclose<M>,
    least: f64,
    claims: &Judgement<M>,
    done: &mut Vec<Cell<M>>,
) -> Attempt {
    let whole = cell.place;
    let (begin, to) = (whole.middle - whole.half, whole.middle + whole.half);
    let (mut from, mut margin) = (begin, f64::INFINITY);
    // a little wider than its share, so that rounding leaves no gap
    let new = |from: f64, share: f64| {
        let place = Place { middle: from + share, half: share + OVERLAP, ..whole };
        Cell { place, matrix: enclose(&place) }
    };
    // not below `least` before that was tried
    let narrower = |half: f64, fits: f64| {
        let next = (FEWER * fits).min(0.5 * half).max(half / MOST_SHRINKAGE);
        if half > 1.001 * least { next.max(least) } else { next }
    };
    let mut half = narrower(whole.half, fits);
    // what is left may be no more than the overlap
    while to - from > if mutant::is("last-cell-skipped") { 1.5 * half } else { OVERLAP } {
        let judged = if half < least {
            Err(Attempt::Open { place: Place { middle: from, half, ..whole } })
        } else {
            let share = 0.5 * (to - from) / (0.5 * (to - from) / half).ceil();
            let next = new(from, share);
            match judge(claims, &next) {
                Judged::Proved(found) => {
                    margin = margin.min(found);
                    half = share * (AIM / (1.0 - found)).sqrt().clamp(1.0, MOST_GROWTH);
                    from += 2.0 * share;
                    done.push(next);
                    Ok(())
                }
                Judged::Open { fits } => {
                    half = narrower(share, fits);
                    Ok(())
                }
                Judged::Refuted(refuted) => Err(refuted),
            }
        };
        if let Err(outcome) = judged {
            done.push(if from == begin { cell } else { new(from, 0.5 * (to - from)) });
            return outcome;
        }
    }
    Attempt::Proved(margin)
}

/// What all claims together say of one cell.
enum Judged {
    Proved(f64),
    Refuted(Attempt),
    /// The widest half-width that might do.
    Open {
        fits: f64,
    },
}

fn judge<M>(claims: &Judgement<M>, cell: &Cell<M>) -> Judged {
    let (mut margin, mut open) = (f64::INFINITY, None::<f64>);
    for (rate, definiteness) in claims(&cell.matrix, cell.place.half) {
        match definiteness {
            Definiteness::Proved(found) => margin = margin.min(found),
            Definiteness::Refuted { direction, value } => {
                return Judged::Refuted(Attempt::Refuted { place: cell.place, rate, direction, value });
            }
            Definiteness::Open { fits } => open = Some(open.map_or(fits, |other| other.min(fits))),
        }
    }
    open.map_or(Judged::Proved(margin), |fits| Judged::Open { fits })
}
