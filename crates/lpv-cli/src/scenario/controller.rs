//! Controllers of a scenario: method, limits, how they are flown.

use super::door::{Door, file_name_part};
use super::file::{Bound, ControllerTable, LimitsTable, MethodName};
use super::plan::ControllerPlan;
use super::request::RequestDefaults;
use super::set_point::state_value;
use super::supervision::supervision;
use crate::failure::Failure;
use lpv::controller::InputLimits;
use lpv::plant::Description;
use lpv::synthesis::{DesignRequest, HighGainOptions, Method, RateBoundedOptions};

/// Inputs that the high-gain method is meant for: it poses 2^m inequalities.
const MOST_HIGH_GAIN_INPUTS: usize = 10;
/// Order of Y(ρ) of a design for a moving parameter: where the file says none, and at most.
const LYAPUNOV_ORDER: u32 = 2;
const MOST_LYAPUNOV_ORDER: u32 = 8;

/// Check a controller's table.
pub(super) fn controller(
    door: &Door,
    key: &str,
    table: ControllerTable,
    defaults: &RequestDefaults,
    has_noise: bool,
) -> Result<ControllerPlan, Failure> {
    file_name_part(door, &format!("{key}.name"), &table.name)?;
    if table.unlimited && table.limits.is_some() {
        return door.refuse(format!("{key}.unlimited"), "contradicts the limits of this controller; keep one");
    }
    let label = table.label.clone().unwrap_or_else(|| table.name.clone());
    if label.chars().any(char::is_control) {
        return door.refuse(
            format!("{key}.label"),
            "has a line break or another control character: it has to fit into a line of a table",
        );
    }
    let limits = match (table.unlimited, table.limits.as_ref().or(defaults.limits)) {
        (true, _) | (false, None) => InputLimits::none(defaults.operating_input.len()),
        (false, Some(limits)) => {
            let place = if table.limits.is_some() { format!("{key}.limits") } else { "limits".into() };
            input_limits(door, &place, limits, defaults)?
        }
    };
    let gamma = match table.gamma {
        Some(gamma) => Some(door.positive(&format!("{key}.gamma"), gamma)?),
        None => None,
    };
    let method = match (table.method, gamma) {
        (MethodName::Lpvqr, None) => Method::Lpvqr,
        (MethodName::Lpvqr, Some(_)) => {
            return door.refuse(
                format!("{key}.gamma"),
                "method \"lpvqr\" knows no γ; remove it, or choose \"slpvqr\" or \"high-gain-slpvqr\"",
            );
        }
        (_, None) => {
            return door.refuse(
                format!("{key}.gamma"),
                "is missing: the saturated methods need the level γ > 0 of their certified set",
            );
        }
        (MethodName::Slpvqr, Some(gamma)) => Method::Slpvqr { gamma },
        (MethodName::HighGainSlpvqr, Some(gamma)) => {
            let high_gain = table.high_gain.unwrap_or_default();
            check_high_gain(door, &format!("{key}.high_gain"), &high_gain)?;
            Method::HighGainSlpvqr { gamma, high_gain }
        }
    };
    if table.high_gain.is_some() && !matches!(method, Method::HighGainSlpvqr { .. }) {
        return door.refuse(format!("{key}.high_gain"), "belongs to method \"high-gain-slpvqr\" only");
    }
    if let Some(gamma) = method.gamma() {
        let sigma = limits.symmetric_bound(defaults.operating_input);
        if !sigma.iter().all(|sigma| sigma.is_finite()) {
            return door.refuse(
                format!("{key}.limits"),
                "a saturated method needs a limit on every input; give [limits] min and max",
            );
        }
        if !sigma.iter().all(|sigma| (sigma * sigma / gamma).is_normal()) {
            return door.refuse(
                format!("{key}.gamma"),
                format!("is {gamma:e}: limit²/γ is too large or too small a number to calculate with"),
            );
        }
    }
    let rate_bounded = rate_bounded(door, key, &table, defaults)?;
    let inputs = defaults.operating_input.len();
    if matches!(method, Method::HighGainSlpvqr { .. }) && inputs > MOST_HIGH_GAIN_INPUTS {
        return door.refuse(
            format!("{key}.method"),
            format!("\"high-gain-slpvqr\" is for up to {MOST_HIGH_GAIN_INPUTS} inputs, because it has 2^m inequalities for m of them; the plant has {inputs}: choose \"slpvqr\""),
        );
    }
    if (table.noise || table.estimator.is_some()) && !has_noise {
        return door.refuse(format!("{key}.noise"), "the scenario has no [noise] table to take covariances from");
    }
    if table.estimator.is_some() && !table.noise {
        return door.refuse(format!("{key}.estimator"), "an estimator needs measurements: set noise = true");
    }
    let request = DesignRequest {
        name: table.name.clone(),
        method,
        weights: defaults.weights.clone(),
        grid_points: defaults.grid_points,
        schedule: table.schedule,
        limits,
        sample_time_s: defaults.sample_time_s,
        rate_bounded,
    };
    let supervision = supervision(door, key, &table, &request, defaults)?;
    Ok(ControllerPlan {
        label,
        request,
        supervision,
        noise: table.noise,
        estimator: table.estimator.is_some(),
        require: table.require,
    })
}

