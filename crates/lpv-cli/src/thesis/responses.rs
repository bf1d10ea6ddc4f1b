//! Time histories of two states, the input and the cost, side by side.

use crate::figure::{Axis, Figure, Panel, Style};
use lpv::sim::ContinuousFlight;

/// A flight with its look.
pub struct Curve<'a> {
    pub label: String,
    pub flight: &'a ContinuousFlight,
    pub style: Style,
}

/// The figure of `curves` from zero to `end_s`.
pub fn responses(
    number: &'static str,
    title: &str,
    caption: &str,
    states: [&str; 2],
    input: &str,
    end_s: f64,
    curves: &[Curve],
) -> Figure {
    let time = || Axis::over("t / s", 0.0, end_s);
    let panel = |label: &str, value: &dyn Fn(&ContinuousFlight, usize) -> f64| {
        curves.iter().fold(Panel::new("", time(), Axis::new(label)), |panel, Curve { flight, style, .. }| {
            let inside = flight.time_s.partition_point(|&t| t <= end_s);
            panel.line((0..inside).map(|k| [flight.time_s[k], value(flight, k)]), *style)
        })
    };
    Figure {
        number,
        title: title.into(),
        caption: caption.into(),
        columns: 2,
        aspect: 0.55,
        panels: vec![
            panel(states[0], &|flight, k| flight.states[k][0]),
            panel(states[1], &|flight, k| flight.states[k][1]),
            panel(input, &|flight, k| flight.inputs[k][0]),
            panel("cost J(t)", &|flight, k| flight.cost[k]),
        ],
        legend: curves.iter().map(|curve| (curve.label.clone(), curve.style)).collect(),
    }
}
