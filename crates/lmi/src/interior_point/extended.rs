//! The iteration in double-double arithmetic, for small problems that rounding errors stop.
//!
//! Close to an optimum where x is not unique, M has eigenvalues of size 1/μ and of size μ, and in `f64` the dual equations are lost
//! before the gap is closed; so they are where the multipliers have no interior, and where the optimum is far larger than the data there may not even be a feasible point. Here the
//! same predictor-corrector steps are taken with twice the digits: from the last point of the other iteration that rounding had not touched, from one well inside that it came
//! through, or from its starting point. Scaling by powers of two does not help against rounding: the steps would be the same to the bit.
//!
//! There is no detection of infeasible problems and no structure: entry by entry, everything dense. What comes out is rounded to `f64` and measured again.

mod matrix;
mod operator;

use super::{
    BACK_OFF, CENTRAL, Centre, Ending, INNER, MORE, Point, SOLVED_GAP, SOLVED_UNCERTAINTY, Solution, Status, nan_max,
    unattained,
};
use crate::answer::{InaccurateReason, IterationLog, Residuals};
use crate::block::Program;
use crate::double_double::{self as dd, Double};
use crate::{Mat, Options, start};
use matrix::{Matrix, dot};
use operator::{Operator, Place, Workspace, operators};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Most multiplications for one iteration: a few tenths of a second.
const MOST_WORK: f64 = 1e8;
/// What is added to the unit diagonal of M where its factorisation does not exist: the least, the factor, the most.
const REGULARIZATION: [f64; 3] = [1e-31, 4.0, 1e-14];
/// What S and Z of the starting point are multiplied by, one after the other: where the optimum is far larger than the data, steps from a small start get
/// nowhere.
const STARTS: [[f64; 2]; 2] = [[1.0, 1.0], [1e4, 1e8]];
/// Rounds of refinement of one direction at most.
const REFINEMENTS: usize = 10;
/// What is missed after that, at best.
const REFINED: f64 = 1e-10;
/// Iterations without progress.
const PATIENCE: usize = 15;
/// Merit of a point that is worth more than none.
const WORTH: f64 = 1e2;
/// A gap that falls by less than this factor in so many iterations is closed as far as need be, and not as far as asked for.
const SLOW: f64 = 0.1;
const FEW: usize = 3;
/// Primal residual from which on S is replaced by F(x).
const CLOSE: f64 = 1e-7;

/// One block.
struct State {
    n: usize,
    s: Matrix,
    z: Matrix,
    /// F(x) − S.
    residual: Matrix,
    /// Inverses of the Cholesky factors of S and Z, and of S itself.
    s_factor: Matrix,
    z_factor: Matrix,
    s_inverse: Matrix,
    ds: Matrix,
    dz: Matrix,
    g: Matrix,
    work: [Matrix; 2],
    workspace: Workspace,
}

impl State {
    fn new(operator: &Operator, s: &[f64], z: &[f64]) -> Self {
        let n = operator.n;
        let zero = || Matrix::zeros(n * n);
        Self {
            n,
            s: Matrix::of(s),
            z: Matrix::of(z),
            residual: zero(),
            s_factor: zero(),
            z_factor: zero(),
            s_inverse: zero(),
            ds: zero(),
            dz: zero(),
            g: zero(),
            work: [zero(), zero()],
            workspace: operator.workspace(),
        }
    }

    /// Factors of S and Z; false where one of them is not definite.
    fn factorize(&mut self) -> bool {
        let Self { n, s, z, s_factor, z_factor, s_inverse, work: [factor, transposed], .. } = self;
        for (of, to) in [(s, &mut *s_factor), (z, z_factor)] {
            factor.copy_from(of);
            if !matrix::cholesky(*n, factor) {
                return false;
            }
            matrix::inverse_of_factor(*n, factor, to);
        }
        matrix::inverse(*n, s_factor, transposed, s_inverse);
        true
    }

