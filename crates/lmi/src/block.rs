//! The solver's form of a problem: minimise cᵀx subject to `F_b(x) = C_b + Σ xᵢ F_{b,i} ⪰ 0`.

use crate::assembly::Assembly;
use crate::factored::{Factored, FactoredScratch};
use crate::interior_point::Centre;
use crate::sparse::{Sparse, SparseScratch};

/// A problem in the solver's form.
#[derive(Debug)]
pub(crate) struct Program {
    /// c.
    pub objective: Vec<f64>,
    pub blocks: Vec<Block>,
    /// Units of the unknowns: the blocks hold the coefficients of xᵢ = sᵢ x̃ᵢ, the objective those of x̃ᵢ.
    pub scale: Vec<f64>,
    /// The objective is this multiple of the one that was stated.
    pub omega: f64,
    pub balanced: bool,
    /// A point of a neighbouring problem to begin at.
    pub warm: Option<Centre>,
}

/// One block F_b.
#[derive(Debug)]
pub(crate) enum Block {
    Dense(DenseBlock),
    Diagonal(DiagonalBlock),
}

/// A block whose value is a full symmetric matrix, stored column by column.
#[derive(Debug)]
pub(crate) struct DenseBlock {
    pub size: usize,
    pub constant: Vec<f64>,
    pub factored: Factored,
    pub sparse: Sparse,
}

/// A block whose value is a diagonal matrix, stored as its diagonal.
#[derive(Debug)]
pub(crate) struct DiagonalBlock {
    pub constant: Vec<f64>,
    /// For each row the (unknown, coefficient) pairs.
    rows: Vec<Vec<(usize, f64)>>,
}

/// Scratch memory of one block's operator.
#[derive(Debug, Default)]
pub(crate) struct OperatorScratch {
    factored: FactoredScratch,
    sparse: SparseScratch,
    mixed: Vec<f64>,
}

impl DiagonalBlock {
    /// From (unknown, coefficient) pairs for each row, in any order; repeated unknowns add up.
    pub fn new(constant: Vec<f64>, mut rows: Vec<Vec<(usize, f64)>>) -> Self {
        for row in &mut rows {
            row.sort_by_key(|(unknown, _)| *unknown);
            row.dedup_by(|later, earlier| {
                let same = later.0 == earlier.0;
                if same {
                    earlier.1 += later.1;
                }
                same
            });
            row.retain(|(_, value)| *value != 0.0);
        }
        Self { constant, rows }
    }
}

impl Block {
    pub fn size(&self) -> usize {
        match self {
            Self::Dense(block) => block.size,
            Self::Diagonal(block) => block.constant.len(),
        }
    }

    /// C_b, column by column or its diagonal alone.
    pub fn constant(&self) -> &[f64] {
        match self {
            Self::Dense(block) => &block.constant,
            Self::Diagonal(block) => &block.constant,
        }
    }

    pub fn is_diagonal(&self) -> bool {
        matches!(self, Self::Diagonal(_))
    }

    pub fn scratch(&self, unknowns: usize) -> OperatorScratch {
        match self {
            Self::Dense(block) => OperatorScratch {
                factored: block.factored.scratch(),
                sparse: block.sparse.scratch(),
                mixed: if block.factored.is_empty() || block.sparse.is_empty() { vec![] } else { vec![0.0; unknowns] },
            },
            Self::Diagonal(_) => OperatorScratch::default(),
        }
    }

    /// out ← out + Σ xᵢ F_i.
    pub fn apply(&self, x: &[f64], out: &mut [f64], scratch: &mut OperatorScratch) {
        match self {
            Self::Dense(block) => {
                block.factored.apply(x, out, &mut scratch.factored);
                block.sparse.apply(x, out);
            }
            Self::Diagonal(block) => {
                for (out, row) in out.iter_mut().zip(&block.rows) {
                    *out += row.iter().map(|&(unknown, value)| value * x[unknown]).sum::<f64>();
                }
            }
        }
    }

    /// out_i ← out_i + factor·⟨F_i, H⟩ for symmetric H.
    pub fn adjoint(&self, factor: f64, h: &[f64], out: &mut [f64], scratch: &mut OperatorScratch) {
        match self {
            Self::Dense(block) => {
                block.factored.adjoint(factor, h, out, &mut scratch.factored);
                block.sparse.adjoint(factor, h, out);
            }
            Self::Diagonal(block) => {
                for (h, row) in h.iter().zip(&block.rows) {
                    row.iter().for_each(|&(unknown, value)| out[unknown] += factor * value * h);
                }
            }
        }
    }

