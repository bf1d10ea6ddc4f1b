//! Is a governed reference a motion of the model, for every ρ between the grid points, with rounding accounted for?
//!
//! A reference moved by the matrices of a [`Motion`] leaves the residual
//!
//! ```text
//! w = ẋ_ref − A(ρ)(x_ref − x*) − B(ρ)u_ref = Σ_k s⁽ᵏ⁺¹⁾ R_kΔ + ρ̇ Σ_k s⁽ᵏ⁾ S_kΔ,
//! R_k = Z_k − A Z_{k+1} − B U_{k+1},   S_k = ∂Z_k/∂ρ − B V_k,
//! ```
//!
//! where the last holds for the ρ̇ that the governor takes, flow(ρ)(x − x*) of the file. The plant's is A_ρ(ρ)(x − x*) + B_ρ(ρ)u with its
//! own rows; their difference times s⁽ᵏ⁾ BV_kΔ is added to w. Also − A(ρ)Z₀ times where the reference is. In exact arithmetic R, S and AZ₀ vanish; in the numbers of the file they are of the size of
//! rounding errors. They are enclosed over cells of ρ, as the claims of `proof` are, and w is a disturbance to the error.
//!
//! **How much disturbance the set absorbs.** Let the cost claim be proved, V̇ ≤ −(xᵀQx)/κ without w, and let Y(ρ) ⪰ yI, Q ⪰ qI. On the
//! edge V = γ: eᵀQe ≥ q|e|² ≥ q y γ, and |2eᵀPw| ≤ 2√V √(wᵀPw) ≤ 2√γ |w|/√y. So V̇ < 0 there, and {V ≤ γ} stays invariant, if
//!
//! ```text
//! |w| < q y^{3/2} √γ / (2κ).
//! ```

use super::matrix::{CellMatrix, Definiteness, TaylorMatrix};
use super::sought::COST_INFLATION_RATE_BOUNDED;
use crate::certificate::claim::{Claim, ClaimKind, Of, Verdict, Words};
use crate::controller::{Governor, Motion};
use crate::math::Mat;
use crate::math::decimal::{at_least, at_most};
use crate::math::eigen::smallest_eigenvalue;
use crate::math::interval::Interval;
use crate::math::matrix::inverse_spd;
use crate::math::taylor::Taylor;
use crate::model::MatrixFunction;
use crate::plant::Plant;
use crate::synthesis::Design;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::time::Instant;

/// Cells over the range of the parameter for the residuals. The enclosures are wider than the residuals by the square of the
/// cells' width.
const CELLS: usize = 1 << 12;
/// Cells at which it is first tried to prove the bound on Y; halvings of one.
const FIRST_CELLS: usize = 32;
const MOST_HALVINGS: usize = 12;
/// The bound on Y that is proved, against the least eigenvalue at the points where it is looked for.
const EIGENVALUE_SHARE: f64 = 0.5;
/// Displacements of a set-point state for which the claim is made: a kilometre, where it is a length.
const FARTHEST_MOVE: f64 = 1000.0;
/// Where the reference may be: beyond it a state counts as diverged.
const FARTHEST_PLACE: f64 = 1e6;

/// Enclosed residuals of a reference's motions, and the disturbance that the certified sets absorb.
#[derive(Clone, Debug)]
pub struct MotionProof {
    /// Bounds on the entries of R₀ … R_{K−1}, over all ρ.
    residuals: Vec<Mat<f64>>,
    /// Bounds on the entries of S₁ … S_{K−1}.
    rate_residuals: Vec<Mat<f64>>,
    /// Bounds on the entries of BV₁ … BV_{K−1}; empty where no input depends on the rate.
    turning: Vec<Mat<f64>>,
    /// Bound on the difference of the plant's ρ̇ to the governor's.
    rate_gap: f64,
    /// Bounds on the entries of AZ₀.
    rest: Mat<f64>,
    /// |w| below this leaves every certified set of the controller invariant.
    pub absorbed: f64,
    /// What is claimed of it.
    pub claim: Claim,
}

