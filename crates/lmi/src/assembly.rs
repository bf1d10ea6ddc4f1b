//! The Schur complement of all factored blocks together.
//!
//! With `W = [U V]` the entries are sums over the blocks of products of entries of `WᵀPW` and `WᵀZW` (see [`crate::factored`]). A row of a
//! stack is a line of unknowns, those of its places. For two lines, and all their places at once, a block adds
//!
//! ```text
//! (VᵀPu_r)(VᵀZu_p)ᵀ + (VᵀZu_r)(VᵀPu_p)ᵀ + (u_rᵀZu_p) VᵀPV + (u_pᵀPu_r) VᵀZV .
//! ```
//!
//! Blocks that hold the same lines, such as the 2^m vertices of a saturated design, add to the same sum. When all have, the sum is
//! spread over the unknowns, of which a symmetric one has two places.

use crate::aligned::{Aligned, PADDING};
use crate::block::{Block, DenseBlock};
use crate::combination::Combinations;
use crate::dense::axpy;
use crate::factored::{Factored, Group, NO_UNKNOWN};
use crate::vectorized::arch;
use std::collections::HashMap;
use std::ops::Range;

/// Rows and columns that are folded at once: a cache line.
const TILE: usize = PADDING;

/// The scalar unknowns at the places of a row of a stack.
#[derive(Debug)]
struct Line {
    positions: Vec<usize>,
    /// How many run on one after the other, at the beginning.
    run: usize,
}

/// A row of a stack of a block.
#[derive(Clone, Copy, Debug)]
struct Row {
    line: usize,
    group: usize,
    /// Places in W of u and of the first column of V.
    u: usize,
    v: usize,
    weight: f64,
    symmetric: bool,
}

/// One block.
#[derive(Debug, Default)]
struct Part {
    /// Columns of W.
    w: usize,
    wpw: Aligned,
    wzw: Aligned,
}

/// A pair of rows of one block.
#[derive(Debug)]
struct Pair {
    part: usize,
    rows: [Row; 2],
    /// Where the sum of their lines begins.
    sum: usize,
}

/// The sum of two lines.
#[derive(Debug)]
struct Sum {
    line: usize,
    start: usize,
}

/// A line as the first of two, with those from itself on that blocks hold beside it.
#[derive(Debug)]
struct First {
    line: usize,
    sums: Range<usize>,
    pairs: Range<usize>,
    /// Memory of its sums.
    len: usize,
}

/// Everything that assembling takes, memory included.
#[derive(Debug, Default)]
pub(crate) struct Assembly {
    parts: Vec<Part>,
    lines: Vec<Line>,
    firsts: Vec<First>,
    sums: Vec<Sum>,
    pairs: Vec<Pair>,
    memory: Aligned,
    product: Vec<f64>,
    /// Of each block whose unknowns enter in combinations.
    combined: Vec<Option<Box<Combined>>>,
    /// The matrix of the combinations of one block.
    of_combinations: Vec<f64>,
}

/// A block by itself, with the combinations in place of the unknowns.
#[derive(Debug)]
struct Combined {
    assembly: Assembly,
    combinations: Combinations,
}

impl Assembly {
    pub fn new(blocks: &[Block]) -> Self {
        let none = Factored::default();
        let factored = |block| match block {
            &Block::Dense(DenseBlock { ref factored, .. }) => factored,
            Block::Diagonal(_) => &none,
        };
        let all: Vec<&Factored> = blocks.iter().map(factored).collect();
        let combined = |factored: &&Factored| {
            let combinations = factored.combinations()?.clone();
            Some(Box::new(Combined { assembly: Self::of(&[factored]), combinations }))
        };
        let combined: Vec<Option<Box<Combined>>> = all.iter().map(combined).collect();
        let alone = |factored: &Factored| factored.combinations().is_none();
        let of_unknowns: Vec<&Factored> = all.iter().map(|f| if alone(f) { f } else { &none }).collect();
        let longest = combined.iter().flatten().map(|combined| combined.combinations.len).max().unwrap_or(0);
        Self { combined, of_combinations: vec![0.0; longest * longest], ..Self::of(&of_unknowns) }
    }

