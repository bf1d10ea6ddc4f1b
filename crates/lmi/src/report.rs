//! From the solver's point to an answer: every claim is recomputed on the data as they were stated.

use crate::answer::{Answer, BlockReport, InaccurateReason, Outcome, Ray, Witness};
use crate::expression::{Unknown, inner_product};
use crate::interior_point::{Ending, Solution};
use crate::lowering::Layout;
use crate::verification::{Spectrum, square};
use crate::{Mat, Options};

/// A problem as it was stated: `F_b(x) = C_b + Σ xᵢ F_{b,i}`, objective `constant + sign · cᵀx`.
pub(crate) trait Original {
    /// Name, size and margin of each block.
    fn blocks(&self) -> Vec<BlockReport>;
    /// F_b at the unknowns given, margins not subtracted. A diagonal block comes as a column.
    fn value(&self, block: usize, values: &[Mat<f64>]) -> Mat<f64>;
    /// The objective at the unknowns given, in the sense stated.
    fn objective(&self, values: &[Mat<f64>]) -> f64;
    /// The gradient of `Σ_b⟨F_b, Z_b⟩` with respect to the scalar unknowns.
    fn gradient(&self, multipliers: &[Mat<f64>]) -> Vec<f64>;
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
    options: &Options,
) -> Answer {
    let values = translation.layout.matrices(&result.point.x);
    let mut blocks = original.blocks();
    let mut verified = true;
    for (index, block) in blocks.iter_mut().enumerate() {
        let spectrum = spectrum(&original.value(index, &values), block.size);
        block.smallest_eigenvalue = spectrum.smallest;
        verified &= match original.floor(index, &spectrum) {
            None => spectrum.smallest > 0.0,
            Some(floor) => spectrum.smallest >= floor,
        };
    }
    let multipliers: Vec<Mat<f64>> =
        result.point.z.iter().zip(&blocks).map(|(z, block)| square(z, block.size)).collect();
    let unverified = Outcome::Inaccurate(InaccurateReason::NotVerified);
    let outcome = match result.ending {
        Ending::Converged if verified => Outcome::Solved,
        Ending::Converged => unverified,
        Ending::PrimalInfeasible => witness(original, translation.layout, &blocks, &multipliers, options)
            .map_or(unverified, Outcome::Infeasible),
        Ending::DualInfeasible(direction) => {
            ray(original, translation, &blocks, &direction, options).map_or(unverified, Outcome::Unbounded)
        }
        Ending::Stopped(reason) => Outcome::Inaccurate(reason),
    };
    let stated = |objective: f64| translation.objective_constant + translation.sign * objective;
    let objective = original.objective(&values);
    let dual_objective = stated(result.dual_objective);
    let mut iterations = result.log;
    for entry in &mut iterations {
        entry.objective = stated(entry.objective);
        entry.dual_objective = stated(entry.dual_objective);
    }
    Answer {
        outcome,
        objective,
        dual_objective,
        gap: (objective - dual_objective).abs(),
        blocks,
        residuals: result.residuals,
        iterations,
        multipliers,
        unknowns: translation.unknowns.to_vec(),
        values,
    }
}

/// Of a square matrix, or of a diagonal one given as a column.
fn spectrum(value: &Mat<f64>, size: usize) -> Spectrum {
    if value.ncols() == size { Spectrum::of(value) } else { Spectrum::of_diagonal(value) }
}

/// Checks that the multipliers exclude every point, and normalises them.
fn witness(
    original: &dyn Original,
    layout: &Layout,
    blocks: &[BlockReport],
    z: &[Mat<f64>],
    options: &Options,
) -> Option<Witness> {
    let zero = layout.matrices(&vec![0.0; layout.len()]);
    let mut at_zero = 0.0;
    for (index, (block, z)) in blocks.iter().zip(z).enumerate() {
        let c = original.value(index, &zero);
        let diagonal = |i: usize| {
            if c.ncols() == block.size { c[(i, i)] } else { c[(i, 0)] }
        };
        at_zero += match c.ncols() == block.size {
            true => inner_product(&c, z),
            false => (0..block.size).map(|i| diagonal(i) * z[(i, i)]).sum::<f64>(),
        };
        at_zero -= (0..block.size).map(|i| block.margin * z[(i, i)]).sum::<f64>();
    }
    if at_zero.is_nan() || at_zero >= 0.0 {
        return None;
    }
    let multipliers: Vec<Mat<f64>> = z.iter().map(|z| (-1.0 / at_zero) * z).collect();
    let residual =
        original.gradient(&multipliers).iter().fold(0.0, |m: f64, g| if g.is_nan() { *g } else { m.max(g.abs()) });
    let smallest_eigenvalue = multipliers.iter().map(|z| Spectrum::of(z).smallest).fold(f64::INFINITY, f64::min);
    let scale = multipliers.iter().map(Mat::norm_l2).fold(1.0, f64::max);
    let holds = residual <= 2.0 * options.feasibility_tolerance && smallest_eigenvalue >= -1e-12 * scale;
    holds.then_some(Witness { multipliers, residual, smallest_eigenvalue })
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
