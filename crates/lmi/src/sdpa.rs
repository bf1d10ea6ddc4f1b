//! Problems in the SDPA sparse format, `.dat-s`.
//!
//! ```text
//! minimise cᵀx   subject to   F(x) = Σᵢ xᵢ Fᵢ − F₀ ⪰ 0      (F block diagonal)
//! maximise ⟨F₀, Z⟩   subject to   ⟨Fᵢ, Z⟩ = cᵢ,  Z ⪰ 0      (its dual)
//! ```
//!
//! A file holds comment lines (starting with `"` or `*`), the number m of unknowns, the number of blocks, their sizes (a negative one
//! for a diagonal block), the m entries of c, and then lines `i b r s v`: matrix Fᵢ has in block b the entry v at (r, s) and (s, r), all
//! counted from 1 except i, where 0 is F₀. The characters `, ( ) { }` count as space. Repeated entries add up.
//!
//! ```
//! let text = "2 = m\n1 = blocks\n{2}\n1.0, 1.0\n0 1 1 2 1.0\n1 1 1 1 1.0\n2 1 2 2 1.0\n";
//! let problem = lmi::sdpa::read(text.as_bytes())?;
//! // Minimise x₁ + x₂ over [x₁, −1; −1, x₂] ⪰ 0: x₁ = x₂ = 1.
//! let answer = problem.solve(&lmi::Options::default())?;
//! assert!((answer.objective - 2.0).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod reader;
mod writer;

pub use reader::{ReadError, read};
pub use writer::write;

use crate::answer::{Answer, BlockReport, InaccurateReason, Outcome};
use crate::block::{Block, DenseBlock, DiagonalBlock, Program};
use crate::explanation::explain;
use crate::expression::Unknown;
use crate::factored::Factored;
use crate::lowering::{Layout, check_size};
use crate::multiplier::Multiplier;
use crate::report::{Original, Translation, report, verify};
use crate::rigorous::{Enclosure, SumOfProducts};
use crate::sparse::{Entry, Sparse, merge};
use crate::verification::Spectrum;
use crate::{Error, Explanation, Mat, Options, balancing, structure};

/// The shape of one block of F(x).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockShape {
    /// A symmetric matrix with this many rows.
    Symmetric(usize),
    /// A diagonal matrix with this many rows.
    Diagonal(usize),
}

impl BlockShape {
    /// Rows of the block.
    pub fn size(self) -> usize {
        match self {
            Self::Symmetric(size) | Self::Diagonal(size) => size,
        }
    }
}

/// One entry of a coefficient matrix and its mirror image, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficient {
    /// `None` for F₀, otherwise the unknown.
    pub unknown: Option<usize>,
    /// The block.
    pub block: usize,
    /// The row, at most the column.
    pub row: usize,
    /// The column.
    pub column: usize,
    /// The entry.
    pub value: f64,
}

impl Coefficient {
    /// Where the entry stands: on the diagonal once, elsewhere with its mirror image.
    fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let mirrored = (self.row != self.column).then_some((self.column, self.row));
        std::iter::once((self.row, self.column)).chain(mirrored)
    }
}

/// A problem `minimise cᵀx subject to Σ xᵢFᵢ − F₀ ⪰ 0`, coefficient by coefficient.
#[derive(Clone, Debug, PartialEq)]
pub struct Sdp {
    /// c.
    pub objective: Vec<f64>,
    /// The blocks of F(x).
    pub blocks: Vec<BlockShape>,
    /// The entries of F₀, F₁, …, in any order; repeated entries add up.
    pub coefficients: Vec<Coefficient>,
}

