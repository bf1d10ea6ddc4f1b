//! Gain-scheduled control of nonlinear plants with saturating actuators.
//!
//! plant → LPV model → synthesis → design → check → closed-loop flight. Between two stages there is plain, serialisable
//! data. A module uses only what stands to its left:
//!
//! `math → plant → model → controller → synthesis → certificate → estimator → sim`
//!
//! `certificate` checks a design from the plant alone and never calls the solver; `sim` never designs. The sign
//! convention is u = u* − sat(K(ρ)(x − x_ref)) throughout; SI units and radians.

pub mod certificate;
pub mod controller;
pub mod estimator;
pub mod math;
pub mod model;
#[cfg(not(feature = "mutants"))]
mod mutant;
#[cfg(feature = "mutants")]
pub mod mutant;
pub mod plant;
pub mod sim;
pub mod synthesis;
