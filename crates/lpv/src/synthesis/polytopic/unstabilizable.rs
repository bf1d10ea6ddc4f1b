//! Points of a polytope that no input can stabilise, which refute every theorem for the polytope at once.
//!
//! Let w*A(ρ) = λw* with Re λ ≥ 0 and w*B(ρ) = 0 at one ρ of the polytope. Then w*(A(ρ)Y + YA(ρ)ᵀ − B(ρ)L − LᵀB(ρ)ᵀ)w = 2 Re λ w*Yw ≥ 0 for
//! every Y ≻ 0 and L: no Lyapunov function exists at a resting ρ, and no finer division of the polytope helps. On the yaw circle
//! of the quadrotor this is the centre, where w = e_φ. A solver meets it as an infimum that is not reached and stops short
//! between rounding errors; here the multipliers Zᵢⱼ of its last iterate are read instead: Zᵢⱼ ≈ ρᵢρⱼwwᵀ. What is read there is a guess.
//! It refutes where exact arithmetic finds such a point beside it.

use crate::math::Mat;
use crate::math::eigen::{eigenvalues, smallest_singular_vector, symmetric_eigenvectors};
use crate::math::matrix::{least_squares, quadratic_form, trace};
use crate::math::stabilizability::{Mode, Stabilizability, pencil, stabilizability};
use crate::math::unmoved::unmoved_point;
use crate::model::Polytope;
use serde::Serialize;

/// A point ρ of a polytope with a mode that does not decay and that no input moves.
#[derive(Clone, Debug, Serialize)]
pub struct UnstabilizablePoint {
    /// Proved in exact arithmetic, of a point and a mode that the numbers here are the rounded values of. Otherwise it only seems so, to 10⁻¹⁰ of
    /// ‖[A, B]‖, and refutes nothing.
    #[serde(rename = "proved")]
    pub is_proved: bool,
    /// ρ, convex weights of the vertices.
    pub weights: Vec<f64>,
    /// λ, real and imaginary part; Re λ ≥ 0, where it is not proved up to rounding.
    pub eigenvalue: [f64; 2],
    /// Real part of w: w*A(ρ) = λw*, w*B(ρ) = 0.
    pub direction: Vec<f64>,
    /// Imaginary part of w; empty for a real λ.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub direction_imaginary: Vec<f64>,
}

impl UnstabilizablePoint {
    /// The mode.
    pub fn mode(&self) -> Mode {
        Mode {
            eigenvalue: self.eigenvalue,
            direction: self.direction.clone(),
            direction_imaginary: self.direction_imaginary.clone(),
            is_on_axis: false,
        }
    }
}

/// A guess, and how far it is off.
struct Guess {
    weights: Vec<f64>,
    eigenvalue: f64,
    /// ‖w‖ = 1
    w: Vec<f64>,
    /// ‖wᵀ[A(ρ) − λI, B(ρ)]‖
    residual: f64,
}

/// States that are tried by themselves.
const MOST_ALONE: usize = 4;
/// Share of a state, of the largest, below which it counts as rounding.
const SMALL_SHARE: f64 = 1e-7;
/// Relative residual up to which a mode seems to be unmoved.
const RESIDUAL: f64 = 1e-10;
/// A real part below zero by less than this, relatively, counts as zero: eigenvalues of defective matrices are no better.
const DECAY: f64 = 1e-9;

/// Of the largest entry, what weighs a change of ρ against the equations.
const DAMPING: f64 = 1e-6;

/// A vertex that cannot be stabilised, which is decided exactly.
pub(super) fn vertex(polytope: &Polytope) -> Option<UnstabilizablePoint> {
    (0..polytope.len()).find_map(|i| {
        let Stabilizability::Unstabilizable(mode) = stabilizability(polytope.a(i), polytope.b(i)) else { return None };
        let mut weights = vec![0.0; polytope.len()];
        weights[i] = 1.0;
        Some(UnstabilizablePoint {
            is_proved: true,
            weights,
            eigenvalue: mode.eigenvalue,
            direction: mode.direction,
            direction_imaginary: mode.direction_imaginary,
        })
    })
}

/// A point of the polytope near the one that the multipliers of the stability inequalities describe: `terms` says which (i, j) each
/// belongs to.
pub(super) fn point(
    polytope: &Polytope,
    terms: &[(usize, usize)],
    multipliers: &[Mat<f64>],
) -> Option<UnstabilizablePoint> {
    let n = polytope.states();
    let mut weights = vec![0.0; polytope.len()];
    let mut sum = Mat::zeros(n, n);
    for (&(i, j), z) in terms.iter().zip(multipliers) {
        weights[i] += trace(z);
        weights[j] += trace(z);
        sum += z;
    }
    let total: f64 = weights.iter().sum();
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    weights.iter_mut().for_each(|weight| *weight /= total);
    let (_, vectors) = symmetric_eigenvectors(&sum)?;
    let mut w: Vec<f64> = (0..n).map(|i| vectors[(i, n - 1)]).collect();
    let mut best: Option<Guess> = None;
    // ρ, then λ and w, in turn: the start is right to the root of the solver's tolerance
    for _ in 0..3 {
        weights = moved(polytope, &weights, &w)?;
        let model = polytope.at(&weights);
        // eigenvalues of a defective A(ρ), which double integrators make, are no better than roots of rounding errors: zero comes first
        let zero = at(polytope, &weights, 0.0).filter(|guess| holds(polytope, guess));
        best = zero.or_else(|| {
            let real = eigenvalues(&model.a).into_iter().filter(|&(_, im)| im == 0.0).map(|(re, _)| re);
            let tried = [0.0, quadratic_form(&model.a, &w)].into_iter().chain(real);
            (tried.filter_map(|eigenvalue| at(polytope, &weights, eigenvalue)))
                .min_by(|a, b| a.residual.total_cmp(&b.residual))
        });
        w.clone_from(&best.as_ref()?.w);
    }
    best.filter(|guess| holds(polytope, guess)).map(|guess| proved(polytope, guess))
}

