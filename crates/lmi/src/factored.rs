//! Blocks in factored form: `F(x) = Σ_g (U_g X_g V_gᵀ + V_g X_gᵀ U_gᵀ)` with sparse columns in U and V.
//!
//! The scalar unknown at entry (p, q) of a stack X has the coefficient `u_p v_qᵀ + v_q u_pᵀ`. For symmetric P = S⁻¹ and Z its Schur
//! complement entries are
//!
//! ```text
//! tr(F_pq P F_rs Z) = (v_qᵀPu_r)(v_sᵀZu_p) + (v_qᵀPv_s)(u_rᵀZu_p) + (u_pᵀPu_r)(v_sᵀZv_q) + (u_pᵀPv_s)(u_rᵀZv_q),
//! ```
//!
//! entries of the small matrices `WᵀPW` and `WᵀZW`, W = [U V]: for two rows p and r of stacks and all q and s together the sum of two
//! matrices of rank one and of multiples of `VᵀPV` and `VᵀZV`, whatever the size of the block.
//!
//! Of `V X Vᵀ` with a symmetric X (U = ½V: the unknown itself in a corner of the block, or a congruence of it) the entries (p, q) and
//! (q, p) are one unknown, and so are (r, s) and (s, r). Summed over these four pairs the terms are the same, so that the third
//! alone, `(v_pᵀPv_r)(v_qᵀZv_s)`, does for all.

use crate::aligned::PADDING;
use crate::combination::Combinations;
use crate::dense::axpy;
use crate::sparse::Entry;
use crate::vectorized::vectorized;

/// In place of a scalar unknown where a stack has a zero.
pub(crate) const NO_UNKNOWN: usize = usize::MAX;

/// One stack before compilation: columns of U and V, and for entry (r, s) of X the scalar unknown `positions[r·|V| + s]`
/// (or [`NO_UNKNOWN`]).
#[derive(Debug)]
pub(crate) struct Stack {
    pub u: Vec<Vec<f64>>,
    pub v: Vec<Vec<f64>>,
    pub positions: Vec<usize>,
}

impl Stack {
    /// Rows in the order of their last unknowns, falling: those that a row of the lower triangle of M does not reach come last.
    fn by_last_unknown(&self) -> Self {
        let cols = self.v.len();
        let row = |r: usize| &self.positions[r * cols..(r + 1) * cols];
        let last = |r: usize| row(r).iter().copied().filter(|&at| at != NO_UNKNOWN).max();
        let mut order: Vec<usize> = (0..self.u.len()).collect();
        order.sort_by_key(|&r| std::cmp::Reverse(last(r)));
        self.of_rows(&order)
    }

    /// The row of U that is half of each column of V, where there is one for each and X is symmetric between them.
    fn mirrored(&self) -> Option<Vec<usize>> {
        let cols = self.v.len();
        let half = |u: &[f64], v: &[f64]| u.iter().zip(v).all(|(u, v)| *u == 0.5 * v);
        let row = |v: &Vec<f64>| self.u.iter().position(|u| half(u, v));
        let rows: Vec<usize> = self.v.iter().map(row).collect::<Option<_>>()?;
        let position = |s: usize, t: usize| self.positions[rows[s] * cols + t];
        (0..cols).all(|s| (0..s).all(|t| rows[s] != rows[t] && position(s, t) == position(t, s))).then_some(rows)
    }

    /// The stack of some of the rows.
    fn of_rows(&self, rows: &[usize]) -> Self {
        let cols = self.v.len();
        let u = rows.iter().map(|&r| self.u[r].clone()).collect();
        let positions = rows.iter().flat_map(|&r| self.positions[r * cols..(r + 1) * cols].iter().copied()).collect();
        Self { u, v: self.v.clone(), positions }
    }
}

/// Sparse columns.
#[derive(Debug, Default)]
struct Columns {
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl Columns {
    fn push(&mut self, column: &[f64]) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        self.entries.extend(column.iter().copied().enumerate().filter(|(_, value)| *value != 0.0));
        self.starts.push(self.entries.len());
    }

