//! Problems: unknowns, inequalities and an objective.

use crate::answer::{Answer, BlockReport, InaccurateReason, OptimumBound, Outcome, Tolerance};
use crate::expression::{Expr, Unknown};
use crate::interior_point::Centre;
use crate::lowering::{Layout, Lowered, lower};
use crate::multiplier::Multiplier;
use crate::report::{Original, Translation, report, verify};
use crate::rigorous::{Enclosure, Gradient, SumOfProducts};
use crate::sdpa::{BlockShape, Coefficient, Sdp};
use crate::verification::{Spectrum, largest_entry};
use crate::{Error, Mat, Options, balancing};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// An inequality `F(x) ⪰ margin·I`.
#[derive(Clone, Debug)]
pub(crate) struct Inequality {
    pub name: String,
    pub expression: Expr,
    /// `None`: the default margin of the options.
    pub margin: Option<f64>,
    /// The family of one that is posed only where an answer without it breaks it.
    pub lazy: Option<usize>,
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
#[derive(Clone, Debug)]
pub struct Problem {
    id: u64,
    pub(crate) names: Vec<String>,
    pub(crate) unknowns: Vec<Unknown>,
    pub(crate) inequalities: Vec<Inequality>,
    pub(crate) objective: Option<(Sense, Expr)>,
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
        self.inequalities.push(Inequality {
            name: name.into(),
            expression: expression.into(),
            margin: None,
            lazy: None,
        });
    }

    /// Demands `F ⪰ margin·I`.
    pub fn positive_definite_by(&mut self, name: impl Into<String>, expression: impl Into<Expr>, margin: f64) {
        self.inequalities.push(Inequality {
            name: name.into(),
            expression: expression.into(),
            margin: Some(margin),
            lazy: None,
        });
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
        if self.has_lazy() {
            return self.generate(options);
        }
        self.solve_in_stages(None, options)
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
        self.solve_in_stages(neighbour.centre.as_ref(), options)
    }

    /// The problem coefficient by coefficient, to be written as a `.dat-s` file for other solvers: minimise cᵀx, with the scalars of
    /// each unknown in the order made, row by row, of a symmetric one its lower triangle. Margins that were given are part of
    /// F₀; strict inequalities are posed with margin zero. The constant of the objective is lost, and a maximised one changes its sign.
    ///
    /// # Errors
    ///
    /// Those of [`Self::solve`].
    pub fn to_sdp(&self, options: &Options) -> Result<Sdp, Error> {
        let lowered = lower(self.id, &self.unknowns, &self.inequalities, self.objective.as_ref(), options)?;
        let mut coefficients: BTreeMap<(Option<usize>, usize, usize, usize), f64> = BTreeMap::new();
        for (block, (form, inequality)) in lowered.program.blocks.iter().zip(&self.inequalities).enumerate() {
            form.coefficients(&mut |row, column, unknown, value| {
                let value = if unknown.is_none() { -value } else { value };
                *coefficients.entry((unknown, block, column, row)).or_default() += value;
            });
            let margin = inequality.margin.unwrap_or(0.0);
            for i in 0..form.size() {
                *coefficients.entry((None, block, i, i)).or_default() += margin;
            }
        }
        let coefficients = coefficients.into_iter().filter(|(_, value)| *value != 0.0);
        Ok(Sdp {
            objective: lowered.program.objective,
            blocks: lowered.program.blocks.iter().map(|block| BlockShape::Symmetric(block.size())).collect(),
            coefficients: coefficients
                .map(|((unknown, block, row, column), value)| Coefficient { unknown, block, row, column, value })
                .collect(),
        })
    }

    /// Proves lower bounds on the smallest eigenvalues of the inequalities at any point, whoever found it: one matrix for each unknown in the
    /// order made.
    ///
    /// # Errors
    ///
    /// A number or size of matrices that does not match the unknowns.
    pub fn verify(&self, values: &[Mat<f64>]) -> Result<Vec<BlockReport>, Error> {
        let sizes = |m: &Mat<f64>, u: &Unknown| (m.nrows(), m.ncols()) == (u.rows, u.cols);
        if values.len() != self.unknowns.len() || !values.iter().zip(&self.unknowns).all(|(m, u)| sizes(m, u)) {
            return Err(Error::BadPoint { expected: self.unknowns.len(), given: values.len() });
        }
        let layout = Layout::new(&self.unknowns);
        let margins: Vec<f64> = self.inequalities.iter().map(|i| i.margin.unwrap_or(0.0)).collect();
        Ok(verify(&Stated { problem: self, layout: &layout, margins: &margins }, values).0)
    }

