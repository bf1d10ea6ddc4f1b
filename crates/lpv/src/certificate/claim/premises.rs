//! Verdicts carried over from premises.

use super::{Claim, ClaimKind, Verdict};

/// Carry the verdicts on premises over: a claim is proved only if each of its premises is, and numerical at best if one is; a premise
/// that is refuted, undecided or missing leaves it undecided, and is named.
pub fn settle(claims: &mut [Claim]) {
    if crate::mutant::is("premise-ignored") {
        return;
    }
    // a chain of premises is no longer than there are claims
    for _ in 0..claims.len() {
        let before: Vec<Verdict> = claims.iter().map(|claim| claim.verdict).collect();
        for at in 0..claims.len() {
            let premises = claims[at].premises.clone();
            let known = premises.iter().map(|id| (id, claims.iter().find(|claim| claim.id == *id)));
            let worst = known.min_by_key(|(_, claim)| claim.map(|claim| claim.verdict));
            let Some((id, premise)) = worst else { continue };
            let (verdict, reason) = match premise {
                None => (Verdict::Undecided, format!("it rests on {id}, of which nothing is known")),
                Some(premise) => match premise.verdict {
                    Verdict::Proved => continue,
                    Verdict::Numerical => {
                        (Verdict::Numerical, format!("it rests on a numerical check: {}", premise.claim))
                    }
                    word => (Verdict::Undecided, format!("it rests on what is {}: {}", word.word(), premise.claim)),
                },
            };
            let is_refuted_premise = premise.is_some_and(|premise| premise.verdict == Verdict::Refuted);
            let claim = &mut claims[at];
            // a witness of its own stands, unless what it was evaluated with is false; a step of the sampled loop is evaluated with its limits
            let is_own = !is_refuted_premise || matches!(claim.kind, ClaimKind::SampledInvariance { .. });
            let stands = claim.verdict == Verdict::Refuted && is_own;
            if stands || claim.verdict <= verdict && !is_refuted_premise {
                continue;
            }
            if claim.verdict != verdict {
                claim.detail = reason;
                claim.margin = f64::NAN;
                claim.witness = None;
                claim.verdict = verdict;
            }
        }
        if claims.iter().zip(&before).all(|(claim, before)| claim.verdict == *before) {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certificate::claim::{ClaimKind, Motion, Of, Words};

    fn claim(kind: ClaimKind, verdict: Verdict, premises: &[&'static str]) -> Claim {
        Claim::new(kind, Of::Model, &Words { lyapunov: "V", ..Words::default() })
            .decided(verdict, 1.0, "")
            .resting_on(premises)
    }

    fn verdicts(claims: &[Claim]) -> Vec<Verdict> {
        claims.iter().map(|claim| claim.verdict).collect()
    }

    #[test]
    fn nothing_is_better_than_what_it_rests_on() {
        use Verdict::{Numerical, Proved, Refuted, Undecided};
        let chain = |first: Verdict, last: Verdict| {
            let mut claims = vec![
                // premises may come after what rests on them
                claim(ClaimKind::Cost { factor: 1.0, level: None, motion: Motion::None }, last, &["invariance"]),
                claim(ClaimKind::Invariance { level: 1.0, motion: Motion::None }, Proved, &["unsaturated"]),
                claim(ClaimKind::Unsaturated { level: 1.0 }, first, &[]),
            ];
            settle(&mut claims);
            verdicts(&claims)
        };
        assert_eq!(chain(Proved, Proved), [Proved, Proved, Proved]);
        assert_eq!(chain(Numerical, Proved), [Numerical, Numerical, Numerical]);
        assert_eq!(chain(Undecided, Proved), [Undecided, Undecided, Undecided]);
        assert_eq!(chain(Refuted, Proved), [Undecided, Undecided, Refuted]);
        // a witness of its own stands
        assert_eq!(chain(Undecided, Refuted), [Refuted, Undecided, Undecided]);
    }

    #[test]
    fn a_missing_premise_is_named() {
        let mut claims = vec![claim(ClaimKind::Decrease { motion: Motion::None }, Verdict::Proved, &["weights"])];
        settle(&mut claims);
        assert_eq!(claims[0].verdict, Verdict::Undecided);
        assert!(claims[0].detail.contains("weights"), "{}", claims[0].detail);
    }

    #[test]
    fn a_refuted_premise_takes_a_refutation_back() {
        let mut claims = vec![
            claim(ClaimKind::LyapunovDefinite, Verdict::Refuted, &[]),
            claim(ClaimKind::Decrease { motion: Motion::None }, Verdict::Refuted, &["lyapunov-definite"]),
        ];
        settle(&mut claims);
        assert_eq!(verdicts(&claims), [Verdict::Refuted, Verdict::Undecided]);
    }
}
