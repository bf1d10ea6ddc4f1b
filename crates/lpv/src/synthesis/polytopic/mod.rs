//! Synthesis over a polytope of vertices, for any A(ρ) = Σ ρᵢAᵢ, B(ρ) = Σ ρᵢBᵢ.
//!
//! | Lyapunov function | stabilise | regulate | under saturation |
//! |---|---|---|---|
//! | one vertex (LTI) | Lemma 4.1 | Theorem 2.1 | Theorems 5.1, 5.2 |
//! | common, xᵀY⁻¹x | Theorem 4.1 | Theorem 4.3, Corollary 4.1 | the same with (5.19), (5.20) at every vertex |
//! | parameter-dependent, xᵀ(Σρᵢ Yᵢ)⁻¹x | Theorem 4.2 | Theorem 4.4 | the same |
//!
//! What is found holds for every motion ρ(t) in the polytope; with a parameter-dependent Lyapunov function for those with
//! ρ̇ in the hull of the rate vertices. Under saturation it holds from every state with V ≤ γ. It is about the LPV model:
//! for a nonlinear plant it is what the plant's trajectories are embedded in. Theorems 4.5, 5.3 and 5.4 are this module at
//! single points ρ ([`frozen`]), and guarantee nothing once ρ moves.
//!
//! What each theorem states, for which shapes and under which assumptions, and what it does not guarantee: [`Theorem`].
//!
//! The controller is u = −K(ρ)x with K(ρ) = (Σ ρᵢLᵢ)(Σ ρᵢYᵢ)⁻¹, of which Kᵢ = LᵢYᵢ⁻¹ are the values at the vertices; for
//! a common Y it is Σ ρᵢKᵢ.

mod inequality;
mod moderation;
mod objective;
mod rates;
mod separation;
mod theorem;
mod unstabilizable;

pub use moderation::{BackOff, Moderation};
pub use objective::Objective;
pub use rates::rate_box_vertices;
pub use separation::Separation;
pub use theorem::Theorem;
pub use unstabilizable::UnstabilizablePoint;

use super::high_gain::Segment;
use super::{CostWeights, HighGainOptions, SynthesisError};
use crate::math::Mat;
use crate::math::eigen::smallest_eigenvalue;
use crate::math::matrix::{inverse_spd, is_diagonal, symmetric_part, trace};
use crate::math::riccati::{self, Regulator, RiccatiError};
use crate::math::stabilizability::{Mode, Stabilizability, stabilizability};
use crate::math::unmoved::sum_is_zero;
use crate::model::{FrozenModel, Polytope};
use inequality::{DoubleSum, Unknowns, Weights};
use lmi::{Answer, BlockReport, Carrier, Explanation, Expr, InaccurateReason, Options, Outcome, Problem};
use moderation::{COST_LADDER, MARGIN_LADDER, Moderated, Stage};
use objective::Posed;

/// The Lyapunov function xᵀY(ρ)⁻¹x.
#[derive(Clone, Debug, PartialEq)]
pub enum Lyapunov {
    /// Y(ρ) = Y.
    Common,
    /// Y(ρ) = Σ ρᵢYᵢ.
    ParameterDependent {
        /// νₖ with Σᵢ νₖᵢ = 0: ρ̇ is in their hull (4.19).
        rate_vertices: Vec<Vec<f64>>,
    },
}

/// |uᵢ| ≤ σᵢ, and the level of the set {x: V ≤ γ} on which the design is to hold.
#[derive(Clone, Debug, PartialEq)]
pub struct InputBounds {
    /// σᵢ > 0, one for each input; infinite where one is not limited (of a certificate; synthesis asks for limits).
    pub sigma: Vec<f64>,
    /// γ > 0
    pub gamma: f64,
}

/// What is asked for.
#[derive(Clone, Debug)]
pub struct PolytopicRequest {
    /// Q ⪰ 0 and R ≻ 0 of the cost; `None` asks for stability alone (Theorems 4.1, 4.2).
    pub weights: Option<CostWeights>,
    /// Which Lyapunov function.
    pub lyapunov: Lyapunov,
    /// Input saturation (chapter 5).
    pub saturation: Option<InputBounds>,
    /// The gain may saturate on the set (Theorems 5.2, 5.4); needs `saturation` and `weights`.
    pub high_gain: Option<HighGain>,
    /// What is optimised. Stabilisation has its own: the largest margin.
    pub objective: Objective,
    /// How much of the optimum is given back for a gain that can be applied.
    pub back_off: BackOff,
}

