//! A design in [`Units`] of the problem's own as one of the problem as it is stated, proved again for its numbers.

use super::inequality::Weights;
use super::objective::{COST_BOUND, MARGIN};
use super::primed::objective_factor;
use super::regulation::RegulatorProblem;
use super::stabilization::StabilityProblem;
use super::{PolytopicDesign, PolytopicRequest, Solution};
use crate::math::Mat;
use crate::model::Polytope;
use crate::synthesis::units::{Units, scaled};
use lmi::{Answer, Problem};

/// `design`, found in `units`, as one of `polytope` and `request`; `None` where it is not solved, or is not proved as stated.
pub(super) fn restated(
    polytope: &Polytope,
    request: &PolytopicRequest,
    units: &Units,
    design: PolytopicDesign,
) -> Option<PolytopicDesign> {
    let solution = design.solution.as_ref().filter(|_| design.is_solved())?;
    let mut restated = in_units(solution, units);
    let objective = objective_factor(units, request);
    let answer = match &request.weights {
        None => {
            let StabilityProblem { problem, .. } = StabilityProblem::new(polytope, &request.lyapunov);
            problem.restated(&design.answer, values(&problem, &design.answer, units, objective), objective)?
        }
        Some(cost) => {
            let weights = Weights::new(cost)?;
            let posed = RegulatorProblem::new(polytope, request, cost, &weights);
            let answer = match design.riccati {
                // Y and L are not the solver's
                Some(_) => {
                    let blocks = posed.problem.verify(&[restated.y[0].clone(), restated.l[0].clone()]).ok()?;
                    if !blocks.iter().all(|block| block.verified_lower_bound > 0.0) {
                        return None;
                    }
                    let mut answer = design.answer;
                    (answer.objective, answer.optimum_bound, answer.blocks) =
                        (objective * answer.objective, None, blocks);
                    answer
                }
                None => {
                    let values = values(&posed.problem, &design.answer, units, objective);
                    posed.problem.restated(&design.answer, values, objective)?
                }
            };
            if let Some(s) = restated.s {
                restated.mixtures = posed.mixtures(polytope, request, &weights, s, &answer);
            }
            answer
        }
    };
    let moderation = design.moderation.map(|moderation| moderation.times(objective));
    Some(PolytopicDesign { answer, moderation, solution: Some(restated), ..design })
}

/// The matrices of `solution` as they are stated; its mixtures are left out.
fn in_units(solution: &Solution, units: &Units) -> Solution {
    let each =
        |of: &[Mat<f64>], as_stated: &dyn Fn(&Mat<f64>) -> Mat<f64>| of.iter().map(as_stated).collect::<Vec<_>>();
    Solution {
        y: each(&solution.y, &|y| scaled(y, units.y())),
        l: each(&solution.l, &|l| units.l(l)),
        p: each(&solution.p, &|p| scaled(p, 1.0 / units.y())),
        gain: each(&solution.gain, &|k| units.gain(k)),
        auxiliary_gain: solution.auxiliary_gain.as_ref().map(|gain| each(gain, &|k| units.gain(k))),
        s: solution.s,
        mixtures: Vec::new(),
    }
}

/// The unknowns of a problem as they are stated, from those of the `answer` in `units`: Y, L and M, and the scalar that is optimised.
fn values(problem: &Problem, answer: &Answer, units: &Units, objective: f64) -> Vec<Mat<f64>> {
    let as_stated = |(name, value): (&String, &Mat<f64>)| match name.as_str() {
        MARGIN | COST_BOUND => scaled(value, objective),
        name if name.starts_with('Y') => scaled(value, units.y()),
        _ => units.l(value),
    };
    problem.unknown_names().iter().zip(answer.unknown_values()).map(as_stated).collect()
}
