//! Taylor arithmetic of second order over intervals: a function of one variable t by enclosures of its value and its first
//! two derivatives, with a derivative by a second variable carried along.
//!
//! With value and slope at one point c and the second derivative over a whole cell, f(t) ∈ f(c) + (t − c)f′(c) + ½(t − c)²f″(cell)
//! for all t of the cell (Taylor's theorem with Lagrange's remainder).

use super::interval::Interval;
use super::scalar::Scalar;
use super::sinc::sinc_and_derivatives;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// f, f′ and, where it is asked for, f″.
#[derive(Clone, Copy, Debug)]
pub struct Taylor {
    /// f
    pub value: Interval,
    /// f′
    pub slope: Interval,
    /// f″; `None` where only the first two are carried.
    pub bend: Option<Interval>,
}

impl Taylor {
    /// The variable itself, over `t`.
    pub fn variable(t: Interval) -> Self {
        Self { value: t, slope: Interval::point(1.0), bend: Some(Interval::point(0.0)) }
    }

    /// The variable, of which values and slopes are wanted but no second derivatives.
    pub fn variable_of_first_order(t: Interval) -> Self {
        Self { bend: None, ..Self::variable(t) }
    }

    /// A constant.
    pub fn constant(value: Interval) -> Self {
        Self { value, slope: Interval::point(0.0), bend: Some(Interval::point(0.0)) }
    }

    /// Exactly zero, with its derivatives.
    pub fn is_zero(&self) -> bool {
        self.value.is_zero() && self.slope.is_zero() && self.bend.is_none_or(Interval::is_zero)
    }
}

impl From<f64> for Taylor {
    fn from(x: f64) -> Self {
        Self::constant(x.into())
    }
}

impl Add for Taylor {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        let bend = self.bend.zip(other.bend).map(|(f, g)| f + g);
        Self { value: self.value + other.value, slope: self.slope + other.slope, bend }
    }
}

impl Sub for Taylor {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        let bend = self.bend.zip(other.bend).map(|(f, g)| f - g);
        Self { value: self.value - other.value, slope: self.slope - other.slope, bend }
    }
}

impl Neg for Taylor {
    type Output = Self;

    fn neg(self) -> Self {
        Self { value: -self.value, slope: -self.slope, bend: self.bend.map(|f| -f) }
    }
}

impl Mul for Taylor {
    type Output = Self;

    /// (fg)″ = f″g + 2f′g′ + fg″
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: self.slope * other.value + self.value * other.slope,
            bend: (self.bend.zip(other.bend))
                .map(|(f, g)| f * other.value + (self.slope * other.slope).doubled() + self.value * g),
        }
    }
}

impl Div for Taylor {
    type Output = Self;

    /// With q = f/g: q′ = (f′ − qg′)/g, q″ = (f″ − 2q′g′ − qg″)/g.
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let slope = (self.slope - value * other.slope) / other.value;
        let bend = (self.bend.zip(other.bend)).map(|(f, g)| (f - slope * other.slope * 2.0 - value * g) / other.value);
        Self { value, slope, bend }
    }
}

impl Scalar for Taylor {
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        let square = self.slope.square();
        let sine = Self { value: sin, slope: cos * self.slope, bend: self.bend.map(|f| cos * f - sin * square) };
        let cosine =
            Self { value: cos, slope: -(sin * self.slope), bend: self.bend.map(|f| -(sin * f) - cos * square) };
        (sine, cosine)
    }

    fn sinc(self) -> Self {
        let [value, first, second] = sinc_and_derivatives(self.value);
        let bend = self.bend.map(|bend| second * self.slope.square() + first * bend);
        Self { value, slope: first * self.slope, bend }
    }
}

/// f and ∂f/∂s, both as functions of t.
#[derive(Clone, Copy, Debug)]
pub struct TaylorDual {
    /// f
    pub value: Taylor,
    /// ∂f/∂s
    pub derivative: Taylor,
}

