//! Problem files of `lpv design`: an LPV model as matrices or a plant by name, weights, and a method with its settings.
//! Everything that can be wrong with a file is met here.

mod curve;
mod file;
pub mod gain;
mod model;
mod objective;
mod plan;
mod solve;
mod source;
mod stages;
pub mod trade_off;
mod transformed;
mod values;
mod verdict;

use crate::failure::Failure;
use crate::scenario::door::Door;
use crate::scenario::{file as scenario_file, weights};
pub use curve::solve_with_trade_off;
use file::{DesignTable, LyapunovName, MethodName, ModelTable, ObjectiveName, ProblemFile};
use lpv::math::matrix::is_diagonal;
use lpv::synthesis::polytopic::{BackOff, HighGain, InputBounds, Lyapunov, Objective, rate_box_vertices};
use lpv::synthesis::{CostWeights, HighGainOptions};
use model::models;
use objective::{initial, objective};
pub use plan::{Initial, ProblemPlan, Scope};
pub use solve::solve;
use std::path::Path;
use values::SUM_TOLERANCE;

/// Vertices of a polytope; each pair of them is an inequality for each rate vertex.
const MOST_VERTICES: usize = 64;
/// Inequalities of a problem.
const MOST_BLOCKS: usize = 4096;
/// States of a model.
const MOST_STATES: usize = 60;
/// Inputs of a high-gain design whose R is not diagonal: there are 2^m mixtures, each an inequality.
const MOST_COUPLED_INPUTS: usize = 10;
/// Inputs of a high-gain design with diagonal R, whose mixtures follow from one inequality.
const MOST_HIGH_GAIN_INPUTS: usize = 64;
impl ProblemPlan {
    /// Whether the text of a file is a problem rather than a scenario: it has a table `[design]`.
    pub fn is_problem(text: &str) -> bool {
        toml::from_str::<toml::Table>(text).is_ok_and(|table| table.contains_key("design"))
    }

    /// Read and check the problem `text` of the file at `path`.
    pub fn read(path: &Path, text: &str) -> Result<Self, Failure> {
        let door = Door { file: path };
        let file: ProblemFile = toml::from_str(text).map_err(|error| Failure::Unreadable {
            file: path.to_owned(),
            message: scenario_file::toml_message(text, &error),
        })?;
        let design = file.design;
        let lyapunov = lyapunov(&door, &design, &file.model, file.plant.is_some())?;
        let source = models(&door, file.model, file.plant, lyapunov)?;
        let (n, m) = (source.models[0].a.nrows(), source.models[0].b.ncols());
        if n > MOST_STATES {
            return door.refuse("model", format!("has {n} states: allowed are up to {MOST_STATES}"));
        }
        if matches!(design.method, MethodName::Lqr | MethodName::Slqr) && source.models.len() > 1 {
            let message = format!(
                "is for a model of one vertex, and this one has {}: choose \"lpvqr\" or \"slpvqr\"",
                source.models.len()
            );
            return door.refuse("design.method", message);
        }

        let weights = cost_weights(&door, file.weights, design.method, n, m)?;
        let saturation = saturation(&door, &design, m)?;
        let high_gain = high_gain(&door, &design, weights.as_ref(), m)?;
        let (objective, region) = objective(&door, &design, n, saturation.is_some())?;
        let scope = match lyapunov {
            LyapunovName::Frozen => Scope::Frozen,
            LyapunovName::Common => Scope::Polytope(Lyapunov::Common),
            LyapunovName::ParameterDependent => Scope::Polytope(Lyapunov::ParameterDependent {
                rate_vertices: rate_vertices(&door, &design, source.models.len())?,
            }),
        };
        if !matches!(lyapunov, LyapunovName::ParameterDependent) {
            for (key, given) in
                [("rate_vertices", design.rate_vertices.is_some()), ("rate_bound", design.rate_bound.is_some())]
            {
                if given {
                    return door.refuse(format!("design.{key}"), "belongs to lyapunov = \"parameter-dependent\" only");
                }
            }
        }
        let initial = initial(&door, &design, &source, lyapunov)?;
        let mut plan = Self {
            states: source.states.iter().map(|state| state.name.clone()).collect(),
            transformed: source.transformed,
            places: source.places,
            models: source.models,
            scope,
            weights,
            saturation,
            high_gain,
            objective,
            back_off: back_off(&door, design.back_off)?,
            region,
            initial,
        };
        if let (Objective::States { parameter, .. }, Some(Initial { parameter: given, .. })) =
            (&mut plan.objective, &plan.initial)
            && design.objective == ObjectiveName::InitialState
        {
            parameter.clone_from(given);
        }
        plan.check_size(&door)?;
        Ok(plan)
    }

