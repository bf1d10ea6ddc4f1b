//! V decreases, with or without the cost, over the whole range of the parameter; and the largest rate of the parameter for which it does.
//!
//! Where inputs may saturate the condition by rows comes first (`rowwise.rs`). It is sufficient; where it does not prove, a few inputs are
//! tried by all mixtures of their rows. A mixture that fails in the middle of the place where the rows did spares that.

use super::cells::{Attempt, Cells, LEAST_HALF, LEAST_HALF_OF_SEARCH};
use super::closed_loop::{ByRows, ClosedLoop, Decrease};
use super::matrix::{CellMatrix, Definiteness};
use super::place::Place;
use super::rowwise::{ALL_HIGH, separable};
use super::sought::{RATE_RATIO, RATES};
use crate::math::Mat;
use crate::mutant;

/// κ and c of the claim κV̇ + c(xᵀQx + sᵀRs) < 0.
type Weights = [f64; 2];

/// The cells of the claims that V decreases, kept while they can be of use for the next.
pub(super) struct DecreaseProof<'a> {
    closed_loop: &'a ClosedLoop<'a>,
    /// R, or what bounds it row by row.
    r: Mat<f64>,
    by_rows: Option<(Weights, Cells<'a, ByRows>)>,
    by_mixtures: Option<Cells<'a, Decrease>>,
}

/// How a claim was proved.
pub(super) enum Found<'c, 'a> {
    ByRows(&'c Cells<'a, ByRows>),
    ByMixtures(Option<&'c Cells<'a, Decrease>>),
}

impl<'a> DecreaseProof<'a> {
    pub fn new(closed_loop: &'a ClosedLoop<'a>) -> Self {
        let r = separable(&closed_loop.weights.r, &closed_loop.saturating());
        Self { closed_loop, r, by_rows: None, by_mixtures: None }
    }

    /// Number of cells that the last claim took.
    pub fn cells(&self) -> usize {
        match (&self.by_mixtures, &self.by_rows) {
            (Some(cells), _) => cells.len(),
            (None, Some((_, cells))) => cells.len(),
            (None, None) => 0,
        }
    }

    /// For |ρ̇| ≤ `rate`.
    pub fn at(&mut self, rate: f64, weights: Weights) -> Attempt {
        let attempt = self.rows(LEAST_HALF, rate, weights);
        match self.is_left_to_mixtures(&attempt, rate, weights) {
            Ok(()) => self.mixtures(LEAST_HALF, rate, weights),
            Err(attempt) => attempt,
        }
    }

    /// The largest rate for which it is proved, by bisection; the attempt at rest where even that fails.
    pub fn largest_rate(&mut self, weights: Weights) -> (f64, Attempt) {
        let (rate, attempt) = largest_rate(|rate| self.rows(LEAST_HALF_OF_SEARCH, rate, weights));
        match self.is_left_to_mixtures(&attempt, rate, weights) {
            Ok(()) => largest_rate(|rate| self.mixtures(LEAST_HALF_OF_SEARCH, rate, weights)),
            Err(attempt) => (rate, attempt),
        }
    }

    /// The cells of the last claim, by rows or by mixtures, for a record.
    pub fn found(&self) -> Found<'_, 'a> {
        match (&self.by_mixtures, &self.by_rows) {
            (None, Some((_, cells))) => Found::ByRows(cells),
            (cells, _) => Found::ByMixtures(cells.as_ref()),
        }
    }

    /// By rows, where inputs may saturate. That this condition fails says nothing of the claim: it is open there.
    fn rows(&mut self, least: f64, rate: f64, weights: Weights) -> Attempt {
        let closed_loop = self.closed_loop;
        if closed_loop.saturating().is_empty() {
            return self.mixtures(least, rate, weights);
        }
        self.by_mixtures = None;
        if self.by_rows.as_ref().is_none_or(|(other, _)| *other != weights) {
            // the old ones go before new ones come
            self.by_rows = None;
            let r = self.r.clone();
            let enclose = move |place: &Place| closed_loop.by_rows(place, weights, &r);
            self.by_rows = Some((weights, Cells::new(closed_loop.pieces, 1, enclose)));
        }
        let (_, cells) = self.by_rows.as_mut().expect("they are there");
        let factor = weights[0];
        let attempt = cells.prove(least, &|cell: &ByRows, half| {
            let of_end = |end: f64| (end, cell.matrix(times(factor, end)).is_positive(half));
            ends(rate).into_iter().map(of_end).collect()
        });
        match attempt {
            Attempt::Refuted { place, .. } => Attempt::Open { place },
            other => other,
        }
    }

