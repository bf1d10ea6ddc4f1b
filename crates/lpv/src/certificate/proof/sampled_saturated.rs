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
//!   times Y and ηᵢ = φbᵢ). For any cᵢ > 0 it is at least −δᵢδᵢᵀ/(4cᵢ), δᵢ = cᵢuᵢ − 2wᵢ, because max(0, ab) ≤ (a + b)²/4. One matrix, M(φ, F) −
//!   Σδᵢδᵢᵀ/(4cᵢ) ≻ 0, does for all 2ᵐ mixtures; where it is not definite, the mixtures are taken one by one.
//!
//! None of this depends on the level: it is the one up to which F does not saturate.

use super::closed_loop::{ClosedLoop, Form, Place};
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix};
use super::rowwise::ALL_HIGH;
use super::sampled::{hold, rest};
use super::{Attempt, Cells, LEAST_HALF};
use crate::certificate::claim::{Claim, ClaimKind, Verdict, Words};
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::matrix::{identity, inverse, quadratic_form, symmetric_part};
use crate::math::taylor::Taylor;
use std::time::Instant;

/// Terms of φ that are summed before the rest is bounded.
const TERMS: usize = 8;
/// Inputs that may saturate, up to which mixtures are taken one by one.
const MOST_MIXED: usize = 6;

/// At which times V is not larger than at the sample before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Times {
    /// At all.
    All,
    /// At the next sample.
    Samples,
}

/// M(φ, F) and what each input that may saturate adds to it, for one φ.
struct Condition {
    matrix: TaylorMatrix,
    /// uᵢ and wᵢ, 2n each.
    changes: Vec<[Vec<Taylor>; 2]>,
}

/// The claim that the saturated, sampled loop keeps {V ≤ γ} invariant.
pub(super) fn prove(closed_loop: &ClosedLoop, words: &Words, level: f64, sample_time_s: f64) -> Claim {
    let started = Instant::now();
    let kind = ClaimKind::SampledInvariance { level, sample_time_s };
    let premises = ["lyapunov-definite", "unsaturated"];
    if !(sample_time_s.is_finite() && sample_time_s > 0.0) {
        let claim = words.claim(kind, Attempt::Proved(f64::NAN), closed_loop, 0, started).resting_on(&premises);
        return claim.decided(Verdict::Undecided, f64::NAN, "the sample time is not positive");
    }
    let attempt = |times: Times| {
        let mut cells =
            Cells::new(closed_loop.pieces, 1, |place: &Place| cell(closed_loop, place, sample_time_s, times));
        // that a mixture fails refutes nothing
        let attempt = cells.prove(LEAST_HALF, &|matrices: &Vec<CellMatrix>, half| {
            let positive = |matrix: &CellMatrix| match matrix.is_positive(half) {
                Definiteness::Refuted { .. } => Definiteness::Open { fits: 0.0 },
                other => other,
            };
            matrices.iter().map(|matrix| (0.0, positive(matrix))).collect()
        });
        (times, attempt, cells.len())
    };
    let all = attempt(Times::All);
    let (times, attempt, cells) = if matches!(all.1, Attempt::Proved(_)) { all } else { attempt(Times::Samples) };
    let mut claim = words.claim(kind, attempt, closed_loop, cells, started).resting_on(&premises);
    if claim.verdict == Verdict::Proved {
        let when = match times {
            Times::All => "at the samples and between them",
            Times::Samples => "at the times of the samples alone",
        };
        claim.detail = format!("{when}, {}", claim.detail);
    }
    claim
}

/// What has to be definite on the cell.
fn cell(closed_loop: &ClosedLoop, place: &Place, sample_time_s: f64, times: Times) -> Vec<CellMatrix> {
    let Place { piece, middle, half, .. } = *place;
    let at_middle = Taylor::variable_of_first_order(Interval::point(middle));
    let over = Taylor::variable(Interval::new(middle - half, middle + half));
    let [middle, over] = [at_middle, over].map(|t| conditions(closed_loop, piece, t, sample_time_s, times));
    middle.iter().zip(&over).flat_map(|(middle, over)| matrices(middle, over)).collect()
}

/// One matrix for all mixtures, or where that is not definite in the middle, one for each.
fn matrices(middle: &Condition, over: &Condition) -> Vec<CellMatrix> {
    if let Some(factors) = middle.factors() {
        // for the whole cell or not at all: both forms have to be of one function
        let moving = over.moving();
        let [middle, over] = [middle, over].map(|condition| condition.for_all_mixtures(&factors, &moving));
        let one = CellMatrix::new(&middle, &over);
        if matches!(one.is_positive(0.0), Definiteness::Proved(_)) || factors.len() > MOST_MIXED {
            return vec![one];
        }
    }
    if middle.changes.len() > MOST_MIXED {
        return vec![CellMatrix::unbounded(middle.matrix.shape().0)];
    }
    let mixture = |bits: usize| CellMatrix::new(&middle.of_mixture(bits), &over.of_mixture(bits));
    (0..1 << middle.changes.len()).map(mixture).collect()
}

