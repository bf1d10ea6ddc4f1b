//! Problems that have no meaning.

/// Why a problem cannot be posed to the solver. What a well-posed problem can turn out to be
/// (infeasible, unbounded, …) is an [`Outcome`](crate::Outcome) instead.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// There is no inequality.
    #[error("the problem has no inequality: state at least one with positive_definite")]
    NoConstraint,
    /// A known matrix holds NaN or an infinity.
    #[error("{place} holds {value} at row {row}, column {column}: all data must be finite")]
    NotFinite {
        /// The inequality or objective.
        place: String,
        /// The entry's row.
        row: usize,
        /// The entry's column.
        column: usize,
        /// The entry.
        value: f64,
    },
    /// The left side of an inequality is not square.
    #[error("inequality \"{name}\" is {rows} × {columns}: a square, symmetric expression is needed")]
    NotSquare {
        /// The inequality.
        name: String,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
    /// The left side of an inequality is not symmetric.
    #[error(
        "inequality \"{name}\" is not symmetric: entries ({row}, {column}) and ({column}, {row}) differ by {difference:.3e}; \
         write S + S.t(), or use Expr::symmetric_blocks"
    )]
    NotSymmetric {
        /// The inequality.
        name: String,
        /// Row of the entry that differs most.
        row: usize,
        /// Its column.
        column: usize,
        /// By how much it differs from its mirror image.
        difference: f64,
    },
    /// The objective is not 1 × 1.
    #[error("the objective is {rows} × {columns}: a 1 × 1 expression is needed, such as a trace")]
    ObjectiveNotScalar {
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
    /// An expression holds an unknown of another problem.
    #[error("{place} holds an unknown of another problem: make all unknowns with the problem that is solved")]
    ForeignUnknown {
        /// The inequality or objective.
        place: String,
    },
    /// The problem is too large for a dense Schur complement.
    #[error("{unknowns} scalar unknowns: the dense solver takes at most {allowed}")]
    TooLarge {
        /// Scalar unknowns of the problem.
        unknowns: usize,
        /// The most that are taken.
        allowed: usize,
    },
    /// An entry of an [`Sdp`](crate::sdpa::Sdp) has no place in it.
    #[error(
        "F{matrix} has an entry in block {block} at ({row}, {column}), counted from 0: the problem has no such place"
    )]
    BadCoefficient {
        /// The coefficient matrix, 0 for F₀.
        matrix: usize,
        /// The block, counted from 0.
        block: usize,
        /// The row, counted from 0.
        row: usize,
        /// The column, counted from 0.
        column: usize,
    },
    /// A point to verify does not match the unknowns.
    #[error("the point does not match the unknowns: {expected} matrices of their sizes are needed, {given} are given")]
    BadPoint {
        /// Unknowns of the problem.
        expected: usize,
        /// Matrices given.
        given: usize,
    },
    /// An option is outside its range.
    #[error("option {option} is {value}: {allowed}")]
    BadOption {
        /// Its name.
        option: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
}
