//! What a plant parameter may not be.

/// A plant parameter that makes no plant.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum PlantParameterError {
    /// A physical parameter that is not positive and finite.
    #[error("{parameter} is {value}: it has to be a positive, finite number")]
    NotPositive {
        /// Which parameter.
        parameter: &'static str,
        /// Its value.
        value: f64,
    },
    /// A matrix of the wrong size.
    #[error("{matrix} is {rows} × {columns}: it has to be {expected}")]
    Shape {
        /// Which matrix.
        matrix: &'static str,
        /// Its rows.
        rows: usize,
        /// Its columns; of the first row that differs from the others, if one does.
        columns: usize,
        /// What is allowed.
        expected: String,
    },
    /// A matrix with a non-finite entry.
    #[error("{matrix} has an entry that is not finite")]
    NotFinite {
        /// Which matrix.
        matrix: &'static str,
    },
}
