//! How large the unknowns of a feasible point can be.
//!
//! For blocks `G_b(x) = C_b + Σ xᵢ F_{b,i} ⪰ 0` and multipliers Z_b ⪰ 0, let `τ(x) = Σ_b⟨G_b(x), Z_b⟩ ≥ 0`. Where every unknown satisfies
//!
//! ```text
//! |xᵢ| ≤ aᵢ + bᵢ τ(x)        at every feasible x,
//! ```
//!
//! multipliers that miss their equations by rᵢ still prove something of every x, not only of those within some distance: from
//! `τ = κ + Σ rᵢ xᵢ` follows `τ ≤ (κ + Σ|rᵢ|aᵢ)/(1 − Σ|rᵢ|bᵢ)` if `Σ|rᵢ|bᵢ < 1`.
//!
//! The bounds come from the entries of the blocks, one unknown at a time:
//! diagonal entries are not negative, which bounds unknowns where the others in the entry are bounded; and entries are at most
//! `√(Gⱼⱼ Gₖₖ)`, with Gⱼⱼ bounded by the unknowns in it or by `wⱼ τ` ([`Multiplier`]). An unknown that stands alone in an entry, or with
//! bounded ones, is bounded with it; those that never do are bounded together. Coefficients are taken with what rounding may have done to them.

use crate::multiplier::Multiplier;
use crate::report::Original;
use crate::{Mat, estimate};

/// Rounds of bounds from diagonal entries.
const ROUNDS: usize = 6;
/// Rounds in which bounds that were found are improved.
const IMPROVEMENTS: usize = 1;
/// A coefficient that rounding leaves less of than this is no pivot.
const LEAST_PIVOT: f64 = 0.5;
/// Most unknowns that are bounded together.
const MOST_INDEPENDENT: usize = 400;
/// Absolute error of a coefficient by underflow.
const UNDERFLOW: f64 = 1e-290;

/// A coefficient of an entry, known to be within `error` of `value`.
#[derive(Clone, Copy, Debug)]
struct Term {
    unknown: u32,
    value: f64,
    error: f64,
}

impl Term {
    fn most(&self) -> f64 {
        self.value.abs() + self.error
    }

    /// What the coefficient is at least, in size; 0 where its sign is not known.
    fn least(&self) -> f64 {
        let least = self.value.abs() - self.error;
        if least > LEAST_PIVOT * self.value.abs() { least } else { 0.0 }
    }
}

/// An entry of a block, without terms if it is known and on the diagonal.
#[derive(Clone, Debug)]
struct Entry {
    /// Rows, numbered through all blocks, the first not less than the second.
    rows: [u32; 2],
    constant: f64,
    error: f64,
    terms: std::ops::Range<usize>,
}

/// The entries of all blocks that hold unknowns, and all on their diagonals, of the lower triangles.
pub(crate) struct Entries {
    entries: Vec<Entry>,
    terms: Vec<Term>,
    unknowns: usize,
    rows: usize,
}

/// `|xᵢ| ≤ aᵢ + bᵢ τ`.
pub(crate) struct Reach {
    pub a: Vec<f64>,
    pub b: Vec<f64>,
}

impl Entries {
    /// Of `F_b(x) − margin·I`, the margins of strict inequalities zero.
    pub fn new(original: &dyn Original, sizes: &[usize], margins: &[f64], unknowns: usize) -> Self {
        let mut all = Self { entries: Vec::new(), terms: Vec::new(), unknowns, rows: sizes.iter().sum() };
        let mut first = 0;
        // Where an unknown stands among the terms of the entry at hand.
        let mut place = vec![usize::MAX; unknowns];
        for (block, (&n, &margin)) in sizes.iter().zip(margins).enumerate() {
            all.add_block(original, block, n, margin, first, &mut place);
            first += n;
        }
        all
    }