/// The keys of a design for a moving parameter.
fn rate_bounded(
    door: &Door,
    key: &str,
    table: &ControllerTable,
    defaults: &RequestDefaults,
) -> Result<Option<RateBoundedOptions>, Failure> {
    let Some(rate) = table.rate_bound else {
        return match (table.lyapunov_order, &table.region) {
            (None, None) => Ok(None),
            (Some(_), _) => door.refuse(format!("{key}.lyapunov_order"), "belongs to a design with rate_bound only"),
            (_, Some(_)) => door.refuse(format!("{key}.region"), "belongs to a design with rate_bound only"),
        };
    };
    let Some(scheduling) = &defaults.description.scheduling else {
        return door
            .refuse(format!("{key}.rate_bound"), "the plant has no scheduling parameter that could move; remove it");
    };
    if !(rate >= 0.0 && rate.is_finite()) {
        return door.refuse(
            format!("{key}.rate_bound"),
            format!(
                "is {rate}: it has to be the largest rate of {}, zero or more, in {}/s",
                scheduling.parameter, scheduling.unit
            ),
        );
    }
    let order = table.lyapunov_order.unwrap_or(LYAPUNOV_ORDER);
    if !(1..=MOST_LYAPUNOV_ORDER).contains(&order) {
        return door.refuse(
            format!("{key}.lyapunov_order"),
            format!("is {order}: allowed are 1 to {MOST_LYAPUNOV_ORDER}, the highest harmonic (or power) of the parameter in Y"),
        );
    }
    let direction = match &table.region {
        None => None,
        Some(region) => Some(direction(door, &format!("{key}.region"), region, defaults.description)?),
    };
    Ok(Some(RateBoundedOptions { rate, order, direction }))
}

/// A direction in state space, by the names of states.
fn direction(door: &Door, key: &str, table: &toml::Table, description: &Description) -> Result<Vec<f64>, Failure> {
    let mut direction = vec![0.0; description.states.len()];
    for (name, value) in table {
        let (state, value) = state_value(door, &format!("{key}.{name}"), description, name, value)?;
        direction[state] = value;
    }
    match direction.iter().any(|&value| value != 0.0) {
        true => Ok(direction),
        false => {
            let example = &description.states[0].name;
            door.refuse(
                key,
                format!("is no direction: give an error that the set has to hold, such as {{ {example} = 1.0 }}"),
            )
        }
    }
}

fn check_high_gain(door: &Door, key: &str, options: &HighGainOptions) -> Result<(), Failure> {
    if !(options.recovery >= 0.0 && options.recovery.is_finite()) {
        return door.refuse(
            format!("{key}.recovery"),
            format!("is {}: it has to be a fraction, zero or more", options.recovery),
        );
    }
    if !(options.gain_margin >= 1.0 && options.gain_margin.is_finite()) {
        return door.refuse(
            format!("{key}.gain_margin"),
            format!("is {}: it has to be a factor of at least 1", options.gain_margin),
        );
    }
    Ok(())
}

fn input_limits(
    door: &Door,
    key: &str,
    table: &LimitsTable,
    defaults: &RequestDefaults,
) -> Result<InputLimits, Failure> {
    let m = defaults.operating_input.len();
    // a limit of -∞ below or ∞ above is none
    let limit = |side: &str, value: f64| {
        let none = if side == "min" { f64::NEG_INFINITY } else { f64::INFINITY };
        Some(value).filter(|&value| value != none)
    };
    let spread = |side: &str, bound: &Option<Bound>| match bound {
        None => Ok(vec![None; m]),
        Some(Bound::All(value)) => Ok(vec![limit(side, *value); m]),
        Some(Bound::Each(values)) if values.len() == m => Ok(values.iter().map(|&value| limit(side, value)).collect()),
        Some(Bound::Each(values)) => {
            door.refuse(format!("{key}.{side}"), format!("has {} numbers: the plant has {m} inputs", values.len()))
        }
    };
    let limits = InputLimits { min: spread("min", &table.min)?, max: spread("max", &table.max)? };
    for (i, (&operating, signal)) in defaults.operating_input.iter().zip(&defaults.description.inputs).enumerate() {
        let outside = |side: &str, bound: f64| {
            door.refuse(
                format!("{key}.{side}"),
                format!(
                    "is {bound:?} for {}: the limits exclude the operating input {operating} {}, at which the plant rests; it has to lie strictly between min and max",
                    signal.name, signal.unit
                ),
            )
        };
        match (limits.min[i], limits.max[i]) {
            (Some(min), _) if min.is_nan() || min >= operating => return outside("min", min),
            (_, Some(max)) if max.is_nan() || max <= operating => return outside("max", max),
            _ => {}
        }
    }
    Ok(limits)
}
