//! Proofs over a polytope of matrices, for K and P from anywhere.
//!
//! With A(ρ) = Σ ρᵢAᵢ, B(ρ) = Σ ρᵢBᵢ every claim is a double sum Σ ρᵢρⱼ Mᵢⱼ ≻ 0 with
//!
//! ```text
//! P given:  V = xᵀPx,        u = −Σρᵢ Kᵢ x,           Mᵢⱼ = −(P(Aᵢ − BᵢSⱼ) + ·ᵀ)
//! Y given:  V = xᵀY(ρ)⁻¹x,   u = −L(ρ)Y(ρ)⁻¹x,        Mᵢⱼ = −((AᵢYⱼ − BᵢSⱼ) + ·ᵀ) + Ẏ(ν)
//! ```
//!
//! for S of rows of K and F (or of L and FY). It is proved by Mᵢᵢ ≻ 0 and Mᵢⱼ + Mⱼᵢ ≻ 0 (the thesis's (A.10)), each in interval
//! arithmetic; with the cost, Q and R enter by their Schur complement, which for the pair (i, j) subtracts
//! ½(Yᵢ + Yⱼ)Q(Yᵢ + Yⱼ) + ½(Sᵢ + Sⱼ)ᵀR(Sᵢ + Sⱼ), or 2Q and the second term. A box of several parameters is the polytope of
//! its corners.

use super::matrix::{CellMatrix, Definiteness, TaylorMatrix};
use crate::certificate::{Claim, Verdict, Witness};
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::matrix::symmetric_part;
use crate::math::taylor::Taylor;
use crate::model::Polytope;
use crate::synthesis::CostWeights;
use crate::synthesis::polytopic::InputBounds;
use std::time::Instant;

/// Factors of the cost bound, of which the least that can be proved is claimed.
const COST_FACTORS: [f64; 4] = [1.0, 1.0001, 1.01, 1.1];

/// The Lyapunov function and the gain that belongs to it.
#[derive(Clone, Debug)]
pub enum PolytopicLyapunov {
    /// V = xᵀPx for any motion of the parameter, u = −Σρᵢ Kᵢ x.
    Common {
        /// P, n × n.
        p: Mat<f64>,
        /// Kᵢ, m × n, one for each vertex.
        gain: Vec<Mat<f64>>,
    },
    /// V = xᵀ(Σρᵢ Yᵢ)⁻¹x for ρ̇ in the hull of the rate vertices, u = −(Σρᵢ Lᵢ)(Σρᵢ Yᵢ)⁻¹x.
    ParameterDependent {
        /// Yᵢ, n × n.
        y: Vec<Mat<f64>>,
        /// Lᵢ, m × n.
        l: Vec<Mat<f64>>,
        /// νₖ, each with a rate for each vertex.
        rate_vertices: Vec<Vec<f64>>,
    },
}

/// What is to be proved over a polytope.
#[derive(Clone, Debug)]
pub struct PolytopicClaim {
    /// A(ρ) and B(ρ).
    pub polytope: Polytope,
    /// V and the gain.
    pub lyapunov: PolytopicLyapunov,
    /// F of a high gain at the vertices: it stays unsaturated, and K may saturate.
    pub auxiliary_gain: Option<Vec<Mat<f64>>>,
    /// Of the cost; `None`: stability alone.
    pub weights: Option<CostWeights>,
    /// |uᵢ| ≤ σᵢ, on {V ≤ γ}.
    pub saturation: Option<InputBounds>,
}

/// Prove over the whole polytope: P ≻ 0, the unsaturated set, that V decreases (and with it that the set is invariant), and
/// the cost bound.
///
/// # Panics
/// If sizes do not fit.
pub fn prove_polytopic(claim: &PolytopicClaim) -> Vec<Claim> {
    let sums = Sums::new(claim);
    let mut claims = vec![sums.definite()];
    if let Some(bounds) = &claim.saturation {
        claims.push(sums.unsaturated(bounds));
    }
    let what = match &claim.saturation {
        Some(bounds) => format!("the set V <= {} is invariant", bounds.gamma),
        None => "V decreases".into(),
    };
    claims.push(sums.decrease(&format!("{what}{}", sums.every()), 1.0, None));
    if let Some(weights) = &claim.weights {
        let of_factor = |factor: f64| {
            let words = format!("the cost is at most {factor} V(x(0)){}", sums.every());
            sums.decrease(&words, factor, Some(weights))
        };
        let attempts: Vec<Claim> = COST_FACTORS.into_iter().map(of_factor).collect();
        let proved = attempts.iter().position(|claim| claim.verdict == Verdict::Proved).unwrap_or(0);
        claims.extend(attempts.into_iter().nth(proved));
    }
    claims
}

/// Everything of a claim as interval matrices.
struct Sums<'a> {
    claim: &'a PolytopicClaim,
    /// P, or the Yᵢ.
    lyapunov: Vec<TaylorMatrix>,
    /// Kᵢ, or the Lᵢ.
    gain: Vec<TaylorMatrix>,
    /// Fᵢ, or the FᵢYᵢ.
    auxiliary: Option<Vec<TaylorMatrix>>,
    /// At least one; zeros for a common P.
    rates: Vec<Vec<f64>>,
}

