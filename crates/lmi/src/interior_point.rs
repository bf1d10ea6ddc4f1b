//! The primal-dual interior-point iteration: Mehrotra's predictor-corrector with the HKM direction from an infeasible start.
//!
//! Helmberg, Rendl, Vanderbei and Wolkowicz (SIAM J. Optim. 6, 1996); Kojima, Shindoh and Hara (SIAM J. Optim. 7, 1997); Borchers (CSDP,
//! Optim. Methods Softw. 11, 1999). The direction does not change when a block is replaced by a congruent one
//! or the unknowns by linear combinations, so that scaling matters for the starting point and the stopping rule only.

mod certificate;
pub(crate) mod extended;
mod refinement;

use crate::answer::{InaccurateReason, IterationLog, Residuals};
use crate::assembly::Assembly;
use crate::block::{Block, Program};
use crate::dense::{Scratch, dot, norm};
use crate::direction::BlockState;
use crate::lanczos::Lanczos;
use crate::schur::Schur;
use crate::{Options, start};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// A point whose relative gap is still larger than this is well inside.
const BACK_OFF: f64 = 1e-6;
/// Largest relative gap of a point that is called solved, and what the dual residual may take from it.
pub(crate) const SOLVED_GAP: f64 = 1e-7;
const SOLVED_UNCERTAINTY: f64 = 1e-6;
/// An optimum smaller than this is to be told to [`SOLVED_GAP`] of itself, which so many more iterations may be spent on.
const SMALL: f64 = 1e-2;
const MORE: usize = 3;
/// Dual residual of multipliers that are kept for proofs, against the tolerance.
const INNER: f64 = 1e-2;
/// Relative gap at which a point is kept for neighbouring problems to begin at.
const CENTRAL: f64 = 3e-2;
/// Iterations without progress, and those after which the iteration in more digits carries on if it can.
const PATIENCE: usize = 15;
const LITTLE_PATIENCE: usize = 4;
/// Steps after which a point is well inside.
const EVEN: f64 = 0.5;
/// Where x still grows by this factor in each of so many last iterations, as the gap closes or until no progress is made, no x attains the
/// optimum: close to one that is attained x hardly moves.
const GROWTH: f64 = 1.1;
const GROWING: usize = 4;
/// Where the gap closes all the same, the point is as good as optimal unless x has grown by this factor since the gap was this small.
const UNATTAINED: f64 = 2e4;
const NEAR: f64 = 1e-2;
/// A multiplier is a witness of infeasibility when its residual is this small against the dual objective: rounding level.
const CERTIFICATE: f64 = 1e-14;
/// From here on it is tried to complete a multiplier to an exact witness.
const NEAR_CERTIFICATE: f64 = 1e-3;
/// Dual residual of a direction from which on it is suspected to be noise.
const NOISE: f64 = 1e-6;
/// Where regularisation of such a direction begins, relative to the diagonal of M, and ends.
const LEAST_REGULARIZATION: f64 = 1e-15;
const MOST_REGULARIZATION: f64 = 1e-11;

/// A point of the iteration.
#[derive(Clone, Debug, Default)]
pub(crate) struct Point {
    pub x: Vec<f64>,
    pub z: Vec<Vec<f64>>,
}

/// A point on the way, well inside: where the iteration of a neighbouring problem may begin.
#[derive(Clone, Debug, Default)]
pub(crate) struct Centre {
    pub x: Vec<f64>,
    pub s: Vec<Vec<f64>>,
    pub z: Vec<Vec<f64>>,
}

impl Centre {
    /// Whether the point has the shape of a program.
    pub fn fits(&self, program: &Program) -> bool {
        let blocks = &program.blocks;
        let of = |matrices: &[Vec<f64>]| {
            matrices.len() == blocks.len() && matrices.iter().zip(blocks).all(|(m, b)| m.len() == b.constant().len())
        };
        self.x.len() == program.objective.len() && of(&self.s) && of(&self.z)
    }
}

/// How the iteration ended.
#[derive(Clone, Debug)]
pub(crate) enum Ending {
    Converged,
    /// The point's multipliers exclude every x.
    PrimalInfeasible,
    /// The objective falls for ever along this direction of x.
    DualInfeasible(Vec<f64>),
    Stopped(InaccurateReason),
}

