//! What is proved stays true under exact arithmetic and random sampling, and what is false is never proved.

use crate::numbers::Numbers;
use crate::quadrotor::{limits, plant, spec, weights};
use lpv::certificate::{
    Claim, ClaimKind, PolytopicClaim, PolytopicLyapunov, ProofOptions, Verdict, lyapunov_matrix, prove, prove_polytopic,
};
use lpv::controller::{InputLimits, Schedule};
use lpv::math::Mat;
use lpv::math::matrix::{diagonal, quadratic_form};
use lpv::model::{MatrixFunction, Polytope, linearize};
use lpv::plant::{LinearParameters, PlantSpec};
use lpv::sim::RungeKutta4;
use lpv::synthesis::polytopic::InputBounds;
use lpv::synthesis::{
    CostWeights, Design, DesignRequest, HighGainOptions, Method, RateBoundedOptions, ScheduleKind, design,
};

/// The claim of this name about the model.
fn claim<'a>(claims: &'a [Claim], name: &str) -> &'a Claim {
    claims.iter().find(|claim| claim.id.to_string() == name).unwrap_or_else(|| panic!("no {name}: {claims:?}"))
}

/// Units in which all numbers of the mutation test are integers.
const UNIT: f64 = 1024.0;

fn integers(matrix: &Mat<f64>) -> [[i128; 2]; 2] {
    [0, 1].map(|i| [0, 1].map(|j| (matrix[(i, j)] * UNIT) as i128))
}

/// Whether −(P(A − bk) + (A − bk)ᵀP) − weight·(Q + kᵀrk) ≻ 0 exactly, in integers over 2³⁰.
fn exactly_decreases(a: &Mat<f64>, p: &Mat<f64>, k: &Mat<f64>, cost: Option<(&Mat<f64>, f64)>) -> bool {
    let unit = UNIT as i128;
    let (a, p) = (integers(a), integers(p));
    let k = [0, 1].map(|j| (k[(0, j)] * UNIT) as i128);
    // b = (0, 1)ᵀ
    let closed = [a[0], [a[1][0] - k[0], a[1][1] - k[1]]];
    let flow = |i: usize, j: usize| (0..2).map(|l| p[i][l] * closed[l][j]).sum::<i128>() * unit;
    let q = cost.map(|(q, r)| (integers(q), (r * UNIT) as i128));
    let n = [0, 1].map(|i| {
        [0, 1].map(|j| {
            let stage = q.map_or(0, |(q, r)| q[i][j] * unit * unit + k[i] * k[j] * r);
            -flow(i, j) - flow(j, i) - stage
        })
    });
    n[0][0] > 0 && n[0][0] * n[1][1] - n[0][1] * n[1][0] > 0
}

fn rounded(matrix: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| (matrix[(i, j)] * UNIT).round() / UNIT)
}

