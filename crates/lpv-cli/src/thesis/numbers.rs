//! Chapter VI in numbers: the printed gains, why Theorems 4.1-4.4 fail, what the saturated designs are good for, the filter.

use super::comparison::{Entry, Standing, Table};
use super::quadrotor::{Fleet, HALF_TURN, SAMPLE_TIME_S, weights};
use crate::failure::Failure;
use lpv::certificate::{ProofOptions, prove};
use lpv::controller::Schedule;
use lpv::math::Mat;
use lpv::math::decimal::{Rounding, about, at_most, decimal, fixed_toward};
use lpv::math::eigen::{spectral_abscissa, spectral_radius};
use lpv::math::hold::discretize;
use lpv::math::matrix::inverse_spd;
use lpv::math::riccati;
use lpv::model::{FrozenModel, GridModel, Polytope, linearize};
use lpv::plant::{PlantSpec, QuadrotorParameters};
use lpv::sim::Outcome;
use lpv::synthesis::Design;
use lpv::synthesis::polytopic::{BackOff, Lyapunov, Objective, PolytopicRequest, UnstabilizablePoint, synthesize};
use rayon::prelude::*;
use std::f64::consts::PI;

/// K(ψ) of (6.3)-(6.7) as printed, u = −Kx, with (6.3)'s slip mended.
const PRINTED: &str = include_str!("../../../../scenarios/thesis-printed-gain.json");
/// Columns whose sign half a turn of yaw changes: v_x, v_y, r_x, r_y, φ, θ.
const TURNED: [usize; 6] = [0, 1, 3, 4, 9, 10];
/// The g that the printed gains were computed with.
const THEIR_GRAVITY: f64 = 9.81;
/// Half arcs of yaw on which one Lyapunov function is asked for, in degrees.
const ARCS_DEG: [f64; 5] = [30.0, 60.0, 80.0, 85.0, 88.0];
/// Steps along x = y = z that are tried first, in metres: doubled until one is lost.
const FIRST_STEP_M: f64 = 4.0;
const LONGEST_STEP_M: f64 = 512.0;
/// Relative width at which the search for the edge ends.
const EDGE: f64 = 0.01;

fn entry(row: impl Into<String>, quantity: &'static str, value: f64, decimals: usize, standing: Standing) -> Entry {
    Entry { row: row.into(), quantity, printed: None, value: Some(value), decimals, standing, reason: String::new() }
}

impl Entry {
    fn because(self, reason: impl Into<String>) -> Self {
        Self { reason: reason.into(), ..self }
    }

    fn against(self, printed: f64) -> Self {
        Self { printed: Some(printed), ..self }
    }
}

/// Two digits of what was measured.
fn short(value: f64) -> String {
    decimal(value, 2, Rounding::Nearest)
}

/// Everything in one table.
pub fn chapter(fleet: &Fleet) -> Result<Table, Failure> {
    let (((gains, arcs), proofs), (steps, edges)) = rayon::join(
        || rayon::join(|| rayon::join(|| printed_gain(fleet), || arcs(fleet)), || proofs(fleet)),
        || rayon::join(|| steps(fleet), || edges(fleet)),
    );
    let entries = [gains?, arcs?, regions(fleet)?, steps, edges, proofs?, filter(fleet)?].concat();
    Ok(Table {
        number: "6.2",
        title: "Chapter VI in numbers, where the thesis has words, gains and pictures".into(),
        setting: "Not a table of the thesis. Q, R of (6.1), (6.2); Table 6.1; 32 yaw angles; controllers sample every 2 ms; [0, mg/2] for each \
                  rotor unless said otherwise. A figure without a thesis value stands for a statement or picture of it."
            .into(),
        entries,
    })
}

/// K at yaw zero from the vertices as printed.
fn printed_at_zero() -> Result<Mat<f64>, Failure> {
    let design: Design = serde_json::from_str(PRINTED).map_err(|error| Failure::serialisation(&error))?;
    match &design.controller.schedule {
        schedule @ Schedule::Vertices { .. } => Ok(schedule.gain_matrix(0.0)),
        _ => Err(Failure::Defect("the printed gain has no vertices".into())),
    }
}