    fn check_size(&self, door: &Door) -> Result<(), Failure> {
        let count = self.models.len();
        let (pairs, rates) = match &self.scope {
            Scope::Frozen => (0, 1),
            Scope::Polytope(Lyapunov::Common) => (count * (count - 1) / 2, 1),
            Scope::Polytope(Lyapunov::ParameterDependent { rate_vertices }) => {
                (count * (count - 1) / 2, rate_vertices.len())
            }
        };
        let blocks = (count + pairs) * rates;
        if matches!(self.scope, Scope::Polytope(_)) && (count > MOST_VERTICES || blocks > MOST_BLOCKS) {
            return door.refuse(
                "model",
                format!("has {count} vertices, which makes {blocks} inequalities: allowed are {MOST_VERTICES} vertices and {MOST_BLOCKS} inequalities"),
            );
        }
        Ok(())
    }
}

fn lyapunov(door: &Door, design: &DesignTable, model: &ModelTable, has_plant: bool) -> Result<LyapunovName, Failure> {
    let is_plant = has_plant || model.plant.is_some();
    let lyapunov = design.lyapunov.unwrap_or(if is_plant { LyapunovName::Frozen } else { LyapunovName::Common });
    if design.lyapunov_order.is_some() {
        return door.refuse(
            "design.lyapunov_order",
            "is for controllers of a scenario: over a polytope Y is affine in ρ; remove it",
        );
    }
    if model.grid.is_some() && lyapunov != LyapunovName::Frozen {
        return door.refuse("model.grid", "belongs to lyapunov = \"frozen\" only");
    }
    Ok(lyapunov)
}

fn cost_weights(
    door: &Door,
    table: Option<file::WeightsTable>,
    method: MethodName,
    n: usize,
    m: usize,
) -> Result<Option<CostWeights>, Failure> {
    match (table, method) {
        (None, MethodName::Stabilize) => Ok(None),
        (Some(_), MethodName::Stabilize) => door.refuse("weights", "method \"stabilize\" has no cost; remove them"),
        (None, _) => door.refuse("weights", "are missing: give [weights] with Q and R"),
        (Some(table), _) => {
            let q = weights::semidefinite(door, "weights.Q", table.q, table.q_diag, n)?;
            if q.norm_max() == 0.0 {
                return door.refuse("weights.Q", "is zero: some state has to cost something");
            }
            Ok(Some(CostWeights { q, r: weights::definite(door, "weights.R", table.r, table.r_diag, m)? }))
        }
    }
}

fn saturation(door: &Door, design: &DesignTable, m: usize) -> Result<Option<InputBounds>, Failure> {
    let saturated = matches!(design.method, MethodName::Slqr | MethodName::Slpvqr);
    match (&design.sigma, design.gamma, saturated) {
        (None, None, false) => Ok(None),
        (Some(_), _, false) => door.refuse("design.sigma", "belongs to the methods \"slqr\" and \"slpvqr\" only"),
        (_, Some(_), false) => door.refuse("design.gamma", "belongs to the methods \"slqr\" and \"slpvqr\" only"),
        (None, _, true) => door.refuse("design.sigma", format!("is missing: the bound of each of the {m} inputs")),
        (_, None, true) => door.refuse("design.gamma", "is missing: the level γ > 0 of the certified set"),
        (Some(sigma), Some(gamma), true) => {
            let gamma = door.positive("design.gamma", gamma)?;
            if sigma.len() != m {
                return door.refuse("design.sigma", format!("has {} numbers: the model has {m} inputs", sigma.len()));
            }
            for (i, &bound) in sigma.iter().enumerate() {
                door.positive(&format!("design.sigma[{}]", i + 1), bound)?;
                if !(bound * bound / gamma).is_normal() {
                    let message =
                        format!("is {gamma:e}: sigma²/γ is too large or too small a number to calculate with");
                    return door.refuse("design.gamma", message);
                }
            }
            Ok(Some(InputBounds { sigma: sigma.clone(), gamma }))
        }
    }
}

