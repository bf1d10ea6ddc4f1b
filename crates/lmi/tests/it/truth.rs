//! Problems whose truth is known exactly, from comparisons of doubles or from integers: no word may say more than is true of the data as read.

use lmi::sdpa::{BlockShape, Coefficient, Sdp};
use lmi::{Answer, Expr, Mat, Options, Outcome, Problem};
use std::collections::BTreeMap;

/// What is true of a problem.
#[derive(Clone, Copy, Debug)]
enum Truth {
    /// Feasible, with an optimum between two numbers.
    Optimum(f64, f64),
    /// Feasible; the objective is bounded.
    Feasible,
    Infeasible,
    Unbounded,
}

/// How often each word was given.
#[derive(Default)]
struct Words(BTreeMap<&'static str, usize>);

impl Words {
    /// No word is false, nor is a bound.
    fn check(&mut self, answer: &Answer, truth: Truth, what: &str) {
        let word = answer.outcome.word();
        *self.0.entry(word).or_default() += 1;
        let allowed = match truth {
            Truth::Optimum(..) | Truth::Feasible => &["solved", "solved to tolerance", "unbounded to tolerance"][..],
            // What comes as near to feasible as one likes may be solved to tolerance.
            Truth::Infeasible => {
                &["infeasible", "infeasible within a radius", "solved to tolerance", "unbounded to tolerance"]
            }
            Truth::Unbounded => &["unbounded", "unbounded to tolerance", "solved to tolerance"],
        };
        assert!(word == "inaccurate" || allowed.contains(&word), "{what}: {truth:?} is called {word}: {answer:?}");
        let feasible = !matches!(truth, Truth::Infeasible);
        if let Outcome::SolvedToTolerance(tolerance) = &answer.outcome {
            assert!(feasible || tolerance.violation > 0.0, "{what}: {tolerance:?}");
        }
        assert!(feasible || answer.attained.is_none(), "{what}: {:?} is attained", answer.attained);
        if let Truth::Optimum(low, high) = truth {
            let bound = answer.optimum_bound.map_or(f64::NEG_INFINITY, |bound| bound.value);
            assert!(bound <= high, "{what}: {bound:e} is no bound on {high:e}");
            assert!(answer.attained.is_none_or(|p| p >= low), "{what}: {:?} is below {low:e}", answer.attained);
        }
    }

    fn share(&self, word: &str) -> f64 {
        *self.0.get(word).unwrap_or(&0) as f64 / self.0.values().sum::<usize>() as f64
    }

    fn print(&self, what: &str) {
        println!("{what}: {:?}", self.0);
    }
}

fn entry(unknown: Option<usize>, block: usize, row: usize, column: usize, value: f64) -> Coefficient {
    Coefficient { unknown, block, row, column, value }
}

fn solve(objective: &[f64], blocks: &[BlockShape], coefficients: Vec<Coefficient>) -> Answer {
    let sdp = Sdp { objective: objective.to_vec(), blocks: blocks.to_vec(), coefficients };
    sdp.solve(&Options::default()).unwrap()
}

/// 10⁻³, …, 10⁻¹⁴ with both signs, and zero.
fn distances() -> impl Iterator<Item = f64> {
    (3..=14).flat_map(|e| [10.0_f64.powi(-e), -(10.0_f64.powi(-e))]).chain([0.0])
}

const SCALES: [f64; 3] = [1e-8, 1.0, 1e8];

/// Minimise x over a ≤ x ≤ b: comparisons of doubles.
#[test]
fn intervals() {
    let mut words = Words::default();
    for scale in SCALES {
        for distance in distances() {
            let (a, b) = (scale, scale * (1.0 + distance));
            let truth = if a <= b { Truth::Optimum(a, a) } else { Truth::Infeasible };
            let coefficients = |diagonal: bool| {
                let other = usize::from(!diagonal);
                let place = usize::from(diagonal);
                vec![
                    entry(None, 0, 0, 0, a),
                    entry(Some(0), 0, 0, 0, 1.0),
                    entry(None, other, place, place, -b),
                    entry(Some(0), other, place, place, -1.0),
                ]
            };
            let what = format!("{a:e} ≤ x ≤ {b:e}");
            words.check(&solve(&[1.0], &[BlockShape::Diagonal(2)], coefficients(true)), truth, &what);
            words.check(&solve(&[1.0], &[BlockShape::Symmetric(1); 2], coefficients(false)), truth, &what);
            // Strictly, a = b has no solution.
            let mut problem = Problem::new();
            let x = problem.scalar("x");
            let one = |value: f64| Expr::constant(Mat::from_fn(1, 1, |_, _| value));
            problem.positive_definite("a < x", &x - one(a));
            problem.positive_definite("x < b", one(b) - &x);
            problem.minimize(&x);
            let truth = if a < b { Truth::Optimum(a, a) } else { Truth::Infeasible };
            words.check(&problem.solve(&Options::default()).unwrap(), truth, &format!("{what}, strictly"));
        }
    }
    words.print("intervals");
    assert!(words.share("solved") > 0.2 && words.share("infeasible") > 0.2);
}

/// Minimise x over [kx, ks; ks, k(2 − x)] ⪰ 0, k a power of two: x(2 − x) ≥ s², which is at most 1. The optimum is 1 − √(1 − s²).
#[test]
fn two_by_two_blocks() {
    let mut words = Words::default();
    for k in [2.0_f64.powi(-27), 1.0, 2.0_f64.powi(27)] {
        for distance in distances() {
            let s: f64 = 1.0 - distance;
            let truth = match s <= 1.0 {
                true => {
                    // 1 − s is exact.
                    let optimum = 1.0 - ((1.0 - s) * (1.0 + s)).sqrt();
                    Truth::Optimum(optimum - 1e-15, optimum + 1e-15)
                }
                false => Truth::Infeasible,
            };
            let coefficients = vec![
                entry(Some(0), 0, 0, 0, k),
                entry(Some(0), 0, 1, 1, -k),
                entry(None, 0, 1, 1, -2.0 * k),
                entry(None, 0, 0, 1, -k * s),
            ];
            words.check(&solve(&[1.0], &[BlockShape::Symmetric(2)], coefficients), truth, &format!("{k:e}, {s:e}"));
        }
    }
    words.print("2 × 2 blocks");
    assert!(words.share("solved") > 0.2 && words.share("infeasible") > 0.2);
}

/// AᵀP + PA ≺ 0, P ≻ 0 for A = [−1, 1; 0, δ]: solvable if and only if δ < 0.
#[test]
fn nearly_stable_matrices() {
    let mut words = Words::default();
    for delta in distances() {
        let a = Mat::from_fn(2, 2, |i, j| [[-1.0, 1.0], [0.0, delta]][i][j]);
        let mut problem = Problem::new();
        let p = problem.symmetric("P", 2);
        problem.positive_definite("decay", -(a.transpose().to_owned() * &p + &p * &a));
        problem.positive_definite("P", p);
        let truth = if delta < 0.0 { Truth::Feasible } else { Truth::Infeasible };
        words.check(&problem.solve(&Options::default()).unwrap(), truth, &format!("δ = {delta:e}"));
    }
    words.print("nearly stable matrices");
    assert!(words.share("solved") > 0.1);
}

/// [x, 1; 1, 0] ⪰ 0 has no solution and comes as near to one as one likes; [t, 1; 1, s] ⪰ 0 has t > 0, as small as one likes.
#[test]
fn weakly_infeasible_and_unattained() {
    let mut words = Words::default();
    for scale in SCALES {
        let weak = vec![entry(Some(0), 0, 0, 0, 1.0), entry(None, 0, 0, 1, -scale)];
        for c in [1.0, 0.0] {
            let answer = solve(&[c], &[BlockShape::Symmetric(2)], weak.clone());
            words.check(&answer, Truth::Infeasible, &format!("[x, {scale:e}; {scale:e}, 0]"));
        }
        let hyperbola = vec![entry(Some(0), 0, 0, 0, 1.0), entry(Some(1), 0, 1, 1, 1.0), entry(None, 0, 0, 1, -scale)];
        let answer = solve(&[1.0, 0.0], &[BlockShape::Symmetric(2)], hyperbola);
        words.check(&answer, Truth::Optimum(0.0, 0.0), &format!("[t, {scale:e}; {scale:e}, s]"));
    }
    words.print("weakly infeasible, unattained");
}

/// Feasible, but only with x₄ ≥ 10¹⁶: x₁ ≥ 10, xₖ₊₁ ≥ xₖ² (L. Khachiyan's example).
#[test]
fn solutions_far_away() {
    let mut words = Words::default();
    for length in 2..7 {
        let mut coefficients = vec![entry(Some(0), 0, 0, 0, 1.0), entry(None, 0, 0, 0, 10.0)];
        for k in 1..length {
            coefficients.push(entry(Some(k), k, 0, 0, 1.0));
            coefficients.push(entry(Some(k - 1), k, 0, 1, 1.0));
            coefficients.push(entry(None, k, 1, 1, -1.0));
        }
        let blocks: Vec<BlockShape> = (0..length).map(|k| BlockShape::Symmetric(if k == 0 { 1 } else { 2 })).collect();
        let mut objective = vec![0.0; length];
        objective[length - 1] = 1.0;
        let answer = solve(&objective, &blocks, coefficients);
        let least = 10.0_f64.powi(1 << (length - 1));
        match &answer.outcome {
            // True as long as what is excluded is smaller than what there is; the units of this problem are powers of ten at most as large.
            Outcome::InfeasibleWithin(witness) => assert!(witness.excluded_radius < least, "{length}: {witness:?}"),
            _ => {
                words.check(&answer, Truth::Optimum(least * (1.0 - 1e-14), least * (1.0 + 1e-14)), &format!("{length}"))
            }
        }
    }
    words.print("solutions far away");
}

/// Minimise ∓εx over x ≥ 0: no end, or zero; and over 0 ≤ x ≤ 1/ε, which ends.
#[test]
fn small_slopes() {
    let mut words = Words::default();
    for slope in distances().filter(|slope| *slope != 0.0) {
        let half_line = vec![entry(Some(0), 0, 0, 0, 1.0)];
        let truth = if slope < 0.0 { Truth::Unbounded } else { Truth::Optimum(0.0, 0.0) };
        let answer = solve(&[slope], &[BlockShape::Symmetric(1)], half_line.clone());
        words.check(&answer, truth, &format!("{slope:e} x"));
        // 1 − |ε| x ≥ 0: x ≤ 1/|ε|, up to the rounding of the quotient.
        let end = [entry(Some(0), 1, 0, 0, -slope.abs()), entry(None, 1, 0, 0, -1.0)];
        let segment = [half_line, end.to_vec()].concat();
        let s = slope.abs();
        let far = -1.0 / s;
        let answer = solve(&[-1.0], &[BlockShape::Symmetric(1); 2], segment);
        let truth = Truth::Optimum(far * (1.0 + 1e-15), far * (1.0 - 1e-15));
        words.check(&answer, truth, &format!("x ≤ {:e}", -far));
        // Far out, by little at each step: −s²x over 1 − s³x ≥ 0 is −1/s at best.
        let far_end =
            vec![entry(Some(0), 0, 0, 0, 1.0), entry(Some(0), 1, 0, 0, -s * s * s), entry(None, 1, 0, 0, -1.0)];
        let answer = solve(&[-s * s], &[BlockShape::Symmetric(1); 2], far_end);
        let optimum = -1.0 / s;
        words.check(&answer, Truth::Optimum(optimum * (1.0 + 1e-14), optimum * (1.0 - 1e-14)), &format!("x ≤ {s:e}⁻³"));
    }
    words.print("small slopes");
    assert!(words.share("unbounded") > 0.15 && words.share("solved") > 0.2);
}

/// A stream of integers from a seed.
struct Integers(u64);

impl Integers {
    /// In −size, …, size.
    fn next(&mut self, size: i64) -> i64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as i64 % (2 * size + 1) - size
    }

    fn symmetric(&mut self, n: usize) -> Vec<i64> {
        let mut m = vec![0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let value = self.next(3);
                (m[i + j * n], m[j + i * n]) = (value, value);
            }
        }
        m
    }

    /// LLᵀ ≻ 0 for a lower triangle L with ones on its diagonal, or positive semidefinite of a rank.
    fn definite(&mut self, n: usize, rank: usize) -> Vec<i64> {
        let l: Vec<i64> = (0..n * n).map(|at| if at % n == at / n { 1 } else { self.next(2) }).collect();
        let entry = |i: usize, k: usize| if i >= k { l[i + k * n] } else { 0 };
        let product = |i: usize, j: usize| (0..rank).map(|k| entry(i, k) * entry(j, k)).sum();
        (0..n * n).map(|at| product(at % n, at / n)).collect()
    }
}

