//! The coefficients of one block, entry by entry, and what the iteration does with them.

use super::matrix::{self, Matrix};
use crate::block::Program;
use crate::double_double::{self as dd, Double};
use crate::vectorized::vectorized;

/// The coefficient matrix of one unknown.
#[derive(Debug)]
struct Coefficient {
    unknown: usize,
    /// (row, column, value) with row ≥ column, no place twice.
    entries: Vec<(usize, usize, Double)>,
    /// Rows with entries, and the entries of the full symmetric matrix as (place among these rows, column, value).
    support: Vec<usize>,
    full: Vec<(usize, usize, Double)>,
}

impl Coefficient {
    fn new(unknown: usize, mut entries: Vec<(usize, usize, Double)>) -> Self {
        entries.sort_by_key(|&(i, j, _)| (j, i));
        entries.dedup_by(|later, earlier| {
            let same = (later.0, later.1) == (earlier.0, earlier.1);
            if same {
                earlier.2 = dd::add(earlier.2, later.2);
            }
            same
        });
        entries.retain(|(_, _, value)| value.h != 0.0);
        let mut support: Vec<usize> = entries.iter().flat_map(|&(i, j, _)| [i, j]).collect();
        support.sort_unstable();
        support.dedup();
        let place = |row: usize| support.partition_point(|&r| r < row);
        let mirrored = |&(i, j, value): &(usize, usize, Double)| {
            let other = (i != j).then(|| (place(j), i, value));
            std::iter::once((place(i), j, value)).chain(other)
        };
        let full = entries.iter().flat_map(mirrored).collect();
        Self { unknown, entries, support, full }
    }
}

/// One block: n × n with its known part and coefficients. Every row of a diagonal block is a block of its own.
#[derive(Debug)]
pub(super) struct Operator {
    pub n: usize,
    pub constant: Matrix,
    coefficients: Vec<Coefficient>,
}

/// Where a block of the program comes to stand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Its first operator, and how many it has become.
    pub first: usize,
    pub count: usize,
}

/// The blocks of a program with the unknowns in its units.
pub(super) fn operators(program: &Program) -> (Vec<Operator>, Vec<Place>) {
    let (mut operators, mut places) = (Vec::new(), Vec::new());
    for block in &program.blocks {
        let size = block.size();
        let (count, n) = if block.is_diagonal() { (size, 1) } else { (1, size) };
        let mut entries: Vec<Vec<(usize, usize, usize, Double)>> = vec![Vec::new(); count];
        block.coefficients(&mut |i, j, unknown, value| {
            if let Some(unknown) = unknown
                && value != 0.0
            {
                let value = Double { h: value * program.scale[unknown], l: 0.0 };
                let (operator, i, j) = if block.is_diagonal() { (i, 0, 0) } else { (0, i, j) };
                entries[operator].push((unknown, i.max(j), i.min(j), value));
            }
        });
        places.push(Place { first: operators.len(), count });
        for (row, mut entries) in entries.into_iter().enumerate() {
            entries.sort_by_key(|e| e.0);
            let of = |group: &[(usize, usize, usize, Double)]| {
                Coefficient::new(group[0].0, group.iter().map(|&(_, i, j, value)| (i, j, value)).collect())
            };
            let coefficients = entries.chunk_by(|a, b| a.0 == b.0).map(of).collect();
            let constant = if block.is_diagonal() { &block.constant()[row..=row] } else { block.constant() };
            operators.push(Operator { n, constant: Matrix::of(constant), coefficients });
        }
    }
    (operators, places)
}

/// Working memory for the rows of the Schur complement.
#[derive(Debug)]
pub(super) struct Workspace {
    of_z: Matrix,
    product: Matrix,
}

impl Operator {
    pub fn workspace(&self) -> Workspace {
        let most = self.coefficients.iter().map(|c| c.support.len()).max().unwrap_or(0);
        Workspace { of_z: Matrix::zeros(most * self.n), product: Matrix::zeros(self.n * self.n) }
    }

