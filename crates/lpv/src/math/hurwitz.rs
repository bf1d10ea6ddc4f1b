//! Do all eigenvalues of a matrix of integers have negative real parts? Decided exactly.
//!
//! A polynomial p with real coefficients and positive leading one has all its zeros in Re s < 0 if and only if its Hermite matrix H ≻ 0,
//!
//! ```text
//! Σᵢⱼ Hᵢⱼ xⁱyʲ = (p(x)p(y) − p(−x)p(−y)) / 2(x + y)
//! ```
//!
//! (Ch. Hermite, 1856; P. C. Parks and V. Hahn, Stability Theory, 1993). A zero s with −s another one, or on the axis, makes H singular;
//! without such, the inertia of H is that of the zeros. The coefficients come from Faddeev and Le Verrier's method, the zeros of a
//! matrix that is block triangular after a permutation from its blocks.

use super::definite::{Definiteness, eliminated};
use num_bigint::{BigInt, Sign};

/// A matrix of integers, by rows.
pub(super) type Integers = Vec<Vec<BigInt>>;

/// Largest size of an irreducible block.
const MOST_SIZE: usize = 24;
/// Bits of the entries of the Hermite matrix, times its size, beyond which elimination would take too long.
const MOST_BITS: u64 = 400_000;

/// Whether the matrix `m` has all eigenvalues in Re s < 0; `None` where that would take too long.
pub(super) fn is_hurwitz(m: &Integers) -> Option<bool> {
    let d = m.len() as u64;
    // what shows at sight: the trace is the sum of the eigenvalues
    let trace: BigInt = (0..m.len()).map(|i| &m[i][i]).sum();
    if !m.is_empty() && trace.sign() != Sign::Minus {
        return Some(false);
    }
    let bits = m.iter().flatten().map(BigInt::bits).max().unwrap_or(0);
    if m.len() > 1 && (m.len() > MOST_SIZE || 2 * d * (bits + d) * d > MOST_BITS) {
        return None;
    }
    Some(has_zeros_on_the_left(&characteristic_polynomial(m)))
}

/// Coefficients c₀ … c_d, c_d = 1, of det(sI − M).
pub(super) fn characteristic_polynomial(m: &Integers) -> Vec<BigInt> {
    let d = m.len();
    let mut auxiliary: Integers = (0..d).map(|i| (0..d).map(|j| BigInt::from(u8::from(i == j))).collect()).collect();
    let mut coefficients = vec![BigInt::from(1)];
    for k in 1..=d {
        auxiliary = product(m, &auxiliary);
        let trace: BigInt = (0..d).map(|i| &auxiliary[i][i]).sum();
        let coefficient = -trace / BigInt::from(k);
        (0..d).for_each(|i| auxiliary[i][i] += &coefficient);
        coefficients.push(coefficient);
    }
    coefficients.reverse();
    coefficients
}

/// Whether c₀ + c₁s + … + c_d s^d, c_d > 0, has all zeros in Re s < 0.
pub(super) fn has_zeros_on_the_left(c: &[BigInt]) -> bool {
    let d = c.len() - 1;
    if c.iter().any(|c| c.sign() != Sign::Plus) {
        return false;
    }
    let term = |i: usize, j: usize| if (i + j) % 2 == 1 { &c[i] * &c[j] } else { BigInt::from(0) };
    let mut hermite: Integers = Vec::with_capacity(d);
    for i in 0..d {
        let row = (0..d).map(|j| match i {
            i if i > 0 && j + 1 < d => term(i, j + 1) - &hermite[i - 1][j + 1],
            _ => term(i, j + 1),
        });
        let row: Vec<BigInt> = row.collect();
        hermite.push(row);
    }
    eliminated(hermite) == Definiteness::Positive
}

/// XY
pub(super) fn product(x: &Integers, y: &Integers) -> Integers {
    let columns = y.first().map_or(0, Vec::len);
    let entry = |row: &Vec<BigInt>, j: usize| -> BigInt {
        row.iter().zip(y).filter(|(x, _)| x.sign() != Sign::NoSign).map(|(x, y)| x * &y[j]).sum()
    };
    x.iter().map(|row| (0..columns).map(|j| entry(row, j)).collect()).collect()
}

/// For each index those that it leads to along entries that are not zero, itself among them: `reaches[i][j]`.
pub(super) fn reachability(m: &Integers) -> Vec<Vec<bool>> {
    let d = m.len();
    let mut reaches: Vec<Vec<bool>> =
        (0..d).map(|i| (0..d).map(|j| i == j || m[i][j].sign() != Sign::NoSign).collect()).collect();
    for k in 0..d {
        let through = reaches[k].clone();
        for row in reaches.iter_mut().filter(|row| row[k]) {
            row.iter_mut().zip(&through).for_each(|(reaches, through)| *reaches |= through);
        }
    }
    reaches
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn polynomial(c: &[i64]) -> Vec<BigInt> {
        c.iter().map(|&c| BigInt::from(c)).collect()
    }

    /// The product of s − z, or of (s − a)² + b² for a pair.
    fn from_zeros(real: &[i64], pairs: &[(i64, i64)]) -> Vec<BigInt> {
        let times = |p: Vec<BigInt>, q: &[BigInt]| {
            let mut out = vec![BigInt::from(0); p.len() + q.len() - 1];
            for (i, p) in p.iter().enumerate() {
                q.iter().enumerate().for_each(|(j, q)| out[i + j] += p * q);
            }
            out
        };
        let start = real.iter().fold(polynomial(&[1]), |p, z| times(p, &polynomial(&[-z, 1])));
        pairs.iter().fold(start, |p, (a, b)| times(p, &polynomial(&[a * a + b * b, -2 * a, 1])))
    }

    #[test]
    fn edges() {
        assert!(has_zeros_on_the_left(&polynomial(&[1])));
        assert!(has_zeros_on_the_left(&polynomial(&[1, 1])));
        assert!(!has_zeros_on_the_left(&polynomial(&[0, 1])));
        assert!(!has_zeros_on_the_left(&polynomial(&[1, 0, 1])), "±i");
        assert!(!has_zeros_on_the_left(&polynomial(&[1, 1, 1, 1])), "(s² + 1)(s + 1): every coefficient is positive");
        assert!(has_zeros_on_the_left(&polynomial(&[1, 2, 2, 1])));
        assert!(!has_zeros_on_the_left(&from_zeros(&[-5, -6, -7], &[(1, 20)])));
        assert!(has_zeros_on_the_left(&from_zeros(&[-1; 12], &[(-1, 1000)])), "multiple zeros");
        assert_eq!(is_hurwitz(&Vec::new()), Some(true));
    }

    #[test]
    fn characteristic_polynomial_of_a_companion_matrix() {
        let m: Integers = vec![polynomial(&[0, 1, 0]), polynomial(&[0, 0, 1]), polynomial(&[-6, -11, -6])];
        assert_eq!(characteristic_polynomial(&m), from_zeros(&[-1, -2, -3], &[]));
        assert_eq!(is_hurwitz(&m), Some(true));
    }

    proptest! {
        #[test]
        fn zeros_decide(real in proptest::collection::vec(-4i64..2, 0..5), pairs in proptest::collection::vec((-3i64..2, 1i64..6), 0..4)) {
            let expected = real.iter().all(|&z| z < 0) && pairs.iter().all(|pair| pair.0 < 0);
            prop_assert_eq!(has_zeros_on_the_left(&from_zeros(&real, &pairs)), expected);
        }
    }
}
