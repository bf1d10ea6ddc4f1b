//! Numbers and matrices of any precision with a bound on their error: fixed-point balls.
//!
//! A ball is an integer m and an integer r, and stands for every number x with |2ᵇx − m| ≤ r; the bits b behind the point are the
//! caller's choice. A matrix has one radius for all of its entries. Products are exact on integers, then cut off, which the radius bears:
//!
//! ```text
//! |AB − MᴬMᴮ| ≤ ‖Mᴬ‖∞ rᴮ + ‖Mᴮ‖₁ rᴬ + n rᴬ rᴮ.
//! ```
//!
//! What is lost is made good by more bits; where that is bound to fail (an exact tie) nothing is decided.

use super::definite::parts;
use super::interval::Interval;
use num_bigint::{BigInt, Sign};

/// A number with a bound on its error.
#[derive(Clone, Debug)]
pub struct Ball {
    bits: u64,
    middle: BigInt,
    radius: BigInt,
}

/// A matrix, every entry of which is known up to the same radius.
#[derive(Clone, Debug)]
pub struct BallMatrix {
    rows: usize,
    columns: usize,
    bits: u64,
    middle: Vec<BigInt>,
    radius: BigInt,
}

/// Exponents of entries beyond which nothing is computed.
const MOST_EXPONENT: i64 = 100_000;

/// m 2^e rounded down, and whether that is exact.
fn shifted(m: BigInt, e: i64) -> (BigInt, bool) {
    if m.sign() == Sign::NoSign {
        return (m, true);
    }
    if e >= 0 {
        return (m << e, true);
    }
    let is_exact = m.trailing_zeros().is_none_or(|zeros| zeros as i64 >= -e);
    // what is shifted out as a whole is −1 or 0
    (m >> -e, is_exact)
}

fn absolute(x: &BigInt) -> BigInt {
    BigInt::from(x.magnitude().clone())
}

impl Ball {
    /// x, exactly (rounded once where `bits` do not hold it).
    ///
    /// # Panics
    /// If x is not finite.
    pub fn new(x: f64, bits: u64) -> Self {
        assert!(x.is_finite(), "a ball is finite");
        let (m, e) = parts(x);
        let (middle, is_exact) = shifted(m.into(), e + bits as i64);
        Self { bits, middle, radius: u8::from(!is_exact).into() }
    }

    /// x − y
    pub fn minus(&self, other: &Self) -> Self {
        Self { bits: self.bits, middle: &self.middle - &other.middle, radius: &self.radius + &other.radius }
    }

    /// xy
    pub fn times(&self, other: &Self) -> Self {
        let (a, b) = (absolute(&self.middle), absolute(&other.middle));
        let spread = a * &other.radius + (b + &other.radius) * &self.radius;
        let (middle, is_exact) = shifted(&self.middle * &other.middle, -(self.bits as i64));
        let lost = BigInt::from(u8::from(!is_exact));
        Self { bits: self.bits, middle, radius: upwards(spread, self.bits) + lost }
    }

    /// −x/k for a whole number k > 0.
    pub fn negated_over(&self, k: usize) -> Self {
        Self { bits: self.bits, middle: -&self.middle / k, radius: &self.radius / k + 2 }
    }

    /// x/y; `None` where y may be zero.
    ///
    /// |X/Y − x/y| ≤ (rˣ + |x/y| rʸ)/(|y| − rʸ).
    pub fn over(&self, other: &Self) -> Option<Self> {
        let least = absolute(&other.middle) - &other.radius;
        if least.sign() != Sign::Plus {
            return None;
        }
        let quotient = (&self.middle << self.bits) / &other.middle;
        let spread = &self.radius + upwards((absolute(&quotient) + 1) * &other.radius, self.bits);
        let radius = (spread << self.bits) / least + 2;
        Some(Self { bits: self.bits, middle: quotient, radius })
    }

    /// A bound from below, positive, on 1 − |x| of every member; `None` where there is none.
    pub fn below_one(&self) -> Option<f64> {
        self.positive((BigInt::from(1) << self.bits) - absolute(&self.middle) - &self.radius)
    }

    /// A bound from below, positive, on |x| − 1 of every member; `None` where there is none.
    pub fn above_one(&self) -> Option<f64> {
        self.positive(absolute(&self.middle) - &self.radius - (BigInt::from(1) << self.bits))
    }

    /// Whether the radius is at most 2⁻ᵏ.
    pub fn is_within(&self, k: u64) -> bool {
        self.radius.bits() + k <= self.bits
    }

    /// A double in units of the last bit, rounded down.
    fn positive(&self, x: BigInt) -> Option<f64> {
        if x.sign() != Sign::Plus {
            return None;
        }
        let excess = x.bits().saturating_sub(53);
        let leading = u64::try_from(x >> excess).ok()? as f64;
        let exponent = excess as i64 - self.bits as i64;
        let scale = |e: i64| 2.0_f64.powi(e.clamp(-1000, 900) as i32);
        // far below the range of normal numbers it is still positive
        Some((leading * scale(exponent)).max(f64::MIN_POSITIVE))
    }
}