    /// Of stacks as they are, whatever their positions stand for.
    fn of(blocks: &[&Factored]) -> Self {
        let mut assembly = Self::default();
        let mut rows: Vec<Vec<Row>> = Vec::new();
        let mut known: HashMap<&[usize], usize> = HashMap::new();
        for factored in blocks {
            let mut of_block = Vec::new();
            for (index, group) in factored.groups().iter().enumerate() {
                let &Group { u, v, cols, symmetric, .. } = group;
                for (p, positions) in group.positions.chunks_exact(cols).enumerate() {
                    let line = *known.entry(positions).or_insert_with(|| {
                        assembly.lines.push(Line::new(positions));
                        assembly.lines.len() - 1
                    });
                    of_block.push(Row { line, group: index, u: u + p, v, weight: group.weight(), symmetric });
                }
            }
            rows.push(of_block);
            let w = factored.columns();
            let longest = assembly.product.len().max(factored.size() * w);
            assembly.product.resize(longest, 0.0);
            assembly.parts.push(Part { w, wpw: Aligned::zeros(w * w), wzw: Aligned::zeros(w * w) });
        }
        // Lines come in the order of their unknowns: one after the other, their sums go to neighbouring columns.
        let mut order: Vec<usize> = (0..assembly.lines.len()).collect();
        order.sort_by_key(|&line| assembly.lines[line].first());
        let mut rank = vec![0; order.len()];
        order.iter().enumerate().for_each(|(place, &line)| rank[line] = place);
        let mut holders: Vec<Vec<(usize, usize)>> = vec![Vec::new(); order.len()];
        for (part, rows) in rows.iter().enumerate() {
            rows.iter().enumerate().for_each(|(at, row)| holders[row.line].push((part, at)));
        }
        for &line in &order {
            assembly.add_first(line, &holders[line], &rows, &rank);
        }
        let most = assembly.firsts.iter().map(|first| first.len).max().unwrap_or(0);
        assembly.memory = Aligned::zeros(most);
        assembly
    }

    /// A line with the rows that hold it, as (part, row).
    fn add_first(&mut self, line: usize, holders: &[(usize, usize)], rows: &[Vec<Row>], rank: &[usize]) {
        let later = |row: &&Row| rank[row.line] >= rank[line];
        let beside = |&(part, _): &(usize, usize)| rows[part].iter().filter(later).map(|row| row.line);
        let mut seconds: Vec<usize> = holders.iter().flat_map(beside).collect();
        seconds.sort_unstable_by_key(|&second| rank[second]);
        seconds.dedup();
        let (sums, pairs) = (self.sums.len(), self.pairs.len());
        let cols = self.lines[line].positions.len();
        let mut len = 0;
        for second in seconds {
            self.sums.push(Sum { line: second, start: len });
            len += cols * self.lines[second].width();
        }
        for &(part, at) in holders {
            for row in rows[part].iter().filter(later) {
                let place = self.sums[sums..].binary_search_by_key(&rank[row.line], |sum| rank[sum.line]);
                // Every second line is among the sums.
                let sum = self.sums[sums + place.unwrap_or_default()].start;
                self.pairs.push(Pair { part, rows: [rows[part][at], *row], sum });
            }
        }
        self.firsts.push(First { line, sums: sums..self.sums.len(), pairs: pairs..self.pairs.len(), len });
    }

    /// Takes over P and Z of one block.
    pub fn project(&mut self, block: usize, factored: &Factored, p: &[f64], z: &[f64]) {
        if let Some(combined) = self.combined.get_mut(block).and_then(Option::as_mut) {
            return combined.assembly.project(0, factored, p, z);
        }
        let part = &mut self.parts[block];
        factored.project(p, &mut self.product, &mut part.wpw);
        factored.project(z, &mut self.product, &mut part.wzw);
    }

