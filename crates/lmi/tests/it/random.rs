//! Random problems with a known answer.

use lmi::sdpa::{BlockShape, Coefficient, Sdp};
use lmi::{Expr, Mat, Options, Outcome, Problem};
use proptest::prelude::*;

/// A stream of numbers in (−1, 1) from a seed.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as f64) / f64::from(1_u32 << 30) - 1.0
    }

    fn matrix(&mut self, rows: usize, cols: usize) -> Mat<f64> {
        Mat::from_fn(rows, cols, |_, _| self.next())
    }

    fn symmetric(&mut self, n: usize) -> Mat<f64> {
        let m = self.matrix(n, n);
        0.5 * (&m + m.transpose())
    }

    fn orthogonal(&mut self, n: usize) -> Mat<f64> {
        self.matrix(n, n).qr().compute_thin_Q()
    }
}

fn inner(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    (0..a.ncols()).map(|j| (0..a.nrows()).map(|i| a[(i, j)] * b[(i, j)]).sum::<f64>()).sum()
}

/// Q diag(d) Qᵀ.
fn with_spectrum(q: &Mat<f64>, d: impl Fn(usize) -> f64) -> Mat<f64> {
    let n = q.nrows();
    let scaled = Mat::from_fn(n, n, |i, j| q[(i, j)] * d(j));
    let m = scaled * q.transpose();
    0.5 * (&m + m.transpose())
}

/// minimise cᵀx over blocks C + Σ xᵢFᵢ ⪰ 0, in both doors' forms.
struct Instance {
    c: Vec<f64>,
    constants: Vec<Mat<f64>>,
    coefficients: Vec<Vec<Mat<f64>>>,
}

impl Instance {
    fn modelled(&self) -> Problem {
        let mut problem = Problem::new();
        let x: Vec<Expr> = (0..self.c.len()).map(|i| problem.scalar(format!("x{i}"))).collect();
        for (b, constant) in self.constants.iter().enumerate() {
            let f = x.iter().zip(&self.coefficients[b]).fold(Expr::from(constant), |f, (x, m)| f + x.times(m));
            problem.positive_definite_by(format!("F{b}"), f, 0.0);
        }
        let cost = x.iter().zip(&self.c).fold(Expr::zeros(1, 1), |sum, (x, &c)| sum + c * x);
        problem.minimize(&cost);
        problem
    }

    fn sdp(&self) -> Sdp {
        let mut coefficients = Vec::new();
        let mut add = |unknown: Option<usize>, block: usize, m: &Mat<f64>, sign: f64| {
            for column in 0..m.ncols() {
                for row in 0..=column {
                    coefficients.push(Coefficient { unknown, block, row, column, value: sign * m[(row, column)] });
                }
            }
        };
        for (block, constant) in self.constants.iter().enumerate() {
            add(None, block, constant, -1.0);
            self.coefficients[block].iter().enumerate().for_each(|(i, m)| add(Some(i), block, m, 1.0));
        }
        let blocks = self.constants.iter().map(|m| BlockShape::Symmetric(m.nrows())).collect();
        Sdp { objective: self.c.clone(), blocks, coefficients }
    }

