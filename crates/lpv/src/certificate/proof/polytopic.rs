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
//! ½(Yᵢ + Yⱼ)Q(Yᵢ + Yⱼ) + ½(Sᵢ + Sⱼ)ᵀR(Sᵢ + Sⱼ), or 2Q and the second term. Where inputs may saturate, S = F and what `rowwise.rs`
//! subtracts come first; mixtures are for a few inputs where that does not prove. A box of several parameters is the polytope of
//! its corners.

use super::matrix::{CellMatrix, Definiteness, TaylorMatrix};
use super::rowwise::{Balanced, Rows, mixed, mixtures, multipliers, separable, shares};
use super::weights;
use super::witness::{Broken, Loop, form, image, inverse, unsaturated_scale};
use crate::certificate::claim::{Claim, ClaimKind, Motion, Of, Verdict, Witness, Words, settle};
use crate::math::Mat;
use crate::math::decimal::at_least;
use crate::math::definite::asymmetry;
use crate::math::interval::Interval;
use crate::math::matrix::symmetric_part;
use crate::math::taylor::Taylor;
use crate::model::Polytope;
use crate::mutant;
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

impl PolytopicLyapunov {
    /// P, or the Yᵢ.
    fn matrices(&self) -> &[Mat<f64>] {
        match self {
            Self::Common { p, .. } => std::slice::from_ref(p),
            Self::ParameterDependent { y, .. } => y,
        }
    }
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
    let motion = sums.motion();
    let mut claims: Vec<Claim> = claim.weights.iter().map(|given| weights::claim(given, &words())).collect();
    claims.push(sums.definite());
    let level = sums.limited_rows().first().and(claim.saturation.as_ref()).map(|bounds| bounds.gamma);
    if let Some(level) = level {
        claims.push(sums.unsaturated(level));
    }
    let decrease = match level {
        Some(level) => ClaimKind::Invariance { level, motion },
        None => ClaimKind::Decrease { motion },
    };
    claims.push(sums.decrease(decrease, level, None));
    if let Some(weights) = &claim.weights {
        let of_factor =
            |factor: f64| sums.decrease(ClaimKind::Cost { factor, level, motion }, level, Some((factor, weights)));
        let attempts: Vec<Claim> = COST_FACTORS.into_iter().map(of_factor).collect();
        let proved = attempts.iter().position(|claim| claim.verdict == Verdict::Proved).unwrap_or(0);
        claims.extend(attempts.into_iter().nth(proved));
    }
    settle(&mut claims);
    claims
}

