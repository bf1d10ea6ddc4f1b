//! Nested certified sets and the reference governor of a controller.

use super::door::Door;
use super::file::{ControllerTable, GovernorReference, GovernorTable};
use super::request::RequestDefaults;
use super::set_point::state_value;
use crate::failure::Failure;
use lpv::synthesis::{DesignRequest, GovernorOptions, Supervision, SupervisionError, governed_states, governor};

/// Inner members of a family, at most: each is a design and a proof of its own.
const MOST_INNER: usize = 8;
/// β and φ where the file says none.
const LEVEL_SHARE: f64 = 0.9;
const FEEDFORWARD: f64 = 0.5;

/// The keys `nested` and `governor` of a controller.
pub(super) fn supervision(
    door: &Door,
    key: &str,
    table: &ControllerTable,
    request: &DesignRequest,
    defaults: &RequestDefaults,
) -> Result<Supervision, Failure> {
    let given = [("nested", table.nested.is_some()), ("governor", table.governor.is_some())];
    let Some((name, _)) = given.into_iter().find(|(_, given)| *given) else {
        return Ok(Supervision::default());
    };
    let Some(gamma) = request.method.gamma() else {
        return door.refuse(
            format!("{key}.{name}"),
            "needs a certified set: choose method \"slpvqr\" or \"high-gain-slpvqr\"",
        );
    };
    if let (Some(scheduling), None) = (&defaults.description.scheduling, &request.rate_bounded) {
        return door.refuse(
            format!("{key}.{name}"),
            format!("needs rate_bound: without it the design is certified for {} at rest only", scheduling.parameter),
        );
    }
    let mut inner_levels = Vec::new();
    let levels = table.nested.iter().flatten().enumerate();
    for (k, &level) in levels {
        let key = format!("{key}.nested[{}]", k + 1);
        if !(level > 0.0 && level < gamma) {
            return door.refuse(key, format!("is {level}: inner levels lie between 0 and gamma = {gamma}"));
        }
        if inner_levels.contains(&level) {
            return door.refuse(key, format!("is {level}, as another one; keep one"));
        }
        inner_levels.push(level);
    }
    if table.nested.is_some() && !(1..=MOST_INNER).contains(&inner_levels.len()) {
        let message = format!("has {} levels: allowed are 1 to {MOST_INNER}", inner_levels.len());
        return door.refuse(format!("{key}.nested"), message);
    }
    let governor = match &table.governor {
        None => None,
        Some(governor) => Some(options(door, &format!("{key}.governor"), governor, request, defaults)?),
    };
    Ok(Supervision { inner_levels, governor })
}

fn options(
    door: &Door,
    key: &str,
    table: &GovernorTable,
    request: &DesignRequest,
    defaults: &RequestDefaults,
) -> Result<GovernorOptions, Failure> {
    let share = |name: &str, value: Option<f64>, default: f64| match value.unwrap_or(default) {
        value if value > 0.0 && value < 1.0 => Ok(value),
        value => door.refuse(format!("{key}.{name}"), format!("is {value}: it has to be a share, above 0 and below 1")),
    };
    let level_share = share("level", table.level, LEVEL_SHARE)?;
    let rate = request.rate_bounded.as_ref().map_or(0.0, |bounded| bounded.rate);
    let movable = governed_states(defaults.plant, rate);
    let names = |states: &[usize]| {
        let names: Vec<&str> = states.iter().map(|&state| defaults.description.states[state].name.as_str()).collect();
        names.join(", ")
    };
    let mut state_bounds = vec![None; defaults.description.states.len()];
    let feedforward = match table.reference {
        GovernorReference::Moving => Some(share("feedforward", table.feedforward, FEEDFORWARD)?),
        GovernorReference::Static => {
            let foreign = [("feedforward", table.feedforward.is_some()), ("bounds", table.bounds.is_some())];
            if let Some((name, _)) = foreign.into_iter().find(|(_, given)| *given) {
                return door.refuse(format!("{key}.{name}"), "belongs to moving references only");
            }
            None
        }
    };
    for (name, value) in table.bounds.iter().flatten() {
        let key = format!("{key}.bounds.{name}");
        let (state, bound) = state_value(door, &key, defaults.description, name, value)?;
        if bound <= 0.0 {
            return door.refuse(key, format!("is {bound}: it has to be positive"));
        }
        if movable.contains(&state) {
            return door.refuse(key, "is a state that set points move: bounds are for the states in between");
        }
        state_bounds[state] = Some(bound);
    }
    let options = GovernorOptions { level_share, feedforward, state_bounds };
    if let Err(error) = governor(defaults.plant, request, &options, &request.limits) {
        let message = match error {
            SupervisionError::NotFlat { state } => format!(
                "{} cannot be moved exactly by the inputs through at most four derivatives; set reference = \"static\"",
                names(&[state])
            ),
            SupervisionError::NotPeriodic => {
                "the scheduling parameter is not periodic: set reference = \"static\"".to_owned()
            }
            other => other.to_string(),
        };
        return door.refuse(key, message);
    }
    if let Some(&(state, number)) = defaults.set_points.iter().find(|(state, _)| !movable.contains(state)) {
        return door.refuse(
            key,
            format!(
                "set point {number} moves {}, where the plant does not rest (at the certified rate); a governor moves {}",
                names(&[state]),
                names(&movable)
            ),
        );
    }
    Ok(options)
}
