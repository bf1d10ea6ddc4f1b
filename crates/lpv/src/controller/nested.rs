//! Nested certified sets: high gain near the set point, low gain far from it.
//!
//! A family of designs i = 1 … N on the same model, each with its own gain Kᵢ, its own Vᵢ = xᵀYᵢ(ρ)⁻¹x and its own certified
//! set Eᵢ = {Vᵢ ≤ γᵢ}: a larger γ reaches farther and pays with a lower gain. The controller uses one member at a time, by
//! two rules, applied at every sample in this order:
//!
//! 1. **Out**: if the error has left the set of the active member, the smallest set that holds it becomes active; if none
//!    does, the outermost member, uncertified.
//! 2. **In**: an inner member j becomes active once Vⱼ ≤ h γⱼ with h < 1 ([`ENTER`]) and Vⱼ ≤ V of the active member.
//!
//! # Why this is sound
//!
//! Let the claims of every member be proved for |ρ̇| ≤ r: V̇ᵢ ≤ −(xᵀQx + uᵀRu)/κᵢ < 0 along every motion under Kᵢ that starts in
//! Eᵢ, which is therefore invariant under Kᵢ.
//!
//! * *Invariance.* Let the state be in E_a at the time when a becomes active. It stays in E_a as long as a is active. Rule 1
//!   therefore never acts, and rule 2 hands over at a state that is in E_j. By induction the state is in the active
//!   member's set at all times; the sets need not contain each other.
//! * *No chattering.* Without rule 1 the active index only falls, so that there are at most N − 1 changes, and no sliding
//!   along a switching surface. h < 1 leaves a distance to the edge of E_j, so that what the model leaves out (noise, the
//!   plant's nonlinearity) does not throw the state out at once.
//! * *Stability.* After the last change one member is active for good, and its V falls to zero.
//! * *Cost.* Until the change at t_s the cost is at most κ(V_a(x₀) − V_a(x_s)), afterwards at most κ V_j(x_s) ≤ κ V_a(x_s), with κ
//!   the largest of the members'. The sum is at most κ V_a(x₀): the bound of the member that the flight starts with. This is
//!   what Vⱼ ≤ V_a in rule 2 is for.
//!
//! A set point that changes moves the error by a jump: it starts a new argument, with the member that rule 1 finds. Rule 1
//! is also what happens after a disturbance that the model knows nothing of.

use super::Schedule;
use super::certified_set::{CertifiedSet, SetEvaluator};
use serde::{Deserialize, Serialize};

/// h: an inner member becomes active at this share of its level.
pub const ENTER: f64 = 0.9;

/// A design of a family: gain and certified set.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Member {
    /// Kᵢ(ρ), m × n.
    pub schedule: Schedule,
    /// Eᵢ
    pub set: CertifiedSet,
}

/// Which member is active, and V/γ there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Active {
    /// 0 is the outermost.
    pub member: usize,
    pub share: f64,
}

/// The member for the error `error` at parameter `rho`, by the rules above; `sets` from the outermost to the innermost.
pub(super) fn select(
    active: usize,
    sets: &[&CertifiedSet],
    evaluator: &mut SetEvaluator,
    rho: f64,
    error: &[f64],
) -> Active {
    let mut value = |member: usize| {
        evaluator.at(sets[member], rho);
        evaluator.value(error)
    };
    let mut member = active;
    let mut v = value(member);
    if v > sets[member].level {
        let holds = (0..sets.len()).rev().map(|i| (i, value(i))).find(|&(i, v)| v <= sets[i].level);
        (member, v) = holds.unwrap_or_else(|| (0, value(0)));
    }
    if v <= sets[member].level {
        for (inner, set) in sets.iter().enumerate().skip(member + 1) {
            let v_inner = value(inner);
            if v_inner <= ENTER * set.level && v_inner <= v {
                (member, v) = (inner, v_inner);
            }
        }
    }
    Active { member, share: v / sets[member].level }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::diagonal;
    use crate::model::MatrixFunction;

    /// {x² / y ≤ γ} for a scalar error.
    fn set(y: f64, level: f64) -> CertifiedSet {
        CertifiedSet { level, y: MatrixFunction::constant(diagonal(&[y])) }
    }

    #[test]
    fn the_smallest_set_that_holds_the_error_is_active() {
        // |x| ≤ 10, 3, 1, with V falling from member to member
        let sets = [set(1.0, 100.0), set(3.0, 3.0), set(5.0, 0.2)];
        let sets: Vec<&CertifiedSet> = sets.iter().collect();
        let mut evaluator = SetEvaluator::new(1);
        let mut at = |active: usize, x: f64| select(active, &sets, &mut evaluator, 0.0, &[x]);
        assert_eq!(at(0, 9.0), Active { member: 0, share: 0.81 });
        assert_eq!(at(0, 2.99).member, 0, "inside the second, but not by the margin");
        assert_eq!(at(0, 2.8).member, 1);
        assert_eq!(at(1, 2.99).member, 1, "and it stays there");
        assert_eq!(at(0, 0.5).member, 2, "inwards over several at once");
        // out: what has left its set goes to the smallest that holds it
        assert_eq!(at(2, 2.0).member, 1);
        assert_eq!(at(2, 5.0).member, 0);
        assert_eq!(at(2, 20.0), Active { member: 0, share: 4.0 });
    }

    #[test]
    fn a_larger_bound_is_not_taken() {
        // the inner V is larger: handing over would cost more than the active member guarantees
        let sets = [set(2.0, 50.0), set(1.0, 1.0)];
        let sets: Vec<&CertifiedSet> = sets.iter().collect();
        assert_eq!(select(0, &sets, &mut SetEvaluator::new(1), 0.0, &[0.5]).member, 0);
    }
}
