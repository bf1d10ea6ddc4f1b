//! Balancing: every block is replaced by `D F D` and every unknown by `xᵢ = sᵢ x̃ᵢ`, with D diagonal, and the objective by a
//! multiple, so that the coefficients of the problem are about 1.
//!
//! All factors are powers of two, so that nothing is rounded, and are undone after solving: `x = s∘x̃`, `Z = D Z̃ D / ω`. They are
//! the least-squares solution of `log dᵢ + log dⱼ + log s_k + log|F_k,ij| = 0` over all nonzero entries (`s₀ = 1` for the known
//! part), after Curtis and Reid (J. Inst. Math. Appl. 10, 1972). Unlike equilibration by the largest entry this solution is
//! unique up to what does not matter, and a problem stated in other units gives the same balanced one.

use crate::Options;
use crate::answer::{Balancing, InaccurateReason, Residuals};
use crate::block::Program;
use crate::interior_point::{self, Ending, Solution};
use std::borrow::Cow;
use std::time::Instant;

/// Rounds of conjugate gradients for the logarithms of the factors, which need no more than one digit.
const ROUNDS: usize = 40;
/// Binary orders of magnitude below the median at which a scaled entry is a rounding error rather than a coefficient, and how
/// often such are sought.
const OUTLIER: f64 = 30.0;
const OUTLIER_PASSES: usize = 4;
/// Rows, unknowns and costs that differ more than this in size are balanced from the beginning.
const WIDE: f64 = 1e5;
/// Relative gap at which a stalled iteration is worth another attempt.
const FAR_OFF: f64 = 1e-4;
/// Largest exponent of a factor: what can be squared and multiplied without overflow.
const MOST: f64 = 120.0;
/// Largest binary exponent of a coefficient that is taken for what it says.
const EXTREME: f64 = 400.0;

/// `dᵢ dⱼ s_k |F_k,ij|` is to be 1.
#[derive(Clone, Copy, Debug)]
struct Equation {
    /// Those of dᵢ, dⱼ and s_k among the variables; of the known part the place behind the last one, whose s is 1.
    places: [u32; 3],
    /// log₂|F_k,ij|.
    log: f64,
}

/// Factors of one problem.
struct Factors {
    /// The diagonal of D, block after block.
    rows: Vec<f64>,
    unknowns: Vec<f64>,
    /// log₂ of both, and of the 1 that the known part is multiplied by.
    logs: Vec<f64>,
}

/// Solves a program with the margin of each block, balanced where its data or the course of the iteration ask for it.
///
/// Most problems are stated in sensible units, and the iteration does well on them as they are. It begins with the balanced
/// problem where rows or unknowns differ widely in size, and turns to the other form where it stalls far from the end.
/// Margins are tiny and have no say in what the balanced program looks like.
pub(crate) fn solve(mut program: Program, margins: &[f64], options: &Options) -> (Solution, Balancing) {
    let equations = equations(&program);
    let before = range(&equations);
    let untouched = Balancing { before, after: before };
    let wide = spread(&program, &equations) > WIDE;
    program.blocks.iter_mut().zip(margins).for_each(|(block, margin)| block.subtract(*margin));
    let mut factors = None;
    let mut with_units = |mut solution: Solution, program: &Program| {
        // What the multipliers of an infeasible problem exclude is told in the units of the balanced one.
        if matches!(solution.ending, Ending::PrimalInfeasible) {
            solution.units = factors.get_or_insert_with(|| self::factors(program, &equations)).unknowns.clone();
        }
        solution
    };
    let started = Instant::now();
    let plain = (!wide).then(|| {
        let solution = with_units(interior_point::solve(&program, options), &program);
        if far_off(&solution, options) { solution } else { carried_on(&program, options, solution, started) }
    });
    let plain = match plain {
        Some(solution) if !far_off(&solution, options) => return (solution, untouched),
        other => other,
    };
    let factors = factors.unwrap_or_else(|| self::factors(&program, &equations));
    let after = range_after(&equations, &factors);
    let balanced = solve_scaled(&mut program, &factors, options);
    match (plain, balanced) {
        (None, Some(balanced)) if !far_off(&balanced, options) => (balanced, Balancing { before, after }),
        (None, Some(balanced)) => {
            unscale_program(&mut program, &factors);
            let mut plain = interior_point::solve(&program, options);
            plain.units = factors.unknowns;
            if closer(&plain, &balanced) { (plain, untouched) } else { (balanced, Balancing { before, after }) }
        }
        (Some(plain), Some(balanced)) if closer(&balanced, &plain) => (balanced, Balancing { before, after }),
        (Some(plain), _) => (plain, untouched),
        (None, None) => (interior_point::solve(&program, options), untouched),
    }
}

