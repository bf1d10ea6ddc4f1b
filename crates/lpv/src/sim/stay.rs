//! How a flight kept to the conditions of a proof: the certified set, and the rate of the parameter.

use super::closed_loop::Trajectory;
use serde::Serialize;
use std::ops::Range;

/// How part of a flight kept to the certified set of its controller and to a parameter rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetStay {
    /// Largest V/γ, in the set of the member that was active.
    pub peak_share: f64,
    /// When.
    pub peak_share_time_s: f64,
    /// When the error was first outside, V > γ; `None` if never.
    pub outside_from_s: Option<f64>,
    /// Time outside.
    pub outside_s: f64,
    /// Largest rate of the parameter, per second, from one sample to the next.
    pub peak_rate: f64,
    /// When it was first above the rate that was allowed; `None` if never.
    pub fast_from_s: Option<f64>,
    /// Time above.
    pub fast_s: f64,
}

/// How `samples` of a flight kept to its sets and to the rate `allowed` of state `parameter`; `share` gives V/γ of a member from
/// what the trajectory says.
pub fn set_stay(
    trajectory: &Trajectory,
    samples: Range<usize>,
    parameter: Option<usize>,
    allowed: f64,
    share: impl Fn(usize, f64) -> f64,
) -> SetStay {
    let mut stay = SetStay {
        peak_share: 0.0,
        peak_share_time_s: 0.0,
        outside_from_s: None,
        outside_s: 0.0,
        peak_rate: 0.0,
        fast_from_s: None,
        fast_s: 0.0,
    };
    for k in samples {
        let time_s = trajectory.time_s[k];
        let duration_s = trajectory.time_s.get(k + 1).map_or(0.0, |next| next - time_s);
        let found = share(trajectory.members[k], trajectory.set_shares[k]);
        if found > stay.peak_share || found.is_nan() {
            (stay.peak_share, stay.peak_share_time_s) = (found, time_s);
        }
        if found.is_nan() || found > 1.0 {
            stay.outside_from_s.get_or_insert(time_s);
            stay.outside_s += duration_s;
        }
        let (Some(state), Some(next)) = (parameter, trajectory.states.get(k + 1)) else { continue };
        let rate = (next[state] - trajectory.states[k][state]).abs() / duration_s;
        stay.peak_rate = stay.peak_rate.max(rate);
        if rate.is_nan() || rate > allowed {
            stay.fast_from_s.get_or_insert(time_s);
            stay.fast_s += duration_s;
        }
    }
    stay
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_outside_and_above_the_rate_are_counted() {
        let trajectory = Trajectory {
            time_s: (0..5).map(|k| 0.5 * f64::from(k)).collect(),
            states: [0.0, 0.1, 1.1, 1.2, 1.2].map(|x| vec![x]).to_vec(),
            members: vec![0, 0, 1, 1, 1],
            set_shares: vec![0.5, 1.2, 0.9, 1.1, 0.2],
            ..Trajectory::default()
        };
        let stay =
            set_stay(&trajectory, 0..5, Some(0), 1.0, |member, share| if member == 1 { share / 0.9 } else { share });
        assert_eq!((stay.outside_from_s, stay.outside_s), (Some(0.5), 1.0));
        assert_eq!((stay.fast_from_s, stay.fast_s), (Some(0.5), 0.5));
        assert_eq!((stay.peak_share_time_s, stay.peak_rate), (1.5, 2.0));
    }
}
