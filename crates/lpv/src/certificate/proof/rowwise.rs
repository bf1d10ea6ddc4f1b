//! A saturated input at a time: one inequality instead of 2^m mixtures of rows.
//!
//! On {V ≤ γ} the input sᵢ of a high gain lies between fᵢx and kᵢx. In the decrease that is claimed, κV̇ + c(xᵀQx + sᵀRs) < 0 with V̇ =
//! 2xᵀP(Ax − Bs), it stands for diagonal R in the terms −2κ(bᵢᵀPx)sᵢ + c rᵢsᵢ² alone. They are convex in sᵢ, so that their largest
//! value between fᵢx and kᵢx is at an end:
//!
//! ```text
//! value at fᵢx + max(0, (dᵢx)(gᵢx)),    dᵢ = kᵢ − fᵢ,    gᵢ = c rᵢ(kᵢ + fᵢ) − 2κ bᵢᵀP.
//! ```
//!
//! For any αᵢ > 0 and δᵢ = gᵢ + αᵢdᵢ, (dᵢx)(gᵢx) = (dᵢx)(δᵢx) − αᵢ(dᵢx)² ≤ (δᵢx)²/(4αᵢ). With M_F, the matrix of the decrease with F,
//!
//! ```text
//! M_F − Σᵢ δᵢᵀδᵢ/(4αᵢ) ≻ 0
//! ```
//!
//! proves the decrease for every saturation, whatever the number of inputs. Nothing is lost where δᵢ = 0: that is so for K = F + s(R⁻¹BᵀP − F), 0 < s < 2,
//! and αᵢ = κrᵢ(2 − cs/κ)/s, which is what synthesis makes, up to the schedule between grid points. αᵢ is a number that is chosen in the middle of a
//! cell, ‖gᵢ‖/‖dᵢ‖ in the norm of M_F⁻¹, where ‖δᵢ‖²/αᵢ is least; the proof does not ask where it is from. Of an R that is not diagonal
//! its row sums of absolute values are taken, sᵀRs ≤ Σᵢ(Σⱼ|Rᵢⱼ|)sᵢ². In the inverse form every row is one times Y.

use super::closed_loop::{ClosedLoop, Decrease, Form, Place};
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix};
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::matrix::{diagonal, quadratic_form};
use crate::math::taylor::Taylor;

/// Inputs that may saturate up to which 2^m mixtures are enumerated where the row-wise inequality is not proved.
pub(super) const MOST_ENUMERATED: usize = 10;
/// Of the decrease, what a row without gᵢ may take at most.
const LEAST_SHARE: f64 = 1e-9;

/// The decrease κ V̇ + c (xᵀQx + uᵀRu) < 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Claimed {
    /// κ
    pub factor: f64,
    /// c
    pub cost: f64,
}

/// What is definite on a cell if the decrease holds there.
pub(super) trait Decreasing: Send + Sync {
    /// Whether κ(constant + ρ̇ rate) + c cost, less what the saturation takes, is positive definite for |t − c| ≤ `half`.
    fn is_decreasing(&self, rate: f64, claimed: Claimed, half: f64) -> Definiteness;
}

impl Decreasing for Decrease {
    fn is_decreasing(&self, rate: f64, Claimed { factor, cost }: Claimed, half: f64) -> Definiteness {
        let terms = [(factor, &self.constant), (factor * rate, &self.rate), (cost, &self.cost)];
        CellMatrix::combination(&terms).is_positive(half)
    }
}

/// The decrease with F, and what the saturation takes from it.
pub(super) struct RowWise {
    decrease: Decrease,
    /// Σ δᵢᵀδᵢ/(4αᵢ)
    taken: CellMatrix,
    /// αᵢ of the inputs that may saturate; empty where there are none to be had.
    pub alpha: Vec<f64>,
}

impl Decreasing for RowWise {
    fn is_decreasing(&self, rate: f64, Claimed { factor, cost }: Claimed, half: f64) -> Definiteness {
        let Decrease { constant, rate: by_rate, cost: stage } = &self.decrease;
        let terms = [(factor, constant), (factor * rate, by_rate), (cost, stage), (-1.0, &self.taken)];
        match CellMatrix::combination(&terms).is_positive(half) {
            // that this bound is not definite refutes nothing
            Definiteness::Refuted { .. } => Definiteness::Open { fits: 0.0 },
            other => other,
        }
    }
}

/// R where it is diagonal, else its row sums of absolute values, rounded up.
pub(super) fn separable(r: &Mat<f64>) -> Mat<f64> {
    let row = |i: usize| {
        let others = (0..r.ncols()).filter(|&j| j != i && r[(i, j)] != 0.0);
        others.fold(Interval::point(r[(i, i)].abs()), |sum, j| sum + r[(i, j)].abs()).hi()
    };
    diagonal(&(0..r.nrows()).map(row).collect::<Vec<f64>>())
}

/// The αᵢ for rows dᵢ and gᵢ as numbers, against the decrease with this inverse; `None` where a row takes nothing.
pub(super) fn balance(d: &[f64], g: &[f64], inverse: &Mat<f64>) -> Option<f64> {
    let size = |row: &[f64]| quadratic_form(inverse, row).max(0.0).sqrt();
    let (d, g) = (size(d), size(g));
    let alpha = (g / d).max(LEAST_SHARE / (d * d));
    (d > 0.0 && alpha.is_finite()).then_some(alpha)
}

