//! What refutes a claim.

use serde::Serialize;

/// A state whose own motion breaks a claim, at this parameter and rate.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Witness {
    /// ρ
    pub parameter: f64,
    /// ρ̇
    pub rate: f64,
    /// ρ as convex weights of the vertices, over a polytope.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vertex_weights: Vec<f64>,
    /// ρ̇ of these weights.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vertex_rates: Vec<f64>,
    /// The state (of a bordered matrix the direction, with the border first).
    pub state: Vec<f64>,
    /// Proved bound on what the claim asks to be positive, which is negative.
    pub value: f64,
}
