//! Sampled loops of chains of integrators, whose zero-order hold is a polynomial: exactly stable or not; and with
//! saturation, from samples at the edge of the set.

use super::attack;
use super::linear::{is_refuted_by_its_step, sampled, sampled_exactly};
use crate::Tally;
use crate::loops::Linear;
use crate::numbers::Numbers;
use lpv::certificate::{Claim, ClaimKind, ProofOptions, Verdict};
use lpv::controller::InputLimits;
use lpv::math::Mat;
use lpv::math::matrix::{from_rows, identity, symmetric_part};
use lpv::math::riccati;
use lpv::synthesis::CostWeights;

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    if numbers.once_in(4) {
        return of_the_first_order(numbers, tally);
    }
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
            (ClaimKind::SampledInvariance { .. } | ClaimKind::SampledCost { .. }, verdict) => {
                tally.witnesses += usize::from(is_refuted_by_its_step(claim));
                for _ in 0..8 {
                    sampled(numbers, &linear, claim)
                        .map_err(|reason| format!("{} is {}: {reason}", claim.id, verdict.word()))?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// ẋ = ax + bu, u = −kx held for T: x₊ = (e^{aT} − bk(e^{aT} − 1)/a)x, at the edge −1 or near it; exactly on it where
/// a = 0.
fn of_the_first_order(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let scalar = |value: f64| Mat::from_fn(1, 1, |_, _| value);
    let (a, b) = (numbers.of(&[0.0, 1.0, -1.0]) * (0.2 + numbers.unit()), 0.5 + numbers.unit());
    let off = numbers.of(&[0.0, 1e-13, -1e-13, 1e-6, -1e-6, 1e-3, -1e-3, 0.02, -0.02]);
    let (b, k, sample_time_s) = if a == 0.0 {
        let [b, k] = [0, 1].map(|_| 2.0_f64.powi(numbers.below(9) as i32 - 4));
        (b, k, 2.0 / (b * k) * (1.0 + off))
    } else {
        let sample_time_s = 0.2 + 1.5 * numbers.unit();
        let growth = (a * sample_time_s).exp_m1();
        (b, a * (growth + 2.0) / (b * growth) * (1.0 + off), sample_time_s)
    };
    let linear = Linear {
        a: scalar(a),
        b: scalar(b),
        weights: CostWeights { q: scalar(1.0), r: scalar(1.0) },
        p: scalar(1.0),
        k: scalar(k),
        f: None,
        limits: InputLimits::none(1),
        operating: vec![0.0],
        gamma: None,
        sample_time_s,
    };
    let of = linear.build().ok_or("the plant cannot be built")?;
    let claims = attack(numbers, tally, &of, &ProofOptions::default(), &[0.0])?;
    let kind = |claim: &&Claim| matches!(claim.kind, ClaimKind::SampledStability { .. });
    let claim = claims.iter().find(kind).ok_or("nothing is said of the sampled loop")?;
    // 1 − |λ|, to rounding
    let factor = (a * sample_time_s).exp() - if a == 0.0 { 0.0 } else { b * k * (a * sample_time_s).exp_m1() / a };
    let inside = match sampled_exactly(&linear) {
        Some(true) => f64::INFINITY,
        Some(false) => f64::NEG_INFINITY,
        None => 1.0 - factor.abs(),
    };
    match claim.verdict {
        Verdict::Proved if inside < -1e-12 => Err(format!("{} is proved, and λ is {factor}", claim.id)),
        Verdict::Refuted if inside > 1e-12 => Err(format!("{} is refuted, and λ is {factor}", claim.id)),
        _ => Ok(()),
    }
}
