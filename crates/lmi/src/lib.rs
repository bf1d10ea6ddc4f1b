//! Linear matrix inequalities: unknowns, expressions, problems, and a primal-dual interior-point solver.
//!
//! An LMI problem asks for matrices that make affine matrix expressions positive definite and a linear
//! objective as small (or as large) as possible. The largest part of linear control design has this form.
//! The crate knows nothing of control: it takes the inequality as it stands in the book.
//!
//! ```
//! use lmi::{Expr, Mat, Options, Outcome, Problem};
//!
//! // Minimise tr P over AᵀP + PA + I ≺ 0, P ≻ 0: at the optimum AᵀP + PA + I = 0.
//! let a = Mat::from_fn(2, 2, |i, j| [[-1.0, 2.0], [0.0, -3.0]][i][j]);
//! let mut problem = Problem::new();
//! let p = problem.symmetric("P", 2);
//! let lyapunov = a.transpose().to_owned() * &p + &p * &a + Expr::identity(2);
//! problem.positive_definite("Lyapunov", -lyapunov);
//! problem.positive_definite("P", p.clone());
//! problem.minimize(&p.trace());
//!
//! let answer = problem.solve(&Options::default())?;
//! assert!(matches!(answer.outcome, Outcome::Solved));
//! assert!((answer.value(&p)[(0, 0)] - 0.5).abs() < 1e-6);
//! assert!((answer.objective - (0.5 + 1.0 / 3.0)).abs() < 1e-6);
//! # Ok::<(), lmi::Error>(())
//! ```
//!
//! # The two doors
//!
//! * [`Problem`] and [`Expr`]: matrix unknowns and block expressions, written as in a textbook. The structure
//!   `U X Vᵀ` of each matrix unknown is kept down to the solver, which profits from it.
//! * [`sdpa`]: problems in the SDPA sparse format (`.dat-s`), coefficient matrix by coefficient matrix.
//!
//! # What is solved
//!
//! With the blocks `F_b(x) = C_b + Σᵢ xᵢ F_{b,i}` (symmetric matrices, x the scalar unknowns)
//!
//! ```text
//! minimise cᵀx               subject to  F_b(x) ⪰ 0 for every block b
//! maximise −Σ_b⟨C_b, Z_b⟩    subject to  Σ_b⟨F_{b,i}, Z_b⟩ = cᵢ,  Z_b ⪰ 0        (its dual)
//! ```
//!
//! # Strict inequalities
//!
//! `F(x) ≻ 0` has no meaning for an optimum, which lies on the boundary. Every strict inequality is posed as
//! `F(x) ⪰ margin·I`, with a small default margin relative to the block's scale ([`Options::margin`]) or one of
//! your choice ([`Problem::positive_definite_by`]). After solving, a lower bound on the smallest eigenvalue of every block is
//! proved, from the expressions, all rounding accounted for; [`Outcome::Solved`] is given only when all of them are positive.
//!
//! # Outcomes
//!
//! Infeasible, unbounded and inaccurate are outcomes ([`Outcome`]), not errors: they carry a witness, a ray or the
//! best point with its residuals. [`Outcome::Solved`], [`Outcome::Infeasible`] and [`Outcome::Unbounded`] are proved of the data as they were read,
//! rounding included; what cannot be proved has a softer word. [`Error`] is for problems that have no meaning. The [`guide`] has a page on each.

mod aligned;
mod answer;
mod assembly;
mod balancing;
mod block;
mod cholesky;
mod coefficients;
mod combination;
mod conditioning;
mod dense;
mod direction;
mod double_double;
mod error;
mod estimate;
mod explanation;
mod expression;
mod factored;
mod generation;
pub mod guide;
mod interior_point;
mod lanczos;
mod lowering;
mod multiplier;
mod operators;
mod options;
mod problem;
mod reach;
mod report;
mod rigorous;
mod schur;
pub mod sdpa;
mod small;
mod sparse;
mod start;
mod structure;
mod vectorized;
mod verification;

pub use answer::{
    Answer, Balancing, BlockReport, InaccurateReason, IterationLog, OptimumBound, Outcome, Ray, Residuals, Tolerance,
    Witness,
};
pub use error::Error;
pub use explanation::{Carrier, Explanation};
pub use expression::Expr;
pub use options::Options;
pub use problem::Problem;

/// Dense matrices, as the linear-algebra crate `faer` defines them.
pub use faer::Mat;
