//! Interval arithmetic with outward rounding: every result holds the exact result of the operation on all members of its
//! operands.
//!
//! After each operation of IEEE double precision, which is within half a unit of its last place of the exact result, the
//! ends are moved outwards by a few units. That is wider than directed rounding and asks nothing of the processor's rounding
//! mode. An operation without a meaning, such as division by an interval that holds zero, or one whose result is not finite,
//! gives the whole line.

mod scalar;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A closed interval [lo, hi].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    lo: f64,
    hi: f64,
}

/// π/2 lies between the double nearest to it and the next above.
const HALF_PI: Interval = Interval { lo: std::f64::consts::FRAC_PI_2, hi: std::f64::consts::FRAC_PI_2.next_up() };
/// 2⁻⁵¹, four times the relative error of an operation.
const WIDENING: f64 = 2.0 * f64::EPSILON;
/// Arguments of sine and cosine beyond this are not reduced.
const MOST_RADIANS: f64 = 1e9;

impl Interval {
    /// The whole line.
    pub const ENTIRE: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// [lo, hi]; the whole line if the ends are not in order.
    pub fn new(lo: f64, hi: f64) -> Self {
        if lo <= hi { Self { lo, hi } } else { Self::ENTIRE }
    }

    /// [x, x].
    pub const fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    /// An interval that holds 2π.
    pub fn tau() -> Self {
        HALF_PI * 4.0
    }

    /// Lower end.
    pub fn lo(self) -> f64 {
        self.lo
    }

    /// Upper end.
    pub fn hi(self) -> f64 {
        self.hi
    }

    /// A number of the interval near its middle.
    pub fn middle(self) -> f64 {
        let middle = 0.5 * self.lo + 0.5 * self.hi;
        if middle.is_finite() { middle.clamp(self.lo, self.hi) } else { 0.0 }
    }

    /// Whether it is exactly zero.
    #[inline]
    pub fn is_zero(self) -> bool {
        self.lo == 0.0 && self.hi == 0.0
    }

    /// Whether it is exactly one.
    #[inline]
    fn is_one(self) -> bool {
        self.lo == 1.0 && self.hi == 1.0
    }

    /// The largest absolute value of a member.
    pub fn magnitude(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// Whether `x` is a member.
    pub fn contains(self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }

    /// The least interval that holds both.
    pub fn hull(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// 2x, exactly.
    #[inline]
    pub fn doubled(self) -> Self {
        Self { lo: 2.0 * self.lo, hi: 2.0 * self.hi }
    }

    /// x², which is not negative.
    pub fn square(self) -> Self {
        let square = self * self;
        Self { lo: square.lo.max(0.0), hi: square.hi }
    }

    /// A number near the middle and the distance to the farther end, rounded up: the interval lies in middle ± radius.
    #[inline]
    pub fn middle_and_radius(self) -> (f64, f64) {
        if self.lo == self.hi {
            return (self.lo, 0.0);
        }
        let middle = self.middle();
        let distance = (self.hi - middle).max(middle - self.lo);
        (middle, distance + (distance * WIDENING + f64::MIN_POSITIVE))
    }

    /// middle ± radius; the whole line where that is not finite.
    #[inline]
    pub fn around(middle: f64, radius: f64) -> Self {
        if radius == 0.0 && middle.is_finite() {
            return Self::point(middle);
        }
        Self::outward(middle - radius, middle + radius)
    }

    /// Σ wₖxₖ for vectors wₖ of `len` numbers, with one bound on the rounding of all of it. A sum without a term that is not zero is
    /// exactly zero.
    ///
    /// With xₖ in mₖ ± rₖ each of N products wₖmₖ and sums is wrong by at most 2⁻⁵³ of what it adds up to and 2⁻¹⁰⁷⁵, so that the sum is at
    /// most Σ|wₖ|rₖ + (N + 1)2⁻⁵³ Σ|wₖmₖ| + N 2⁻¹⁰⁷⁵ from the exact one. Twice that and more is taken, which covers the rounding of these
    /// sums themselves for N up to a million.
    pub fn weighted_sums<'a>(len: usize, terms: impl Iterator<Item = (&'a [f64], Self)> + Clone) -> Vec<Self> {
        let terms = terms.filter(|(_, x)| !x.is_zero());
        let count = (terms.clone().count() + 4) as f64;
        let (mut middles, mut radii) = (vec![0.0; len], vec![0.0; len]);
        for (weights, x) in terms {
            let (middle, radius) = x.middle_and_radius();
            let lost = if crate::mutant::is("rounding-off") { 0.0 } else { count * f64::EPSILON };
            let radius = radius * (1.0 + 1e-9) + middle.abs() * lost + f64::MIN_POSITIVE;
            if !radius.is_finite() {
                // 0 · ∞ is no number
                weights.iter().zip(&mut radii).filter(|(w, _)| **w != 0.0).for_each(|(_, r)| *r = f64::INFINITY);
                continue;
            }
            for ((sum, total), w) in middles.iter_mut().zip(&mut radii).zip(weights) {
                *sum += w * middle;
                // what underflows to nothing is not forgotten
                *total += w.abs() * radius + if *w == 0.0 { 0.0 } else { f64::MIN_POSITIVE };
            }
        }
        middles.into_iter().zip(radii).map(|(middle, radius)| Self::around(middle, radius)).collect()
    }