/// The last or best point, and how it was reached.
#[derive(Debug)]
pub(crate) struct Solution {
    pub point: Point,
    pub ending: Ending,
    pub residuals: Residuals,
    pub dual_objective: f64,
    /// A strictly feasible x not far from the optimum, to back off to.
    pub interior: Option<Vec<f64>>,
    /// Multipliers not far from the optimum that are well inside and met the dual equations.
    pub inner: Option<Vec<Vec<f64>>>,
    /// Where a neighbouring problem may begin.
    pub centre: Option<Centre>,
    /// The last point before rounding errors told, in the units of the program that was solved: where more digits may carry on.
    pub sound: Option<Centre>,
    /// Sensible units of the unknowns.
    pub units: Vec<f64>,
    pub log: Vec<IterationLog>,
}

/// Everything the iteration works on.
struct Iteration<'a> {
    operators: &'a [Block],
    /// The operators' unknowns are sᵢ times those of the iteration.
    scale: &'a [f64],
    /// What counts as 1 in the objective.
    unit: f64,
    /// Unknowns as the operators take them.
    unscaled: Vec<f64>,
    objective: &'a [f64],
    options: &'a Options,
    blocks: Vec<BlockState>,
    x: Vec<f64>,
    /// A(Z).
    az: Vec<f64>,
    assembly: Assembly,
    schur: Schur,
    /// The matrix of A(F(y)), factorised when first needed.
    gram: Option<Schur>,
    scratch: Scratch,
    lanczos: Lanczos,
    right_side: Vec<f64>,
    dx: Vec<f64>,
    change: Vec<f64>,
    /// Σ of block sizes.
    order: f64,
    /// Whether S = F(x) exactly.
    feasible: bool,
    constant_norms: Vec<f64>,
    objective_norm: f64,
}

/// Where a point stands.
#[derive(Clone, Copy, Debug)]
struct Status {
    objective: f64,
    dual_objective: f64,
    residuals: Residuals,
    mu: f64,
}

impl Status {
    /// An iteration as it begins, before its step is known.
    fn begins(&self) -> IterationLog {
        IterationLog {
            objective: self.objective,
            dual_objective: self.dual_objective,
            residuals: self.residuals,
            complementarity: self.mu,
            centring: 0.0,
            primal_step: 0.0,
            dual_step: 0.0,
        }
    }

    /// At most 1 for a point that may be called solved.
    fn merit(&self, options: &Options) -> f64 {
        let Residuals { primal, dual, gap, uncertainty } = self.residuals;
        let feasibility = nan_max(primal, dual) / options.feasibility_tolerance;
        let merit = nan_max(feasibility, nan_max(gap / SOLVED_GAP, uncertainty / SOLVED_UNCERTAINTY));
        if merit.is_nan() { f64::INFINITY } else { merit }
    }

    /// Whether the gap is closed against the objectives themselves, where they are small against the unit.
    fn resolves(&self, unit: f64) -> bool {
        let size = self.objective.abs() + self.dual_objective.abs();
        size >= SMALL * unit || self.residuals.gap * (unit + size) <= SOLVED_GAP * size
    }
}

/// Solves a program in the solver's form.
///
/// A direction without end says nothing about whether there is a feasible point to start from: where the iteration has not seen
/// one, a second one without objective decides between infeasible and unbounded.
pub(crate) fn solve(program: &Program, options: &Options) -> Solution {
    let started = Instant::now();
    let solution = iterate(program, &program.objective, options, started);
    let unseen = solution.residuals.primal > options.feasibility_tolerance;
    if matches!(solution.ending, Ending::DualInfeasible(_)) && unseen {
        let zero = vec![0.0; program.objective.len()];
        let feasibility = iterate(program, &zero, options, started);
        match feasibility.ending {
            Ending::PrimalInfeasible => return feasibility,
            Ending::Converged => {
                return Solution { point: feasibility.point, ..solution };
            }
            _ => {}
        }
    }
    solution
}

