//! The LPV model that a tensor-product model was made of, as plain data: what a proof needs to be about the model itself and not about
//! its approximation.

use super::linearize;
use super::literature::LiteratureModel;
use crate::math::Mat;
use crate::math::taylor::Taylor;
use crate::plant::{Plant, PlantSpec, Signal};
use serde::{Deserialize, Serialize};

/// A function S(ρ) = [A(ρ) B(ρ)] by name, with its constants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelSource {
    /// A model of the literature.
    Literature(LiteratureModel),
    /// The linearisation of a plant with a scheduling parameter.
    Plant(PlantSpec),
}

/// A scheduling parameter of a [`ModelSource`].
#[derive(Clone, Debug, PartialEq)]
pub struct SourceParameter {
    /// Symbol.
    pub name: String,
    /// Unit; `1` for a number.
    pub unit: String,
    /// Number of the state that it is, from 0, where the model is the nonlinear plant in quasi-LPV form; `None` otherwise.
    pub state: Option<usize>,
}

/// A source that makes no LPV model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct SourceError(String);

/// A source, ready to be evaluated.
pub struct SourceModel {
    function: Function,
    /// Components of x.
    pub states: Vec<Signal>,
    /// ρ, in order.
    pub parameters: Vec<SourceParameter>,
    /// m, the number of inputs.
    pub inputs: usize,
}

enum Function {
    Literature(LiteratureModel),
    Plant(Box<dyn Plant>),
}

impl ModelSource {
    /// Its name in files.
    pub fn name(&self) -> String {
        match self {
            Self::Literature(model) => {
                LiteratureModel::all().iter().find(|(name, _)| model.is(name)).map_or("", |(name, _)| name).into()
            }
            Self::Plant(spec) => spec.build().map_or(String::new(), |plant| plant.description().name.clone()),
        }
    }

    /// The model, ready to be evaluated.
    ///
    /// # Errors
    /// Constants that make no model, a plant without a scheduling parameter.
    pub fn build(&self) -> Result<SourceModel, SourceError> {
        match self {
            Self::Literature(model) => {
                model.check().map_err(|error| SourceError(error.to_string()))?;
                let parameters = (model.parameters().into_iter().zip(model.parameter_states()))
                    .map(|(p, state)| SourceParameter { name: p.name.into(), unit: p.unit.into(), state })
                    .collect::<Vec<_>>();
                let states = model.states();
                let at = model.at(&vec![0.0; parameters.len()]);
                let inputs = at.ncols() - at.nrows();
                Ok(SourceModel { function: Function::Literature(*model), states, parameters, inputs })
            }
            Self::Plant(spec) => {
                let plant = spec.build().map_err(|error| SourceError(error.to_string()))?;
                let description = plant.description();
                let Some(scheduling) = &description.scheduling else {
                    return Err(SourceError(format!("\"{}\" has no scheduling parameter", description.name)));
                };
                // a linearisation is not the plant, whatever its parameter is
                let (name, unit) = (scheduling.parameter.clone(), scheduling.unit.clone());
                let parameters = vec![SourceParameter { name, unit, state: None }];
                let (states, inputs) = (description.states.clone(), description.inputs.len());
                Ok(SourceModel { function: Function::Plant(plant), states, parameters, inputs })
            }
        }
    }
}

impl SourceModel {
    /// A(ρ), n × n, and B(ρ), n × m, in row order, as Taylor forms: enclosures of every member of `rho`.
    ///
    /// # Panics
    /// If `rho` has fewer components than there are parameters.
    pub fn over(&self, rho: &[Taylor]) -> (Vec<Taylor>, Vec<Taylor>) {
        match &self.function {
            Function::Literature(model) => {
                let (entries, n) = (model.over(rho), self.states.len());
                let width = n + self.inputs;
                let (a, b): (Vec<_>, Vec<_>) = entries.into_iter().enumerate().partition(|(at, _)| at % width < n);
                let values = |part: Vec<(usize, Taylor)>| part.into_iter().map(|(_, entry)| entry).collect();
                (values(a), values(b))
            }
            Function::Plant(plant) => {
                let (x, u) = plant.trim_over(rho[0]);
                plant.jacobians_over(&x, &u)
            }
        }
    }

    /// [A(ρ) B(ρ)] in floating point.
    ///
    /// # Panics
    /// If `rho` has fewer components than there are parameters.
    pub fn at(&self, rho: &[f64]) -> Mat<f64> {
        match &self.function {
            Function::Literature(model) => model.at(rho),
            Function::Plant(plant) => {
                let point = linearize(&**plant, rho[0]);
                let n = point.a.ncols();
                Mat::from_fn(n, n + self.inputs, |i, j| if j < n { point.a[(i, j)] } else { point.b[(i, j - n)] })
            }
        }
    }
}