    fn add_block(
        &mut self,
        original: &dyn Original,
        block: usize,
        n: usize,
        margin: f64,
        first: usize,
        place: &mut [usize],
    ) {
        // (position in the lower triangle, unknown, value), then sorted by position through counting.
        let mut found: Vec<(u32, u32, f64)> = Vec::new();
        let known = u32::MAX;
        let diagonal = original.is_diagonal(block);
        let position = |i: usize, j: usize| if diagonal { i } else { i * (i + 1) / 2 + j };
        let positions = position(n, 0);
        let mut starts = vec![0_u32; positions + 1];
        original.entries(block, &mut |i, j, unknown, value| {
            let at = position(i.max(j), i.min(j));
            starts[at] += 1;
            found.push((at as u32, unknown.map_or(known, |unknown| unknown as u32), value));
        });
        let mut sum = 0;
        for start in &mut starts {
            (*start, sum) = (sum, sum + *start);
        }
        let mut sorted = vec![(0_u32, 0.0_f64); found.len()];
        for &(at, unknown, value) in &found {
            sorted[starts[at as usize] as usize] = (unknown, value);
            starts[at as usize] += 1;
        }
        let mut begin = 0;
        let (mut i, mut j) = (0, 0);
        for &end in &starts[..positions] {
            let end = end as usize;
            self.add_entry(&sorted[begin..end], known, [i, j], if i == j { margin } else { 0.0 }, first, place);
            begin = end;
            if diagonal {
                (i, j) = (i + 1, j + 1);
            } else if i == j {
                (i, j) = (i + 1, 0);
            } else {
                j += 1;
            }
        }
    }

    fn add_entry(
        &mut self,
        parts: &[(u32, f64)],
        known: u32,
        [i, j]: [usize; 2],
        margin: f64,
        first: usize,
        place: &mut [usize],
    ) {
        let begin = self.terms.len();
        let (mut constant, mut magnitude) = (-margin, margin.abs());
        let mut is_zero = margin == 0.0;
        for &(unknown, value) in parts {
            if unknown == known {
                constant += value;
                magnitude += value.abs();
                is_zero = false;
                continue;
            }
            let at = &mut place[unknown as usize];
            if *at == usize::MAX {
                *at = self.terms.len();
                self.terms.push(Term { unknown, value, error: value.abs() });
            } else {
                let term = &mut self.terms[*at];
                term.value += value;
                // Σ|terms| for now.
                term.error += value.abs();
            }
        }
        if self.terms.len() == begin && i != j {
            return;
        }
        let rounding = (parts.len() + 3) as f64 * f64::EPSILON;
        for term in &mut self.terms[begin..] {
            place[term.unknown as usize] = usize::MAX;
            term.error = rounding * term.error + UNDERFLOW;
        }
        let rows = [i, j].map(|row| (first + row) as u32);
        let error = if is_zero { 0.0 } else { rounding * magnitude + UNDERFLOW };
        self.entries.push(Entry { rows, constant, error, terms: begin..self.terms.len() });
    }

    /// Whether an unknown stands in an entry that a multiplier weighs; where it does not, it is in no equation of the multipliers.
    pub fn weighed(&self, multipliers: &[Multiplier]) -> Vec<bool> {
        let mut starts = Vec::with_capacity(self.rows);
        for (block, z) in multipliers.iter().enumerate() {
            let first = starts.len();
            starts.extend((0..z.matrix.nrows()).map(|_| (block, first)));
        }
        let mut weighed = vec![false; self.unknowns];
        for entry in &self.entries {
            let [i, j] = entry.rows.map(|row| row as usize);
            let (block, first) = starts[i];
            if multipliers[block].matrix[(i - first, j - first)] != 0.0 {
                self.terms[entry.terms.clone()].iter().for_each(|term| weighed[term.unknown as usize] = true);
            }
        }
        weighed
    }

    /// For each row of the blocks, whether it is not the same for every step along a direction.
    pub fn moved(&self, direction: &[f64]) -> Vec<bool> {
        let mut moved = vec![false; self.rows];
        for entry in &self.entries {
            if self.terms[entry.terms.clone()].iter().any(|term| direction[term.unknown as usize] != 0.0) {
                entry.rows.iter().for_each(|&row| moved[row as usize] = true);
            }
        }
        moved
    }

