//! Scheduling parameters of models, as their sources have them.

use serde::{Deserialize, Serialize};

/// A scheduling parameter with the range and grid that its source uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiteratureParameter {
    /// Symbol.
    pub name: &'static str,
    /// Unit; `1` for a number.
    pub unit: &'static str,
    /// Least and largest value.
    pub range: [f64; 2],
    /// Grid points.
    pub grid_points: usize,
}
