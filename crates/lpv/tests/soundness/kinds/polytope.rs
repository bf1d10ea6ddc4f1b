//! Polytopes of matrices with a common and with a parameter-dependent V, low and high gain.

use super::{cost_factor, decreasing, direction};
use crate::Tally;
use crate::conditions::{Bounds, check};
use crate::flight::Flown;
use crate::loops::{level, polytope_frozen, polytope_point, polytope_witness};
use crate::numbers::Numbers;
use lpv::certificate::{Claim, Motion, PolytopicClaim, PolytopicLyapunov, prove_polytopic};
use lpv::math::Mat;
use lpv::math::matrix::{diagonal, identity, inverse_spd, symmetric_part};
use lpv::math::riccati;
use lpv::model::Polytope;
use lpv::synthesis::CostWeights;
use lpv::synthesis::polytopic::InputBounds;

/// Vertices around a stabilisable pair, a gain and a P from its Riccati equation.
pub fn generate(numbers: &mut Numbers) -> Option<PolytopicClaim> {
    if numbers.once_in(10) {
        return opposed(numbers);
    }
    let is_coarse = numbers.once_in(3);
    let n = if is_coarse { 1 } else { numbers.of(&[1, 2, 2, 3, 4]) };
    let m = if numbers.once_in(300) { 64 } else { 1 + numbers.below(3) };
    let count = numbers.of(&[1, 2, 2, 3, 4]);
    let size = 2.0_f64.powi(-(numbers.below(10) as i32));
    // numbers that meet edges exactly
    let coarse = |matrix: Mat<f64>| match is_coarse {
        true => Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| (16.0 * matrix[(i, j)]).round() / 16.0),
        false => matrix,
    };
    let (a, b) = (numbers.matrix(n, n), numbers.matrix(n, m));
    let r: Vec<f64> = (0..m).map(|_| 10.0_f64.powf(numbers.next())).collect();
    let weights = CostWeights { q: coarse(identity(n)), r: coarse(diagonal(&r)) };
    let optimal = riccati::solve(&a, &b, &weights.q, &weights.r).ok()?;
    let spread = |numbers: &mut Numbers, center: &Mat<f64>, size: f64| {
        let noise = numbers.matrix(center.nrows(), center.ncols());
        coarse(Mat::from_fn(center.nrows(), center.ncols(), |i, j| center[(i, j)] + size * noise[(i, j)]))
    };
    let vertices_a: Vec<Mat<f64>> = (0..count).map(|_| spread(numbers, &a, size)).collect();
    let vertices_b: Vec<Mat<f64>> = (0..count).map(|_| spread(numbers, &b, 0.2 * size)).collect();
    let polytope = Polytope::new(vertices_a, vertices_b).ok()?;
    let scale = 1.0 + numbers.of(&[0.01, 0.1, 0.5]);
    let p = coarse(symmetric_part(&(scale * &optimal.p)));
    let is_high = numbers.once_in(2);
    let low = coarse(optimal.k.clone());
    let s = numbers.of(&[0.5, 1.9, 10.0]);
    let high = Mat::from_fn(m, n, |i, j| low[(i, j)] + s * (scale * optimal.k[(i, j)] - low[(i, j)]));
    let high = if is_high { coarse(high) } else { low.clone() };
    let gain: Vec<Mat<f64>> = (0..count).map(|_| spread(numbers, &high, 0.3 * size)).collect();
    let sigma: Vec<f64> = (0..m).map(|_| numbers.of(&[f64::INFINITY, 0.5, 1.0, 2.0, 1.0, 0.0625])).collect();
    let f: Vec<Mat<f64>> = (0..count).map(|_| spread(numbers, &low, 0.1 * size)).collect();
    let reached = level(&p, if is_high { &f[0] } else { &gain[0] }, &sigma).unwrap_or(1.0);
    let share = numbers.of(&[0.01, 0.5, 0.9, 1.0, 1.1, 10.0]);
    let gamma = if is_coarse { ((16.0 * share * reached).ceil() / 16.0).max(0.0625) } else { share * reached };
    let saturation = (is_high || numbers.once_in(2)).then_some(InputBounds { sigma, gamma });
    let lyapunov = if count == 1 || numbers.once_in(2) {
        PolytopicLyapunov::Common { p, gain }
    } else {
        let y0 = inverse_spd(&p)?;
        let y_size = 0.2 * size * y0.norm_max();
        let y: Vec<Mat<f64>> = (0..count)
            .map(|_| {
                let noise = numbers.symmetric(n);
                coarse(Mat::from_fn(n, n, |i, j| y0[(i, j)] + y_size * noise[(i, j)]))
            })
            .collect();
        let l = gain.iter().zip(&y).map(|(k, y)| coarse(k * y)).collect();
        let rate = numbers.of(&[0.0, 0.0625, 0.25, 1.0, 4.0]);
        let pairs = (0..count).flat_map(|i| (0..count).map(move |j| (i, j))).filter(|(i, j)| i != j);
        let vertex = |(i, j): (usize, usize)| {
            (0..count)
                .map(|v| {
                    if v == i {
                        rate
                    } else if v == j {
                        -rate
                    } else {
                        0.0
                    }
                })
                .collect()
        };
        PolytopicLyapunov::ParameterDependent { y, l, rate_vertices: pairs.map(vertex).collect() }
    };
    Some(PolytopicClaim {
        polytope,
        lyapunov,
        auxiliary_gain: is_high.then_some(f),
        weights: (numbers.below(4) > 0).then_some(weights),
        saturation,
    })
}

