//! A flight that costs more than is proved of the plant as it flies: a defect of the program, if it is no error of the integration.

use crate::failure::Failure;
use crate::flown::{Certified, Flown, ROUNDING, cost_of_step};
use crate::scenario::{ControllerPlan, Scenario};
use crate::step_bounds::step_bounds;
use lpv::math::decimal::{at_least, at_most};
use lpv::sim::{Simulation, performance};

/// How often the integration steps are halved before a flight is said to contradict a bound.
const HALVINGS: u32 = 6;

/// A step that costs more than is proved of the plant as it flies. It is flown again with ever shorter integration steps first, to be held against
/// the bound from where it then starts: what is left of the integration's error, the change when the steps were halved last, is no contradiction.
pub fn contradiction_of(
    flown: &Flown,
    scenario: &Scenario,
    plan: &ControllerPlan,
    simulation: &Simulation,
    certified: &Certified,
) -> Option<String> {
    let exceeded = |k: &usize| flown.bounds[*k].is_guaranteed() && flown.steps_are_all && flown.exceeds(*k);
    let k = (0..flown.bounds.len()).find(exceeded)?;
    let trajectory = &flown.flight.trajectory;
    let first = (flown.bounds[k].bound, cost_of_step(trajectory, &flown.performance, k)?);
    let again = |steps_per_sample: usize| {
        let finer = Simulation {
            initial_state: simulation.initial_state.clone(),
            reference: simulation.reference.clone(),
            steps_per_sample,
            ..*simulation
        };
        let flight = finer.fly(&certified.design.controller);
        let performance = performance(scenario.plant.description(), &scenario.reference, &flight);
        let trajectory = &flight.trajectory;
        let (bounds, _) = step_bounds(scenario, plan, certified.design, certified.proofs, &performance, trajectory);
        let bound = bounds.get(k).filter(|bound| bound.is_guaranteed())?.bound;
        Some((bound, cost_of_step(trajectory, &performance, k)?))
    };
    let (steps_per_sample, bound, cost) = confirmed(first, simulation.steps_per_sample, again)?;
    let (bound, cost) = (at_most(bound), at_least(cost));
    let words = format!("the cost of step {} is proved to be at most {bound}, and the flight cost {cost}", k + 1);
    Some(format!("{words} ({steps_per_sample} integration steps a sample)"))
}

/// Whether a cost is still above its bound when the flight is integrated in more steps a sample: with their number, bound and cost then. `fly`
/// gives bound and cost for a number of steps.
fn confirmed(
    (mut bound, mut cost): (f64, f64),
    mut steps_per_sample: usize,
    mut fly: impl FnMut(usize) -> Option<(f64, f64)>,
) -> Option<(usize, f64, f64)> {
    for _ in 0..HALVINGS {
        steps_per_sample *= 2;
        let again = fly(steps_per_sample)?;
        let error = ((again.1 - again.0) - (cost - bound)).abs();
        (bound, cost) = again;
        let is_clear = (cost - bound).abs() > error + ROUNDING * bound;
        if is_clear || error <= 0.1 * ROUNDING * bound {
            return (cost > bound * (1.0 + ROUNDING)).then_some((steps_per_sample, bound, cost));
        }
    }
    // what the integration leaves open contradicts nothing
    None
}

/// What is proved of the plant as it flies holds for its flight; else the program is wrong, and `command` shows it again.
pub fn no_contradiction(scenario: &Scenario, flown: &[Flown], command: &str) -> Result<(), Failure> {
    let found =
        scenario.controllers.iter().zip(flown).find_map(|(plan, flown)| Some((plan, flown.contradiction.as_ref()?)));
    found.map_or(Ok(()), |(plan, words)| {
        let (name, seed) = (&plan.request.name, scenario.seed);
        Err(Failure::Defect(format!("\"{name}\": {words}; to replay (seed {seed}): {command}")))
    })
}

#[cfg(test)]
mod tests {
    use super::confirmed;

    /// Of a method of order four the error falls sixteenfold with each halving.
    fn integrated(exact: f64, error: f64) -> impl FnMut(usize) -> Option<(f64, f64)> {
        move |steps| Some((1.0, exact + error * (steps as f64).powi(-4)))
    }

    #[test]
    fn an_error_of_the_integration_is_no_contradiction() {
        for error in [1e-8, 1e-4, 0.5] {
            let mut fly = integrated(1.0 - 1e-12, error);
            let first = fly(1).unwrap();
            assert!(first.1 > first.0 * (1.0 + 1e-9), "what is flown first is above the bound");
            assert_eq!(confirmed(first, 1, fly), None, "{error}");
        }
    }

    #[test]
    fn an_excess_is_confirmed_however_small() {
        for (excess, error) in [(1e-7, 0.0), (1e-6, 1e-3), (0.01, 0.5), (0.01, -0.5), (3.0, 1e-9)] {
            let mut fly = integrated(1.0 + excess, error);
            let first = fly(1).unwrap();
            let (steps, bound, cost) = confirmed(first, 1, fly).unwrap();
            assert!(steps > 1 && bound == 1.0 && cost > 1.0 + 0.5 * excess, "{excess} {error}: {steps} {cost}");
        }
    }

    #[test]
    fn a_flight_that_has_no_bound_any_more_contradicts_none() {
        assert_eq!(confirmed((1.0, 2.0), 1, |_| None), None);
    }
}
