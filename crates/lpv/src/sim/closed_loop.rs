//! One closed-loop flight.

use super::noise::{Channel, NoiseStream};
use super::reference::Reference;
use super::runge_kutta::RungeKutta4;
use crate::controller::{Controller, Law};
use crate::estimator::{Consistency, ConsistencyStatistics, Ekf, NoiseCovariance};
use crate::math::Mat;
use crate::math::matrix::to_row_vec;
use crate::plant::Plant;
use serde::Serialize;

/// A state beyond this is a divergence, whatever its unit: no plant here works at such values.
pub const FARTHEST: f64 = 1e6;

/// What to fly.
pub struct Simulation<'a> {
    /// The nonlinear plant.
    pub plant: &'a dyn Plant,
    /// Initial state x(0), which the estimator knows, (6.16)-(6.17).
    pub initial_state: Vec<f64>,
    /// Set points.
    pub reference: Reference,
    /// End of the flight.
    pub duration_s: f64,
    /// Time between two samples of controller and noise, T.
    pub sample_time_s: f64,
    /// Integration steps within one sample.
    pub steps_per_sample: usize,
    /// Cost weight Q of the state error.
    pub state_weight: &'a Mat<f64>,
    /// Cost weight R of the input deviation.
    pub input_weight: &'a Mat<f64>,
    /// Noise on the plant; without it the flight is deterministic.
    pub noise: Option<&'a NoiseCovariance>,
    /// Feed back the estimate of an extended Kalman filter from measurements; otherwise the true state. Needs `noise`.
    pub estimate: bool,
    /// Seed of the noise.
    pub seed: u64,
    /// Index of the run under that seed: another index, other noise.
    pub run: u64,
}

/// How a flight ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Outcome {
    /// It reached its end.
    Completed,
    /// A state left the range where the plant's equations hold.
    Diverged {
        /// When.
        time_s: f64,
        /// Index of the state.
        state: usize,
        /// Its last value.
        value: f64,
    },
    /// The estimate or its covariance left all bounds, though the plant had not.
    EstimatorDiverged {
        /// When.
        time_s: f64,
    },
}

/// Samples of a flight, one entry of the outer vectors a sample.
#[derive(Clone, Debug, Default)]
pub struct Trajectory {
    /// t
    pub time_s: Vec<f64>,
    /// x(t)
    pub states: Vec<Vec<f64>>,
    /// x_ref(t)
    pub references: Vec<Vec<f64>>,
    /// The reference that a governor made of x_ref(t); empty without one.
    pub governed: Vec<Vec<f64>>,
    /// Which member of a family of gains was active, 0 the outermost; empty for a controller without certified sets.
    pub members: Vec<usize>,
    /// V/γ of the error that the controller saw, in the active member's set; empty for a controller without certified sets.
    pub set_shares: Vec<f64>,
    /// u(t), after saturation, held until the next sample.
    pub inputs: Vec<Vec<f64>>,
    /// Whether an input was limited.
    pub saturated: Vec<bool>,
    /// J accumulated up to t.
    pub cost: Vec<f64>,
    /// y(t) with its noise; empty without noise.
    pub measurements: Vec<Vec<f64>>,
    /// x̂(t); empty without an estimator.
    pub estimates: Vec<Vec<f64>>,
    /// Standard deviations that the estimator reports; empty without one.
    pub deviations: Vec<Vec<f64>>,
}

/// A flown flight.
#[derive(Clone, Debug)]
pub struct Flight {
    /// How it ended.
    pub outcome: Outcome,
    /// Its samples, up to the last one before a divergence.
    pub trajectory: Trajectory,
    /// Consistency of the estimator, if one was in the loop.
    pub consistency: Option<Consistency>,
}

