//! A problem over a polytope in [`Units`] of its own. States of an objective are in units of their largest entry.

use super::{InputBounds, Lyapunov, Objective, PolytopicRequest};
use crate::math::Mat;
use crate::model::Polytope;
use crate::synthesis::units::{Units, largest_entry};

/// The units of a problem; `None` where its numbers give none. The regulator of one vertex is not rounded.
pub(super) fn units(polytope: &Polytope, request: &PolytopicRequest) -> Option<Units> {
    let is_regulator = polytope.len() == 1 && request.weights.is_some() && request.saturation.is_none();
    let models: Vec<(&Mat<f64>, &Mat<f64>)> = (0..polytope.len()).map(|i| (polytope.a(i), polytope.b(i))).collect();
    Units::of(&models, request.weights.as_ref(), !is_regulator)
}

/// (A′, B′) at every vertex.
pub(super) fn polytope(units: &Units, polytope: &Polytope) -> Polytope {
    let vertices = 0..polytope.len();
    let a = vertices.clone().map(|i| units.a(polytope.a(i))).collect();
    let b = vertices.map(|i| units.b(polytope.b(i))).collect();
    Polytope::new(a, b).expect("the same sizes")
}

/// What is asked for, primed.
pub(super) fn request(units: &Units, request: &PolytopicRequest) -> PolytopicRequest {
    let lyapunov = match &request.lyapunov {
        Lyapunov::Common => Lyapunov::Common,
        Lyapunov::ParameterDependent { rate_vertices } => {
            let primed = |nu: &Vec<f64>| nu.iter().map(|&rate| units.per_time(rate)).collect();
            Lyapunov::ParameterDependent { rate_vertices: rate_vertices.iter().map(primed).collect() }
        }
    };
    let limits = |bounds: &InputBounds| InputBounds { sigma: units.limits(&bounds.sigma, bounds.gamma), gamma: 1.0 };
    let mut high_gain = request.high_gain;
    if let Some(time) = high_gain.as_mut().and_then(|high_gain| high_gain.sample_time_s.as_mut()) {
        *time = units.time(*time);
    }
    PolytopicRequest {
        weights: request.weights.as_ref().map(|weights| units.weights(weights)),
        lyapunov,
        saturation: request.saturation.as_ref().map(limits),
        high_gain,
        objective: objective(units, &request.objective),
        back_off: request.back_off,
    }
}

fn objective(units: &Units, objective: &Objective) -> Objective {
    match objective {
        Objective::Trace => Objective::Trace,
        Objective::States { states, parameter } => {
            let largest = largest_entry(states.iter().flatten());
            let primed = |state: &Vec<f64>| state.iter().map(|x| units.number(x / largest)).collect();
            Objective::States { states: states.iter().map(primed).collect(), parameter: parameter.clone() }
        }
        Objective::Ellipsoid { shape } => Objective::Ellipsoid { shape: units.matrix(shape, 1.0 / shape.norm_max()) },
    }
}

/// By how much the objective of a request is larger than the primed one: of tr Y as Y, of a cost bound as P, of a margin of stability as ω.
pub(super) fn objective_factor(units: &Units, request: &PolytopicRequest) -> f64 {
    match &request.objective {
        _ if request.weights.is_none() => units.rate(),
        Objective::Trace => units.y(),
        Objective::States { states, .. } => largest_entry(states.iter().flatten()).powi(2) / units.y(),
        Objective::Ellipsoid { shape } => 1.0 / (shape.norm_max() * units.y()),
    }
}
