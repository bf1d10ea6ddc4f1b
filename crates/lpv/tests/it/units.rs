//! A design does not depend on the units that its plant is stated in: x = x̂/a, u = û/b, t = t̂/s and costs q times as large state the same problem,
//! whose answer has K̂ = bK/a. By powers of two to the last bit, by other factors to 10⁻⁹.

use crate::numbers::Numbers;
use crate::quadrotor;
use lpv::math::Mat;
use lpv::math::matrix::diagonal;
use lpv::model::Polytope;
use lpv::synthesis::polytopic::{
    BackOff, HighGain, InputBounds, Lyapunov, Objective, PolytopicDesign, PolytopicRequest, rate_box_vertices,
    synthesize,
};
use lpv::synthesis::{CostWeights, DesignRequest, HighGainOptions, Method, RateBoundedOptions, ScheduleKind, design};

/// a, b, s and q.
#[derive(Clone, Copy, Debug)]
struct Change {
    state: f64,
    input: f64,
    time: f64,
    cost: f64,
}

const NONE: Change = Change { state: 1.0, input: 1.0, time: 1.0, cost: 1.0 };

impl Change {
    fn each(factor: f64) -> [Self; 5] {
        [
            Change { state: factor, ..NONE },
            Change { input: factor, ..NONE },
            Change { time: factor, ..NONE },
            Change { cost: factor, ..NONE },
            Change { state: factor, input: 1.0 / factor, time: factor, cost: factor },
        ]
    }

    fn polytope(&self, of: &Polytope) -> Polytope {
        let per_time = 1.0 / self.time;
        let a = (0..of.len()).map(|i| times(of.a(i), per_time)).collect();
        let b = (0..of.len()).map(|i| times(of.b(i), per_time * self.state / self.input)).collect();
        Polytope::new(a, b).unwrap()
    }

    fn request(&self, of: &PolytopicRequest) -> PolytopicRequest {
        let mut request = of.clone();
        if let Some(CostWeights { q, r }) = &mut request.weights {
            *q = times(q, self.cost / self.state / self.state);
            *r = times(r, self.cost / self.input / self.input);
        }
        if let Some(InputBounds { sigma, gamma }) = &mut request.saturation {
            sigma.iter_mut().for_each(|sigma| *sigma *= self.input);
            *gamma *= self.cost * self.time;
        }
        if let Some(time) = request.high_gain.as_mut().and_then(|high_gain| high_gain.sample_time_s.as_mut()) {
            *time *= self.time;
        }
        if let Lyapunov::ParameterDependent { rate_vertices } = &mut request.lyapunov {
            rate_vertices.iter_mut().flatten().for_each(|rate| *rate /= self.time);
        }
        if let Objective::States { states, .. } = &mut request.objective {
            states.iter_mut().flatten().for_each(|x| *x *= self.state);
        }
        request
    }

    /// K as it would be without the change.
    fn undone(&self, design: &PolytopicDesign) -> Vec<Mat<f64>> {
        let solution = design.solution.as_ref().unwrap();
        solution.gain.iter().map(|k| times(k, self.state / self.input)).collect()
    }
}

fn times(matrix: &Mat<f64>, factor: f64) -> Mat<f64> {
    Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| factor * matrix[(i, j)])
}

/// Of the largest entry, how much of it `other` differs by at most.
fn difference(one: &[Mat<f64>], other: &[Mat<f64>]) -> f64 {
    let largest = one.iter().map(Mat::norm_max).fold(0.0, f64::max);
    one.iter().zip(other).map(|(one, other)| (one - other).norm_max()).fold(0.0, f64::max) / largest
}

/// Random plants that can be stabilised: A of size 1, an input for about each state.
fn plant(numbers: &mut Numbers, (n, m, vertices): (usize, usize, usize)) -> Polytope {
    let middle = numbers.matrix(n, n);
    let near = |numbers: &mut Numbers| &middle + times(&numbers.matrix(n, n), 0.2);
    let a = (0..vertices).map(|_| near(numbers)).collect();
    let b = numbers.matrix(n, m);
    Polytope::new(a, vec![b]).unwrap()
}

