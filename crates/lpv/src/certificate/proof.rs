//! Proofs over the continuous range of the parameter, between grid points too, with every rounding accounted for.
//!
//! The range is cut into cells. On each cell the matrix of a claim is enclosed by its Taylor form of second order in
//! interval arithmetic: the plant's equations, their Jacobians, the schedule that flies and the Lyapunov function are all
//! evaluated over intervals, none is sampled. Gershgorin's theorem after a congruence then proves it definite on the whole
//! cell, or an eigenvector in interval arithmetic refutes it in the middle, or narrower cells take its place. The claims are affine in
//! the parameter's rate, so that both ends of its interval are enough.
//!
//! The solver is not asked, and no number but P (or Y), the gains and the model enters. `docs/proved.md` says what is proved
//! and what is not.

mod closed_loop;
mod decrease;
mod difference;
mod enclosed;
mod gain;
mod interpolated;
mod matrix;
mod mean_value;
mod motion;
mod nonlinear;
mod polytopic;
mod record;
mod rowwise;
mod sampled;
mod sampled_constant;
mod sampled_cost;
mod sampled_saturated;
mod sampled_spectrum;
mod sampled_witness;
mod scheduled;
mod value;
mod weights;
mod witness;

pub(super) use closed_loop::Form;
pub use closed_loop::Unprovable;
pub use gain::prove_gain;
pub use motion::MotionProof;
pub(super) use motion::prove_motion;
pub use nonlinear::NonlinearProof;
pub use polytopic::{PolytopicClaim, PolytopicLyapunov, prove_polytopic};
pub use record::{Record, RecordError};
pub use sampled_cost::{SampledCost, prove_sampled_cost};
pub use scheduled::{MOST_CELLS, ScheduledClaim, prove_scheduled};

use super::claim::{Claim, ClaimKind, Of, Verdict, Witness, Words, settle};
use crate::math::decimal::{about, at_least};
use crate::math::interval::Interval;
use crate::mutant;
use crate::plant::Plant;
use crate::synthesis::Design;
use closed_loop::{ClosedLoop, Place, Row};
use decrease::DecreaseProof;
use matrix::{CellMatrix, Definiteness};
use rayon::prelude::*;
use std::time::Instant;

/// Half-widths of cells, in pieces, below which no narrower one is tried: for a claim that is asked for, and while the
/// largest rate is sought.
const LEAST_HALF: f64 = 1.0 / 2048.0;
const LEAST_HALF_OF_SEARCH: f64 = 1.0 / 1024.0;
/// By how much the next attempt is narrower at most, and how much of the width is taken that a wider cell lets expect.
const MOST_SHRINKAGE: f64 = 8.0;
const FEWER: f64 = 0.95;
/// What the rows of the next cell are to sum to, 1 being too much, and by how much it is wider at most.
const AIM: f64 = 0.8;
const MOST_GROWTH: f64 = 2.0;
/// Cells reach over their ends by this, in pieces: far more than the rounding of their ends, which lie below 2^14.
const OVERLAP: f64 = 1e-10;
/// What the level of the certified set is multiplied by until it is proved: between grid points a little is lost.
const LEVELS: [f64; 5] = [1.0, 0.999, 0.995, 0.98, 0.9];
/// By this factor the cost bound of a frozen design may be exceeded when it is proved for a moving parameter.
pub const COST_INFLATION: f64 = 1.1;
/// The same of a design that was made for a moving parameter.
pub const COST_INFLATION_RATE_BOUNDED: f64 = 1.01;
/// Rates are found to this factor.
const RATE_RATIO: f64 = 1.03;
/// Rates outside are not sought.
const RATES: [f64; 2] = [1e-4, 1e5];

/// A cell of the range of the parameter.
struct Cell<M> {
    place: Place,
    matrix: M,
}

/// How a matrix is enclosed on a place.
type Enclose<'a, M> = Box<dyn Fn(&Place) -> M + Sync + 'a>;

/// What is known of a cell's claims from its matrix and half-width, each with the rate that it is for.
type Judgement<'j, M> = dyn Fn(&M, f64) -> Vec<(f64, Definiteness)> + Sync + 'j;

/// Cells of every piece and of every variant of a claim (mixtures, inputs), refined as far as a claim ever needed.
struct Cells<'a, M> {
    groups: Vec<Vec<Cell<M>>>,
    enclose: Enclose<'a, M>,
}

/// How an attempt to prove a claim on all cells ended.
#[derive(Clone, Debug)]
enum Attempt {
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
    fn new(pieces: usize, variants: usize, enclose: impl Fn(&Place) -> M + Sync + 'a) -> Self {
        let pieces = if mutant::is("last-piece-skipped") && pieces > 1 { pieces - 1 } else { pieces };
        let groups: Vec<(usize, usize)> =
            (0..pieces).flat_map(|piece| (0..variants).map(move |v| (piece, v))).collect();
        let first = |&(piece, variant): &(usize, usize)| {
            let place = Place { piece, variant, middle: piece as f64 + 0.5, half: 0.5 };
            vec![Cell { place, matrix: enclose(&place) }]
        };
        Self { groups: groups.par_iter().map(first).collect(), enclose: Box::new(enclose) }
    }

