//! The kinds of cases.

mod edge;
mod family;
mod gain;
mod governed;
mod linear;
mod mutation;
mod narrow;
mod polytope;
mod sampled;
mod scheduled;
mod weights;

use crate::Tally;
use crate::conditions::{Bounds, check};
use crate::flight::{Flown, Frozen};
use crate::loops::{Loop, sides};
use crate::numbers::Numbers;
use lpv::certificate::{Claim, ClaimKind, Motion, ProofOptions, Verdict, prove};
use lpv::math::Mat;
use lpv::model::{BasisFunction, MatrixFunction};

/// A kind of cases.
pub struct Kind {
    pub name: &'static str,
    pub cases: u64,
    pub run: fn(&mut Numbers, &mut Tally) -> Result<(), String>,
}

pub const KINDS: &[Kind] = &[
    Kind { name: "linear", cases: 2600, run: linear::case },
    Kind { name: "family", cases: 500, run: family::case },
    Kind { name: "narrow", cases: 700, run: narrow::case },
    Kind { name: "edge", cases: 1200, run: edge::case },
    Kind { name: "polytope", cases: 2600, run: polytope::case },
    Kind { name: "weights", cases: 800, run: weights::case },
    Kind { name: "sampled", cases: 600, run: sampled::case },
    Kind { name: "gain", cases: 250, run: gain::case },
    Kind { name: "governed", cases: 250, run: governed::case },
    Kind { name: "mutation", cases: 1500, run: mutation::case },
    Kind { name: "scheduled", cases: 300, run: scheduled::case },
];

/// M₀ and small multiples of random matrices with the powers of ρ up to `degree`.
pub fn polynomials(
    numbers: &mut Numbers,
    center: &Mat<f64>,
    degree: u32,
    size: f64,
    symmetric: bool,
) -> MatrixFunction {
    around(numbers, center, &BasisFunction::powers(0, degree), size, symmetric)
}

/// M₀ and small multiples of random matrices with the other basis functions.
pub fn around(
    numbers: &mut Numbers,
    center: &Mat<f64>,
    basis: &[BasisFunction],
    size: f64,
    symmetric: bool,
) -> MatrixFunction {
    let (rows, columns) = (center.nrows(), center.ncols());
    let coefficients = (0..basis.len()).map(|k| match (k, symmetric) {
        (0, _) => center.clone(),
        (_, true) => size * numbers.symmetric(rows),
        (_, false) => size * numbers.matrix(rows, columns),
    });
    MatrixFunction { coefficients: coefficients.collect(), basis: basis.to_vec() }
}

/// The claim of this name about the model, if it is proved.
pub fn proved<'a>(claims: &'a [Claim], name: &str) -> Option<&'a Claim> {
    claims.iter().find(|claim| claim.id.to_string() == name && claim.verdict == Verdict::Proved)
}

/// What is proved of where V decreases: the level (`None`: everywhere), and the motions of the parameter.
pub fn decreasing(claims: &[Claim]) -> Option<(Option<f64>, Motion)> {
    match proved(claims, "invariance").or(proved(claims, "decrease"))?.kind {
        ClaimKind::Invariance { level, motion } => Some((Some(level), motion)),
        ClaimKind::Decrease { motion } => Some((None, motion)),
        _ => None,
    }
}

/// κ of a cost bound that is proved for at least this motion.
pub fn cost_factor(claims: &[Claim], of: Motion) -> Option<f64> {
    match proved(claims, "cost")?.kind {
        ClaimKind::Cost { factor, motion, .. } if motion == of => Some(factor),
        _ => None,
    }
}

/// A direction to start a flight in: one of the worst, or any.
pub fn direction(numbers: &mut Numbers, flown: &Flown) -> Vec<f64> {
    let worst = flown.worst_directions();
    match worst.len() {
        0 => (0..flown.states).map(|_| numbers.next()).collect(),
        count if numbers.below(3) > 0 => worst[numbers.below(count)].clone(),
        _ => (0..flown.states).map(|_| numbers.next()).collect(),
    }
}

/// Prove a design and attack the verdicts, at these values of the parameter.
pub fn attack(
    numbers: &mut Numbers,
    tally: &mut Tally,
    of: &Loop,
    options: &ProofOptions,
    positions: &[f64],
) -> Result<Vec<Claim>, String> {
    let design = &of.design;
    let proofs = match prove(design, &*of.plant, options) {
        Ok(proofs) => proofs,
        Err(_) => {
            tally.refused += 1;
            return Ok(Vec::new());
        }
    };
    let claims = proofs.claims;
    tally.count(&claims);
    let controller = &design.controller;
    let bounds = Bounds::of_limits(&controller.limits, &controller.operating_input, &design.weights);
    let points: Vec<_> = positions.iter().map(|&rho| of.point(rho)).collect();
    tally.witnesses += check(&claims, &bounds, &points, &|witness| of.point(witness.parameter))?;
    // a level that is proved is the one that is asked for, or less
    if let (Some(asked), Some(claim)) = (options.level.or(design.method.gamma()), proved(&claims, "unsaturated"))
        && matches!(claim.kind, ClaimKind::Unsaturated { level } if level > asked)
    {
        return Err(format!("more than the level {asked} is proved"));
    }
    if let Some((level, motion)) = decreasing(&claims) {
        fly(numbers, tally, of, &claims, level, motion, positions)?;
    }
    Ok(claims)
}

fn fly(
    numbers: &mut Numbers,
    tally: &mut Tally,
    of: &Loop,
    claims: &[Claim],
    level: Option<f64>,
    motion: Motion,
    positions: &[f64],
) -> Result<(), String> {
    let (states, inputs) = of.sizes();
    let controller = &of.design.controller;
    let (below, above) = sides(&controller.limits, &controller.operating_input);
    let rate = match motion {
        Motion::Bounded { rate } => rate,
        _ => 0.0,
    };
    let scheduling = of.plant.description().scheduling.clone();
    let moves = |rho: &[f64], h: f64| -> Vec<Vec<f64>> {
        let Some(scheduling) = scheduling.as_ref().filter(|_| rate > 0.0) else { return vec![rho.to_vec()] };
        // beyond this a loop only oscillates: the step resolves nothing else
        let distance = (rate * h).min(1.0);
        let clamped = |x: f64| if scheduling.periodic { x } else { x.clamp(scheduling.range[0], scheduling.range[1]) };
        [-distance, distance].map(|d| vec![clamped(rho[0] + d)]).to_vec()
    };
    let constant = if of.family.is_none() { of.frozen(0.0) } else { None };
    let frozen = |rho: &[f64]| -> Option<Frozen> { constant.clone().or_else(|| of.frozen(rho[0])) };
    let low = of.design.points[0].auxiliary_gain.is_none();
    let flown = Flown {
        states,
        inputs,
        frozen: &frozen,
        start: vec![positions[numbers.below(positions.len())]],
        moves: &moves,
        below,
        above,
        level: level.unwrap_or_else(|| 10.0_f64.powf(4.0 * numbers.next())),
        unsaturated: low && level.is_some(),
        cost: cost_factor(claims, motion).map(|factor| (factor, &of.design.weights.q, &of.design.weights.r)),
    };
    tally.flights += 1;
    flown.fly(&direction(numbers, &flown))
}
