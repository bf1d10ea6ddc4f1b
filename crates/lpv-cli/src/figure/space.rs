//! Paths in space, drawn in a panel by a parallel projection.

use super::axis::Axis;
use super::panel::{Mark, Panel};
use super::style::{Dash, Style};

/// Seen from this azimuth and elevation, in degrees.
const AZIMUTH_DEG: f64 = -58.0;
const ELEVATION_DEG: f64 = 24.0;

fn project([x, y, z]: [f64; 3]) -> [f64; 2] {
    let (s, c) = AZIMUTH_DEG.to_radians().sin_cos();
    let (se, ce) = ELEVATION_DEG.to_radians().sin_cos();
    [-s * x + c * y, z * ce - (c * x + s * y) * se]
}

/// Points of a path, those of whole seconds, and its look.
pub type PathInSpace = (Vec<[f64; 3]>, Vec<[f64; 3]>, Style);

/// A panel with paths over a floor of squares of `square` metres, from (0, 0, 0) to `size`; every path has a mark each second.
/// A path is (point, whole second) by sample.
pub fn path_in_space(title: &str, size: [f64; 3], square: f64, paths: &[PathInSpace]) -> Panel {
    let mut marks = Vec::new();
    let grey = Style::solid(5);
    let mut segment = |a: [f64; 3], b: [f64; 3], style: Style| {
        marks.push(Mark { points: vec![project(a), project(b)], style });
    };
    let lines = |length: f64| (0..=(length / square).round() as usize).map(move |k| k as f64 * square);
    for x in lines(size[0]) {
        segment([x, 0.0, 0.0], [x, size[1], 0.0], Style::with(5, Dash::Dotted));
    }
    for y in lines(size[1]) {
        segment([0.0, y, 0.0], [size[0], y, 0.0], Style::with(5, Dash::Dotted));
    }
    segment([0.0; 3], [size[0], 0.0, 0.0], grey);
    segment([0.0; 3], [0.0, size[1], 0.0], grey);
    segment([0.0; 3], [0.0, 0.0, size[2]], grey);
    segment([size[0], size[1], 0.0], size, Style::with(5, Dash::Dotted));
    for (path, seconds, style) in paths {
        marks.push(Mark { points: path.iter().map(|point| project(*point)).collect(), style: *style });
        marks.push(Mark {
            points: seconds.iter().map(|point| project(*point)).collect(),
            style: Style::with(style.color, Dash::Dots),
        });
    }
    let across = format!("across, in the plane of the drawing / m; floor squares of {square} m");
    // beyond the ends of the axes, where no path goes
    let beyond = |axis: usize| project([0, 1, 2].map(|i| if i == axis { 1.08 * size[i] } else { 0.0 }));
    Panel {
        labels: ["x", "y", "z"].iter().enumerate().map(|(axis, name)| (beyond(axis), (*name).to_owned())).collect(),
        title: title.into(),
        x: Axis::new(across),
        y: Axis::new("up, in the plane of the drawing / m"),
        equal: true,
        marks,
        notes: Vec::new(),
    }
}