impl Sdp {
    /// Solves the problem. The blocks of the answer are named `block 1`, `block 2`, …; its one unknown is the column x.
    ///
    /// [`Options::bound`] bounds the entries of x, as one more block; [`Options::back_off`] has no effect: a file says nothing of which
    /// blocks are to have margins.
    ///
    /// # Errors
    ///
    /// No block; an entry outside its block, off the diagonal of a diagonal block or of an unknown that does not exist; data
    /// that is not finite; an option out of range; too many unknowns.
    pub fn solve(&self, options: &Options) -> Result<Answer, Error> {
        options.check()?;
        self.check()?;
        if let Some(bound) = options.bound {
            return self.bounded(bound).solve(&Options { bound: None, ..options.clone() });
        }
        let m = self.objective.len();
        let unknowns = [Unknown { problem: u64::MAX, index: 0, rows: m, cols: 1, symmetric: false }];
        let layout = Layout::new(&unknowns);
        let margins = vec![0.0; self.blocks.len()];
        let translation = Translation { layout: &layout, unknowns: &unknowns, objective_constant: 0.0, sign: 1.0 };
        let report =
            |(result, balancing)| report(&Stated { sdp: self, options }, &translation, result, balancing, options);
        let answer = report(balancing::solve(self.program(), &margins, options));
        if matches!(answer.outcome, Outcome::Inaccurate(InaccurateReason::NotVerified)) {
            let again = balancing::solve_in_more_digits(self.program(), &margins, options).map(report);
            return Ok(again.unwrap_or(answer));
        }
        Ok(answer)
    }

    /// Proves lower bounds on the smallest eigenvalues of the blocks at any x, whoever found it.
    ///
    /// # Errors
    ///
    /// Those of [`Self::solve`]; an x of another length.
    pub fn verify(&self, x: &[f64]) -> Result<Vec<BlockReport>, Error> {
        self.check()?;
        if x.len() != self.objective.len() {
            return Err(Error::BadPoint { expected: self.objective.len(), given: x.len() });
        }
        let options = Options::default();
        Ok(verify(&Stated { sdp: self, options: &options }, &[Mat::from_fn(x.len(), 1, |i, _| x[i])]).0)
    }

    /// Explains an answer that is [`Outcome::Infeasible`]; `None` for every other one, and where the least
    /// relaxation cannot be found. See [`Problem::explain`](crate::Problem::explain).
    ///
    /// # Errors
    ///
    /// Those of [`Self::solve`].
    pub fn explain(&self, answer: &Answer, options: &Options) -> Result<Option<Explanation>, Error> {
        let names: Vec<String> = answer.blocks.iter().map(|block| block.name.clone()).collect();
        explain(answer, &names, &|relaxed| {
            let mut answer = self.relaxed(relaxed).solve(&Options { bound: None, ..options.clone() })?;
            answer.multipliers.truncate(self.blocks.len());
            Ok(answer)
        })
    }

    /// Minimise t with tI added to some blocks, t ≥ −1.
    fn relaxed(&self, relaxed: &dyn Fn(usize) -> bool) -> Self {
        let mut problem = self.clone();
        let t = self.objective.len();
        problem.objective = vec![0.0; t + 1];
        problem.objective[t] = 1.0;
        for (block, shape) in self.blocks.iter().enumerate().filter(|(block, _)| relaxed(*block)) {
            problem.coefficients.extend((0..shape.size()).map(|row| Coefficient {
                unknown: Some(t),
                block,
                row,
                column: row,
                value: 1.0,
            }));
        }
        let block = problem.blocks.len();
        problem.blocks.push(BlockShape::Diagonal(1));
        for (unknown, value) in [(None, -1.0), (Some(t), 1.0)] {
            problem.coefficients.push(Coefficient { unknown, block, row: 0, column: 0, value });
        }
        problem
    }

    /// With −bound ≤ xᵢ ≤ bound as a last, diagonal block.
    fn bounded(&self, bound: f64) -> Self {
        let mut problem = self.clone();
        let (m, block) = (self.objective.len(), self.blocks.len());
        problem.blocks.push(BlockShape::Diagonal(2 * m));
        for i in 0..m {
            for (row, sign) in [(i, 1.0), (m + i, -1.0)] {
                let entry = |unknown, value| Coefficient { unknown, block, row, column: row, value };
                problem.coefficients.extend([entry(None, -bound), entry(Some(i), sign)]);
            }
        }
        problem
    }

