//! Every bound against points that are there.

use super::*;
use crate::Options;
use crate::sdpa::{BlockShape, Coefficient, Sdp, Stated};

/// A stream of integers in −size, …, size.
fn integers(mut seed: u64) -> impl FnMut(i64) -> i64 {
    move |size| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as i64 % (2 * size + 1) - size
    }
}

/// G = F(x) is any positive semidefinite matrix of integers at an x of any size, so that every bound can be compared with the x that is there.
#[test]
fn bounds_hold_at_feasible_points() {
    let (mut bounded, mut all) = (0, 0);
    for seed in 0..300 {
        let mut next = integers(seed);
        let n = 1 + (seed % 5) as usize;
        let unknowns = 1 + (seed / 5 % 6) as usize;
        let size = [1, 10, 100_000][(seed % 3) as usize];
        let x: Vec<i64> = (0..unknowns).map(|_| next(size)).collect();
        let sparse = seed % 2 == 0;
        let diagonal = seed % 7 == 0;
        let mut definite = |rank: usize| -> Vec<i64> {
            let l: Vec<i64> = (0..n * n).map(|_| if diagonal { 0 } else { next(3) }).collect();
            let sum = |i: usize, j: usize| (0..rank).map(|k| l[i + k * n] * l[j + k * n]).sum::<i64>();
            (0..n * n).map(|at| sum(at % n, at / n) + i64::from(at % n == at / n && rank == n)).collect()
        };
        // On the boundary as well as inside.
        let (g, z) = (definite(if seed % 4 == 0 { 1 } else { n }), definite(n));
        let mut coefficients = Vec::new();
        let mut constant = g.clone();
        for (unknown, &value) in x.iter().enumerate() {
            for column in 0..n {
                for row in if diagonal { column..column + 1 } else { 0..column + 1 } {
                    let entry = if sparse && next(2) != 0 { 0 } else { next(4) };
                    let places = if row == column { 1 } else { 2 };
                    let at = [row + column * n, column + row * n];
                    at[..places].iter().for_each(|&at| constant[at] -= value * entry);
                    coefficients.push(Coefficient {
                        unknown: Some(unknown),
                        block: 0,
                        row,
                        column,
                        value: entry as f64,
                    });
                }
            }
        }
        for column in 0..n {
            for row in if diagonal { column..column + 1 } else { 0..column + 1 } {
                let value = -(constant[row + column * n] as f64);
                coefficients.push(Coefficient { unknown: None, block: 0, row, column, value });
            }
        }
        let blocks = vec![if diagonal { BlockShape::Diagonal(n) } else { BlockShape::Symmetric(n) }];
        let sdp = Sdp { objective: vec![0.0; unknowns], blocks, coefficients };
        let options = Options::default();
        let entries = Entries::new(&Stated { sdp: &sdp, options: &options }, &[n], &[0.0], unknowns);
        let multiplier = Multiplier::new(&Mat::from_fn(n, n, |i, j| z[i + j * n] as f64)).unwrap();
        let tau = (0..n * n).map(|at| g[at] * z[at]).sum::<i64>() as f64;
        for about in [1e-6, 1.0, tau.max(1e-3), 1e6] {
            let Reach { a, b } = entries.reach(std::slice::from_ref(&multiplier), about);
            for (k, &x) in x.iter().enumerate() {
                let bound = a[k] + product(b[k], tau);
                assert!(bound >= (x as f64).abs(), "seed {seed}, {about:e}: |{x}| > {} + {} · {tau}", a[k], b[k]);
                all += 1;
                bounded += usize::from(a[k].is_finite());
            }
        }
    }
    assert!(3 * bounded > all, "{bounded} of {all}");
}
