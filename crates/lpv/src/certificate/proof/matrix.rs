//! Matrices of Taylor forms, and the proof that a symmetric one is positive definite over a cell.

use crate::math::Mat;
use crate::math::eigen::{smallest_eigenvalue, smallest_eigenvector};
use crate::math::interval::Interval;
use crate::math::matrix::cholesky_inverse;
use crate::math::taylor::Taylor;

/// A matrix of functions of the cell's variable, in row order.
#[derive(Clone, Debug)]
pub(super) struct TaylorMatrix {
    rows: usize,
    columns: usize,
    entries: Vec<Taylor>,
}

impl TaylorMatrix {
    pub fn new(rows: usize, columns: usize, entries: Vec<Taylor>) -> Self {
        debug_assert_eq!(entries.len(), rows * columns);
        Self { rows, columns, entries }
    }

    pub fn constant(matrix: &Mat<f64>) -> Self {
        Self::from_fn(matrix.nrows(), matrix.ncols(), |i, j| Taylor::from(matrix[(i, j)]))
    }

    pub fn from_fn(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> Taylor) -> Self {
        Self { rows, columns, entries: (0..rows * columns).map(|at| entry(at / columns, at % columns)).collect() }
    }

    pub fn at(&self, i: usize, j: usize) -> Taylor {
        self.entries[i * self.columns + j]
    }

    pub fn times(&self, other: &Self) -> Self {
        debug_assert_eq!(self.columns, other.rows);
        let (zero, columns) = (Taylor::from(0.0), other.columns);
        let mut product = Self::new(self.rows, other.columns, vec![zero; self.rows * other.columns]);
        for i in 0..self.rows {
            for k in 0..self.columns {
                let factor = self.at(i, k);
                if factor.is_zero() {
                    continue;
                }
                for j in 0..other.columns {
                    let other = other.at(k, j);
                    if !other.is_zero() {
                        let sum = &mut product.entries[i * columns + j];
                        *sum = *sum + factor * other;
                    }
                }
            }
        }
        product
    }

    /// Mᵀ D M for a constant symmetric D, each entry of the symmetric product once.
    pub fn quadratic(&self, weight: &Mat<f64>) -> Self {
        let weighted = Self::from_fn(self.rows, self.columns, |i, j| {
            let terms = (0..self.rows).filter(|&k| weight[(i, k)] != 0.0);
            terms.fold(Taylor::from(0.0), |sum, k| sum + self.at(k, j) * weight[(i, k)])
        });
        let n = self.columns;
        let mut product = Self::new(n, n, vec![Taylor::from(0.0); n * n]);
        for i in 0..n {
            for j in i..n {
                let terms = (0..self.rows).map(|k| (self.at(k, i), weighted.at(k, j)));
                let sum = terms
                    .filter(|(a, b)| !a.is_zero() && !b.is_zero())
                    .fold(Taylor::from(0.0), |sum, (a, b)| sum + a * b);
                product.entries[i * n + j] = sum;
                product.entries[j * n + i] = sum;
            }
        }
        product
    }

    pub fn transpose(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self.at(j, i))
    }

    pub fn negated(&self) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| -self.at(i, j))
    }

    pub fn minus(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| self.at(i, j) - other.at(i, j))
    }

    pub fn plus(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| self.at(i, j) + other.at(i, j))
    }
}

/// M(t) ∈ value + (t − c) slope + ½(t − c)² bend on a cell, symmetric, n × n in row order.
#[derive(Clone, Debug)]
pub(super) struct CellMatrix {
    n: usize,
    value: Vec<Interval>,
    slope: Vec<Interval>,
    bend: Vec<Interval>,
}

/// What is known of a symmetric matrix on a cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Definiteness {
    /// Positive definite on the whole cell; with L⁻¹ML⁻ᵀ ⪰ margin·I for a factor L of its value in the middle.
    Proved(f64),
    /// Not positive definite in the middle: zᵀMz is proved to be negative, at most `value` for the unit vector z.
    Refuted {
        /// z
        direction: Vec<f64>,
        /// Proved upper bound on zᵀMz.
        value: f64,
    },
    /// Neither: a smaller cell may tell, unless the middle itself is on the edge.
    Open {
        /// Half-width of a cell around the same middle that would be proved; 0 if none.
        fits: f64,
    },
}

impl CellMatrix {
    /// From the Taylor forms at the middle and over the cell; the symmetric part is taken.
    pub fn new(middle: &TaylorMatrix, over: &TaylorMatrix) -> Self {
        let n = middle.rows;
        let half = |x: Interval| x * 0.5;
        let entry = |at: usize| (at / n, at % n);
        let symmetric = |of: &dyn Fn(usize, usize) -> Interval| -> Vec<Interval> {
            (0..n * n).map(entry).map(|(i, j)| half(of(i, j) + of(j, i))).collect()
        };
        Self {
            n,
            value: symmetric(&|i, j| middle.at(i, j).value),
            slope: symmetric(&|i, j| middle.at(i, j).slope),
            bend: symmetric(&|i, j| over.at(i, j).bend.unwrap_or(Interval::ENTIRE)),
        }
    }

