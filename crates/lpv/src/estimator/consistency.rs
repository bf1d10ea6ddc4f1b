//! Is the filter as good as it says? Errors against the covariance that the filter itself reports.

use crate::math::matrix::{from_row_slice, inverse_spd, quadratic_form};
use serde::{Deserialize, Serialize};

/// Consistency of a filter over one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Consistency {
    /// Share of samples with |x̂ᵢ − xᵢ| ≤ 3σᵢ, for each state; 0.9973 for a consistent Gaussian filter.
    pub inside_three_sigma: Vec<f64>,
    /// Root mean square of x̂ᵢ − xᵢ, for each state.
    pub rms_error: Vec<f64>,
    /// Mean normalised estimation error squared eᵀP⁻¹e; the number of states for a consistent filter.
    pub nees: f64,
}

/// Accumulates [`Consistency`] sample by sample.
#[derive(Clone, Debug)]
pub struct ConsistencyStatistics {
    inside: Vec<usize>,
    squares: Vec<f64>,
    samples: usize,
    nees_sum: f64,
    nees_samples: usize,
}

impl ConsistencyStatistics {
    /// No samples yet, for `states` states.
    pub fn new(states: usize) -> Self {
        Self { inside: vec![0; states], squares: vec![0.0; states], samples: 0, nees_sum: 0.0, nees_samples: 0 }
    }

    /// Add a sample: the estimation error and the filter's covariance in row order.
    pub fn add(&mut self, error: &[f64], covariance: &[f64]) {
        let n = error.len();
        self.samples += 1;
        for (i, e) in error.iter().enumerate() {
            self.squares[i] += e * e;
            self.inside[i] += usize::from(e * e <= 9.0 * covariance[i * n + i]);
        }
        // P starts at zero when the initial state is known, and has no inverse until noise has reached every state
        if let Some(inverse) = inverse_spd(&from_row_slice(n, n, covariance)) {
            self.nees_sum += quadratic_form(&inverse, error);
            self.nees_samples += 1;
        }
    }

    /// The statistics so far.
    pub fn result(&self) -> Consistency {
        let count = self.samples as f64;
        Consistency {
            inside_three_sigma: self.inside.iter().map(|&inside| inside as f64 / count).collect(),
            rms_error: self.squares.iter().map(|sum| (sum / count).sqrt()).collect(),
            nees: self.nees_sum / self.nees_samples as f64,
        }
    }
}