/// A condition for each φ.
fn conditions(closed_loop: &ClosedLoop, piece: usize, t: Taylor, sample_time_s: f64, times: Times) -> Vec<Condition> {
    let (a, b, _) = closed_loop.model_and_gain(piece, t);
    let low = closed_loop.parts(piece, 0, t);
    let saturating = if crate::mutant::is("sampled-low-only") { Vec::new() } else { closed_loop.saturating() };
    let high = (!saturating.is_empty()).then(|| closed_loop.parts(piece, ALL_HIGH, t).gain);
    // P from the left, or Y from the right
    let (left, flow) = match closed_loop.form {
        Form::Direct(_) => (Some(&low.lyapunov), a.minus(&b.times(&low.gain))),
        Form::Inverse(_) => (None, a.times(&low.lyapunov).minus(&b.times(&low.gain))),
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
        let change = |&i: &usize| {
            let difference = |j: usize| high.as_ref().map_or(Taylor::from(0.0), |k| k.at(i, j) - low.gain.at(i, j));
            let u = (0..2 * n).map(|j| if j < n { difference(j) } else { Taylor::from(0.0) }).collect();
            let w = (0..2 * n).map(|j| if j < n { eta.at(j, i) } else { -(eta.at(j - n, i) * sample_time_s) });
            [u, w.collect()]
        };
        Condition { matrix: block(&h, &low.lyapunov, sample_time_s), changes: saturating.iter().map(change).collect() }
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
    /// cᵢ of all inputs, powers of two: near the minimum 2√(wᵢᵀM⁻¹wᵢ / uᵢᵀM⁻¹uᵢ) of what is taken from M, which is halfway between F and
    /// K. `None` where M is not definite.
    fn factors(&self) -> Option<Vec<f64>> {
        let size = self.matrix.shape().0;
        let middle = |entries: &[Taylor]| entries.iter().map(|entry| entry.value.middle()).collect::<Vec<f64>>();
        let changes: Vec<[Vec<f64>; 2]> = self.changes.iter().map(|[u, w]| [middle(u), middle(w)]).collect();
        let halfway = Mat::from_fn(size, size, |i, j| {
            let added = |[u, w]: &[Vec<f64>; 2]| 0.5 * (u[i] * w[j] + w[i] * u[j]);
            self.matrix.at(i, j).value.middle() + changes.iter().map(added).sum::<f64>()
        });
        let inverse = symmetric_part(&inverse(&halfway));
        let factor = |[u, w]: &[Vec<f64>; 2]| {
            let ratio = quadratic_form(&inverse, w) / quadratic_form(&inverse, u);
            let factor = 2.0_f64.powi((1.0 + 0.5 * ratio.log2()).round().clamp(-500.0, 500.0) as i32);
            // rows of F and K that agree add nothing, whatever the factor
            if u.iter().all(|entry| *entry == 0.0) { Some(1.0) } else { (ratio > 0.0).then_some(factor) }
        };
        changes.iter().map(factor).collect()
    }

    /// The inputs whose rows of F and K differ somewhere, for a condition over a whole cell.
    fn moving(&self) -> Vec<bool> {
        self.changes.iter().map(|[u, _]| !u.iter().all(Taylor::is_zero)).collect()
    }

    /// M(φ, F) − Σδᵢδᵢᵀ/(4cᵢ) of the inputs that are `moving`.
    fn for_all_mixtures(&self, factors: &[f64], moving: &[bool]) -> TaylorMatrix {
        let size = self.matrix.shape().0;
        let changes = self.changes.iter().zip(factors).zip(moving).filter(|(_, moving)| **moving);
        changes.fold(self.matrix.clone(), |sum, (([u, w], &c), _)| {
            let delta = TaylorMatrix::from_fn(1, size, |_, j| u[j] * c - w[j] * 2.0);
            sum.minus(&delta.transpose().times(&delta).scaled(0.25 / c))
        })
    }

    /// M(φ, S) with the rows of K of the inputs whose bits are set.
    fn of_mixture(&self, bits: usize) -> TaylorMatrix {
        let size = self.matrix.shape().0;
        let chosen = self.changes.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1);
        chosen.fold(self.matrix.clone(), |sum, (_, [u, w])| {
            let product = TaylorMatrix::from_fn(size, size, |i, j| u[i] * w[j]);
            sum.plus(&product).plus(&product.transpose())
        })
    }
}
