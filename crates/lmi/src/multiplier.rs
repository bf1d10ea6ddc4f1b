//! Multipliers that are proved to be positive semidefinite, and how much of a block they weigh.
//!
//! With D diagonal and `D Z D ⪰ λI` a block F ⪰ 0 satisfies `⟨F, Z⟩ ≥ λ Σⱼ Fⱼⱼ/dⱼ²`: where ⟨F, Z⟩ is known to be at most τ,
//!
//! ```text
//! Fⱼⱼ ≤ wⱼ τ,   |Fⱼₖ| ≤ ½ √(wⱼ wₖ) τ,   wⱼ = dⱼ²/λ.
//! ```

use crate::Mat;
use crate::rigorous::Enclosure;
use crate::verification::{Spectrum, largest_entry};

/// Share of the estimated smallest eigenvalue that is proved.
const SHARE: f64 = 0.5;
/// Steps of the estimate by inverse iteration.
const STEPS: usize = 4;
/// Largest binary exponent of a scaling factor.
const MOST: i32 = 400;

/// A multiplier Z ⪰ 0, proved.
#[derive(Clone, Debug)]
pub(crate) struct Multiplier {
    /// Z, symmetric to the bit.
    pub matrix: Mat<f64>,
    /// wⱼ; ∞ where nothing is known of row j.
    pub weights: Vec<f64>,
}

impl Multiplier {
    /// Of the symmetric part of a matrix, moved up by a few rounding errors if need be; `None` where it is not proved.
    pub fn new(z: &Mat<f64>) -> Option<Self> {
        let n = z.nrows();
        let mut matrix = Mat::from_fn(n, n, |i, j| 0.5 * (z[(i, j)] + z[(j, i)]));
        let largest = largest_entry(&matrix);
        if !largest.is_finite() {
            return None;
        }
        if is_diagonal(&matrix) {
            (0..n).for_each(|i| matrix[(i, i)] = matrix[(i, i)].max(0.0));
            let weights = (0..n).map(|i| 1.001 / matrix[(i, i)]).collect();
            return Some(Self { matrix, weights });
        }
        if let Some(weights) = weights(&matrix) {
            return Some(Self { matrix, weights });
        }
        let unknown = vec![f64::INFINITY; n];
        let proved = |z: &Mat<f64>| Enclosure::of_matrix(z).exceeds(0.0);
        if proved(&matrix) {
            return Some(Self { matrix, weights: unknown });
        }
        let spectrum = Spectrum::of(&matrix);
        let rounding = spectrum.rounding.max(f64::EPSILON * spectrum.largest);
        for _ in 0..3 {
            (0..n).for_each(|i| matrix[(i, i)] += rounding);
            if proved(&matrix) {
                return Some(Self { matrix, weights: unknown });
            }
        }
        None
    }

    /// tr Z.
    pub fn trace(&self) -> f64 {
        (0..self.matrix.nrows()).map(|i| self.matrix[(i, i)]).sum()
    }
}

fn is_diagonal(m: &Mat<f64>) -> bool {
    (0..m.ncols()).all(|j| m.col_as_slice(j).iter().enumerate().all(|(i, entry)| i == j || *entry == 0.0))
}

/// The weights of a matrix whose rows are zero or, all together, those of a positive definite one. Where this succeeds, the matrix is
/// proved to be positive semidefinite.
fn weights(z: &Mat<f64>) -> Option<Vec<f64>> {
    let n = z.nrows();
    let rows: Vec<usize> = (0..n).filter(|&j| z.col_as_slice(j).iter().any(|entry| *entry != 0.0)).collect();
    let mut exponents = Vec::with_capacity(rows.len());
    for &j in &rows {
        let entry = z[(j, j)];
        let exponent = (-0.5 * entry.log2()).round();
        if !(entry > 0.0 && exponent.abs() <= f64::from(MOST)) {
            return None;
        }
        exponents.push(exponent as i32);
    }
    // Products of powers of two with entries of at most √(zⱼⱼ zₖₖ): what underflows is caught by the error that the proof allows.
    let powers: Vec<f64> = exponents.iter().map(|&e| 2.0_f64.powi(e)).collect();
    let scaled = Mat::from_fn(rows.len(), rows.len(), |i, j| z[(rows[i], rows[j])] * powers[i] * powers[j]);
    let lambda = SHARE * smallest_eigenvalue(&scaled)?;
    if !(lambda > 0.0 && Enclosure::of_matrix(&scaled).exceeds(lambda)) {
        return None;
    }
    let mut weights = vec![f64::INFINITY; n];
    rows.iter().zip(&powers).for_each(|(&j, d)| weights[j] = 1.001 * d * d / lambda);
    Some(weights)
}

/// An estimate from a Cholesky factorisation and inverse iteration, mostly from above; `None` where there is no factor.
fn smallest_eigenvalue(m: &Mat<f64>) -> Option<f64> {
    let n = m.nrows();
    let mut l: Vec<f64> = (0..n).flat_map(|j| m.col_as_slice(j).iter().copied()).collect();
    for k in 0..n {
        let pivot = l[k + k * n];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// ⟨F, Z⟩ ≥ Fⱼⱼ/wⱼ for F = vvᵀ, at the edge of what the weights claim.
    #[test]
    fn weights_hold() {
        for scale in [1e-6, 1.0, 1e6] {
            let d = [1.0, scale, 1.0 / scale];
            let z = Mat::from_fn(3, 3, |i, j| d[i] * d[j] * if i == j { 1.0 } else { 0.4 });
            let multiplier = Multiplier::new(&z).unwrap();
            for k in 0..3 {
                // v: the vector that makes F_kk/⟨F, Z⟩ largest is the k-th column of Z⁻¹.
                let inverse = [1.0, -0.4 / 1.4, -0.4 / 1.4];
                let v: Vec<f64> = (0..3).map(|i| inverse[(i + 3 - k) % 3] / d[i]).collect();
                let form: f64 = (0..3).map(|i| (0..3).map(|j| v[i] * v[j] * z[(i, j)]).sum::<f64>()).sum();
                assert!(v[k] * v[k] <= multiplier.weights[k] * form, "{k}: {:?}", multiplier.weights);
            }
        }
    }

    #[test]
    fn what_is_not_definite_is_refused() {
        let z = |a: f64| Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { a });
        assert!(Multiplier::new(&z(1.0 + 1e-9)).is_none());
        assert!(Multiplier::new(&z(1.0 - 1e-9)).is_some());
        assert!(Multiplier::new(&z(f64::NAN)).is_none());
        // A row of zeros has no weight, the others keep theirs.
        let padded = Mat::from_fn(3, 3, |i, j| if i == 1 || j == 1 { 0.0 } else { z(0.5)[(i / 2, j / 2)] });
        let weights = Multiplier::new(&padded).unwrap().weights;
        assert!(weights[1].is_infinite() && weights[0].is_finite() && weights[2].is_finite());
    }
}
