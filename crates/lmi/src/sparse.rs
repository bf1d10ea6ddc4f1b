//! Blocks given coefficient matrix by coefficient matrix, each sparse: the form of `.dat-s` files.
//!
//! A row of the Schur complement, `M_ij = ⟨F_j, P F_i Z⟩`, is formed by one of two of the formulas of Fujisawa, Kojima
//! and Nakata (Math. Program. 79, 1997): the whole product H = P F_i Z first, or only the entries that F_j asks for,
//! whichever takes fewer operations. Unknowns are visited in the order of falling entry count, so that the costly product
//! is made for the matrix with more entries. Only the rows where F_i is not zero enter the products.

use crate::dense;

/// One entry in the lower triangle of a coefficient matrix (and its mirror image).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub unknown: usize,
    pub row: usize,
    pub column: usize,
    pub value: f64,
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
    /// Whether the whole product H is formed.
    whole: bool,
}

/// The sparse part of a block.
#[derive(Debug, Default)]
pub(crate) struct Sparse {
    n: usize,
    coefficients: Vec<Coefficient>,
}

/// Scratch memory, reused in every iteration.
#[derive(Debug, Default)]
pub(crate) struct SparseScratch {
    fz: Vec<f64>,
    p_rows: Vec<f64>,
    pub h: Vec<f64>,
}

impl Sparse {
    /// From entries in any order; repeated entries add up.
    pub fn new(n: usize, mut entries: Vec<Entry>) -> Self {
        entries.sort_by_key(|e| (e.unknown, e.column, e.row));
        let mut coefficients: Vec<Coefficient> = Vec::new();
        for group in entries.chunk_by(|a, b| a.unknown == b.unknown) {
            let mut merged: Vec<(usize, usize, f64)> = Vec::new();
            for e in group {
                match merged.last_mut() {
                    Some(last) if (last.0, last.1) == (e.row, e.column) => last.2 += e.value,
                    _ => merged.push((e.row, e.column, e.value)),
                }
            }
            merged.retain(|e| e.2 != 0.0);
            if merged.is_empty() {
                continue;
            }
            let mut support: Vec<usize> = merged.iter().flat_map(|e| [e.0, e.1]).collect();
            support.sort_unstable();
            support.dedup();
            let place = |row: usize| support.binary_search(&row).unwrap_or(0);
            let mut full = Vec::new();
            for &(i, j, value) in &merged {
                full.push((place(i), j, value));
                if i != j {
                    full.push((place(j), i, value));
                }
            }
            let unknown = group[0].unknown;
            coefficients.push(Coefficient {
                unknown,
                entries: merged,
                support,
                full,
                whole: false,
            });
        }
        coefficients.sort_by_key(|c| std::cmp::Reverse(c.entries.len()));
        let mut remaining: usize = coefficients.iter().map(|c| c.entries.len()).sum();
        for c in &mut coefficients {
            let k = c.support.len();
            c.whole = n * n * k + 2 * remaining < 2 * k * remaining + k * n;
            remaining -= c.entries.len();
        }
        Self { n, coefficients }
    }

    pub fn is_empty(&self) -> bool {
        self.coefficients.is_empty()
    }

    pub fn scratch(&self) -> SparseScratch {
        if self.is_empty() {
            return SparseScratch::default();
        }
        let square = self.n * self.n;
        SparseScratch {
            fz: vec![0.0; square],
            p_rows: vec![0.0; square],
            h: vec![0.0; square],
        }
    }

    /// out ← out + F(x) − F(0).
    pub fn apply(&self, x: &[f64], out: &mut [f64]) {
        for c in &self.coefficients {
            let x = x[c.unknown];
            for &(i, j, value) in &c.entries {
                out[i + j * self.n] += x * value;
                if i != j {
                    out[j + i * self.n] += x * value;
                }
            }
        }
    }

    /// out_i ← out_i + factor·⟨F_i, H⟩ for symmetric H.
    pub fn adjoint(&self, factor: f64, h: &[f64], out: &mut [f64]) {
        for c in &self.coefficients {
            let inner: f64 = c
                .entries
                .iter()
                .map(|&(i, j, value)| {
                    if i == j {
                        value * h[i + j * self.n]
                    } else {
                        2.0 * value * h[i + j * self.n]
                    }
                })
                .sum();
            out[c.unknown] += factor * inner;
        }
    }

    /// out_i ← max(out_i, ‖F_i‖_F).
    pub fn norms(&self, out: &mut [f64]) {
        for c in &self.coefficients {
            let square: f64 = c
                .entries
                .iter()
                .map(|&(i, j, v)| if i == j { v * v } else { 2.0 * v * v })
                .sum();
            out[c.unknown] = out[c.unknown].max(square.sqrt());
        }
    }

    /// M ← M + tr(F_i P F_j Z) over the sparse unknowns, lower triangle. For each of them `mixed` is called with
    /// the unknown and the symmetrised H = P F_i Z when `wants_product`.
    pub fn schur(
        &self,
        p: &[f64],
        z: &[f64],
        m: &mut [f64],
        unknowns: usize,
        scratch: &mut SparseScratch,
        wants_product: bool,
        mut mixed: impl FnMut(usize, &[f64], &mut [f64]),
    ) {
        let n = self.n;
        let SparseScratch { fz, p_rows, h } = scratch;
        for (at, c) in self.coefficients.iter().enumerate() {
            let k = c.support.len();
            let (fz, p_rows) = (&mut fz[..k * n], &mut p_rows[..k * n]);
            // Rows of F_i Z and of P on the support, stored so that the inner products below run contiguously.
            fz.fill(0.0);
            for &(row, column, value) in &c.full {
                for (j, z) in z[column * n..(column + 1) * n].iter().enumerate() {
                    fz[row + j * k] += value * z;
                }
            }
            for (row, &i) in c.support.iter().enumerate() {
                for (j, p) in p[i * n..(i + 1) * n].iter().enumerate() {
                    p_rows[row + j * k] = *p;
                }
            }
            let whole = c.whole || wants_product;
            if whole {
                dense::multiply_transposed(k, n, p_rows, fz, h);
            }
            if wants_product {
                dense::symmetrize(n, h);
                mixed(c.unknown, h, m);
            }
            let inner = |i: usize, j: usize| {
                if whole {
                    h[i + j * n]
                } else {
                    dense::dot(&p_rows[i * k..(i + 1) * k], &fz[j * k..(j + 1) * k])
                }
            };
            for other in &self.coefficients[at..] {
                let sum: f64 = other
                    .entries
                    .iter()
                    .map(|&(i, j, value)| {
                        if i == j {
                            value * inner(i, i)
                        } else {
                            value * (inner(i, j) + inner(j, i))
                        }
                    })
                    .sum();
                let (low, high) = (c.unknown.min(other.unknown), c.unknown.max(other.unknown));
                m[high + low * unknowns] += sum;
            }
        }
    }
}
