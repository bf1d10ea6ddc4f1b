//! Claims that fail on a narrow interval of the parameter only, away from the middles of cells and from grid points,
//! or by next to nothing not at all.

use super::attack;
use crate::Tally;
use crate::loops::{Family, Scheduled};
use crate::numbers::Numbers;
use lpv::certificate::ProofOptions;
use lpv::controller::{InputLimits, Schedule};
use lpv::math::Mat;
use lpv::math::matrix::{diagonal, identity};
use lpv::model::{BasisFunction, MatrixFunction};
use lpv::synthesis::{CostWeights, RateBounded};

fn polynomial(coefficients: [f64; 3]) -> MatrixFunction {
    let coefficients = coefficients.map(|c| Mat::from_fn(1, 1, |_, _| c)).to_vec();
    MatrixFunction { basis: BasisFunction::powers(0, 2), coefficients }
}

/// c((ρ − ρ₀)² − w) + `plus`, exactly.
fn valley(c: f64, at: f64, w: f64, plus: f64) -> [f64; 3] {
    [c * (at * at - w) + plus, -2.0 * c * at, c]
}

/// ẋ = a(ρ)x + u, u = −kx with V = x²/y(ρ); ρ in [−1, 1].
pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    // of few bits, so that the polynomials are what they are meant to be
    let at = (numbers.next() * 512.0).round() / 512.0;
    let c = numbers.of(&[1.0, 4.0, 0.25]);
    let w = numbers.of(&[-1.0, 1.0, 1.0]) * 4.0_f64.powi(-3 - numbers.below(8) as i32);
    let k = 2.0;
    let rate = numbers.of(&[0.0, 0.5, 1.0, 2.0]);
    let mut weights = CostWeights { q: identity(1), r: identity(1) };
    let (mut y, mut limits, mut gamma) = ([1.0, 0.0, 0.0], InputLimits::none(1), None);
    let a;
    match numbers.below(6) {
        // the decrease is 2(k − a)y
        0 => a = valley(-c, at, w, k),
        // with the parameter's motion: 2(k − a)y ± r y′
        1 => {
            let slope = numbers.of(&[0.25, -0.25]);
            y = [1.0, slope, 0.0];
            // 2(k − a) = r|y′| + c((ρ − ρ₀)² − w), but for y, which is 1 at most of the places: there it fails or not
            y[0] -= slope * at;
            a = valley(-0.5 * c, at, w, k - 0.5 * rate * slope.abs());
        }
        // a hump that comes down to next to nothing, or below, at one end of the range
        5 => {
            let end = numbers.of(&[1.0, -1.0]);
            let from = -end * at.abs();
            a = valley(c, from, (end - from) * (end - from) - w, k);
        }
        // y itself
        2 => {
            y = valley(c, at, w, 0.0);
            a = [-1.0, 0.0, 0.0];
        }
        // the unsaturated set: σ² > γ k² y
        3 => {
            y = valley(-0.25 * c, at, 0.0, 1.0);
            let room = numbers.of(&[1.0, 2.0]);
            limits = InputLimits { min: vec![Some(-room)], max: vec![Some(room)] };
            gamma = Some(room * room / (k * k) * (1.0 + 0.25 * w));
            a = [-8.0, 0.0, 0.0];
        }
        // the cost: κ 2(k − a) > q + k² with y = 1
        _ => {
            weights = CostWeights { q: diagonal(&[0.5]), r: diagonal(&[0.25]) };
            a = valley(-c, at, w, k - 0.5 * 1.5 / 1.01);
        }
    }
    let high = Mat::from_fn(1, 1, |_, _| k);
    let basis = |coefficients: [f64; 3]| polynomial(coefficients);
    let l = gamma.map(|_| {
        let y = basis(y);
        MatrixFunction { coefficients: y.coefficients.iter().map(|y| k * y).collect(), basis: y.basis }
    });
    let count = 4 + numbers.below(5);
    let grid: Vec<f64> = (0..count).map(|k| -1.0 + 2.0 * k as f64 / (count - 1) as f64).collect();
    let schedule = match numbers.below(2) {
        0 => Schedule::Constant { gain: high },
        _ => Schedule::Grid { parameters: grid.clone(), period: None, gains: vec![high; count] },
    };
    let scheduled = Scheduled {
        weights,
        schedule,
        points: grid.iter().map(|&rho| (rho, identity(1), None)).collect(),
        rate_bounded: Some(RateBounded { rate, y: basis(y), l }),
        limits,
        gamma,
        high: false,
        sample_time_s: 0.01,
    };
    let constant = |value: f64| MatrixFunction::constant(Mat::from_fn(1, 1, |_, _| value));
    let of = scheduled.build(Family::new(basis(a), constant(1.0), [-1.0, 1.0], false));
    attack(numbers, tally, &of, &ProofOptions::default(), &[at, -1.0, 1.0, (at + 0.125).min(1.0)]).map(|_| ())
}
