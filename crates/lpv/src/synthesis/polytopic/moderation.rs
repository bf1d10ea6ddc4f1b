//! A gain that can be applied, for a stated part of the optimum.
//!
//! The supremum of tr Y, or of the margin of stability, is usually not attained over a polytope: L is free, and a maximising
//! sequence drives Y to singular and K = LY⁻¹ to infinity. So the optimum f* is found first, and then, with a share β of it given
//! back, the design whose input is smallest on its own ellipsoid:
//!
//! ```text
//! minimise τ   subject to   the inequalities of the design,   f ≥ f* − β|f*|   (t ≤ t* + β|t*| of a cost bound t),
//!
//! ⎡ τ R⁻¹  Lᵢ ⎤ ⪰ 0 at every vertex:   uᵀRu ≤ τ on {x: V ≤ 1} for u = −K(ρ)x.
//! ⎣ Lᵢᵀ    Yᵢ ⎦
//! ```
//!
//! uᵀRu ≤ τV and V ≤ ν xᵀQx, so that τν bounds the gain itself, uᵀRu/xᵀQx; where that is large, the least ν is taken with a little more than
//! the least τ: P ⪯ νQ. Both sides are quadratic in x, so that the measure has no unit of its own: it is the same for every scale of states, inputs and
//! time. Of stabilisation, which has no cost, Q is the I that its margin is measured by, and R weighs every input by the square of its column of B, so that the unit of an
//! input does not matter. Of a high gain it is the low gain F that is kept small; K is then the chosen share of the way to R⁻¹BᵀP.
//!
//! At its optimum the second problem rests on its boundary as the first does. What is returned is (Y, L)/(1 + ε): for
//! W(P) = P(A − BK) + (A − BK)ᵀP + Q + KᵀRK ⪯ 0, W((1 + ε)P) = (1 + ε)W(P) − ε(Q + KᵀRK), and |kx| ≤ σ on V ≤ γ becomes strict, which
//! pays for the rounding of K and P: by that of P alone kP⁻¹kᵀ moves by a share of cond(P) units in the last place. ε is a part of β.

use super::objective::{COST_BOUND, MARGIN, Posed};
use super::trade_off::largest_effort;
use crate::math::Mat;
use crate::math::eigen::symmetric_eigenvalues;
use crate::math::matrix::{inverse_spd, semidefinite_factor};
use crate::synthesis::units::STRICT;
use lmi::{Answer, Error, Expr, Options, Outcome, Problem};

/// How much of the optimum is given back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum BackOff {
    /// Nothing: the bare optimum, or what the solver reached on the way to one that is not attained.
    #[default]
    Nothing,
    /// The least share of a short ladder after which more of it hardly makes the gain smaller, or the gain is no larger than what the vertices
    /// need one by one; nothing where the optimum's gain is moderate.
    Knee,
    /// β, 0 < β < 1.
    Share(f64),
}

/// What was given back, and for what.
#[derive(Clone, Debug, PartialEq)]
pub struct Moderation {
    /// β: the objective of the design is within this share of the optimum.
    pub back_off: f64,
    /// f*, as the solver found it; of an optimum that is not attained what it came to.
    pub optimum: f64,
    /// Whether f* is the optimum to the solver's tolerance.
    pub is_attained: bool,
}

impl Moderation {
    /// Of an objective that is `factor` times as large.
    pub(super) fn times(self, factor: f64) -> Self {
        Self { optimum: factor * self.optimum, ..self }
    }
}

/// Shares of a cost that are tried, ascending.
pub(super) const COST_LADDER: [f64; 4] = [1e-3, 1e-2, 5e-2, 1e-1];
/// Shares of a margin of stability, which costs nobody anything.
pub(super) const MARGIN_LADDER: [f64; 3] = [1e-2, 1e-1, 5e-1];
/// The knee: the effort is at most this many times that of the largest share, or of the reference.
const KNEE: f64 = 2.0;
/// A design that takes this many times more effort than is enough, as its first rounds see it, is not worth solving for.
const FAR_MORE: f64 = 1.5;
/// √(uᵀRu/xᵀQx) from which a gain counts as large: then, with some room for the effort, V is kept small relative to the running cost.
const LARGE_GAIN: f64 = 1e3;
/// How much more than the least τ may then be taken.
const EFFORT_ROOM: f64 = 4.0;
/// ε of the strictness that is paid for rounding, as a share of what is given back, and at least.
const STRICTNESS: (f64, f64) = (0.02, 1e-6);

