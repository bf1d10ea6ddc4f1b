//! The cost bound of the loop as it flies: no flight costs more, it is sharp where that can be computed, and what is false is not proved.

use crate::flight;
use lpv::certificate::{
    BoundBasis, BoundOf, SampledCost, StepConditions, UnmetCondition, Verdict, prove_sampled_cost, step_bound,
};
use lpv::controller::{InputLimits, Schedule};
use lpv::math::Mat;
use lpv::math::matrix::{diagonal, from_rows, identity, inverse_spd, quadratic_form};
use lpv::plant::{LinearParameters, Plant, PlantSpec};
use lpv::sim::{Reference, SetPoint};
use lpv::synthesis::{CostWeights, Design, DesignRequest, HighGainOptions, Method, ScheduleKind, design};

const HIGH_GAIN: HighGainOptions = HighGainOptions { recovery: 0.05, gain_margin: 2.0 };

struct Case {
    design: Design,
    plant: Box<dyn Plant>,
}

impl Case {
    fn new(spec: PlantSpec, method: Method, limits: InputLimits, weights: CostWeights, sample_time_s: f64) -> Self {
        let plant = spec.build().unwrap();
        let request = DesignRequest {
            name: "sampled".into(),
            method,
            weights,
            grid_points: 1,
            schedule: ScheduleKind::Grid,
            limits,
            sample_time_s,
            rate_bounded: None,
        };
        let design = design(&spec, &*plant, &request, &|_| ()).unwrap();
        Self { design, plant }
    }

    fn double_integrator(method: Method, sample_time_s: f64) -> Self {
        let limits = InputLimits { min: vec![Some(-1.0)], max: vec![Some(1.5)] };
        let weights = CostWeights { q: identity(2), r: diagonal(&[0.1]) };
        Self::new(PlantSpec::DoubleIntegrator {}, method, limits, weights, sample_time_s)
    }

    fn proved(&self) -> SampledCost {
        prove_sampled_cost(&self.design, &*self.plant).unwrap()
    }

    fn p(&self) -> &Mat<f64> {
        &self.design.points[0].p
    }

    /// The largest cost of flights from the edge of the set (or of size one) against V at their start, and whether an input was limited.
    fn flown(&self, level: Option<f64>, directions: usize, duration_s: f64, steps_per_sample: usize) -> (f64, bool) {
        let n = self.p().nrows();
        let mut numbers = 0.0;
        let (mut most, mut is_limited) = (0.0_f64, false);
        for _ in 0..directions {
            let direction: Vec<f64> = (0..n)
                .map(|_| {
                    numbers += 1.0;
                    f64::sin(numbers * 12.9898)
                })
                .collect();
            let size = (level.unwrap_or(1.0) / quadratic_form(self.p(), &direction)).sqrt() * (1.0 - 1e-12);
            let start: Vec<f64> = direction.iter().map(|x| size * x).collect();
            let targets = (0..n).map(|i| (i, 0.0)).collect();
            let reference = Reference::new(start.clone(), vec![SetPoint { time_s: 0.0, targets }]);
            let value = quadratic_form(self.p(), &start);
            let (flight, performance) = flight::fly(
                &*self.plant,
                &self.design,
                &self.design.weights,
                start,
                reference,
                duration_s,
                steps_per_sample,
            );
            most = most.max(performance.actual_cost.unwrap() / value);
            is_limited |= flight.trajectory.saturated.iter().any(|limited| *limited);
        }
        (most, is_limited)
    }
}

/// From the edge of the set, with the input at its limit, at three sample times.
#[test]
fn no_flight_of_the_double_integrator_costs_more() {
    let high = Method::HighGainSlpvqr { gamma: 2.0, high_gain: HIGH_GAIN };
    for method in [Method::Lpvqr, Method::Slpvqr { gamma: 2.0 }, high] {
        let mut last = 0.0;
        for (sample_time_s, steps) in [(0.001, 1), (0.02, 10), (0.1, 40)] {
            let case = Case::double_integrator(method, sample_time_s);
            let proved = case.proved();
            let factor = proved.factor.unwrap_or_else(|| panic!("{method:?} {sample_time_s}: {:?}", proved.claims));
            let level = proved.level.unwrap();
            assert!(method.gamma().is_none_or(|gamma| level <= gamma), "{level}");
            let (cost, is_limited) = case.flown(Some(level), 24, 15.0, steps);
            assert!(cost <= factor * (1.0 + 1e-9), "{method:?} {sample_time_s}: {cost} {factor}");
            assert!(
                cost > 0.5 * factor,
                "{method:?} {sample_time_s}: {cost} {factor}: a bound that is worth something"
            );
            assert_eq!(is_limited, method == high, "{method:?}");
            assert!(factor > last, "the longer an input is held the more it costs");
            last = factor;
        }
    }
}

