//! The saturated loop with zero-order hold: {V ≤ γ} is invariant at every fixed parameter, at the samples and between them.
//!
//! After a sample at x the inputs are held, u = u* − v with vᵢ = sat(kᵢx), and a time τ ≤ T later
//!
//! ```text
//! x(τ) = e^{Aτ}x − ∫₀^τ e^{As}ds Bv = x + τ φ(τ)(Ax − Bv),   φ(τ) = Σ_{k≥0} (Aτ)ᵏ/(k + 1)!.
//! ```
//!
//! In {V ≤ γ} the row fᵢ of the low gain does not saturate, so that vᵢ lies between fᵢx and kᵢx. V(x(τ)) is convex in v, and largest at a
//! corner: v = Sx for a mixture S of rows of F and K (of a low gain there is one). V(x(τ)) < V(x) is −(EᵀP + PE + τEᵀPE) ≻ 0, E = φ(τ)(A − BS);
//! where it holds with T instead of the last τ, it holds all the more. By Schur, with H = PE, Λ = P, or H = EY, Λ = Y for
//! V = xᵀY⁻¹x,
//!
//! ```text
//! M(φ, S) = [−(H + Hᵀ), THᵀ; TH, TΛ] ≻ 0,
//! ```
//!
//! which is affine in φ and in S. So two things are to be covered:
//!
//! - **all τ = sT, 0 ≤ s ≤ 1**: with N = AT, φ = I + sN/2 + s²N²/6 + s³·rest is a convex combination (Bernstein's polynomials of degree 2)
//!   of I, I + N/4 and I + N/2 + N²/6, plus a rest that is enclosed. Three matrices do for all times between samples. Where they are not
//!   definite, φ(T) alone does for the times of the samples.
//! - **all mixtures**: from F to K row i adds sᵢ(uᵢwᵢᵀ + wᵢuᵢᵀ), 0 ≤ sᵢ ≤ 1, uᵢ = (kᵢ − fᵢ, 0), wᵢ = (ηᵢ, −Tηᵢ), ηᵢ = Pφbᵢ (with Y: uᵢ
//!   times Y and ηᵢ = φbᵢ). For any cᵢ > 0 it is at least −δᵢδᵢᵀ/(4cᵢ), δᵢ = cᵢuᵢ − 2wᵢ: s(uwᵀ + wuᵀ) + δδᵀ/(4c) is for s = 0 a square,
//!   for s = 1 the square (cu + 2w)(cu + 2w)ᵀ/(4c), and affine in between. One matrix, M(φ, F) − Σδᵢδᵢᵀ/(4cᵢ) ≻ 0, does for all 2ᵐ
//!   mixtures, with any cᵢ > 0, and so with other cᵢ on each cell: they are taken from its middle by `rowwise::multipliers`, the same for
//!   every φ. Where that fails even in the middle, the mixtures are taken one by one.
//!
//! None of this depends on the level: it is the one up to which F does not saturate.

use super::cells::{Attempt, Cells, LEAST_HALF};
use super::closed_loop::{ClosedLoop, Form};
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix, middle as middle_of};
use super::place::Place;
use super::rowwise::{Balanced, Rows, multipliers, shares};
use super::sampled_loop::{hold, rest};
use super::sampled_witness::leaves_when_sampled;
use crate::certificate::claim::{Claim, ClaimKind, Verdict, Words};
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::matrix::{identity, symmetric_part};
use crate::math::taylor::Taylor;
use std::time::Instant;

/// Terms of φ that are summed before the rest is bounded.
const TERMS: usize = 8;
/// Inputs that may saturate, up to which mixtures are taken one by one.
const MOST_MIXED: usize = 6;

/// At which times V is not larger than at the sample before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Times {
    /// At all.
    All,
    /// At the next sample.
    Samples,
}

/// M(φ, F) and what each input that may saturate adds to it, for one φ.
struct Condition {
    matrix: TaylorMatrix,
    /// −2wᵢ and uᵢ, 2n each: δᵢ = cᵢuᵢ − 2wᵢ.
    rows: Rows,
}

/// What is known of a cell: not its matrices, which are large.
pub(super) struct SaturatedCell {
    /// Of each φ, or of each mixture of one.
    known: Vec<Definiteness>,
    /// cᵢ; `None` where mixtures were taken one by one. For a record.
    pub multipliers: Option<Vec<f64>>,
}

