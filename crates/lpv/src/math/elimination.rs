//! Linear equations of integers, solved without fractions (E. H. Bareiss, Math. Comp. 22, 1968): every division has no remainder.

use super::hurwitz::Integers;
use num_bigint::{BigInt, Sign};

/// Equations after elimination: in the row of each pivot d x_pivot + Σ c x_free = 0, a column of right sides among the free ones if there is one.
pub(super) struct Elimination {
    /// The rows of the pivots, in their order.
    pub rows: Integers,
    /// The rows without a pivot: zero in every column that a pivot was looked for in.
    pub rest: Integers,
    /// Columns of the pivots.
    pub pivots: Vec<usize>,
    /// d, not zero.
    pub determinant: BigInt,
}

impl Elimination {
    /// Of `rows`, with pivots in the columns of `order` as far as they go, in it.
    pub fn of(mut rows: Integers, order: impl IntoIterator<Item = usize>) -> Self {
        let mut pivots = Vec::new();
        let mut determinant = BigInt::from(1);
        for column in order {
            let rank = pivots.len();
            let Some(found) = (rank..rows.len()).find(|&i| rows[i][column].sign() != Sign::NoSign) else { continue };
            rows.swap(rank, found);
            let pivot_row = rows[rank].clone();
            let pivot = pivot_row[column].clone();
            for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != rank) {
                let factor = row[column].clone();
                for (entry, of_pivot) in row.iter_mut().zip(&pivot_row) {
                    *entry = (&*entry * &pivot - &factor * of_pivot) / &determinant;
                }
            }
            determinant = pivot;
            pivots.push(column);
        }
        let rest = rows.split_off(pivots.len());
        Self { rows, rest, pivots, determinant }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn integers(rows: &[&[i64]]) -> Integers {
        rows.iter().map(|row| row.iter().map(|&x| BigInt::from(x)).collect()).collect()
    }

    #[test]
    fn two_equations_and_one_that_follows() {
        // x + 2y = 5, 3x + 4y = 6, and their sum
        let of = Elimination::of(integers(&[&[1, 2, 5], &[3, 4, 6], &[4, 6, 11]]), [0, 1]);
        assert_eq!((of.pivots, of.determinant), (vec![0, 1], BigInt::from(-2)));
        assert_eq!(of.rows, integers(&[&[-2, 0, 8], &[0, -2, -9]]));
        assert_eq!(of.rest, integers(&[&[0, 0, 0]]));
    }

    #[test]
    fn no_equations() {
        let of = Elimination::of(Vec::new(), [0]);
        assert_eq!((of.rows.len(), of.pivots.len(), of.determinant), (0, 0, BigInt::from(1)));
    }
}
