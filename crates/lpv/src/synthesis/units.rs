//! Units in which the numbers of a problem are about 1.
//!
//! A plant in nanometres, a Q in 10¹⁵ and a clock in microseconds state the same problem as one in metres, 1 and seconds, and have to get the same
//! design. So it is posed in units of its own, with time in 1/ω, inputs in the diagonal β and costs in κ:
//!
//! ```text
//! A′ = A/ω,   B′ = Bβ/ω,   Q′ = Q/κ,   R′ = βRβ/κ,   σ′ = σ/(β√(γω/κ)),   γ′ = 1,
//! Y = Y′ω/κ,   L = βL′ω/κ,   K = βK′,   P = P′κ/ω.
//! ```
//!
//! A unit of states is none of its own: x in aξ has B/a, a²Q, that is another β and κ. ω = max|A|, κ = max|Q| and βⱼ² = κ/Rⱼⱼ make the largest
//! entries of A′ and Q′ and the diagonal of R′ one; without a cost Y has its trace, κ = ω, and βⱼ makes that of every column of B′ one. They follow
//! every change of units, and the primed numbers are rounded to 32 bits, so that what the solver sees, and where it goes, is the same to the last bit
//! whatever the units were. (The design of least effort is often far from unique, and a last bit would choose among them.) Of rounded numbers nothing
//! is proved: what is found is proved again as it was stated. Not rounded are the regulator of one vertex, which is the Riccati solution, and weights
//! whose definiteness the rounding might take.

use super::CostWeights;
use crate::math::Mat;
use crate::math::matrix::{inverse_spd, is_diagonal};
use crate::model::FrozenModel;

/// ω, β and κ.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Units {
    rate: f64,
    inputs: Vec<f64>,
    cost: f64,
    /// Without a cost, Y is of trace n whatever the units.
    has_cost: bool,
    /// Whether the primed numbers are rounded to 32 bits.
    is_rounded: bool,
}

impl Units {
    /// Those of `models` (A, B) and `weights`, as they stand or to be rounded; `None` where their numbers give no unit.
    pub fn of(models: &[(&Mat<f64>, &Mat<f64>)], weights: Option<&CostWeights>, is_rounded: bool) -> Option<Self> {
        let largest =
            |size: &dyn Fn(&Mat<f64>, &Mat<f64>) -> f64| models.iter().map(|(a, b)| size(a, b)).fold(0.0, f64::max);
        let speed = largest(&|a, _| a.norm_max());
        let column = |j: usize| largest(&|_, b| (0..b.nrows()).map(|k| b[(k, j)].abs()).fold(0.0, f64::max));
        let inputs = 0..models.first()?.1.ncols();
        let (rate, inputs, cost) = match weights {
            Some(CostWeights { q, r }) => {
                let cost = q.norm_max();
                let inputs: Vec<f64> = inputs.map(|j| (cost / r[(j, j)]).sqrt()).collect();
                let pull = inputs.iter().enumerate().map(|(j, unit)| unit * column(j)).fold(0.0, f64::max);
                (if speed > 0.0 { speed } else { pull }, inputs, cost)
            }
            None => {
                let rate = if speed > 0.0 { speed } else { inputs.clone().map(column).fold(0.0, f64::max) };
                // an input that moves nothing has no unit
                let unit = |j: usize| if column(j) > 0.0 { rate / column(j) } else { 1.0 };
                (rate, inputs.map(unit).collect(), 1.0)
            }
        };
        let has_size = inputs.iter().chain([&rate, &cost]).all(|unit| (LEAST..=1.0 / LEAST).contains(unit));
        let own = Self { rate, inputs, cost, has_cost: weights.is_some(), is_rounded };
        let is_definite = |m: &Mat<f64>| inverse_spd(m).is_some();
        // what a Q that is only semidefinite becomes is seen of a diagonal alone
        let keeps_definiteness = |units: &Self| {
            weights.is_none_or(|weights| {
                let primed = units.weights(weights);
                is_definite(&primed.r) && (is_diagonal(&weights.q) || is_definite(&weights.q) && is_definite(&primed.q))
            })
        };
        has_size.then(|| if keeps_definiteness(&own) { own } else { Self { is_rounded: false, ..own } })
    }

    /// A′
    pub fn a(&self, a: &Mat<f64>) -> Mat<f64> {
        self.matrix(a, 1.0 / self.rate)
    }

    /// B′
    pub fn b(&self, b: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(b.nrows(), b.ncols(), |k, j| self.number(b[(k, j)] * (self.inputs[j] / self.rate)))
    }

    /// A′ and B′, of the same parameter.
    pub fn model(&self, model: &FrozenModel) -> FrozenModel {
        FrozenModel { a: self.a(&model.a), b: self.b(&model.b), ..model.clone() }
    }

