//! Random linear plants under low and high gains, with every mix of limits.

use super::attack;
use crate::Tally;
use crate::exact::{Dyadic, Exact};
use crate::loops::{Linear, level, limits};
use crate::numbers::Numbers;
use lpv::certificate::{Claim, ClaimKind, ProofOptions, Verdict};
use lpv::math::Mat;
use lpv::math::eigen::spectral_radius;
use lpv::math::hold::discretize;
use lpv::math::matrix::{diagonal, identity, quadratic_form, symmetric_part};
use lpv::math::riccati;
use lpv::synthesis::CostWeights;

/// A regulator from the Riccati equation with P a little larger, a low gain near it, and for half of them a high gain
/// on its segment.
pub fn regulator(numbers: &mut Numbers, n: usize, m: usize, size: f64) -> Option<Linear> {
    let (a, b) = (numbers.matrix(n, n), numbers.matrix(n, m));
    let r: Vec<f64> = (0..m).map(|_| 10.0_f64.powf(numbers.next())).collect();
    let q = match numbers.below(4) {
        0 => diagonal(&(0..n).map(|i| if i == 0 { 1.0 } else { numbers.of(&[0.0, 0.5]) }).collect::<Vec<f64>>()),
        _ => identity(n),
    };
    let mut weights = CostWeights { q, r: diagonal(&r) };
    let optimal = riccati::solve(&a, &b, &weights.q, &weights.r).ok()?;
    if numbers.once_in(8) && m > 1 {
        let couple = 0.3 * (r[0] * r[1]).sqrt() * numbers.next();
        (weights.r[(0, 1)], weights.r[(1, 0)]) = (couple, couple);
    }
    let scale = 1.0 + numbers.of(&[1e-6, 0.02, 0.05, 0.3]);
    let noise = numbers.symmetric(n);
    let p = symmetric_part(&(scale * &optimal.p));
    let p = Mat::from_fn(n, n, |i, j| p[(i, j)] * (1.0 + 0.2 * size * noise[(i, j)]));
    let spread = |numbers: &mut Numbers, around: &Mat<f64>| {
        let noise = numbers.matrix(m, n);
        Mat::from_fn(m, n, |i, j| around[(i, j)] * (1.0 + size * noise[(i, j)]))
    };
    let low = spread(numbers, &optimal.k);
    let is_high = numbers.once_in(2);
    let s: Vec<f64> = (0..m).map(|_| numbers.of(&[0.1, 0.5, 1.0, 1.9, 20.0])).collect();
    let high = Mat::from_fn(m, n, |i, j| low[(i, j)] + s[i] * (scale * optimal.k[(i, j)] - low[(i, j)]));
    let high = spread(numbers, &high);
    let operating: Vec<f64> = match numbers.below(3) {
        0 => (0..m).map(|_| numbers.next()).collect(),
        _ => vec![0.0; m],
    };
    let limits = limits(numbers, &operating);
    let sigma = limits.room(&operating);
    let reached = level(&p, &low, &sigma).unwrap_or(1.0);
    let share = numbers.of(&[1e-3, 0.5, 0.9, 0.999_999, 1.0, 1.000_001, 1.3, 30.0]);
    let gamma = (is_high || numbers.below(3) > 0).then_some(share * reached);
    let sample_time_s = 10.0_f64.powf(-2.0 + 1.5 * numbers.next());
    let (k, f) = if is_high { (high, Some(low)) } else { (low, None) };
    Some(Linear { a, b, weights, p, k, f, limits, operating, gamma, sample_time_s })
}

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let n = numbers.of(&[1, 1, 1, 2, 2, 2, 3, 3, 4, 6]);
    let m = if numbers.once_in(80) { 64 } else { 1 + numbers.below(4) };
    let size = 2.0_f64.powi(-(numbers.below(14) as i32) + 1);
    let Some(mut linear) = regulator(numbers, n, m, size) else {
        tally.refused += 1;
        return Ok(());
    };
    if numbers.once_in(6) {
        // numbers that meet edges exactly
        let sixteenths = |matrix: &Mat<f64>| {
            Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| (16.0 * matrix[(i, j)]).round() / 16.0)
        };
        (linear.a, linear.b, linear.p, linear.k) =
            (sixteenths(&linear.a), sixteenths(&linear.b), sixteenths(&linear.p), sixteenths(&linear.k));
        linear.f = linear.f.as_ref().map(sixteenths);
    }
    examine(numbers, tally, &linear).map(|_| ())
}

