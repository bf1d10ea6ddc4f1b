//! Plants whose matrices turn with a parameter: frozen designs and designs for a rate, low and high gain.

use super::linear::regulator;
use super::{around, attack};
use crate::Tally;
use crate::loops::{Family, Loop, Scheduled};
use crate::numbers::Numbers;
use lpv::certificate::ProofOptions;
use lpv::controller::Schedule;
use lpv::math::matrix::inverse_spd;
use lpv::model::{BasisFunction, MatrixFunction};
use lpv::synthesis::RateBounded;
use std::f64::consts::{PI, TAU};

/// A loop, what is asked of it, and values of the parameter.
pub fn generate(numbers: &mut Numbers) -> Option<(Loop, ProofOptions, Vec<f64>)> {
    let (n, m) = (1 + numbers.below(3), 1 + numbers.below(2));
    let spread = 2.0_f64.powi(-(numbers.below(10) as i32));
    let linear = regulator(numbers, n, m, spread)?;
    let size = 2.0_f64.powi(-(numbers.below(9) as i32) - 1);
    let periodic = numbers.once_in(2);
    let is_bounded = !periodic || numbers.once_in(2);
    let basis =
        if periodic { BasisFunction::harmonics(0, 1) } else { BasisFunction::powers(0, 1 + numbers.below(2) as u32) };
    let plant = Family::new(
        around(numbers, &linear.a, &basis, size, false),
        around(numbers, &linear.b, &basis, 0.2 * size, false),
        if periodic { [-PI, PI] } else { [-1.0, 1.0] },
        periodic,
    );
    let count = 4 + numbers.below(5);
    let grid: Vec<f64> = (0..count)
        .map(
            |k| if periodic { -PI + TAU * k as f64 / count as f64 } else { -1.0 + 2.0 * k as f64 / (count - 1) as f64 },
        )
        .collect();
    let schedule = match numbers.below(3) {
        0 => {
            let function = around(numbers, &linear.k, &basis, 0.3 * size, false);
            let gains = grid.iter().map(|&rho| function.at(&[rho])).collect();
            Schedule::Grid { parameters: grid.clone(), period: periodic.then_some(TAU), gains }
        }
        _ => Schedule::Constant { gain: linear.k.clone() },
    };
    let y0 = inverse_spd(&linear.p)?;
    let y_size = 0.2 * size * y0.norm_max();
    let y = around(numbers, &y0, &basis, y_size, true);
    let f = linear.f.filter(|_| is_bounded);
    let rate = numbers.of(&[0.0, 0.01, 0.1, 1.0, 5.0]);
    let low = f.as_ref().unwrap_or(&linear.k);
    let l = linear.gamma.map(|_| MatrixFunction {
        basis: basis.clone(),
        coefficients: y.coefficients.iter().map(|y| low * y).collect(),
    });
    let p = around(numbers, &linear.p, &basis, 0.05 * size, true);
    let points = grid.iter().map(|&rho| (rho, p.at(&[rho]), f.clone())).collect();
    let high = f.is_some();
    let rate_bounded = is_bounded.then_some(RateBounded { rate, y, l });
    let scheduled = Scheduled {
        weights: linear.weights,
        schedule,
        points,
        rate_bounded,
        limits: linear.limits,
        gamma: linear.gamma.map(|gamma| 0.8 * gamma),
        high,
        sample_time_s: linear.sample_time_s,
    };
    let options =
        ProofOptions { rate: (numbers.below(4) > 0 && !is_bounded).then_some(rate), level: None, nonlinear: false };
    let (low, high) = if periodic { (-PI, PI) } else { (-1.0, 1.0) };
    let mut positions: Vec<f64> = (0..5).map(|_| low + (high - low) * numbers.unit()).collect();
    positions.extend([low, high]);
    Some((scheduled.build(plant), options, positions))
}

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let Some((of, options, positions)) = generate(numbers) else {
        tally.refused += 1;
        return Ok(());
    };
    attack(numbers, tally, &of, &options, &positions).map(|_| ())
}
