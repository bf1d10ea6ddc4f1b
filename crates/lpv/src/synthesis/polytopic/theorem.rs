//! The theorems of chapters 2, 4 and 5, each with its statement, shapes and assumptions, and what it does not guarantee.

use super::{Lyapunov, PolytopicRequest};
use crate::model::Polytope;
use serde::Serialize;

/// A theorem of the thesis, in its corrected form.
///
/// Throughout: A(ρ) = Σ ρᵢAᵢ, n × n, and B(ρ) = Σ ρᵢBᵢ, n × m, with ρᵢ ≥ 0, Σρᵢ = 1; u = −K(ρ)x, m inputs; Y, Yᵢ symmetric
/// n × n, L, Lᵢ, M, Mᵢ m × n, ℓᵢ and 𝓂ᵢ their rows; Q ⪰ 0, n × n, and R ≻ 0, m × m, of J = ∫ xᵀQx + uᵀRu dt; He(X) = X + Xᵀ. ρ(t) is
/// measured without error or delay, u acts in continuous time, and the plant *is* the LPV model: a nonlinear plant has what is
/// said here as far as its trajectories are embedded in the model's, a sampled or estimated loop does not have it by itself.
/// Infeasible says that no certificate of this form exists, not that no controller does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Theorem {
    /// Theorem 2.1, one vertex. Largest tr Y with
    ///
    /// ```text
    /// ⎡ −He(AY − BL)  Y    Lᵀ  ⎤
    /// ⎢ Y             Q⁻¹  0   ⎥ ≻ 0
    /// ⎣ L             0    R⁻¹ ⎦
    /// ```
    ///
    /// Then A − BK with K = LY⁻¹ is stable and J < x(0)ᵀPx(0), P = Y⁻¹. At the optimum P solves the Riccati equation (2.31) and
    /// K = R⁻¹BᵀP. Assumes (A, B) stabilisable; where Q is singular, with an unobserved state that does not decay, tr Y is unbounded.
    /// *Not guaranteed:* anything under saturation.
    #[serde(rename = "Theorem 2.1")]
    Regulator,
    /// Lemma 4.1 at one vertex: −He(AY − BL) ≻ 0, Y ≻ 0. Then A − BK, K = LY⁻¹, is stable; necessary and sufficient.
    /// *Not guaranteed:* a decay rate, a cost, or a moderate gain.
    #[serde(rename = "Lemma 4.1")]
    Stabilization,
    /// Theorem 4.1: Y ≻ 0 with −He(AᵢY − BᵢLᵢ) ≻ 0 (4.11) and −He(AᵢY − BᵢLⱼ + AⱼY − BⱼLᵢ) ≻ 0, i < j (4.12). Then xᵀY⁻¹x falls under
    /// K(ρ) = Σ ρᵢLᵢY⁻¹ for every motion of ρ, however fast. Sufficient only: the pairs are asked one by one.
    /// *Not guaranteed:* as for [`Stabilization`](Self::Stabilization).
    #[serde(rename = "Theorem 4.1")]
    CommonStabilization,
    /// Theorem 4.2: Yᵢ ≻ 0 with Y(νₖ) − He(AᵢYᵢ − BᵢLᵢ) ≻ 0 (4.22) and 2Y(νₖ) − He(AᵢYⱼ − BᵢLⱼ + AⱼYᵢ − BⱼLᵢ) ≻ 0, i < j (4.23), at every
    /// rate vertex νₖ, Y(ν) = Σ νᵢYᵢ. Then xᵀY(ρ)⁻¹x falls under K(ρ) = (Σ ρᵢLᵢ)(Σ ρᵢYᵢ)⁻¹ while ρ̇ is in the hull of the νₖ.
    /// *Not guaranteed:* anything once ρ̇ leaves that hull; that Y(ρ) is affine makes P(ρ) not so, against (4.15).
    #[serde(rename = "Theorem 4.2")]
    ParameterDependentStabilization,
    /// Theorem 4.3. Largest tr Y with the block of [`Regulator`](Self::Regulator) at every vertex (4.28), and for i < j
    ///
    /// ```text
    /// ⎡ −He(AᵢY − BᵢLⱼ + AⱼY − BⱼLᵢ)  2Y    (Lᵢ + Lⱼ)ᵀ ⎤
    /// ⎢ 2Y                            2Q⁻¹  0          ⎥ ≻ 0  (4.29)
    /// ⎣ Lᵢ + Lⱼ                       0     2R⁻¹       ⎦
    /// ```
    ///
    /// Then J < x(0)ᵀPx(0), P = Y⁻¹, under K(ρ) = Σ ρᵢLᵢY⁻¹ for every motion of ρ. *Not guaranteed:* that this is the least bound at any
    /// x(0), which tr Y is not; the Lᵢ are not unique, and the cost of a flight depends on which is taken.
    #[serde(rename = "Theorem 4.3")]
    CommonRegulator,
    /// Corollary 4.1: Theorem 4.3 for B the same at every vertex (to the last bit, as it is tested), where (4.29) is the sum of (4.28) at i
    /// and j and is left out. The same guarantee, and the same set of Y.
    #[serde(rename = "Corollary 4.1")]
    CommonRegulatorConstantInput,
    /// Theorem 4.4. Largest Σ tr Yᵢ with, at every rate vertex νₖ, the blocks (4.31) and (4.32):
    ///
    /// ```text
    /// ⎡ Y(νₖ) − He(AᵢYᵢ − BᵢLᵢ)  Yᵢ   Lᵢᵀ ⎤      ⎡ 2Y(νₖ) − He(AᵢYⱼ − BᵢLⱼ + AⱼYᵢ − BⱼLᵢ)  Yᵢ + Yⱼ  (Lᵢ + Lⱼ)ᵀ ⎤
    /// ⎢ Yᵢ                       Q⁻¹  0   ⎥ ≻ 0, ⎢ Yᵢ + Yⱼ                                 2Q⁻¹     0          ⎥ ≻ 0
    /// ⎣ Lᵢ                       0    R⁻¹ ⎦      ⎣ Lᵢ + Lⱼ                                 0        2R⁻¹       ⎦
    /// ```
    ///
    /// Then J < x(0)ᵀ(Σ ρᵢ(0)Yᵢ)⁻¹x(0) under K(ρ) = (Σ ρᵢLᵢ)(Σ ρᵢYᵢ)⁻¹ while ρ̇ is in the hull of the νₖ, Σᵢ νₖᵢ = 0. The factor 2
    /// of Y(νₖ) and every i are needed: without them the thesis printed 72.3877 and 55.7618, which are no bounds.
    /// *Not guaranteed:* anything beyond the rate.
    #[serde(rename = "Theorem 4.4")]
    ParameterDependentRegulator,
    /// Theorem 4.5 at single ρ: Theorem 2.1 for each (A(ρ), B(ρ)). P(ρ) is the Riccati solution there.
    /// *Not guaranteed:* anything once ρ moves, neither cost nor stability. The thesis's proof takes the ρ that minimises xᵀP(ρ)x
    /// (Lemma 2.1) for the scheduled one; on its own example the actual cost, 56.026, exceeds the "guarantee" 55.866.
    #[serde(rename = "Theorem 4.5")]
    FrozenRegulator,
    /// Theorem 5.1, one vertex, |uᵢ| ≤ σᵢ: Theorem 2.1 with
    ///
    /// ```text
    /// ⎡ σᵢ²/γ  ℓᵢ ⎤ ≻ 0, i = 1 … m  (5.8)
    /// ⎣ ℓᵢᵀ    Y  ⎦
    /// ```
    ///
    /// Then from xᵀPx ≤ γ the input never saturates, and J < x(0)ᵀPx(0). *Not guaranteed:* anything from outside that ellipsoid.
    #[serde(rename = "Theorem 5.1")]
    Saturated,
    /// Theorem 5.2, one vertex: the block of Theorem 2.1 with S(v, L, M) for L, for each of the 2^m choices v of rows from L or M (5.12), and
    /// (5.8) for the rows of M (5.13). Then from xᵀPx ≤ γ, J < x(0)ᵀPx(0) under u = −sat(Kx), K = LY⁻¹, which may saturate there.
    /// The optimal Y is that of Theorem 5.1 (take L = M). For diagonal R every K on F + s(R⁻¹BᵀP − F), F = MY⁻¹, 0 ≤ s ≤ 1, is a
    /// solution, and the 2^m blocks are not posed. *Not guaranteed:* anything from outside the ellipsoid, and nothing for a sampled
    /// controller: s is chosen so that the sampled loop is stable without saturation, which is less.
    #[serde(rename = "Theorem 5.2")]
    SaturatedHighGain,
    /// Theorem 5.3 at single ρ: Theorem 5.1 for each (A(ρ), B(ρ)). *Not guaranteed:* anything once ρ moves, as for
    /// [`FrozenRegulator`](Self::FrozenRegulator); not even that the ellipsoid stays invariant.
    #[serde(rename = "Theorem 5.3")]
    FrozenSaturated,
    /// Theorem 5.4 at single ρ: Theorem 5.2 for each (A(ρ), B(ρ)). *Not guaranteed:* as for [`FrozenSaturated`](Self::FrozenSaturated).
    #[serde(rename = "Theorem 5.4")]
    FrozenSaturatedHighGain,
    /// Theorem 4.3 with (5.19) at every vertex: from xᵀPx ≤ γ no input saturates, and J < x(0)ᵀPx(0), for every motion of ρ.
    /// Not in the thesis, which extends Theorem 4.5 alone. *Not guaranteed:* anything from outside the ellipsoid.
    #[serde(rename = "Theorem 4.3 with (5.19)")]
    CommonSaturated,
    /// Theorem 4.3 with (5.20) and (5.21) at every vertex and pair, or with diagonal R the segment of Theorem 5.2 at every ρ.
    /// *Not guaranteed:* as for [`SaturatedHighGain`](Self::SaturatedHighGain).
    #[serde(rename = "Theorem 4.3 with (5.20), (5.21)")]
    CommonSaturatedHighGain,
    /// Theorem 4.4 with (5.19) at every vertex: from x(0)ᵀP(ρ(0))x(0) ≤ γ the state stays in xᵀP(ρ)x ≤ γ, no input saturates, and
    /// J < x(0)ᵀP(ρ(0))x(0), while ρ̇ is in the hull of the rate vertices. *Not guaranteed:* anything from outside, or faster.
    #[serde(rename = "Theorem 4.4 with (5.19)")]
    ParameterDependentSaturated,
    /// Theorem 4.4 with (5.20) and (5.21) at every vertex and pair, or with diagonal R the segment of Theorem 5.2 at every ρ.
    /// *Not guaranteed:* as for [`ParameterDependentSaturated`](Self::ParameterDependentSaturated).
    #[serde(rename = "Theorem 4.4 with (5.20), (5.21)")]
    ParameterDependentSaturatedHighGain,
}

