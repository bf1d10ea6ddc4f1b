//! Constants of models, and what they may be.

/// A constant that makes no model.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{constant} is {value}: {allowed}")]
pub struct ConstantError {
    /// Which.
    pub constant: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed.
    pub allowed: &'static str,
}

impl ConstantError {
    pub(super) fn unless(holds: bool, constant: &'static str, value: f64, allowed: &'static str) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(Self { constant, value, allowed }) }
    }

    pub(super) fn unless_positive(constant: &'static str, value: f64) -> Result<(), Self> {
        let holds = value.is_finite() && value > 0.0;
        Self::unless(holds, constant, value, "it has to be a positive, finite number")
    }

    pub(super) fn unless_finite(constant: &'static str, value: f64) -> Result<(), Self> {
        Self::unless(value.is_finite(), constant, value, "it has to be finite")
    }
}
