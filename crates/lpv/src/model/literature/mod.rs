//! Models of the literature of tensor-product control, as matrix-valued functions S(ρ) = [A(ρ) B(ρ)] of their parameters.
//! They share tests, examples and documentation.

mod catalogue;
mod constant;
mod nata;
mod parameter;
mod pendulum_cart;
mod tora;

pub use catalogue::LiteratureModel;
pub use constant::ConstantError;
pub use nata::NataParameters;
pub use parameter::LiteratureParameter;
pub use pendulum_cart::PendulumCartParameters;
pub use tora::ToraParameters;
