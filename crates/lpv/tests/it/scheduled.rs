//! Designs over the vertices of tensor-product models, proved for the LPV model itself; and attacks on that.

use lpv::certificate::{
    Claim, ClaimKind, MOST_CELLS, Of, PolytopicClaim, PolytopicLyapunov, ScheduledClaim, Verdict, prove_polytopic,
    prove_scheduled,
};
use lpv::math::Mat;
use lpv::math::eigen::{smallest_eigenvalue, symmetric_eigenvectors};
use lpv::math::matrix::{diagonal, identity, inverse_spd, quadratic_form, symmetric_part};
use lpv::model::literature::{LiteratureModel, ToraParameters};
use lpv::model::tensor_product::{
    ParameterGrid, RankRule, TensorProductModel, TensorProductOptions, TensorProductSchedule, Weighting,
};
use lpv::model::{ModelSource, Polytope};
use lpv::synthesis::CostWeights;
use lpv::synthesis::polytopic::{BackOff, HighGain, InputBounds, Lyapunov, Objective, PolytopicRequest, synthesize};

/// A design with all that is claimed of it.
struct Case {
    source: Option<ModelSource>,
    schedule: TensorProductSchedule,
    claim: PolytopicClaim,
}

/// What is asked for of a literature model.
struct Asked {
    model: LiteratureModel,
    ranges: [[f64; 2]; 2],
    points: [usize; 2],
    ranks: [usize; 2],
    r: f64,
    saturation: Option<InputBounds>,
    high_gain: bool,
}

fn tora() -> Asked {
    let limit = std::f64::consts::FRAC_PI_4;
    Asked {
        model: LiteratureModel::Tora(ToraParameters::default()),
        ranges: [[-limit, limit], [-0.5, 0.5]],
        points: [13, 3],
        ranks: [5, 2],
        r: 1.0,
        saturation: None,
        high_gain: false,
    }
}

impl Asked {
    fn design(&self) -> Case {
        let parameters = self.model.parameters();
        let grids: Vec<ParameterGrid> = (parameters.iter().zip(self.ranges).zip(self.points))
            .map(|((p, range), points)| ParameterGrid::equidistant(p.name, p.unit, range, points))
            .collect();
        let options = TensorProductOptions {
            ranks: self.ranks.map(RankRule::Count).to_vec(),
            weightings: vec![Weighting::Cno],
            ..TensorProductOptions::default()
        };
        let model = TensorProductModel::of(&|rho| self.model.at(rho), &grids, &options).unwrap();
        let n = model.size[0];
        let part = |from: usize, to: usize| {
            let of = |v: &Mat<f64>| Mat::from_fn(n, to - from, |i, j| v[(i, from + j)]);
            model.vertices().iter().map(of).collect::<Vec<_>>()
        };
        let polytope = Polytope::new(part(0, n), part(n, model.size[1])).unwrap();
        let weights = CostWeights { q: identity(n), r: diagonal(&[self.r]) };
        let request = PolytopicRequest {
            weights: Some(weights.clone()),
            lyapunov: Lyapunov::Common,
            saturation: self.saturation.clone(),
            high_gain: self
                .high_gain
                .then_some(HighGain { options: lpv::synthesis::HighGainOptions::default(), sample_time_s: Some(0.01) }),
            objective: Objective::Trace,
            back_off: BackOff::Share(0.05),
        };
        let solution = synthesize(&polytope, &request).unwrap().solution.unwrap();
        let lyapunov = PolytopicLyapunov::Common { p: symmetric_part(&solution.p[0]), gain: solution.gain };
        let claim = PolytopicClaim {
            polytope,
            lyapunov,
            auxiliary_gain: solution.auxiliary_gain.filter(|_| self.high_gain),
            weights: Some(weights),
            saturation: self.saturation.clone(),
        };
        Case { source: Some(ModelSource::Literature(self.model)), schedule: model.schedule(), claim }
    }
}

impl Case {
    fn prove(&self) -> Vec<Claim> {
        self.prove_with(MOST_CELLS)
    }

