//! Covariances of the noise that acts on a sampled plant.

use crate::math::Mat;
use crate::math::matrix::rows;
use serde::{Deserialize, Serialize};

/// Discrete covariances of process and measurement noise at sample time T, thesis (6.10)-(6.11).
///
/// The white noises that they stand for have Q_c = Q_d/T (2.42) and R_c = R_d T (2.47).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NoiseCovariance {
    /// Q_d, n_w × n_w: covariance of the disturbance's integral over one sample.
    #[serde(with = "rows")]
    pub process: Mat<f64>,
    /// R_d, n_y × n_y: covariance of a sampled measurement.
    #[serde(with = "rows")]
    pub measurement: Mat<f64>,
}
