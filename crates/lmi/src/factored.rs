//! Blocks in factored form: `F(x) = Σ_g (U_g X_g V_gᵀ + V_g X_gᵀ U_gᵀ)` with sparse columns in U and V.
//!
//! The scalar unknown at entry (p, q) of a stack X has the coefficient `u_p v_qᵀ + v_q u_pᵀ`. For symmetric P = S⁻¹ and Z its Schur
//! complement entries are
//!
//! ```text
//! tr(F_pq P F_rs Z) = (v_qᵀPu_r)(v_sᵀZu_p) + (v_qᵀPv_s)(u_rᵀZu_p) + (u_pᵀPu_r)(v_sᵀZv_q) + (u_pᵀPv_s)(u_rᵀZv_q),
//! ```
//!
//! entries of the small matrices `WᵀPW` and `WᵀZW`, W = [U V]: one row of the Schur complement is a sum of four outer products,
//! whatever the size of the block.

use crate::dense::axpy;
use crate::vectorized::vectorized;
use std::collections::HashMap;

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

    fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    fn column(&self, j: usize) -> &[(usize, f64)] {
        &self.entries[self.starts[j]..self.starts[j + 1]]
    }
}

/// A stack: U is columns `u..u + rows` of W, V is columns `v..v + cols`.
#[derive(Debug)]
struct Group {
    u: usize,
    rows: usize,
    v: usize,
    cols: usize,
    positions: Vec<usize>,
    places: Vec<Places>,
}

/// Where the entries of one row of X stand among the unknowns.
#[derive(Clone, Copy, Debug)]
enum Places {
    /// One after the other, from here.
    Run(usize),
    /// Anywhere up to here.
    Scattered(usize),
}

impl Places {
    fn of(positions: &[usize]) -> Self {
        let first = positions[0];
        if first != NO_UNKNOWN && positions.iter().enumerate().all(|(s, &position)| position == first + s) {
            return Self::Run(first);
        }
        Self::Scattered(positions.iter().copied().filter(|&at| at != NO_UNKNOWN).max().unwrap_or(0))
    }

    fn last(self, cols: usize) -> usize {
        match self {
            Self::Run(first) => first + cols - 1,
            Self::Scattered(last) => last,
        }
    }
}

/// A row of the Schur complement that a group contributes to: the entries of X that are one scalar unknown
/// (two for a symmetric unknown off the diagonal).
#[derive(Debug)]
struct Row {
    position: usize,
    group: usize,
    entries: [(usize, usize); 2],
    count: usize,
}

/// The factored part of a block.
#[derive(Debug, Default)]
pub(crate) struct Factored {
    n: usize,
    w: Columns,
    groups: Vec<Group>,
    rows: Vec<Row>,
}

/// Rows are padded to a multiple of this, at least the widest vector register.
const PADDING: usize = 8;

/// Scratch memory of one block's factored part, reused in every iteration.
#[derive(Debug, Default)]
pub(crate) struct FactoredScratch {
    product: Vec<f64>,
    wpw: Vec<f64>,
    wzw: Vec<f64>,
    /// The two sides of a sum of outer products, and the sum.
    factors: Vec<f64>,
    lines: Vec<f64>,
    sum: Vec<f64>,
}

impl Factored {
    pub fn new(n: usize, stacks: Vec<Stack>) -> Self {
        let mut w = Columns::default();
        let mut groups = Vec::new();
        let mut rows: Vec<Row> = Vec::new();
        for stack in stacks {
            let (u, count) = (w.len(), stack.u.len());
            stack.u.iter().for_each(|column| w.push(column));
            let (v, cols) = (w.len(), stack.v.len());
            stack.v.iter().for_each(|column| w.push(column));
            let mut seen: HashMap<usize, usize> = HashMap::new();
            for (at, &position) in stack.positions.iter().enumerate() {
                if position == NO_UNKNOWN {
                    continue;
                }
                let entry = (at / cols, at % cols);
                match seen.get(&position) {
                    Some(&row) if rows[row].count == 1 => {
                        rows[row].entries[1] = entry;
                        rows[row].count = 2;
                    }
                    _ => {
                        seen.insert(position, rows.len());
                        rows.push(Row { position, group: groups.len(), entries: [entry; 2], count: 1 });
                    }
                }
            }
            let places = stack.positions.chunks(cols).map(Places::of).collect();
            groups.push(Group { u, rows: count, v, cols, positions: stack.positions, places });
        }
        Self { n, w, groups, rows }
    }

    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Operations that a Schur complement takes, roughly; those on whole columns and rows counted by vectors of about six.
    pub fn cost(&self) -> usize {
        let (n, w, filled) = (self.n, self.w.len(), self.w.entries.len());
        let projection = filled * n / 6 + filled * w / 2;
        let padded = |g: &Group| g.cols.next_multiple_of(PADDING);
        // Each row reaches half of the others on average.
        let products: usize = self.groups.iter().map(|g| g.rows * padded(g)).sum();
        let gathered: usize = self.groups.iter().map(|g| g.rows + padded(g)).sum();
        let terms: usize = self.rows.iter().map(|row| 4 * row.count).sum();
        2 * projection + terms * (products / 12 + gathered / 4) + self.rows.len() * products / 6
    }

