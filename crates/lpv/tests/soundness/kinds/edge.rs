//! Claims within a rounding error of their edge, on either side of it or on it: exact arithmetic alone knows.

use super::linear::{examine, sampled_exactly};
use super::polytope;
use crate::Tally;
use crate::loops::Linear;
use crate::numbers::Numbers;
use lpv::certificate::{ClaimKind, PolytopicClaim, PolytopicLyapunov, Verdict};
use lpv::controller::InputLimits;
use lpv::math::Mat;
use lpv::math::matrix::{from_rows, identity};
use lpv::model::Polytope;
use lpv::synthesis::CostWeights;
use lpv::synthesis::polytopic::InputBounds;

fn scalar(value: f64) -> Mat<f64> {
    Mat::from_fn(1, 1, |_, _| value)
}

/// A number in (1/2, 4) with all its digits.
fn full(numbers: &mut Numbers) -> f64 {
    0.5 + 3.5 * numbers.unit()
}

/// A few units of the last place away, or not at all.
fn nudged(numbers: &mut Numbers, x: f64) -> f64 {
    let steps = numbers.of(&[0, 0, 0, 1, -1, 2, -3]);
    (0..i32::abs(steps)).fold(x, |x, _| if steps > 0 { x.next_up() } else { x.next_down() })
}

fn plain(a: Mat<f64>, b: Mat<f64>, k: Mat<f64>, p: Mat<f64>) -> Linear {
    let (n, m) = (a.nrows(), b.ncols());
    Linear {
        a,
        b,
        weights: CostWeights { q: identity(n), r: identity(m) },
        p,
        k,
        f: None,
        limits: InputLimits::none(m),
        operating: vec![0.0; m],
        gamma: None,
        sample_time_s: 0.01,
    }
}

fn generate(numbers: &mut Numbers) -> Linear {
    let (a, b, k, q, r) = (full(numbers), full(numbers), full(numbers), full(numbers), full(numbers));
    match numbers.below(6) {
        // a = bk
        0 => plain(scalar(nudged(numbers, b * k)), scalar(b), scalar(k), scalar(q)),
        // 2p(bk − a) = q + k²r
        1 => {
            let k = (a + full(numbers)) / b;
            let p = nudged(numbers, (q + k * k * r) / (2.0 * (b * k - a)));
            let linear = plain(scalar(a), scalar(b), scalar(k), scalar(p));
            Linear { weights: CostWeights { q: scalar(q), r: scalar(r) }, ..linear }
        }
        // γk² = σ²p
        2 => {
            let (k, sigma) = ((a + 1.0) / b, full(numbers));
            let gamma = nudged(numbers, sigma * sigma * q / (k * k));
            let limits = InputLimits { min: vec![Some(-sigma)], max: vec![Some(sigma)] };
            Linear { limits, gamma: Some(gamma), ..plain(scalar(a), scalar(b), scalar(k), scalar(q)) }
        }
        // −(A + Aᵀ) = [1, c; c, c²], K = 0
        3 => {
            let c = full(numbers);
            let a = from_rows(&[vec![-1.0, -c], vec![-c, -nudged(numbers, c * c)]]);
            plain(a, Mat::zeros(2, 1), Mat::zeros(1, 2), identity(2))
        }
        // P = [1, c; c, c²]
        4 => {
            let c = full(numbers);
            let p = from_rows(&[vec![1.0, c], vec![c, nudged(numbers, c * c)]]);
            plain(Mat::from_fn(2, 2, |i, j| if i == j { -1.0 } else { 0.0 }), Mat::zeros(2, 1), Mat::zeros(1, 2), p)
        }
        // 1 − bkT = −1
        _ => {
            let sample_time_s = nudged(numbers, 2.0 / (b * k));
            Linear { sample_time_s, ..plain(scalar(0.0), scalar(b), scalar(k), scalar(q)) }
        }
    }
}

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let linear = generate(numbers);
    let claims = examine(numbers, tally, &linear)?;
    let stable = sampled_exactly(&linear);
    for claim in claims.iter().filter(|claim| matches!(claim.kind, ClaimKind::SampledStability { .. })) {
        if let (Some(stable), Verdict::Proved | Verdict::Refuted) = (stable, claim.verdict)
            && stable != (claim.verdict == Verdict::Proved)
        {
            return Err(format!("{} is {}, and exactly it is not so", claim.id, claim.verdict.word()));
        }
    }
    // the same over a polytope of one vertex
    let sigma = linear.limits.max.iter().map(|max| max.unwrap_or(f64::INFINITY)).collect();
    let claim = PolytopicClaim {
        polytope: Polytope::new(vec![linear.a], vec![linear.b]).map_err(|error| error.to_string())?,
        lyapunov: PolytopicLyapunov::Common { p: linear.p, gain: vec![linear.k] },
        auxiliary_gain: None,
        weights: Some(linear.weights),
        saturation: linear.gamma.map(|gamma| InputBounds { sigma, gamma }),
    };
    polytope::examine(numbers, tally, &claim).map(|_| ())
}
