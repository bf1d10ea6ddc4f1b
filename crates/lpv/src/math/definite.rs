//! Is a symmetric matrix of doubles positive definite, or semidefinite? Decided exactly.
//!
//! A double is an integer times a power of two, so that a matrix of doubles is, after an exact scaling D M D by powers of two and a
//! common factor, one of integers. Symmetric elimination without fractions (E. H. Bareiss, Math. Comp. 22, 1968) with the largest
//! diagonal entry as pivot keeps it so: after k steps its entries are those of the Schur complement times the product of the pivots,
//! which are positive, so that signs tell definiteness and a remainder of zeros semidefiniteness.

use super::Mat;
use super::eigen::symmetric_eigenvalues;
use num_bigint::BigInt;

/// What a symmetric matrix is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Definiteness {
    /// ≻ 0
    Positive,
    /// ⪰ 0 and singular.
    Semidefinite,
    /// Neither: xᵀMx < 0 for some x.
    Indefinite,
}

/// Bits of an integer matrix, entries' bits times size, beyond which elimination would take too long.
const MOST_BITS: i64 = 400_000;

/// What `matrix` is, exactly; `None` of one that is not symmetric to the bit, not finite, or whose entries differ too much in
/// size for exact elimination to be practical.
pub fn definiteness(matrix: &Mat<f64>) -> Option<Definiteness> {
    let n = matrix.nrows();
    let is_usable = |i: usize, j: usize| matrix[(i, j)].is_finite() && matrix[(i, j)] == matrix[(j, i)];
    if n != matrix.ncols() || !(0..n).all(|i| (0..n).all(|j| is_usable(i, j))) {
        return None;
    }
    // what shows at sight, for any size of entries
    if (0..n).any(|i| matrix[(i, i)] < 0.0 || matrix[(i, i)] == 0.0 && (0..n).any(|j| matrix[(i, j)] != 0.0)) {
        return Some(Definiteness::Indefinite);
    }
    let kept: Vec<usize> = (0..n).filter(|&i| matrix[(i, i)] != 0.0).collect();
    let integers = integers(matrix, &kept)?;
    let of_rest = eliminated(integers);
    Some(match of_rest {
        Definiteness::Positive if kept.len() < n => Definiteness::Semidefinite,
        other => other,
    })
}

/// m and e of x = m 2^e.
pub(super) fn parts(x: f64) -> (i64, i64) {
    let bits = x.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i64;
    let fraction = (bits & 0x000f_ffff_ffff_ffff) as i64;
    let mantissa = if exponent == 0 { fraction } else { fraction | 1 << 52 };
    let sign = if bits >> 63 == 1 { -1 } else { 1 };
    (sign * mantissa, exponent.max(1) - 1075)
}

/// The rows and columns `kept`, scaled by powers of two, as integers.
fn integers(matrix: &Mat<f64>, kept: &[usize]) -> Option<Vec<Vec<BigInt>>> {
    // 2^-s brings the diagonal entry near one
    let scale = |i: usize| parts_exponent(matrix[(i, i)]).div_euclid(2);
    let scales: Vec<i64> = kept.iter().map(|&i| scale(i)).collect();
    let entry = |a: usize, b: usize| {
        let (mantissa, exponent) = parts(matrix[(kept[a], kept[b])]);
        (mantissa, exponent - scales[a] - scales[b])
    };
    let pairs = || (0..kept.len()).flat_map(|a| (0..kept.len()).map(move |b| (a, b)));
    let exponents = || pairs().map(|(a, b)| entry(a, b)).filter(|(mantissa, _)| *mantissa != 0).map(|(_, e)| e);
    let (least, most) = (exponents().min().unwrap_or(0), exponents().max().unwrap_or(0));
    if (most - least + 53) * (kept.len() as i64) > MOST_BITS {
        return None;
    }
    let integer = |a: usize, b: usize| match entry(a, b) {
        (0, _) => BigInt::from(0),
        (mantissa, exponent) => BigInt::from(mantissa) << (exponent - least),
    };
    Some((0..kept.len()).map(|a| (0..kept.len()).map(|b| integer(a, b)).collect()).collect())
}

/// Exponent of the leading bit.
fn parts_exponent(x: f64) -> i64 {
    let (mantissa, exponent) = parts(x);
    exponent + 64 - i64::from(mantissa.unsigned_abs().leading_zeros())
}

/// What the symmetric matrix `m` of integers is.
pub(super) fn eliminated(mut m: Vec<Vec<BigInt>>) -> Definiteness {
    let zero = BigInt::from(0);
    let n = m.len();
    let mut previous = BigInt::from(1);
    for k in 0..n {
        let pivot = (k..n).max_by(|&a, &b| m[a][a].cmp(&m[b][b])).unwrap_or(k);
        m.swap(k, pivot);
        m.iter_mut().for_each(|row| row.swap(k, pivot));
        if (k..n).any(|i| m[i][i] < zero) {
            return Definiteness::Indefinite;
        }
        if m[k][k] == zero {
            let vanishes = (k..n).all(|i| (k..n).all(|j| m[i][j] == zero));
            return if vanishes { Definiteness::Semidefinite } else { Definiteness::Indefinite };
        }
        for i in k + 1..n {
            for j in i..n {
                let value = (&m[k][k] * &m[i][j] - &m[i][k] * &m[k][j]) / &previous;
                m[j][i].clone_from(&value);
                m[i][j] = value;
            }
        }
        previous = m[k][k].clone();
    }
    Definiteness::Positive
}

