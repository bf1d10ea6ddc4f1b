//! Theorems 2.1, 4.3, 4.4 and 5.1-5.4: the optimum of a regulator, and the design with a moderate gain after it.
//!
//! Whatever the weights and bounds, there is a solution if and only if the system can be stabilised by the same Lyapunov function:
//! for T(Y, L) ≻ 0, (εY, εL) satisfies ε T − ε²(YQY + LᵀRL) ≻ 0 and ε ℓᵢY⁻¹ℓᵢᵀ < σᵢ²/γ for small ε > 0, and the first block of each
//! inequality is T. Where it cannot, Y → 0 in some direction comes as near to a solution as one likes; the solver then stops short
//! without a witness, and the stabilisation's is taken.

use super::inequality::{DoubleSum, Unknowns, Weights};
use super::moderation::{COST_LADDER, Stage};
use super::objective::Posed;
use super::stabilization::Stabilization;
use super::{
    BackOff, HighGain, Objective, PolytopicDesign, PolytopicRequest, Solution, UnstabilizablePoint, distinct, finish,
    solver,
};
use crate::math::Mat;
use crate::math::eigen::smallest_eigenvalue;
use crate::math::matrix::{inverse_spd, is_diagonal, trace};
use crate::math::riccati::{self, Regulator, RiccatiError};
use crate::math::stabilizability::{Mode, Stabilizability, stabilizability};
use crate::model::Polytope;
use crate::synthesis::high_gain::{Segment, mixture};
use crate::synthesis::{CostWeights, SynthesisError};
use lmi::{Answer, BlockReport, Expr, Outcome, Problem};

/// What is done where the solver finds no regulator.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum WhereStalled {
    /// Ask why: whether anything stabilises.
    Refute,
    /// Nothing: that is who asks.
    Stop,
}

/// The inequalities of a regulator.
pub(super) struct RegulatorProblem {
    pub problem: Problem,
    unknowns: Unknowns,
    /// Mᵢ, where its mixtures with Lᵢ are inequalities: of a high gain with a general R. With diagonal R the low gain L = M is optimal, and every K_s
    /// satisfies the 2^m inequalities (`high_gain`).
    auxiliary: Option<Vec<Expr>>,
    objective: Posed,
}

impl RegulatorProblem {
    pub fn new(polytope: &Polytope, request: &PolytopicRequest, cost: &CostWeights, weights: &Weights) -> Self {
        let mut problem = Problem::new();
        let unknowns = Unknowns::new(&mut problem, polytope, &request.lyapunov);
        let sum = DoubleSum::new(polytope, &request.lyapunov, &unknowns.y);
        let mixtures = request.high_gain.filter(|_| !is_diagonal(&cost.r));
        let auxiliary: Option<Vec<Expr>> = mixtures.map(|_| {
            let (m, n) = (polytope.inputs(), polytope.states());
            (0..polytope.len()).map(|i| problem.rectangular(format!("M{}", i + 1), m, n)).collect()
        });
        for (k, (name, block)) in performance(&sum, weights, &unknowns.l, auxiliary.as_deref()).into_iter().enumerate()
        {
            match sum.leads(k) {
                true => problem.positive_definite(name, block),
                false => problem.positive_definite_lazily(name, block, None, sum.family(k)),
            }
        }
        for (i, y) in distinct(&unknowns.y, &request.lyapunov).iter().enumerate() {
            problem.positive_definite(format!("Y{} definite", i + 1), (*y).clone());
        }
        if let Some(bounds) = &request.saturation {
            for (name, block) in sum.unsaturated(auxiliary.as_ref().unwrap_or(&unknowns.l), bounds) {
                problem.positive_definite(name, block);
            }
        }
        let objective = request.objective.pose(&mut problem, &distinct(&unknowns.y, &request.lyapunov), &unknowns.y);
        Self { problem, unknowns, auxiliary, objective }
    }

    /// Lᵢ of the gain that is kept small.
    fn low_l(&self) -> &[Expr] {
        self.auxiliary.as_deref().unwrap_or(&self.unknowns.l)
    }

