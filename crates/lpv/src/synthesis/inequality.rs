//! The matrix inequalities that the methods share, in the unknowns Y = P⁻¹ and L = K Y.

use super::SynthesisError;
use crate::math::Mat;
use crate::math::decimal::at_least;
use crate::math::matrix::inverse_spd;
use crate::model::FrozenModel;
use lmi::{Answer, Expr, Options, Outcome, Problem, Witness};

/// Q⁻¹ and R⁻¹, which the inequalities hold as constants.
pub(super) struct InverseWeights {
    pub q: Mat<f64>,
    pub r: Mat<f64>,
}

impl InverseWeights {
    /// The inverses of Q ≻ 0 and R ≻ 0. The caller has checked definiteness.
    pub fn new(weights: &super::CostWeights) -> Self {
        let inverse = |m: &Mat<f64>| inverse_spd(m).expect("weights are checked to be positive definite");
        Self { q: inverse(&weights.q), r: inverse(&weights.r) }
    }
}

/// The performance inequality (2.33), (4.36), (5.18), of size 2n + m:
///
/// ```text
/// ⎡ −(AY − BL) − (AY − BL)ᵀ   Y     Lᵀ  ⎤
/// ⎢  Y                        Q⁻¹   0   ⎥ ≻ 0
/// ⎣  L                        0     R⁻¹ ⎦
/// ```
///
/// Equivalent to V̇ < −xᵀQx − uᵀRu for V = xᵀY⁻¹x under u = −LY⁻¹x.
pub(super) fn performance(y: &Expr, l: &Expr, model: &FrozenModel, inverse: &InverseWeights) -> Expr {
    performance_with_rate(y, l, &Expr::zeros(y.nrows(), y.nrows()), model, inverse)
}

/// [`performance`] for a Y that moves: its first block is −(AY − BL) − (AY − BL)ᵀ + Ẏ (4.32), and V̇ is along the moving
/// parameter too.
pub(super) fn performance_with_rate(
    y: &Expr,
    l: &Expr,
    y_rate: &Expr,
    model: &FrozenModel,
    inverse: &InverseWeights,
) -> Expr {
    let flow = &model.a * y - &model.b * l;
    Expr::symmetric_blocks(vec![
        vec![y_rate - (&flow + flow.t())],
        vec![y.clone(), Expr::constant(inverse.q.clone())],
        vec![l.clone(), Expr::zeros(l.nrows(), y.ncols()), Expr::constant(inverse.r.clone())],
    ])
}

/// Lemma 2.2, (5.8), (5.19), of size 1 + n: |ℓY⁻¹x| ≤ σ on the ellipsoid xᵀY⁻¹x ≤ γ.
///
/// ```text
/// ⎡ σ²/γ  ℓ ⎤
/// ⎣ ℓᵀ    Y ⎦ ≻ 0
/// ```
pub(super) fn unsaturated(y: &Expr, row: Expr, sigma: f64, gamma: f64) -> Expr {
    let bound = Mat::from_fn(1, 1, |_, _| sigma * sigma / gamma);
    Expr::symmetric_blocks(vec![vec![Expr::constant(bound)], vec![row.t(), y.clone()]])
}

/// Relative gap to aim for: the back-off of P makes up for what is left.
const GAP: f64 = 1e-9;

/// Solve, and turn every outcome without a point that is proved to be feasible into an error that says where.
pub(super) fn solve(problem: &Problem, rho: f64) -> Result<Answer, SynthesisError> {
    let answer = problem.solve(&Options { gap_tolerance: GAP, ..Options::default() })?;
    match &answer.outcome {
        outcome if outcome.is_feasible() => Ok(answer),
        Outcome::Infeasible(witness) => Err(SynthesisError::Infeasible { rho, carriers: carriers(&answer, witness) }),
        Outcome::InfeasibleWithin(witness) => {
            let (radius, carriers) = (at_least(witness.excluded_radius), carriers(&answer, witness).join(", "));
            let reason = format!(
                "no solution exists with entries up to {radius} times the problem's units; the contradiction is carried by: {carriers}"
            );
            Err(SynthesisError::Inaccurate { rho, reason })
        }
        Outcome::Unbounded(_) | Outcome::UnboundedToTolerance(_) => Err(SynthesisError::Unbounded { rho }),
        Outcome::Inaccurate(reason) => Err(SynthesisError::Inaccurate { rho, reason: reason.to_string() }),
        Outcome::Solved | Outcome::SolvedToTolerance(_) => {
            let reason = "the point it found misses an inequality by a rounding error".into();
            Err(SynthesisError::Inaccurate { rho, reason })
        }
    }
}

/// The inequalities with the largest multipliers, with their share.
fn carriers(answer: &Answer, witness: &Witness) -> Vec<String> {
    let weight = |z: &Mat<f64>| (0..z.nrows()).map(|i| z[(i, i)]).sum::<f64>();
    let total: f64 = witness.multipliers.iter().map(weight).sum();
    let mut shares: Vec<(f64, &str)> = (witness.multipliers.iter().zip(&answer.blocks))
        .map(|(z, block)| (weight(z) / total, block.name.as_str()))
        .collect();
    shares.sort_by(|a, b| b.0.total_cmp(&a.0));
    shares.iter().take(3).map(|(share, name)| format!("{name} ({:.0} %)", 100.0 * share)).collect()
}
