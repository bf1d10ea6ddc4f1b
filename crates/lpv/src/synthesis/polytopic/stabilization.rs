//! Theorems 4.1 and 4.2: the largest margin of stability, and the design with a moderate gain after it.
//!
//! ```text
//! maximise t   subject to   T(Y, L) ⪰ tI at every vertex (2tI for pairs),   Yᵢ ⪰ 0,   tr Yᵢ ≤ n.
//! ```
//!
//! The scale of Y is free, as the inequalities are homogeneous, and tr Yᵢ ≤ n fixes it. There is a design if and only if t > 0.

use super::inequality::{DoubleSum, Unknowns};
use super::moderation::{MARGIN_LADDER, Moderated, Stage};
use super::objective::{MARGIN, Posed};
use super::regulation::{Regulation, WhereStalled};
use super::{
    BackOff, Lyapunov, Moderation, Objective, PolytopicDesign, PolytopicRequest, Separation, Solution,
    UnstabilizablePoint, distinct, finish, solver, unstabilizable,
};
use crate::math::Mat;
use crate::math::eigen::smallest_eigenvalue;
use crate::math::matrix::trace;
use crate::math::unmoved::sum_is_zero;
use crate::model::Polytope;
use crate::synthesis::{CostWeights, SynthesisError};
use lmi::{Answer, Carrier, Explanation, Expr, Outcome, Problem};

/// Margin of stability, of tr Y = n, below which the answer is taken for zero.
const LEAST_MARGIN: f64 = 1e-7;
/// A little less than 1, so that what is scaled is strict.
const LESS: f64 = 1.0 - 1e-6;

/// The inequalities of the largest margin.
pub(super) struct StabilityProblem {
    pub problem: Problem,
    unknowns: Unknowns,
    t: Expr,
}

impl StabilityProblem {
    pub fn new(polytope: &Polytope, lyapunov: &Lyapunov) -> Self {
        let n = polytope.states();
        let mut problem = Problem::new();
        let unknowns = Unknowns::new(&mut problem, polytope, lyapunov);
        let t = problem.scalar(MARGIN);
        let sum = DoubleSum::new(polytope, lyapunov, &unknowns.y);
        for (k, (name, block)) in sum.stability(&unknowns.l, &t).into_iter().enumerate() {
            match sum.leads(k) {
                true => problem.positive_definite_by(name, block, 0.0),
                false => problem.positive_definite_lazily(name, block, Some(0.0), sum.family(k)),
            }
        }
        for (i, y) in distinct(&unknowns.y, lyapunov).iter().enumerate() {
            problem.positive_definite(format!("Y{} definite", i + 1), (*y).clone());
            let trace = Expr::constant(Mat::from_fn(1, 1, |_, _| n as f64)) - y.trace();
            problem.positive_definite_by(format!("scale of Y{}", i + 1), trace, 0.0);
        }
        problem.maximize(&t);
        Self { problem, unknowns, t }
    }
}

/// The largest margin, as the solver found it.
pub(super) struct Stabilization {
    polytope: Polytope,
    lyapunov: Lyapunov,
    problem: Problem,
    unknowns: Unknowns,
    t: Expr,
    answer: Answer,
    r_inverse: Mat<f64>,
}

impl Stabilization {
    /// Solve for the largest margin.
    ///
    /// # Errors
    /// Problems without meaning.
    pub fn new(polytope: &Polytope, lyapunov: &Lyapunov) -> Result<Self, SynthesisError> {
        let StabilityProblem { mut problem, unknowns, t } = StabilityProblem::new(polytope, lyapunov);
        let mut answer = problem.solve(&solver())?;
        if matches!(answer.outcome, Outcome::Unbounded(_) | Outcome::UnboundedToTolerance(_)) {
            // where every state has an input of its own any decay can be had: as fast as the plant itself is enough
            let speed = (0..polytope.len()).map(|i| polytope.a(i).norm_l2()).fold(0.0, f64::max);
            let ceiling = 2.0 * if speed > 0.0 { speed } else { 1.0 };
            let ceiling = Expr::constant(Mat::from_fn(1, 1, |_, _| ceiling)) - &t;
            problem.positive_definite_by("ceiling of the margin", ceiling, 0.0);
            answer = problem.solve(&solver())?;
        }
        let (polytope, lyapunov, r_inverse) = (polytope.clone(), lyapunov.clone(), input_units(polytope));
        Ok(Self { polytope, lyapunov, problem, unknowns, t, answer, r_inverse })
    }