    /// −sym(A B Z), or sym(A B Z) added to what is in `to`, for symmetric B.
    fn triple(n: usize, a: &Matrix, b: &Matrix, z: &Matrix, work: &mut Matrix, to: &mut Matrix) {
        matrix::multiply(n, a, b, work);
        matrix::multiply(n, work, z, to);
        to.symmetrize(n);
    }

    /// G ← −sym(P R Z) + σμ P − sym(P dS dZ), the last two where there is a predictor.
    fn right_side(&mut self, feasible: bool, sigma_mu: Option<f64>) {
        let Self { n, z, residual, s_inverse, ds, dz, g, work: [work, product], .. } = self;
        let minus = Double { h: -1.0, l: 0.0 };
        g.fill_zero();
        if !feasible {
            Self::triple(*n, s_inverse, residual, z, work, product);
            g.add_multiple(minus, product);
        }
        if let Some(sigma_mu) = sigma_mu {
            g.add_multiple(Double { h: sigma_mu, l: 0.0 }, s_inverse);
            Self::triple(*n, s_inverse, ds, dz, work, product);
            g.add_multiple(minus, product);
        }
    }

    /// dS and dZ from dx.
    fn complete(&mut self, operator: &Operator, dx: &Matrix) {
        let Self { n, z, residual, s_inverse, ds, dz, g, work: [work, product], .. } = self;
        let (one, minus) = (Double { h: 1.0, l: 0.0 }, Double { h: -1.0, l: 0.0 });
        ds.fill_zero();
        operator.apply(dx, ds);
        Self::triple(*n, s_inverse, ds, z, work, product);
        dz.copy_from(g);
        dz.add_multiple(minus, z);
        dz.add_multiple(minus, product);
        ds.add_multiple(one, residual);
    }

    /// dS and dZ for a change of dx.
    fn refine(&mut self, operator: &Operator, change: &Matrix, of_z: bool) {
        let Self { n, z, s_inverse, ds, dz, work: [work, product], .. } = self;
        let mut moved = Matrix::zeros(*n * *n);
        operator.apply(change, &mut moved);
        if of_z {
            Self::triple(*n, z, &moved, z, work, product);
            dz.add_multiple(Double { h: 1.0, l: 0.0 }, product);
            return;
        }
        ds.add_multiple(Double { h: 1.0, l: 0.0 }, &moved);
        Self::triple(*n, s_inverse, &moved, z, work, product);
        dz.add_multiple(Double { h: -1.0, l: 0.0 }, product);
    }

    /// The longest steps that keep S and Z semidefinite.
    fn longest_steps(&mut self) -> [f64; 2] {
        let Self { n, s_factor, z_factor, ds, dz, work: [work, product], .. } = self;
        [(&*s_factor, &*ds), (&*z_factor, &*dz)].map(|(factor, step)| {
            // (L⁻¹D)(L⁻¹)ᵀ.
            matrix::multiply(*n, factor, step, work);
            matrix::multiply(*n, work, factor, product);
            let smallest = smallest_eigenvalue(*n, product);
            if smallest >= 0.0 { f64::INFINITY } else { -1.0 / smallest }
        })
    }

    /// ⟨S + α dS, Z + β dZ⟩.
    fn complementarity(&self, alpha: f64, beta: f64) -> f64 {
        let Self { s, z, ds, dz, .. } = self;
        dot(s, z).h + alpha * dot(ds, z).h + beta * dot(s, dz).h + alpha * beta * dot(ds, dz).h
    }

    /// Whether M + step·D is definite.
    fn stays(&mut self, dual: bool, step: f64) -> bool {
        let Self { n, s, z, ds, dz, work: [work, _], .. } = self;
        let (m, d) = if dual { (z, dz) } else { (s, ds) };
        work.copy_from(m);
        work.add_multiple(Double { h: step, l: 0.0 }, d);
        matrix::cholesky(*n, work)
    }
}

