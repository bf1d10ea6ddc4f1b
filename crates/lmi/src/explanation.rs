//! Why a problem has no solution, in terms of its own inequalities.

use crate::answer::{Answer, Outcome, Residuals};
use crate::expression::Expr;
use crate::problem::{Inequality, Problem};
use crate::{Error, Mat, Options};
use serde::Serialize;
use std::fmt;

/// Inequalities that are tried one by one.
const TRIED: usize = 5;
/// Least share of an inequality that is worth a word.
const LEAST_SHARE: f64 = 1e-3;

/// How far a problem is from having a solution, and what stands in the way.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// The least t with `F_b(x) + tI ⪰ margin·I` for every inequality b and some x.
    pub distance: f64,
    /// The inequalities that contradict each other, the one that weighs most first.
    pub carriers: Vec<Carrier>,
}

/// One of the inequalities that contradict each other.
#[derive(Clone, Debug, Serialize)]
pub struct Carrier {
    /// Its name.
    pub name: String,
    /// Its share `tr Z_b / Σ tr Z` in the multipliers of the least t: by so much falls t when `F_b ⪰ 0` is relaxed to `F_b ⪰ −1·I`,
    /// for small relaxations.
    pub share: f64,
    /// The least t with which relaxing this inequality alone to `F_b ⪰ −tI` makes the problem solvable; `None` where that does not
    /// help, or was not tried because the share is small.
    pub alone: Option<f64>,
}

impl Explanation {
    /// The inequality whose relaxation alone helps with the smallest change.
    pub fn cheapest(&self) -> Option<&Carrier> {
        let helping = self.carriers.iter().filter(|carrier| carrier.alone.is_some());
        helping.min_by(|a, b| a.alone.unwrap_or(f64::INFINITY).total_cmp(&b.alone.unwrap_or(f64::INFINITY)))
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // by how little, where it is known
        match self.distance > 0.0 {
            true => writeln!(f, "no solution: every inequality would have to give way by {:.3e}", self.distance)?,
            false => writeln!(f, "no solution: these inequalities contradict each other")?,
        }
        for carrier in &self.carriers {
            write!(f, "  {:5.1} %  {}", 100.0 * carrier.share, carrier.name)?;
            match carrier.alone {
                Some(t) => writeln!(f, ": relaxed alone by {t:.3e}, it would do")?,
                None => writeln!(f)?,
            }
        }
        match self.cheapest() {
            Some(carrier) => write!(f, "relax \"{}\" first", carrier.name),
            None => write!(f, "no inequality helps when it is relaxed alone"),
        }
    }
}

impl Problem {
    /// Explains an answer that is [`Outcome::Infeasible`] or [`Outcome::InfeasibleWithin`]; `None` for every other one, and
    /// where the least relaxation cannot be found.
    ///
    /// Solves the problem anew with its inequalities relaxed, all together and then one by one.
    ///
    /// # Errors
    ///
    /// Those of [`Problem::solve`].
    pub fn explain(&self, answer: &Answer, options: &Options) -> Result<Option<Explanation>, Error> {
        let names: Vec<String> = self.inequalities.iter().map(|inequality| inequality.name.clone()).collect();
        let options = Options { back_off: None, bound: None, ..options.clone() };
        explain(answer, &names, &|relaxed| self.least_relaxation(relaxed, &options))
    }

    /// Minimises t with tI added to some inequalities.
    fn least_relaxation(&self, relaxed: &dyn Fn(usize) -> bool, options: &Options) -> Result<Answer, Error> {
        let mut problem = self.without_inequalities();
        let t = problem.scalar("relaxation");
        for (block, Inequality { name, expression, margin, lazy }) in self.inequalities.iter().enumerate() {
            let n = expression.nrows();
            let expression = match relaxed(block) {
                true => expression + t.times(&Mat::identity(n, n)),
                false => expression.clone(),
            };
            problem.inequalities.push(Inequality {
                name: name.clone(),
                expression,
                margin: Some(margin.unwrap_or(0.0)),
                lazy: *lazy,
            });
        }
        // Inequalities relaxed beyond need would leave t without end where there is no contradiction.
        let floor: Expr = &t + Expr::identity(1);
        problem.positive_definite_by("relaxation", floor, 0.0);
        problem.minimize(&t);
        let mut answer = problem.solve(options)?;
        answer.multipliers.pop();
        Ok(answer)
    }
}

/// Solves for the least relaxation of the inequalities that are picked.
type Relax<'a> = dyn Fn(&dyn Fn(usize) -> bool) -> Result<Answer, Error> + 'a;

/// The explanation of an infeasible answer, from what solves for the least relaxation of some inequalities.
pub(crate) fn explain(answer: &Answer, names: &[String], relax: &Relax<'_>) -> Result<Option<Explanation>, Error> {
    if !matches!(answer.outcome, Outcome::Infeasible(_) | Outcome::InfeasibleWithin(_)) {
        return Ok(None);
    }
    let least = |relaxed: &dyn Fn(usize) -> bool| -> Result<Option<Answer>, Error> {
        let answer = relax(relaxed)?;
        let Residuals { primal, dual, gap, uncertainty } = answer.residuals;
        let near = primal.max(dual).max(gap).max(uncertainty) < 1e-4;
        let found = match answer.outcome {
            Outcome::Solved | Outcome::SolvedToTolerance(_) => true,
            Outcome::Inaccurate(_) => near,
            _ => false,
        };
        Ok(found.then_some(answer))
    };
    let Some(together) = least(&|_| true)? else {
        return Ok(None);
    };
    let weight = |z: &Mat<f64>| (0..z.nrows()).map(|i| z[(i, i)]).sum::<f64>();
    let weights: Vec<f64> = together.multipliers.iter().map(weight).collect();
    let total: f64 = weights.iter().sum();
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]));
    let mut carriers = Vec::new();
    for (place, block) in order.into_iter().enumerate() {
        let share = weights[block] / total;
        if share.is_nan() || share < LEAST_SHARE {
            break;
        }
        let alone = match place < TRIED {
            true => least(&|other| other == block)?.map(|answer| answer.objective),
            false => None,
        };
        carriers.push(Carrier { name: names[block].clone(), share, alone });
    }
    Ok(Some(Explanation { distance: together.objective, carriers }))
}