fn iterate(program: &Program, objective: &[f64], options: &Options, started: Instant) -> Solution {
    let mut it = Iteration::new(program, objective, options);
    if let Some(centre) = &program.warm {
        it.begin_at(centre);
    }
    let mut log: Vec<IterationLog> = Vec::new();
    let mut best: Option<(f64, Status)> = None;
    let mut point = Point::default();
    let (mut since_progress, mut more) = (0, 0);
    let mut best_witness = f64::INFINITY;
    let mut interior = None;
    let mut inner = None;
    let mut centre = None;
    let mut sound = None;
    let mut even = false;
    // ‖x‖ of every iteration.
    let mut sizes: Vec<f64> = Vec::new();
    let ending = loop {
        it.update_residuals();
        let status = it.status();
        let merit = status.merit(options);
        let improves = best.as_ref().is_none_or(|(best, ..)| merit < *best);
        let much = best.as_ref().is_none_or(|(best, ..)| merit < 0.9 * best);
        if improves {
            best = Some((merit, status));
            it.copy_point(&mut point);
        }
        log.push(status.begins());
        let Residuals { primal, dual, gap, uncertainty } = status.residuals;
        if it.feasible && gap > BACK_OFF {
            copy(&it.x, interior.get_or_insert_default());
        }
        if dual <= INNER * options.feasibility_tolerance && gap > BACK_OFF && gap <= CENTRAL {
            it.copy_multipliers(inner.get_or_insert_default());
        }
        if it.feasible && gap <= CENTRAL && centre.is_none() {
            centre = Some(it.centre());
        }
        if it.feasible && even && gap <= CENTRAL && dual <= options.feasibility_tolerance && uncertainty <= gap {
            it.copy_centre(sound.get_or_insert_default());
        }
        sizes.push(norm(&it.x));
        let tolerance = options.feasibility_tolerance;
        let certain = uncertainty <= options.gap_tolerance * SOLVED_UNCERTAINTY / SOLVED_GAP;
        if primal <= tolerance && dual <= tolerance && gap <= options.gap_tolerance && certain {
            if more == MORE || it.objective_norm == 0.0 || status.resolves(it.unit) {
                break Ending::Converged;
            }
            more += 1;
        }
        let witness = it.witness_residual(&status);
        if witness <= CERTIFICATE || (witness <= NEAR_CERTIFICATE && it.complete_witness()) {
            best = Some((merit, status));
            it.copy_point(&mut point);
            break Ending::PrimalInfeasible;
        }
        if let Some(ray) = it.ray(&status) {
            best = Some((merit, status));
            it.copy_point(&mut point);
            break Ending::DualInfeasible(ray);
        }
        since_progress = if much || witness < 0.9 * best_witness { 0 } else { since_progress + 1 };
        best_witness = best_witness.min(witness);
        let patience = if best.as_ref().is_some_and(|(merit, ..)| *merit <= 1.0) { 1 } else { PATIENCE };
        let in_vain = since_progress == LITTLE_PATIENCE && sound.is_some() && extended::takes(program);
        if since_progress > patience || in_vain {
            break Ending::Stopped(InaccurateReason::Stalled);
        }
        if let Some(reason) = it.interrupted(log.len(), started) {
            break Ending::Stopped(reason);
        }
        match it.step(&status) {
            Some((centring, primal_step, dual_step)) => {
                even = primal_step.min(dual_step) >= EVEN;
                if let Some(entry) = log.last_mut() {
                    (entry.centring, entry.primal_step, entry.dual_step) = (centring, primal_step, dual_step);
                }
            }
            None => break Ending::Stopped(InaccurateReason::Stalled),
        }
    };
    let solved = best.as_ref().is_some_and(|(merit, ..)| *merit <= 1.0);
    let ending = match ending {
        Ending::Stopped(_) if solved => Ending::Converged,
        Ending::Stopped(InaccurateReason::Stalled) => match it.ray_in_null_space() {
            Some(ray) => Ending::DualInfeasible(ray),
            None => ending,
        },
        other => other,
    };
    let ending = match ending {
        Ending::Converged | Ending::Stopped(InaccurateReason::Stalled)
            if unattained(&log, &sizes, &ending, options) =>
        {
            Ending::Stopped(InaccurateReason::NotAttained)
        }
        other => other,
    };
    // Every course has a first point.
    let status = best.map_or_else(|| it.status(), |(_, status)| status);
    let units = program.scale.clone();
    let Status { residuals, dual_objective, .. } = status;
    Solution { point, ending, residuals, dual_objective, interior, inner, centre, sound, units, log }
}

