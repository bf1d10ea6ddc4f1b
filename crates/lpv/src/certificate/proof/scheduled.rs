//! Proofs for the LPV model itself where a design was made over the vertices of its tensor-product model.
//!
//! The vertices stand for the model up to the transformation's error: truncated singular values, weights that are linear between the grid
//! points, corners of the curve that a hull leaves out. Nothing about vertices is carried over. With the gain as it flies,
//! K(ρ) = Σ w₁,ᵢ₁(ρ₁) ⋯ K_{i₁…}, the weights linear between the points of their grids, every claim is a matrix over the box of the
//! parameters,
//!
//! ```text
//! κ(−P(A(ρ) − B(ρ)K(ρ)) − ·ᵀ) − c (Q + K(ρ)ᵀRK(ρ)) ≻ 0,    [1/γ, kᵢ(ρ)/σᵢ; ·ᵀ, P] ≻ 0,
//! ```
//!
//! with A(ρ), B(ρ) the equations of the model in interval arithmetic, on cells that cover the box (`mean_value.rs`). The error is in it, whatever
//! it is, and so is a gain whose weights were not convex. Where inputs may saturate it is the inequality of `rowwise.rs`. P is one for all ρ, so
//! that the parameters may move as they like.
//!
//! **The nonlinear plant.** Where parameters are states, ẋ = A(ρ(x))x + B(ρ(x))u is the plant, exactly, while these states are in the ranges:
//! on {V ≤ c} they are, if |xᵢ| ≤ rᵢ there for the nearer end rᵢ of each, [1/c, eᵢ/rᵢ; ·ᵀ, P] ≻ 0. What is claimed of the model then holds of
//! the plant from every state of that set.

use super::interpolated::Scheduled;
use super::matrix::{self, CellMatrix, Definiteness, TaylorMatrix};
use super::mean_value::{BoxCell, BoxOutcome, MeanValueMatrix, prove_on_box};
use super::polytopic::{PolytopicClaim, PolytopicLyapunov};
use super::rowwise::{Balanced, Rows, mixed, multipliers, separable, shares};
use crate::certificate::claim::{Claim, ClaimKind, Motion, Of, Verdict, Words, settle};
use crate::math::Mat;
use crate::math::decimal::{Rounding, about, at_least, decimal};
use crate::math::interval::Interval;
use crate::math::matrix::inverse_spd;
use crate::math::taylor::Taylor;
use crate::model::tensor_product::TensorProductSchedule;
use crate::model::{ModelSource, SourceModel};
use crate::mutant;
use crate::synthesis::CostWeights;
use rayon::prelude::*;
use std::time::Instant;

/// Cells on which the transformation's error may exceed this multiple of the largest that is certain are bisected, as long as there are no more
/// than so many to be looked at.
const ERROR_EXCESS: f64 = 1.1;
const ERROR_CELLS: usize = 40_000;
/// Factors of the cost bound, of which the least that can be proved is claimed, and the share of the cells that each may take: a small one is
/// out of reach where the model is not in the hull of the vertices, and is not worth many.
const COST_ATTEMPTS: [(f64, f64); 4] = [(1.0, 0.075), (1.001, 0.075), (1.01, 0.25), (1.1, 1.0)];
/// Claims about P, Q and R, which know of no model.
const OF_NO_MODEL: [&str; 2] = ["weights", "lyapunov-definite"];
/// What is tried of the largest level on which the states seem to stay in their ranges.
const RANGE_SHARES: [f64; 4] = [1.0 - 1e-12, 1.0 - 1e-9, 1.0 - 1e-6, 0.99];

/// A design over the vertices of a tensor-product model, with the model.
#[derive(Clone, Copy, Debug)]
pub struct ScheduledClaim<'a> {
    /// What is claimed over the polytope of the vertices, with the gains there.
    pub polytopic: &'a PolytopicClaim,
    /// The weights of the vertices, in their order.
    pub schedule: &'a TensorProductSchedule,
    /// The LPV model; `None` where only its samples were known.
    pub source: Option<&'a ModelSource>,
    /// Cells after which a proof gives up: [`MOST_CELLS`] as a rule.
    pub most_cells: usize,
}