    /// Adds the sum over all blocks of tr(F_i P F_j Z) to M, lower triangle: entry (i, j), j ≤ i, at `m[i + j·N]`. The upper triangle
    /// is to be zero and is zero again afterwards: each entry first goes to the column of the unknown that it was formed for, where what
    /// is near in memory was touched before.
    pub fn add(&mut self, m: &mut [f64], unknowns: usize) {
        arch().dispatch(Sums { assembly: self, m, unknowns });
        for Combined { assembly, combinations } in self.combined.iter_mut().flatten().map(|combined| &mut **combined) {
            let n = combinations.len;
            let h = &mut self.of_combinations[..n * n];
            h.fill(0.0);
            assembly.add(h, n);
            combinations.spread(h, m, unknowns);
        }
    }
}

impl Line {
    fn new(positions: &[usize]) -> Self {
        let first = positions[0];
        let runs = |(s, at): &(usize, &usize)| first != NO_UNKNOWN && **at == first + s;
        let run = positions.iter().enumerate().take_while(runs).count();
        Self { positions: positions.to_vec(), run }
    }

    /// The first unknown.
    fn first(&self) -> usize {
        self.positions.iter().copied().min().unwrap_or(NO_UNKNOWN)
    }

    /// Places in whole vectors.
    fn width(&self) -> usize {
        self.positions.len().next_multiple_of(PADDING)
    }

    /// Adds entries of one unknown with those of the line, which is another than that of the unknown, to its column of M.
    #[inline(always)]
    fn spread(&self, unknown: usize, entries: &[f64], column: &mut [f64]) {
        let (run, scattered) = entries.split_at(self.run);
        if self.run > 0 {
            let first = self.positions[0];
            axpy(1.0, run, &mut column[first..first + self.run]);
            if (first..first + self.run).contains(&unknown) {
                // As in `add_entries`.
                column[unknown] += run[unknown - first];
            }
        }
        add_entries(column, unknown, &self.positions[self.run..], scattered);
    }
}

/// Adds what the places of two unknowns, not the same, have in common: twice where they belong to one unknown, as each is the first of a pair.
#[inline(always)]
fn add_entries(column: &mut [f64], unknown: usize, positions: &[usize], entries: &[f64]) {
    for (&at, value) in positions.iter().zip(entries).filter(|(at, _)| **at != NO_UNKNOWN) {
        column[at] += if at == unknown { 2.0 * value } else { *value };
    }
}

/// Adds the upper triangle to the lower one and leaves it zero, tile by tile.
#[inline(always)]
fn fold(m: &mut [f64], n: usize) {
    for left in (0..n).step_by(TILE) {
        for top in (left..n).step_by(TILE) {
            for j in left..(left + TILE).min(n) {
                for i in top.max(j + 1)..(top + TILE).min(n) {
                    m[i + j * n] += std::mem::take(&mut m[j + i * n]);
                }
            }
        }
    }
}

/// All sums, one first line after the other.
struct Sums<'a> {
    assembly: &'a mut Assembly,
    m: &'a mut [f64],
    unknowns: usize,
}

impl pulp::WithSimd for Sums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Self { assembly: Assembly { parts, lines, firsts, sums, pairs, memory, .. }, m, unknowns: n } = self;
        for first in firsts.iter() {
            let memory = &mut memory[..first.len];
            memory.fill(0.0);
            let positions = &lines[first.line].positions[..];
            for Pair { part, rows, sum } in &pairs[first.pairs.clone()] {
                let width = lines[rows[1].line].width();
                let sum = &mut memory[*sum..*sum + positions.len() * width];
                add_pair(simd, &parts[*part], *rows, width, sum);
            }
            for Sum { line, start } in &sums[first.sums.clone()] {
                let second = &lines[*line];
                let rows = memory[*start..].chunks_exact(second.width()).zip(positions).enumerate();
                for (q, (entries, &unknown)) in rows.filter(|(_, (_, unknown))| **unknown != NO_UNKNOWN) {
                    let column = &mut m[unknown * n..(unknown + 1) * n];
                    if *line != first.line {
                        second.spread(unknown, &entries[..second.positions.len()], column);
                        continue;
                    }
                    // The sum of a line with itself is symmetric: one half of it, and the diagonal once.
                    column[unknown] += entries[q];
                    add_entries(column, unknown, &positions[..q], entries);
                }
            }
        }
        if !firsts.is_empty() {
            fold(m, n);
        }
    }
}

