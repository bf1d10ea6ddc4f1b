//! Badly scaled regulators: feasible problems that must not be called infeasible.

use crate::plants::matrix;
use lmi::{Answer, Expr, Mat, Options, Outcome, Problem};
use proptest::prelude::*;

/// max tr Y subject to [−s − sᵀ, Y, Lᵀ; Y, Q⁻¹, 0; L, 0, R⁻¹] ≻ 0 for s = AY − BL.
fn regulator(a: &Mat<f64>, b: &Mat<f64>, q_inverse: &Mat<f64>, r_inverse: &Mat<f64>) -> (Problem, Expr, Expr) {
    let (n, m) = (a.nrows(), b.ncols());
    let mut problem = Problem::new();
    let (y, l) = (problem.symmetric("Y", n), problem.rectangular("L", m, n));
    let s = a * &y - b * &l;
    problem.positive_definite(
        "Riccati",
        Expr::symmetric_blocks(vec![
            vec![-(&s + s.t())],
            vec![y.clone(), Expr::from(q_inverse)],
            vec![l.clone(), Expr::zeros(m, n), Expr::from(r_inverse)],
        ]),
    );
    problem.maximize(&y.trace());
    (problem, y, l)
}

fn double_integrator(q_inverse: Mat<f64>, r: f64) -> (Answer, f64) {
    let (a, b) = (matrix([[0.0, 1.0], [0.0, 0.0]]), matrix([[0.0], [1.0]]));
    let (problem, y, _) = regulator(&a, &b, &q_inverse, &matrix([[1.0 / r]]));
    let answer = problem.solve(&Options::default()).unwrap();
    let trace = answer.value(&y.trace())[(0, 0)];
    (answer, trace)
}

/// tr P⁻¹ for Q = diag(q₁, q₂): p₁₂ = √(q₁ r), p₂₂ = √(r (q₂ + 2 p₁₂)), p₁₁ = p₁₂ p₂₂ / r.
fn closed_form(q1: f64, q2: f64, r: f64) -> f64 {
    let p12 = (q1 * r).sqrt();
    let p22 = (r * (q2 + 2.0 * p12)).sqrt();
    let p11 = p12 * p22 / r;
    (p11 + p22) / (p11 * p22 - p12 * p12)
}

/// The gap promises 1e-7 of 1 + |objective|; the closed form of a tiny trace holds to more than that.
fn close(trace: f64, expected: f64) -> bool {
    (trace - expected).abs() <= 1e-6 * expected + 1e-8
}

#[test]
fn a_nearly_free_input_is_solved() {
    for r in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-16, 1e-20] {
        let (answer, trace) = double_integrator(Mat::identity(2, 2), r);
        let expected = closed_form(1.0, 1.0, r);
        assert!(matches!(answer.outcome, Outcome::Solved), "R = {r:e}: {:?}", answer.outcome);
        assert!(close(trace, expected), "R = {r:e}: {trace} {expected}");
        assert!(answer.blocks[0].verified_lower_bound > 0.0);
    }
}

#[test]
fn an_enormous_weight_is_solved() {
    for q2 in [1.0, 1e5, 1e10, 1e15, 1e20] {
        let (answer, trace) = double_integrator(matrix([[1.0, 0.0], [0.0, 1.0 / q2]]), 0.1);
        let expected = closed_form(1.0, q2, 0.1);
        assert!(matches!(answer.outcome, Outcome::Solved), "q₂ = {q2:e}: {:?}", answer.outcome);
        assert!(close(trace, expected), "q₂ = {q2:e}: {trace} {expected}");
    }
}

/// Both weights together, far beyond what double precision holds: whatever is said must not be wrong.
#[test]
fn no_scale_makes_a_stabilizable_plant_infeasible() {
    for q in [-20, -10, 0, 10, 20] {
        for r in [-20, -10, 0, 10, 20] {
            let (q2, r) = (10.0_f64.powi(q), 10.0_f64.powi(r));
            let (answer, trace) = double_integrator(matrix([[1.0, 0.0], [0.0, 1.0 / q2]]), r);
            let expected = closed_form(1.0, q2, r);
            match answer.outcome {
                Outcome::Solved | Outcome::SolvedToTolerance(_) => {
                    assert!(close(trace, expected), "q₂ = {q2:e}, r = {r:e}: {trace} {expected}")
                }
                Outcome::Inaccurate(_) => {}
                other => panic!("q₂ = {q2:e}, r = {r:e}: {other:?}"),
            }
        }
    }
}

#[test]
fn a_nearly_singular_weight_is_not_infeasible() {
    // Q = [1, 1; 1, 1 + 2⁻⁵²], whose inverse is exact.
    let e = 2.0_f64.powi(52);
    let (answer, _) = double_integrator(matrix([[e + 1.0, -e], [-e, e]]), 0.1);
    assert!(!matches!(answer.outcome, Outcome::Infeasible(_) | Outcome::Unbounded(_)), "{:?}", answer.outcome);
}