fn inner(a: &[i64], b: &[i64]) -> i64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// One block Σ xᵢFᵢ + C ⪰ 0 of integers, each exactly a double.
fn integers(objective: &[f64], constant: &[i64], matrices: &[Vec<i64>], n: usize) -> Answer {
    let mut coefficients = Vec::new();
    let all = std::iter::once((None, constant)).chain(matrices.iter().enumerate().map(|(k, m)| (Some(k), &m[..])));
    for (unknown, m) in all {
        for j in 0..n {
            for i in 0..=j {
                let sign = if unknown.is_none() { -1.0 } else { 1.0 };
                coefficients.push(entry(unknown, 0, i, j, sign * m[i + j * n] as f64));
            }
        }
    }
    solve(objective, &[BlockShape::Symmetric(n)], coefficients)
}

/// ⟨C, Z⟩ < 0 = ⟨Fᵢ, Z⟩ in integers, for a Z ⪰ 0 of any rank: infeasible.
#[test]
fn infeasible_by_construction() {
    let mut words = [Words::default(), Words::default()];
    for seed in 0..120 {
        let mut numbers = Integers(seed);
        let n = 2 + (seed % 4) as usize;
        let unknowns = 1 + (seed / 4 % 5) as usize;
        let full = seed % 3 != 0;
        let z = numbers.definite(n, if full { n } else { 1 });
        // F⟨E, Z⟩ − ⟨F, Z⟩E is orthogonal to Z.
        let e = numbers.definite(n, n);
        let weight = inner(&e, &z);
        let orthogonal = |m: Vec<i64>| -> Vec<i64> {
            let share = inner(&m, &z);
            m.iter().zip(&e).map(|(m, e)| m * weight - share * e).collect()
        };
        let matrices: Vec<Vec<i64>> = (0..unknowns).map(|_| orthogonal(numbers.symmetric(n))).collect();
        let constant: Vec<i64> = orthogonal(numbers.symmetric(n)).iter().zip(&e).map(|(c, e)| c - e).collect();
        assert!(inner(&constant, &z) < 0 && matrices.iter().all(|m| inner(m, &z) == 0));
        let objective: Vec<f64> = (0..unknowns).map(|_| numbers.next(3) as f64).collect();
        let answer = integers(&objective, &constant, &matrices, n);
        words[usize::from(full)].check(&answer, Truth::Infeasible, &format!("seed {seed}"));
    }
    words[0].print("infeasible by a Z of rank one");
    words[1].print("infeasible by a Z of full rank");
    assert!(words[1].share("infeasible") > 0.5);
}

