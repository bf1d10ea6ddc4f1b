//! Actuator limits.

use serde::{Deserialize, Serialize};

/// Least and largest value of each input; `None` is no limit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InputLimits {
    /// Least values.
    pub min: Vec<Option<f64>>,
    /// Largest values.
    pub max: Vec<Option<f64>>,
}

impl InputLimits {
    /// No limits on `inputs` inputs.
    pub fn none(inputs: usize) -> Self {
        Self { min: vec![None; inputs], max: vec![None; inputs] }
    }

    /// Whether no input is limited.
    pub fn is_none(&self) -> bool {
        self.min.iter().chain(&self.max).all(Option::is_none)
    }

    /// Clip each input to its limits; true if one was clipped.
    pub fn saturate(&self, input: &mut [f64]) -> bool {
        let mut saturated = false;
        for ((value, min), max) in input.iter_mut().zip(&self.min).zip(&self.max) {
            let free = *value;
            if let Some(min) = *min {
                *value = value.max(min);
            }
            if let Some(max) = *max {
                *value = value.min(max);
            }
            saturated |= *value != free;
        }
        saturated
    }

    /// σ: the largest symmetric deviation from `operating_input` that every input can make, one for each input.
    ///
    /// For an asymmetric range this is the smaller side, so that a design made for |u − u*| ≤ σ is sound for the real
    /// limits. `None` when an input is not limited at all.
    pub fn symmetric_bound(&self, operating_input: &[f64]) -> Option<Vec<f64>> {
        let side = |distance: Option<f64>| distance.unwrap_or(f64::INFINITY);
        (0..operating_input.len())
            .map(|i| {
                let below = side(self.min[i].map(|min| operating_input[i] - min));
                let above = side(self.max[i].map(|max| max - operating_input[i]));
                Some(below.min(above)).filter(|sigma| sigma.is_finite())
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_and_tells() {
        let limits = InputLimits { min: vec![Some(0.0), None], max: vec![Some(2.0), Some(1.0)] };
        let mut input = [3.0, -5.0];
        assert!(limits.saturate(&mut input));
        assert_eq!(input, [2.0, -5.0]);
        assert!(!limits.saturate(&mut input));
    }

    #[test]
    fn bound_is_the_smaller_side() {
        let limits = InputLimits { min: vec![Some(0.0)], max: vec![Some(10.0)] };
        assert_eq!(limits.symmetric_bound(&[4.0]), Some(vec![4.0]));
        assert_eq!(InputLimits::none(1).symmetric_bound(&[4.0]), None);
    }
}
