//! Mathematics that the rest of the library stands on: scalars for several arithmetics (dual numbers, intervals, Taylor forms, balls of any precision), small matrix helpers,
//! Riccati, Lyapunov and Stein equations, eigenvalues, stabilisability, angles, tensors and their higher-order singular value decomposition.
//!
//! Dense linear algebra is [`faer`]'s, and it is named only here (and in crate `lmi`). Nothing here knows of plants
//! or controllers.

pub mod angle;
pub mod balance;
pub mod ball;
pub mod decimal;
pub mod definite;
pub mod eigen;
mod elimination;
pub mod hold;
pub mod hosvd;
mod hurwitz;
pub mod interval;
pub mod lyapunov;
pub mod matrix;
mod residue;
pub mod riccati;
pub mod scalar;
pub mod schur_cohn;
pub mod separation;
pub mod sinc;
pub mod stabilizability;
pub mod stein;
pub mod taylor;
pub mod tensor;
pub mod unmoved;

pub use faer::Mat;
