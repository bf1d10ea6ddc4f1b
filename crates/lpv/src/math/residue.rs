//! Subspaces over the integers modulo a prime, and the rational numbers that they stand for.
//!
//! A rank modulo a prime is never above the rank itself, so that full rank modulo one prime proves full rank. Entries of a reduced
//! basis are rational numbers; from their residues modulo M they are found again if numerator and denominator are below √(M/2)
//! (P. S. Wang, 1981). That they are found proves nothing: who uses them checks what they are for, in integers.

use num_bigint::{BigInt, BigUint, Sign};

/// Primes just below 2⁶¹, found by Miller and Rabin's test, which with these bases is no guess for 64 bits.
pub(super) fn primes() -> impl Iterator<Item = u64> {
    (0..).map(|k| (1_u64 << 61) - 1 - 2 * k).filter(|&candidate| is_prime(candidate))
}

fn is_prime(candidate: u64) -> bool {
    let (odd, twos) = ((candidate - 1) >> (candidate - 1).trailing_zeros(), (candidate - 1).trailing_zeros());
    [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37].into_iter().all(|base| {
        let mut x = power(base, odd, candidate);
        if x == 1 || x == candidate - 1 {
            return true;
        }
        (1..twos).any(|_| {
            x = times(x, x, candidate);
            x == candidate - 1
        })
    })
}

fn times(x: u64, y: u64, p: u64) -> u64 {
    (u128::from(x) * u128::from(y) % u128::from(p)) as u64
}

fn power(mut x: u64, mut exponent: u64, p: u64) -> u64 {
    let mut out = 1;
    while exponent > 0 {
        if exponent & 1 == 1 {
            out = times(out, x, p);
        }
        x = times(x, x, p);
        exponent >>= 1;
    }
    out
}

/// The residue of `x`, from 0 to p − 1.
pub(super) fn residue(x: &BigInt, p: u64) -> u64 {
    let of_magnitude = (x.magnitude() % p).iter_u64_digits().next().unwrap_or(0);
    if x.sign() == Sign::Minus && of_magnitude > 0 { p - of_magnitude } else { of_magnitude }
}

/// A subspace modulo p by a basis in echelon form.
pub(super) struct Subspace {
    p: u64,
    /// Each with a one at its pivot, and zeros at the pivots of those before it.
    rows: Vec<(usize, Vec<u64>)>,
}

impl Subspace {
    /// The smallest subspace that holds the columns of B and with x also Ax, modulo p. `a` has the rows of A, `b` the columns of B.
    pub fn invariant(a: &[Vec<u64>], b: Vec<Vec<u64>>, p: u64) -> Self {
        let mut subspace = Self { p, rows: Vec::new() };
        let mut open = b;
        while let Some(x) = open.pop() {
            let Some(x) = subspace.add(x) else { continue };
            let image =
                a.iter().map(|row| row.iter().zip(x.iter()).fold(0, |sum, (&a, &x)| (sum + times(a, x, p)) % p));
            open.push(image.collect());
            if subspace.rows.len() == a.len() {
                break;
            }
        }
        subspace
    }

    /// Dimension.
    pub fn dimension(&self) -> usize {
        self.rows.len()
    }

    /// The part of x outside, which becomes a member of the basis; `None` where there is none.
    fn add(&mut self, mut x: Vec<u64>) -> Option<&[u64]> {
        for (pivot, row) in &self.rows {
            let factor = x[*pivot];
            subtract(&mut x, row, factor, self.p);
        }
        let pivot = x.iter().position(|&entry| entry != 0)?;
        let inverse = power(x[pivot], self.p - 2, self.p);
        x.iter_mut().for_each(|entry| *entry = times(*entry, inverse, self.p));
        self.rows.push((pivot, x));
        self.rows.last().map(|(_, row)| row.as_slice())
    }

    /// The pivots in ascending order, and the rows of the reduced basis in that order: ones at the own pivot, zeros at the others.
    pub fn reduced(mut self) -> (Vec<usize>, Vec<Vec<u64>>) {
        for k in (0..self.rows.len()).rev() {
            let (later, p) = (self.rows.split_off(k + 1), self.p);
            let row = &mut self.rows[k].1;
            for (pivot, other) in &later {
                let factor = row[*pivot];
                subtract(row, other, factor, p);
            }
            self.rows.extend(later);
        }
        self.rows.sort_by_key(|(pivot, _)| *pivot);
        self.rows.into_iter().unzip()
    }
}

