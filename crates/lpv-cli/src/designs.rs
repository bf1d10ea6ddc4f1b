//! Designs of a scenario: synthesis with progress, checks, JSON files.

use crate::failure::Failure;
use crate::folder::ResultFolder;
use crate::progress;
use crate::scenario::{ControllerPlan, Scenario, engineers_words};
use lpv::certificate::{
    Claim, ClaimKind, Member, Of, ProofOptions, Proofs, SupervisedProofs, Verdict, Words, check, merged, prove,
    prove_supervised, worst,
};
use lpv::synthesis::{Design, SynthesisError, design_supervised};
use serde::Serialize;
use std::time::Instant;

/// A design with what its check said.
pub struct CheckedDesign {
    /// The design.
    pub design: Design,
    /// Claims about it that need no flight.
    pub claims: Vec<Claim>,
    /// What is proved of a design that is supervised or required to be proved; `None` of others, which `lpv certify` proves.
    pub proofs: Option<SupervisedProofs>,
    /// Seconds that synthesis took; zero where a design was shared.
    pub design_seconds: f64,
    /// Seconds that the check took.
    pub check_seconds: f64,
}

impl CheckedDesign {
    /// The worst verdict of its claims.
    pub fn verdict(&self) -> Verdict {
        worst(&self.claims)
    }

    /// What `--json` prints of it.
    pub fn summary(&self) -> DesignSummary<'_> {
        let points = &self.design.points;
        DesignSummary {
            name: &self.design.name,
            method: self.design.method,
            convention: &self.design.convention,
            verdict: self.verdict(),
            trace_y: points.iter().map(|point| point.trace_y).collect(),
            parameters: points.iter().map(|point| point.rho).collect(),
            gain_at_first_parameter: lpv::math::matrix::to_rows(&points[0].gain),
            iterations: points.iter().map(|point| point.iterations).sum(),
            seconds: self.design_seconds,
            claims: &self.claims,
        }
    }
}

/// A design in a few lines, for machines.
#[derive(Serialize)]
pub struct DesignSummary<'a> {
    name: &'a str,
    #[serde(flatten)]
    method: lpv::synthesis::Method,
    convention: &'a str,
    verdict: Verdict,
    /// tr Y at each grid point.
    trace_y: Vec<f64>,
    /// Parameter value of each grid point.
    parameters: Vec<f64>,
    gain_at_first_parameter: Vec<Vec<f64>>,
    iterations: usize,
    seconds: f64,
    claims: &'a [Claim],
}

/// The verdict on the design called `label` and the claims about it, as text, a line each.
pub fn text(label: &str, verdict: Verdict, claims: &[Claim]) -> String {
    let mut text = format!("{label}: {}\n", verdict.word());
    for claim in claims {
        let detail = if claim.detail.is_empty() { String::new() } else { format!(" ({})", claim.detail) };
        text.push_str(&format!("  {}: {}{detail}\n", claim.verdict.word(), claim.claim));
    }
    text
}

/// A controller of a scenario that could not be designed.
#[derive(Serialize)]
pub struct Undesigned {
    /// Its place among the controllers of the file, from 0.
    #[serde(skip)]
    pub place: usize,
    /// Its name.
    pub name: String,
    /// What it is called in reports.
    pub label: String,
    /// Why.
    #[serde(rename = "not_designed", serialize_with = "as_text")]
    pub source: SynthesisError,
}

fn as_text<S: serde::Serializer>(error: &SynthesisError, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(error)
}

impl From<Undesigned> for Failure {
    fn from(Undesigned { name, source, .. }: Undesigned) -> Self {
        Failure::Synthesis { controller: name, source }
    }
}

/// Design and check every controller of the scenario, in its order. Controllers that differ only in how they are flown
/// share one synthesis. Those that cannot be designed are taken out of the scenario and returned beside the others.
///
/// # Errors
/// Bad input; the first failure where no controller at all is designed.
pub fn design_all(scenario: &mut Scenario) -> Result<(Vec<CheckedDesign>, Vec<Undesigned>), Failure> {
    let mut finished: Vec<(&ControllerPlan, CheckedDesign)> = Vec::new();
    let mut undesigned = Vec::new();
    for (place, plan) in scenario.controllers.iter().enumerate() {
        let request = &plan.request;
        let shared = finished.iter().find(|(earlier, _)| same_but_name(earlier, plan)).map(|(_, checked)| checked);
        let checked = match shared {
            Some(earlier) => Ok(CheckedDesign {
                design: Design { name: request.name.clone(), ..earlier.design.clone() },
                claims: earlier.claims.clone(),
                proofs: earlier.proofs.clone(),
                design_seconds: 0.0,
                check_seconds: 0.0,
            }),
            None => design_one(scenario, plan),
        };
        match checked {
            Ok(checked) => finished.push((plan, checked)),
            Err(source) => {
                undesigned.push(Undesigned { place, name: request.name.clone(), label: plan.label.clone(), source });
            }
        }
    }
    let designed: Vec<CheckedDesign> = finished.into_iter().map(|(_, checked)| checked).collect();
    // what is wrong with the file is said before anything is written
    let of_input = undesigned.iter().position(|undesigned| is_input(&undesigned.source));
    if let Some(at) = of_input.or((designed.is_empty() && !undesigned.is_empty()).then_some(0)) {
        return Err(undesigned.swap_remove(at).into());
    }
    let mut places = 0..;
    scenario.controllers.retain(|_| {
        let place = places.next();
        !undesigned.iter().any(|undesigned| Some(undesigned.place) == place)
    });
    Ok((designed, undesigned))
}

