//! The modelling layer: arithmetic against the same arithmetic on matrices, sizes, and messages.

use crate::plants::matrix;
use lmi::{Error, Expr, Mat, Options, Outcome, Problem};
use std::panic::{AssertUnwindSafe, catch_unwind};

fn close(a: &Mat<f64>, b: &Mat<f64>) -> bool {
    a.nrows() == b.nrows() && a.ncols() == b.ncols() && (a - b).norm_max() < 1e-12
}

/// A solved problem whose unknowns have values without pattern: expressions can be evaluated at it.
fn sample() -> (lmi::Answer, Expr, Expr, Expr) {
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 2);
    let l = problem.rectangular("L", 2, 3);
    let t = problem.scalar("t");
    let around = |e: &Expr, center: &Mat<f64>| {
        let difference = e - center;
        let (rows, cols) = (difference.nrows(), difference.ncols());
        Expr::symmetric_blocks(vec![
            vec![Expr::constant(1e-6 * Mat::<f64>::identity(rows, rows))],
            vec![difference.t(), Expr::constant(1e-6 * Mat::<f64>::identity(cols, cols))],
        ])
    };
    problem.positive_definite("Y", around(&y, &matrix([[1.0, 0.3], [0.3, 2.0]])));
    problem.positive_definite("L", around(&l, &matrix([[0.1, -0.4, 0.9], [1.7, 0.2, -0.6]])));
    problem.positive_definite("t", around(&t, &matrix([[-0.7]])));
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
    (answer, y, l, t)
}

#[test]
fn expressions_evaluate_like_matrices() {
    let (answer, y, l, t) = sample();
    let (yv, lv, tv) = (answer.value(&y), answer.value(&l), answer.value(&t)[(0, 0)]);
    assert!((yv[(0, 1)] - 0.3).abs() < 1e-5 && (tv + 0.7).abs() < 1e-5);
    let a = matrix([[1.0, 2.0], [-3.0, 0.5]]);
    assert!(close(&answer.value(&(&a * &y)), &(&a * &yv)));
    assert!(close(&answer.value(&(&y * &a)), &(&yv * &a)));
    assert!(close(&answer.value(&(&l.t() * &a)), &(lv.transpose() * &a)));
    assert!(close(&answer.value(&(&a * &l).t()), &(&a * &lv).transpose().to_owned()));
    assert!(close(&answer.value(&(2.0 * &y - &a + y.clone() * 0.5)), &(2.5 * &yv - &a)));
    assert!(close(&answer.value(&-(&a - &y)), &(&yv - &a)));
    assert!(close(&answer.value(&l.row(1)), &lv.subrows(1, 1).to_owned()));
    assert!(close(&answer.value(&l.columns(1..3)), &lv.subcols(1, 2).to_owned()));
    assert!(close(&answer.value(&t.times(&a)), &(tv * &a)));
    assert!(close(&answer.value(&(&a * t.times(&a)).t()), &(tv * &a * &a).transpose().to_owned()));
    let trace = answer.value(&(&a * &y + t.times(&a)).trace())[(0, 0)];
    let expected = (&a * &yv)[(0, 0)] + (&a * &yv)[(1, 1)] + tv * 1.5;
    assert!((trace - expected).abs() < 1e-12);
    let product = &l * Mat::<f64>::from_fn(3, 2, |i, j| (i + 2 * j) as f64);
    let trace = answer.value(&product.t().trace())[(0, 0)];
    assert!((trace - answer.value(&product.trace())[(0, 0)]).abs() < 1e-12);
}