/// Two vertices whose inputs act in opposite directions, with gains to match: halfway no input acts, and a alone is
/// left.
fn opposed(numbers: &mut Numbers) -> Option<PolytopicClaim> {
    let scalar = |value: f64| Mat::from_fn(1, 1, |_, _| value);
    let [b, k, p] = [0, 1, 2].map(|_| 0.5 + numbers.unit());
    let weights = CostWeights { q: scalar(1.0), r: scalar(0.25) };
    if numbers.once_in(2) {
        return tight_between(numbers, [b, k, p], weights);
    }
    // the decrease halfway is −2pa, and the cost asks for q
    let a = match numbers.below(2) {
        0 => -(1.5 * numbers.unit()) / (2.0 * p),
        _ => 0.3 * numbers.next(),
    };
    let polytope = Polytope::new(vec![scalar(a); 2], vec![scalar(b), scalar(-b)]).ok()?;
    let gain = vec![scalar(k), scalar(-k)];
    let lyapunov = match numbers.below(2) {
        0 => PolytopicLyapunov::Common { p: scalar(p), gain },
        _ => PolytopicLyapunov::ParameterDependent {
            y: vec![scalar(1.0 / p); 2],
            l: gain.iter().map(|k| (1.0 / p) * k).collect(),
            rate_vertices: vec![vec![1.0, -1.0], vec![-1.0, 1.0]],
        },
    };
    Some(PolytopicClaim { polytope, lyapunov, auxiliary_gain: None, weights: Some(weights), saturation: None })
}

