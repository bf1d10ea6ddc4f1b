//! Where bad values are refused.

use crate::failure::Failure;
use std::path::Path;

/// Characters of a name that becomes part of a file name; file systems allow 255.
const LONGEST_NAME: usize = 100;

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

/// A name that becomes part of a file name.
pub(super) fn file_name_part(door: &Door, key: &str, name: &str) -> Result<(), Failure> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    match (1..=LONGEST_NAME).contains(&name.len()) && name.chars().all(allowed) {
        true => Ok(()),
        false => door.refuse(
            key,
            format!("{name:?}: allowed are 1 to {LONGEST_NAME} letters, digits, - and _ (it becomes a file name)"),
        ),
    }
}
