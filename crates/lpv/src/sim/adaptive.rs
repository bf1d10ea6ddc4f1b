//! The closed loop in continuous time, integrated to a tolerance: actual costs that can be quoted to six digits.
//!
//! [`super::Simulation`] samples and holds as a digital controller does. The costs of the literature are those of the
//! feedback law itself, J = ∫ eᵀQe + dᵀRd dt with u a function of x at every instant, and a fixed step shows in their
//! fourth digit. Here [x, J] is one system and the Dormand–Prince method of order 8(5,3) keeps the local error of each
//! component below a tolerance.
//!
//! A saturated law is only continuous: the derivative of ẋ jumps where an input meets its limit. Step-size control finds
//! such a kink by rejecting steps across it, so that the order is lost on one step of 10⁻⁵ seconds or so and nowhere else.
//! Whether that is enough is measured and not assumed: everything is integrated again at a hundred times the tolerance,
//! and the change of J is kept with the result.

use crate::math::Mat;
use crate::math::matrix::quadratic_form;
use crate::plant::Plant;
use differential_equations::prelude::{ExplicitRungeKutta, IVP, ODE};

/// Tolerances of [`fly_continuously`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveOptions {
    /// Local error of a component, relative to its size.
    pub relative_tolerance: f64,
    /// Local error of a component that is near zero.
    pub absolute_tolerance: f64,
    /// Longest step; short enough that no kink is stepped over unseen.
    pub longest_step_s: f64,
}

impl Default for AdaptiveOptions {
    fn default() -> Self {
        Self { relative_tolerance: 1e-11, absolute_tolerance: 1e-12, longest_step_s: 0.02 }
    }
}

/// Why an integration did not reach its end.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum IntegrationError {
    /// The integrator gave up.
    #[error("the integration stopped ({reason}); the closed loop may be unstable, or the tolerance too tight")]
    Stopped {
        /// What it says.
        reason: String,
    },
    /// The state or the cost is no number any more.
    #[error("the state left all bounds by {time_s} s: the closed loop is unstable")]
    Diverged {
        /// End of the integration.
        time_s: f64,
    },
}

/// A trajectory of the closed loop in continuous time, with a sample at each step of the integrator.
#[derive(Clone, Debug)]
pub struct ContinuousFlight {
    /// t
    pub time_s: Vec<f64>,
    /// x(t)
    pub states: Vec<Vec<f64>>,
    /// u(t)
    pub inputs: Vec<Vec<f64>>,
    /// J accumulated up to t.
    pub cost: Vec<f64>,
    /// J at the end.
    pub actual_cost: f64,
    /// |ΔJ| when the tolerances are a hundred times as large.
    pub cost_change: f64,
    /// Accepted steps.
    pub steps: usize,
    /// Rejected steps: kinks, mostly.
    pub rejected_steps: usize,
}

/// Integrate ẋ = f(x, u(x), 0) and J from `initial_state` for `duration_s` seconds, the reference being the plant's
/// operating point at parameter zero.
///
/// * `q`: Q = Qᵀ, n × n; `r`: R = Rᵀ, m × m, of J = ∫ (x − x*)ᵀQ(x − x*) + (u − u*)ᵀR(u − u*) dt.
/// * `feedback(x, u)` writes the input, limits included; it should be continuous and piecewise smooth.
///
/// J is that of the interval: the caller chooses a duration after which nothing is left.
///
/// # Errors
/// See [`IntegrationError`].
pub fn fly_continuously(
    plant: &dyn Plant,
    (q, r): (&Mat<f64>, &Mat<f64>),
    initial_state: &[f64],
    duration_s: f64,
    feedback: &dyn Fn(&[f64], &mut [f64]),
    options: &AdaptiveOptions,
) -> Result<ContinuousFlight, IntegrationError> {
    let operating_point = plant.trim(0.0);
    let system = ClosedLoop { plant, q, r, feedback, state: operating_point.state, input: operating_point.input };
    let start: Vec<f64> = initial_state.iter().copied().chain([0.0]).collect();
    let loose = AdaptiveOptions {
        relative_tolerance: 100.0 * options.relative_tolerance,
        absolute_tolerance: 100.0 * options.absolute_tolerance,
        ..*options
    };
    let n = initial_state.len();
    let loose_cost = integrate(&system, start.clone(), duration_s, &loose)?.last()[n];
    let path = integrate(&system, start, duration_s, options)?;
    let actual_cost = path.last()[n];
    let inputs = (path.states.iter())
        .map(|z| {
            let mut u = vec![0.0; system.input.len()];
            feedback(&z[..n], &mut u);
            u
        })
        .collect();
    Ok(ContinuousFlight {
        time_s: path.time_s,
        inputs,
        cost: path.states.iter().map(|z| z[n]).collect(),
        states: path.states.into_iter().map(|z| z[..n].to_vec()).collect(),
        actual_cost,
        cost_change: (actual_cost - loose_cost).abs(),
        steps: path.steps,
        rejected_steps: path.rejected_steps,
    })
}