    /// The ends moved outwards by more than the rounding of one operation; the whole line where one is not finite.
    ///
    /// The exact result x of an operation that gave r has |x − r| ≤ 2⁻⁵³|r| + 2⁻¹⁰⁷⁵. Adding d = 2⁻⁵¹|r| + 2⁻¹⁰²² outwards, the sum
    /// rounded by at most 2⁻⁵³(|r| + d), leaves it outside.
    #[inline]
    fn outward(lo: f64, hi: f64) -> Self {
        if crate::mutant::is("rounding-off") {
            return Self { lo, hi };
        }
        let out = Self {
            lo: lo - (lo.abs() * WIDENING + f64::MIN_POSITIVE),
            hi: hi + (hi.abs() * WIDENING + f64::MIN_POSITIVE),
        };
        if (out.hi - out.lo).is_finite() { out } else { Self::ENTIRE }
    }
}

impl From<f64> for Interval {
    fn from(x: f64) -> Self {
        if x.is_nan() { Self::ENTIRE } else { Self::point(x) }
    }
}

impl Add for Interval {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        if self.is_zero() {
            return other;
        }
        if other.is_zero() {
            return self;
        }
        Self::outward(self.lo + other.lo, self.hi + other.hi)
    }
}

impl Sub for Interval {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        if other.is_zero() {
            return self;
        }
        Self::outward(self.lo - other.hi, self.hi - other.lo)
    }
}

impl Neg for Interval {
    type Output = Self;

    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Mul for Interval {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        if self.is_zero() || other.is_zero() {
            // exactly zero, and rounded to nothing else; of an infinite end nothing is known
            let finite = self.magnitude().is_finite() && other.magnitude().is_finite();
            return if finite { Self::point(0.0) } else { Self::ENTIRE };
        }
        // so that the Jacobian of a linear plant holds the numbers of its file and no others
        if self.is_one() {
            return other;
        }
        if other.is_one() {
            return self;
        }
        let [a, b, c, d] = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        // NaN of 0 · ∞ is lost in min and max, but the other products are then infinite or NaN
        let least = if a < b { a } else { b };
        let most = if a < b { b } else { a };
        let (least, most) = (if c < least { c } else { least }, if c > most { c } else { most });
        Self::outward(if d < least { d } else { least }, if d > most { d } else { most })
    }
}

impl Div for Interval {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        if other.contains(0.0) {
            return Self::ENTIRE;
        }
        if self.is_zero() && other.magnitude().is_finite() {
            return self;
        }
        let [a, b, c, d] = [self.lo / other.lo, self.lo / other.hi, self.hi / other.lo, self.hi / other.hi];
        if a.is_nan() || b.is_nan() || c.is_nan() || d.is_nan() {
            return Self::ENTIRE;
        }
        Self::outward(a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
    }
}

macro_rules! with_numbers {
    ($($operation:ident $method:ident),*) => {$(
        impl $operation<f64> for Interval {
            type Output = Self;

            fn $method(self, other: f64) -> Self {
                $operation::$method(self, Interval::from(other))
            }
        }
    )*};
}
with_numbers!(Add add, Sub sub, Div div);

impl Mul<f64> for Interval {
    type Output = Self;

