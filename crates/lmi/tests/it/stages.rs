//! Solving near a neighbour's answer, backed off from the optimum, within bounds; points that others found.

use crate::plants::{diagonal, matrix, quadrotor};
use crate::quadrotor::{high_gain_at, low_gain};
use lmi::{Error, Expr, Mat, Options, Outcome, Problem, sdpa};

/// Every point of a yaw grid from its neighbour: the same optimum in fewer iterations.
#[test]
fn neighbours_share_their_way() {
    let (mut cold, mut warm) = (0, 0);
    let mut before = None;
    for k in 0..4 {
        let (problem, _) = high_gain_at(&quadrotor(0.2 * f64::from(k)), 20.0);
        let alone = problem.solve(&Options::default()).unwrap();
        if let Some(neighbour) = &before {
            let near = problem.solve_near(neighbour, &Options::default()).unwrap();
            assert!(matches!(near.outcome, Outcome::Solved), "{:?}", near.outcome);
            assert!((near.objective - alone.objective).abs() < 2e-7, "{} {}", near.objective, alone.objective);
            assert!(near.blocks.iter().all(|block| block.verified_lower_bound > 0.0));
            cold += alone.iterations.len();
            warm += near.iterations.len();
        }
        before = Some(alone);
    }
    assert!(4 * warm < 3 * cold, "{warm} iterations from neighbours, {cold} without");
}

/// A neighbour of another shape, or one that is far away, costs time and nothing else.
#[test]
fn a_neighbour_that_is_none_does_no_harm() {
    let (small, _) = low_gain(1.0);
    let (large, _) = high_gain_at(&quadrotor(0.3), 1.0);
    let [small_answer, large_answer] = [&small, &large].map(|p| p.solve(&Options::default()).unwrap());
    let crossed = large.solve_near(&small_answer, &Options::default()).unwrap();
    assert!(matches!(crossed.outcome, Outcome::Solved));
    assert!((crossed.objective - large_answer.objective).abs() < 2e-7);
    let infeasible = {
        let mut problem = Problem::new();
        let t = problem.scalar("t");
        problem.positive_definite("t > 1", &t - Expr::identity(1));
        problem.positive_definite("t < 0", -&t);
        problem
    };
    let answer = infeasible.solve(&Options::default()).unwrap();
    assert!(matches!(infeasible.solve_near(&answer, &Options::default()).unwrap().outcome, Outcome::Infeasible(_)));
}

/// The margins grow by orders of magnitude for a thousandth of the objective.
#[test]
fn backing_off_buys_margins() {
    let (problem, y) = low_gain(20.0);
    let optimum = problem.solve(&Options::default()).unwrap();
    let backed_off = problem.solve(&Options { back_off: Some(1e-3), ..Options::default() }).unwrap();
    assert!(matches!(backed_off.outcome, Outcome::Solved));
    let room = 1e-3 * (1.0 + optimum.objective);
    assert!(optimum.objective - backed_off.objective <= room * (1.0 + 1e-6));
    assert!((backed_off.value(&y.trace())[(0, 0)] - backed_off.objective).abs() < 1e-12);
    // The bound is that of the optimum.
    assert!((backed_off.dual_objective - optimum.objective).abs() < 1e-6);
    let least =
        |answer: &lmi::Answer| answer.blocks.iter().map(|b| b.verified_lower_bound).fold(f64::INFINITY, f64::min);
    assert!(least(&backed_off) > 1e3 * least(&optimum), "{:.1e} {:.1e}", least(&backed_off), least(&optimum));
}

/// Minimise t over [t, 1; 1, s] ⪰ 0: no s attains t = 0, with s ≤ 10³ it is 10⁻³.
#[test]
fn bounds_keep_the_optimum_from_infinity() {
    let mut problem = Problem::new();
    let (t, s) = (problem.scalar("t"), problem.scalar("s"));
    let rows = vec![vec![t.clone()], vec![Expr::identity(1), s]];
    problem.positive_definite("hyperbola", Expr::symmetric_blocks(rows));
    problem.minimize(&t);
    let free = problem.solve(&Options::default()).unwrap();
    assert!(!matches!(free.outcome, Outcome::Solved), "{:?} {}", free.outcome, free.objective);
    let bounded = problem.solve(&Options { bound: Some(1e3), ..Options::default() }).unwrap();
    assert!(matches!(bounded.outcome, Outcome::Solved), "{:?}", bounded.outcome);
    assert!((bounded.objective - 1e-3).abs() < 1e-7, "{}", bounded.objective);
    assert!(bounded.blocks.iter().any(|block| block.name == "upper bound on s"));
}

/// ‖X‖ ≤ β of a rectangular unknown is its largest singular value: maximise ⟨W, X⟩ gives β times the sum of the singular values of W.
#[test]
fn a_bound_is_on_the_largest_singular_value() {
    let w = matrix([[3.0, 0.0, 0.0], [0.0, 0.0, 4.0]]);
    let mut problem = Problem::new();
    let x = problem.rectangular("X", 2, 3);
    problem.positive_definite("one", Expr::identity(1));
    problem.maximize(&(w.transpose().to_owned() * &x).trace());
    let answer = problem.solve(&Options { bound: Some(2.0), ..Options::default() }).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
    assert!((answer.objective - 14.0).abs() < 1e-5, "{}", answer.objective);
}