fn words() -> Words {
    Words { lyapunov: "V", ..Words::default() }
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
    /// The same quadratic form at these convex weights and rates, where this one is of a pair.
    at: TaylorMatrix,
    weights: Vec<f64>,
    rates: Vec<f64>,
    /// `at` is of the gain that flies, unsaturated.
    is_motion: bool,
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
                let auxiliary = f.map(|f| f.iter().zip(&y).map(|(f, y)| f.times(y)).collect::<Vec<_>>());
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

    fn motion(&self) -> Motion {
        match (self.len(), self.is_common()) {
            (1, _) => Motion::None,
            (_, true) => Motion::Any,
            (_, false) => Motion::Hull,
        }
    }

    /// σ of input `i`; infinite where it is not limited.
    fn sigma(&self, i: usize) -> f64 {
        let free = |sigma: &[f64]| mutant::is("one-free-frees-all") && sigma.contains(&f64::INFINITY);
        let bounds = self.claim.saturation.as_ref().filter(|bounds| !free(&bounds.sigma));
        bounds.map_or(f64::INFINITY, |bounds| bounds.sigma[i])
    }

    /// The inputs that may saturate: limited, of a high gain.
    fn saturating(&self) -> Vec<usize> {
        let inputs = self.claim.polytope.inputs();
        (0..inputs).filter(|&i| self.auxiliary.is_some() && self.sigma(i).is_finite()).collect()
    }

    /// The limited inputs that the low gain moves at some vertex: rows of zeros never reach a limit.
    fn limited_rows(&self) -> Vec<usize> {
        let (inputs, n) = (self.claim.polytope.inputs(), self.claim.polytope.states());
        let moves = |i: usize| (0..self.len()).any(|k| (0..n).any(|j| !self.low(i)[k].at(i, j).is_zero()));
        (0..inputs).filter(|&i| self.sigma(i).is_finite() && moves(i)).collect()
    }

    /// The gain whose row `i` is not to saturate.
    fn low(&self, i: usize) -> &[TaylorMatrix] {
        self.auxiliary.as_ref().filter(|_| self.sigma(i).is_finite()).unwrap_or(&self.gain)
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
            is_motion: true,
        };
        let is_symmetric = |matrix: &Mat<f64>| asymmetry(matrix).is_none() || mutant::is("asymmetry-tolerated");
        if !self.claim.lyapunov.matrices().iter().all(is_symmetric) {
            // V is not a quadratic form of these numbers
            let claim = Claim::new(ClaimKind::LyapunovDefinite, Of::Model, &words());
            return claim.decided(Verdict::Undecided, f64::NAN, "P or Y is not symmetric to the last digit");
        }
        let mut conditions: Vec<Condition> = self.lyapunov.iter().enumerate().map(at).collect();
        conditions.truncate(if mutant::is("definiteness-assumed") { 0 } else { usize::MAX });
        decide(ClaimKind::LyapunovDefinite, Instant::now(), &conditions, |condition, direction, value| {
            Some(condition.witness(self.state(&condition.weights, direction), value))
        })
    }

    /// [1/γ, f/σ; fᵀ/σ, P] ≻ 0 at every vertex, which is affine in ρ.
    fn unsaturated(&self, gamma: f64) -> Claim {
        let n = self.claim.polytope.states();
        let rows = self.limited_rows();
        let conditions = (0..self.len()).flat_map(|i| rows.iter().map(move |&input| (i, input)));
        let conditions = conditions.map(|(i, input)| {
            let matrix = self.lyapunov(i);
            let sigma = Taylor::constant(Interval::point(self.sigma(input)));
            let row = |c: usize| self.low(input)[i].at(input, c) / sigma;
            let bordered = TaylorMatrix::from_fn(n + 1, n + 1, |r, c| match (r, c) {
                (0, 0) => Taylor::constant(Interval::point(1.0) / gamma),
                (0, c) => row(c - 1),
                (r, 0) => row(r - 1),
                (r, c) => matrix.at(r - 1, c - 1),
            });
            Condition {
                at: bordered.clone(),
                matrix: bordered,
                weights: self.vertex(i),
                rates: Vec::new(),
                is_motion: true,
            }
        });
        let mut conditions: Vec<Condition> = conditions.collect();
        conditions.truncate(if mutant::is("level-unchecked") { 0 } else { usize::MAX });
        let kind = ClaimKind::Unsaturated { level: gamma };
        // the multiple of the direction with V = γ passes the limit, see `witness`
        decide(kind, Instant::now(), &conditions, |condition, direction, value| {
            Some(condition.witness(self.state(&condition.weights, direction.get(1..)?), value))
        })
        .resting_on(&["lyapunov-definite"])
    }

    /// κM − (cost) ≻ 0 for vertices, pairs and rates: by rows where inputs may saturate, and where that does not prove, for every mixture
    /// of the rows of a few.
    fn decrease(&self, kind: ClaimKind, level: Option<f64>, cost: Option<(f64, &CostWeights)>) -> Claim {
        let started = Instant::now();
        let (factor, weights) = cost.map_or((1.0, None), |(factor, weights)| (factor, Some(weights)));
        let saturating = self.saturating();
        let decided = |conditions: &[Condition]| {
            decide(kind.clone(), started, conditions, |condition, direction, value| match cost {
                // a mixture of rows is no motion
                None if condition.is_motion => self.leaves(condition, direction, value, level),
                None => None,
                Some((factor, weights)) => self.costs_more(condition, factor, weights),
            })
        };
        let by_rows = (!saturating.is_empty()).then(|| decided(&self.by_rows(&saturating, factor, weights)));
        let claim = match (by_rows, mixtures(saturating.len())) {
            (Some(claim), _) if claim.verdict != Verdict::Undecided => claim,
            (Some(claim), None) => claim,
            (_, count) => {
                let count = count.unwrap_or(1);
                let of_mixture = |mixture: usize| {
                    let s = self.mixed(mixture, &saturating);
                    let of = self.conditions(&s, factor, weights);
                    of.into_iter().map(move |c| Condition { is_motion: mixture + 1 == count, ..c })
                };
                decided(&(0..count).flat_map(of_mixture).collect::<Vec<Condition>>())
            }
        };
        let mut premises = vec!["lyapunov-definite"];
        premises.extend(weights.map(|_| "weights"));
        premises.extend(level.map(|_| "unsaturated"));
        premises.extend(level.and(weights).map(|_| "invariance"));
        claim.resting_on(&premises)
    }

    /// The state that a direction of a condition's matrix stands for: itself, or Y(ρ)z.
    fn state(&self, weights: &[f64], direction: &[f64]) -> Vec<f64> {
        match self.claim.lyapunov {
            PolytopicLyapunov::Common { .. } => direction.to_vec(),
            PolytopicLyapunov::ParameterDependent { .. } => {
                image(&self.mean(&self.lyapunov, weights), direction).into_iter().map(Interval::middle).collect()
            }
        }
    }

    /// Σ ρᵢMᵢ.
    fn mean(&self, matrices: &[TaylorMatrix], weights: &[f64]) -> TaylorMatrix {
        if matrices.len() == 1 {
            return matrices[0].clone();
        }
        let (rows, columns) = matrices[0].shape();
        TaylorMatrix::from_fn(rows, columns, |i, j| {
            let terms = matrices.iter().zip(weights).filter(|&(_, &weight)| weight != 0.0);
            terms.fold(Taylor::from(0.0), |sum, (matrix, &weight)| sum + matrix.at(i, j) * weight)
        })
    }

    /// The witness that V grows at these weights and rates: where there is a level, on the edge of the set with no input at its limit.
    fn leaves(&self, condition: &Condition, direction: &[f64], value: f64, level: Option<f64>) -> Option<Witness> {
        let size = form(&self.mean(&self.lyapunov, &condition.weights), direction);
        if let Some(level) = level {
            let inputs = image(&self.mean(&self.gain, &condition.weights), direction);
            let stays = |(i, input): (usize, &Interval)| {
                let [square, bound] = [input.magnitude(), self.sigma(i)].map(|x| Interval::point(x).square());
                !self.sigma(i).is_finite() || (square * level).hi() < (bound * size.lo()).lo()
            };
            if size.lo() <= 0.0 || !inputs.iter().enumerate().all(stays) && !mutant::is("witness-saturates") {
                return None;
            }
        }
        let inputs = image(&self.mean(&self.gain, &condition.weights), direction);
        // on the edge, or so small that no input is at its limit
        let scale = match level {
            Some(level) => level.sqrt() / size.middle().sqrt(),
            None => (inputs.iter().enumerate().filter(|&(i, _)| self.sigma(i).is_finite()))
                .map(|(i, &input)| unsaturated_scale(self.sigma(i), input))
                .fold(1.0, f64::min),
        };
        if scale.is_nan() || scale <= 0.0 {
            return None;
        }
        let state = self.state(&condition.weights, direction).iter().map(|x| scale * x).collect();
        Some(condition.witness(state, value))
    }

    /// The witness that a motion at rest at these weights costs more than `factor` V(x(0)).
    fn costs_more(&self, condition: &Condition, factor: f64, weights: &CostWeights) -> Option<Witness> {
        // an input without room saturates however small the state is
        let has_room = (0..self.claim.polytope.inputs()).all(|i| self.sigma(i) > 0.0);
        if !self.allows_rest() || !has_room {
            return None;
        }
        let (polytope, at) = (&self.claim.polytope, &condition.weights);
        let all = |of: &dyn Fn(usize) -> TaylorMatrix| (0..self.len()).map(of).collect::<Vec<_>>();
        let a = self.mean(&all(&|i| TaylorMatrix::constant(polytope.a(i))), at);
        let b = self.mean(&all(&|i| TaylorMatrix::constant(polytope.b(i))), at);
        let (matrix, gain) = (self.mean(&self.lyapunov, at), self.mean(&self.gain, at));
        let (p, k) = match self.is_common() {
            true => (matrix, gain),
            false => {
                let p = inverse(&matrix)?;
                let k = gain.times(&p);
                (p, k)
            }
        };
        let motion = Loop {
            flow: a.minus(&b.times(&k)),
            stage: k.quadratic(&weights.r).plus(&TaylorMatrix::constant(&weights.q)),
            lyapunov: p,
            limited: (0..polytope.inputs()).any(|i| self.sigma(i).is_finite()),
        };
        let Broken { state, value } = motion.exceeds_cost(factor)?;
        Some(Witness { vertex_weights: at.clone(), state, value, ..Witness::default() })
    }

    /// Whether ρ̇ = 0 is certainly among the rates.
    fn allows_rest(&self) -> bool {
        let is_opposite = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(x, y)| *x == -*y);
        self.rates.iter().any(|a| self.rates.iter().any(|b| is_opposite(a, b)))
    }

    /// Rows of K and of F, or of L and FY.
    fn mixed(&self, mixture: usize, saturating: &[usize]) -> Vec<TaylorMatrix> {
        let Some(low) = &self.auxiliary else { return self.gain.clone() };
        self.gain.iter().zip(low).map(|(k, f)| mixed(mixture, saturating, f, k)).collect()
    }

    /// The conditions with the gains `s`, unsaturated.
    fn conditions(&self, s: &[TaylorMatrix], factor: f64, cost: Option<&CostWeights>) -> Vec<Condition> {
        let pair = |pair: [usize; 2], rates: &Vec<f64>| self.pair(pair, s, rates, factor, cost);
        self.rates.iter().flat_map(|rates| self.pairs().map(move |at| pair(at, rates))).collect()
    }

    /// Pairs of vertices, each with itself too.
    fn pairs(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let count = self.len();
        let skips = move |[i, j]: [usize; 2]| {
            mutant::is("vertex-skipped") && i == j && i > 0 && i + 1 == count || mutant::is("pair-skipped") && i != j
        };
        (0..count).flat_map(move |i| (i..count).map(move |j| [i, j])).filter(move |&pair| !skips(pair))
    }

    /// The conditions under saturation, see `rowwise.rs`: δᵢ is affine in ρ, so that Σ δᵢᵀδᵢ/(4cᵢ) is a double sum too. Halfway stands the
    /// loop of K, which moves so.
    fn by_rows(&self, saturating: &[usize], factor: f64, cost: Option<&CostWeights>) -> Vec<Condition> {
        let m = self.claim.polytope.inputs();
        let r = cost.map_or_else(|| Mat::zeros(m, m), |weights| separable(&weights.r, saturating));
        let bound = cost.map(|weights| CostWeights { q: weights.q.clone(), r: r.clone() });
        let low = self.mixed(0, saturating);
        let rows: Vec<Rows> = (0..self.len())
            .map(|i| {
                let b = TaylorMatrix::constant(self.claim.polytope.b(i)).transpose();
                let input = if self.is_common() { b.times(self.lyapunov(0)) } else { b };
                let weights = [factor, f64::from(u8::from(cost.is_some()))];
                Rows::new(saturating, &input, [&low[i], &self.gain[i]], &r, weights)
            })
            .collect();
        let conditions = self.conditions(&low, factor, bound.as_ref());
        let pairs: Vec<[usize; 2]> = self.rates.iter().flat_map(|_| self.pairs()).collect();
        let multipliers = multipliers(&balanced(&conditions, &pairs, &rows));
        let moving: Vec<bool> =
            (0..saturating.len()).map(|input| rows.iter().any(|rows| rows.moving()[input])).collect();
        let deltas: Vec<TaylorMatrix> = rows.iter().map(|rows| rows.deltas(&multipliers, &moving)).collect();
        let weighted: Vec<TaylorMatrix> =
            deltas.iter().map(|delta| TaylorMatrix::constant(&shares(&multipliers)).times(delta)).collect();
        let lost = |[i, j]: [usize; 2]| {
            let product = deltas[i].transpose().times(&weighted[j]);
            if i == j { product } else { product.plus(&product.transpose()) }
        };
        let of_high = self.conditions(&self.gain, factor, cost);
        let under_saturation = |((low, high), &pair): ((Condition, Condition), &[usize; 2])| Condition {
            matrix: low.matrix.minus(&lost(pair)),
            is_motion: true,
            ..high
        };
        conditions.into_iter().zip(of_high).zip(&pairs).map(under_saturation).collect()
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
            let forgotten = mutant::is("input-cost-forgotten").then(|| Mat::zeros(r.nrows(), r.ncols()));
            let input = s[i].plus(&s[j]).quadratic(forgotten.as_ref().unwrap_or(r));
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
            matrix = less(both, if mutant::is("pair-cost-halved") { 0.25 } else { 0.5 });
        }
        Condition { matrix, at, weights: halfway, rates: rates_of_claim, is_motion: true }
    }
}

