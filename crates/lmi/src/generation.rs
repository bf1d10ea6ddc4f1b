//! Inequalities that are posed only where an answer breaks them.
//!
//! Of thousands of inequalities, as for the corners of a set of rates, a few dozen carry the optimum. A relaxed problem without the others is solved;
//! those that its point breaks are posed too, the worst first, until it breaks none (constraint generation; in semi-infinite programming the
//! exchange method, R. Hettich and K. Kortanek 1993). What is found is the optimum of the whole problem: a bound on the optimum of a relaxed problem, and a
//! contradiction in one, are those of the whole.

use crate::answer::{Answer, InaccurateReason, Outcome, Residuals, Tolerance, Witness};
use crate::problem::{Inequality, Problem};
use crate::{Error, Expr, Mat, Options};
use faer::Side;
use std::collections::BTreeMap;

/// Rounds after which everything is posed.
const MOST_ROUNDS: usize = 40;
/// Relative gaps of the rounds until nothing is broken: far from the optimum, and near it.
const GAPS: [f64; 2] = [1e-2, 1e-6];
/// Of the largest trace of a multiplier: what carries less is taken back while the objective still moves.
const IDLE: f64 = 2e-3;
/// The same where the gap is small.
const IDLE_AT_OPTIMUM: f64 = 1e-5;
/// Of the worst violation: what is broken by less waits for the next round.
const WORTH_POSING: f64 = 0.05;
/// Residual and relative gap beyond which there is no point to speak of.
const NOWHERE: (f64, f64) = (1e-5, 0.1);
/// How many of one family are posed at a time. A round costs more than a few inequalities that turn out not to matter.
const OF_FAMILY: usize = 3;

/// What the rounds are for.
#[derive(Clone, Copy, PartialEq)]
enum Until {
    /// The answer.
    Solved,
    /// A point that the next round would not move by more than its gap.
    NothingMoves,
}

impl Problem {
    /// Demands `F ≻ 0`, or `F ⪰ margin·I` as [`Self::positive_definite_by`] does, and poses it to the solver only where an answer without it breaks it.
    /// For problems with hundreds of inequalities most of which do not matter; the answer is that of the whole problem. Of those of one `family`, which are
    /// much alike, the worst few are posed at a time.
    pub fn positive_definite_lazily(
        &mut self,
        name: impl Into<String>,
        expression: impl Into<Expr>,
        margin: Option<f64>,
        family: usize,
    ) {
        let (name, expression) = (name.into(), expression.into());
        self.inequalities.push(Inequality { name, expression, margin, lazy: Some(family) });
    }

    /// The same problem, with the lazy inequalities that carry `answer` posed from the start.
    pub fn beginning_with(&self, answer: &Answer) -> Self {
        let mut problem = self.clone();
        let carries = carrying(&answer.multipliers, IDLE_AT_OPTIMUM);
        for (inequality, carries) in problem.inequalities.iter_mut().zip(carries) {
            inequality.lazy = inequality.lazy.filter(|_| !carries);
        }
        problem
    }

    /// Whether any inequality is posed only where it is broken.
    pub fn has_lazy(&self) -> bool {
        self.inequalities.iter().any(|inequality| inequality.lazy.is_some())
    }

    /// A point near the optimum, to a percent or so of the objective, of which nothing is proved: enough to see whether the problem is worth
    /// solving, in the first rounds of what [`Self::solve`] would do where inequalities are lazy. `None` where they come to no point.
    ///
    /// # Errors
    ///
    /// Those of [`Self::solve`].
    pub fn sketch(&self, options: &Options) -> Result<Option<Answer>, Error> {
        options.check()?;
        let answer = self.rounds(options, Until::NothingMoves, &GAPS)?;
        let is_point = answer.outcome.is_optimal() || matches!(answer.outcome, Outcome::Inaccurate(_));
        Ok(Some(answer).filter(|answer| is_point && !is_nowhere(answer)))
    }

    /// Solves the problem as [`Self::solve`] does, going on from its [sketch](Self::sketch).
    ///
    /// # Errors
    ///
    /// Those of [`Self::solve`].
    pub fn solve_sketched(&self, sketch: &Answer, options: &Options) -> Result<Answer, Error> {
        let problem = self.beginning_with(sketch);
        match problem.has_lazy() {
            true => problem.rounds(options, Until::Solved, &GAPS[1..]),
            false => problem.solve(options),
        }
    }