#[test]
fn blocks_stand_where_they_are_put() {
    let (answer, y, l, _) = sample();
    let (yv, lv) = (answer.value(&y), answer.value(&l));
    let f = answer.value(&Expr::symmetric_blocks(vec![vec![y.clone()], vec![l.t(), Expr::identity(3)]]));
    assert!(close(&f.submatrix(0, 2, 2, 3).to_owned(), &lv));
    assert!(close(&f.submatrix(2, 0, 3, 2).to_owned(), &lv.transpose().to_owned()));
    assert!(close(&f.submatrix(0, 0, 2, 2).to_owned(), &yv));
    let g = answer.value(&Expr::blocks(vec![vec![y.clone(), l.clone()], vec![Expr::zeros(1, 2), l.row(0)]]));
    assert!(close(&g.submatrix(2, 2, 1, 3).to_owned(), &lv.subrows(0, 1).to_owned()));
    assert!(close(&g.submatrix(0, 2, 2, 3).to_owned(), &lv));
}

/// The message of a panic.
fn message(f: impl FnOnce()) -> String {
    let payload = catch_unwind(AssertUnwindSafe(f)).expect_err("a panic was expected");
    payload.downcast_ref::<String>().cloned().unwrap_or_default()
}

#[test]
fn wrong_sizes_panic_with_both_sizes() {
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 2);
    let l = problem.rectangular("L", 2, 3);
    let a = Mat::<f64>::zeros(4, 3);
    for text in [
        message(|| drop(&a * &y)),
        message(|| drop(&l * &Mat::<f64>::zeros(4, 3))),
        message(|| drop(&y + &l)),
        message(|| drop(&y - &a)),
        message(|| drop(l.trace())),
        message(|| drop(l.times(&a))),
        message(|| drop(l.row(2))),
        message(|| drop(l.columns(2..4))),
    ] {
        let digits = text.chars().filter(char::is_ascii_digit).count();
        assert!(digits >= 2 && text.contains('×'), "{text}");
    }
    let text = message(|| drop(Expr::symmetric_blocks(vec![vec![y.clone()], vec![l.clone(), y.clone()]])));
    assert!(text.contains("block (1, 0) is 2 × 3, 2 × 2 expected"), "{text}");
    let text = message(|| drop(Expr::symmetric_blocks(vec![vec![y.clone()], vec![y.clone()]])));
    assert!(text.contains("row 1") && text.contains("2 expected"), "{text}");
    let text = message(|| drop(Expr::blocks(vec![vec![y.clone()], vec![l.clone()]])));
    assert!(text.contains("2 × 3"), "{text}");
}

#[test]
fn malformed_problems_are_errors() {
    let options = Options::default();
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 2);
    let l = problem.rectangular("L", 2, 3);
    assert_eq!(problem.solve(&options).unwrap_err(), Error::NoConstraint);

    problem.positive_definite("skew", &y + matrix([[0.0, 1.0], [0.0, 0.0]]));
    let error = problem.solve(&options).unwrap_err();
    assert!(matches!(error, Error::NotSymmetric { row: 0, column: 1, .. }), "{error}");
    assert!(error.to_string().contains("symmetric_blocks"), "{error}");

    let with = |f: Expr| {
        let mut problem = Problem::new();
        let _ = (problem.symmetric("Y", 2), problem.rectangular("L", 2, 3));
        problem.positive_definite("F", f);
        problem.solve(&options)
    };
    assert!(matches!(with(l.clone()), Err(Error::ForeignUnknown { .. } | Error::NotSquare { .. })));
    assert!(matches!(with(Expr::zeros(2, 3)), Err(Error::NotSquare { rows: 2, columns: 3, .. })));
    assert!(matches!(with(y.clone()), Err(Error::ForeignUnknown { .. })));
    let nan = matrix([[1.0, f64::NAN], [f64::NAN, 1.0]]);
    assert!(matches!(with(Expr::constant(nan)), Err(Error::NotFinite { row: 1, column: 0, .. })));

    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 2);
    let a = matrix([[0.0, f64::INFINITY], [0.0, 0.0]]);
    problem.positive_definite("F", &a * &y + (&a * &y).t());
    assert!(matches!(problem.solve(&options), Err(Error::NotFinite { .. })));

    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 2);
    problem.positive_definite("Y", y.clone());
    problem.minimize(&y);
    assert!(matches!(problem.solve(&options), Err(Error::ObjectiveNotScalar { rows: 2, columns: 2 })));
    problem.minimize(&y.trace());
    let bad = Options { gap_tolerance: -1.0, ..Options::default() };
    assert!(matches!(problem.solve(&bad), Err(Error::BadOption { option: "gap_tolerance", .. })));
    problem.positive_definite_by("Y", y, f64::NAN);
    assert!(matches!(problem.solve(&options), Err(Error::NotFinite { .. })));
}

