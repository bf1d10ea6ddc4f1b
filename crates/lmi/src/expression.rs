//! Affine matrix expressions in matrix unknowns.
//!
//! An expression is `C + Σ U·X·V + Σ U·Xᵀ·V + Σ ⟨W, X⟩·N` with known matrices C, U, V, W, N and unknowns X. The terms
//! are kept as they are written and never expanded into scalar unknowns, so that the solver sees how
//! each matrix unknown enters each block.

use crate::Mat;
use crate::dense::axpy;
use std::sync::Arc;

/// A matrix unknown of one problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Unknown {
    /// The problem that owns the unknown.
    pub problem: u64,
    /// Position among the problem's unknowns.
    pub index: usize,
    pub rows: usize,
    pub cols: usize,
    pub symmetric: bool,
}

/// How an unknown enters an expression.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    /// `left · X · right`, or `left · Xᵀ · right`.
    Product { left: Mat<f64>, transposed: bool, right: Mat<f64> },
    /// `⟨weights, X⟩ · matrix`.
    Scaled { weights: Mat<f64>, matrix: Mat<f64> },
}

#[derive(Clone, Debug)]
pub(crate) struct Term {
    pub unknown: Unknown,
    pub shape: Shape,
}

/// An affine matrix expression `C + Σ U X V` in the unknowns of a [`Problem`](crate::Problem).
///
/// Expressions come from [`Problem::symmetric`](crate::Problem::symmetric),
/// [`Problem::rectangular`](crate::Problem::rectangular) and [`Problem::scalar`](crate::Problem::scalar), from
/// known matrices ([`Expr::constant`], `Expr::from(&matrix)`), and from arithmetic: `&a * &y`, `&y * &a`, `p + q`, `p - q`, `-p`,
/// `2.0 * p`, where any operand may be owned or borrowed and a known matrix may stand wherever an expression
/// can (but not both). Cloning is cheap.
///
/// # Panics
///
/// Operators and the methods below panic when sizes do not match; the message holds both sizes.
#[derive(Clone, Debug)]
pub struct Expr {
    pub(crate) constant: Arc<Mat<f64>>,
    pub(crate) terms: Arc<Vec<Term>>,
}

impl Expr {
    /// A known matrix.
    pub fn constant(matrix: Mat<f64>) -> Self {
        Self::new(matrix, Vec::new())
    }

