//! The plants that a file can name, each with its parameters.

use super::double_integrator::DoubleIntegrator;
use super::equations::Plant;
use super::linear::{Linear, LinearParameters};
use super::parameter_error::PlantParameterError;
use super::pendulum::Pendulum;
use super::quadrotor::{Quadrotor, QuadrotorParameters};
use serde::{Deserialize, Serialize};

/// A plant by name, with its parameters: plain data that a design carries so that it can be checked again later.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
pub enum PlantSpec {
    /// [`Quadrotor`]
    Quadrotor(QuadrotorParameters),
    /// [`Pendulum`]
    Pendulum {},
    /// [`DoubleIntegrator`]
    DoubleIntegrator {},
    /// [`Linear`]
    Linear(LinearParameters),
}

impl PlantSpec {
    /// A fingerprint of the plant with its parameters: 16 hexadecimal digits, the same exactly for the same plant. Two plants
    /// share one by chance only (FNV-1a, 64 bits, of the plant as JSON).
    pub fn fingerprint(&self) -> String {
        let text = serde_json::to_string(self).unwrap_or_default();
        let hash = text
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
        format!("{hash:016x}")
    }

    /// The plant.
    ///
    /// # Errors
    /// A parameter that is not positive and finite.
    pub fn build(&self) -> Result<Box<dyn Plant>, PlantParameterError> {
        match self {
            PlantSpec::Quadrotor(parameters) => {
                for (parameter, value) in parameters.named() {
                    if !(value.is_finite() && value > 0.0) {
                        return Err(PlantParameterError::NotPositive { parameter, value });
                    }
                }
                Ok(Box::new(Quadrotor::new(*parameters)))
            }
            PlantSpec::Pendulum {} => Ok(Box::new(Pendulum::default())),
            PlantSpec::DoubleIntegrator {} => Ok(Box::new(DoubleIntegrator::default())),
            PlantSpec::Linear(parameters) => Ok(Box::new(Linear::new(parameters)?)),
        }
    }
}