    /// Adds columns, and empty ones up to a multiple of [`PADDING`]; gives the place of the first one.
    fn push_whole_vectors(&mut self, columns: &[Vec<f64>]) -> usize {
        let first = self.len();
        columns.iter().for_each(|column| self.push(column));
        (columns.len()..columns.len().next_multiple_of(PADDING)).for_each(|_| self.push(&[]));
        first
    }

    fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    fn column(&self, j: usize) -> &[(usize, f64)] {
        &self.entries[self.starts[j]..self.starts[j + 1]]
    }
}

/// A stack: U is columns `u..u + rows` of W, V is columns `v..v + cols`; of a symmetric one U is half of V.
#[derive(Debug)]
pub(crate) struct Group {
    pub u: usize,
    pub rows: usize,
    pub v: usize,
    pub cols: usize,
    pub positions: Vec<usize>,
    pub symmetric: bool,
    /// The entries of the coefficients, where U and V have one in each column at most; otherwise none.
    entries: Vec<Entry>,
}

impl Group {
    fn new(w: &Columns, u: usize, v: usize, stack: Stack, symmetric: bool) -> Self {
        let (rows, cols) = (stack.u.len(), stack.v.len());
        let mut group = Self { u, rows, v, cols, positions: stack.positions, symmetric, entries: Vec::new() };
        if (u..u + rows).chain(v..v + cols).all(|j| w.column(j).len() <= 1) {
            group.entries = group.single_entries(w);
        }
        group
    }

    fn single_entries(&self, w: &Columns) -> Vec<Entry> {
        let places = self.positions.iter().enumerate().filter(|(_, at)| **at != NO_UNKNOWN);
        let entry = |(at, &unknown): (usize, &usize)| {
            let (r, s) = (at / self.cols, at % self.cols);
            // Of a symmetric unknown one of two places speaks for both.
            if self.symmetric && r < s {
                return None;
            }
            let (&(i, a), &(j, b)) = (w.column(self.u + r).first()?, w.column(self.v + s).first()?);
            let value = if i == j && !self.symmetric { 2.0 * a * b } else { a * b };
            Some(Entry { unknown, row: i.max(j), column: i.min(j), value })
        };
        places.filter_map(entry).collect()
    }

    /// What the columns of W that are taken for U are multiplied by.
    pub fn weight(&self) -> f64 {
        if self.symmetric { 0.5 } else { 1.0 }
    }
}

/// The factored part of a block.
#[derive(Debug, Default)]
pub(crate) struct Factored {
    n: usize,
    w: Columns,
    groups: Vec<Group>,
    /// What the groups hold in place of the unknowns, where these enter in combinations.
    combinations: Option<Combinations>,
}

/// Scratch memory of one block's factored part, reused in every iteration.
#[derive(Debug, Default)]
pub(crate) struct FactoredScratch {
    product: Vec<f64>,
    /// Of the combinations.
    combined: Vec<f64>,
}

impl Factored {
    pub fn new(n: usize, stacks: Vec<Stack>) -> Self {
        let mut w = Columns::default();
        let mut groups = Vec::new();
        for stack in &stacks {
            let mut v = None;
            let mut columns_of_v = |w: &mut Columns| *v.get_or_insert_with(|| w.push_whole_vectors(&stack.v));
            let mirrored = stack.mirrored();
            if let Some(rows_of_v) = &mirrored {
                let v = columns_of_v(&mut w);
                groups.push(Group::new(&w, v, v, stack.of_rows(rows_of_v), true));
            }
            let left = |r: &usize| mirrored.as_ref().is_none_or(|rows| !rows.contains(r));
            let rest: Vec<usize> = (0..stack.u.len()).filter(left).collect();
            if !rest.is_empty() {
                let rest = stack.of_rows(&rest).by_last_unknown();
                let v = columns_of_v(&mut w);
                let u = w.push_whole_vectors(&rest.u);
                groups.push(Group::new(&w, u, v, rest, false));
            }
        }
        Self { n, w, groups, combinations: None }
    }

