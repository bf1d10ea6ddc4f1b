//! Chapter V: the double integrator (5.4) with |u| ≤ 1 under LQR, SLQR and high-gain SLQR. Table 5.1, Figures 5.1 to 5.9.

use super::comparison::{Entry, Standing, Table};
use super::phase_plane::{ellipse, strip};
use super::responses::{Curve, responses};
use crate::failure::Failure;
use crate::figure::{Axis, Dash, Figure, Panel, Style};
use lpv::math::Mat;
use lpv::math::decimal::{Rounding, decimal};
use lpv::math::matrix::{diagonal, identity, quadratic_form};
use lpv::math::riccati::{self, Regulator};
use lpv::model::{Polytope, linearize};
use lpv::plant::DoubleIntegrator;
use lpv::sim::{AdaptiveOptions, ContinuousFlight, fly_continuously};
use lpv::synthesis::CostWeights;
use lpv::synthesis::polytopic::{BackOff, InputBounds, Lyapunov, Objective, PolytopicRequest, Solution, synthesize};

/// R of (5.5); Q = I.
const R: f64 = 0.001;
/// x(0) of Table 5.1 and of the trajectories.
const START: [f64; 2] = [0.0, 2.0];
/// The gains printed in (5.6), (5.9) and (5.14).
const PRINTED_LQR: [f64; 2] = [31.6241, 32.6078];
const PRINTED_SLQR: [f64; 2] = [0.4378, 1.1094];
const PRINTED_HIGH: [f64; 2] = [117.0280, 152.2037];
/// Levels of the certified sets.
const GAMMAS: [f64; 3] = [1.0, 30.0, 60.0];

/// A gain with the matrix of its bound.
struct Regulated {
    k: Mat<f64>,
    p: Mat<f64>,
}

/// The chapter: its table and its figures.
pub fn chapter() -> Result<(Table, Vec<Figure>), Failure> {
    let lqr = regulator()?;
    let low: Vec<Regulated> = GAMMAS.into_iter().map(|gamma| slqr(1.0, gamma)).collect::<Result<_, _>>()?;
    let (s, from_segment) = printed_point(&low[0]);
    let high: Vec<Regulated> = low.iter().map(|low| high_gain(low, s)).collect();

    let lqr_flight = fly(&lqr.k, 1.0, START, 60.0)?;
    let low_flights: Vec<_> = low.iter().map(|design| fly(&design.k, 1.0, START, 150.0)).collect::<Result<_, _>>()?;
    let high_flights: Vec<_> = high.iter().map(|design| fly(&design.k, 1.0, START, 60.0)).collect::<Result<_, _>>()?;

    let mut entries = Vec::new();
    let outside = "x(0) lies outside the certified ellipsoid xᵀPx ≤ γ: the number is no bound for it.";
    add(
        &mut entries,
        "LQR",
        [0.1304, 12.9183],
        (quadratic_form(&lqr.p, &START), 6, Standing::NoBound),
        "Holds without saturation only; the cost with it is a hundred times larger.",
        &lqr_flight,
        "The printed one is 0.006 low: the tolerance of its integration.",
    );
    let printed_low = [[5.9236, 14.6245], [39.6801, 39.6767], [59.6855, 59.6823]];
    let printed_high = [[5.9238, 12.9800], [39.6809, 13.7781], [59.6850, 14.1560]];
    for (k, gamma) in GAMMAS.into_iter().enumerate() {
        let bound = quadratic_form(&low[k].p, &START);
        let (standing, why) = if bound <= gamma {
            (Standing::BoundNumerical, "Checked in floating point. The thesis prints what its solver left of accuracy.")
        } else {
            (Standing::NoBound, outside)
        };
        add(
            &mut entries,
            &format!("SLQR, γ = {gamma}"),
            printed_low[k],
            (bound, 4, standing),
            why,
            &low_flights[k],
            "The printed one is 0.003 to 0.004 low: the tolerance of its integration.",
        );
    }
    for (k, gamma) in GAMMAS.into_iter().enumerate() {
        let bound = quadratic_form(&high[k].p, &START);
        let (standing, why) = if bound <= gamma {
            (Standing::BoundNumerical, "The same optimum as Theorem 5.1's: the two have the same Y.")
        } else {
            (Standing::NoBound, outside)
        };
        add(
            &mut entries,
            &format!("High-gain SLQR, γ = {gamma}"),
            printed_high[k],
            (bound, 4, standing),
            why,
            &high_flights[k],
            &format!(
                "Theorem 5.2 leaves the gain open; taken is K_s at s = {s:.4}, where the printed gain (5.14) lies. The cost hardly \
                 depends on s; the printed one is 0.002 to 0.006 low besides."
            ),
        );
    }
    let mut gain = |row: &str, printed: [f64; 2], k: &Mat<f64>, reason: &str| {
        for (j, quantity) in ["K, entry 1", "K, entry 2"].into_iter().enumerate() {
            entries.push(Entry {
                row: row.into(),
                quantity,
                printed: Some(printed[j]),
                value: Some(k[(0, j)]),
                decimals: 6,
                standing: Standing::Computed,
                reason: reason.into(),
            });
        }
    };
    gain(
        "LQR gain (5.6)",
        PRINTED_LQR,
        &lqr.k,
        "By the Riccati equation; the thesis prints what its LMI solver left of accuracy.",
    );
    gain("SLQR gain (5.9), γ = 1", PRINTED_SLQR, &low[0].k, "");
    let reason = format!(
        "Not unique: the printed gain is this point of the segment of solutions F + s(R⁻¹BᵀP − F), {} off it relatively.",
        decimal(from_segment, 1, Rounding::Up)
    );
    gain("High gain (5.14), γ = 1", PRINTED_HIGH, &high[0].k, &reason);
    entries.push(Entry {
        row: "High gain (5.14), γ = 1".into(),
        quantity: "s on K_s",
        printed: None,
        value: Some(s),
        decimals: 4,
        standing: Standing::Computed,
        reason,
    });
    let table = Table {
        number: "5.1",
        title: "LQR, SLQR and high-gain SLQR of the saturated double integrator".into(),
        setting: "ẋ₁ = x₂, ẋ₂ = u, |u| ≤ 1; Q = I, R = 0.001; x(0) = [0, 2]. Actual costs: Dormand–Prince 8(5,3) in continuous \
                  time, relative tolerance 10⁻¹¹; what changes at a tolerance a hundred times larger is given with each."
            .into(),
        entries,
    };
    let figures = figures(&lqr, &low, &high, (&lqr_flight, &low_flights, &high_flights))?;
    Ok((table, figures))
}

