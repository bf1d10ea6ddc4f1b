//! The enclosing simplex of least volume, which gives the CNO weights: close to one at some point each, as the hull is
//! tight. (Chan, Chi, Huang and Ma, "A convex analysis-based minimum-volume enclosing simplex algorithm for
//! hyperspectral unmixing", IEEE Trans. Signal Processing 57(11), 2009, state the same problem for spectra.)
//!
//! Minimise −log|det T| subject to W = PT ≥ 0 and T1 = e₁. The problem is not convex: a log-barrier method with regularised
//! Newton steps finds a local minimum from each of several starts, and the best is taken.

use super::simplex::{log_determinant, touching};
use crate::math::Mat;
use crate::math::eigen::symmetric_eigenvalues;
use crate::math::matrix::{inverse, solve};
use rayon::prelude::*;

/// Barrier parameters μ, per point and weight: from the first to the last, each the factor times the one before.
const BARRIER: (f64, f64, f64) = (1e-1, 1e-12, 0.2);
/// Newton steps for one μ.
const MOST_STEPS: usize = 30;
/// A start is drawn this far towards its centre, so that no weight is zero.
const INTERIOR: f64 = 0.1;

/// The best of the local minima from `starts`; every face touches the points.
pub fn minimum_volume(points: &Mat<f64>, starts: &[Mat<f64>]) -> Mat<f64> {
    let ends: Vec<Mat<f64>> = starts.par_iter().map(|start| touching(points, &descend(points, start))).collect();
    // the starts are candidates too: a start that is a vertex solution cannot be improved
    let candidates = ends.into_iter().chain(starts.iter().map(|start| touching(points, start)));
    candidates.fold(touching(points, &starts[0]), |best, next| {
        if log_determinant(&next) > log_determinant(&best) { next } else { best }
    })
}

/// Follow the barrier's path from `start`.
fn descend(points: &Mat<f64>, start: &Mat<f64>) -> Mat<f64> {
    let k = start.ncols();
    let mut simplex = touching(points, start);
    simplex =
        Mat::from_fn(k, k, |i, j| (1.0 - INTERIOR) * simplex[(i, j)] + if i == 0 { INTERIOR / k as f64 } else { 0.0 });
    let (first, last, factor) = BARRIER;
    let mut mu = first;
    while mu > last {
        for _ in 0..MOST_STEPS {
            let (gradient, hessian) = derivatives(points, &simplex, mu / points.nrows() as f64);
            let step = newton_step(&gradient, hessian);
            let slope: f64 = step.iter().zip(&gradient).map(|(s, g)| s * g).sum();
            let Some(next) = line_search(points, &simplex, mu / points.nrows() as f64, &step, slope) else { break };
            simplex = next;
            // the decrease that is left is small against μ
            if -slope < 1e-6 * mu {
                break;
            }
        }
        mu *= factor;
    }
    simplex
}

/// −log|det T| − μ Σ log wᵢⱼ; infinite outside.
fn barrier(points: &Mat<f64>, simplex: &Mat<f64>, mu: f64) -> f64 {
    let weights = points * simplex;
    let mut sum = 0.0;
    for j in 0..weights.ncols() {
        for i in 0..weights.nrows() {
            if weights[(i, j)] <= 0.0 {
                return f64::INFINITY;
            }
            sum += weights[(i, j)].ln();
        }
    }
    -log_determinant(simplex) - mu * sum
}

/// Gradient and Hessian with respect to the first k − 1 columns of T, column after column; the last is e₁ minus their sum.
fn derivatives(points: &Mat<f64>, simplex: &Mat<f64>, mu: f64) -> (Vec<f64>, Mat<f64>) {
    let k = simplex.ncols();
    let (weights, inverse) = (points * simplex, inverse(simplex));
    // change of row c of T⁻¹dT by variable (a, b): the row's entry (T⁻¹)_ca goes to column b, and its negative to the last
    let free = k * (k - 1);
    let mut gradient = vec![0.0; free];
    let mut hessian = Mat::zeros(free, free);
    for b in 0..k - 1 {
        for a in 0..k {
            gradient[b * k + a] = inverse[(k - 1, a)] - inverse[(b, a)];
            for d in 0..k - 1 {
                for c in 0..k {
                    // tr(T⁻¹ E_ab T⁻¹ E_cd), E_ab = e_a(e_b − e_k)ᵀ
                    let left = inverse[(d, a)] - inverse[(k - 1, a)];
                    let right = inverse[(b, c)] - inverse[(k - 1, c)];
                    hessian[(b * k + a, d * k + c)] = left * right;
                }
            }
        }
    }
    for j in 0..k {
        for a in 0..k {
            let push: f64 = (0..points.nrows()).map(|i| points[(i, a)] / weights[(i, j)]).sum::<f64>() * mu;
            for b in 0..k - 1 {
                gradient[b * k + a] += if j == b {
                    -push
                } else if j == k - 1 {
                    push
                } else {
                    0.0
                };
            }
            for c in 0..k {
                let curvature = |i: usize| points[(i, a)] * points[(i, c)] / weights[(i, j)].powi(2);
                let sum = mu * (0..points.nrows()).map(curvature).sum::<f64>();
                for b in 0..k - 1 {
                    for d in 0..k - 1 {
                        if j == k - 1 || (j == b && j == d) {
                            hessian[(b * k + a, d * k + c)] += sum;
                        }
                    }
                }
            }
        }
    }
    (gradient, hessian)
}

/// −(H + λI)⁻¹g with λ large enough for a direction of descent.
fn newton_step(gradient: &[f64], mut hessian: Mat<f64>) -> Vec<f64> {
    let size = gradient.len();
    let eigenvalues = symmetric_eigenvalues(&hessian);
    let (least, largest) = (eigenvalues[0], eigenvalues[size - 1].abs().max(1.0));
    let shift = (1e-10 * largest - least).max(0.0) + if least < 0.0 { -least } else { 0.0 };
    (0..size).for_each(|i| hessian[(i, i)] += shift);
    let step = solve(&hessian, &Mat::from_fn(size, 1, |i, _| -gradient[i]));
    (0..size).map(|i| step[(i, 0)]).collect()
}

/// The first of the halved steps that decreases the barrier function enough.
fn line_search(points: &Mat<f64>, simplex: &Mat<f64>, mu: f64, step: &[f64], slope: f64) -> Option<Mat<f64>> {
    let k = simplex.ncols();
    let before = barrier(points, simplex, mu);
    (0..40).map(|halvings| 0.5f64.powi(halvings)).find_map(|length| {
        let last = |i: usize| (0..k - 1).map(|b| step[b * k + i]).sum::<f64>();
        let next =
            Mat::from_fn(k, k, |i, j| simplex[(i, j)] + length * if j + 1 < k { step[j * k + i] } else { -last(i) });
        (barrier(points, &next, mu) <= before + 1e-4 * length * slope).then_some(next)
    })
}