/// x ← s∘x for powers of two.
fn scaled(x: &mut Matrix, scale: &[f64]) {
    x.h.iter_mut().zip(&mut x.l).zip(scale).for_each(|((h, l), s)| (*h, *l) = (*h * s, *l * s));
}

fn smallest_eigenvalue(n: usize, m: &Matrix) -> f64 {
    if n == 1 {
        return m.h[0];
    }
    let m = Mat::from_fn(n, n, |i, j| m.h[i.max(j) + i.min(j) * n]);
    crate::verification::Spectrum::of(&m).smallest
}

struct Iteration<'a> {
    operators: &'a [Operator],
    states: Vec<State>,
    objective: &'a [f64],
    objective_norm: f64,
    constant_norms: Vec<f64>,
    unit: f64,
    x: Matrix,
    dx: Matrix,
    /// c − A(Z).
    misses: Matrix,
    /// M, and its factor.
    assembled: Matrix,
    m: Matrix,
    /// What the last factorisation took.
    regularization: f64,
    /// Powers of two that bring the diagonal of M near 1.
    scale: Vec<f64>,
    order: f64,
    feasible: bool,
}

/// The solution of a program that the iteration in `f64` did not get far enough with, if it did anything; `None` where this one does not either, or
/// would take too long. A point that is nearly solved, or no longer once it is rounded to `f64`, is given as one that stalled.
pub(crate) fn solve(
    program: &Program,
    options: &Options,
    stopped: Option<&Solution>,
    started: Instant,
) -> Option<Solution> {
    let (operators, places) = operators(program);
    if !within_reach(program, &operators) {
        return None;
    }
    let centre = stopped.and_then(|stopped| stopped.sound.as_ref().or(stopped.centre.as_ref()));
    let starts = if centre.is_some() { &STARTS[..1] } else { &STARTS[..] };
    let before = stopped.map_or(&[][..], |stopped| &stopped.log);
    let mut log = Vec::new();
    let solve_from = |&factors: &[f64; 2]| {
        let it = Iteration::new(program, &operators, &places, centre, factors);
        let most = options.max_iterations.saturating_sub(before.len() + log.len());
        iterate(it, &places, most, options, started, &mut log)
    };
    let Solved { ending, point, residuals, dual_objective, interior, inner } = starts.iter().find_map(solve_from)?;
    Some(Solution {
        point,
        ending,
        residuals,
        dual_objective,
        interior,
        inner,
        centre: stopped.and_then(|stopped| stopped.centre.clone()),
        sound: None,
        units: program.scale.clone(),
        log: before.iter().copied().chain(log).collect(),
    })
}

/// A point, rounded to `f64`, that is solved or nearly so, with what is known of it.
struct Solved {
    ending: Ending,
    point: Point,
    residuals: Residuals,
    dual_objective: f64,
    interior: Option<Vec<f64>>,
    inner: Option<Vec<Vec<f64>>>,
}

