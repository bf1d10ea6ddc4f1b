//! Gain against optimum: the curve's own inequalities, and that one first stage serves every back-off.

use lpv::math::Mat;
use lpv::math::eigen::{largest_singular_value, smallest_eigenvalue, spectral_abscissa};
use lpv::math::matrix::{diagonal, from_rows, inverse_spd, quadratic_form};
use lpv::model::Polytope;
use lpv::synthesis::CostWeights;
use lpv::synthesis::polytopic::{
    BackOff, FirstStage, InputBounds, Lyapunov, Objective, PolytopicRequest, TradeOff, rate_box_vertices, synthesize,
};

const SHARES: [f64; 5] = [0.0, 0.001, 0.01, 0.1, 0.4];

/// Two stiffnesses of a mass on a spring whose sign is uncertain.
fn springs() -> Polytope {
    let a = [1.0, -0.5].map(|k| from_rows(&[vec![0.0, 1.0], vec![k, -0.1]]));
    Polytope::new(a.to_vec(), vec![from_rows(&[vec![0.0], vec![1.0]])]).unwrap()
}

fn request(weights: Option<CostWeights>) -> PolytopicRequest {
    PolytopicRequest {
        weights,
        lyapunov: Lyapunov::Common,
        saturation: None,
        high_gain: None,
        objective: Objective::Trace,
        back_off: BackOff::Knee,
    }
}

fn weights() -> CostWeights {
    CostWeights { q: diagonal(&[4.0, 1.0]), r: diagonal(&[0.5]) }
}

/// [τR⁻¹, L; Lᵀ, Y] is positive semidefinite for τ = effort², and singular at some vertex.
fn effort_is_tight(curve: &TradeOff, r_inverse: &Mat<f64>) {
    for point in &curve.points {
        let (Some(design), Some(effort)) = (&point.design, point.effort) else { continue };
        let solution = design.solution.as_ref().unwrap();
        let least = solution.l.iter().zip(&solution.y).map(|(l, y)| {
            let (m, n) = (l.nrows(), l.ncols());
            let scale = |i: usize| if i < m { 1.0 / effort } else { 1.0 };
            let block = Mat::from_fn(m + n, m + n, |i, j| {
                let entry = match (i < m, j < m) {
                    (true, true) => effort * effort * r_inverse[(i, j)],
                    (true, false) => l[(i, j - m)],
                    (false, true) => l[(j, i - m)],
                    (false, false) => y[(i - m, j - m)],
                };
                scale(i) * entry * scale(j)
            });
            smallest_eigenvalue(&block)
        });
        let least = least.fold(f64::INFINITY, f64::min);
        // eigenvalues of matrices whose entries are about 1 are right to 1e-12; a gain of 1e4 leaves 1e-8 of it
        assert!(least.abs() < 1e-8, "share {}: {least:e}", point.share);
    }
}

/// What is asked of a curve: every design keeps to its share and to its inequalities, and more given back is less effort.
fn is_a_trade_off(curve: &TradeOff) {
    let designs: Vec<_> = curve.points.iter().filter(|point| point.share > 0.0).collect();
    for point in &designs {
        let design = point.design.as_ref().unwrap_or_else(|| panic!("no design for {}", point.share));
        assert!(design.is_solved());
        assert!(design.answer.blocks.iter().all(|block| block.verified_lower_bound > 0.0), "{}", point.share);
        let lost = (curve.optimum - design.answer.objective).abs() / curve.optimum.abs();
        assert!(lost <= point.share * (1.0 + 1e-9), "{lost} of {}", point.share);
        let gain = design.solution.as_ref().unwrap().gain.iter().map(largest_singular_value).fold(0.0, f64::max);
        assert_eq!(point.gain, Some(gain));
    }
    for pair in designs.windows(2) {
        // the solver's gap is 1e-8, and what is made strict is a fiftieth of the share
        assert!(pair[1].effort.unwrap() < 1.001 * pair[0].effort.unwrap(), "{:?}", (pair[0].effort, pair[1].effort));
    }
}

