//! Proved bounds on the optimum, from both sides.

use super::{Original, Translation, at_zero, sizes_and_margins};
use crate::Mat;
use crate::answer::{BlockReport, OptimumBound};
use crate::multiplier::Multiplier;
use crate::reach::{Entries, taken};
use crate::verification::largest_entry;

/// How much larger than the answer the points are that a bound speaks of which does not hold for all.
const REACH: f64 = 10.0;
/// What holding for every x may take from the bound, relative to the objective; and what it is worth looking for better bounds to save.
const LITTLE: f64 = 1e-7;
const FOR_ALL: f64 = 1e-5;

/// The bound on the optimum and the one that the answer attains.
pub(super) struct Bracket {
    pub bound: Option<OptimumBound>,
    /// An objective that is attained, rounded to the safe side.
    pub attained: Option<f64>,
}

impl Bracket {
    /// (p − d) / (1 + |p| + |d|) for the proved p and d; ∞ without one of them.
    pub fn gap(&self, sign: f64) -> f64 {
        match (self.attained, self.bound) {
            (Some(p), Some(OptimumBound { value: d, .. })) => {
                let gap = 1.001 * (sign * (p - d)).max(0.0) / (1.0 + p.abs() + d.abs());
                if gap.is_nan() { f64::INFINITY } else { gap }
            }
            _ => f64::INFINITY,
        }
    }
}

/// A point and its multipliers, with what is known of the point.
pub(super) struct Optimal<'a> {
    pub values: &'a [Mat<f64>],
    pub multipliers: &'a [Mat<f64>],
    /// Multipliers not far from the optimum that are well inside.
    pub inner: Option<Vec<Mat<f64>>>,
    /// Whether the point is proved to be feasible.
    pub feasible: bool,
}

/// For every x with `G_b(x) ⪰ 0` (margins that were given subtracted), and every Z_b ⪰ 0,
///
/// ```text
/// cᵀx = Σ⟨G_b(x), Z_b⟩ − Σ⟨C_b, Z_b⟩ + Σ rᵢxᵢ ≥ τ + d − Σ|rᵢ||xᵢ|,    r = c − A(Z),  d = −Σ⟨C_b, Z_b⟩.
/// ```
///
/// With |xᵢ| ≤ aᵢ + bᵢτ ([`crate::reach`]) this is at least `d − Σ|rᵢ|aᵢ` for every x, if `Σ|rᵢ|bᵢ ≤ 1`. Where it is not, multipliers that are
/// well inside may bound those x that are at least as good as the point; otherwise what is known is `d − Σ|rᵢ||xᵢ|` for x of a limited size.
pub(super) fn bracket(
    original: &dyn Original,
    translation: &Translation<'_>,
    blocks: &[BlockReport],
    point: &Optimal<'_>,
) -> Bracket {
    let (objective, error) = original.objective_enclosure(point.values);
    let sign = translation.sign;
    let attained = objective + sign * (error + 2.0 * f64::EPSILON * objective.abs());
    let attained = (point.feasible && attained.is_finite()).then_some(attained);
    if !original.has_objective() {
        let bound = OptimumBound { value: translation.objective_constant, reach: f64::INFINITY };
        return Bracket { bound: Some(bound), attained };
    }
    Bracket { bound: optimum_bound(original, translation, blocks, point, attained), attained }
}

/// Multipliers that are proved to be semidefinite, with what they say of the objective.
struct Dual {
    multipliers: Vec<Multiplier>,
    /// At most −Σ⟨C_b, Z_b⟩.
    objective: f64,
    /// At least |cᵢ − A(Z)ᵢ|.
    misses: Vec<f64>,
}

