//! From the solver's point to an answer: every claim is recomputed on the data as they were stated.

mod infeasible;
mod optimum;
mod unbounded;

use crate::answer::{Answer, Balancing, BlockReport, InaccurateReason, Outcome, Tolerance};
use crate::expression::Unknown;
use crate::interior_point::{Ending, SOLVED_GAP, Solution};
use crate::lowering::Layout;
use crate::multiplier::Multiplier;
use crate::rigorous::{Enclosure, SumOfProducts};
use crate::verification::{Spectrum, square};
use crate::{Mat, Options};
use optimum::{Bracket, Optimal, bracket};
use unbounded::Endless;

/// A problem as it was stated: `F_b(x) = C_b + Σ xᵢ F_{b,i}`, objective `constant + sign · cᵀx`.
pub(crate) trait Original {
    /// Name, size and margin of each block.
    fn blocks(&self) -> Vec<BlockReport>;
    /// F_b at the unknowns given, margins not subtracted. A diagonal block comes as a column.
    fn value(&self, block: usize, values: &[Mat<f64>]) -> Mat<f64>;
    /// F_b at the unknowns given, with bounds on its entries.
    fn enclosure(&self, block: usize, values: &[Mat<f64>]) -> Enclosure;
    /// ⟨C_b, Z⟩, with a bound on its error.
    fn known_product(&self, block: usize, z: &Mat<f64>) -> SumOfProducts;
    /// The change of F_b along a direction, with bounds on its entries: F_b(d) − F_b(0).
    fn change(&self, block: usize, direction: &[Mat<f64>]) -> Enclosure;
    /// Whether a block is stated by its diagonal.
    fn is_diagonal(&self, block: usize) -> bool;
    /// Whether F_b(0) and the margin that was given are zero.
    fn is_homogeneous(&self, block: usize) -> bool;
    /// Gives (row, column, unknown or known part, value) to `sink`; what is given of one entry and unknown adds up to its coefficient, each
    /// value rounded once or twice. Entries of the lower triangle.
    fn entries(&self, block: usize, sink: &mut dyn FnMut(usize, usize, Option<usize>, f64));
    /// The objective at the unknowns given, in the sense stated.
    fn objective(&self, values: &[Mat<f64>]) -> f64;
    /// The same with a bound on its error.
    fn objective_enclosure(&self, values: &[Mat<f64>]) -> (f64, f64);
    /// The change of the objective along a direction, in the sense stated, with a bound on its error.
    fn slope(&self, direction: &[Mat<f64>]) -> (f64, f64);
    /// Whether there is an objective that is not constant.
    fn has_objective(&self) -> bool;
    /// For each of the scalar unknowns, whether it stands in the objective.
    fn in_objective(&self, unknowns: usize) -> Vec<bool>;
    /// Proved upper bounds on `|Σ_b⟨F_{b,i}, Z_b⟩|`, or on `|Σ_b⟨F_{b,i}, Z_b⟩ − cᵢ|` for c of the minimised objective.
    fn gradient_bounds(&self, multipliers: &[Multiplier], with_objective: bool) -> Vec<f64>;
    /// Whether the margin of a block stands for a strict inequality.
    fn strict(&self, block: usize) -> bool;
    /// How far below its margin the smallest eigenvalue of a block may be for a point that is called solved to tolerance.
    fn tolerance(&self, block: usize, spectrum: &Spectrum) -> f64;
}

/// What the translation back needs besides the original.
pub(crate) struct Translation<'a> {
    pub layout: &'a Layout,
    pub unknowns: &'a [Unknown],
    pub objective_constant: f64,
    /// 1 to minimise, −1 to maximise.
    pub sign: f64,
}

/// Recomputes blocks, witnesses and rays from the original data and gives the outcome they support.
pub(crate) fn report(
    original: &dyn Original,
    translation: &Translation<'_>,
    result: Solution,
    balancing: Balancing,
    options: &Options,
) -> Answer {
    let mut values = translation.layout.matrices(&result.point.x);
    let (mut blocks, mut proof) = verify(original, &values);
    if let (false, Ending::Converged, Some(interior)) = (proof.proved, &result.ending, &result.interior) {
        // Rounding put the optimum outside: back off as far as the gap allows.
        let inside = translation.layout.matrices(interior);
        let (here, there) = (original.objective(&values), original.objective(&inside));
        let share = (BACK_OFF * (1.0 + 2.0 * here.abs()) / (there - here).abs()).min(1.0);
        let between: Vec<Mat<f64>> = values.iter().zip(&inside).map(|(x, y)| x + share * (y - x)).collect();
        let (backed_off, inner) = verify(original, &between);
        if inner.proved {
            (values, blocks, proof) = (between, backed_off, inner);
        }
    }
    let multipliers = squares(&result.point.z, &blocks);
    let stated = |objective: f64| translation.objective_constant + translation.sign * objective;
    let dual_objective = stated(result.dual_objective);
    let mut residuals = result.residuals;
    let distance = |objective: f64| (objective - dual_objective).abs();
    let relative = |objective: f64| distance(objective) / (1.0 + objective.abs() + dual_objective.abs());
    let unverified = Outcome::Inaccurate(InaccurateReason::NotVerified);
    let mut bounds = Bracket { bound: None, attained: None };
    let outcome = match result.ending {
        Ending::Converged => {
            let objective = original.objective(&values);
            residuals.gap = residuals.gap.max(relative(objective));
            let converged = objective.is_finite() && residuals.gap <= SOLVED_GAP;
            if converged && proof.tolerated {
                let inner = result.inner.as_ref().map(|z| squares(z, &blocks));
                let feasible = proof.proved;
                let point = Optimal { values: &values, multipliers: &multipliers, inner, feasible };
                bounds = bracket(original, translation, &blocks, &point);
                let gap = bounds.gap(translation.sign);
                let for_all = bounds.bound.is_some_and(|bound| bound.reach.is_infinite());
                let solved = proof.proved && for_all && gap <= PROVED_GAP;
                let tolerance = Tolerance { violation: proof.violation, gap };
                if solved { Outcome::Solved } else { Outcome::SolvedToTolerance(tolerance) }
            } else {
                unverified
            }
        }
        Ending::PrimalInfeasible => {
            infeasible::infeasible(original, &blocks, &multipliers, &result.units).unwrap_or(unverified)
        }
        Ending::DualInfeasible(direction) => {
            match unbounded::unbounded(original, translation, &blocks, &values, &direction, options) {
                Some(Endless { outcome, point }) => {
                    if let Some(point) = point {
                        (values, blocks) = point;
                    }
                    outcome
                }
                None => unverified,
            }
        }
        Ending::Stopped(reason) => Outcome::Inaccurate(reason),
    };
    let objective = original.objective(&values);
    let gap = distance(objective);
    let mut iterations = result.log;
    for entry in &mut iterations {
        entry.objective = stated(entry.objective);
        entry.dual_objective = stated(entry.dual_objective);
    }
    Answer {
        outcome,
        objective,
        dual_objective,
        gap,
        optimum_bound: bounds.bound,
        attained: bounds.attained,
        blocks,
        balancing,
        residuals,
        iterations,
        multipliers,
        centre: result.centre,
        unknowns: translation.unknowns.to_vec(),
        values,
    }
}

