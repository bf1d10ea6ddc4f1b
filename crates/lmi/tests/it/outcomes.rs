//! Infeasible, unbounded, interrupted and unconstrained problems, each with its evidence checked here again.

use crate::plants::{diagonal, matrix};
use lmi::{Answer, Expr, InaccurateReason, Mat, Options, Outcome, Problem};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// AᵀP + PA ≺ 0, P ≻ I.
fn lyapunov(a: &Mat<f64>) -> (Problem, Answer) {
    let mut problem = Problem::new();
    let n = a.nrows();
    let p = problem.symmetric("P", n);
    problem.positive_definite("decay", -(a.transpose().to_owned() * &p + &p * a));
    problem.positive_definite("P", &p - Expr::identity(n));
    let answer = problem.solve(&Options::default()).unwrap();
    (problem, answer)
}

#[test]
fn a_stable_matrix_has_a_lyapunov_function() {
    let (_, answer) = lyapunov(&matrix([[-1.0, 5.0], [0.0, -2.0]]));
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
    assert!(answer.blocks.iter().all(|block| block.smallest_eigenvalue > 0.0));
}

#[test]
fn an_unstable_matrix_has_none_and_the_witness_proves_it() {
    let a = matrix([[0.5, 1.0], [0.0, -2.0]]);
    let (_, answer) = lyapunov(&a);
    let Outcome::Infeasible(witness) = &answer.outcome else { panic!("{:?}", answer.outcome) };
    let [decay, bound] = &witness.multipliers[..] else { panic!("two multipliers expected") };
    // ⟨−(AᵀP + PA), Z₁⟩ + ⟨P − I, Z₂⟩ = ⟨P, Z₂ − AZ₁ − Z₁Aᵀ⟩ − tr Z₂ for all P.
    let coefficient = bound - &a * decay - decay * a.transpose();
    assert!(coefficient.norm_max() < 1e-6, "{coefficient:?}");
    assert!((bound[(0, 0)] + bound[(1, 1)] - 1.0).abs() < 1e-6);
    assert!(witness.residual < 1e-6 && witness.excluded_radius.is_infinite(), "{witness:?}");
    assert!(witness.smallest_eigenvalue > -1e-12, "{witness:?}");
    for z in &witness.multipliers {
        assert!(z.self_adjoint_eigenvalues(faer::Side::Lower).unwrap()[0] > -1e-9);
    }
}

/// Feasible, but by less than the default margin: infeasibility must not be claimed.
#[test]
fn the_default_margin_decides_nothing() {
    let mut problem = Problem::new();
    let t = problem.scalar("t");
    let thin = matrix([[1.0, 1.0], [1.0, 1.0 + 1e-14]]);
    problem.positive_definite("thin", &thin + t.times(&Mat::zeros(2, 2)));
    problem.positive_definite("0 < t", t.clone());
    problem.positive_definite("t < 1", Expr::identity(1) - &t);
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
    assert!(answer.blocks[0].verified_lower_bound > 1e-15 && answer.blocks[0].verified_lower_bound < 1e-14);
}

#[test]
fn an_explanation_names_what_contradicts() {
    // 3 < t and t < 1 contradict by 2; each alone has to give way by 2, both together by 1 each.
    let mut problem = Problem::new();
    let (t, u) = (problem.scalar("t"), problem.scalar("u"));
    problem.positive_definite("3 < t", &t - matrix([[3.0]]));
    problem.positive_definite("t < 1", matrix([[1.0]]) - &t);
    problem.positive_definite("u < 7", matrix([[7.0]]) - &u);
    let answer = problem.solve(&Options::default()).unwrap();
    let why = problem.explain(&answer, &Options::default()).unwrap().expect("an infeasible answer");
    assert!((why.distance - 1.0).abs() < 1e-6, "{why}");
    assert_eq!(why.carriers.len(), 2);
    for carrier in &why.carriers {
        assert!((carrier.share - 0.5).abs() < 1e-6 && (carrier.alone.unwrap() - 2.0).abs() < 1e-6, "{why}");
    }
    let text = why.to_string();
    assert!(text.contains("3 < t") && text.contains("50.0 %") && text.contains("relax \""), "{text}");
    // Nothing to explain.
    let mut problem = Problem::new();
    let t = problem.scalar("t");
    problem.positive_definite("t > 0", t);
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(problem.explain(&answer, &Options::default()).unwrap().is_none());
}

#[test]
fn contradictory_bounds_are_infeasible() {
    let mut problem = Problem::new();
    let t = problem.scalar("t");
    problem.positive_definite("t > 1", &t - matrix([[1.0]]));
    problem.positive_definite("t < 0", -&t);
    problem.minimize(&t);
    let answer = problem.solve(&Options::default()).unwrap();
    let Outcome::Infeasible(witness) = &answer.outcome else { panic!("{:?}", answer.outcome) };
    assert!((witness.multipliers[0][(0, 0)] - 1.0).abs() < 1e-6);
    assert!((witness.multipliers[1][(0, 0)] - 1.0).abs() < 1e-6);
}