/// The two numbers of a row.
fn add(
    entries: &mut Vec<Entry>,
    row: &str,
    printed: [f64; 2],
    (bound, decimals, standing): (f64, usize, Standing),
    why_bound: &str,
    flight: &ContinuousFlight,
    why_cost: &str,
) {
    entries.push(Entry {
        row: row.into(),
        quantity: "guaranteed cost",
        printed: Some(printed[0]),
        value: Some(bound),
        decimals,
        standing,
        reason: why_bound.into(),
    });
    entries.push(Entry {
        row: row.into(),
        quantity: "actual cost",
        printed: Some(printed[1]),
        value: Some(flight.actual_cost),
        decimals: 4,
        standing: Standing::Integrated,
        reason: format!(
            "{why_cost} Changes by {} with the tolerance.",
            decimal(flight.cost_change.max(1e-15), 1, Rounding::Up)
        ),
    });
}

fn regulator() -> Result<Regulated, Failure> {
    let model = linearize(&DoubleIntegrator::default(), 0.0);
    let Regulator { p, k } = riccati::solve(&model.a, &model.b, &identity(2), &diagonal(&[R]))
        .map_err(|error| Failure::Defect(format!("the regulator of the double integrator: {error}")))?;
    Ok(Regulated { k, p })
}

/// Theorem 5.1.
fn slqr(sigma: f64, gamma: f64) -> Result<Regulated, Failure> {
    let model = linearize(&DoubleIntegrator::default(), 0.0);
    let request = PolytopicRequest {
        weights: Some(CostWeights { q: identity(2), r: diagonal(&[R]) }),
        lyapunov: Lyapunov::Common,
        saturation: Some(InputBounds { sigma: vec![sigma], gamma }),
        high_gain: None,
        objective: Objective::Trace,
        back_off: BackOff::Nothing,
    };
    let failed = |source| Failure::Synthesis { controller: "double integrator".into(), source };
    let design = synthesize(&Polytope::hull(&[model]), &request).map_err(failed)?;
    match design.solution {
        Some(Solution { gain, p, .. }) => Ok(Regulated { k: gain[0].clone(), p: p[0].clone() }),
        None => Err(Failure::Defect("the double integrator has no saturated regulator".into())),
    }
}

