//! Blocks given coefficient matrix by coefficient matrix, each sparse: the form of `.dat-s` files.
//!
//! A row of the Schur complement, `M_ij = ⟨F_j, P F_i Z⟩`, is formed by one of two of the formulas of Fujisawa, Kojima
//! and Nakata (Math. Program. 79, 1997): the whole product H = P F_i Z first, or only the entries that F_j asks for,
//! whichever takes fewer operations. Unknowns are visited in the order of falling entry count, so that the costly product
//! is made for the matrix with more entries. Only the rows where F_i is not zero enter the products.

use crate::dense;
use crate::vectorized::vectorized;

/// One entry in the lower triangle of a coefficient matrix (and its mirror image).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub unknown: usize,
    pub row: usize,
    pub column: usize,
    pub value: f64,
}

impl Entry {
    /// out ← out + x·(the entry and its mirror image), n × n.
    #[inline(always)]
    pub fn apply(&self, n: usize, x: &[f64], out: &mut [f64]) {
        let &Self { unknown, row, column, value } = self;
        out[row + column * n] += value * x[unknown];
        if row != column {
            out[column + row * n] += value * x[unknown];
        }
    }

    /// Its part of ⟨F, H⟩ for symmetric H, n × n.
    #[inline(always)]
    pub fn inner_product(&self, n: usize, h: &[f64]) -> f64 {
        let &Self { row, column, value, .. } = self;
        (if row == column { value } else { 2.0 * value }) * h[row + column * n]
    }
}

/// The coefficient matrix of one unknown.
#[derive(Debug)]
struct Coefficient {
    unknown: usize,
    /// (row, column, value) with row ≥ column.
    entries: Vec<(usize, usize, f64)>,
    /// Rows in which the full symmetric matrix has entries.
    support: Vec<usize>,
    /// The entries of the full symmetric matrix as (place in `support`, column, value).
    full: Vec<(usize, usize, f64)>,
    /// Where its weights begin among those of the block.
    start: usize,
    /// Whether the whole product H is formed.
    whole: bool,
}

impl Coefficient {
    fn lower_entries(&self) -> impl Iterator<Item = Entry> {
        let unknown = self.unknown;
        self.entries.iter().map(move |&(row, column, value)| Entry { unknown, row, column, value })
    }
}

/// The sparse part of a block.
#[derive(Debug, Default)]
pub(crate) struct Sparse {
    n: usize,
    /// By falling number of entries.
    coefficients: Vec<Coefficient>,
    /// All entries in that order, as ⟨F, H⟩ for symmetric H needs them: (place in the lower triangle of H, value, doubled off the diagonal).
    weights: Vec<(u32, f64)>,
}

/// The coefficient matrix of each unknown that has one, as (row, column, value), row ≥ column, by rising column and row.
pub(crate) type Coefficients = Vec<(usize, Vec<(usize, usize, f64)>)>;

/// Gathers entries in any order; repeated entries add up.
pub(crate) fn merge(mut entries: Vec<Entry>) -> Coefficients {
    entries.sort_by_key(|e| (e.unknown, e.column, e.row));
    let mut coefficients: Coefficients = Vec::new();
    for group in entries.chunk_by(|a, b| a.unknown == b.unknown) {
        let mut merged: Vec<(usize, usize, f64)> = Vec::with_capacity(group.len());
        for e in group {
            match merged.last_mut() {
                Some(last) if (last.0, last.1) == (e.row, e.column) => last.2 += e.value,
                _ => merged.push((e.row, e.column, e.value)),
            }
        }
        merged.retain(|e| e.2 != 0.0);
        if !merged.is_empty() {
            coefficients.push((group[0].unknown, merged));
        }
    }
    coefficients
}

/// What is done with each product H of a block that is not sparse alone.
pub(crate) type Mixed<'a> = &'a mut dyn FnMut(usize, &[f64], &mut [f64]);

/// Scratch memory, reused in every iteration.
#[derive(Debug, Default)]
pub(crate) struct SparseScratch {
    fz: Vec<f64>,
    p_rows: Vec<f64>,
    pub h: Vec<f64>,
}

