//! States by name: initial values and set points.

use super::door::Door;
use crate::failure::Failure;
use lpv::plant::Description;
use lpv::sim::{FARTHEST, SetPoint};

/// `name = value` or `name_deg = value` for a state of the plant.
pub(super) fn state_value(
    door: &Door,
    key: &str,
    description: &Description,
    name: &str,
    value: &toml::Value,
) -> Result<(usize, f64), Failure> {
    let number = match value {
        toml::Value::Float(value) => *value,
        toml::Value::Integer(value) => *value as f64,
        other => {
            return door.refuse(key, format!("is of type {}: it has to be a number", other.type_str()));
        }
    };
    let number = door.finite(key, number)?;
    let in_degrees = name.strip_suffix("_deg").and_then(|name| description.state(name));
    let in_range = |state: usize, value: f64| {
        let limit = description.state_limits[state].map_or(FARTHEST, |limit| limit.min(FARTHEST));
        match value.abs() < limit {
            true => Ok((state, value)),
            false => door.refuse(
                key,
                format!(
                    "is {value:e} {unit}: allowed are values between -{limit} and {limit} {unit}",
                    limit = (limit * 1e6).round() / 1e6,
                    unit = description.states[state].unit
                ),
            ),
        }
    };
    match (description.state(name), in_degrees) {
        (Some(state), _) => in_range(state, number),
        (None, Some(state)) if description.states[state].unit == "rad" => in_range(state, number.to_radians()),
        _ => {
            let names: Vec<String> = (description.states.iter())
                .map(|signal| match signal.unit.as_str() {
                    "rad" => format!("{0}, {0}_deg", signal.name),
                    _ => signal.name.clone(),
                })
                .collect();
            door.refuse(key, format!("is not a state of the plant; allowed are {}", names.join(", ")))
        }
    }
}

pub(super) fn set_point(
    door: &Door,
    key: &str,
    description: &Description,
    table: &toml::Table,
    last_sample_s: f64,
) -> Result<(SetPoint, String), Failure> {
    let (mut time_s, mut label, mut targets) = (None, None, Vec::new());
    for (name, value) in table {
        let key = format!("{key}.{name}");
        match (name.as_str(), value) {
            ("time_s", toml::Value::Float(time)) => time_s = Some(*time),
            ("time_s", toml::Value::Integer(time)) => time_s = Some(*time as f64),
            ("label", toml::Value::String(text)) => label = Some(text.clone()),
            ("time_s" | "label", other) => {
                let expected = if name == "label" { "a string" } else { "a number of seconds" };
                return door.refuse(key, format!("is of type {}: it has to be {expected}", other.type_str()));
            }
            _ => targets.push(state_value(door, &key, description, name, value)?),
        }
    }
    let Some(time_s) = time_s else {
        return door.refuse(format!("{key}.time_s"), "is missing: say when the set point takes effect, in seconds");
    };
    if !(0.0..last_sample_s).contains(&time_s) {
        return door.refuse(
            format!("{key}.time_s"),
            format!("is {time_s}: it has to lie in the flight, from 0 to below {last_sample_s} s"),
        );
    }
    if targets.is_empty() {
        let example = &description.states[0].name;
        return door.refuse(key, format!("moves no state; give at least one, such as {example} = 1.0"));
    }
    if let Some(name) = table.keys().find(|name| table.contains_key(&format!("{name}_deg"))) {
        return door.refuse(format!("{key}.{name}"), format!("{name} and {name}_deg are both given; keep one"));
    }
    let spell = |&(state, value): &(usize, f64)| {
        let signal = &description.states[state];
        match signal.unit.as_str() {
            "rad" => format!("{} = {}°", signal.name, (value.to_degrees() * 1e6).round() / 1e6),
            unit => format!("{} = {value} {unit}", signal.name),
        }
    };
    let label = label.unwrap_or_else(|| targets.iter().map(spell).collect::<Vec<_>>().join(", "));
    Ok((SetPoint { time_s, targets }, label))
}
