//! Designs for a parameter that moves: Lyapunov matrix Y(ρ) = Σ fᵢ(ρ) Yᵢ with basis functions fᵢ, and a bound on the rate.
//!
//! After F. Wu, X. H. Yang, A. Packard and G. Becker, "Induced L2-norm control for LPV systems with bounded parameter
//! variation rates", International Journal of Robust and Nonlinear Control 6 (1996), with the cost bound of Theorem 4.4
//! in place of the L2 gain and the input constraint of Theorem 5.3. For V = xᵀY(ρ)⁻¹x and u = −L(ρ)Y(ρ)⁻¹x
//!
//! ```text
//! V̇ = −xᵀY⁻¹ [ −(AY − BL) − (AY − BL)ᵀ + Ẏ ] Y⁻¹x,    Ẏ = Σ_p ρ̇_p ∂Y/∂ρ_p,
//! ```
//!
//! so the inequality of Theorem 4.5 with Ẏ added to its first block, at every ρ and both ends of the rate interval (Ẏ is
//! affine in ρ̇), makes xᵀY(ρ)⁻¹x a bound on the cost of every flight with |ρ̇| ≤ r. The inequalities are imposed on a
//! grid; what lies between its points is for the certificate to prove.

use super::inequality::{InverseWeights, performance_with_rate, solve, unsaturated};
use super::units::{STRICT, Units, largest_entry, scaled};
use super::{CostWeights, SynthesisError};
use crate::math::Mat;
use crate::math::matrix::{inverse_spd, symmetric_part};
use crate::math::scalar::{derivative, dual};
use crate::model::{BasisFunction, FrozenModel, MatrixFunction};
use lmi::{Expr, Problem};
use serde::{Deserialize, Serialize};

/// How a design for a moving parameter is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateBoundedOptions {
    /// r ≥ 0: the parameter's rate is anywhere in [−r, r], its unit per second.
    pub rate: f64,
    /// Y(ρ) is a trigonometric polynomial (periodic parameter) or polynomial of this order; at least 1.
    pub order: u32,
    /// An error x whose bound xᵀP(ρ)x is to be least over all ρ, so that the certified set reaches farthest along it;
    /// without it Σ tr Y(ρ_k) is to be largest.
    pub direction: Option<Vec<f64>>,
}

/// The Lyapunov function xᵀY(ρ)⁻¹x of a design for a moving parameter.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RateBounded {
    /// r: what is claimed is claimed for parameter rates in [−r, r].
    pub rate: f64,
    /// Y(ρ) ≻ 0, for every ρ; P(ρ) = Y(ρ)⁻¹.
    pub y: MatrixFunction,
    /// L(ρ) = F(ρ)Y(ρ) with the gain F that is unsaturated on the certified set; only of the saturated methods.
    #[serde(default)]
    pub l: Option<MatrixFunction>,
}

impl RateBounded {
    /// P(ρ) = Y(ρ)⁻¹; `None` where Y is not positive definite.
    pub fn p(&self, rho: f64) -> Option<Mat<f64>> {
        inverse_spd(&self.y.at(&[rho]))
    }

    /// r ∂P/∂ρ = −r P Y′ P: the rate of P when the parameter moves at r.
    pub fn p_rate(&self, rho: f64) -> Option<Mat<f64>> {
        let p = self.p(rho)?;
        let flow = &p * self.y.derivative(&[rho], 0) * &p;
        Some(Mat::from_fn(p.nrows(), p.ncols(), |i, j| -self.rate * flow[(i, j)]))
    }

    /// F(ρ) = L(ρ)Y(ρ)⁻¹, of the saturated methods.
    pub fn unsaturated_gain(&self, rho: f64) -> Option<Mat<f64>> {
        Some(self.l.as_ref()?.at(&[rho]) * self.p(rho)?)
    }

    /// Y and L divided by `factor`: P is multiplied by it, F stays.
    pub(super) fn back_off(&mut self, factor: f64) {
        for coefficient in
            self.y.coefficients.iter_mut().chain(self.l.iter_mut().flat_map(|l| l.coefficients.iter_mut()))
        {
            *coefficient = Mat::from_fn(coefficient.nrows(), coefficient.ncols(), |i, j| coefficient[(i, j)] / factor);
        }
    }
}

/// Basis functions of order `order` for a parameter that is periodic with 2π, or not.
pub(super) fn basis(periodic: bool, order: u32) -> Vec<BasisFunction> {
    if periodic { BasisFunction::harmonics(0, order) } else { BasisFunction::powers(0, order) }
}