/// The matrices of vertices and pairs as numbers, with the rows that take from them.
fn balanced(conditions: &[Condition], pairs: &[[usize; 2]], rows: &[Rows]) -> Vec<Balanced> {
    let numbers: Vec<[Mat<f64>; 2]> = rows.iter().map(Rows::middle).collect();
    let of_pair = |(condition, &[i, j]): (&Condition, &[usize; 2])| {
        // ¼(2δ)² of a vertex, and at most ½(δᵢ + δⱼ)² of a pair
        let share = if i == j { 0.5 } else { 0.5_f64.sqrt() };
        let mean = |of: usize| share * (&numbers[i][of] + &numbers[j][of]);
        let base = CellMatrix::new(&condition.matrix, &condition.matrix).middle();
        Balanced { base, gradient: mean(0), difference: mean(1) }
    };
    conditions.iter().zip(pairs).map(of_pair).collect()
}

impl Condition {
    fn witness(&self, state: Vec<f64>, value: f64) -> Witness {
        let (vertex_weights, vertex_rates) = (self.weights.clone(), self.rates.clone());
        Witness { vertex_weights, vertex_rates, state, value, ..Witness::default() }
    }
}

/// Proved if every condition is; refuted if one is false and `witness` makes of its direction a motion that breaks the claim.
fn decide(
    kind: ClaimKind,
    started: Instant,
    conditions: &[Condition],
    witness: impl Fn(&Condition, &[f64], f64) -> Option<Witness>,
) -> Claim {
    let verdict_of = |matrix: &TaylorMatrix| CellMatrix::new(matrix, matrix).is_positive(0.0);
    let mut claim = Claim::new(kind, Of::Model, &words()).decided(Verdict::Proved, f64::INFINITY, "");
    claim.cells = conditions.len();
    for condition in conditions {
        if let Definiteness::Proved(margin) = verdict_of(&condition.matrix) {
            // NaN of an undecided one stays
            if claim.margin >= margin {
                claim.margin = margin;
            }
            continue;
        }
        let rates = match condition.rates.is_empty() {
            true => String::new(),
            false => format!(" with rates {:?}", condition.rates),
        };
        claim.verdict = Verdict::Undecided;
        claim.margin = f64::NAN;
        claim.detail = format!("neither proved nor refuted at vertex weights {:?}{rates}", condition.weights);
        if let Definiteness::Refuted { direction, value } = verdict_of(&condition.at) {
            claim = claim.refuted_by(witness(condition, &direction, value));
        }
        if claim.verdict == Verdict::Refuted {
            break;
        }
    }
    if claim.verdict == Verdict::Proved {
        claim.detail = format!("relative margin {}, {} matrices", at_least(claim.margin), claim.cells);
    }
    claim.seconds = started.elapsed().as_secs_f64();
    claim
}