fn iterate(
    mut it: Iteration<'_>,
    places: &[Place],
    most: usize,
    options: &Options,
    started: Instant,
    log: &mut Vec<IterationLog>,
) -> Option<Solved> {
    let first = log.len();
    let mut sizes = Vec::new();
    let (mut interior, mut inner, mut best_point) = (None, None, None);
    let (mut best, mut since_progress, mut more) = ([f64::INFINITY; 3], 0, 0);
    loop {
        it.update_residuals();
        let status = it.status();
        // Against what the equations are made of: the coefficients are about 1.
        let against = (1.0 + it.objective_norm) / (1.0 + it.objective_norm + it.largest_multiplier());
        let Residuals { primal, dual, gap, uncertainty } = status.residuals;
        let dual = dual * against;
        log.push(status.begins());
        sizes.push(it.x.norm());
        if it.feasible && gap > BACK_OFF {
            interior = Some(it.x.h.clone());
        }
        if dual <= INNER * options.feasibility_tolerance && gap > BACK_OFF && gap <= CENTRAL {
            inner = Some(it.multipliers(places));
        }
        let merit = Status { residuals: Residuals { dual, ..status.residuals }, ..status }.merit(options);
        if merit <= best[0].min(WORTH) {
            best_point = Some(it.copy());
        }
        let progress_of = |best: f64, now: f64| now < 0.9 * best;
        let improves = progress_of(best[0], merit);
        best[0] = best[0].min(merit);
        let certain = uncertainty <= options.gap_tolerance * SOLVED_UNCERTAINTY / SOLVED_GAP;
        let tolerance = options.feasibility_tolerance;
        if primal <= tolerance && dual <= tolerance && gap <= options.gap_tolerance && certain {
            if more == MORE || it.objective_norm == 0.0 || status.resolves(it.unit) {
                break;
            }
            more += 1;
        }
        // Without an interior the gap closes slowly to the end.
        let slow = sizes.len() > FEW && gap > SLOW * log[log.len() - 1 - FEW].residuals.gap;
        if slow && merit <= 0.5 && certain {
            break;
        }
        // Far from feasible, the gap grows for a while.
        let now = [primal.max(tolerance), dual.max(tolerance)];
        let progress = improves || now.iter().zip(&best[1..]).any(|(now, best)| progress_of(*best, *now));
        since_progress = if progress { 0 } else { since_progress + 1 };
        best[1..].iter_mut().zip(now).for_each(|(best, now)| *best = best.min(now));
        let cancelled = options.cancel.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed));
        let late = options.time_limit.is_some_and(|limit| started.elapsed() >= limit);
        if cancelled || late {
            return None;
        }
        let patience = if best[0] <= 1.0 { 1 } else { PATIENCE };
        if since_progress > patience || sizes.len() > most {
            break;
        }
        let Some((centring, primal_step, dual_step)) = it.step(&status) else { break };
        if let Some(entry) = log.last_mut() {
            (entry.centring, entry.primal_step, entry.dual_step) = (centring, primal_step, dual_step);
        }
    }
    it.take(best_point?);
    // What is given away is rounded, and so are its residuals. By how much that misses the dual equations depends on the units of Z; what it is worth
    // against x says the uncertainty.
    it.round();
    it.update_residuals();
    let status = it.status();
    let worth = Status { residuals: Residuals { dual: 0.0, ..status.residuals }, ..status };
    if unattained(&log[first..], &sizes, &Ending::Converged, options) {
        return None;
    }
    let solved = best[0] <= 1.0 && worth.merit(options) <= 1.0;
    Some(Solved {
        ending: if solved { Ending::Converged } else { Ending::Stopped(InaccurateReason::Stalled) },
        point: Point { x: it.x.h.clone(), z: it.multipliers(places) },
        residuals: status.residuals,
        dual_objective: status.dual_objective,
        interior,
        inner,
    })
}

/// Whether the iteration in more digits takes on a program.
pub(super) fn takes(program: &Program) -> bool {
    within_reach(program, &operators(program).0)
}

fn within_reach(program: &Program, operators: &[Operator]) -> bool {
    let unknowns = program.objective.len() as f64;
    operators.iter().map(Operator::work).sum::<f64>() + unknowns.powi(3) / 6.0 <= MOST_WORK
}