impl MotionProof {
    /// A bound on |w| for the displacement `delta` with the profile that the governor takes for it.
    pub fn disturbance(&self, governor: &Governor, motion: &Motion, delta: &[f64], scheduling: Option<usize>) -> f64 {
        let peaks = governor.profile(motion, delta, scheduling).peaks();
        let n = self.residuals[0].nrows();
        let of_row = |i: usize| {
            let row = |m: &Mat<f64>| delta.iter().enumerate().map(|(j, d)| m[(i, j)] * d.abs()).sum::<f64>();
            let along: f64 = self.residuals.iter().zip(&peaks).map(|(r, p)| p * row(r)).sum();
            let across: f64 = self.rate_residuals.iter().zip(&peaks).map(|(r, p)| p * row(r)).sum();
            let rest: f64 = (0..delta.len()).map(|j| self.rest[(i, j)]).sum();
            let turning: f64 = self.turning.iter().zip(&peaks).map(|(r, p)| p * row(r)).sum();
            let unforeseen = if turning == 0.0 { 0.0 } else { turning * self.rate_gap };
            along + motion.parameter_rate * across + unforeseen + FARTHEST_PLACE * rest
        };
        let n = if crate::mutant::is("governor-row-skipped") { n - 1 } else { n };
        (0..n).map(|i| of_row(i).powi(2)).sum::<f64>().sqrt()
    }

    /// Whether the certified sets stay invariant during the move `delta`.
    pub fn absorbs(&self, governor: &Governor, motion: &Motion, delta: &[f64], scheduling: Option<usize>) -> bool {
        // the sums above are in floating point: a part in a million is far more than their rounding
        self.claim.verdict == Verdict::Proved
            && self.disturbance(governor, motion, delta, scheduling) * (1.0 + 1e-6) < self.absorbed
    }
}

/// Enclose the residuals of the motions of `governor`, and bound the disturbance that the sets of `members`, each with its
/// proved level, absorb.
pub(in super::super) fn prove_motion(
    governor: &Governor,
    motion: &Motion,
    members: &[(&Design, f64)],
    plant: &dyn Plant,
) -> MotionProof {
    let started = Instant::now();
    let description = plant.description();
    let (low, high) = match &description.scheduling {
        // beyond the end, so that rounding of the ends leaves no gap in the circle
        Some(scheduling) => (scheduling.range[0], scheduling.range[1] + 1e-9),
        None => (0.0, 0.0),
    };
    let count = if description.scheduling.is_some() { CELLS } else { 1 };
    let edge = |i: usize| low + (high - low) * i as f64 / count as f64;
    let cells: Vec<Residuals> = (0..count)
        .into_par_iter()
        .map(|i| Residuals::on_cell(governor, motion, plant, Interval::new(edge(i), edge(i + 1))))
        .collect();
    let scheduling_state = description.scheduling.as_ref().map(|scheduling| scheduling.state);
    let largest = |of: fn(&Residuals) -> &Vec<Mat<f64>>| -> Vec<Mat<f64>> {
        let first = of(&cells[0]);
        let most = |k: usize, i: usize, j: usize| cells.iter().map(|cell| of(cell)[k][(i, j)]).fold(0.0, f64::max);
        (0..first.len()).map(|k| Mat::from_fn(first[k].nrows(), first[k].ncols(), |i, j| most(k, i, j))).collect()
    };
    let absorbed =
        members.iter().map(|&(design, level)| absorbed(design, level, low, high)).fold(f64::INFINITY, f64::min);

    let names: Vec<&str> =
        governor.set_point_states.iter().map(|&state| description.states[state].name.as_str()).collect();
    let mut proof = MotionProof {
        residuals: largest(|cell| &cell.along),
        rate_residuals: largest(|cell| &cell.across),
        turning: largest(|cell| &cell.turning),
        rate_gap: cells.iter().map(|cell| cell.rate_gap).fold(0.0, f64::max),
        rest: Mat::from_fn(description.states.len(), names.len(), |i, j| {
            cells.iter().map(|cell| cell.rest[(i, j)]).fold(0.0, f64::max)
        }),
        absorbed,
        claim: Claim {
            cells: count,
            ..Claim::new(
                ClaimKind::GovernedMotion {
                    states: names.iter().map(|name| (*name).to_owned()).collect(),
                    farthest: FARTHEST_MOVE,
                },
                Of::Model,
                &Words::default(),
            )
        },
    };
    let of_state = |j: usize| {
        let farthest = if description.states[governor.set_point_states[j]].wraps { PI } else { FARTHEST_MOVE };
        let delta: Vec<f64> = (0..names.len()).map(|i| if i == j { farthest } else { 0.0 }).collect();
        proof.disturbance(governor, motion, &delta, scheduling_state)
    };
    let disturbance = (0..names.len()).map(of_state).fold(0.0, f64::max);
    proof.claim.verdict = if disturbance < proof.absorbed { Verdict::Proved } else { Verdict::Undecided };
    proof.claim.margin = proof.absorbed - disturbance;
    proof.claim.detail = format!(
        "residual at most {}, the sets absorb {}; {count} cells",
        at_most(disturbance),
        at_least(proof.absorbed)
    );
    let divided =
        |design: &Design| governor.authority_is_divided(&design.controller.limits, &design.controller.operating_input);
    let rate = |design: &Design| design.rate_bounded.as_ref().map_or(0.0, |bounded| bounded.rate);
    if !motion.inputs_by_rate.is_empty() && members.iter().any(|(design, _)| rate(design) > motion.parameter_rate) {
        proof.claim.verdict = Verdict::Undecided;
        proof.claim.detail = "the reference is for a smaller rate of the parameter than the design".into();
    }
    if !members.iter().all(|(design, _)| divided(design)) && !crate::mutant::is("governor-authority") {
        proof.claim.verdict = Verdict::Undecided;
        proof.claim.detail = "the reference's input and the feedback's limits together exceed the actuators".into();
    }
    proof.claim.seconds = started.elapsed().as_secs_f64();
    proof
}

