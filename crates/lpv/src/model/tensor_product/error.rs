//! What cannot be transformed.

/// A transformation that cannot be made.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum TensorProductError {
    /// A function without parameters.
    #[error("the function has no parameter: there is nothing to transform")]
    NoParameter,
    /// A grid that is no grid.
    #[error("the grid of {parameter} has to have at least two finite points in ascending order")]
    Grid {
        /// Of which parameter.
        parameter: String,
    },
    /// No rule for ranks or weightings.
    #[error("at least one rank rule and one weighting are needed")]
    NoRule,
    /// An unusable rank rule.
    #[error(
        "the rank rule of {parameter} has to keep at least one singular value: a count from 1, or a tolerance in [0, 1)"
    )]
    Rank {
        /// Of which parameter.
        parameter: String,
    },
    /// A function value that is not finite or of another size than at the first grid point.
    #[error("the function is not a finite {rows} × {cols} matrix at ρ = {rho:?}")]
    Value {
        /// Rows at the first grid point.
        rows: usize,
        /// Columns at the first grid point.
        cols: usize,
        /// Where.
        rho: Vec<f64>,
    },
    /// A function that is zero everywhere.
    #[error("the function is zero at every grid point")]
    Zero,
    /// A decomposition that does not converge.
    #[error("the singular value decomposition for {parameter} does not converge, or overflows: scale the function")]
    NotConverged {
        /// Of which parameter.
        parameter: String,
    },
    /// A box with too many corners.
    #[error(
        "a box for {parameter} would have 2^{coordinates} corners; keep fewer singular values, or take another weighting"
    )]
    BoxTooLarge {
        /// Of which parameter.
        parameter: String,
        /// Its coordinates.
        coordinates: usize,
    },
    /// A least-volume hull with too many vertices.
    #[error(
        "a CNO hull for {parameter} would have {weights} vertices; keep fewer singular values, or take another weighting"
    )]
    HullTooLarge {
        /// Of which parameter.
        parameter: String,
        /// Its vertices.
        weights: usize,
    },
    /// INO-RNO weights that are not found.
    #[error("no INO-RNO weights are found for {parameter}; take \"ino\" or \"cno\"")]
    NotRelaxed {
        /// Of which parameter.
        parameter: String,
    },
}
