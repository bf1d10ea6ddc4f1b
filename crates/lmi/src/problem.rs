//! Problems: unknowns, inequalities and an objective.

use crate::answer::{Answer, BlockReport, InaccurateReason, Outcome};
use crate::expression::{Expr, Unknown};
use crate::interior_point::Centre;
use crate::lowering::{Layout, lower};
use crate::report::{Original, Translation, report};
use crate::rigorous::{Enclosure, Gradient};
use crate::verification::Spectrum;
use crate::{Error, Mat, Options, balancing};
use std::sync::atomic::{AtomicU64, Ordering};

/// An inequality `F(x) ⪰ margin·I`.
#[derive(Clone, Debug)]
pub(crate) struct Inequality {
    pub name: String,
    pub expression: Expr,
    /// `None`: the default margin of the options.
    pub margin: Option<f64>,
}

/// The direction of the objective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sense {
    Minimize,
    Maximize,
}

/// An LMI problem: matrix unknowns, inequalities on affine expressions in them, a linear objective.
///
/// See the [crate's front page](crate) for an example. Without an objective the problem is one of feasibility.
#[derive(Debug)]
pub struct Problem {
    id: u64,
    names: Vec<String>,
    unknowns: Vec<Unknown>,
    pub(crate) inequalities: Vec<Inequality>,
    objective: Option<(Sense, Expr)>,
}

impl Default for Problem {
    fn default() -> Self {
        Self::new()
    }
}

impl Problem {
    /// A problem without unknowns and inequalities.
    pub fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            names: Vec::new(),
            unknowns: Vec::new(),
            inequalities: Vec::new(),
            objective: None,
        }
    }

    /// A symmetric n × n unknown, n(n + 1)/2 scalars. Symmetric only: definiteness is an inequality of its own.
    pub fn symmetric(&mut self, name: impl Into<String>, n: usize) -> Expr {
        self.unknown(name.into(), n, n, true)
    }

    /// An unknown with `rows` rows and `cols` columns.
    pub fn rectangular(&mut self, name: impl Into<String>, rows: usize, cols: usize) -> Expr {
        self.unknown(name.into(), rows, cols, false)
    }

    /// A scalar unknown, as a 1 × 1 expression.
    pub fn scalar(&mut self, name: impl Into<String>) -> Expr {
        self.unknown(name.into(), 1, 1, true)
    }

    /// Demands `F ≻ 0`, posed as `F ⪰ margin·I` with the default margin of [`Options::margin`].
    pub fn positive_definite(&mut self, name: impl Into<String>, expression: impl Into<Expr>) {
        self.inequalities.push(Inequality { name: name.into(), expression: expression.into(), margin: None });
    }

    /// Demands `F ⪰ margin·I`.
    pub fn positive_definite_by(&mut self, name: impl Into<String>, expression: impl Into<Expr>, margin: f64) {
        self.inequalities.push(Inequality { name: name.into(), expression: expression.into(), margin: Some(margin) });
    }

    /// Sets the objective: the smallest value of a 1 × 1 expression.
    pub fn minimize(&mut self, objective: &Expr) {
        self.objective = Some((Sense::Minimize, objective.clone()));
    }

    /// Sets the objective: the largest value of a 1 × 1 expression.
    pub fn maximize(&mut self, objective: &Expr) {
        self.objective = Some((Sense::Maximize, objective.clone()));
    }

    /// Names of the unknowns, in the order made.
    pub fn unknown_names(&self) -> &[String] {
        &self.names
    }

    /// Number of scalar unknowns.
    pub fn scalar_unknowns(&self) -> usize {
        Layout::new(&self.unknowns).len()
    }

    /// Solves the problem.
    ///
    /// # Errors
    ///
    /// Only for problems without meaning ([`Error`]): no inequality, data that is not finite, an inequality that is not
    /// square and symmetric, an objective that is not 1 × 1, an unknown of another problem, an option out of range.
    /// Infeasible, unbounded and inaccurate are outcomes.
    pub fn solve(&self, options: &Options) -> Result<Answer, Error> {
        options.check()?;
        let answer = self.solve_once(None, options)?;
        let unproved = matches!(answer.outcome, Outcome::Inaccurate(InaccurateReason::NotVerified));
        if unproved && options.margin > 0.0 {
            // The default margin may have been too much for a set that is thin: F(x) ≻ 0 is proved or not, whatever was imposed.
            let again = self.solve_once(None, &Options { margin: 0.0, ..options.clone() })?;
            if matches!(again.outcome, Outcome::Solved) {
                return Ok(again);
            }
        }
        Ok(answer)
    }

    /// Solves the problem as [`Self::solve`] does, beginning near the answer to a neighbouring problem: the same unknowns and inequalities
    /// with other numbers, as along a grid of a parameter.
    ///
    /// The neighbour's course is joined where its gap was a few percent, about half way. Where that leads nowhere, or the neighbour
    /// has another shape, the iteration begins as it always does; what is proved of the answer does not depend on where it began.
    ///
    /// # Errors
    ///
    /// Those of [`Self::solve`].
    pub fn solve_near(&self, neighbour: &Answer, options: &Options) -> Result<Answer, Error> {
        if let Some(centre) = &neighbour.centre {
            options.check()?;
            let answer = self.solve_once(Some(centre), options)?;
            if matches!(answer.outcome, Outcome::Solved) {
                return Ok(answer);
            }
        }
        self.solve(options)
    }

    fn solve_once(&self, centre: Option<&Centre>, options: &Options) -> Result<Answer, Error> {
        let mut lowered = lower(self.id, &self.unknowns, &self.inequalities, self.objective.as_ref(), options)?;
        lowered.program.warm = centre.cloned();
        let (result, balancing) = balancing::solve(lowered.program, &lowered.margins, options);
        let translation = Translation {
            layout: &lowered.layout,
            unknowns: &self.unknowns,
            objective_constant: lowered.objective_constant,
            sign: lowered.sign,
        };
        Ok(report(
            &Stated { problem: self, layout: &lowered.layout, margins: &lowered.margins },
            &translation,
            result,
            balancing,
            options,
        ))
    }

    /// The same unknowns and nothing else.
    pub(crate) fn without_inequalities(&self) -> Self {
        let Self { id, names, unknowns, .. } = self;
        Self { id: *id, names: names.clone(), unknowns: unknowns.clone(), inequalities: Vec::new(), objective: None }
    }

    fn unknown(&mut self, name: String, rows: usize, cols: usize, symmetric: bool) -> Expr {
        let unknown = Unknown { problem: self.id, index: self.unknowns.len(), rows, cols, symmetric };
        self.names.push(name);
        self.unknowns.push(unknown);
        Expr::unknown(unknown)
    }
}

