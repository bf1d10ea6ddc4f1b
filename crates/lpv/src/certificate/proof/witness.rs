//! A refutation is a motion that breaks the claim itself, evaluated in interval arithmetic.
//!
//! That a sufficient condition fails refutes nothing: another P, another auxiliary gain, another mixture of rows may do. At a fixed ρ, with
//! u = −Kx unsaturated, the loop is ẋ = A_c x, and
//!
//! - **V does not decrease** if V̇(x) > 0 at some x; where the set {V ≤ γ} is claimed to be invariant, at an x with V(x) = γ at
//!   which no input saturates: the motion leaves the set there.
//! - **The cost exceeds κV(x₀)** if x₀ᵀXx₀ > κ x₀ᵀPx₀ for an X with A_cᵀX + XA_c + W ≻ 0, W = Q + KᵀRK ≻ 0. Along the motion
//!   d(xᵀXx)/dt > −xᵀWx, so that the cost up to a time T is more than x₀ᵀXx₀ − x(T)ᵀXx(T). A finite cost makes x square integrable,
//!   for a linear loop x(T) → 0 then, and the cost is at least x₀ᵀXx₀; an infinite one is more than any bound. Where inputs are
//!   limited the loop is also proved to be stable: then the motion of a small multiple of x₀ does not saturate.
//!   Every finite horizon's cost matrix X_T has A_cᵀX_T + X_T A_c + W = ΦᵀWΦ ⪰ 0, stable or not; a little less than it is taken.
//! - **The loop is not stable** if A_cᵀZ + ZA_c ≺ 0 while zᵀZz < 0 for some z: the motion from z keeps xᵀZx below zᵀZz.

use super::cells::Attempt;
use super::closed_loop::{ClosedLoop, Form};
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix, middle};
use super::place::Place;
use crate::certificate::claim::Witness;
use crate::math::Mat;
use crate::math::eigen::{smallest_eigenvector, spectral_abscissa, symmetric_eigenvectors};
use crate::math::interval::Interval;
use crate::math::lyapunov;
use crate::math::matrix::{identity, is_finite, solve, symmetric_part};
use crate::math::taylor::Taylor;
use crate::mutant;

/// Shares by which a cost matrix is taken smaller until its inequality is proved.
const SHARES: [f64; 7] = [1e-15, 1e-14, 1e-13, 1e-12, 1e-10, 1e-7, 1e-3];
/// Doublings of the horizon of a cost matrix, and the first horizon times ‖A_c‖.
const DOUBLINGS: usize = 40;
const FIRST_HORIZON: f64 = 0.125;
const TERMS: usize = 14;
/// States up to which the Lyapunov equation of an unstable loop is solved as n² linear equations.
const MOST_STATES: usize = 24;

/// The unsaturated loop at one value of the parameter, enclosed.
pub(super) struct Loop {
    /// A − BK
    pub flow: TaylorMatrix,
    /// Q + KᵀRK
    pub stage: TaylorMatrix,
    /// P
    pub lyapunov: TaylorMatrix,
    /// An input is limited.
    pub limited: bool,
}

/// A state that breaks a claim, and a proved bound, negative, on what should be positive along it.
pub(super) struct Broken {
    pub state: Vec<f64>,
    pub value: f64,
}

impl Loop {
    /// A state whose cost exceeds `factor` V(x₀), if one is found and proved.
    pub fn exceeds_cost(&self, factor: f64) -> Option<Broken> {
        let (a, w, p) =
            (middle(&self.flow), symmetric_part(&middle(&self.stage)), symmetric_part(&middle(&self.lyapunov)));
        if !is_positive(&self.stage) || self.limited && !self.is_stable(&a) {
            return None;
        }
        let of_rest = if spectral_abscissa(&a) < 0.0 { lyapunov::solve(&a, &w) } else { None };
        of_rest
            .into_iter()
            .chain(finite_horizons(&a, &w))
            .filter(is_finite)
            .find_map(|x| self.broken_by(&x, &p, factor))
    }