/// Cells after which the proof of a claim about the LPV model gives up: a minute or so.
pub const MOST_CELLS: usize = 400_000;

/// The claims about the polytope, which [`prove_polytopic`](super::prove_polytopic) made, about the LPV model over the whole box of its parameters,
/// and, where parameters are states, about the nonlinear plant.
pub fn prove_scheduled(claim: &ScheduledClaim, polytope: Vec<Claim>) -> Vec<Claim> {
    let about_polytope = |claim: Claim| match OF_NO_MODEL.contains(&claim.id.name) {
        true => claim,
        false => claim.of_polytope(&["unsaturated", "decrease", "invariance"]),
    };
    let mut claims: Vec<Claim> = polytope.into_iter().map(about_polytope).collect();
    match BoxLoop::new(claim) {
        Ok(closed_loop) => claims.extend(closed_loop.claims()),
        Err(reason) => claims.extend(unknown(claim, &reason)),
    }
    settle(&mut claims);
    claims
}

/// Names and ranges of the parameters, as far as `of` picks them, in words: the claims hold for more than is printed.
fn words(schedule: &TensorProductSchedule, of: impl Fn(usize) -> bool) -> Words {
    let range = |(_, parameter): (usize, &crate::model::tensor_product::ScheduledParameter)| {
        let grid = &parameter.grid;
        let [low, high] = [grid.points[0], grid.points[grid.points.len() - 1]];
        let unit = if grid.unit == "1" { String::new() } else { format!(" {}", grid.unit) };
        format!("{} in [{}, {}]{unit}", grid.name, decimal(low, 6, Rounding::Up), decimal(high, 6, Rounding::Down))
    };
    let ranges: Vec<String> = schedule.parameters.iter().enumerate().filter(|(k, _)| of(*k)).map(range).collect();
    Words { parameter: ranges.join(" and "), unit: String::new(), lyapunov: "V" }
}

/// The claims about a model of which nothing can be proved.
fn unknown(claim: &ScheduledClaim, reason: &str) -> Vec<Claim> {
    let words = words(claim.schedule, |_| true);
    let motion = Motion::WithinRanges;
    let level = claim.polytopic.saturation.as_ref().map(|bounds| bounds.gamma);
    let decrease = match level {
        Some(level) => ClaimKind::Invariance { level, motion },
        None => ClaimKind::Decrease { motion },
    };
    let cost = claim.polytopic.weights.as_ref().map(|_| ClaimKind::Cost { factor: 1.0, level, motion });
    let undecided = |kind| Claim::new(kind, Of::Model, &words).decided(Verdict::Undecided, f64::NAN, reason);
    std::iter::once(decrease).chain(cost).map(undecided).collect()
}

/// The LPV model with the gain as it flies.
struct BoxLoop<'a> {
    claim: &'a PolytopicClaim,
    schedule: &'a TensorProductSchedule,
    source: SourceModel,
    /// What the model is called.
    name: String,
    /// P
    p: TaylorMatrix,
    /// K(ρ), and F(ρ) of a high gain.
    gain: Scheduled<'a>,
    auxiliary: Option<Scheduled<'a>>,
    /// Σ wᵥAᵥ and Σ wᵥBᵥ.
    approximation: [Scheduled<'a>; 2],
    words: Words,
    most_cells: usize,
}

/// A, B, the low gain and K at ρ.
struct Matrices {
    a: TaylorMatrix,
    b: TaylorMatrix,
    low: TaylorMatrix,
    high: TaylorMatrix,
}

/// The transformation's error on a cell, of A and of B: a bound, and about what it is in the middle.
struct ErrorCell {
    cell: BoxCell,
    bound: [f64; 2],
    certain: [f64; 2],
    /// The parameter along which it changes most.
    widest: usize,
}

