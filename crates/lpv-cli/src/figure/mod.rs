//! Static figures as scalable vector graphics: axes, curves, regions, legends outside the data, light and dark.
//!
//! A [`Figure`] is plain data; [`Figure::svg`] draws it. Colours are variables of the style sheet [`STYLE`], so that a figure
//! follows the reader's colour scheme, alone in a file as well as within a page that holds the sheet.

mod axis;
mod curve;
mod drawing;
mod space;

pub use axis::Axis;
pub use space::path_in_space;

/// Style sheet of all figures: a page that holds drawings without their own needs it once.
pub const STYLE: &str = include_str!("figure.css");

/// Which colour, and how a line is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// Index of the colour, 0 … 5; 5 is grey.
    pub color: u8,
    /// The pattern.
    pub dash: Dash,
}

/// The pattern of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dash {
    /// ────
    Solid,
    /// ─ ─
    Dashed,
    /// ─·─
    Chain,
    /// ····
    Dotted,
    /// No line: a filled region.
    Fill,
    /// No line: dots.
    Dots,
    /// No line: crosses.
    Crosses,
    /// No line: rings, around other marks.
    Rings,
}

impl Style {
    /// A solid line.
    pub const fn solid(color: u8) -> Self {
        Self { color, dash: Dash::Solid }
    }

    /// A line of another pattern.
    pub const fn with(color: u8, dash: Dash) -> Self {
        Self { color, dash }
    }
}

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

/// A figure: panels in rows, under one legend.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Its number, `4.1`; empty where it has none.
    pub number: &'static str,
    /// What it is, in a line.
    pub title: String,
    /// What is seen, and with which setting.
    pub caption: String,
    /// Panels in a row.
    pub columns: usize,
    /// Height of a panel's data region relative to its width.
    pub aspect: f64,
    /// The panels.
    pub panels: Vec<Panel>,
    /// Entries of the legend.
    pub legend: Vec<(String, Style)>,
}

/// Text for a page: without markup of its own.
pub fn escaped(text: &str) -> String {
    drawing::plain(text)
}

impl Figure {
    /// The drawing. With `alone`, a file of its own with its style sheet; otherwise for a page that holds [`STYLE`].
    pub fn svg(&self, alone: bool) -> String {
        drawing::draw(self, alone)
    }

    /// Name of its file.
    pub fn file_name(&self) -> String {
        format!("figure-{}.svg", self.number)
    }
}