    /// With a cost matrix near `x`.
    fn broken_by(&self, x: &Mat<f64>, p: &Mat<f64>, factor: f64) -> Option<Broken> {
        let factor = if mutant::is("cost-witness-factor") { 0.5 * factor } else { factor };
        let excess = symmetric_part(&(factor * p - x));
        let (values, vectors) = symmetric_eigenvectors(&excess)?;
        if values[0].is_nan() || values[0] >= 0.0 {
            return None;
        }
        let direction: Vec<f64> = (0..p.nrows()).map(|i| vectors[(i, 0)]).collect();
        SHARES.into_iter().find_map(|share| {
            let less = TaylorMatrix::constant(&symmetric_part(&((1.0 - share) * x)));
            let value = (form(&self.lyapunov, &direction) * factor - form(&less, &direction)).hi();
            let product = less.times(&self.flow);
            let holds = value < 0.0 && is_positive(&product.plus(&product.transpose()).plus(&self.stage));
            holds.then(|| Broken { state: direction.clone(), value })
        })
    }

    fn is_stable(&self, a: &Mat<f64>) -> bool {
        let Some(z) = lyapunov::solve(a, &identity(a.nrows())) else { return false };
        let z = TaylorMatrix::constant(&z);
        let product = z.times(&self.flow);
        is_positive(&z) && is_positive(&product.plus(&product.transpose()).negated())
    }

    /// A state whose motion does not come to rest at the origin, if one is found and proved.
    pub fn is_unstable(&self) -> Option<Broken> {
        let a = middle(&self.flow);
        let n = a.nrows();
        if n > MOST_STATES || !is_finite(&a) {
            return None;
        }
        // (I ⊗ Aᵀ + Aᵀ ⊗ I) vec Z = −vec I
        let kronecker = Mat::from_fn(n * n, n * n, |r, c| {
            let ((i, j), (k, l)) = ((r / n, r % n), (c / n, c % n));
            (if i == k { a[(l, j)] } else { 0.0 }) + (if j == l { a[(k, i)] } else { 0.0 })
        });
        let right = Mat::from_fn(n * n, 1, |r, _| if r / n == r % n { -1.0 } else { 0.0 });
        let found = solve(&kronecker, &right);
        let z = symmetric_part(&Mat::from_fn(n, n, |i, j| found[(i * n + j, 0)]));
        if !is_finite(&z) {
            return None;
        }
        let direction = smallest_eigenvector(&z)?;
        let z = TaylorMatrix::constant(&z);
        let product = z.times(&self.flow);
        let value = form(&z, &direction).hi();
        let grows = value < 0.0 && is_positive(&product.plus(&product.transpose()).negated());
        grows.then_some(Broken { state: direction, value })
    }
}

/// X_T of horizons that double: X = Σ hᵏ⁺¹/(k + 1)! Lᵏ(W), L(W) = AᵀW + WA, for a short one; then X ← X + ΦᵀXΦ, Φ ← Φ².
fn finite_horizons(a: &Mat<f64>, w: &Mat<f64>) -> Vec<Mat<f64>> {
    let n = a.nrows();
    let h = FIRST_HORIZON / a.norm_l2().max(f64::MIN_POSITIVE);
    let (mut x, mut phi) = (Mat::zeros(n, n), identity(n));
    let (mut term, mut power) = (w.clone(), identity(n));
    let mut weight = 1.0;
    for k in 1..=TERMS {
        weight *= h / k as f64;
        x += weight * &term;
        term = a.transpose() * &term + &term * a;
        power = a * &power;
        phi += weight * &power;
    }
    let mut horizons = Vec::new();
    for _ in 0..DOUBLINGS {
        x = symmetric_part(&(&x + phi.transpose() * &x * &phi));
        phi = &phi * &phi;
        if !is_finite(&x) || !is_finite(&phi) {
            break;
        }
        horizons.push(x.clone());
    }
    horizons
}