    fn check(&self) -> Result<(), Error> {
        if self.blocks.iter().all(|block| block.size() == 0) {
            return Err(Error::NoConstraint);
        }
        check_size(self.objective.len())?;
        if let Some((row, &value)) = self.objective.iter().enumerate().find(|(_, c)| !c.is_finite()) {
            return Err(Error::NotFinite { place: "the objective".to_owned(), row, column: 0, value });
        }
        for c in &self.coefficients {
            let shape = self.blocks.get(c.block).copied();
            let inside = shape.is_some_and(|shape| match shape {
                BlockShape::Symmetric(n) => c.row < n && c.column < n,
                BlockShape::Diagonal(n) => c.row < n && c.column == c.row,
            });
            if !inside || c.unknown.is_some_and(|unknown| unknown >= self.objective.len()) {
                return Err(Error::BadCoefficient {
                    matrix: c.unknown.map_or(0, |unknown| unknown + 1),
                    block: c.block,
                    row: c.row,
                    column: c.column,
                });
            }
            if !c.value.is_finite() {
                let place = format!("block {} of F{}", c.block + 1, c.unknown.map_or(0, |unknown| unknown + 1));
                return Err(Error::NotFinite { place, row: c.row, column: c.column, value: c.value });
            }
        }
        Ok(())
    }

    /// The solver's form, C = −F₀.
    fn program(&self) -> Program {
        let mut entries: Vec<Vec<Entry>> = vec![Vec::new(); self.blocks.len()];
        let mut constants: Vec<Vec<f64>> = Vec::with_capacity(self.blocks.len());
        for shape in &self.blocks {
            constants.push(match shape {
                BlockShape::Symmetric(n) if *n > 1 => vec![0.0; n * n],
                _ => vec![0.0; shape.size()],
            });
        }
        for c in &self.coefficients {
            let (row, column) = (c.row.max(c.column), c.row.min(c.column));
            match c.unknown {
                Some(unknown) => entries[c.block].push(Entry { unknown, row, column, value: c.value }),
                None => {
                    let (n, constant) = (self.blocks[c.block].size(), &mut constants[c.block]);
                    if constant.len() == n {
                        constant[row] -= c.value;
                    } else {
                        constant[row + column * n] -= c.value;
                        if row != column {
                            constant[column + row * n] -= c.value;
                        }
                    }
                }
            }
        }
        let blocks = self.blocks.iter().zip(entries).zip(constants).map(|((shape, entries), constant)| {
            let size = shape.size();
            if constant.len() == size {
                let mut rows = vec![Vec::new(); size];
                entries.iter().for_each(|e| rows[e.row].push((e.unknown, e.value)));
                return Block::Diagonal(DiagonalBlock::new(constant, rows));
            }
            let coefficients = merge(entries);
            let factored = structure::stacks(size, &coefficients).map(|stacks| Factored::new(size, stacks));
            let (factored, sparse) = match factored {
                Some(factored) if factored.cost() < Sparse::cost(size, &coefficients) => (factored, Sparse::default()),
                _ => (Factored::default(), Sparse::of_coefficients(size, coefficients)),
            };
            Block::Dense(DenseBlock { size, constant, factored, sparse })
        });
        let scale = vec![1.0; self.objective.len()];
        Program {
            objective: self.objective.clone(),
            blocks: blocks.collect(),
            scale,
            omega: 1.0,
            balanced: false,
            warm: None,
        }
    }
}

/// A problem as its coefficients state it.
pub(crate) struct Stated<'a> {
    pub sdp: &'a Sdp,
    pub options: &'a Options,
}

