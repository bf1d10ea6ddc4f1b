//! The set that ρ̇ lives in, for convex weights ρ.

/// The vertices of {ν ∈ ℝᴺ: Σνᵢ = 0, |νᵢ| ≤ bound} (4.19)-(4.20): half of the νᵢ are `bound` and half −`bound`, and one is
/// zero where N is odd. For N = 1 it is {0}.
pub fn rate_box_vertices(count: usize, bound: f64) -> Vec<Vec<f64>> {
    let half = count / 2;
    let mut vertices = Vec::new();
    let mut signs = vec![0_i8; count];
    extend(&mut signs, 0, half, half, count % 2, bound, &mut vertices);
    vertices
}

/// Fill `signs` from place `at` with so many pluses, minuses and zeros.
fn extend(
    signs: &mut [i8],
    at: usize,
    plus: usize,
    minus: usize,
    zeros: usize,
    bound: f64,
    vertices: &mut Vec<Vec<f64>>,
) {
    if at == signs.len() {
        vertices.push(signs.iter().map(|&sign| f64::from(sign) * bound).collect());
        return;
    }
    for (sign, left) in [(1, plus), (-1, minus), (0, zeros)] {
        if left > 0 {
            signs[at] = sign;
            let less = |kind: i8, count: usize| if kind == sign { count - 1 } else { count };
            extend(signs, at + 1, less(1, plus), less(-1, minus), less(0, zeros), bound, vertices);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_extreme_and_complete() {
        assert_eq!(rate_box_vertices(1, 2.0), [[0.0]]);
        assert_eq!(rate_box_vertices(2, 0.87), [[0.87, -0.87], [-0.87, 0.87]]);
        // N!/((N/2)!)² for even N, N!/(((N − 1)/2)!)² for odd N
        for (count, expected) in [(3, 6), (4, 6), (5, 30), (6, 20)] {
            let vertices = rate_box_vertices(count, 1.0);
            assert_eq!(vertices.len(), expected);
            assert!(vertices.iter().all(|nu| nu.iter().sum::<f64>() == 0.0));
        }
    }
}