fn regulator(gravity_m_s2: f64, yaw_rad: f64) -> Result<(FrozenModel, Mat<f64>), Failure> {
    let spec = PlantSpec::Quadrotor(QuadrotorParameters { gravity_m_s2, ..QuadrotorParameters::default() });
    let plant = spec.build().map_err(|error| Failure::Defect(error.to_string()))?;
    let model = linearize(&*plant, yaw_rad);
    let cost = weights();
    let regulator = riccati::solve(&model.a, &model.b, &cost.q, &cost.r)
        .map_err(|error| Failure::Defect(format!("the regulator of the quadrotor: {error}")))?;
    Ok((model, regulator.k))
}

/// (6.3)-(6.7)
fn printed_gain(fleet: &Fleet) -> Result<Vec<Entry>, Failure> {
    let printed = printed_at_zero()?;
    let mended = Mat::from_fn(4, 12, |i, j| if TURNED.contains(&j) { -printed[(i, j)] } else { printed[(i, j)] });
    let model = linearize(&*fleet.plant, 0.0);
    let abscissa = |k: &Mat<f64>| spectral_abscissa(&(&model.a - &model.b * k));
    let difference = |gravity: f64, yaw: f64, k: &Mat<f64>| {
        let (_, right) = regulator(gravity, yaw)?;
        Ok::<_, Failure>((&right - k).norm_max() / right.norm_max())
    };
    let theirs = difference(THEIR_GRAVITY, 0.0, &mended)?;
    let turned = difference(THEIR_GRAVITY, PI, &printed)?;
    let table = difference(QuadrotorParameters::default().gravity_m_s2, 0.0, &mended)?;
    let relative = "from the Riccati gain";
    Ok(vec![
        entry("K(ψ) as printed, at ψ = 0", "max Re λ", abscissa(&printed), 4, Standing::Computed)
            .because("Unstable on the thesis's own model: it is the gain at ψ + π."),
        entry("the same, columns 1, 2, 4, 5, 10, 11 negated", "max Re λ", abscissa(&mended), 4, Standing::Computed)
            .because("Stable. Listing the vertices as K₄, K₃, K₂, K₁ does the same."),
        entry("K(ψ) as printed, at ψ + π, g = 9.81", relative, turned, 7, Standing::Computed)
            .because("Largest difference of an entry, relative: the four decimals printed."),
        entry("g of the gains", "g / (m/s²)", THEIR_GRAVITY, 4, Standing::Computed).against(9.807).because(format!(
            "Table 6.1 says 9.807; the gains differ from the Riccati gain by {} with 9.81 and by {} with 9.807.",
            short(theirs),
            short(table)
        )),
    ])
}

/// Theorems 4.1 to 4.4 on the hull of yaw angles.
fn arcs(fleet: &Fleet) -> Result<Vec<Entry>, Failure> {
    let stabilize = PolytopicRequest {
        weights: None,
        lyapunov: Lyapunov::Common,
        saturation: None,
        high_gain: None,
        objective: Objective::Trace,
        back_off: BackOff::Nothing,
    };
    let solve = |models: &[FrozenModel]| {
        synthesize(&Polytope::hull(models), &stabilize)
            .map_err(|source| Failure::Synthesis { controller: "quadrotor on an arc of yaw".into(), source })
    };
    let circle = solve(&GridModel::of_plant(&*fleet.plant, 8).points)?;
    let Some(UnstabilizablePoint { is_proved: true, direction, eigenvalue, .. }) = circle.unstabilizable else {
        return Err(Failure::Defect("the hull of the yaw circle has no point that cannot be stabilised".into()));
    };
    let length = direction.iter().map(|w| w * w).sum::<f64>().sqrt();
    let tilt = direction[9].hypot(direction[10]) / length;
    let mut entries = vec![
        entry("Theorems 4.1-4.4, whole circle", "λ of the mode that no input moves at its centre", eigenvalue[0], 9, Standing::Refuted).because(format!(
            "Infeasible, as the thesis says, but not because four vertices are conservative: the hull of any points around the circle holds its centre, where no \
             input moves roll and pitch (w has {} of its length in φ and θ).",
            about(tilt)
        )),
    ];
    for degrees in ARCS_DEG {
        let half = degrees.to_radians();
        let models: Vec<_> = (0..7).map(|k| linearize(&*fleet.plant, half * (f64::from(k) / 3.0 - 1.0))).collect();
        let design = solve(&models)?;
        entries.push(
            entry(
                format!("Theorem 4.1, yaw within ±{degrees}°"),
                "largest margin, tr Y = 12",
                design.answer.objective,
                4,
                Standing::BoundNumerical,
            )
            .because("Feasible on an arc; the margin falls as the arc's hull nears the centre."),
        );
    }
    Ok(entries)
}