    /// The zero matrix with `rows` rows and `cols` columns.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self::constant(Mat::zeros(rows, cols))
    }

    /// The n × n identity matrix.
    pub fn identity(n: usize) -> Self {
        Self::constant(Mat::identity(n, n))
    }

    /// The symmetric block matrix with the given lower block triangle, row by row; the upper block triangle is
    /// its transpose.
    ///
    /// Row i holds i + 1 blocks. Diagonal blocks are square and expected to be symmetric (a problem checks that
    /// when it is solved); block (i, j) has as many rows as diagonal block i and as many columns as diagonal block j.
    ///
    /// # Panics
    ///
    /// When row i does not hold i + 1 blocks or a block's size does not match its diagonal blocks.
    pub fn symmetric_blocks(rows: Vec<Vec<Expr>>) -> Self {
        let mut sizes = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            assert_eq!(
                row.len(),
                i + 1,
                "row {i} of a lower block triangle holds {} blocks, {} expected",
                row.len(),
                i + 1
            );
            let diagonal = &row[i];
            assert_eq!(
                diagonal.nrows(),
                diagonal.ncols(),
                "diagonal block ({i}, {i}) is {} × {}, a square matrix expected",
                diagonal.nrows(),
                diagonal.ncols()
            );
            sizes.push(diagonal.nrows());
        }
        let starts = starts(&sizes);
        let n = sizes.iter().sum();
        let mut out = Accumulator::new(n, n);
        for (i, row) in rows.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                check_block(block, i, j, sizes[i], sizes[j]);
                out.place(block, starts[i], starts[j]);
                if i != j {
                    out.place(&block.t(), starts[j], starts[i]);
                }
            }
        }
        out.finish()
    }

    /// The block matrix with the given blocks, row by row.
    ///
    /// # Panics
    ///
    /// When the rows differ in their number of blocks, or a block's size differs from the first one in its row
    /// or column.
    pub fn blocks(rows: Vec<Vec<Expr>>) -> Self {
        let heights: Vec<usize> = rows.iter().map(|row| row.first().map_or(0, Expr::nrows)).collect();
        let widths: Vec<usize> = rows.first().map_or(Vec::new(), |row| row.iter().map(Expr::ncols).collect());
        let (tops, lefts) = (starts(&heights), starts(&widths));
        let mut out = Accumulator::new(heights.iter().sum(), widths.iter().sum());
        for (i, row) in rows.iter().enumerate() {
            assert_eq!(
                row.len(),
                widths.len(),
                "row {i} of a block matrix holds {} blocks, {} expected",
                row.len(),
                widths.len()
            );
            for (j, block) in row.iter().enumerate() {
                check_block(block, i, j, heights[i], widths[j]);
                out.place(block, tops[i], lefts[j]);
            }
        }
        out.finish()
    }

    /// Number of rows.
    pub fn nrows(&self) -> usize {
        self.constant.nrows()
    }

    /// Number of columns.
    pub fn ncols(&self) -> usize {
        self.constant.ncols()
    }

    /// The transpose.
    pub fn t(&self) -> Self {
        let terms = self.terms.iter().map(|term| Term { unknown: term.unknown, shape: term.transposed_shape() });
        Self::new(self.constant.transpose().to_owned(), terms.collect())
    }

    /// The trace, a 1 × 1 expression.
    ///
    /// # Panics
    ///
    /// When the expression is not square.
    pub fn trace(&self) -> Self {
        assert_eq!(
            self.nrows(),
            self.ncols(),
            "trace of a {} × {} expression, a square one expected",
            self.nrows(),
            self.ncols()
        );
        let one = || Mat::from_fn(1, 1, |_, _| 1.0);
        let terms = self.terms.iter().map(|term| {
            let weights = match &term.shape {
                // tr(U X V) = ⟨(V U)ᵀ, X⟩ and tr(U Xᵀ V) = ⟨V U, X⟩.
                Shape::Product { left, transposed: false, right } => (right * left).transpose().to_owned(),
                Shape::Product { left, transposed: true, right } => right * left,
                Shape::Scaled { weights, matrix } => trace(matrix) * weights,
            };
            Term { unknown: term.unknown, shape: Shape::Scaled { weights, matrix: one() } }
        });
        Self::new(trace(&self.constant) * one(), terms.collect())
    }

    /// Row `i`, a 1 × n expression.
    ///
    /// # Panics
    ///
    /// When there is no row `i`.
    pub fn row(&self, i: usize) -> Self {
        self.rows(i..i + 1)
    }

    /// The rows in `range`.
    ///
    /// # Panics
    ///
    /// When `range` goes past the last row.
    pub fn rows(&self, range: std::ops::Range<usize>) -> Self {
        assert!(
            range.start <= range.end && range.end <= self.nrows(),
            "rows {range:?} of a {} × {} expression",
            self.nrows(),
            self.ncols()
        );
        let cut = |m: &Mat<f64>| m.subrows(range.start, range.len()).to_owned();
        self.map_left(&cut)
    }

    /// The columns in `range`.
    ///
    /// # Panics
    ///
    /// When `range` goes past the last column.
    pub fn columns(&self, range: std::ops::Range<usize>) -> Self {
        assert!(
            range.start <= range.end && range.end <= self.ncols(),
            "columns {range:?} of a {} × {} expression",
            self.nrows(),
            self.ncols()
        );
        let cut = |m: &Mat<f64>| m.subcols(range.start, range.len()).to_owned();
        self.map_right(&cut)
    }

    /// The matrix `self · matrix` for a 1 × 1 expression, such as `γ I`.
    ///
    /// # Panics
    ///
    /// When the expression is not 1 × 1.
    pub fn times(&self, matrix: &Mat<f64>) -> Self {
        assert!(
            self.nrows() == 1 && self.ncols() == 1,
            "scalar multiple of a matrix by a {} × {} expression, a 1 × 1 one expected",
            self.nrows(),
            self.ncols()
        );
        let terms = self.terms.iter().map(|term| {
            let (weights, factor) = match &term.shape {
                Shape::Product { left, transposed: false, right } => ((right * left).transpose().to_owned(), 1.0),
                Shape::Product { left, transposed: true, right } => (right * left, 1.0),
                Shape::Scaled { weights, matrix } => (weights.clone(), matrix[(0, 0)]),
            };
            Term { unknown: term.unknown, shape: Shape::Scaled { weights, matrix: factor * matrix } }
        });
        Self::new(self.constant[(0, 0)] * matrix, terms.collect())
    }

    pub(crate) fn new(constant: Mat<f64>, terms: Vec<Term>) -> Self {
        Self { constant: Arc::new(constant), terms: Arc::new(terms) }
    }

    pub(crate) fn unknown(unknown: Unknown) -> Self {
        let shape = Shape::Product {
            left: Mat::identity(unknown.rows, unknown.rows),
            transposed: false,
            right: Mat::identity(unknown.cols, unknown.cols),
        };
        Self::new(Mat::zeros(unknown.rows, unknown.cols), vec![Term { unknown, shape }])
    }

    /// Applies a map that is linear in the rows (a product from the left) to every part.
    pub(crate) fn map_left(&self, map: &dyn Fn(&Mat<f64>) -> Mat<f64>) -> Self {
        let terms = self.terms.iter().map(|term| {
            let shape = match &term.shape {
                Shape::Product { left, transposed, right } => {
                    Shape::Product { left: map(left), transposed: *transposed, right: right.clone() }
                }
                Shape::Scaled { weights, matrix } => Shape::Scaled { weights: weights.clone(), matrix: map(matrix) },
            };
            Term { unknown: term.unknown, shape }
        });
        Self::new(map(&self.constant), terms.collect())
    }

    /// Applies a map that is linear in the columns (a product from the right) to every part.
    pub(crate) fn map_right(&self, map: &dyn Fn(&Mat<f64>) -> Mat<f64>) -> Self {
        let terms = self.terms.iter().map(|term| {
            let shape = match &term.shape {
                Shape::Product { left, transposed, right } => {
                    Shape::Product { left: left.clone(), transposed: *transposed, right: map(right) }
                }
                Shape::Scaled { weights, matrix } => Shape::Scaled { weights: weights.clone(), matrix: map(matrix) },
            };
            Term { unknown: term.unknown, shape }
        });
        Self::new(map(&self.constant), terms.collect())
    }

    /// The value of the expression when `value_of` gives the value of each unknown.
    pub(crate) fn evaluate<'a>(&self, value_of: &dyn Fn(Unknown) -> &'a Mat<f64>) -> Mat<f64> {
        let mut sum = (*self.constant).clone();
        for term in self.terms.iter() {
            term.add_to(value_of(term.unknown), &mut sum);
        }
        sum
    }
}

