//! Synthesis over a polytope of vertices, for any A(ρ) = Σ ρᵢAᵢ, B(ρ) = Σ ρᵢBᵢ.
//!
//! | Lyapunov function | stabilise | regulate | under saturation |
//! |---|---|---|---|
//! | one vertex (LTI) | Lemma 4.1 | Theorem 2.1 | Theorems 5.1, 5.2 |
//! | common, xᵀY⁻¹x | Theorem 4.1 | Theorem 4.3, Corollary 4.1 | the same with (5.19), (5.20) at every vertex |
//! | parameter-dependent, xᵀ(Σρᵢ Yᵢ)⁻¹x | Theorem 4.2 | Theorem 4.4 | the same |
//!
//! What is found holds for every motion ρ(t) in the polytope; with a parameter-dependent Lyapunov function for those with
//! ρ̇ in the hull of the rate vertices. Under saturation it holds from every state with V ≤ γ. It is about the LPV model:
//! for a nonlinear plant it is what the plant's trajectories are embedded in. Theorems 4.5, 5.3 and 5.4 are this module at
//! single points ρ ([`frozen`]), and guarantee nothing once ρ moves.
//!
//! What each theorem states, for which shapes and under which assumptions, and what it does not guarantee: [`Theorem`].
//!
//! The controller is u = −K(ρ)x with K(ρ) = (Σ ρᵢLᵢ)(Σ ρᵢYᵢ)⁻¹, of which Kᵢ = LᵢYᵢ⁻¹ are the values at the vertices; for
//! a common Y it is Σ ρᵢKᵢ.

mod inequality;
mod moderation;
mod objective;
mod primed;
mod rates;
mod regulation;
mod restatement;
mod separation;
mod stabilization;
mod theorem;
mod trade_off;
mod unstabilizable;

pub use moderation::{BackOff, Moderation};
pub use objective::Objective;
pub use rates::rate_box_vertices;
pub use separation::Separation;
pub use theorem::Theorem;
pub use trade_off::{TradeOff, TradeOffPoint};
pub use unstabilizable::UnstabilizablePoint;

use super::units::Units;
use super::{CostWeights, HighGainOptions, SynthesisError};
use crate::math::Mat;
use crate::math::matrix::{inverse_spd, symmetric_part};
use crate::math::stabilizability::{Mode, Stabilizability, stabilizability};
use crate::model::{FrozenModel, Polytope};
use inequality::Unknowns;
use lmi::{Answer, Explanation, Expr, InaccurateReason, Options, Outcome, Problem};
use moderation::Moderated;
use regulation::{Regulation, WhereStalled};
use stabilization::Stabilization;
use std::cell::OnceCell;

/// The Lyapunov function xᵀY(ρ)⁻¹x.
#[derive(Clone, Debug, PartialEq)]
pub enum Lyapunov {
    /// Y(ρ) = Y.
    Common,
    /// Y(ρ) = Σ ρᵢYᵢ.
    ParameterDependent {
        /// νₖ with Σᵢ νₖᵢ = 0: ρ̇ is in their hull (4.19).
        rate_vertices: Vec<Vec<f64>>,
    },
}

/// |uᵢ| ≤ σᵢ, and the level of the set {x: V ≤ γ} on which the design is to hold.
#[derive(Clone, Debug, PartialEq)]
pub struct InputBounds {
    /// σᵢ > 0, one for each input; infinite where one is not limited (of a certificate; synthesis asks for limits).
    pub sigma: Vec<f64>,
    /// γ > 0
    pub gamma: f64,
}

/// What is asked for.
#[derive(Clone, Debug)]
pub struct PolytopicRequest {
    /// Q ⪰ 0 and R ≻ 0 of the cost; `None` asks for stability alone (Theorems 4.1, 4.2).
    pub weights: Option<CostWeights>,
    /// Which Lyapunov function.
    pub lyapunov: Lyapunov,
    /// Input saturation (chapter 5).
    pub saturation: Option<InputBounds>,
    /// The gain may saturate on the set (Theorems 5.2, 5.4); needs `saturation` and `weights`.
    pub high_gain: Option<HighGain>,
    /// What is optimised. Stabilisation has its own: the largest margin.
    pub objective: Objective,
    /// How much of the optimum is given back for a gain that can be applied.
    pub back_off: BackOff,
}