    /// The optimum's.
    pub fn answer(&self) -> &Answer {
        &self.answer
    }

    /// The design with `back_off` of the margin given back.
    ///
    /// # Errors
    /// Problems without meaning.
    pub fn design(&self, back_off: BackOff) -> Result<PolytopicDesign, SynthesisError> {
        let has_margin = self.answer.outcome.is_optimal() && self.answer.objective > LEAST_MARGIN;
        if has_margin {
            let design = self.moderated(self.answer.clone(), back_off)?;
            if design.moderation.is_some() || back_off == BackOff::Nothing {
                return Ok(design);
            }
        }
        // the scale allows t = 0 always: what there is nothing above for is said by a point, or by the strict problem's witness
        let point = self.unstabilizable_point();
        if let Some(design) = self.refuted(point.as_ref()) {
            return Ok(design);
        }
        let mut design = match self.answer.outcome.is_optimal() {
            true => self.strict()?,
            false => self.moderated(self.answer.clone(), back_off)?,
        };
        let found = match &design.solution {
            Some(Solution { y, l, .. }) if design.is_solved() && design.moderation.is_none() => Some(self.scaled(y, l)),
            _ if matches!(design.answer.outcome, Outcome::Inaccurate(_)) && !design.is_solved() => {
                if back_off == BackOff::Nothing { None } else { self.stabilizing()? }
            }
            _ => None,
        };
        if let Some(answer) = found.and_then(|values| self.with_its_margin(&values)) {
            let margin = answer.objective;
            // from there the gain may be made smaller as from an optimum
            let smaller = self.moderated(answer.clone(), back_off)?;
            design = match smaller.moderation.is_some() {
                true => smaller,
                false => {
                    let moderation = Some(Moderation { back_off: 0.0, optimum: margin, is_attained: false });
                    finish(&self.problem, Moderated { answer, moderation }, &self.unknowns, None)?
                }
            };
            let achieved = design.answer.objective;
            if let Some(moderation) = &mut design.moderation {
                match has_margin {
                    true => {
                        moderation.optimum = self.answer.objective;
                        moderation.back_off = (1.0 - achieved / self.answer.objective).max(0.0);
                    }
                    false => moderation.is_attained = false,
                }
            }
        }
        design.withdraw_infeasible(&self.polytope);
        design.unstabilizable = point;
        Ok(design)
    }

    /// The second stage after `answer`.
    fn moderated(&self, answer: Answer, back_off: BackOff) -> Result<PolytopicDesign, SynthesisError> {
        let n = self.polytope.states();
        let identity = Mat::identity(n, n);
        let stage = Stage {
            problem: &self.problem,
            objective: &Posed { value: self.t.clone(), is_maximised: true },
            least: LEAST_MARGIN,
            l: &self.unknowns.l,
            y: &self.unknowns.y,
            distinct: distinct(&self.unknowns.y, &self.lyapunov).len(),
            r_inverse: &self.r_inverse,
            q: Some(&identity),
            ladder: &MARGIN_LADDER,
            reference: &[],
        };
        let moderated = stage.moderate(answer, back_off, &solver())?;
        finish(&self.problem, moderated, &self.unknowns, None)
    }

