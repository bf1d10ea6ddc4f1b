//! Is a reference a point of rest of the plant that flies, and one that the model is about?
//!
//! A bound on the cost of a step holds for the error to a reference that stays where it is. f(x_ref, u*) is enclosed in interval arithmetic;
//! it may differ from zero by what rounding leaves of terms that cancel, a part in 10¹² of Σ|∂fᵢ/∂xⱼ xⱼ| + Σ|∂fᵢ/∂uⱼ uⱼ|, and by nothing
//! where there are no such terms.

use crate::math::definite::is_zero_sum;
use crate::math::interval::Interval;
use crate::math::taylor::Taylor;
use crate::plant::Plant;

/// Part of cancelling terms that rounding may leave.
const ROUNDING: f64 = 1e-12;
/// Relative difference up to which two linearisations are the same.
const SAME: f64 = 1e-9;

/// Why a reference is none that a bound is about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unrest {
    /// The state `state` moves at `rate`, per second, with the operating input.
    Moves {
        /// Index of the state.
        state: usize,
        /// ẋ of it.
        rate: f64,
    },
    /// It rests, but the plant is another there than at the operating point that the design was made for.
    Elsewhere,
}

/// Whether `reference` with the input `input` is a point of rest at which the plant is the model's; `None` if it is.
pub fn unrest(plant: &dyn Plant, reference: &[f64], input: &[f64]) -> Option<Unrest> {
    let points =
        |values: &[f64]| values.iter().map(|&value| Taylor::constant(Interval::point(value))).collect::<Vec<_>>();
    let (x, u) = (points(reference), points(input));
    let (n, m) = (x.len(), u.len());
    let (a, b) = plant.jacobians_over(&x, &u);
    let terms = |i: usize| -> f64 {
        let of = |entries: &[Taylor], values: &[f64], width: usize| -> f64 {
            (0..width).map(|j| entries[i * width + j].value.magnitude() * values[j].abs()).filter(|t| !t.is_nan()).sum()
        };
        of(&a, reference, n) + of(&b, input, m)
    };
    let flow = plant.dynamics_over(&x, &u);
    // what is not known moves
    let moves = |i: usize| flow[i].value.magnitude().is_nan() || flow[i].value.magnitude() > ROUNDING * terms(i);
    let fastest =
        (0..n).filter(|&i| moves(i)).max_by(|&i, &j| flow[i].value.magnitude().total_cmp(&flow[j].value.magnitude()));
    if let Some(state) = fastest {
        return Some(Unrest::Moves { state, rate: flow[state].value.middle() });
    }
    let rho = plant.description().scheduling.as_ref().map_or(0.0, |scheduling| reference[scheduling.state]);
    let operating = plant.trim(rho);
    let (a_there, b_there) = plant.jacobians_over(&points(&operating.state), &points(&operating.input));
    let differs = |here: &[Taylor], there: &[Taylor]| {
        let size = there.iter().map(|entry| entry.value.magnitude()).fold(0.0, f64::max);
        let is_far = |distance: f64| distance.is_nan() || distance > SAME * size;
        here.iter().zip(there).any(|(a, b)| is_far((a.value - b.value).magnitude()))
    };
    (differs(&a, &a_there) || differs(&b, &b_there)).then_some(Unrest::Elsewhere)
}

/// Whether Ax_ref + Bu is zero to the last bit, of a linear plant whose A and B are known exactly. Rounding takes nothing: the sums are those of
/// integers.
pub fn rests_exactly(plant: &dyn Plant, reference: &[f64], input: &[f64]) -> bool {
    let points =
        |values: &[f64]| values.iter().map(|&value| Taylor::constant(Interval::point(value))).collect::<Vec<_>>();
    let (a, b) = plant.jacobians_over(&points(reference), &points(input));
    let n = reference.len();
    let m = input.len();
    (0..n).all(|i| {
        let of = |entries: &[Taylor], values: &[f64], width: usize| -> Option<Vec<(f64, f64)>> {
            let factors = entries[i * width..(i + 1) * width].iter().zip(values);
            let exact = |(entry, &value): (&Taylor, &f64)| {
                let entry = entry.value;
                (entry.lo() == entry.hi() && value.is_finite()).then_some((entry.lo(), value))
            };
            factors.map(exact).collect()
        };
        let products = of(&a, reference, n).zip(of(&b, input, m));
        products.is_some_and(|(state, input)| is_zero_sum(&[state, input].concat()))
    })
}