/// The values alone, as constants.
pub(super) fn values(matrix: &TaylorMatrix) -> TaylorMatrix {
    let (rows, columns) = matrix.shape();
    TaylorMatrix::from_fn(rows, columns, |i, j| Taylor::constant(matrix.at(i, j).value))
}

/// Whether every matrix of a constant enclosure is positive definite.
pub(super) fn is_positive(matrix: &TaylorMatrix) -> bool {
    matches!(CellMatrix::new(matrix, matrix).is_positive(0.0), Definiteness::Proved(_))
}

/// xᵀMx
pub(super) fn form(matrix: &TaylorMatrix, x: &[f64]) -> Interval {
    let n = x.len();
    (0..n * n).fold(Interval::point(0.0), |sum, at| {
        sum + matrix.at(at / n, at % n).value * (Interval::point(x[at / n]) * x[at % n])
    })
}

/// Mx
pub(super) fn image(matrix: &TaylorMatrix, x: &[f64]) -> Vec<Interval> {
    let row = |i: usize| (0..x.len()).fold(Interval::point(0.0), |sum, j| sum + matrix.at(i, j).value * x[j]);
    (0..matrix.shape().0).map(row).collect()
}

/// An enclosure of M⁻¹ of a constant enclosure: with R ≈ M⁻¹ and e = ‖I − RM‖ < 1, |M⁻¹ − R| ≤ e‖R‖/(1 − e) in every entry.
pub(super) fn inverse(matrix: &TaylorMatrix) -> Option<TaylorMatrix> {
    let n = matrix.shape().0;
    let guess = crate::math::matrix::inverse(&middle(matrix));
    if !is_finite(&guess) {
        return None;
    }
    let r = TaylorMatrix::constant(&guess);
    let rest = TaylorMatrix::constant(&identity(n)).minus(&r.times(matrix));
    let norm = |m: &TaylorMatrix| {
        let row = |i: usize| (0..n).fold(Interval::point(0.0), |sum, j| sum + m.at(i, j).value.magnitude());
        (0..n).map(|i| row(i).hi()).fold(0.0, f64::max)
    };
    let e = norm(&rest);
    if e.is_nan() || e > 0.5 {
        return None;
    }
    let radius = (Interval::point(e) * norm(&r) / (Interval::point(1.0) - e)).hi();
    let around = Interval::new(-radius, radius);
    Some(TaylorMatrix::from_fn(n, n, |i, j| Taylor::constant(Interval::point(guess[(i, j)]) + around)))
}