/// Whether a failure of synthesis is one of the file.
fn is_input(error: &SynthesisError) -> bool {
    matches!(error, SynthesisError::UnlimitedInput { .. } | SynthesisError::Problem(_))
}

/// Prove what can be proved of every design, and add it to its claims; what is only found of a frozen design, and not claimed,
/// is added where it is proved. `None` where nothing can be proved of a design. With `nonlinear` also of the nonlinear plant, a finding as well.
pub fn prove_all(scenario: &Scenario, checked: &mut [CheckedDesign], nonlinear: bool) -> Vec<Option<Proofs>> {
    let bar = progress::bar("prove", checked.len());
    let prove_one = |checked: &mut CheckedDesign| {
        if let Some(proofs) = checked.proofs.as_ref().filter(|_| !nonlinear) {
            // proved when it was designed
            bar.inc(1);
            return Some(proofs.members[0].clone());
        }
        let options = ProofOptions { nonlinear, ..ProofOptions::default() };
        let proofs = prove(&checked.design, &*scenario.plant, &options).ok();
        bar.inc(1);
        let told = |proofs: &Proofs| {
            let is_told = |claim: &&Claim| {
                proofs.is_counted(claim) && (claim.of == Of::Model || claim.verdict == Verdict::Proved)
            };
            proofs.claims.iter().filter(is_told).cloned().collect::<Vec<Claim>>()
        };
        if let Some(proofs) = &proofs {
            checked.claims = merged(std::mem::take(&mut checked.claims), told(proofs));
        }
        proofs
    };
    let proofs = checked.iter_mut().map(prove_one).collect();
    bar.finish_and_clear();
    proofs
}

fn same_but_name(a_plan: &ControllerPlan, b_plan: &ControllerPlan) -> bool {
    let supervisions = a_plan.supervision == b_plan.supervision;
    let (a, b) = (&a_plan.request, &b_plan.request);
    // all requests of a scenario share plant, weights, grid and sample time
    let requests =
        a.method == b.method && a.schedule == b.schedule && a.limits == b.limits && a.rate_bounded == b.rate_bounded;
    // one that is to be proved is proved once, too
    requests && supervisions && a_plan.require == b_plan.require
}

fn design_one(scenario: &Scenario, plan: &ControllerPlan) -> Result<CheckedDesign, SynthesisError> {
    let request = &plan.request;
    let grid_points = if scenario.plant.description().scheduling.is_some() { request.grid_points } else { 1 };
    let bar = progress::bar(&format!("design {}", request.name), grid_points);
    let started = Instant::now();
    let progress = |done| bar.set_position(done as u64);
    let design = design_supervised(&scenario.plant_spec, &*scenario.plant, request, &plan.supervision, &progress)?;
    let design_seconds = started.elapsed().as_secs_f64();
    bar.set_message(format!("check {}", request.name));
    let started = Instant::now();
    let mut claims = check(&design, &*scenario.plant);
    for (k, inner) in design.inner.iter().enumerate() {
        let of_inner = check(inner, &*scenario.plant).into_iter().map(|claim| claim.of_member(Member::Inner(k)));
        claims.extend(of_inner);
    }
    let mut proofs = None;
    if design.controller.supervisor.is_some() || plan.require == Some(Verdict::Proved) {
        bar.set_message(format!("prove {}", request.name));
        match prove_supervised(&design, &*scenario.plant, &ProofOptions::default()) {
            Ok(found) => {
                let counted = found.claims.iter().filter(|claim| found.members[0].is_counted(claim));
                claims = merged(claims, counted.cloned().collect());
                proofs = Some(found);
            }
            Err(reason) => {
                let provable = Claim::new(ClaimKind::Provable, Of::Model, &Words::default());
                claims.push(provable.decided(Verdict::Undecided, f64::NAN, reason.to_string()));
            }
        }
    }
    bar.finish_and_clear();
    Ok(CheckedDesign { design, claims, proofs, design_seconds, check_seconds: started.elapsed().as_secs_f64() })
}

/// Write the LPV model and the designs on it.
pub fn write_all(scenario: &Scenario, checked: &[CheckedDesign], folder: &ResultFolder) -> Result<(), Failure> {
    folder.write("model.json", &to_json(&scenario.model)?)?;
    for checked in checked {
        folder.write(&file_name(&checked.design.name), &to_json(&checked.design)?)?;
    }
    Ok(())
}

fn to_json(data: &impl Serialize) -> Result<Vec<u8>, Failure> {
    let mut json = serde_json::to_vec(data).map_err(|error| Failure::serialisation(&error))?;
    json.push(b'\n');
    Ok(json)
}

/// Read a design from `text` of `file`.
pub fn from_json(file: &std::path::Path, text: &str) -> Result<Design, Failure> {
    let unreadable = |message: String| Failure::Unreadable { file: file.to_owned(), message };
    let design: Design = serde_json::from_str(text).map_err(|error| {
        let message = engineers_words(&error.to_string());
        unreadable(format!("is not a design: {message}"))
    })?;
    if design.name.chars().any(char::is_control) {
        return Err(unreadable("name: has a control character".into()));
    }
    design.validate().map_err(|error| unreadable(format!("is not a usable design: {error}")))?;
    Ok(design)
}

/// File name of a controller's design.
pub fn file_name(controller: &str) -> String {
    format!("design-{controller}.json")
}
