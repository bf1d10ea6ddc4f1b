//! Chapters III and VI: the quadrotor's parameters and its flights. Figures 3.4 and 6.4 to 6.16.

use crate::failure::Failure;
use crate::figure::{Axis, Dash, Figure, Panel, Style, path_in_space};
use lpv::controller::InputLimits;
use lpv::estimator::NoiseCovariance;
use lpv::math::matrix::diagonal;
use lpv::model::BoxWeights;
use lpv::plant::{Feature, Plant, PlantSpec, QuadrotorParameters};
use lpv::sim::{Flight, Outcome, Performance, Reference, SetPoint, Simulation, Trajectory, performance};
use lpv::synthesis::{CostWeights, Design, DesignRequest, HighGainOptions, Method, ScheduleKind, design};
use rayon::prelude::*;
use std::f64::consts::PI;

pub const SAMPLE_TIME_S: f64 = 0.002;
const STEP_AT_S: f64 = 1.0;
const YAW: usize = 11;
/// The set points of the figures, which the thesis gives as pictures only: x = y = z of this many metres with half a turn.
/// Here the story is seen: the LPVQR fails with [0, mg/2], the SLPVQR does not; farther out γ = 1 fails.
const NEAR_M: f64 = 6.0;
const FAR_M: f64 = 18.0;
/// What γ = 1 still flies along x alone.
const ALONG_X_M: f64 = 35.0;
/// Half a turn, short of where the two ways round are equally long.
pub const HALF_TURN: f64 = PI * (1.0 - 1e-9);

/// The controllers of chapter VI, each designed once.
pub struct Fleet {
    pub plant: Box<dyn Plant>,
    /// mg
    pub weight_n: f64,
    /// Theorem 4.5, limits none, [0, mg] and [0, mg/2].
    pub lpvqr: [Design; 3],
    /// Theorem 5.3 with [0, mg/2], γ = 1, 10, 20.
    pub low: [Design; 3],
    /// Theorem 5.4 with [0, mg/2], γ = 20.
    pub high: Design,
}

/// Q and R of (6.1), (6.2).
pub fn weights() -> CostWeights {
    CostWeights { q: diagonal(&[1., 1., 100., 1., 1., 50., 50., 50., 50., 1., 1., 100.]), r: diagonal(&[0.001; 4]) }
}

impl Fleet {
    /// Design them.
    pub fn new() -> Result<Self, Failure> {
        let parameters = QuadrotorParameters::default();
        let weight_n = parameters.mass_kg * parameters.gravity_m_s2;
        let spec = PlantSpec::Quadrotor(parameters);
        let plant = spec.build().map_err(|error| Failure::Defect(error.to_string()))?;
        let made = |method: Method, limit: Option<f64>| {
            let limits = match limit {
                None => InputLimits::none(4),
                Some(limit) => InputLimits { min: vec![Some(0.0); 4], max: vec![Some(limit * weight_n); 4] },
            };
            let request = DesignRequest {
                name: "quadrotor".into(),
                method,
                weights: weights(),
                grid_points: 32,
                schedule: ScheduleKind::Grid,
                limits,
                sample_time_s: SAMPLE_TIME_S,
                rate_bounded: None,
            };
            design(&spec, &*plant, &request, &|_| ())
                .map_err(|source| Failure::Synthesis { controller: "quadrotor".into(), source })
        };
        let low = |gamma| made(Method::Slpvqr { gamma }, Some(0.5));
        Ok(Self {
            lpvqr: [made(Method::Lpvqr, None)?, made(Method::Lpvqr, Some(1.0))?, made(Method::Lpvqr, Some(0.5))?],
            low: [low(1.0)?, low(10.0)?, low(20.0)?],
            high: made(Method::HighGainSlpvqr { gamma: 20.0, high_gain: HighGainOptions::default() }, Some(0.5))?,
            plant,
            weight_n,
        })
    }

    /// A flight to (x, y, z) and yaw from rest at the origin, the step at one second; with `noise` on the filter's estimate.
    pub fn fly(&self, design: &Design, position_m: [f64; 3], yaw_rad: f64, noise: bool, duration_s: f64) -> Flight {
        self.flight(design, position_m, yaw_rad, noise, duration_s).1
    }