    fn prove_with(&self, most_cells: usize) -> Vec<Claim> {
        let claim = ScheduledClaim {
            polytopic: &self.claim,
            schedule: &self.schedule,
            source: self.source.as_ref(),
            most_cells,
        };
        prove_scheduled(&claim, prove_polytopic(&self.claim))
    }

    fn p(&self) -> &Mat<f64> {
        let PolytopicLyapunov::Common { p, .. } = &self.claim.lyapunov else { unreachable!() };
        p
    }

    fn gains(&mut self) -> &mut Vec<Mat<f64>> {
        let PolytopicLyapunov::Common { gain, .. } = &mut self.claim.lyapunov else { unreachable!() };
        gain
    }

    /// A, B and K at ρ, in floating point.
    fn at(&self, rho: &[f64]) -> [Mat<f64>; 3] {
        let model = self.source.as_ref().unwrap().build().unwrap().at(rho);
        let n = model.nrows();
        let PolytopicLyapunov::Common { gain, .. } = &self.claim.lyapunov else { unreachable!() };
        [
            Mat::from_fn(n, n, |i, j| model[(i, j)]),
            Mat::from_fn(n, model.ncols() - n, |i, j| model[(i, n + j)]),
            self.schedule.combine(gain, rho),
        ]
    }

    /// Least eigenvalue of κ(−P(A − BK) − ·ᵀ) − c(Q + KᵀRK) over a fine grid of the box, its edges and corners among it.
    fn sampled(&self, [factor, cost]: [f64; 2], per_axis: usize) -> f64 {
        let ends: Vec<[f64; 2]> = (self.schedule.parameters.iter())
            .map(|p| [p.grid.points[0], p.grid.points[p.grid.points.len() - 1]])
            .collect();
        let value = |k: usize, [low, high]: [f64; 2]| low + (high - low) * k as f64 / (per_axis - 1) as f64;
        let weights = self.claim.weights.as_ref().unwrap();
        let each = (0..per_axis * per_axis).map(|at| {
            let rho = [value(at % per_axis, ends[0]), value(at / per_axis, ends[1])];
            let [a, b, k] = self.at(&rho);
            let flow = self.p() * (&b * &k - &a);
            let stage = k.transpose() * &weights.r * &k + &weights.q;
            smallest_eigenvalue(&symmetric_part(&(factor * (&flow + flow.transpose()) - cost * stage)))
        });
        each.fold(f64::INFINITY, f64::min)
    }
}

fn verdict(claims: &[Claim], id: &str) -> Verdict {
    claims.iter().find(|claim| claim.id.to_string() == id).unwrap_or_else(|| panic!("no {id}")).verdict
}

fn level(claims: &[Claim], id: &str) -> f64 {
    match claims.iter().find(|claim| claim.id.to_string() == id).unwrap().kind {
        ClaimKind::Invariance { level, .. } | ClaimKind::StatesInRange { level, .. } => level,
        ref other => panic!("{other:?}"),
    }
}

