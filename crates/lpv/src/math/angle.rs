//! Angles in radians.

use std::f64::consts::{PI, TAU};

/// The angle congruent to `angle_rad` in [−π, π).
///
/// A difference of headings has to be wrapped before it is fed back: a vehicle at 179° that is sent to −179° turns by
/// 2°, not by −358°.
pub fn wrap(angle_rad: f64) -> f64 {
    let wrapped = (angle_rad + PI).rem_euclid(TAU) - PI;
    // rem_euclid may round up to TAU itself
    if wrapped >= PI { wrapped - TAU } else { wrapped }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn wrapped_angle_is_congruent_and_in_range(angle in -1e4..1e4f64) {
            let wrapped = wrap(angle);
            prop_assert!((-PI..PI).contains(&wrapped));
            let turns = (angle - wrapped) / TAU;
            prop_assert!((turns - turns.round()).abs() < 1e-9);
        }
    }

    #[test]
    fn half_turn_goes_to_minus_pi() {
        assert_eq!(wrap(PI), -PI);
        assert_eq!(wrap(-PI), -PI);
        assert_eq!(wrap(0.5), 0.5);
    }
}