/// x − factor·row
fn subtract(x: &mut [u64], row: &[u64], factor: u64, p: u64) {
    if factor != 0 {
        x.iter_mut().zip(row).for_each(|(x, &row)| *x = (*x + (p - times(factor, row, p))) % p);
    }
}

/// Numbers known modulo M, a product of primes.
pub(super) struct Residues {
    modulus: BigInt,
    values: Vec<BigInt>,
}

impl Residues {
    /// Modulo one prime.
    pub fn new(values: &[u64], p: u64) -> Self {
        Self { modulus: p.into(), values: values.iter().map(|&value| value.into()).collect() }
    }

    /// Modulo another prime too (Chinese remainders).
    pub fn join(&mut self, values: &[u64], p: u64) {
        let inverse = power(residue(&self.modulus, p), p - 2, p);
        for (known, &value) in self.values.iter_mut().zip(values) {
            let step = times((value + p - residue(known, p)) % p, inverse, p);
            *known += &self.modulus * step;
        }
        self.modulus *= p;
    }

    /// Small numerators over one common denominator q > 0 that the residues stand for; `None` where there are none.
    pub fn fractions(&self) -> Option<(Vec<BigInt>, BigInt)> {
        let bound = BigInt::from((self.modulus.magnitude() >> 1_u8).sqrt());
        let half = &self.modulus >> 1;
        let mut denominator = BigInt::from(1);
        for value in &self.values {
            denominator *= fraction_denominator(&(value * &denominator % &self.modulus), &self.modulus, &bound)?;
            if denominator > bound {
                return None;
            }
        }
        let numerator = |value: &BigInt| {
            let product = value * &denominator % &self.modulus;
            let centred = if product > half { product - &self.modulus } else { product };
            (centred.magnitude() <= bound.magnitude()).then_some(centred)
        };
        Some((self.values.iter().map(numerator).collect::<Option<_>>()?, denominator))
    }
}

/// q > 0 with qx = r modulo M and q, |r| within the bound: Euclid's algorithm, stopped halfway.
fn fraction_denominator(x: &BigInt, modulus: &BigInt, bound: &BigInt) -> Option<BigInt> {
    let (mut r, mut next_r) = (modulus.clone(), x.clone());
    let (mut t, mut next_t) = (BigInt::from(0), BigInt::from(1));
    while next_r > *bound {
        let quotient = &r / &next_r;
        (r, next_r) = (next_r.clone(), r - &quotient * &next_r);
        (t, next_t) = (next_t.clone(), t - quotient * &next_t);
    }
    let denominator: BigUint = next_t.magnitude().clone();
    (denominator <= *bound.magnitude()).then(|| denominator.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mersenne_prime_and_the_next() {
        let found: Vec<u64> = primes().take(4).collect();
        assert_eq!(found[0], (1 << 61) - 1);
        assert!(found.windows(2).all(|pair| pair[1] < pair[0]));
        assert!(!is_prime((1 << 61) - 3) && !is_prime(3_215_031_751) && is_prime(65_537));
    }

    #[test]
    fn fractions_are_found_again() {
        let (p, q) = (primes().next().unwrap(), primes().nth(1).unwrap());
        let values = |p: u64| {
            let over = |n: i64, d: u64| times(residue(&n.into(), p), power(d, p - 2, p), p);
            vec![over(-3, 7), over(5, 14), 0, over(-123_456_789_012, 35), 1]
        };
        let mut residues = Residues::new(&values(p), p);
        assert_eq!(residues.fractions(), None, "one prime is too short");
        residues.join(&values(q), q);
        let (numerators, denominator) = residues.fractions().unwrap();
        let expected = [-3 * 10, 5 * 5, 0, -123_456_789_012_i64 * 2, 70].map(BigInt::from);
        assert_eq!((numerators, denominator), (expected.to_vec(), BigInt::from(70)));
    }

    #[test]
    fn invariant_subspace() {
        let p = primes().next().unwrap();
        // a chain 3 → 2 → 1 and a state by itself
        let a = vec![vec![0, 1, 0, 0], vec![0, 0, 1, 0], vec![0, 0, 0, 0], vec![0, 0, 0, 5]];
        let subspace = Subspace::invariant(&a, vec![vec![0, 0, 3, 0]], p);
        assert_eq!(subspace.dimension(), 3);
        let (pivots, rows) = subspace.reduced();
        assert_eq!(pivots, [0, 1, 2]);
        assert_eq!(rows, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]);
    }
}