/// Bounds on the entries of R_k and S_k on a cell.
struct Residuals {
    along: Vec<Mat<f64>>,
    across: Vec<Mat<f64>>,
    turning: Vec<Mat<f64>>,
    rate_gap: f64,
    /// A Z₀
    rest: Mat<f64>,
}

impl Residuals {
    fn on_cell(governor: &Governor, motion: &Motion, plant: &dyn Plant, cell: Interval) -> Self {
        let middle = cell.middle();
        let half =
            (Interval::point(cell.hi()) - middle).magnitude().max((Interval::point(middle) - cell.lo()).magnitude());
        let at_middle = matrices(governor, motion, plant, Taylor::variable_of_first_order(Interval::point(middle)));
        let over = matrices(governor, motion, plant, Taylor::variable(cell));
        let bound = |middle: &TaylorMatrix, over: &TaylorMatrix, rows: usize, columns: usize| {
            let half = Interval::point(half);
            Mat::from_fn(rows, columns, |i, j| {
                let (middle, over) = (middle.at(i, j), over.at(i, j));
                let bend = over.bend.unwrap_or(Interval::ENTIRE).magnitude();
                let linear = half * middle.slope.magnitude();
                (Interval::point(middle.value.magnitude()) + linear + half.square() * 0.5 * bend).hi()
            })
        };
        let (n, m) = (plant.description().states.len(), plant.description().inputs.len());
        let d = governor.set_point_states.len();
        let bounds = |middle: &[TaylorMatrix], over: &[TaylorMatrix]| {
            middle.iter().zip(over).map(|(middle, over)| bound(middle, over, n, d)).collect()
        };
        Self {
            along: bounds(&at_middle.along, &over.along),
            across: bounds(&at_middle.across, &over.across),
            turning: bounds(&at_middle.turning, &over.turning),
            rate_gap: rate_gap(&bound(&at_middle.flow_gap, &over.flow_gap, 1, n + m), motion),
            rest: Mat::from_fn(n, d, |i, j| over.rest.at(i, j).value.magnitude()),
        }
    }
}

/// Bound on the difference of the rates: of its row for states and inputs, with states anywhere and inputs within the actuators.
fn rate_gap(row: &Mat<f64>, motion: &Motion) -> f64 {
    let n = row.ncols() - motion.input_budget.len();
    let of_input = |i: usize| match (row[(0, n + i)], motion.actuators.min[i], motion.actuators.max[i]) {
        (0.0, _, _) => 0.0,
        // a deviation from u*, which lies in between
        (entry, Some(min), Some(max)) => entry * (max - min),
        _ => f64::INFINITY,
    };
    let states: f64 = (0..n).map(|j| row[(0, j)] * FARTHEST_PLACE).sum();
    // rounding of these sums is far below the part in a million that is added
    (states + (0..motion.input_budget.len()).map(of_input).sum::<f64>()) * (1.0 + 1e-6)
}

struct Matrices {
    along: Vec<TaylorMatrix>,
    across: Vec<TaylorMatrix>,
    turning: Vec<TaylorMatrix>,
    /// The plant's row for ρ̇ less the governor's, 1 × (n + m).
    flow_gap: TaylorMatrix,
    rest: TaylorMatrix,
}

