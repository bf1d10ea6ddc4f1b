//! Designs: against the thesis's (corrected) numbers, and by their own inequalities.

use crate::quadrotor::{designed, limits, plant, spec, weights};
use lpv::certificate::{Verdict, check};
use lpv::controller::InputLimits;
use lpv::math::eigen::spectral_abscissa;
use lpv::math::matrix::{diagonal, quadratic_form, trace};
use lpv::math::stabilizability::{Stabilizability, stabilizability};
use lpv::math::{Mat, riccati};
use lpv::model::{PolytopicModel, linearize};
use lpv::plant::PlantSpec;
use lpv::synthesis::{
    CostWeights, Design, DesignRequest, HighGainOptions, Method, ScheduleKind, SynthesisError, design,
    lqr_by_inequality,
};

/// Theorem 2.1: the inequality's optimum is the Riccati solution, Y = P⁻¹.
#[test]
fn riccati_and_inequality_agree() {
    let plant = plant();
    for psi in [-2.0, 0.0, 0.3] {
        let model = linearize(&*plant, psi);
        let regulator = riccati::solve(&model.a, &model.b, &weights().q, &weights().r).unwrap();
        let (y, l, _) = lqr_by_inequality(&model, &weights()).unwrap();
        let identity = &regulator.p * &y;
        // P has a condition number of 1e4, and Y is exact to about 1e-8
        assert!((identity - Mat::<f64>::identity(12, 12)).norm_max() < 1e-3);
        let k = l * &regulator.p;
        assert!((&k - &regulator.k).norm_max() < 1e-3 * regulator.k.norm_max());
    }
}

/// Magnitudes of (6.7), with g = 9.81 as they were made, and the right signs: the printed matrix is the gain at ψ + π.
#[test]
fn lpvqr_gain_is_the_thesis_one_at_every_yaw() {
    let plant_spec = spec(9.81);
    let plant = plant_spec.build().unwrap();
    for schedule in [ScheduleKind::Grid, ScheduleKind::Vertices] {
        let request = DesignRequest {
            name: "lpvqr".into(),
            method: Method::Lpvqr,
            weights: weights(),
            grid_points: 32,
            schedule,
            limits: InputLimits::none(4),
            sample_time_s: 0.002,
            rate_bounded: None,
        };
        let design = design(&plant_spec, &*plant, &request, &|_| {}).unwrap();
        for k in 0..50 {
            let psi = -3.1 + 0.123 * f64::from(k);
            let gain = design.controller.schedule.gain_matrix(psi);
            let (s, c) = psi.sin_cos();
            // row 1 of (6.7) with columns 1, 2, 4, 5, 10, 11 negated
            let row = [
                -47.7494 * c,
                -47.7494 * s,
                158.4679,
                -22.3607 * c,
                -22.3607 * s,
                111.8035,
                0.0,
                -163.1777,
                123.0254,
                390.4586 * s,
                -390.4586 * c,
                158.1147,
            ];
            for (j, expected) in row.into_iter().enumerate() {
                assert!(
                    (gain[(0, j)] - expected).abs() < 1e-4 * 390.4586,
                    "K(1,{}) at {psi}: {} is not {expected}",
                    j + 1,
                    gain[(0, j)]
                );
            }
            // and the Riccati gain at this very yaw
            let model = linearize(&*plant, psi);
            let regulator = riccati::solve(&model.a, &model.b, &weights().q, &weights().r).unwrap();
            assert!((&gain - &regulator.k).norm_max() < 5e-5 * regulator.k.norm_max());
        }
    }
}

/// The thesis's printed K(ψ) destabilises its own model: max Re λ = +3.263; the right one has −0.7071.
#[test]
fn printed_gain_is_unstable_and_ours_is_not() {
    let model = linearize(&*spec(9.81).build().unwrap(), 0.0);
    let regulator = riccati::solve(&model.a, &model.b, &weights().q, &weights().r).unwrap();
    let printed =
        Mat::from_fn(
            4,
            12,
            |i, j| {
                if [0, 1, 3, 4, 9, 10].contains(&j) { -regulator.k[(i, j)] } else { regulator.k[(i, j)] }
            },
        );
    assert!((spectral_abscissa(&(&model.a - &model.b * printed)) - 3.263).abs() < 1e-3);
    let ours = spectral_abscissa(&(&model.a - &model.b * regulator.k));
    assert_eq!((1e4 * ours).round(), -7071.0);
}