/// 1/(4α), not less.
pub(super) fn share(alpha: f64) -> f64 {
    (0.25 / alpha).next_up()
}

/// Rows dᵢ and gᵢ of the inputs that may saturate.
pub(super) struct Rows {
    pub d: TaylorMatrix,
    pub g: TaylorMatrix,
}

impl Rows {
    /// From kᵢ, fᵢ (or those times Y), bᵢᵀP (or bᵢᵀ) and rᵢ of the inputs `saturating`.
    pub fn new(
        saturating: &[usize],
        [k, f, bp]: [&TaylorMatrix; 3],
        r: &Mat<f64>,
        Claimed { factor, cost }: Claimed,
    ) -> Self {
        let n = k.shape().1;
        let rows = |of: &dyn Fn(usize, usize) -> Taylor| {
            TaylorMatrix::from_fn(saturating.len(), n, |at, j| of(saturating[at], j))
        };
        Self {
            d: rows(&|i, j| k.at(i, j) - f.at(i, j)),
            g: rows(&|i, j| {
                let by_cost = (k.at(i, j) + f.at(i, j)) * Taylor::constant(Interval::point(cost) * r[(i, i)]);
                by_cost - bp.at(i, j) * Taylor::constant(Interval::point(factor) * 2.0)
            }),
        }
    }

    /// αᵢ of each row, chosen by the middles of the entries; zero of one that takes nothing.
    pub fn balance(&self, inverse: &Mat<f64>) -> Vec<f64> {
        let (rows, n) = self.d.shape();
        let middle =
            |matrix: &TaylorMatrix, i: usize| -> Vec<f64> { (0..n).map(|j| matrix.at(i, j).value.middle()).collect() };
        (0..rows).map(|i| balance(&middle(&self.d, i), &middle(&self.g, i), inverse).unwrap_or(0.0)).collect()
    }

    /// δᵢ
    pub fn slack(&self, alpha: &[f64]) -> TaylorMatrix {
        let (rows, n) = self.d.shape();
        TaylorMatrix::from_fn(rows, n, |i, j| match alpha[i] {
            0.0 => Taylor::from(0.0),
            alpha => self.g.at(i, j) + self.d.at(i, j) * alpha,
        })
    }

    /// Whether a row with dᵢ ≠ 0 somewhere has no αᵢ.
    fn is_left_out(&self, alpha: &[f64]) -> bool {
        let (rows, n) = self.d.shape();
        (0..rows).any(|i| alpha[i] == 0.0 && (0..n).any(|j| !self.d.at(i, j).is_zero()))
    }
}

/// diag(1/(4αᵢ))
pub(super) fn shares(alpha: &[f64]) -> Mat<f64> {
    diagonal(&alpha.iter().map(|&alpha| if alpha == 0.0 { 0.0 } else { share(alpha) }).collect::<Vec<f64>>())
}

impl ClosedLoop<'_> {
    /// The row-wise inequality on a cell.
    pub fn row_wise(&self, place: &Place, claimed: Claimed) -> RowWise {
        let r = separable(&self.weights.r);
        let saturating = self.saturating();
        let at = |t: Taylor| {
            let parts = self.parts_weighted(place.piece, 0, t, &r);
            let rows = self.rows(place.piece, t, &parts.gain, &parts.lyapunov, &r, claimed, &saturating);
            (parts, rows)
        };
        let Place { middle, half, .. } = *place;
        let (over, over_rows) = at(Taylor::variable(Interval::new(middle - half, middle + half)));
        let (middle, middle_rows) = at(Taylor::variable_of_first_order(Interval::point(middle)));
        let decrease = Decrease::new(&over, &middle);
        let nothing = || (CellMatrix::unbounded(self.weights.q.nrows()), Vec::new());
        let with_f = [(claimed.factor, &decrease.constant), (claimed.cost, &decrease.cost)];
        let (taken, alpha) = match CellMatrix::combination(&with_f).middle_inverse() {
            None => nothing(),
            Some(inverse) => {
                let alpha = middle_rows.balance(&inverse);
                let taken = |rows: &Rows| rows.slack(&alpha).quadratic(&shares(&alpha));
                match over_rows.is_left_out(&alpha) {
                    true => nothing(),
                    false => (CellMatrix::new(&taken(&middle_rows), &taken(&over_rows)), alpha),
                }
            }
        };
        RowWise { decrease, taken, alpha }
    }

    #[allow(clippy::too_many_arguments)] // one line of the derivation
    fn rows(
        &self,
        piece: usize,
        t: Taylor,
        f: &TaylorMatrix,
        lyapunov: &TaylorMatrix,
        r: &Mat<f64>,
        claimed: Claimed,
        saturating: &[usize],
    ) -> Rows {
        let (_, b, k) = self.model_and_gain(piece, t);
        let (k, bp) = match self.form {
            Form::Direct(_) => (k, b.transpose().times(lyapunov)),
            Form::Inverse(_) => (k.times(lyapunov), b.transpose()),
        };
        Rows::new(saturating, [&k, f, &bp], r, claimed)
    }
}
