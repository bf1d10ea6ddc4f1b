//! Steps of supervised controllers: did the flight stay in the certified sets and within the certified rate, and what is
//! proved about them?

use crate::scenario::{ControllerPlan, Scenario};
use lpv::certificate::{Claim, ClaimKind, Of, SupervisedProofs, Verdict, Words};
use lpv::math::angle::wrap;
use lpv::sim::{Flight, Performance, SetStay, set_stay};
use lpv::synthesis::Design;
use serde::Serialize;

/// A step, as far as its certificate goes.
#[derive(Clone, Serialize)]
pub struct StepStay {
    /// When it began.
    pub time_s: f64,
    /// How it kept to sets and rate.
    #[serde(flatten)]
    pub stay: SetStay,
    /// The statement, with its verdict.
    #[serde(skip)]
    pub claim: Claim,
    /// Its verdict: `proved` is certified.
    pub verdict: Verdict,
}

/// Each step of a supervised flight. A step is certified, `proved`, if every claim of its design is proved and the flight
/// was inside the sets and the rate of these proofs all the time.
pub fn step_stays(
    scenario: &Scenario,
    plan: &ControllerPlan,
    design: &Design,
    proofs: Option<&SupervisedProofs>,
    flight: &Flight,
    performance: &Performance,
) -> Vec<StepStay> {
    let trajectory = &flight.trajectory;
    if trajectory.set_shares.is_empty() {
        return Vec::new();
    }
    let scheduling = scenario.plant.description().scheduling.as_ref();
    let rate = proofs.and_then(|proofs| proofs.rate).or(design.rate_bounded.as_ref().map(|bounded| bounded.rate));
    let allowed = rate.unwrap_or(f64::INFINITY);
    let first_sample = |time_s: f64| trajectory.time_s.partition_point(|&t| t < time_s - 1e-9);
    let step = |(k, response): (usize, &lpv::sim::StepResponse)| {
        let next = scenario.reference.step_times().into_iter().find(|&t| t > response.time_s);
        let samples = first_sample(response.time_s)..next.map_or(trajectory.time_s.len(), first_sample);
        let share = |member: usize, watched: f64| proofs.map_or(watched, |proofs| proofs.share(member, watched));
        let stay = set_stay(trajectory, samples, scheduling.map(|scheduling| scheduling.state), allowed, share);
        let mut reasons = Vec::new();
        match proofs {
            None => reasons.push("the design was not proved in this run: see lpv certify".to_owned()),
            Some(proofs) if proofs.verdict() < Verdict::Proved => {
                let open = proofs.claims.iter().find(|claim| claim.verdict < Verdict::Proved);
                let name = open.map_or("", |claim| &claim.claim);
                reasons.push(format!("of the design it is not proved that {name}"));
            }
            Some(proofs) if !move_is_absorbed(scenario, design, proofs, response.time_s) => {
                reasons.push("the move is farther than its reference is proved to be a motion of the model".into());
            }
            Some(_) => {}
        }
        if let Some(from) = stay.outside_from_s {
            reasons.push(format!("outside the set from t = {from:.3} s, for {:.3} s", stay.outside_s));
        }
        if let (Some(from), Some(scheduling)) = (stay.fast_from_s, scheduling) {
            let (parameter, unit) = (&scheduling.parameter, &scheduling.unit);
            let duration = stay.fast_s;
            reasons
                .push(format!("{parameter} faster than {allowed} {unit}/s from t = {from:.3} s, for {duration:.3} s"));
        }
        if plan.noise {
            reasons.push("noise acts, of which the proof knows nothing".into());
        }
        if flight.outcome != lpv::sim::Outcome::Completed {
            reasons.push("the flight diverged".into());
        }
        let peak = format!("V at most {:.3} of the level, at t = {:.2} s", stay.peak_share, stay.peak_share_time_s);
        let motion = match scheduling {
            Some(s) => format!("; |d{}/dt| at most {:.2e} {}/s", s.parameter, stay.peak_rate, s.unit),
            None => String::new(),
        };
        let verdict = if reasons.is_empty() { Verdict::Proved } else { Verdict::Undecided };
        let reasons: String = reasons.iter().map(|reason| format!("; {reason}")).collect();
        let kind = ClaimKind::StepStays { step: k + 1, time_s: response.time_s };
        let claim = Claim::new(kind, Of::Model, &Words::default()).decided(
            verdict,
            1.0 - stay.peak_share,
            peak + &motion + &reasons,
        );
        StepStay { time_s: response.time_s, stay, claim, verdict }
    };
    performance.steps.iter().enumerate().map(step).collect()
}

/// Whether the proof that references are motions of the model covers the set point at `time_s`.
fn move_is_absorbed(scenario: &Scenario, design: &Design, proofs: &SupervisedProofs, time_s: f64) -> bool {
    let governor = design.controller.supervisor.as_ref().and_then(|supervisor| supervisor.governor.as_ref());
    let (Some(governor), Some(motion_proof)) = (governor, &proofs.motion) else { return true };
    let Some(motion) = &governor.motion else { return true };
    let states = &scenario.plant.description().states;
    let (before, after) = (scenario.reference.at(time_s - 1e-6), scenario.reference.at(time_s));
    let difference = |&state: &usize| {
        let difference = after[state] - before[state];
        if states[state].wraps { wrap(difference) } else { difference }
    };
    let delta: Vec<f64> = governor.set_point_states.iter().map(difference).collect();
    let still = delta.iter().all(|&delta| delta == 0.0);
    still || motion_proof.absorbs(governor, motion, &delta, design.controller.scheduling_state)
}