impl TaylorDual {
    /// `value`, with ∂/∂s of it 1 or 0.
    pub fn new(value: Taylor, is_variable: bool) -> Self {
        Self { value, derivative: Taylor::from(f64::from(u8::from(is_variable))) }
    }
}

impl From<f64> for TaylorDual {
    fn from(x: f64) -> Self {
        Self::new(x.into(), false)
    }
}

impl Add for TaylorDual {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, derivative: self.derivative + other.derivative }
    }
}

impl Sub for TaylorDual {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, derivative: self.derivative - other.derivative }
    }
}

impl Neg for TaylorDual {
    type Output = Self;

    fn neg(self) -> Self {
        Self { value: -self.value, derivative: -self.derivative }
    }
}

impl Mul for TaylorDual {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            derivative: self.derivative * other.value + self.value * other.derivative,
        }
    }
}

impl Div for TaylorDual {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, derivative: (self.derivative - value * other.derivative) / other.value }
    }
}

impl Scalar for TaylorDual {
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (
            Self { value: sin, derivative: cos * self.derivative },
            Self { value: cos, derivative: -(sin * self.derivative) },
        )
    }

    /// sinc′ as a function of t has the derivatives sinc″ and, at most 1/4 everywhere, sinc‴.
    fn sinc(self) -> Self {
        let Taylor { value: x, slope, bend } = self.value;
        let [_, first, second] = sinc_and_derivatives(x);
        let third = Interval::new(-0.25, 0.25);
        let bend = bend.map(|bend| third * slope.square() + second * bend);
        let derivative = Taylor { value: first, slope: second * slope, bend };
        Self { value: self.value.sinc(), derivative: derivative * self.derivative }
    }
}

macro_rules! with_numbers {
    ($number:ident: $($operation:ident $method:ident),*) => {$(
        impl $operation<f64> for $number {
            type Output = Self;

            fn $method(self, other: f64) -> Self {
                $operation::$method(self, Self::from(other))
            }
        }
    )*};
}
with_numbers!(Taylor: Add add, Sub sub, Div div);

impl Mul<f64> for Taylor {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, slope: self.slope * factor, bend: self.bend.map(|f| f * factor) }
    }
}

with_numbers!(TaylorDual: Add add, Sub sub, Mul mul, Div div);

#[cfg(test)]
mod tests {
    use super::*;

    fn function<S: Scalar>(t: S) -> S {
        let (sin, cos) = (t * 2.0).sin_cos();
        (sin * cos + t * t - 0.3 + (t * 3.0).sinc()) / (cos * 0.5 + 2.0)
    }

    /// f(t) of random t in a cell lies in the Taylor form of the cell.
    #[test]
    fn cells_enclose_the_function() {
        for k in 0..200 {
            let (center, half) = (-3.0 + 0.03 * f64::from(k), 0.02);
            let at = function(Taylor::variable(Interval::point(center)));
            let over = function(Taylor::variable(Interval::new(center - half, center + half)));
            for j in -10..=10 {
                let step = half * f64::from(j) / 10.0;
                let delta = Interval::point(step);
                let form = at.value + delta * at.slope + delta.square() * 0.5 * over.bend.unwrap();
                let value = function(center + step);
                assert!(form.lo() <= value + 1e-14 && value - 1e-14 <= form.hi(), "{value} in {form:?}");
                assert!(form.hi() - form.lo() < 0.05 * half);
            }
        }
    }

    /// Slopes are those of differences, by t and by the second variable.
    #[test]
    fn derivatives_are_those_of_differences() {
        let (t, h) = (0.7, 1e-5);
        let at = function(TaylorDual::new(Taylor::variable(Interval::point(t)), true));
        let difference = (function(t + h) - function(t - h)) / (2.0 * h);
        let bend = (function(t + h) - 2.0 * function(t) + function(t - h)) / (h * h);
        assert!((at.value.slope.middle() - difference).abs() < 1e-8);
        assert!((at.derivative.value.middle() - difference).abs() < 1e-8);
        assert!((at.value.bend.unwrap().middle() - bend).abs() < 1e-4);
        assert!((at.derivative.slope.middle() - bend).abs() < 1e-4);
    }
}
