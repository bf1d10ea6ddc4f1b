//! Proofs that no point satisfies all inequalities.

use super::{AtZero, Original, at_zero, sizes_and_margins};
use crate::Mat;
use crate::answer::{BlockReport, Outcome, Witness};
use crate::multiplier::Multiplier;
use crate::reach::{Entries, taken};
use crate::verification::Spectrum;

/// Least radius of the excluded box, in the units of the balanced unknowns, that is worth a word.
const EXCLUDED: f64 = 1e10;
/// Shares of the largest diagonal entry below which a row of the multipliers is taken for zero, one after the other.
const NEGLIGIBLE: [f64; 3] = [0.0, 1e-12, 1e-7];

/// The outcome that the multipliers prove, the strongest first.
pub(super) fn infeasible(
    original: &dyn Original,
    blocks: &[BlockReport],
    z: &[Mat<f64>],
    units: &[f64],
) -> Option<Outcome> {
    let (sizes, margins) = sizes_and_margins(original, blocks);
    let AtZero { total, .. } = at_zero(original, blocks, z.iter());
    if total.is_nan() || total >= 0.0 {
        return None;
    }
    // Scaled first, so that what is proved is what is given.
    let z: Vec<Mat<f64>> = z.iter().map(|z| (-1.0 / total) * z).collect();
    let entries = Entries::new(original, &sizes, &margins, units.len());
    for share in NEGLIGIBLE {
        let Some(multipliers) = without_negligible(&z, share) else { continue };
        if let Some(witness) = everywhere(original, blocks, &entries, &multipliers) {
            return Some(Outcome::Infeasible(witness));
        }
    }
    let multipliers = NEGLIGIBLE.into_iter().filter_map(|share| without_negligible(&z, share));
    let mut witnesses = multipliers.filter_map(|multipliers| within(original, blocks, &multipliers, units));
    witnesses.next().map(Outcome::InfeasibleWithin)
}

/// The multipliers, proved to be semidefinite, with rows that are as good as zero set to zero.
fn without_negligible(z: &[Mat<f64>], share: f64) -> Option<Vec<Multiplier>> {
    let diagonal = |z: &Mat<f64>| (0..z.nrows()).map(|i| z[(i, i)]).fold(0.0, f64::max);
    let least = share * z.iter().map(diagonal).fold(0.0, f64::max);
    let cleared = |z: &Mat<f64>| {
        let kept = |i: usize| z[(i, i)] > least;
        let entry = |i: usize, j: usize| if kept(i) && kept(j) { z[(i, j)] } else { 0.0 };
        Multiplier::new(&Mat::from_fn(z.nrows(), z.ncols(), entry))
    };
    z.iter().map(cleared).collect()
}

/// For every x with `G_b(x) ⪰ 0`: `τ = Σ⟨G_b(x), Z_b⟩ = κ + Σ rᵢxᵢ` with κ = Σ⟨C_b, Z_b⟩, r = A(Z). With |xᵢ| ≤ aᵢ + bᵢτ and `Σ|rᵢ|bᵢ < 1`,
/// `κ + Σ|rᵢ|aᵢ < 0` contradicts τ ≥ 0; and zero does where a strict inequality has a say, because then τ > 0.
fn everywhere(
    original: &dyn Original,
    blocks: &[BlockReport],
    entries: &Entries,
    multipliers: &[Multiplier],
) -> Option<Witness> {
    let AtZero { known, error, .. } = at_zero(original, blocks, multipliers.iter().map(|z| &z.matrix));
    let misses = misses(original, entries, multipliers);
    let reach = entries.reach(multipliers, (1e-3 * known.abs()).max(f64::MIN_POSITIVE));
    if taken(&misses, &reach.b) >= 1.0 {
        return None;
    }
    let strict = (0..blocks.len()).any(|block| original.strict(block) && multipliers[block].trace() > 0.0);
    let shared = taken(&misses, &reach.a);
    let vanishes = strict && is_homogeneous(original, multipliers) && shared == 0.0;
    let contradicts = known + error + shared < 0.0 || vanishes;
    if !contradicts {
        return None;
    }
    Some(report(multipliers, &misses, f64::INFINITY, false))
}

/// What is excluded for all x of a limited size.
fn within(
    original: &dyn Original,
    blocks: &[BlockReport],
    multipliers: &[Multiplier],
    units: &[f64],
) -> Option<Witness> {
    let AtZero { total, known, error } = at_zero(original, blocks, multipliers.iter().map(|z| &z.matrix));
    // Where the default margins of strict inequalities decide, what they leave is excluded, and no more. That says something only where the
    // known part itself has no share in the matter: x may then be multiplied by any number, and it is relative to the size of x that F(x) is small.
    let needs_margin = known > -0.5 * total.abs();
    if needs_margin && !is_homogeneous(original, multipliers) {
        return None;
    }
    let least = if needs_margin { total } else { known };
    let bounds = original.gradient_bounds(multipliers, false);
    let reach: f64 = bounds.iter().zip(units).map(|(bound, unit)| bound * unit).sum();
    let excluded_radius = 0.999 * -(least + error) / reach;
    let holds = excluded_radius >= EXCLUDED && excluded_radius.is_finite();
    holds.then(|| report(multipliers, &bounds, excluded_radius, needs_margin))
}

/// Whether Σ⟨C_b, Z_b⟩ is zero because every C_b that is weighed is.
fn is_homogeneous(original: &dyn Original, multipliers: &[Multiplier]) -> bool {
    multipliers.iter().enumerate().all(|(block, z)| z.trace() == 0.0 || original.is_homogeneous(block))
}

/// Upper bounds on the equations' residuals, zero for unknowns that no multiplier weighs.
fn misses(original: &dyn Original, entries: &Entries, multipliers: &[Multiplier]) -> Vec<f64> {
    let weighed = entries.weighed(multipliers);
    let bounds = original.gradient_bounds(multipliers, false);
    bounds.iter().zip(weighed).map(|(bound, weighed)| if weighed { *bound } else { 0.0 }).collect()
}

fn report(multipliers: &[Multiplier], residuals: &[f64], excluded_radius: f64, needs_margin: bool) -> Witness {
    let multipliers: Vec<Mat<f64>> = multipliers.iter().map(|z| z.matrix.clone()).collect();
    let residual = residuals.iter().fold(0.0, |m: f64, r| if r.is_nan() { *r } else { m.max(*r) });
    let smallest_eigenvalue = multipliers.iter().map(|z| Spectrum::of(z).smallest).fold(f64::INFINITY, f64::min);
    Witness { multipliers, residual, excluded_radius, needs_margin, smallest_eigenvalue }
}