    fn len(&self) -> usize {
        self.groups.iter().map(Vec::len).sum()
    }

    /// Prove `claims` of every cell, with cells of half-width at least `least`.
    fn prove(&mut self, least: f64, claims: &Judgement<M>) -> Attempt {
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

/// What is to be proved of a design.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProofOptions {
    /// The parameter's largest rate; `None`: the design's own, and for a frozen design the largest that can be proved.
    pub rate: Option<f64>,
    /// Level of the set {V ≤ γ}; `None`: the design's.
    pub level: Option<f64>,
    /// Also look for the largest set that is invariant for the nonlinear plant.
    pub nonlinear: bool,
}

/// What is proved of a design: its claims, and the conditions under which its cost bounds hold.
#[derive(Clone, Debug)]
pub struct Proofs {
    /// The claims, in the order in which they build on each other.
    pub claims: Vec<Claim>,
    /// Whether the rate was asked for, by the caller or by the design: then a claim that is not proved is a failure.
    pub asked: bool,
    /// Largest rate of the parameter for which stability (and invariance of the set) is proved.
    pub stable_up_to: Option<f64>,
    /// Largest rate for which the cost bound is proved, inflated by `cost_factor`.
    pub cost_up_to: Option<f64>,
    /// The cost is at most this times V(x(0)).
    pub cost_factor: f64,
    /// Level of the set that the claims are about; `None` where they hold everywhere.
    pub level: Option<f64>,
    /// What is proved of the nonlinear plant, if it was asked for and anything is.
    pub nonlinear: Option<NonlinearProof>,
}

impl Proofs {
    /// Whether the claim counts in the verdict on the design: all that the design, or the caller, claims. What is looked for beyond that
    /// is a finding, and counts if it is proved.
    pub fn is_counted(&self, claim: &Claim) -> bool {
        // that a set found between grid points is not kept by the sampled loop takes nothing from a design that does not claim it
        let is_found = matches!(claim.kind, ClaimKind::SampledInvariance { .. });
        let is_decided = claim.verdict == Verdict::Proved || claim.verdict == Verdict::Refuted && !is_found;
        // a factor is looked for, none is claimed
        let is_asked = self.asked && !matches!(claim.kind, ClaimKind::SampledCost { .. });
        is_asked || is_decided || matches!(claim.kind, ClaimKind::AsAsked { .. })
    }
}

/// Prove what can be proved of `design`, for the plant that it names:
///
/// 1. Q ⪰ 0, R ≻ 0 and P(ρ) ≻ 0;
/// 2. on {V ≤ γ} no limited input of the low gain (K, or F of high gain) saturates;
/// 3. V falls along every motion of the LPV model with |ρ̇| ≤ r, under every mixture of saturated rows, so that {V ≤ γ} is
///    invariant;
/// 4. the cost is at most V(x(0)) times a factor for |ρ̇| ≤ r;
/// 5. the loop with zero-order hold at the design's sample time is stable at every fixed ρ, while no input saturates;
/// 6. of a plant without a parameter, the cost of the saturated loop with zero-order hold is at most κ V(x(0)), for the least κ found;
/// 7. where it is asked for, the largest set {V ≤ c} that is invariant for the nonlinear plant.
pub fn prove(design: &Design, plant: &dyn Plant, options: &ProofOptions) -> Result<Proofs, Unprovable> {
    let closed_loop = ClosedLoop::new(design, plant)?;
    let words = words(plant);
    let mut claims = vec![weights::claim(&design.weights, &words), definite(&closed_loop, &words)];
    let asked_level = options.level.or(design.method.gamma());
    // a frozen design claims its level at the grid points, and what is proved between them is a finding
    let is_claimed = options.level.is_some() || design.rate_bounded.is_some() || !closed_loop.has_parameter;
    let level = unsaturated(&closed_loop, &words, asked_level, is_claimed, &mut claims);

    let started = Instant::now();
    let mut decrease = DecreaseProof::new(&closed_loop);
    let own = design.rate_bounded.as_ref().map(|bounded| bounded.rate);
    let asked = if closed_loop.has_parameter { options.rate.or(own) } else { Some(0.0) };
    let cost_factor = match (closed_loop.has_parameter, own) {
        (false, _) => 1.0,
        (true, Some(_)) => COST_INFLATION_RATE_BOUNDED,
        (true, None) => COST_INFLATION,
    };
    let mut reached = [None, None];
    for (place, (cost, factor)) in [(0.0, 1.0), (1.0, cost_factor)].into_iter().enumerate() {
        let (rate, attempt) = match asked {
            Some(rate) => (rate, decrease.at(rate, [factor, cost])),
            None => decrease.largest_rate([factor, cost]),
        };
        if let Attempt::Proved(_) = attempt {
            reached[place] = Some(rate);
        }
        let motion = closed_loop.motion(rate);
        let kind = match (place, level) {
            (0, None) => ClaimKind::Decrease { motion },
            (0, Some(level)) => ClaimKind::Invariance { level, motion },
            _ if mutant::is("cost-factor-lowered") => ClaimKind::Cost { factor: 1.0, level, motion },
            _ => ClaimKind::Cost { factor, level, motion },
        };
        let premises: &[&str] = match (place, level) {
            (0, None) => &["lyapunov-definite"],
            (0, Some(_)) => &["lyapunov-definite", "unsaturated"],
            (_, None) => &["weights", "lyapunov-definite"],
            (_, Some(_)) => &["weights", "lyapunov-definite", "unsaturated", "invariance"],
        };
        let witness = match (&attempt, place) {
            (Attempt::Refuted { .. }, 0) => closed_loop.leaves(&attempt, level),
            // only a claim about the cost is refuted by a cost
            (Attempt::Refuted { place, .. } | Attempt::Open { place, .. }, 1) => closed_loop.costs_more(place, factor),
            _ => None,
        };
        let mut claim = words.claim(kind, attempt, &closed_loop, decrease.cells(), started).resting_on(premises);
        claim = claim.refuted_by(witness);
        if asked.is_none() && claim.verdict == Verdict::Refuted {
            // nobody claimed it: with the gain between the grid points this P is no bound even at rest, another may be
            claim.verdict = Verdict::Undecided;
            claim.detail = format!("no rate could be proved: {}", claim.detail);
        }
        claims.push(claim);
    }
    if let (Some(rate), None) = (options.rate.filter(|_| closed_loop.has_parameter), reached[0]) {
        let (found, attempt) = decrease.largest_rate([1.0, 0.0]);
        let proved = matches!(attempt, Attempt::Proved(_)).then_some(found);
        claims.push(Claim::new(ClaimKind::AsAsked { what: "rate", asked: rate, proved }, Of::Model, &words));
    }
    claims.push(sampled::prove(&closed_loop, &words, design.sample_time_s));
    if let Some(level) = level {
        let is_founded = claims.iter().all(|c| c.id.name != "unsaturated" || c.verdict == Verdict::Proved);
        claims.push(sampled_saturated::prove(&closed_loop, &words, level, design.sample_time_s, is_founded));
    }
    if !closed_loop.has_parameter {
        claims.push(sampled_cost::claim(&closed_loop, &words, level, design.sample_time_s));
    }
    let mut nonlinear = None;
    if options.nonlinear {
        let (found, proof) = nonlinear::prove(&closed_loop, &words, level);
        claims.extend(found);
        nonlinear = proof;
    }
    settle(&mut claims);
    // what a claim rests on is part of what is reached
    let holds = |name: &str| claims.iter().filter(|c| c.id.name == name).all(|c| c.verdict == Verdict::Proved);
    let stable_up_to = reached[0].filter(|_| holds("decrease") && holds("invariance"));
    let cost_up_to = reached[1].filter(|_| holds("cost"));
    Ok(Proofs { asked: asked.is_some(), stable_up_to, cost_up_to, cost_factor, level, nonlinear, claims })
}

/// Names of the plant's parameter.
pub(super) fn words(plant: &dyn Plant) -> Words {
    let parameter = plant.description().scheduling.as_ref();
    Words {
        parameter: parameter.map_or(String::new(), |s| s.parameter.clone()),
        unit: parameter.map_or(String::new(), |s| s.unit.clone()),
        lyapunov: "x'P x",
    }
}

/// The witness that the frozen loop is not stable at `rho`, where that can be proved.
pub(super) fn unstable_at(design: &Design, plant: &dyn Plant, rho: f64) -> Option<Witness> {
    ClosedLoop::new(design, plant).ok()?.does_not_rest(rho)
}

/// V of the claims; `None` where nothing can be proved.
pub(super) fn lyapunov_form(design: &Design, plant: &dyn Plant) -> Option<Form> {
    Some(ClosedLoop::new(design, plant).ok()?.form)
}

/// P(ρ) of the Lyapunov function that [`prove`] is about; `None` where there is none.
pub fn lyapunov_matrix(design: &Design, plant: &dyn Plant, rho: f64) -> Option<crate::math::Mat<f64>> {
    ClosedLoop::new(design, plant).ok()?.form.p(rho)
}

impl Words {
    fn claim(
        &self,
        kind: ClaimKind,
        attempt: Attempt,
        closed_loop: &ClosedLoop,
        cells: usize,
        started: Instant,
    ) -> Claim {
        let at = |place: &Place| match closed_loop.has_parameter {
            true => format!(" at parameter {}", about(closed_loop.parameter(place.middle))),
            false => String::new(),
        };
        let (verdict, margin, detail, place) = match attempt {
            Attempt::Proved(margin) => {
                (Verdict::Proved, margin, format!("relative margin {}, {cells} cells", at_least(margin)), None)
            }
            Attempt::Refuted { place, rate, value, .. } => {
                let rate = if rate == 0.0 { String::new() } else { format!(" with rate {}", about(rate)) };
                (Verdict::Undecided, value, format!("its condition fails{}{rate}", at(&place)), Some(place))
            }
            Attempt::Open { place } => {
                let detail = format!(
                    "open{} on a cell of {} of a grid step: too close to the edge to be told",
                    at(&place),
                    about(2.0 * place.half)
                );
                (Verdict::Undecided, f64::NAN, detail, Some(place))
            }
        };
        let at = place.filter(|_| closed_loop.has_parameter).map(|place| closed_loop.parameter(place.middle));
        let claim = Claim::new(kind, Of::Model, self).decided(verdict, margin, detail);
        Claim { at, cells, seconds: started.elapsed().as_secs_f64(), ..claim }
    }
}

fn definite(closed_loop: &ClosedLoop, words: &Words) -> Claim {
    let started = Instant::now();
    let mut cells = Cells::new(closed_loop.pieces, 1, |place: &Place| closed_loop.bordered(place, None));
    let attempt = cells.prove(LEAST_HALF, &|matrix: &CellMatrix, half| vec![(0.0, matrix.is_positive(half))]);
    let attempt = if mutant::is("definiteness-assumed") { Attempt::Proved(0.5) } else { attempt };
    let witness = closed_loop.witness(&attempt);
    words.claim(ClaimKind::LyapunovDefinite, attempt, closed_loop, cells.len(), started).refuted_by(witness)
}

/// The claim that no limited input saturates on the set of level γ, asked for or found, and of the level that is proved; it is
/// added to `claims`, and a second one where less than was asked for is proved. The level of the set that further claims are about:
/// `None` where nothing can saturate and they hold everywhere.
fn unsaturated(
    closed_loop: &ClosedLoop,
    words: &Words,
    asked: Option<f64>,
    is_claimed: bool,
    claims: &mut Vec<Claim>,
) -> Option<f64> {
    let rows = closed_loop.limited_rows();
    if rows.is_empty() {
        return None;
    }
    let gamma = asked.unwrap_or_else(|| closed_loop.unsaturated_level());
    let started = Instant::now();
    if let Some(&stuck) = rows.iter().find(|&&i| closed_loop.sigma[i] <= 0.0) {
        let kind = ClaimKind::Unsaturated { level: gamma };
        let detail =
            format!("input {} has no room on one side of its operating value, and its gain is not zero", stuck + 1);
        let claim = Claim::new(kind, Of::Model, words).decided(Verdict::Undecided, f64::NAN, detail);
        claims.push(claim.resting_on(&["lyapunov-definite"]));
        return Some(gamma);
    }
    let attempt = |level: f64| {
        let mut cells = Cells::new(closed_loop.pieces, rows.len(), |place: &Place| {
            closed_loop.bordered(place, Some((Row::Limited(rows[place.variant]), Interval::point(1.0) / level)))
        });
        let attempt = cells.prove(LEAST_HALF, &|matrix: &CellMatrix, half| vec![(0.0, matrix.is_positive(half))]);
        let attempt = if mutant::is("level-unchecked") { Attempt::Proved(0.5) } else { attempt };
        (level, attempt, cells.len())
    };
    let mut attempts = LEVELS.into_iter().map(|factor| attempt(factor * gamma));
    let first = attempts.next().expect("there are levels");
    let (level, attempt, cells) = match first.1 {
        Attempt::Proved(_) => first,
        _ => attempts.find(|(_, attempt, _)| matches!(attempt, Attempt::Proved(_))).unwrap_or(first),
    };
    let level = if mutant::is("level-not-lowered") { gamma } else { level };
    let is_proved = matches!(attempt, Attempt::Proved(_));
    let witness = closed_loop.saturates(&attempt, &rows);
    let kind = ClaimKind::Unsaturated { level };
    let claim = words.claim(kind, attempt, closed_loop, cells, started).resting_on(&["lyapunov-definite"]);
    claims.push(claim.refuted_by(witness));
    if let Some(asked) = asked.filter(|asked| is_claimed && is_proved && *asked != level) {
        let kind = ClaimKind::AsAsked { what: "level", asked, proved: Some(level) };
        claims.push(Claim::new(kind, Of::Model, words));
    }
    Some(level)
}