/// Whether the objective came closer to its bound only as x grew, from the norms of x in each iteration.
fn unattained(log: &[IterationLog], sizes: &[f64], ending: &Ending, options: &Options) -> bool {
    let within = |gap: f64| {
        let feasible = |r: &Residuals| r.primal <= options.feasibility_tolerance && r.gap <= gap;
        log.iter().position(|entry| feasible(&entry.residuals))
    };
    // Where the gap has closed, rounding errors may carry x on.
    let last = within(SOLVED_GAP).unwrap_or(log.len() - 1);
    let Some(first) = within(NEAR).or_else(|| within(1.0)) else { return false };
    let grows = last >= GROWING && sizes[last - GROWING..=last].windows(2).all(|w| w[1] > GROWTH * w[0]);
    grows && (!matches!(ending, Ending::Converged) || sizes[last] > UNATTAINED * sizes[first])
}

impl<'a> Iteration<'a> {
    fn new(program: &'a Program, objective: &'a [f64], options: &'a Options) -> Self {
        let unknowns = objective.len();
        let operators = &program.blocks[..];
        let starts = start::start(program, objective);
        let blocks: Vec<BlockState> =
            operators.iter().zip(starts).map(|(block, (s, z))| BlockState::new(block, unknowns, &s, &z)).collect();
        let largest = operators.iter().filter(|b| !b.is_diagonal()).map(|b| b.size()).max().unwrap_or(1);
        Self {
            operators,
            scale: &program.scale,
            unit: program.omega.min(1.0),
            unscaled: vec![0.0; unknowns],
            objective,
            options,
            x: vec![0.0; unknowns],
            az: vec![0.0; unknowns],
            assembly: Assembly::new(operators),
            schur: Schur::new(unknowns),
            gram: None,
            scratch: Scratch::new(largest),
            lanczos: Lanczos::new(largest),
            right_side: vec![0.0; unknowns],
            dx: vec![0.0; unknowns],
            change: vec![0.0; unknowns],
            order: blocks.iter().map(|b| b.n as f64).sum(),
            feasible: false,
            constant_norms: operators.iter().map(|b| norm(b.constant())).collect(),
            objective_norm: objective.iter().fold(0.0, |m, c| m.max(c.abs())),
            blocks,
        }
    }

    /// Begins at a point of a neighbouring problem, if it is positive definite.
    fn begin_at(&mut self, centre: &Centre) {
        let before: Vec<(Vec<f64>, Vec<f64>)> = self.blocks.iter().map(|b| (b.s.clone(), b.z.clone())).collect();
        let pairs = centre.s.iter().zip(&centre.z);
        let scratch = &mut self.scratch;
        if self.blocks.iter_mut().zip(pairs).all(|(state, (s, z))| state.begin(s, z, scratch)) {
            self.x.copy_from_slice(&centre.x);
            // Where F(x) is positive definite it takes the place of S at once.
            self.feasible = true;
            return;
        }
        for (state, (s, z)) in self.blocks.iter_mut().zip(&before) {
            state.begin(s, z, scratch);
        }
    }

    fn centre(&self) -> Centre {
        let mut centre = Centre::default();
        self.copy_centre(&mut centre);
        centre
    }

    fn copy_centre(&self, to: &mut Centre) {
        copy(&self.x, &mut to.x);
        to.s.resize_with(self.blocks.len(), Vec::new);
        to.s.iter_mut().zip(&self.blocks).for_each(|(to, block)| copy(&block.s, to));
        self.copy_multipliers(&mut to.z);
    }

    fn copy_point(&self, to: &mut Point) {
        copy(&self.x, &mut to.x);
        self.copy_multipliers(&mut to.z);
    }

    fn copy_multipliers(&self, to: &mut Vec<Vec<f64>>) {
        to.resize_with(self.blocks.len(), Vec::new);
        to.iter_mut().zip(&self.blocks).for_each(|(to, block)| copy(&block.z, to));
    }

