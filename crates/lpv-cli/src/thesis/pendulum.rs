//! Chapter IV: the inverted pendulum (4.37)-(4.38) as an LPV system, under the LPVQR with every kind of Lyapunov function.
//! Table 4.1, Figures 4.1 to 4.5.

use super::comparison::{Entry, Standing, Table};
use super::responses::{Curve, responses};
use crate::failure::Failure;
use crate::figure::{Axis, Dash, Figure, Panel, Style};
use lpv::math::Mat;
use lpv::math::decimal::{Rounding, decimal, fixed_toward};
use lpv::math::matrix::{diagonal, identity, inverse_spd, quadratic_form};
use lpv::math::riccati;
use lpv::model::Polytope;
use lpv::plant::Pendulum;
use lpv::sim::{AdaptiveOptions, ContinuousFlight, fly_continuously, optimal_trajectory};
use lpv::synthesis::CostWeights;
use lpv::synthesis::polytopic::{
    BackOff, Lyapunov, Objective, PolytopicRequest, Solution, rate_box_vertices, synthesize,
};
use std::f64::consts::PI;

/// x(0) of Table 4.1, which the text does not state; ρ(0) = (0, 1) there.
const START: [f64; 2] = [PI, 0.0];
const DURATION_S: f64 = 40.0;
/// Largest |dρ₁/dx₁|, by which |ẋ₁| is multiplied to bound ρ̇; found by [`steepest_slope`].
const SAMPLES: usize = 20_000;

/// ρ₁(x₁) = sin x₁ / x₁
fn rho(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

/// dρ₁/dx₁
fn rho_slope(x: f64) -> f64 {
    if x.abs() < 1e-4 { -x / 3.0 } else { (x * x.cos() - x.sin()) / (x * x) }
}

/// max |dρ₁/dx₁| on [0, π].
fn steepest_slope() -> f64 {
    (0..=SAMPLES).map(|k| rho_slope(PI * k as f64 / SAMPLES as f64).abs()).fold(0.0, f64::max)
}

fn polytope() -> Polytope {
    let a = |corner: f64| Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [corner, -0.1]][i][j]);
    let b = Mat::from_fn(2, 1, |i, _| i as f64);
    Polytope::new(vec![a(1.0), a(0.0)], vec![b]).expect("the vertices have one size")
}

fn weights() -> CostWeights {
    CostWeights { q: diagonal(&[4.0, 4.0]), r: identity(1) }
}

fn design(lyapunov: Lyapunov) -> Result<Solution, Failure> {
    optimized(lyapunov, Objective::Trace)
}

fn optimized(lyapunov: Lyapunov, objective: Objective) -> Result<Solution, Failure> {
    let request = PolytopicRequest {
        weights: Some(weights()),
        lyapunov,
        saturation: None,
        high_gain: None,
        objective,
        back_off: BackOff::Nothing,
    };
    let failed = |source| Failure::Synthesis { controller: "pendulum".into(), source };
    let design = synthesize(&polytope(), &request).map_err(failed)?;
    design.solution.ok_or_else(|| Failure::Defect("no regulator of the pendulum was found".into()))
}

fn bounded_rate(speed: f64) -> Lyapunov {
    Lyapunov::ParameterDependent { rate_vertices: rate_box_vertices(2, steepest_slope() * speed) }
}

/// u = −K(ρ(x₁))x.
fn fly(gain: &dyn Fn(f64) -> [f64; 2]) -> Result<ContinuousFlight, Failure> {
    let law = |x: &[f64], u: &mut [f64]| {
        let k = gain(rho(x[0]));
        u[0] = -(k[0] * x[0] + k[1] * x[1]);
    };
    let CostWeights { q, r } = weights();
    let options = AdaptiveOptions { longest_step_s: 0.1, ..AdaptiveOptions::default() };
    fly_continuously(&Pendulum::default(), (&q, &r), &START, DURATION_S, &law, &options)
        .map_err(|error| Failure::Defect(format!("the pendulum: {error}")))
}