    /// Multiplications for the block's part of one Schur complement, about.
    pub fn work(&self) -> f64 {
        let n = self.n as f64;
        let product = |c: &Coefficient| (c.full.len() as f64 + c.support.len() as f64 * n) * n;
        let meets: f64 = self.coefficients.iter().map(|c| c.entries.len() as f64).sum();
        let all: f64 = self.coefficients.iter().map(product).sum();
        all + 4.0 * meets * self.coefficients.len() as f64 + 20.0 * n.powi(3)
    }

    /// out ← out + Σ xᵢFᵢ.
    pub fn apply(&self, x: &Matrix, out: &mut Matrix) {
        apply(&self.coefficients, self.n, x, out);
    }

    /// outᵢ ← outᵢ + factor·⟨Fᵢ, H⟩ for symmetric H.
    pub fn adjoint(&self, factor: f64, h: &Matrix, out: &mut Matrix) {
        adjoint(&self.coefficients, self.n, factor, h, out);
    }

    /// Adds tr(FᵢPFⱼZ) to the lower triangle of the N × N matrix m.
    pub fn schur(&self, p: &Matrix, z: &Matrix, unknowns: usize, m: &mut Matrix, workspace: &mut Workspace) {
        let n = self.n;
        for (at, c) in self.coefficients.iter().enumerate() {
            let Workspace { of_z, product } = workspace;
            of_z.fill_zero();
            for &(place, j, value) in &c.full {
                matrix::add_column(n, value, (z, j), (of_z, place));
            }
            matrix::outer(n, p, &c.support, of_z, product);
            product.symmetrize(n);
            add_row(&self.coefficients[at..], n, product, unknowns, m);
        }
    }
}

// Fused multiplications are instructions only where the instruction set is known.

vectorized! {
    fn apply<'a>(coefficients: &'a [Coefficient], n: usize, x: &'a Matrix, out: &'a mut Matrix) {
        for c in coefficients {
            let x = x.get(c.unknown);
            for &(i, j, value) in &c.entries {
                let term = dd::multiply(value, x);
                out.set(i + j * n, dd::accumulate(out.get(i + j * n), term));
                if i != j {
                    out.set(j + i * n, dd::accumulate(out.get(j + i * n), term));
                }
            }
        }
    }
}

vectorized! {
    fn adjoint<'a>(coefficients: &'a [Coefficient], n: usize, factor: f64, h: &'a Matrix, out: &'a mut Matrix) {
        for c in coefficients {
            let sum = inner(&c.entries, n, h);
            out.set(c.unknown, dd::accumulate(out.get(c.unknown), dd::multiply_by(sum, factor)));
        }
    }
}

vectorized! {
    /// Adds ⟨F, H⟩ for H of the first coefficient and each F to M.
    fn add_row<'a>(coefficients: &'a [Coefficient], n: usize, h: &'a Matrix, unknowns: usize, m: &'a mut Matrix) {
        let unknown = coefficients[0].unknown;
        for other in coefficients {
            let entry = inner(&other.entries, n, h);
            let place = unknown.max(other.unknown) + unknown.min(other.unknown) * unknowns;
            m.set(place, dd::accumulate(m.get(place), entry));
        }
    }
}

