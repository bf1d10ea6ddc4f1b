//! Synthesis over polytopes: against other solvers, the thesis's corrected numbers, and the inequalities' own meaning.

use crate::quadrotor::{plant, weights as quadrotor_weights};
use lpv::math::Mat;
use lpv::math::eigen::{smallest_eigenvalue, spectral_abscissa};
use lpv::math::matrix::{diagonal, from_rows, quadratic_form};
use lpv::model::{GridModel, Polytope, linearize};
use lpv::synthesis::polytopic::{
    BackOff, HighGain, InputBounds, Lyapunov, Objective, PolytopicDesign, PolytopicRequest, rate_box_vertices,
    synthesize,
};
use lpv::synthesis::{CostWeights, HighGainOptions};
use serde::Deserialize;
use std::f64::consts::PI;

fn matrices(rows: &[Vec<Vec<f64>>]) -> Vec<Mat<f64>> {
    rows.iter().map(|rows| from_rows(rows)).collect()
}

fn request(weights: CostWeights) -> PolytopicRequest {
    PolytopicRequest {
        weights: Some(weights),
        lyapunov: Lyapunov::Common,
        saturation: None,
        high_gain: None,
        objective: Objective::Trace,
        back_off: BackOff::Nothing,
    }
}

fn pendulum() -> (Polytope, CostWeights) {
    let a = [[[0., 1.], [1., -0.1]], [[0., 1.], [0., -0.1]]].map(|a| Mat::from_fn(2, 2, |i, j| a[i][j]));
    let b = Mat::from_fn(2, 1, |i, _| i as f64);
    let weights = CostWeights { q: diagonal(&[4., 4.]), r: diagonal(&[1.]) };
    (Polytope::new(a.to_vec(), vec![b]).unwrap(), weights)
}

fn double_integrator() -> (Polytope, CostWeights) {
    let a = Mat::from_fn(2, 2, |i, j| f64::from(u8::from(i == 0 && j == 1)));
    let b = Mat::from_fn(2, 1, |i, _| i as f64);
    let weights = CostWeights { q: diagonal(&[1., 1.]), r: diagonal(&[0.001]) };
    (Polytope::new(vec![a], vec![b]).unwrap(), weights)
}

fn solved(polytope: &Polytope, request: &PolytopicRequest) -> PolytopicDesign {
    let design = synthesize(polytope, request).unwrap();
    // L may grow without end where it costs nothing: then no bound on the optimum holds for every L.
    assert!(design.answer.outcome.is_feasible(), "{:?}", design.answer.outcome);
    assert!(design.answer.blocks.iter().all(|block| block.verified_lower_bound > -1e-9));
    design
}

/// `validation/golden/polytopic.py`: problems with the optima that two other solvers agree on.
#[derive(Deserialize)]
struct Golden {
    problems: Vec<GoldenProblem>,
}

