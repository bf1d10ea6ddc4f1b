//! The decrease of V under saturation, row by row: one inequality in place of one for each of the 2^m mixtures of rows of K and F.
//!
//! On {V ≤ γ} a saturated input sᵢ lies between fᵢx and kᵢx, because fᵢx is unsaturated there. To be shown is, for every such s,
//!
//! ```text
//! −κ 2xᵀP(Ax − Bs) − c (xᵀQx + sᵀRs) > 0.
//! ```
//!
//! If R couples no two inputs that may saturate, this is a sum of functions hᵢ(sᵢ) = 2κ(bᵢᵀPx) sᵢ − c sᵢ (rᵢsᵢ + 2 Σⱼ Rᵢⱼkⱼx), j over the
//! inputs that cannot, and of what does not see s. Each hᵢ is concave (rᵢ ≥ 0), its least value on the interval is at an end, and
//! with dᵢ = kᵢ − fᵢ
//!
//! ```text
//! hᵢ(fᵢx) − hᵢ(kᵢx) = (dᵢx)(gᵢx),    gᵢ = c (R(K + F))ᵢ − 2κ bᵢᵀP,
//! ```
//!
//! where F has the rows of K for the inputs that cannot saturate. So with M_F, the matrix of the claim for S = F, the left side is at least
//! xᵀM_F x − Σ max(0, (dᵢx)(gᵢx)). For any number cᵢ > 0 and δᵢ = gᵢ + cᵢdᵢ
//!
//! ```text
//! (dᵢx)(gᵢx) = (dᵢx)(δᵢx) − cᵢ(dᵢx)² ≤ (δᵢx)²/(4cᵢ),
//! ```
//!
//! and **M_F − Σ δᵢᵀδᵢ/(4cᵢ) ≻ 0 proves every mixture**. To start from S = K, or from any mixture, gives the same matrix, as
//! M_F − Σ δᵢᵀδᵢ/(4cᵢ) = ½(M_F + M_K) − ¼ Σ (gᵢᵀgᵢ/cᵢ + cᵢdᵢᵀdᵢ), and no smaller quadratic form than (δᵢx)²/(4cᵢ) for some cᵢ bounds
//! max(0, (dᵢx)(gᵢx)). Nothing is lost (δ = 0) where K = F + s(R⁻¹BᵀP − F), 0 < s < 2, κ = c = 1: gᵢ = −rᵢ(2 − s)(R⁻¹BᵀP − F)ᵢ is then
//! a negative multiple of dᵢ, and cᵢ = rᵢ(2 − s)/s. That is the gain of `synthesis/high_gain.rs`.
//!
//! With V = xᵀY⁻¹x and x = Yz everything is multiplied by Y: the rows are those of FY, KY, and bᵢᵀ is in the place of bᵢᵀP.
//!
//! An R that couples inputs that may saturate is replaced by a larger one that does not ([`separable`]), which loses something.

use super::matrix::TaylorMatrix;
use crate::math::Mat;
use crate::math::eigen::symmetric_eigenvalues;
use crate::math::interval::Interval;
use crate::math::matrix::{cholesky_inverse, diagonal, identity, inverse_spd, quadratic_form};
use crate::math::taylor::Taylor;
use crate::mutant;

/// Inputs that may saturate up to which all mixtures of rows are tried where the condition by rows does not prove.
const MOST_ENUMERATED: usize = 10;
/// The number of a mixture: all rows of K, however many there are.
pub(super) const ALL_HIGH: usize = usize::MAX;
/// Share of the decrease that one row may take without harm, where it has to take some.
const HARMLESS: f64 = 1e-9;
/// Share of the decrease that all rows may take before their multipliers are looked for again, and how often they are.
const CONTENT: f64 = 0.5;
const ROUNDS: usize = 8;
/// How far the decrease that multipliers are balanced against stays from the edge.
const INSIDE: f64 = 1.05;

/// Number of mixtures of rows where `saturating` inputs may saturate; `None` where there are too many to enumerate.
pub(super) fn mixtures(saturating: usize) -> Option<usize> {
    if mutant::is("low-mixture-only") {
        return Some(1);
    }
    (saturating <= MOST_ENUMERATED).then(|| 1 << saturating)
}