/// Solves a program, balanced, in more digits from the beginning: for what looked infeasible or unbounded and is not proved to be. `None` where that leads nowhere.
pub(crate) fn solve_in_more_digits(
    mut program: Program,
    margins: &[f64],
    options: &Options,
) -> Option<(Solution, Balancing)> {
    let equations = equations(&program);
    let factors = factors(&program, &equations);
    let balancing = Balancing { before: range(&equations), after: range_after(&equations, &factors) };
    program.blocks.iter_mut().zip(margins).for_each(|(block, margin)| block.subtract(*margin));
    program.warm = None;
    let omega = apply(&mut program, &factors)?;
    let solution = interior_point::extended::solve(&program, options, None, Instant::now())?;
    Some((unscaled(&program, &factors, omega, solution), balancing))
}

/// The solution in more digits where rounding errors stopped the iteration; as it was where that does not help.
fn carried_on(program: &Program, options: &Options, solution: Solution, started: Instant) -> Solution {
    if !matches!(solution.ending, Ending::Stopped(InaccurateReason::Stalled)) {
        return solution;
    }
    match interior_point::extended::solve(program, options, Some(&solution), started) {
        Some(further) if closer(&further, &solution) => further,
        _ => solution,
    }
}

/// Whether the iteration gave up far from an answer.
fn far_off(solution: &Solution, options: &Options) -> bool {
    let Residuals { primal, dual, gap, .. } = solution.residuals;
    let near = primal.max(dual) <= 10.0 * options.feasibility_tolerance && gap <= FAR_OFF;
    matches!(solution.ending, Ending::Stopped(InaccurateReason::Stalled | InaccurateReason::NotAttained)) && !near
}

/// Whether the first of two solutions is the better one.
fn closer(a: &Solution, b: &Solution) -> bool {
    let stalled = |s: &Solution| matches!(s.ending, Ending::Stopped(_));
    let distance = |s: &Solution| s.residuals.primal.max(s.residuals.dual).max(s.residuals.gap);
    match (stalled(a), stalled(b)) {
        (false, true) => true,
        (true, false) => false,
        _ => distance(a) < distance(b),
    }
}

/// Scales the program, solves it, and gives the solution in the units of the program as it was; `None` where scaling overflows.
fn solve_scaled(program: &mut Program, factors: &Factors, options: &Options) -> Option<Solution> {
    let omega = apply(program, factors)?;
    let started = Instant::now();
    let solution = interior_point::solve(program, options);
    let solution = carried_on(program, options, solution, started);
    Some(unscaled(program, factors, omega, solution))
}

/// A solution of the scaled program in the units of the program as it was.
fn unscaled(program: &Program, factors: &Factors, omega: f64, mut solution: Solution) -> Solution {
    let unscale = |x: &mut Vec<f64>| x.iter_mut().zip(&factors.unknowns).for_each(|(x, s)| *x *= s);
    unscale(&mut solution.point.x);
    solution.interior.iter_mut().for_each(unscale);
    if let Ending::DualInfeasible(ray) = &mut solution.ending {
        unscale(ray);
    }
    let divided = |d: f64, value: f64| value * d / omega;
    scale_matrices(program, factors, &mut solution.point.z, divided);
    if let Some(inner) = &mut solution.inner {
        scale_matrices(program, factors, inner, divided);
    }
    if let Some(centre) = &mut solution.centre {
        unscale(&mut centre.x);
        scale_matrices(program, factors, &mut centre.s, |d, value| value / d);
        scale_matrices(program, factors, &mut centre.z, divided);
    }
    solution.dual_objective /= omega;
    for entry in &mut solution.log {
        entry.objective /= omega;
        entry.dual_objective /= omega;
    }
    solution
}

/// Gives every entry of every block's matrix to `scaled` with its factor dᵢdⱼ.
fn scale_matrices(program: &Program, factors: &Factors, matrices: &mut [Vec<f64>], scaled: impl Fn(f64, f64) -> f64) {
    let mut first = 0;
    for (block, matrix) in program.blocks.iter().zip(matrices) {
        let n = block.size();
        let d = &factors.rows[first..first + n];
        first += n;
        for (at, value) in matrix.iter_mut().enumerate() {
            let (i, j) = if block.is_diagonal() { (at, at) } else { (at % n, at / n) };
            *value = scaled(d[i] * d[j], *value);
        }
    }
}

