//! Designs for a parameter that moves: published ranges, and the decrease of the Lyapunov function along random motions.

use crate::quadrotor::{limits, plant, spec, weights};
use lpv::controller::InputLimits;
use lpv::math::matrix::quadratic_form;
use lpv::model::linearize;
use lpv::synthesis::{Design, DesignRequest, Method, RateBoundedOptions, design};

/// The quadrotor's design for yaw rates up to `rate`, with the largest region along r_x.
fn designed(method: Method, limits: InputLimits, rate: f64) -> Design {
    let mut direction = vec![0.0; 12];
    direction[3] = 1.0;
    let request = DesignRequest {
        name: "moving".into(),
        method,
        weights: weights(),
        grid_points: 32,
        schedule: Default::default(),
        limits,
        sample_time_s: 0.002,
        rate_bounded: Some(RateBoundedOptions { rate, order: 2, direction: Some(direction) }),
    };
    design(&spec(9.807), &*plant(), &request, &|_| {}).unwrap()
}

/// Largest x'P(ρ)x of a unit step in r_x over all yaws.
fn step_bound(design: &Design) -> f64 {
    design.points.iter().map(|point| point.p[(3, 3)]).fold(0.0, f64::max)
}

/// The bound of a step of 1 m: 2.1356 of the frozen design, and hardly more at ±4 rad/s.
#[test]
fn designing_for_the_rate_costs_almost_nothing() {
    let bound = step_bound(&designed(Method::Lpvqr, InputLimits::none(4), 4.0));
    assert!((2.1356..2.1534).contains(&bound), "{bound}");
}

/// Certified range along r_x at ±2 rad/s: 0.6671 m for γ = 1 by an independent computation in coordinates that rotate with
/// the vehicle.
#[test]
fn certified_range_of_a_saturated_design() {
    let design = designed(Method::Slpvqr { gamma: 1.0 }, limits(), 2.0);
    let range = (1.0 / step_bound(&design)).sqrt();
    assert!((0.97 * 0.6671..0.6726).contains(&range), "{range}");
}

/// V̇ ≤ −x'Qx − u'Ru between the grid points, and |kᵢx| ≤ σᵢ on the set, for random yaws, rates in the interval and states.
#[test]
fn decrease_along_random_motions() {
    let (design, plant, weights) = (designed(Method::Slpvqr { gamma: 1.0 }, limits(), 2.0), plant(), weights());
    let bounded = design.rate_bounded.as_ref().unwrap();
    // a linear congruential generator is random enough for directions
    let mut state = 1_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    };
    for _ in 0..2000 {
        let (rho, rate) = (3.2 * uniform(), uniform());
        let model = linearize(&*plant, rho);
        let (p, p_rate) = (bounded.p(rho).unwrap(), bounded.p_rate(rho).unwrap());
        let k = design.controller.schedule.gain_matrix(rho);
        let flow = &p * (&model.a - &model.b * &k);
        let decrease = &flow + flow.transpose() + rate * &p_rate + &weights.q + k.transpose() * &weights.r * &k;
        let mut x: Vec<f64> = (0..12).map(|_| uniform()).collect();
        assert!(quadratic_form(&decrease, &x) < 0.0, "yaw {rho}, rate {rate}, {x:?}");
        let scale = (1.0 / quadratic_form(&p, &x)).sqrt();
        x.iter_mut().for_each(|value| *value *= scale);
        for i in 0..4 {
            let input: f64 = (0..12).map(|j| k[(i, j)] * x[j]).sum();
            assert!(input.abs() <= 4.9035, "yaw {rho}, input {i}: {input}");
        }
    }
}