#[derive(Deserialize)]
struct GoldenProblem {
    name: String,
    a: Vec<Vec<Vec<f64>>>,
    b: Vec<Vec<Vec<f64>>>,
    q: Option<Vec<Vec<f64>>>,
    r: Option<Vec<Vec<f64>>>,
    rates: Option<Vec<Vec<f64>>>,
    sigma: Option<Vec<f64>>,
    gamma: Option<f64>,
    high_gain: bool,
    objective: GoldenObjective,
    optima: std::collections::BTreeMap<String, f64>,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
enum GoldenObjective {
    Trace,
    States { states: Vec<Vec<f64>>, parameter: Option<Vec<f64>> },
    Ellipsoid { shape: Vec<Vec<f64>> },
}

fn golden() -> Vec<GoldenProblem> {
    serde_json::from_str::<Golden>(include_str!("data/polytopic.json")).unwrap().problems
}

/// Every method and objective, with high gain against all 2^m inequalities. The two solvers agree to 2e-7.
#[test]
fn optima_of_other_solvers() {
    let problems = golden();
    assert!(problems.len() >= 20, "{}", problems.len());
    for problem in problems {
        let polytope = Polytope::new(matrices(&problem.a), matrices(&problem.b)).unwrap();
        let request = PolytopicRequest {
            weights: problem.q.zip(problem.r).map(|(q, r)| CostWeights { q: from_rows(&q), r: from_rows(&r) }),
            lyapunov: match problem.rates {
                None => Lyapunov::Common,
                Some(rate_vertices) => Lyapunov::ParameterDependent { rate_vertices },
            },
            saturation: problem.sigma.zip(problem.gamma).map(|(sigma, gamma)| InputBounds { sigma, gamma }),
            high_gain: problem.high_gain.then(|| HighGain { options: HighGainOptions::default(), sample_time_s: None }),
            objective: match problem.objective {
                GoldenObjective::Trace => Objective::Trace,
                GoldenObjective::States { states, parameter } => Objective::States { states, parameter },
                GoldenObjective::Ellipsoid { shape } => Objective::Ellipsoid { shape: from_rows(&shape) },
            },
            back_off: BackOff::Nothing,
        };
        let found = solved(&polytope, &request).answer.objective;
        for (solver, optimum) in problem.optima {
            assert!((found / optimum - 1.0).abs() < 1e-6, "{}: {found} is not {optimum} of {solver}", problem.name);
        }
    }
}

/// The quadrotor's matrices of the golden problems, written from (3.34) in the script, are the plant's linearisations.
#[test]
fn golden_quadrotor_is_the_plant() {
    let plant = plant();
    let vehicles: Vec<GoldenProblem> =
        golden().into_iter().filter(|problem| problem.name.starts_with("quadrotor")).collect();
    assert!(!vehicles.is_empty());
    for problem in vehicles {
        for (k, (a, b)) in matrices(&problem.a).iter().zip(&matrices(&problem.b)).enumerate() {
            let model = linearize(&*plant, (k as f64 - 1.0) * PI / 6.0);
            assert!((&model.a - a).norm_max() < 1e-12 && (&model.b - b).norm_max() < 1e-12, "{}", problem.name);
        }
    }
}

/// Table 4.1 with the corrected numbers: bounds from x(0) = (π, 0), where ρ(0) = (0, 1).
#[test]
fn table_4_1() {
    let (polytope, weights) = pendulum();
    let bound = |lyapunov: Lyapunov| {
        let design = solved(&polytope, &PolytopicRequest { lyapunov, ..request(weights.clone()) });
        quadratic_form(&design.solution.unwrap().lyapunov_matrix(&[0.0, 1.0]).unwrap(), &[PI, 0.0])
    };
    let rate = |speed: f64| Lyapunov::ParameterDependent { rate_vertices: rate_box_vertices(2, 0.43618182 * speed) };
    for (found, right, tolerance) in
        [(bound(Lyapunov::Common), 77.975, 1e-3), (bound(rate(PI)), 77.0554, 1e-4), (bound(rate(2.0)), 68.7353, 1e-4)]
    {
        assert!((found - right).abs() < tolerance, "{found} is not {right}");
    }
}

/// The largest tr Y is not the least bound: 74.901 is in reach of Theorem 4.3.
#[test]
fn least_bound_of_an_initial_state() {
    let (polytope, weights) = pendulum();
    let objective = Objective::States { states: vec![vec![PI, 0.0]], parameter: None };
    let design = solved(&polytope, &PolytopicRequest { objective, ..request(weights) });
    let bound = quadratic_form(&design.solution.unwrap().p[0], &[PI, 0.0]);
    assert!((bound - 74.901).abs() < 1e-3, "{bound}");
    assert!((bound / design.answer.objective - 1.0).abs() < 1e-6);
}

/// The ellipsoid through ±x along one axis is bounded like the state x itself or worse; the ball of P⁻¹'s size by 1.
#[test]
fn worst_case_over_an_ellipsoid() {
    let (polytope, weights) = pendulum();
    let shape = diagonal(&[0.25, 1.0]);
    let objective = Objective::Ellipsoid { shape: shape.clone() };
    let design = solved(&polytope, &PolytopicRequest { objective, ..request(weights) });
    let (p, t) = (&design.solution.as_ref().unwrap().p[0], design.answer.objective);
    let slack = Mat::from_fn(2, 2, |i, j| t * shape[(i, j)] - p[(i, j)]);
    assert!(smallest_eigenvalue(&slack).abs() < 1e-6 * t, "P ⪯ tS, and touches it");
}

/// Theorem 4.1: what it finds is stable for any motion; its infeasibility on the hull of the quadrotor's yaws is explained.
#[test]
fn stabilisation() {
    let (polytope, _) = pendulum();
    let stabilize = PolytopicRequest { weights: None, ..request(pendulum().1) };
    let design = solved(&polytope, &stabilize);
    assert!(design.answer.objective > 0.01);
    let solution = design.solution.unwrap();
    for i in 0..2 {
        assert!(spectral_abscissa(&(polytope.a(i) - polytope.b(i) * &solution.gain[i])) < 0.0);
    }

    let circle = Polytope::hull(&GridModel::of_plant(&*plant(), 4).points);
    let design = synthesize(&circle, &stabilize).unwrap();
    assert!(design.is_infeasible() && design.solution.is_none() && !design.explanation.unwrap().carriers.is_empty());
}

/// On an arc of yaw the common Lyapunov function exists, and its margin falls as the arc opens: 0.5115 at ±30°, 0.2360 at
/// ±60° by an independent computation.
#[test]
fn quadrotor_on_an_arc_of_yaw() {
    let plant = plant();
    let arc = |degrees: f64| -> Vec<_> {
        let half = degrees.to_radians();
        (0..9).map(|k| linearize(&*plant, half * (k as f64 / 4.0 - 1.0))).collect()
    };
    let stabilize = PolytopicRequest { weights: None, ..request(quadrotor_weights()) };
    let margins = [30.0, 60.0].map(|degrees| solved(&Polytope::hull(&arc(degrees)), &stabilize).answer.objective);
    assert!((margins[0] - 0.5115).abs() < 1e-4 && (margins[1] - 0.2360).abs() < 1e-4, "{margins:?}");

    let design = solved(&Polytope::hull(&arc(30.0)), &request(quadrotor_weights()));
    let solution = design.solution.unwrap();
    // between the vertices too: A(ψ) of the arc is in the hull up to the curvature between two of nine points
    for k in 0..9 {
        let model = &arc(30.0)[k];
        let flow = &solution.p[k] * (&model.a - &model.b * &solution.gain[k]);
        assert!(smallest_eigenvalue(&Mat::from_fn(12, 12, |i, j| -flow[(i, j)] - flow[(j, i)])) > 0.0);
    }
}

/// Table 5.1: bounds from x(0) = (0, 2), and the high gain has the same Y.
#[test]
fn table_5_1() {
    let (polytope, weights) = double_integrator();
    let design = |gamma: f64, high_gain| {
        let saturation = Some(InputBounds { sigma: vec![1.0], gamma });
        solved(&polytope, &PolytopicRequest { saturation, high_gain, ..request(weights.clone()) }).solution.unwrap()
    };
    let high = HighGain { options: HighGainOptions::default(), sample_time_s: Some(0.001) };
    for (gamma, right) in [(1.0, 5.92367), (30.0, 39.6808), (60.0, 59.6849)] {
        let (low, high) = (design(gamma, None), design(gamma, Some(high)));
        for p in [&low.p[0], &high.p[0]] {
            let bound = quadratic_form(p, &[0.0, 2.0]);
            assert!((bound / right - 1.0).abs() < 1e-5, "{bound} is not {right}");
        }
        assert!(high.s.unwrap() > 0.0 && high.gain[0].norm_max() > low.gain[0].norm_max());
        assert!((&high.auxiliary_gain.unwrap()[0] - &low.gain[0]).norm_max() < 1e-6 * low.gain[0].norm_max());
    }
}

/// A general R has no closed form: every mixture of the gain that is returned meets the inequality.
#[test]
fn high_gain_with_a_general_r() {
    let a = from_rows(&[vec![0., 1., 0.], vec![0., 0., 1.], vec![-0.5, 0., 0.]]);
    let b = from_rows(&[vec![0., 0.3], vec![1., 0.], vec![0., 1.]]);
    let polytope = Polytope::new(vec![a.clone()], vec![b.clone()]).unwrap();
    let weights = CostWeights { q: diagonal(&[1., 2., 3.]), r: from_rows(&[vec![0.1, 0.05], vec![0.05, 0.2]]) };
    let design = solved(
        &polytope,
        &PolytopicRequest {
            saturation: Some(InputBounds { sigma: vec![1.0, 0.5], gamma: 10.0 }),
            high_gain: Some(HighGain { options: HighGainOptions::default(), sample_time_s: None }),
            ..request(weights.clone())
        },
    );
    let solution = design.solution.unwrap();
    let (p, k, f) = (&solution.p[0], &solution.gain[0], &solution.auxiliary_gain.as_ref().unwrap()[0]);
    for vertex in 0..4 {
        let s = Mat::from_fn(2, 3, |i, j| if vertex >> i & 1 == 1 { k[(i, j)] } else { f[(i, j)] });
        let flow = p * (&a - &b * &s);
        let decrease = &flow + flow.transpose() + &weights.q + s.transpose() * &weights.r * &s;
        let largest = -smallest_eigenvalue(&Mat::from_fn(3, 3, |i, j| -decrease[(i, j)]));
        assert!(largest < 1e-6, "mixture {vertex}: {largest}");
    }
}

/// The centre of the yaw circle is in the hull of any points around it: no input moves roll and pitch there (w = e_φ or e_θ, or
/// between), and no number of points helps.
#[test]
fn no_stabilisation_on_the_whole_circle() {
    for count in [3, 4, 5, 8, 12] {
        let circle = Polytope::hull(&GridModel::of_plant(&*plant(), count).points);
        for weights in [None, Some(quadrotor_weights())] {
            let design = synthesize(&circle, &PolytopicRequest { weights, ..request(quadrotor_weights()) }).unwrap();
            assert!(design.is_infeasible() && design.solution.is_none(), "{count} points");
            let point = design.unstabilizable.unwrap();
            let model = circle.at(&point.weights);
            let w = &point.direction;
            let along = |matrix: &Mat<f64>| {
                (0..matrix.ncols())
                    .map(|j| (0..12).map(|i| w[i] * matrix[(i, j)]).sum::<f64>().abs())
                    .fold(0.0, f64::max)
            };
            assert!(point.weights.iter().all(|&weight| weight >= 0.0) && point.eigenvalue == [0.0, 0.0]);
            assert!(along(&model.a) < 1e-9 && along(&model.b) < 1e-9, "wᵀA = 0 and wᵀB = 0");
            assert!(point.is_proved && (0..12).all(|i| matches!(i, 9 | 10) || w[i] == 0.0), "roll and pitch: {w:?}");
        }
    }
}