/// Operations for the row of one unknown, by the whole product, counted by vectors of about six, and by the entries that are asked for: of
/// `support` rows, with so many entries of its own and of the unknowns after it.
fn operations(n: usize, support: usize, entries: usize) -> (usize, usize) {
    (n * n * (support + 6) / 6 + entries, 2 * support * entries)
}

impl Sparse {
    /// From entries in any order; repeated entries add up.
    pub fn new(n: usize, entries: Vec<Entry>) -> Self {
        Self::of_coefficients(n, merge(entries))
    }

    /// From coefficient matrices.
    pub fn of_coefficients(n: usize, merged: Coefficients) -> Self {
        let mut coefficients: Vec<Coefficient> = Vec::new();
        for (unknown, entries) in merged {
            let mut support: Vec<usize> = entries.iter().flat_map(|e| [e.0, e.1]).collect();
            support.sort_unstable();
            support.dedup();
            let place = |row: usize| support.binary_search(&row).unwrap_or(0);
            let mut full = Vec::new();
            for &(i, j, value) in &entries {
                full.push((place(i), j, value));
                if i != j {
                    full.push((place(j), i, value));
                }
            }
            coefficients.push(Coefficient { unknown, entries, support, full, start: 0, whole: false });
        }
        coefficients.sort_by_key(|c| std::cmp::Reverse(c.entries.len()));
        let mut remaining: usize = coefficients.iter().map(|c| c.entries.len()).sum();
        let mut weights = Vec::with_capacity(remaining);
        for c in &mut coefficients {
            let (whole, entrywise) = operations(n, c.support.len(), remaining);
            c.whole = whole < entrywise;
            remaining -= c.entries.len();
            c.start = weights.len();
            let weight =
                |&(i, j, value): &(usize, usize, f64)| ((i + j * n) as u32, if i == j { value } else { 2.0 * value });
            weights.extend(c.entries.iter().map(weight));
        }
        Self { n, coefficients, weights }
    }

    /// Operations that a Schur complement of these coefficient matrices takes, roughly.
    pub fn cost(n: usize, coefficients: &Coefficients) -> usize {
        let mut seen = vec![0; n];
        let mut sizes: Vec<[usize; 3]> = Vec::with_capacity(coefficients.len());
        for (at, (_, entries)) in coefficients.iter().enumerate() {
            let (mut support, mut full) = (0, 0);
            for &(i, j, _) in entries {
                full += if i == j { 1 } else { 2 };
                for row in [i, j] {
                    support += usize::from(seen[row] != at + 1);
                    seen[row] = at + 1;
                }
            }
            sizes.push([entries.len(), support, full]);
        }
        sizes.sort_by_key(|[count, ..]| std::cmp::Reverse(*count));
        let mut remaining: usize = sizes.iter().map(|[count, ..]| count).sum();
        let mut cost = 0;
        for [count, support, full] in sizes {
            let (whole, entrywise) = operations(n, support, remaining);
            // Single entries cost about twice what they count.
            cost += full * n / 6 + if whole < entrywise { whole } else { 2 * entrywise };
            remaining -= count;
        }
        cost
    }

    pub fn is_empty(&self) -> bool {
        self.coefficients.is_empty()
    }

    pub fn scratch(&self) -> SparseScratch {
        if self.is_empty() {
            return SparseScratch::default();
        }
        let square = self.n * self.n;
        SparseScratch { fz: vec![0.0; square], p_rows: vec![0.0; square], h: vec![0.0; square] }
    }

    /// out ← out + F(x) − F(0).
    pub fn apply(&self, x: &[f64], out: &mut [f64]) {
        for c in &self.coefficients {
            c.lower_entries().for_each(|entry| entry.apply(self.n, x, out));
        }
    }

    /// out_i ← out_i + factor·⟨F_i, H⟩ for symmetric H.
    pub fn adjoint(&self, factor: f64, h: &[f64], out: &mut [f64]) {
        for c in &self.coefficients {
            let inner: f64 = c.lower_entries().map(|entry| entry.inner_product(self.n, h)).sum();
            out[c.unknown] += factor * inner;
        }
    }