    pub fn scratch(&self) -> FactoredScratch {
        let w = self.w.len();
        let rows = self.groups.iter().map(|g| g.rows).max().unwrap_or(0);
        let cols = self.groups.iter().map(|g| g.cols.next_multiple_of(PADDING)).max().unwrap_or(0);
        FactoredScratch {
            product: vec![0.0; self.n * w],
            wpw: vec![0.0; w * w],
            wzw: vec![0.0; w * w],
            factors: vec![0.0; 8 * rows],
            lines: vec![0.0; 8 * cols],
            sum: vec![0.0; rows * cols],
        }
    }

    /// out ← out + F(x) − F(0).
    pub fn apply(&self, x: &[f64], out: &mut [f64], scratch: &mut FactoredScratch) {
        for group in &self.groups {
            apply(self.n, &self.w, group, x, &mut scratch.product, out);
        }
    }

    /// out_i ← out_i + factor·⟨F_i, H⟩ for symmetric H.
    pub fn adjoint(&self, factor: f64, h: &[f64], out: &mut [f64], scratch: &mut FactoredScratch) {
        for group in &self.groups {
            adjoint(self.n, &self.w, group, factor, h, &mut scratch.product, out);
        }
    }

    /// Visits the products u_i v_j that make up the coefficients as (row, column, unknown, value), row ≥ column.
    pub fn entries(&self, visit: &mut dyn FnMut(usize, usize, Option<usize>, f64)) {
        for group in &self.groups {
            for (at, &position) in group.positions.iter().enumerate().filter(|(_, at)| **at != NO_UNKNOWN) {
                for &(i, u) in self.w.column(group.u + at / group.cols) {
                    for &(j, v) in self.w.column(group.v + at % group.cols) {
                        visit(i.max(j), i.min(j), Some(position), u * v);
                    }
                }
            }
        }
    }

    /// F ← D F D for a diagonal D.
    pub fn scale(&mut self, d: &[f64]) {
        self.w.entries.iter_mut().for_each(|(i, value)| *value *= d[*i]);
    }

    /// out_i ← max(out_i, estimate of ‖D F_i D‖_F) for a diagonal D.
    pub fn norms(&self, d: &[f64], out: &mut [f64]) {
        let length = |j: usize| self.w.column(j).iter().map(|&(i, v)| (v * d[i]).powi(2)).sum::<f64>().sqrt();
        let lengths: Vec<f64> = (0..self.w.len()).map(length).collect();
        for group in &self.groups {
            for r in 0..group.rows {
                for s in (0..group.cols).filter(|s| group.positions[r * group.cols + s] != NO_UNKNOWN) {
                    let norm = 2.0_f64.sqrt() * lengths[group.u + r] * lengths[group.v + s];
                    let out = &mut out[group.positions[r * group.cols + s]];
                    *out = out.max(norm);
                }
            }
        }
    }

    /// M ← M + tr(F_i P F_j Z), lower triangle (j ≤ i stored at `m[i + j·N]`).
    pub fn schur(&self, p: &[f64], z: &[f64], m: &mut [f64], unknowns: usize, scratch: &mut FactoredScratch) {
        project(self.n, &self.w, p, &mut scratch.product, &mut scratch.wpw);
        project(self.n, &self.w, z, &mut scratch.product, &mut scratch.wzw);
        pulp::Arch::new().dispatch(SchurRows { factored: self, m, unknowns, scratch });
    }
}