    #[inline]
    fn mul(self, factor: f64) -> Self {
        if self.is_zero() || factor == 0.0 || factor.is_nan() {
            return self * Interval::from(factor);
        }
        if self.is_one() && factor.is_finite() {
            return Self::point(factor);
        }
        let [a, b] = [self.lo * factor, self.hi * factor];
        if factor > 0.0 { Self::outward(a, b) } else { Self::outward(b, a) }
    }
}

impl Interval {
    /// Enclosures of sine and cosine, by the mean value theorem of second order around the middle m: sin(m + δ) ∈ sin m + δ cos m + [−δ²/2, δ²/2].
    pub fn sin_cos(self) -> (Self, Self) {
        let unit = Self { lo: -1.0, hi: 1.0 };
        let middle = self.middle();
        let delta = self - middle;
        if self.magnitude() > MOST_RADIANS || delta.magnitude() > 1.0 {
            return (unit, unit);
        }
        let (sin, cos) = sin_cos_of_number(middle);
        if self.lo == self.hi {
            return (sin, cos);
        }
        let half = (delta.square() * 0.5).hi;
        let bend = Self { lo: -half, hi: half };
        let within = |x: Self| Self { lo: x.lo.clamp(-1.0, 1.0), hi: x.hi.clamp(-1.0, 1.0) };
        (within(sin + delta * cos + bend), within(cos - delta * sin + bend))
    }
}