/// R⁻¹BᵀP, B = [0; 1]
fn highest(p: &Mat<f64>) -> [f64; 2] {
    [p[(1, 0)] / R, p[(1, 1)] / R]
}

/// Theorem 5.2, which has the P of Theorem 5.1, with the gain K_s = F + s(R⁻¹BᵀP − F).
fn high_gain(Regulated { k: f, p }: &Regulated, s: f64) -> Regulated {
    let end = highest(p);
    Regulated { k: Mat::from_fn(1, 2, |_, j| (1.0 - s) * f[(0, j)] + s * end[j]), p: p.clone() }
}

/// The s at which K_s is closest to the printed high gain (5.14), and the relative distance left.
fn printed_point(low: &Regulated) -> (f64, f64) {
    let end = highest(&low.p);
    let (along, from) = ([0, 1].map(|j| end[j] - low.k[(0, j)]), [0, 1].map(|j| PRINTED_HIGH[j] - low.k[(0, j)]));
    let s = (along[0] * from[0] + along[1] * from[1]) / (along[0].powi(2) + along[1].powi(2));
    let left = (from[0] - s * along[0]).hypot(from[1] - s * along[1]);
    (s, left / PRINTED_HIGH[0].hypot(PRINTED_HIGH[1]))
}

/// u = −sat(Kx), |u| ≤ `sigma`.
fn fly(k: &Mat<f64>, sigma: f64, start: [f64; 2], duration_s: f64) -> Result<ContinuousFlight, Failure> {
    let law = |x: &[f64], u: &mut [f64]| u[0] = -(k[(0, 0)] * x[0] + k[(0, 1)] * x[1]).clamp(-sigma, sigma);
    let weights = (&identity(2), &diagonal(&[R]));
    fly_continuously(&DoubleIntegrator::default(), weights, &start, duration_s, &law, &AdaptiveOptions::default())
        .map_err(|error| Failure::Defect(format!("the double integrator: {error}")))
}

fn path(flight: &ContinuousFlight) -> Vec<[f64; 2]> {
    flight.states.iter().map(|x| [x[0], x[1]]).collect()
}

type Flights<'a> = (&'a ContinuousFlight, &'a [ContinuousFlight], &'a [ContinuousFlight]);