/// ẋ = ax + bu, u = −kx: x₊ = αx, and the cost of a period by hand. κ is that cost over p(1 − α²), no more than its last printed digit.
#[test]
fn one_state_is_sharp() {
    for (a, t) in [(-0.5, 0.3), (1e-9, 0.1), (2.0, 0.05), (-3.0, 1e-4)] {
        let spec = PlantSpec::Linear(LinearParameters { a: vec![vec![a]], b: vec![vec![2.0]], c: None });
        let weights = CostWeights { q: diagonal(&[3.0]), r: diagonal(&[0.25]) };
        let case = Case::new(spec, Method::Lpvqr, InputLimits::none(1), weights, t);
        let (k, p) = (case.design.points[0].gain[(0, 0)], case.p()[(0, 0)]);
        let input = 2.0 * k / a;
        // x(τ) = (1 − c)e^{aτ} + c with c = bk/a, and the integrals of its square
        let [once, twice] = [(a * t).exp_m1() / a, (2.0 * a * t).exp_m1() / (2.0 * a)];
        let growth = (1.0 - input) * (a * t).exp_m1();
        let alpha = 1.0 + growth;
        let square = match a.abs() < 1e-6 {
            // x = 1 − bkτ
            true => t - 2.0 * k * t * t + (2.0 * k * t).powi(2) * t / 3.0,
            false => (1.0 - input).powi(2) * twice + 2.0 * input * (1.0 - input) * once + input * input * t,
        };
        let alpha = if a.abs() < 1e-6 { 1.0 - 2.0 * k * t } else { alpha };
        let exact = (3.0 * square + 0.25 * k * k * t) / (p * (1.0 - alpha * alpha));
        let proved = case.proved();
        assert_eq!(proved.level, None);
        let factor = proved.factor.unwrap();
        let tolerance = if a.abs() < 1e-6 { 1e-5 } else { 1e-6 };
        assert!(
            (factor / exact - 1.0).abs() < tolerance && factor > exact * (1.0 - 1e-10),
            "{a} {t}: {factor} {exact}"
        );
    }
}

/// The same design in coordinates that differ by twelve orders of magnitude has the same κ.
#[test]
fn coordinates_do_not_matter() {
    let a = [[0.0, 1.0, 0.0], [0.0, -0.5, 1.0], [1.0, 0.0, -2.0]];
    let b = [[0.0], [1.0], [0.5]];
    let spec = |x: &[f64], u: f64| {
        let scaled = |row: &[f64], i: usize, per: &[f64]| row.iter().zip(per).map(|(e, per)| e * x[i] / per).collect();
        PlantSpec::Linear(LinearParameters {
            a: (0..3).map(|i| scaled(&a[i], i, x)).collect(),
            b: (0..3).map(|i| scaled(&b[i], i, &[u])).collect(),
            c: None,
        })
    };
    let limits = |u: f64| InputLimits { min: vec![Some(-u)], max: vec![Some(u)] };
    let weights = CostWeights { q: identity(3), r: identity(1) };
    let high = Method::HighGainSlpvqr { gamma: 5.0, high_gain: HIGH_GAIN };
    let case = Case::new(spec(&[1.0; 3], 1.0), high, limits(1.0), weights, 0.02);
    let factor = case.proved().factor.unwrap();
    for (x, u) in [([1e6, 1.0, 1e-6], 1e4), ([3e-5, 7e3, 1e-2], 1e-3)] {
        let mut design = case.design.clone();
        let form = |m: &Mat<f64>| Mat::from_fn(3, 3, |i, j| m[(i, j)] / (x[i] * x[j]));
        let gain = |m: &Mat<f64>| Mat::from_fn(1, 3, |_, j| m[(0, j)] * u / x[j]);
        design.weights = CostWeights { q: form(&design.weights.q), r: diagonal(&[1.0 / (u * u)]) };
        let point = &mut design.points[0];
        (point.p, point.gain) = (form(&point.p), gain(&point.gain));
        point.auxiliary_gain = point.auxiliary_gain.as_ref().map(gain);
        design.controller.schedule = Schedule::Constant { gain: gain(&design.controller.schedule.gain_matrix(0.0)) };
        design.controller.limits = limits(u);
        let spec = spec(&x, u);
        let scaled = Case { plant: spec.build().unwrap(), design: Design { plant: spec, ..design } };
        let proved = scaled.proved();
        let again = proved.factor.unwrap_or_else(|| panic!("{:?}", proved.claims));
        assert!((again / factor - 1.0).abs() < 1e-5, "{again} {factor}");
    }
}

