//! The infeasible starting point x = 0, S = ηI, Z = ξI, after Tütüncü, Toh and Todd (Math. Program. 95, 2003):
//! multiples of the identity that are large against the data of each block.

use crate::block::Block;
use crate::dense::norm;

/// The multiples (η, ξ) for every block.
pub(crate) fn scales(blocks: &[Block], objective: &[f64]) -> Vec<(f64, f64)> {
    let unknowns = objective.len();
    let mut norms = vec![0.0; unknowns];
    blocks
        .iter()
        .map(|block| {
            norms.fill(0.0);
            block.norms(&mut norms);
            let n = block.size() as f64;
            let largest = norms.iter().copied().fold(norm(block.constant()), f64::max);
            let ratio = norms
                .iter()
                .zip(objective)
                .filter(|(norm, _)| **norm > 0.0)
                .map(|(norm, c)| (1.0 + c.abs()) / (1.0 + norm))
                .fold(0.0, f64::max);
            let eta = n.sqrt().max(10.0).max(largest);
            let xi = n.sqrt().max(10.0).max(n.sqrt() * ratio);
            (eta, xi)
        })
        .collect()
}