    /// Lᵢ of K_s, on the way from the low gain to R⁻¹BᵀP.
    fn on_segment(&self, polytope: &Polytope, weights: &Weights, s: f64) -> Vec<Expr> {
        let end = |i: usize| s * Expr::constant(&weights.r_inverse * polytope.b(i).transpose());
        self.low_l().iter().enumerate().map(|(i, low)| (1.0 - s) * low + end(i)).collect()
    }

    /// [`Solution::mixtures`] of K_s and F at the vertices.
    pub fn mixtures(
        &self,
        polytope: &Polytope,
        request: &PolytopicRequest,
        weights: &Weights,
        s: f64,
        answer: &Answer,
    ) -> Vec<(String, f64)> {
        let sum = DoubleSum::new(polytope, &request.lyapunov, &self.unknowns.y);
        let high = self.on_segment(polytope, weights, s);
        listed_mixtures(polytope.inputs())
            .into_iter()
            .flat_map(|which| {
                let l: Vec<Expr> = high.iter().zip(self.low_l()).map(|(l, low)| mixture(which, l, low)).collect();
                let name = format!("mixture {which:0inputs$b}", inputs = polytope.inputs());
                sum.performance_at_vertices(&name, &l, weights)
            })
            .map(|(name, block)| (name, smallest_eigenvalue(&answer.value(&block))))
            .collect()
    }
}

/// The optimum of a regulator, as the solver found it.
pub(super) struct Regulation {
    polytope: Polytope,
    request: PolytopicRequest,
    cost: CostWeights,
    weights: Weights,
    posed: RegulatorProblem,
    answer: Answer,
    /// What no back-off changes: that there is no design, or the Riccati equation's.
    settled: Option<PolytopicDesign>,
    undetectable: Option<Mode>,
    seems_unstabilizable: Option<UnstabilizablePoint>,
}

impl Regulation {
    /// Solve for the optimum of `request`, whatever its back-off; `cost` are its weights.
    ///
    /// # Errors
    /// Problems without meaning.
    pub fn new(
        polytope: &Polytope,
        request: &PolytopicRequest,
        cost: &CostWeights,
        where_stalled: WhereStalled,
    ) -> Result<Self, SynthesisError> {
        let weights = Weights::new(cost).expect("weights are checked to be semidefinite and definite");
        let posed = RegulatorProblem::new(polytope, request, cost, &weights);
        let answer = posed.problem.solve(&solver())?;
        let mut regulation = Self {
            polytope: polytope.clone(),
            request: request.clone(),
            cost: cost.clone(),
            weights,
            posed,
            answer,
            settled: None,
            undetectable: None,
            seems_unstabilizable: None,
        };
        regulation.refute_or_settle(where_stalled)?;
        Ok(regulation)
    }

    /// The optimum's.
    pub fn answer(&self) -> &Answer {
        &self.answer
    }

    /// The design with `back_off` of the optimum given back.
    ///
    /// # Errors
    /// No high gain that is stable at the sample time, with the number of the vertex (from 0) for the parameter.
    pub fn design(&self, back_off: BackOff) -> Result<PolytopicDesign, SynthesisError> {
        if let Some(design) = &self.settled {
            return Ok(design.clone());
        }
        let is_attained = self.is_regulator() && self.answer.outcome.is_feasible();
        let back_off = if is_attained && back_off == BackOff::Knee { BackOff::Nothing } else { back_off };
        let (polytope, cost, posed) = (&self.polytope, &self.cost, &self.posed);
        let lqr =
            |i: usize| riccati::solve(polytope.a(i), polytope.b(i), &cost.q, &cost.r).ok().map(|regulator| regulator.k);
        // the knee alone asks for it
        let reference: Vec<Mat<f64>> = match back_off {
            BackOff::Knee => (0..polytope.len()).map(lqr).collect::<Option<_>>().unwrap_or_default(),
            _ => Vec::new(),
        };
        let stage = Stage {
            problem: &posed.problem,
            objective: &posed.objective,
            least: f64::NEG_INFINITY,
            l: posed.low_l(),
            y: &posed.unknowns.y,
            distinct: distinct(&posed.unknowns.y, &self.request.lyapunov).len(),
            r_inverse: &self.weights.r_inverse,
            q: inverse_spd(&cost.q).map(|_| &cost.q),
            ladder: &COST_LADDER,
            reference: &reference,
        };
        let moderated = stage.moderate(self.answer.clone(), back_off, &solver())?;
        let mut design = finish(&posed.problem, moderated, &posed.unknowns, posed.auxiliary.as_deref())?;
        design.withdraw_infeasible(polytope);
        design.undetectable.clone_from(&self.undetectable);
        design.unstabilizable.clone_from(&self.seems_unstabilizable);
        if let (Some(solution), Some(high_gain)) = (&mut design.solution, &self.request.high_gain) {
            self.raise(solution, &design.answer, high_gain)?;
        }
        Ok(design)
    }

