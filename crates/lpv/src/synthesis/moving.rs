//! A [`Design`] for a moving parameter, from the inequalities of [`rate_bounded`](super::rate_bounded).

use super::back_off::{Saturation, back_off_moving};
use super::design::{Parts, assemble, schedule};
use super::high_gain::Segment;
use super::rate_bounded::{basis, solve_on_grid};
use super::slpvqr::not_definite;
use super::{Design, DesignRequest, FrozenDesign, Method, RateBounded, RateBoundedOptions, SynthesisError};
use crate::math::matrix::{inverse_spd, trace};
use crate::model::{FrozenModel, GridModel};
use crate::plant::{Plant, PlantSpec};
use rayon::prelude::*;

/// Grid points that the inequalities are imposed on at first, for each basis function; and at most.
const POINTS_PER_FUNCTION: [usize; 2] = [2, 16];
/// How much denser than asked for the schedule may become: interpolation of the gain between its points errs with the
/// fourth power of their distance.
const SCHEDULE_REFINEMENTS: [usize; 3] = [1, 2, 4];
/// Points between two grid points of the schedule at which the inequalities are checked before a design is returned.
const CHECKS_PER_POINT: usize = 4;

/// Impose the inequalities on a grid, check them between its points with the gain as scheduled, and refine schedule and
/// grid until they hold there too.
///
/// # Errors
/// As [`solve_on_grid`]; [`SynthesisError::BetweenGridPoints`] when refinement does not help.
pub(super) fn design(
    spec: &PlantSpec,
    plant: &dyn Plant,
    request: &DesignRequest,
    options: &RateBoundedOptions,
    model: &GridModel,
    sigma: Option<&[f64]>,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Design, SynthesisError> {
    let periodic = model.scheduling.as_ref().is_some_and(|scheduling| scheduling.periodic);
    let basis = basis(periodic, options.order);
    let saturation = sigma.zip(request.method.gamma());
    let bounds = saturation.map(|(sigma, gamma)| Saturation { sigma, gamma });
    let is_high_gain = matches!(request.method, Method::HighGainSlpvqr { .. });
    let [mut count, most] = POINTS_PER_FUNCTION.map(|points| points * basis.len());
    loop {
        let coarse = GridModel::of_plant(plant, count);
        let (lyapunov, iterations) = solve_on_grid(&coarse.points, options, &basis, &request.weights, saturation)?;
        for refinement in SCHEDULE_REFINEMENTS {
            let scheduled = GridModel::of_plant(plant, refinement * model.points.len());
            let fine = GridModel::of_plant(plant, CHECKS_PER_POINT * scheduled.points.len());
            let points = points(request, &scheduled.points, &lyapunov, iterations)?;
            let schedule = schedule(&scheduled, &points, request.schedule);
            let mut strict = lyapunov.clone();
            let factor =
                back_off_moving(&mut strict, &fine.points, &request.weights, &schedule, is_high_gain, bounds.as_ref());
            let Some(back_off) = factor else { continue };
            let points = (points.into_iter())
                .map(|point| Some(FrozenDesign { p: strict.p(point.rho)?, ..point }))
                .collect::<Option<_>>()
                .ok_or_else(|| not_definite(model.points[0].rho))?;
            progress(model.points.len());
            let operating_input = plant.trim(model.points[0].rho).input;
            let parts = Parts { schedule, points, back_off, rate_bounded: Some(strict) };
            return Ok(assemble(spec, request, &scheduled, operating_input, parts));
        }
        if count >= most {
            return Err(SynthesisError::BetweenGridPoints { points: count });
        }
        count *= 2;
        progress((model.points.len() * count / (2 * most)).min(model.points.len()));
    }
}

/// Gains and Lyapunov matrices at the points of the schedule.
fn points(
    request: &DesignRequest,
    models: &[FrozenModel],
    lyapunov: &RateBounded,
    iterations: usize,
) -> Result<Vec<FrozenDesign>, SynthesisError> {
    let design = |gain, auxiliary_gain, p, model: &FrozenModel| FrozenDesign {
        rho: model.rho,
        gain,
        auxiliary_gain,
        p,
        trace_y: trace(&lyapunov.y.at(&[model.rho])),
        riccati_difference: None,
        iterations,
    };
    let p = |model: &FrozenModel| lyapunov.p(model.rho).ok_or_else(|| not_definite(model.rho));
    match request.method {
        Method::Lpvqr => {
            let r_inverse = inverse_spd(&request.weights.r).expect("weights are checked to be positive definite");
            let point = |model: &FrozenModel| {
                let p = p(model)?;
                Ok(design(&r_inverse * model.b.transpose() * &p, None, p, model))
            };
            models.iter().map(point).collect()
        }
        Method::Slpvqr { .. } => {
            let point = |model: &FrozenModel| {
                let gain = lyapunov.unsaturated_gain(model.rho).ok_or_else(|| not_definite(model.rho))?;
                Ok(design(gain, None, p(model)?, model))
            };
            models.iter().map(point).collect()
        }
        Method::HighGainSlpvqr { high_gain, .. } => {
            let choose = |model: &FrozenModel| {
                let segment = Segment::moving(model, &request.weights, lyapunov, iterations)
                    .ok_or_else(|| not_definite(model.rho))?;
                let s = segment.choose(model, &request.weights, Some(request.sample_time_s), &high_gain)?;
                Ok((segment, s))
            };
            let chosen: Vec<_> = models.par_iter().map(choose).collect();
            let segments = chosen.into_iter().collect::<Result<Vec<_>, SynthesisError>>()?;
            let least = segments.iter().map(|&(_, s)| s).fold(f64::INFINITY, f64::min);
            Ok((segments.into_iter().zip(models))
                .map(|((segment, _), model)| segment.into_design(model, &request.weights, least))
                .collect())
        }
    }
}
