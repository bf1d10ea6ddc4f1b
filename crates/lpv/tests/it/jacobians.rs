//! Jacobians from dual numbers: against the thesis's printed (corrected) ones and against central differences.

use crate::quadrotor::plant;
use lpv::plant::{LinearParameters, Plant, PlantSpec};
use proptest::prelude::*;

/// (3.28), (6.12) with Ā₁ … Ā₄, in the corrected version: Ā₂'s entry (2,3) is p(I_z − I_x)/I_y and its third row
/// [q(I_x − I_y)/I_z, p(I_x − I_y)/I_z, 0]; Ā₃'s entry (2,3) is 0 and Ā₄ is separate from it.
fn thesis_state_jacobian(x: &[f64], force: f64) -> [[f64; 12]; 12] {
    let (m, ix, iy, iz) = (2.0, 1.25, 1.25, 2.5);
    let (p, q, r) = (x[6], x[7], x[8]);
    let ((s_phi, c_phi), (s_theta, c_theta), (s_psi, c_psi)) = (x[9].sin_cos(), x[10].sin_cos(), x[11].sin_cos());
    let t_theta = s_theta / c_theta;
    let a = force / m;
    let a1 = [
        [0.0, c_theta * a, 0.0],
        [-c_phi * c_theta * a, s_phi * s_theta * a, 0.0],
        [-s_phi * c_theta * a, -c_phi * s_theta * a, 0.0],
    ];
    let a2 = [
        [0.0, r * (iy - iz) / ix, q * (iy - iz) / ix],
        [r * (iz - ix) / iy, 0.0, p * (iz - ix) / iy],
        [q * (ix - iy) / iz, p * (ix - iy) / iz, 0.0],
    ];
    let a3 = [[c_psi / c_theta, -s_psi / c_theta, 0.0], [s_psi, c_psi, 0.0], [-c_psi * t_theta, s_psi * t_theta, 1.0]];
    let a4 = [
        [0.0, (p * c_psi - q * s_psi) * t_theta / c_theta, -(p * s_psi + q * c_psi) / c_theta],
        [0.0, 0.0, p * c_psi - q * s_psi],
        [0.0, (q * s_psi - p * c_psi) / c_theta.powi(2), (p * s_psi + q * c_psi) * t_theta],
    ];
    let mut jacobian = [[0.0; 12]; 12];
    for i in 0..3 {
        jacobian[3 + i][i] = 1.0;
        for j in 0..3 {
            jacobian[i][9 + j] = a1[i][j];
            jacobian[6 + i][6 + j] = a2[i][j];
            jacobian[9 + i][6 + j] = a3[i][j];
            jacobian[9 + i][9 + j] = a4[i][j];
        }
    }
    jacobian
}

/// (3.29), (6.13)
fn thesis_input_jacobian(x: &[f64]) -> [[f64; 4]; 12] {
    let (m, ix, iy, iz, l, d) = (2.0, 1.25, 1.25, 2.5, 0.3, 0.075);
    let ((s_phi, c_phi), (s_theta, c_theta)) = (x[9].sin_cos(), x[10].sin_cos());
    let mut jacobian = [[0.0; 4]; 12];
    jacobian[0] = [s_theta / m; 4];
    jacobian[1] = [-s_phi * c_theta / m; 4];
    jacobian[2] = [c_phi * c_theta / m; 4];
    jacobian[6] = [0.0, l / ix, 0.0, -l / ix];
    jacobian[7] = [-l / iy, 0.0, l / iy, 0.0];
    jacobian[8] = [d / iz, -d / iz, d / iz, -d / iz];
    jacobian
}

fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    for (k, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).abs() <= tolerance * (1.0 + e.abs()), "{what}, entry {k}: {f} is not {e}");
    }
}

proptest! {
    #[test]
    fn quadrotor_jacobians_are_the_corrected_thesis_ones(
        x in proptest::collection::vec(-1.2..1.2f64, 12),
        u in proptest::collection::vec(0.0..10.0f64, 4),
        w in proptest::collection::vec(-1.0..1.0f64, 4),
    ) {
        let plant = plant();
        let force: f64 = u.iter().chain(&w).sum();
        let (mut a, mut b, mut l) = (vec![0.0; 144], vec![0.0; 48], vec![0.0; 48]);
        plant.dynamics_by_state(&x, &u, &w, &mut a);
        plant.dynamics_by_input(&x, &u, &w, &mut b);
        plant.dynamics_by_disturbance(&x, &u, &w, &mut l);
        assert_close(&a, thesis_state_jacobian(&x, force).as_flattened(), 1e-14, "A (6.12)");
        assert_close(&b, thesis_input_jacobian(&x).as_flattened(), 1e-15, "B (3.29)");
        assert_close(&l, thesis_input_jacobian(&x).as_flattened(), 1e-15, "L (6.13)");
    }

    #[test]
    fn jacobians_of_every_plant_match_central_differences(
        x in proptest::collection::vec(-1.0..1.0f64, 12),
        u in proptest::collection::vec(-2.0..8.0f64, 4),
    ) {
        let linear = LinearParameters { a: vec![vec![0.0, 1.0], vec![-2.0, 0.3]], b: vec![vec![0.0], vec![1.5]], c: None };
        let specs = [PlantSpec::Quadrotor(Default::default()), PlantSpec::Pendulum {}, PlantSpec::DoubleIntegrator {}, PlantSpec::Linear(linear)];
        for spec in specs {
            differences(&*spec.build().unwrap(), &x, &u);
        }
    }
}