/// Two vertices at which the cost is just below its bound, and halfway it is just below or above it: with b ± d and k
/// ± e the conditions of the vertices are δ each, and that of the pair is 2δ − (8pde − 2re²).
fn tight_between(numbers: &mut Numbers, [b, k, p]: [f64; 3], weights: CostWeights) -> Option<PolytopicClaim> {
    let scalar = |value: f64| Mat::from_fn(1, 1, |_, _| value);
    let (q, r) = (weights.q[(0, 0)], weights.r[(0, 0)]);
    let (delta, e) = (0.02 * q, 0.1 + 0.2 * numbers.unit());
    let d = (q * numbers.unit() + 2.0 * r * e * e) / (8.0 * p * e);
    let vertices = [(b + d, k + e), (b - d, k - e)];
    let a = vertices.map(|(b, k)| scalar(b * k - (q + r * k * k + delta) / (2.0 * p)));
    let polytope = Polytope::new(a.to_vec(), vertices.map(|(b, _)| scalar(b)).to_vec()).ok()?;
    let lyapunov = PolytopicLyapunov::Common { p: scalar(p), gain: vertices.map(|(_, k)| scalar(k)).to_vec() };
    Some(PolytopicClaim { polytope, lyapunov, auxiliary_gain: None, weights: Some(weights), saturation: None })
}

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let Some(claim) = generate(numbers) else {
        tally.refused += 1;
        return Ok(());
    };
    examine(numbers, tally, &claim).map(|_| ())
}

pub fn examine(numbers: &mut Numbers, tally: &mut Tally, claim: &PolytopicClaim) -> Result<Vec<Claim>, String> {
    let claims = prove_polytopic(claim);
    tally.count(&claims);
    let (count, n, m) = (claim.polytope.len(), claim.polytope.states(), claim.polytope.inputs());
    let unlimited = vec![f64::INFINITY; m];
    let sigma = claim.saturation.as_ref().map_or(&unlimited, |bounds| &bounds.sigma);
    let bounds = Bounds::of_sigma(sigma, claim.weights.as_ref());
    let vertex = |i: usize| (0..count).map(|j| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
    let mut positions: Vec<Vec<f64>> = (0..count).map(vertex).collect();
    for i in 1..count {
        positions.push((0..count).map(|j| if j == i || j == i - 1 { 0.5 } else { 0.0 }).collect());
        // between, in eighths
        let eighth = f64::from(1 + numbers.below(7) as u32) / 8.0;
        positions.push(
            (0..count)
                .map(|j| {
                    if j == i {
                        eighth
                    } else if j == i - 1 {
                        1.0 - eighth
                    } else {
                        0.0
                    }
                })
                .collect(),
        );
    }
    let points: Vec<_> = positions.iter().map(|weights| polytope_point(claim, weights, None)).collect();
    tally.witnesses += check(&claims, &bounds, &points, &|witness| match witness.vertex_weights.is_empty() {
        true => points[0].clone(),
        false => polytope_witness(claim, witness),
    })?;
    let Some((level, motion)) = decreasing(&claims) else { return Ok(claims) };
    let rates = match &claim.lyapunov {
        PolytopicLyapunov::ParameterDependent { rate_vertices, .. } => rate_vertices.clone(),
        _ => Vec::new(),
    };
    let corners: Vec<Vec<f64>> = (0..count).map(vertex).collect();
    let moves = |rho: &[f64], h: f64| -> Vec<Vec<f64>> {
        if motion != Motion::Hull {
            return corners.clone();
        }
        let along = |rate: &Vec<f64>| rho.iter().zip(rate).map(|(w, r)| w + h * r).collect::<Vec<f64>>();
        let inside: Vec<Vec<f64>> = rates.iter().map(along).filter(|to| to.iter().all(|w| *w >= 0.0)).collect();
        if inside.is_empty() { vec![rho.to_vec()] } else { inside }
    };
    let flown = Flown {
        states: n,
        inputs: m,
        frozen: &|weights| polytope_frozen(claim, weights),
        start: positions[numbers.below(positions.len())].clone(),
        moves: &moves,
        below: sigma.clone(),
        above: sigma.clone(),
        level: level.unwrap_or(1.0),
        unsaturated: claim.auxiliary_gain.is_none() && level.is_some(),
        cost: claim.weights.as_ref().and_then(|w| Some((cost_factor(&claims, motion)?, &w.q, &w.r))),
    };
    tally.flights += 1;
    flown.fly(&direction(numbers, &flown))?;
    Ok(claims)
}
