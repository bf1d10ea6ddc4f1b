//! Matrices of Taylor forms, and the proof that a symmetric one is positive definite over a cell.

use super::enclosed::Enclosed;
use crate::math::Mat;
use crate::math::eigen::{smallest_eigenvalue, smallest_eigenvector};
use crate::math::interval::Interval;
use crate::math::matrix::cholesky_inverse;
use crate::math::taylor::{Taylor, TaylorDual};
use crate::model::MatrixFunction;
use crate::mutant;

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

    /// M(ρ).
    pub fn of_function(function: &MatrixFunction, rho: Taylor) -> Self {
        Self::combination(function, &function.factors(&[rho]))
    }

    /// M(ρ) and ∂M/∂ρ, by dual numbers.
    pub fn of_function_and_derivative(function: &MatrixFunction, rho: Taylor) -> [Self; 2] {
        let factors = function.factors(&[TaylorDual::new(rho, true)]);
        let of = |part: fn(&TaylorDual) -> Taylor| {
            Self::combination(function, &factors.iter().map(part).collect::<Vec<Taylor>>())
        };
        [of(|factor| factor.value), of(|factor| factor.derivative)]
    }

    /// Σ fₖMₖ.
    fn combination(function: &MatrixFunction, factors: &[Taylor]) -> Self {
        let (rows, columns) = function.shape();
        let has_bend = factors.iter().all(|factor| factor.bend.is_some());
        let sums = |j: usize, part: fn(&Taylor) -> Interval| {
            let matrices = function.coefficients.iter().map(|matrix| matrix.col_as_slice(j));
            Interval::weighted_sums(rows, matrices.zip(factors.iter().map(part)))
        };
        let column = |j: usize| {
            let (values, slopes) = (sums(j, |f| f.value), sums(j, |f| f.slope));
            let bends = has_bend.then(|| sums(j, |f| f.bend.unwrap_or(Interval::ENTIRE)));
            let entry = |i: usize| Taylor { value: values[i], slope: slopes[i], bend: bends.as_ref().map(|b| b[i]) };
            (0..rows).map(entry).collect::<Vec<Taylor>>()
        };
        let entries: Vec<Vec<Taylor>> = (0..columns).map(column).collect();
        Self::from_fn(rows, columns, |i, j| entries[j][i])
    }

    /// Rows and columns.
    pub fn shape(&self) -> (usize, usize) {
        (self.rows, self.columns)
    }

    pub fn at(&self, i: usize, j: usize) -> Taylor {
        self.entries[i * self.columns + j]
    }

    /// Product, each of the products of values and derivatives by middles and radii with one bound on its rounding.
    pub fn times(&self, other: &Self) -> Self {
        debug_assert_eq!(self.columns, other.rows);
        let [left, right] = [self.parts(), other.parts()];
        let product = Enclosed::sum_of_products;
        let value = product(&[(&left.value, &right.value, 1.0)]);
        let slope = product(&[(&left.slope, &right.value, 1.0), (&left.value, &right.slope, 1.0)]);
        let bend = (left.bend.as_ref().zip(right.bend.as_ref()))
            .map(|(f, g)| product(&[(f, &right.value, 1.0), (&left.slope, &right.slope, 2.0), (&left.value, g, 1.0)]));
        let entry = |at: usize| Taylor { value: value[at], slope: slope[at], bend: bend.as_ref().map(|bend| bend[at]) };
        Self::new(self.rows, other.columns, (0..value.len()).map(entry).collect())
    }

    fn parts(&self) -> TaylorParts {
        let part = |of: &dyn Fn(&Taylor) -> Interval| Enclosed::of_entries(self.columns, self.entries.iter().map(of));
        let has_bend = self.entries.iter().all(|entry| entry.bend.is_some());
        TaylorParts {
            value: part(&|entry| entry.value),
            slope: part(&|entry| entry.slope),
            bend: has_bend.then(|| part(&|entry| entry.bend.unwrap_or(Interval::ENTIRE))),
        }
    }

    /// Mᵀ D M for a constant symmetric D.
    pub fn quadratic(&self, weight: &Mat<f64>) -> Self {
        self.transpose().times(&Self::constant(weight).times(self))
    }

    pub fn transpose(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self.at(j, i))
    }

    /// xM for a number x.
    pub fn scaled(&self, factor: f64) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| self.at(i, j) * factor)
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

