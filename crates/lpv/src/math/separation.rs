//! Matrices that show that no common Lyapunov function exists, exactly.
//!
//! Let Zᵢ ⪰ 0, not all of them zero, with ZᵢB = 0 and S = Σ(ZᵢAᵢ + AᵢᵀZᵢ) ⪰ 0. Then for all Y ≻ 0 and Lᵢ
//!
//! ```text
//! Σ tr Zᵢ(−(AᵢY − BLᵢ) − (AᵢY − BLᵢ)ᵀ) = −tr YS ≤ 0,
//! ```
//!
//! and not every −(AᵢY − BLᵢ) − (AᵢY − BLᵢ)ᵀ is positive definite: xᵀY⁻¹x falls at all vertices for no gain. Since BᵀSB = 0, S ⪰ 0 asks for
//! SB = ΣZᵢAᵢB = 0. These equations hold of no rounded numbers; so with the rows of N a basis of what B does not reach, NB = 0, found without
//! fractions, Zᵢ = NᵀWᵢN, and of the linear equations ΣWᵢNAᵢB = 0 as many entries of the Wᵢ as there are equations follow exactly from the
//! others (`elimination.rs`). Whether Wᵢ ⪰ 0 and NSNᵀ ⪰ 0 is then decided on integers, too.

use super::Mat;
use super::definite::{Definiteness, eliminated};
use super::elimination::Elimination;
use super::hurwitz::{Integers, product};
use super::stabilizability::{integers, quotient};
use num_bigint::{BigInt, Sign};

/// Bits behind the point of what the entries of Wᵢ are rounded to, of the largest.
const BITS: i32 = 44;
/// Bits of an entry of the equations, times equations squared, beyond which elimination would take too long.
const MOST_BITS: u64 = 4_000_000;

/// The Zᵢ near `guess` that are proved to exclude a common Lyapunov function for the Aᵢ and B, rounded; `None` where there are none near, or it
/// cannot be told.
pub fn separating(a: &[&Mat<f64>], b: &Mat<f64>, guess: &[Mat<f64>]) -> Option<Vec<Mat<f64>>> {
    let (n, count) = (b.nrows(), a.len());
    let stacked = Mat::from_fn(count * n, n, |i, j| a[i / n][(i % n, j)]);
    let (a, _) = integers(&stacked, |_, _| 0)?;
    let a: Vec<Integers> = a.chunks(n).map(<[_]>::to_vec).collect();
    let (b, _) = integers(b, |_, _| 0)?;
    let unreached = Unreached::of(&b)?;
    let q = unreached.free.len();
    let reached: Vec<Integers> = a.iter().map(|a| product(&product(&unreached.rows, a), &b)).collect();
    let w = repaired(&reached, &unreached.free, guess)?;
    let is_definite = |m: &Integers| eliminated(m.clone()) != Definiteness::Indefinite;
    if w.iter().flatten().flatten().all(|entry| entry.sign() == Sign::NoSign) || !w.iter().all(is_definite) {
        return None;
    }
    let transposed: Integers = (0..n).map(|i| (0..q).map(|k| unreached.rows[k][i].clone()).collect()).collect();
    let z: Vec<Integers> = w.iter().map(|w| product(&product(&transposed, w), &unreached.rows)).collect();
    let mut s: Integers = vec![vec![BigInt::from(0); n]; n];
    for (z, a) in z.iter().zip(&a) {
        let half = product(z, a);
        (0..n).for_each(|i| (0..n).for_each(|j| s[i][j] += &half[i][j] + &half[j][i]));
    }
    let reaches_nothing = |m: &Integers| product(m, &b).iter().flatten().all(|entry| entry.sign() == Sign::NoSign);
    let projected = product(&product(&unreached.rows, &s), &transposed);
    if !reaches_nothing(&s) || !z.iter().all(reaches_nothing) || !is_definite(&projected) {
        return None;
    }
    let largest = z.iter().flatten().flatten().max_by(|x, y| x.magnitude().cmp(y.magnitude()))?.magnitude().clone();
    let largest = BigInt::from(largest);
    let rounded = |z: &Integers| Mat::from_fn(n, n, |i, j| quotient(&z[i][j], &largest, 0));
    Some(z.iter().map(rounded).collect())
}

/// The w with wᵀB = 0.
struct Unreached {
    /// States that are free in w, each with one row of N: there it has d, and zeros at the others.
    free: Vec<usize>,
    /// N, q × n.
    rows: Integers,
}

impl Unreached {
    /// `None` where B reaches everything.
    fn of(b: &Integers) -> Option<Self> {
        let (n, m) = (b.len(), b.first().map_or(0, Vec::len));
        let columns: Integers = (0..m).map(|j| (0..n).map(|i| b[i][j].clone()).collect()).collect();
        let Elimination { rows, pivots, determinant, .. } = Elimination::of(columns, 0..n);
        let free: Vec<usize> = (0..n).filter(|i| !pivots.contains(i)).collect();
        let basis = |&k: &usize| {
            let mut w = vec![BigInt::from(0); n];
            w[k].clone_from(&determinant);
            pivots.iter().zip(&rows).for_each(|(&pivot, row)| w[pivot] = -&row[k]);
            w
        };
        (!free.is_empty()).then(|| Self { rows: free.iter().map(basis).collect(), free })
    }
}

