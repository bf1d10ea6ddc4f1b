//! Integration tests, one binary.

mod plants;
mod quadrotor;