/// How the gain on K_s = F + s(R⁻¹BᵀP − F) is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HighGain {
    /// How much cost may be given away, and how robust the sampled loop has to be.
    pub options: HighGainOptions,
    /// Time between two samples of the controller; `None`: it is continuous.
    pub sample_time_s: Option<f64>,
}

/// What was found, whatever the outcome.
#[derive(Debug)]
pub struct PolytopicDesign {
    /// The solver's answer: outcome, objective, blocks with rigorous margins, witness. Where a part of the optimum was given back objective
    /// and blocks are those of the design that is returned, and the outcome is that of the optimum.
    pub answer: Answer,
    /// What was given back of the optimum; `None` where nothing was asked for.
    pub moderation: Option<Moderation>,
    /// Why there is no solution, where there is none.
    pub explanation: Option<Explanation>,
    /// A point of the polytope that no input can stabilise, or that only seems so: where it is proved there is no solution, whatever the solver says.
    pub unstabilizable: Option<UnstabilizablePoint>,
    /// Proof that the vertices have no common Lyapunov function.
    pub separation: Option<Separation>,
    /// A motion that costs nothing and does not decay, of one vertex, which is proved.
    pub undetectable: Option<Mode>,
    /// Where the answer's blocks and objective are those of the Riccati solution, made strict by this ε
    /// ([`crate::math::riccati::strict`]): they are proved at it, and it is the solution.
    pub riccati: Option<f64>,
    /// Y, L and gains where the problem was solved, and at the best point so far where the solver stopped short.
    pub solution: Option<Solution>,
}

impl PolytopicDesign {
    /// Whether Y and L satisfy every inequality, with a proved margin: at the optimum, or with a part of it given back.
    pub fn is_solved(&self) -> bool {
        let is_proved = self.moderation.is_some() || self.riccati.is_some();
        self.solution.is_some() && (is_proved || self.answer.outcome.is_feasible())
    }

    /// The optimum of what was asked for, whatever was given back of it.
    pub fn optimum(&self) -> f64 {
        self.moderation.as_ref().map_or(self.answer.objective, |moderation| moderation.optimum)
    }

    /// Whether it is refuted, by the solver's witness or by a point that is proved not to be stabilisable.
    pub fn is_infeasible(&self) -> bool {
        self.separation.is_some()
            || self.unstabilizable.as_ref().is_some_and(|point| point.is_proved)
            || matches!(self.answer.outcome, Outcome::Infeasible(_))
    }

    fn without_solution(answer: Answer) -> Self {
        Self {
            answer,
            moderation: None,
            explanation: None,
            unstabilizable: None,
            separation: None,
            undetectable: None,
            riccati: None,
            solution: None,
        }
    }

    /// A witness of the solver excludes solutions up to a size. Of one vertex that is stabilisable it is known that there are larger ones.
    fn withdraw_infeasible(&mut self, polytope: &Polytope) {
        if matches!(self.answer.outcome, Outcome::InfeasibleWithin(_))
            && polytope.len() == 1
            && stabilizability(polytope.a(0), polytope.b(0)) == Stabilizability::Stabilizable
        {
            self.answer.outcome = Outcome::Inaccurate(InaccurateReason::NotVerified);
            self.explanation = None;
        }
    }
}

/// The matrices of a design, one for each vertex.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Yᵢ ≻ 0, n × n; the same N times for a common Lyapunov function.
    pub y: Vec<Mat<f64>>,
    /// Lᵢ, m × n.
    pub l: Vec<Mat<f64>>,
    /// Pᵢ = Yᵢ⁻¹.
    pub p: Vec<Mat<f64>>,
    /// Kᵢ = LᵢYᵢ⁻¹.
    pub gain: Vec<Mat<f64>>,
    /// Fᵢ = MᵢYᵢ⁻¹, unsaturated on the set, of the high-gain designs.
    pub auxiliary_gain: Option<Vec<Mat<f64>>>,
    /// s on K_s, of the high-gain designs.
    pub s: Option<f64>,
    /// Smallest eigenvalue of the performance inequality of every mixture of the rows of Kᵢ and Fᵢ at every vertex, with its
    /// name, in floating point: (5.12), (5.20) for the gain that is returned. Empty unless it is a high gain.
    pub mixtures: Vec<(String, f64)>,
}