/// Two inputs that are limited, one beside an unlimited one, a weight that couples them, and a state more.
#[test]
fn several_inputs_of_which_some_are_limited() {
    let spec = || {
        PlantSpec::Linear(LinearParameters {
            a: vec![vec![0.0, 1.0, 0.0], vec![0.3, 0.0, 0.2], vec![0.0, -0.4, 0.1]],
            b: vec![vec![0.0, 0.1], vec![1.0, 0.3], vec![0.2, 1.0]],
            c: None,
        })
    };
    let weights = CostWeights { q: identity(3), r: from_rows(&[vec![0.2, 0.05], vec![0.05, 0.1]]) };
    let high = Method::HighGainSlpvqr { gamma: 3.0, high_gain: HIGH_GAIN };
    // the saturated methods ask for limits of every input
    for (method, limits) in [
        (high, InputLimits { min: vec![Some(-1.0), Some(-2.0)], max: vec![Some(2.0), Some(1.0)] }),
        (Method::Lpvqr, InputLimits { min: vec![Some(-1.0), None], max: vec![Some(1.0), None] }),
    ] {
        // one input at its limit and the other at a high gain: not every sample time is short enough for that
        let of = |sample_time_s: f64| {
            let case = Case::new(spec(), method, limits.clone(), weights.clone(), sample_time_s);
            let proved = case.proved();
            proved.factor.map(|factor| (case, factor, proved.level))
        };
        let (case, factor, level) = [0.02, 0.005, 0.001, 0.0002].into_iter().find_map(of).expect("a sample time does");
        let (cost, _) = case.flown(level, 6, 8.0, 4);
        assert!(cost <= factor * (1.0 + 1e-9), "{cost} {factor}");
    }
}

/// Half of P has twice the factor; an indefinite P, a gain that is unstable when sampled and a weight that is none have no bound at all.
#[test]
fn what_is_false_is_not_proved() {
    let mut case = Case::double_integrator(Method::Lpvqr, 0.02);
    let factor = case.proved().factor.unwrap();
    let p = case.p().clone();
    case.design.points[0].p = 0.5 * &p;
    let twice = case.proved().factor.unwrap();
    assert!((twice / factor - 2.0).abs() < 1e-6 && twice >= 2.0 * factor * (1.0 - 1e-12), "{twice} {factor}");

    let none = |case: &Case, what: &str| {
        let proved = case.proved();
        assert_eq!(proved.factor, None, "{what}");
        let claim = proved.claims.iter().find(|claim| claim.id.name == "sampled-cost").unwrap();
        assert_eq!(claim.verdict, Verdict::Undecided, "{what}: {claim:?}");
    };
    case.design.points[0].p = diagonal(&[1.0, -1.0]);
    none(&case, "an indefinite P");
    case.design.points[0].p = p.clone();
    case.design.weights.q = diagonal(&[1.0, -1.0]);
    none(&case, "a weight that is no cost");
    case.design.weights.q = identity(2);
    case.design.controller.schedule = Schedule::Constant { gain: from_rows(&[vec![0.0, 0.0]]) };
    none(&case, "no feedback");
    let mut case = Case::double_integrator(Method::Lpvqr, 0.02);
    for sample_time_s in [2.0, 1e6, 0.0, f64::NAN] {
        case.design.sample_time_s = sample_time_s;
        none(&case, "held for too long, or not at all");
    }
}