#[test]
fn wrong_signs_are_told_from_right_ones() {
    // The non-symmetric part of A Y alone is caught although its known part is symmetric.
    let mut problem = Problem::new();
    let y = problem.symmetric("Y", 2);
    problem.positive_definite("A Y", matrix([[1.0, 2.0], [0.0, 1.0]]) * &y);
    assert!(matches!(problem.solve(&Options::default()), Err(Error::NotSymmetric { .. })));
}

#[test]
fn sharing_one_unknown_between_sparse_and_factored_parts() {
    // max λ with A − λI ⪰ 0 written three ways.
    let a = matrix([[3.0, 1.0, 0.0], [1.0, 2.0, -1.0], [0.0, -1.0, 4.0]]);
    let expected = a.self_adjoint_eigenvalues(faer::Side::Lower).unwrap()[0];
    for way in 0..3 {
        let mut problem = Problem::new();
        let t = problem.scalar("t");
        let e = |i: usize| Mat::<f64>::from_fn(3, 1, |r, _| if r == i { 1.0 } else { 0.0 });
        let column = |i: usize| &e(i) * &t * &e(i).transpose().to_owned();
        let shifted = match way {
            0 => t.times(&Mat::identity(3, 3)),
            1 => column(0) + column(1) + column(2),
            _ => column(0) + t.times(&(e(1) * e(1).transpose() + e(2) * e(2).transpose())),
        };
        problem.positive_definite("A − tI", &a - shifted);
        problem.maximize(&t);
        let answer = problem.solve(&Options::default()).unwrap();
        assert!(matches!(answer.outcome, Outcome::Solved), "{way}: {:?}", answer.outcome);
        assert!((answer.objective - expected).abs() < 1e-7, "{way}: {} {expected}", answer.objective);
    }
}

/// Callers solve many problems in parallel.
/// A scalar times a constant and a matrix unknown in products of other shapes share one block: the largest t with
/// t·C ⪯ Y, Y ⪯ I and [1, aᵀY; Ya, I] ⪰ 0.
#[test]
fn scalars_and_matrices_in_one_block() {
    let mut problem = Problem::new();
    let (t, y) = (problem.scalar("t"), problem.symmetric("Y", 3));
    let c = matrix([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 4.0]]);
    let column = matrix([[0.5], [0.0], [0.0]]);
    problem.positive_definite_by("scaled", &y - t.times(&c), 0.0);
    let product = &y * &column;
    let block = Expr::symmetric_blocks(vec![
        vec![Expr::identity(1) - &t],
        vec![product, Expr::identity(3) - t.times(&Mat::from_fn(3, 3, |i, j| if i == j { 0.1 } else { 0.0 }))],
    ]);
    problem.positive_definite_by("mixed", block, 0.0);
    problem.positive_definite_by("bounded", Expr::identity(3) - &y, 0.0);
    problem.maximize(&t);
    let answer = problem.solve(&Options::default()).unwrap();
    assert!(matches!(answer.outcome, Outcome::Solved));
    // Y = I allows t = 1/4; the mixed block then holds with room
    assert!((answer.objective - 0.25).abs() < 1e-7, "{}", answer.objective);
}

#[test]
fn everything_can_move_between_threads() {
    fn check<T: Send + Sync>() {}
    check::<Problem>();
    check::<Expr>();
    check::<Options>();
    check::<lmi::Answer>();
    check::<lmi::sdpa::Sdp>();
}