    /// Q′ and R′.
    pub fn weights(&self, CostWeights { q, r }: &CostWeights) -> CostWeights {
        let r = Mat::from_fn(r.nrows(), r.ncols(), |i, j| {
            self.number(r[(i, j)] * (self.inputs[i] * self.inputs[j] / self.cost))
        });
        CostWeights { q: self.matrix(q, 1.0 / self.cost), r }
    }

    /// σ′, for γ′ = 1: what binds is the limit on {V ≤ 1}.
    pub fn limits(&self, sigma: &[f64], gamma: f64) -> Vec<f64> {
        let size = (gamma * self.y()).sqrt();
        sigma.iter().zip(&self.inputs).map(|(sigma, unit)| self.number(sigma / (unit * size))).collect()
    }

    /// A rate of the parameter.
    pub fn per_time(&self, rate: f64) -> f64 {
        self.number(rate / self.rate)
    }

    /// A duration.
    pub fn time(&self, seconds: f64) -> f64 {
        self.number(seconds * self.rate)
    }

    /// A multiple of a matrix, in as many digits as the others.
    pub fn matrix(&self, matrix: &Mat<f64>, factor: f64) -> Mat<f64> {
        Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| self.number(factor * matrix[(i, j)]))
    }

    /// `number` in as many digits as the others.
    pub fn number(&self, number: f64) -> f64 {
        if self.is_rounded { rounded(number) } else { number }
    }

    /// By how much a margin of stability is larger than the primed one.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// By how much Y is larger than Y′.
    pub fn y(&self) -> f64 {
        if self.has_cost { self.rate / self.cost } else { 1.0 }
    }

    /// P of a P′ that is found for rounded numbers, made strict for those of the problem.
    pub fn strict_p(&self, p: &Mat<f64>) -> Mat<f64> {
        scaled(p, (1.0 + STRICT) / self.y())
    }

    /// tr Y of [`strict_p`](Self::strict_p).
    pub fn strict_trace(&self, trace: f64) -> f64 {
        trace * self.y() / (1.0 + STRICT)
    }

    /// L of L′.
    pub fn l(&self, l: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(l.nrows(), l.ncols(), |i, j| self.inputs[i] * self.y() * l[(i, j)])
    }

    /// K of K′.
    pub fn gain(&self, gain: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(gain.nrows(), gain.ncols(), |i, j| self.inputs[i] * gain[(i, j)])
    }
}

/// What `solve` finds at one model in units of its own, as `as_stated` makes it of the problem as it is stated; where it finds nothing, what it finds
/// for that: an error, and what is refuted, is told of the problem as it is stated.
///
/// # Errors
/// Those of `solve`.
pub(super) fn in_own_units<T, E>(
    model: &FrozenModel,
    weights: &CostWeights,
    (sigma, gamma): (&[f64], f64),
    solve: impl Fn(&FrozenModel, &CostWeights, &[f64], f64) -> Result<T, E>,
    as_stated: impl FnOnce(&Units, T) -> T,
) -> Result<T, E> {
    if let Some(units) = Units::of(&[(&model.a, &model.b)], Some(weights), true)
        && let Ok(found) = solve(&units.model(model), &units.weights(weights), &units.limits(sigma, gamma), 1.0)
    {
        return Ok(as_stated(&units, found));
    }
    solve(model, weights, sigma, gamma)
}

/// The largest size of an entry; 1 of zeros.
pub(super) fn largest_entry<'a>(entries: impl IntoIterator<Item = &'a f64>) -> f64 {
    let largest = entries.into_iter().map(|x| x.abs()).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

/// ε of P(1 + ε), so that an optimum found for rounded numbers holds for those of the problem.
pub(super) const STRICT: f64 = 1e-7;

/// Smallest unit: products and quotients of a few are no overflow.
const LEAST: f64 = 1e-60;

/// The nearest number of 32 bits, ties away from zero.
fn rounded(number: f64) -> f64 {
    const DROPPED: u32 = f64::MANTISSA_DIGITS - 32;
    match number.is_finite() {
        // a carry goes into the exponent, as it should
        true => f64::from_bits((number.to_bits() + (1 << (DROPPED - 1))) & !((1 << DROPPED) - 1)),
        false => number,
    }
}

/// A multiple of a matrix.
pub(super) fn scaled(matrix: &Mat<f64>, factor: f64) -> Mat<f64> {
    Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| factor * matrix[(i, j)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_32_bits_and_hides_the_last_ones() {
        let mut x = 0.123_456_789_f64;
        for _ in 0..500 {
            x = -x * 1.37;
            let near = rounded(x);
            assert!((near - x).abs() <= x.abs() * 2f64.powi(-32), "{x}");
            assert_eq!(rounded(near), near);
            assert_eq!(near.to_bits() & ((1 << 21) - 1), 0);
        }
        for exact in [0.0, 1.0, -0.5, 3.0, 1e6, f64::INFINITY] {
            assert_eq!(rounded(exact), exact);
        }
        assert_eq!(rounded(1.0 + f64::EPSILON), 1.0);
        assert_eq!(rounded(1.0 - f64::EPSILON), 1.0);
    }
}