    /// Of stacks whose positions are those of scalars of combinations.
    pub fn of_combinations(n: usize, stacks: Vec<Stack>, combinations: Option<Combinations>) -> Self {
        Self { combinations, ..Self::new(n, stacks) }
    }

    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Operations that a Schur complement takes, roughly; those on whole columns and rows counted by vectors of about six.
    pub fn cost(&self) -> usize {
        let (n, w, filled) = (self.n, self.w.len(), self.w.entries.len());
        let projection = filled * n / 6 + filled * w / 2;
        let entries: usize = self.groups.iter().map(|g| g.rows * g.cols.next_multiple_of(PADDING)).sum();
        let entries_of_symmetric = |g: &Group| if g.symmetric { g.rows * g.cols } else { 0 };
        let easy: usize = self.groups.iter().map(|g| entries_of_symmetric(g).pow(2)).sum();
        // Half of all pairs of entries: their products, and the spreading of the sums, which is shared with other blocks.
        2 * projection + (4 * entries.pow(2) - 3 * easy) / 12 + entries.pow(2) / 8
    }

    pub fn scratch(&self) -> FactoredScratch {
        let widest = self.groups.iter().map(|g| g.cols).max().unwrap_or(0);
        let combined = vec![0.0; self.combinations.as_ref().map_or(0, |combinations| combinations.len)];
        FactoredScratch { product: vec![0.0; self.n * widest.max(1)], combined }
    }

    /// Rows of the block.
    pub fn size(&self) -> usize {
        self.n
    }

    /// Columns of W.
    pub fn columns(&self) -> usize {
        self.w.len()
    }

    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// What the groups hold in place of the unknowns, where these enter in combinations.
    pub fn combinations(&self) -> Option<&Combinations> {
        self.combinations.as_ref()
    }

    /// WᵀHW for symmetric H, row by row; what belongs to empty columns is left as it is.
    pub fn project(&self, h: &[f64], product: &mut [f64], out: &mut [f64]) {
        project(self.n, &self.w, h, &mut product[..self.n * self.w.len()], out);
    }

    /// out ← out + F(x) − F(0).
    pub fn apply(&self, x: &[f64], out: &mut [f64], scratch: &mut FactoredScratch) {
        let FactoredScratch { product, combined } = scratch;
        let x = match &self.combinations {
            Some(combinations) => {
                combinations.gather(x, combined);
                combined
            }
            None => x,
        };
        for group in &self.groups {
            if group.entries.is_empty() {
                apply(self.n, &self.w, group, x, product, out);
            }
            group.entries.iter().for_each(|entry| entry.apply(self.n, x, out));
        }
    }

    /// out_i ← out_i + factor·⟨F_i, H⟩ for symmetric H.
    pub fn adjoint(&self, factor: f64, h: &[f64], out: &mut [f64], scratch: &mut FactoredScratch) {
        let FactoredScratch { product, combined } = scratch;
        match &self.combinations {
            Some(combinations) => {
                combined.fill(0.0);
                self.adjoint_of_groups(factor, h, combined, product);
                combinations.scatter(combined, out);
            }
            None => self.adjoint_of_groups(factor, h, out, product),
        }
    }

    fn adjoint_of_groups(&self, factor: f64, h: &[f64], out: &mut [f64], product: &mut [f64]) {
        for group in &self.groups {
            if group.entries.is_empty() {
                adjoint(self.n, &self.w, group, factor, h, product, out);
            }
            group.entries.iter().for_each(|entry| out[entry.unknown] += factor * entry.inner_product(self.n, h));
        }
    }

    /// Visits the products u_i v_j that make up the coefficients as (row, column, unknown, value), row ≥ column.
    pub fn entries(&self, visit: &mut dyn FnMut(usize, usize, Option<usize>, f64)) {
        for group in &self.groups {
            for (at, &position) in group.positions.iter().enumerate().filter(|(_, at)| **at != NO_UNKNOWN) {
                for &(i, u) in self.w.column(group.u + at / group.cols) {
                    for &(j, v) in self.w.column(group.v + at % group.cols) {
                        let value = group.weight() * u * v;
                        self.each_unknown(position, |at, factor| visit(i.max(j), i.min(j), Some(at), factor * value));
                    }
                }
            }
        }
    }