    /// Bounds on the unknowns at every feasible point; `about`: a guess of τ, positive, to choose between bounds.
    pub fn reach(&self, multipliers: &[Multiplier], about: f64) -> Reach {
        let weights: Vec<f64> = multipliers.iter().flat_map(|z| z.weights.iter().copied()).collect();
        let (least, most) = self.intervals();
        let mut reach = Reach {
            a: least.iter().zip(&most).map(|(l, h)| l.abs().max(h.abs())).collect(),
            b: vec![0.0; self.unknowns],
        };
        (reach.a.iter().zip(&mut reach.b)).filter(|(a, _)| a.is_infinite()).for_each(|(_, b)| *b = f64::INFINITY);
        // Largest diagonal entries, where the unknowns in them are bounded.
        let mut diagonal = vec![f64::INFINITY; self.rows];
        for entry in self.entries.iter().filter(|entry| entry.rows[0] == entry.rows[1]) {
            let terms = &self.terms[entry.terms.clone()];
            let sum: f64 = terms.iter().map(|t| t.most() * reach.a[t.unknown as usize]).sum();
            diagonal[entry.rows[0] as usize] = 1.001 * (entry.constant.abs() + entry.error + sum);
        }
        // |entry| ≤ u + v τ.
        let size = |entry: &Entry| -> (f64, f64) {
            let [i, j] = entry.rows.map(|row| row as usize);
            let root = |a: f64, b: f64| 1.001 * a.sqrt() * b.sqrt();
            // √(g w τ) ≤ ½ (s g + w τ/s), equal where τ = s² g/w.
            let mixed = |g: f64, w: f64| {
                let s = w.sqrt() * about.sqrt() / g.sqrt();
                (0.501 * s * g, 0.501 * w / s)
            };
            let weighed = if i == j { 1.001 * weights[i] } else { 0.5 * root(weights[i], weights[j]) };
            let bounds = [
                (root(diagonal[i], diagonal[j]), 0.0),
                (0.0, weighed),
                mixed(diagonal[i], weights[j]),
                mixed(diagonal[j], weights[i]),
            ];
            let finite = bounds.into_iter().filter(|(u, v)| u.is_finite() && v.is_finite());
            let unknown = (f64::INFINITY, f64::INFINITY);
            finite.min_by(|p, q| (p.0 + p.1 * about).total_cmp(&(q.0 + q.1 * about))).unwrap_or(unknown)
        };
        let known = |reach: &Reach, unknown: u32| reach.a[unknown as usize].is_finite();
        // The bound that an entry gives one of its unknowns, from those of the others.
        let bound = |reach: &Reach, entry: &Entry, pivot: &Term| -> (f64, f64) {
            let (mut a, mut b) = size(entry);
            a += entry.constant.abs() + entry.error;
            for term in self.terms[entry.terms.clone()].iter().filter(|term| term.unknown != pivot.unknown) {
                a += term.most() * reach.a[term.unknown as usize];
                b += term.most() * reach.b[term.unknown as usize];
            }
            (1.001 * a / pivot.least(), 1.001 * b / pivot.least())
        };
        // Entries by unknown, and the number of unbounded unknowns in each.
        let mut open: Vec<u32> = (self.entries.iter())
            .map(|entry| self.terms[entry.terms.clone()].iter().filter(|t| !known(&reach, t.unknown)).count() as u32)
            .collect();
        let mut starts = vec![0_usize; self.unknowns + 1];
        self.terms.iter().for_each(|term| starts[term.unknown as usize] += 1);
        let mut sum = 0;
        for start in &mut starts {
            (*start, sum) = (sum, sum + *start);
        }
        let mut holders = vec![0_u32; self.terms.len()];
        for (at, entry) in self.entries.iter().enumerate() {
            for term in &self.terms[entry.terms.clone()] {
                let start = &mut starts[term.unknown as usize];
                holders[*start] = at as u32;
                *start += 1;
            }
        }
        let of = |unknown: usize| if unknown == 0 { 0..starts[0] } else { starts[unknown - 1]..starts[unknown] };
        let mut queue: std::collections::VecDeque<usize> =
            (0..self.entries.len()).filter(|&at| open[at] == 1).collect();
        while let Some(at) = queue.pop_front() {
            let entry = &self.entries[at];
            let Some(pivot) = self.terms[entry.terms.clone()].iter().find(|t| !known(&reach, t.unknown)) else {
                continue;
            };
            let (a, b) = bound(&reach, entry, pivot);
            if !(a.is_finite() && b.is_finite()) {
                continue;
            }
            let unknown = pivot.unknown as usize;
            (reach.a[unknown], reach.b[unknown]) = (a, b);
            for &holder in &holders[of(unknown)] {
                open[holder as usize] -= 1;
                if open[holder as usize] == 1 {
                    queue.push_back(holder as usize);
                }
            }
        }
        self.add_independent(&mut reach, about, &size);
        for _ in 0..IMPROVEMENTS {
            for entry in self.entries.iter() {
                let terms = &self.terms[entry.terms.clone()];
                if !terms.iter().all(|t| known(&reach, t.unknown)) {
                    continue;
                }
                for pivot in terms.iter().filter(|t| t.least() > 0.0) {
                    let (a, b) = bound(&reach, entry, pivot);
                    let unknown = pivot.unknown as usize;
                    if a + b * about < reach.a[unknown] + reach.b[unknown] * about && b.is_finite() {
                        (reach.a[unknown], reach.b[unknown]) = (a, b);
                    }
                }
            }
        }
        reach
    }