/// The point near a guess that is exactly one, if there is one; else the guess. A guess of w mixes what is unmoved at the same point, so
/// that each of its states is tried by itself too.
fn proved(polytope: &Polytope, guess: Guess) -> UnstabilizablePoint {
    let n = polytope.states();
    let vertices: Vec<_> = (0..polytope.len()).map(|i| (polytope.a(i), polytope.b(i))).collect();
    let largest = guess.w.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let shares: Vec<f64> =
        guess.w.iter().map(|x| if x.abs() > SMALL_SHARE * largest { x / largest } else { 0.0 }).collect();
    let alone = |i: usize| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
    let mut moving: Vec<usize> = (0..n).filter(|&i| shares[i] != 0.0).collect();
    moving.sort_by(|&i, &j| shares[j].abs().total_cmp(&shares[i].abs()));
    let tried = std::iter::once(shares.clone()).chain(moving.into_iter().take(MOST_ALONE).map(alone));
    let found = tried.into_iter().find_map(|w| {
        let (weights, eigenvalue) = unmoved_point(&vertices, &guess.weights, &w)?;
        Some(UnstabilizablePoint {
            is_proved: true,
            weights,
            eigenvalue: [eigenvalue, 0.0],
            direction: w,
            direction_imaginary: Vec::new(),
        })
    });
    found.unwrap_or(UnstabilizablePoint {
        is_proved: false,
        weights: guess.weights,
        eigenvalue: [guess.eigenvalue, 0.0],
        direction: shares,
        direction_imaginary: Vec::new(),
    })
}

/// The weights closest to `weights` with wᵀ[A(ρ) − λI, B(ρ)] = 0 for some λ, in the least-squares sense: the part of A(ρ)ᵀw across w,
/// B(ρ)ᵀw and Σδρᵢ are linear in the change δρ.
fn moved(polytope: &Polytope, weights: &[f64], w: &[f64]) -> Option<Vec<f64>> {
    let (n, m, count) = (polytope.states(), polytope.inputs(), polytope.len());
    let row = |matrix: &Mat<f64>, j: usize| -> f64 { (0..n).map(|i| w[i] * matrix[(i, j)]).sum() };
    let column = |a: &Mat<f64>, b: &Mat<f64>| -> Vec<f64> {
        let flow: Vec<f64> = (0..n).map(|j| row(a, j)).collect();
        let along: f64 = flow.iter().zip(w).map(|(x, y)| x * y).sum();
        flow.iter().zip(w).map(|(x, y)| x - along * y).chain((0..m).map(|j| row(b, j))).collect()
    };
    let columns: Vec<Vec<f64>> = (0..count).map(|i| column(polytope.a(i), polytope.b(i))).collect();
    let model = polytope.at(weights);
    let now = column(&model.a, &model.b);
    // the last rows keep δρ small where w, not ρ, is what is wrong
    let damping = DAMPING * columns.iter().flatten().fold(0.0_f64, |most, entry| most.max(entry.abs()));
    let matrix = Mat::from_fn(n + m + 1 + count, count, |r, i| match r {
        _ if r < n + m => columns[i][r],
        _ if r == n + m => 1.0,
        _ if r - (n + m + 1) == i => damping,
        _ => 0.0,
    });
    let right = Mat::from_fn(matrix.nrows(), 1, |r, _| if r < n + m { -now[r] } else { 0.0 });
    let change = least_squares(&matrix, &right)?;
    let shifted: Vec<f64> = weights.iter().enumerate().map(|(i, weight)| (weight + change[(i, 0)]).max(0.0)).collect();
    let total: f64 = shifted.iter().sum();
    Some(shifted.iter().map(|weight| weight / total).collect())
}

/// The w that `eigenvalue` is nearest to a mode without input with.
fn at(polytope: &Polytope, weights: &[f64], eigenvalue: f64) -> Option<Guess> {
    let model = polytope.at(weights);
    let pencil = pencil(&model.a, &model.b, [eigenvalue, 0.0]);
    let w = smallest_singular_vector(&pencil)?;
    let product = |j: usize| -> f64 { w.iter().enumerate().map(|(i, w)| w * pencil[(i, j)]).sum() };
    let residual = (0..pencil.ncols()).map(|j| product(j).powi(2)).sum::<f64>().sqrt();
    Some(Guess { weights: weights.to_vec(), eigenvalue, w, residual })
}

/// Whether the mode seems neither to decay nor to be moved.
fn holds(polytope: &Polytope, guess: &Guess) -> bool {
    let model = polytope.at(&guess.weights);
    let scale = model.a.norm_l2().max(model.b.norm_l2());
    guess.residual <= RESIDUAL * scale && guess.eigenvalue >= -DECAY * scale
}
