//! From the solver's point to an answer: every claim is recomputed on the data as they were stated.

use crate::answer::{Answer, Balancing, BlockReport, InaccurateReason, OptimumBound, Outcome, Ray, Witness};
use crate::expression::Unknown;
use crate::interior_point::{Ending, SOLVED_GAP, Solution};
use crate::lowering::Layout;
use crate::rigorous::{Enclosure, SumOfProducts};
use crate::verification::{Spectrum, largest_entry, square};
use crate::{Mat, Options};

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
    /// The objective at the unknowns given, in the sense stated.
    fn objective(&self, values: &[Mat<f64>]) -> f64;
    /// Proved upper bounds on `|Σ_b⟨F_{b,i}, Z_b⟩ − offsetᵢ|`, the offset zero if there is none.
    fn gradient_bounds(&self, multipliers: &[Mat<f64>], offset: Option<&[f64]>) -> Vec<f64>;
    /// c of the minimised objective.
    fn costs(&self) -> &[f64];
    /// Whether the margin of a block stands for a strict inequality.
    fn strict(&self, block: usize) -> bool;
    /// By how much the smallest eigenvalue of a block of an answer must exceed zero: `None` for a strict inequality.
    fn floor(&self, block: usize, spectrum: &Spectrum) -> Option<f64>;
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
    let (mut blocks, mut verified) = verify(original, &values);
    if let (false, Ending::Converged, Some(interior)) = (verified, &result.ending, &result.interior) {
        // Rounding put the optimum outside: back off as far as the gap allows.
        let inside = translation.layout.matrices(interior);
        let (here, there) = (original.objective(&values), original.objective(&inside));
        let share = (BACK_OFF * (1.0 + 2.0 * here.abs()) / (there - here).abs()).min(1.0);
        let between: Vec<Mat<f64>> = values.iter().zip(&inside).map(|(x, y)| x + share * (y - x)).collect();
        let (backed_off, proved) = verify(original, &between);
        if proved {
            (values, blocks, verified) = (between, backed_off, true);
        }
    }
    let multipliers: Vec<Mat<f64>> =
        result.point.z.iter().zip(&blocks).map(|(z, block)| square(z, block.size)).collect();
    let stated = |objective: f64| translation.objective_constant + translation.sign * objective;
    let objective = original.objective(&values);
    let dual_objective = stated(result.dual_objective);
    let mut residuals = result.residuals;
    let gap = (objective - dual_objective).abs();
    if let Ending::Converged = result.ending {
        residuals.gap = residuals.gap.max(gap / (1.0 + objective.abs() + dual_objective.abs()));
        verified &= gap.is_finite() && objective.is_finite() && residuals.gap <= SOLVED_GAP;
    }
    let unverified = Outcome::Inaccurate(InaccurateReason::NotVerified);
    let outcome = match result.ending {
        Ending::Converged if verified => Outcome::Solved,
        Ending::Converged => unverified,
        Ending::PrimalInfeasible => {
            witness(original, &blocks, &multipliers, &result.units).map_or(unverified, Outcome::Infeasible)
        }
        Ending::DualInfeasible(direction) => {
            ray(original, translation, &blocks, &direction, options).map_or(unverified, Outcome::Unbounded)
        }
        Ending::Stopped(reason) => Outcome::Inaccurate(reason),
    };
    let optimum_bound = match outcome {
        Outcome::Solved => optimum_bound(original, translation, &blocks, &multipliers, &values),
        _ => None,
    };
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
        optimum_bound,
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

/// Relative change of the objective that backing off may cost.
const BACK_OFF: f64 = 3e-8;

/// The blocks at the unknowns given, and whether each is proved to be as positive definite as it has to be.
pub(crate) fn verify(original: &dyn Original, values: &[Mat<f64>]) -> (Vec<BlockReport>, bool) {
    let mut blocks = original.blocks();
    let mut verified = true;
    for (index, block) in blocks.iter_mut().enumerate() {
        let enclosure = original.enclosure(index, values);
        let spectrum = spectrum(&enclosure.approximate(), block.size);
        block.smallest_eigenvalue = spectrum.smallest;
        let bound = enclosure.smallest_eigenvalue_bound(&spectrum);
        block.verified_lower_bound = bound;
        verified &= match original.floor(index, &spectrum) {
            None => bound > 0.0,
            Some(floor) => bound >= floor,
        };
    }
    (blocks, verified)
}

/// Of a square matrix, or of a diagonal one given as a column.
fn spectrum(value: &Mat<f64>, size: usize) -> Spectrum {
    if value.ncols() == size { Spectrum::of(value) } else { Spectrum::of_diagonal(value) }
}

/// How much larger than the answer the points are that the bound on the optimum speaks of.
const REACH: f64 = 10.0;

/// For every x with `F_b(x) ⪰ 0`, and every Z_b ⪰ 0, `cᵀx = Σ⟨F_b(x) − C_b, Z_b⟩ + Σ(c − A(Z))ᵢxᵢ ≥ −Σ⟨C_b, Z_b⟩ − Σ|c − A(Z)|ᵢ|xᵢ|`.
fn optimum_bound(
    original: &dyn Original,
    translation: &Translation<'_>,
    blocks: &[BlockReport],
    multipliers: &[Mat<f64>],
    values: &[Mat<f64>],
) -> Option<OptimumBound> {
    let definite: Vec<Mat<f64>> = multipliers.iter().map(made_definite).collect::<Option<_>>()?;
    let at_zero = at_zero(original, blocks, &definite);
    let misses = original.gradient_bounds(&definite, Some(original.costs()));
    let largest: Vec<Mat<f64>> = values
        .iter()
        .map(|x| {
            let most = REACH * largest_entry(x);
            Mat::from_fn(x.nrows(), x.ncols(), |_, _| most)
        })
        .collect();
    let reach = translation.layout.values(&largest);
    let taken: f64 = misses.iter().zip(&reach).map(|(miss, x)| miss * x).sum();
    let least = -at_zero.known - at_zero.error - 1.001 * taken;
    let value = translation.objective_constant + translation.sign * least;
    // The last two roundings.
    let value = value - translation.sign * 4.0 * f64::EPSILON * (value.abs() + least.abs());
    value.is_finite().then_some(OptimumBound { value, reach: REACH })
}

