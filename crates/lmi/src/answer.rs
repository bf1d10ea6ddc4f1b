//! What a solve gives back.

use crate::Mat;
use crate::expression::{Expr, Unknown};
use crate::interior_point::Centre;
use serde::Serialize;
use std::fmt;

/// How a solve ended.
#[derive(Clone, Debug, Serialize)]
pub enum Outcome {
    /// Optimal: the relative duality gap is at most 1e-7 (by default it aims for 1e-8), what the dual residual leaves uncertain of it at
    /// most 1e-6, the residuals are within tolerance, and of every block, recomputed from the data as stated, a lower bound on the smallest eigenvalue is
    /// **proved** ([`BlockReport::verified_lower_bound`]) that is positive for strict inequalities, at least the margin (up to rounding) where one
    /// was given, and for [`Sdp`](crate::sdpa::Sdp) at least −tolerance·(1 + ‖F₀‖).
    Solved,
    /// No point satisfies all inequalities; the witness shows why.
    Infeasible(Witness),
    /// The objective improves without end along the ray.
    Unbounded(Ray),
    /// The solver stopped short. The answer holds the best point so far with its true residuals.
    Inaccurate(InaccurateReason),
}

/// A proof that no x satisfies all inequalities `F_b(x) = C_b + Σ xᵢ F_{b,i} ⪰ 0`.
///
/// Matrices `Z_b ⪰ 0` with `Σ_b⟨C_b, Z_b⟩ = −1` and `Σ_b⟨F_{b,i}, Z_b⟩ = 0` for every i: then
/// `Σ_b⟨F_b(x), Z_b⟩ = −1` for all x, though it could not be negative if every `F_b(x)` were positive semidefinite.
#[derive(Clone, Debug, Serialize)]
pub struct Witness {
    /// `Z_b` for every inequality in the order stated, symmetric positive semidefinite.
    #[serde(serialize_with = "nested_rows")]
    pub multipliers: Vec<Mat<f64>>,
    /// Proved upper bound on `|Σ_b⟨F_{b,i}, Z_b⟩|` over all i. Zero in exact arithmetic; the witness excludes all x with
    /// `Σ|xᵢ| < 1/residual`.
    pub residual: f64,
    /// What the witness is proved to exclude, in sensible units: all x with `|xᵢ| ≤ excluded_radius · sᵢ`, where sᵢ is the unit of
    /// xᵢ in the balanced problem, in which coefficients are about 1. At least 1e10; [`Outcome::Infeasible`] is not
    /// claimed for less.
    pub excluded_radius: f64,
    /// Smallest eigenvalue over all `Z_b`, recomputed. Not negative beyond rounding.
    pub smallest_eigenvalue: f64,
}

/// A direction along which every inequality stays satisfied and the objective improves.
///
/// `Σ dᵢ F_{b,i} ⪰ 0` for every block, while the objective changes by −1 (minimised) or +1 (maximised) per unit step.
#[derive(Clone, Debug, Serialize)]
pub struct Ray {
    /// The direction, one matrix per unknown in the order made.
    #[serde(serialize_with = "nested_rows")]
    pub direction: Vec<Mat<f64>>,
    /// Smallest eigenvalue of `Σ dᵢ F_{b,i}` over all blocks, recomputed. Not negative beyond rounding.
    pub smallest_eigenvalue: f64,
}

/// Why a solve stopped short.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum InaccurateReason {
    /// The iteration limit was reached.
    IterationLimit,
    /// The time limit was reached.
    TimeLimit,
    /// The caller cancelled.
    Cancelled,
    /// The objective comes ever closer to its bound, but only as the unknowns grow without end: no point attains the optimum. The
    /// objectives are those of the last point.
    NotAttained,
    /// Rounding errors stopped progress: the problem has no interior, or is badly conditioned.
    Stalled,
    /// The solver converged, but what it found cannot be proved on the data as stated: a block is not positive definite by its margin, or
    /// a witness of infeasibility excludes too little.
    NotVerified,
}

impl fmt::Display for InaccurateReason {
    /// Completes "the solver stopped short: …".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::IterationLimit => "it reached its iteration limit",
            Self::TimeLimit => "it reached its time limit",
            Self::Cancelled => "it was cancelled",
            Self::NotAttained => {
                "the objective comes closer to its bound only as the unknowns grow without end; bound them, or ask for less"
            }
            Self::Stalled => "rounding errors stopped its progress: the problem has no interior or is badly conditioned",
            Self::NotVerified => "its answer did not pass the check of its blocks",
        })
    }
}

/// One inequality at the answer.
#[derive(Clone, Debug, Serialize)]
pub struct BlockReport {
    /// The inequality's name.
    pub name: String,
    /// Rows of the block.
    pub size: usize,
    /// Smallest eigenvalue of F(x), recomputed from the expression and not from the solver's variables.
    pub smallest_eigenvalue: f64,
    /// A proved lower bound on the smallest eigenvalue of F(x), all rounding accounted for, by a verified Cholesky
    /// factorisation of F(x) as the expression states it; −∞ where there is no proof.
    pub verified_lower_bound: f64,
    /// The margin imposed: F(x) ⪰ margin·I.
    pub margin: f64,
}