/// A matrix that has to be definite.
struct Condition {
    matrix: TaylorMatrix,
    /// What is refuted if this is not definite: the claim itself at these convex weights and rates.
    at: TaylorMatrix,
    weights: Vec<f64>,
    rates: Vec<f64>,
}

impl<'a> Sums<'a> {
    fn new(claim: &'a PolytopicClaim) -> Self {
        let all = |matrices: &[Mat<f64>]| matrices.iter().map(TaylorMatrix::constant).collect::<Vec<_>>();
        let symmetric = |matrix: &Mat<f64>| TaylorMatrix::constant(&symmetric_part(matrix));
        let zeros = vec![vec![0.0; claim.polytope.len()]];
        let f = claim.auxiliary_gain.as_deref().map(all);
        match &claim.lyapunov {
            PolytopicLyapunov::Common { p, gain } => {
                Self { claim, lyapunov: vec![symmetric(p)], gain: all(gain), auxiliary: f, rates: zeros }
            }
            PolytopicLyapunov::ParameterDependent { y, l, rate_vertices } => {
                let y: Vec<TaylorMatrix> = y.iter().map(symmetric).collect();
                // any M with F = M(ρ)Y(ρ)⁻¹ will do: the one of these numbers
                let auxiliary = f.map(|f| f.iter().zip(&y).map(|(f, y)| f.times(y)).collect());
                Self { claim, lyapunov: y, gain: all(l), auxiliary, rates: rate_vertices.clone() }
            }
        }
    }

    fn len(&self) -> usize {
        self.claim.polytope.len()
    }

    fn is_common(&self) -> bool {
        matches!(self.claim.lyapunov, PolytopicLyapunov::Common { .. })
    }

