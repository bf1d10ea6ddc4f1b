//! The cost is one: Q ⪰ 0 and R ≻ 0, decided exactly.

use crate::certificate::claim::{Claim, ClaimKind, Of, Verdict, Words};
use crate::math::decimal::about;
use crate::math::definite::{Definiteness, definiteness, smallest_eigenvalue_about};
use crate::synthesis::CostWeights;
use std::time::Instant;

/// The claim; refuted by Q or R itself.
pub(super) fn claim(weights: &CostWeights, words: &Words) -> Claim {
    let started = Instant::now();
    let [q, r] = [&weights.q, &weights.r].map(smallest_eigenvalue_about);
    let detail = format!("smallest eigenvalues about {} of Q and {} of R", about(q), about(r));
    let (verdict, margin) = match (definiteness(&weights.q), definiteness(&weights.r)) {
        (Some(Definiteness::Positive | Definiteness::Semidefinite), Some(Definiteness::Positive)) => {
            (Verdict::Proved, r)
        }
        (Some(_), Some(Definiteness::Positive)) if crate::mutant::is("q-indefinite") => (Verdict::Proved, r),
        (Some(_), Some(_)) => (Verdict::Refuted, q.min(r)),
        _ => (Verdict::Undecided, f64::NAN),
    };
    let claim = Claim::new(ClaimKind::Weights, Of::Model, words).decided(verdict, margin, detail);
    Claim { seconds: started.elapsed().as_secs_f64(), ..claim }
}