impl Solution {
    /// P(ρ) = (Σ ρᵢYᵢ)⁻¹ at convex weights; `None` where it is not definite.
    pub fn lyapunov_matrix(&self, rho: &[f64]) -> Option<Mat<f64>> {
        let n = self.y[0].nrows();
        inverse_spd(&Mat::from_fn(n, n, |i, j| rho.iter().zip(&self.y).map(|(weight, y)| weight * y[(i, j)]).sum()))
    }
}

/// The theorem of `request` for `polytope`.
///
/// # Errors
/// Problems without meaning; no high gain that is stable at the sample time, with the number of the vertex (from 0) for the
/// parameter. Infeasible, unbounded and inaccurate are outcomes in the answer.
///
/// # Panics
/// If sizes of weights, bounds, rates or objective do not fit the polytope; for a high gain of more than 10 inputs with a general R, or of
/// more than 64.
pub fn synthesize(polytope: &Polytope, request: &PolytopicRequest) -> Result<PolytopicDesign, SynthesisError> {
    match &request.weights {
        Some(weights) => regulate(polytope, request, weights, WhereStalled::Refute),
        None => stabilize(polytope, request),
    }
}

/// Theorems 4.5, 5.1-5.4 at single models: each is designed as if the parameter stood still there.
///
/// # Errors
/// As [`synthesize`], with the number of the model for the parameter.
pub fn frozen(models: &[FrozenModel], request: &PolytopicRequest) -> Result<Vec<PolytopicDesign>, SynthesisError> {
    let request = PolytopicRequest { lyapunov: Lyapunov::Common, ..request.clone() };
    let each = |(k, model)| {
        synthesize(&Polytope::hull(std::slice::from_ref(model)), &request).map_err(|error| error.moved_to(k as f64))
    };
    models.iter().enumerate().map(each).collect()
}

/// Settings of the solver. The optimum of tr Y is flat: a relative gap g moves P by about √g, and 10⁻¹² gives the bound
/// x(0)ᵀPx(0) six digits where the default, 10⁻⁹, gives four or five. Where rounding ends the iteration sooner, what was reached counts.
fn solver() -> Options {
    Options { gap_tolerance: 1e-12, ..Options::default() }
}