    /// Bounds on the unknowns that are left, from all entries that hold them at once: with M the coefficients, rows scaled by
    /// what bounds the entries and columns to length 1, `|x|₂ ≤ |entries|₂ / σ_min(M)`. λ_min(MᵀM) is proved by a Cholesky
    /// factorisation in `f64`: one that ends is that of a matrix that differs by at most n γ, γ = (n + 1)υ/(1 − (n + 1)υ), for
    /// diagonal entries of at most 1 (Demmel 1989).
    fn add_independent(&self, reach: &mut Reach, about: f64, size: &dyn Fn(&Entry) -> (f64, f64)) {
        let mut columns = vec![usize::MAX; self.unknowns];
        let mut open = Vec::new();
        for term in &self.terms {
            let unknown = term.unknown as usize;
            if reach.a[unknown].is_infinite() && columns[unknown] == usize::MAX {
                columns[unknown] = open.len();
                open.push(unknown);
            }
        }
        let n = open.len();
        if n == 0 || n > MOST_INDEPENDENT {
            return;
        }
        // Σ over the entries of A² and B², where the scaled entry is at most A + Bτ.
        let (mut a_square, mut b_square, mut error_square) = (0.0, 0.0, vec![0.0; n]);
        let mut rows: Vec<Vec<(usize, f64)>> = Vec::new();
        for entry in &self.entries {
            let terms = &self.terms[entry.terms.clone()];
            let (mut a, mut b) = size(entry);
            if !(a.is_finite() && b.is_finite()) || terms.iter().all(|t| columns[t.unknown as usize] == usize::MAX) {
                continue;
            }
            a += entry.constant.abs() + entry.error;
            for term in terms.iter().filter(|t| columns[t.unknown as usize] == usize::MAX) {
                a += term.most() * reach.a[term.unknown as usize];
                b += term.most() * reach.b[term.unknown as usize];
            }
            let scale = 1.0 / (a + b * about);
            if !(scale.is_finite() && scale > 0.0) {
                continue;
            }
            a_square += (a * scale).powi(2);
            b_square += (b * scale).powi(2);
            let mut row = Vec::new();
            for term in terms {
                let column = columns[term.unknown as usize];
                if column != usize::MAX {
                    row.push((column, term.value * scale));
                    error_square[column] += (term.error * scale).powi(2);
                }
            }
            rows.push(row);
        }
        let mut lengths = vec![0.0; n];
        rows.iter().flatten().for_each(|&(column, value)| lengths[column] += value * value);
        let units: Vec<f64> = lengths.iter().map(|square| 1.0 / square.sqrt()).collect();
        if !units.iter().all(|unit| unit.is_finite()) {
            return;
        }
        let mut gram = Mat::<f64>::zeros(n, n);
        for row in &rows {
            for &(j, v) in row {
                for &(i, u) in row {
                    gram[(i, j)] += u * units[i] * (v * units[j]);
                }
            }
        }
        let Some(estimate) = estimate::smallest_eigenvalue(&gram) else { return };
        let shift = 0.5 * estimate;
        let mut shifted: Vec<f64> = (0..n).flat_map(|j| gram.col_as_slice(j).iter().copied()).collect();
        (0..n).for_each(|i| shifted[i + i * n] -= shift);
        if !estimate::cholesky(n, &mut shifted) {
            return;
        }
        let size = n as f64;
        // Of the factorisation, and of the entries of MᵀM, sums of as many terms as there are rows.
        let rounding = 4.0 * f64::EPSILON * size * (size + rows.len() as f64 + 8.0);
        let errors: f64 = error_square.iter().zip(&units).map(|(square, unit)| square * unit * unit).sum();
        let least = (shift - rounding).max(0.0).sqrt() - 1.001 * errors.sqrt() - 8.0 * f64::EPSILON * size.sqrt();
        if least.is_nan() || least <= 0.0 {
            return;
        }
        let (a, b) = (1.001 * a_square.sqrt() / least, 1.001 * b_square.sqrt() / least);
        for (&unknown, unit) in open.iter().zip(&units) {
            (reach.a[unknown], reach.b[unknown]) = (1.001 * unit * a, 1.001 * unit * b);
        }
    }