    /// F ← D F D for a diagonal D.
    pub fn scale(&mut self, d: &[f64]) {
        self.w.entries.iter_mut().for_each(|(i, value)| *value *= d[*i]);
        let entries = self.groups.iter_mut().flat_map(|group| &mut group.entries);
        entries.for_each(|entry| entry.value *= d[entry.row] * d[entry.column]);
    }

    /// out_i ← max(out_i, estimate of ‖D F_i D‖_F) for a diagonal D.
    pub fn norms(&self, d: &[f64], out: &mut [f64]) {
        let length = |j: usize| self.w.column(j).iter().map(|&(i, v)| (v * d[i]).powi(2)).sum::<f64>().sqrt();
        let lengths: Vec<f64> = (0..self.w.len()).map(length).collect();
        for group in &self.groups {
            for r in 0..group.rows {
                for s in (0..group.cols).filter(|s| group.positions[r * group.cols + s] != NO_UNKNOWN) {
                    let norm = 2.0_f64.sqrt() * group.weight() * lengths[group.u + r] * lengths[group.v + s];
                    self.each_unknown(group.positions[r * group.cols + s], |at, factor| {
                        out[at] = out[at].max(factor.abs() * norm);
                    });
                }
            }
        }
    }

    /// The unknowns behind a position of a group, with their factors.
    fn each_unknown(&self, position: usize, mut visit: impl FnMut(usize, f64)) {
        match &self.combinations {
            Some(combinations) => combinations.unknowns(position).for_each(|(at, factor)| visit(at, factor)),
            None => visit(position, 1.0),
        }
    }
}

vectorized! {
    /// out ← out + U X Vᵀ + V Xᵀ Uᵀ of one group.
    fn apply<'a>(
        n: usize,
        w: &'a Columns,
        group: &'a Group,
        x: &'a [f64],
        product: &'a mut [f64],
        out: &'a mut [f64],
    ) {
        let t = &mut product[..n * group.cols];
        t.fill(0.0);
        for r in 0..group.rows {
            for &(i, value) in w.column(group.u + r) {
                let value = group.weight() * value;
                let positions = &group.positions[r * group.cols..(r + 1) * group.cols];
                for (s, position) in positions.iter().enumerate() {
                    if *position != NO_UNKNOWN {
                        t[i + s * n] += value * x[*position];
                    }
                }
            }
        }
        for (s, t) in t.chunks_exact(n).enumerate() {
            for &(i, value) in w.column(group.v + s) {
                axpy(value, t, &mut out[i * n..(i + 1) * n]);
                for (k, t) in t.iter().enumerate() {
                    out[i + k * n] += value * t;
                }
            }
        }
    }
}

vectorized! {
    /// out_i ← out_i + factor·⟨F_i, H⟩ over one group.
    fn adjoint<'a>(
        n: usize,
        w: &'a Columns,
        group: &'a Group,
        factor: f64,
        h: &'a [f64],
        product: &'a mut [f64],
        out: &'a mut [f64],
    ) {
        let hv = &mut product[..n];
        for s in 0..group.cols {
            hv.fill(0.0);
            for &(i, value) in w.column(group.v + s) {
                axpy(2.0 * factor * group.weight() * value, &h[i * n..(i + 1) * n], hv);
            }
            for r in 0..group.rows {
                let at = group.positions[r * group.cols + s];
                if at == NO_UNKNOWN {
                    continue;
                }
                let inner: f64 = w.column(group.u + r).iter().map(|&(i, value)| value * hv[i]).sum();
                out[at] += inner;
            }
        }
    }
}

vectorized! {
    /// WᵀHW for symmetric H.
    fn project<'a>(n: usize, w: &'a Columns, h: &'a [f64], product: &'a mut [f64], out: &'a mut [f64]) {
        let count = w.len();
        for (j, hw) in product.chunks_exact_mut(n).enumerate().filter(|(j, _)| !w.column(*j).is_empty()) {
            hw.fill(0.0);
            for &(i, value) in w.column(j) {
                axpy(value, &h[i * n..(i + 1) * n], hw);
            }
            for k in 0..=j {
                let inner: f64 = w.column(k).iter().map(|&(i, value)| value * hw[i]).sum();
                out[k + j * count] = inner;
                out[j + k * count] = inner;
            }
        }
    }
}
