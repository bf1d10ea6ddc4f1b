//! A problem solved, and its answer as text and for machines.

use super::plan::{ProblemPlan, Scope};
use super::stages::{Stages, request};
use super::trade_off::{TradeOffCurve, TradeOffRow};
use super::verdict::{failure_at, verdict};
use crate::certify::polytopic::{self, SOLVED, Transformed};
use crate::failure::Failure;
use crate::scenario::door::Door;
use lmi::{Explanation, Outcome, Witness};
use lpv::certificate::{Claim, Of, Record, Verdict, worst};
use lpv::math::Mat;
use lpv::math::decimal::{Rounding, about, at_least, at_most, decimal, fixed};
use lpv::math::eigen::largest_singular_value;
use lpv::math::matrix::{quadratic_form, to_rows};
use lpv::model::{FrozenModel, Polytope};
use lpv::synthesis::SynthesisError;
use lpv::synthesis::polytopic::{
    BackOff, Lyapunov, Moderation, Objective, PolytopicDesign, PolytopicRequest, Solution, Theorem,
    UnstabilizablePoint, frozen,
};
use serde::Serialize;
use serde::ser::SerializeMap;
use std::path::Path;

type Rows = Vec<Vec<f64>>;

/// The word where nothing is known.
pub(super) const INACCURATE: &str = "inaccurate";

/// What `lpv design PROBLEM.toml --json` prints.
#[derive(Serialize)]
pub struct Report {
    /// solved, infeasible, unbounded or inaccurate; of several points the worst.
    pub status: &'static str,
    /// The theorem of the thesis that was solved.
    theorem: Theorem,
    /// The sign convention of K.
    convention: &'static str,
    /// tr Y or Σ tr Yᵢ; the cost bound where that is the objective; the reach along the directions; the margin of stability.
    objective: Option<f64>,
    /// What `objective` is.
    objective_is: &'static str,
    /// Whether the objective is a cost bound, the smaller the better.
    #[serde(skip)]
    pub(super) is_cost_bound: bool,
    /// The objective of the design that is returned; below the optimum where a part of it was given back.
    #[serde(skip_serializing_if = "Option::is_none")]
    achieved: Option<f64>,
    /// The share of the optimum that was given back for a smaller gain, at most; 0: nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    back_off: Option<f64>,
    /// Whether the optimum is attained, to the solver's tolerance; of one that is not, `objective` is what the solver came to.
    #[serde(skip_serializing_if = "Option::is_none")]
    optimum_is_attained: Option<bool>,
    /// Largest singular value of the Kᵢ.
    #[serde(skip_serializing_if = "Option::is_none")]
    largest_gain: Option<f64>,
    /// √τ: the largest √(uᵀRu) on {V ≤ 1}.
    #[serde(skip)]
    effort: Option<f64>,
    /// Gain against optimum, where it is asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trade_off: Option<TradeOffCurve>,
    /// How the Lyapunov function depends on the parameter.
    lyapunov: &'static str,
    /// What the design was made for: with it `lpv certify` needs no other file.
    model: ModelMatrices,
    /// Fingerprint of the model.
    model_hash: String,
    /// Of a tensor-product model: its weights, and the LPV model that the design is proved for.
    #[serde(skip_serializing_if = "Option::is_none")]
    tensor_product: Option<Transformed>,
    #[serde(skip_serializing_if = "Option::is_none")]
    weights: Option<WeightMatrices>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gamma: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rate_vertices: Option<Vec<Vec<f64>>>,
    /// Vertices or grid points, in the order of the matrices.
    places: Vec<String>,
    #[serde(rename = "Y")]
    y: Option<Vec<Rows>>,
    #[serde(rename = "P")]
    p: Option<Vec<Rows>>,
    #[serde(rename = "L")]
    l: Option<Vec<Rows>>,
    #[serde(rename = "K")]
    k: Option<Vec<Rows>>,
    /// The gain that stays unsaturated, of high-gain designs.
    #[serde(rename = "F", skip_serializing_if = "Option::is_none")]
    f: Option<Vec<Rows>>,
    /// s on K = F + s(R⁻¹BᵀP − F), at each vertex or point.
    #[serde(skip_serializing_if = "Option::is_none")]
    s: Option<Vec<f64>>,
    /// x(0)ᵀP(ρ(0))x(0).
    /// The thesis's word: a guarantee only where the verdict is `proved`.
    guaranteed_cost: Option<f64>,
    /// Whether x(0) is in the certified set.
    #[serde(skip_serializing_if = "Option::is_none")]
    inside_certified_set: Option<bool>,
    /// Proved lower bound on the smallest eigenvalue of each block.
    residuals: Margins,
    /// Smallest eigenvalue, in floating point, of the inequality of each mixture of rows of K and F, of high-gain designs.
    #[serde(skip_serializing_if = "Option::is_none")]
    mixtures: Option<Margins>,
    iterations: usize,
    seconds: f64,
    verdict: Verdict,
    /// Why the verdict is no better.
    verdict_reason: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    witness: Option<Vec<NamedMultiplier>>,
    /// A point of the polytope that no input can stabilise, where that is the reason, or seems to be.
    #[serde(rename = "unstabilizable_point", skip_serializing_if = "Option::is_none")]
    unstabilizable: Option<UnstabilizablePoint>,
    #[serde(skip_serializing_if = "Option::is_none")]
    explanation: Option<Explanation>,
    #[serde(skip)]
    has_no_common_function: bool,
    /// The place that the status, witness and explanation are of, if it is one of several.
    #[serde(skip_serializing_if = "Option::is_none")]
    place: Option<String>,
}