/// Whether Σ xy of pairs (x, y) is zero, exactly; with a pair that is not finite it is not.
pub fn is_zero_sum(pairs: &[(f64, f64)]) -> bool {
    if pairs.iter().any(|(x, y)| !(x.is_finite() && y.is_finite())) {
        return false;
    }
    let product = |&(x, y): &(f64, f64)| {
        let ((m, e), (n, f)) = (parts(x), parts(y));
        (BigInt::from(m) * n, e + f)
    };
    let products: Vec<(BigInt, i64)> = pairs.iter().filter(|(x, y)| *x != 0.0 && *y != 0.0).map(product).collect();
    let least = products.iter().map(|(_, e)| *e).min().unwrap_or(0);
    let sum: BigInt = products.into_iter().map(|(m, e)| m << (e - least)).sum();
    sum == BigInt::from(0)
}

/// The first pair (i, j), i < j, whose entries differ, compared as numbers.
pub fn asymmetry(matrix: &Mat<f64>) -> Option<(usize, usize)> {
    let n = matrix.nrows().min(matrix.ncols());
    (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).find(|&(i, j)| matrix[(i, j)] != matrix[(j, i)])
}

/// λ_min in floating point: for messages.
pub fn smallest_eigenvalue_about(matrix: &Mat<f64>) -> f64 {
    symmetric_eigenvalues(matrix).first().copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::Definiteness::{Indefinite, Positive, Semidefinite};
    use super::*;
    use crate::math::matrix::{diagonal, from_rows, identity};
    use proptest::prelude::*;

    fn of(rows: &[&[f64]]) -> Option<Definiteness> {
        definiteness(&from_rows(&rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>()))
    }

    #[test]
    fn edges() {
        assert_eq!(definiteness(&Mat::zeros(0, 0)), Some(Positive));
        assert_eq!(of(&[&[0.0]]), Some(Semidefinite));
        assert_eq!(of(&[&[-0.0]]), Some(Semidefinite));
        assert_eq!(of(&[&[f64::from_bits(1)]]), Some(Positive));
        assert_eq!(of(&[&[-f64::from_bits(1)]]), Some(Indefinite));
        assert_eq!(of(&[&[f64::NAN]]), None);
        assert_eq!(of(&[&[1.0, 1.0], &[1.0, 1.0]]), Some(Semidefinite));
        assert_eq!(of(&[&[1.0, 1.0], &[1.0, 1.0_f64.next_up()]]), Some(Positive));
        assert_eq!(of(&[&[1.0, 1.0], &[1.0, 1.0_f64.next_down()]]), Some(Indefinite));
        assert_eq!(of(&[&[1.0, 0.5], &[0.5_f64.next_up(), 1.0]]), None, "asymmetric by one unit in the last place");
        assert_eq!(of(&[&[0.0, 1.0], &[1.0, 5.0]]), Some(Indefinite));
        assert_eq!(definiteness(&diagonal(&[1e300, 1e-300, 5e-324])), Some(Positive));
        let (large, small) = (2.0_f64.powi(900), 2.0_f64.powi(-900));
        assert_eq!(of(&[&[large, 1.0], &[1.0, small]]), Some(Semidefinite));
        assert_eq!(of(&[&[large, 1.0], &[1.0, small.next_up()]]), Some(Positive));
        assert_eq!(of(&[&[1.0, 0.0], &[0.0, -20.0]]), Some(Indefinite));
        assert_eq!(definiteness(&identity(64)), Some(Positive));
    }

    #[test]
    fn sums_of_products_are_exact() {
        assert!(is_zero_sum(&[]) && is_zero_sum(&[(0.0, 1.0), (-0.0, 3.0)]));
        // the double 0.1 is not a third of the double 0.3
        assert!(!is_zero_sum(&[(0.1, 3.0), (-0.3, 1.0)]) && is_zero_sum(&[(0.1, 4.0), (-0.4, 1.0)]));
        assert!(is_zero_sum(&[(1e300, 1e300), (-1e300, 1e300)]) && !is_zero_sum(&[(1e-300, 1e-300)]));
        assert!(!is_zero_sum(&[(1.0, 1.0), (-1.0, 1.0_f64.next_up())]));
        // in floating point this sum is zero
        assert!(!is_zero_sum(&[(1.0, 1e30), (1.0, 1.0), (-1.0, 1e30)]));
        assert!(!is_zero_sum(&[(f64::NAN, 0.0)]) && !is_zero_sum(&[(f64::INFINITY, 0.0)]));
    }

    proptest! {
        /// GGᵀ of integers is semidefinite, definite exactly if G is regular; less a unit it is not.
        #[test]
        fn gram_matrices(entries in proptest::collection::vec(-3i32..4, 12), shift in 0..3usize) {
            let g = |i: usize, k: usize| f64::from(entries[4 * i + k]);
            let columns = 2 + shift;
            let gram = Mat::from_fn(3, 3, |i, j| (0..columns.min(4)).map(|k| g(i, k) * g(j, k)).sum::<f64>());
            let found = definiteness(&gram).unwrap();
            prop_assert!(found != Indefinite);
            prop_assert!(columns > 2 || found == Semidefinite);
            if found == Semidefinite {
                let tiny = f64::from_bits(1 << 52);
                let up = &gram + diagonal(&[1.0, 1.0, 1.0]);
                prop_assert_eq!(definiteness(&up), Some(Positive));
                let below = Mat::from_fn(3, 3, |i, j| if i == j && gram[(i, j)] == 0.0 { -tiny } else if i == j { gram[(i, j)].next_down() } else { gram[(i, j)] });
                prop_assert_eq!(definiteness(&below), Some(Indefinite));
            }
        }
    }
}