fn requests(n: usize, m: usize, vertices: usize) -> Vec<(&'static str, PolytopicRequest)> {
    let ones = |count: usize| vec![1.0; count];
    let regulate = PolytopicRequest {
        weights: Some(CostWeights { q: diagonal(&ones(n)), r: diagonal(&ones(m)) }),
        lyapunov: Lyapunov::Common,
        saturation: None,
        high_gain: None,
        objective: Objective::Trace,
        back_off: BackOff::Knee,
    };
    let states = Objective::States { states: vec![ones(n)], parameter: None };
    let bounds = InputBounds { sigma: ones(m), gamma: 0.3 };
    let moving = Lyapunov::ParameterDependent { rate_vertices: rate_box_vertices(vertices, 0.2) };
    let limited = PolytopicRequest { saturation: Some(bounds), ..regulate.clone() };
    let high_gain = HighGain { options: HighGainOptions::default(), sample_time_s: Some(1e-3) };
    vec![
        ("stabilize", PolytopicRequest { weights: None, ..regulate.clone() }),
        ("lpvqr", regulate.clone()),
        ("share", PolytopicRequest { back_off: BackOff::Share(0.05), ..regulate.clone() }),
        ("states", PolytopicRequest { objective: states, ..limited.clone() }),
        ("moving", PolytopicRequest { lyapunov: moving, ..regulate }),
        ("high gain", PolytopicRequest { high_gain: Some(high_gain), ..limited.clone() }),
        ("slpvqr", limited),
    ]
}

#[test]
fn units_do_not_matter() {
    let mut numbers = Numbers(20);
    let (mut solved, mut asked) = (0, 0);
    for sizes @ (n, m, vertices) in [(1, 1, 1), (2, 1, 2), (3, 2, 3), (4, 3, 2), (5, 3, 1)] {
        let polytope = plant(&mut numbers, sizes);
        for (what, request) in requests(n, m, vertices) {
            asked += 1;
            let design = synthesize(&polytope, &request).unwrap();
            if !design.is_solved() {
                continue;
            }
            solved += 1;
            let expected = NONE.undone(&design);
            let changed = |change: Change| {
                let changed = synthesize(&change.polytope(&polytope), &change.request(&request)).unwrap();
                assert!(changed.is_solved(), "{what} {sizes:?} {change:?}: {:?}", changed.answer.outcome);
                change.undone(&changed)
            };
            for change in [2f64.powi(20), 2f64.powi(-20)].into_iter().flat_map(Change::each) {
                assert_eq!(changed(change), expected, "{what} {sizes:?} {change:?}");
            }
            for change in [1e6, 1e-6].into_iter().flat_map(Change::each) {
                let difference = difference(&expected, &changed(change));
                assert!(difference < 1e-9, "{what} {sizes:?} {change:?}: {difference:e}");
            }
            let weights = [1e15, 1e-15].map(|cost| Change { cost, ..NONE });
            for change in weights.into_iter().filter(|_| request.weights.is_some()) {
                let difference = difference(&expected, &changed(change));
                assert!(difference < 1e-9, "{what} {sizes:?} {change:?}: {difference:e}");
            }
        }
    }
    assert!(solved == asked, "{solved} of {asked}");
}

/// What is returned is proved as it is stated, not in the units that it was found in.
#[test]
fn what_is_proved_is_proved_as_stated() {
    let mut numbers = Numbers(21);
    let (n, m, vertices) = (3, 2, 2);
    let polytope = plant(&mut numbers, (n, m, vertices));
    let change = Change { state: 3e5, input: 7e-4, time: 1.7e4, cost: 1.3e7 };
    for (what, request) in requests(n, m, vertices) {
        let (polytope, request) = (change.polytope(&polytope), change.request(&request));
        let design = synthesize(&polytope, &request).unwrap();
        let solution = design.solution.as_ref().filter(|_| design.is_solved()).unwrap();
        // Y and L of the answer are those of the solution, to the rounding of a unit
        let blocks = &design.answer.blocks;
        assert!(blocks.iter().all(|block| block.verified_lower_bound >= block.margin), "{what}");
        for (i, (y, l)) in solution.y.iter().zip(&solution.l).enumerate() {
            let flow = polytope.a(i) * y - polytope.b(i) * l;
            let decrease = &flow + flow.transpose();
            assert!((0..n).all(|k| decrease[(k, k)] < 0.0) || what == "moving", "{what}");
        }
        let traces = solution.y.iter().map(|y| (0..n).map(|k| y[(k, k)]).sum::<f64>());
        if matches!(request.objective, Objective::Trace) && request.weights.is_some() {
            let trace: f64 = match request.lyapunov {
                Lyapunov::Common => traces.take(1).sum(),
                Lyapunov::ParameterDependent { .. } => traces.sum(),
            };
            let objective = design.answer.objective;
            assert!((objective - trace).abs() <= 1e-12 * trace, "{what}: {objective} {trace}");
            assert!(design.moderation.is_none_or(|moderation| {
                let least = (1.0 - moderation.back_off) * moderation.optimum;
                objective >= least * (1.0 - 2e-7) && objective <= moderation.optimum * (1.0 + 1e-6)
            }));
        }
    }
}

