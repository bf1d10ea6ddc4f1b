//! Colours, and how a line is broken.

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
