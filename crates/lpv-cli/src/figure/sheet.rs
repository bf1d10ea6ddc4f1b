//! A figure as plain data.

use super::panel::Panel;
use super::style::Style;

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

impl Figure {
    /// Name of its file.
    pub fn file_name(&self) -> String {
        format!("figure-{}.svg", self.number)
    }
}