fn matrices(governor: &Governor, motion: &Motion, plant: &dyn Plant, rho: Taylor) -> Matrices {
    let description = plant.description();
    let (n, m, d) = (description.states.len(), description.inputs.len(), governor.set_point_states.len());
    let (x, u) = plant.trim_over(rho);
    let (a, b) = plant.jacobians_over(&x, &u);
    let (a, b) = (TaylorMatrix::new(n, n, a), TaylorMatrix::new(n, m, b));
    let value = |function: &MatrixFunction| TaylorMatrix::of_function(function, rho);
    let slope = |function: &MatrixFunction| {
        let [_, slope] = TaylorMatrix::of_function_and_derivative(function, rho);
        slope
    };
    let unit =
        TaylorMatrix::from_fn(n, d, |i, j| Taylor::from(if i == governor.set_point_states[j] { 1.0 } else { 0.0 }));
    let rest = a.times(&unit);
    let mut z = vec![unit];
    z.extend(motion.states.iter().map(value));
    let along = (motion.inputs.iter().enumerate())
        .map(|(k, u)| {
            let input = z[k].minus(&b.times(&value(u)));
            match z.get(k + 1) {
                Some(next) => input.minus(&a.times(next)),
                None => input,
            }
        })
        .collect();
    let turning: Vec<TaylorMatrix> = motion.inputs_by_rate.iter().map(|v| b.times(&value(v))).collect();
    let across = (motion.states.iter().enumerate())
        .map(|(k, z)| match turning.get(k) {
            Some(turning) => slope(z).minus(turning),
            None => slope(z),
        })
        .collect();
    let flow = motion.parameter_flow.as_ref().map(value);
    let flow_gap = TaylorMatrix::from_fn(1, n + m, |_, j| match (description.scheduling.as_ref(), &flow) {
        (Some(scheduling), Some(flow)) if j < n => a.at(scheduling.state, j) - flow.at(0, j),
        (Some(scheduling), _) if j < n => a.at(scheduling.state, j),
        (Some(scheduling), _) => b.at(scheduling.state, j - n),
        (None, _) => Taylor::from(0.0),
    });
    Matrices { along, across, turning, flow_gap, rest }
}

/// q y^{3/2} √γ/(2κ) for the set of a design; zero where y could not be proved.
fn absorbed(design: &Design, level: f64, low: f64, high: f64) -> f64 {
    let q = EIGENVALUE_SHARE * smallest_eigenvalue(&design.weights.q);
    let identity = |n: usize, scale: f64| Mat::from_fn(n, n, |i, j| if i == j { scale } else { 0.0 });
    let n = design.weights.q.nrows();
    let positive = |middle: &TaylorMatrix, over: &TaylorMatrix, half: f64| {
        matches!(CellMatrix::new(middle, over).is_positive(half), Definiteness::Proved(_))
    };
    // a ≻ b, with the rounding of the difference
    let is_more = |a: &Mat<f64>, b: &Mat<f64>| {
        let matrix = TaylorMatrix::constant(a).minus(&TaylorMatrix::constant(b));
        positive(&matrix, &matrix, 0.0)
    };
    if !is_more(&design.weights.q, &identity(n, q)) {
        return 0.0;
    }
    let y = match &design.rate_bounded {
        None => {
            let p = &design.points[0].p;
            let y = EIGENVALUE_SHARE * inverse_spd(p).map_or(0.0, |y| smallest_eigenvalue(&y));
            if y > 0.0 && is_more(&identity(n, (1.0 / y).next_down()), p) { y } else { 0.0 }
        }
        Some(bounded) => {
            let edge = |i: usize| low + (high - low) * i as f64 / FIRST_CELLS as f64;
            let least = (0..4 * FIRST_CELLS)
                .map(|i| {
                    smallest_eigenvalue(&bounded.y.at(&[low + (high - low) * i as f64 / (4 * FIRST_CELLS) as f64]))
                })
                .fold(f64::INFINITY, f64::min);
            let y = EIGENVALUE_SHARE * least;
            let shift = TaylorMatrix::constant(&identity(n, y));
            let matrix = |rho: Taylor| TaylorMatrix::of_function(&bounded.y, rho).minus(&shift);
            let holds = |cell: Interval| {
                let middle = cell.middle();
                let half = (cell.hi() - middle).max(middle - cell.lo()) * (1.0 + 1e-12);
                let at_middle = matrix(Taylor::variable_of_first_order(Interval::point(middle)));
                positive(&at_middle, &matrix(Taylor::variable(cell)), half)
            };
            let first: Vec<Interval> = (0..FIRST_CELLS).map(|i| Interval::new(edge(i), edge(i + 1))).collect();
            if y > 0.0 && first.into_par_iter().all(|cell| holds_halved(&holds, cell, MOST_HALVINGS)) { y } else { 0.0 }
        }
    };
    // rounding of these few operations is far below the halves taken above
    q * y.powf(1.5) * level.sqrt() / (2.0 * COST_INFLATION_RATE_BOUNDED)
}

/// Whether `holds` is true of `cell`, or of its halves.
fn holds_halved(holds: &(impl Fn(Interval) -> bool + Sync), cell: Interval, halvings: usize) -> bool {
    if holds(cell) {
        return true;
    }
    let middle = cell.middle();
    halvings > 0
        && holds_halved(holds, Interval::new(cell.lo(), middle), halvings - 1)
        && holds_halved(holds, Interval::new(middle, cell.hi()), halvings - 1)
}