/// tr Y of Theorem 5.3 and, with all sixteen mixtures, of Theorem 5.4: by three other solvers to six digits.
#[test]
fn saturated_designs_reach_the_known_optima() {
    for (gamma, trace_y) in [(1.0, 5.472401), (10.0, 5.146219), (20.0, 5.087519)] {
        let low = designed(Method::Slpvqr { gamma }, limits(), 4, ScheduleKind::Grid);
        for point in &low.points {
            assert!((point.trace_y - trace_y).abs() < 2e-6, "γ = {gamma}: tr Y = {}", point.trace_y);
        }
    }
    let high = designed(
        Method::HighGainSlpvqr { gamma: 20.0, high_gain: HighGainOptions::default() },
        limits(),
        4,
        ScheduleKind::Grid,
    );
    for point in &high.points {
        assert!((point.trace_y - 5.087519).abs() < 2e-6, "high gain: tr Y = {}", point.trace_y);
        let largest = point.gain.norm_max();
        assert!((10.0..5000.0).contains(&largest), "the gain of {largest} is not usable");
    }
}

/// Bounds xᵀPx for a 1 m step in x, which are the costs of the linear closed loop: 2.1356 for LPVQR; the certified steps
/// in x alone are 0.65, 1.76, 1.81 m.
#[test]
fn bounds_and_certified_steps() {
    let bound = |design: &Design| design.points[design.points.len() / 2].p[(3, 3)];
    let lpvqr = designed(Method::Lpvqr, InputLimits::none(4), 4, ScheduleKind::Grid);
    assert!((bound(&lpvqr) - 2.1356).abs() < 1e-4);
    for (gamma, step) in [(1.0, 0.65), (10.0, 1.76), (20.0, 1.81)] {
        let design = designed(Method::Slpvqr { gamma }, limits(), 4, ScheduleKind::Grid);
        assert!(((gamma / bound(&design)).sqrt() - step).abs() < 0.005, "γ = {gamma}");
    }
}

/// Every method's design passes the check from the plant alone, and a broken one does not.
#[test]
fn designs_pass_their_check_and_broken_ones_fail() {
    let methods = [
        Method::Lpvqr,
        Method::Slpvqr { gamma: 10.0 },
        Method::HighGainSlpvqr { gamma: 10.0, high_gain: HighGainOptions::default() },
    ];
    let plant = plant();
    for method in methods {
        let mut design = designed(method, limits(), 8, ScheduleKind::Vertices);
        design.validate().unwrap();
        for claim in check(&design, &*plant) {
            assert_eq!(claim.verdict, Verdict::Numerical, "{claim:?}");
            assert!(claim.margin > 0.0);
        }
        // P larger by 1 % cannot satisfy inequalities whose optimum is the smallest P
        for point in &mut design.points {
            point.p = Mat::from_fn(12, 12, |i, j| 0.99 * point.p[(i, j)]);
        }
        // ... which is no witness against the design
        let claims = check(&design, &*plant);
        assert!(claims.iter().any(|claim| claim.verdict == Verdict::Undecided && claim.margin < 0.0), "{method:?}");
        assert!(claims.iter().all(|claim| claim.verdict != Verdict::Refuted), "{method:?}");
    }
}

/// A saved design is the design.
#[test]
fn designs_survive_their_file() {
    let design = designed(Method::Slpvqr { gamma: 1.0 }, limits(), 4, ScheduleKind::Vertices);
    let json = serde_json::to_string(&design).unwrap();
    let read: Design = serde_json::from_str(&json).unwrap();
    assert_eq!(json, serde_json::to_string(&read).unwrap());
    assert_eq!(design.points[1].p, read.points[1].p);
}