    fn sum(&self) -> DoubleSum<'_> {
        DoubleSum::new(&self.polytope, &self.lyapunov, &self.unknowns.y)
    }

    /// A point of the polytope that no input stabilises, or seems to, where the parameter may rest there.
    fn unstabilizable_point(&self) -> Option<UnstabilizablePoint> {
        let terms = self.sum().stability_terms();
        let point = || {
            unstabilizable::vertex(&self.polytope)
                .or_else(|| unstabilizable::point(&self.polytope, &terms, &self.answer.multipliers))
        };
        rests(&self.lyapunov).then(point).flatten()
    }

    /// That there is no design, where it is proved: by `point`, or by vertices that exclude each other.
    fn refuted(&self, point: Option<&UnstabilizablePoint>) -> Option<PolytopicDesign> {
        let refuted = |shares: &[f64]| {
            let explanation = Explanation { distance: 0.0, carriers: carriers(shares) };
            let refuted = PolytopicDesign::without_solution(self.answer.clone());
            PolytopicDesign { explanation: Some(explanation), ..refuted }
        };
        if let Some(point) = point.filter(|point| point.is_proved) {
            return Some(PolytopicDesign { unstabilizable: Some(point.clone()), ..refuted(&point.weights) });
        }
        let separation = (self.lyapunov == Lyapunov::Common).then(|| Separation::of(&self.polytope)).flatten()?;
        Some(PolytopicDesign { separation: Some(separation.clone()), ..refuted(&separation.shares) })
    }

    /// The inequalities with Yᵢ ⪰ I for the scale and no objective: the problem that has a witness where they contradict each other.
    fn strict(&self) -> Result<PolytopicDesign, SynthesisError> {
        let n = self.polytope.states();
        let mut strict = Problem::new();
        let unknowns = Unknowns::new(&mut strict, &self.polytope, &self.lyapunov);
        let sum = DoubleSum::new(&self.polytope, &self.lyapunov, &unknowns.y);
        for (k, (name, block)) in sum.stability(&unknowns.l, &Expr::zeros(1, 1)).into_iter().enumerate() {
            match sum.leads(k) {
                true => strict.positive_definite(name, block),
                false => strict.positive_definite_lazily(name, block, None, sum.family(k)),
            }
        }
        for (i, y) in distinct(&unknowns.y, &self.lyapunov).iter().enumerate() {
            strict.positive_definite_by(format!("Y{} ⪰ I", i + 1), *y - Expr::identity(n), 0.0);
        }
        let answer = strict.solve(&solver())?;
        finish(&strict, answer.into(), &unknowns, None)
    }

    /// Y and L of a regulator with Q = I and R = I, which stabilises too, for where the largest margin is too small for the solver. `None`
    /// where there is none.
    fn stabilizing(&self) -> Result<Option<Vec<Mat<f64>>>, SynthesisError> {
        let (n, m) = (self.polytope.states(), self.polytope.inputs());
        let request = PolytopicRequest {
            weights: None,
            lyapunov: self.lyapunov.clone(),
            saturation: None,
            high_gain: None,
            objective: Objective::Trace,
            back_off: BackOff::Knee,
        };
        let cost = CostWeights { q: Mat::identity(n, n), r: Mat::identity(m, m) };
        let regulation = Regulation::new(&self.polytope, &request, &cost, WhereStalled::Stop)?;
        let design = regulation.design(BackOff::Knee)?;
        let solution = design.solution.as_ref().filter(|_| design.is_solved());
        Ok(solution.map(|Solution { y, l, .. }| self.scaled(y, l)))
    }

    /// Y and L of every vertex scaled to tr Yᵢ ≤ n, one matrix for each unknown but the margin.
    fn scaled(&self, y: &[Mat<f64>], l: &[Mat<f64>]) -> Vec<Mat<f64>> {
        let n = self.polytope.states();
        let scale = LESS * n as f64 / y.iter().map(trace).fold(0.0, f64::max);
        let distinct = if self.lyapunov == Lyapunov::Common { 1 } else { y.len() };
        y[..distinct].iter().chain(l).map(|matrix| scale * matrix).collect()
    }

    /// The answer at `values`, with the margin that they have; `None` where nothing is proved there.
    fn with_its_margin(&self, values: &[Mat<f64>]) -> Option<Answer> {
        let with_margin = |t: f64| [values, &[Mat::from_fn(1, 1, |_, _| t)]].concat();
        let at = self.problem.moved(&self.answer, with_margin(0.0))?;
        let sum = self.sum();
        let blocks = sum.stability(&self.unknowns.l, &Expr::zeros(1, 1));
        let margins = blocks.iter().zip(sum.stability_terms()).map(|((_, block), (i, j))| {
            // of a pair of vertices the margin counts twice
            smallest_eigenvalue(&at.value(block)) / if i == j { 1.0 } else { 2.0 }
        });
        let margin = LESS * margins.fold(f64::INFINITY, f64::min);
        self.problem.moved(&at, with_margin(margin))
    }
}

/// R⁻¹ of an effort that knows no units of the inputs: uᵀRu = Σⱼ ‖bⱼ‖²uⱼ², with the largest column bⱼ of all vertices; 1 for an input that moves nothing.
pub(super) fn input_units(polytope: &Polytope) -> Mat<f64> {
    let largest = |j: usize| {
        let columns = (0..polytope.len()).map(|i| polytope.b(i).col(j).norm_l2());
        columns.fold(0.0, f64::max)
    };
    let entry = |j: usize| Some(largest(j).powi(-2)).filter(|inverse| inverse.is_normal()).unwrap_or(1.0);
    Mat::from_fn(polytope.inputs(), polytope.inputs(), |i, j| if i == j { entry(j) } else { 0.0 })
}

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