fn high_gain(
    door: &Door,
    design: &DesignTable,
    weights: Option<&CostWeights>,
    m: usize,
) -> Result<Option<HighGain>, Failure> {
    let saturated = matches!(design.method, MethodName::Slqr | MethodName::Slpvqr);
    if !design.high_gain {
        let settings = [
            ("sample_time_s", design.sample_time_s.is_some()),
            ("recovery", design.recovery.is_some()),
            ("gain_margin", design.gain_margin.is_some()),
        ];
        return match settings.into_iter().find(|(_, given)| *given) {
            Some((key, _)) => door.refuse(format!("design.{key}"), "belongs to high_gain = true only"),
            None => Ok(None),
        };
    }
    if !saturated {
        return door.refuse("design.high_gain", "belongs to the methods \"slqr\" and \"slpvqr\" only");
    }
    let is_coupled = weights.is_some_and(|weights| !is_diagonal(&weights.r));
    let (most, with) =
        if is_coupled { (MOST_COUPLED_INPUTS, " with an R that is not diagonal") } else { (MOST_HIGH_GAIN_INPUTS, "") };
    if m > most {
        return door.refuse("design.high_gain", format!("is for up to {most} inputs{with}; the model has {m}"));
    }
    let default = HighGainOptions::default();
    let recovery = design.recovery.unwrap_or(default.recovery);
    if !(recovery >= 0.0 && recovery.is_finite()) {
        return door.refuse("design.recovery", format!("is {recovery}: it has to be a fraction, zero or more"));
    }
    let gain_margin = design.gain_margin.unwrap_or(default.gain_margin);
    if !(gain_margin >= 1.0 && gain_margin.is_finite()) {
        return door.refuse("design.gain_margin", format!("is {gain_margin}: it has to be a factor of at least 1"));
    }
    let sample_time_s = match design.sample_time_s {
        Some(time) => Some(door.positive("design.sample_time_s", time)?),
        None => None,
    };
    Ok(Some(HighGain { options: HighGainOptions { recovery, gain_margin }, sample_time_s }))
}

/// The share of the optimum that is given back: the knee where the file does not say, nothing for 0.
fn back_off(door: &Door, share: Option<f64>) -> Result<BackOff, Failure> {
    match share {
        None => Ok(BackOff::Knee),
        Some(0.0) => Ok(BackOff::Nothing),
        Some(share) if (1e-6..=0.9).contains(&share) => Ok(BackOff::Share(share)),
        Some(share) => {
            let message = "a share of the optimum: 0 for the bare optimum, or 1e-6 to 0.9";
            door.refuse("design.back_off", format!("is {share}: it has to be {message}"))
        }
    }
}

fn state_like(door: &Door, key: &str, values: &[f64], count: usize) -> Result<(), Failure> {
    if values.len() != count {
        return door.refuse(key, format!("has {} numbers: the model has {count} vertices", values.len()));
    }
    values.iter().try_for_each(|&value| door.finite(key, value).map(|_| ()))
}

fn rate_vertices(door: &Door, design: &DesignTable, count: usize) -> Result<Vec<Vec<f64>>, Failure> {
    match (&design.rate_vertices, design.rate_bound) {
        (Some(_), Some(_)) => door.refuse("design.rate_bound", "and rate_vertices are both given; keep one"),
        (None, None) => door.refuse(
            "design.rate_vertices",
            "is missing: lyapunov = \"parameter-dependent\" needs the vertices of ρ̇, or rate_bound",
        ),
        (None, Some(bound)) => match bound >= 0.0 && bound.is_finite() {
            // C(12, 6) = 924 vertices
            true if count <= 12 => Ok(rate_box_vertices(count, bound)),
            true => door.refuse(
                "design.rate_bound",
                format!("has too many vertices for {count} of the model: give rate_vertices"),
            ),
            false => door.refuse("design.rate_bound", format!("is {bound}: it has to be finite, zero or more")),
        },
        (Some(vertices), None) => {
            if vertices.is_empty() {
                return door.refuse(
                    "design.rate_vertices",
                    "is empty: give at least one rate; [[0, …]] is a parameter at rest",
                );
            }
            for (k, nu) in vertices.iter().enumerate() {
                let key = format!("design.rate_vertices[{}]", k + 1);
                state_like(door, &key, nu, count)?;
                let largest = nu.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
                if nu.iter().sum::<f64>().abs() > SUM_TOLERANCE * largest {
                    return door.refuse(
                        key,
                        format!("is {nu:?}: it has to sum to zero, because the weights of the vertices sum to one"),
                    );
                }
            }
            Ok(vertices.clone())
        }
    }
}