impl ClosedLoop<'_> {
    /// The witness that P (or Y) is not definite.
    pub fn witness(&self, attempt: &Attempt) -> Option<Witness> {
        let Attempt::Refuted { place, rate, direction, value } = attempt else { return None };
        let state = self.state(place.middle, direction);
        Some(Witness {
            parameter: self.parameter(place.middle),
            rate: *rate,
            state,
            value: *value,
            ..Witness::default()
        })
    }

    /// The witness that the low gain passes a limit in the set: the direction (a, y) of the bordered matrix has
    /// a²/γ + 2a fy/σ + yᵀPy < 0, hence (fy)² > (σ²/γ) yᵀPy, and the multiple of y with V = γ passes the limit.
    pub fn saturates(&self, attempt: &Attempt, rows: &[usize]) -> Option<Witness> {
        let Attempt::Refuted { place, direction, value, .. } = attempt else { return None };
        rows.get(place.variant)?;
        let (_, direction) = direction.split_first()?;
        let size = form(&values(&self.bordered_at_middle(place)), direction);
        let state = self.state(place.middle, direction);
        (size.lo() > 0.0).then(|| Witness {
            parameter: self.parameter(place.middle),
            state,
            value: *value,
            ..Witness::default()
        })
    }

    /// The witness that V grows, and where there is a level, that it does so on the edge of the set with no input at its limit. `None`
    /// where the matrix is of a mixture of rows, which is no motion.
    pub fn leaves(&self, attempt: &Attempt, level: Option<f64>) -> Option<Witness> {
        let Attempt::Refuted { place, rate, direction, value } = attempt else { return None };
        let limited: Vec<usize> = (0..self.inputs()).filter(|&i| self.sigma[i].is_finite()).collect();
        if !self.is_all_of_k(place.variant) || limited.iter().any(|&i| self.sigma[i] <= 0.0) {
            return None;
        }
        let parts = self.parts(place.piece, place.variant, at_middle(place));
        let size = form(&parts.lyapunov, direction);
        if let Some(level) = level {
            let inputs = image(&parts.gain, direction);
            let stays = |&i: &usize| {
                let [square, bound] = [inputs[i].magnitude(), self.sigma[i]].map(|x| Interval::point(x).square());
                (square * level).hi() < (bound * size.lo()).lo()
            };
            if size.lo() <= 0.0 || !limited.iter().all(stays) && !mutant::is("witness-saturates") {
                return None;
            }
        }
        // on the edge, or so small that no input is at its limit
        let inputs = image(&parts.gain, direction);
        let scale = match level {
            Some(level) => level.sqrt() / size.middle().sqrt(),
            None => limited.iter().map(|&i| unsaturated_scale(self.sigma[i], inputs[i])).fold(1.0, f64::min),
        };
        let state = self.state(place.middle, direction).iter().map(|x| scale * x).collect();
        Some(Witness {
            parameter: self.parameter(place.middle),
            rate: *rate,
            state,
            value: *value,
            ..Witness::default()
        })
    }

    /// The unsaturated loop in the middle of a place.
    pub fn at(&self, place: &Place) -> Option<Loop> {
        let (a, b, k) = self.model_and_gain(place.piece, at_middle(place));
        let [a, b, k] = [a, b, k].map(|matrix| values(&matrix));
        let matrix = values(&self.bordered_at_middle(place));
        let limits: Vec<f64> = self.sigma.iter().copied().filter(|sigma| sigma.is_finite()).collect();
        if limits.iter().any(|&sigma| sigma <= 0.0) {
            return None;
        }
        Some(Loop {
            flow: a.minus(&b.times(&k)),
            stage: k.quadratic(&self.weights.r).plus(&TaylorMatrix::constant(&self.weights.q)),
            lyapunov: match self.form {
                Form::Direct(_) => matrix,
                Form::Inverse(_) => inverse(&matrix)?,
            },
            limited: !limits.is_empty(),
        })
    }

    /// The witness that the loop at rest at `rho` is not stable.
    pub fn does_not_rest(&self, rho: f64) -> Option<Witness> {
        let middle = self.position(rho).clamp(0.0, self.pieces as f64);
        let piece = (middle as usize).min(self.pieces - 1);
        let Broken { state, value } = self.at(&Place { piece, variant: 0, middle, half: 0.0 })?.is_unstable()?;
        Some(Witness { parameter: self.parameter(middle), state, value, ..Witness::default() })
    }

    /// The witness that a motion at rest in the middle of a place costs more than `factor` V(x(0)).
    pub fn costs_more(&self, place: &Place, factor: f64) -> Option<Witness> {
        let Broken { state, value } = self.at(place)?.exceeds_cost(factor)?;
        Some(Witness { parameter: self.parameter(place.middle), state, value, ..Witness::default() })
    }
}

/// What a state has to be multiplied with, at most, that the input `input` stays well within σ > 0.
pub(super) fn unsaturated_scale(sigma: f64, input: Interval) -> f64 {
    0.5 * (sigma / input.magnitude())
}

/// The variable in the middle of a place.
fn at_middle(place: &Place) -> Taylor {
    Taylor::variable_of_first_order(Interval::point(place.middle))
}