/// Residuals of the answer, relative to the data; `primal` and `dual` of the problem as it was solved, balanced or not.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Residuals {
    /// By how much the blocks differ from the solver's positive definite slack:
    /// max_b ‖F_b(x) − S_b‖ / (1 + ‖C_b‖), Frobenius norms.
    pub primal: f64,
    /// ‖c − A(Z)‖ / (1 + ‖c‖) in the largest absolute entry, `A(Z)ᵢ = Σ_b⟨F_{b,i}, Z_b⟩`.
    pub dual: f64,
    /// |p − d| / (1 + |p| + |d|) for the objective p and the dual objective d.
    pub gap: f64,
    /// Σ|cᵢ − A(Z)ᵢ||xᵢ| / (1 + |p| + |d|): what the dual residual may take from the bound d, for an optimum of about this x.
    pub uncertainty: f64,
}

/// A proved bound on the optimum: weak duality with every rounding accounted for.
///
/// No x that satisfies the inequalities (strict ones also with equality) has a smaller objective (a larger one when it is
/// maximised), as long as no entry of an unknown is more than `reach` times as large as the largest one of that unknown in the answer. The
/// restriction is what computed multipliers, which meet `A(Z) = c` to rounding only, can prove.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct OptimumBound {
    /// The bound.
    pub value: f64,
    /// How much larger than the answer x may be.
    pub reach: f64,
}

/// What balancing did to the problem before it was solved; it is undone in the answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Balancing {
    /// Smallest and largest absolute coefficient of the problem as stated.
    pub before: (f64, f64),
    /// The same of the problem that was solved.
    pub after: (f64, f64),
}

/// One interior-point iteration, as it began.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct IterationLog {
    /// Objective at x.
    pub objective: f64,
    /// Dual objective at Z.
    pub dual_objective: f64,
    /// Residuals at (x, S, Z).
    pub residuals: Residuals,
    /// Complementarity ⟨S, Z⟩ / n.
    pub complementarity: f64,
    /// Centring parameter σ of the step then taken.
    pub centring: f64,
    /// Length of the step in x and S.
    pub primal_step: f64,
    /// Length of the step in Z.
    pub dual_step: f64,
}

/// The result of [`Problem::solve`](crate::Problem::solve).
#[derive(Clone, Debug, Serialize)]
pub struct Answer {
    /// How the solve ended.
    pub outcome: Outcome,
    /// The objective at the answer.
    pub objective: f64,
    /// The dual objective: for a dual point without residual, a bound on the objective of every feasible point.
    pub dual_objective: f64,
    /// |objective − dual_objective|.
    pub gap: f64,
    /// A proved bound on what any point can reach, of a solved problem.
    pub optimum_bound: Option<OptimumBound>,
    /// Every inequality, in the order stated.
    pub blocks: Vec<BlockReport>,
    /// Coefficient ranges before and after balancing.
    pub balancing: Balancing,
    /// Residuals of the answer.
    pub residuals: Residuals,
    /// The course of the iteration.
    pub iterations: Vec<IterationLog>,
    /// Multipliers `Z_b ⪰ 0` of the inequalities, in the order stated.
    #[serde(serialize_with = "nested_rows")]
    pub multipliers: Vec<Mat<f64>>,
    #[serde(skip)]
    pub(crate) centre: Option<Centre>,
    #[serde(skip)]
    pub(crate) unknowns: Vec<Unknown>,
    #[serde(rename = "unknowns", serialize_with = "nested_rows")]
    pub(crate) values: Vec<Mat<f64>>,
}

impl Answer {
    /// The value of each unknown, in the order made; for an [`Sdp`](crate::sdpa::Sdp) the one column x.
    pub fn unknown_values(&self) -> &[Mat<f64>] {
        &self.values
    }

    /// The value of any expression at the answer.
    ///
    /// # Panics
    ///
    /// When the expression holds an unknown of another problem, or one made after the solve.
    pub fn value(&self, expression: &Expr) -> Mat<f64> {
        expression.evaluate(&|unknown| {
            assert!(
                self.unknowns.get(unknown.index) == Some(&unknown),
                "value of an expression with a {} × {} unknown that the solved problem does not have",
                unknown.rows,
                unknown.cols
            );
            &self.values[unknown.index]
        })
    }
}

/// Matrices as lists of rows.
fn nested_rows<S: serde::Serializer>(matrices: &[Mat<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(
        matrices.iter().map(|m| -> Vec<Vec<f64>> {
            (0..m.nrows()).map(|i| (0..m.ncols()).map(|j| m[(i, j)]).collect()).collect()
        }),
    )
}