/// Rows of `high` where the bit of `mixture` is set and of `low` elsewhere; of `high` for inputs that are not among `saturating`.
/// Mixture 0 is all of `low`.
pub(super) fn mixed(mixture: usize, saturating: &[usize], low: &TaylorMatrix, high: &TaylorMatrix) -> TaylorMatrix {
    let (m, n) = high.shape();
    let is_set = |bit: usize| mixture == ALL_HIGH || mixture.checked_shr(bit as u32).unwrap_or(0) & 1 == 1;
    let mut is_low = vec![false; m];
    saturating.iter().enumerate().for_each(|(bit, &i)| is_low[i] = !is_set(bit));
    TaylorMatrix::from_fn(m, n, |i, j| if is_low[i] { low.at(i, j) } else { high.at(i, j) })
}

/// R̂ ⪰ R that couples no two of the inputs `saturating`; R itself if that does not.
///
/// 2sᵢsⱼ ≤ τsᵢ² + sⱼ²/τ for any τ > 0, here √(rᵢ/rⱼ): each |Rᵢⱼ| goes to the diagonal, weighted. R̂ − R is then a sum of positive
/// semidefinite matrices of two rows; sums are rounded up.
pub(super) fn separable(r: &Mat<f64>, saturating: &[usize]) -> Mat<f64> {
    let mut bound = r.clone();
    for (at, &i) in saturating.iter().enumerate() {
        for &j in &saturating[at + 1..] {
            let coupling = r[(i, j)].abs().max(r[(j, i)].abs());
            (bound[(i, j)], bound[(j, i)]) = (0.0, 0.0);
            if coupling != 0.0 && !mutant::is("coupling-dropped") {
                let tau = positive((r[(i, i)] / r[(j, j)]).sqrt());
                let raised = |entry: f64, by: Interval| (Interval::point(entry) + by).hi();
                bound[(i, i)] = raised(bound[(i, i)], Interval::point(coupling) * tau);
                bound[(j, j)] = raised(bound[(j, j)], Interval::point(coupling) / tau);
            }
        }
    }
    bound
}

/// gᵢ and dᵢ of the inputs that may saturate, as the rows of two matrices.
pub(super) struct Rows {
    pub gradient: TaylorMatrix,
    pub difference: TaylorMatrix,
}

impl Rows {
    /// From BᵀP (or Bᵀ), the gains (or their products with Y), R̂ and the weights κ and c.
    pub fn new(
        saturating: &[usize],
        input: &TaylorMatrix,
        [low, high]: [&TaylorMatrix; 2],
        r: &Mat<f64>,
        [factor, cost]: [f64; 2],
    ) -> Self {
        let n = high.shape().1;
        let rows =
            |matrix: &TaylorMatrix| TaylorMatrix::from_fn(saturating.len(), n, |i, j| matrix.at(saturating[i], j));
        let two = if mutant::is("factor-two-missing") { 1.0 } else { 2.0 };
        let flow = |i: usize, j: usize| -input.at(saturating[i], j) * (two * factor);
        let gradient = if cost == 0.0 {
            TaylorMatrix::from_fn(saturating.len(), n, flow)
        } else {
            let of_saturating = Mat::from_fn(saturating.len(), r.ncols(), |i, j| r[(saturating[i], j)]);
            let stage = TaylorMatrix::constant(&of_saturating).times(&low.plus(high));
            TaylorMatrix::from_fn(saturating.len(), n, |i, j| stage.at(i, j) * cost + flow(i, j))
        };
        Self { gradient, difference: rows(high).minus(&rows(low)) }
    }

    /// The inputs with dᵢ ≠ 0 somewhere, for rows over a whole cell: of the others nothing is taken, whatever g is.
    pub fn moving(&self) -> Vec<bool> {
        let (count, n) = self.difference.shape();
        let moves = |i: usize| (0..n).any(|j| !self.difference.at(i, j).is_zero()) && !mutant::is("saturation-is-free");
        (0..count).map(moves).collect()
    }

    /// δᵢ = gᵢ + cᵢdᵢ of the inputs that are `moving`, else zero.
    pub fn deltas(&self, multipliers: &[f64], moving: &[bool]) -> TaylorMatrix {
        let (count, n) = self.gradient.shape();
        TaylorMatrix::from_fn(count, n, |i, j| match moving[i] {
            true => self.gradient.at(i, j) + self.difference.at(i, j) * multipliers[i],
            false => Taylor::from(0.0),
        })
    }

    /// The values in the middle, as numbers.
    pub fn middle(&self) -> [Mat<f64>; 2] {
        [&self.gradient, &self.difference].map(super::matrix::middle)
    }
}

/// The matrix with 1/(4cᵢ) on its diagonal, rounded up: more than that proves too.
pub(super) fn shares(multipliers: &[f64]) -> Mat<f64> {
    let share = if mutant::is("share-halved") { 0.125 } else { 0.25 };
    diagonal(&multipliers.iter().map(|c| (share / c).next_up()).collect::<Vec<f64>>())
}