/// Theorems 4.1 and 4.2: the largest t with every inequality ⪰ tI, where tr Yᵢ ≤ n fixes the scale.
fn stabilize(polytope: &Polytope, request: &PolytopicRequest) -> Result<PolytopicDesign, SynthesisError> {
    let n = polytope.states();
    let mut problem = Problem::new();
    let unknowns = Unknowns::new(&mut problem, polytope, &request.lyapunov);
    let t = problem.scalar("margin");
    let sum = DoubleSum::new(polytope, &request.lyapunov, &unknowns.y);
    for (k, (name, block)) in sum.stability(&unknowns.l, &t).into_iter().enumerate() {
        match sum.leads(k) {
            true => problem.positive_definite_by(name, block, 0.0),
            false => problem.positive_definite_lazily(name, block, Some(0.0), sum.family(k)),
        }
    }
    for (i, y) in distinct(&unknowns.y, &request.lyapunov).iter().enumerate() {
        problem.positive_definite(format!("Y{} definite", i + 1), (*y).clone());
        let trace = Expr::constant(Mat::from_fn(1, 1, |_, _| n as f64)) - y.trace();
        problem.positive_definite_by(format!("scale of Y{}", i + 1), trace, 0.0);
    }
    problem.maximize(&t);
    let terms = sum.stability_terms();
    let mut answer = problem.solve(&solver())?;
    if matches!(answer.outcome, Outcome::Unbounded(_) | Outcome::UnboundedToTolerance(_)) {
        // where every state has an input of its own any decay can be had: as fast as the plant itself is enough
        let speed = (0..polytope.len()).map(|i| polytope.a(i).norm_l2()).fold(0.0, f64::max);
        let ceiling = 2.0 * if speed > 0.0 { speed } else { 1.0 };
        let ceiling = Expr::constant(Mat::from_fn(1, 1, |_, _| ceiling)) - &t;
        problem.positive_definite_by("ceiling of the margin", ceiling, 0.0);
        answer = problem.solve(&solver())?;
    }
    let solved = answer.outcome.is_optimal();
    let moderated = |answer: Answer| -> Result<PolytopicDesign, SynthesisError> {
        let r_inverse = input_units(polytope);
        let identity = Mat::identity(n, n);
        let stage = Stage {
            problem: &problem,
            objective: &Posed { value: t.clone(), is_maximised: true },
            least: LEAST_MARGIN,
            l: &unknowns.l,
            y: &unknowns.y,
            r_inverse: &r_inverse,
            q: Some(&identity),
            ladder: &MARGIN_LADDER,
            reference: &[],
        };
        let moderated = stage.moderate(answer, request.back_off, &solver())?;
        finish(&problem, moderated, &unknowns, None)
    };
    if solved && answer.objective > LEAST_MARGIN {
        let design = moderated(answer.clone())?;
        if design.moderation.is_some() || request.back_off == BackOff::Nothing {
            return Ok(design);
        }
    }
    // the scale allows t = 0 always: what there is nothing above for is said by a point, or by the strict problem's witness
    let point = (rests(&request.lyapunov).then(|| {
        unstabilizable::vertex(polytope).or_else(|| unstabilizable::point(polytope, &terms, &answer.multipliers))
    }))
    .flatten();
    if let Some(point) = point.as_ref().filter(|point| point.is_proved) {
        let explanation = Explanation { distance: 0.0, carriers: carriers(&point.weights) };
        let refuted = PolytopicDesign::without_solution(answer);
        return Ok(PolytopicDesign { explanation: Some(explanation), unstabilizable: Some(point.clone()), ..refuted });
    }
    if request.lyapunov == Lyapunov::Common
        && let Some(separation) = Separation::of(polytope)
    {
        let explanation = Explanation { distance: 0.0, carriers: carriers(&separation.shares) };
        let refuted = PolytopicDesign::without_solution(answer);
        return Ok(PolytopicDesign { explanation: Some(explanation), separation: Some(separation), ..refuted });
    }
    let mut design = match solved {
        true => stabilize_strictly(polytope, request)?,
        false => moderated(answer)?,
    };
    let is_stalled = !design.is_solved() && matches!(design.answer.outcome, Outcome::Inaccurate(_));
    if is_stalled
        && request.back_off != BackOff::Nothing
        && let Some(values) = stabilizing(polytope, request)?
    {
        let with_margin = |t: f64| [values.as_slice(), &[Mat::from_fn(1, 1, |_, _| t)]].concat();
        let blocks = sum.stability(&unknowns.l, &Expr::zeros(1, 1));
        // of a pair of vertices the margin counts twice
        let weighted = |(block, (i, j)): (&(String, Expr), &(usize, usize)), at: &Answer| {
            smallest_eigenvalue(&at.value(&block.1)) / if i == j { 1.0 } else { 2.0 }
        };
        let moved = problem.moved(&design.answer, with_margin(0.0)).and_then(|at| {
            let margins = blocks.iter().zip(&terms).map(|pair| weighted(pair, &at));
            problem.moved(&at, with_margin(LESS * margins.fold(f64::INFINITY, f64::min)))
        });
        if let Some(answer) = moved {
            // from there the gain may be made smaller as from an optimum
            let smaller = moderated(answer.clone())?;
            design = match smaller.moderation.is_some() {
                true => smaller,
                false => {
                    let moderation = Some(Moderation { back_off: 0.0, optimum: answer.objective, is_attained: false });
                    finish(&problem, Moderated { answer, moderation }, &unknowns, None)?
                }
            };
        }
    }
    design.withdraw_infeasible(polytope);
    design.unstabilizable = point;
    Ok(design)
}

/// R⁻¹ of an effort that knows no units of the inputs: uᵀRu = Σⱼ ‖bⱼ‖²uⱼ², with the largest column bⱼ of all vertices; 1 for an input that moves nothing.
fn input_units(polytope: &Polytope) -> Mat<f64> {
    let largest = |j: usize| {
        let columns = (0..polytope.len()).map(|i| polytope.b(i).col(j).norm_l2());
        columns.fold(0.0, f64::max)
    };
    let entry = |j: usize| Some(largest(j).powi(-2)).filter(|inverse| inverse.is_normal()).unwrap_or(1.0);
    Mat::from_fn(polytope.inputs(), polytope.inputs(), |i, j| if i == j { entry(j) } else { 0.0 })
}

