//! Balancing: a diagonal similarity by powers of two that brings rows and columns of a matrix to the same size.

use super::Mat;

/// Sweeps after which what is reached is taken.
const MOST_SWEEPS: usize = 20;
/// Largest exponent of a power of two.
const MOST_EXPONENT: i32 = 300;

/// e for which D⁻¹MD, D = diag(2^e), has rows and columns of about the same norm (Parlett and Reinsch 1969, without permutations, which
/// leaves a row or column of zeros as it is). Powers of two scale doubles exactly.
pub fn balance(matrix: &Mat<f64>) -> Vec<i32> {
    let n = matrix.nrows();
    let mut exponents = vec![0_i32; n];
    let entry = |i: usize, j: usize, e: &[i32]| matrix[(i, j)].abs() * 2.0_f64.powi(e[j] - e[i]);
    for _ in 0..MOST_SWEEPS {
        let mut has_changed = false;
        for i in 0..n {
            let others = || (0..n).filter(|&j| j != i);
            let column: f64 = others().map(|j| entry(j, i, &exponents)).sum();
            let row: f64 = others().map(|j| entry(i, j, &exponents)).sum();
            let ratio = row / column;
            if !(ratio.is_finite() && ratio > 0.0) {
                continue;
            }
            let step = (0.5 * ratio.log2()).round() as i32;
            let factor = 2.0_f64.powi(step);
            let next = exponents[i] + step;
            if step != 0 && column * factor + row / factor < 0.95 * (column + row) && next.abs() <= MOST_EXPONENT {
                exponents[i] = next;
                has_changed = true;
            }
        }
        if !has_changed {
            break;
        }
    }
    exponents
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::from_rows;

    #[test]
    fn badly_scaled_matrix() {
        let matrix = from_rows(&[vec![1.0, 1e9, 0.0], vec![1e-9, 2.0, 1e5], vec![0.0, 1e-7, 3.0]]);
        let e = balance(&matrix);
        let scaled = |i: usize, j: usize| matrix[(i, j)] * 2.0_f64.powi(e[j] - e[i]);
        for (i, j) in [(0, 1), (1, 0), (1, 2), (2, 1)] {
            assert!((0.01..100.0).contains(&scaled(i, j)), "{i} {j} {}", scaled(i, j));
        }
    }

    #[test]
    fn zeros_and_what_is_no_number() {
        assert_eq!(balance(&Mat::zeros(3, 3)), vec![0; 3]);
        assert_eq!(balance(&Mat::from_fn(2, 2, |_, _| f64::NAN)), vec![0; 2]);
        assert_eq!(balance(&Mat::zeros(0, 0)), Vec::<i32>::new());
    }
}