/// A problem as its expressions state it.
struct Stated<'a> {
    problem: &'a Problem,
    layout: &'a Layout,
    margins: &'a [f64],
}

impl Original for Stated<'_> {
    fn blocks(&self) -> Vec<BlockReport> {
        let reports = self.problem.inequalities.iter().zip(self.margins).map(|(inequality, &margin)| BlockReport {
            name: inequality.name.clone(),
            size: inequality.expression.nrows(),
            smallest_eigenvalue: f64::NAN,
            verified_lower_bound: f64::NEG_INFINITY,
            margin,
        });
        reports.collect()
    }

    fn value(&self, block: usize, values: &[Mat<f64>]) -> Mat<f64> {
        self.problem.inequalities[block].expression.evaluate(&|unknown| &values[unknown.index])
    }

    fn enclosure(&self, block: usize, values: &[Mat<f64>]) -> Enclosure {
        Enclosure::of_expression(&self.problem.inequalities[block].expression, &|unknown| &values[unknown.index])
    }

    fn objective(&self, values: &[Mat<f64>]) -> f64 {
        let objective = self.problem.objective.as_ref();
        objective.map_or(0.0, |(_, expression)| expression.evaluate(&|unknown| &values[unknown.index])[(0, 0)])
    }

    fn gradient_bounds(&self, multipliers: &[Mat<f64>]) -> Vec<f64> {
        let expressions = self.problem.inequalities.iter().map(|inequality| &inequality.expression);
        let gradient = Gradient::new(&self.problem.unknowns, expressions.zip(multipliers));
        let values = self.layout.scalars(&gradient.values);
        let radii = self.layout.scalars(&gradient.radii);
        values.iter().zip(radii).map(|(value, radius)| 1.001 * (value.abs() + radius)).collect()
    }

    fn strict(&self, block: usize) -> bool {
        self.problem.inequalities[block].margin.is_none()
    }

    fn floor(&self, block: usize, spectrum: &Spectrum) -> Option<f64> {
        self.problem.inequalities[block].margin.map(|margin| margin - 4.0 * spectrum.rounding)
    }
}