/// Least radius of the excluded box, in the units of the balanced unknowns, that is called infeasible.
const EXCLUDED: f64 = 1e10;

/// Proves that the multipliers exclude every point within reach, and normalises them.
fn witness(original: &dyn Original, blocks: &[BlockReport], z: &[Mat<f64>], units: &[f64]) -> Option<Witness> {
    let definite: Vec<Mat<f64>> = z.iter().map(made_definite).collect::<Option<_>>()?;
    let at_zero = at_zero(original, blocks, &definite);
    if at_zero.total.is_nan() || at_zero.total >= 0.0 {
        return None;
    }
    let multipliers: Vec<Mat<f64>> = definite.iter().map(|z| symmetric(&((-1.0 / at_zero.total) * z))).collect();
    let at_zero = self::at_zero(original, blocks, &multipliers);
    // Where a default margin decides, F(x) ≻ 0 is excluded only if the known part itself has no share in the matter.
    let needs_margin = at_zero.known > -0.5 * at_zero.total.abs();
    if needs_margin && at_zero.known.abs() > 1e-14 * at_zero.magnitude {
        return None;
    }
    let bounds = original.gradient_bounds(&multipliers, None);
    let residual = bounds.iter().fold(0.0, |m: f64, g| if g.is_nan() { *g } else { m.max(*g) });
    let reach: f64 = bounds.iter().zip(units).map(|(bound, unit)| bound * unit).sum();
    let excluded_radius = 0.999 * -(at_zero.total + at_zero.error) / reach;
    let mut smallest_eigenvalue = f64::INFINITY;
    for z in &multipliers {
        smallest_eigenvalue = smallest_eigenvalue.min(Spectrum::of(z).smallest);
        if largest_entry(z) > 0.0 && !Enclosure::of_matrix(z).exceeds(0.0) {
            return None;
        }
    }
    let holds = excluded_radius >= EXCLUDED;
    holds.then_some(Witness { multipliers, residual, excluded_radius, smallest_eigenvalue })
}

/// `Σ_b⟨C_b − margin·I, Z_b⟩`.
struct AtZero {
    total: f64,
    /// The part that does not come from default margins.
    known: f64,
    /// Σ|terms| of that part.
    magnitude: f64,
    /// Bound on the rounding errors of both sums.
    error: f64,
}

fn at_zero(original: &dyn Original, blocks: &[BlockReport], z: &[Mat<f64>]) -> AtZero {
    let mut sum = AtZero { total: 0.0, known: 0.0, magnitude: 0.0, error: 0.0 };
    for (index, (block, z)) in blocks.iter().zip(z).enumerate() {
        let known = original.known_product(index, z);
        let margin = SumOfProducts::of((0..block.size).map(|i| (block.margin, z[(i, i)])));
        sum.magnitude += known.magnitude;
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

fn symmetric(m: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| 0.5 * (m[(i, j)] + m[(j, i)]))
}

/// A symmetric matrix that is proved to be positive definite (or zero), moved up by a few rounding errors if need be.
fn made_definite(z: &Mat<f64>) -> Option<Mat<f64>> {
    let mut z = symmetric(z);
    let proved = |z: &Mat<f64>| largest_entry(z) == 0.0 || Enclosure::of_matrix(z).exceeds(0.0);
    if proved(&z) {
        return Some(z);
    }
    let spectrum = Spectrum::of(&z);
    let rounding = spectrum.rounding.max(f64::EPSILON * spectrum.largest);
    for _ in 0..4 {
        if proved(&z) {
            return Some(z);
        }
        (0..z.nrows()).for_each(|i| z[(i, i)] += rounding);
    }
    None
}

/// Checks that the direction keeps every block positive semidefinite while the objective improves.
fn ray(
    original: &dyn Original,
    translation: &Translation<'_>,
    blocks: &[BlockReport],
    direction: &[f64],
    options: &Options,
) -> Option<Ray> {
    let layout = translation.layout;
    let zero = layout.matrices(&vec![0.0; layout.len()]);
    let direction = layout.matrices(direction);
    let slope = translation.sign * (original.objective(&direction) - original.objective(&zero));
    if slope.is_nan() || slope >= 0.0 {
        return None;
    }
    let direction: Vec<Mat<f64>> = direction.iter().map(|d| (-1.0 / slope) * d).collect();
    let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
    for (index, block) in blocks.iter().enumerate() {
        let change = original.value(index, &direction) - original.value(index, &zero);
        let spectrum = spectrum(&change, block.size);
        if spectrum.smallest.is_nan() {
            return None;
        }
        smallest = smallest.min(spectrum.smallest);
        largest = largest.max(spectrum.largest);
    }
    // A violation of ε means that no objective beyond 1/ε times the data's scale is excluded.
    let holds = smallest >= -options.feasibility_tolerance * largest.max(1.0);
    holds.then_some(Ray { direction, smallest_eigenvalue: smallest })
}