/// A and B at each vertex or point.
#[derive(Serialize)]
struct ModelMatrices {
    #[serde(rename = "A")]
    a: Vec<Rows>,
    #[serde(rename = "B")]
    b: Vec<Rows>,
}

#[derive(Serialize)]
struct WeightMatrices {
    #[serde(rename = "Q")]
    q: Rows,
    #[serde(rename = "R")]
    r: Rows,
}

/// Z of one block of the witness.
#[derive(Serialize)]
struct NamedMultiplier {
    name: String,
    multiplier: Rows,
}

/// Verified λ_min by block, a map in the order of the inequalities.
struct Margins(Vec<(String, f64)>);

impl Serialize for Margins {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, margin) in &self.0 {
            map.serialize_entry(name, &Some(margin).filter(|margin| margin.is_finite()))?;
        }
        map.end()
    }
}

/// Shares of the optimum that are given back in turn until the design is proved, where the file names none.
const PROVABLE: [BackOff; 6] = [
    BackOff::Knee,
    BackOff::Share(0.01),
    BackOff::Share(0.05),
    BackOff::Share(0.1),
    BackOff::Share(0.2),
    BackOff::Share(0.4),
];

/// Solve the problem. What is called solved is proved: every claim of `lpv certify` about the file that is written.
pub fn solve(plan: &ProblemPlan, path: &Path) -> Result<Report, Failure> {
    solve_from(&Stages::new(plan, path)?)
}

/// As [`solve`], from first stages that are solved.
pub(super) fn solve_from(stages: &Stages) -> Result<Report, Failure> {
    let plan = stages.plan;
    let tried: &[BackOff] = if plan.back_off == BackOff::Knee { &PROVABLE } else { &[plan.back_off] };
    let (mut of_polytope, mut first) = (None, None);
    for &back_off in tried {
        let (report, worth) = judged(stages, stages.designs(back_off)?, back_off)?;
        if report.status != SOLVED && worth.is_none() {
            // of a solver that stopped short on the way more of the optimum given back may be found
            if report.status == INACCURATE && report.k.is_some() {
                first.get_or_insert(report);
                continue;
            }
            return Ok(of_polytope.or(first).unwrap_or(report).without_unproved_gain());
        }
        match worth {
            Some(Worth::Everything) => return Ok(report),
            Some(Worth::Polytope) => of_polytope.get_or_insert(report),
            Some(Worth::Nothing) | None => first.get_or_insert(report),
        };
    }
    let answer = of_polytope.or(first).ok_or_else(|| Failure::Defect("no back-off was tried".into()))?;
    Ok(answer.without_unproved_gain())
}