    /// Settling time and cost of the same flight.
    pub fn measure(&self, design: &Design, position_m: [f64; 3], yaw_rad: f64, duration_s: f64) -> Performance {
        let (reference, flight) = self.flight(design, position_m, yaw_rad, false, duration_s);
        performance(self.plant.description(), &reference, &flight)
    }

    fn flight(
        &self,
        design: &Design,
        [x, y, z]: [f64; 3],
        yaw_rad: f64,
        noise: bool,
        duration_s: f64,
    ) -> (Reference, Flight) {
        let angle = 5.0_f64.to_radians().powi(2);
        let covariance = NoiseCovariance {
            process: diagonal(&[1e-4; 4]),
            measurement: diagonal(&[0.01, 0.01, 0.01, angle, angle, angle]),
        };
        let targets = [(3, x), (4, y), (5, z), (YAW, yaw_rad)].into_iter().filter(|&(_, value)| value != 0.0);
        let start = self.plant.trim(0.0).state;
        let set_point = SetPoint { time_s: STEP_AT_S, targets: targets.collect() };
        let reference = Reference::new(start.clone(), vec![set_point]);
        let CostWeights { q, r } = weights();
        let simulation = Simulation {
            plant: &*self.plant,
            initial_state: start,
            reference: reference.clone(),
            duration_s,
            sample_time_s: SAMPLE_TIME_S,
            steps_per_sample: 1,
            state_weight: &q,
            input_weight: &r,
            noise: noise.then_some(&covariance),
            estimate: noise,
            seed: 1,
            run: 0,
        };
        let flight = simulation.fly(&design.controller);
        (reference, flight)
    }
}

/// Time and a value of every tenth sample.
fn series<'a>(flight: &'a Trajectory, value: impl Fn(usize) -> f64 + 'a) -> impl Iterator<Item = [f64; 2]> + 'a {
    (0..flight.time_s.len()).step_by(10).map(move |k| [flight.time_s[k], value(k)])
}

/// Angles that wrap are drawn without jumps.
fn unwrapped(flight: &Trajectory, state: usize) -> Vec<[f64; 2]> {
    let mut last: Option<f64> = None;
    series(flight, |k| flight.states[k][state])
        .map(|[t, value]| {
            let value = match last {
                Some(last) => value + (2.0 * PI) * ((last - value) / (2.0 * PI)).round(),
                None => value,
            };
            last = Some(value);
            [t, value.to_degrees()]
        })
        .collect()
}

/// Which of the flights were flown to the end, in words.
fn told(flights: &[(&str, &Flight)]) -> String {
    let end = |(label, flight): &(&str, &Flight)| match flight.outcome {
        Outcome::Completed => format!("{label} flies"),
        _ => format!("{label} is lost after {:.1} s", flight.trajectory.time_s.last().copied().unwrap_or(0.0)),
    };
    flights.iter().map(end).collect::<Vec<_>>().join(", ")
}

type Labelled<'a> = (&'a str, &'a Trajectory, Style);

fn legend(flights: &[Labelled]) -> Vec<(String, Style)> {
    flights.iter().map(|(label, _, style)| ((*label).to_owned(), *style)).collect()
}

/// Position and attitude over time.
fn states(number: &'static str, title: &str, caption: String, end_s: f64, flights: &[Labelled]) -> Figure {
    let reference = flights[0].1;
    let axis = || Axis::over("t / s", 0.0, end_s);
    let names = ["r_x / m", "r_y / m", "r_z / m", "φ / °", "θ / °", "ψ / °"];
    let grey = Style::with(5, Dash::Dotted);
    let panel = |(place, name): (usize, &str)| {
        let state = if place < 3 { 3 + place } else { 6 + place };
        let far = if place < 3 { 2.5 } else { 1.0 };
        let goal = reference.references.last().map_or(0.0, |x| x[state]);
        let range = match place {
            0..3 => Axis::over(name, -0.4 * far * goal.abs().max(1.0) / 2.5, far * goal.abs().max(1.0) * 0.7),
            5 => Axis::over(name, -60.0, 260.0),
            _ => Axis::over(name, -65.0, 65.0),
        };
        let degrees = if place < 3 { 1.0 } else { 180.0 / PI };
        let start =
            Panel::new("", axis(), range).line(series(reference, |k| degrees * reference.references[k][state]), grey);
        flights.iter().fold(start, |panel, (_, flight, style)| match place {
            0..3 => panel.line(series(flight, |k| flight.states[k][state]), *style),
            _ => panel.line(unwrapped(flight, state), *style),
        })
    };
    let mut legend = legend(flights);
    legend.push(("reference".into(), grey));
    Figure {
        number,
        title: title.into(),
        caption,
        columns: 2,
        aspect: 0.42,
        panels: [0, 3, 1, 4, 2, 5].map(|place| panel((place, names[place]))).into(),
        legend,
    }
}

