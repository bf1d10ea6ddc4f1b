//! The inequalities of Theorems 4.1-4.4 and 5.1-5.4 for the vertices of a polytope.
//!
//! Every one is a sum Σᵢⱼ ρᵢρⱼ T(i, j) over convex weights ρ, with T(i, j) in AᵢYⱼ − BᵢLⱼ: positive definite for all ρ if
//! T(i, i) and T(i, j) + T(j, i) are (the thesis's (A.10)). With constant B and common Y, T(i, j) + T(j, i) = T(i, i) +
//! T(j, j), and the second set is not needed (Corollary 4.1).

use super::{InputBounds, Lyapunov};
use crate::math::Mat;
use crate::math::matrix::{inverse_spd, semidefinite_factor};
use crate::model::Polytope;
use crate::synthesis::CostWeights;
use crate::synthesis::inequality::unsaturated;
use lmi::{Expr, Problem};

/// Q = CᵀW⁻¹C and R⁻¹ as the performance inequality holds them: C = I, W = Q⁻¹ for Q ≻ 0 as in the thesis; a factor C of
/// full row rank with W = I where Q is singular.
pub(super) struct Weights {
    output: Mat<f64>,
    output_weight_inverse: Mat<f64>,
    pub r_inverse: Mat<f64>,
}

impl Weights {
    /// `None` if Q is not positive semidefinite or R not positive definite.
    pub fn new(weights: &CostWeights) -> Option<Self> {
        let n = weights.q.nrows();
        let r_inverse = inverse_spd(&weights.r)?;
        if let Some(inverse) = inverse_spd(&weights.q) {
            return Some(Self { output: Mat::identity(n, n), output_weight_inverse: inverse, r_inverse });
        }
        let factor = semidefinite_factor(&weights.q)?;
        let scale = factor.norm_max();
        let columns: Vec<usize> =
            (0..factor.ncols()).filter(|&j| (0..n).any(|i| factor[(i, j)].abs() > 1e-12 * scale)).collect();
        let output = Mat::from_fn(columns.len(), n, |i, j| factor[(j, columns[i])]);
        let p = output.nrows();
        Some(Self { output, output_weight_inverse: Mat::identity(p, p), r_inverse })
    }
}

/// Yᵢ and Lᵢ of every vertex; M too where the input may saturate.
pub(super) struct Unknowns {
    /// Yᵢ: N of them, or N times the one.
    pub y: Vec<Expr>,
    /// Lᵢ
    pub l: Vec<Expr>,
}

impl Unknowns {
    pub fn new(problem: &mut Problem, polytope: &Polytope, lyapunov: &Lyapunov) -> Self {
        let (n, m, count) = (polytope.states(), polytope.inputs(), polytope.len());
        let numbered = |letter: &str, i: usize| if count == 1 { letter.into() } else { format!("{letter}{}", i + 1) };
        let y = match lyapunov {
            Lyapunov::Common => vec![problem.symmetric("Y", n); count],
            Lyapunov::ParameterDependent { .. } => (0..count).map(|i| problem.symmetric(numbered("Y", i), n)).collect(),
        };
        let l = (0..count).map(|i| problem.rectangular(numbered("L", i), m, n)).collect();
        Self { y, l }
    }
}

/// Blocks that are posed all at once.
const FEW_BLOCKS: usize = 48;

/// The vertices and pairs of vertices of the double sum, with the rate vertices.
pub(super) struct DoubleSum<'a> {
    polytope: &'a Polytope,
    lyapunov: &'a Lyapunov,
    y: &'a [Expr],
}

impl<'a> DoubleSum<'a> {
    pub fn new(polytope: &'a Polytope, lyapunov: &'a Lyapunov, y: &'a [Expr]) -> Self {
        Self { polytope, lyapunov, y }
    }

    /// Every (i, j) that is needed: j = i, and i < j.
    fn terms(&self) -> Vec<(usize, usize)> {
        let count = self.polytope.len();
        let reduced = matches!(self.lyapunov, Lyapunov::Common) && self.polytope.has_constant_b();
        let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
        (0..count).map(|i| (i, i)).chain(pairs.filter(|_| !reduced)).collect()
    }