fn factor(claims: &[Claim]) -> f64 {
    match claims.iter().find(|claim| claim.id.to_string() == "cost").unwrap().kind {
        ClaimKind::Cost { factor, .. } => factor,
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn tora_is_proved_for_the_model_and_for_the_plant() {
    let case = tora().design();
    let claims = case.prove();
    for claim in &claims {
        assert_eq!(claim.verdict, Verdict::Proved, "{}: {}", claim.claim, claim.detail);
    }
    let ids: Vec<String> = claims.iter().map(|claim| claim.id.to_string()).collect();
    for id in [
        "polytope.decrease",
        "polytope.cost",
        "transformation-error",
        "decrease",
        "cost",
        "states-in-range",
        "plant.invariance",
        "plant.cost",
    ] {
        assert!(ids.iter().any(|other| other == id), "{id} is missing in {ids:?}");
    }
    assert!(claims.iter().filter(|c| c.of == Of::Polytope).all(|c| c.claim.starts_with("the polytope: ")));
    let of_model = claims.iter().find(|claim| claim.id.to_string() == "decrease").unwrap();
    assert!(of_model.claim.contains("theta in [") && of_model.claim.contains("theta_dot in ["), "{}", of_model.claim);
    // what is proved holds where it is looked at
    assert!(case.sampled([1.0, 0.0], 61) > 0.0 && case.sampled([factor(&claims), 1.0], 61) > 0.0);
}

/// The proved bound of the transformation's error is above all that is found, and not far above.
#[test]
fn the_transformations_error_is_bounded() {
    for ranks in [[5, 2], [2, 2]] {
        let case = Asked { ranks, ..tora() }.design();
        let claims = case.prove_with(1);
        let ClaimKind::TransformationError { a, b } =
            claims.iter().find(|claim| claim.id.name == "transformation-error").unwrap().kind
        else {
            unreachable!()
        };
        let polytope = &case.claim.polytope;
        let vertices = |of: &dyn Fn(usize) -> Mat<f64>| (0..polytope.len()).map(of).collect::<Vec<_>>();
        let [all_a, all_b] = [vertices(&|v| polytope.a(v).clone()), vertices(&|v| polytope.b(v).clone())];
        let (mut largest, limit) = ([0.0_f64; 2], std::f64::consts::FRAC_PI_4);
        for k in 0..101 * 7 {
            let rho = [-limit + 2.0 * limit * (k % 101) as f64 / 100.0, -0.5 + (k / 101) as f64 / 6.0];
            let [model_a, model_b, _] = case.at(&rho);
            let errors = [case.schedule.combine(&all_a, &rho) - model_a, case.schedule.combine(&all_b, &rho) - model_b];
            largest = [0, 1].map(|k| largest[k].max(errors[k].norm_l2()));
        }
        for (bound, found) in [a, b].into_iter().zip(largest) {
            assert!(found <= bound * (1.0 + 1e-12) && bound < 1.5 * found, "{bound} for {found}");
        }
    }
}

/// Vertices are no premise of what is said of the model: one that is wrong by a lot changes the claims about the polytope alone.
#[test]
fn a_wrong_vertex_changes_nothing_about_the_model() {
    let mut case = tora().design();
    let before = case.prove();
    let polytope = case.claim.polytope.clone();
    let mut a: Vec<Mat<f64>> = (0..polytope.len()).map(|v| polytope.a(v).clone()).collect();
    a[3][(1, 0)] += 3.0;
    let b = (0..polytope.len()).map(|v| polytope.b(v).clone()).collect();
    case.claim.polytope = Polytope::new(a, b).unwrap();
    let after = case.prove();
    assert_ne!(verdict(&after, "polytope.cost"), Verdict::Proved);
    for id in ["decrease", "cost", "plant.invariance"] {
        assert_eq!((verdict(&before, id), verdict(&after, id)), (Verdict::Proved, Verdict::Proved), "{id}");
    }
    // and the error that is stated is that of the vertices as they are
    let error = |claims: &[Claim]| match claims.iter().find(|c| c.id.name == "transformation-error").unwrap().kind {
        ClaimKind::TransformationError { a, .. } => a,
        _ => unreachable!(),
    };
    assert!(error(&after) > 100.0 * error(&before));
}

/// Gains of two vertices exchanged, for every pair, and turned around: whatever is proved holds at every point that is looked at.
#[test]
fn exchanged_and_reversed_gains_are_not_proved_where_they_are_false() {
    let (mut refused, mut proved) = (0, 0);
    for pair in [0, 3, 5, 8] {
        let mut case = tora().design();
        case.gains().swap(pair, 9);
        case.gains()[pair] = 4.0 * case.gains()[pair].clone();
        let claims = case.prove_with(6_000);
        if verdict(&claims, "decrease") == Verdict::Proved {
            assert!(case.sampled([1.0, 0.0], 81) > 0.0);
            proved += 1;
        }
        if verdict(&claims, "cost") == Verdict::Proved {
            assert!(case.sampled([factor(&claims), 1.0], 81) > 0.0);
        } else {
            assert_ne!(verdict(&claims, "plant.cost"), Verdict::Proved);
            refused += 1;
        }
    }
    assert!(refused > 0, "{refused} refused, {proved} proved");
    let mut case = tora().design();
    case.gains().iter_mut().for_each(|gain| *gain = -1.0 * gain.clone());
    let claims = case.prove_with(6_000);
    for id in ["decrease", "cost", "plant.invariance", "plant.cost"] {
        assert_ne!(verdict(&claims, id), Verdict::Proved, "{id}");
    }
}

/// One singular value of a wide range: the polytope is a poor stand-in for the model. What is proved of it says so, and of the model nothing is.
#[test]
fn a_large_error_leaves_the_model_undecided() {
    let asked = Asked {
        model: LiteratureModel::named("pendulum-cart").unwrap(),
        ranges: [[-1.45, 1.45], [-2.0, 2.0]],
        points: [15, 3],
        ranks: [1, 1],
        r: 0.01,
        saturation: None,
        high_gain: false,
    };
    let case = asked.design();
    let claims = case.prove_with(6_000);
    assert_eq!(verdict(&claims, "polytope.decrease"), Verdict::Proved);
    assert!(case.sampled([1.1, 1.0], 41) < 0.0, "the attack has to be one");
    for id in ["cost", "plant.cost"] {
        let claim = claims.iter().find(|claim| claim.id.to_string() == id).unwrap();
        assert_eq!(claim.verdict, Verdict::Undecided, "{}", claim.claim);
        assert!(!claim.detail.is_empty());
    }
    let open = claims.iter().find(|claim| claim.id.to_string() == "cost").unwrap();
    assert!(open.detail.contains("fails at theta = "), "{}", open.detail);
}

/// The gain of a box is taken to wider ones: where the claim stops being proved, it stops being true close by, at the edge.
#[test]
fn the_edge_of_the_box_counts() {
    let case = tora().design();
    let stretched = |share: f64| {
        let mut parameters = case.schedule.parameters.clone();
        let points = &mut parameters[1].grid.points;
        let last = points.len() - 1;
        (points[0], points[last]) = (-share, share);
        Case { source: case.source.clone(), schedule: TensorProductSchedule { parameters }, claim: case.claim.clone() }
    };
    let is_proved = |half: f64| verdict(&stretched(half).prove_with(40_000), "decrease") == Verdict::Proved;
    let truth = |half: f64| stretched(half).sampled([1.0, 0.0], 41);
    let (mut holds, mut fails) = (0.5, 64.0);
    assert!(is_proved(holds) && truth(fails) < 0.0, "the attack has to be one");
    while fails - holds > 1e-3 * fails {
        let middle = 0.5 * (holds + fails);
        if truth(middle) > 0.0 { holds = middle } else { fails = middle }
    }
    // false in the corners alone
    assert!(!is_proved(fails) && !is_proved(1.02 * fails) && is_proved(0.8 * holds), "holds up to {holds}");
}

/// Where the model is known by samples alone, or V depends on the parameter, only the polytope is spoken of.
#[test]
fn without_the_model_only_the_polytope_is_proved() {
    let mut case = tora().design();
    case.source = None;
    let claims = case.prove();
    assert_eq!(verdict(&claims, "polytope.cost"), Verdict::Proved);
    for id in ["decrease", "cost"] {
        let claim = claims.iter().find(|claim| claim.id.to_string() == id).unwrap();
        assert_eq!(claim.verdict, Verdict::Undecided);
        assert!(claim.detail.contains("samples"), "{}", claim.detail);
    }
    assert!(claims.iter().all(|claim| claim.of != Of::Plant));
}

/// A set that reaches beyond the range of a parameter that is a state says nothing of the plant out there.
#[test]
fn states_stay_in_the_ranges_of_their_parameters() {
    let mut case = tora().design();
    let claims = case.prove();
    let within = level(&claims, "plant.invariance");
    let y = inverse_spd(case.p()).unwrap();
    let limit = std::f64::consts::FRAC_PI_4;
    let widest = (limit * limit / y[(2, 2)]).min(0.25 / y[(3, 3)]);
    assert!(within <= widest && within > 0.99 * widest, "{within} of {widest}");
    // rest outside of a range: nothing is said
    let points = &mut case.schedule.parameters[0].grid.points;
    points.iter_mut().for_each(|point| *point += 1.0);
    let claims = case.prove_with(6_000);
    assert_eq!(verdict(&claims, "states-in-range"), Verdict::Undecided);
    assert!(claims.iter().all(|claim| claim.of != Of::Plant || claim.verdict != Verdict::Proved));
}

/// From the edge of the set that is proved for the nonlinear plant, in the worst directions and others, with and without saturation: V
/// falls, the parameters stay in their ranges, and the cost is below its bound.
#[test]
fn flights_of_the_nonlinear_plant_stay_in_the_proved_set() {
    let bounds = |gamma| Some(InputBounds { sigma: vec![0.5], gamma });
    for (saturation, high_gain) in [(None, false), (bounds(0.4), false), (bounds(0.4), true)] {
        let case = Asked { saturation: saturation.clone(), high_gain, ..tora() }.design();
        let claims = case.prove();
        for claim in &claims {
            assert_eq!(claim.verdict, Verdict::Proved, "{}: {}", claim.claim, claim.detail);
        }
        let (level, factor) = (level(&claims, "plant.invariance"), factor(&claims));
        let (_, axes) = symmetric_eigenvectors(case.p()).unwrap();
        for direction in 0..8 {
            let sign = if direction % 2 == 0 { 1.0 } else { -1.0 };
            let along: Vec<f64> = (0..4).map(|i| sign * axes[(i, direction / 2)]).collect();
            let scale = (level / quadratic_form(case.p(), &along)).sqrt();
            case.fly(along.iter().map(|x| scale * x).collect(), level, factor);
        }
    }
}

impl Case {
    /// Classical Runge–Kutta steps of the equations of motion of TORA, as its source states them, not of the quasi-LPV form.
    fn fly(&self, mut x: Vec<f64>, level: f64, factor: f64) {
        let weights = self.claim.weights.as_ref().unwrap();
        let sigma = self.claim.saturation.as_ref().map_or(f64::INFINITY, |bounds| bounds.sigma[0]);
        let input = |x: &[f64]| {
            let [_, _, k] = self.at(&[x[2], x[3]]);
            (0..4).map(|j| -k[(0, j)] * x[j]).sum::<f64>().clamp(-sigma, sigma)
        };
        // ẍ + x = ε(θ̇² sin θ − θ̈ cos θ), θ̈ + ε ẍ cos θ = u, solved for ẍ and θ̈
        let rate = |x: &[f64]| {
            let (u, (sin, cos)) = (input(x), x[2].sin_cos());
            let coupled = 0.2 * cos;
            let drive = -x[0] + 0.2 * x[3] * x[3] * sin;
            let acceleration = (drive - coupled * u) / (1.0 - coupled * coupled);
            vec![x[1], acceleration, x[3], u - coupled * acceleration]
        };
        let stage = |x: &[f64]| quadratic_form(&weights.q, x) + weights.r[(0, 0)] * input(x).powi(2);
        let (h, start) = (0.01, quadratic_form(self.p(), &x));
        let (mut cost, mut v) = (0.0, start);
        let moved = |x: &[f64], k: &[f64], h: f64| x.iter().zip(k).map(|(x, k)| x + h * k).collect::<Vec<f64>>();
        for _ in 0..4000 {
            let k1 = rate(&x);
            let k2 = rate(&moved(&x, &k1, 0.5 * h));
            let k3 = rate(&moved(&x, &k2, 0.5 * h));
            let k4 = rate(&moved(&x, &k3, h));
            let mean: Vec<f64> = (0..4).map(|i| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0).collect();
            let before = stage(&x);
            x = moved(&x, &mean, h);
            cost += 0.5 * h * (before + stage(&x));
            let now = quadratic_form(self.p(), &x);
            assert!(now <= v * (1.0 + 1e-9) + 1e-15, "V grows from {v} to {now} at {x:?}");
            v = now;
            assert!(x[2].abs() <= std::f64::consts::FRAC_PI_4 + 1e-9 && x[3].abs() <= 0.5 + 1e-9, "{x:?}");
        }
        // the trapezoidal rule is right to 10⁻⁴ here
        assert!(start <= level * (1.0 + 1e-9) && cost <= factor * start * (1.0 + 1e-3), "{cost} of {start}");
        assert!(v < 0.2 * start, "{v} of {start}");
    }
}