impl<'a> Iteration<'a> {
    fn new(
        program: &'a Program,
        operators: &'a [Operator],
        places: &[Place],
        centre: Option<&Centre>,
        factors: [f64; 2],
    ) -> Self {
        let unknowns = program.objective.len();
        let diagonals = match centre {
            Some(_) => Vec::new(),
            None => start::start(program, &program.objective),
        };
        let mut states = Vec::with_capacity(operators.len());
        for (block, place) in places.iter().enumerate() {
            for (row, operator) in operators[place.first..place.first + place.count].iter().enumerate() {
                let n = operator.n;
                let [s, z] = match centre {
                    Some(Centre { s, z, .. }) if place.count == 1 && n > 1 => [s[block].clone(), z[block].clone()],
                    Some(Centre { s, z, .. }) => [vec![s[block][row]], vec![z[block][row]]],
                    None => {
                        let (s, z) = &diagonals[block];
                        [(s, factors[0]), (z, factors[1])].map(|(d, factor)| {
                            let mut m = vec![0.0; n * n];
                            (0..n).for_each(|i| m[i + i * n] = factor * d[row + i]);
                            m
                        })
                    }
                };
                states.push(State::new(operator, &s, &z));
            }
        }
        Self {
            constant_norms: operators.iter().map(|o| o.constant.norm()).collect(),
            order: operators.iter().map(|o| o.n as f64).sum(),
            operators,
            states,
            objective: &program.objective,
            objective_norm: program.objective.iter().fold(0.0, |m, c| m.max(c.abs())),
            unit: program.omega.min(1.0),
            x: centre.map_or_else(|| Matrix::zeros(unknowns), |centre| Matrix::of(&centre.x)),
            dx: Matrix::zeros(unknowns),
            misses: Matrix::zeros(unknowns),
            assembled: Matrix::zeros(unknowns * unknowns),
            m: Matrix::zeros(unknowns * unknowns),
            regularization: 0.0,
            scale: vec![0.0; unknowns],
            feasible: centre.is_some(),
        }
    }

    /// R = F(x) − S, closed as soon as F(x) is definite; c − A(Z).
    fn update_residuals(&mut self) {
        let minus = Double { h: -1.0, l: 0.0 };
        for (state, operator) in self.states.iter_mut().zip(self.operators) {
            state.residual.copy_from(&operator.constant);
            operator.apply(&self.x, &mut state.residual);
            state.residual.add_multiple(minus, &state.s);
        }
        if self.feasible || self.primal_residual() <= CLOSE {
            self.feasible = true;
            for state in &mut self.states {
                let State { n, s, residual, work: [value, factor], .. } = state;
                value.copy_from(s);
                value.add_multiple(Double { h: 1.0, l: 0.0 }, residual);
                factor.copy_from(value);
                if matrix::cholesky(*n, factor) {
                    s.copy_from(value);
                    residual.fill_zero();
                } else {
                    self.feasible = false;
                }
            }
        }
        self.misses.h.copy_from_slice(self.objective);
        self.misses.l.fill(0.0);
        for (state, operator) in self.states.iter().zip(self.operators) {
            operator.adjoint(-1.0, &state.z, &mut self.misses);
        }
    }

    fn largest_multiplier(&self) -> f64 {
        self.states.iter().flat_map(|state| &state.z.h).fold(0.0, |m, z| m.max(z.abs()))
    }

    fn primal_residual(&self) -> f64 {
        let relative = self.states.iter().zip(&self.constant_norms).map(|(s, c)| s.residual.norm() / (1.0 + c));
        relative.fold(0.0, nan_max)
    }

    fn status(&self) -> Status {
        let objective = dot(&Matrix::of(self.objective), &self.x).h;
        let known = |(o, s): (&Operator, &State)| dot(&o.constant, &s.z);
        let dual_objective = -self.operators.iter().zip(&self.states).map(known).fold(Double::default(), dd::add).h;
        let complementarity: f64 = self.states.iter().map(|s| dot(&s.s, &s.z).h).sum();
        let uncertainty: f64 = self.misses.h.iter().zip(&self.x.h).map(|(miss, x)| (miss * x).abs()).sum();
        let scale = self.unit + objective.abs() + dual_objective.abs();
        let dual = self.misses.h.iter().fold(0.0, |m: f64, miss| nan_max(m, miss.abs())) / (1.0 + self.objective_norm);
        let residuals = Residuals {
            primal: self.primal_residual(),
            dual,
            gap: (objective - dual_objective).abs() / scale,
            uncertainty: uncertainty / scale,
        };
        Status { objective, dual_objective, residuals, mu: complementarity / self.order }
    }

