//! Governed references of chains of integrators whose matrices are wrong in one entry: what is claimed to be a motion
//! of the model is one, up to what the set absorbs.

use crate::Tally;
use crate::conditions::check_premises;
use crate::exact::Dyadic;
use crate::numbers::Numbers;
use lpv::certificate::{ClaimKind, ProofOptions, Verdict, prove_supervised};
use lpv::controller::InputLimits;
use lpv::math::Mat;
use lpv::math::matrix::{identity, quadratic_form};
use lpv::model::linearize;
use lpv::plant::{LinearParameters, PlantSpec};
use lpv::synthesis::{CostWeights, Design, DesignRequest, GovernorOptions, Method, Supervision, design_supervised};
use std::sync::LazyLock;

/// Chains of these lengths side by side, each with its input.
const CHAINS: [&[usize]; 4] = [&[2], &[3], &[2, 1], &[2, 2]];

static DESIGNS: LazyLock<Vec<Design>> = LazyLock::new(|| CHAINS.iter().filter_map(|chains| governed(chains)).collect());

fn governed(chains: &[usize]) -> Option<Design> {
    let (n, m) = (chains.iter().sum::<usize>(), chains.len());
    let (mut a, mut b) = (vec![vec![0.0; n]; n], vec![vec![0.0; m]; n]);
    let mut first = 0;
    for (input, length) in chains.iter().enumerate() {
        (first..first + length - 1).for_each(|i| a[i][i + 1] = 1.0);
        b[first + length - 1][input] = 1.0;
        first += length;
    }
    let spec = PlantSpec::Linear(LinearParameters { a, b, c: None });
    let request = DesignRequest {
        name: "governed".into(),
        method: Method::Slpvqr { gamma: 1.0 },
        weights: CostWeights { q: identity(n), r: identity(m) },
        grid_points: 1,
        schedule: Default::default(),
        limits: InputLimits { min: vec![Some(-1.0); m], max: vec![Some(1.0); m] },
        sample_time_s: 0.01,
        rate_bounded: None,
    };
    let governor = GovernorOptions { level_share: 0.9, feedforward: Some(0.5), state_bounds: vec![None; n] };
    let supervision = Supervision { inner_levels: Vec::new(), governor: Some(governor) };
    design_supervised(&spec, &*spec.build().ok()?, &request, &supervision, &|_| {}).ok()
}

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let mut design = DESIGNS[numbers.below(DESIGNS.len())].clone();
    let supervisor = design.controller.supervisor.as_mut().ok_or("no supervisor")?;
    let motion = supervisor.governor.as_mut().and_then(|governor| governor.motion.as_mut()).ok_or("no motion")?;
    let of = numbers.below(motion.inputs.len());
    let change = numbers.of(&[0.0, 1e-14, 1e-9, 1e-6, 1e-3, 0.5, -2.0]);
    match numbers.below(4) {
        0 => {}
        1 => {
            let matrix = &mut motion.inputs[of].coefficients[0];
            let (i, j) = (numbers.below(matrix.nrows()), numbers.below(matrix.ncols()));
            matrix[(i, j)] += change;
        }
        2 if !motion.states.is_empty() => {
            let of = numbers.below(motion.states.len());
            let matrix = &mut motion.states[of].coefficients[0];
            let (i, j) = (numbers.below(matrix.nrows()), numbers.below(matrix.ncols()));
            matrix[(i, j)] += change;
        }
        _ => {
            let at = numbers.below(motion.input_budget.len());
            motion.input_budget[at] *= numbers.of(&[1.0 + 1e-15, 1.0 + 1e-9, 1.1, 0.5]);
        }
    }
    tally.refused += usize::from(design.validate().is_err());
    let plant = design.plant.build().map_err(|error| error.to_string())?;
    let Ok(proofs) = prove_supervised(&design, &*plant, &ProofOptions::default()) else { return Ok(()) };
    tally.count(&proofs.claims);
    check_premises(&proofs.claims)?;
    let claim =
        proofs.claims.iter().find(|claim| claim.id.name == "governed-motion").ok_or("no claim about the motion")?;
    let ClaimKind::GovernedMotion { farthest, .. } = claim.kind else { return Err("another claim".into()) };
    if claim.verdict != Verdict::Proved {
        return Ok(());
    }
    is_a_motion(&design, farthest).map_err(|reason| format!("{} is proved: {reason}", claim.id))?;
    tally.witnesses += 1;
    Ok(())
}

/// Budget and limits together are within the actuators, exactly; and V falls on the edge of the set against what the
/// reference leaves over.
fn is_a_motion(design: &Design, farthest: f64) -> Result<(), String> {
    let controller = &design.controller;
    let governor = controller.supervisor.as_ref().and_then(|s| s.governor.as_ref()).ok_or("no governor")?;
    let motion = governor.motion.as_ref().ok_or("no motion")?;
    let side = |limit: Option<f64>| limit.map(Dyadic::from).map(|limit| limit.abs());
    for i in 0..motion.input_budget.len() {
        let [feedback, all] = [&controller.limits, &motion.actuators].map(|limits| {
            let sides = [side(limits.min[i]), side(limits.max[i])];
            sides.into_iter().flatten().reduce(|a, b| if a.exceeds(&b) { b } else { a })
        });
        let (Some(feedback), Some(all)) = (feedback, all) else { return Err("an input has no limit".into()) };
        if (&feedback + &motion.input_budget[i].into()).exceeds(&all) {
            return Err(format!("input {}: reference and feedback exceed the actuators", i + 1));
        }
    }
    let plant = design.plant.build().map_err(|error| error.to_string())?;
    let model = linearize(&*plant, 0.0);
    let (n, d) = (model.a.nrows(), governor.set_point_states.len());
    let (p, k) = (&design.points[0].p, &design.points[0].gain);
    let unit = Mat::from_fn(n, d, |i, j| f64::from(u8::from(i == governor.set_point_states[j])));
    let constant = |function: &lpv::model::MatrixFunction| function.at(&[0.0]);
    let z: Vec<Mat<f64>> = std::iter::once(unit).chain(motion.states.iter().map(constant)).collect();
    for j in 0..d {
        let delta: Vec<f64> = (0..d).map(|i| if i == j { farthest } else { 0.0 }).collect();
        let peaks = governor.profile(motion, &delta, None).peaks();
        // R_k = Z_k − A Z_{k+1} − B U_{k+1}
        let mut w = vec![0.0_f64; n];
        for (step, input) in motion.inputs.iter().enumerate() {
            let mut rest = &z[step] - &model.b * constant(input);
            if let Some(next) = z.get(step + 1) {
                rest -= &model.a * next;
            }
            (0..n).for_each(|i| w[i] += peaks[step] * farthest * rest[(i, j)]);
        }
        let size = quadratic_form(p, &w);
        if size <= 0.0 {
            continue;
        }
        // e on the edge along w
        let level = design.method.gamma().ok_or("no level")?;
        let e: Vec<f64> = w.iter().map(|w| w * (level / size).sqrt()).collect();
        let flow = &model.a - &model.b * k;
        let rate = |i: usize| (0..n).map(|j| flow[(i, j)] * e[j]).sum::<f64>() + w[i];
        let along: f64 = (0..n).map(|i| (0..n).map(|l| 2.0 * e[i] * p[(i, l)] * rate(l)).sum::<f64>()).sum();
        if along > 0.0 {
            return Err(format!("against the residual {w:?} of a move of state {j} V grows by {along} per second"));
        }
    }
    Ok(())
}