    /// R = F(x) − S, closed exactly as soon as F(x) itself is positive definite; A(Z).
    fn update_residuals(&mut self) {
        let mut closed = true;
        product(self.scale, &self.x, &mut self.unscaled);
        for (state, block) in self.blocks.iter_mut().zip(self.operators) {
            state.update_residual(block, &self.unscaled);
        }
        let worst = self.primal_residual();
        if self.feasible || worst <= 1e-7 {
            for state in &mut self.blocks {
                closed &= state.close_residual(&mut self.scratch);
            }
            self.feasible = closed;
        }
        self.az.fill(0.0);
        for (state, block) in self.blocks.iter_mut().zip(self.operators) {
            block.adjoint(1.0, &state.z, &mut self.az, &mut state.operator);
        }
        scale_by(self.scale, &mut self.az);
    }

    fn primal_residual(&self) -> f64 {
        let relative = self.blocks.iter().zip(&self.constant_norms).map(|(b, c)| norm(&b.residual) / (1.0 + c));
        relative.fold(0.0, nan_max)
    }

    fn dual_residual(&self) -> f64 {
        let differences = self.objective.iter().zip(&self.az).map(|(c, a)| (c - a).abs());
        differences.fold(0.0, nan_max) / (1.0 + self.objective_norm)
    }

    fn status(&self) -> Status {
        let objective = dot(self.objective, &self.x);
        let dual_objective =
            -self.operators.iter().zip(&self.blocks).map(|(b, s)| dot(b.constant(), &s.z)).sum::<f64>();
        let complementarity: f64 = self.blocks.iter().map(|b| dot(&b.s, &b.z)).sum();
        // d ≤ p* + Σ|cᵢ − A(Z)ᵢ||xᵢ*|: with large x, small residuals spoil the bound.
        let differences = self.objective.iter().zip(&self.az).map(|(c, a)| c - a);
        let uncertainty: f64 = differences.zip(&self.x).map(|(difference, x)| (difference * x).abs()).sum();
        let scale = self.unit + objective.abs() + dual_objective.abs();
        let residuals = Residuals {
            primal: self.primal_residual(),
            dual: self.dual_residual(),
            gap: (objective - dual_objective).abs() / scale,
            uncertainty: uncertainty / scale,
        };
        Status { objective, dual_objective, residuals, mu: complementarity / self.order }
    }

    fn interrupted(&self, iterations: usize, started: Instant) -> Option<InaccurateReason> {
        let cancelled = |flag: &std::sync::Arc<std::sync::atomic::AtomicBool>| flag.load(Ordering::Relaxed);
        if self.options.cancel.as_ref().is_some_and(cancelled) {
            return Some(InaccurateReason::Cancelled);
        }
        if self.options.time_limit.is_some_and(|limit| started.elapsed() >= limit) {
            return Some(InaccurateReason::TimeLimit);
        }
        (iterations > self.options.max_iterations).then_some(InaccurateReason::IterationLimit)
    }

    /// One predictor-corrector step: (centring, primal step, dual step), or `None` when no step can be taken.
    fn step(&mut self, status: &Status) -> Option<(f64, f64, f64)> {
        self.blocks.iter_mut().for_each(|state| state.invert(&mut self.scratch));
        self.assemble(|state| [&state.s_inverse, &state.z]);
        let (mut sigma, mut primal, mut dual, mut left);
        let mut regularization = 0.0;
        loop {
            if !self.schur.factorize(regularization) {
                return None;
            }
            (sigma, primal, dual) = self.predict_and_correct(status);
            left = self.refine();
            // A direction that misses the dual equations by more than they are missed now is noise: M is factorised
            // again, a little further from singular.
            let bad = left.is_nan() || left > NOISE.max(2.0 * status.residuals.dual);
            if !bad || regularization >= MOST_REGULARIZATION {
                break;
            }
            regularization = (100.0 * self.schur.regularization).max(LEAST_REGULARIZATION);
        }
        self.project(left);
        let fraction = 0.9 + 0.098 * primal.min(dual);
        // As accurate as what is left to the boundary: close to the optimum the step decides how far the gap falls.
        let (primal, dual) = self.longest_steps(0.5 * (1.0 - fraction));
        let (primal, dual) = ((fraction * primal).min(1.0), (fraction * dual).min(1.0));
        let primal = self.safeguard(primal, BlockState::try_primal)?;
        let dual = self.safeguard(dual, BlockState::try_dual)?;
        self.blocks.iter_mut().for_each(|state| state.advance(primal, dual));
        crate::dense::axpy(primal, &self.dx, &mut self.x);
        Some((sigma, primal, dual))
    }