    /// Whether it is the regulator of one model without limits, whose optimum is attained.
    fn is_regulator(&self) -> bool {
        self.polytope.len() == 1 && self.request.saturation.is_none()
    }

    /// Find out what no back-off changes.
    fn refute_or_settle(&mut self, where_stalled: WhereStalled) -> Result<(), SynthesisError> {
        let (polytope, cost) = (&self.polytope, &self.cost);
        let contradicts = matches!(self.answer.outcome, Outcome::Infeasible(_) | Outcome::InfeasibleWithin(_));
        if where_stalled == WhereStalled::Refute
            && (contradicts || matches!(self.answer.outcome, Outcome::Inaccurate(_)))
        {
            // whether there is a solution is all that is asked
            let stabilization = Stabilization::new(polytope, &self.request.lyapunov)?.design(BackOff::Nothing)?;
            if stabilization.is_infeasible() {
                self.settled = Some(stabilization);
                return Ok(());
            }
            self.seems_unstabilizable = stabilization.unstabilizable;
        }
        // the least cost from every state at once, so that there is an optimum, which is attained
        if self.is_regulator() && matches!(self.request.objective, Objective::Trace) {
            match riccati::solve(polytope.a(0), polytope.b(0), &cost.q, &cost.r) {
                Ok(regulator) => {
                    self.settled = by_riccati(polytope, cost, &self.posed.problem, &self.answer, &regulator)?;
                }
                // that the objective has no bound follows for a pair that is stabilisable
                Err(RiccatiError::Unweighted(mode))
                    if stabilizability(polytope.a(0), polytope.b(0)) == Stabilizability::Stabilizable =>
                {
                    self.undetectable = Some(mode);
                }
                Err(_) => {}
            }
        }
        Ok(())
    }

    /// From the low gain of `solution` to the high one.
    fn raise(&self, solution: &mut Solution, answer: &Answer, high_gain: &HighGain) -> Result<(), SynthesisError> {
        let (polytope, weights, posed) = (&self.polytope, &self.weights, &self.posed);
        let low = solution.auxiliary_gain.take().unwrap_or_else(|| solution.gain.clone());
        let mut s = choose(polytope, &self.cost, &solution.p, &low, high_gain)?;
        // with a general R the inequalities decide; s = 0 satisfies them, so halving ends
        if posed.auxiliary.is_some() {
            let sum = DoubleSum::new(polytope, &self.request.lyapunov, &posed.unknowns.y);
            let holds = |s: f64| {
                let l = posed.on_segment(polytope, weights, s);
                let blocks = performance(&sum, weights, &l, posed.auxiliary.as_deref());
                blocks.iter().all(|(_, block)| inverse_spd(&answer.value(block)).is_some())
            };
            let mut halvings = 0;
            while s > 0.0 && !holds(s) {
                s = if halvings < 60 { 0.5 * s } else { 0.0 };
                halvings += 1;
            }
        }
        solution.l = posed.on_segment(polytope, weights, s).iter().map(|l| answer.value(l)).collect();
        solution.gain = solution.l.iter().zip(&solution.p).map(|(l, p)| l * p).collect();
        solution.auxiliary_gain = Some(low);
        solution.s = Some(s);
        solution.mixtures = posed.mixtures(polytope, &self.request, weights, s, answer);
        Ok(())
    }
}