/// Thousands of designs, perturbed from grossly to next to nothing: none is proved that exact arithmetic refutes.
#[test]
fn no_mutation_that_is_false_is_proved() {
    let mut numbers = Numbers(7);
    let (mut proved, mut false_ones) = (0, 0);
    for case in 0..4000 {
        let a = rounded(&Mat::from_fn(2, 2, |_, _| 2.0 * numbers.next()));
        let spec = PlantSpec::Linear(LinearParameters {
            a: (0..2).map(|i| (0..2).map(|j| a[(i, j)]).collect()).collect(),
            b: vec![vec![0.0], vec![1.0]],
            c: None,
        });
        let plant = spec.build().unwrap();
        let size = 2.0_f64.powi(-(case % 10));
        let closed = Mat::from_fn(2, 2, |i, j| if i == j { 1.5 } else { 0.25 * numbers.next() });
        let p = rounded(&Mat::from_fn(2, 2, |i, j| {
            let symmetric = if i <= j { closed[(i, j)] } else { closed[(j, i)] };
            symmetric + if i == j { size * numbers.next().abs() } else { 0.0 }
        }));
        let p = Mat::from_fn(2, 2, |i, j| if i <= j { p[(i, j)] } else { p[(j, i)] });
        let k = rounded(&Mat::from_fn(1, 2, |_, j| a[(1, j)] + 1.0 + j as f64 + 2.0 * size * numbers.next()));
        let weights = CostWeights { q: rounded(&diagonal(&[0.125, 0.25])), r: diagonal(&[0.0625]) };
        let design = Design {
            name: "mutant".into(),
            convention: String::new(),
            plant: spec,
            model_hash: None,
            method: Method::Lpvqr,
            weights: weights.clone(),
            sample_time_s: 0.01,
            controller: lpv::controller::Controller {
                schedule: Schedule::Constant { gain: k.clone() },
                scheduling_state: None,
                limits: InputLimits::none(1),
                operating_input: vec![0.0],
                supervisor: None,
            },
            schedule_error: 0.0,
            back_off: 0.0,
            points: vec![lpv::synthesis::FrozenDesign {
                rho: 0.0,
                gain: k.clone(),
                auxiliary_gain: None,
                trace_y: 0.0,
                p: p.clone(),
                riccati_difference: None,
                iterations: 0,
            }],
            rate_bounded: None,
            inner: Vec::new(),
        };
        let proofs = prove(&design, &*plant, &ProofOptions::default()).unwrap();
        for (name, cost) in [("decrease", None), ("cost", Some((&weights.q, 0.0625)))] {
            let verdict = claim(&proofs.claims, name).verdict;
            let truth = exactly_decreases(&a, &p, &k, cost);
            assert!(truth || verdict != Verdict::Proved, "case {case}: {name} is false and proved");
            assert!(!truth || verdict != Verdict::Refuted, "case {case}: {name} is true and refuted");
            proved += usize::from(verdict == Verdict::Proved);
            false_ones += usize::from(!truth);
        }
    }
    assert!(proved > 500 && false_ones > 500, "{proved} proved, {false_ones} false: the test tests something");
}

/// A bit beyond the edge is refuted, a bit inside proved: ẋ = −x/2 + u with k = 0.5 has 2P(−1) + Q + 0.25 R = 0 at P = 0.75.
#[test]
fn the_edge_is_found() {
    let spec = PlantSpec::Linear(LinearParameters { a: vec![vec![-0.5]], b: vec![vec![1.0]], c: None });
    let plant = spec.build().unwrap();
    let scalar = |value: f64| Mat::from_fn(1, 1, |_, _| value);
    let weights = CostWeights { q: scalar(1.25), r: scalar(1.0) };
    for (p, expected) in
        [(0.75 * (1.0 + 1e-13), Verdict::Proved), (0.75 * (1.0 - 1e-13), Verdict::Refuted), (0.75, Verdict::Undecided)]
    {
        let request = DesignRequest {
            name: "edge".into(),
            method: Method::Lpvqr,
            weights: weights.clone(),
            grid_points: 1,
            schedule: ScheduleKind::Grid,
            limits: InputLimits::none(1),
            sample_time_s: 0.01,
            rate_bounded: None,
        };
        let mut design = design(&spec, &*plant, &request, &|_| {}).unwrap();
        design.points[0].p = scalar(p);
        design.controller.schedule = Schedule::Constant { gain: scalar(0.5) };
        let proofs = prove(&design, &*plant, &ProofOptions::default()).unwrap();
        assert_eq!(claim(&proofs.claims, "cost").verdict, expected, "P = {p}");
    }
}