/// The report of `designs` with what is proved of it; no worth where they are none.
pub(super) fn judged(
    stages: &Stages,
    designs: Vec<PolytopicDesign>,
    back_off: BackOff,
) -> Result<(Report, Option<Worth>), Failure> {
    let (plan, path) = (stages.plan, stages.path);
    let request = request(plan, back_off);
    let guaranteed = guaranteed_cost(plan, &designs, &request).map_err(|error| failure_at(plan, path, error))?;
    let theorem = Theorem::of(
        &Polytope::hull(&plan.models),
        &request,
        matches!(plan.scope, Scope::Frozen) && plan.models.len() > 1,
    );
    let mut report = report(plan, theorem, &designs, guaranteed);
    report.effort = stages.effort(&designs);
    // a file that our own door refuses has numbers that rounding got the better of
    let has_gain = report.status == SOLVED || report.status == INACCURATE && report.k.is_some();
    let claims = if has_gain { claims(&report, path).unwrap_or_default() } else { Vec::new() };
    report.take_what_is_proved(plan, &claims);
    report.seconds = stages.started.elapsed().as_secs_f64();
    let worth = (report.status == SOLVED).then(|| report.is_proved_by(plan, &claims));
    Ok((report, worth))
}

/// What is proved of a design.
pub(super) enum Worth {
    /// Every claim.
    Everything,
    /// Every claim about the polytope, and of the LPV model that it stands for not every one.
    Polytope,
    /// Less.
    Nothing,
}

/// What `lpv certify` says of the report as a file.
fn claims(report: &Report, path: &Path) -> Result<Vec<Claim>, Failure> {
    let text = serde_json::to_string(report).map_err(|error| Failure::serialisation(&error))?;
    polytopic::claims(&Door { file: path }, &text, None, &mut Record::default())
}

/// x(0)ᵀP(ρ(0))x(0); of a frozen design P is of ρ(0) itself.
fn guaranteed_cost(
    plan: &ProblemPlan,
    designs: &[PolytopicDesign],
    request: &PolytopicRequest,
) -> Result<Option<f64>, SynthesisError> {
    let Some(initial) = &plan.initial else { return Ok(None) };
    let p: Option<Mat<f64>> = match (&plan.scope, &initial.model) {
        (Scope::Frozen, Some(model)) => {
            let same = |other: &FrozenModel| other.a == model.a && other.b == model.b;
            match plan.models.iter().position(same) {
                Some(at) => designs[at].solution.as_ref().map(|solution| solution.p[0].clone()),
                None => {
                    // not one of the model's points: no place of that number
                    let here = frozen(std::slice::from_ref(model), request)
                        .map_err(|error| error.moved_to(plan.models.len() as f64))?;
                    here[0].solution.as_ref().map(|solution| solution.p[0].clone())
                }
            }
        }
        _ => designs[0].solution.as_ref().and_then(|solution| match &initial.parameter {
            Some(rho) => solution.lyapunov_matrix(rho),
            None => Some(solution.p[0].clone()),
        }),
    };
    Ok(p.map(|p| quadratic_form(&p, &initial.state)))
}