/// The certified sets, and how high the high gain may go.
fn regions(fleet: &Fleet) -> Result<Vec<Entry>, Failure> {
    let mut entries = Vec::new();
    for design in &fleet.low {
        let gamma = design.method.gamma().unwrap_or(f64::NAN);
        let point = &design.points[0];
        let row = format!("Theorem 5.3, γ = {gamma}");
        entries.push(entry(row.clone(), "tr Y", point.trace_y, 6, Standing::Computed));
        entries.push(
            entry(row, "certified step in x / m", (gamma / point.p[(3, 3)]).sqrt(), 2, Standing::BoundNumerical)
                .because("For a yaw at rest. What flies goes far beyond: see the steps below."),
        );
    }
    let (model, cost) = (linearize(&*fleet.plant, 0.0), weights());
    let nearest = |point: &&lpv::synthesis::FrozenDesign| (point.rho - model.rho).abs();
    let point = fleet.low[2].points.iter().min_by(|a, b| nearest(a).total_cmp(&nearest(b)));
    let point = point.ok_or_else(|| Failure::Defect("a design without points".into()))?;
    let r_inverse = inverse_spd(&cost.r).ok_or_else(|| Failure::Defect("R has no inverse".into()))?;
    let model = linearize(&*fleet.plant, point.rho);
    let highest = r_inverse * model.b.transpose() * &point.p;
    let (ad, bd) = discretize(&model.a, &model.b, SAMPLE_TIME_S);
    let high = &fleet.high.points[0].gain;
    entries.push(
        entry("Theorem 5.4, γ = 20, s = 1", "largest entry of K", highest.norm_max(), 0, Standing::Computed)
            .because("R⁻¹BᵀP satisfies the theorem, and cannot run at 2 ms."),
    );
    entries.push(
        entry(
            "Theorem 5.4, γ = 20, s = 1",
            "max |λ| sampled",
            spectral_radius(&(&ad - &bd * &highest)),
            1,
            Standing::Computed,
        )
        .because("Of the loop sampled every 2 ms: it has to be below one."),
    );
    entries.push(
        entry(
            "Theorem 5.4, γ = 20, s as chosen",
            "max |λ| sampled",
            {
                let model = linearize(&*fleet.plant, fleet.high.points[0].rho);
                let (ad, bd) = discretize(&model.a, &model.b, SAMPLE_TIME_S);
                spectral_radius(&(&ad - &bd * high))
            },
            4,
            Standing::Computed,
        )
        .because(format!("The gain that flies; its largest entry is {}.", about(high.norm_max()))),
    );
    Ok(entries)
}

/// A step of 1 m in x.
fn steps(fleet: &Fleet) -> Vec<Entry> {
    let [free, _, one] = &fleet.lpvqr;
    let [low_1, low_10, low_20] = &fleet.low;
    let flown: Vec<Vec<Entry>> = [
        ("LPVQR, unbounded", free),
        ("LPVQR", one),
        ("SLPVQR, γ = 1", low_1),
        ("SLPVQR, γ = 10", low_10),
        ("SLPVQR, γ = 20", low_20),
        ("high-gain SLPVQR, γ = 20", &fleet.high),
    ]
    .par_iter()
    .map(|(name, design)| {
        let measured = fleet.measure(design, [1.0, 0.0, 0.0], 0.0, 61.0);
        let row = format!("{name}, step of 1 m in x");
        let point = design.points.iter().min_by(|a, b| a.rho.abs().total_cmp(&b.rho.abs()));
        let bound = point.map_or(f64::NAN, |point| point.p[(3, 3)]);
        vec![
            entry(row.clone(), "cost over 60 s", measured.actual_cost.unwrap_or(f64::NAN), 4, Standing::Integrated)
                .because(format!(
                    "x(0)ᵀPx(0) = {}: the bound of the linear model, and without limits its cost.",
                    at_most(bound)
                )),
            entry(row, "settling to 5 % / s", measured.settling_time_s.unwrap_or(f64::NAN), 2, Standing::Integrated),
        ]
    })
    .collect();
    flown.concat()
}