#[test]
fn every_method_has_its_curve() {
    let polytope = springs();
    let rates = Lyapunov::ParameterDependent { rate_vertices: rate_box_vertices(2, 0.5) };
    let bounds = InputBounds { sigma: vec![2.0], gamma: 1.0 };
    let states = Objective::States { states: vec![vec![1.0, 0.0], vec![0.0, 1.0]], parameter: None };
    for request in [
        request(Some(weights())),
        PolytopicRequest { lyapunov: rates, ..request(Some(weights())) },
        PolytopicRequest { saturation: Some(bounds), ..request(Some(weights())) },
        PolytopicRequest { objective: states, ..request(Some(weights())) },
        request(None),
    ] {
        let curve = FirstStage::new(&polytope, &request).unwrap().trade_off(&SHARES).unwrap();
        is_a_trade_off(&curve);
        // of stabilisation the one column of B has length 1
        effort_is_tight(&curve, &inverse_spd(&request.weights.map_or(diagonal(&[1.0]), |cost| cost.r)).unwrap());
    }
}

/// A cost bound is raised by what is given back, and never more.
#[test]
fn a_cost_bound_is_raised_by_its_share() {
    let objective = Objective::States { states: vec![vec![1.0, -0.5]], parameter: None };
    let stage = FirstStage::new(&springs(), &PolytopicRequest { objective, ..request(Some(weights())) }).unwrap();
    let curve = stage.trade_off(&SHARES).unwrap();
    for point in &curve.points[1..] {
        let design = point.design.as_ref().unwrap();
        let bound = quadratic_form(&design.solution.as_ref().unwrap().p[0], &[1.0, -0.5]);
        assert!(bound >= curve.optimum * (1.0 - 1e-9) && bound <= (1.0 + point.share) * curve.optimum, "{bound}");
    }
}

/// One first stage gives what a synthesis of its own gives.
#[test]
fn one_first_stage_serves_every_back_off() {
    let polytope = springs();
    for weights in [Some(weights()), None] {
        let request = request(weights);
        let stage = FirstStage::new(&polytope, &request).unwrap();
        for back_off in [BackOff::Knee, BackOff::Nothing, BackOff::Share(0.05)] {
            let alone = synthesize(&polytope, &PolytopicRequest { back_off, ..request.clone() }).unwrap();
            let shared = stage.design(back_off).unwrap();
            assert_eq!(alone.moderation, shared.moderation);
            assert_eq!(alone.answer.objective, shared.answer.objective);
            assert_eq!(alone.solution.unwrap().gain, shared.solution.unwrap().gain);
        }
    }
}

/// Where there is no design at all every point says so.
#[test]
fn no_design_has_no_points() {
    let polytope = Polytope::new(vec![diagonal(&[1.0, -1.0])], vec![from_rows(&[vec![0.0], vec![1.0]])]).unwrap();
    for weights in [Some(weights()), None] {
        let curve = FirstStage::new(&polytope, &request(weights)).unwrap().trade_off(&SHARES).unwrap();
        assert!(curve.points.iter().all(|point| point.design.is_none() && point.effort.is_none()));
    }
}

/// The effort of stabilisation is the same in every unit of the inputs: √τ of B and of BS agree, for diagonal S.
#[test]
fn effort_has_no_units_of_inputs() {
    let a = from_rows(&[vec![1.0, 2.0], vec![3.0, 4.0]]);
    let effort = |units: [f64; 2]| {
        let b = from_rows(&[vec![units[0], 0.0], vec![0.5 * units[0], units[1]]]);
        let polytope = Polytope::new(vec![a.clone()], vec![b.clone()]).unwrap();
        let curve = FirstStage::new(&polytope, &request(None)).unwrap().trade_off(&[0.1]).unwrap();
        let gain = &curve.points[0].design.as_ref().unwrap().solution.as_ref().unwrap().gain[0];
        assert!(spectral_abscissa(&(&a - &b * gain)) < 0.0);
        curve.points[0].effort.unwrap()
    };
    let one = effort([1.0, 1.0]);
    for units in [[1e-6, 1.0], [1e6, 1e-6], [1e-9, 1e-9], [1e9, 1.0]] {
        let effort = effort(units);
        assert!((effort / one - 1.0).abs() < 1e-6, "{units:?}: {effort} is not {one}");
    }
}