/// K(ρ) = (Σ ρᵢLᵢ)(Σ ρᵢYᵢ)⁻¹.
fn scheduled(solution: &Solution) -> impl Fn(f64) -> [f64; 2] {
    let (y, l) = (solution.y.clone(), solution.l.clone());
    move |rho: f64| {
        let mix =
            |m: &[Mat<f64>]| Mat::from_fn(m[0].nrows(), 2, |i, j| rho * m[0][(i, j)] + (1.0 - rho) * m[1][(i, j)]);
        let k = inverse_spd(&mix(&y)).map(|p| mix(&l) * p);
        k.map_or([f64::NAN; 2], |k| [k[(0, 0)], k[(0, 1)]])
    }
}

/// The frozen regulator at ρ.
fn frozen(rho: f64) -> Result<riccati::Regulator, Failure> {
    let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [rho, -0.1]][i][j]);
    let b = Mat::from_fn(2, 1, |i, _| i as f64);
    let CostWeights { q, r } = weights();
    riccati::solve(&a, &b, &q, &r).map_err(|error| Failure::Defect(format!("the frozen pendulum: {error}")))
}

/// The chapter: its table and its figures.
pub fn chapter() -> Result<(Table, Vec<Figure>), Failure> {
    let common = design(Lyapunov::Common)?;
    // Lᵢ = R⁻¹Bᵀ is optimal for constant B, and the one that Corollary 4.1 leaves when L is eliminated
    let eliminated = Solution { l: vec![Mat::from_fn(1, 2, |_, j| j as f64); 2], ..common.clone() };
    let slow = design(bounded_rate(2.0))?;
    let fast = design(bounded_rate(PI))?;
    let bound =
        |solution: &Solution| solution.lyapunov_matrix(&[0.0, 1.0]).map_or(f64::NAN, |p| quadratic_form(&p, &START));
    let flights = [&common, &eliminated, &fast, &slow].map(|solution| fly(&scheduled(solution)));
    let [common_flight, eliminated_flight, fast_flight, slow_flight] = flights;
    let (common_flight, eliminated_flight) = (common_flight?, eliminated_flight?);
    let (fast_flight, slow_flight) = (fast_flight?, slow_flight?);
    let composite_bound = quadratic_form(&frozen(0.0)?.p, &START);
    let composite_flight = fly(&|rho| frozen(rho).map_or([f64::NAN; 2], |k| [k.k[(0, 0)], k.k[(0, 1)]]))?;
    let CostWeights { q, r } = weights();
    let optimum = optimal_trajectory(&Pendulum::default(), (&q, &r), &START, 9.0)
        .map_err(|error| Failure::Defect(format!("the optimum of the pendulum: {error}")))?;

    let mut entries = Vec::new();
    let mut row = |row: &str, printed: [f64; 2], bound: (f64, Standing, &str), flight: &ContinuousFlight, why: &str| {
        let numbers = [
            ("guaranteed cost", printed[0], bound.0, bound.1, bound.2.to_owned(), 4),
            (
                "actual cost",
                printed[1],
                flight.actual_cost,
                Standing::Integrated,
                format!(
                    "{why} Changes by {} with the tolerance.",
                    decimal(flight.cost_change.max(1e-15), 1, Rounding::Up)
                ),
                4,
            ),
        ];
        for (quantity, printed, value, standing, reason, decimals) in numbers {
            entries.push(Entry {
                row: row.into(),
                quantity,
                printed: Some(printed),
                value: Some(value),
                decimals,
                standing,
                reason,
            });
        }
    };
    row(
        "Theorem 4.3, common Y",
        [77.9747, 58.5117],
        (bound(&common), Standing::BoundNumerical, "A flat optimum: 1e-10 in tr Y moves the fourth digit."),
        &common_flight,
        "Not determined by the theorem: the Lᵢ are not unique. This is one of them.",
    );
    row(
        "Corollary 4.1, common Y",
        [77.9747, 58.2753],
        (bound(&eliminated), Standing::BoundNumerical, "The same Y as Theorem 4.3."),
        &eliminated_flight,
        "With Lᵢ = R⁻¹Bᵀ, which is optimal; the thesis flew another of the possible Lᵢ.",
    );
    row(
        "Theorem 4.4, |ẋ₁| ≤ π",
        [72.3877, 58.0670],
        (
            bound(&fast),
            Standing::BoundNumerical,
            "The thesis's program imposed (4.31) for i = 1 only and lost the factor 2 in (4.32): its number is no bound.",
        ),
        &fast_flight,
        "With the right gains.",
    );
    row(
        "Theorem 4.4, |ẋ₁| ≤ 2",
        [55.7618, 55.6300],
        (
            bound(&slow),
            Standing::BoundNumerical,
            "As above; 55.7618 is below what ρ = (0, 1) at rest already costs, 55.8658.",
        ),
        &slow_flight,
        "The printed cost is below the least of any controller: impossible.",
    );
    row(
        "Theorem 4.5, composite",
        [55.8658, 55.7392],
        (
            composite_bound,
            Standing::NoBound,
            "The frozen Riccati bound at ρ(0). Once ρ moves nothing is guaranteed, and its own controller breaks it.",
        ),
        &composite_flight,
        "More than the \"guarantee\". The printed cost is below the least of any controller: impossible.",
    );
    let least = optimized(Lyapunov::Common, Objective::States { states: vec![START.to_vec()], parameter: None })?;
    entries.push(Entry {
        row: "Theorem 4.3, least bound of x(0)".into(),
        quantity: "guaranteed cost",
        printed: None,
        value: Some(bound(&least)),
        decimals: 3,
        standing: Standing::BoundNumerical,
        reason: "The same inequalities with x(0)ᵀPx(0) minimised: the largest tr Y is not the least bound.".into(),
    });
    entries.push(Entry {
        row: "Piecewise quadratic function [59]".into(),
        quantity: "guaranteed cost",
        printed: Some(58.75),
        value: None,
        decimals: 4,
        standing: Standing::Quoted,
        reason: "Quoted by the thesis from the example's source; no method of the thesis.".into(),
    });
    entries.push(Entry {
        row: "Largest |dρ₁/dx₁|, at x₁ = 2.0816".into(),
        quantity: "ν₀ per rad/s",
        printed: None,
        value: Some(steepest_slope()),
        decimals: 8,
        standing: Standing::Computed,
        reason: "Turns the bound of |ẋ₁| into that of ρ̇.".into(),
    });
    entries.push(Entry {
        row: "Least cost of any controller".into(),
        quantity: "actual cost",
        printed: None,
        value: Some(optimum.cost),
        decimals: 5,
        standing: Standing::Floor,
        reason: format!(
            "Pontryagin's principle on the nonlinear pendulum, by shooting; the trajectory begins {} from x(0).",
            decimal(optimum.residual, 1, Rounding::Up)
        ),
    });
    let table = Table {
        number: "4.1",
        title: "LPVQR of the pendulum with various Lyapunov functions".into(),
        setting: format!(
            "ẋ₁ = x₂, ẋ₂ = −0.1x₂ + sin x₁ + u; Q = diag(4, 4), R = 1; x(0) = [π, 0], ρ(0) = (0, 1) (not stated in the thesis). \
             ν = ±(ν₀, −ν₀) with ν₀ = {} |ẋ₁|. Actual costs: Dormand–Prince 8(5,3), relative tolerance 10⁻¹¹.",
            fixed_toward(steepest_slope(), 8, Rounding::Up)
        ),
        entries,
    };

    let dashed = |color: u8| Style::with(color, Dash::Dashed);
    let grid = |from: f64, to: f64| (0..=400).map(move |k| from + (to - from) * f64::from(k) / 400.0);
    let mut figures = vec![Figure {
        number: "4.1",
        title: "The parameter ρ and its slope".into(),
        caption: format!(
            "Left: ρ₁ = sin x₁ / x₁ and ρ₂ = 1 − ρ₁. Right: dρ₁/dx₁; its largest size on [−π, π], {} at x₁ = 2.0816, bounds ρ̇ by |ẋ₁|.",
            fixed_toward(steepest_slope(), 6, Rounding::Up)
        ),
        columns: 2,
        aspect: 0.7,
        panels: vec![
            Panel::new("", Axis::over("x_1 / rad", -PI, PI), Axis::over("ρ", -0.05, 1.05))
                .line(grid(-PI, PI).map(|x| [x, rho(x)]), Style::solid(0))
                .line(grid(-PI, PI).map(|x| [x, 1.0 - rho(x)]), dashed(1)),
            Panel::new("", Axis::over("x_1 / rad", -PI, PI), Axis::new("dρ_1/dx_1 / (1/rad)"))
                .line(grid(-PI, PI).map(|x| [x, rho_slope(x)]), Style::solid(0)),
        ],
        legend: vec![("ρ_1".into(), Style::solid(0)), ("ρ_2".into(), dashed(1))],
    }];
    let compare = |number, title: &str, caption: &str, a: (&str, &ContinuousFlight), b: (&str, &ContinuousFlight)| {
        let curve = |(label, flight): (&str, _), style| Curve { label: label.to_owned(), flight, style };
        let curves = [curve(a, Style::solid(0)), curve(b, dashed(1))];
        responses(number, title, caption, ["x_1 / rad", "x_2 / (rad/s)"], "u / (rad/s²)", 8.0, &curves)
    };
    figures.push(compare(
        "4.2",
        "Theorem 4.3 and Corollary 4.1",
        "From x(0) = [π, 0]. The two have the same Y; the gains differ where the inequalities leave them open.",
        ("Theorem 4.3", &common_flight),
        ("Corollary 4.1, L = R⁻¹Bᵀ", &eliminated_flight),
    ));
    figures.push(compare(
        "4.3",
        "Theorem 4.4 for two bounds of the rate",
        "From x(0) = [π, 0]. The tighter bound of the rate, which the flight keeps, gives the lower cost.",
        ("|ẋ_1| ≤ 2", &slow_flight),
        ("|ẋ_1| ≤ π", &fast_flight),
    ));
    let speeds: Vec<f64> = (0..=80).map(|k| 0.1 * f64::from(k)).collect();
    let bounds = speeds.iter().map(|&speed| Ok([speed, bound(&design(bounded_rate(speed))?)]));
    let bounds: Vec<[f64; 2]> = bounds.collect::<Result<_, Failure>>()?;
    figures.push(Figure {
        number: "4.4",
        title: "Guaranteed cost of Theorem 4.4 over the bound of the rate".into(),
        caption: "The bound grows with the rate that the parameter is allowed. Over the right inequalities it passes that of the \
                  common Lyapunov function, because the largest Σ tr Yᵢ is not the least bound at x(0)."
            .into(),
        columns: 1,
        aspect: 0.45,
        panels: vec![
            Panel::new("", Axis::over("bound of |ẋ_1| / (rad/s)", 0.0, 8.0), Axis::new("guaranteed cost"))
                .line(bounds, Style::solid(0))
                .line([[0.0, bound(&common)], [8.0, bound(&common)]], dashed(5)),
        ],
        legend: vec![("Theorem 4.4".into(), Style::solid(0)), ("common Y (Theorem 4.3)".into(), dashed(5))],
    });
    figures.push(compare(
        "4.5",
        "Theorem 4.4 and Theorem 4.5",
        "From x(0) = [π, 0]. The frozen design of Theorem 4.5 costs a little less than that of Theorem 4.4, and more than its own \"guarantee\".",
        ("Theorem 4.4, |ẋ_1| ≤ 2", &slow_flight),
        ("Theorem 4.5", &composite_flight),
    ));
    Ok((table, figures))
}
