//! A pair of axes with what is drawn in it, as plain data.

use super::axis::Axis;
use super::style::Style;

/// Something drawn in a panel, in data coordinates.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Points of the curve, outline or cloud.
    pub points: Vec<[f64; 2]>,
    /// How it looks.
    pub style: Style,
}

/// A pair of axes with what is drawn in it.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Above it; empty for none.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// The same length for a unit of both axes.
    pub equal: bool,
    /// From back to front.
    pub marks: Vec<Mark>,
    /// Words at points, in data coordinates, on top.
    pub labels: Vec<([f64; 2], String)>,
    /// Words to the right of points.
    pub notes: Vec<([f64; 2], String)>,
}

impl Panel {
    /// A panel without marks.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, equal: false, marks: Vec::new(), labels: Vec::new(), notes: Vec::new() }
    }

    /// With a curve.
    #[must_use]
    pub fn line(mut self, points: impl IntoIterator<Item = [f64; 2]>, style: Style) -> Self {
        self.marks.push(Mark { points: points.into_iter().collect(), style });
        self
    }
}