/// C ≻ 0, so that x = 0 is feasible. With F₁ ≻ 0 and c₁ < 0 there is no end; where c = A(Z) for a Z ⪰ 0 there is one.
#[test]
fn feasible_by_construction() {
    let mut words = [Words::default(), Words::default()];
    for seed in 0..120 {
        let mut numbers = Integers(1000 + seed);
        let n = 2 + (seed % 4) as usize;
        // Fewer than entries: they bound the unknowns.
        let unknowns = (1 + (seed / 4 % 5) as usize).min(n * (n + 1) / 2 - 1);
        let constant = numbers.definite(n, n);
        let mut matrices: Vec<Vec<i64>> = (0..unknowns).map(|_| numbers.symmetric(n)).collect();
        let bounded = seed % 2 == 0;
        let objective: Vec<f64> = if bounded {
            let z = numbers.definite(n, n);
            matrices.iter().map(|m| inner(m, &z) as f64).collect()
        } else {
            matrices[0] = numbers.definite(n, n);
            (0..unknowns).map(|i| if i == 0 { -1.0 } else { numbers.next(3) as f64 }).collect()
        };
        let answer = integers(&objective, &constant, &matrices, n);
        let truth = if bounded { Truth::Feasible } else { Truth::Unbounded };
        words[usize::from(bounded)].check(&answer, truth, &format!("seed {seed}"));
    }
    words[0].print("unbounded");
    words[1].print("bounded");
    assert!(words[0].share("unbounded") > 0.5 && words[1].share("solved") > 0.8);
}