    /// Bounds on each unknown from diagonal entries alone, which are not negative.
    fn intervals(&self) -> (Vec<f64>, Vec<f64>) {
        let mut least = vec![f64::NEG_INFINITY; self.unknowns];
        let mut most = vec![f64::INFINITY; self.unknowns];
        let diagonal: Vec<&Entry> = self.entries.iter().filter(|entry| entry.rows[0] == entry.rows[1]).collect();
        for _ in 0..ROUNDS {
            let mut changed = false;
            for entry in &diagonal {
                let terms = &self.terms[entry.terms.clone()];
                // The largest value of a term, over its coefficient and its unknown.
                let largest = |t: &Term| {
                    let unknown = t.unknown as usize;
                    let [low, high] = [least[unknown], most[unknown]];
                    let ends = [t.value - t.error, t.value + t.error].map(|c| product(c, low).max(product(c, high)));
                    ends[0].max(ends[1])
                };
                let values: Vec<f64> = terms.iter().map(largest).collect();
                let infinite = values.iter().filter(|v| v.is_infinite()).count();
                if infinite > 1 {
                    continue;
                }
                let finite: f64 = values.iter().filter(|v| v.is_finite()).sum();
                let magnitude: f64 = values.iter().filter(|v| v.is_finite()).map(|v| v.abs()).sum();
                for (term, value) in terms.iter().zip(&values) {
                    if infinite == 1 && value.is_finite() || term.least() == 0.0 {
                        continue;
                    }
                    let rest = entry.constant + if value.is_finite() { finite - value } else { finite };
                    let rounding = (terms.len() + 4) as f64 * f64::EPSILON;
                    let slack = entry.error + rounding * (entry.constant.abs() + magnitude);
                    // f x ≥ −rest − slack, f of known sign.
                    let edge = -(rest + slack) / term.value;
                    // Outwards by what the coefficient may be wrong.
                    let outwards = edge.abs() * (2.0 * term.error / term.least() + 4.0 * f64::EPSILON);
                    let unknown = term.unknown as usize;
                    if term.value > 0.0 && edge - outwards > least[unknown] {
                        changed |= worthwhile(least[unknown], edge);
                        least[unknown] = edge - outwards;
                    } else if term.value < 0.0 && edge + outwards < most[unknown] {
                        changed |= worthwhile(most[unknown], edge);
                        most[unknown] = edge + outwards;
                    }
                }
            }
            if !changed {
                break;
            }
        }
        (least, most)
    }
}

/// Whether a new bound is worth another round.
fn worthwhile(before: f64, after: f64) -> bool {
    before.is_infinite() || (before - after).abs() > 1e-3 * before.abs()
}

/// A product in which zero times infinity is zero.
fn product(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}

/// `Σ rᵢ vᵢ` rounded up, where an r of zero takes nothing from an unbounded v.
pub(crate) fn taken(r: &[f64], v: &[f64]) -> f64 {
    1.001 * r.iter().zip(v).map(|(r, v)| product(*r, *v)).sum::<f64>()
}

#[cfg(test)]
mod tests;