/// The claim that the saturated, sampled loop keeps {V ≤ γ} invariant. Where it is not proved, or rests on what is not (`is_founded`), a
/// state that leaves the set is looked for.
pub(super) fn prove(
    closed_loop: &ClosedLoop,
    words: &Words,
    level: f64,
    sample_time_s: f64,
    is_founded: bool,
) -> Claim {
    let started = Instant::now();
    let kind = ClaimKind::SampledInvariance { level, sample_time_s };
    let premises = ["lyapunov-definite", "unsaturated"];
    if !(sample_time_s.is_finite() && sample_time_s > 0.0) {
        let claim = words.claim(kind, Attempt::Proved(f64::NAN), closed_loop, 0, started).resting_on(&premises);
        return claim.decided(Verdict::Undecided, f64::NAN, "the sample time is not positive");
    }
    let attempt = |times: Times| {
        let (cells, attempt) = prove_cells(closed_loop, sample_time_s, times);
        (times, attempt, cells.len())
    };
    let all = attempt(Times::All);
    let (times, attempt, cells) = if matches!(all.1, Attempt::Proved(_)) { all } else { attempt(Times::Samples) };
    let witness = match &attempt {
        Attempt::Proved(_) if is_founded => None,
        Attempt::Proved(_) => leaves_when_sampled(closed_loop, None, level, sample_time_s),
        Attempt::Refuted { place, .. } | Attempt::Open { place } => {
            leaves_when_sampled(closed_loop, Some(*place), level, sample_time_s)
        }
    };
    let mut claim = words.claim(kind, attempt, closed_loop, cells, started).resting_on(&premises).refuted_by(witness);
    if claim.verdict == Verdict::Proved {
        let when = match times {
            Times::All => "at the samples and between them",
            Times::Samples => "at the times of the samples alone",
        };
        claim.detail = format!("{when}, {}", claim.detail);
    }
    claim
}

/// The cells, and what they prove.
pub(super) fn prove_cells<'a>(
    closed_loop: &'a ClosedLoop<'a>,
    sample_time_s: f64,
    times: Times,
) -> (Cells<'a, SaturatedCell>, Attempt) {
    let enclose = move |place: &Place| cell(closed_loop, place, sample_time_s, times);
    let mut cells = Cells::new(closed_loop.pieces, 1, enclose);
    let attempt = cells.prove(LEAST_HALF, &|cell: &SaturatedCell, _| {
        cell.known.iter().map(|definiteness| (0.0, definiteness.clone())).collect()
    });
    (cells, attempt)
}

/// What is known of a matrix; that one fails refutes nothing, neither a mixture nor what stands for all.
fn known(matrix: &CellMatrix, half: f64) -> Definiteness {
    match matrix.is_positive(half) {
        Definiteness::Refuted { .. } => Definiteness::Open { fits: 0.0 },
        other => other,
    }
}

/// Whether all matrices are definite on the cell, for each φ and for all mixtures at once; where that fails even in the middle, for each
/// mixture.
fn cell(closed_loop: &ClosedLoop, place: &Place, sample_time_s: f64, times: Times) -> SaturatedCell {
    let Place { piece, middle, half, .. } = *place;
    let at_middle = Taylor::variable_of_first_order(Interval::point(middle));
    let over = Taylor::variable(Interval::new(middle - half, middle + half));
    let [middle, over] = [at_middle, over].map(|t| conditions(closed_loop, piece, t, sample_time_s, times));
    let multipliers = multipliers(&middle.iter().map(Condition::balanced).collect::<Vec<Balanced>>());
    // an input is left out for a whole cell or not at all: both forms have to be of one function
    let moving = over.iter().map(|over| over.rows.moving());
    let by_rows = |((middle, over), moving): ((&Condition, &Condition), Vec<bool>)| {
        let [middle, over] = [middle, over].map(|condition| condition.for_all_mixtures(&multipliers, &moving));
        known(&CellMatrix::new(&middle, &over), half)
    };
    let by_rows: Vec<Definiteness> = middle.iter().zip(&over).zip(moving).map(by_rows).collect();
    let count = multipliers.len();
    let fails = |known: &Definiteness| matches!(known, Definiteness::Open { fits } if *fits == 0.0);
    if !by_rows.iter().any(fails) || !(1..=MOST_MIXED).contains(&count) {
        return SaturatedCell { known: by_rows, multipliers: Some(multipliers) };
    }
    let pairs = middle.iter().zip(&over).flat_map(|pair| (0..1 << count).map(move |bits| (pair, bits)));
    let of_mixture = |((middle, over), bits): ((&Condition, &Condition), usize)| {
        known(&CellMatrix::new(&middle.of_mixture(bits), &over.of_mixture(bits)), half)
    };
    SaturatedCell { known: pairs.map(of_mixture).collect(), multipliers: None }
}

