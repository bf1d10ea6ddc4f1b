//! The models that a file can name.

use super::constant::ConstantError;
use super::nata::{self, NataParameters};
use super::parameter::LiteratureParameter;
use super::pendulum_cart::{self, PendulumCartParameters};
use super::tora::{self, ToraParameters};
use crate::math::Mat;
use crate::math::scalar::Scalar;
use crate::plant::Signal;
use serde::{Deserialize, Serialize};

/// A model by name, with its constants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
pub enum LiteratureModel {
    /// Translational oscillator with a rotational actuator.
    Tora(ToraParameters),
    /// Prototypical aeroelastic wing section.
    Nata(NataParameters),
    /// Inverted pendulum on a cart.
    PendulumCart(PendulumCartParameters),
}

impl LiteratureModel {
    /// The names in files, each with the model of the source's constants.
    pub fn all() -> [(&'static str, Self); 3] {
        [
            ("tora", Self::Tora(ToraParameters::default())),
            ("nata", Self::Nata(NataParameters::default())),
            ("pendulum-cart", Self::PendulumCart(PendulumCartParameters::default())),
        ]
    }

    /// The model called `name`, with the constants of its source.
    pub fn named(name: &str) -> Option<Self> {
        Self::all().into_iter().find(|(known, _)| *known == name).map(|(_, model)| model)
    }

    /// Whether this is the model called `name`.
    pub fn is(&self, name: &str) -> bool {
        Self::named(name).is_some_and(|known| std::mem::discriminant(&known) == std::mem::discriminant(self))
    }

    /// Whether the constants make a model.
    ///
    /// # Errors
    /// A constant that is out of its range.
    pub fn check(&self) -> Result<(), ConstantError> {
        match self {
            Self::Tora(constants) => constants.check(),
            Self::Nata(constants) => constants.check(),
            Self::PendulumCart(constants) => constants.check(),
        }
    }

    /// Where model and constants are from.
    pub fn source(&self) -> &'static str {
        match self {
            Self::Tora(_) => tora::SOURCE,
            Self::Nata(_) => nata::SOURCE,
            Self::PendulumCart(_) => pendulum_cart::SOURCE,
        }
    }

    /// The scheduling parameters ρ.
    pub fn parameters(&self) -> Vec<LiteratureParameter> {
        match self {
            Self::Tora(_) => tora::parameters(),
            Self::Nata(_) => nata::parameters(),
            Self::PendulumCart(_) => pendulum_cart::parameters(),
        }
    }

    /// The state x; the columns of S(ρ) after its components belong to the inputs.
    pub fn states(&self) -> Vec<Signal> {
        match self {
            Self::Tora(_) => Signal::list(&[("x_1", "1"), ("x_2", "1"), ("theta", "rad"), ("theta_dot", "1")]),
            Self::Nata(_) => Signal::list(&[("h", "m"), ("alpha", "rad"), ("h_dot", "m/s"), ("alpha_dot", "rad/s")]),
            Self::PendulumCart(_) => {
                Signal::list(&[("r", "m"), ("theta", "rad"), ("r_dot", "m/s"), ("theta_dot", "rad/s")])
            }
        }
    }

    /// For each parameter the number of the state that it is, from 0; `None` of one from outside, such as a wind speed. With such
    /// parameters ẋ = A(ρ(x))x + B(ρ(x))u is the nonlinear plant itself, as long as the states stay in the parameters' ranges.
    pub fn parameter_states(&self) -> Vec<Option<usize>> {
        match self {
            Self::Tora(_) => vec![Some(2), Some(3)],
            Self::Nata(_) => vec![None, Some(1)],
            Self::PendulumCart(_) => vec![Some(1), Some(3)],
        }
    }

    /// S(ρ) = [A(ρ) B(ρ)], n × (n + m).
    ///
    /// # Panics
    /// If `rho` has fewer components than [`parameters`](Self::parameters).
    pub fn at(&self, rho: &[f64]) -> Mat<f64> {
        let (entries, rows) = (self.over(rho), self.states().len());
        let columns = entries.len() / rows;
        Mat::from_fn(rows, columns, |i, j| entries[i * columns + j])
    }

    /// S(ρ) in row order, over any arithmetic: over intervals it holds S of every ρ in them.
    ///
    /// # Panics
    /// If `rho` has fewer components than [`parameters`](Self::parameters).
    pub fn over<S: Scalar>(&self, rho: &[S]) -> Vec<S> {
        match self {
            Self::Tora(constants) => constants.over(rho),
            Self::Nata(constants) => constants.over(rho),
            Self::PendulumCart(constants) => constants.over(rho),
        }
    }
}
