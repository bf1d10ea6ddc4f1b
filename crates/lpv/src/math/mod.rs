//! Mathematics that the rest of the library stands on: scalars for several arithmetics (dual numbers, intervals, Taylor forms), small matrix helpers,
//! Riccati and Lyapunov equations, eigenvalues, angles.
//!
//! Dense linear algebra is [`faer`]'s, and it is named only here (and in crate `lmi`). Nothing here knows of plants
//! or controllers.

pub mod angle;
pub mod eigen;
pub mod hold;
pub mod interval;
pub mod lyapunov;
pub mod matrix;
pub mod riccati;
pub mod scalar;
pub mod taylor;

pub use faer::Mat;