/// A condition for each φ.
fn conditions(closed_loop: &ClosedLoop, piece: usize, t: Taylor, sample_time_s: f64, times: Times) -> Vec<Condition> {
    let (a, b, k) = closed_loop.model_and_gain(piece, t);
    let lyapunov = closed_loop.lyapunov(t);
    let [low, high] = closed_loop.gains(k, 0, t);
    let saturating = if crate::mutant::is("sampled-low-only") { Vec::new() } else { closed_loop.saturating() };
    // P from the left, or Y from the right
    let (left, flow) = match closed_loop.form {
        Form::Direct(_) => (Some(&lyapunov), a.minus(&b.times(&low))),
        Form::Inverse(_) => (None, a.times(&lyapunov).minus(&b.times(&low))),
    };
    let held = match times {
        Times::All => held_over(&a.scaled(sample_time_s)),
        Times::Samples => vec![hold(&a, sample_time_s)],
    };
    let of = |phi: &TaylorMatrix| {
        let from_left = |matrix: &TaylorMatrix| {
            let product = phi.times(matrix);
            left.map_or_else(|| product.clone(), |p| p.times(&product))
        };
        let (h, eta) = (from_left(&flow), from_left(&b));
        let n = h.shape().0;
        let difference = |row: usize, j: usize| match j < n {
            true => high.at(saturating[row], j) - low.at(saturating[row], j),
            false => Taylor::from(0.0),
        };
        let gradient = |row: usize, j: usize| match j < n {
            true => eta.at(j, saturating[row]) * -2.0,
            false => eta.at(j - n, saturating[row]) * sample_time_s * 2.0,
        };
        Condition {
            matrix: block(&h, &lyapunov, sample_time_s),
            rows: Rows {
                gradient: TaylorMatrix::from_fn(saturating.len(), 2 * n, gradient),
                difference: TaylorMatrix::from_fn(saturating.len(), 2 * n, difference),
            },
        }
    };
    held.iter().map(of).collect()
}

/// [−(H + Hᵀ), THᵀ; TH, TΛ]
fn block(h: &TaylorMatrix, lyapunov: &TaylorMatrix, sample_time_s: f64) -> TaylorMatrix {
    let n = h.shape().0;
    TaylorMatrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => -(h.at(i, j) + h.at(j, i)),
        (true, false) => h.at(j - n, i) * sample_time_s,
        (false, true) => h.at(i - n, j) * sample_time_s,
        (false, false) => lyapunov.at(i - n, j - n) * sample_time_s,
    })
}

/// I, I + N/4 and I + N/2 + N²/6, each with the rest s³ Σ_{k≥3} sᵏ⁻³Nᵏ/(k + 1)! of all s from 0 to 1.
fn held_over(x: &TaylorMatrix) -> Vec<TaylorMatrix> {
    let n = x.shape().0;
    let one = TaylorMatrix::constant(&identity(n));
    let square = x.times(x);
    let of_zero_to_one = |f: Taylor| {
        let share = Interval::new(0.0, 1.0);
        Taylor { value: share * f.value, slope: share * f.slope, bend: f.bend.map(|bend| share * bend) }
    };
    let mut power = square.scaled(1.0 / 2.0);
    power = TaylorMatrix::from_fn(n, n, |i, j| power.at(i, j) / 3.0);
    let quadratic = power.clone();
    let mut tail = TaylorMatrix::constant(&Mat::zeros(n, n));
    for k in 3..=TERMS {
        let product = power.times(x);
        power = TaylorMatrix::from_fn(n, n, |i, j| product.at(i, j) / (k + 1) as f64);
        tail = TaylorMatrix::from_fn(n, n, |i, j| tail.at(i, j) + of_zero_to_one(power.at(i, j)));
    }
    // a nilpotent A has none
    let is_over = (0..n * n).all(|at| power.at(at / n, at % n).is_zero());
    if !is_over {
        // around zero, and with it all of its multiples by less than one
        let rest = rest(x, TERMS);
        tail = TaylorMatrix::from_fn(n, n, |i, j| tail.at(i, j) + rest);
    }
    let early = one.plus(&x.scaled(0.25));
    let late = one.plus(&x.scaled(0.5)).plus(&quadratic);
    [one, early, late].iter().map(|phi| phi.plus(&tail)).collect()
}

impl Condition {
    /// The values in the middle of a cell, as numbers.
    fn balanced(&self) -> Balanced {
        let [gradient, difference] = self.rows.middle();
        Balanced { base: symmetric_part(&middle_of(&self.matrix)), gradient, difference }
    }

    /// M(φ, F) − Σδᵢδᵢᵀ/(4cᵢ) of the inputs that are `moving`.
    fn for_all_mixtures(&self, multipliers: &[f64], moving: &[bool]) -> TaylorMatrix {
        match multipliers.is_empty() {
            true => self.matrix.clone(),
            false => self.matrix.minus(&self.rows.deltas(multipliers, moving).quadratic(&shares(multipliers))),
        }
    }

    /// M(φ, S) with the rows of K of the inputs whose bits are set.
    fn of_mixture(&self, bits: usize) -> TaylorMatrix {
        let Rows { gradient, difference } = &self.rows;
        let chosen = |i: &usize| bits >> i & 1 == 1;
        let rows: Vec<usize> = (0..gradient.shape().0).filter(chosen).collect();
        let size = self.matrix.shape().0;
        rows.iter().fold(self.matrix.clone(), |sum, &i| {
            let product = TaylorMatrix::from_fn(size, size, |j, k| difference.at(i, j) * gradient.at(i, k) * -0.5);
            sum.plus(&product).plus(&product.transpose())
        })
    }
}
