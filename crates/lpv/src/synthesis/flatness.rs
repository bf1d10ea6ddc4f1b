//! The motions of an LPV model that a reference can make ([`Motion`]), found from A(ρ) and B(ρ) alone.
//!
//! For each state j in whose direction the plant rests anywhere, A(ρ)eⱼ = 0, the chain z₀ = eⱼ, A z_{k+1} + B u_{k+1} = z_k is
//! followed by least squares of least norm at each point of a grid, until z_k is in the range of B: then B u_{k+1} = z_k ends it.
//! What was found at the points is interpolated by harmonics, and the equations are checked between the points.

use super::SupervisionError;
use crate::controller::{InputLimits, MOST_ORDER, Motion};
use crate::math::Mat;
use crate::math::matrix::least_squares;
use crate::model::{FrozenModel, GridModel, MatrixFunction};
use crate::plant::Plant;

/// Points over the range of the parameter at which the chains are followed; and between which they are checked.
const POINTS: usize = 16;
const CHECKS_PER_POINT: usize = 7;
/// Relative size of what counts as zero.
const ZERO: f64 = 1e-9;
/// Harmonics below this, against the largest entry, are rounding.
const HARMONIC_TOLERANCE: f64 = 1e-12;

/// The states in whose directions the plant rests anywhere: A(ρ)eⱼ = 0 for every ρ.
pub fn set_point_states(plant: &dyn Plant) -> Vec<usize> {
    let grid = GridModel::of_plant(plant, POINTS).points;
    let scale = grid.iter().map(|point| point.a.norm_max()).fold(0.0, f64::max);
    let is_zero = |j: usize| grid.iter().all(|point| point.a.col(j).norm_max() <= ZERO * scale);
    (0..plant.description().states.len()).filter(|&j| is_zero(j)).collect()
}

/// The motions along the states `states`, with bounds of inputs and states still open.
pub(super) fn motion(plant: &dyn Plant, states: &[usize], parameter_rate: f64) -> Result<Motion, SupervisionError> {
    let description = plant.description();
    if description.scheduling.as_ref().is_some_and(|scheduling| !scheduling.periodic) {
        return Err(SupervisionError::NotPeriodic);
    }
    let grid = GridModel::of_plant(plant, POINTS).points;
    let chains = (grid.iter()).map(|model| chains(model, states)).collect::<Result<Vec<Chains>, SupervisionError>>()?;
    let interpolated = |of: &dyn Fn(&Chains, &FrozenModel) -> Mat<f64>| {
        let samples: Vec<Mat<f64>> = chains.iter().zip(&grid).map(|(chains, model)| of(chains, model)).collect();
        match samples.len() {
            1 => MatrixFunction::constant(samples[0].clone()),
            _ => MatrixFunction::trigonometric(grid[0].rho, &samples, HARMONIC_TOLERANCE),
        }
    };
    let order = chains.iter().map(|chains| chains.inputs.len()).max().unwrap_or(0);
    let (n, m) = (description.states.len(), description.inputs.len());
    let zero = |rows: usize| Mat::zeros(rows, states.len());
    let z: Vec<MatrixFunction> = (1..order)
        .map(|k| interpolated(&|chains, _| chains.states.get(k).cloned().unwrap_or_else(|| zero(n))))
        .collect();
    let inputs = (0..order)
        .map(|k| interpolated(&|chains, _| chains.inputs.get(k).cloned().unwrap_or_else(|| zero(m))))
        .collect();
    let moves = |z: &MatrixFunction| z.basis.len() > 1;
    let inputs_by_rate: Vec<MatrixFunction> = match z.iter().any(moves) {
        false => Vec::new(),
        true => (z.iter())
            .map(|z| {
                interpolated(&|_, model| {
                    least_squares(&model.b, &z.derivative(&[model.rho], 0)).unwrap_or_else(|| zero(m))
                })
            })
            .collect(),
    };
    let parameter_flow = (description.scheduling.as_ref()).map(|scheduling| {
        let row = |model: &FrozenModel| Mat::from_fn(1, n, |_, j| model.a[(scheduling.state, j)]);
        interpolated(&|_, model| row(model))
    });
    let motion = Motion {
        states: z,
        inputs,
        inputs_by_rate,
        parameter_flow,
        parameter_rate,
        input_budget: vec![0.0; m],
        state_bounds: vec![None; n],
        actuators: InputLimits::none(m),
    };
    check(plant, states, &motion)?;
    Ok(motion)
}