/// Step h = 6e-6: the truncation error h² and the rounding error ε/h are both below 1e-10 for these smooth functions.
fn differences(plant: &dyn Plant, x: &[f64], u: &[f64]) {
    let description = plant.description();
    let (n, m, ny) = (description.states.len(), description.inputs.len(), description.outputs.len());
    let (x, u) = (&x[..n], &u[..m]);
    let (w, v) = (vec![0.0; description.disturbances.len()], vec![0.0; ny]);
    let h = 6e-6;
    let mut jacobian = vec![0.0; n * n];
    plant.dynamics_by_state(x, u, &w, &mut jacobian);
    let column = |j: usize, f: &dyn Fn(&[f64], &mut [f64]), point: &[f64], rows: usize| {
        let side = |sign: f64| {
            let (mut moved, mut value) = (point.to_vec(), vec![0.0; rows]);
            moved[j] += sign * h;
            f(&moved, &mut value);
            value
        };
        side(1.0).iter().zip(side(-1.0)).map(|(a, b)| (a - b) / (2.0 * h)).collect::<Vec<f64>>()
    };
    for j in 0..n {
        let expected = column(j, &|x, dx| plant.dynamics(x, u, &w, dx), x, n);
        let found: Vec<f64> = (0..n).map(|i| jacobian[i * n + j]).collect();
        assert_close(&found, &expected, 1e-8, &description.name);
    }
    let mut jacobian = vec![0.0; n * m];
    plant.dynamics_by_input(x, u, &w, &mut jacobian);
    for j in 0..m {
        let expected = column(j, &|u, dx| plant.dynamics(x, u, &w, dx), u, n);
        let found: Vec<f64> = (0..n).map(|i| jacobian[i * m + j]).collect();
        assert_close(&found, &expected, 1e-8, &description.name);
    }
    let mut jacobian = vec![0.0; ny * n];
    plant.measurement_by_state(x, &v, &mut jacobian);
    for j in 0..n {
        let expected = column(j, &|x, y| plant.measurement(x, &v, y), x, ny);
        let found: Vec<f64> = (0..ny).map(|i| jacobian[i * n + j]).collect();
        assert_close(&found, &expected, 1e-8, &description.name);
    }
}

/// (6.14)-(6.15): position and attitude are measured, each with its own noise.
#[test]
fn measurement_jacobians_select_position_and_attitude() {
    let plant = plant();
    let (mut c, mut m) = (vec![0.0; 72], vec![0.0; 36]);
    plant.measurement_by_state(&[0.1; 12], &[0.0; 6], &mut c);
    plant.measurement_by_noise(&[0.1; 12], &[0.0; 6], &mut m);
    for i in 0..6 {
        for j in 0..12 {
            let measured = if i < 3 { 3 + i } else { 6 + i };
            assert_eq!(c[12 * i + j], f64::from(u8::from(j == measured)));
        }
        for j in 0..6 {
            assert_eq!(m[6 * i + j], f64::from(u8::from(i == j)));
        }
    }
}

#[test]
fn every_plant_rests_at_its_operating_point() {
    for spec in [PlantSpec::Quadrotor(Default::default()), PlantSpec::Pendulum {}, PlantSpec::DoubleIntegrator {}] {
        let plant = spec.build().unwrap();
        for rho in [-3.0, 0.0, 0.7] {
            let trim = plant.trim(rho);
            let mut rate = vec![1.0; trim.state.len()];
            plant.dynamics(&trim.state, &trim.input, &vec![0.0; plant.description().disturbances.len()], &mut rate);
            assert!(rate.iter().all(|r| r.abs() < 1e-14), "{} does not rest: {rate:?}", plant.description().name);
        }
    }
}

/// A free rigid body with no thrust keeps its rotational energy, and falls with g.
#[test]
fn free_body_keeps_rotational_energy() {
    let plant = plant();
    let (p, q, r) = (0.7, -0.4, 1.1);
    let mut x = vec![0.0; 12];
    (x[6], x[7], x[8]) = (p, q, r);
    let mut dx = vec![0.0; 12];
    plant.dynamics(&x, &[0.0; 4], &[0.0; 4], &mut dx);
    assert_eq!(dx[2], -9.807);
    let power = 1.25 * p * dx[6] + 1.25 * q * dx[7] + 2.5 * r * dx[8];
    assert!(power.abs() < 1e-15);
}
