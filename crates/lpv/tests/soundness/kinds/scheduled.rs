//! Gains scheduled by tensor-product weights, on models of two parameters: what is proved of the LPV model and of the nonlinear plant is held against
//! the conditions at many points of the box, its edges and corners among them. The vertices that stand for the model are good, bad and wrong.

use crate::Tally;
use crate::numbers::Numbers;
use lpv::certificate::{
    Claim, ClaimKind, PolytopicClaim, PolytopicLyapunov, ScheduledClaim, Verdict, prove_polytopic, prove_scheduled,
};
use lpv::math::Mat;
use lpv::math::eigen::smallest_eigenvalue;
use lpv::math::matrix::{diagonal, identity, inverse_spd, symmetric_part};
use lpv::math::riccati;
use lpv::model::literature::{LiteratureModel, PendulumCartParameters, ToraParameters};
use lpv::model::tensor_product::{ParameterGrid, ScheduledParameter, TensorProductSchedule};
use lpv::model::{ModelSource, Polytope};
use lpv::synthesis::CostWeights;
use lpv::synthesis::polytopic::InputBounds;

/// Cells that a proof may take: few, so that a case is short.
const MOST_CELLS: usize = 1500;
/// Points of the box in each direction at which conditions are looked at.
const POINTS: usize = 17;
/// Of the size of a condition, what counts as rounding.
const ROUNDING: f64 = 1e-9;

struct Case {
    source: ModelSource,
    schedule: TensorProductSchedule,
    claim: PolytopicClaim,
}

fn generate(numbers: &mut Numbers) -> Option<Case> {
    let (model, ranges) = match numbers.below(2) {
        0 => {
            let model = LiteratureModel::Tora(ToraParameters { coupling: 0.05 + 0.4 * numbers.unit() });
            (model, [1.2 * numbers.unit() + 0.05, 2.0 * numbers.unit() + 0.05])
        }
        _ => {
            let constants = PendulumCartParameters { half_length_m: 0.3 + numbers.unit(), ..Default::default() };
            (LiteratureModel::PendulumCart(constants), [1.3 * numbers.unit() + 0.05, 3.0 * numbers.unit() + 0.05])
        }
    };
    let interval = |numbers: &mut Numbers, half: f64| match numbers.below(4) {
        // rest is not always inside, nor in the middle
        0 => [-half, 0.5 * half],
        1 => [0.1 * half, half],
        _ => [-half, half],
    };
    let parameters: Vec<ScheduledParameter> = (model.parameters().iter().zip(ranges))
        .map(|(p, half)| {
            let points = 2 + numbers.below(3);
            let grid = ParameterGrid::equidistant(p.name, p.unit, interval(numbers, half), points);
            let weight = |k: usize| k as f64 / (points - 1) as f64;
            let row = |k: usize| vec![1.0 - weight(k), weight(k)];
            ScheduledParameter { grid, weights: (0..points).map(row).collect() }
        })
        .collect();
    let schedule = TensorProductSchedule { parameters };
    let r = 10.0_f64.powf(2.0 * numbers.next() - 1.0);
    let weights = CostWeights { q: identity(4), r: diagonal(&[r]) };
    let ends = |k: usize, number: usize| {
        let points = &schedule.parameters[k].grid.points;
        if number == 0 { points[0] } else { points[points.len() - 1] }
    };
    let parts = |rho: &[f64]| {
        let at = model.at(rho);
        (Mat::from_fn(4, 4, |i, j| at[(i, j)]), Mat::from_fn(4, 1, |i, _| at[(i, 4)]))
    };
    // vertices are the values at the corners, some of them wrong
    let is_wrong = numbers.once_in(4);
    let corners: Vec<Vec<f64>> =
        (0..4).map(|v| schedule.numbers(v)).map(|n| vec![ends(0, n[0]), ends(1, n[1])]).collect();
    let vertices: Vec<(Mat<f64>, Mat<f64>)> = corners
        .iter()
        .map(|rho| {
            let (a, b) = parts(rho);
            let size = if is_wrong { 0.5 } else { 0.0 };
            (a + size * numbers.matrix(4, 4), b)
        })
        .collect();
    let (a, b) = vertices.iter().cloned().unzip();
    let middle = parts(&[0.0, 0.0]);
    let optimal = riccati::solve(&middle.0, &middle.1, &weights.q, &weights.r).ok()?;
    let scale = 1.0 + numbers.of(&[0.02, 0.2, 1.0]);
    let p = symmetric_part(&(scale * &optimal.p));
    let of_corner = numbers.once_in(2);
    let noise = numbers.of(&[0.0, 0.05, 0.5]);
    let gain: Vec<Mat<f64>> = vertices
        .iter()
        .map(|(a, b)| {
            let own = of_corner.then(|| riccati::solve(a, b, &weights.q, &weights.r).ok()).flatten();
            let k = own.map_or_else(|| optimal.k.clone(), |regulator| regulator.k);
            let (size, matrix) = (noise * k.norm_max(), numbers.matrix(1, 4));
            k + size * matrix
        })
        .collect();
    let is_high = numbers.once_in(2);
    let low: Vec<Mat<f64>> = gain.iter().map(|k| numbers.of(&[0.3, 0.6, 1.0]) * k).collect();
    let sigma = numbers.of(&[0.5, 1.0, 5.0]);
    let y = inverse_spd(&p)?;
    let reach = |k: &Mat<f64>| sigma * sigma / (k * &y * k.transpose())[(0, 0)];
    let reached = if is_high { &low } else { &gain }.iter().map(reach).fold(f64::INFINITY, f64::min);
    let gamma = numbers.of(&[0.5, 0.99, 1.05, 3.0]) * reached;
    let saturation = (is_high || numbers.once_in(2)).then_some(InputBounds { sigma: vec![sigma], gamma });
    let claim = PolytopicClaim {
        polytope: Polytope::new(a, b).ok()?,
        lyapunov: PolytopicLyapunov::Common { p, gain },
        auxiliary_gain: is_high.then_some(low),
        weights: (numbers.below(4) > 0).then_some(weights),
        saturation,
    };
    Some(Case { source: ModelSource::Literature(model), schedule, claim })
}

