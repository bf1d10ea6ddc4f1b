//! Multipliers that are proved to be positive semidefinite, and how much of a block they weigh.
//!
//! With D diagonal and `D Z D ⪰ λI` a block F ⪰ 0 satisfies `⟨F, Z⟩ ≥ λ Σⱼ Fⱼⱼ/dⱼ²`: where ⟨F, Z⟩ is known to be at most τ,
//!
//! ```text
//! Fⱼⱼ ≤ wⱼ τ,   |Fⱼₖ| ≤ ½ √(wⱼ wₖ) τ,   wⱼ = dⱼ²/λ.
//! ```

use crate::Mat;
use crate::estimate;
use crate::rigorous::Enclosure;
use crate::verification::{Spectrum, largest_entry};

/// Share of the estimated smallest eigenvalue that is proved.
const SHARE: f64 = 0.5;
/// Least eigenvalue of a scaled multiplier that counts.
const LEAST: f64 = 1e-200;
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
    let enclosure = Enclosure::of_matrix(&scaled);
    let estimate = SHARE * estimate::smallest_eigenvalue(&scaled).unwrap_or(0.0);
    let lambda = if estimate > 0.0 && enclosure.exceeds(estimate) {
        estimate
    } else {
        enclosure.smallest_eigenvalue_bound(&Spectrum::of(&scaled))
    };
    // Far above what underflow may have done to the scaled entries.
    if lambda.is_nan() || lambda <= LEAST {
        return None;
    }
    let mut weights = vec![f64::INFINITY; n];
    rows.iter().zip(&powers).for_each(|(&j, d)| weights[j] = 1.001 * d * d / lambda);
    Some(weights)
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
