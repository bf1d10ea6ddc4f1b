//! What every controller of a scenario is designed with.

use super::file::LimitsTable;
use lpv::plant::{Description, Plant};
use lpv::synthesis::CostWeights;

/// What every controller of a scenario shares.
pub(super) struct RequestDefaults<'a> {
    pub weights: &'a CostWeights,
    pub grid_points: usize,
    pub sample_time_s: f64,
    pub limits: Option<&'a LimitsTable>,
    pub plant: &'a dyn Plant,
    pub description: &'a Description,
    pub operating_input: &'a [f64],
    /// States that set points move, with the number of the set point.
    pub set_points: &'a [(usize, usize)],
}