/// x 2⁻ᵇ rounded up.
fn upwards(x: BigInt, bits: u64) -> BigInt {
    if x.sign() == Sign::NoSign { x } else { (x >> bits) + 1 }
}

impl BallMatrix {
    /// From enclosures of the entries times powers of two 2^s(i, j); `None` where one is not bounded, or out of range.
    pub fn new(
        rows: usize,
        columns: usize,
        bits: u64,
        entry: impl Fn(usize, usize) -> Interval,
        shift: impl Fn(usize, usize) -> i64,
    ) -> Option<Self> {
        let (mut middle, mut radius) = (Vec::with_capacity(rows * columns), BigInt::from(0));
        for at in 0..rows * columns {
            let (i, j) = (at / columns, at % columns);
            let (interval, scale) = (entry(i, j), shift(i, j) + bits as i64);
            if !interval.magnitude().is_finite() || scale.abs() > MOST_EXPONENT {
                return None;
            }
            let end = |x: f64| {
                let (m, e) = parts(x);
                shifted(m.into(), e + scale)
            };
            let ((lo, is_exact), (hi, _)) = (end(interval.lo()), end(interval.hi()));
            if interval.lo() == interval.hi() {
                radius = radius.max(u8::from(!is_exact).into());
                middle.push(lo);
            } else {
                radius = radius.max((&hi - &lo) / 2 + 2);
                middle.push((lo + hi) / 2);
            }
        }
        Some(Self { rows, columns, bits, middle, radius })
    }

    /// I
    pub fn identity(n: usize, bits: u64) -> Self {
        let entry = |at: usize| if at / n == at % n { BigInt::from(1) << bits } else { 0.into() };
        Self { rows: n, columns: n, bits, middle: (0..n * n).map(entry).collect(), radius: 0.into() }
    }

    /// M + N
    pub fn plus(&self, other: &Self) -> Self {
        self.with(self.middle.iter().zip(&other.middle).map(|(a, b)| a + b), &self.radius + &other.radius)
    }

    /// M − N
    pub fn minus(&self, other: &Self) -> Self {
        self.with(self.middle.iter().zip(&other.middle).map(|(a, b)| a - b), &self.radius + &other.radius)
    }

    /// MN
    pub fn times(&self, other: &Self) -> Self {
        let (rows, inner, columns) = (self.rows, self.columns, other.columns);
        let (mut middle, mut is_exact) = (Vec::with_capacity(rows * columns), true);
        for at in 0..rows * columns {
            let (i, j) = (at / columns, at % columns);
            let mut sum = BigInt::from(0);
            for k in 0..inner {
                let (a, b) = (&self.middle[i * inner + k], &other.middle[k * columns + j]);
                if a.sign() != Sign::NoSign && b.sign() != Sign::NoSign {
                    sum += a * b;
                }
            }
            let (value, exact) = shifted(sum, -(self.bits as i64));
            is_exact &= exact;
            middle.push(value);
        }
        let spread = self.row_sum() * &other.radius
            + other.column_sum() * &self.radius
            + &self.radius * &other.radius * BigInt::from(inner);
        let radius = upwards(spread, self.bits) + BigInt::from(u8::from(!is_exact));
        Self { rows, columns, bits: self.bits, middle, radius }
    }

    /// xM for a number x.
    pub fn times_number(&self, x: f64) -> Self {
        let (m, e) = parts(x);
        let mut is_exact = true;
        let middle: Vec<BigInt> = (self.middle.iter())
            .map(|entry| {
                let (value, exact) = shifted(entry * m, e);
                is_exact &= exact;
                value
            })
            .collect();
        let (radius, exact) = shifted(&self.radius * m.abs(), e);
        let lost = u8::from(!exact) + u8::from(!is_exact);
        self.with(middle, radius + BigInt::from(lost))
    }

    /// M/k for a whole number k > 0.
    pub fn over(&self, k: usize) -> Self {
        let is_exact = self.middle.iter().all(|entry| entry.sign() == Sign::NoSign) && self.radius == 0.into();
        let lost = if is_exact { 0 } else { 2 };
        self.with(self.middle.iter().map(|entry| entry / k), &self.radius / k + lost)
    }

    /// M + xI
    pub fn plus_diagonal(&self, x: &Ball) -> Self {
        let n = self.columns;
        let entry = |(at, entry): (usize, &BigInt)| if at / n == at % n { entry + &x.middle } else { entry.clone() };
        self.with(self.middle.iter().enumerate().map(entry), &self.radius + &x.radius)
    }

    /// tr M
    pub fn trace(&self) -> Ball {
        let middle = (0..self.rows).map(|i| &self.middle[i * self.columns + i]).sum();
        Ball { bits: self.bits, middle, radius: &self.radius * BigInt::from(self.rows) }
    }

    /// The same with every entry wider by a bound on the row sums of `other`.
    pub fn widened_by(&self, other: &Self) -> Self {
        let norm = other.row_sum() + &other.radius * BigInt::from(other.columns);
        Self { radius: &self.radius + norm, ..self.clone() }
    }

