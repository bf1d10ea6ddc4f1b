//! Unknowns that a block sees in combinations alone.
//!
//! The inequality of a rate ν holds Σ νₖYₖ of all the unknowns, beside a few of them by themselves. Its part of the Schur complement is formed
//! for the combinations, H, and then spread: of combinations Σ aₖXₖ and Σ bₗYₗ it is `aₖbₗH` for Xₖ and Yₗ. With N unknowns in a sum that takes
//! N² additions where it would take N² times the work of forming H.

use crate::dense::axpy;
use crate::vectorized::vectorized;

/// A combination Σ cₖXₖ of matrix unknowns of one shape, or one of them.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// Its first scalar, among those of all combinations of the block, and how many it has.
    pub start: usize,
    pub len: usize,
    /// The first scalar of each Xₖ among all unknowns, with cₖ.
    pub of: Vec<(usize, f64)>,
}

/// The combinations of a block, one after the other.
#[derive(Clone, Debug)]
pub(crate) struct Combinations {
    pub parts: Vec<Part>,
    /// Scalars of all of them.
    pub len: usize,
}

impl Combinations {
    /// The combinations at x.
    pub fn gather(&self, x: &[f64], out: &mut [f64]) {
        for part in &self.parts {
            let out = &mut out[part.start..part.start + part.len];
            out.fill(0.0);
            part.of.iter().for_each(|&(start, factor)| axpy(factor, &x[start..start + part.len], out));
        }
    }

    /// From a gradient with respect to the combinations to that with respect to the unknowns, added to `out`.
    pub fn scatter(&self, gradient: &[f64], out: &mut [f64]) {
        for part in &self.parts {
            let gradient = &gradient[part.start..part.start + part.len];
            part.of.iter().for_each(|&(start, factor)| axpy(factor, gradient, &mut out[start..start + part.len]));
        }
    }

    /// The unknowns of a scalar of the combinations, with their factors.
    pub fn unknowns(&self, at: usize) -> impl Iterator<Item = (usize, f64)> {
        let part = self.parts.iter().find(|part| (part.start..part.start + part.len).contains(&at));
        part.into_iter().flat_map(move |part| part.of.iter().map(move |&(start, c)| (start + at - part.start, c)))
    }

    /// Adds the matrix `h` of the combinations, of which the lower triangle is given and both are known afterwards, to that of the `unknowns`, lower triangle.
    pub fn spread(&self, h: &mut [f64], m: &mut [f64], unknowns: usize) {
        let n = self.len;
        for j in 0..n {
            for i in j + 1..n {
                h[j + i * n] = h[i + j * n];
            }
        }
        spread(self, h, m, unknowns);
    }
}

vectorized! {
    /// M ← M + TᵀHT for the combinations Tx, lower triangle.
    fn spread<'a>(combinations: &'a Combinations, h: &'a [f64], m: &'a mut [f64], unknowns: usize) {
        let n = combinations.len;
        for (at, a) in combinations.parts.iter().enumerate() {
            for b in &combinations.parts[..=at] {
                for &(to_a, of_a) in &a.of {
                    for &(to_b, of_b) in &b.of {
                        let factor = of_a * of_b;
                        // the one with the larger unknowns gives the rows of M
                        let (rows, columns) = if to_a >= to_b { ((a, to_a), (b, to_b)) } else { ((b, to_b), (a, to_a)) };
                        if a.start == b.start && to_a < to_b {
                            continue;
                        }
                        for j in 0..columns.0.len {
                            let first = if to_a == to_b { j } else { 0 };
                            let into = (columns.1 + j) * unknowns + rows.1;
                            let into = &mut m[into + first..into + rows.0.len];
                            let column = |of: &Part, rows: &Part| {
                                let at = (of.start + j) * n + rows.start;
                                at + first..at + rows.len
                            };
                            axpy(factor, &h[column(columns.0, rows.0)], into);
                            // an unknown by itself and in a sum meets itself from both sides
                            if to_a == to_b && a.start != b.start {
                                axpy(factor, &h[column(rows.0, columns.0)], into);
                            }
                        }
                    }
                }
            }
        }
    }
}
