//! Bounds on the unknowns, and the best-conditioned point near the optimum.
//!
//! Optima of LMI problems lie on the boundary, where matrices are singular and unknowns may be huge. The classic cure is a second
//! problem: with the optimum p* known, give the objective a little room and use it for the margins,
//!
//! ```text
//! maximise t   subject to   F_b(x) ⪰ t s_b I,   cᵀx ≤ p* + ε (1 + |p*|),   t ≤ 1,
//! ```
//!
//! with s_b the mean eigenvalue of F_b at the optimum, so that t is a share of what a block has.

use crate::answer::Answer;
use crate::problem::{Inequality, Problem, Sense};
use crate::{Error, Expr, Mat, Options};

impl Problem {
    /// The problem with `‖X‖ ≤ bound` (largest singular value) for every unknown as inequalities of its own.
    pub(crate) fn bounded(&self, bound: f64) -> Self {
        let mut problem = self.clone();
        for (unknown, name) in self.unknowns.iter().zip(&self.names) {
            let x = Expr::unknown(*unknown);
            let beta = |n: usize| Expr::constant(bound * Mat::<f64>::identity(n, n));
            let name = format!("bound on {name}");
            if unknown.symmetric {
                problem.positive_definite_by(format!("lower {name}"), beta(unknown.rows) + &x, 0.0);
                problem.positive_definite_by(format!("upper {name}"), beta(unknown.rows) - &x, 0.0);
            } else {
                let rows = vec![vec![beta(unknown.cols)], vec![x, beta(unknown.rows)]];
                problem.positive_definite_by(name, Expr::symmetric_blocks(rows), 0.0);
            }
        }
        problem
    }

    /// The answer moved to the best-conditioned point whose objective is at most `room`·(1 + |p*|) from the optimum p*. The answer
    /// as it was where it is not solved, has no objective, or no better point is proved.
    pub(crate) fn best_conditioned(&self, answer: Answer, room: f64, options: &Options) -> Result<Answer, Error> {
        let (true, Some((sense, objective))) = (answer.outcome.is_optimal(), &self.objective) else {
            return Ok(answer);
        };
        let mut relaxed = self.without_inequalities();
        let t = relaxed.scalar("margin");
        for (Inequality { name, expression, margin, lazy }, block) in self.inequalities.iter().zip(&answer.blocks) {
            let n = block.size;
            let value = answer.value(expression);
            let mean = (0..n).map(|i| value[(i, i)]).sum::<f64>() / n.max(1) as f64;
            let expression = expression - t.times(&(mean * Mat::<f64>::identity(n, n)));
            let margin = Some(margin.unwrap_or(block.margin));
            relaxed.inequalities.push(Inequality { name: name.clone(), expression, margin, lazy: *lazy });
        }
        let sign = if *sense == Sense::Minimize { 1.0 } else { -1.0 };
        let limit = sign * answer.objective + room * (1.0 + answer.objective.abs());
        let one = |value: f64| Expr::constant(Mat::from_fn(1, 1, |_, _| value));
        relaxed.positive_definite_by("objective", one(limit) - sign * objective, 0.0);
        relaxed.positive_definite_by("share", one(1.0) - &t, 0.0);
        relaxed.maximize(&t);
        let mut second = relaxed.solve(&Options { back_off: None, bound: None, ..options.clone() })?;
        let usable = second.outcome.is_optimal() && second.objective > 0.0;
        if !usable {
            return Ok(answer);
        }
        second.values.pop();
        Ok(self.moved(&answer, second.values).unwrap_or(answer))
    }
}