fn report(plan: &ProblemPlan, theorem: Theorem, designs: &[PolytopicDesign], guaranteed: Option<f64>) -> Report {
    let severity = |design: &PolytopicDesign| match status(design) {
        "infeasible" | "infeasible within a radius" => 3,
        "unbounded" | "unbounded to tolerance" => 2,
        INACCURATE => 1,
        _ => 0,
    };
    let worst = (0..designs.len()).rev().max_by_key(|&k| severity(&designs[k])).unwrap_or(0);
    let solutions: Option<Vec<&Solution>> = designs.iter().map(|design| design.solution.as_ref()).collect();
    let matrices = |of: &dyn Fn(&Solution) -> Vec<Mat<f64>>| {
        let all = solutions.as_ref()?.iter().flat_map(|solution| of(solution));
        Some(all.map(|matrix| to_rows(&matrix)).collect::<Vec<Rows>>())
    };
    let place = |k: usize| if designs.len() > 1 { format!("{}: ", plan.places[k]) } else { String::new() };
    let blocks = designs.iter().enumerate().flat_map(|(k, design)| {
        design
            .answer
            .blocks
            .iter()
            .map(move |block| (format!("{}{}", place(k), block.name), block.verified_lower_bound))
    });
    let inside = guaranteed.zip(plan.saturation.as_ref()).map(|(bound, saturation)| bound <= saturation.gamma);
    let (verdict, verdict_reason) = verdict(plan, &designs[worst], inside);
    let (objective, objective_is) = objective(plan, designs.iter().map(PolytopicDesign::optimum));
    let moderations: Vec<&Moderation> = designs.iter().filter_map(|design| design.moderation.as_ref()).collect();
    let gains = solutions.iter().flatten().flat_map(|solution| &solution.gain);
    let largest_gain = gains.map(largest_singular_value).reduce(f64::max);
    Report {
        status: status(&designs[worst]),
        theorem,
        convention: "u = -K x",
        lyapunov: match &plan.scope {
            Scope::Frozen => "frozen",
            Scope::Polytope(Lyapunov::Common) => "common",
            Scope::Polytope(Lyapunov::ParameterDependent { .. }) => "parameter-dependent",
        },
        model: ModelMatrices {
            a: plan.models.iter().map(|model| to_rows(&model.a)).collect(),
            b: plan.models.iter().map(|model| to_rows(&model.b)).collect(),
        },
        model_hash: Polytope::hull(&plan.models).fingerprint(),
        tensor_product: plan.transformed.clone(),
        weights: plan.weights.as_ref().map(|weights| WeightMatrices { q: to_rows(&weights.q), r: to_rows(&weights.r) }),
        sigma: plan.saturation.as_ref().map(|bounds| bounds.sigma.clone()),
        gamma: plan.saturation.as_ref().map(|bounds| bounds.gamma),
        rate_vertices: match &plan.scope {
            Scope::Polytope(Lyapunov::ParameterDependent { rate_vertices }) => Some(rate_vertices.clone()),
            _ => None,
        },
        objective: solutions.as_ref().and(objective),
        objective_is,
        is_cost_bound: plan.weights.is_some() && !plan.region && !matches!(plan.objective, Objective::Trace),
        achieved: solutions
            .as_ref()
            .and_then(|_| self::objective(plan, designs.iter().map(|design| design.answer.objective)).0),
        back_off: moderations.iter().map(|moderation| moderation.back_off).reduce(f64::max),
        optimum_is_attained: (!moderations.is_empty())
            .then(|| moderations.iter().all(|moderation| moderation.is_attained)),
        largest_gain,
        effort: None,
        trade_off: None,
        places: plan.places.clone(),
        y: matrices(&|solution| solution.y.clone()),
        p: matrices(&|solution| solution.p.clone()),
        l: matrices(&|solution| solution.l.clone()),
        k: matrices(&|solution| solution.gain.clone()),
        f: plan.high_gain.and_then(|_| matrices(&|solution| solution.auxiliary_gain.clone().unwrap_or_default())),
        s: solutions.as_ref().and_then(|all| all.iter().map(|solution| solution.s).collect()),
        guaranteed_cost: guaranteed,
        inside_certified_set: inside,
        residuals: Margins(blocks.collect()),
        mixtures: plan.high_gain.and(solutions.as_ref()).map(|all| {
            let of = |(k, solution): (usize, &&Solution)| -> Vec<(String, f64)> {
                solution.mixtures.iter().map(|(name, margin)| (format!("{}{name}", place(k)), *margin)).collect()
            };
            Margins(all.iter().enumerate().flat_map(of).collect())
        }),
        iterations: designs.iter().map(|design| design.answer.iterations.len()).sum(),
        seconds: 0.0,
        verdict,
        verdict_reason,
        witness: witness(&designs[worst]),
        unstabilizable: designs[worst].unstabilizable.clone(),
        has_no_common_function: designs[worst].separation.is_some(),
        explanation: designs[worst].explanation.clone(),
        place: (designs.len() > 1 && severity(&designs[worst]) > 0).then(|| plan.places[worst].clone()),
    }
}