    fn every(&self) -> &'static str {
        match (self.len(), self.is_common()) {
            (1, _) => "",
            (_, true) => " for every motion of the parameter in the polytope",
            (_, false) => " for every motion of the parameter in the polytope with rates in the hull of rate_vertices",
        }
    }

    fn vertex(&self, i: usize) -> Vec<f64> {
        (0..self.len()).map(|k| f64::from(u8::from(k == i))).collect()
    }

    fn definite(&self) -> Claim {
        let at = |(i, matrix): (usize, &TaylorMatrix)| Condition {
            matrix: matrix.clone(),
            at: matrix.clone(),
            weights: self.vertex(i),
            rates: Vec::new(),
        };
        let conditions: Vec<Condition> = self.lyapunov.iter().enumerate().map(at).collect();
        decide("P is positive definite", Instant::now(), &conditions)
    }

    /// [σ²/γ, f; fᵀ, P] ≻ 0 at every vertex, which is affine in ρ.
    fn unsaturated(&self, bounds: &InputBounds) -> Claim {
        let low = self.auxiliary.as_ref().unwrap_or(&self.gain);
        let n = self.claim.polytope.states();
        let conditions = (0..self.len()).flat_map(|i| (0..bounds.sigma.len()).map(move |input| (i, input)));
        let conditions = conditions.map(|(i, input)| {
            let matrix = &self.lyapunov[i.min(self.lyapunov.len() - 1)];
            let square = Interval::point(bounds.sigma[input]).square() / bounds.gamma;
            let bordered = TaylorMatrix::from_fn(n + 1, n + 1, |r, c| match (r, c) {
                (0, 0) => Taylor::constant(square),
                (0, c) => low[i].at(input, c - 1),
                (r, 0) => low[i].at(input, r - 1),
                (r, c) => matrix.at(r - 1, c - 1),
            });
            Condition { at: bordered.clone(), matrix: bordered, weights: self.vertex(i), rates: Vec::new() }
        });
        decide(
            &format!("the low gain does not saturate on V <= {}", bounds.gamma),
            Instant::now(),
            &conditions.collect::<Vec<_>>(),
        )
    }

    /// κM − (cost) ≻ 0 for vertices, pairs, rates and mixtures.
    fn decrease(&self, words: &str, factor: f64, cost: Option<&CostWeights>) -> Claim {
        let started = Instant::now();
        let mixtures = if self.auxiliary.is_some() { 1 << self.claim.polytope.inputs() } else { 1 };
        let mut conditions = Vec::new();
        for mixture in 0..mixtures {
            let s = self.mixed(mixture);
            for rates in &self.rates {
                for i in 0..self.len() {
                    for j in i..self.len() {
                        conditions.push(self.pair([i, j], &s, rates, factor, cost));
                    }
                }
            }
        }
        decide(words, started, &conditions)
    }

    /// Rows of K (bit set) and of F, or of L and FY.
    fn mixed(&self, mixture: usize) -> Vec<TaylorMatrix> {
        let Some(low) = &self.auxiliary else { return self.gain.clone() };
        let (m, n) = (self.claim.polytope.inputs(), self.claim.polytope.states());
        let row = |(k, f): (&TaylorMatrix, &TaylorMatrix)| {
            TaylorMatrix::from_fn(m, n, |i, j| if mixture >> i & 1 == 1 { k.at(i, j) } else { f.at(i, j) })
        };
        self.gain.iter().zip(low).map(row).collect()
    }

    /// P or Yᵢ.
    fn lyapunov(&self, i: usize) -> &TaylorMatrix {
        &self.lyapunov[i.min(self.lyapunov.len() - 1)]
    }

    /// Mᵢⱼ without the cost.
    fn flow(&self, i: usize, j: usize, s: &[TaylorMatrix], rates: &[f64]) -> TaylorMatrix {
        let a = TaylorMatrix::constant(self.claim.polytope.a(i));
        let b = TaylorMatrix::constant(self.claim.polytope.b(i));
        let bs = b.times(&s[j]);
        if self.is_common() {
            let flow = self.lyapunov(0).times(&bs.minus(&a));
            return flow.plus(&flow.transpose());
        }
        let flow = bs.minus(&a.times(self.lyapunov(j)));
        let n = self.claim.polytope.states();
        let rate = TaylorMatrix::from_fn(n, n, |r, c| {
            (rates.iter().zip(&self.lyapunov)).fold(Taylor::from(0.0), |sum, (&rate, y)| sum + y.at(r, c) * rate)
        });
        flow.plus(&flow.transpose()).plus(&rate)
    }

    /// Mᵢᵢ, or Mᵢⱼ + Mⱼᵢ; and four times the claim's matrix halfway between the two vertices.
    fn pair(
        &self,
        [i, j]: [usize; 2],
        s: &[TaylorMatrix],
        rates: &[f64],
        factor: f64,
        cost: Option<&CostWeights>,
    ) -> Condition {
        let times = |matrix: &TaylorMatrix, factor: f64| {
            let n = self.claim.polytope.states();
            TaylorMatrix::from_fn(n, n, |r, c| matrix.at(r, c) * factor)
        };
        // of the sums, four times the cost halfway
        let stage = cost.map(|CostWeights { q, r }| {
            let input = s[i].plus(&s[j]).quadratic(r);
            match self.is_common() {
                true => input.plus(&times(&TaylorMatrix::constant(q), 4.0)),
                false => input.plus(&self.lyapunov(i).plus(self.lyapunov(j)).quadratic(q)),
            }
        });
        let less = |flow: TaylorMatrix, share: f64| match &stage {
            None => flow,
            Some(stage) => times(&flow, factor).minus(&times(stage, share)),
        };
        let halfway: Vec<f64> = self.vertex(i).iter().zip(self.vertex(j)).map(|(a, b)| 0.5 * (a + b)).collect();
        let rates_of_claim = if self.is_common() { Vec::new() } else { rates.to_vec() };
        let (ii, jj) = (self.flow(i, i, s, rates), self.flow(j, j, s, rates));
        let matrix;
        let at;
        if i == j {
            matrix = less(ii, 0.25);
            at = matrix.clone();
        } else {
            let both = self.flow(i, j, s, rates).plus(&self.flow(j, i, s, rates));
            at = less(ii.plus(&jj).plus(&both), 1.0);
            matrix = less(both, 0.5);
        }
        Condition { matrix, at, weights: halfway, rates: rates_of_claim }
    }
}

/// Proved if every condition is; refuted if one is false where it is the claim itself.
fn decide(words: &str, started: Instant, conditions: &[Condition]) -> Claim {
    let verdict_of = |matrix: &TaylorMatrix| CellMatrix::new(matrix, matrix).is_positive(0.0);
    let place = |condition: &Condition| {
        let rates =
            if condition.rates.is_empty() { String::new() } else { format!(" with rates {:?}", condition.rates) };
        format!("at vertex weights {:?}{rates}", condition.weights)
    };
    let mut claim = Claim::checked(words, Verdict::Proved, f64::INFINITY, "");
    claim.cells = conditions.len();
    for condition in conditions {
        match verdict_of(&condition.matrix) {
            // NaN of an undecided one stays
            Definiteness::Proved(margin) if claim.margin >= margin => claim.margin = margin,
            Definiteness::Proved(_) => {}
            _ => match verdict_of(&condition.at) {
                Definiteness::Refuted { direction, value } => {
                    claim.verdict = Verdict::Refuted;
                    claim.margin = value;
                    claim.detail = format!("fails {}", place(condition));
                    claim.witness = Some(Witness {
                        vertex_weights: condition.weights.clone(),
                        vertex_rates: condition.rates.clone(),
                        state: direction,
                        value,
                        ..Witness::default()
                    });
                    break;
                }
                _ => {
                    claim.verdict = Verdict::Undecided;
                    claim.margin = f64::NAN;
                    claim.detail = format!("neither proved nor refuted {}", place(condition));
                }
            },
        }
    }
    if claim.verdict == Verdict::Proved {
        claim.detail = format!("relative margin {:.1e}, {} matrices", claim.margin, claim.cells);
    }
    claim.seconds = started.elapsed().as_secs_f64();
    claim
}