/// Enclosures of sin x and cos x, |x| ≤ 10⁹: reduction by multiples of π/2, then Taylor polynomials, whose error is at most
/// their first omitted term.
fn sin_cos_of_number(x: f64) -> (Interval, Interval) {
    let quarter = (x / HALF_PI.lo).round();
    let y = Interval::point(x) - HALF_PI * quarter;
    let square = y.square();
    // Σ (−1)ᵏ y²ᵏ⁺ᵖ/(2k + p)! for p = 0 and 1
    let series = |first: Interval, offset: f64| {
        let (mut term, mut sum, mut n) = (first, first, offset);
        for _ in 0..9 {
            term = -(term * square / ((n + 1.0) * (n + 2.0)));
            sum = sum + term;
            n += 2.0;
        }
        let rest = (term * square / ((n + 1.0) * (n + 2.0))).magnitude();
        sum + Interval { lo: -rest, hi: rest }
    };
    let (sin, cos) = (series(y, 1.0), series(Interval::point(1.0), 0.0));
    match quarter.rem_euclid(4.0) as u8 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A fraction of integers, exactly.
    #[derive(Clone, Copy)]
    struct Fraction(i128, i128);

    /// Whether a/b lies in `interval`, exactly: ends of moderate size are integers over 2^100.
    fn holds(interval: Interval, Fraction(a, b): Fraction) -> bool {
        let (a, b) = if b < 0 { (-a, -b) } else { (a, b) };
        // a/b ≥ lo, by comparing a with lo·b in double-double: the product of a double and an integer below 2^53 is exact there
        let compare = |end: f64| {
            let high = end * b as f64;
            let low = end.mul_add(b as f64, -high);
            (a as f64 - high) - low
        };
        compare(interval.lo) >= 0.0 && compare(interval.hi) <= 0.0
    }

    proptest! {
        /// Sums, differences, products and quotients of members are members.
        #[test]
        fn operations_enclose(a in -1000_i32..1000, b in -1000_i32..1000, c in 1_i32..1000, d in 1_i32..1000) {
            // eighths, and their sums and products, are exact
            let (x, y) = (f64::from(a) / 8.0, f64::from(b) / 8.0);
            let (u, v) = (Interval::new(x, x + f64::from(c) / 8.0), Interval::new(y, y + f64::from(d) / 8.0));
            for (p, q) in [(u.lo, v.lo), (u.hi, v.hi), (u.lo, v.hi), (u.middle(), v.middle())] {
                prop_assert!((u + v).contains(p + q) && (u - v).contains(p - q) && (u * v).contains(p * q));
                prop_assert!((u / v).contains(p / q) || v.contains(0.0));
            }
        }

        /// a/b is not a double in general, and its interval holds it, exactly.
        #[test]
        fn quotients_enclose_exactly(a in -1_000_000_i64..1_000_000, b in 1_i64..1_000_000) {
            let interval = Interval::point(a as f64) / Interval::point(b as f64);
            prop_assert!(holds(interval, Fraction(i128::from(a), i128::from(b))));
            prop_assert!(interval.hi - interval.lo <= 6.0 * f64::EPSILON * interval.magnitude() + 1e-300);
        }

        /// sin² + cos² = 1, and the values of the library, which errs by less than a unit of the last place.
        #[test]
        fn sine_and_cosine_enclose(x in -40.0_f64..40.0, width in 0.0_f64..0.5) {
            let interval = Interval::new(x, x + width);
            let (sin, cos) = interval.sin_cos();
            for k in 0..=10 {
                let t = (x + width * f64::from(k) / 10.0).clamp(x, x + width);
                prop_assert!(Interval::new(sin.lo - 1e-15, sin.hi + 1e-15).contains(t.sin()));
                prop_assert!(Interval::new(cos.lo - 1e-15, cos.hi + 1e-15).contains(t.cos()));
            }
            let (sin, cos) = Interval::point(x).sin_cos();
            prop_assert!((sin.square() + cos.square()).contains(1.0));
            prop_assert!(sin.hi - sin.lo < 1e-13 && cos.hi - cos.lo < 1e-13);
        }
    }

    proptest! {
        /// Integers are exact: the sum of members with integer ends lies inside, and about as sharply as operation by operation.
        #[test]
        fn weighted_sums_hold_their_members(terms in prop::collection::vec((-1000_i32..1000, -1000_i32..1000, 0_i32..50, 0.0_f64..1.0), 0..12)) {
            let scale = 1.0 / 3.0;
            let of = |x: i32| f64::from(x) * scale;
            let parts = terms.iter().map(|&(w, x, width, _)| (of(w), Interval::new(of(x), of(x + width))));
            let weights: Vec<[f64; 3]> = terms.iter().map(|&(w, ..)| [of(w), 0.0, -of(w)]).collect();
            let sums = Interval::weighted_sums(3, weights.iter().map(|w| &w[..]).zip(parts.clone().map(|(_, x)| x)));
            let sum = sums[0];
            prop_assert_eq!((sums[1], sums[2]), (Interval::point(0.0), -sum));
            // w x of numbers that are the doubles nearest to thirds: exactly, in units of the last place of the smallest, by i128
            let units = |x: f64| (x * 2.0_f64.powi(54)) as i128;
            let [low, high] = [true, false].map(|low| {
                let ends = terms.iter().map(|&(w, x, width, _)| {
                    let ends = [units(of(w)) * units(of(x)), units(of(w)) * units(of(x + width))];
                    if low { ends[0].min(ends[1]) } else { ends[0].max(ends[1]) }
                });
                ends.sum::<i128>()
            });
            let end = |x: f64| x * 2.0_f64.powi(108);
            prop_assert!(end(sum.lo) <= low as f64 && high as f64 <= end(sum.hi));
            let singly = parts.fold(Interval::point(0.0), |sum, (w, x)| sum + x * w);
            prop_assert!(sum.hi - sum.lo <= (singly.hi - singly.lo) * 1.1 + 1e-9);
        }
    }

    #[test]
    fn sums_with_infinite_terms_are_the_whole_line() {
        let terms = [(&[1.0, 1.0][..], Interval::point(1.0)), (&[2.0, 0.0][..], Interval::ENTIRE)];
        let [first, second] = Interval::weighted_sums(2, terms.into_iter())[..] else { unreachable!() };
        assert_eq!(first, Interval::ENTIRE);
        assert!(second.contains(1.0) && second.hi - second.lo < 1e-14);
        assert_eq!(Interval::weighted_sums(1, std::iter::empty()), vec![Interval::point(0.0)]);
    }

    #[test]
    fn what_has_no_meaning_is_the_whole_line() {
        let zero = Interval::new(-1.0, 1.0);
        for entire in
            [Interval::from(1.0) / zero, Interval::from(f64::NAN), Interval::new(2.0, 1.0), zero * Interval::ENTIRE]
        {
            assert_eq!((entire.lo, entire.hi), (f64::NEG_INFINITY, f64::INFINITY));
        }
        assert_eq!(Interval::point(1e12).sin_cos().0, Interval::new(-1.0, 1.0));
    }
}