    /// out_i ← max(out_i, ‖D F_i D‖_F) for a diagonal D, the norm estimated for factored blocks.
    pub fn norms(&self, d: &[f64], out: &mut [f64]) {
        match self {
            Self::Dense(block) => {
                block.factored.norms(d, out);
                block.sparse.norms(d, out);
            }
            Self::Diagonal(block) => {
                let mut squares = vec![0.0; out.len()];
                for (row, d) in block.rows.iter().zip(d) {
                    row.iter().for_each(|&(unknown, value)| squares[unknown] += (value * d * d).powi(2));
                }
                out.iter_mut().zip(squares).for_each(|(out, square)| *out = out.max(square.sqrt()));
            }
        }
    }

    /// Visits every coefficient as (row, column, unknown or `None` for C, value), row ≥ column; of factored blocks the products that
    /// make up the coefficients.
    pub fn entries(&self, visit: &mut dyn FnMut(usize, usize, Option<usize>, f64)) {
        match self {
            Self::Dense(block) => {
                let n = block.size;
                for j in 0..n {
                    (j..n).for_each(|i| visit(i, j, None, block.constant[i + j * n]));
                }
                block.factored.entries(visit);
                block.sparse.entries(visit);
            }
            Self::Diagonal(block) => {
                for (i, (constant, row)) in block.constant.iter().zip(&block.rows).enumerate() {
                    visit(i, i, None, *constant);
                    row.iter().for_each(|&(unknown, value)| visit(i, i, Some(unknown), value));
                }
            }
        }
    }

    /// Visits the entries of the coefficient matrices themselves as (row, column, unknown or `None` for C, value), row ≥ column; an entry
    /// may come in parts.
    pub fn coefficients(&self, visit: &mut dyn FnMut(usize, usize, Option<usize>, f64)) {
        let Self::Dense(block) = self else { return self.entries(visit) };
        let n = block.size;
        for j in 0..n {
            (j..n).for_each(|i| visit(i, j, None, block.constant[i + j * n]));
        }
        // U X Vᵀ + V Xᵀ Uᵀ meets the diagonal twice.
        block.factored.entries(&mut |i, j, unknown, value| {
            visit(i, j, unknown, if i == j { 2.0 * value } else { value });
        });
        block.sparse.entries(visit);
    }

    /// F ← F − margin·I.
    pub fn subtract(&mut self, margin: f64) {
        match self {
            Self::Dense(block) => (0..block.size).for_each(|i| block.constant[i + i * block.size] -= margin),
            Self::Diagonal(block) => block.constant.iter_mut().for_each(|c| *c -= margin),
        }
    }

    /// F ← D F D for a diagonal D.
    pub fn scale(&mut self, d: &[f64]) {
        match self {
            Self::Dense(block) => {
                let n = block.size;
                block.constant.iter_mut().enumerate().for_each(|(at, c)| *c *= d[at % n] * d[at / n]);
                block.factored.scale(d);
                block.sparse.scale(d);
            }
            Self::Diagonal(block) => {
                for ((constant, row), d) in block.constant.iter_mut().zip(&mut block.rows).zip(d) {
                    *constant *= d * d;
                    row.iter_mut().for_each(|(_, value)| *value *= d * d);
                }
            }
        }
    }

    /// Adds tr(F_i P F_j Z) to M, lower triangle: entry (i, j), j ≤ i, at `m[i + j·N]`. What is due to the factored part alone is left to
    /// the assembly, which takes over P and Z for that.
    pub fn schur(
        &self,
        index: usize,
        [p, z]: [&[f64]; 2],
        assembly: &mut Assembly,
        m: &mut [f64],
        unknowns: usize,
        scratch: &mut OperatorScratch,
    ) {
        match self {
            Self::Dense(block) => {
                let OperatorScratch { factored, sparse, mixed } = scratch;
                let alone = block.factored.is_empty();
                if !alone {
                    assembly.project(index, &block.factored, p, z);
                }
                let mut meet_factored = |unknown: usize, h: &[f64], m: &mut [f64]| {
                    mixed.fill(0.0);
                    block.factored.adjoint(1.0, h, mixed, factored);
                    for (other, value) in mixed.iter().enumerate() {
                        // An unknown with both a sparse and a factored part meets itself from both sides.
                        let value = if other == unknown { 2.0 * value } else { *value };
                        m[other.max(unknown) + other.min(unknown) * unknowns] += value;
                    }
                };
                let mixed = (!alone).then_some(&mut meet_factored as crate::sparse::Mixed<'_>);
                block.sparse.schur(p, z, m, unknowns, sparse, mixed);
            }
            Self::Diagonal(block) => {
                for ((p, z), row) in p.iter().zip(z).zip(&block.rows) {
                    for (at, &(low, a)) in row.iter().enumerate() {
                        for &(high, b) in &row[at..] {
                            m[high + low * unknowns] += a * b * p * z;
                        }
                    }
                }
            }
        }
    }
}
