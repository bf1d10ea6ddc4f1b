//! What the other tests share: the quadrotor of the thesis with its weights.

use lpv::controller::InputLimits;
use lpv::math::matrix::diagonal;
use lpv::plant::{Plant, PlantSpec, QuadrotorParameters};
use lpv::synthesis::{CostWeights, Design, DesignRequest, Method, ScheduleKind, design};

/// Q and R of (6.1)-(6.2).
pub fn weights() -> CostWeights {
    CostWeights { q: diagonal(&[1., 1., 100., 1., 1., 50., 50., 50., 50., 1., 1., 100.]), r: diagonal(&[0.001; 4]) }
}

/// [0, mg/2] for each rotor.
pub fn limits() -> InputLimits {
    InputLimits { min: vec![Some(0.0); 4], max: vec![Some(9.807); 4] }
}

/// The quadrotor with gravity `gravity_m_s2`; the thesis's printed gains were made with 9.81, all else with 9.807.
pub fn spec(gravity_m_s2: f64) -> PlantSpec {
    PlantSpec::Quadrotor(QuadrotorParameters { gravity_m_s2, ..Default::default() })
}

/// The quadrotor of Table 6.1.
pub fn plant() -> Box<dyn Plant> {
    spec(9.807).build().unwrap()
}

/// A design for the quadrotor of Table 6.1.
pub fn designed(method: Method, limits: InputLimits, grid_points: usize, schedule: ScheduleKind) -> Design {
    let request = DesignRequest {
        name: "test".into(),
        method,
        weights: weights(),
        grid_points,
        schedule,
        limits,
        sample_time_s: 0.002,
        rate_bounded: None,
    };
    design(&spec(9.807), &*plant(), &request, &|_| {}).unwrap()
}