/// The four forces over time.
fn forces(
    number: &'static str,
    title: &str,
    caption: String,
    end_s: f64,
    flights: &[Labelled],
    top: Option<f64>,
) -> Figure {
    let panel = |i: usize| {
        let label = format!("F_{} / N", i + 1);
        let axis = top.map_or(Axis::new(label.clone()), |top| Axis::over(label, -0.05 * top, 1.05 * top));
        flights.iter().fold(Panel::new("", Axis::over("t / s", 0.0, end_s), axis), |panel, (_, flight, style)| {
            let inputs = (0..flight.inputs.len()).step_by(5).map(|k| [flight.time_s[k], flight.inputs[k][i]]);
            panel.line(inputs.collect::<Vec<_>>(), *style)
        })
    };
    Figure {
        number,
        title: title.into(),
        caption,
        columns: 2,
        aspect: 0.42,
        panels: (0..4).map(panel).collect(),
        legend: legend(flights),
    }
}

/// The figures of chapters III and VI.
pub fn figures(fleet: &Fleet) -> Result<Vec<Figure>, Failure> {
    let Fleet { plant, weight_n, lpvqr: [free, two, one], low: [low_1, low_10, low_20], high } = fleet;
    let (near, far) = ([NEAR_M; 3], [FAR_M; 3]);
    // half a turn is as far either way round, and noise decides: the last two are asked to take the way that it takes here
    let flights: Vec<Flight> = [
        (free, near, HALF_TURN, false),
        (two, near, HALF_TURN, false),
        (one, near, HALF_TURN, false),
        (low_1, near, HALF_TURN, false),
        (low_10, near, HALF_TURN, false),
        (low_20, near, HALF_TURN, false),
        (high, near, HALF_TURN, false),
        (low_1, far, HALF_TURN, false),
        (low_10, far, HALF_TURN, false),
        (low_20, far, HALF_TURN, false),
        (low_1, [ALONG_X_M, NEAR_M, NEAR_M], HALF_TURN, false),
        (high, near, -HALF_TURN, true),
        (high, near, -HALF_TURN, false),
    ]
    .par_iter()
    .map(|&(design, to, yaw, noise)| fleet.fly(design, to, yaw, noise, 40.0))
    .collect();
    let trajectories: Vec<&Trajectory> = flights.iter().map(|flight| &flight.trajectory).collect();
    let [free, two, one, low_1, low_10, low_20, high_20, far_1, far_10, far_20, _, noisy, quiet] = trajectories[..]
    else {
        return Err(Failure::Defect("a flight is missing".into()));
    };
    let consistency = flights[11].consistency.as_ref().ok_or_else(|| Failure::Defect("no filter flew".into()))?;
    let (solid, dashed) = (Style::solid, |color: u8| Style::with(color, Dash::Dashed));
    let dotted = |color: u8| Style::with(color, Dash::Chain);
    let set_point = format!("Set point x = y = z = {NEAR_M} m with ψ = 180° at t = {STEP_AT_S} s.");
    let top = 0.5 * *weight_n;
    let three = |a, b, c| [("γ = 1", a, solid(0)), ("γ = 10", b, dashed(1)), ("γ = 20", c, dotted(2))];

    let box_weights = BoxWeights::new(&[Feature::Sin, Feature::Cos]);
    let psi = || (0..=360).map(|k| f64::from(k - 180).to_radians());
    let weight_panel =
        (0..4).fold(Panel::new("", Axis::over("ψ / °", -180.0, 180.0), Axis::over("ρ", -0.02, 1.02)), |panel, i| {
            let style = [solid(0), dashed(1), dotted(2), Style::with(3, Dash::Dotted)][i];
            panel.line(psi().map(|psi| [psi.to_degrees(), box_weights.at(psi)[i]]).collect::<Vec<_>>(), style)
        });
    let mut figures = vec![Figure {
        number: "3.4",
        title: "The parameters ρᵢ as functions of the yaw angle".into(),
        caption: "(3.36)-(3.39): zero or more, and their sum is one.".into(),
        columns: 1,
        aspect: 0.45,
        panels: vec![weight_panel],
        legend: (0..4)
            .map(|i| (format!("ρ_{}", i + 1), [solid(0), dashed(1), dotted(2), Style::with(3, Dash::Dotted)][i]))
            .collect(),
    }];
    figures.push(states(
        "6.4",
        "Responses under the LPVQR with unbounded inputs",
        format!("{set_point} The regulator of Theorem 4.5 flies it in four seconds."),
        12.0,
        &[("LPVQR, unbounded", free, solid(0))],
    ));
    let varying = |i: usize, style| {
        let yaw: Vec<[f64; 2]> = unwrapped(free, YAW);
        (
            yaw.into_iter()
                .map(move |[t, psi]| [t, BoxWeights::new(&[Feature::Sin, Feature::Cos]).at(psi.to_radians())[i]]),
            style,
        )
    };
    let styles = [solid(0), dashed(1), dotted(2), Style::with(3, Dash::Dotted)];
    figures.push(Figure {
        number: "6.5",
        title: "The varying parameters of this flight".into(),
        caption: "ρᵢ(ψ(t)): half a turn takes the vehicle from one side of the polytope to the other.".into(),
        columns: 1,
        aspect: 0.4,
        panels: vec![(0..4).fold(
            Panel::new("", Axis::over("t / s", 0.0, 12.0), Axis::over("ρ", -0.02, 1.02)),
            |panel, i| {
                let (points, style) = varying(i, styles[i]);
                panel.line(points, style)
            },
        )],
        legend: (0..4).map(|i| (format!("ρ_{}", i + 1), styles[i])).collect(),
    });
    figures.push(forces(
        "6.6",
        "Unbounded inputs of the LPVQR",
        "The first samples ask for forces that no rotor gives, of either sign; the axis shows the first seconds."
            .into(),
        4.0,
        &[("LPVQR, unbounded", free, solid(0))],
        None,
    ));
    figures.push(states(
        "6.7",
        "Responses under the LPVQR with bounded inputs",
        format!(
            "{set_point} {} ([0, mg] for each rotor is the thesis's \"2 g\", [0, mg/2] its \"1 g\").",
            told(&[("Unbounded", &flights[0]), ("[0, mg]", &flights[1]), ("[0, mg/2]", &flights[2])])
        ),
        20.0,
        &[("unbounded", free, solid(0)), ("[0, mg]", two, dashed(1)), ("[0, mg/2]", one, dotted(4))],
    ));
    figures.push(states(
        "6.8",
        "Responses under the SLPVQR with [0, mg/2]",
        format!("{set_point} σ = mg/4. The larger γ, the larger the certified set and the slower the flight."),
        40.0,
        &three(low_1, low_10, low_20),
    ));
    figures.push(forces(
        "6.9",
        "Inputs of the SLPVQR",
        "The forces stay within [0, mg/2], and saturate at the beginning only.".into(),
        12.0,
        &three(low_1, low_10, low_20),
        Some(top),
    ));
    let path = |flight: &Trajectory, style| {
        let point = |k: usize| [flight.states[k][3], flight.states[k][4], flight.states[k][5]];
        let per_second = (1.0 / SAMPLE_TIME_S).round() as usize;
        let count = flight.time_s.len();
        ((0..count).step_by(25).map(point).collect(), (0..count).step_by(per_second).map(point).collect(), style)
    };
    figures.push(Figure {
        number: "6.10",
        title: "Paths of the SLPVQR in space".into(),
        caption: format!("From the origin to ({NEAR_M}, {NEAR_M}, {NEAR_M}) m; a dot for each second. Seen from a corner, without perspective."),
        columns: 1,
        aspect: 0.7,
        panels: vec![path_in_space(
            "",
            [NEAR_M; 3],
            2.0,
            &[path(low_1, solid(0)), path(low_10, dashed(1)), path(low_20, dotted(2))],
        )],
        legend: legend(&three(low_1, low_10, low_20)),
    });
    figures.push(states(
        "6.11",
        "Responses under the SLPVQR, farther away",
        format!(
            "Set point x = y = z = {FAR_M} m with ψ = 180°. {}: the certified sets, of a metre or two, say nothing of either. The thesis \
             moves the set point along x alone; there γ = 1 {} x = {ALONG_X_M} m with y = z = {NEAR_M} m.",
            told(&[("γ = 1", &flights[7]), ("γ = 10", &flights[8]), ("γ = 20", &flights[9])]),
            if flights[10].outcome == Outcome::Completed { "still flies" } else { "does not fly" },
        ),
        40.0,
        &three(far_1, far_10, far_20),
    ));
    let pair = [("high-gain SLPVQR", high_20, solid(0)), ("SLPVQR", low_20, dashed(1))];
    figures.push(states(
        "6.12",
        "Responses under the high-gain SLPVQR and the SLPVQR, γ = 20",
        format!("{set_point} The high gain has the same certified set, and flies like the LPVQR."),
        40.0,
        &pair,
    ));
    figures.push(forces(
        "6.13",
        "Inputs of the two, γ = 20",
        "The high gain saturates more, and settles sooner.".into(),
        12.0,
        &pair,
        Some(top),
    ));

    let measured = |place: usize| {
        let (state, name) =
            ([3, 4, 5, 9, 10, 11][place], ["r_x / m", "r_y / m", "r_z / m", "φ / °", "θ / °", "ψ / °"][place]);
        let unit = if place < 3 { 1.0 } else { 180.0 / PI };
        let count = noisy.measurements.len();
        let dots = (0..count).step_by(40).map(|k| [noisy.time_s[k], unit * noisy.measurements[k][place]]);
        Panel::new("", Axis::over("t / s", 0.0, 12.0), Axis::new(name))
            .line(dots.collect::<Vec<_>>(), Style::with(5, Dash::Dots))
            .line(series(noisy, move |k| unit * noisy.states[k][state]), solid(0))
    };
    figures.push(Figure {
        number: "6.14",
        title: "Responses and measurements with noise and filter".into(),
        caption: format!("{set_point} High gain, γ = 20, on the estimate of the extended Kalman filter. Half a turn is as far either way round; here it goes to −180°."),
        columns: 2,
        aspect: 0.42,
        panels: [0, 3, 1, 4, 2, 5].map(measured).into(),
        legend: vec![("response".into(), solid(0)), ("measurement".into(), Style::with(5, Dash::Dots))],
    });
    figures.push(forces(
        "6.15",
        "Inputs with and without noise",
        "Both turn to −180°. The estimate's noise goes through the high gain: the rotors move between their limits."
            .into(),
        6.0,
        &[("with noise and filter", noisy, Style::with(5, Dash::Solid)), ("without", quiet, solid(0))],
        Some(top),
    ));
    let names = plant.description().states.iter().map(|signal| (signal.name.clone(), signal.unit.clone()));
    let errors = names.enumerate().map(|(i, (name, unit))| {
        let count = noisy.estimates.len();
        let at = |value: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
            (0..count).step_by(20).map(|k| [noisy.time_s[k], value(k)]).collect()
        };
        let error = |k: usize| {
            let difference = noisy.states[k][i] - noisy.estimates[k][i];
            if i == YAW { lpv::math::angle::wrap(difference) } else { difference }
        };
        let bound = at(&|k| 3.0 * noisy.deviations[k][i]);
        let below = bound.iter().map(|[t, value]| [*t, -value]).collect::<Vec<_>>();
        let name = match name.as_str() {
            "phi" => "φ",
            "theta" => "θ",
            "psi" => "ψ",
            other => other,
        };
        let unit = if unit.contains('/') { format!("({unit})") } else { unit };
        Panel::new("", Axis::over("t / s", 0.0, 40.0), Axis::new(format!("{name} / {unit}")))
            .line(at(&error), solid(0))
            .line(bound, dashed(1))
            .line(below, dashed(1))
    });
    figures.push(Figure {
        number: "6.16",
        title: "Estimation errors and ±3σ".into(),
        caption: format!(
            "Error of each state, x − x̂, with the filter's own ±3σ: inside for {:.1} to {:.1} % of the time; mean of eᵀP⁻¹e {:.2}, of a \
             consistent filter 12.",
            100.0 * consistency.inside_three_sigma.iter().copied().fold(1.0, f64::min),
            100.0 * consistency.inside_three_sigma.iter().copied().fold(0.0, f64::max),
            consistency.nees
        ),
        columns: 3,
        aspect: 0.6,
        panels: errors.collect(),
        legend: vec![("error".into(), solid(0)), ("±3σ of the filter".into(), dashed(1))],
    });
    Ok(figures)
}