/// Least bound along the direction times this is what the second stage may use: it costs 0.05 % of the range.
const DIRECTION_SLACK: f64 = 1.001;

/// The inequalities on the grid of linearisations `grid`, for Y with `basis`; L has the basis functions too.
///
/// With input bounds (σ, γ) the unknowns are Y and L, and kᵢx is bounded as in Theorem 5.3. Without them L = R⁻¹Bᵀ is
/// optimal and eliminated (Corollary 4.1): the performance inequality is then −(AY + YAᵀ) + BR⁻¹Bᵀ + Ẏ bordered by Y and Q⁻¹.
///
/// Without a direction Σ tr Y(ρ_k) is maximised. With a direction d the least t with dᵀY(ρ_k)⁻¹d ≤ t is found first, and
/// then Σ tr Y(ρ_k) is maximised with t a thousandth above the least: the least t alone says nothing of the other
/// directions, where Y could be next to singular and the gain without bound.
///
/// Returns the Lyapunov function and the number of interior-point iterations.
///
/// # Errors
/// Infeasible, unbounded or inaccurate.
pub(super) fn solve_on_grid(
    grid: &[FrozenModel],
    options: &RateBoundedOptions,
    basis: &[BasisFunction],
    weights: &CostWeights,
    saturation: Option<(&[f64], f64)>,
) -> Result<(RateBounded, usize), SynthesisError> {
    let models: Vec<(&Mat<f64>, &Mat<f64>)> = grid.iter().map(|model| (&model.a, &model.b)).collect();
    if let Some(units) = Units::of(&models, Some(weights), true) {
        let own: Vec<FrozenModel> = grid.iter().map(|model| units.model(model)).collect();
        let limits = saturation.map(|(sigma, gamma)| units.limits(sigma, gamma));
        let direction = options.direction.as_ref().map(|direction| {
            let largest = largest_entry(direction);
            direction.iter().map(|x| units.number(x / largest)).collect()
        });
        let primed = RateBoundedOptions { rate: units.per_time(options.rate), direction, ..options.clone() };
        let found =
            in_its_units(&own, &primed, basis, &units.weights(weights), limits.as_deref().map(|sigma| (sigma, 1.0)));
        if let Ok((RateBounded { mut y, mut l, .. }, iterations)) = found {
            y.coefficients.iter_mut().for_each(|y| *y = scaled(y, units.y()));
            l.iter_mut().flat_map(|l| &mut l.coefficients).for_each(|l| *l = units.l(l));
            let mut strict = RateBounded { rate: options.rate, y, l };
            strict.back_off(1.0 + STRICT);
            return Ok((strict, iterations));
        }
    }
    in_its_units(grid, options, basis, weights, saturation)
}

/// The problem as it stands, whatever the size of its numbers.
fn in_its_units(
    grid: &[FrozenModel],
    options: &RateBoundedOptions,
    basis: &[BasisFunction],
    weights: &CostWeights,
    saturation: Option<(&[f64], f64)>,
) -> Result<(RateBounded, usize), SynthesisError> {
    let Some(direction) = &options.direction else {
        let mut unknowns = Unknowns::with_inequalities(grid, options, basis, weights, saturation);
        unknowns.maximize_trace(grid);
        return unknowns.solve(grid, options);
    };
    let mut first = Unknowns::with_inequalities(grid, options, basis, weights, saturation);
    let bound = first.problem.scalar("t");
    first.bound_direction(grid, direction, &bound);
    first.problem.minimize(&bound);
    let least = solve(&first.problem, grid[0].rho)?;
    let allowed = DIRECTION_SLACK * least.value(&bound)[(0, 0)];

    let mut second = Unknowns::with_inequalities(grid, options, basis, weights, saturation);
    second.bound_direction(grid, direction, &Expr::constant(Mat::from_fn(1, 1, |_, _| allowed)));
    second.maximize_trace(grid);
    let (lyapunov, iterations) = second.solve(grid, options)?;
    Ok((lyapunov, iterations + least.iterations.len()))
}

/// Yᵢ and Lᵢ, and the problem that they are unknowns of.
struct Unknowns<'a> {
    problem: Problem,
    basis: &'a [BasisFunction],
    y: Vec<Expr>,
    /// Empty where L is eliminated.
    l: Vec<Expr>,
}