/// Prove and attack; sampled claims by the discrete loop itself.
pub fn examine(numbers: &mut Numbers, tally: &mut Tally, linear: &Linear) -> Result<Vec<Claim>, String> {
    let Some(of) = linear.build() else {
        tally.refused += 1;
        return Ok(Vec::new());
    };
    let claims = attack(numbers, tally, &of, &ProofOptions::default(), &[0.0])?;
    for claim in &claims {
        sampled(numbers, linear, claim)
            .map_err(|reason| format!("{} is {}: {reason}", claim.id, claim.verdict.word()))?;
    }
    Ok(claims)
}

/// The claims about the loop with zero-order hold.
pub fn sampled(numbers: &mut Numbers, linear: &Linear, claim: &Claim) -> Result<(), String> {
    let Linear { a, b, k, p, limits, operating, sample_time_s, .. } = linear;
    match (&claim.kind, claim.verdict) {
        (ClaimKind::SampledStability { .. }, Verdict::Proved | Verdict::Refuted) => {
            let (phi, gamma) = discretize(a, b, *sample_time_s);
            let closed = phi - gamma * k;
            let radius = spectral_radius(&closed);
            // of a defective matrix eigenvalues are known to the n-th root of rounding
            let rounding = 1e-13_f64.powf(1.0 / a.nrows() as f64).max(1e-9) * closed.norm_max().max(1.0);
            let off = if claim.verdict == Verdict::Proved { radius - 1.0 } else { 1.0 - radius };
            if off > rounding { Err(format!("the spectral radius is {radius}")) } else { Ok(()) }
        }
        (ClaimKind::SampledInvariance { level, .. }, Verdict::Proved) => {
            let between = claim.detail.contains("between");
            let (below, above) = crate::loops::sides(limits, operating);
            let (n, m) = (a.nrows(), b.ncols());
            for _ in 0..3 {
                let share = if between { numbers.of(&[1.0, 0.5, 0.25, 0.9]) } else { 1.0 };
                let (phi, gamma) = discretize(a, b, share * sample_time_s);
                let mut x: Vec<f64> = (0..n).map(|_| numbers.next()).collect();
                let scale = (level / quadratic_form(p, &x)).sqrt() * numbers.of(&[1.0, 1.0, 0.3]);
                x.iter_mut().for_each(|x| *x *= scale);
                let s: Vec<f64> =
                    (0..m).map(|i| (0..n).map(|j| k[(i, j)] * x[j]).sum::<f64>().clamp(-below[i], above[i])).collect();
                let next: Vec<f64> = (0..n)
                    .map(|i| {
                        (0..n).map(|j| phi[(i, j)] * x[j]).sum::<f64>()
                            - (0..m).map(|j| gamma[(i, j)] * s[j]).sum::<f64>()
                    })
                    .collect();
                let (v, after) = (quadratic_form(p, &x), quadratic_form(p, &next));
                if after > v * (1.0 + 1e-9) {
                    return Err(format!("V goes from {v} to {after} after {share} of the sample time"));
                }
            }
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Whether the sampled loop of one or two integrators is stable, exactly; `None` of other plants.
pub fn sampled_exactly(linear: &Linear) -> Option<bool> {
    let Linear { a, b, k, sample_time_s, .. } = linear;
    let one = Dyadic::from(1.0);
    let t = Dyadic::from(*sample_time_s);
    match a.nrows() {
        1 if a[(0, 0)] == 0.0 => {
            let gain = Exact::of(b).times(&Exact::of(k)).scalar();
            Some(one.exceeds(&(&one - &(&gain * &t)).abs()))
        }
        2 if a[(0, 1)] == 1.0 && a[(0, 0)] == 0.0 && a[(1, 0)] == 0.0 && a[(1, 1)] == 0.0 && b[(0, 0)] == 0.0 => {
            // x₊ = [1, T; 0, 1]x − [T²/2; T] b₂ kx
            let half = &(&t.square() * &Dyadic::from(0.5)) * &Dyadic::from(b[(1, 0)]);
            let whole = &t * &Dyadic::from(b[(1, 0)]);
            let [k1, k2] = [0, 1].map(|j| Dyadic::from(k[(0, j)]));
            let m = [[&one - &(&half * &k1), &t - &(&half * &k2)], [-&(&whole * &k1), &one - &(&whole * &k2)]];
            let trace = &m[0][0] + &m[1][1];
            let determinant = &(&m[0][0] * &m[1][1]) - &(&m[0][1] * &m[1][0]);
            // Jury
            Some(one.exceeds(&determinant.abs()) && (&one + &determinant).exceeds(&trace.abs()))
        }
        _ => None,
    }
}
