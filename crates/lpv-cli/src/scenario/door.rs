//! Where bad values are refused.

use crate::failure::Failure;
use std::path::Path;

/// The file that values are checked for: every refusal names it, the key, and what is allowed.
pub(crate) struct Door<'a> {
    pub file: &'a Path,
}

impl Door<'_> {
    pub fn refuse<T>(&self, key: impl Into<String>, message: impl Into<String>) -> Result<T, Failure> {
        Err(Failure::BadInput { file: self.file.to_owned(), key: key.into(), message: message.into() })
    }

    pub fn positive(&self, key: &str, value: f64) -> Result<f64, Failure> {
        match value.is_finite() && value > 0.0 {
            true => Ok(value),
            false => self.refuse(key, format!("is {value}: it has to be a positive, finite number")),
        }
    }

    pub fn finite(&self, key: &str, value: f64) -> Result<f64, Failure> {
        match value.is_finite() {
            true => Ok(value),
            false => self.refuse(key, format!("is {value}: it has to be finite")),
        }
    }
}
