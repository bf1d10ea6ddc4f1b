//! What a problem asks to be best, and from where: the objective and the initial state.

use super::file::{DesignTable, LyapunovName, MethodName, ObjectiveName};
use super::plan::Initial;
use super::source::Source;
use super::transformed::check_initial;
use super::values::{convex_weights, matrix, state};
use crate::failure::Failure;
use crate::scenario::door::Door;
use lpv::math::matrix::{inverse_spd, is_symmetric};
use lpv::model::linearize;
use lpv::synthesis::polytopic::Objective;

/// The objective, and whether it is the reach along its states.
pub(super) fn objective(
    door: &Door,
    design: &DesignTable,
    n: usize,
    saturated: bool,
) -> Result<(Objective, bool), Failure> {
    let name = design.objective;
    if design.method == MethodName::Stabilize && name != ObjectiveName::Trace {
        return door.refuse("design.objective", "method \"stabilize\" has its own: the largest margin; remove it");
    }
    for (key, given, belongs) in [
        ("initial_states", design.initial_states.is_some(), ObjectiveName::WorstCase),
        ("ellipsoid", design.ellipsoid.is_some(), ObjectiveName::WorstCase),
        ("directions", design.directions.is_some(), ObjectiveName::Region),
    ] {
        if given && name != belongs {
            let belongs = if belongs == ObjectiveName::Region { "region" } else { "worst-case" };
            return door.refuse(format!("design.{key}"), format!("belongs to objective = \"{belongs}\""));
        }
    }
    let checked = |key: &str, states: &Vec<Vec<f64>>| -> Result<Objective, Failure> {
        if states.is_empty() {
            return door.refuse(format!("design.{key}"), "is empty: give at least one state");
        }
        for (k, x) in states.iter().enumerate() {
            state(door, &format!("design.{key}[{}]", k + 1), x, n)?;
            if x.iter().all(|&value| value == 0.0) {
                return door
                    .refuse(format!("design.{key}[{}]", k + 1), "is zero: its bound is zero whatever the design");
            }
        }
        Ok(Objective::States { states: states.clone(), parameter: None })
    };
    match name {
        ObjectiveName::Trace => Ok((Objective::Trace, false)),
        ObjectiveName::InitialState => match &design.initial_state {
            None => door.refuse("design.initial_state", "is missing: objective = \"initial-state\" is its cost bound"),
            Some(x) => Ok((checked("initial_state", &vec![x.clone()])?, false)),
        },
        ObjectiveName::WorstCase => match (&design.initial_states, &design.ellipsoid) {
            (Some(_), Some(_)) => door.refuse("design.ellipsoid", "and initial_states are both given; keep one"),
            (None, None) => door.refuse(
                "design.initial_states",
                "is missing: objective = \"worst-case\" needs initial_states or ellipsoid",
            ),
            (Some(states), None) => Ok((checked("initial_states", states)?, false)),
            (None, Some(rows)) => {
                let shape = matrix(door, "design.ellipsoid", rows)?;
                if (shape.nrows(), shape.ncols()) != (n, n)
                    || !is_symmetric(&shape, 1e-12)
                    || inverse_spd(&shape).is_none()
                {
                    let message =
                        format!("has to be a symmetric positive definite {n} × {n} matrix S: the states xᵀSx ≤ 1");
                    return door.refuse("design.ellipsoid", message);
                }
                Ok((Objective::Ellipsoid { shape }, false))
            }
        },
        ObjectiveName::Region => match &design.directions {
            _ if !saturated => door.refuse(
                "design.objective",
                "\"region\" is for the methods \"slqr\" and \"slpvqr\": without saturation everything is certified",
            ),
            None => door.refuse("design.directions", "is missing: objective = \"region\" is the reach along them"),
            Some(states) => Ok((checked("directions", states)?, true)),
        },
    }
}

/// Convex weights of the ascending `grid` at `rho`, of its two neighbours; `None` outside.
fn weights_between(grid: &[f64], rho: f64) -> Option<Vec<f64>> {
    let right = (1..grid.len()).find(|&k| grid[k - 1] <= rho && rho <= grid[k])?;
    let share = (rho - grid[right - 1]) / (grid[right] - grid[right - 1]);
    let weight = |k: usize| match k {
        _ if k == right => share,
        _ if k + 1 == right => 1.0 - share,
        _ => 0.0,
    };
    Some((0..grid.len()).map(weight).collect())
}

/// The initial state, and where the parameter starts.
pub(super) fn initial(
    door: &Door,
    design: &DesignTable,
    source: &Source,
    lyapunov: LyapunovName,
) -> Result<Option<Initial>, Failure> {
    let Some(x) = &design.initial_state else {
        return match design.initial_parameter {
            Some(_) => door.refuse("design.initial_parameter", "belongs to initial_state, which is missing"),
            None => Ok(None),
        };
    };
    if design.method == MethodName::Stabilize {
        return door.refuse("design.initial_state", "method \"stabilize\" has no cost to bound; remove it");
    }
    state(door, "design.initial_state", x, source.models[0].a.nrows())?;
    if let Some(transformed) = &source.transformed {
        check_initial(door, x, design.initial_parameter.as_deref(), transformed, &source.states)?;
    }
    let key = "design.initial_parameter";
    let (parameter, model) = match (&design.initial_parameter, &source.polytope, &source.plant) {
        (None, _, _) if lyapunov == LyapunovName::Common || source.models.len() == 1 => {
            (None, (lyapunov == LyapunovName::Frozen).then(|| source.models[0].clone()))
        }
        (None, _, _) => return door.refuse(key, "is missing: the cost bound depends on the parameter at the start"),
        (Some(weights), Some(polytope), _) => {
            convex_weights(door, key, weights, polytope.len())?;
            let model = (lyapunov == LyapunovName::Frozen).then(|| polytope.at(weights));
            (Some(weights.clone()), model)
        }
        (Some(value), None, Some(plant)) => match (value.as_slice(), &plant.description().scheduling) {
            ([rho], Some(scheduling)) if rho.is_finite() => match lyapunov {
                LyapunovName::Common => (None, None),
                LyapunovName::Frozen => (None, Some(linearize(&**plant, *rho))),
                LyapunovName::ParameterDependent => {
                    let grid: Vec<f64> = source.models.iter().map(|model| model.rho).collect();
                    let Some(weights) = weights_between(&grid, *rho) else {
                        let message = format!(
                            "is {rho}: {} of the model's grid is from {} to {}",
                            scheduling.parameter,
                            grid[0],
                            grid[grid.len() - 1]
                        );
                        return door.refuse(key, message);
                    };
                    (Some(weights), None)
                }
            },
            (_, Some(scheduling)) => {
                return door.refuse(key, format!("has to be one finite number, {}", scheduling.parameter));
            }
            (_, None) => return door.refuse(key, "the plant has no scheduling parameter; remove it"),
        },
        (Some(_), None, None) => return door.refuse(key, "has no model to belong to"),
    };
    Ok(Some(Initial { state: x.clone(), parameter, model }))
}