    /// M ← Σ_b tr(F_i P F_j Z) for the P and Z that every block gives.
    fn assemble(&mut self, factors: fn(&BlockState) -> [&Vec<f64>; 2]) {
        let unknowns = self.x.len();
        self.schur.clear();
        for (index, (state, block)) in self.blocks.iter_mut().zip(self.operators).enumerate() {
            let mut operator = std::mem::take(&mut state.operator);
            let [p, z] = factors(state);
            block.schur(index, [p, z], &mut self.assembly, &mut self.schur.matrix, unknowns, &mut operator);
            state.operator = operator;
        }
        self.assembly.add(&mut self.schur.matrix, unknowns);
        self.schur.scale_by(self.scale);
    }

    /// The predictor, then the corrector's direction: (centring, primal step, dual step of the predictor).
    fn predict_and_correct(&mut self, status: &Status) -> (f64, f64, f64) {
        let feasible = self.feasible;
        self.blocks.iter_mut().for_each(|state| state.begin_predictor(feasible, &mut self.scratch));
        self.direction();
        let (primal, dual) = self.longest_steps(0.3);
        let (primal, dual) = (primal.min(1.0), dual.min(1.0));
        let reached: f64 = self.blocks.iter().map(|b| b.complementarity(primal, dual)).sum::<f64>() / self.order;
        let ratio = (reached / status.mu).clamp(0.0, 1.0);
        let exponent = (3.0 * primal.min(dual).powi(2)).max(1.0);
        let sigma = ratio.powf(exponent).clamp(1e-6, 1.0);
        self.blocks.iter_mut().for_each(|state| state.begin_corrector(sigma * status.mu, &mut self.scratch));
        self.direction();
        (sigma, primal, dual)
    }

    /// dx, dS and dZ for the right side that the blocks hold. What the predictor tells needs few digits, and the corrector is refined against
    /// the equations themselves.
    fn direction(&mut self) {
        self.right_side.fill(0.0);
        for (state, block) in self.blocks.iter_mut().zip(self.operators) {
            state.add_right_side(block, &mut self.right_side);
        }
        scale_by(self.scale, &mut self.right_side);
        crate::dense::axpy(-1.0, self.objective, &mut self.right_side);
        self.schur.solve_once(&self.right_side, &mut self.dx);
        product(self.scale, &self.dx, &mut self.unscaled);
        for (state, block) in self.blocks.iter_mut().zip(self.operators) {
            state.complete(block, &self.unscaled, self.feasible, &mut self.scratch);
        }
    }

    fn longest_steps(&mut self, accuracy: f64) -> (f64, f64) {
        let (mut primal, mut dual) = (f64::INFINITY, f64::INFINITY);
        for state in &self.blocks {
            let (p, d) = state.longest_steps(&mut self.lanczos, accuracy);
            (primal, dual) = (primal.min(p), dual.min(d));
        }
        (primal, dual)
    }

    /// Shortens a step until every block stays positive definite.
    fn safeguard(&mut self, mut step: f64, attempt: fn(&mut BlockState, f64, &mut Scratch) -> bool) -> Option<f64> {
        for _ in 0..40 {
            if step < 1e-9 {
                return None;
            }
            if self.blocks.iter_mut().all(|state| attempt(state, step, &mut self.scratch)) {
                return Some(step);
            }
            step *= 0.8;
        }
        None
    }
}

fn copy(from: &[f64], to: &mut Vec<f64>) {
    to.clear();
    to.extend_from_slice(from);
}

/// v ← s∘v.
fn scale_by(s: &[f64], v: &mut [f64]) {
    v.iter_mut().zip(s).for_each(|(v, s)| *v *= s);
}

/// out ← s∘v.
fn product(s: &[f64], v: &[f64], out: &mut [f64]) {
    out.iter_mut().zip(v).zip(s).for_each(|((out, v), s)| *out = v * s);
}

/// The larger one, or NaN when either is.
fn nan_max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