impl<'a> BoxLoop<'a> {
    fn new(claim: &ScheduledClaim<'a>) -> Result<Self, String> {
        let ScheduledClaim { polytopic, schedule, source, most_cells } = *claim;
        let source = source.ok_or("the model is known by its samples alone, and nothing is known between them")?;
        let name = source.name();
        let source = source.build().map_err(|error| format!("the model cannot be evaluated: {error}"))?;
        let PolytopicLyapunov::Common { p, gain } = &polytopic.lyapunov else {
            return Err("V depends on the weights of the vertices: only a common P is proved for the LPV model".into());
        };
        schedule.check().map_err(|error| error.to_string())?;
        let polytope = &polytopic.polytope;
        let fits = schedule.vertices() == polytope.len()
            && schedule.parameters.len() == source.parameters.len()
            && [source.states.len(), source.inputs] == [polytope.states(), polytope.inputs()];
        if !fits {
            return Err("the vertices and weights are of other sizes than the model".into());
        }
        let words = words(schedule, |_| true);
        let all = |of: &dyn Fn(usize) -> Mat<f64>| (0..polytope.len()).map(of).collect::<Vec<_>>();
        let vertices = [all(&|v| polytope.a(v).clone()), all(&|v| polytope.b(v).clone())];
        let scheduled = |matrices: &[Mat<f64>]| Scheduled::new(schedule, matrices);
        Ok(Self {
            claim: polytopic,
            schedule,
            source,
            name,
            p: TaylorMatrix::constant(p),
            gain: scheduled(gain),
            auxiliary: polytopic.auxiliary_gain.as_deref().map(scheduled),
            approximation: [scheduled(&vertices[0]), scheduled(&vertices[1])],
            words,
            most_cells,
        })
    }

    fn claims(&self) -> Vec<Claim> {
        let rows = self.limited_rows();
        let level = (!rows.is_empty()).then(|| self.claim.saturation.as_ref().map(|bounds| bounds.gamma)).flatten();
        let mut claims = vec![self.error()];
        if let Some(level) = level {
            claims.push(self.unsaturated(level, &rows));
        }
        claims.push(self.decrease(level, None, self.most_cells));
        if let Some(weights) = &self.claim.weights {
            // the last says most where none is proved
            let mut last = None;
            for (factor, share) in COST_ATTEMPTS {
                let most = (share * self.most_cells as f64) as usize;
                let attempt = self.decrease(level, Some((factor, weights)), most);
                let is_proved = attempt.verdict == Verdict::Proved;
                last = Some(attempt);
                if is_proved {
                    break;
                }
            }
            claims.extend(last);
        }
        claims.extend(self.of_plant(&claims, level));
        claims
    }

    fn cells(&self) -> Vec<BoxCell> {
        let grids: Vec<&[f64]> = self.schedule.parameters.iter().map(|p| p.grid.points.as_slice()).collect();
        BoxCell::all(&grids)
    }

    /// A(ρ) and B(ρ) of the model.
    fn model(&self, cell: &BoxCell, rho: &[Taylor]) -> [TaylorMatrix; 2] {
        if mutant::is("approximation-trusted") {
            return [self.approximation[0].at(cell, rho), self.approximation[1].at(cell, rho)];
        }
        let (n, m) = (self.source.states.len(), self.source.inputs);
        let (a, b) = self.source.over(rho);
        [TaylorMatrix::new(n, n, a), TaylorMatrix::new(n, m, b)]
    }

    fn matrices(&self, cell: &BoxCell, rho: &[Taylor]) -> Matrices {
        let [a, b] = self.model(cell, rho);
        let high = self.gain.at(cell, rho);
        let low = match &self.auxiliary {
            // an input that is not limited is always the one of K
            Some(f) => mixed(0, &self.saturating(), &f.at(cell, rho), &high),
            None => high.clone(),
        };
        Matrices { a, b, low, high }
    }

    /// σ of input `i`; infinite where it is not limited.
    fn sigma(&self, i: usize) -> f64 {
        self.claim.saturation.as_ref().map_or(f64::INFINITY, |bounds| bounds.sigma[i])
    }