impl Original for Stated<'_> {
    fn blocks(&self) -> Vec<BlockReport> {
        let report = |(index, shape): (usize, &BlockShape)| BlockReport {
            name: format!("block {}", index + 1),
            size: shape.size(),
            smallest_eigenvalue: f64::NAN,
            verified_lower_bound: f64::NEG_INFINITY,
            margin: 0.0,
        };
        self.sdp.blocks.iter().enumerate().map(report).collect()
    }

    fn value(&self, block: usize, values: &[Mat<f64>]) -> Mat<f64> {
        let shape = self.sdp.blocks[block];
        let diagonal = matches!(shape, BlockShape::Diagonal(_));
        let mut value = Mat::zeros(shape.size(), if diagonal { 1 } else { shape.size() });
        for c in self.sdp.coefficients.iter().filter(|c| c.block == block) {
            let term = c.unknown.map_or(-c.value, |unknown| c.value * values[0][(unknown, 0)]);
            c.places().for_each(|(row, column)| value[(row, if diagonal { 0 } else { column })] += term);
        }
        value
    }

    fn enclosure(&self, block: usize, values: &[Mat<f64>]) -> Enclosure {
        self.enclose(block, |unknown| Some(unknown.map_or(-1.0, |unknown| values[0][(unknown, 0)])))
    }

    fn known_product(&self, block: usize, z: &Mat<f64>) -> SumOfProducts {
        let known = self.sdp.coefficients.iter().filter(|c| c.block == block && c.unknown.is_none());
        SumOfProducts::of(known.flat_map(|c| c.places().map(|place| (-c.value, z[place]))))
    }

    fn objective(&self, values: &[Mat<f64>]) -> f64 {
        self.sdp.objective.iter().enumerate().map(|(i, c)| c * values[0][(i, 0)]).sum()
    }

    fn objective_enclosure(&self, values: &[Mat<f64>]) -> (f64, f64) {
        let sum = SumOfProducts::of(self.sdp.objective.iter().enumerate().map(|(i, c)| (*c, values[0][(i, 0)])));
        (sum.value(), sum.error())
    }

    fn slope(&self, direction: &[Mat<f64>]) -> (f64, f64) {
        self.objective_enclosure(direction)
    }

    fn has_objective(&self) -> bool {
        self.sdp.objective.iter().any(|c| *c != 0.0)
    }

    fn in_objective(&self, _: usize) -> Vec<bool> {
        self.sdp.objective.iter().map(|c| *c != 0.0).collect()
    }

    fn change(&self, block: usize, direction: &[Mat<f64>]) -> Enclosure {
        self.enclose(block, |unknown| unknown.map(|unknown| direction[0][(unknown, 0)]))
    }

    fn is_diagonal(&self, block: usize) -> bool {
        matches!(self.sdp.blocks[block], BlockShape::Diagonal(_))
    }

    fn is_homogeneous(&self, block: usize) -> bool {
        !self.sdp.coefficients.iter().any(|c| c.block == block && c.unknown.is_none() && c.value != 0.0)
    }

    fn entries(&self, block: usize, sink: &mut dyn FnMut(usize, usize, Option<usize>, f64)) {
        for c in self.sdp.coefficients.iter().filter(|c| c.block == block && c.value != 0.0) {
            let value = if c.unknown.is_none() { -c.value } else { c.value };
            sink(c.row.max(c.column), c.row.min(c.column), c.unknown, value);
        }
    }

    fn gradient_bounds(&self, multipliers: &[Multiplier], with_objective: bool) -> Vec<f64> {
        let mut gradient = Enclosure::zeros(self.sdp.objective.len(), true);
        let objective = self.sdp.objective.iter().enumerate().filter(|_| with_objective);
        let objective = objective.map(|(k, cost)| (k, k, -1.0, *cost));
        let products = self.sdp.coefficients.iter().filter_map(|c| {
            let (k, count) = (c.unknown?, if c.row == c.column { 1.0 } else { 2.0 });
            Some((k, k, count * c.value, multipliers[c.block].matrix[(c.row, c.column)]))
        });
        gradient.add_products(objective.chain(products));
        gradient.absolute_bounds()
    }

    fn strict(&self, _: usize) -> bool {
        false
    }

    fn tolerance(&self, block: usize, spectrum: &Spectrum) -> f64 {
        let constant = self.sdp.coefficients.iter().filter(|c| c.block == block && c.unknown.is_none());
        let square: f64 = constant.map(|c| c.value * c.value * if c.row == c.column { 1.0 } else { 2.0 }).sum();
        self.options.feasibility_tolerance * (1.0 + square.sqrt()) + spectrum.rounding
    }
}

impl Stated<'_> {
    /// Σ of coefficients times the factors of their unknowns, those without a factor left out.
    fn enclose(&self, block: usize, factor: impl Fn(Option<usize>) -> Option<f64>) -> Enclosure {
        let shape = self.sdp.blocks[block];
        let mut sum = Enclosure::zeros(shape.size(), matches!(shape, BlockShape::Diagonal(_)));
        sum.add_products(self.sdp.coefficients.iter().filter(|c| c.block == block).flat_map(|c| {
            let x = factor(c.unknown);
            c.places().filter_map(move |(row, column)| Some((row, column, c.value, x?)))
        }));
        sum
    }
}