/// How the gain on K_s = F + s(R⁻¹BᵀP − F) is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HighGain {
    /// How much cost may be given away, and how robust the sampled loop has to be.
    pub options: HighGainOptions,
    /// Time between two samples of the controller; `None`: it is continuous.
    pub sample_time_s: Option<f64>,
}

/// What was found, whatever the outcome.
#[derive(Clone, Debug)]
pub struct PolytopicDesign {
    /// The solver's answer: outcome, objective, blocks with rigorous margins, witness. Where a part of the optimum was given back objective
    /// and blocks are those of the design that is returned, and the outcome is that of the optimum.
    pub answer: Answer,
    /// What was given back of the optimum; `None` where nothing was asked for.
    pub moderation: Option<Moderation>,
    /// Why there is no solution, where there is none.
    pub explanation: Option<Explanation>,
    /// A point of the polytope that no input can stabilise, or that only seems so: where it is proved there is no solution, whatever the solver says.
    pub unstabilizable: Option<UnstabilizablePoint>,
    /// Proof that the vertices have no common Lyapunov function.
    pub separation: Option<Separation>,
    /// A motion that costs nothing and does not decay, of one vertex, which is proved.
    pub undetectable: Option<Mode>,
    /// Where the answer's blocks and objective are those of the Riccati solution, made strict by this ε
    /// ([`crate::math::riccati::strict`]): they are proved at it, and it is the solution.
    pub riccati: Option<f64>,
    /// Y, L and gains where the problem was solved, and at the best point so far where the solver stopped short.
    pub solution: Option<Solution>,
}

impl PolytopicDesign {
    /// Whether Y and L satisfy every inequality, with a proved margin: at the optimum, or with a part of it given back.
    pub fn is_solved(&self) -> bool {
        let is_proved = self.moderation.is_some() || self.riccati.is_some();
        self.solution.is_some() && (is_proved || self.answer.outcome.is_feasible())
    }

    /// The optimum of what was asked for, whatever was given back of it.
    pub fn optimum(&self) -> f64 {
        self.moderation.as_ref().map_or(self.answer.objective, |moderation| moderation.optimum)
    }

    /// Whether it is refuted, by the solver's witness or by a point that is proved not to be stabilisable.
    pub fn is_infeasible(&self) -> bool {
        self.separation.is_some()
            || self.unstabilizable.as_ref().is_some_and(|point| point.is_proved)
            || matches!(self.answer.outcome, Outcome::Infeasible(_))
    }

    fn without_solution(answer: Answer) -> Self {
        Self {
            answer,
            moderation: None,
            explanation: None,
            unstabilizable: None,
            separation: None,
            undetectable: None,
            riccati: None,
            solution: None,
        }
    }

    /// A witness of the solver excludes solutions up to a size. Of one vertex that is stabilisable it is known that there are larger ones.
    fn withdraw_infeasible(&mut self, polytope: &Polytope) {
        if matches!(self.answer.outcome, Outcome::InfeasibleWithin(_))
            && polytope.len() == 1
            && stabilizability(polytope.a(0), polytope.b(0)) == Stabilizability::Stabilizable
        {
            self.answer.outcome = Outcome::Inaccurate(InaccurateReason::NotVerified);
            self.explanation = None;
        }
    }
}

/// The matrices of a design, one for each vertex.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Yᵢ ≻ 0, n × n; the same N times for a common Lyapunov function.
    pub y: Vec<Mat<f64>>,
    /// Lᵢ, m × n.
    pub l: Vec<Mat<f64>>,
    /// Pᵢ = Yᵢ⁻¹.
    pub p: Vec<Mat<f64>>,
    /// Kᵢ = LᵢYᵢ⁻¹.
    pub gain: Vec<Mat<f64>>,
    /// Fᵢ = MᵢYᵢ⁻¹, unsaturated on the set, of the high-gain designs.
    pub auxiliary_gain: Option<Vec<Mat<f64>>>,
    /// s on K_s, of the high-gain designs.
    pub s: Option<f64>,
    /// Smallest eigenvalue of the performance inequality of every mixture of the rows of Kᵢ and Fᵢ at every vertex, with its
    /// name, in floating point: (5.12), (5.20) for the gain that is returned. Empty unless it is a high gain.
    pub mixtures: Vec<(String, f64)>,
}