/// Y and L of a regulator with Q = I and R = I, which stabilises too, for where the largest margin is too small for the solver: scaled to
/// tr Y ≤ n, one matrix for each unknown of the stabilisation but the margin. `None` where there is none.
fn stabilizing(polytope: &Polytope, request: &PolytopicRequest) -> Result<Option<Vec<Mat<f64>>>, SynthesisError> {
    let (n, m) = (polytope.states(), polytope.inputs());
    let cost = CostWeights { q: Mat::identity(n, n), r: Mat::identity(m, m) };
    let request =
        PolytopicRequest { saturation: None, high_gain: None, objective: Objective::Trace, ..request.clone() };
    let design = regulate(polytope, &request, &cost, WhereStalled::Stop)?;
    let Some(Solution { y, l, .. }) = design.solution.as_ref().filter(|_| design.is_solved()) else { return Ok(None) };
    let scale = LESS * n as f64 / y.iter().map(trace).fold(0.0, f64::max);
    let distinct = if request.lyapunov == Lyapunov::Common { 1 } else { y.len() };
    Ok(Some(y[..distinct].iter().chain(l).map(|matrix| scale * matrix).collect()))
}

/// A little less than 1, so that what is scaled is strict.
const LESS: f64 = 1.0 - 1e-6;

/// Whether the parameter may rest: zero is in the hull of the rate vertices, as far as their mean, taken exactly, tells.
fn rests(lyapunov: &Lyapunov) -> bool {
    let Lyapunov::ParameterDependent { rate_vertices } = lyapunov else { return true };
    let rates = |i: usize| rate_vertices.iter().map(|nu| nu[i]).collect::<Vec<f64>>();
    rate_vertices.iter().any(|nu| nu.iter().all(|&rate| rate == 0.0))
        || rate_vertices.first().is_some_and(|first| (0..first.len()).all(|i| sum_is_zero(&rates(i))))
}

/// The stability inequalities of the vertices that refute together, with their shares, largest first.
fn carriers(shares: &[f64]) -> Vec<Carrier> {
    let count = shares.len();
    let mut carriers: Vec<Carrier> = (shares.iter().enumerate())
        .filter(|&(_, &share)| share > 1e-3)
        .map(|(i, &share)| Carrier {
            name: if count == 1 { "stability".into() } else { format!("stability at vertex {}", i + 1) },
            share,
            alone: None,
        })
        .collect();
    carriers.sort_by(|a, b| b.share.total_cmp(&a.share));
    carriers
}

/// The inequalities of Theorems 4.1 and 4.2 with Yᵢ ⪰ I for the scale, which they are homogeneous in, and no objective: the problem that
/// has a witness where they contradict each other.
fn stabilize_strictly(polytope: &Polytope, request: &PolytopicRequest) -> Result<PolytopicDesign, SynthesisError> {
    let n = polytope.states();
    let mut strict = Problem::new();
    let unknowns = Unknowns::new(&mut strict, polytope, &request.lyapunov);
    let sum = DoubleSum::new(polytope, &request.lyapunov, &unknowns.y);
    for (k, (name, block)) in sum.stability(&unknowns.l, &Expr::zeros(1, 1)).into_iter().enumerate() {
        match sum.leads(k) {
            true => strict.positive_definite(name, block),
            false => strict.positive_definite_lazily(name, block, None, sum.family(k)),
        }
    }
    for (i, y) in distinct(&unknowns.y, &request.lyapunov).iter().enumerate() {
        strict.positive_definite_by(format!("Y{} ⪰ I", i + 1), *y - Expr::identity(n), 0.0);
    }
    let answer = strict.solve(&solver())?;
    finish(&strict, answer.into(), &unknowns, None)
}

/// Margin of stability, of tr Y = n, below which the answer is taken for zero.
const LEAST_MARGIN: f64 = 1e-7;

/// What is done where the solver finds no regulator.
#[derive(Clone, Copy, PartialEq)]
enum WhereStalled {
    /// Ask why: whether anything stabilises.
    Refute,
    /// Nothing: that is who asks.
    Stop,
}