/// The performance inequalities of the gain `l`, and of its mixtures with `low` where there is one.
fn performance(sum: &DoubleSum, weights: &Weights, l: &[Expr], low: Option<&[Expr]>) -> Vec<(String, Expr)> {
    let Some(low) = low else { return sum.performance("performance", l, weights) };
    let inputs = l.first().map_or(0, Expr::nrows);
    let of_mixture = |vertex: usize| {
        let mixed: Vec<Expr> = l.iter().zip(low).map(|(l, m)| mixture(vertex, l, m)).collect();
        sum.performance(&format!("performance of mixture {vertex:0inputs$b}"), &mixed, weights)
    };
    (0..1usize << inputs).flat_map(of_mixture).collect()
}

/// Inputs up to which all mixtures are listed.
const MOST_LISTED_INPUTS: usize = 10;

/// The mixtures of a design that are listed: all 2^m of few inputs; of more, whose R is diagonal so that all follow, F and K_s themselves.
fn listed_mixtures(inputs: usize) -> Vec<usize> {
    match inputs <= MOST_LISTED_INPUTS {
        true => (0..1 << inputs).collect(),
        false => vec![0, usize::MAX >> (usize::BITS as usize - inputs)],
    }
}

/// What is added to a solution of the Riccati equation: the least that is tried, relatively, the factor from one to the next, and how many.
const STRICT: (f64, f64, i32) = (1e-14, 10.0, 12);

/// P + εX of [`riccati::strict`], with Y, L and their proved inequalities.
struct Strict {
    epsilon: f64,
    p: Mat<f64>,
    y: Mat<f64>,
    l: Mat<f64>,
    blocks: Vec<BlockReport>,
}

/// Theorem 2.1 by the Riccati equation, whose gain is right to rounding where the solver's has half the digits of its gap: the P of least ε
/// that is proved to satisfy the inequalities of `problem`. With an unobserved motion that decays the optimum is not attained; the gain is that of the optimum all the same.
fn by_riccati(
    polytope: &Polytope,
    cost: &CostWeights,
    problem: &Problem,
    answer: &Answer,
    regulator: &Regulator,
) -> Result<Option<PolytopicDesign>, SynthesisError> {
    let (a, b) = (polytope.a(0), polytope.b(0));
    let at = |step: i32| -> Result<Option<Strict>, SynthesisError> {
        let epsilon = STRICT.0 * STRICT.1.powi(step);
        let Some(p) = riccati::strict((a, b), (&cost.q, &cost.r), regulator, epsilon) else { return Ok(None) };
        let Some(y) = inverse_spd(&p) else { return Ok(None) };
        let l = &regulator.k * &y;
        let blocks = problem.verify(&[y.clone(), l.clone()])?;
        let holds = blocks.iter().all(|block| block.verified_lower_bound > 0.0);
        Ok(holds.then_some(Strict { epsilon, p, y, l, blocks }))
    };
    for step in 0..STRICT.2 {
        let Some(least) = at(step)? else { continue };
        // one more, so that it does not hold by the last digit
        let Strict { epsilon, p, y, l, blocks } = at(step + 1)?.unwrap_or(least);
        let mut answer = answer.clone();
        (answer.objective, answer.blocks) = (trace(&y), blocks);
        let solution = Solution {
            y: vec![y],
            l: vec![l],
            p: vec![p],
            gain: vec![regulator.k.clone()],
            auxiliary_gain: None,
            s: None,
            mixtures: Vec::new(),
        };
        return Ok(Some(PolytopicDesign {
            riccati: Some(epsilon),
            solution: Some(solution),
            ..PolytopicDesign::without_solution(answer)
        }));
    }
    Ok(None)
}

/// The least s of all vertices, each by the rule of [`Segment`].
fn choose(
    polytope: &Polytope,
    cost: &CostWeights,
    p: &[Mat<f64>],
    low: &[Mat<f64>],
    high_gain: &HighGain,
) -> Result<f64, SynthesisError> {
    let at = |i: usize| {
        let model = polytope.vertex(i);
        Segment::between(&model, cost, &p[i], &low[i]).choose(&model, cost, high_gain.sample_time_s, &high_gain.options)
    };
    (0..polytope.len()).map(at).try_fold(f64::INFINITY, |least, s| Ok(least.min(s?)))
}