/// ⟨F, H⟩ for symmetric H. High and low parts are added up apart, so that no addition waits for more than the one before.
#[inline(always)]
fn inner(entries: &[(usize, usize, Double)], n: usize, h: &Matrix) -> Double {
    let (mut high, mut low) = (0.0, 0.0);
    for &(i, j, value) in entries {
        let factor = if i == j { 1.0 } else { 2.0 };
        let (a, b) = (Double { h: factor * value.h, l: factor * value.l }, h.get(i + j * n));
        let product = dd::two_product(a.h, b.h);
        let sum = dd::two_sum(high, product.h);
        high = sum.h;
        low += sum.l + a.l.mul_add(b.h, a.h.mul_add(b.l, product.l));
    }
    dd::fast_two_sum(high, low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::Assembly;
    use crate::block::{Block, DenseBlock, DiagonalBlock};
    use crate::factored::Factored;
    use crate::sparse::{Entry, Sparse};

    /// Both kinds of blocks, with unknowns in units of their own, against the operators in `f64`.
    #[test]
    fn operators_are_those_of_the_program() {
        let entry = |unknown, row, column, value| Entry { unknown, row, column, value };
        let entries = [entry(0, 0, 0, 1.5), entry(0, 2, 1, -0.5), entry(1, 1, 0, 2.0), entry(2, 2, 2, 1.0)];
        let dense = |entries: Vec<Entry>| {
            let constant = vec![1.0, 0.5, 0.0, 0.5, 2.0, 0.0, 0.0, 0.0, 3.0];
            Block::Dense(DenseBlock {
                size: 3,
                constant,
                factored: Factored::default(),
                sparse: Sparse::new(3, entries),
            })
        };
        let diagonal = DiagonalBlock::new(vec![1.0, -1.0], vec![vec![(0, 2.0), (2, 1.0)], vec![(1, -3.0)]]);
        let program = Program {
            objective: vec![0.0; 3],
            blocks: vec![dense(entries.to_vec()), Block::Diagonal(diagonal)],
            scale: vec![1.0, 4.0, 0.5],
            omega: 1.0,
            balanced: false,
            warm: None,
        };
        let (operators, places) = operators(&program);
        assert_eq!(places.iter().map(|place| (place.first, place.count)).collect::<Vec<_>>(), [(0, 1), (1, 2)]);
        let x = [0.7, -1.25, 2.0];
        let unscaled: Vec<f64> = x.iter().zip(&program.scale).map(|(x, s)| x * s).collect();
        let matrix = |n: usize, seed: usize| -> Vec<f64> {
            let entry = |i: usize, j: usize| {
                ((5 * i.max(j) + 3 * i.min(j) + seed) % 7) as f64 / 4.0 + f64::from(u8::from(i == j))
            };
            (0..n * n).map(|at| entry(at % n, at / n)).collect()
        };
        let mut assembly = Assembly::new(&program.blocks);
        for (index, (block, place)) in program.blocks.iter().zip(&places).enumerate() {
            let mut scratch = block.scratch(3);
            let [p, z] =
                [1, 2].map(|seed| if block.is_diagonal() { matrix(2, seed)[..2].to_vec() } else { matrix(3, seed) });
            let mut value = block.constant().to_vec();
            block.apply(&unscaled, &mut value, &mut scratch);
            let mut adjoint = vec![0.0; 3];
            block.adjoint(1.5, &z, &mut adjoint, &mut scratch);
            let mut schur = vec![0.0; 9];
            block.schur(index, [&p, &z], &mut assembly, &mut schur, 3, &mut scratch);
            let (mut values, mut adjoints, mut m) = (Vec::new(), Matrix::zeros(3), Matrix::zeros(9));
            for (row, operator) in operators[place.first..place.first + place.count].iter().enumerate() {
                let part = |of: &[f64]| Matrix::of(if operator.n == 1 { &of[row..=row] } else { of });
                let mut out = operator.constant.clone();
                operator.apply(&Matrix::of(&x), &mut out);
                values.extend(out.h);
                operator.adjoint(1.5, &part(&z), &mut adjoints);
                operator.schur(&part(&p), &part(&z), 3, &mut m, &mut operator.workspace());
            }
            assert!(values.iter().zip(&value).all(|(a, b)| (a - b).abs() < 1e-14), "{values:?} {value:?}");
            for j in 0..3 {
                let s = &program.scale;
                assert!((adjoints.h[j] - s[j] * adjoint[j]).abs() < 1e-14, "{adjoints:?} {adjoint:?}");
                for i in j..3 {
                    let expected = s[i] * s[j] * schur[i + 3 * j];
                    assert!((m.h[i + 3 * j] - expected).abs() < 1e-13, "{i} {j}: {} {expected}", m.h[i + 3 * j]);
                }
            }
        }
    }
}