/// Theorems 2.1, 4.3, 4.4, 5.1-5.4.
///
/// Whatever the weights and bounds, there is a solution if and only if the system can be stabilised by the same Lyapunov function:
/// for T(Y, L) ≻ 0, (εY, εL) satisfies ε T − ε²(YQY + LᵀRL) ≻ 0 and ε ℓᵢY⁻¹ℓᵢᵀ < σᵢ²/γ for small ε > 0, and the first block of each
/// inequality is T. Where it cannot, Y → 0 in some direction comes as near to a solution as one likes; the solver then stops short
/// without a witness, and the stabilisation's is taken.
fn regulate(
    polytope: &Polytope,
    request: &PolytopicRequest,
    cost: &CostWeights,
    where_stalled: WhereStalled,
) -> Result<PolytopicDesign, SynthesisError> {
    let weights = Weights::new(cost).expect("weights are checked to be semidefinite and definite");
    let mut problem = Problem::new();
    let unknowns = Unknowns::new(&mut problem, polytope, &request.lyapunov);
    let sum = DoubleSum::new(polytope, &request.lyapunov, &unknowns.y);
    // with diagonal R the low gain L = M is optimal, and every K_s satisfies the 2^m inequalities (`high_gain`)
    let mixtures = request.high_gain.filter(|_| !is_diagonal(&cost.r));
    let auxiliary: Option<Vec<Expr>> = mixtures.map(|_| {
        let (m, n) = (polytope.inputs(), polytope.states());
        (0..polytope.len()).map(|i| problem.rectangular(format!("M{}", i + 1), m, n)).collect()
    });
    let performance = |l: &[Expr]| -> Vec<(String, Expr)> {
        let Some(low) = &auxiliary else { return sum.performance("performance", l, &weights) };
        let inputs = polytope.inputs();
        let of_mixture = |vertex: usize| {
            let mixed: Vec<Expr> = l.iter().zip(low).map(|(l, m)| super::high_gain::mixture(vertex, l, m)).collect();
            sum.performance(&format!("performance of mixture {vertex:0inputs$b}"), &mixed, &weights)
        };
        (0..1usize << inputs).flat_map(of_mixture).collect()
    };
    for (k, (name, block)) in performance(&unknowns.l).into_iter().enumerate() {
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
    let answer = problem.solve(&solver())?;
    let mut seems_unstabilizable = None;
    let contradicts = matches!(answer.outcome, Outcome::Infeasible(_) | Outcome::InfeasibleWithin(_));
    if where_stalled == WhereStalled::Refute && (contradicts || matches!(answer.outcome, Outcome::Inaccurate(_))) {
        // whether there is a solution is all that is asked
        let stabilization = stabilize(polytope, &PolytopicRequest { back_off: BackOff::Nothing, ..request.clone() })?;
        if stabilization.is_infeasible() {
            return Ok(stabilization);
        }
        seems_unstabilizable = stabilization.unstabilizable;
    }
    // the least cost from every state at once, so that there is an optimum, which is attained
    let is_regulator = polytope.len() == 1 && request.saturation.is_none();
    let is_riccati = is_regulator && matches!(request.objective, Objective::Trace);
    let mut undetectable = None;
    if is_riccati {
        match riccati::solve(polytope.a(0), polytope.b(0), &cost.q, &cost.r) {
            Ok(regulator) => {
                if let Some(design) = by_riccati(polytope, cost, &problem, &answer, &regulator)? {
                    return Ok(design);
                }
            }
            // that the objective has no bound follows for a pair that is stabilisable
            Err(RiccatiError::Unweighted(mode))
                if stabilizability(polytope.a(0), polytope.b(0)) == Stabilizability::Stabilizable =>
            {
                undetectable = Some(mode);
            }
            Err(_) => {}
        }
    }
    let is_attained = is_regulator && answer.outcome.is_feasible();
    let back_off = if is_attained && request.back_off == BackOff::Knee { BackOff::Nothing } else { request.back_off };
    let lqr =
        |i: usize| riccati::solve(polytope.a(i), polytope.b(i), &cost.q, &cost.r).ok().map(|regulator| regulator.k);
    // the knee alone asks for it
    let reference: Vec<Mat<f64>> = match back_off {
        BackOff::Knee => (0..polytope.len()).map(lqr).collect::<Option<_>>().unwrap_or_default(),
        _ => Vec::new(),
    };
    let low_l: Vec<Expr> = auxiliary.clone().unwrap_or_else(|| unknowns.l.clone());
    let stage = Stage {
        problem: &problem,
        objective: &objective,
        least: f64::NEG_INFINITY,
        l: &low_l,
        y: &unknowns.y,
        r_inverse: &weights.r_inverse,
        q: inverse_spd(&cost.q).map(|_| &cost.q),
        ladder: &COST_LADDER,
        reference: &reference,
    };
    let moderated = stage.moderate(answer, back_off, &solver())?;
    let mut design = finish(&problem, moderated, &unknowns, auxiliary.as_deref())?;
    design.withdraw_infeasible(polytope);
    (design.undetectable, design.unstabilizable) = (undetectable, seems_unstabilizable);
    let (Some(solution), Some(high_gain)) = (&mut design.solution, request.high_gain) else { return Ok(design) };
    let low = solution.auxiliary_gain.take().unwrap_or_else(|| solution.gain.clone());
    let mut s = choose(polytope, cost, &solution.p, &low, &high_gain)?;
    // with a general R the inequalities decide; s = 0 satisfies them, so halving ends
    let on_segment = |s: f64| -> Vec<Expr> {
        let end = |i: usize| s * Expr::constant(&weights.r_inverse * polytope.b(i).transpose());
        low_l.iter().enumerate().map(|(i, low)| (1.0 - s) * low + end(i)).collect()
    };
    if mixtures.is_some() {
        let holds = |s: f64| {
            let blocks = performance(&on_segment(s));
            blocks.iter().all(|(_, block)| inverse_spd(&design.answer.value(block)).is_some())
        };
        let mut halvings = 0;
        while s > 0.0 && !holds(s) {
            s = if halvings < 60 { 0.5 * s } else { 0.0 };
            halvings += 1;
        }
    }
    solution.l = on_segment(s).iter().map(|l| design.answer.value(l)).collect();
    solution.gain = solution.l.iter().zip(&solution.p).map(|(l, p)| l * p).collect();
    solution.auxiliary_gain = Some(low);
    solution.s = Some(s);
    solution.mixtures = listed_mixtures(polytope.inputs())
        .into_iter()
        .flat_map(|mixture| {
            let l: Vec<Expr> =
                on_segment(s).iter().zip(&low_l).map(|(l, low)| super::high_gain::mixture(mixture, l, low)).collect();
            let name = format!("mixture {mixture:0inputs$b}", inputs = polytope.inputs());
            sum.performance_at_vertices(&name, &l, &weights)
        })
        .map(|(name, block)| (name, smallest_eigenvalue(&design.answer.value(&block))))
        .collect();
    Ok(design)
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

/// The Yᵢ without repetition.
fn distinct<'a>(y: &'a [Expr], lyapunov: &Lyapunov) -> Vec<&'a Expr> {
    match lyapunov {
        Lyapunov::Common => vec![&y[0]],
        Lyapunov::ParameterDependent { .. } => y.iter().collect(),
    }
}

