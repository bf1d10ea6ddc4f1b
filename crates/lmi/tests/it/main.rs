//! Integration tests, one binary.

mod bounded_real;
mod generation;
mod hostile;
mod modelling;
mod outcomes;
mod plants;
mod quadrotor;
mod random;
mod regulator;
mod scaling;
mod sdpa_format;
mod sdplib;
mod stages;
mod truth;