    /// Σ wₖMₖ.
    pub fn combination(terms: &[(f64, &CellMatrix)]) -> Self {
        let n = terms[0].1.n;
        let sum = |of: &dyn Fn(&CellMatrix) -> &Vec<Interval>| -> Vec<Interval> {
            let at = |at: usize| {
                (terms.iter()).filter(|(w, _)| *w != 0.0).fold(Interval::point(0.0), |sum, (w, m)| sum + of(m)[at] * *w)
            };
            (0..n * n).map(at).collect()
        };
        Self { n, value: sum(&|m| &m.value), slope: sum(&|m| &m.slope), bend: sum(&|m| &m.bend) }
    }

    /// The value in the middle, as numbers.
    pub fn middle(&self) -> Mat<f64> {
        Mat::from_fn(self.n, self.n, |i, j| self.value[i * self.n + j].middle())
    }

    /// Nothing is known.
    pub fn unbounded(n: usize) -> Self {
        let entire = vec![Interval::ENTIRE; n * n];
        Self { n, value: entire.clone(), slope: entire.clone(), bend: entire }
    }

    /// Is −M, or M, positive definite for all |t − c| ≤ `half`?
    ///
    /// With T ≈ L⁻ᵀ for M(c) ≈ LLᵀ the matrix TᵀM(t)T is near I; it is positive definite, and with it M(t) and T regular, if
    /// every row of its difference to I sums to less than 1 in absolute values (Gershgorin).
    pub fn is_positive(&self, half: f64) -> Definiteness {
        let n = self.n;
        let middle = self.middle();
        let Some(inverse) = cholesky_inverse(&middle) else { return self.refutation(&middle) };
        // Tᵀ = L⁻¹, row order
        let factor = |i: usize, j: usize| inverse[(i, j)];
        let value = congruence(n, &factor, &self.value);
        let slope = congruence(n, &factor, &self.slope);
        let bend = congruence(n, &factor, &self.bend);
        let half = Interval::point(half);
        let sums = |i: usize| {
            (0..n).fold([Interval::point(0.0); 3], |[constant, linear, quadratic], j| {
                let at = i * n + j;
                let identity = if i == j { 1.0 } else { 0.0 };
                [
                    constant + Interval::point((value[at] - identity).magnitude()),
                    linear + Interval::point(slope[at].magnitude()),
                    quadratic + Interval::point(bend[at].magnitude()) * 0.5,
                ]
            })
        };
        let sums: Vec<[Interval; 3]> = (0..n).map(sums).collect();
        let excess = |[constant, linear, quadratic]: &[Interval; 3]| {
            (*constant + half * *linear + half.square() * *quadratic).hi()
        };
        let largest = sums.iter().map(excess).fold(0.0, f64::max);
        if largest < 1.0 {
            return Definiteness::Proved((1.0 - largest).next_down());
        }
        // c + l h + q h² = 1
        let fits = |[constant, linear, quadratic]: &[Interval; 3]| {
            let (left, linear, quadratic) = (1.0 - constant.hi(), linear.hi(), quadratic.hi());
            2.0 * left / (linear + (linear * linear + 4.0 * quadratic * left.max(0.0)).sqrt())
        };
        let fits = sums.iter().map(fits).fold(half.hi(), f64::min);
        Definiteness::Open { fits: if fits > 0.0 { fits } else { 0.0 } }
    }

    /// zᵀM(c)z for the eigenvector z of the smallest eigenvalue, in interval arithmetic.
    fn refutation(&self, middle: &Mat<f64>) -> Definiteness {
        let n = self.n;
        let Some(direction) = smallest_eigenvector(middle).filter(|_| smallest_eigenvalue(middle) < 0.0) else {
            return Definiteness::Open { fits: 0.0 };
        };
        let form = (0..n * n).fold(Interval::point(0.0), |sum, at| {
            sum + self.value[at] * (Interval::point(direction[at / n]) * direction[at % n])
        });
        match form.hi() < 0.0 {
            true => Definiteness::Refuted { direction, value: form.hi() },
            false => Definiteness::Open { fits: 0.0 },
        }
    }
}

/// F M Fᵀ for a lower triangular F of numbers.
fn congruence(n: usize, factor: &dyn Fn(usize, usize) -> f64, matrix: &[Interval]) -> Vec<Interval> {
    let mut left = vec![Interval::point(0.0); n * n];
    for i in 0..n {
        for k in 0..=i {
            let f = Interval::point(factor(i, k));
            for j in 0..n {
                left[i * n + j] = left[i * n + j] + f * matrix[k * n + j];
            }
        }
    }
    let mut both = vec![Interval::point(0.0); n * n];
    for i in 0..n {
        for j in 0..n {
            for k in 0..=j {
                both[i * n + j] = both[i * n + j] + left[i * n + k] * factor(j, k);
            }
        }
    }
    both
}