/// Read the matrices from the answer; explain it where it is infeasible.
fn finish(
    problem: &Problem,
    moderated: Moderated,
    unknowns: &Unknowns,
    auxiliary: Option<&[Expr]>,
) -> Result<PolytopicDesign, SynthesisError> {
    let Moderated { answer, moderation } = moderated;
    let explanation = problem.explain(&answer, &solver())?;
    let solution = match answer.outcome {
        Outcome::Solved | Outcome::SolvedToTolerance(_) | Outcome::Inaccurate(_) => {
            let values =
                |of: &[Expr]| -> Vec<Mat<f64>> { of.iter().map(|expression| answer.value(expression)).collect() };
            let y: Vec<Mat<f64>> = values(&unknowns.y).iter().map(symmetric_part).collect();
            let l = values(&unknowns.l);
            let p: Option<Vec<Mat<f64>>> = y.iter().map(inverse_spd).collect();
            p.map(|p| Solution {
                gain: l.iter().zip(&p).map(|(l, p)| l * p).collect(),
                auxiliary_gain: auxiliary.map(|m| values(m).iter().zip(&p).map(|(m, p)| m * p).collect()),
                s: None,
                mixtures: Vec::new(),
                y,
                l,
                p,
            })
        }
        Outcome::Infeasible(_)
        | Outcome::InfeasibleWithin(_)
        | Outcome::Unbounded(_)
        | Outcome::UnboundedToTolerance(_) => None,
    };
    Ok(PolytopicDesign { moderation, explanation, solution, ..PolytopicDesign::without_solution(answer) })
}