/// How far each controller flies.
fn edges(fleet: &Fleet) -> Vec<Entry> {
    let [_, _, one] = &fleet.lpvqr;
    let [low_1, low_10, low_20] = &fleet.low;
    let controllers = [
        ("LPVQR", one),
        ("SLPVQR, γ = 1", low_1),
        ("SLPVQR, γ = 10", low_10),
        ("SLPVQR, γ = 20", low_20),
        ("high-gain SLPVQR, γ = 20", &fleet.high),
    ];
    let of = |&(name, design): &(&str, &Design)| {
        let flies =
            |distance: f64| fleet.fly(design, [distance; 3], HALF_TURN, false, 60.0).outcome == Outcome::Completed;
        let row = format!("{name}, x = y = z, ψ = 180°");
        let (mut flown, mut lost) = (0.0, FIRST_STEP_M);
        while lost <= LONGEST_STEP_M && flies(lost) {
            (flown, lost) = (lost, 2.0 * lost);
        }
        while lost - flown > EDGE * lost {
            let middle = 0.5 * (flown + lost);
            if flies(middle) { flown = middle } else { lost = middle }
        }
        entry(row, "step that is lost / m", lost, 2, Standing::Integrated).because(format!(
            "{} m is flown. By bisection, so that a shorter one may be lost too. The certified step is far shorter.",
            fixed_toward(flown, 2, Rounding::Down)
        ))
    };
    controllers.par_iter().map(of).collect()
}

/// Up to which yaw rate the frozen designs are good for anything.
fn proofs(fleet: &Fleet) -> Result<Vec<Entry>, Failure> {
    let of = |(name, design): &(&str, &Design)| {
        let proofs = prove(design, &*fleet.plant, &ProofOptions::default())
            .map_err(|error| Failure::Defect(format!("the proof for the quadrotor: {error}")))?;
        // none at all is not a rate of zero
        let standing = if proofs.stable_up_to.is_some() { Standing::Proved } else { Standing::NoBound };
        let rate = entry(*name, "proved yaw rate / (rad/s)", 0.0, 4, standing);
        Ok(Entry { value: proofs.stable_up_to, ..rate }
            .because("Stability, and invariance of the certified set, with P(ψ) of the frozen designs, for every yaw. The thesis guarantees it at any rate."))
    };
    [("Theorem 4.5", &fleet.lpvqr[0]), ("Theorem 5.3, γ = 1", &fleet.low[0]), ("Theorem 5.3, γ = 20", &fleet.low[2])]
        .par_iter()
        .map(of)
        .collect()
}

/// The extended Kalman filter in the loop of the high gain.
fn filter(fleet: &Fleet) -> Result<Vec<Entry>, Failure> {
    let flight = fleet.fly(&fleet.high, [6.0; 3], HALF_TURN, true, 60.0);
    let found = flight.consistency.ok_or_else(|| Failure::Defect("no filter flew".into()))?;
    let least = found.inside_three_sigma.iter().copied().fold(1.0, f64::min);
    let row = || "EKF, 60 s with noise".to_owned();
    let mut entries = vec![
        entry(row(), "mean eᵀP⁻¹e", found.nees, 2, Standing::Integrated).because(
            "12 for a consistent filter of 12 states; Q_c = Q_d/T, R_c = R_d T, force noise held over T with covariance Q_d/T².",
        ),
        entry(row(), "least share inside ±3σ / %", 100.0 * least, 1, Standing::Integrated).because("99.7 for Gaussian errors."),
    ];
    let states = &fleet.plant.description().states;
    for (state, rms) in states.iter().zip(&found.rms_error) {
        entries.push(entry(format!("EKF, error of {}", state.name), "root mean square", *rms, 4, Standing::Integrated));
    }
    Ok(entries)
}