    fn outcomes(&self) -> [lmi::Answer; 2] {
        let options = Options::default();
        [self.modelled().solve(&options).unwrap(), self.sdp().solve(&options).unwrap()]
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    /// S* and Z* share eigenvectors and are complementary: c = A(Z*), C = S* − F(x*) make them optimal.
    #[test]
    fn known_optimum(seed: u64, m in 1_usize..8, sizes in prop::collection::vec(1_usize..7, 1..4)) {
        let mut numbers = Numbers(seed);
        let x: Vec<f64> = (0..m).map(|_| numbers.next()).collect();
        let mut c = vec![0.0; m];
        let (mut constants, mut coefficients) = (Vec::new(), Vec::new());
        for &n in &sizes {
            let q = numbers.orthogonal(n);
            let rank = n - n / 2;
            let spectrum: Vec<f64> = (0..n).map(|_| 0.2 + numbers.next().abs()).collect();
            let s = with_spectrum(&q, |i| if i < rank { spectrum[i] } else { 0.0 });
            let z = with_spectrum(&q, |i| if i < rank { 0.0 } else { spectrum[i] });
            let f: Vec<Mat<f64>> = (0..m).map(|_| numbers.symmetric(n)).collect();
            let mut constant = s;
            for i in 0..m {
                constant -= x[i] * &f[i];
                c[i] += inner(&f[i], &z);
            }
            constants.push(constant);
            coefficients.push(f);
        }
        // Interior on both sides is not implied: a bounded box gives it to the primal, and to the dual.
        let optimum: f64 = c.iter().zip(&x).map(|(c, x)| c * x).sum();
        for i in 0..m {
            for sign in [1.0, -1.0] {
                constants.push(Mat::from_fn(1, 1, |_, _| 10.0));
                coefficients.push((0..m).map(|j| Mat::from_fn(1, 1, |_, _| if i == j { sign } else { 0.0 })).collect());
            }
        }
        let instance = Instance { c, constants, coefficients };
        for answer in instance.outcomes() {
            // Without an interior the solver may stop short, but never claim a wrong optimum.
            match &answer.outcome {
                Outcome::Solved => {
                    prop_assert!((answer.objective - optimum).abs() < 3e-6 * (1.0 + optimum.abs()),
                        "{} {optimum}", answer.objective);
                    // x* is feasible but for its own rounding.
                    let bound = answer.optimum_bound.unwrap().value;
                    prop_assert!(bound <= optimum + 1e-13 * (1.0 + optimum.abs()), "{bound:e} {optimum:e}");
                    prop_assert!(bound >= optimum - 1e-4 * (1.0 + optimum.abs()), "{bound:e} {optimum:e}");
                }
                Outcome::SolvedToTolerance(_) | Outcome::Inaccurate(_) => prop_assert!((answer.objective - optimum).abs() < 1e-3 * (1.0 + optimum.abs())),
                other => prop_assert!(false, "{other:?}"),
            }
        }
    }

    /// Z ≻ 0 with A(Z) = 0 and ⟨C, Z⟩ < 0 excludes every x.
    #[test]
    fn known_witness(seed: u64, m in 1_usize..8, n in 2_usize..7) {
        let mut numbers = Numbers(seed);
        let q = numbers.orthogonal(n);
        let spectrum: Vec<f64> = (0..n).map(|_| 0.2 + numbers.next().abs()).collect();
        let z = with_spectrum(&q, |i| spectrum[i]);
        let square = inner(&z, &z);
        let f: Vec<Mat<f64>> = (0..m)
            .map(|_| {
                let f = numbers.symmetric(n);
                &f - (inner(&f, &z) / square) * &z
            })
            .collect();
        let constant = {
            let c = numbers.symmetric(n);
            &c - ((inner(&c, &z) + 1.0) / square) * &z
        };
        let instance = Instance { c: (0..m).map(|_| numbers.next()).collect(), constants: vec![constant], coefficients: vec![f] };
        for answer in instance.outcomes() {
            // From as many matrices as there are entries something far out may satisfy the rounded data.
            let (Outcome::Infeasible(witness) | Outcome::InfeasibleWithin(witness)) = &answer.outcome else {
                return Err(TestCaseError::fail(format!("{:?} {:?}", answer.outcome, answer.residuals)));
            };
            let z = &witness.multipliers[0];
            for f in &instance.coefficients[0] {
                prop_assert!(inner(f, z).abs() < 1e-6);
            }
            prop_assert!((inner(&instance.constants[0], z) + 1.0).abs() < 1e-6);
        }
    }

    /// F(d) ≻ 0 and cᵀd < 0: feasible, and without end.
    #[test]
    fn known_ray(seed: u64, m in 1_usize..8, n in 1_usize..7) {
        let mut numbers = Numbers(seed);
        let q = numbers.orthogonal(n);
        let mut f: Vec<Mat<f64>> = (0..m).map(|_| numbers.symmetric(n)).collect();
        f[0] = with_spectrum(&q, |i| 0.5 + i as f64);
        let mut c: Vec<f64> = (0..m).map(|_| numbers.next()).collect();
        c[0] = -0.5 - c[0].abs();
        let instance = Instance { c, constants: vec![numbers.symmetric(n)], coefficients: vec![f] };
        for answer in instance.outcomes() {
            prop_assert!(
                matches!(answer.outcome, Outcome::Unbounded(_) | Outcome::UnboundedToTolerance(_)),
                "{:?}", answer.outcome
            );
        }
    }

    /// The structured Schur complement and the sparse one solve the same problem: Lyapunov inequalities by matrix unknown
    /// and scalar by scalar.
    #[test]
    fn structured_and_sparse_forms_agree(seed: u64, n in 2_usize..6, k in 1_usize..4) {
        let mut numbers = Numbers(seed);
        let a = numbers.matrix(n, n) - 2.0 * Mat::<f64>::identity(n, n);
        let b = numbers.matrix(n, k);
        let build = |expanded: bool| {
            let mut problem = Problem::new();
            let (y, l) = if expanded {
                let mut y = Expr::zeros(n, n);
                for i in 0..n {
                    for j in 0..=i {
                        let e = Mat::from_fn(n, n, |r, c| if (r, c) == (i, j) || (r, c) == (j, i) { 1.0 } else { 0.0 });
                        y = y + problem.scalar(format!("y{i}{j}")).times(&e);
                    }
                }
                let mut l = Expr::zeros(k, n);
                for i in 0..k {
                    for j in 0..n {
                        let e = Mat::from_fn(k, n, |r, c| if (r, c) == (i, j) { 1.0 } else { 0.0 });
                        l = l + problem.scalar(format!("l{i}{j}")).times(&e);
                    }
                }
                (y, l)
            } else {
                (problem.symmetric("Y", n), problem.rectangular("L", k, n))
            };
            let s = &a * &y - &b * &l;
            problem.positive_definite("Riccati", Expr::symmetric_blocks(vec![
                vec![-(&s + s.t())],
                vec![y.clone(), Expr::identity(n)],
                vec![l.clone(), Expr::zeros(k, n), Expr::identity(k)],
            ]));
            problem.maximize(&y.trace());
            problem.solve(&Options::default()).unwrap()
        };
        let (structured, sparse) = (build(false), build(true));
        prop_assert!(matches!(structured.outcome, Outcome::Solved), "{:?}", structured.outcome);
        prop_assert!(matches!(sparse.outcome, Outcome::Solved), "{:?}", sparse.outcome);
        prop_assert!((structured.objective - sparse.objective).abs() < 1e-6 * (1.0 + sparse.objective.abs()));
    }
}

/// Graph equipartition, minimise Σ yᵢ over y₀eeᵀ + Diag(y) − L ⪰ 0: its multipliers Z have eᵀZe = 0, no interior, and y₀ may grow without
/// end. On the complement of e there is nothing of that, and the optimum is the same.
#[test]
fn multipliers_without_interior() {
    let cases = 40;
    let mut solved = 0;
    for seed in 0..cases {
        let mut numbers = Numbers(seed);
        let n = 10 + seed as usize;
        let weights = Mat::from_fn(n, n, |_, _| f64::from(u8::from(numbers.next() > 0.6)));
        let weight = |i: usize, j: usize| weights[(i.max(j), i.min(j))];
        let degree = |i: usize| (0..n).filter(|&j| j != i).map(|j| weight(i, j)).sum::<f64>();
        let laplacian = Mat::from_fn(n, n, |i, j| if i == j { degree(i) } else { -weight(i, j) });
        let whole = bound(&laplacian, |problem, f| f + problem.scalar("y0").times(&Mat::from_fn(n, n, |_, _| 1.0)));
        // Columns e_i − e_{n−1}.
        let complement = Mat::from_fn(n, n - 1, |i, j| f64::from(i8::from(i == j) - i8::from(i == n - 1)));
        let reduced = bound(&laplacian, |_, f| complement.transpose().to_owned() * f * &complement);
        assert!(matches!(reduced.outcome, Outcome::Solved), "{seed}: {:?}", reduced.outcome);
        assert!(
            whole.outcome.is_optimal() || matches!(whole.outcome, Outcome::Inaccurate(_)),
            "{seed}: {:?}",
            whole.outcome
        );
        // What y₀ may grow to is not bounded, and so no bound holds for every y.
        solved += usize::from(whole.outcome.is_optimal());
        let difference = (whole.objective - reduced.objective).abs() / (1.0 + reduced.objective.abs());
        assert!(difference < 1e-6, "{seed}: {} {}", whole.objective, reduced.objective);
    }
    assert!(10 * solved >= 9 * cases as usize, "{solved} of {cases}");
}

/// minimise Σ yᵢ over F(Diag(y) − L) ⪰ 0.
fn bound(laplacian: &Mat<f64>, f: impl Fn(&mut Problem, Expr) -> Expr) -> lmi::Answer {
    let n = laplacian.nrows();
    let mut problem = Problem::new();
    let y: Vec<Expr> = (0..n).map(|i| problem.scalar(format!("y{i}"))).collect();
    let unit = |at: usize| Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == at && j == at)));
    let diagonal = y.iter().enumerate().fold(Expr::from(-laplacian), |sum, (i, y)| sum + y.times(&unit(i)));
    let block = f(&mut problem, diagonal);
    problem.positive_definite_by("bound", block, 0.0);
    problem.minimize(&y.iter().fold(Expr::zeros(1, 1), |sum, y| sum + y));
    problem.solve(&Options::default()).unwrap()
}