fn figures(
    lqr: &Regulated,
    low: &[Regulated],
    high: &[Regulated],
    (lqr_flight, low_flights, high_flights): Flights,
) -> Result<Vec<Figure>, Failure> {
    const REACH: f64 = 60.0;
    let plane = |title: &str, half: [f64; 2]| {
        Panel::new(title, Axis::over("x_1 / m", -half[0], half[0]), Axis::over("x_2 / (m/s)", -half[1], half[1]))
    };
    let fill = |color: u8| Style::with(color, Dash::Fill);
    let dashed = |color: u8| Style::with(color, Dash::Dashed);
    let mut figures = Vec::new();

    let unbounded = fly(&lqr.k, f64::INFINITY, START, 20.0)?;
    figures.push(Figure {
        number: "5.1",
        title: "State trajectories of the LQR".into(),
        caption: "From x(0) = [0, 2] under the LQR, u = −Kx with K = [31.6228, 32.6074]: with unbounded input the state goes \
                  almost straight down; with |u| ≤ 1 braking takes two seconds and the position overshoots by 2 m."
            .into(),
        columns: 1,
        aspect: 0.5,
        panels: vec![
            Panel::new("", Axis::over("x_1 / m", -0.6, 2.4), Axis::over("x_2 / (m/s)", -1.6, 2.3))
                .line(strip(&lqr.k, 1.0, REACH), fill(2))
                .line(strip(&lqr.k, 1.0, REACH), Style::with(2, Dash::Dotted))
                .line(path(&unbounded), Style::solid(0))
                .line(path(lqr_flight), dashed(1)),
        ],
        legend: vec![
            ("unbounded input".into(), Style::solid(0)),
            ("|u| ≤ 1".into(), dashed(1)),
            ("unsaturated, |Kx| ≤ 1".into(), fill(2)),
        ],
    });

    figures.push(Figure {
        number: "5.2",
        title: "Ellipsoid and unsaturated region of the LQR".into(),
        caption: "The ellipsoid xᵀPx ≤ 1 of the LQR and the strip |Kx| ≤ 1 in which its input does not saturate: the ellipsoid \
                  sticks out far, so that its bound says nothing of the saturated loop."
            .into(),
        columns: 1,
        aspect: 0.55,
        panels: vec![
            plane("", [1.6, 6.5])
                .line(strip(&lqr.k, 1.0, REACH), fill(0))
                .line(strip(&lqr.k, 1.0, REACH), Style::solid(0))
                .line(ellipse(&lqr.p, 1.0), Style::solid(1)),
        ],
        legend: vec![("unsaturated, |Kx| ≤ 1".into(), fill(0)), ("xᵀPx = 1".into(), Style::solid(1))],
    });

    // σ²/γ the same: the same P, so that the whole picture is scaled
    let (inner, outer) = (&low[0], 2.0);
    figures.push(Figure {
        number: "5.3",
        title: "Geometry of Theorem 5.1".into(),
        caption: "With σ²/γ the same P is found: σ₁ = 1, γ₁ = 1 and σ₂ = 2, γ₂ = 4. The bound σ of the input sets the width of \
                  the strip, the level γ the size of the ellipsoid; the ellipsoid touches the strip from inside."
            .into(),
        columns: 1,
        aspect: 0.55,
        panels: vec![
            plane("", [6.0, 3.4])
                .line(strip(&inner.k, outer, REACH), fill(1))
                .line(strip(&inner.k, 1.0, REACH), fill(0))
                .line(ellipse(&inner.p, outer * outer), dashed(1))
                .line(ellipse(&inner.p, 1.0), Style::solid(0)),
        ],
        legend: vec![
            ("|Kx| ≤ σ_1".into(), fill(0)),
            ("xᵀPx = γ_1".into(), Style::solid(0)),
            ("|Kx| ≤ σ_2".into(), fill(1)),
            ("xᵀPx = γ_2".into(), dashed(1)),
        ],
    });

    // a start on the boundary of each ellipsoid, at its largest velocity
    let top = |design: &Regulated| {
        ellipse(&design.p, 1.0).into_iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap_or([0.0; 2])
    };
    let (lqr_start, low_start) = (top(lqr), top(&low[0]));
    let leaving = fly(&lqr.k, 1.0, lqr_start, 60.0)?;
    let staying = fly(&low[0].k, 1.0, low_start, 60.0)?;
    figures.push(Figure {
        number: "5.4",
        title: "Trajectories and ellipsoids of the LQR and the SLQR".into(),
        caption: "Each trajectory starts on the boundary xᵀPx = 1 of its own ellipsoid, |u| ≤ 1. The one of the LQR leaves its \
                  ellipsoid by far (it passes x₁ = 15 m); the one of the SLQR (σ = 1, γ = 1) stays inside, and its ellipsoid \
                  lies within the strip |Kx| ≤ 1. The strip of the LQR is too narrow to be told from a line."
            .into(),
        columns: 2,
        aspect: 0.8,
        panels: vec![
            Panel::new("LQR", Axis::over("x_1 / m", -9.0, 18.0), Axis::over("x_2 / (m/s)", -7.0, 7.0))
                .line(strip(&lqr.k, 1.0, REACH), Style::with(2, Dash::Dotted))
                .line(ellipse(&lqr.p, 1.0), Style::solid(1))
                .line(path(&leaving), dashed(1)),
            plane("SLQR, γ = 1", [2.6, 1.6])
                .line(strip(&low[0].k, 1.0, REACH), fill(0))
                .line(ellipse(&low[0].p, 1.0), Style::solid(0))
                .line(path(&staying), dashed(0)),
        ],
        legend: vec![
            ("ellipsoid, LQR".into(), Style::solid(1)),
            ("trajectory, LQR".into(), dashed(1)),
            ("ellipsoid, SLQR".into(), Style::solid(0)),
            ("trajectory, SLQR".into(), dashed(0)),
            ("unsaturated, SLQR".into(), fill(0)),
            ("unsaturated, LQR".into(), Style::with(2, Dash::Dotted)),
        ],
    });

    let ladder = |number, title: &str, caption: &str, settings: &[(f64, f64)], half: [f64; 2], name: &str| {
        let mut legend = vec![("LQR, xᵀPx = 1".to_owned(), dashed(5))];
        let mut panels = Vec::new();
        let mut all = plane("ellipsoids", half).line(ellipse(&lqr.p, 1.0), dashed(5));
        let mut strips = plane("and their unsaturated regions", half);
        for (k, &(sigma, gamma)) in settings.iter().enumerate() {
            let design = slqr(sigma, gamma)?;
            let style = Style::solid(k as u8);
            all = all.line(ellipse(&design.p, gamma), style);
            strips = strips.line(strip(&design.k, sigma, REACH), style).line(ellipse(&design.p, gamma), fill(k as u8));
            legend.push((format!("{name} = {}", if name == "σ" { sigma } else { gamma }), style));
        }
        panels.extend([all, strips]);
        Ok::<_, Failure>(Figure {
            number,
            title: title.into(),
            caption: caption.into(),
            columns: 2,
            aspect: 0.85,
            panels,
            legend,
        })
    };
    figures.push(ladder(
        "5.5",
        "Ellipsoids of the SLQR for various σ",
        "γ = 1. With a larger bound σ of the input the unsaturated strip widens and the ellipsoid grows toward that of the LQR, \
         and no further.",
        &[(0.5, 1.0), (1.0, 1.0), (4.0, 1.0), (16.0, 1.0)],
        [2.4, 6.0],
        "σ",
    )?);
    figures.push(ladder(
        "5.6",
        "Ellipsoids of the SLQR for various γ",
        "σ = 1. A larger level γ gives a larger ellipsoid, at the price of a larger bound on the cost.",
        &[(1.0, 1.0), (1.0, 10.0), (1.0, 30.0), (1.0, 60.0)],
        [14.0, 6.0],
        "γ",
    )?);

    let curve = |label: &str, flight, style| Curve { label: label.to_owned(), flight, style };
    let states = ["x_1 / m", "x_2 / (m/s)"];
    figures.push(responses(
        "5.7",
        "Responses, inputs and costs of the LQR and the SLQR",
        "From x(0) = [0, 2] with |u| ≤ 1. Only γ = 60 covers x(0); its low gain makes the return slow and the cost four times \
         that of the LQR.",
        states,
        "u / (m/s²)",
        25.0,
        &[
            curve("LQR", lqr_flight, Style::solid(1)),
            curve("SLQR, γ = 1", &low_flights[0], dashed(0)),
            curve("SLQR, γ = 30", &low_flights[1], Style::with(2, Dash::Chain)),
            curve("SLQR, γ = 60", &low_flights[2], Style::with(3, Dash::Dotted)),
        ],
    ));

    let quick = fly(&high[0].k, 1.0, low_start, 60.0)?;
    figures.push(Figure {
        number: "5.8",
        title: "Trajectories and ellipsoids of the LQR, the SLQR and the high-gain SLQR".into(),
        caption: format!(
            "σ = 1, γ = 1. The unsaturated strip of the high gain K_s = [{:.1}, {:.1}] is so narrow that it looks like a line; \
             yet its ellipsoid, that of the SLQR, is invariant: outside the strip the input saturates and the trajectory still \
             stays inside.",
            high[0].k[(0, 0)],
            high[0].k[(0, 1)]
        ),
        columns: 1,
        aspect: 0.55,
        panels: vec![
            plane("", [2.6, 1.6])
                .line(strip(&low[0].k, 1.0, REACH), fill(0))
                .line(strip(&high[0].k, 1.0, REACH), Style::with(2, Dash::Chain))
                .line(ellipse(&lqr.p, 1.0), Style::solid(1))
                .line(ellipse(&low[0].p, 1.0), Style::solid(0))
                .line(path(&staying), dashed(0))
                .line(path(&quick), dashed(2)),
        ],
        legend: vec![
            ("ellipsoid, LQR".into(), Style::solid(1)),
            ("ellipsoid, SLQR and high gain".into(), Style::solid(0)),
            ("trajectory, SLQR".into(), dashed(0)),
            ("trajectory, high gain".into(), dashed(2)),
            ("unsaturated, SLQR".into(), fill(0)),
            ("unsaturated, high gain".into(), Style::with(2, Dash::Chain)),
        ],
    });
    figures.push(responses(
        "5.9",
        "Responses, inputs and costs of the LQR, the SLQR and the high-gain SLQR",
        "From x(0) = [0, 2] with |u| ≤ 1, γ = 60. The high gain has the bound of the SLQR and nearly the cost of the LQR, \
         which has no bound at all.",
        states,
        "u / (m/s²)",
        12.0,
        &[
            curve("LQR", lqr_flight, Style::solid(1)),
            curve("SLQR, γ = 60", &low_flights[2], dashed(0)),
            curve("high-gain SLQR, γ = 60", &high_flights[2], Style::with(2, Dash::Chain)),
        ],
    ));
    Ok(figures)
}