    fn step(&mut self, status: &Status) -> Option<(f64, f64, f64)> {
        if !self.states.iter_mut().all(State::factorize) {
            return None;
        }
        if !self.factorize(false) {
            return None;
        }
        self.direction(None);
        let [primal, dual] = self.longest_steps().map(|step| step.min(1.0));
        let reached: f64 = self.states.iter().map(|s| s.complementarity(primal, dual)).sum::<f64>() / self.order;
        let ratio = (reached / status.mu).clamp(0.0, 1.0);
        let exponent = (3.0 * primal.min(dual).powi(2)).max(1.0);
        let sigma = ratio.powf(exponent).clamp(1e-6, 1.0);
        self.direction(Some(sigma * status.mu));
        self.refine(REFINED * (1.0 + self.objective_norm));
        let fraction = 0.9 + 0.098 * primal.min(dual);
        let [primal, dual] = self.longest_steps().map(|step| (fraction * step).min(1.0));
        let primal = self.safeguard(primal, false)?;
        let dual = self.safeguard(dual, true)?;
        let [of_primal, of_dual] = [primal, dual].map(|h| Double { h, l: 0.0 });
        for state in &mut self.states {
            let State { s, z, ds, dz, .. } = state;
            s.add_multiple(of_primal, ds);
            z.add_multiple(of_dual, dz);
        }
        self.x.add_multiple(of_primal, &self.dx);
        Some((sigma, primal, dual))
    }

    /// The Cholesky factor of M, scaled, in its place.
    fn factorize(&mut self, of_z: bool) -> bool {
        let n = self.objective.len();
        let m = &mut self.assembled;
        m.fill_zero();
        for (state, operator) in self.states.iter_mut().zip(self.operators) {
            let State { s_inverse, z, workspace, .. } = state;
            operator.schur(if of_z { &*z } else { &*s_inverse }, z, n, m, workspace);
        }
        for (i, scale) in self.scale.iter_mut().enumerate() {
            let entry = m.h[i + i * n];
            if !entry.is_finite() {
                return false;
            }
            *scale = if entry > 0.0 { (-0.5 * entry.log2()).round().exp2() } else { 0.0 };
        }
        for j in 0..n {
            for i in j..n {
                let factor = self.scale[i] * self.scale[j];
                let entry = m.get(i + j * n);
                m.set(i + j * n, Double { h: factor * entry.h, l: factor * entry.l });
            }
            if self.scale[j] == 0.0 {
                m.set(j + j * n, Double { h: 1.0, l: 0.0 });
            }
        }
        let [least, factor, most] = REGULARIZATION;
        // What was too little before is not tried again, but for one step.
        let mut regularization = self.regularization / factor;
        if regularization < least {
            regularization = 0.0;
        }
        loop {
            self.m.copy_from(m);
            for j in 0..n {
                let at = j + j * n;
                self.m.set(at, dd::add(self.m.get(at), Double { h: regularization, l: 0.0 }));
            }
            if matrix::cholesky(n, &mut self.m) {
                self.regularization = regularization;
                return true;
            }
            regularization = if regularization == 0.0 { least } else { factor * regularization };
            if regularization > most {
                return false;
            }
        }
    }

    /// dx, dS and dZ.
    fn direction(&mut self, sigma_mu: Option<f64>) {
        let n = self.objective.len();
        let feasible = self.feasible;
        self.dx.h.copy_from_slice(self.objective);
        self.dx.l.fill(0.0);
        self.dx.h.iter_mut().for_each(|c| *c = -*c);
        for (state, operator) in self.states.iter_mut().zip(self.operators) {
            state.right_side(feasible, sigma_mu);
            operator.adjoint(1.0, &state.g, &mut self.dx);
        }
        scaled(&mut self.dx, &self.scale);
        matrix::solve(n, &self.m, &mut self.dx);
        scaled(&mut self.dx, &self.scale);
        for (state, operator) in self.states.iter_mut().zip(self.operators) {
            state.complete(operator, &self.dx);
        }
    }