    /// By every mixture of rows; the only one where no input may saturate.
    fn mixtures(&mut self, least: f64, rate: f64, weights: Weights) -> Attempt {
        let closed_loop = self.closed_loop;
        let Some(count) = closed_loop.mixtures() else {
            return Attempt::Open { place: Place { piece: 0, variant: ALL_HIGH, middle: 0.5, half: 0.5 } };
        };
        self.by_rows = None;
        let cells = self
            .by_mixtures
            .get_or_insert_with(|| Cells::new(closed_loop.pieces, count, |place: &Place| closed_loop.decrease(place)));
        cells.prove(least, &|parts: &Decrease, half| decreases(parts, rate, weights, half))
    }

    /// Whether an attempt by rows leaves the claim to the mixtures; else what is known. A mixture that fails where the rows did is known.
    fn is_left_to_mixtures(&self, attempt: &Attempt, rate: f64, weights: Weights) -> Result<(), Attempt> {
        let Attempt::Open { place } = *attempt else { return Err(attempt.clone()) };
        let closed_loop = self.closed_loop;
        if closed_loop.saturating().is_empty() {
            return Err(attempt.clone());
        }
        let fails = |variant: usize| {
            let at = Place { variant, half: 0.0, ..place };
            let refuted = |(rate, definiteness): (f64, Definiteness)| match definiteness {
                Definiteness::Refuted { direction, value } => {
                    Some(Attempt::Refuted { place: Place { variant, ..place }, rate, direction, value })
                }
                _ => None,
            };
            decreases(&closed_loop.decrease(&at), rate, weights, 0.0).into_iter().find_map(refuted)
        };
        // K itself first: it is a motion
        let mixtures = std::iter::once(ALL_HIGH).chain(0..closed_loop.mixtures().unwrap_or(0));
        match (mixtures.into_iter().find_map(fails), closed_loop.mixtures()) {
            (Some(refuted), _) => Err(refuted),
            (None, None) => Err(attempt.clone()),
            (None, Some(_)) => Ok(()),
        }
    }
}

impl ByRows {
    fn matrix(&self, rate: f64) -> CellMatrix {
        CellMatrix::combination(&[(1.0, &self.still), (rate, &self.rate)])
    }
}

/// The claims are affine in the rate: its ends are enough.
fn ends(rate: f64) -> Vec<f64> {
    if rate == 0.0 || mutant::is("rate-dropped") {
        return vec![0.0];
    }
    if mutant::is("rate-one-end") {
        return vec![rate];
    }
    let rate = if mutant::is("rate-halved") { 0.5 * rate } else { rate };
    vec![-rate, rate]
}

/// κρ̇, away from zero: what holds for more holds for less.
fn times(factor: f64, rate: f64) -> f64 {
    match rate {
        0.0 => 0.0,
        rate if rate > 0.0 => (factor * rate).next_up(),
        rate => (factor * rate).next_down(),
    }
}

/// κ(constant ± r rate) + c cost ≻ 0.
fn decreases(parts: &Decrease, rate: f64, [factor, cost]: Weights, half: f64) -> Vec<(f64, Definiteness)> {
    let of_end = |end: f64| {
        let terms = [(factor, &parts.constant), (times(factor, end), &parts.rate), (cost, &parts.cost)];
        (end, CellMatrix::combination(&terms).is_positive(half))
    };
    ends(rate).into_iter().map(of_end).collect()
}

fn largest_rate(mut attempt: impl FnMut(f64) -> Attempt) -> (f64, Attempt) {
    let mut best = (0.0, attempt(0.0));
    if !matches!(best.1, Attempt::Proved(_)) {
        return best;
    }
    let [mut rate, most] = RATES;
    let mut fails = f64::INFINITY;
    while fails / best.0.max(RATES[0]) > RATE_RATIO && rate <= most {
        match attempt(rate) {
            proved @ Attempt::Proved(_) => best = (rate, proved),
            _ => fails = rate,
        }
        rate = match fails.is_finite() {
            true if best.0 == 0.0 => return best,
            true => (best.0 * fails).sqrt(),
            false => 8.0 * rate,
        };
    }
    best
}
