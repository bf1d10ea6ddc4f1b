//! Proofs that the objective improves without end.

use super::{Original, Proof, Translation, sizes_and_margins, spectrum, verify};
use crate::Mat;
use crate::Options;
use crate::answer::{BlockReport, Outcome, Ray};
use crate::reach::Entries;

/// Shares of the largest entry below which an entry of a ray is taken for zero, one after the other.
const NEGLIGIBLE: [f64; 3] = [0.0, 1e-12, 1e-6];
/// Lengths along the ray, in multiples of the point's size, at which a feasible point is looked for.
const STEPS: [f64; 5] = [0.0, 1.0, 1e2, 1e4, 1e8];

/// The outcome that a ray proves, with a feasible point where one is proved.
pub(super) struct Endless {
    pub outcome: Outcome,
    pub point: Option<(Vec<Mat<f64>>, Vec<BlockReport>)>,
}

/// `Unbounded` needs `F_b(d) − F_b(0) ⪰ 0` for every block, cᵀd < 0, and one feasible point, all of them proved.
pub(super) fn unbounded(
    original: &dyn Original,
    translation: &Translation<'_>,
    blocks: &[BlockReport],
    values: &[Mat<f64>],
    direction: &[f64],
    options: &Options,
) -> Option<Endless> {
    let layout = translation.layout;
    let (sizes, margins) = sizes_and_margins(original, blocks);
    let entries = Entries::new(original, &sizes, &margins, layout.len());
    let largest = direction.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
    for share in NEGLIGIBLE {
        let kept = |d: &f64| if d.abs() > share * largest { *d } else { 0.0 };
        let direction: Vec<f64> = direction.iter().map(kept).collect();
        let Some(ray) = scaled(original, translation, &direction) else { continue };
        if !recedes(original, &entries, &sizes, &layout.values(&ray), &ray) {
            continue;
        }
        let Some(point) = feasible_point(original, values, &ray) else { break };
        let smallest_eigenvalue = smallest_eigenvalue(original, translation, blocks, &ray)?.0;
        let outcome = Outcome::Unbounded(Ray { direction: ray, smallest_eigenvalue });
        return Some(Endless { outcome, point: Some(point) });
    }
    let ray = scaled(original, translation, direction)?;
    let (smallest_eigenvalue, largest) = smallest_eigenvalue(original, translation, blocks, &ray)?;
    // A violation of ε means that no objective beyond 1/ε times the data's scale is excluded.
    let holds = smallest_eigenvalue >= -options.feasibility_tolerance * largest.max(1.0);
    let point = feasible_point(original, values, &ray);
    let outcome = Outcome::UnboundedToTolerance(Ray { direction: ray, smallest_eigenvalue });
    holds.then_some(Endless { outcome, point })
}

/// The direction with a slope of −1 of the minimised objective, up to rounding; `None` unless its slope is proved to be negative.
fn scaled(original: &dyn Original, translation: &Translation<'_>, direction: &[f64]) -> Option<Vec<Mat<f64>>> {
    let slope = |direction: &[Mat<f64>]| {
        let (slope, error) = original.slope(direction);
        (translation.sign * slope, error)
    };
    let direction = translation.layout.matrices(direction);
    let (first, _) = slope(&direction);
    if !(first < 0.0 && first.is_finite()) {
        return None;
    }
    let direction: Vec<Mat<f64>> = direction.iter().map(|d| (-1.0 / first) * d).collect();
    let (slope, error) = slope(&direction);
    (slope + error < 0.0).then_some(direction)
}

/// Whether every block is proved not to fall along the ray: rows that do not move are zero, the others those of a positive definite matrix.
fn recedes(original: &dyn Original, entries: &Entries, sizes: &[usize], direction: &[f64], ray: &[Mat<f64>]) -> bool {
    let moved = entries.moved(direction);
    let mut first = 0;
    sizes.iter().enumerate().all(|(block, &n)| {
        let rows: Vec<usize> = (0..n).filter(|row| moved[first + row]).collect();
        first += n;
        rows.is_empty() || original.change(block, ray).part(&rows).exceeds(0.0)
    })
}

/// A point on the ray from the one given that is proved to be feasible, with its blocks.
fn feasible_point(
    original: &dyn Original,
    values: &[Mat<f64>],
    ray: &[Mat<f64>],
) -> Option<(Vec<Mat<f64>>, Vec<BlockReport>)> {
    let norm = |m: &[Mat<f64>]| m.iter().map(|m| m.norm_max()).fold(0.0, f64::max);
    let size = (1.0 + norm(values)) / norm(ray);
    STEPS.into_iter().find_map(|step| {
        let point: Vec<Mat<f64>> = values.iter().zip(ray).map(|(x, d)| x + (step * size) * d).collect();
        let (blocks, Proof { proved, .. }) = verify(original, &point);
        proved.then_some((point, blocks))
    })
}

/// Smallest and largest eigenvalue of the blocks along the ray, in floating point.
fn smallest_eigenvalue(
    original: &dyn Original,
    translation: &Translation<'_>,
    blocks: &[BlockReport],
    ray: &[Mat<f64>],
) -> Option<(f64, f64)> {
    let zero = translation.layout.matrices(&vec![0.0; translation.layout.len()]);
    let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
    for (index, block) in blocks.iter().enumerate() {
        let change = original.value(index, ray) - original.value(index, &zero);
        let spectrum = spectrum(&change, block.size);
        if spectrum.smallest.is_nan() {
            return None;
        }
        smallest = smallest.min(spectrum.smallest);
        largest = largest.max(spectrum.largest);
    }
    Some((smallest, largest))
}
