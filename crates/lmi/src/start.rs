//! The infeasible starting point x = 0, S = η D⁻², Z = ξ D², with D diagonal for each block.
//!
//! D balances the block: the largest absolute entries of D C D and all D Fᵢ D are about 1 in every row (Ruiz's iteration). For the balanced
//! block S and Z are multiples of the identity (D = I where the problem was balanced before), after Tütüncü, Toh and Todd (Math. Program. 95, 2003). Since the
//! search direction does not depend on D, this is all the balancing that the iteration needs.

use crate::block::{Block, Program};

/// Rounds of balancing.
const ROUNDS: usize = 8;

/// The diagonals of S and Z for every block.
pub(crate) fn start(program: &Program, objective: &[f64]) -> Vec<(Vec<f64>, Vec<f64>)> {
    program.blocks.iter().map(|block| block_start(block, objective, program)).collect()
}

fn block_start(block: &Block, objective: &[f64], program: &Program) -> (Vec<f64>, Vec<f64>) {
    let n = block.size();
    let d = if program.balanced { vec![1.0; n] } else { balance(block) };
    let mut norms = vec![0.0; objective.len()];
    block.norms(&d, &mut norms);
    norms.iter_mut().zip(&program.scale).for_each(|(norm, s)| *norm *= s);
    let size = n as f64;
    let constant = scaled_norm(block, &d);
    let largest = norms.iter().copied().fold(constant, f64::max);
    let ratio = norms
        .iter()
        .zip(objective)
        .filter(|(norm, _)| **norm > 0.0)
        .map(|(norm, c)| (1.0 + c.abs()) / (1.0 + norm))
        .fold(0.0, f64::max);
    let eta = size.sqrt().max(10.0).max(largest);
    let xi = size.sqrt().max(10.0).max(size.sqrt() * ratio);
    (d.iter().map(|d| eta / (d * d)).collect(), d.iter().map(|d| xi * d * d).collect())
}

/// The diagonal of D.
fn balance(block: &Block) -> Vec<f64> {
    let n = block.size();
    let mut magnitudes = vec![0.0_f64; block.constant().len()];
    block.entries(&mut |i, j, _, value| {
        for at in if block.is_diagonal() { [i, i] } else { [i + j * n, j + i * n] } {
            magnitudes[at] = magnitudes[at].max(value.abs());
        }
    });
    let mut d = vec![1.0; n];
    if block.is_diagonal() {
        for (d, m) in d.iter_mut().zip(&magnitudes) {
            if *m > 0.0 {
                *d = clamp(1.0 / m.sqrt());
            }
        }
        return d;
    }
    for _ in 0..ROUNDS {
        let largest: Vec<f64> =
            (0..n).map(|i| (0..n).map(|j| magnitudes[j + i * n] * d[i] * d[j]).fold(0.0, f64::max)).collect();
        for (d, largest) in d.iter_mut().zip(largest) {
            if largest > 0.0 {
                *d = clamp(*d / largest.sqrt());
            }
        }
    }
    d
}

/// Within what can be squared and multiplied without overflow.
fn clamp(d: f64) -> f64 {
    d.clamp(1e-30, 1e30)
}

/// ‖D C D‖_F.
fn scaled_norm(block: &Block, d: &[f64]) -> f64 {
    let n = block.size();
    let square: f64 = if block.is_diagonal() {
        block.constant().iter().zip(d).map(|(c, d)| (c * d * d).powi(2)).sum()
    } else {
        block.constant().iter().enumerate().map(|(at, c)| (c * d[at % n] * d[at / n]).powi(2)).sum()
    };
    square.sqrt()
}
