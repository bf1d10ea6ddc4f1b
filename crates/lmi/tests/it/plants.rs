//! Plants and weights that several tests share.

use lmi::Mat;

/// A matrix from its rows.
pub fn matrix<const R: usize, const C: usize>(rows: [[f64; C]; R]) -> Mat<f64> {
    Mat::from_fn(R, C, |i, j| rows[i][j])
}

/// A diagonal matrix.
pub fn diagonal(entries: &[f64]) -> Mat<f64> {
    Mat::from_fn(entries.len(), entries.len(), |i, j| if i == j { entries[i] } else { 0.0 })
}

/// ẋ = Ax + Bu with the weights of ∫ xᵀQx + uᵀRu dt, inverted.
pub struct Plant {
    pub a: Mat<f64>,
    pub b: Mat<f64>,
    pub q_inverse: Mat<f64>,
    pub r_inverse: Mat<f64>,
}

/// The linearised quadrotor at hover and a yaw angle, state [v, r, p q r, φ θ ψ], four rotor forces, in SI units.
pub fn quadrotor(yaw_rad: f64) -> Plant {
    const G: f64 = 9.807;
    const MASS: f64 = 2.0;
    const INERTIA: [f64; 3] = [1.25, 1.25, 2.5];
    const ARM: f64 = 0.3;
    const DRAG: f64 = 0.075;
    let (sin, cos) = yaw_rad.sin_cos();
    let mut a = Mat::zeros(12, 12);
    a[(0, 10)] = G;
    a[(1, 9)] = -G;
    (a[(3, 0)], a[(4, 1)], a[(5, 2)]) = (1.0, 1.0, 1.0);
    (a[(9, 6)], a[(9, 7)]) = (cos, -sin);
    (a[(10, 6)], a[(10, 7)]) = (sin, cos);
    a[(11, 8)] = 1.0;
    let mut b = Mat::zeros(12, 4);
    for rotor in 0..4 {
        b[(2, rotor)] = 1.0 / MASS;
        b[(8, rotor)] = if rotor % 2 == 0 { DRAG } else { -DRAG } / INERTIA[2];
    }
    (b[(6, 1)], b[(6, 3)]) = (ARM / INERTIA[0], -ARM / INERTIA[0]);
    (b[(7, 2)], b[(7, 0)]) = (ARM / INERTIA[1], -ARM / INERTIA[1]);
    let q = [1.0, 1.0, 100.0, 1.0, 1.0, 50.0, 50.0, 50.0, 50.0, 1.0, 1.0, 100.0];
    Plant { a, b, q_inverse: diagonal(&q.map(|q| 1.0 / q)), r_inverse: diagonal(&[1000.0; 4]) }
}
