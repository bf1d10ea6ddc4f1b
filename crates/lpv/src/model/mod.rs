//! LPV models as plain data: ẋ = A(ρ)(x − x*) + B(ρ)(u − u*) (3.32).
//!
//! [`FrozenModel`] is the linearisation at one parameter value, [`GridModel`] a grid of them, [`PolytopicModel`] the
//! hull of the features that the matrices are affine in. Nothing here designs or simulates.

mod grid;
mod polytopic;

pub use grid::{FrozenModel, GridModel, linearize, parameter_grid};
pub use polytopic::{BoxWeights, PolytopicModel};