impl<'a> Unknowns<'a> {
    fn with_inequalities(
        grid: &[FrozenModel],
        options: &RateBoundedOptions,
        basis: &'a [BasisFunction],
        weights: &CostWeights,
        saturation: Option<(&[f64], f64)>,
    ) -> Self {
        let (n, m) = (grid[0].a.nrows(), grid[0].b.ncols());
        let inverse = InverseWeights::new(weights);
        let mut problem = Problem::new();
        let y = (0..basis.len()).map(|i| problem.symmetric(format!("Y{i}"), n)).collect();
        let l = match saturation {
            Some(_) => (0..basis.len()).map(|i| problem.rectangular(format!("L{i}"), m, n)).collect(),
            None => Vec::new(),
        };
        let mut unknowns = Self { problem, basis, y, l };
        for model in grid {
            let rho = model.rho;
            let y = unknowns.y_at(rho);
            let l = saturation.map(|_| combination(basis, &unknowns.l, |function| function.at(&[rho])));
            let slope = combination(basis, &unknowns.y, |function| derivative(&function.at(&[dual(rho, Some(0))]), 0));
            for rate in ends(options.rate) {
                let y_rate = rate * &slope;
                let inequality = match &l {
                    Some(l) => performance_with_rate(&y, l, &y_rate, model, &inverse),
                    None => {
                        let flow = &model.a * &y;
                        let control = &model.b * &inverse.r * model.b.transpose();
                        Expr::symmetric_blocks(vec![
                            vec![y_rate - (&flow + flow.t()) + Expr::constant(control)],
                            vec![y.clone(), Expr::constant(inverse.q.clone())],
                        ])
                    }
                };
                unknowns.problem.positive_definite(format!("performance at {rho:.4}, rate {rate:+}"), inequality);
            }
            if let (Some(l), Some((sigma, gamma))) = (&l, saturation) {
                for (i, &bound) in sigma.iter().enumerate() {
                    let name = format!("input {} unsaturated at {rho:.4}", i + 1);
                    unknowns.problem.positive_definite(name, unsaturated(&y, l.row(i), bound, gamma));
                }
            }
        }
        unknowns
    }

    fn y_at(&self, rho: f64) -> Expr {
        combination(self.basis, &self.y, |function| function.at(&[rho]))
    }

    /// dᵀY(ρ_k)⁻¹d ≤ `bound` at every grid point.
    fn bound_direction(&mut self, grid: &[FrozenModel], direction: &[f64], bound: &Expr) {
        let column = Expr::constant(Mat::from_fn(direction.len(), 1, |i, _| direction[i]));
        for model in grid {
            let blocks = vec![vec![bound.clone()], vec![column.clone(), self.y_at(model.rho)]];
            let name = format!("bound of the direction at {:.4}", model.rho);
            self.problem.positive_definite(name, Expr::symmetric_blocks(blocks));
        }
    }

    fn maximize_trace(&mut self, grid: &[FrozenModel]) {
        let trace = grid.iter().fold(Expr::zeros(1, 1), |sum, model| sum + self.y_at(model.rho).trace());
        self.problem.maximize(&trace);
    }

    fn solve(
        &self,
        grid: &[FrozenModel],
        options: &RateBoundedOptions,
    ) -> Result<(RateBounded, usize), SynthesisError> {
        let answer = solve(&self.problem, grid[0].rho)?;
        let function = |coefficients| MatrixFunction { basis: self.basis.to_vec(), coefficients };
        let y = function(self.y.iter().map(|y| symmetric_part(&answer.value(y))).collect());
        let l = (!self.l.is_empty()).then(|| function(self.l.iter().map(|l| answer.value(l)).collect()));
        Ok((RateBounded { rate: options.rate, y, l }, answer.iterations.len()))
    }
}

/// The ends of the rate interval [−r, r].
fn ends(rate: f64) -> Vec<f64> {
    if rate == 0.0 { vec![0.0] } else { vec![-rate, rate] }
}

/// Σ fᵢ Xᵢ with numbers fᵢ made from the basis functions.
fn combination(basis: &[BasisFunction], unknowns: &[Expr], factor: impl Fn(&BasisFunction) -> f64) -> Expr {
    let (rows, columns) = (unknowns[0].nrows(), unknowns[0].ncols());
    let terms = basis.iter().zip(unknowns).map(|(function, unknown)| factor(function) * unknown);
    terms.fold(Expr::zeros(rows, columns), |sum, term| sum + term)
}