fn status(design: &PolytopicDesign) -> &'static str {
    let outcome = &design.answer.outcome;
    match outcome {
        _ if design.is_infeasible() => "infeasible",
        _ if design.is_solved() => SOLVED,
        _ if design.undetectable.is_some() => "unbounded",
        _ if outcome.is_optimal() => INACCURATE,
        _ => outcome.word(),
    }
}

/// The objective of the problem, of those of its designs, with its name.
pub(super) fn objective(plan: &ProblemPlan, all: impl Iterator<Item = f64>) -> (Option<f64>, &'static str) {
    match (&plan.objective, &plan.saturation) {
        _ if plan.weights.is_none() => {
            (all.reduce(f64::min), "largest margin t with every inequality at least tI, tr Y <= n")
        }
        (Objective::Trace, _) => (Some(all.sum()), "sum of tr Y"),
        (_, Some(saturation)) if plan.region => {
            let reach = all.map(|bound| (saturation.gamma / bound).sqrt()).reduce(f64::min);
            (reach, "reach of the certified set along every direction, in multiples of it")
        }
        _ => (all.reduce(f64::max), "largest cost bound of the initial states"),
    }
}

/// The name that serde gives it.
fn word(theorem: &Theorem) -> String {
    serde_json::to_value(theorem).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

fn witness(design: &PolytopicDesign) -> Option<Vec<NamedMultiplier>> {
    let answer = &design.answer;
    if let Some(UnstabilizablePoint { weights, direction: w, direction_imaginary: v, is_proved: true, .. }) =
        &design.unstabilizable
    {
        let name =
            |i: usize| if weights.len() == 1 { "stability".into() } else { format!("stability at vertex {}", i + 1) };
        let imaginary = |i: usize| v.get(i).copied().unwrap_or(0.0);
        let entry = |i: usize, j: usize| w[i] * w[j] + imaginary(i) * imaginary(j);
        let multiplier = |share: f64| -> Rows {
            (0..w.len()).map(|i| (0..w.len()).map(|j| share * entry(i, j)).collect()).collect()
        };
        let each = |(i, &share): (usize, &f64)| NamedMultiplier { name: name(i), multiplier: multiplier(share) };
        return Some(weights.iter().enumerate().map(each).collect());
    }
    if let Some(separation) = &design.separation {
        let named = |(z, carrier): (&Mat<f64>, usize)| NamedMultiplier {
            name: format!("stability at vertex {}", carrier + 1),
            multiplier: to_rows(z),
        };
        return Some(separation.multipliers.iter().zip(0..).map(named).collect());
    }
    let (Outcome::Infeasible(Witness { multipliers, .. }) | Outcome::InfeasibleWithin(Witness { multipliers, .. })) =
        &answer.outcome
    else {
        return None;
    };
    let named = |(z, block): (&Mat<f64>, &lmi::BlockReport)| NamedMultiplier {
        name: block.name.clone(),
        multiplier: to_rows(z),
    };
    Some(multipliers.iter().zip(&answer.blocks).map(named).collect())
}

impl Report {
    /// Of a solver that stopped short what it came to is a design all the same where every one of its `claims` is proved.
    fn take_what_is_proved(&mut self, plan: &ProblemPlan, claims: &[Claim]) {
        let is_single = matches!(plan.scope, Scope::Polytope(_)) || plan.models.len() == 1;
        let is_proved = !claims.is_empty() && worst(claims) == Verdict::Proved;
        if self.status == INACCURATE && is_proved && is_single && self.inside_certified_set != Some(false) {
            (self.status, self.verdict, self.optimum_is_attained) = (SOLVED, Verdict::Proved, Some(false));
            self.verdict_reason =
                "every claim of lpv certify about K and P as they are printed; the solver stopped short of the optimum"
                    .into();
        }
    }

    /// The share of the optimum that the design of the report has given back; `None` where there is no design.
    pub(super) fn chosen_share(&self) -> Option<f64> {
        (self.status == SOLVED).then_some(self.back_off.unwrap_or(0.0))
    }

    /// As a point of the curve at `share`.
    pub(super) fn row(&self, share: f64) -> TradeOffRow {
        let Self { status, verdict, achieved, effort, largest_gain, .. } = *self;
        TradeOffRow { back_off: share, status, verdict, achieved, effort, largest_gain }
    }

    /// No gain is shown as if it were an answer.
    fn without_unproved_gain(mut self) -> Self {
        if self.status != SOLVED {
            (self.y, self.p, self.l, self.k, self.f) = (None, None, None, None, None);
            (self.s, self.achieved, self.largest_gain, self.guaranteed_cost) = (None, None, None, None);
        }
        self
    }

    /// Take the verdict from the `claims` about the file. What is not proved of the polytope is no solution.
    fn is_proved_by(&mut self, plan: &ProblemPlan, claims: &[Claim]) -> Worth {
        if !claims.is_empty() && worst(claims) == Verdict::Proved {
            if self.verdict == Verdict::Numerical {
                self.verdict = Verdict::Proved;
                self.verdict_reason = self.verdict_reason.replace(
                    "verified for Y and L at all vertices",
                    "every claim of lpv certify about K and P as they are printed",
                );
                if plan.transformed.is_some() {
                    self.verdict_reason += ", and for the LPV model itself in the ranges of its parameters, whatever the transformation's error";
                }
            }
            return Worth::Everything;
        }
        let open = claims.iter().find(|claim| claim.verdict != Verdict::Proved);
        let is_of_model =
            |claim: &&Claim| !matches!(claim.id.name, "weights" | "lyapunov-definite") && claim.of != Of::Polytope;
        let of_polytope = claims.iter().filter(|claim| plan.transformed.is_none() || !is_of_model(claim));
        if let Some(claim) = open.filter(|_| of_polytope.clone().all(|claim| claim.verdict == Verdict::Proved))
            && plan.transformed.is_some()
        {
            if self.verdict != Verdict::Undecided {
                self.verdict = Verdict::Undecided;
                self.verdict_reason = format!(
                    "proved of the polytope of the vertices alone; of the LPV model \"{}\" is {}: {}",
                    claim.claim,
                    claim.verdict.word(),
                    claim.detail
                );
            }
            return Worth::Polytope;
        }
        let open = open.map_or(String::new(), |claim| format!(": \"{}\" is {}", claim.claim, claim.verdict.word()));
        self.status = INACCURATE;
        self.verdict = Verdict::Undecided;
        let remedy = match plan.back_off {
            BackOff::Knee => "weights, limits or units of less different size may help",
            _ => "give more of the optimum back, or leave back_off out",
        };
        self.verdict_reason = format!("the design that was found cannot be proved{open}; {remedy}");
        Worth::Nothing
    }

    /// The answer as text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |name: &str, value: String| text.push_str(&format!("{name:16} {value}\n"));
        line("status", self.status.into());
        line("theorem", word(&self.theorem));
        if let Some(objective) = self.objective {
            line("objective", format!("{}  ({})", decimal(objective, 10, Rounding::Nearest), self.objective_is));
        }
        if let (Some(achieved), Some(share)) = (self.achieved, self.back_off) {
            let attained = self.optimum_is_attained.unwrap_or(true);
            let of = if attained { "the optimum" } else { "what the solver came to, an optimum that is not attained" };
            // a cost bound is rounded up, what is maximised down
            let achieved = if self.is_cost_bound { at_most(achieved) } else { at_least(achieved) };
            let given = match share > 0.0 {
                true => format!("{achieved}  (up to {} % of {of} given back for a smaller gain)", about(100.0 * share)),
                false => format!("{achieved}  ({of}, with a moderate gain)"),
            };
            line("achieved", given);
        }
        if let Some(gain) = self.largest_gain {
            line("largest gain", about(gain));
        }
        if let Some(k) = &self.k {
            for (place, k) in self.places.iter().zip(k) {
                for (i, row) in k.iter().enumerate() {
                    let numbers: Vec<String> = row.iter().map(|value| format!("{:>13}", fixed(*value, 6))).collect();
                    let name = if i == 0 { format!("K at {place}") } else { String::new() };
                    line(&name, format!("[{}]", numbers.join(" ")));
                }
            }
        }
        if let Some(s) = &self.s {
            line("s", s.iter().map(|s| about(*s)).collect::<Vec<_>>().join(", "));
        }
        if let Some(cost) = self.guaranteed_cost {
            line("cost bound", format!("{}  ({})", decimal(cost, 7, Rounding::Up), self.verdict.word()));
        }
        if let Some((name, margin)) =
            self.residuals.0.iter().min_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| self.k.is_some())
        {
            line(
                "least margin",
                format!("{}  proved, of {} blocks, in \"{name}\"", at_least(*margin), self.residuals.0.len()),
            );
        }
        line("verdict", format!("{}: {}", self.verdict.word(), self.verdict_reason));
        line("iterations", format!("{} in {:.4} s", self.iterations, self.seconds));
        if let Some(explanation) = self.explanation.as_ref().filter(|_| !self.has_unstabilizable_point()) {
            text.push_str(&format!("{explanation}\n"));
        }
        if let Some(curve) = &self.trade_off {
            text.push_str(&curve.text());
        }
        text
    }

    fn has_unstabilizable_point(&self) -> bool {
        self.unstabilizable.as_ref().is_some_and(|point| point.is_proved)
    }

    /// The failure that the status is, if it is one.
    pub fn failure(&self, path: &Path) -> Option<Failure> {
        let place = self.place.as_ref().map_or(String::new(), |place| format!(" at {place}"));
        let message = format!("{}: {}{place}: {}", path.display(), self.status, self.verdict_reason);
        match self.status {
            SOLVED => (self.verdict < Verdict::Numerical).then_some(Failure::NotCertified(message)),
            "infeasible" | "unbounded" => Some(Failure::NoOptimum(message + &self.relaxation())),
            INACCURATE => Some(Failure::NotCertified(message)),
            _ => Some(Failure::NotCertified(message + &self.relaxation())),
        }
    }

    /// What to relax, or which inequalities contradict each other.
    fn relaxation(&self) -> String {
        if let Some(point) = self.unstabilizable.as_ref().filter(|_| self.has_unstabilizable_point()) {
            if point.weights.iter().filter(|&&weight| weight > 1e-3).count() == 1 {
                return "; it needs an input there".into();
            }
            return "; leave that point out of the polytope: a smaller range, or vertices around the trajectories alone".into();
        }
        if self.has_no_common_function {
            return "; leave vertices out, divide the polytope, or take lyapunov = \"parameter-dependent\" with a bound on the rate".into();
        }
        let Some(explanation) = &self.explanation else { return String::new() };
        if let Some(carrier) = explanation.cheapest() {
            return format!("; relax \"{}\" first", carrier.name);
        }
        let carriers = explanation.carriers.iter().take(4);
        let shares: Vec<String> =
            carriers.map(|carrier| format!("\"{}\" ({:.0} %)", carrier.name, 100.0 * carrier.share)).collect();
        format!("; relax several of {}, none helps alone", shares.join(", "))
    }
}
