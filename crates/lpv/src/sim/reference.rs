//! References: set points in time.

use serde::{Deserialize, Serialize};

/// A set point: from `time_s` on, the states `targets` (index, value) are asked for; the others stay as they were.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetPoint {
    /// When it takes effect.
    pub time_s: f64,
    /// (state index, value)
    pub targets: Vec<(usize, f64)>,
}

/// x_ref(t): constant between set points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    initial: Vec<f64>,
    set_points: Vec<SetPoint>,
}

impl Reference {
    /// Starts at `initial`; set points are taken in the order of their times.
    pub fn new(initial: Vec<f64>, mut set_points: Vec<SetPoint>) -> Self {
        set_points.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        Self { initial, set_points }
    }

    /// The set points in time order.
    pub fn set_points(&self) -> &[SetPoint] {
        &self.set_points
    }

    /// x_ref at time `t_s` (a nanosecond early counts as on time: sample times are rounded).
    pub fn at(&self, t_s: f64) -> Vec<f64> {
        let mut reference = self.initial.clone();
        for set_point in self.set_points.iter().take_while(|set_point| set_point.time_s <= t_s + 1e-9) {
            for &(state, value) in &set_point.targets {
                reference[state] = value;
            }
        }
        reference
    }

    /// When a step begins: at time zero (a flight may start away from its reference) and at each set point.
    pub fn step_times(&self) -> Vec<f64> {
        let mut times: Vec<f64> =
            std::iter::once(0.0).chain(self.set_points.iter().map(|point| point.time_s)).collect();
        times.dedup();
        times
    }

    /// The states that the set point at `time_s` moves; `None` if there is no set point at that time.
    pub fn moved_at(&self, time_s: f64) -> Option<Vec<usize>> {
        let set_point = self.set_points.iter().find(|set_point| set_point.time_s == time_s)?;
        Some(set_point.targets.iter().map(|&(state, _)| state).collect())
    }

    /// The states that some set point moves.
    pub fn moved_states(&self) -> Vec<usize> {
        let mut moved: Vec<usize> =
            self.set_points.iter().flat_map(|set_point| set_point.targets.iter().map(|&(state, _)| state)).collect();
        moved.sort_unstable();
        moved.dedup();
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn set_points_hold_until_the_next() {
        let at = |time_s, state, value| SetPoint { time_s, targets: vec![(state, value)] };
        let reference = Reference::new(vec![0.0; 2], vec![at(2.0, 1, 5.0), at(1.0, 0, 3.0)]);
        assert_eq!(reference.at(0.999), [0.0, 0.0]);
        assert_eq!(reference.at(1.0), [3.0, 0.0]);
        assert_eq!(reference.at(9.0), [3.0, 5.0]);
        assert_eq!(reference.moved_states(), [0, 1]);
        assert_eq!(reference.step_times(), [0.0, 1.0, 2.0]);
        assert_eq!(reference.moved_at(2.0), Some(vec![1]));
        assert_eq!(reference.moved_at(0.0), None);
    }
}