/// The Wᵢ with ΣWᵢGᵢ = 0 near those of `guess`, times a common factor.
fn repaired(reached: &[Integers], free: &[usize], guess: &[Mat<f64>]) -> Option<Vec<Integers>> {
    let (q, m) = (free.len(), reached.first()?.first()?.len());
    // unknowns are the upper triangles, one after the other
    let triangle: Vec<(usize, usize)> = (0..q).flat_map(|i| (i..q).map(move |j| (i, j))).collect();
    let at = |vertex: usize, i: usize, j: usize| {
        let (i, j) = (i.min(j), i.max(j));
        vertex * triangle.len() + i * q - i * (i + 1) / 2 + j
    };
    let unknowns = reached.len() * triangle.len();
    let mut equations: Integers = Vec::with_capacity(q * m);
    for k in 0..q {
        for column in 0..m {
            let mut row = vec![BigInt::from(0); unknowns];
            for (vertex, g) in reached.iter().enumerate() {
                (0..q).for_each(|l| row[at(vertex, k, l)] += &g[l][column]);
            }
            equations.push(row);
        }
    }
    let bits = equations.iter().flatten().map(BigInt::bits).max().unwrap_or(0);
    if bits * ((q * m) as u64).pow(2) > MOST_BITS {
        return None;
    }
    let values: Vec<f64> = guess.iter().flat_map(|z| triangle.iter().map(|&(i, j)| z[(free[i], free[j])])).collect();
    let largest = values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if values.len() != unknowns || largest <= 0.0 || !largest.is_finite() {
        return None;
    }
    // the diagonal entries are the largest of a semidefinite matrix: what follows from the others changes least in proportion
    let mut order: Vec<usize> = (0..unknowns).collect();
    order.sort_by(|&i, &j| values[j].abs().total_cmp(&values[i].abs()));
    let Elimination { rows, pivots, determinant, .. } = Elimination::of(equations, order);
    let integer = |x: f64| BigInt::from((x / largest * 2.0_f64.powi(BITS)).round() as i64);
    let sign = if determinant.sign() == Sign::Minus { -1 } else { 1 };
    let mut solution: Vec<BigInt> = values.iter().map(|&x| integer(x)).collect();
    let is_pivot: Vec<bool> = (0..unknowns).map(|k| pivots.contains(&k)).collect();
    let fixed: Vec<BigInt> =
        rows.iter().map(|row| (0..unknowns).filter(|&k| !is_pivot[k]).map(|k| &row[k] * &solution[k]).sum()).collect();
    for (_, x) in solution.iter_mut().enumerate().filter(|(k, _)| !is_pivot[*k]) {
        *x *= &determinant * sign;
    }
    for (&pivot, fixed) in pivots.iter().zip(&fixed) {
        solution[pivot] = -fixed * sign;
    }
    let matrix = |vertex: usize| -> Integers {
        (0..q).map(|i| (0..q).map(|j| solution[at(vertex, i, j)].clone()).collect()).collect()
    };
    Some((0..reached.len()).map(matrix).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::{diagonal, from_rows};
    use std::slice::from_ref;

    /// ẋ₁ = ±x₂ + …, ẋ₂ = u: x₁ is driven by x₂ with either sign, and no common function exists. With the same sign there is one.
    #[test]
    fn opposite_signs() {
        let b = from_rows(&[vec![0.0], vec![1.0]]);
        let a = |growth: f64, sign: f64| from_rows(&[vec![growth, sign], vec![0.0, 0.0]]);
        let (plus, minus, weak) = (a(0.1, 1.0), a(0.1, -1.0), a(0.1, 0.5));
        let half = [diagonal(&[0.5, 0.0]), diagonal(&[0.5, 0.0])];
        let z = separating(&[&plus, &minus], &b, &half).unwrap();
        assert_eq!(z, vec![diagonal(&[1.0, 0.0]); 2]);
        // the guess is wrong, and what follows is exact: Z₁ = Z₂ is needed
        assert!(separating(&[&plus, &minus], &b, &[diagonal(&[0.5, 0.0]), diagonal(&[0.4, 7.0])]).is_some());
        assert_eq!(separating(&[&plus, &weak], &b, &half), None, "a gain on x₁ alone does it");
        let decaying = (a(-0.1, 1.0), a(-0.1, -1.0));
        assert_eq!(separating(&[&decaying.0, &decaying.1], &b, &half), None);
        // as little as a double can tell
        let (least, sure) = (a(f64::from_bits(1), 1.0), a(0.0, -1.0));
        assert!(separating(&[&a(0.0, 1.0), &sure], &b, &half).is_some(), "at rest without an input");
        assert!(separating(&[&least, &sure], &b, &half).is_some());
        assert!(separating(&[&a(-1e-17, 1.0), &sure], &b, &half).is_none());
        assert!(separating(&[&a(1e-17, 1.0), &sure], &b, &half).is_some());
    }

    /// Everything reached, nothing reached, and guesses without meaning.
    #[test]
    fn edges() {
        let one = Mat::from_fn(1, 1, |_, _| 1.0);
        let none = Mat::zeros(1, 1);
        assert_eq!(separating(&[&one], &one, from_ref(&one)), None);
        assert!(separating(&[&one], &none, from_ref(&one)).is_some(), "ẋ = x without an input");
        assert_eq!(separating(&[&(-1.0 * &one)], &none, from_ref(&one)), None);
        assert_eq!(separating(&[&one], &none, from_ref(&none)), None, "zero separates nothing");
        assert_eq!(separating(&[&one], &none, &[-1.0 * &one]), None);
        assert_eq!(separating(&[&one], &none, &[Mat::from_fn(1, 1, |_, _| f64::NAN)]), None);
        assert_eq!(separating(&[&one], &none, &[]), None);
    }
}