    /// The answer of this problem with other values of the unknowns, one matrix for each in the order made; `None` where these are not proved to
    /// satisfy the inequalities. Bounds and multipliers stay those of the answer.
    ///
    /// # Panics
    ///
    /// When the values do not match the unknowns in number and size.
    pub fn moved(&self, answer: &Answer, values: Vec<Mat<f64>>) -> Option<Answer> {
        let layout = Layout::new(&self.unknowns);
        let margins: Vec<f64> = answer.blocks.iter().map(|block| block.margin).collect();
        let stated = Stated { problem: self, layout: &layout, margins: &margins };
        let (blocks, proof) = verify(&stated, &values);
        if !proof.proved {
            return None;
        }
        let answer = answer.clone();
        let objective = stated.objective(&values);
        let gap = (objective - answer.dual_objective).abs();
        let mut residuals = answer.residuals;
        residuals.gap = gap / (1.0 + objective.abs() + answer.dual_objective.abs());
        // The bound speaks of multiples of the point that it was proved at.
        let shrinks = answer.values.iter().zip(&values).map(|(x, y)| largest_entry(x) / largest_entry(y));
        let share = shrinks.fold(1.0, f64::min);
        let optimum_bound = answer.optimum_bound.map(|bound| OptimumBound { reach: share * bound.reach, ..bound });
        let (value, error) = stated.objective_enclosure(&values);
        let sign = if matches!(self.objective, Some((Sense::Maximize, _))) { -1.0 } else { 1.0 };
        let attained = Some(value + sign * (error + 2.0 * f64::EPSILON * value.abs()));
        let outcome = match answer.outcome {
            Outcome::SolvedToTolerance(tolerance) => {
                Outcome::SolvedToTolerance(Tolerance { violation: 0.0, ..tolerance })
            }
            other => other,
        };
        Some(Answer { outcome, blocks, objective, gap, optimum_bound, attained, residuals, values, ..answer })
    }

    /// The answer to this problem by that to the same one stated in other units: `values` are those of the answer in the units here, and the objective here
    /// is `objective` times as large; `None` where the values are not proved to satisfy the inequalities as they are stated here. What was proved of
    /// the data there is not carried over: there is no bound on the optimum, and there are no multipliers.
    pub fn restated(&self, answer: &Answer, values: Vec<Mat<f64>>, objective: f64) -> Option<Answer> {
        let blocks = self.verify(&values).ok()?;
        let outcome = match answer.outcome {
            Outcome::Solved | Outcome::SolvedToTolerance(_) => {
                Outcome::SolvedToTolerance(Tolerance { violation: 0.0, gap: f64::INFINITY })
            }
            ref other => other.clone(),
        };
        let restated = Answer {
            outcome,
            objective: objective * answer.objective,
            dual_objective: objective * answer.dual_objective,
            optimum_bound: None,
            blocks,
            multipliers: Vec::new(),
            centre: None,
            unknowns: self.unknowns.clone(),
            ..answer.clone()
        };
        self.moved(&restated, values)
    }

    /// With bounds on the unknowns, and the best-conditioned point after the optimum, where the options ask for them.
    fn solve_in_stages(&self, centre: Option<&Centre>, options: &Options) -> Result<Answer, Error> {
        options.check()?;
        let bounded = options.bound.map(|bound| self.bounded(bound));
        let problem = bounded.as_ref().unwrap_or(self);
        let near = match centre {
            Some(centre) => Some(problem.solve_once(Some(centre), options)?),
            None => None,
        };
        let answer = match near {
            Some(answer) if answer.outcome.is_optimal() => answer,
            _ => problem.solve_whole(options)?,
        };
        match options.back_off {
            Some(room) => problem.best_conditioned(answer, room, options),
            None => Ok(answer),
        }
    }

    fn solve_whole(&self, options: &Options) -> Result<Answer, Error> {
        let answer = self.solve_once(None, options)?;
        let unproved = matches!(answer.outcome, Outcome::Inaccurate(InaccurateReason::NotVerified));
        if unproved && options.margin > 0.0 {
            // The default margin may have been too much for a set that is thin: F(x) ≻ 0 is proved or not, whatever was imposed.
            let again = self.solve_once(None, &Options { margin: 0.0, ..options.clone() })?;
            if again.outcome.is_optimal() {
                return Ok(again);
            }
        }
        match unproved {
            true => Ok(self.solve_in_more_digits(options)?.unwrap_or(answer)),
            false => Ok(answer),
        }
    }