    /// Ẏ at every rate vertex, Σᵢ νᵢYᵢ (4.21); zero for a common Y.
    fn rates(&self) -> Vec<(String, Expr)> {
        let n = self.polytope.states();
        match self.lyapunov {
            Lyapunov::Common => vec![(String::new(), Expr::zeros(n, n))],
            Lyapunov::ParameterDependent { rate_vertices } => {
                let rate = |nu: &Vec<f64>| {
                    nu.iter().zip(self.y).fold(Expr::zeros(n, n), |sum, (&nu, y)| match nu == 0.0 {
                        true => sum,
                        false => sum + nu * y,
                    })
                };
                let name =
                    |k: usize| if rate_vertices.len() == 1 { String::new() } else { format!(", rate {}", k + 1) };
                rate_vertices.iter().enumerate().map(|(k, nu)| (name(k), rate(nu))).collect()
            }
        }
    }

    /// Whether a block, counted over the rates and the terms within each, is one that a solver should begin with: of a vertex itself, at the first or the
    /// last rate; all of them where there are few. The others may never matter.
    pub fn leads(&self, block: usize) -> bool {
        let rates = match self.lyapunov {
            Lyapunov::Common => 1,
            Lyapunov::ParameterDependent { rate_vertices } => rate_vertices.len(),
        };
        let terms = self.terms().len();
        let (rate, term) = (block % (terms * rates) / terms, block % terms);
        terms * rates <= FEW_BLOCKS || term < self.polytope.len() && (rate == 0 || rate + 1 == rates)
    }

    /// The term of a block: blocks of one term differ by the rate.
    pub fn family(&self, block: usize) -> usize {
        block % self.terms().len()
    }

    /// Where (i, j) is, in words.
    fn place(&self, (i, j): (usize, usize)) -> String {
        match (self.polytope.len(), i == j) {
            (1, _) => String::new(),
            (_, true) => format!(" at vertex {}", i + 1),
            (_, false) => format!(" between vertices {} and {}", i + 1, j + 1),
        }
    }

    /// T(i, i) = Ẏ − (AᵢYᵢ − BᵢLᵢ) − (…)ᵀ, or T(i, j) + T(j, i).
    fn decrease(&self, (i, j): (usize, usize), y_rate: &Expr, l: &[Expr]) -> Expr {
        let flow = |i: usize, j: usize| self.polytope.a(i) * &self.y[j] - self.polytope.b(i) * &l[j];
        if i == j {
            let flow = flow(i, i);
            y_rate - (&flow + flow.t())
        } else {
            let flow = flow(i, j) + flow(j, i);
            2.0 * y_rate - (&flow + flow.t())
        }
    }

    /// The (i, j) of each block of [`stability`](Self::stability).
    pub fn stability_terms(&self) -> Vec<(usize, usize)> {
        self.rates().iter().flat_map(|_| self.terms()).collect()
    }

    /// (4.11)-(4.12) and (4.22)-(4.23), each ⪰ `margin`·I (twice it for pairs): quadratic stability with u = −L(ρ)Y(ρ)⁻¹x.
    pub fn stability(&self, l: &[Expr], margin: &Expr) -> Vec<(String, Expr)> {
        let n = self.polytope.states();
        let identity = margin.times(&Mat::identity(n, n));
        let mut blocks = Vec::new();
        for (rate_name, y_rate) in self.rates() {
            for term in self.terms() {
                let weight = if term.0 == term.1 { 1.0 } else { 2.0 };
                let name = format!("stability{}{rate_name}", self.place(term));
                blocks.push((name, self.decrease(term, &y_rate, l) - weight * &identity));
            }
        }
        blocks
    }