impl Term {
    /// The value of the term at X = `x`.
    pub(crate) fn evaluate(&self, x: &Mat<f64>) -> Mat<f64> {
        match &self.shape {
            Shape::Product { left, transposed: false, right } => left * x * right,
            Shape::Product { left, transposed: true, right } => left * x.transpose() * right,
            Shape::Scaled { weights, matrix } => inner_product(weights, x) * matrix,
        }
    }

    /// sum ← sum + the value of the term at X = `x`. Most of U and V is zero where the term stands in a corner of a block.
    fn add_to(&self, x: &Mat<f64>, sum: &mut Mat<f64>) {
        let Shape::Product { left, transposed, right } = &self.shape else {
            *sum += self.evaluate(x);
            return;
        };
        let inner = left.ncols();
        let mut xv = vec![0.0; inner];
        for column in 0..right.ncols() {
            xv.fill(0.0);
            for (k, v) in right.col_as_slice(column).iter().enumerate().filter(|(_, v)| **v != 0.0) {
                match transposed {
                    true => xv.iter_mut().enumerate().for_each(|(i, xv)| *xv += v * x[(k, i)]),
                    false => axpy(*v, x.col_as_slice(k), &mut xv),
                }
            }
            let out = sum.col_as_slice_mut(column);
            xv.iter()
                .enumerate()
                .filter(|(_, xv)| **xv != 0.0)
                .for_each(|(i, xv)| axpy(*xv, left.col_as_slice(i), out));
        }
    }

