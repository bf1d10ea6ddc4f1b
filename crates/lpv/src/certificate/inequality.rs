//! The matrix inequalities of a design, block by block, from K, F and P.

use crate::math::Mat;
use crate::math::eigen::smallest_eigenvalue;
use crate::math::matrix::{inverse_spd, symmetric_part};
use crate::model::{FrozenModel, linearize};
use crate::plant::Plant;
use crate::synthesis::{Design, FrozenDesign};
use serde::Serialize;

/// Limited inputs up to which every mixture of rows is computed.
const MOST_ENUMERATED: usize = 10;

/// λ_min of one block.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlockMargin {
    /// Parameter value of the grid point.
    pub parameter: f64,
    /// Which inequality.
    pub name: String,
    /// Its smallest eigenvalue, NaN when P is not positive definite.
    pub smallest_eigenvalue: f64,
}

/// λ_min of every block of the inequalities of a design at every grid point: (4.36) for LPVQR; (5.18), (5.19) for SLPVQR;
/// (5.20) for all 2^m mixtures and (5.21) for high gain.
///
/// The blocks are in Y = P⁻¹ and L = KY, as printed, with the K that flies: the schedule's, not the point's. A design for
/// a moving parameter has ±Ẏ in its first block, at both ends of its rate interval.
pub fn block_margins(design: &Design, plant: &dyn Plant) -> Vec<BlockMargin> {
    let margins = |point: &FrozenDesign| point_margins(design, point, &linearize(plant, point.rho));
    design.points.iter().flat_map(margins).collect()
}

/// The margins at one grid point; `model` is the linearisation there.
fn point_margins(design: &Design, point: &FrozenDesign, model: &FrozenModel) -> Vec<BlockMargin> {
    let block = |name: String, smallest_eigenvalue| BlockMargin { parameter: point.rho, name, smallest_eigenvalue };
    let mut margins = vec![block("P".into(), smallest_eigenvalue(&point.p))];
    let gain = design.controller.schedule.gain_matrix(point.rho);
    let inverses = (inverse_spd(&point.p), inverse_spd(&design.weights.q), inverse_spd(&design.weights.r));
    let (Some(y), Some(q_inverse), Some(r_inverse)) = inverses else {
        margins.push(block("P, Q, R invertible".into(), f64::NAN));
        return margins;
    };
    let y_rate = (design.rate_bounded.as_ref()).map(|bounded| bounded.rate * bounded.y.derivative(&[point.rho], 0));
    // the worse of both ends of the rate interval
    let performance = |gain: &Mat<f64>| {
        let block = performance_block(model, &y, &(gain * &y), &q_inverse, &r_inverse);
        match &y_rate {
            None => smallest_eigenvalue(&block),
            Some(rate) => smallest_eigenvalue(&with_rate(&block, rate, 1.0))
                .min(smallest_eigenvalue(&with_rate(&block, rate, -1.0))),
        }
    };

    let sigma = design.controller.limits.symmetric_bound(&design.controller.operating_input);
    match &point.auxiliary_gain {
        None => margins.push(block("performance".into(), performance(&gain))),
        Some(auxiliary) => {
            let inputs = gain.nrows();
            // an input without limit flies K; of many inputs the two ends stand for all mixtures
            let limited: Vec<usize> = (0..inputs).filter(|&i| sigma[i].is_finite()).collect();
            let all = if limited.is_empty() { vec![1] } else { vec![0, u64::MAX] };
            let vertices: Vec<u64> = match limited.len() {
                count @ 1..=MOST_ENUMERATED => (0..1 << count).collect(),
                _ => all,
            };
            margins.extend(vertices.into_iter().map(|vertex| {
                let is_low =
                    |i: usize| limited.iter().position(|&l| l == i).is_some_and(|bit| vertex >> bit.min(63) & 1 == 0);
                let mixture =
                    Mat::from_fn(inputs, gain.ncols(), |i, j| if is_low(i) { auxiliary[(i, j)] } else { gain[(i, j)] });
                let rows: String = (0..inputs).rev().map(|i| if is_low(i) { '0' } else { '1' }).collect();
                block(format!("performance of mixture {rows}"), performance(&mixture))
            }));
        }
    }
    if let Some(gamma) = design.method.gamma() {
        let unsaturated = point.auxiliary_gain.as_ref().unwrap_or(&gain) * &y;
        margins.extend(sigma.iter().enumerate().filter(|(_, bound)| bound.is_finite()).map(|(i, bound)| {
            let matrix = unsaturated_block(&y, &unsaturated, i, bound * bound / gamma);
            block(format!("input {} unsaturated", i + 1), smallest_eigenvalue(&matrix))
        }));
    }
    margins
}

/// (2.33)
fn performance_block(
    model: &FrozenModel,
    y: &Mat<f64>,
    l: &Mat<f64>,
    q_inverse: &Mat<f64>,
    r_inverse: &Mat<f64>,
) -> Mat<f64> {
    let (n, m) = (y.nrows(), l.nrows());
    let flow = &model.a * y - &model.b * l;
    let flow = symmetric_part(&flow);
    Mat::from_fn(2 * n + m, 2 * n + m, |i, j| match (i / n, j / n) {
        (0, 0) => -2.0 * flow[(i, j)],
        (0, 1) => y[(i, j - n)],
        (1, 0) => y[(i - n, j)],
        (1, 1) => q_inverse[(i - n, j - n)],
        (0, _) => l[(j - 2 * n, i)],
        (_, 0) => l[(i - 2 * n, j)],
        (1, _) | (_, 1) => 0.0,
        _ => r_inverse[(i - 2 * n, j - 2 * n)],
    })
}

/// `block` with `sign` · Ẏ added to its first block (4.32).
fn with_rate(block: &Mat<f64>, y_rate: &Mat<f64>, sign: f64) -> Mat<f64> {
    let n = y_rate.nrows();
    Mat::from_fn(block.nrows(), block.ncols(), |i, j| {
        if i < n && j < n { block[(i, j)] + sign * y_rate[(i, j)] } else { block[(i, j)] }
    })
}

/// (5.19), row `i` of `l`.
fn unsaturated_block(y: &Mat<f64>, l: &Mat<f64>, row: usize, bound: f64) -> Mat<f64> {
    Mat::from_fn(1 + y.nrows(), 1 + y.nrows(), |i, j| match (i, j) {
        (0, 0) => bound,
        (0, j) => l[(row, j - 1)],
        (i, 0) => l[(row, i - 1)],
        (i, j) => y[(i - 1, j - 1)],
    })
}
