//! The Schur complement of all factored blocks together.
//!
//! With `W = [U V]` the entries are sums over the blocks of products of entries of `WᵀPW` and `WᵀZW` (see [`crate::factored`]). One row
//! of the Schur complement is gone through block by block, as a sum of outer products over the places of the stacks; blocks whose
//! stacks hold the same row of a matrix unknown, such as the 2^m vertices of a saturated design, add to the same line, and each line
//! is spread over the unknowns once.

use crate::block::Block;
use crate::dense::axpy;
use crate::factored::{Factored, NO_UNKNOWN, PADDING};
use std::collections::HashMap;
use std::ops::Range;

/// A row of a stack, as blocks share it: the scalar unknowns at its places.
#[derive(Debug)]
struct Line {
    positions: Vec<usize>,
    /// The first one, where they run on one after the other.
    run: Option<usize>,
    last: usize,
    /// Where its sum begins.
    start: usize,
}

/// A stack of a block: columns `u..` and `v..` of W, and for each row where its line's sum begins.
#[derive(Debug)]
struct Target {
    u: usize,
    v: usize,
    width: usize,
    starts: Vec<usize>,
    /// The last unknown among each [`PADDING`] columns of each row.
    lasts: Vec<Vec<usize>>,
}

/// One block.
#[derive(Debug, Default)]
struct Part {
    /// Columns of W.
    w: usize,
    targets: Vec<Target>,
    wpw: Vec<f64>,
    wzw: Vec<f64>,
}

/// The places of a scalar unknown in one stack of a block: one, or two of a symmetric unknown.
#[derive(Debug)]
struct Source {
    part: usize,
    /// Where the rows of `WᵀPW` for u and v begin.
    places: [(usize, usize); 2],
    count: usize,
}

/// A row of the Schur complement.
#[derive(Debug)]
struct Row {
    unknown: usize,
    sources: Range<usize>,
    lines: Range<usize>,
}

/// Everything that assembling takes, memory included.
#[derive(Debug, Default)]
pub(crate) struct Assembly {
    parts: Vec<Part>,
    lines: Vec<Line>,
    rows: Vec<Row>,
    sources: Vec<Source>,
    /// The lines that each row reaches.
    reached: Vec<usize>,
    sums: Vec<f64>,
    product: Vec<f64>,
}

impl Assembly {
    pub fn new(blocks: &[Block]) -> Self {
        let factored: Vec<Option<&Factored>> = blocks
            .iter()
            .map(|block| match block {
                Block::Dense(block) if !block.factored.is_empty() => Some(&block.factored),
                _ => None,
            })
            .collect();
        let mut assembly = Self::default();
        let mut known: HashMap<&[usize], usize> = HashMap::new();
        let mut sources: Vec<(usize, Source)> = Vec::new();
        let mut lines_of: Vec<Vec<usize>> = Vec::new();
        for (index, factored) in factored.iter().enumerate() {
            let Some(factored) = factored else {
                assembly.parts.push(Part::default());
                lines_of.push(Vec::new());
                continue;
            };
            let w = factored.columns();
            let (mut targets, mut own) = (Vec::new(), Vec::new());
            for group in factored.groups() {
                let width = group.cols.next_multiple_of(PADDING);
                let mut starts = Vec::with_capacity(group.rows);
                let mut lasts = vec![Vec::with_capacity(group.rows); width / PADDING];
                for positions in group.positions.chunks_exact(group.cols) {
                    let lines = &mut assembly.lines;
                    let line = *known.entry(positions).or_insert_with(|| {
                        let start =
                            lines.last().map_or(0, |l: &Line| l.start + l.positions.len().next_multiple_of(PADDING));
                        lines.push(Line::new(positions, start));
                        lines.len() - 1
                    });
                    starts.push(assembly.lines[line].start);
                    for (lasts, positions) in lasts.iter_mut().zip(positions.chunks(PADDING)) {
                        lasts.push(last(positions));
                    }
                    own.push(line);
                }
                targets.push(Target { u: group.u, v: group.v, width, starts, lasts });
            }
            for row in factored.rows() {
                let g = &factored.groups()[row.group];
                let places = row.entries.map(|(p, q)| ((g.u + p) * w, (g.v + q) * w));
                sources.push((row.position, Source { part: index, places, count: row.count }));
            }
            let square = || vec![0.0; w * w + PADDING];
            assembly.parts.push(Part { w, targets, wpw: square(), wzw: square() });
            lines_of.push(own);
        }
        let longest = |of: &dyn Fn(&Factored) -> usize| factored.iter().flatten().map(|f| of(f)).max().unwrap_or(0);
        assembly.product = vec![0.0; longest(&|f| f.size() * f.columns())];
        assembly.sums = vec![0.0; assembly.lines.iter().map(|l| l.positions.len().next_multiple_of(PADDING)).sum()];
        sources.sort_by_key(|(unknown, source)| (*unknown, source.part));
        for group in sources.chunk_by(|a, b| a.0 == b.0) {
            let unknown = group[0].0;
            let mut lines: Vec<usize> = group.iter().flat_map(|(_, s)| lines_of[s.part].iter().copied()).collect();
            lines.sort_unstable();
            lines.dedup();
            lines.retain(|&line| assembly.lines[line].last >= unknown);
            let (first, reached) = (assembly.rows.last().map_or(0, |r| r.sources.end), assembly.reached.len());
            assembly.reached.extend(lines);
            let row = Row { unknown, sources: first..first + group.len(), lines: reached..assembly.reached.len() };
            assembly.rows.push(row);
        }
        assembly.sources = sources.into_iter().map(|(_, source)| source).collect();
        assembly
    }