    fn solve_in_more_digits(&self, options: &Options) -> Result<Option<Answer>, Error> {
        let lowered = lower(self.id, &self.unknowns, &self.inequalities, self.objective.as_ref(), options)?;
        let Lowered { program, layout, margins, objective_constant, sign } = lowered;
        let solved = balancing::solve_in_more_digits(program, &margins, options);
        let report = |(result, balancing)| {
            let translation = Translation { layout: &layout, unknowns: &self.unknowns, objective_constant, sign };
            report(
                &Stated { problem: self, layout: &layout, margins: &margins },
                &translation,
                result,
                balancing,
                options,
            )
        };
        Ok(solved.map(report))
    }

    pub(crate) fn solve_once(&self, centre: Option<&Centre>, options: &Options) -> Result<Answer, Error> {
        let mut lowered = lower(self.id, &self.unknowns, &self.inequalities, self.objective.as_ref(), options)?;
        lowered.program.warm = centre.filter(|centre| centre.fits(&lowered.program)).cloned();
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

    fn known_product(&self, block: usize, z: &Mat<f64>) -> SumOfProducts {
        let constant = &self.problem.inequalities[block].expression.constant;
        let entries = (0..z.ncols()).flat_map(|j| constant.col_as_slice(j).iter().zip(z.col_as_slice(j)));
        SumOfProducts::of(entries.filter(|(c, _)| **c != 0.0).map(|(c, z)| (*c, *z)))
    }

    fn objective(&self, values: &[Mat<f64>]) -> f64 {
        let objective = self.problem.objective.as_ref();
        objective.map_or(0.0, |(_, expression)| expression.evaluate(&|unknown| &values[unknown.index])[(0, 0)])
    }

    fn objective_enclosure(&self, values: &[Mat<f64>]) -> (f64, f64) {
        let objective = self.problem.objective.as_ref();
        let enclosure =
            |(_, e): &(Sense, Expr)| Enclosure::of_expression(e, &|unknown| &values[unknown.index]).scalar();
        objective.map_or((0.0, 0.0), enclosure)
    }

    fn slope(&self, direction: &[Mat<f64>]) -> (f64, f64) {
        let objective = self.problem.objective.as_ref();
        let change = |(_, e): &(Sense, Expr)| Enclosure::of_change(e, &|unknown| &direction[unknown.index]).scalar();
        objective.map_or((0.0, 0.0), change)
    }

    fn has_objective(&self) -> bool {
        self.problem.objective.as_ref().is_some_and(|(_, objective)| !objective.terms.is_empty())
    }

    fn in_objective(&self, unknowns: usize) -> Vec<bool> {
        let mut found = vec![false; unknowns];
        if let Some((_, objective)) = &self.problem.objective {
            objective.coefficients(self.layout, &mut |_, _, unknown, _| {
                unknown.into_iter().for_each(|unknown| found[unknown] = true)
            });
        }
        found
    }

    fn change(&self, block: usize, direction: &[Mat<f64>]) -> Enclosure {
        Enclosure::of_change(&self.problem.inequalities[block].expression, &|unknown| &direction[unknown.index])
    }

    fn is_diagonal(&self, _: usize) -> bool {
        false
    }

    fn is_homogeneous(&self, block: usize) -> bool {
        let Inequality { expression, margin, .. } = &self.problem.inequalities[block];
        margin.is_none_or(|margin| margin == 0.0) && largest_entry(&expression.constant) == 0.0
    }

    fn entries(&self, block: usize, sink: &mut dyn FnMut(usize, usize, Option<usize>, f64)) {
        self.problem.inequalities[block].expression.coefficients(self.layout, sink);
    }

    fn gradient_bounds(&self, multipliers: &[Multiplier], with_objective: bool) -> Vec<f64> {
        let expressions = self.problem.inequalities.iter().map(|inequality| &inequality.expression);
        // A(Z) − c: the objective is one more block, with a multiplier of −1 when it is minimised.
        let sense = |sense: Sense| Mat::from_fn(1, 1, |_, _| if sense == Sense::Minimize { -1.0 } else { 1.0 });
        let objective = self.problem.objective.as_ref().filter(|_| with_objective);
        let objective = objective.map(|(direction, expression)| (expression, sense(*direction)));
        let blocks = expressions.zip(multipliers.iter().map(|z| &z.matrix));
        let all = blocks.chain(objective.as_ref().map(|(expression, sign)| (*expression, sign)));
        let gradient = Gradient::new(&self.problem.unknowns, all);
        let values = self.layout.scalars(&gradient.values);
        let radii = self.layout.scalars(&gradient.radii);
        values.iter().zip(radii).map(|(value, radius)| 1.001 * (value.abs() + radius)).collect()
    }

    fn strict(&self, block: usize) -> bool {
        self.problem.inequalities[block].margin.is_none()
    }

    fn tolerance(&self, block: usize, spectrum: &Spectrum) -> f64 {
        if self.strict(block) { 0.0 } else { 4.0 * spectrum.rounding }
    }
}