/// Undoes what [`apply`] did.
fn unscale_program(program: &mut Program, factors: &Factors) {
    let mut first = 0;
    for block in &mut program.blocks {
        let inverse: Vec<f64> = factors.rows[first..first + block.size()].iter().map(|d| 1.0 / d).collect();
        first += block.size();
        block.scale(&inverse);
    }
    let omega = program.omega;
    program.objective.iter_mut().zip(&factors.unknowns).for_each(|(c, s)| *c /= s * omega);
    program.scale.fill(1.0);
    (program.omega, program.balanced) = (1.0, false);
    program.warm = None;
}

/// By how much rows and unknowns differ in size: the ratio of the largest to the smallest of their largest coefficients.
fn spread(program: &Program, equations: &[Equation]) -> f64 {
    let rows: usize = program.blocks.iter().map(|block| block.size()).sum();
    let unknowns = rows + program.objective.len();
    // Rows of the coefficient matrices, unknowns, rows of the known parts.
    let mut largest = vec![f64::NEG_INFINITY; unknowns + rows];
    for e in equations {
        let [i, j, k] = e.places.map(|at| at as usize);
        let places = if k < unknowns { [i, j, k] } else { [unknowns + i, unknowns + j, unknowns + j] };
        places.into_iter().for_each(|at| largest[at] = largest[at].max(e.log));
    }
    let costs = program.objective.iter().map(|c| c.abs().log2()).fold(f64::NEG_INFINITY, f64::max);
    let known = || largest.iter().copied().chain([costs]).filter(|log| log.is_finite());
    let (least, most) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
    (most - least).exp2()
}

fn equations(program: &Program) -> Vec<Equation> {
    let rows: usize = program.blocks.iter().map(|block| block.size()).sum();
    let scales: Vec<f64> = program.scale.iter().map(|s| s.log2()).collect();
    let (mut out, mut first) = (Vec::new(), 0);
    for block in &program.blocks {
        block.entries(&mut |i, j, unknown, value| {
            if value == 0.0 {
                return;
            }
            let scale = unknown.map_or(0.0, |unknown| scales[unknown]);
            let log = if value.abs() == 1.0 { scale } else { value.abs().log2() + scale };
            if log.is_finite() {
                let unknown = rows + unknown.unwrap_or(program.objective.len());
                out.push(Equation { places: [first + i, first + j, unknown].map(|at| at as u32), log });
            }
        });
        first += block.size();
    }
    out
}

/// Smallest and largest coefficient.
fn range(equations: &[Equation]) -> (f64, f64) {
    let smallest = equations.iter().map(|e| e.log).fold(f64::INFINITY, f64::min);
    let largest = equations.iter().map(|e| e.log).fold(f64::NEG_INFINITY, f64::max);
    if equations.is_empty() { (0.0, 0.0) } else { (smallest.exp2(), largest.exp2()) }
}

/// The same of the scaled problem.
fn range_after(equations: &[Equation], factors: &Factors) -> (f64, f64) {
    let scaled = |e: &Equation| Equation { log: e.log + scaling_log(e, factors), ..*e };
    range(&equations.iter().map(scaled).collect::<Vec<_>>())
}

/// Least squares without the entries that stay far below 1 however the others are scaled: sin π of a basis function is a
/// zero that rounding left, and its logarithm would pull all factors its way.
fn factors(program: &Program, equations: &[Equation]) -> Factors {
    let mut kept = Cow::Borrowed(equations);
    for _ in 0..OUTLIER_PASSES {
        let factors = least_squares(program, &kept);
        let scaled = |e: &Equation| e.log + scaling_log(e, &factors);
        let mut logs: Vec<f64> = kept.iter().map(scaled).collect();
        let middle = logs.len() / 2;
        let median = if logs.is_empty() { 0.0 } else { *logs.select_nth_unstable_by(middle, f64::total_cmp).1 };
        let outlying = |e: &Equation| scaled(e) < median - OUTLIER;
        if !kept.iter().any(outlying) {
            return factors;
        }
        kept.to_mut().retain(|e| !outlying(e));
    }
    least_squares(program, &kept)
}

