//! What linearisation leaves out of A and B, and what it takes from the decrease of V.
//!
//! A difference Δᵢⱼ with |Δᵢⱼ| ≤ d adds d (τ aaᵀ + bbᵀ/τ) ⪰ ±d (abᵀ + baᵀ) for any τ > 0, with a column a of P and a unit vector b (or of I
//! and Y).

use super::closed_loop::{Form, Parts};
use super::matrix::TaylorMatrix;
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::matrix::{diagonal, quadratic_form};

/// Bounds dᵢⱼ on the differences of A_Δ to A(ρ) and of B_Δ to B(ρ) on a part of a piece, and of ρ̇.
#[derive(Clone)]
pub(super) struct Difference {
    /// n × n: of A_Δ − A.
    pub state: Mat<f64>,
    /// n × 2m: of (B_Δ − B)M and of (B_Δ − B)(I − MMᵀ).
    pub input: Mat<f64>,
    /// ρ̇
    pub rate: Interval,
}

impl Difference {
    /// Bounds that hold where either does.
    pub fn hull(mut self, other: &Self) -> Self {
        let larger = |a: &Mat<f64>, b: &Mat<f64>| Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)].max(b[(i, j)]));
        self.state = larger(&self.state, &other.state);
        self.input = larger(&self.input, &other.input);
        self.rate = self.rate.hull(other.rate);
        self
    }
}

/// The weights of Σ d (τ aaᵀ + bbᵀ/τ), gathered by columns: the τ make both terms equally large against the decrease.
pub(super) struct Balance {
    /// Of the a, for each row of A and B.
    row: Mat<f64>,
    /// Of the b, for each column of A.
    state: Mat<f64>,
    /// Of the b, for each column of B.
    input: Mat<f64>,
}

impl Balance {
    /// Balanced against the decrease with this inverse.
    pub fn new(form: &Form, parts: &Parts, difference: &Difference, inverse: &Mat<f64>) -> Self {
        let n = inverse.nrows();
        let unit = |i: usize| (0..n).map(|k| if k == i { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        let lyapunov = |i: usize| (0..n).map(|k| parts.lyapunov.at(i, k).value.middle()).collect::<Vec<f64>>();
        let gain = |i: usize| (0..n).map(|k| parts.gain.at(i, k).value.middle()).collect::<Vec<f64>>();
        let size = |vector: Vec<f64>| quadratic_form(inverse, &vector).max(0.0).sqrt();
        let (rows, columns): (Vec<f64>, Vec<f64>) = match form {
            Form::Direct(_) => (0..n).map(|i| (size(lyapunov(i)), size(unit(i)))).unzip(),
            Form::Inverse(_) => (0..n).map(|i| (size(unit(i)), size(lyapunov(i)))).unzip(),
        };
        let m = difference.input.ncols();
        let inputs: Vec<f64> = (0..m).map(|i| size(gain(i))).collect();
        let (mut row, mut state, mut input) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
        let mut add = |i: usize, d: f64, b: f64, weight: &mut f64| {
            if d == 0.0 || b == 0.0 {
                return;
            }
            let tau = b / rows[i];
            // rounded up, so that no product is less than it stands for
            row[i] += (d * tau).next_up();
            *weight += (d / tau).next_up();
        };
        for i in 0..n {
            for j in 0..n {
                add(i, difference.state[(i, j)], columns[j], &mut state[j]);
            }
            for j in 0..m {
                add(i, difference.input[(i, j)], inputs[j], &mut input[j]);
            }
        }
        // of the sums and of τ·(1/τ)
        let up = |weights: Vec<f64>| diagonal(&weights.into_iter().map(|w| w * (1.0 + 1e-12)).collect::<Vec<f64>>());
        Self { row: up(row), state: up(state), input: up(input) }
    }

    /// Σ d (τ aaᵀ + bbᵀ/τ).
    pub fn spread(&self, form: &Form, parts: &Parts) -> TaylorMatrix {
        let inputs = parts.gain.quadratic(&self.input);
        let (lyapunov, constant) = match form {
            Form::Direct(_) => (&self.row, &self.state),
            Form::Inverse(_) => (&self.state, &self.row),
        };
        inputs.plus(&parts.lyapunov.quadratic(lyapunov)).plus(&TaylorMatrix::constant(constant))
    }
}
