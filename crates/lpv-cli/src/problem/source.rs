//! The models of a problem file, whichever way they were given.

use crate::certify::polytopic::Transformed;
use lpv::model::{FrozenModel, Polytope};
use lpv::plant::{Plant, Signal};

/// The models of a file, before it is known what for.
pub(super) struct Source {
    pub models: Vec<FrozenModel>,
    pub places: Vec<String>,
    /// Of matrices: the polytope, of which the models may be points.
    pub polytope: Option<Polytope>,
    pub plant: Option<Box<dyn Plant>>,
    /// The states, where they have names.
    pub states: Vec<Signal>,
    /// Of a tensor-product model: where the vertices come from.
    pub transformed: Option<Transformed>,
}