impl Solution {
    /// P(ρ) = (Σ ρᵢYᵢ)⁻¹ at convex weights; `None` where it is not definite.
    pub fn lyapunov_matrix(&self, rho: &[f64]) -> Option<Mat<f64>> {
        let n = self.y[0].nrows();
        inverse_spd(&Mat::from_fn(n, n, |i, j| rho.iter().zip(&self.y).map(|(weight, y)| weight * y[(i, j)]).sum()))
    }
}

/// The optimum of a request, from which a design follows for every back-off: what takes most of the time is done once.
pub struct FirstStage {
    polytope: Polytope,
    request: PolytopicRequest,
    /// In units of its own.
    own: Option<(Units, Optimum)>,
    /// As the problem is stated, where that is needed.
    stated: OnceCell<Optimum>,
}

enum Optimum {
    Stabilization(Box<Stabilization>),
    Regulation(Box<Regulation>),
}

impl Optimum {
    fn new(polytope: &Polytope, request: &PolytopicRequest) -> Result<Self, SynthesisError> {
        Ok(match &request.weights {
            Some(weights) => {
                Self::Regulation(Box::new(Regulation::new(polytope, request, weights, WhereStalled::Refute)?))
            }
            None => Self::Stabilization(Box::new(Stabilization::new(polytope, &request.lyapunov)?)),
        })
    }

    fn design(&self, back_off: BackOff) -> Result<PolytopicDesign, SynthesisError> {
        match self {
            Self::Stabilization(stage) => stage.design(back_off),
            Self::Regulation(stage) => stage.design(back_off),
        }
    }

    fn answer(&self) -> &Answer {
        match self {
            Self::Stabilization(stage) => stage.answer(),
            Self::Regulation(stage) => stage.answer(),
        }
    }
}

impl FirstStage {
    /// Solve for the optimum of `request` over `polytope`, whatever its back-off.
    ///
    /// # Errors
    /// Problems without meaning. Infeasible, unbounded and inaccurate are outcomes in the answers of the designs.
    ///
    /// # Panics
    /// If sizes of weights, bounds, rates or objective do not fit the polytope; for a high gain of more than 10 inputs with a general R, or of
    /// more than 64.
    pub fn new(polytope: &Polytope, request: &PolytopicRequest) -> Result<Self, SynthesisError> {
        let own = match primed::units(polytope, request) {
            Some(units) => {
                let optimum = Optimum::new(&primed::polytope(&units, polytope), &primed::request(&units, request))?;
                Some((units, optimum))
            }
            None => None,
        };
        Ok(Self { polytope: polytope.clone(), request: request.clone(), own, stated: OnceCell::new() })
    }

    /// The design with `back_off` of the optimum given back.
    ///
    /// # Errors
    /// Problems without meaning; no high gain that is stable at the sample time, with the number of the vertex (from 0) for the
    /// parameter.
    pub fn design(&self, back_off: BackOff) -> Result<PolytopicDesign, SynthesisError> {
        // an error, and what is refuted, is told of the problem as it is stated
        if let Some((units, optimum)) = &self.own
            && let Ok(design) = optimum.design(back_off)
            && let Some(design) = restatement::restated(&self.polytope, &self.request, units, design)
        {
            return Ok(design);
        }
        self.stated()?.design(back_off)
    }

    fn stated(&self) -> Result<&Optimum, SynthesisError> {
        if let Some(optimum) = self.stated.get() {
            return Ok(optimum);
        }
        let optimum = Optimum::new(&self.polytope, &self.request)?;
        Ok(self.stated.get_or_init(|| optimum))
    }

