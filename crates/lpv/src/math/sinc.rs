//! sinc x = sin x / x with sinc 0 = 1, and its first two derivatives, in interval arithmetic.
//!
//! sinc x = ∫₀¹ cos(xs) ds, so that the n-th derivative is at most ∫₀¹ sⁿ ds = 1/(n + 1) everywhere, and over an interval with the middle m
//! the mean value theorem of second order gives each of them from its values at m.

use super::interval::Interval;

/// Up to this magnitude the power series are taken, beyond it sin and cos.
const SERIES: f64 = 1.0;
/// Terms of the series, of which the first that is left out is below 10⁻²³ for magnitudes up to [`SERIES`].
const TERMS: u32 = 11;

/// Enclosures of sinc, sinc′ and sinc″ over `x`.
pub fn sinc_and_derivatives(x: Interval) -> [Interval; 3] {
    let within = |bound: f64| Interval::new(-bound, bound);
    // 1/3 is no double
    let everywhere = [within(1.0), within(0.5), within((1.0_f64 / 3.0).next_up())];
    let middle = x.middle();
    let delta = x - middle;
    if delta.magnitude().is_nan() || delta.magnitude() > 1.0 || !x.magnitude().is_finite() {
        return everywhere;
    }
    let [value, slope, bend] = at(middle);
    if x.lo() == x.hi() {
        return [value, slope, bend];
    }
    let square = Interval::new(0.0, delta.square().hi());
    // halves of the bounds on the second and third derivative, and the bound on the third
    [
        value + delta * slope + square * within((1.0_f64 / 6.0).next_up()),
        slope + delta * bend + square * within(0.125),
        bend + delta * within(0.25),
    ]
}

/// sinc, sinc′ and sinc″ at a number.
fn at(x: f64) -> [Interval; 3] {
    if x.abs() <= SERIES {
        return series(x);
    }
    let point = Interval::point(x);
    let (sin, cos) = point.sin_cos();
    let value = sin / point;
    let slope = (cos - value) / point;
    [value, slope, -value - slope * 2.0 / point]
}

/// Σ (−1)ᵏ x²ᵏ/(2k + 1)! and its derivatives by terms. For |x| ≤ 1 the terms alternate and fall, and the rest is at most the first omitted.
fn series(x: f64) -> [Interval; 3] {
    let (point, square) = (Interval::point(x), Interval::point(x).square());
    // (−1)ᵏ x^(2k − 2)/(2k + 1)! from k = 1
    let mut term = -(Interval::point(1.0) / 6.0);
    let mut sums = [Interval::point(1.0), Interval::point(0.0), Interval::point(0.0)];
    let parts = |term: Interval, k: u32| {
        let k2 = f64::from(2 * k);
        [term * square, term * point * k2, term * (k2 * (k2 - 1.0))]
    };
    for k in 1..=TERMS {
        let next = parts(term, k);
        sums.iter_mut().zip(next).for_each(|(sum, part)| *sum = *sum + part);
        let k2 = f64::from(2 * k);
        term = -(term * square / ((k2 + 2.0) * (k2 + 3.0)));
    }
    let rest = parts(term, TERMS + 1);
    let mut out = sums;
    out.iter_mut().zip(rest).for_each(|(sum, rest)| {
        *sum = *sum + Interval::new(-rest.magnitude(), rest.magnitude());
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// sinc″ by formula, away from zero.
    fn numbers(x: f64) -> [f64; 3] {
        let value = x.sin() / x;
        let slope = (x.cos() - value) / x;
        [value, slope, -value - 2.0 * slope / x]
    }

    #[test]
    fn members_lie_inside_and_points_are_sharp() {
        for k in -400..400 {
            let x = 0.0137 * f64::from(k) + 0.003;
            let sharp = sinc_and_derivatives(Interval::point(x));
            for width in [0.0, 1e-3, 0.3, 1.7] {
                let wide = sinc_and_derivatives(Interval::new(x, x + width));
                for j in 0..=8 {
                    let t = x + width * f64::from(j) / 8.0;
                    // the formula loses digits near zero with the square of 1/x
                    let lost = 1e-14 / (t * t).min(1.0);
                    for (interval, number) in wide.into_iter().zip(numbers(t)) {
                        assert!(interval.lo() <= number + lost && number - lost <= interval.hi(), "{t}: {number}");
                    }
                }
            }
            assert!(sharp.iter().all(|interval| interval.hi() - interval.lo() < 1e-12), "{x}: {sharp:?}");
        }
    }

    /// At zero: 1, 0 and −1/3; and the two formulas agree where they meet.
    #[test]
    fn zero_and_the_seam() {
        let [value, slope, bend] = sinc_and_derivatives(Interval::point(0.0));
        assert!(value.contains(1.0) && slope.contains(0.0) && bend.contains(-1.0 / 3.0));
        for (below, above) in series(1.0).into_iter().zip(at(1.0_f64.next_up())) {
            assert!(below.hi() >= above.lo() - 1e-15 && above.hi() >= below.lo() - 1e-15);
        }
        let around = sinc_and_derivatives(Interval::new(-0.1, 0.1));
        assert!(around[0].contains(1.0) && around[0].contains(0.1_f64.sin() / 0.1) && around[0].hi() < 1.01);
    }
}
