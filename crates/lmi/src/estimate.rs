//! A plain Cholesky factorisation and what it tells of the smallest eigenvalue.

use crate::Mat;

/// Steps of inverse iteration.
const STEPS: usize = 4;

/// The lower triangle of the factor in place of that of a matrix, column by column; false where it does not exist.
pub(crate) fn cholesky(n: usize, l: &mut [f64]) -> bool {
    for k in 0..n {
        let pivot = l[k + k * n];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        let root = pivot.sqrt();
        l[k * n + k..(k + 1) * n].iter_mut().for_each(|entry| *entry /= root);
        let (done, left) = l.split_at_mut((k + 1) * n);
        let column = &done[k * n..];
        for j in k + 1..n {
            let factor = column[j];
            let target = &mut left[(j - k - 1) * n + j..(j - k) * n];
            target.iter_mut().zip(&column[j..]).for_each(|(a, b)| *a -= factor * b);
        }
    }
    true
}

/// An estimate of the smallest eigenvalue by inverse iteration, mostly from above; `None` where there is no factor.
pub(crate) fn smallest_eigenvalue(m: &Mat<f64>) -> Option<f64> {
    let n = m.nrows();
    let mut l: Vec<f64> = (0..n).flat_map(|j| m.col_as_slice(j).iter().copied()).collect();
    if !cholesky(n, &mut l) {
        return None;
    }
    let mut x: Vec<f64> = (0..n).map(|i| 1.0 + 0.3 * ((7 * i + 3) % 11) as f64 / 11.0).collect();
    let mut estimate = f64::INFINITY;
    for _ in 0..STEPS {
        let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        x.iter_mut().for_each(|x| *x /= length);
        for k in 0..n {
            let column = &l[k * n..(k + 1) * n];
            x[k] /= column[k];
            let solved = x[k];
            x[k + 1..].iter_mut().zip(&column[k + 1..]).for_each(|(x, l)| *x -= solved * l);
        }
        for k in (0..n).rev() {
            let column = &l[k * n..(k + 1) * n];
            let inner: f64 = x[k + 1..].iter().zip(&column[k + 1..]).map(|(x, l)| x * l).sum();
            x[k] = (x[k] - inner) / column[k];
        }
        estimate = 1.0 / x.iter().map(|x| x * x).sum::<f64>().sqrt();
    }
    estimate.is_finite().then_some(estimate)
}
