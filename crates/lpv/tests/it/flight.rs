//! Noiseless flights of a design, for the tests.

use lpv::plant::Plant;
use lpv::sim::{Flight, Performance, Reference, Simulation, performance};
use lpv::synthesis::{CostWeights, Design};

/// Flies the design and gives the flight with its figures of merit.
pub fn fly(
    plant: &dyn Plant,
    design: &Design,
    weights: &CostWeights,
    initial_state: Vec<f64>,
    reference: Reference,
    duration_s: f64,
    steps_per_sample: usize,
) -> (Flight, Performance) {
    let simulation = Simulation {
        plant,
        initial_state,
        reference: reference.clone(),
        duration_s,
        sample_time_s: design.sample_time_s,
        steps_per_sample,
        state_weight: &weights.q,
        input_weight: &weights.r,
        noise: None,
        estimate: false,
        seed: 0,
        run: 0,
    };
    let flight = simulation.fly(&design.controller);
    let performance = performance(plant.description(), &reference, &flight);
    (flight, performance)
}