impl Dual {
    fn new(original: &dyn Original, blocks: &[BlockReport], entries: &Entries, z: &[Mat<f64>]) -> Option<Self> {
        let multipliers: Vec<Multiplier> = z.iter().map(Multiplier::new).collect::<Option<_>>()?;
        let at_zero = at_zero(original, blocks, multipliers.iter().map(|z| &z.matrix));
        let mut misses = original.gradient_bounds(&multipliers, true);
        let weighed = entries.weighed(&multipliers);
        // Nothing is missed of an equation that says 0 = 0.
        let absent = weighed.iter().zip(original.in_objective(misses.len())).map(|(weighed, cost)| !weighed && !cost);
        misses.iter_mut().zip(absent).filter(|(_, absent)| *absent).for_each(|(miss, _)| *miss = 0.0);
        Some(Self { multipliers, objective: -at_zero.known - at_zero.error, misses })
    }
}

fn optimum_bound(
    original: &dyn Original,
    translation: &Translation<'_>,
    blocks: &[BlockReport],
    point: &Optimal<'_>,
    attained: Option<f64>,
) -> Option<OptimumBound> {
    let (sizes, margins) = sizes_and_margins(original, blocks);
    let entries = Entries::new(original, &sizes, &margins, translation.layout.len());
    let dual = Dual::new(original, blocks, &entries, point.multipliers)?;
    let (d, misses) = (dual.objective, &dual.misses);
    let minimised = |objective: f64| translation.sign * (objective - translation.objective_constant);
    // Complementarity of a point as far from the optimum as this one: at least what rounding leaves of it.
    let about = (minimised(original.objective(point.values)) - d).abs().max(f64::EPSILON * d.abs());
    let reach = entries.reach(&dual.multipliers, about.max(f64::MIN_POSITIVE));
    let little = LITTLE * (1.0 + d.abs());
    let mut everywhere = if taken(misses, &reach.b) < 1.0 { taken(misses, &reach.a) } else { f64::INFINITY };
    if everywhere > little
        && let (Some(inner), Some(p)) = (&point.inner, attained)
        && let Some(inner) = Dual::new(original, blocks, &entries, inner)
    {
        let p = minimised(p) + 4.0 * f64::EPSILON * (p.abs() + translation.objective_constant.abs());
        everywhere = everywhere.min(taken_near(&entries, &inner, p, misses));
    }
    let largest: Vec<Mat<f64>> = point
        .values
        .iter()
        .map(|x| {
            let most = REACH * largest_entry(x);
            Mat::from_fn(x.nrows(), x.ncols(), |_, _| most)
        })
        .collect();
    let near = taken(misses, &translation.layout.values(&largest));
    let for_all = everywhere <= near.max(FOR_ALL * (1.0 + d.abs()));
    let (least, reach) = if for_all { (d - everywhere, f64::INFINITY) } else { (d - near, REACH) };
    let value = translation.objective_constant + translation.sign * least;
    // The last roundings.
    let value = value - translation.sign * 4.0 * f64::EPSILON * (value.abs() + least.abs() + d.abs());
    value.is_finite().then_some(OptimumBound { value, reach })
}

/// `Σ|rᵢ||xᵢ|` at most, for feasible x with cᵀx ≤ p: of the inner multipliers `τ = cᵀx − d − Σrᵢxᵢ ≤ (p − d + Σ|rᵢ|aᵢ)/(1 − Σ|rᵢ|bᵢ)`.
fn taken_near(entries: &Entries, inner: &Dual, p: f64, misses: &[f64]) -> f64 {
    let distance = (p - inner.objective).max(0.0) + 4.0 * f64::EPSILON * (p.abs() + inner.objective.abs());
    let reach = entries.reach(&inner.multipliers, distance.max(f64::MIN_POSITIVE));
    let share = taken(&inner.misses, &reach.b);
    if share.is_nan() || share > 0.9 {
        return f64::INFINITY;
    }
    let tau = 1.001 * (distance + taken(&inner.misses, &reach.a)) / (1.0 - share);
    taken(misses, &reach.a) + tau * taken(misses, &reach.b)
}