    /// (2.33), (4.28)-(4.29), (4.31)-(4.32): V̇ < −xᵀQx − uᵀRu for V = xᵀY(ρ)⁻¹x, u = −L(ρ)Y(ρ)⁻¹x. `what` names them.
    ///
    /// ```text
    /// ⎡ Ẏ − (AᵢYᵢ − BᵢLᵢ) − (…)ᵀ   Yᵢ    Lᵢᵀ ⎤      ⎡ 2Ẏ − (AᵢYⱼ + AⱼYᵢ − BᵢLⱼ − BⱼLᵢ) − (…)ᵀ   Yᵢ + Yⱼ   Lᵢᵀ + Lⱼᵀ ⎤
    /// ⎢ Yᵢ                         Q⁻¹   0   ⎥ ≻ 0, ⎢ Yᵢ + Yⱼ                                   2Q⁻¹      0         ⎥ ≻ 0
    /// ⎣ Lᵢ                         0     R⁻¹ ⎦      ⎣ Lᵢ + Lⱼ                                   0         2R⁻¹      ⎦
    /// ```
    pub fn performance(&self, what: &str, l: &[Expr], weights: &Weights) -> Vec<(String, Expr)> {
        self.performance_of(&self.terms(), what, l, weights)
    }

    /// The first of the two alone, at every vertex.
    pub fn performance_at_vertices(&self, what: &str, l: &[Expr], weights: &Weights) -> Vec<(String, Expr)> {
        let vertices: Vec<(usize, usize)> = (0..self.polytope.len()).map(|i| (i, i)).collect();
        self.performance_of(&vertices, what, l, weights)
    }

    fn performance_of(
        &self,
        terms: &[(usize, usize)],
        what: &str,
        l: &[Expr],
        weights: &Weights,
    ) -> Vec<(String, Expr)> {
        let mut blocks = Vec::new();
        for (rate_name, y_rate) in self.rates() {
            for &term @ (i, j) in terms {
                let (y, l_sum, weight) = match i == j {
                    true => (self.y[i].clone(), l[i].clone(), 1.0),
                    false => (&self.y[i] + &self.y[j], &l[i] + &l[j], 2.0),
                };
                let output = &weights.output * &y;
                let (p, m) = (output.nrows(), l_sum.nrows());
                let block = Expr::symmetric_blocks(vec![
                    vec![self.decrease(term, &y_rate, l)],
                    vec![output, weight * Expr::constant(weights.output_weight_inverse.clone())],
                    vec![l_sum, Expr::zeros(m, p), weight * Expr::constant(weights.r_inverse.clone())],
                ]);
                blocks.push((format!("{what}{}{rate_name}", self.place(term)), block));
            }
        }
        blocks
    }

