//! Mathematics that the rest of the library stands on: scalars for several arithmetics (dual numbers, intervals, Taylor forms), small matrix helpers,
//! Riccati and Lyapunov equations, eigenvalues, angles, tensors and their higher-order singular value decomposition.
//!
//! Dense linear algebra is [`faer`]'s, and it is named only here (and in crate `lmi`). Nothing here knows of plants
//! or controllers.

pub mod angle;
pub mod decimal;
pub mod definite;
pub mod eigen;
pub mod hold;
pub mod hosvd;
pub mod interval;
pub mod lyapunov;
pub mod matrix;
pub mod riccati;
pub mod scalar;
pub mod taylor;
pub mod tensor;

pub use faer::Mat;
