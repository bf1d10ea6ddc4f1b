//! Actual costs in continuous time: the values of thesis Tables 4.1 and 5.1 as they are right, and the least cost of all.

use lpv::math::Mat;
use lpv::math::matrix::{diagonal, identity, quadratic_form};
use lpv::math::riccati;
use lpv::model::linearize;
use lpv::plant::{DoubleIntegrator, Linear, LinearParameters, Pendulum};
use lpv::sim::{AdaptiveOptions, ContinuousFlight, fly_continuously, optimal_trajectory};
use std::f64::consts::PI;

fn row(k: &Mat<f64>, x: &[f64]) -> f64 {
    x.iter().enumerate().map(|(j, x)| k[(0, j)] * x).sum()
}

fn saturated_cost(k: [f64; 2], duration_s: f64) -> ContinuousFlight {
    let plant = DoubleIntegrator::default();
    let law = move |x: &[f64], u: &mut [f64]| u[0] = -(k[0] * x[0] + k[1] * x[1]).clamp(-1.0, 1.0);
    let weights = (&identity(2), &diagonal(&[0.001]));
    fly_continuously(&plant, weights, &[0.0, 2.0], duration_s, &law, &AdaptiveOptions::default()).unwrap()
}

/// For a linear plant the cost of the regulator is xᵀPx in closed form.
#[test]
fn regulator_costs_what_the_riccati_equation_says() {
    let parameters = LinearParameters {
        a: vec![vec![0.0, 1.0, 0.0], vec![0.5, -0.1, 1.0], vec![0.0, 0.3, 0.2]],
        b: vec![vec![0.0], vec![0.0], vec![1.0]],
        c: None,
    };
    let plant = Linear::new(&parameters).unwrap();
    let model = linearize(&plant, 0.0);
    let (q, r, x0) = (identity(3), diagonal(&[0.5]), [1.0, -2.0, 0.3]);
    let regulator = riccati::solve(&model.a, &model.b, &q, &r).unwrap();
    let law = |x: &[f64], u: &mut [f64]| u[0] = -row(&regulator.k, x);
    let flight = fly_continuously(&plant, (&q, &r), &x0, 60.0, &law, &AdaptiveOptions::default()).unwrap();
    let exact = quadratic_form(&regulator.p, &x0);
    assert!((flight.actual_cost / exact - 1.0).abs() < 1e-10, "{} is not {exact}", flight.actual_cost);
    // and nothing is cheaper
    let optimal = optimal_trajectory(&plant, (&q, &r), &x0, 20.0).unwrap();
    assert!((optimal.cost / exact - 1.0).abs() < 1e-9, "{} is not {exact}", optimal.cost);
}

/// Table 5.1, row LQR, with the exact gain; the thesis printed 12.9183.
#[test]
fn saturated_regulator_on_the_double_integrator() {
    let root = 1000f64.sqrt();
    let flight = saturated_cost([root, (1000.0 + 2.0 * root).sqrt()], 60.0);
    assert!((flight.actual_cost - 12.9242).abs() < 5e-5, "{}", flight.actual_cost);
    assert!(flight.cost_change < 1e-7, "not converged: {}", flight.cost_change);
    assert!(flight.rejected_steps > 0, "the kinks were not noticed");
}

/// Theorem 4.5 on the pendulum: Riccati gain at ρ(x). The thesis printed 55.7392, below the least cost of all.
#[test]
fn no_controller_beats_the_optimum_of_the_pendulum() {
    let plant = Pendulum::default();
    let weights = (&diagonal(&[4.0, 4.0]), &identity(1));
    let x0 = [PI, 0.0];
    let optimal = optimal_trajectory(&plant, weights, &x0, 9.0).unwrap();
    assert!((optimal.cost - 55.89497).abs() < 5e-6, "{}", optimal.cost);
    // twice the distance from the origin at the end changes the seventh digit at most
    let shorter = optimal_trajectory(&plant, weights, &x0, 8.0).unwrap();
    assert!((optimal.cost - shorter.cost).abs() < 1e-6);

    let b = linearize(&plant, 0.0).b;
    let law = |x: &[f64], u: &mut [f64]| {
        let rho = if x[0].abs() < 1e-8 { 1.0 } else { x[0].sin() / x[0] };
        let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [rho, -0.1]][i][j]);
        u[0] = -row(&riccati::solve(&a, &b, weights.0, weights.1).unwrap().k, x);
    };
    let options = AdaptiveOptions { longest_step_s: 0.1, ..AdaptiveOptions::default() };
    let flight = fly_continuously(&plant, weights, &x0, 30.0, &law, &options).unwrap();
    assert!((flight.actual_cost - 56.026).abs() < 5e-4, "{}", flight.actual_cost);
    assert!(flight.cost_change < 1e-7 && flight.actual_cost > optimal.cost);
}
