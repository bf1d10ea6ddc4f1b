//! The scalar that a plant's equations are generic over.
//!
//! A plant is written once and evaluated over `f64` (simulation) and over [`Dual`] numbers (exact Jacobians). A new
//! arithmetic (SIMD lanes, intervals) joins by implementing [`Scalar`]; no plant changes.

use num_dual::{Derivative, DualNum, DualSVec64};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that the equations of a plant can be evaluated over.
pub trait Scalar:
    Copy
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// (sin x, cos x)
    fn sin_cos(self) -> (Self, Self);

    /// sin x / x, and 1 at zero.
    fn sinc(self) -> Self;
}

impl Scalar for f64 {
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }

    #[inline]
    fn sinc(self) -> Self {
        if self == 0.0 { 1.0 } else { self.sin() / self }
    }
}

/// Number of directions that one dual number carries. A Jacobian with k columns takes ⌈k / LANES⌉ passes, so that
/// plants of any size share one fixed-size number type.
pub const LANES: usize = 4;

/// Dual number a + Σ bᵢεᵢ, εᵢεⱼ = 0, with [`LANES`] directions: f(a + ε) = f(a) + f′(a)ε exactly.
pub type Dual = DualSVec64<LANES>;

impl Scalar for Dual {
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        DualNum::sin_cos(&self)
    }

    #[inline]
    fn sinc(self) -> Self {
        self.sph_j0()
    }
}

/// `value` as a dual number that carries the unit direction `lane`, or none.
#[inline]
pub fn dual(value: f64, lane: Option<usize>) -> Dual {
    match lane {
        Some(lane) => Dual::from_re(value).derivative(lane),
        None => Dual::from_re(value),
    }
}

/// The derivative of `number` along direction `lane`.
#[inline]
pub fn derivative(number: &Dual, lane: usize) -> f64 {
    match &number.eps {
        Derivative(Some(eps)) => eps[lane],
        Derivative(None) => 0.0,
    }
}