#[test]
fn options_out_of_range_are_errors() {
    let (problem, _) = low_gain(1.0);
    for bad in [
        Options { bound: Some(0.0), ..Options::default() },
        Options { bound: Some(f64::NAN), ..Options::default() },
        Options { back_off: Some(-1e-3), ..Options::default() },
        Options { back_off: Some(f64::INFINITY), ..Options::default() },
    ] {
        assert!(matches!(problem.solve(&bad), Err(Error::BadOption { .. })));
    }
}

/// The bounds are proved of whatever point is given.
#[test]
fn points_of_others_are_verified() {
    let mut problem = Problem::new();
    let p = problem.symmetric("P", 2);
    problem.positive_definite("P > I", &p - Expr::identity(2));
    let at = |values: &[f64]| problem.verify(&[diagonal(values)]).unwrap()[0].verified_lower_bound;
    assert!(at(&[3.0, 1.5]) > 0.49 && at(&[3.0, 1.5]) <= 0.5);
    assert!(at(&[0.5, 2.0]) < -0.49);
    assert!(matches!(problem.verify(&[Mat::zeros(3, 3)]), Err(Error::BadPoint { .. })));
}

/// Points a little outside get a bound a little below, also where the terms of F cancel so far that `f64` would not see the eigenvalue.
#[test]
fn slightly_infeasible_points_are_bounded_sharply() {
    // 10⁸(x₁ + x₂)·I with the known part −10⁻¹⁰·I, on a 2 × 2 block; F₀ is stated in parts that cancel.
    let text = "2\n1\n2\n0 0\n0 1 1 1 1e8\n0 1 1 1 -1e8\n0 1 1 1 1e-10\n0 1 2 2 1e-10\n\
                1 1 1 1 1e8\n1 1 2 2 1e8\n2 1 1 1 1e8\n2 1 2 2 1e8\n";
    let sdp = sdpa::read(text.as_bytes()).unwrap();
    let bound = sdp.verify(&[0.3, -0.3]).unwrap()[0].verified_lower_bound;
    assert!(bound <= -1e-10 && bound > -1.01e-10, "{bound:e}");
}

/// Expressions and the file written from them have one optimum, and the file is what other solvers' makers wrote by hand.
#[test]
fn a_problem_written_as_a_file_is_the_same() {
    let (problem, _) = low_gain(20.0);
    let sdp = problem.to_sdp(&Options::default()).unwrap();
    let mut text = Vec::new();
    sdpa::write(&sdp, &mut text).unwrap();
    assert_eq!(sdpa::read(&text[..]).unwrap(), sdp);
    let [here, there] = [problem.solve(&Options::default()).unwrap(), sdp.solve(&Options::default()).unwrap()];
    assert!(matches!(there.outcome, Outcome::Solved));
    // A maximised objective changes its sign.
    assert!((here.objective + there.objective).abs() < 2e-7, "{} {}", here.objective, there.objective);
    let given = {
        let mut problem = Problem::new();
        let t = problem.scalar("t");
        problem.positive_definite_by("t > 3", t.clone(), 3.0);
        problem.minimize(&t);
        problem.to_sdp(&Options::default()).unwrap()
    };
    assert!((given.solve(&Options::default()).unwrap().objective - 3.0).abs() < 1e-7);
}

#[test]
fn files_are_bounded_verified_and_explained() {
    // Minimise x₁ over x₁ ≥ x₂, x₁ + x₂ ≥ 0: 0; with |xᵢ| ≤ 5 and x₁ ≥ 7 besides, infeasible by 1.
    let text = "2\n1\n-3\n1 0\n0 1 3 3 7\n1 1 1 1 1\n2 1 1 1 -1\n1 1 2 2 1\n2 1 2 2 1\n1 1 3 3 1\n";
    let sdp = sdpa::read(text.as_bytes()).unwrap();
    assert!((sdp.solve(&Options::default()).unwrap().objective - 7.0).abs() < 1e-6);
    let bounded = Options { bound: Some(5.0), ..Options::default() };
    let answer = sdp.solve(&bounded).unwrap();
    assert!(matches!(answer.outcome, Outcome::Infeasible(_)), "{:?}", answer.outcome);
    assert_eq!(sdp.verify(&[8.0, 1.0]).unwrap()[0].verified_lower_bound.round(), 1.0);
    assert!(matches!(sdp.verify(&[8.0]), Err(Error::BadPoint { .. })));
    let contradiction = "1\n1\n-2\n1\n0 1 1 1 1\n1 1 1 1 1\n1 1 2 2 -1\n";
    let sdp = sdpa::read(contradiction.as_bytes()).unwrap();
    let answer = sdp.solve(&Options::default()).unwrap();
    let explanation = sdp.explain(&answer, &Options::default()).unwrap().unwrap();
    assert!((explanation.distance - 0.5).abs() < 1e-6);
}