impl Case {
    /// Points of the box: corners, edges, and inside.
    fn points(&self) -> Vec<Vec<f64>> {
        let value = |k: usize, at: usize| {
            let points = &self.schedule.parameters[k].grid.points;
            let (low, high) = (points[0], points[points.len() - 1]);
            low + (high - low) * at as f64 / (POINTS - 1) as f64
        };
        (0..POINTS * POINTS).map(|at| vec![value(0, at % POINTS), value(1, at / POINTS)]).collect()
    }

    /// The claim is false at ρ, by more than rounding.
    fn fails(&self, claim: &Claim, rho: &[f64]) -> bool {
        let PolytopicLyapunov::Common { p, gain } = &self.claim.lyapunov else { return false };
        let n = p.nrows();
        let model = self.source.build().map(|source| source.at(rho)).unwrap_or_else(|_| Mat::zeros(n, n + 1));
        let a = Mat::from_fn(n, n, |i, j| model[(i, j)]);
        let b = Mat::from_fn(n, 1, |i, _| model[(i, n)]);
        let k = self.schedule.combine(gain, rho);
        let low = self.claim.auxiliary_gain.as_ref().map_or_else(|| k.clone(), |f| self.schedule.combine(f, rho));
        let negative = |matrix: Mat<f64>| {
            let matrix = symmetric_part(&matrix);
            smallest_eigenvalue(&matrix) < -ROUNDING * matrix.norm_max()
        };
        let flow = |s: &Mat<f64>| {
            let flow = p * (&b * s - &a);
            &flow + flow.transpose()
        };
        // of a high gain both ends of what the saturated input may be
        let gains = if self.claim.auxiliary_gain.is_some() { vec![&k, &low] } else { vec![&k] };
        match (&claim.kind, &self.claim.weights) {
            (ClaimKind::Unsaturated { level }, _) => {
                let Some(y) = inverse_spd(p) else { return true };
                let bound = self.claim.saturation.as_ref().map_or(f64::INFINITY, |bounds| bounds.sigma[0]);
                (&low * y * low.transpose())[(0, 0)] * level > bound * bound * (1.0 + ROUNDING)
            }
            (ClaimKind::Decrease { .. } | ClaimKind::Invariance { .. }, _) => gains.iter().any(|s| negative(flow(s))),
            (ClaimKind::Cost { factor, .. }, Some(CostWeights { q, r })) => {
                gains.iter().any(|s| negative(*factor * flow(s) - q - s.transpose() * r * *s))
            }
            (ClaimKind::TransformationError { a: most_a, b: most_b }, _) => {
                let polytope = &self.claim.polytope;
                let all = |of: &dyn Fn(usize) -> Mat<f64>| (0..polytope.len()).map(of).collect::<Vec<_>>();
                let difference = |all: &[Mat<f64>], of: &Mat<f64>| (self.schedule.combine(all, rho) - of).norm_l2();
                difference(&all(&|v| polytope.a(v).clone()), &a) > most_a + 1e-9
                    || difference(&all(&|v| polytope.b(v).clone()), &b) > most_b + 1e-9
            }
            _ => false,
        }
    }

    /// A state of {V ≤ level} is beyond the range of its parameter.
    fn leaves_ranges(&self, level: f64) -> bool {
        let PolytopicLyapunov::Common { p, .. } = &self.claim.lyapunov else { return false };
        let (Ok(source), Some(y)) = (self.source.build(), inverse_spd(p)) else { return true };
        source.parameters.iter().zip(&self.schedule.parameters).any(|(parameter, own)| {
            let points = &own.grid.points;
            let nearer = (-points[0]).min(points[points.len() - 1]);
            parameter.state.is_some_and(|i| (level * y[(i, i)]).sqrt() > nearer * (1.0 + ROUNDING))
        })
    }
}

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let Some(case) = generate(numbers) else {
        tally.refused += 1;
        return Ok(());
    };
    let claim = ScheduledClaim {
        polytopic: &case.claim,
        schedule: &case.schedule,
        source: Some(&case.source),
        most_cells: MOST_CELLS,
    };
    let claims = prove_scheduled(&claim, prove_polytopic(&case.claim));
    tally.count(&claims);
    let points = case.points();
    let is_of_polytope = |claim: &Claim| claim.id.to_string().starts_with("polytope.");
    for claim in claims.iter().filter(|claim| claim.verdict == Verdict::Proved && !is_of_polytope(claim)) {
        if let Some(rho) = points.iter().find(|rho| case.fails(claim, rho)) {
            return Err(format!("proved, and false at {rho:?}: {}", claim.claim));
        }
        let is_of_plant = claim.id.to_string().starts_with("plant.");
        let level = match claim.kind {
            ClaimKind::StatesInRange { level, .. } => Some(level),
            ClaimKind::Invariance { level, .. } if is_of_plant => Some(level),
            ClaimKind::Cost { level, .. } if is_of_plant => level,
            _ => None,
        };
        if let Some(level) = level.filter(|&level| case.leaves_ranges(level)) {
            return Err(format!("proved on V <= {level}, where a state leaves its range: {}", claim.claim));
        }
    }
    Ok(())
}