    /// Whether the row sums of every member are at most 2ᵏ.
    pub fn is_at_most(&self, k: i64) -> bool {
        let norm = self.row_sum() + &self.radius * BigInt::from(self.columns);
        norm <= shifted(1.into(), self.bits as i64 + k).0
    }

    /// The number of bits before the point of a bound on the row sums, 0 where they are at most 1.
    pub fn whole_bits(&self) -> u64 {
        let norm: BigInt = self.row_sum() + &self.radius * BigInt::from(self.columns);
        norm.bits().saturating_sub(self.bits)
    }

    /// Size.
    pub fn size(&self) -> usize {
        self.rows
    }

    /// Bits behind the point.
    pub fn bits(&self) -> u64 {
        self.bits
    }

    fn with(&self, middle: impl IntoIterator<Item = BigInt>, radius: BigInt) -> Self {
        Self { middle: middle.into_iter().collect(), radius, ..*self }
    }

    fn row_sum(&self) -> BigInt {
        let row = |i: usize| (0..self.columns).map(|j| absolute(&self.middle[i * self.columns + j])).sum::<BigInt>();
        (0..self.rows).map(row).max().unwrap_or_default()
    }

    fn column_sum(&self) -> BigInt {
        let column = |j: usize| (0..self.rows).map(|i| absolute(&self.middle[i * self.columns + j])).sum::<BigInt>();
        (0..self.columns).map(column).max().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Whether m/2¹⁰ is in the ball.
    fn holds(ball: &Ball, numerator: &BigInt, denominator: &BigInt) -> bool {
        let distance = absolute(&((numerator << ball.bits) - denominator * &ball.middle));
        distance <= absolute(denominator) * &ball.radius
    }

    #[test]
    fn doubles_are_held_exactly() {
        for x in [0.0, -0.0, 1.0, -1.5, 0.1, -1e300, 1e-10] {
            let ball = Ball::new(x, 100);
            assert_eq!(ball.radius, 0.into(), "{x}");
        }
        let tiny = Ball::new(5e-324, 100);
        assert!(tiny.radius == 1.into() && tiny.below_one().is_some());
        let tiny = Ball::new(-5e-324, 100);
        assert!(tiny.radius == 1.into() && tiny.middle == (-1).into());
    }

    #[test]
    fn one_is_neither_below_nor_above() {
        for x in [1.0, -1.0] {
            let ball = Ball::new(x, 64);
            assert!(ball.below_one().is_none() && ball.above_one().is_none());
        }
        assert_eq!(Ball::new(1.0_f64.next_down(), 64).below_one(), Some(f64::EPSILON / 2.0));
        assert_eq!(Ball::new(-1.0_f64.next_up(), 64).above_one(), Some(f64::EPSILON));
    }

    proptest! {
        /// Products, quotients and sums of numbers k/2¹⁰ hold the exact ones, with few bits.
        #[test]
        fn operations_hold_exact_results(a in -4000i64..4000, b in -4000i64..4000, c in 1i64..4000, bits in 3u64..40) {
            let unit = 1024.0;
            let ball = |k: i64| Ball::new(k as f64 / unit, bits);
            let whole = |k: i64| BigInt::from(k);
            prop_assert!(holds(&ball(a).times(&ball(b)), &whole(a * b), &whole(1 << 20)));
            prop_assert!(holds(&ball(a).minus(&ball(b)), &whole(a - b), &whole(1 << 10)));
            prop_assert!(holds(&ball(a).negated_over(7), &whole(-a), &whole(7 << 10)));
            if let Some(quotient) = ball(a).over(&ball(c)) {
                prop_assert!(holds(&quotient, &whole(a), &whole(c)));
            }
        }

        /// The same of matrices.
        #[test]
        fn products_of_matrices_hold_exact_ones(
            entries in proptest::collection::vec(-4000i64..4000, 18),
            bits in 3u64..40,
            number in -4000i64..4000,
        ) {
            let of = |from: usize| {
                let entry = |i: usize, j: usize| Interval::point(entries[from + 3 * i + j] as f64 / 1024.0);
                BallMatrix::new(3, 3, bits, entry, |_, _| 0).unwrap()
            };
            let (a, b) = (of(0), of(9));
            let product = a.times(&b);
            let scaled = a.times_number(number as f64 / 1024.0);
            let third = a.over(3);
            for at in 0..9 {
                let (i, j) = (at / 3, at % 3);
                let exact: i64 = (0..3).map(|k| entries[3 * i + k] * entries[9 + 3 * k + j]).sum();
                let entry = |m: &BallMatrix| Ball { bits, middle: m.middle[at].clone(), radius: m.radius.clone() };
                prop_assert!(holds(&entry(&product), &exact.into(), &(1 << 20).into()));
                prop_assert!(holds(&entry(&scaled), &(entries[at] * number).into(), &(1 << 20).into()));
                prop_assert!(holds(&entry(&third), &entries[at].into(), &(3 << 10).into()));
            }
        }
    }
}