    /// The inputs that may saturate: limited, of a high gain.
    fn saturating(&self) -> Vec<usize> {
        (0..self.source.inputs).filter(|&i| self.claim.auxiliary_gain.is_some() && self.sigma(i).is_finite()).collect()
    }

    /// Kᵥ
    fn gains(&self) -> &[Mat<f64>] {
        match &self.claim.lyapunov {
            PolytopicLyapunov::Common { gain, .. } => gain,
            PolytopicLyapunov::ParameterDependent { .. } => &[],
        }
    }

    /// The limited inputs that the low gain moves at some vertex.
    fn limited_rows(&self) -> Vec<usize> {
        let low = self.claim.auxiliary_gain.as_deref().unwrap_or(self.gains());
        let moves = |i: usize| low.iter().any(|gain| (0..gain.ncols()).any(|j| gain[(i, j)] != 0.0));
        (0..self.source.inputs).filter(|&i| self.sigma(i).is_finite() && moves(i)).collect()
    }

    /// [1/γ, kᵢ(ρ)/σᵢ; ·ᵀ, P] ≻ 0 for the limited rows of the low gain.
    fn unsaturated(&self, level: f64, rows: &[usize]) -> Claim {
        let started = Instant::now();
        let conditions = |cell: &BoxCell| {
            let of_row = |&input: &usize| {
                let of = |rho: &[Taylor]| {
                    let low = self.matrices(cell, rho).low;
                    let sigma = Taylor::constant(Interval::point(self.sigma(input)));
                    self.bordered(level, |j| low.at(input, j) / sigma)
                };
                MeanValueMatrix::new(cell, &of)
            };
            rows.iter().map(of_row).collect()
        };
        let outcome = if mutant::is("level-unchecked") {
            (BoxOutcome::Proved(0.5), 0)
        } else {
            prove_on_box(self.cells(), self.most_cells, conditions)
        };
        self.decided(ClaimKind::Unsaturated { level }, outcome, started).resting_on(&["lyapunov-definite"])
    }

    /// [1/γ, f; fᵀ, P]
    fn bordered(&self, level: f64, row: impl Fn(usize) -> Taylor) -> TaylorMatrix {
        let n = self.source.states.len();
        TaylorMatrix::from_fn(n + 1, n + 1, |r, c| match (r, c) {
            (0, 0) => Taylor::constant(Interval::point(1.0) / level),
            (0, k) | (k, 0) => row(k - 1),
            (r, c) => self.p.at(r - 1, c - 1),
        })
    }

    /// κ(−P(A − BS) − ·ᵀ) − c (Q + SᵀRS), under saturation less what `rowwise.rs` takes.
    fn decrease(&self, level: Option<f64>, cost: Option<(f64, &CostWeights)>, most: usize) -> Claim {
        let started = Instant::now();
        let motion = Motion::WithinRanges;
        let (kind, mut premises) = match (cost, level) {
            (None, None) => (ClaimKind::Decrease { motion }, vec!["lyapunov-definite"]),
            (None, Some(level)) => (ClaimKind::Invariance { level, motion }, vec!["lyapunov-definite", "unsaturated"]),
            (Some((factor, _)), None) => {
                (ClaimKind::Cost { factor, level, motion }, vec!["lyapunov-definite", "weights"])
            }
            (Some((factor, _)), Some(_)) => {
                let kind = ClaimKind::Cost { factor, level, motion };
                (kind, vec!["lyapunov-definite", "weights", "unsaturated"])
            }
        };
        if cost.is_some() {
            premises.push(if level.is_some() { "invariance" } else { "decrease" });
        }
        let saturating = self.saturating();
        let conditions = |cell: &BoxCell| {
            vec![match saturating.is_empty() {
                true => MeanValueMatrix::new(cell, &|rho| {
                    let Matrices { a, b, high, .. } = self.matrices(cell, rho);
                    self.unlimited([&a, &b, &high], cost, None)
                }),
                false => self.by_rows(cell, &saturating, cost),
            }]
        };
        let outcome = prove_on_box(self.cells(), most, conditions);
        self.decided(kind, outcome, started).resting_on(&premises)
    }

