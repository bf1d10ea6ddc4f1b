//! What a solve gives back.

use crate::Mat;
use crate::expression::{Expr, Unknown};
use crate::interior_point::Centre;
use serde::Serialize;
use std::fmt;

/// How a solve ended: what is proved of the data as they were read, rounding included, and softer words where less is.
///
/// The data are the doubles of the expressions or of the file, of blocks their symmetric parts. Write `G_b(x) = F_b(x) − margin_b·I` with the
/// margin that was given, zero for strict inequalities and files.
#[derive(Clone, Debug, Serialize)]
pub enum Outcome {
    /// Optimal, and proved: `G_b(x) ⪰ 0` for every block at the answer's x (`≻ 0` for strict inequalities), so that its objective
    /// p ([`Answer::attained`]) is attained, and no x whatever has a better one than d ([`Answer::optimum_bound`]), with
    ///
    /// ```text
    /// |p − d| / (1 + |p| + |d|) ≤ 10⁻⁵.
    /// ```
    ///
    /// The solver's own estimate of this gap is at most 10⁻⁷ ([`Residuals::gap`]; what
    /// [`Options::back_off`](crate::Options::back_off) gives up comes on top).
    Solved,
    /// Optimal up to rounding; what is missing to `Solved` is said by [`Tolerance`]. So end problems without interior, such as those with equations as
    /// pairs of inequalities: whether a feasible point exists at all is then not known.
    SolvedToTolerance(Tolerance),
    /// Proved: no x satisfies all inequalities.
    Infeasible(Witness),
    /// Proved: no x of a limited size satisfies all inequalities; the limit is [`Witness::excluded_radius`].
    InfeasibleWithin(Witness),
    /// Proved: the point of the answer is feasible, and from it the objective improves without end along the ray.
    Unbounded(Ray),
    /// The objective improves along the ray as far as rounding lets see. Either the blocks may fall along it by what rounding leaves, and
    /// the objective may end far out, or no feasible point was proved.
    UnboundedToTolerance(Ray),
    /// The solver stopped short. The answer holds the best point so far with its true residuals.
    Inaccurate(InaccurateReason),
}

impl Outcome {
    /// Whether there is an optimal point, proved or up to rounding.
    pub fn is_optimal(&self) -> bool {
        matches!(self, Self::Solved | Self::SolvedToTolerance(_))
    }

    /// Whether the point of the answer is optimal up to rounding at least, and proved to satisfy every inequality.
    pub fn is_feasible(&self) -> bool {
        match self {
            Self::Solved => true,
            Self::SolvedToTolerance(tolerance) => tolerance.violation == 0.0,
            _ => false,
        }
    }

    /// The word for it: `solved`, `solved to tolerance`, `infeasible`, `infeasible within a radius`, `unbounded`, `unbounded to tolerance` or
    /// `inaccurate`.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::SolvedToTolerance(_) => "solved to tolerance",
            Self::Infeasible(_) => "infeasible",
            Self::InfeasibleWithin(_) => "infeasible within a radius",
            Self::Unbounded(_) => "unbounded",
            Self::UnboundedToTolerance(_) => "unbounded to tolerance",
            Self::Inaccurate(_) => "inaccurate",
        }
    }
}

/// What is proved of a point that is optimal up to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tolerance {
    /// Proved: `G_b(x) ⪰ −violation·I` for every block. Zero where the point is proved to be feasible.
    pub violation: f64,
    /// Proved relative distance of the objective that is attained from the bound on the optimum, `|p − d| / (1 + |p| + |d|)`; the bound may be one
    /// for x within its [reach](OptimumBound::reach) only. ∞ where one of the two is not proved.
    pub gap: f64,
}

/// A proof that no x satisfies all inequalities `G_b(x) = C_b + Σ xᵢ F_{b,i} ⪰ 0`.
///
/// Matrices `Z_b ⪰ 0`, proved, with `κ = Σ_b⟨C_b, Z_b⟩ ≈ −1` and `rᵢ = Σ_b⟨F_{b,i}, Z_b⟩ ≈ 0`: in exact arithmetic
/// `Σ_b⟨G_b(x), Z_b⟩ = −1` for all x, though it could not be negative if every `G_b(x)` were positive semidefinite. Computed multipliers miss the
/// equations by rᵢ, and exclude
///
/// * every x, where `|xᵢ| ≤ aᵢ + bᵢτ` is proved of feasible ones with τ = Σ_b⟨G_b(x), Z_b⟩, `Σ|rᵢ|bᵢ < 1` and `κ + Σ|rᵢ|aᵢ < 0`: the blocks
///   themselves, or the weight that Z gives their diagonals, bound the unknowns;
/// * otherwise every x with `κ + Σ|rᵢ||xᵢ| < 0`.
#[derive(Clone, Debug, Serialize)]
pub struct Witness {
    /// `Z_b` for every inequality in the order stated, symmetric positive semidefinite.
    #[serde(serialize_with = "nested_rows")]
    pub multipliers: Vec<Mat<f64>>,
    /// Proved upper bound on `|rᵢ|` over all i.
    pub residual: f64,
    /// Proved to be excluded: all x with `|xᵢ| ≤ excluded_radius · sᵢ`, where sᵢ is the unit of xᵢ in the balanced problem, in which
    /// coefficients are about 1. ∞ where every x is, which is what [`Outcome::Infeasible`] says; at least 1e10 otherwise.
    pub excluded_radius: f64,
    /// Whether what is excluded are points with `F_b(x) ⪰ margin·I`, for the default margins of strict inequalities ([`BlockReport::margin`]),
    /// and not all with `F_b(x) ≻ 0`. So only where the inequalities that contradict each other have no known part: then x, multiplied to the excluded
    /// radius, has blocks less definite than the margin.
    pub needs_margin: bool,
    /// Smallest eigenvalue over all `Z_b`, recomputed. Not negative beyond rounding.
    pub smallest_eigenvalue: f64,
}

/// A direction along which every inequality stays satisfied and the objective improves.
///
/// `Σ dᵢ F_{b,i} ⪰ 0` for every block, while the objective changes by −1 (minimised) or +1 (maximised) per unit step, up to rounding. Proved, the sign
/// of the change too, in [`Outcome::Unbounded`].
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
/// maximised). Computed multipliers meet `A(Z) = c` to rounding only. That is made up for where the blocks bound the unknowns; where they
/// do not, the bound speaks of those x of which no entry of an unknown is more than `reach` times as large as the largest one of that unknown
/// in the answer.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct OptimumBound {
    /// The bound.
    pub value: f64,
    /// How much larger than the answer x may be; ∞ where the bound holds for every x.
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
    /// Of a solved problem whose x is proved to be feasible: the objective there, rounded to the side on which a feasible point is proved to be as good.
    pub attained: Option<f64>,
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