/// ẋ = x + u with u = −2x held for T: x₊ = (2 − e^T)x, stable up to T = ln 3; and ẋ = u, whose series ends, up to T = 1.
#[test]
fn the_sampled_loop_is_proved_up_to_its_edge() {
    let scalar = |value: f64| Mat::from_fn(1, 1, |_, _| value);
    for (a, edge) in [(1.0, 3.0_f64.ln()), (0.0, 1.0)] {
        let spec = PlantSpec::Linear(LinearParameters { a: vec![vec![a]], b: vec![vec![1.0]], c: None });
        let plant = spec.build().unwrap();
        for (sample_time_s, expected) in
            [(edge * (1.0 - 1e-6), Verdict::Proved), (edge * (1.0 + 1e-6), Verdict::Refuted)]
        {
            let request = DesignRequest {
                name: "sampled".into(),
                method: Method::Lpvqr,
                weights: CostWeights { q: scalar(1.0), r: scalar(1.0) },
                grid_points: 1,
                schedule: ScheduleKind::Grid,
                limits: InputLimits::none(1),
                sample_time_s,
                rate_bounded: None,
            };
            let mut design = design(&spec, &*plant, &request, &|_| {}).unwrap();
            design.controller.schedule = Schedule::Constant { gain: scalar(2.0) };
            let proofs = prove(&design, &*plant, &ProofOptions::default()).unwrap();
            assert_eq!(claim(&proofs.claims, "sampled-stability").verdict, expected, "a = {a}, T = {sample_time_s}");
        }
    }
}

/// Ten thousand scalar polytopes with two vertices: model, Y, L, γ, σ and rates at random, every number a multiple of 1/16. What is
/// proved is true in integers at nine points of the polytope; what is refuted is false at one of them.
#[test]
fn polytopes_are_proved_only_if_integers_agree() {
    let mut numbers = Numbers(5);
    let mut integer = |size: i128| (numbers.next() * size as f64).round() as i128;
    let mut counts = std::collections::BTreeMap::new();
    for case in 0..10_000 {
        let spread = 1 << (case % 6);
        let (y0, l0) = (16 + integer(12), 24 + integer(16));
        let a = [integer(12), integer(12)];
        let b = [16 + integer(4), 16 + integer(4)];
        let y = [y0, (y0 + integer(spread)).max(1)];
        let l = [l0, l0 + integer(spread)];
        let [nu, q, r, sigma, gamma] =
            [integer(spread).abs(), 2 + integer(1), 2 + integer(1), 40 + integer(24), 16 + integer(8)];
        let scalars = |values: [i128; 2]| values.map(|value| Mat::from_fn(1, 1, |_, _| value as f64 / 16.0)).to_vec();
        let rate = nu as f64 / 16.0;
        let request = PolytopicClaim {
            polytope: Polytope::new(scalars(a), scalars(b)).unwrap(),
            lyapunov: PolytopicLyapunov::ParameterDependent {
                y: scalars(y),
                l: scalars(l),
                rate_vertices: vec![vec![rate, -rate], vec![-rate, rate]],
            },
            auxiliary_gain: None,
            weights: Some(CostWeights { q: scalars([q, q])[0].clone(), r: scalars([r, r])[0].clone() }),
            saturation: Some(InputBounds { sigma: vec![sigma as f64 / 16.0], gamma: gamma as f64 / 16.0 }),
        };
        let at = |k: i128, values: [i128; 2]| k * values[0] + (8 - k) * values[1];
        // in units of 1/(8·16)² and of its multiples
        let flow = |k: i128, nu: i128| -2 * (at(k, a) * at(k, y) - at(k, b) * at(k, l)) + 64 * nu * (y[0] - y[1]);
        let everywhere = |holds: &dyn Fn(i128, i128) -> bool| (0..=8).all(|k| [-nu, nu].iter().all(|&nu| holds(k, nu)));
        let decreases = everywhere(&|k, nu| flow(k, nu) > 0);
        let costs = everywhere(&|k, nu| 16 * flow(k, nu) - at(k, y).pow(2) * q - at(k, l).pow(2) * r > 0);
        let unsaturated = everywhere(&|k, _| sigma * sigma * at(k, y) * 8 > gamma * at(k, l).pow(2));
        let claims = prove_polytopic(&request);
        for (name, truth) in [("invariance", decreases), ("unsaturated", unsaturated), ("cost", costs)] {
            let claim = claim(&claims, name);
            // the cost with a factor is another claim
            if matches!(claim.kind, ClaimKind::Cost { factor, .. } if factor != 1.0) {
                continue;
            }
            assert!(truth || claim.verdict != Verdict::Proved, "case {case}: {name} is false and proved");
            assert!(!truth || claim.verdict != Verdict::Refuted, "case {case}: {name} is true and refuted");
            *counts.entry((name, claim.verdict.word())).or_insert(0) += 1;
        }
    }
    for name in ["invariance", "unsaturated", "cost"] {
        let of = |verdict: &str| counts.get(&(name, verdict)).copied().unwrap_or(0);
        assert!(of("refuted") > 100 && of("proved") > 300, "{counts:?}: the test tests something");
    }
}

