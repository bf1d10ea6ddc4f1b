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
        tally.witnesses += usize::from(is_refuted_by_its_step(claim));
        sampled(numbers, linear, claim)
            .map_err(|reason| format!("{} is {}: {reason}", claim.id, claim.verdict.word()))?;
    }
    Ok(claims)
}

/// Whether the claim is refuted by a sample that [`sampled`] takes again.
pub fn is_refuted_by_its_step(claim: &Claim) -> bool {
    claim.verdict == Verdict::Refuted && matches!(claim.kind, ClaimKind::SampledInvariance { .. })
}

/// The claims about the loop with zero-order hold.
pub fn sampled(numbers: &mut Numbers, linear: &Linear, claim: &Claim) -> Result<(), String> {
    let Linear { a, b, k, p, sample_time_s, .. } = linear;
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
            let held = Held::of(linear);
            for _ in 0..3 {
                let share = if between { numbers.of(&[1.0, 0.5, 0.25, 0.9]) } else { 1.0 };
                let mut x: Vec<f64> = (0..a.nrows()).map(|_| numbers.next()).collect();
                let scale = (level / quadratic_form(p, &x)).sqrt() * numbers.of(&[1.0, 1.0, 0.3]);
                x.iter_mut().for_each(|x| *x *= scale);
                let next = held.after(&x, &held.input(&x), share * sample_time_s);
                let (v, after) = (quadratic_form(p, &x), quadratic_form(p, &next));
                if after > v * (1.0 + 1e-9) {
                    return Err(format!("V goes from {v} to {after} after {share} of the sample time"));
                }
            }
            Ok(())
        }
        (ClaimKind::SampledInvariance { level, .. }, Verdict::Refuted) => {
            let x = &claim.witness.as_ref().ok_or("there is no witness")?.state;
            let held = Held::of(linear);
            let next = held.after(x, &held.input(x), *sample_time_s);
            let rounding = |x: &[f64]| 1e-12 * p.norm_max() * x.iter().map(|x| x.abs()).sum::<f64>().powi(2);
            let (v, after) = (quadratic_form(p, x), quadratic_form(p, &next));
            let is_in = v <= level + rounding(x);
            let leaves = after >= level - rounding(&next);
            if is_in && leaves { Ok(()) } else { Err(format!("V goes from {v} to {after}, of {level}")) }
        }
        (ClaimKind::SampledCost { factor, level, .. }, Verdict::Proved) => {
            let held = Held::of(linear);
            let mut x: Vec<f64> = (0..a.nrows()).map(|_| numbers.next()).collect();
            let scale = level.map_or(1.0, |level| (level / quadratic_form(p, &x)).sqrt());
            x.iter_mut().for_each(|x| *x *= scale * (1.0 - 1e-12));
            let bound = factor * quadratic_form(p, &x);
            let cost = held.cost(x, 200);
            if cost > bound * (1.0 + 1e-6) {
                Err(format!("the motion costs {cost}, more than {bound}"))
            } else {
                Ok(())
            }
        }
        _ => Ok(()),
    }
}

/// The saturated loop with zero-order hold, in floating point.
struct Held<'a> {
    linear: &'a Linear,
    /// How far the inputs go below and above their operating values.
    sides: (Vec<f64>, Vec<f64>),
}

impl<'a> Held<'a> {
    fn of(linear: &'a Linear) -> Self {
        Self { linear, sides: crate::loops::sides(&linear.limits, &linear.operating) }
    }

    /// sat(Kx), which is subtracted.
    fn input(&self, x: &[f64]) -> Vec<f64> {
        let (k, (below, above)) = (&self.linear.k, &self.sides);
        let row = |i: usize| x.iter().enumerate().map(|(j, x)| k[(i, j)] * x).sum::<f64>();
        (0..k.nrows()).map(|i| row(i).clamp(-below[i], above[i])).collect()
    }

    /// x after `time_s` with the input held.
    fn after(&self, x: &[f64], held: &[f64], time_s: f64) -> Vec<f64> {
        moved(&discretize(&self.linear.a, &self.linear.b, time_s), x, held)
    }

    /// ∫ xᵀQx + uᵀRu dt over that many samples, by Simpson's rule.
    fn cost(&self, mut x: Vec<f64>, samples: usize) -> f64 {
        let Linear { a, b, weights, sample_time_s, .. } = self.linear;
        let time_s = sample_time_s / PARTS as f64;
        let part = discretize(a, b, time_s);
        let mut cost = 0.0;
        for _ in 0..samples {
            let held = self.input(&x);
            let stage = |x: &[f64]| quadratic_form(&weights.q, x) + quadratic_form(&weights.r, &held);
            cost += stage(&x);
            for k in 1..=PARTS {
                x = moved(&part, &x, &held);
                cost += stage(&x) * if k == PARTS { 1.0 } else { [2.0, 4.0][k % 2] };
            }
        }
        cost * time_s / 3.0
    }
}

/// Parts of a sample, even: Simpson's rule is then right to a few parts in 10⁷ where a sample is as long as the plant's own motion.
const PARTS: usize = 32;

/// Φx − Γu
fn moved((phi, gamma): &(Mat<f64>, Mat<f64>), x: &[f64], held: &[f64]) -> Vec<f64> {
    let row = |m: &Mat<f64>, i: usize, y: &[f64]| y.iter().enumerate().map(|(j, y)| m[(i, j)] * y).sum::<f64>();
    (0..x.len()).map(|i| row(phi, i, x) - row(gamma, i, held)).collect()
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