/// The gains of the thesis's quadrotor do not depend on the size of its weights, for a yaw at rest and for one that turns.
#[test]
fn weights_of_a_grid_have_no_size() {
    let designed = |cost: f64, high_gain: bool, rate_bounded: Option<RateBoundedOptions>| {
        let CostWeights { q, r } = quadrotor::weights();
        let gamma = 20.0 * cost;
        let request = DesignRequest {
            name: "one".into(),
            method: match high_gain {
                true => Method::HighGainSlpvqr { gamma, high_gain: HighGainOptions::default() },
                false => Method::Slpvqr { gamma },
            },
            weights: CostWeights { q: times(&q, cost), r: times(&r, cost) },
            grid_points: 4,
            schedule: ScheduleKind::Grid,
            limits: quadrotor::limits(),
            sample_time_s: 0.002,
            rate_bounded,
        };
        let design = design(&quadrotor::spec(9.807), &*quadrotor::plant(), &request, &|_| {}).unwrap();
        design.points.iter().map(|point| point.gain.clone()).collect::<Vec<_>>()
    };
    let moving = RateBoundedOptions { rate: 2.0, order: 1, direction: None };
    for (high_gain, rate_bounded) in [(false, None), (true, None), (false, Some(moving))] {
        let expected = designed(1.0, high_gain, rate_bounded.clone());
        for cost in [1e6, 1e-15] {
            let difference = difference(&expected, &designed(cost, high_gain, rate_bounded.clone()));
            assert!(difference < 1e-9, "{high_gain} {rate_bounded:?} {cost:e}: {difference:e}");
        }
    }
}

/// Weights that are definite by less than the 32 bits that the solver's numbers are rounded to, and a Q of rank one.
#[test]
fn weights_stay_definite() {
    let near = |size: usize, by: f64| Mat::from_fn(size, size, |i, j| if i == j { 1.0 } else { 1.0 - by });
    let mut numbers = Numbers(22);
    let polytope = plant(&mut numbers, (2, 2, 2));
    for (what, request) in requests(2, 2, 2) {
        for (q, r) in [(near(2, 1.0), near(2, 1e-10)), (near(2, 1e-10), near(2, 1.0)), (near(2, 0.0), near(2, 0.5))] {
            let weights = request.weights.as_ref().map(|_| CostWeights { q, r });
            let design = synthesize(&polytope, &PolytopicRequest { weights, ..request.clone() }).unwrap();
            assert!(!design.is_infeasible(), "{what}: {:?}", design.answer.outcome);
            let blocks = &design.answer.blocks;
            let proved = blocks.iter().all(|block| block.verified_lower_bound >= block.margin);
            assert!(proved || !design.is_solved(), "{what}");
        }
    }
    for r in [near(4, 1e-10), near(4, 0.5)] {
        let request = DesignRequest {
            name: "one".into(),
            method: Method::HighGainSlpvqr { gamma: 20.0, high_gain: HighGainOptions::default() },
            weights: CostWeights { r, ..quadrotor::weights() },
            grid_points: 2,
            schedule: ScheduleKind::Grid,
            limits: quadrotor::limits(),
            sample_time_s: 0.002,
            rate_bounded: None,
        };
        // a design or an error, and no end of another kind
        let _ = design(&quadrotor::spec(9.807), &*quadrotor::plant(), &request, &|_| {});
    }
}
