//! Proved bounds against exact integer arithmetic.

use super::*;

struct Numbers(u64);

impl Numbers {
    /// An integer from −most to most.
    fn next(&mut self, most: i64) -> i64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as i64 % (2 * most + 1) - most
    }
}

/// Sylvester's criterion in exact integers: the leading minors by Bareiss's elimination without fractions.
fn positive_definite(mut a: Vec<Vec<i128>>) -> bool {
    let n = a.len();
    let mut last = 1;
    for k in 0..n {
        if a[k][k] <= 0 {
            return false;
        }
        for i in k + 1..n {
            for j in k + 1..n {
                a[i][j] = (a[i][j] * a[k][k] - a[i][k] * a[k][j]) / last;
            }
        }
        last = a[k][k];
    }
    true
}

fn bound(a: &Mat<f64>) -> f64 {
    Enclosure::of_matrix(a).smallest_eigenvalue_bound(&Spectrum::of(a))
}

/// The bound holds, is sharp to rounding, and is positive exactly for positive definite matrices.
#[test]
fn bounds_hold_in_exact_arithmetic() {
    let (mut numbers, mut definite) = (Numbers(7), 0);
    for round in 0..3000 {
        let n = 1 + round % 4;
        let mut a = vec![vec![0_i64; n]; n];
        for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let entry = numbers.next(5) + if i == j { 4 } else { 0 };
            (a[i][j], a[j][i]) = (entry, entry);
        }
        let matrix = Mat::from_fn(n, n, |i, j| a[i][j] as f64);
        let found = bound(&matrix);
        // 2¹⁴ A − ⌊2¹⁴ bound⌋ I.
        let grid = 14;
        let floor = (found * f64::from(1 << grid)).floor() as i128 - 1;
        let shifted = |shift: i128| {
            let entry = |i: usize, j: usize| (i128::from(a[i][j]) << grid) - if i == j { shift } else { 0 };
            (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect::<Vec<Vec<i128>>>()
        };
        assert!(positive_definite(shifted(floor)), "{a:?}: {found}");
        assert!(!positive_definite(shifted(floor + 4)), "{a:?}: {found} is not sharp");
        let exact = positive_definite(shifted(0));
        assert_eq!(found > 0.0, exact, "{a:?}: {found}");
        definite += usize::from(exact);
    }
    assert!(definite > 300);
}

/// Matrices that `f64` cannot tell from singular ones.
#[test]
fn nearly_singular_matrices_are_proved_definite_and_singular_ones_are_not() {
    let e = 2.0_f64.powi(52);
    // Determinant 2⁵², trace 2⁵³ + 1: the smallest eigenvalue is just below 1/2.
    let near = Mat::from_fn(2, 2, |i, j| {
        if (i, j) == (0, 0) {
            e + 1.0
        } else if i == j {
            e
        } else {
            -e
        }
    });
    let found = bound(&near);
    assert!(found > 0.45 && found < 0.5, "{found}");
    let singular = Mat::from_fn(2, 2, |i, j| if i == j { e } else { -e });
    assert!(bound(&singular) <= 0.0);
    let mut numbers = Numbers(3);
    for n in 2..8 {
        let v: Vec<i64> = (0..n).map(|_| numbers.next(50)).collect();
        let w: Vec<i64> = (0..n).map(|_| numbers.next(50)).collect();
        let gram = Mat::from_fn(n, n, |i, j| (v[i] * v[j] + if n > 2 { w[i] * w[j] } else { 0 }) as f64);
        assert!(bound(&gram) <= 0.0, "a matrix of lower rank was called definite");
    }
}

/// Scales far apart do not hide a small eigenvalue.
#[test]
fn bounds_survive_bad_scaling() {
    let d = [1e-9, 1.0, 1e9];
    let a = Mat::from_fn(3, 3, |i, j| d[i] * d[j] * if i == j { 2.0 } else { 1.0 });
    let found = bound(&a);
    assert!(found > 5e-19 && found < 2e-18, "{found}");
}

/// An expression evaluated at rounded unknowns, against the same in integers.
#[test]
fn enclosures_contain_the_exact_value() {
    let mut problem = crate::Problem::new();
    let x = problem.symmetric("X", 2);
    let a = Mat::from_fn(2, 2, |i, j| [[3.0, 2.0_f64.powi(40)], [1.0, -5.0]][i][j]);
    let f = &a * &x + (&a * &x).t() - Expr::identity(2);
    let value = Mat::from_fn(2, 2, |i, j| [[2.0_f64.powi(30) + 1.0, 7.0], [7.0, 2.0_f64.powi(20) + 1.0]][i][j]);
    let sum = Enclosure::of_expression(&f, &|_| &value);
    let (a, x) = ([[3_i128, 1 << 40], [1, -5]], [[(1_i128 << 30) + 1, 7], [7, (1 << 20) + 1]]);
    for i in 0..2 {
        for j in 0..2 {
            let product = |i: usize, j: usize| a[i][0] * x[0][j] + a[i][1] * x[1][j];
            let exact = product(i, j) + product(j, i) - i128::from(i == j);
            assert_eq!(sum.high[i + 2 * j] as i128 + sum.low[i + 2 * j] as i128, exact);
        }
    }
}