fn strictness(share: f64) -> f64 {
    (STRICTNESS.0 * share).max(STRICTNESS.1)
}

/// The first stage, as the second builds on it.
pub(super) struct Stage<'a> {
    /// The inequalities, with the optimum's objective.
    pub problem: &'a Problem,
    /// f
    pub objective: &'a Posed,
    /// f* has to be more than this, for there to be something to give back.
    pub least: f64,
    /// Lᵢ of the gain that is to be small.
    pub l: &'a [Expr],
    /// Yᵢ
    pub y: &'a [Expr],
    /// How many of the Yᵢ differ: so many unknowns come first, and then the Lᵢ.
    pub distinct: usize,
    /// R⁻¹ ≻ 0
    pub r_inverse: &'a Mat<f64>,
    /// Q, where it is definite.
    pub q: Option<&'a Mat<f64>>,
    /// The shares that are tried, ascending.
    pub ladder: &'a [f64],
    /// Gains that nobody calls large, one for each vertex: those of its own LQR. What the vertices need one by one is not worth giving cost back for.
    pub reference: &'a [Mat<f64>],
}

/// The answer of a design, with what was given back for it.
pub(super) struct Moderated {
    /// The first stage's, moved to the point of the second.
    pub answer: Answer,
    /// `None` where nothing was asked for, or nothing is solved.
    pub moderation: Option<Moderation>,
}

impl From<Answer> for Moderated {
    /// The answer as it is.
    fn from(answer: Answer) -> Self {
        Self { answer, moderation: None }
    }
}

