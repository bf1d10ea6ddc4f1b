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

/// One stack before compilation: columns of U and V, and for entry (r, s) of X the scalar unknown `positions[r·|V| + s]`.
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
        self.entries.extend(
            column
                .iter()
                .copied()
                .enumerate()
                .filter(|(_, value)| *value != 0.0),
        );
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
    /// Largest position in each row of X: rows that end before the row of M in hand are skipped.
    last: Vec<usize>,
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

/// Scratch memory of one block's factored part, reused in every iteration.
#[derive(Debug, Default)]
pub(crate) struct FactoredScratch {
    product: Vec<f64>,
    wpw: Vec<f64>,
    wzw: Vec<f64>,
    row: Vec<f64>,
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
            let first = rows.len();
            for (at, &position) in stack.positions.iter().enumerate() {
                let entry = (at / cols, at % cols);
                match rows[first..]
                    .iter_mut()
                    .find(|row| row.position == position && row.count == 1)
                {
                    Some(row) => {
                        row.entries[1] = entry;
                        row.count = 2;
                    }
                    None => rows.push(Row {
                        position,
                        group: groups.len(),
                        entries: [entry; 2],
                        count: 1,
                    }),
                }
            }
            let last = stack
                .positions
                .chunks(cols)
                .map(|c| c.iter().copied().max().unwrap_or(0))
                .collect();
            groups.push(Group {
                u,
                rows: count,
                v,
                cols,
                positions: stack.positions,
                last,
            });
        }
        Self { n, w, groups, rows }
    }

    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    pub fn scratch(&self) -> FactoredScratch {
        let w = self.w.len();
        let longest = self
            .groups
            .iter()
            .map(|g| g.positions.len())
            .max()
            .unwrap_or(0);
        FactoredScratch {
            product: vec![0.0; self.n * w],
            wpw: vec![0.0; w * w],
            wzw: vec![0.0; w * w],
            row: vec![0.0; longest],
        }
    }

    /// out ← out + F(x) − F(0).
    pub fn apply(&self, x: &[f64], out: &mut [f64], scratch: &mut FactoredScratch) {
        let n = self.n;
        for group in &self.groups {
            let t = &mut scratch.product[..n * group.cols];
            t.fill(0.0);
            for r in 0..group.rows {
                for &(i, value) in self.w.column(group.u + r) {
                    for (s, position) in group.positions[r * group.cols..][..group.cols]
                        .iter()
                        .enumerate()
                    {
                        t[i + s * n] += value * x[*position];
                    }
                }
            }
            for (s, t) in t.chunks_exact(n).enumerate() {
                for &(i, value) in self.w.column(group.v + s) {
                    axpy(value, t, &mut out[i * n..(i + 1) * n]);
                    for (k, t) in t.iter().enumerate() {
                        out[i + k * n] += value * t;
                    }
                }
            }
        }
    }

    /// out_i ← out_i + factor·⟨F_i, H⟩ for symmetric H.
    pub fn adjoint(&self, factor: f64, h: &[f64], out: &mut [f64], scratch: &mut FactoredScratch) {
        let n = self.n;
        for group in &self.groups {
            let hv = &mut scratch.product[..n];
            for s in 0..group.cols {
                hv.fill(0.0);
                for &(i, value) in self.w.column(group.v + s) {
                    axpy(2.0 * factor * value, &h[i * n..(i + 1) * n], hv);
                }
                for r in 0..group.rows {
                    let inner: f64 = self
                        .w
                        .column(group.u + r)
                        .iter()
                        .map(|&(i, value)| value * hv[i])
                        .sum();
                    out[group.positions[r * group.cols + s]] += inner;
                }
            }
        }
    }

    /// out_i ← max(out_i, estimate of ‖F_i‖_F).
    pub fn norms(&self, out: &mut [f64]) {
        let length = |j: usize| {
            self.w
                .column(j)
                .iter()
                .map(|(_, v)| v * v)
                .sum::<f64>()
                .sqrt()
        };
        for group in &self.groups {
            for r in 0..group.rows {
                for s in 0..group.cols {
                    let norm = 2.0_f64.sqrt() * length(group.u + r) * length(group.v + s);
                    let out = &mut out[group.positions[r * group.cols + s]];
                    *out = out.max(norm);
                }
            }
        }
    }

    /// M ← M + tr(F_i P F_j Z), lower triangle (j ≤ i stored at `m[i + j·N]`).
    pub fn schur(
        &self,
        p: &[f64],
        z: &[f64],
        m: &mut [f64],
        unknowns: usize,
        scratch: &mut FactoredScratch,
    ) {
        let FactoredScratch {
            product,
            wpw,
            wzw,
            row: buffer,
        } = scratch;
        self.project(p, product, wpw);
        self.project(z, product, wzw);
        let w = self.w.len();
        for row in &self.rows {
            let target = &mut m[row.position * unknowns..(row.position + 1) * unknowns];
            let g = &self.groups[row.group];
            for h in &self.groups {
                let first = h.last.partition_point(|_| false);
                let buffer = &mut buffer[..h.positions.len()];
                buffer.fill(0.0);
                for &(p, q) in &row.entries[..row.count] {
                    let (up, vq) = (g.u + p, g.v + q);
                    let of = |m: &'_ [f64], column: usize, at: usize| m[column * w + at];
                    let span = |column: usize| column * w + h.v..column * w + h.v + h.cols;
                    let (zu, pv) = (&wzw[span(up)], &wpw[span(vq)]);
                    let (zv, pu) = (&wzw[span(vq)], &wpw[span(up)]);
                    for r in first..h.rows {
                        if h.last[r] < row.position {
                            continue;
                        }
                        let ur = h.u + r;
                        let (a, b) = (of(wpw, vq, ur), of(wzw, up, ur));
                        let (c, d) = (of(wpw, up, ur), of(wzw, vq, ur));
                        let out = &mut buffer[r * h.cols..(r + 1) * h.cols];
                        for ((((out, zu), pv), zv), pu) in
                            out.iter_mut().zip(zu).zip(pv).zip(zv).zip(pu)
                        {
                            *out += a * zu + b * pv + c * zv + d * pu;
                        }
                    }
                }
                for (&position, value) in h.positions.iter().zip(buffer.iter()) {
                    if position >= row.position {
                        target[position] += value;
                    }
                }
            }
        }
    }

    /// WᵀHW for symmetric H.
    fn project(&self, h: &[f64], product: &mut [f64], out: &mut [f64]) {
        let (n, w) = (self.n, self.w.len());
        for (j, hw) in product.chunks_exact_mut(n).enumerate() {
            hw.fill(0.0);
            for &(i, value) in self.w.column(j) {
                axpy(value, &h[i * n..(i + 1) * n], hw);
            }
            for k in 0..=j {
                let inner: f64 = self
                    .w
                    .column(k)
                    .iter()
                    .map(|&(i, value)| value * hw[i])
                    .sum();
                out[k + j * w] = inner;
                out[j + k * w] = inner;
            }
        }
    }
}
