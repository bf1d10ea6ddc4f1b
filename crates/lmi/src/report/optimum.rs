//! Proved bounds on the optimum, from both sides.

use super::{Original, Translation, at_zero, sizes_and_margins};
use crate::Mat;
use crate::answer::{BlockReport, OptimumBound};
use crate::multiplier::Multiplier;
use crate::reach::{Entries, taken};
use crate::verification::largest_entry;

/// How much larger than the answer the points are that a bound speaks of which does not hold for all.
const REACH: f64 = 10.0;
/// What holding for every x may take from the bound, relative to the objective.
const FOR_ALL: f64 = 1e-7;

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

/// For every x with `G_b(x) ⪰ 0` (margins that were given subtracted), and every Z_b ⪰ 0,
///
/// ```text
/// cᵀx = Σ⟨G_b(x), Z_b⟩ − Σ⟨C_b, Z_b⟩ + Σ rᵢxᵢ ≥ τ + d − Σ|rᵢ||xᵢ|,    r = c − A(Z),  d = −Σ⟨C_b, Z_b⟩.
/// ```
///
/// With |xᵢ| ≤ aᵢ + bᵢτ ([`crate::reach`]) this is at least `d − Σ|rᵢ|aᵢ` for every x, if `Σ|rᵢ|bᵢ ≤ 1`; otherwise what is known is
/// `d − Σ|rᵢ||xᵢ|` for x of a limited size.
pub(super) fn bracket(
    original: &dyn Original,
    translation: &Translation<'_>,
    blocks: &[BlockReport],
    multipliers: &[Mat<f64>],
    values: &[Mat<f64>],
    feasible: bool,
) -> Bracket {
    let (objective, error) = original.objective_enclosure(values);
    let sign = translation.sign;
    let attained = objective + sign * (error + 2.0 * f64::EPSILON * objective.abs());
    let attained = (feasible && attained.is_finite()).then_some(attained);
    if !original.has_objective() {
        let bound = OptimumBound { value: translation.objective_constant, reach: f64::INFINITY };
        return Bracket { bound: Some(bound), attained };
    }
    Bracket { bound: optimum_bound(original, translation, blocks, multipliers, values), attained }
}

fn optimum_bound(
    original: &dyn Original,
    translation: &Translation<'_>,
    blocks: &[BlockReport],
    multipliers: &[Mat<f64>],
    values: &[Mat<f64>],
) -> Option<OptimumBound> {
    let definite: Vec<Multiplier> = multipliers.iter().map(Multiplier::new).collect::<Option<_>>()?;
    let at_zero = at_zero(original, blocks, definite.iter().map(|z| &z.matrix));
    let d = -at_zero.known - at_zero.error;
    let misses = original.gradient_bounds(&definite, true);
    let largest: Vec<Mat<f64>> = values
        .iter()
        .map(|x| {
            let most = REACH * largest_entry(x);
            Mat::from_fn(x.nrows(), x.ncols(), |_, _| most)
        })
        .collect();
    let near = taken(&misses, &translation.layout.values(&largest));
    let (sizes, margins) = sizes_and_margins(original, blocks);
    let entries = Entries::new(original, &sizes, &margins, misses.len());
    // Complementarity of a point as far from the optimum as this one: more than what rounding leaves of it.
    let about = (translation.sign * (original.objective(values) - translation.objective_constant) - d).abs();
    let reach = entries.reach(&definite, about.max(f64::EPSILON * d.abs()).max(f64::MIN_POSITIVE));
    let everywhere = if taken(&misses, &reach.b) < 1.0 { taken(&misses, &reach.a) } else { f64::INFINITY };
    let for_all = everywhere <= near.max(FOR_ALL * (1.0 + d.abs()));
    let (least, reach) = if for_all { (d - everywhere, f64::INFINITY) } else { (d - near, REACH) };
    let value = translation.objective_constant + translation.sign * least;
    // The last roundings.
    let value = value - translation.sign * 4.0 * f64::EPSILON * (value.abs() + least.abs() + d.abs());
    value.is_finite().then_some(OptimumBound { value, reach })
}