    /// The decrease with the gain s; with `r` for R.
    fn unlimited(
        &self,
        [a, b, s]: [&TaylorMatrix; 3],
        cost: Option<(f64, &CostWeights)>,
        r: Option<&Mat<f64>>,
    ) -> TaylorMatrix {
        let flow = self.p.times(&b.times(s).minus(a));
        let flow = flow.plus(&flow.transpose());
        let Some((factor, weights)) = cost else { return flow };
        let stage = s.quadratic(r.unwrap_or(&weights.r)).plus(&TaylorMatrix::constant(&weights.q));
        flow.scaled(factor).minus(&stage)
    }

    fn by_rows(&self, cell: &BoxCell, saturating: &[usize], cost: Option<(f64, &CostWeights)>) -> MeanValueMatrix {
        let m = self.source.inputs;
        let r = cost.map_or_else(|| Mat::zeros(m, m), |(_, weights)| separable(&weights.r, saturating));
        let weights = [cost.map_or(1.0, |(factor, _)| factor), f64::from(u8::from(cost.is_some()))];
        let parts = |rho: &[Taylor]| {
            let Matrices { a, b, low, high } = self.matrices(cell, rho);
            let rows = Rows::new(saturating, &b.transpose().times(&self.p), [&low, &high], &r, weights);
            (self.unlimited([&a, &b, &low], cost, Some(&r)), rows)
        };
        let middle: Vec<Taylor> = cell.middle().into_iter().map(|c| Taylor::constant(Interval::point(c))).collect();
        let (base, rows) = parts(&middle);
        let [gradient, difference] = rows.middle();
        let multipliers = multipliers(&[Balanced { base: matrix::middle(&base), gradient, difference }]);
        let (moving, shares) = (self.moving(saturating), shares(&multipliers));
        MeanValueMatrix::new(cell, &|rho| {
            let (base, rows) = parts(rho);
            base.minus(&rows.deltas(&multipliers, &moving).quadratic(&shares))
        })
    }

    /// The inputs whose rows of K and F differ at some vertex: of the others saturation takes nothing.
    fn moving(&self, saturating: &[usize]) -> Vec<bool> {
        let Some(f) = &self.claim.auxiliary_gain else { return vec![false; saturating.len()] };
        let differs =
            |i: usize| self.gains().iter().zip(f).any(|(k, f)| (0..k.ncols()).any(|j| k[(i, j)] != f[(i, j)]));
        saturating.iter().map(|&i| differs(i) && !mutant::is("saturation-is-free")).collect()
    }

    /// The transformation's error: Σ wᵥAᵥ − A and Σ wᵥBᵥ − B on cells that cover the box. Those on which it may be largest are bisected.
    fn error(&self) -> Claim {
        let started = Instant::now();
        let bounded =
            |cells: Vec<BoxCell>| -> Vec<ErrorCell> { cells.into_par_iter().map(|cell| self.error_on(cell)).collect() };
        let mut cells = bounded(self.cells());
        let mut looked_at = cells.len();
        loop {
            let certain = [0, 1].map(|k| cells.iter().map(|cell| cell.certain[k]).fold(0.0, f64::max));
            let is_large = |cell: &ErrorCell| (0..2).any(|k| cell.bound[k] > ERROR_EXCESS * certain[k]);
            let (large, small): (Vec<ErrorCell>, Vec<ErrorCell>) = cells.into_iter().partition(is_large);
            cells = small;
            looked_at += 2 * large.len();
            if large.is_empty() || looked_at > ERROR_CELLS {
                cells.extend(large);
                break;
            }
            cells.extend(bounded(large.into_iter().flat_map(|cell| cell.cell.bisected(cell.widest)).collect()));
        }
        let greater = |x: f64, y: f64| if x.is_nan() || y.is_nan() { f64::NAN } else { x.max(y) };
        let [a, b] = [0, 1].map(|k| cells.iter().map(|cell| cell.bound[k]).fold(0.0, greater));
        let claim = Claim::new(ClaimKind::TransformationError { a, b }, Of::Model, &self.words);
        let claim = match a.is_finite() && b.is_finite() {
            true => claim.decided(Verdict::Proved, 0.0, format!("{}, {} cells", self.name, cells.len())),
            false => {
                claim.decided(Verdict::Undecided, f64::NAN, "the model is not bounded in the ranges of its parameters")
            }
        };
        Claim { cells: cells.len(), seconds: started.elapsed().as_secs_f64(), ..claim }
    }