    /// R⁻¹ of the effort uᵀRu that is kept small.
    fn r_inverse(&self) -> Option<Mat<f64>> {
        match &self.request.weights {
            Some(weights) => inverse_spd(&weights.r),
            None => Some(stabilization::input_units(&self.polytope)),
        }
    }

    /// f*, as far as the solver came, and whether that is the optimum to its tolerance.
    fn optimum(&self) -> Result<(f64, bool), SynthesisError> {
        Ok(match &self.own {
            Some((units, optimum)) => {
                let answer = optimum.answer();
                (primed::objective_factor(units, &self.request) * answer.objective, answer.outcome.is_optimal())
            }
            None => {
                let answer = self.stated()?.answer();
                (answer.objective, answer.outcome.is_optimal())
            }
        })
    }
}

/// The theorem of `request` for `polytope`.
///
/// # Errors
/// As [`FirstStage::new`] and [`FirstStage::design`].
///
/// # Panics
/// As [`FirstStage::new`].
pub fn synthesize(polytope: &Polytope, request: &PolytopicRequest) -> Result<PolytopicDesign, SynthesisError> {
    FirstStage::new(polytope, request)?.design(request.back_off)
}

/// Theorems 4.5, 5.1-5.4 at single models: each is designed as if the parameter stood still there.
///
/// # Errors
/// As [`synthesize`], with the number of the model for the parameter.
pub fn frozen(models: &[FrozenModel], request: &PolytopicRequest) -> Result<Vec<PolytopicDesign>, SynthesisError> {
    let request = PolytopicRequest { lyapunov: Lyapunov::Common, ..request.clone() };
    let each = |(k, model)| {
        synthesize(&Polytope::hull(std::slice::from_ref(model)), &request).map_err(|error| error.moved_to(k as f64))
    };
    models.iter().enumerate().map(each).collect()
}

/// Settings of the solver. The optimum of tr Y is flat: a relative gap g moves P by about √g, and 10⁻¹² gives the bound
/// x(0)ᵀPx(0) six digits where the default, 10⁻⁹, gives four or five. Where rounding ends the iteration sooner, what was reached counts.
fn solver() -> Options {
    Options { gap_tolerance: 1e-12, ..Options::default() }
}

/// The Yᵢ without repetition.
fn distinct<'a>(y: &'a [Expr], lyapunov: &Lyapunov) -> Vec<&'a Expr> {
    match lyapunov {
        Lyapunov::Common => vec![&y[0]],
        Lyapunov::ParameterDependent { .. } => y.iter().collect(),
    }
}

/// Read the matrices from the answer; explain it where it is infeasible.
fn finish(
    problem: &Problem,
    moderated: Moderated,
    unknowns: &Unknowns,
    auxiliary: Option<&[Expr]>,
) -> Result<PolytopicDesign, SynthesisError> {
    let Moderated { answer, moderation } = moderated;
    let explanation = problem.explain(&answer, &solver())?;
    let solution = match answer.outcome {
        Outcome::Solved | Outcome::SolvedToTolerance(_) | Outcome::Inaccurate(_) => {
            let values =
                |of: &[Expr]| -> Vec<Mat<f64>> { of.iter().map(|expression| answer.value(expression)).collect() };
            let y: Vec<Mat<f64>> = values(&unknowns.y).iter().map(symmetric_part).collect();
            let l = values(&unknowns.l);
            let p: Option<Vec<Mat<f64>>> = y.iter().map(inverse_spd).collect();
            p.map(|p| Solution {
                gain: l.iter().zip(&p).map(|(l, p)| l * p).collect(),
                auxiliary_gain: auxiliary.map(|m| values(m).iter().zip(&p).map(|(m, p)| m * p).collect()),
                s: None,
                mixtures: Vec::new(),
                y,
                l,
                p,
            })
        }
        Outcome::Infeasible(_)
        | Outcome::InfeasibleWithin(_)
        | Outcome::Unbounded(_)
        | Outcome::UnboundedToTolerance(_) => None,
    };
    Ok(PolytopicDesign { moderation, explanation, solution, ..PolytopicDesign::without_solution(answer) })
}