impl Simulation<'_> {
    /// Fly with `controller`.
    ///
    /// At each sample t_k the controller reads the state (or its estimate) and holds its input, the process noise is
    /// drawn with covariance Q_d/T² and held, the measurement noise with covariance R_d and held; in between
    /// [x, J, x̂, P] is integrated as one system, the filter seeing y(t) = h(x(t), v_k).
    pub fn fly(&self, controller: &Controller) -> Flight {
        let description = self.plant.description();
        let (n, m) = (description.states.len(), description.inputs.len());
        let (nw, ny) = (description.disturbances.len(), description.outputs.len());
        let covariance = self.noise.filter(|_| self.estimate);
        let mut filter = covariance.map(|covariance| Ekf::new(self.plant, covariance, self.sample_time_s));
        let mut consistency = covariance.map(|_| ConsistencyStatistics::new(n));
        let mut process = self.noise.map(|noise| {
            let held = 1.0 / (self.sample_time_s * self.sample_time_s);
            NoiseStream::new(self.seed, self.run, Channel::Process, &noise.process, held)
        });
        let mut measurement = self
            .noise
            .map(|noise| NoiseStream::new(self.seed, self.run, Channel::Measurement, &noise.measurement, 1.0));

        // z = [x, J, x̂, P]; the last two only with a filter
        let size = n + 1 + if filter.is_some() { n + n * n } else { 0 };
        let mut z = vec![0.0; size];
        z[..n].copy_from_slice(&self.initial_state);
        if filter.is_some() {
            z[n + 1..2 * n + 1].copy_from_slice(&self.initial_state);
        }

        let stage_cost = StageCost::new(self.state_weight, self.input_weight);
        let mut law = Law::new(controller, description, self.sample_time_s, &self.initial_state);
        let mut method = RungeKutta4::new(size);
        let mut trajectory = Trajectory::default();
        let (mut u, mut w, mut v, mut y) = (vec![0.0; m], vec![0.0; nw], vec![0.0; ny], vec![0.0; ny]);
        let (mut deviation, mut error) = (vec![0.0; m], vec![0.0; n]);
        let samples = (self.duration_s / self.sample_time_s).round() as usize;
        let step_s = self.sample_time_s / self.steps_per_sample as f64;
        let mut outcome = Outcome::Completed;

        for k in 0..=samples {
            let t_s = k as f64 * self.sample_time_s;
            if let Some(state) = (0..n).find(|&i| {
                let limit = description.state_limits[i].unwrap_or(FARTHEST).min(FARTHEST);
                z[i].is_nan() || z[i].abs() >= limit
            }) {
                outcome = Outcome::Diverged { time_s: t_s, state, value: z[state] };
                break;
            }
            // a covariance is a square: its bound is the square of the states'
            if z[n..].iter().any(|value| value.is_nan() || value.abs() >= FARTHEST * FARTHEST) {
                outcome = Outcome::EstimatorDiverged { time_s: t_s };
                break;
            }
            let reference = self.reference.at(t_s);
            let feedback = if filter.is_some() { &z[n + 1..2 * n + 1] } else { &z[..n] };
            let saturated = law.step(t_s, feedback, &reference, &mut u);
            if let Some(process) = &mut process {
                process.next(&mut w);
            }
            if let Some(measurement) = &mut measurement {
                measurement.next(&mut v);
                self.plant.measurement(&z[..n], &v, &mut y);
                trajectory.measurements.push(y.clone());
            }
            if let Some(statistics) = &mut consistency {
                let (estimate, covariance) = z[n + 1..].split_at(n);
                description.state_error(estimate, &z[..n], &mut error);
                statistics.add(&error, covariance);
                trajectory.estimates.push(estimate.to_vec());
                trajectory.deviations.push((0..n).map(|i| covariance[i * n + i].max(0.0).sqrt()).collect());
            }
            if let Some(governed) = law.governed_reference() {
                trajectory.governed.push(governed.to_vec());
            }
            if let Some((member, share)) = law.set_share() {
                trajectory.members.push(member);
                trajectory.set_shares.push(share);
            }
            trajectory.time_s.push(t_s);
            trajectory.states.push(z[..n].to_vec());
            trajectory.inputs.push(u.clone());
            trajectory.saturated.push(saturated);
            trajectory.cost.push(z[n]);

            for ((d, u), operating) in deviation.iter_mut().zip(&u).zip(&controller.operating_input) {
                *d = u - operating;
            }
            for step in 0..self.steps_per_sample {
                method.step(t_s + step as f64 * step_s, step_s, &mut z, |_, z, dz| {
                    let (x, rest) = z.split_at(n);
                    let (dx, d_rest) = dz.split_at_mut(n);
                    self.plant.dynamics(x, &u, &w, dx);
                    description.state_error(x, &reference, &mut error);
                    d_rest[0] = stage_cost.value(&error, &deviation);
                    if let Some(filter) = &mut filter {
                        self.plant.measurement(x, &v, &mut y);
                        let (estimate, covariance) = rest[1..].split_at(n);
                        let (d_estimate, d_covariance) = d_rest[1..].split_at_mut(n);
                        filter.derivative(estimate, covariance, &u, &y, d_estimate, d_covariance);
                    }
                });
            }
            trajectory.references.push(reference);
        }
        Flight { outcome, trajectory, consistency: consistency.map(|statistics| statistics.result()) }
    }
}

/// eᵀQe + dᵀRd, without the zeros of Q and R.
struct StageCost {
    state: Vec<(usize, usize, f64)>,
    input: Vec<(usize, usize, f64)>,
}

impl StageCost {
    fn new(q: &Mat<f64>, r: &Mat<f64>) -> Self {
        let entries = |m: &Mat<f64>| {
            let columns = m.ncols();
            to_row_vec(m)
                .into_iter()
                .enumerate()
                .filter(|&(_, value)| value != 0.0)
                .map(|(k, value)| (k / columns, k % columns, value))
                .collect()
        };
        Self { state: entries(q), input: entries(r) }
    }

    fn value(&self, error: &[f64], deviation: &[f64]) -> f64 {
        let form = |entries: &[(usize, usize, f64)], v: &[f64]| {
            entries.iter().map(|&(i, j, value)| value * v[i] * v[j]).sum::<f64>()
        };
        form(&self.state, error) + form(&self.input, deviation)
    }
}
