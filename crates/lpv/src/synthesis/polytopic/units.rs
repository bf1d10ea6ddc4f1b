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
//! States of an objective are in units of their largest entry. Otherwise a unit of states is none of its own: x in aξ has B/a, a²Q, that is another β and κ. ω = max|A|, κ = max|Q| and βⱼ² = κ/Rⱼⱼ make the largest entries of
//! A′ and Q′ and the diagonal of R′ one; without a cost Y has its trace, κ = ω, and βⱼ makes that of every column of B′ one. They follow every change of units, and the primed numbers are rounded to 32 bits, so that what the solver sees, and where it goes,
//! is the same to the last bit whatever the units were. (The design of least effort is often far from unique, and a last bit would choose among them.)
//! Of rounded numbers nothing is proved: what is found is proved again as it was stated. The regulator of one vertex, which is the Riccati solution, is
//! not rounded.

use super::{InputBounds, Lyapunov, Objective, PolytopicRequest};
use crate::math::Mat;
use crate::model::Polytope;
use crate::synthesis::CostWeights;

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
    /// Those of a problem; `None` where its numbers give no unit.
    pub fn of(polytope: &Polytope, request: &PolytopicRequest) -> Option<Self> {
        let is_regulator = polytope.len() == 1 && request.weights.is_some() && request.saturation.is_none();
        let largest = |size: &dyn Fn(usize) -> f64| (0..polytope.len()).map(size).fold(0.0, f64::max);
        let speed = largest(&|i| polytope.a(i).norm_max());
        let column =
            |j: usize| largest(&|i| (0..polytope.states()).map(|k| polytope.b(i)[(k, j)].abs()).fold(0.0, f64::max));
        let inputs = 0..polytope.inputs();
        let (rate, inputs, cost) = match &request.weights {
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
        let has_cost = request.weights.is_some();
        has_size.then_some(Self { rate, inputs, cost, has_cost, is_rounded: !is_regulator })
    }

    /// (A′, B′)
    pub fn polytope(&self, polytope: &Polytope) -> Polytope {
        let each = |of: &dyn Fn(usize) -> Mat<f64>| (0..polytope.len()).map(of).collect();
        let a = each(&|i| self.matrix(polytope.a(i), 1.0 / self.rate));
        let b = each(&|i| {
            let b = polytope.b(i);
            Mat::from_fn(b.nrows(), b.ncols(), |k, j| self.number(b[(k, j)] * (self.inputs[j] / self.rate)))
        });
        Polytope::new(a, b).expect("the same sizes")
    }

    /// What is asked for, primed.
    pub fn request(&self, request: &PolytopicRequest) -> PolytopicRequest {
        let weights = request.weights.as_ref().map(|CostWeights { q, r }| CostWeights {
            q: self.matrix(q, 1.0 / self.cost),
            r: Mat::from_fn(r.nrows(), r.ncols(), |i, j| {
                self.number(r[(i, j)] * (self.inputs[i] * self.inputs[j] / self.cost))
            }),
        });
        let primed = |rate: &f64| self.number(rate / self.rate);
        let lyapunov = match &request.lyapunov {
            Lyapunov::Common => Lyapunov::Common,
            Lyapunov::ParameterDependent { rate_vertices } => Lyapunov::ParameterDependent {
                rate_vertices: rate_vertices.iter().map(|nu| nu.iter().map(primed).collect()).collect(),
            },
        };
        // what binds is the limit on {V ≤ 1}
        let saturation = request.saturation.as_ref().map(|bounds| {
            let size = (bounds.gamma * self.y()).sqrt();
            let primed = |(sigma, unit): (&f64, &f64)| self.number(sigma / (unit * size));
            InputBounds { sigma: bounds.sigma.iter().zip(&self.inputs).map(primed).collect(), gamma: 1.0 }
        });
        let mut high_gain = request.high_gain;
        if let Some(time) = high_gain.as_mut().and_then(|high_gain| high_gain.sample_time_s.as_mut()) {
            *time = self.number(*time * self.rate);
        }
        let objective = self.primed_objective(&request.objective);
        PolytopicRequest { weights, lyapunov, saturation, high_gain, objective, back_off: request.back_off }
    }

    fn matrix(&self, matrix: &Mat<f64>, factor: f64) -> Mat<f64> {
        Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| self.number(factor * matrix[(i, j)]))
    }

    fn number(&self, number: f64) -> f64 {
        if self.is_rounded { rounded(number) } else { number }
    }

    /// By how much Y is larger than Y′.
    pub fn y(&self) -> f64 {
        if self.has_cost { self.rate / self.cost } else { 1.0 }
    }

    /// L of L′.
    pub fn l(&self, l: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(l.nrows(), l.ncols(), |i, j| self.inputs[i] * self.y() * l[(i, j)])
    }

    /// K of K′.
    pub fn gain(&self, gain: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(gain.nrows(), gain.ncols(), |i, j| self.inputs[i] * gain[(i, j)])
    }

    /// By how much the objective is larger: of tr Y as Y, of a cost bound as P, of a margin of stability as ω.
    pub fn objective(&self, objective: &Objective) -> f64 {
        match objective {
            _ if !self.has_cost => self.rate,
            Objective::Trace => self.y(),
            Objective::States { states, .. } => largest_entry(states).powi(2) / self.y(),
            Objective::Ellipsoid { shape } => 1.0 / (shape.norm_max() * self.y()),
        }
    }

    /// The states and the shape in units of their largest entries, whose bounds are in those.
    fn primed_objective(&self, objective: &Objective) -> Objective {
        match objective {
            Objective::Trace => Objective::Trace,
            Objective::States { states, parameter } => {
                let largest = largest_entry(states);
                let primed = |state: &Vec<f64>| state.iter().map(|x| self.number(x / largest)).collect();
                Objective::States { states: states.iter().map(primed).collect(), parameter: parameter.clone() }
            }
            Objective::Ellipsoid { shape } => {
                Objective::Ellipsoid { shape: self.matrix(shape, 1.0 / shape.norm_max()) }
            }
        }
    }
}

/// The largest size of an entry; 1 of zeros.
fn largest_entry(states: &[Vec<f64>]) -> f64 {
    let largest = states.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

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