/// Unknowns whose coefficients are zero up to rounding at some inequalities, as sin kπ is: the answer is the one without
/// them.
#[test]
fn rounding_errors_are_no_coefficients() {
    let plants = [-1.0, 0.4, 1.0].map(|k| (matrix([[0.0, 1.0], [k, -0.1]]), matrix([[0.0], [1.0]])));
    let optimum = |zero: f64| {
        let mut problem = Problem::new();
        let ys: Vec<Expr> = (0..3).map(|i| problem.symmetric(format!("Y{i}"), 2)).collect();
        let ls: Vec<Expr> = (0..3).map(|i| problem.rectangular(format!("L{i}"), 1, 2)).collect();
        let mut trace = Expr::zeros(1, 1);
        for (k, (a, b)) in plants.iter().enumerate() {
            // 1, cos ρ, sin ρ at ρ = 0, π/2, π
            let factors = [[1.0, 1.0, zero], [1.0, zero, 1.0], [1.0, -1.0, zero]][k];
            let sum = |of: &[Expr]| of.iter().zip(factors).skip(1).fold(of[0].clone(), |sum, (e, f)| sum + f * e);
            let (y, l) = (sum(&ys), sum(&ls));
            let flow = a * &y - b * &l;
            let block = Expr::symmetric_blocks(vec![
                vec![-(&flow + flow.t())],
                vec![y.clone(), Expr::identity(2)],
                vec![l, Expr::zeros(1, 2), Expr::constant(matrix([[1e7]]))],
            ]);
            problem.positive_definite(format!("performance {k}"), block);
            trace = trace + y.trace();
        }
        problem.maximize(&trace);
        let answer = problem.solve(&Options::default()).unwrap();
        assert!(matches!(answer.outcome, Outcome::Solved), "{zero:e}: {:?} {:?}", answer.outcome, answer.residuals);
        answer.objective
    };
    let without = optimum(0.0);
    for zero in [1e-14, 1.2e-16, -2.4e-16, 1e-30] {
        assert!((optimum(zero) / without - 1.0).abs() < 1e-6, "{zero:e}");
    }
}

/// A stream of numbers in (−1, 1) from a seed.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as f64) / f64::from(1_u32 << 30) - 1.0
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    /// A random regulator in other units: states x = T z, inputs u = U v, the whole block multiplied by c.
    #[test]
    fn other_units_change_nothing(seed: u64, n in 2_usize..5, powers in prop::collection::vec(-4_i32..5, 8), c in -8_i32..9) {
        let mut numbers = Numbers(seed);
        let a = Mat::from_fn(n, n, |_, _| 2.0 * numbers.next());
        let b = Mat::from_fn(n, 2, |i, j| numbers.next() + if i == j { 2.0 } else { 0.0 });
        let power = |k: i32| 10.0_f64.powi(k);
        let weights: Vec<f64> = (0..n).map(|_| 1.5 + numbers.next()).collect();
        let solve = |t: &dyn Fn(usize) -> f64, u: &dyn Fn(usize) -> f64, c: f64| {
            let scaled_a = Mat::from_fn(n, n, |i, j| a[(i, j)] / t(i) * t(j));
            let scaled_b = Mat::from_fn(n, 2, |i, j| b[(i, j)] / t(i) * u(j));
            let q_inverse = Mat::from_fn(n, n, |i, j| if i == j { weights[i] / t(i) / t(i) * c } else { 0.0 });
            let r_inverse = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 / u(i) / u(i) * c } else { 0.0 });
            let (mut problem, y, _) = regulator(&scaled_a, &scaled_b, &q_inverse, &r_inverse);
            let units = Mat::from_fn(n, n, |i, j| if i == j { t(i) * t(i) / c } else { 0.0 });
            problem.maximize(&(&units * &y).trace());
            problem.solve(&Options::default()).unwrap()
        };
        let plain = solve(&|_| 1.0, &|_| 1.0, 1.0);
        let scaled = solve(&|i| power(powers[i]), &|i| power(powers[4 + i]), power(c));
        prop_assert!(matches!(plain.outcome, Outcome::Solved), "{:?}", plain.outcome);
        prop_assert!(matches!(scaled.outcome, Outcome::Solved), "{:?} {:?}", scaled.outcome, scaled.residuals);
        prop_assert!((scaled.objective / plain.objective - 1.0).abs() <= 1e-5, "{} {}", plain.objective, scaled.objective);
        prop_assert!(scaled.balancing.after.1 / scaled.balancing.after.0 <= scaled.balancing.before.1 / scaled.balancing.before.0);
    }
}
