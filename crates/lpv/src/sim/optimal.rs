//! The least cost that any controller can reach on a nonlinear plant, by Pontryagin's principle.
//!
//! For ẋ = f(x, u) affine in u and J = ∫ xᵀQx + uᵀRu dt the optimal trajectories that end at rest in the origin are the
//! stable manifold of
//!
//! ```text
//! ẋ = f(x, u),   ṗ = −2Qx − (∂f/∂x)ᵀp,   u = −½R⁻¹(∂f/∂u)ᵀp,
//! ```
//!
//! p = ∂V/∂x. Near the origin p = 2Px with P the Riccati solution, up to terms of third order for an odd f. Time runs
//! backward from there: the manifold attracts then, so that the error of the start dies out. What is unknown is the point ξ
//! of the manifold, a fixed time T before which the trajectory was at x₀: n equations for n unknowns, solved by Newton's
//! method along a homotopy from the linear plant's answer.

use super::adaptive::{AdaptiveOptions, IntegrationError, integrate};
use crate::math::hold::discretize;
use crate::math::matrix::{from_row_slice, quadratic_form, solve};
use crate::math::{Mat, riccati};
use crate::model::linearize;
use crate::plant::Plant;
use differential_equations::prelude::ODE;

/// An optimal trajectory.
#[derive(Clone, Debug)]
pub struct OptimalTrajectory {
    /// V(x₀) = min J.
    pub cost: f64,
    /// t
    pub time_s: Vec<f64>,
    /// x(t)
    pub states: Vec<Vec<f64>>,
    /// Distance from x₀ at which the trajectory begins: what Newton's method left.
    pub residual: f64,
}

/// Why no optimal trajectory was found.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum OptimalError {
    /// No regulator of the linearised problem was found.
    #[error("no regulator of the linearised plant was found: {0}")]
    Riccati(#[from] riccati::RiccatiError),
    /// An integration failed.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// Newton's method did not converge.
    #[error("the shooting method did not converge: the trajectory begins {residual:.2e} from the initial state")]
    NotConverged {
        /// Distance from x₀.
        residual: f64,
    },
}

/// State and costate, and J.
struct Hamiltonian<'a> {
    plant: &'a dyn Plant,
    q: &'a Mat<f64>,
    r_inverse: Mat<f64>,
    r: &'a Mat<f64>,
    inputs: usize,
}

impl ODE<f64, Vec<f64>> for Hamiltonian<'_> {
    fn diff(&self, _t: f64, z: &Vec<f64>, dz: &mut Vec<f64>) {
        let (n, m) = (self.q.nrows(), self.inputs);
        let (x, p) = (&z[..n], &z[n..2 * n]);
        let w = vec![0.0; self.plant.description().disturbances.len()];
        let (mut a, mut b, mut u) = (vec![0.0; n * n], vec![0.0; n * m], vec![0.0; m]);
        // affine in u: ∂f/∂u does not depend on it
        self.plant.dynamics_by_input(x, &u, &w, &mut b);
        let pull: Vec<f64> = (0..m).map(|j| (0..n).map(|i| b[i * m + j] * p[i]).sum()).collect();
        for (i, u) in u.iter_mut().enumerate() {
            *u = -0.5 * (0..m).map(|j| self.r_inverse[(i, j)] * pull[j]).sum::<f64>();
        }
        self.plant.dynamics(x, &u, &w, &mut dz[..n]);
        self.plant.dynamics_by_state(x, &u, &w, &mut a);
        for i in 0..n {
            let weight: f64 = (0..n).map(|j| self.q[(i, j)] * x[j]).sum();
            dz[n + i] = -2.0 * weight - (0..n).map(|j| a[j * n + i] * p[j]).sum::<f64>();
        }
        dz[2 * n] = quadratic_form(self.q, x) + quadratic_form(self.r, &u);
    }
}

/// The locally optimal trajectory from `initial_state` to the origin that a homotopy from the linear plant's leads to.
///
/// * `q`: Q = Qᵀ ≻ 0, n × n; `r`: R = Rᵀ ≻ 0, m × m.
/// * The plant rests at the origin with u* = 0, and is affine in u.
/// * `horizon_s`: T. The cost after it is taken as quadratic; its error is of fourth order in what is left of the state.
///
/// # Errors
/// See [`OptimalError`].
pub fn optimal_trajectory(
    plant: &dyn Plant,
    (q, r): (&Mat<f64>, &Mat<f64>),
    initial_state: &[f64],
    horizon_s: f64,
) -> Result<OptimalTrajectory, OptimalError> {
    let n = initial_state.len();
    let model = linearize(plant, 0.0);
    let regulator = riccati::solve(&model.a, &model.b, q, r)?;
    let closed_loop = &model.a - &model.b * &regulator.k;
    let (decay, _) = discretize(&closed_loop, &Mat::zeros(n, 1), horizon_s);
    let r_inverse = crate::math::matrix::inverse(r);
    let system = Hamiltonian { plant, q, r_inverse, r, inputs: r.nrows() };
    let options = AdaptiveOptions { relative_tolerance: 1e-13, absolute_tolerance: 1e-15, longest_step_s: 0.5 };
    // η is where the linear plant would have begun: ξ = e^{(A − BK)T} η
    let shoot = |eta: &[f64]| {
        let end: Vec<f64> = (0..n).map(|i| (0..n).map(|j| decay[(i, j)] * eta[j]).sum()).collect();
        let costate = (0..n).map(|i| 2.0 * (0..n).map(|j| regulator.p[(i, j)] * end[j]).sum::<f64>());
        // J runs backward too, from minus what is left
        let tail = -quadratic_form(&regulator.p, &end);
        let start = end.iter().copied().chain(costate).chain([tail]).collect();
        integrate(&system, start, -horizon_s, &options)
    };
    let miss = |eta: &[f64], target: &[f64]| -> Result<Vec<f64>, IntegrationError> {
        Ok(shoot(eta)?.last()[..n].iter().zip(target).map(|(x, target)| x - target).collect())
    };

    const STAGES: usize = 10;
    let mut eta: Vec<f64> = initial_state.iter().map(|x| x / STAGES as f64).collect();
    let mut residual = f64::INFINITY;
    for stage in 1..=STAGES {
        let target: Vec<f64> = initial_state.iter().map(|x| x * stage as f64 / STAGES as f64).collect();
        for _ in 0..12 {
            let here = miss(&eta, &target)?;
            residual = here.iter().map(|e| e * e).sum::<f64>().sqrt();
            if residual < 1e-10 {
                break;
            }
            let mut jacobian = vec![0.0; n * n];
            for j in 0..n {
                let step = 1e-6 * (1.0 + eta[j].abs());
                let mut moved = eta.clone();
                moved[j] += step;
                for (i, value) in miss(&moved, &target)?.into_iter().enumerate() {
                    jacobian[i * n + j] = (value - here[i]) / step;
                }
            }
            let change = solve(&from_row_slice(n, n, &jacobian), &from_row_slice(n, 1, &here));
            for (j, eta) in eta.iter_mut().enumerate() {
                *eta -= change[(j, 0)];
            }
        }
    }
    if residual.is_nan() || residual > 1e-8 {
        return Err(OptimalError::NotConverged { residual });
    }
    let path = shoot(&eta)?;
    let time_s = path.time_s.iter().rev().map(|t| t + horizon_s).collect();
    let cost = -path.last()[2 * n];
    let states = path.states.iter().rev().map(|z| z[..n].to_vec()).collect();
    Ok(OptimalTrajectory { cost, time_s, states, residual })
}