/// z₀, z₁, … and u₁, u₂, … of all states, a column each.
struct Chains {
    states: Vec<Mat<f64>>,
    inputs: Vec<Mat<f64>>,
}

fn chains(model: &FrozenModel, states: &[usize]) -> Result<Chains, SupervisionError> {
    let (n, m, d) = (model.a.nrows(), model.b.ncols(), states.len());
    let both = Mat::from_fn(n, n + m, |i, j| if j < n { model.a[(i, j)] } else { model.b[(i, j - n)] });
    let mut found =
        Chains { states: vec![Mat::from_fn(n, d, |i, j| if i == states[j] { 1.0 } else { 0.0 })], inputs: Vec::new() };
    // the columns that have not ended yet
    let mut open: Vec<usize> = (0..d).collect();
    while !open.is_empty() {
        let last = &found.states[found.states.len() - 1];
        let (mut next, mut input) = (Mat::zeros(n, d), Mat::zeros(m, d));
        let mut still_open = Vec::new();
        for &j in &open {
            let flat = || SupervisionError::NotFlat { state: states[j] };
            let column = last.submatrix(0, j, n, 1).to_owned();
            let residual = |matrix: &Mat<f64>, x: &Mat<f64>| (matrix * x - &column).norm_max() / column.norm_max();
            let ending = least_squares(&model.b, &column).filter(|u| residual(&model.b, u) <= ZERO);
            if let Some(u) = ending {
                (0..m).for_each(|i| input[(i, j)] = u[(i, 0)]);
                continue;
            }
            let step = least_squares(&both, &column).filter(|x| residual(&both, x) <= ZERO).ok_or_else(flat)?;
            (0..n).for_each(|i| next[(i, j)] = step[(i, 0)]);
            (0..m).for_each(|i| input[(i, j)] = step[(n + i, 0)]);
            still_open.push(j);
        }
        found.inputs.push(input);
        if let (Some(&j), true) = (still_open.first(), found.inputs.len() == MOST_ORDER) {
            return Err(SupervisionError::NotFlat { state: states[j] });
        }
        if !still_open.is_empty() {
            found.states.push(next);
        }
        open = still_open;
    }
    Ok(found)
}

/// The equations of [`Motion`] on a fine grid.
fn check(plant: &dyn Plant, states: &[usize], motion: &Motion) -> Result<(), SupervisionError> {
    let description = plant.description();
    let (n, d) = (description.states.len(), states.len());
    let flow_row = description.scheduling.as_ref().map(|scheduling| scheduling.state);
    for model in GridModel::of_plant(plant, CHECKS_PER_POINT * POINTS).points {
        let rho = [model.rho];
        let z = |k: usize| match k {
            0 => Mat::from_fn(n, d, |i, j| if i == states[j] { 1.0 } else { 0.0 }),
            _ => motion.states.get(k - 1).map_or_else(|| Mat::zeros(n, d), |z| z.at(&rho)),
        };
        for (k, u) in motion.inputs.iter().enumerate() {
            let residual = &model.a * z(k + 1) + &model.b * u.at(&rho) - z(k);
            // a column that ended before has z = 0 and u = 0
            if let Some(j) = (0..d).find(|&j| residual.col(j).norm_max() > ZERO * z(k).norm_max().max(1.0)) {
                return Err(SupervisionError::NotFlat { state: states[j] });
            }
        }
        for (k, v) in motion.inputs_by_rate.iter().enumerate() {
            let slope = motion.states[k].derivative(&rho, 0);
            let residual = &model.b * v.at(&rho) - &slope;
            if let Some(j) = (0..d).find(|&j| residual.col(j).norm_max() > ZERO * slope.norm_max().max(1.0)) {
                return Err(SupervisionError::NotFlat { state: states[j] });
            }
        }
        // ρ̇ must be known before the input is
        let by_input = flow_row.map_or(0.0, |row| model.b.row(row).norm_max());
        if !motion.inputs_by_rate.is_empty() && by_input > ZERO * model.b.norm_max() {
            return Err(SupervisionError::NotFlat { state: states[0] });
        }
    }
    Ok(())
}