    /// Takes over P and Z of one block.
    pub fn project(&mut self, block: usize, factored: &Factored, p: &[f64], z: &[f64]) {
        let part = &mut self.parts[block];
        factored.project(p, &mut self.product, &mut part.wpw);
        factored.project(z, &mut self.product, &mut part.wzw);
    }

    /// M ← M + Σ tr(F_i P F_j Z) over the blocks taken over, lower triangle (j ≤ i stored at `m[i + j·N]`).
    pub fn add(&mut self, m: &mut [f64], unknowns: usize) {
        pulp::Arch::new().dispatch(Rows { assembly: self, m, unknowns });
    }
}

impl Line {
    fn new(positions: &[usize], start: usize) -> Self {
        let first = positions[0];
        let runs = first != NO_UNKNOWN && positions.iter().enumerate().all(|(s, &at)| at == first + s);
        Self { positions: positions.to_vec(), run: runs.then_some(first), last: last(positions), start }
    }

    /// Adds the entries of the sum from `unknown` on to a row of the Schur complement.
    #[inline(always)]
    fn spread(&self, sum: &[f64], unknown: usize, target: &mut [f64]) {
        if let Some(first) = self.run {
            let skip = unknown.saturating_sub(first);
            let end = first + self.positions.len();
            axpy(1.0, &sum[skip..self.positions.len()], &mut target[first + skip..end]);
            return;
        }
        for (&at, value) in self.positions.iter().zip(sum) {
            if at >= unknown && at != NO_UNKNOWN {
                target[at] += value;
            }
        }
    }
}

/// The last unknown.
fn last(positions: &[usize]) -> usize {
    positions.iter().copied().filter(|&at| at != NO_UNKNOWN).max().unwrap_or(0)
}

/// All rows.
struct Rows<'a> {
    assembly: &'a mut Assembly,
    m: &'a mut [f64],
    unknowns: usize,
}

impl pulp::WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Assembly { parts, lines, rows, sources, reached, sums, .. } = self.assembly;
        for row in rows.iter() {
            let reached = &reached[row.lines.clone()];
            for &line in reached {
                let line = &lines[line];
                sums[line.start..line.start + line.positions.len().next_multiple_of(PADDING)].fill(0.0);
            }
            for source in &sources[row.sources.clone()] {
                let Part { w, targets, wpw, wzw } = &parts[source.part];
                // (v_qᵀPu_r)(v_sᵀZu_p) + (v_qᵀPv_s)(u_rᵀZu_p) + (u_pᵀPu_r)(v_sᵀZv_q) + (u_pᵀPv_s)(u_rᵀZv_q)
                let line = |of: &'_ [f64], at: usize| -> Range<usize> { at..(at + w + PADDING).min(of.len()) };
                let terms = |(u, v): (usize, usize)| {
                    let [pu, pv] = [u, v].map(|at| &wpw[line(wpw, at)]);
                    let [zu, zv] = [u, v].map(|at| &wzw[line(wzw, at)]);
                    [(pv, zu), (zu, pv), (pu, zv), (zv, pu)]
                };
                let first = terms(source.places[0]);
                if source.count == 1 {
                    targets.iter().for_each(|target| outer_products(simd, target, row.unknown, first, sums));
                } else {
                    let [a, b, c, d] = first;
                    let [e, f, g, h] = terms(source.places[1]);
                    let all = [a, b, c, d, e, f, g, h];
                    targets.iter().for_each(|target| outer_products(simd, target, row.unknown, all, sums));
                }
            }
            let target = &mut self.m[row.unknown * self.unknowns..(row.unknown + 1) * self.unknowns];
            for &line in reached {
                let line = &lines[line];
                line.spread(&sums[line.start..], row.unknown, target);
            }
        }
    }
}

/// sums ← sums + Σ_k left_k[u + r] · right_k[v..] for every row r with unknowns from `unknown` on. Rows come with falling last
/// unknowns; where their columns do not, a little too much is computed.
#[inline(always)]
fn outer_products<S: pulp::Simd, const K: usize>(
    simd: S,
    target: &Target,
    unknown: usize,
    terms: [(&[f64], &[f64]); K],
    sums: &mut [f64],
) {
    let rows = target.starts.len();
    let lefts = terms.map(|(left, _)| &left[target.u..target.u + rows]);
    let rights = terms.map(|(_, right)| S::as_simd_f64s(&right[target.v..target.v + target.width]).0);
    for c in 0..target.width / S::F64_LANES {
        let lasts = &target.lasts[c * S::F64_LANES / PADDING];
        let rows = rows - lasts.iter().rev().take_while(|&&last| last < unknown).count();
        let right: [S::f64s; K] = std::array::from_fn(|k| rights[k][c]);
        for (r, &start) in target.starts[..rows].iter().enumerate() {
            let (sum, _) = S::as_mut_simd_f64s(&mut sums[start + c * S::F64_LANES..start + (c + 1) * S::F64_LANES]);
            let mut total = sum[0];
            for k in 0..K {
                total = simd.mul_add_e_f64s(simd.splat_f64s(lefts[k][r]), right[k], total);
            }
            sum[0] = total;
        }
    }
}