    fn transposed_shape(&self) -> Shape {
        match &self.shape {
            Shape::Product { left, transposed, right } => Shape::Product {
                left: right.transpose().to_owned(),
                // A symmetric unknown is its own transpose; one form for it lets equal terms be recognised.
                transposed: !transposed && !self.unknown.symmetric,
                right: left.transpose().to_owned(),
            },
            Shape::Scaled { weights, matrix } => {
                Shape::Scaled { weights: weights.clone(), matrix: matrix.transpose().to_owned() }
            }
        }
    }
}

impl From<Mat<f64>> for Expr {
    fn from(matrix: Mat<f64>) -> Self {
        Self::constant(matrix)
    }
}

impl From<&Mat<f64>> for Expr {
    fn from(matrix: &Mat<f64>) -> Self {
        Self::constant(matrix.clone())
    }
}

/// A block matrix under construction.
struct Accumulator {
    constant: Mat<f64>,
    terms: Vec<Term>,
}

impl Accumulator {
    fn new(rows: usize, cols: usize) -> Self {
        Self { constant: Mat::zeros(rows, cols), terms: Vec::new() }
    }

    fn place(&mut self, block: &Expr, top: usize, left: usize) {
        let (rows, cols) = (self.constant.nrows(), self.constant.ncols());
        let (height, width) = (block.nrows(), block.ncols());
        let deep = |m: &Mat<f64>| {
            let mut out = Mat::zeros(rows, m.ncols());
            out.submatrix_mut(top, 0, height, m.ncols()).copy_from(m);
            out
        };
        let wide = |m: &Mat<f64>| {
            let mut out = Mat::zeros(m.nrows(), cols);
            out.submatrix_mut(0, left, m.nrows(), width).copy_from(m);
            out
        };
        self.constant.submatrix_mut(top, left, height, width).copy_from(&*block.constant);
        for term in block.terms.iter() {
            let shape = match &term.shape {
                Shape::Product { left, transposed, right } => {
                    Shape::Product { left: deep(left), transposed: *transposed, right: wide(right) }
                }
                Shape::Scaled { weights, matrix } => {
                    Shape::Scaled { weights: weights.clone(), matrix: wide(&deep(matrix)) }
                }
            };
            self.terms.push(Term { unknown: term.unknown, shape });
        }
    }

    fn finish(self) -> Expr {
        Expr::new(self.constant, self.terms)
    }
}

fn check_block(block: &Expr, i: usize, j: usize, rows: usize, cols: usize) {
    assert!(
        block.nrows() == rows && block.ncols() == cols,
        "block ({i}, {j}) is {} × {}, {rows} × {cols} expected",
        block.nrows(),
        block.ncols()
    );
}

fn starts(sizes: &[usize]) -> Vec<usize> {
    sizes
        .iter()
        .scan(0, |at, size| {
            let start = *at;
            *at += size;
            Some(start)
        })
        .collect()
}

fn trace(m: &Mat<f64>) -> f64 {
    (0..m.nrows().min(m.ncols())).map(|i| m[(i, i)]).sum()
}

/// ⟨a, b⟩ = Σ aᵢⱼ bᵢⱼ.
pub(crate) fn inner_product(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    (0..a.ncols()).map(|j| (0..a.nrows()).map(|i| a[(i, j)] * b[(i, j)]).sum::<f64>()).sum()
}