    /// The answer to the whole problem, in which nothing but the inequalities that are not lazy need be posed.
    pub(crate) fn generate(&self, options: &Options) -> Result<Answer, Error> {
        options.check()?;
        self.rounds(options, Until::Solved, &GAPS)
    }

    /// Rounds at the gaps given, and then at that of the options.
    fn rounds(&self, options: &Options, until: Until, gaps: &[f64]) -> Result<Answer, Error> {
        let mut posed: Vec<bool> = self.inequalities.iter().map(|inequality| inequality.lazy.is_none()).collect();
        let mut iterations = Vec::new();
        // what is broken far from the optimum is known from a point that is not yet there
        let mut gaps = gaps.iter().copied().filter(|gap| *gap > options.gap_tolerance);
        let mut gap = gaps.next().unwrap_or(options.gap_tolerance);
        let mut last = f64::INFINITY;
        for round in 0.. {
            if round == MOST_ROUNDS || !posed.contains(&true) {
                posed.fill(true);
            }
            let relaxed = self.posing(&posed);
            let mut answer = match gap > options.gap_tolerance {
                // a point is enough, whatever the word for it
                true => relaxed.solve_once(None, &Options { gap_tolerance: gap, ..options.clone() })?,
                false => relaxed.solve(options)?,
            };
            iterations.append(&mut answer.iterations);
            let has_point = answer.outcome.is_optimal() || matches!(answer.outcome, Outcome::Inaccurate(_));
            let broken = if has_point { self.broken(&posed, &answer, options) } else { Vec::new() };
            let has_moved = has_moved(last, &answer, gap);
            let is_unbounded = matches!(answer.outcome, Outcome::Unbounded(_) | Outcome::UnboundedToTolerance(_));
            if is_unbounded && posed.contains(&false) {
                posed.fill(true);
            } else if until == Until::NothingMoves && (broken.is_empty() || !has_moved || is_nowhere(&answer)) {
                answer.multipliers = self.spread(std::mem::take(&mut answer.multipliers), &posed);
                (answer.iterations, answer.centre) = (iterations, None);
                return Ok(answer);
            } else if has_point && gap > options.gap_tolerance && (broken.is_empty() || !has_moved) {
                gap = gaps.next().unwrap_or(options.gap_tolerance);
            } else if broken.is_empty() {
                answer.iterations = iterations;
                return self.completed(answer, &posed);
            }
            // an objective that has become worse never comes back to what it was, so that nothing goes round in circles
            if has_moved && !broken.is_empty() {
                let carries = carrying(&answer.multipliers, if gap == GAPS[0] { IDLE } else { IDLE_AT_OPTIMUM });
                let mut carries = carries.into_iter();
                for (posed, inequality) in posed.iter_mut().zip(&self.inequalities).filter(|(posed, _)| **posed) {
                    *posed = carries.next().unwrap_or(true) || inequality.lazy.is_none();
                }
            }
            broken.into_iter().for_each(|block| posed[block] = true);
            last = answer.objective;
        }
        unreachable!("everything is posed in the end, and then nothing is broken that is not posed")
    }

    /// The inequalities that are posed, alone and none of them lazy.
    fn posing(&self, posed: &[bool]) -> Self {
        let mut problem = self.without_inequalities();
        problem.objective.clone_from(&self.objective);
        let stated = self.inequalities.iter().zip(posed).filter(|(_, posed)| **posed);
        problem.inequalities = stated.map(|(inequality, _)| Inequality { lazy: None, ..inequality.clone() }).collect();
        problem
    }

    /// The inequalities that are not posed and that the point of `answer` breaks, the worst first.
    fn broken(&self, posed: &[bool], answer: &Answer, options: &Options) -> Vec<usize> {
        let violation = |inequality: &Inequality| {
            // half of the margin that is imposed is enough to prove it by
            let margin = 0.5 * inequality.margin.unwrap_or(options.default_margin(&inequality.expression.constant));
            let f = answer.value(&inequality.expression);
            let shifted = Mat::from_fn(f.nrows(), f.ncols(), |i, j| f[(i, j)] - if i == j { margin } else { 0.0 });
            if shifted.llt(Side::Lower).is_ok() {
                return 0.0;
            }
            let values = shifted.self_adjoint_eigenvalues(Side::Lower);
            values.ok().and_then(|values| values.first().copied()).map_or(f64::INFINITY, |least| -least)
        };
        let waiting = self.inequalities.iter().enumerate().filter(|(block, _)| !posed[*block]);
        let mut broken: Vec<(usize, f64)> = waiting.map(|(block, inequality)| (block, violation(inequality))).collect();
        broken.sort_by(|a, b| b.1.total_cmp(&a.1));
        let worst = broken.first().map_or(0.0, |first| first.1);
        let is_worth = |&(_, violation): &(usize, f64)| violation > 0.0 && violation >= WORTH_POSING * worst;
        let mut families: BTreeMap<Option<usize>, usize> = BTreeMap::new();
        let leads = |&(block, _): &(usize, f64)| {
            let before = families.entry(self.inequalities[block].lazy).or_default();
            *before += 1;
            *before <= OF_FAMILY
        };
        broken.into_iter().take_while(is_worth).filter(leads).map(|(block, _)| block).collect()
    }