impl Stage<'_> {
    /// The second stage after `answer`, the optimum's. Where it has no solution of its own the optimum is returned as it is.
    ///
    /// # Errors
    /// Problems without meaning.
    pub fn moderate(&self, answer: Answer, back_off: BackOff, options: &Options) -> Result<Moderated, Error> {
        let is_attained = answer.outcome.is_optimal();
        let is_a_start = is_attained || matches!(answer.outcome, Outcome::Inaccurate(_));
        let optimum = answer.objective;
        if back_off == BackOff::Nothing || !is_a_start || !optimum.is_finite() || optimum <= self.least {
            return Ok(answer.into());
        }
        let ladder = match back_off {
            BackOff::Share(share) => vec![share],
            _ => self.ladder.to_vec(),
        };
        // what carried one design carries the next
        let mut begun = self.problem.beginning_with(&answer);
        // the largest share that the solver finds a design for, which rounding may keep it from
        let mut found = None;
        for (count, &share) in ladder.iter().enumerate().rev() {
            if let Some(second) = self.second(&answer, share, &mut begun, None, options)? {
                found = Some((count, share, second));
                break;
            }
        }
        let Some((smaller, largest, most)) = found else { return Ok(answer.into()) };
        let moderated = |back_off: f64, answer: Answer| {
            let moderation = Some(Moderation { back_off, optimum, is_attained });
            Moderated { answer, moderation }
        };
        let enough = KNEE * self.effort(&most, &most).max(self.effort_of(self.reference, &most));
        if back_off == BackOff::Knee {
            if is_attained && self.effort(&answer, &most) <= enough {
                let strict = self.problem.moved(&answer, self.strict(&answer, STRICT));
                return Ok(moderated(0.0, strict.unwrap_or(answer)));
            }
            for &share in &ladder[..smaller] {
                let second = self.second(&answer, share, &mut begun, Some((&most, enough)), options)?;
                if let Some(second) = second.filter(|second| self.effort(second, &most) <= enough) {
                    return Ok(moderated(share, second));
                }
            }
        }
        Ok(moderated(largest, most))
    }

    /// `first`, moved to the design of least effort with the share `share` of its optimum given back; `None` where the solver does not find it,
    /// or where its effort would be far from `enough`: (whose ellipsoids it is measured on, how much).
    fn second(
        &self,
        first: &Answer,
        share: f64,
        begun: &mut Problem,
        enough: Option<(&Answer, f64)>,
        options: &Options,
    ) -> Result<Option<Answer>, Error> {
        let points = self.least_effort(first.objective, share, begun, enough, options)?;
        let has_point = |point: &&Answer| {
            point.outcome.is_optimal() || matches!(point.outcome, Outcome::Inaccurate(_)) && point.objective.is_finite()
        };
        // of a solver that stopped short by rounding what is made strict may well be proved
        let strict: Vec<Vec<Mat<f64>>> =
            points.iter().filter(has_point).map(|point| self.strict(point, strictness(share))).collect();
        let moved = |values: &Vec<Mat<f64>>| self.problem.moved(first, values.clone());
        // what is proved later is P and K as they are rounded
        let survives =
            |values: &&Vec<Mat<f64>>| self.rounded(values).as_ref().is_some_and(|values| moved(values).is_some());
        Ok(strict.iter().filter(survives).find_map(moved).or_else(|| strict.iter().rev().find_map(moved)))
    }

    /// Y and L as they are read back from P = Y⁻¹ and K = LY⁻¹ in doubles; `None` where Y is not definite.
    fn rounded(&self, values: &[Mat<f64>]) -> Option<Vec<Mat<f64>>> {
        let (distinct, count) = (self.distinct, self.y.len());
        let p: Vec<Mat<f64>> = values[..distinct].iter().map(inverse_spd).collect::<Option<_>>()?;
        let y: Vec<Mat<f64>> = p.iter().map(inverse_spd).collect::<Option<_>>()?;
        let at = |i: usize| if distinct == 1 { 0 } else { i };
        let l = (0..count).map(|i| &values[distinct + i] * &p[at(i)] * &y[at(i)]);
        Some(y.iter().cloned().chain(l).chain(values[distinct + count..].iter().cloned()).collect())
    }

    /// The unknowns of the first stage at a point of the second: (Y, L)/(1 + ε), t(1 + ε) of a cost bound, and t/(1 + ε)² of a margin of stability.
    fn strict(&self, point: &Answer, epsilon: f64) -> Vec<Mat<f64>> {
        let names = self.problem.unknown_names();
        let scaled = |(name, value): (&String, &Mat<f64>)| {
            let factor = match name.as_str() {
                COST_BOUND => 1.0 + epsilon,
                MARGIN => (1.0 + epsilon).powi(-2),
                _ => 1.0 / (1.0 + epsilon),
            };
            Mat::from_fn(value.nrows(), value.ncols(), |i, j| factor * value[(i, j)])
        };
        names.iter().zip(point.unknown_values()).map(scaled).collect()
    }

    /// Points of least effort with the share `share` of `optimum` given back, the better conditioned first, with the unknowns of the second
    /// stage after those of the first. `begun` is the first stage's problem, with the inequalities posed that the solver should begin with.
    fn least_effort(
        &self,
        optimum: f64,
        share: f64,
        begun: &mut Problem,
        enough: Option<(&Answer, f64)>,
        options: &Options,
    ) -> Result<Vec<Answer>, Error> {
        let one = |value: f64| Expr::constant(Mat::from_fn(1, 1, |_, _| value));
        let mut problem = begun.clone();
        let tau = problem.scalar("effort");
        let sign = self.objective.sign();
        // so that what is made strict still is within the share
        let epsilon = strictness(share);
        let given = match self.problem.unknown_names().iter().any(|name| name == MARGIN) {
            true => 1.0 - (1.0 - share) * (1.0 + epsilon).powi(2),
            false => (share - epsilon) / (1.0 + epsilon),
        };
        let least = one(sign * optimum - given.max(0.0) * optimum.abs());
        problem.positive_definite_by("what is left of the optimum", sign * &self.objective.value - least, 0.0);
        for (i, (l, y)) in self.l.iter().zip(self.y).enumerate() {
            let block = Expr::symmetric_blocks(vec![vec![tau.times(self.r_inverse)], vec![l.t(), y.clone()]]);
            problem.positive_definite_by(format!("effort at vertex {}", i + 1), block, 0.0);
        }
        problem.minimize(&tau);
        let options = Options { gap_tolerance: options.gap_tolerance.max(1e-8), ..options.clone() };
        // of what is measured at all: a sketch may miss definiteness by rounding
        let is_hopeless = |sketch: &Answer| {
            enough.is_some_and(|(measure, enough)| {
                let effort = self.effort(sketch, measure);
                effort.is_finite() && effort > FAR_MORE * enough
            })
        };
        let Some(least_effort) = solve_unless(is_hopeless, &problem, &options)? else { return Ok(Vec::new()) };
        *begun = begun.beginning_with(&least_effort);
        let effort = least_effort.value(&tau)[(0, 0)];
        let large = |q: &&Mat<f64>| effort * self.condition(&least_effort, q) > LARGE_GAIN.powi(2);
        let Some(q) = self.q.filter(large) else { return Ok(vec![least_effort]) };
        let nu = problem.scalar("condition");
        problem.positive_definite_by("what is left of the effort", one(EFFORT_ROOM * effort) - &tau, 0.0);
        for (i, y) in self.y.iter().enumerate() {
            let block = Expr::symmetric_blocks(vec![vec![nu.times(q)], vec![Expr::identity(q.nrows()), y.clone()]]);
            problem.positive_definite_by(format!("condition at vertex {}", i + 1), block, 0.0);
        }
        problem.minimize(&nu);
        let conditioned = solve_unless(|_| false, &problem.beginning_with(&least_effort), &options)?;
        Ok(conditioned.into_iter().chain([least_effort]).collect())
    }

    /// The least ν with P ⪯ νQ at every vertex, Q ≻ 0.
    fn condition(&self, design: &Answer, q: &Mat<f64>) -> f64 {
        let Some(root) = inverse_spd(q).and_then(|inverse| semidefinite_factor(&inverse)) else { return f64::INFINITY };
        let at = |y: &Expr| {
            let p = inverse_spd(&design.value(y))?;
            symmetric_eigenvalues(&(root.transpose() * p * &root)).last().copied()
        };
        self.y.iter().map(|y| at(y).unwrap_or(f64::INFINITY)).fold(0.0, f64::max)
    }

    /// The largest √(uᵀRu) of u = −Kx over the vertices on the ellipsoid {V ≤ 1} of `measure`, for K of `design`. Infinite where Y of the
    /// design is not definite.
    fn effort(&self, design: &Answer, measure: &Answer) -> f64 {
        let gain = |(l, y): (&Expr, &Expr)| Some(design.value(l) * inverse_spd(&design.value(y))?);
        let gains: Option<Vec<Mat<f64>>> = self.l.iter().zip(self.y).map(gain).collect();
        gains.map_or(f64::INFINITY, |gains| self.effort_of(&gains, measure))
    }

    /// √λ_max(R^½ Kᵢ Yᵢ Kᵢᵀ R^½) with the Yᵢ of `measure`, the largest of all vertices; zero for no gains.
    fn effort_of(&self, gains: &[Mat<f64>], measure: &Answer) -> f64 {
        let y: Vec<Mat<f64>> = self.y.iter().map(|y| measure.value(y)).collect();
        largest_effort(gains, &y, self.r_inverse)
    }
}

/// The answer, if it is not hopeless after the first rounds: by `is_hopeless`, or because these come to no point. Of a problem that is posed all
/// at once there are no such rounds.
fn solve_unless(
    is_hopeless: impl Fn(&Answer) -> bool,
    problem: &Problem,
    options: &Options,
) -> Result<Option<Answer>, Error> {
    if !problem.has_lazy() {
        return problem.solve(options).map(Some);
    }
    match problem.sketch(options)?.filter(|sketch| !is_hopeless(sketch)) {
        Some(sketch) => problem.solve_sketched(&sketch, options).map(Some),
        None => Ok(None),
    }
}
