//! State estimation from noisy measurements: the continuous-time extended Kalman filter and its consistency statistics.

mod consistency;
mod ekf;
mod noise_covariance;

pub use consistency::{Consistency, ConsistencyStatistics};
pub use ekf::Ekf;
pub use noise_covariance::NoiseCovariance;