/// What one block adds to the sum of two lines, row by row with rows of `width`.
#[inline(always)]
fn add_pair<S: pulp::Simd>(simd: S, part: &Part, [p, r]: [Row; 2], width: usize, sum: &mut [f64]) {
    let Part { w, wpw, wzw } = part;
    let row = |u: usize| [&wpw[u * w..(u + 1) * w], &wzw[u * w..(u + 1) * w]];
    let pair = Projected { p, r, stride: w / S::F64_LANES, part: [wpw, wzw], first: row(p.u), second: row(r.u) };
    let vectors = width / S::F64_LANES;
    for first in (0..vectors).step_by(4) {
        match vectors - first {
            1 => pair.add::<S, 1>(simd, first, vectors, sum),
            2 => pair.add::<S, 2>(simd, first, vectors, sum),
            3 => pair.add::<S, 3>(simd, first, vectors, sum),
            _ => pair.add::<S, 4>(simd, first, vectors, sum),
        }
    }
}

/// Two rows with `WᵀPW` and `WᵀZW`, whole and for their columns of U. Rows of W begin with whole vectors.
struct Projected<'a> {
    p: Row,
    r: Row,
    /// Vectors in a row.
    stride: usize,
    part: [&'a [f64]; 2],
    first: [&'a [f64]; 2],
    second: [&'a [f64]; 2],
}

impl Projected<'_> {
    /// N vectors of every row of the sum, from vector `first` on.
    #[inline(always)]
    fn add<S: pulp::Simd, const N: usize>(&self, simd: S, first: usize, vectors: usize, sum: &mut [f64]) {
        let Self { p, r, stride, part, .. } = self;
        let weight = p.weight * r.weight;
        let (sum, _) = S::as_mut_simd_f64s(sum);
        let at = r.v / S::F64_LANES + first;
        let rows = |of: usize| S::as_simd_f64s(&part[of][p.v * stride * S::F64_LANES..]).0.chunks_exact(*stride);
        let sums = sum.chunks_exact_mut(vectors).map(|row| &mut row[first..first + N]);
        if p.symmetric && p.group == r.group {
            let factor = simd.splat_f64s(self.first[0][r.u]);
            for (sum, z) in sums.zip(rows(1)) {
                for (sum, z) in sum.iter_mut().zip(&z[at..at + N]) {
                    *sum = simd.mul_add_e_f64s(factor, *z, *sum);
                }
            }
            return;
        }
        let [of_p, of_z] = [self.first[0][r.u], self.first[1][r.u]].map(|entry| simd.splat_f64s(weight * entry));
        let vector = |of: usize| -> [S::f64s; N] {
            let row = &S::as_simd_f64s(self.first[of]).0[at..at + N];
            std::array::from_fn(|k| simd.mul_f64s(simd.splat_f64s(weight), row[k]))
        };
        let (pv, zv) = (vector(0), vector(1));
        let (left_p, left_z) = (&self.second[0][p.v..], &self.second[1][p.v..]);
        for ((sum, (vpv, vzv)), (a, b)) in sums.zip(rows(0).zip(rows(1))).zip(left_p.iter().zip(left_z)) {
            let (a, b) = (simd.splat_f64s(*a), simd.splat_f64s(*b));
            let (vpv, vzv) = (&vpv[at..at + N], &vzv[at..at + N]);
            for k in 0..N {
                let rank_two = simd.mul_add_e_f64s(a, zv[k], simd.mul_add_e_f64s(b, pv[k], sum[k]));
                sum[k] = simd.mul_add_e_f64s(of_z, vpv[k], simd.mul_add_e_f64s(of_p, vzv[k], rank_two));
            }
        }
    }
}
