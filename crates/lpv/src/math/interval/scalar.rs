//! Intervals as scalars of a plant's equations.

use super::Interval;
use crate::math::scalar::Scalar;
use crate::math::sinc::sinc_and_derivatives;

impl Scalar for Interval {
    fn sin_cos(self) -> (Self, Self) {
        Interval::sin_cos(self)
    }

    fn sinc(self) -> Self {
        sinc_and_derivatives(self)[0]
    }
}
