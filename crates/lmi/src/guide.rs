//! Pages on what the answers mean. Their examples are compiled and run.

#[doc = include_str!("../../../docs/lmi/infeasible.md")]
pub mod infeasible {}

#[doc = include_str!("../../../docs/lmi/unbounded.md")]
pub mod unbounded {}

#[doc = include_str!("../../../docs/lmi/numerics.md")]
pub mod numerics {}

#[doc = include_str!("../../../docs/lmi/strict_inequalities.md")]
pub mod strict_inequalities {}
