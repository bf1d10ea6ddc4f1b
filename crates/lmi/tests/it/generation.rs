//! Inequalities that are posed only where an answer breaks them: the answer is that of the whole problem.

use lmi::{Expr, Mat, Options, Outcome, Problem};

/// min tr X subject to X ⪰ Cₖ for many fixed Cₖ, some of them lazily.
fn covering(count: usize, is_lazy: &dyn Fn(usize) -> bool) -> (Problem, Expr) {
    let mut problem = Problem::new();
    let x = problem.symmetric("X", 3);
    for k in 0..count {
        let angle = 0.37 * k as f64;
        let v = [angle.cos(), angle.sin(), (1.7 * angle).cos()];
        let weight = 1.0 + 0.3 * (2.9 * k as f64).sin();
        let c = Mat::from_fn(3, 3, |i, j| weight * v[i] * v[j] - if i == j { 0.2 } else { 0.0 });
        let block = &x - Expr::constant(c);
        match is_lazy(k) {
            true => problem.positive_definite_lazily(format!("cover {k}"), block, None, k % 7),
            false => problem.positive_definite(format!("cover {k}"), block),
        }
    }
    problem.minimize(&x.trace());
    (problem, x)
}

#[test]
fn the_optimum_is_that_of_the_whole_problem() {
    let options = Options::default();
    let (whole, _) = covering(300, &|_| false);
    let whole = whole.solve(&options).unwrap();
    for first in [1, 3, 40] {
        let (problem, x) = covering(300, &|k| k >= first);
        let answer = problem.solve(&options).unwrap();
        assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
        assert!((answer.objective - whole.objective).abs() < 1e-6 * whole.objective, "{}", answer.objective);
        assert_eq!((answer.blocks.len(), answer.multipliers.len()), (300, 300));
        assert!(answer.blocks.iter().all(|block| block.verified_lower_bound > 0.0));
        let bound = answer.optimum_bound.unwrap();
        assert!(bound.reach.is_infinite() && bound.value <= whole.objective + 1e-9);
        // few of them carry it
        let posed = answer.multipliers.iter().filter(|z| z.norm_max() > 0.0).count();
        assert!(posed < 100, "{posed}");
        // what begins with them finds the same
        let again = problem.beginning_with(&answer).solve(&options).unwrap();
        assert!((again.objective - whole.objective).abs() < 1e-6 * whole.objective);
        assert!(again.iterations.len() < answer.iterations.len());
        assert!(answer.value(&x)[(0, 0)] > 0.0);
    }
}

#[test]
fn contradictions_and_directions_without_end() {
    let options = Options::default();
    let number = |value: f64| Expr::constant(Mat::from_fn(1, 1, |_, _| value));
    // x ≥ 1 and −x ≥ 0
    let mut problem = Problem::new();
    let x = problem.scalar("x");
    problem.positive_definite("x over 1", &x - number(1.0));
    for k in 0..60 {
        problem.positive_definite_lazily(format!("x over -{k}"), &x + number(f64::from(k)), None, 0);
    }
    problem.positive_definite_lazily("x below 0", -1.0 * &x, None, 1);
    let answer = problem.solve(&options).unwrap();
    let Outcome::Infeasible(witness) = &answer.outcome else { panic!("{:?}", answer.outcome) };
    assert_eq!(witness.multipliers.len(), 62);
    assert!(witness.multipliers[61][(0, 0)] > 0.0 && witness.multipliers[30][(0, 0)] == 0.0);
    let explanation = problem.explain(&answer, &options).unwrap().unwrap();
    assert!((explanation.distance - 0.5).abs() < 1e-6, "{explanation}");

    // without the lazy ones there is no least x
    let mut problem = Problem::new();
    let x = problem.scalar("x");
    problem.positive_definite("x below 5", number(5.0) - &x);
    problem.positive_definite_lazily("x over -1", &x + number(1.0), None, 0);
    problem.minimize(&x);
    let answer = problem.solve(&options).unwrap();
    assert!((answer.objective + 1.0).abs() < 1e-6, "{:?}", answer.outcome);

    // nothing but lazy ones, also such that are not strict
    let mut problem = Problem::new();
    let x = problem.scalar("x");
    problem.positive_definite_lazily("x over 2", &x - number(2.0), Some(0.0), 0);
    problem.positive_definite_lazily("x over 3", &x - number(3.0), Some(0.0), 1);
    problem.minimize(&x);
    let answer = problem.solve(&options).unwrap();
    assert!((answer.objective - 3.0).abs() < 1e-6, "{:?}", answer.outcome);
}