    fn error_on(&self, cell: BoxCell) -> ErrorCell {
        let (n, m) = (self.source.states.len(), self.source.inputs);
        let error = |rho: &[Taylor]| {
            let [a, b] = self.model(&cell, rho);
            let [a, b] = [(0, a), (1, b)].map(|(k, of)| self.approximation[k].at(&cell, rho).minus(&of));
            TaylorMatrix::from_fn(n, n + m, |i, j| if j < n { a.at(i, j) } else { b.at(i, j - n) })
        };
        let (middle, slopes) = cell.enclosed(&error);
        let halves = cell.halves();
        let along = |k: usize, i: usize, j: usize| Interval::point(slopes[k].at(i, j).slope.magnitude()) * halves[k];
        let bound = |i: usize, j: usize| {
            let value = Interval::point(middle.at(i, j).value.magnitude());
            (0..slopes.len()).fold(value, |sum, k| sum + along(k, i, j))
        };
        // Frobenius; the root is rounded by less than is added
        let norm = |columns: std::ops::Range<usize>, size: &dyn Fn(usize, usize) -> Interval| {
            let entries = columns.flat_map(|j| (0..n).map(move |i| (i, j)));
            let square = entries.fold(Interval::point(0.0), |sum, (i, j)| sum + size(i, j).square()).hi();
            if square == 0.0 { 0.0 } else { square.sqrt() * (1.0 + 1e-14) }
        };
        let norms = |size: &dyn Fn(usize, usize) -> Interval| [norm(0..n, size), norm(n..n + m, size)];
        let taken: Vec<f64> = (0..slopes.len()).map(|k| norm(0..n + m, &|i, j| along(k, i, j))).collect();
        let widest = (0..taken.len()).max_by(|&j, &k| taken[j].total_cmp(&taken[k])).unwrap_or(0);
        let (bound, certain) = (norms(&bound), norms(&|i, j| Interval::point(middle.at(i, j).value.middle())));
        ErrorCell { cell, bound, certain, widest }
    }