/// Blocks of the solver as square matrices.
fn squares(z: &[Vec<f64>], blocks: &[BlockReport]) -> Vec<Mat<f64>> {
    z.iter().zip(blocks).map(|(z, block)| square(z, block.size)).collect()
}

/// Relative change of the objective that backing off may cost.
const BACK_OFF: f64 = 3e-8;

/// Largest relative distance of the two proved bounds on the optimum of what is called solved.
const PROVED_GAP: f64 = 1e-5;

/// What is proved of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proof {
    /// Every block is at least its margin, a strict inequality's positive definite.
    pub proved: bool,
    /// Where not, every block misses it by what the tolerances allow.
    pub tolerated: bool,
    /// `F_b(x) ⪰ (margin_b − violation)·I` for every block.
    pub violation: f64,
}

/// The blocks at the unknowns given, and what is proved of them.
pub(crate) fn verify(original: &dyn Original, values: &[Mat<f64>]) -> (Vec<BlockReport>, Proof) {
    let mut blocks = original.blocks();
    let mut proof = Proof { proved: true, tolerated: true, violation: 0.0 };
    for (index, block) in blocks.iter_mut().enumerate() {
        let enclosure = original.enclosure(index, values);
        let spectrum = spectrum(&enclosure.approximate(), block.size);
        block.smallest_eigenvalue = spectrum.smallest;
        let mut bound = enclosure.smallest_eigenvalue_bound(&spectrum);
        let least = if original.strict(index) { 0.0 } else { block.margin };
        // The bound is within rounding of the eigenvalue; where the margin lies between, it is asked for itself.
        if bound < least && spectrum.smallest + spectrum.rounding >= least && enclosure.exceeds(least) {
            bound = least;
        }
        block.verified_lower_bound = bound;
        let holds = if original.strict(index) { bound > 0.0 } else { bound >= least };
        if !holds {
            let violation = (least - bound).max(0.0);
            proof.proved = false;
            proof.tolerated &= violation <= original.tolerance(index, &spectrum);
            proof.violation = proof.violation.max(violation);
        }
    }
    (blocks, proof)
}

/// Of a square matrix, or of a diagonal one given as a column.
fn spectrum(value: &Mat<f64>, size: usize) -> Spectrum {
    if value.ncols() == size { Spectrum::of(value) } else { Spectrum::of_diagonal(value) }
}

/// Sizes of the blocks, and the margins that are part of what is demanded: those of strict inequalities are not.
fn sizes_and_margins(original: &dyn Original, blocks: &[BlockReport]) -> (Vec<usize>, Vec<f64>) {
    let margin = |(index, block): (usize, &BlockReport)| if original.strict(index) { 0.0 } else { block.margin };
    (blocks.iter().map(|block| block.size).collect(), blocks.iter().enumerate().map(margin).collect())
}

/// `Σ_b⟨C_b − margin·I, Z_b⟩`.
struct AtZero {
    total: f64,
    /// The part that does not come from default margins.
    known: f64,
    /// Bound on the rounding errors of both sums.
    error: f64,
}

fn at_zero<'a>(
    original: &dyn Original,
    blocks: &[BlockReport],
    multipliers: impl Iterator<Item = &'a Mat<f64>>,
) -> AtZero {
    let mut sum = AtZero { total: 0.0, known: 0.0, error: 0.0 };
    for (index, (block, z)) in blocks.iter().zip(multipliers).enumerate() {
        let known = original.known_product(index, z);
        let margin = SumOfProducts::of((0..block.size).map(|i| (block.margin, z[(i, i)])));
        sum.error += known.error() + margin.error();
        let total = known.value() - margin.value();
        sum.total += total;
        sum.known += if original.strict(index) { known.value() } else { total };
        // Every block takes part in two sums of as many terms as there are blocks.
        let rounded = known.value().abs() + margin.value().abs();
        sum.error += 2.0 * (blocks.len() + 2) as f64 * f64::EPSILON * rounded;
    }
    sum
}
