//! Shapes of phase planes: ellipsoids and unsaturated strips.

use lpv::math::Mat;
use lpv::math::matrix::inverse_spd;
use std::f64::consts::TAU;

/// The ellipse xᵀPx = level, closed: √level G(cos, sin) with P⁻¹ = GGᵀ, so that the tips of a long one are as dense as its
/// flanks. Empty for a P that is not positive definite.
pub fn ellipse(p: &Mat<f64>, level: f64) -> Vec<[f64; 2]> {
    let Some(y) = inverse_spd(p) else { return Vec::new() };
    let g11 = y[(0, 0)].sqrt();
    let g21 = y[(1, 0)] / g11;
    let g22 = (y[(1, 1)] - g21 * g21).sqrt();
    let size = level.sqrt();
    (0..=240)
        .map(|k| {
            let (s, c) = (TAU * f64::from(k) / 240.0).sin_cos();
            [size * g11 * c, size * (g21 * c + g22 * s)]
        })
        .collect()
}

/// The strip |kx| ≤ σ as an outline that reaches `reach` from the origin.
pub fn strip(k: &Mat<f64>, sigma: f64, reach: f64) -> Vec<[f64; 2]> {
    let norm = k[(0, 0)].hypot(k[(0, 1)]);
    let (normal, along) = ([k[(0, 0)] / norm, k[(0, 1)] / norm], [-k[(0, 1)] / norm, k[(0, 0)] / norm]);
    let half = sigma / norm;
    let corner = |side: f64, end: f64| {
        [side * half * normal[0] + end * reach * along[0], side * half * normal[1] + end * reach * along[1]]
    };
    vec![corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use lpv::math::matrix::{from_rows, quadratic_form};

    #[test]
    fn ellipse_lies_on_its_level() {
        let p = from_rows(&[vec![2.0, 0.3], vec![0.3, 0.01 + 0.045]]);
        for point in ellipse(&p, 7.0) {
            assert!((quadratic_form(&p, &point) - 7.0).abs() < 1e-9);
        }
    }

    #[test]
    fn corners_of_the_strip_saturate() {
        let k = from_rows(&[vec![3.0, -4.0]]);
        for [x, y] in strip(&k, 2.0, 10.0) {
            assert!(((3.0 * x - 4.0 * y).abs() - 2.0).abs() < 1e-12);
        }
    }
}
