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

    /// σ: the largest symmetric deviation from `operating_input` that each input can make; infinite where it is not limited.
    ///
    /// For an asymmetric range this is the smaller side, so that a design made for |u − u*| ≤ σ is sound for the real
    /// limits. The differences are those of floating point: for proofs see [`InputLimits::room`].
    pub fn symmetric_bound(&self, operating_input: &[f64]) -> Vec<f64> {
        let side = |distance: Option<f64>| distance.unwrap_or(f64::INFINITY);
        (0..operating_input.len())
            .map(|i| {
                let below = side(self.min[i].map(|min| operating_input[i] - min));
                let above = side(self.max[i].map(|max| max - operating_input[i]));
                below.min(above)
            })
            .collect()
    }

    /// The same, never more than the exact differences; not below zero.
    pub fn room(&self, operating_input: &[f64]) -> Vec<f64> {
        let difference = |a: f64, b: f64| {
            if a == b {
                return 0.0;
            }
            let d = a - b;
            // what the subtraction rounded away (O. Møller, D. E. Knuth)
            let v = d - a;
            let lost = (a - (d - v)) + (-b - v);
            if lost < 0.0 || lost.is_nan() && d.is_finite() { d.next_down() } else { d }
        };
        (0..operating_input.len())
            .map(|i| {
                let below = self.min[i].map_or(f64::INFINITY, |min| difference(operating_input[i], min));
                let above = self.max[i].map_or(f64::INFINITY, |max| difference(max, operating_input[i]));
                if crate::mutant::is("larger-side") {
                    return below.max(above);
                }
                if crate::mutant::is("one-sided-is-free") && below.max(above).is_infinite() {
                    return f64::INFINITY;
                }
                below.min(above).max(0.0)
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
        assert_eq!(limits.symmetric_bound(&[4.0]), [4.0]);
        assert_eq!(InputLimits::none(1).symmetric_bound(&[4.0]), [f64::INFINITY]);
    }

    #[test]
    fn an_input_has_its_own_room() {
        let (infinite, none) = (f64::INFINITY, None);
        let limits = InputLimits {
            min: vec![Some(-1.0), none, Some(0.0), Some(-infinite), Some(2.0)],
            max: vec![none, none, Some(3.0), Some(infinite), Some(3.0)],
        };
        assert_eq!(limits.room(&[0.0, 0.0, 1.0, 0.0, 2.0]), [1.0, infinite, 1.0, infinite, 0.0]);
        // 1 − 2⁻⁵⁴ is less than the double 1
        let tiny = 0.5_f64.powi(54);
        let close = InputLimits { min: vec![Some(tiny)], max: vec![None] };
        assert_eq!(close.symmetric_bound(&[1.0]), [1.0]);
        assert_eq!(close.room(&[1.0]), [1.0_f64.next_down()]);
    }
}