/// The rows of the Schur complement from `WᵀPW` and `WᵀZW`.
struct SchurRows<'a> {
    factored: &'a Factored,
    m: &'a mut [f64],
    unknowns: usize,
    scratch: &'a mut FactoredScratch,
}

impl pulp::WithSimd for SchurRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Self { factored, m, unknowns, scratch } = self;
        let FactoredScratch { wpw, wzw, factors, lines, sum, .. } = scratch;
        let w = factored.w.len();
        for row in &factored.rows {
            let target = &mut m[row.position * unknowns..(row.position + 1) * unknowns];
            let g = &factored.groups[row.group];
            for h in &factored.groups {
                let padded = h.cols.next_multiple_of(PADDING);
                let terms = 4 * row.count;
                let lines = &mut lines[..terms * padded];
                let factors = &mut factors[..terms * h.rows];
                for (e, &(p, q)) in row.entries[..row.count].iter().enumerate() {
                    let (up, vq) = ((g.u + p) * w, (g.v + q) * w);
                    // (v_qᵀPu_r)(v_sᵀZu_p) + (v_qᵀPv_s)(u_rᵀZu_p) + (u_pᵀPu_r)(v_sᵀZv_q) + (u_pᵀPv_s)(u_rᵀZv_q)
                    let left = [&wpw[vq..], &wzw[up..], &wpw[up..], &wzw[vq..]];
                    let right = [&wzw[up..], &wpw[vq..], &wzw[vq..], &wpw[up..]];
                    for (k, (left, right)) in left.into_iter().zip(right).enumerate() {
                        let k = 4 * e + k;
                        lines[k * padded..k * padded + h.cols].copy_from_slice(&right[h.v..h.v + h.cols]);
                        for (r, value) in left[h.u..h.u + h.rows].iter().enumerate() {
                            factors[r * terms + k] = *value;
                        }
                    }
                }
                let sum = &mut sum[..h.rows * padded];
                if row.count == 1 {
                    outer_products::<S, 4>(simd, h, row.position, factors, lines, sum);
                } else {
                    outer_products::<S, 8>(simd, h, row.position, factors, lines, sum);
                }
                add_from(h, row.position, padded, sum, target);
            }
        }
    }
}

/// sum ← factors · lines for the rows of X that reach beyond `position`, K terms.
#[inline(always)]
fn outer_products<S: pulp::Simd, const K: usize>(
    simd: S,
    h: &Group,
    position: usize,
    factors: &[f64],
    lines: &[f64],
    sum: &mut [f64],
) {
    let (lines, _) = S::as_simd_f64s(lines);
    let (sum, _) = S::as_mut_simd_f64s(sum);
    let width = lines.len() / K;
    for c in 0..width {
        let line: [S::f64s; K] = std::array::from_fn(|k| lines[k * width + c]);
        for ((factors, sum), places) in factors.chunks_exact(K).zip(sum.chunks_exact_mut(width)).zip(&h.places) {
            if places.last(h.cols) < position {
                continue;
            }
            let mut total = simd.mul_f64s(simd.splat_f64s(factors[0]), line[0]);
            for k in 1..K {
                total = simd.mul_add_e_f64s(simd.splat_f64s(factors[k]), line[k], total);
            }
            sum[c] = total;
        }
    }
}

/// Adds the entries of `sum` from `position` on to a row of the Schur complement.
#[inline(always)]
fn add_from(h: &Group, position: usize, padded: usize, sum: &[f64], target: &mut [f64]) {
    for (r, (places, sum)) in h.places.iter().zip(sum.chunks_exact(padded)).enumerate() {
        match *places {
            Places::Run(first) => {
                let skip = position.saturating_sub(first);
                if skip < h.cols {
                    axpy(1.0, &sum[skip..h.cols], &mut target[first + skip..first + h.cols]);
                }
            }
            Places::Scattered(last) if last >= position => {
                for (&at, value) in h.positions[r * h.cols..(r + 1) * h.cols].iter().zip(sum) {
                    if at >= position && at != NO_UNKNOWN {
                        target[at] += value;
                    }
                }
            }
            Places::Scattered(_) => {}
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
                axpy(2.0 * factor * value, &h[i * n..(i + 1) * n], hv);
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
        for (j, hw) in product.chunks_exact_mut(n).enumerate() {
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