/// ẋ = f(x, u(x), 0), J̇ = eᵀQe + dᵀRd.
struct ClosedLoop<'a> {
    plant: &'a dyn Plant,
    q: &'a Mat<f64>,
    r: &'a Mat<f64>,
    feedback: &'a dyn Fn(&[f64], &mut [f64]),
    /// x*
    state: Vec<f64>,
    /// u*
    input: Vec<f64>,
}

impl ODE<f64, Vec<f64>> for ClosedLoop<'_> {
    fn diff(&self, _t: f64, z: &Vec<f64>, dz: &mut Vec<f64>) {
        let n = self.state.len();
        let mut u = vec![0.0; self.input.len()];
        (self.feedback)(&z[..n], &mut u);
        let w = vec![0.0; self.plant.description().disturbances.len()];
        self.plant.dynamics(&z[..n], &u, &w, &mut dz[..n]);
        let mut error = vec![0.0; n];
        self.plant.description().state_error(&z[..n], &self.state, &mut error);
        let deviation: Vec<f64> = u.iter().zip(&self.input).map(|(u, operating)| u - operating).collect();
        dz[n] = quadratic_form(self.q, &error) + quadratic_form(self.r, &deviation);
    }
}

/// What an integration gives.
pub(super) struct Path {
    pub time_s: Vec<f64>,
    pub states: Vec<Vec<f64>>,
    pub steps: usize,
    pub rejected_steps: usize,
}

impl Path {
    /// The state at the end.
    pub fn last(&self) -> &[f64] {
        self.states.last().map_or(&[], Vec::as_slice)
    }
}

/// Integrate `system` from time zero to `end_s`, which may be negative.
pub(super) fn integrate(
    system: &impl ODE<f64, Vec<f64>>,
    start: Vec<f64>,
    end_s: f64,
    options: &AdaptiveOptions,
) -> Result<Path, IntegrationError> {
    let method = ExplicitRungeKutta::dop853()
        .rtol(options.relative_tolerance)
        .atol(options.absolute_tolerance)
        .h_max(options.longest_step_s)
        .max_steps(10_000_000);
    let solution = (IVP::ode(system, 0.0, end_s, start).method(method).solve())
        .map_err(|error| IntegrationError::Stopped { reason: reason(&error) })?;
    let path = Path {
        time_s: solution.t,
        states: solution.y,
        steps: solution.steps.accepted,
        rejected_steps: solution.steps.rejected,
    };
    let is_finite = path.last().iter().all(|value| value.is_finite());
    if is_finite { Ok(path) } else { Err(IntegrationError::Diverged { time_s: end_s }) }
}

fn reason(error: &differential_equations::error::Error<f64, Vec<f64>>) -> String {
    use differential_equations::error::Error;
    match error {
        Error::MaxSteps { t, .. } => format!("too many steps, at {t} s"),
        Error::StepSize { t, .. } => format!("its step vanished at {t} s"),
        Error::Stiffness { t, .. } => format!("the equations are stiff at {t} s: take a shorter longest step"),
        other => format!("{other:?}"),
    }
}