/// The largest proved rates of the frozen designs, against a computation in coordinates that rotate with the vehicle:
/// 76.1 rad/s and 0.38 rad/s.
#[test]
fn rates_of_the_frozen_designs() {
    let plant = plant();
    for (method, limits, expected) in
        [(Method::Lpvqr, InputLimits::none(4), 76.1), (Method::Slpvqr { gamma: 1.0 }, limits(), 0.38)]
    {
        let design = crate::quadrotor::designed(method, limits, 32, ScheduleKind::Grid);
        let proofs = prove(&design, &*plant, &ProofOptions::default()).unwrap();
        let rate = proofs.stable_up_to.unwrap();
        assert!((0.9 * expected..1.005 * expected).contains(&rate), "{rate} is not {expected}");
        // beyond it there is a motion along which V grows
        let beyond =
            prove(&design, &*plant, &ProofOptions { rate: Some(1.2 * expected), ..ProofOptions::default() }).unwrap();
        let claim = beyond.claims.iter().find(|claim| claim.verdict == Verdict::Refuted).unwrap();
        let witness = claim.witness.as_ref().unwrap();
        assert!(witness.value < 0.0 && witness.state.len() == 12 && witness.rate.abs() > expected);
    }
}

/// SLPVQR with γ = 1, made for yaw rates up to 2 rad/s and for the reach along x.
fn made_for_a_rate() -> Design {
    made_for(Method::Slpvqr { gamma: 1.0 })
}

/// A saturated method, made for yaw rates up to 2 rad/s and for the reach along x.
fn made_for(method: Method) -> Design {
    let mut direction = vec![0.0; 12];
    direction[3] = 1.0;
    let request = DesignRequest {
        name: "proved".into(),
        method,
        weights: weights(),
        grid_points: 32,
        schedule: ScheduleKind::Grid,
        limits: limits(),
        sample_time_s: 0.002,
        rate_bounded: Some(RateBoundedOptions { rate: 2.0, order: 2, direction: Some(direction) }),
    };
    design(&spec(9.807), &*plant(), &request, &|_| {}).unwrap()
}

/// Random states x with xᵀPx at most `level`.
fn inside(numbers: &mut Numbers, p: &Mat<f64>, level: f64) -> Vec<f64> {
    let x: Vec<f64> = (0..12).map(|_| numbers.next()).collect();
    let scale = (level / quadratic_form(p, &x)).sqrt() * numbers.next().abs();
    x.iter().map(|value| scale * value).collect()
}

