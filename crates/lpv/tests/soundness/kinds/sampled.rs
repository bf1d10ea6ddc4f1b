//! Sampled loops of chains of integrators, whose zero-order hold is a polynomial: exactly stable or not; and with saturation, from
//! samples at the edge of the set.

use super::attack;
use super::linear::{sampled, sampled_exactly};
use crate::Tally;
use crate::loops::Linear;
use crate::numbers::Numbers;
use lpv::certificate::{ClaimKind, ProofOptions, Verdict};
use lpv::controller::InputLimits;
use lpv::math::Mat;
use lpv::math::matrix::{from_rows, identity, symmetric_part};
use lpv::math::riccati;
use lpv::synthesis::CostWeights;

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let n = 1 + numbers.below(2);
    let a = if n == 1 { Mat::zeros(1, 1) } else { from_rows(&[vec![0.0, 1.0], vec![0.0, 0.0]]) };
    let b = Mat::from_fn(n, 1, |i, _| f64::from(u8::from(i + 1 == n)));
    let weights = CostWeights { q: identity(n), r: Mat::from_fn(1, 1, |_, _| 10.0_f64.powf(numbers.next())) };
    let optimal = riccati::solve(&a, &b, &weights.q, &weights.r).map_err(|error| error.to_string())?;
    let p = symmetric_part(&(1.05 * &optimal.p));
    let f = optimal.k.clone();
    let s = numbers.of(&[0.0, 0.5, 1.9, 10.0]);
    let k = Mat::from_fn(1, n, |i, j| f[(i, j)] * (1.0 + s));
    // T from far inside to just beyond the edge of stability
    let edge = if n == 1 { 2.0 / k[(0, 0)] } else { 2.0 / k[(0, 1)] };
    let sample_time_s = edge
        * match numbers.below(4) {
            0 => 1.0 + numbers.of(&[1e-15, -1e-15, 1e-9, -1e-9, 1e-4, -1e-4]),
            1 => 0.5 + numbers.unit(),
            _ => 10.0_f64.powf(-2.0 * numbers.unit()),
        };
    let is_high = s > 0.0;
    let limits = match numbers.below(4) {
        0 => InputLimits::none(1),
        _ => InputLimits { min: vec![Some(-1.0)], max: vec![Some(numbers.of(&[1.0, 2.0]))] },
    };
    let gamma = 0.9 * p[(n - 1, n - 1)] / (f[(0, n - 1)] * f[(0, n - 1)] + 1.0) * numbers.of(&[0.01, 0.3, 1.0]);
    let linear = Linear {
        a,
        b,
        weights,
        p,
        k,
        f: is_high.then_some(f),
        limits,
        operating: vec![0.0],
        gamma: Some(gamma),
        sample_time_s,
    };
    let of = linear.build().ok_or("the plant cannot be built")?;
    let claims = attack(numbers, tally, &of, &ProofOptions::default(), &[0.0])?;
    let stable = sampled_exactly(&linear).ok_or("a chain of integrators")?;
    for claim in &claims {
        match (&claim.kind, claim.verdict) {
            (ClaimKind::SampledStability { .. }, Verdict::Proved) if !stable => {
                return Err(format!("{} is proved, and the loop is exactly not stable", claim.id));
            }
            (ClaimKind::SampledStability { .. }, Verdict::Refuted) if stable => {
                return Err(format!("{} is refuted, and the loop is exactly stable", claim.id));
            }
            (ClaimKind::SampledInvariance { .. }, _) => {
                for _ in 0..8 {
                    sampled(numbers, &linear, claim).map_err(|reason| format!("{} is proved: {reason}", claim.id))?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}