/// log₂ of what an entry is multiplied by.
fn scaling_log(e: &Equation, factors: &Factors) -> f64 {
    let [i, j, k] = e.places.map(|at| factors.logs[at as usize]);
    i + j + k
}

/// The least-squares solution by conjugate gradients on the normal equations, preconditioned by their diagonal.
fn least_squares(program: &Program, equations: &[Equation]) -> Factors {
    let rows: usize = program.blocks.iter().map(|block| block.size()).sum();
    // The last one stays zero.
    let n = rows + program.objective.len() + 1;
    let (mut diagonal, mut residual) = (vec![0.0; n], vec![0.0; n]);
    for e in equations {
        let [i, j, k] = e.places.map(|at| at as usize);
        diagonal[i] += if i == j { 4.0 } else { 1.0 };
        diagonal[j] += if i == j { 0.0 } else { 1.0 };
        diagonal[k] += 1.0;
        e.places.into_iter().for_each(|at| residual[at as usize] -= e.log.clamp(-EXTREME, EXTREME));
    }
    (diagonal[n - 1], residual[n - 1]) = (0.0, 0.0);
    let precondition =
        |r: &[f64]| -> Vec<f64> { r.iter().zip(&diagonal).map(|(r, d)| if *d > 0.0 { r / d } else { 0.0 }).collect() };
    let (mut v, mut image) = (vec![0.0; n], vec![0.0; n]);
    let mut direction = precondition(&residual);
    let mut size = crate::dense::dot(&residual, &direction);
    let start = size;
    for _ in 0..ROUNDS {
        if size <= 1e-8 * start || size <= 1e-6 {
            break;
        }
        image.fill(0.0);
        for e in equations {
            let [i, j, k] = e.places.map(|at| at as usize);
            let sum = direction[i] + direction[j] + direction[k];
            image[i] += sum;
            image[j] += sum;
            image[k] += sum;
        }
        image[n - 1] = 0.0;
        let step = size / crate::dense::dot(&direction, &image);
        if !step.is_finite() {
            break;
        }
        crate::dense::axpy(step, &direction, &mut v);
        crate::dense::axpy(-step, &image, &mut residual);
        let next = precondition(&residual);
        let last = std::mem::replace(&mut size, crate::dense::dot(&residual, &next));
        direction.iter_mut().zip(next).for_each(|(d, n)| *d = n + size / last * *d);
    }
    for (at, v) in v.iter_mut().enumerate() {
        let most = if at < rows { MOST } else { 2.0 * MOST };
        *v = v.round().clamp(-most, most);
    }
    let powers = |logs: &[f64]| logs.iter().map(|log| log.exp2()).collect();
    Factors { rows: powers(&v[..rows]), unknowns: powers(&v[rows..n - 1]), logs: v }
}

/// Scales the program and gives the factor ω of the objective; `None`, and the program as it was, when that would overflow.
fn apply(program: &mut Program, factors: &Factors) -> Option<f64> {
    let (mut first, mut sound) = (0, true);
    for block in &program.blocks {
        let d = &factors.rows[first..first + block.size()];
        block.entries(&mut |i, j, unknown, value| {
            let scaled = value * d[i] * d[j] * unknown.map_or(1.0, |k| factors.unknowns[k]);
            sound &= value == 0.0 || scaled.abs() < 1e150;
        });
        first += block.size();
    }
    let costs = program.objective.iter().zip(&factors.unknowns).map(|(c, s)| (c * s).abs());
    let largest = costs.fold(0.0, f64::max);
    if !sound || !largest.is_finite() {
        return None;
    }
    let omega = if largest > 0.0 { (-largest.log2().round()).clamp(-900.0, 900.0).exp2() } else { 1.0 };
    first = 0;
    for block in &mut program.blocks {
        let n = block.size();
        block.scale(&factors.rows[first..first + n]);
        first += n;
    }
    program.objective.iter_mut().zip(&factors.unknowns).for_each(|(c, s)| *c *= s * omega);
    program.scale.copy_from_slice(&factors.unknowns);
    (program.omega, program.balanced) = (omega, true);
    if let Some(mut warm) = program.warm.take() {
        warm.x.iter_mut().zip(&factors.unknowns).for_each(|(x, s)| *x /= s);
        scale_matrices(program, factors, &mut warm.s, |d, value| value * d);
        scale_matrices(program, factors, &mut warm.z, |d, value| value * omega / d);
        program.warm = Some(warm);
    }
    Some(omega)
}