/// One input gives ±1, whatever the other may: a gain that saturates at once is bounded on its set only.
#[test]
fn a_limit_that_is_reached_takes_the_bound_away() {
    let case = Case::double_integrator(Method::Lpvqr, 0.02);
    let proved = case.proved();
    let basis = BoundBasis::of_flight(&case.design, &proved).unwrap();
    assert_eq!((basis.of, basis.level), (BoundOf::Plant, proved.level));
    let y = inverse_spd(case.p()).unwrap();
    let edge = (proved.level.unwrap() * y[(0, 0)]).sqrt();
    let at = |x: f64, reference: &[f64]| {
        let state = [x, 0.0];
        let conditions = StepConditions {
            state: &state,
            reference,
            parameter_range: [0.0; 2],
            peak_parameter_rate: 0.0,
            noise: false,
        };
        step_bound(&case.design, &*case.plant, &[basis], &conditions)
    };
    let inside = at(0.5 * edge, &[0.0, 0.0]);
    assert!(inside.is_guaranteed() && inside.unmet.is_empty() && inside.share.unwrap() <= 1.0, "{inside:?}");
    let exact = basis.factor * inside.value;
    assert!(inside.bound >= exact && inside.bound <= exact * (1.0 + 1e-12), "{inside:?}");
    let outside = at(3.0 * edge, &[0.0, 0.0]);
    let [UnmetCondition::Outside { share, .. }] = outside.unmet[..] else { panic!("{outside:?}") };
    assert!(outside.verdict == Verdict::Undecided && share > 1.0 && Some(share) == outside.share);
    // a reference that moves, and one that is 1e-300 from rest
    assert!(matches!(at(0.1, &[0.0, 0.5]).unmet[..], [UnmetCondition::ReferenceMoves { state: 0, .. }, ..]));
    assert!(!at(0.1, &[0.0, 1e-300]).is_guaranteed());
    assert!(at(1e3, &[1e3, 0.0]).unmet.is_empty(), "any position is one of rest");
    assert!(!at(f64::NAN, &[0.0, 0.0]).is_guaranteed() && !at(0.1, &[f64::NAN, 0.0]).is_guaranteed());
}

/// A reference that rests but for the rounding of its file is not one that rests.
#[test]
fn rest_of_a_linear_plant_is_exact() {
    let spec = PlantSpec::Linear(LinearParameters {
        a: vec![vec![-0.3, 0.1], vec![0.6, -0.2]],
        b: vec![vec![1.0], vec![0.0]],
        c: None,
    });
    let weights = CostWeights { q: identity(2), r: identity(1) };
    let case = Case::new(spec, Method::Lpvqr, InputLimits::none(1), weights, 0.01);
    let proved = case.proved();
    let basis = BoundBasis::of_flight(&case.design, &proved).unwrap();
    let verdict = |reference: &[f64]| {
        let conditions = StepConditions {
            state: &[0.0, 0.0],
            reference,
            parameter_range: [0.0; 2],
            peak_parameter_rate: 0.0,
            noise: false,
        };
        step_bound(&case.design, &*case.plant, &[basis], &conditions).verdict
    };
    // −0.3 + 3·0.1 is not zero in doubles, which are not thirds of each other
    assert_eq!(verdict(&[1.0, 3.0]), Verdict::Numerical);
    assert_eq!(verdict(&[0.1, 0.0]), Verdict::Undecided);
}

/// 64 states.
#[test]
fn many_states() {
    let n = 64;
    let entry = |i: usize, j: usize| match j as i64 - i as i64 {
        0 => -0.2,
        1 => 1.0,
        -1 => -0.7,
        _ => 0.0,
    };
    let a: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
    let b: Vec<Vec<f64>> = (0..n).map(|i| vec![if i == n - 1 { 1.0 } else { 0.0 }]).collect();
    let spec = PlantSpec::Linear(LinearParameters { a, b, c: None });
    let weights = CostWeights { q: identity(n), r: identity(1) };
    let limits = InputLimits { min: vec![Some(-1.0)], max: vec![Some(1.0)] };
    let mut case = Case::new(spec, Method::Lpvqr, limits, weights, 0.01);
    let proved = case.proved();
    let factor = proved.factor.unwrap_or_else(|| panic!("{:?}", proved.claims));
    assert!((1.0..1.1).contains(&factor), "{factor}");
    let (cost, _) = case.flown(proved.level, 1, 30.0, 4);
    assert!(cost <= factor, "{cost} {factor}");
    case.design.sample_time_s = 1e9;
    assert_eq!(case.proved().factor, None);
}