    /// What Z + dZ misses the dual equations by.
    fn miss(&self, miss: &mut Matrix) -> f64 {
        miss.h.copy_from_slice(self.objective);
        miss.l.fill(0.0);
        for (state, operator) in self.states.iter().zip(self.operators) {
            operator.adjoint(-1.0, &state.z, miss);
            operator.adjoint(-1.0, &state.dz, miss);
        }
        miss.h.iter().fold(0.0, |m: f64, v| nan_max(m, v.abs()))
    }

    /// Moves Z + dZ onto the dual equations A(Z + dZ) = c: by refinement of the direction, and where that does not get far, by Z F(y) Z.
    fn refine(&mut self, enough: f64) {
        let n = self.objective.len();
        let (mut miss, mut change) = (Matrix::zeros(n), Matrix::zeros(n));
        let mut last = f64::INFINITY;
        for of_z in [false, true] {
            if of_z && !self.factorize(true) {
                return;
            }
            for _ in 0..REFINEMENTS {
                let size = self.miss(&mut miss);

                if size.is_nan() || size <= enough {
                    return;
                }
                if size > 0.9 * last {
                    break;
                }
                last = size;
                // dZ − sym(P F(y) Z) meets them for My = A(Z + dZ) − c, with Z in place of P the other way round.
                let sign = if of_z { 1.0 } else { -1.0 };
                for at in 0..n {
                    change.set(at, Double { h: sign * miss.h[at], l: sign * miss.l[at] });
                }
                scaled(&mut change, &self.scale);
                matrix::solve(n, &self.m, &mut change);
                scaled(&mut change, &self.scale);
                if !of_z {
                    self.dx.add_multiple(Double { h: 1.0, l: 0.0 }, &change);
                }
                for (state, operator) in self.states.iter_mut().zip(self.operators) {
                    state.refine(operator, &change, of_z);
                }
            }
            last = f64::INFINITY;
        }
    }

    fn longest_steps(&mut self) -> [f64; 2] {
        let steps = self.states.iter_mut().map(State::longest_steps);
        steps.fold([f64::INFINITY; 2], |[p, d], [primal, dual]| [p.min(primal), d.min(dual)])
    }

    /// Shortens a step until every block stays definite.
    fn safeguard(&mut self, mut step: f64, dual: bool) -> Option<f64> {
        for _ in 0..40 {
            if step.is_nan() || step < 1e-9 {
                return None;
            }
            if self.states.iter_mut().all(|state| state.stays(dual, step)) {
                return Some(step);
            }
            step *= 0.8;
        }
        None
    }

    /// x and each S and Z.
    fn copy(&self) -> (Matrix, Vec<[Matrix; 2]>) {
        (self.x.clone(), self.states.iter().map(|state| [state.s.clone(), state.z.clone()]).collect())
    }

    fn take(&mut self, (x, blocks): (Matrix, Vec<[Matrix; 2]>)) {
        self.x = x;
        self.states.iter_mut().zip(blocks).for_each(|(state, [s, z])| (state.s, state.z) = (s, z));
    }

    /// x and Z to the precision of `f64`.
    fn round(&mut self) {
        self.x.l.fill(0.0);
        self.states.iter_mut().for_each(|state| state.z.l.fill(0.0));
    }

    /// Z in the blocks of the program.
    fn multipliers(&self, places: &[Place]) -> Vec<Vec<f64>> {
        let of = |place: &Place| {
            let states = &self.states[place.first..place.first + place.count];
            states.iter().flat_map(|state| state.z.h.iter().copied()).collect()
        };
        places.iter().map(of).collect()
    }
}