#[test]
fn a_block_without_unknowns_decides_alone() {
    for (entry, feasible) in [(1.0, true), (-1.0, false)] {
        let mut problem = Problem::new();
        let y = problem.symmetric("Y", 2);
        problem.positive_definite("known", Expr::constant(diagonal(&[1.0, entry])));
        problem.positive_definite("Y", y.clone());
        problem.minimize(&y.trace());
        let answer = problem.solve(&Options::default()).unwrap();
        match answer.outcome {
            Outcome::Solved => assert!(feasible && answer.objective.abs() < 1e-6),
            Outcome::Infeasible(_) => assert!(!feasible),
            other => panic!("{entry}: {other:?}"),
        }
    }
}

#[test]
fn an_objective_without_end_comes_with_its_ray() {
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 2);
    problem.positive_definite("Y", &y - Expr::identity(2));
    problem.maximize(&y.trace());
    let answer = problem.solve(&Options::default()).unwrap();
    let Outcome::Unbounded(ray) = &answer.outcome else { panic!("{:?}", answer.outcome) };
    let d = &ray.direction[0];
    assert!((d[(0, 0)] + d[(1, 1)] - 1.0).abs() < 1e-6);
    assert!(d.self_adjoint_eigenvalues(faer::Side::Lower).unwrap()[0] > -1e-7);
}

#[test]
fn an_unknown_in_the_objective_alone_is_unbounded() {
    let mut problem = Problem::new();
    let (y, t) = (problem.symmetric("Y", 2), problem.scalar("t"));
    problem.positive_definite("Y", y.clone());
    problem.minimize(&(&y.trace() + &t));
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Unbounded(_)), "{:?}", answer.outcome);
}

#[test]
fn an_unused_unknown_stays_put() {
    let mut problem = Problem::new();
    let (y, unused) = (problem.symmetric("Y", 2), problem.rectangular("unused", 2, 2));
    problem.positive_definite("Y", &y - Expr::identity(2));
    problem.minimize(&y.trace());
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
    assert!((answer.objective - 2.0).abs() < 1e-7);
    assert_eq!(answer.value(&unused).norm_max(), 0.0);
}

#[test]
fn dependent_unknowns_are_met_by_regularisation() {
    // Only a + b matters.
    let mut problem = Problem::new();
    let (a, b) = (problem.symmetric("A", 3), problem.symmetric("B", 3));
    problem.positive_definite("A + B", &a + &b - Expr::identity(3));
    problem.minimize(&(&a + &b).trace());
    let answer = problem.solve(&Options::default()).unwrap();
    // A − B is not bounded, and the multipliers' equations hold up to rounding: no bound for every x.
    assert!(answer.outcome.is_feasible() && answer.optimum_bound.unwrap().reach.is_finite(), "{:?}", answer.outcome);
    assert!((answer.objective - 3.0).abs() < 1e-7);
}

#[test]
fn limits_end_the_solve_with_the_point_so_far() {
    let (problem, _) = crate::quadrotor::low_gain(20.0);
    let solve = |options: Options| problem.solve(&options).unwrap();
    let answer = solve(Options { max_iterations: 3, ..Options::default() });
    assert!(matches!(answer.outcome, Outcome::Inaccurate(InaccurateReason::IterationLimit)));
    assert!(answer.iterations.len() <= 4 && answer.objective.is_finite());
    let answer = solve(Options { time_limit: Some(Duration::ZERO), ..Options::default() });
    assert!(matches!(answer.outcome, Outcome::Inaccurate(InaccurateReason::TimeLimit)));
    let cancel = Some(Arc::new(AtomicBool::new(true)));
    let answer = solve(Options { cancel, ..Options::default() });
    assert!(matches!(answer.outcome, Outcome::Inaccurate(InaccurateReason::Cancelled)));
}

#[test]
fn a_margin_of_ones_own_is_kept() {
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 3);
    problem.positive_definite_by("Y", y.clone(), 0.25);
    problem.minimize(&y.trace());
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
    assert!((answer.objective - 0.75).abs() < 1e-7);
    assert!(answer.blocks[0].smallest_eigenvalue >= 0.25 - 1e-14 && answer.blocks[0].margin == 0.25);
}

#[test]
fn a_problem_without_unknowns_is_a_check() {
    let mut problem = Problem::new();
    problem.positive_definite("known", Expr::identity(2));
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
    assert!((answer.blocks[0].smallest_eigenvalue - 1.0).abs() < 1e-14);
}