    /// The claims about the nonlinear plant, from what is proved of the model.
    fn of_plant(&self, model: &[Claim], level: Option<f64>) -> Vec<Claim> {
        // a defect, where it is asked for
        let reach = if mutant::is("range-unchecked") { 2.0 } else { 1.0 };
        let states: Vec<(usize, f64)> = (self.source.parameters.iter().zip(&self.schedule.parameters))
            .filter_map(|(source, parameter)| {
                let points = &parameter.grid.points;
                // how far the state may go to either side of rest
                Some((source.state?, reach * (-points[0]).min(points[points.len() - 1])))
            })
            .collect();
        if states.is_empty() {
            return Vec::new();
        }
        let started = Instant::now();
        let names: Vec<String> = states.iter().map(|&(i, _)| self.source.states[i].name.clone()).collect();
        let outside: Vec<String> =
            states.iter().zip(&names).filter(|((_, r), _)| *r <= 0.0).map(|(_, name)| name.clone()).collect();
        let kind = |level: f64| ClaimKind::StatesInRange { level, states: names.clone() };
        let in_range = |level: f64| {
            states.iter().all(|&(i, r)| {
                let one = Taylor::constant(Interval::point(1.0) / r);
                let matrix = self.bordered(level, |j| if i == j { one } else { Taylor::from(0.0) });
                matches!(CellMatrix::new(&matrix, &matrix).is_positive(0.0), Definiteness::Proved(_))
            })
        };
        let widest = inverse_spd(&matrix::middle(&self.p))
            .map(|y| states.iter().map(|&(i, r)| r * r / y[(i, i)]).fold(f64::INFINITY, f64::min))
            .filter(|widest| widest.is_normal() && *widest > 0.0);
        let asked = level.unwrap_or(f64::INFINITY);
        let found = (widest.filter(|_| outside.is_empty()).into_iter())
            .flat_map(|widest| RANGE_SHARES.map(|share| (share * widest).min(asked)))
            .find(|&level| in_range(level));
        let claim = |kind| Claim::new(kind, Of::Model, &Words { lyapunov: "V", ..Words::default() });
        let Some(within) = found else {
            let reason = match outside.is_empty() {
                false => format!("rest, the origin, is outside the range of {}", outside.join(", ")),
                true => "no set was found on which they are proved to".into(),
            };
            let undecided = claim(kind(level.unwrap_or(0.0))).decided(Verdict::Undecided, f64::NAN, reason);
            return vec![undecided];
        };
        let radii: Vec<String> =
            states.iter().zip(&names).map(|(&(_, r), name)| format!("|{name}| <= {}", at_least(r))).collect();
        let stays =
            claim(kind(within)).decided(Verdict::Proved, 0.0, radii.join(", ")).resting_on(&["lyapunov-definite"]);
        let stays = Claim { seconds: started.elapsed().as_secs_f64(), ..stays };
        // what still moves from outside
        let free = words(self.schedule, |k| self.source.parameters[k].state.is_none());
        let motion = if free.parameter.is_empty() { Motion::None } else { Motion::WithinRanges };
        let carried = |claim: &Claim| {
            let (kind, premises): (ClaimKind, &[&'static str]) = match claim.kind {
                ClaimKind::Decrease { .. } => (ClaimKind::Invariance { level: within, motion }, &["decrease"]),
                ClaimKind::Invariance { .. } => (ClaimKind::Invariance { level: within, motion }, &["invariance"]),
                ClaimKind::Cost { factor, .. } => (ClaimKind::Cost { factor, level: Some(within), motion }, &["cost"]),
                _ => return None,
            };
            let detail = format!("{}, A(x)x + B(x)u is the plant on the set", self.name);
            let claim = Claim::new(kind, Of::Plant, &free).decided(Verdict::Proved, claim.margin, detail);
            Some(claim.resting_on(&["states-in-range"]).resting_on(premises))
        };
        std::iter::once(stays).chain(model.iter().filter_map(carried)).collect()
    }

    fn decided(&self, kind: ClaimKind, (outcome, cells): (BoxOutcome, usize), started: Instant) -> Claim {
        let claim = Claim::new(kind, Of::Model, &self.words);
        let at = |rho: &[f64]| {
            let named = self.schedule.parameters.iter().zip(rho);
            named.map(|(p, value)| format!("{} = {}", p.grid.name, about(*value))).collect::<Vec<_>>().join(", ")
        };
        let claim = match outcome {
            BoxOutcome::Proved(margin) => claim.decided(
                Verdict::Proved,
                margin,
                format!("{}, relative margin {}, {cells} cells", self.name, at_least(margin)),
            ),
            BoxOutcome::Fails { at: rho, broken } => {
                let margin = broken.map_or(f64::NAN, |(_, value)| value);
                claim.decided(Verdict::Undecided, margin, format!("its condition fails at {}", at(&rho)))
            }
            BoxOutcome::Open { at: rho } => {
                let detail = format!("open at {}: too close to the edge to be told with {cells} cells", at(&rho));
                claim.decided(Verdict::Undecided, f64::NAN, detail)
            }
        };
        Claim { cells, seconds: started.elapsed().as_secs_f64(), ..claim }
    }
}
