//! The Cholesky factorisation in double-double that a proof of definiteness consists of.

use crate::double_double::{self as dd, Double};
use crate::vectorized::vectorized;

/// Smallest pivot of a scaled matrix that is taken for positive; far below what τ lets pass.
const LEAST_PIVOT: f64 = 1e-60;
/// Steps towards a closer estimate of a small eigenvalue.
const INVERSE_ITERATIONS: usize = 6;

/// Of `2^e F 2^e − …`, e diagonal: the Cholesky factor rounded to `f64`, but for its diagonal, which holds the pivots.
pub(super) struct Factor {
    n: usize,
    exponents: Vec<i32>,
    lower: Vec<f64>,
}

impl Factor {
    /// Of a matrix in double-double, high and low parts column by column, lower triangle; `None` where the factorisation does not run to its
    /// end.
    pub fn new(n: usize, exponents: Vec<i32>, mut high: Vec<f64>, mut low: Vec<f64>) -> Option<Self> {
        factorizes(n, &mut high, &mut low).then_some(Self { n, exponents, lower: high })
    }

    /// An estimate of the smallest eigenvalue of F by inverse iteration, mostly from above.
    pub fn smallest_eigenvalue(&self) -> f64 {
        let Self { n, exponents, lower } = self;
        let n = *n;
        let scale: Vec<f64> = exponents.iter().map(|&e| 2.0_f64.powi(e)).collect();
        let column = |k: usize| &lower[k * n..(k + 1) * n];
        let mut estimate = f64::INFINITY;
        let mut x: Vec<f64> = (0..n).map(|i| 1.0 + 0.3 * ((7 * i + 3) % 11) as f64 / 11.0).collect();
        for _ in 0..INVERSE_ITERATIONS {
            let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
            x.iter_mut().zip(&scale).for_each(|(x, s)| *x *= s / length);
            for k in 0..n {
                let (pivot, rest) = (column(k)[k].sqrt(), &column(k)[k + 1..]);
                x[k] /= pivot;
                let solved = x[k];
                x[k + 1..].iter_mut().zip(rest).for_each(|(x, l)| *x -= solved * l);
            }
            for k in (0..n).rev() {
                let (pivot, rest) = (column(k)[k].sqrt(), &column(k)[k + 1..]);
                let inner: f64 = x[k + 1..].iter().zip(rest).map(|(x, l)| x * l).sum();
                x[k] = (x[k] - inner) / pivot;
            }
            x.iter_mut().zip(&scale).for_each(|(x, s)| *x *= s);
            estimate = 1.0 / x.iter().map(|x| x * x).sum::<f64>().sqrt();
        }
        estimate
    }
}

vectorized! {
    /// Whether the Cholesky factorisation of the lower triangle runs to its end.
    fn factorizes<'a>(n: usize, high: &'a mut [f64], low: &'a mut [f64]) -> bool {
        for k in 0..n {
            let pivot = Double { h: high[k + k * n], l: low[k + k * n] };
            if !(pivot.h > LEAST_PIVOT && pivot.h.is_finite()) {
                return false;
            }
            let inverse = dd::reciprocal(dd::square_root(pivot));
            for i in k + 1..n {
                let entry = dd::multiply(Double { h: high[i + k * n], l: low[i + k * n] }, inverse);
                (high[i + k * n], low[i + k * n]) = (entry.h, entry.l);
            }
            let (done_high, left_high) = high.split_at_mut((k + 1) * n);
            let (done_low, left_low) = low.split_at_mut((k + 1) * n);
            let (lh, ll) = (&done_high[k * n..], &done_low[k * n..]);
            for j in k + 1..n {
                let factor = Double { h: -lh[j], l: -ll[j] };
                if factor.h == 0.0 {
                    continue;
                }
                let at = (j - k - 1) * n;
                let (ah, al) = (&mut left_high[at + j..at + n], &mut left_low[at + j..at + n]);
                for (((ah, al), lh), ll) in ah.iter_mut().zip(al).zip(&lh[j..]).zip(&ll[j..]) {
                    let product = dd::multiply(Double { h: *lh, l: *ll }, factor);
                    let sum = dd::add(Double { h: *ah, l: *al }, product);
                    (*ah, *al) = (sum.h, sum.l);
                }
            }
        }
        true
    }
}