/// The middles of the entries.
pub(super) fn middle(matrix: &TaylorMatrix) -> Mat<f64> {
    let (rows, columns) = matrix.shape();
    Mat::from_fn(rows, columns, |i, j| matrix.at(i, j).value.middle())
}

/// Values and derivatives of a matrix of Taylor forms.
struct TaylorParts {
    value: Enclosed,
    slope: Enclosed,
    bend: Option<Enclosed>,
}

/// M(t) ∈ value + (t − c) slope + ½(t − c)² bend on a cell, symmetric, n × n.
#[derive(Clone, Debug)]
pub(super) struct CellMatrix {
    n: usize,
    value: Enclosed,
    slope: Enclosed,
    bend: Enclosed,
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
        let symmetric = |of: &dyn Fn(usize, usize) -> Interval| Enclosed::new(n, |i, j| (of(i, j) + of(j, i)) * 0.5);
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
        let sum = |of: fn(&CellMatrix) -> &Enclosed| {
            Enclosed::combination(n, terms.iter().map(move |(weight, matrix)| (*weight, of(matrix))))
        };
        Self { n, value: sum(|m| &m.value), slope: sum(|m| &m.slope), bend: sum(|m| &m.bend) }
    }

    /// The value in the middle, as numbers.
    pub fn middle(&self) -> Mat<f64> {
        self.value.middle()
    }

    /// The inverse of the middle, as numbers; `None` where that is not definite.
    pub fn middle_inverse(&self) -> Option<Mat<f64>> {
        let factor = cholesky_inverse(&self.middle())?;
        Some(factor.transpose() * &factor)
    }

    /// Nothing is known.
    pub fn unbounded(n: usize) -> Self {
        let nothing = Enclosed::unbounded(n);
        Self { n, value: nothing.clone(), slope: nothing.clone(), bend: nothing }
    }

    /// Is −M, or M, positive definite for all |t − c| ≤ `half`?
    ///
    /// With T ≈ L⁻ᵀ for M(c) ≈ LLᵀ the matrix TᵀM(t)T is near I; it is positive definite, and with it M(t) and T regular, if
    /// every row of its difference to I sums to less than 1 in absolute values (Gershgorin).
    pub fn is_positive(&self, half: f64) -> Definiteness {
        let n = self.n;
        let middle = self.middle();
        let Some(inverse) = cholesky_inverse(&middle) else {
            return if mutant::is("margin-sign") { Definiteness::Proved(0.5) } else { self.refutation(&middle) };
        };
        // Tᵀ = L⁻¹, row order
        let factor: Vec<f64> = (0..n * n).map(|at| inverse[(at / n, at % n)]).collect();
        let half = Interval::point(if mutant::is("cells-by-their-middle") { 0.0 } else { half });
        let [constant, linear, quadratic] = [(&self.value, 1.0), (&self.slope, 0.0), (&self.bend, 0.0)]
            .map(|(matrix, identity)| matrix.row_sums_of_congruence(&factor, identity));
        let point = Interval::point;
        let sums: Vec<[Interval; 3]> =
            (0..n).map(|i| [point(constant[i]), point(linear[i]), point(quadratic[i]) * 0.5]).collect();
        let excess = |[constant, linear, quadratic]: &[Interval; 3]| {
            let linear = if mutant::is("slope-dropped") { Interval::point(0.0) } else { half * *linear };
            let rest = mutant::is("remainder-dropped").then_some(Interval::point(0.0));
            (*constant + linear + rest.unwrap_or_else(|| half.square() * *quadratic)).hi()
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
            sum + self.value.at(at / n, at % n) * (Interval::point(direction[at / n]) * direction[at % n])
        });
        match if mutant::is("lower-end-refutes") { form.lo() } else { form.hi() } < 0.0 {
            true => Definiteness::Refuted { direction, value: form.hi() },
            false => Definiteness::Open { fits: 0.0 },
        }
    }
}
