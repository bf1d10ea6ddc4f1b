//! Every way in which the program ends without success, and its exit code.

use lpv::synthesis::SynthesisError;
use std::path::{Path, PathBuf};

/// A failure to report.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Input that makes no sense.
    #[error("{}: {key}: {message}", file.display())]
    BadInput {
        /// The file.
        file: PathBuf,
        /// The key in it, dotted.
        key: String,
        /// What is wrong and what is allowed.
        message: String,
    },
    /// A file that could not be parsed; the message holds line and column.
    #[error("{}: {message}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// A folder or file that cannot be used.
    #[error("{}: {message}", path.display())]
    Output {
        /// Which.
        path: PathBuf,
        /// What is wrong and what to do.
        message: String,
    },
    /// Synthesis found no controller.
    #[error("controller \"{controller}\": {source}")]
    Synthesis {
        /// Name of the controller.
        controller: String,
        /// Why.
        source: SynthesisError,
    },
    /// A problem without an optimum.
    #[error("{0}")]
    NoOptimum(String),
    /// A required verdict was not reached.
    #[error("not certified as asked: {0}")]
    NotCertified(String),
    /// Something that cannot happen.
    #[error("a defect of lpv, please report it: {0}")]
    Defect(String),
}

impl Failure {
    /// Exit code of the program. Numbers that overflow in an inequality, and plants too large for the solver, are input.
    pub fn exit_code(&self) -> u8 {
        match self {
            Failure::Synthesis {
                source: SynthesisError::Problem(lmi::Error::NotFinite { .. } | lmi::Error::TooLarge { .. }),
                ..
            } => 2,
            Failure::Defect(_) | Failure::Synthesis { source: SynthesisError::Problem(_), .. } => 1,
            Failure::BadInput { .. }
            | Failure::Unreadable { .. }
            | Failure::Output { .. }
            | Failure::Synthesis { source: SynthesisError::UnlimitedInput { .. }, .. } => 2,
            Failure::NotCertified(_) | Failure::Synthesis { source: SynthesisError::Inaccurate { .. }, .. } => 4,
            Failure::NoOptimum(_) | Failure::Synthesis { .. } => 3,
        }
    }

    /// A failure to write or read `path`.
    pub fn io(path: &Path, error: &std::io::Error) -> Self {
        Failure::Output { path: path.to_owned(), message: error.to_string() }
    }

    /// Serialising plain data cannot fail; if it does, that is ours.
    pub fn serialisation(error: &serde_json::Error) -> Self {
        Failure::Defect(format!("result could not be written as JSON: {error}"))
    }
}