    /// (5.8), (5.19), (5.21) at every vertex: |f x| ≤ σ for the rows of F(ρ) = M(ρ)Y(ρ)⁻¹ on xᵀY(ρ)⁻¹x ≤ γ. Affine in ρ, so
    /// that the vertices are enough.
    pub fn unsaturated(&self, m: &[Expr], bounds: &InputBounds) -> Vec<(String, Expr)> {
        let mut blocks = Vec::new();
        for (vertex, (y, m)) in self.y.iter().zip(m).enumerate() {
            for (i, &sigma) in bounds.sigma.iter().enumerate() {
                let name = format!("input {} unsaturated{}", i + 1, self.place((vertex, vertex)));
                blocks.push((name, unsaturated(y, m.row(i), sigma, bounds.gamma)));
            }
        }
        blocks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::eigen::smallest_eigenvalue;
    use crate::model::FrozenModel;
    use crate::plant::OperatingPoint;
    use crate::synthesis::polytopic::rate_box_vertices;
    use lmi::{Answer, Options, Outcome};

    /// Stable plants of two states and one input that differ at every vertex.
    fn polytope(count: usize) -> Polytope {
        let entry = |i: usize, at: usize| (1.3 * i as f64 + 2.1 * at as f64).sin();
        let model = |i: usize| FrozenModel {
            rho: 0.0,
            a: Mat::from_fn(2, 2, |r, c| 0.5 * entry(i, 2 * r + c) - if r == c { 1.5 } else { 0.0 }),
            b: Mat::from_fn(2, 1, |r, _| if r == 0 { 0.2 } else { 1.0 }),
            operating_point: OperatingPoint { state: vec![0.0; 2], input: vec![0.0] },
        };
        Polytope::hull(&(0..count).map(model).collect::<Vec<FrozenModel>>())
    }

    struct Posed {
        problem: Problem,
        unknowns: Unknowns,
    }

    fn lyapunov(count: usize, rate: f64) -> Lyapunov {
        Lyapunov::ParameterDependent { rate_vertices: rate_box_vertices(count, rate) }
    }

    /// The inequalities of Theorem 4.4 with Q = I and R = I.
    fn blocks(polytope: &Polytope, rate: f64, unknowns: &Unknowns) -> Vec<(String, Expr)> {
        let weights = Weights::new(&CostWeights { q: Mat::identity(2, 2), r: Mat::identity(1, 1) }).unwrap();
        let lyapunov = lyapunov(polytope.len(), rate);
        DoubleSum::new(polytope, &lyapunov, &unknowns.y).performance("performance", &unknowns.l, &weights)
    }

    /// Theorem 4.4, its inequalities posed where they are broken, or at once.
    fn posed(polytope: &Polytope, rate: f64, is_lazy: bool) -> Posed {
        let lyapunov = lyapunov(polytope.len(), rate);
        let mut problem = Problem::new();
        let unknowns = Unknowns::new(&mut problem, polytope, &lyapunov);
        let sum = DoubleSum::new(polytope, &lyapunov, &unknowns.y);
        for (k, (name, block)) in blocks(polytope, rate, &unknowns).into_iter().enumerate() {
            match sum.leads(k) || !is_lazy {
                true => problem.positive_definite(name, block),
                false => problem.positive_definite_lazily(name, block, None, sum.family(k)),
            }
        }
        let trace = unknowns.y.iter().fold(Expr::zeros(1, 1), |sum, y| sum + y.trace());
        problem.maximize(&trace);
        Posed { problem, unknowns }
    }

    fn solved(posed: &Posed) -> Answer {
        let answer = posed.problem.solve(&Options::default()).unwrap();
        assert!(matches!(answer.outcome, Outcome::Solved), "{:?}", answer.outcome);
        answer
    }

    #[test]
    fn generated_is_enumerated() {
        for (count, expected) in [(4, 60), (6, 420)] {
            let polytope = polytope(count);
            let [generated, enumerated] = [true, false].map(|is_lazy| posed(&polytope, 0.4, is_lazy));
            let [generated, enumerated] = [solved(&generated), solved(&enumerated)];
            assert_eq!(generated.blocks.len(), expected);
            let difference = (generated.objective - enumerated.objective).abs();
            assert!(difference < 1e-6 * enumerated.objective, "{count}: {difference:e}");
            assert!(generated.blocks.iter().all(|block| block.verified_lower_bound > 0.0));
        }
    }

    /// A design for one bound on the rates, with the bound raised until the first inequality of all breaks: it is seen, wherever it is.
    #[test]
    fn one_rate_that_breaks_a_design_is_seen() {
        let polytope = polytope(6);
        let design = posed(&polytope, 0.4, true);
        let answer = solved(&design);
        let values = || answer.unknown_values().to_vec();
        let broken = |rate: f64| {
            let blocks = blocks(&polytope, rate, &design.unknowns);
            blocks.iter().filter(|(_, block)| smallest_eigenvalue(&answer.value(block)) <= 0.0).count()
        };
        assert_eq!(broken(0.4), 0);
        let (mut holds, mut breaks) = (0.4, 0.8);
        assert!(broken(breaks) > 0);
        for _ in 0..45 {
            let middle = 0.5 * (holds + breaks);
            *(if broken(middle) == 0 { &mut holds } else { &mut breaks }) = middle;
        }
        let of_all = broken(breaks);
        assert!((1..=3).contains(&of_all), "{of_all}");
        let at = |rate: f64| posed(&polytope, rate, true).problem.verify(&values()).unwrap();
        let seen = |rate: f64| at(rate).iter().filter(|block| block.verified_lower_bound <= 0.0).count();
        assert_eq!(seen(0.4), 0);
        assert_eq!(seen(breaks * (1.0 + 1e-12)), of_all);
    }
}
