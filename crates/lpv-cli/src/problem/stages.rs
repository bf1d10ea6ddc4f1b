//! The first stages of a problem, solved once, and the designs that follow from them for every back-off.

use super::plan::{ProblemPlan, Scope};
use super::verdict::failure_at;
use crate::failure::Failure;
use lpv::model::{FrozenModel, Polytope};
use lpv::synthesis::SynthesisError;
use lpv::synthesis::polytopic::{BackOff, FirstStage, Lyapunov, PolytopicDesign, PolytopicRequest};
use std::path::Path;
use std::time::Instant;

/// Of the polytope, or of each of the models of a frozen design.
pub(super) struct Stages<'a> {
    /// What is asked.
    pub plan: &'a ProblemPlan,
    /// The file that it stands in.
    pub path: &'a Path,
    /// One, or one for each model.
    pub each: Vec<FirstStage>,
    /// When the work began.
    pub started: Instant,
}

impl<'a> Stages<'a> {
    /// Solve them.
    pub fn new(plan: &'a ProblemPlan, path: &'a Path) -> Result<Self, Failure> {
        let started = Instant::now();
        let request = request(plan, plan.back_off);
        let stage = |models: &[FrozenModel]| FirstStage::new(&Polytope::hull(models), &request);
        let each: Result<Vec<FirstStage>, SynthesisError> = match &plan.scope {
            Scope::Polytope(_) => stage(&plan.models).map(|stage| vec![stage]),
            Scope::Frozen => {
                let at = |(k, model)| {
                    stage(std::slice::from_ref(model)).map_err(|error: SynthesisError| error.moved_to(k as f64))
                };
                plan.models.iter().enumerate().map(at).collect()
            }
        };
        Ok(Self { plan, path, each: each.map_err(|error| failure_at(plan, path, error))?, started })
    }

    /// The designs with `back_off`, one for each stage.
    pub fn designs(&self, back_off: BackOff) -> Result<Vec<PolytopicDesign>, Failure> {
        let is_frozen = matches!(self.plan.scope, Scope::Frozen);
        let at = |(k, stage): (usize, &FirstStage)| {
            let moved = |error: SynthesisError| if is_frozen { error.moved_to(k as f64) } else { error };
            stage.design(back_off).map_err(|error| failure_at(self.plan, self.path, moved(error)))
        };
        self.each.iter().enumerate().map(at).collect()
    }

    /// √τ of the designs, the largest; `None` where one is missing.
    pub fn effort(&self, designs: &[PolytopicDesign]) -> Option<f64> {
        let at = |(stage, design): (&FirstStage, &PolytopicDesign)| Some(stage.effort(design.solution.as_ref()?));
        self.each.iter().zip(designs).map(at).try_fold(0.0_f64, |largest, effort| Some(largest.max(effort?)))
    }
}

/// What the library is asked for.
pub(super) fn request(plan: &ProblemPlan, back_off: BackOff) -> PolytopicRequest {
    PolytopicRequest {
        weights: plan.weights.clone(),
        lyapunov: match &plan.scope {
            Scope::Polytope(lyapunov) => lyapunov.clone(),
            Scope::Frozen => Lyapunov::Common,
        },
        saturation: plan.saturation.clone(),
        high_gain: plan.high_gain,
        objective: plan.objective.clone(),
        back_off,
    }
}