    /// Multipliers of what is posed as those of all inequalities.
    fn spread(&self, of_posed: Vec<Mat<f64>>, posed: &[bool]) -> Vec<Mat<f64>> {
        let nothing = |inequality: &Inequality| {
            let n = inequality.expression.nrows();
            Mat::zeros(n, n)
        };
        let mut of_posed = of_posed.into_iter();
        let each = self.inequalities.iter().zip(posed);
        each.map(|(inequality, posed)| posed.then(|| of_posed.next()).flatten().unwrap_or_else(|| nothing(inequality)))
            .collect()
    }

    /// The answer as one of the whole problem: blocks that were not posed are proved, and have a multiplier of zero.
    fn completed(&self, mut answer: Answer, posed: &[bool]) -> Result<Answer, Error> {
        answer.multipliers = self.spread(std::mem::take(&mut answer.multipliers), posed);
        answer.centre = None;
        if let Outcome::Infeasible(witness) | Outcome::InfeasibleWithin(witness) = &mut answer.outcome {
            let multipliers = self.spread(std::mem::take(&mut witness.multipliers), posed);
            let smallest_eigenvalue = witness.smallest_eigenvalue.min(0.0);
            *witness = Witness { multipliers, smallest_eigenvalue, ..witness.clone() };
        }
        let mut own = std::mem::take(&mut answer.blocks).into_iter();
        let all = self.verify(&answer.values)?;
        answer.blocks = all
            .into_iter()
            .zip(posed)
            .map(|(block, posed)| posed.then(|| own.next()).flatten().unwrap_or(block))
            .collect();
        let waiting = answer.blocks.iter().zip(&self.inequalities).zip(posed).filter(|(_, posed)| !**posed);
        // by how much each may miss what it demands; a strict one has to be proved strict
        let missing = waiting.map(|((block, inequality), _)| {
            let missing = inequality.margin.unwrap_or(0.0) - block.verified_lower_bound;
            if inequality.margin.is_none() && missing >= 0.0 { f64::INFINITY } else { missing.max(0.0) }
        });
        let missing = missing.fold(0.0, f64::max);
        if answer.outcome.is_optimal() && missing > 0.0 {
            (answer.attained, answer.optimum_bound) = (None, None);
            answer.outcome = match answer.outcome {
                Outcome::SolvedToTolerance(Tolerance { violation, gap }) if missing.is_finite() => {
                    Outcome::SolvedToTolerance(Tolerance { violation: violation.max(missing), gap })
                }
                _ if missing.is_finite() => {
                    Outcome::SolvedToTolerance(Tolerance { violation: missing, gap: f64::INFINITY })
                }
                _ => Outcome::Inaccurate(InaccurateReason::NotVerified),
            };
        }
        Ok(answer)
    }
}

/// Whether the iteration ended far from any point that satisfies what is posed.
fn is_nowhere(answer: &Answer) -> bool {
    let Residuals { primal, gap, .. } = answer.residuals;
    matches!(answer.outcome, Outcome::Inaccurate(_)) && (primal.is_nan() || primal > NOWHERE.0 && gap > NOWHERE.1)
}

/// Whether the objective moved by more than the gap lets see.
fn has_moved(last: f64, answer: &Answer, gap: f64) -> bool {
    // not so of a first round, nor of anything that is not a number
    let least = gap * (1.0 + answer.objective.abs());
    last.is_infinite() || (answer.objective - last).abs() > least
}

/// Which inequalities carry more than a share `least` of the largest.
fn carrying(multipliers: &[Mat<f64>], least: f64) -> Vec<bool> {
    let trace = |z: &Mat<f64>| (0..z.nrows()).map(|i| z[(i, i)]).sum::<f64>();
    let weights: Vec<f64> = multipliers.iter().map(trace).collect();
    let least = least * weights.iter().copied().fold(0.0, f64::max);
    weights.into_iter().map(|weight| weight > least).collect()
}