/// The full circle at ±2 rad/s, and then random yaws, rates and states: V falls by the cost, and the input stays unsaturated
/// in the set.
fn proved_and_sampled(matrices: usize, states: usize) {
    let (plant, design) = (plant(), made_for_a_rate());
    let proofs = prove(&design, &*plant, &ProofOptions::default()).unwrap();
    assert!(proofs.claims.iter().all(|claim| claim.verdict == Verdict::Proved), "{:?}", proofs.claims);
    assert_eq!((proofs.stable_up_to, proofs.cost_up_to, proofs.level), (Some(2.0), Some(2.0), Some(1.0)));
    let range = (1.0 / lyapunov_matrix(&design, &*plant, 0.0).unwrap()[(3, 3)]).sqrt();
    assert!(range > 0.97 * 0.6671, "{range}");

    let y = &design.rate_bounded.as_ref().unwrap().y;
    let mut numbers = Numbers(3);
    for _ in 0..matrices {
        let (rho, rate) = (3.2 * numbers.next(), 2.0 * numbers.next());
        let p = lyapunov_matrix(&design, &*plant, rho).unwrap();
        let p_rate = -1.0 * (&p * (rate * y.derivative(&[rho], 0)) * &p);
        let model = linearize(&*plant, rho);
        let k = design.controller.schedule.gain_matrix(rho);
        let flow = &p * (&model.a - &model.b * &k);
        let stage = &design.weights.q + k.transpose() * &design.weights.r * &k;
        let change = proofs.cost_factor * (&flow + flow.transpose() + &p_rate) + &stage;
        for _ in 0..states {
            let mut x: Vec<f64> = (0..12).map(|_| numbers.next()).collect();
            assert!(quadratic_form(&change, &x) < 0.0, "yaw {rho}, rate {rate}, {x:?}");
            let scale = (1.0 / quadratic_form(&p, &x)).sqrt();
            x.iter_mut().for_each(|value| *value *= scale);
            for i in 0..4 {
                let input: f64 = (0..12).map(|j| k[(i, j)] * x[j]).sum();
                assert!(input.abs() <= 9.807 / 2.0, "yaw {rho}, input {i}: {input}");
            }
        }
    }
}

#[test]
fn a_design_for_a_rate_is_proved_and_samples_agree() {
    proved_and_sampled(1000, 20);
}

#[test]
#[ignore = "a million samples: run it in release"]
fn a_million_samples_agree() {
    proved_and_sampled(20_000, 50);
}

/// Flights of the LPV model with the saturated high gain from the edge of the proved set, the parameter turning to and fro at its largest
/// rate: V falls all the way, and the cost stays below its bound.
fn saturated_flights_stay(flights: usize, duration_s: f64) {
    const STEP_S: f64 = 1e-3;
    let (plant, design) =
        (plant(), made_for(Method::HighGainSlpvqr { gamma: 1.0, high_gain: HighGainOptions::default() }));
    let proofs = prove(&design, &*plant, &ProofOptions::default()).unwrap();
    let (invariant, cost) = (claim(&proofs.claims, "invariance"), claim(&proofs.claims, "cost"));
    assert_eq!((invariant.verdict, cost.verdict), (Verdict::Proved, Verdict::Proved), "{:?}", proofs.claims);
    let (level, rate) = (proofs.level.unwrap(), proofs.stable_up_to.unwrap());
    assert_eq!((level, rate), (1.0, 2.0));
    let operating = &design.controller.operating_input;
    let mut numbers = Numbers(29);
    let mut flights_at_limits = 0;
    for flight in 0..flights {
        let mut rho = 3.2 * numbers.next();
        let p = lyapunov_matrix(&design, &*plant, rho).unwrap();
        let mut x: Vec<f64> = (0..12).map(|_| numbers.next()).collect();
        let scale = (level / quadratic_form(&p, &x)).sqrt();
        x.iter_mut().for_each(|value| *value *= scale);
        x.push(0.0); // the cost
        let (mut before, mut turn_in) = (level, 0.0);
        let mut direction = 1.0;
        let mut integrator = RungeKutta4::new(13);
        let mut saturates = false;
        for _ in 0..(duration_s / STEP_S) as usize {
            turn_in -= STEP_S;
            if turn_in < 0.0 {
                (direction, turn_in) = (-direction, 0.3 * numbers.next().abs());
            }
            let from = rho;
            integrator.step(0.0, STEP_S, &mut x, |t, z, slope| {
                let rho = from + direction * rate * t;
                let model = linearize(&*plant, rho);
                let k = design.controller.schedule.gain_matrix(rho);
                let mut u: Vec<f64> =
                    (0..4).map(|i| operating[i] - (0..12).map(|j| k[(i, j)] * z[j]).sum::<f64>()).collect();
                saturates |= design.controller.limits.saturate(&mut u);
                u.iter_mut().zip(operating).for_each(|(u, trim)| *u -= trim);
                for (i, slope) in slope[..12].iter_mut().enumerate() {
                    *slope = (0..12).map(|j| model.a[(i, j)] * z[j]).sum::<f64>()
                        + (0..4).map(|j| model.b[(i, j)] * u[j]).sum::<f64>();
                }
                slope[12] = quadratic_form(&design.weights.q, &z[..12]) + quadratic_form(&design.weights.r, &u);
            });
            rho += direction * rate * STEP_S;
            let now = quadratic_form(&lyapunov_matrix(&design, &*plant, rho).unwrap(), &x[..12]);
            assert!(now < before, "flight {flight}: V went from {before} to {now} at yaw {rho}");
            before = now;
        }
        assert!(x[12] <= proofs.cost_factor * level, "flight {flight} cost {}", x[12]);
        flights_at_limits += usize::from(saturates);
    }
    // otherwise the limits were not put to the test
    assert!(2 * flights_at_limits > flights, "{flights_at_limits} of {flights} flights saturated");
}