/// Section 5.1 of the thesis, double integrator, |u| ≤ 1, x₀ = [0, 2]: bounds of SLQR 5.92367, 39.6808, 59.6849 for
/// γ = 1, 30, 60; gain (5.9) for γ = 1; and (5.6) for the LQR, whose bound is 0.130430.
#[test]
fn double_integrator_bounds() {
    let weights = CostWeights { q: diagonal(&[1.0, 1.0]), r: diagonal(&[0.001]) };
    let request = |method, limits| DesignRequest {
        name: "slqr".into(),
        method,
        weights: weights.clone(),
        grid_points: 1,
        schedule: ScheduleKind::Grid,
        limits,
        sample_time_s: 0.001,
        rate_bounded: None,
    };
    let spec = PlantSpec::DoubleIntegrator {};
    let plant = spec.build().unwrap();
    let unit = InputLimits { min: vec![Some(-1.0)], max: vec![Some(1.0)] };
    let x0 = [0.0, 2.0];
    for (gamma, bound) in [(1.0, 5.92367), (30.0, 39.6808), (60.0, 59.6849)] {
        let design = design(&spec, &*plant, &request(Method::Slpvqr { gamma }, unit.clone()), &|_| {}).unwrap();
        let found = quadratic_form(&design.points[0].p, &x0);
        assert!((found / bound - 1.0).abs() < 2e-5, "γ = {gamma}: {found} is not {bound}");
        if gamma == 1.0 {
            assert!((design.points[0].gain[(0, 0)] - 0.437796).abs() < 2e-5);
            assert!((design.points[0].gain[(0, 1)] - 1.109393).abs() < 2e-5);
        }
    }
    let lqr = design(&spec, &*plant, &request(Method::Lpvqr, InputLimits::none(1)), &|_| {}).unwrap();
    assert!((quadratic_form(&lqr.points[0].p, &x0) - 0.130430).abs() < 1e-6);
}

/// The polytope of yaw is not quadratically stabilisable: its centre (cos, sin) = (0, 0) leaves roll and pitch without
/// input. The frozen models on the circle are.
#[test]
fn centre_of_the_yaw_polytope_has_no_roll_input() {
    let model = PolytopicModel::of_plant(&*plant()).unwrap();
    let centre = Mat::from_fn(12, 12, |i, j| model.a.iter().map(|a| a[(i, j)]).sum::<f64>() / 4.0);
    assert!((0..12).all(|j| centre[(9, j)].abs() < 1e-13) && (0..4).all(|j| model.b[(9, j)] == 0.0));
    // cos and sin are rounded: roll has an input of rounding errors, and to the letter the pair is stabilisable
    let rolled = Mat::from_fn(12, 12, |i, j| if i == 9 { 0.0 } else { centre[(i, j)] });
    assert!(
        matches!(stabilizability(&rolled, &model.b), Stabilizability::Unstabilizable(mode) if mode.states() == [9])
    );
}

#[test]
fn failures_name_their_cause() {
    let spec = spec(9.807);
    let request = |limits: InputLimits| DesignRequest {
        name: "slpvqr".into(),
        method: Method::Slpvqr { gamma: 1.0 },
        weights: weights(),
        grid_points: 4,
        schedule: ScheduleKind::Grid,
        limits,
        sample_time_s: 0.002,
        rate_bounded: None,
    };
    let mut one_free = limits();
    (one_free.min[2], one_free.max[2]) = (None, None);
    let error = design(&spec, &*plant(), &request(one_free), &|_| {}).unwrap_err();
    assert!(matches!(error, SynthesisError::UnlimitedInput { input: 2 }), "{error}");
}

/// Y of a design is smaller the larger the region: tr Y falls with γ.
#[test]
fn trace_falls_with_the_region() {
    let traces: Vec<f64> = [1.0, 3.0, 9.0]
        .into_iter()
        .map(|gamma| designed(Method::Slpvqr { gamma }, limits(), 4, ScheduleKind::Grid).points[0].trace_y)
        .collect();
    assert!(traces[0] > traces[1] && traces[1] > traces[2], "{traces:?}");
    let lpvqr = designed(Method::Lpvqr, InputLimits::none(4), 4, ScheduleKind::Grid);
    assert!(lpvqr.points[0].trace_y > traces[0]);
    assert!(trace(&lpvqr.points[0].p) > 0.0);
}
