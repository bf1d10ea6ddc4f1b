//! Why a polytope has no common Lyapunov function.
//!
//! Theorem 4.1 with one B for all vertices has a solution if and only if NᵀTN ≻ 0 has one, N a basis of what B does not reach: the projected
//! inequality (P. Gahinet and P. Apkarian, 1994, by elimination of L). Y = BBᵀ satisfies it with ⪰, so that what excludes a solution is never strict, and a
//! solver that is asked for a solution stops between rounding errors. Here the excluding matrices are the unknowns,
//!
//! ```text
//! maximise s   subject to   Wᵢ ⪰ sI,   Nᵀ(Σ He(ZᵢAᵢ))N ⪰ sI,   Σ tr Wᵢ ≤ 1,   Zᵢ = NWᵢNᵀ,   ΣZᵢAᵢB = 0,
//! ```
//!
//! which has an interior wherever the polytope is clearly infeasible, and [`separating`] makes them exact.

use super::solver;
use crate::math::Mat;
use crate::math::matrix::trace;
use crate::math::separation::separating;
use crate::model::Polytope;
use lmi::{Expr, Outcome, Problem};

/// Proof that no common Lyapunov function exists: [`crate::math::separation`].
#[derive(Clone, Debug)]
pub struct Separation {
    /// Zᵢ of the vertices, rounded from the exact ones; their largest entry is 1.
    pub multipliers: Vec<Mat<f64>>,
    /// tr Zᵢ of the sum of all: which vertices exclude each other.
    pub shares: Vec<f64>,
}

/// Singular values below this share of the largest count as zero in the search, not in the proof.
const RANK: f64 = 1e-10;
/// Unknowns of the search.
const MOST_UNKNOWNS: usize = 600;

impl Separation {
    /// The matrices that exclude a common Lyapunov function for `polytope`; `None` where B differs between the vertices or none are found.
    pub fn of(polytope: &Polytope) -> Option<Self> {
        if !polytope.has_constant_b() {
            return None;
        }
        let guess = search(polytope)?;
        let a: Vec<&Mat<f64>> = (0..polytope.len()).map(|i| polytope.a(i)).collect();
        let multipliers = separating(&a, polytope.b(0), &guess)?;
        let total: f64 = multipliers.iter().map(trace).sum();
        Some(Self { shares: multipliers.iter().map(|z| trace(z) / total).collect(), multipliers })
    }
}

/// An orthonormal basis of the x with Mx = 0, as columns, whatever the sizes of the rows of M.
fn kernel(m: &Mat<f64>) -> Option<Mat<f64>> {
    let sizes: Vec<f64> = (0..m.nrows()).map(|i| m.row(i).norm_max()).collect();
    let balanced = Mat::from_fn(m.nrows(), m.ncols(), |i, j| if sizes[i] > 0.0 { m[(i, j)] / sizes[i] } else { 0.0 });
    let svd = balanced.svd().ok()?;
    let values: Vec<f64> = (0..m.nrows().min(m.ncols())).map(|k| svd.S()[k]).collect();
    let largest = values.iter().copied().fold(0.0, f64::max);
    let rank = values.iter().filter(|&&value| value > RANK * largest).count();
    Some(svd.V().subcols(rank, m.ncols() - rank).to_owned())
}

/// Zᵢ to rounding.
fn search(polytope: &Polytope) -> Option<Vec<Mat<f64>>> {
    let (count, b) = (polytope.len(), polytope.b(0));
    let n = kernel(&b.transpose().to_owned())?;
    let q = n.ncols();
    let triangle: Vec<(usize, usize)> = (0..q).flat_map(|i| (i..q).map(move |j| (i, j))).collect();
    let unknowns = count * triangle.len();
    if q == 0 || unknowns > MOST_UNKNOWNS {
        return None;
    }
    // the matrix with ones at (i, j) and (j, i)
    let unit =
        |(i, j): (usize, usize)| Mat::from_fn(q, q, |r, c| f64::from(u8::from((r, c) == (i, j) || (r, c) == (j, i))));
    let reached: Vec<Mat<f64>> = (0..count).map(|i| n.transpose() * polytope.a(i) * b).collect();
    let columns: Vec<Mat<f64>> =
        (0..unknowns).map(|k| unit(triangle[k % triangle.len()]) * &reached[k / triangle.len()]).collect();
    let equations = Mat::from_fn(q * b.ncols(), unknowns, |r, k| columns[k][(r % q, r / q)]);
    let basis = kernel(&equations)?;
    let of_basis = |vertex: usize, k: usize| {
        let mut w = Mat::<f64>::zeros(q, q);
        for (position, &(i, j)) in triangle.iter().enumerate() {
            w[(i, j)] = basis[(vertex * triangle.len() + position, k)];
            w[(j, i)] = w[(i, j)];
        }
        w
    };

    let mut problem = Problem::new();
    let s = problem.scalar("margin");
    let theta: Vec<Expr> = (0..basis.ncols()).map(|k| problem.scalar(format!("θ{}", k + 1))).collect();
    let w: Vec<Expr> = (0..count)
        .map(|i| theta.iter().enumerate().fold(Expr::zeros(q, q), |sum, (k, t)| sum + t.times(&of_basis(i, k))))
        .collect();
    let flow = |i: usize| n.transpose() * polytope.a(i) * &n;
    let growth = (0..count).fold(Expr::zeros(q, q), |sum, i| {
        let half = &w[i] * &flow(i);
        sum + (&half + half.t())
    });
    let identity = s.times(&Mat::identity(q, q));
    for (i, w) in w.iter().enumerate() {
        problem.positive_definite_by(format!("W{}", i + 1), w - &identity, 0.0);
    }
    problem.positive_definite_by("growth", growth - &identity, 0.0);
    let total = w.iter().fold(Expr::zeros(1, 1), |sum, w| sum + w.trace());
    problem.positive_definite_by("scale", Expr::identity(1) - total, 0.0);
    problem.maximize(&s);
    let answer = problem.solve(&lmi::Options { gap_tolerance: 1e-8, ..solver() }).ok()?;
    let has_point = answer.outcome.is_optimal() || matches!(answer.outcome, Outcome::Inaccurate(_));
    has_point.then(|| w.iter().map(|w| &n * answer.value(w) * n.transpose()).collect())
}