#[test]
fn saturated_flights_of_the_model_stay_in_the_proved_set() {
    saturated_flights_stay(4, 0.5);
}

#[test]
#[ignore = "hundreds of flights: run it in release"]
fn hundreds_of_saturated_flights_stay_in_the_proved_set() {
    saturated_flights_stay(300, 5.0);
}

/// Of the nonlinear plant: in the proved set V falls along its equations with the gain that flies, and the set is in the box.
#[test]
fn the_set_is_invariant_for_the_nonlinear_plant() {
    let (plant, design) = (plant(), made_for_a_rate());
    let options = ProofOptions { level: Some(0.005), nonlinear: true, ..ProofOptions::default() };
    let proofs = prove(&design, &*plant, &options).unwrap();
    let nonlinear = proofs.nonlinear.expect("something is proved");
    assert_eq!(claim(&proofs.claims, "plant.invariance").verdict, Verdict::Proved);
    assert!(nonlinear.level >= 0.0049 && nonlinear.rate < 2.0, "{nonlinear:?}");
    let y = &design.rate_bounded.as_ref().unwrap().y;
    let mut numbers = Numbers(11);
    for _ in 0..2000 {
        let psi = 3.2 * numbers.next();
        let p = lyapunov_matrix(&design, &*plant, psi).unwrap();
        let e = inside(&mut numbers, &p, nonlinear.level);
        for &(i, radius) in &nonlinear.radii {
            assert!(e[i].abs() <= radius, "state {i}: {} is more than {radius}", e[i]);
        }
        let k = design.controller.schedule.gain_matrix(psi);
        let u: Vec<f64> = (0..4).map(|i| 9.807 / 2.0 - (0..12).map(|j| k[(i, j)] * e[j]).sum::<f64>()).collect();
        let mut x = e.clone();
        x[11] = psi;
        let mut dx = vec![0.0; 12];
        plant.dynamics(&x, &u, &[0.0; 4], &mut dx);
        assert!(dx[11].abs() <= nonlinear.rate);
        let p_rate = -1.0 * (&p * (dx[11] * y.derivative(&[psi], 0)) * &p);
        let along: f64 = (0..12).map(|i| (0..12).map(|j| 2.0 * e[i] * p[(i, j)] * dx[j]).sum::<f64>()).sum();
        assert!(along + quadratic_form(&p_rate, &e) < 0.0, "yaw {psi}, {e:?}");
    }
}

/// The matrix function of a frozen design is what the proof is about: it interpolates the points.
#[test]
fn the_lyapunov_function_interpolates_the_design() {
    let design = crate::quadrotor::designed(Method::Lpvqr, InputLimits::none(4), 16, ScheduleKind::Grid);
    let plant = plant();
    for point in &design.points {
        let p = lyapunov_matrix(&design, &*plant, point.rho).unwrap();
        assert!((&p - &point.p).norm_max() < 1e-9 * point.p.norm_max());
    }
    let samples: Vec<Mat<f64>> = design.points.iter().map(|point| point.p.clone()).collect();
    // the frozen P of this plant turns with the yaw: harmonics up to two, and no more
    assert!(MatrixFunction::trigonometric(design.points[0].rho, &samples, 1e-9).basis.len() <= 5);
}