impl Theorem {
    /// The theorem that [`synthesize`](super::synthesize) solves for `request`, or with `frozen` [`frozen`](super::frozen).
    pub fn of(polytope: &Polytope, request: &PolytopicRequest, frozen: bool) -> Self {
        let single = polytope.len() == 1;
        let level = match (&request.saturation, request.high_gain) {
            (None, _) => 0,
            (Some(_), None) => 1,
            (Some(_), Some(_)) => 2,
        };
        match (&request.weights, &request.lyapunov, level) {
            (None, ..) if single => Theorem::Stabilization,
            (None, Lyapunov::Common, _) => Theorem::CommonStabilization,
            (None, Lyapunov::ParameterDependent { .. }, _) => Theorem::ParameterDependentStabilization,
            (Some(_), _, 0) if frozen => Theorem::FrozenRegulator,
            (Some(_), _, 1) if frozen => Theorem::FrozenSaturated,
            (Some(_), ..) if frozen => Theorem::FrozenSaturatedHighGain,
            (Some(_), _, 0) if single => Theorem::Regulator,
            (Some(_), _, 1) if single => Theorem::Saturated,
            (Some(_), ..) if single => Theorem::SaturatedHighGain,
            (Some(_), Lyapunov::Common, 0) if polytope.has_constant_b() => Theorem::CommonRegulatorConstantInput,
            (Some(_), Lyapunov::Common, 0) => Theorem::CommonRegulator,
            (Some(_), Lyapunov::Common, 1) => Theorem::CommonSaturated,
            (Some(_), Lyapunov::Common, _) => Theorem::CommonSaturatedHighGain,
            (Some(_), Lyapunov::ParameterDependent { .. }, 0) => Theorem::ParameterDependentRegulator,
            (Some(_), Lyapunov::ParameterDependent { .. }, 1) => Theorem::ParameterDependentSaturated,
            (Some(_), Lyapunov::ParameterDependent { .. }, _) => Theorem::ParameterDependentSaturatedHighGain,
        }
    }
}
