//! LPV models as plain data: ẋ = A(ρ)(x − x*) + B(ρ)(u − u*) (3.32).
//!
//! [`FrozenModel`] is the linearisation at one parameter value, [`GridModel`] a grid of them, [`PolytopicModel`] the
//! hull of the features that the matrices are affine in. Nothing here designs or simulates.

mod basis;
mod grid;
pub mod literature;
mod polytope;
mod polytopic;
mod source;
pub mod tensor_product;

pub use basis::{BasisFunction, MatrixFunction};
pub use grid::{FrozenModel, GridModel, linearize, parameter_grid};
pub use polytope::{Polytope, PolytopeError};
pub use polytopic::{BoxWeights, PolytopicModel};
pub use source::{ModelSource, SourceError, SourceModel, SourceParameter};

use crate::plant::{Plant, PlantSpec, Signal};
use serde::{Deserialize, Serialize};

/// The LPV model of a plant, as plain data: parameter, operating points, and the matrices on the grid and at the vertices.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LpvModel {
    /// The plant that it is of.
    pub plant: PlantSpec,
    /// Components of x − x*, in order.
    pub states: Vec<Signal>,
    /// Components of u − u*, in order.
    pub inputs: Vec<Signal>,
    /// The parameter with its range, rate and unit, and the linearisations over it.
    pub grid: GridModel,
    /// The polytope, for a plant with a parameter and a constant B.
    pub polytope: Option<PolytopicModel>,
}

impl LpvModel {
    /// The model of `plant`, which `spec` describes, with `grid_points` linearisations.
    pub fn of_plant(spec: &PlantSpec, plant: &dyn Plant, grid_points: usize) -> Self {
        let description = plant.description();
        Self {
            plant: spec.clone(),
            states: description.states.clone(),
            inputs: description.inputs.clone(),
            grid: GridModel::of_plant(plant, grid_points),
            polytope: PolytopicModel::of_plant(plant),
        }
    }
}