/// A matrix M_F with the rows gᵢ and dᵢ that take from it, as numbers.
pub(super) struct Balanced {
    pub base: Mat<f64>,
    pub gradient: Mat<f64>,
    pub difference: Mat<f64>,
}

/// Multipliers cᵢ > 0, the same for all of `matrices`, with which what the rows take is small against what is there. Any would prove.
///
/// Σ δᵢ W δᵢᵀ/(4cᵢ) with W = M_F⁻¹ is least for cᵢ = ‖gᵢ‖/‖dᵢ‖ in the norm of W. Where that takes too much, W = (θM_F − Σ δᵢᵀδᵢ/(4cᵢ))⁻¹ is
/// the norm of the next round, with θ ≥ 1 so that it is one: a fixed point has the largest determinant of θM_F − Σ δᵢᵀδᵢ/(4cᵢ).
pub(super) fn multipliers(matrices: &[Balanced]) -> Vec<f64> {
    let n = matrices.first().map_or(0, |matrix| matrix.base.nrows());
    let or_unit = |inverse: Option<Mat<f64>>| inverse.unwrap_or_else(|| identity(n));
    let mut norms: Vec<Mat<f64>> = matrices.iter().map(|matrix| or_unit(inverse_spd(&matrix.base))).collect();
    let mut best = (f64::INFINITY, ratios(matrices, &norms));
    let Some(factors) = matrices.iter().map(|matrix| cholesky_inverse(&matrix.base)).collect::<Option<Vec<_>>>() else {
        return best.1;
    };
    for _ in 0..ROUNDS {
        let found = ratios(matrices, &norms);
        let lost: Vec<Mat<f64>> = matrices.iter().map(|matrix| matrix.lost(&found)).collect();
        let taken = |(factor, lost): (&Mat<f64>, &Mat<f64>)| {
            symmetric_eigenvalues(&(factor * lost * factor.transpose())).last().copied().unwrap_or(f64::NAN)
        };
        let share = factors.iter().zip(&lost).map(taken).fold(0.0, f64::max);
        if share < best.0 {
            best = (share, found);
        }
        if share < CONTENT || !share.is_finite() {
            break;
        }
        let left = |(matrix, lost): (&Balanced, &Mat<f64>)| (INSIDE * share).max(1.0) * &matrix.base - lost;
        norms = matrices.iter().zip(&lost).map(left).map(|left| or_unit(inverse_spd(&left))).collect();
    }
    best.1
}

/// cᵢ = ‖gᵢ‖/‖dᵢ‖, in the root mean square over the matrices, each in its norm.
fn ratios(matrices: &[Balanced], norms: &[Mat<f64>]) -> Vec<f64> {
    let count = matrices.first().map_or(0, |matrix| matrix.gradient.nrows());
    let size = |of: fn(&Balanced) -> &Mat<f64>, i: usize| {
        let square = |(matrix, norm): (&Balanced, &Mat<f64>)| {
            let row: Vec<f64> = (0..norm.nrows()).map(|j| of(matrix)[(i, j)]).collect();
            quadratic_form(norm, &row).max(0.0)
        };
        matrices.iter().zip(norms).map(square).sum::<f64>()
    };
    let of_input = |i: usize| match (size(|m| &m.gradient, i), size(|m| &m.difference, i)) {
        (0.0, difference) => 4.0 * HARMLESS / difference,
        (gradient, 0.0) => gradient / (4.0 * HARMLESS),
        (gradient, difference) => (gradient / difference).sqrt(),
    };
    (0..count).map(of_input).map(positive).collect()
}

/// `x` if it is an ordinary positive number whose inverse is one too, else 1.
fn positive(x: f64) -> f64 {
    let is_ordinary = |x: f64| x.is_normal() && x > 0.0;
    if is_ordinary(x) && is_ordinary(0.25 / x) { x } else { 1.0 }
}

impl Balanced {
    /// Σ δᵢᵀδᵢ/(4cᵢ)
    fn lost(&self, multipliers: &[f64]) -> Mat<f64> {
        let (count, n) = (self.gradient.nrows(), self.gradient.ncols());
        // (δᵢ/(2√cᵢ))
        let rows = Mat::from_fn(count, n, |i, j| {
            let c = multipliers[i];
            (self.gradient[(i, j)] + c * self.difference[(i, j)]) / (2.0 * c.sqrt())
        });
        rows.transpose() * &rows
    }
}