    /// Visits every entry as (row, column, unknown, value), row ≥ column.
    pub fn entries(&self, visit: &mut dyn FnMut(usize, usize, Option<usize>, f64)) {
        for c in &self.coefficients {
            c.entries.iter().for_each(|&(i, j, value)| visit(i, j, Some(c.unknown), value));
        }
    }

    /// F ← D F D for a diagonal D.
    pub fn scale(&mut self, d: &[f64]) {
        for c in &mut self.coefficients {
            c.entries.iter_mut().for_each(|(i, j, value)| *value *= d[*i] * d[*j]);
            c.full.iter_mut().for_each(|(place, j, value)| *value *= d[c.support[*place]] * d[*j]);
            let weights = &mut self.weights[c.start..c.start + c.entries.len()];
            for (&(i, j, value), weight) in c.entries.iter().zip(weights) {
                weight.1 = if i == j { value } else { 2.0 * value };
            }
        }
    }

    /// out_i ← max(out_i, ‖D F_i D‖_F) for a diagonal D.
    pub fn norms(&self, d: &[f64], out: &mut [f64]) {
        for c in &self.coefficients {
            let square = |&(i, j, v): &(usize, usize, f64)| (v * d[i] * d[j]).powi(2) * if i == j { 1.0 } else { 2.0 };
            let sum: f64 = c.entries.iter().map(square).sum();
            out[c.unknown] = out[c.unknown].max(sum.sqrt());
        }
    }

    /// M ← M + tr(F_i P F_j Z) over the sparse unknowns, lower triangle. If given, `mixed` is called for each of them with
    /// the unknown, the symmetrised H = P F_i Z and M.
    pub fn schur(
        &self,
        p: &[f64],
        z: &[f64],
        m: &mut [f64],
        unknowns: usize,
        scratch: &mut SparseScratch,
        mut mixed: Option<Mixed<'_>>,
    ) {
        let n = self.n;
        let SparseScratch { fz, p_rows, h } = scratch;
        for (at, c) in self.coefficients.iter().enumerate() {
            let k = c.support.len();
            let (fz, p_rows) = (&mut fz[..k * n], &mut p_rows[..k * n]);
            product_rows(n, &c.full, z, fz);
            for (row, &i) in p_rows.chunks_exact_mut(n).zip(&c.support) {
                row.copy_from_slice(&p[i * n..(i + 1) * n]);
            }
            let targets = self.coefficients[at..].iter();
            let place = |other: &Coefficient| {
                let (low, high) = (c.unknown.min(other.unknown), c.unknown.max(other.unknown));
                high + low * unknowns
            };
            if c.whole || mixed.is_some() {
                dense::multiply_transposed(k, n, p_rows, fz, h);
                dense::symmetrize(n, h);
                if let Some(mixed) = &mut mixed {
                    mixed(c.unknown, h, m);
                }
                for other in targets {
                    let weights = &self.weights[other.start..other.start + other.entries.len()];
                    m[place(other)] += weights.iter().map(|&(at, weight)| weight * h[at as usize]).sum::<f64>();
                }
                continue;
            }
            let inner = |i: usize, j: usize| -> f64 {
                p_rows.chunks_exact(n).zip(fz.chunks_exact(n)).map(|(p, fz)| p[i] * fz[j]).sum()
            };
            for other in targets {
                let entry = |&(i, j, value): &(usize, usize, f64)| {
                    if i == j { value * inner(i, i) } else { value * (inner(i, j) + inner(j, i)) }
                };
                m[place(other)] += other.entries.iter().map(entry).sum::<f64>();
            }
        }
    }
}

vectorized! {
    /// The rows of F Z on the support of F, one after the other.
    fn product_rows<'a>(n: usize, full: &'a [(usize, usize, f64)], z: &'a [f64], out: &'a mut [f64]) {
        out.fill(0.0);
        for &(row, column, value) in full {
            dense::axpy(value, &z[column * n..(column + 1) * n], &mut out[row * n..(row + 1) * n]);
        }
    }
}
