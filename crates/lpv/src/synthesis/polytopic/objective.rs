//! What a design over a polytope is best in.

use crate::math::Mat;
use lmi::{Expr, Problem};

/// The objective of a synthesis.
#[derive(Clone, Debug)]
pub enum Objective {
    /// The largest Σ tr Yᵢ, the thesis's. It is not the least cost bound of any initial state.
    Trace,
    /// The least t with xₖᵀP(ρ(0))xₖ ≤ t for every state xₖ: the cost bound of the worst of them. As directions: {V ≤ γ}
    /// reaches √(γ/t) xₖ at least, and no design reaches farther along the worst.
    States {
        /// xₖ, at least one.
        states: Vec<Vec<f64>>,
        /// ρ(0); `None` for all ρ in the polytope.
        parameter: Option<Vec<f64>>,
    },
    /// The least t with P(ρ) ⪯ tS for all ρ: the cost bound of the worst state of the ellipsoid {x: xᵀSx ≤ 1}.
    Ellipsoid {
        /// S ≻ 0, n × n.
        shape: Mat<f64>,
    },
}

/// Name of the margin of stability t.
pub(super) const MARGIN: &str = "margin";
/// Name of the bound t.
pub(super) const COST_BOUND: &str = "cost bound";

/// An objective of a problem.
pub(super) struct Posed {
    /// A scalar.
    pub value: Expr,
    /// As large as possible, or as small.
    pub is_maximised: bool,
}

impl Posed {
    /// 1, or −1: times this it is to be as large as possible.
    pub fn sign(&self) -> f64 {
        if self.is_maximised { 1.0 } else { -1.0 }
    }
}

impl Objective {
    /// Pose it for the Yᵢ: `distinct` without repetition, `vertices` one for each vertex. Returned is what was posed: the trace,
    /// or t.
    pub(super) fn pose(&self, problem: &mut Problem, distinct: &[&Expr], vertices: &[Expr]) -> Posed {
        match self {
            Objective::Trace => {
                let trace = distinct.iter().fold(Expr::zeros(1, 1), |sum, y| sum + y.trace());
                problem.maximize(&trace);
                Posed { value: trace, is_maximised: true }
            }
            Objective::States { states, parameter } => {
                let n = vertices[0].nrows();
                // P(ρ) ⪯ … for all ρ follows from the vertices: Y(ρ) is affine in the bordered inequality
                let at: Vec<Expr> = match parameter {
                    Some(rho) if distinct.len() > 1 => {
                        vec![rho.iter().zip(vertices).fold(Expr::zeros(n, n), |sum, (&weight, y)| sum + weight * y)]
                    }
                    _ => distinct.iter().map(|y| (*y).clone()).collect(),
                };
                let t = problem.scalar(COST_BOUND);
                for (k, state) in states.iter().enumerate() {
                    let column = Expr::constant(Mat::from_fn(n, 1, |i, _| state[i]));
                    for (i, y) in at.iter().enumerate() {
                        let block = Expr::symmetric_blocks(vec![vec![t.clone()], vec![column.clone(), y.clone()]]);
                        problem
                            .positive_definite(format!("cost bound of state {}{}", k + 1, vertex(i, at.len())), block);
                    }
                }
                problem.minimize(&t);
                Posed { value: t, is_maximised: false }
            }
            Objective::Ellipsoid { shape } => {
                let n = vertices[0].nrows();
                let t = problem.scalar(COST_BOUND);
                for (i, y) in distinct.iter().enumerate() {
                    let block =
                        Expr::symmetric_blocks(vec![vec![t.times(shape)], vec![Expr::identity(n), (*y).clone()]]);
                    problem
                        .positive_definite(format!("cost bound of the ellipsoid{}", vertex(i, distinct.len())), block);
                }
                problem.minimize(&t);
                Posed { value: t, is_maximised: false }
            }
        }
    }
}

fn vertex(i: usize, count: usize) -> String {
    if count == 1 { String::new() } else { format!(" at vertex {}", i + 1) }
}
