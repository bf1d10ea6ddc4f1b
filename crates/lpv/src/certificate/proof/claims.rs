//! Attempts as claims, and the claims that all others rest on: a Lyapunov function, and inputs that do not saturate.

use super::cells::{Attempt, Cells, LEAST_HALF};
use super::closed_loop::{ClosedLoop, Row};
use super::matrix::CellMatrix;
use super::place::Place;
use crate::certificate::claim::{Claim, ClaimKind, Of, Verdict, Words};
use crate::math::decimal::{about, at_least};
use crate::math::interval::Interval;
use crate::mutant;
use crate::plant::Plant;
use std::time::Instant;

/// What the level of the certified set is multiplied by until it is proved: between grid points a little is lost.
const LEVELS: [f64; 5] = [1.0, 0.999, 0.995, 0.98, 0.9];

/// Names of the plant's parameter.
pub(in super::super) fn words(plant: &dyn Plant) -> Words {
    let parameter = plant.description().scheduling.as_ref();
    Words {
        parameter: parameter.map_or(String::new(), |s| s.parameter.clone()),
        unit: parameter.map_or(String::new(), |s| s.unit.clone()),
        lyapunov: "x'P x",
    }
}

impl Words {
    pub(super) fn claim(
        &self,
        kind: ClaimKind,
        attempt: Attempt,
        closed_loop: &ClosedLoop,
        cells: usize,
        started: Instant,
    ) -> Claim {
        let at = |place: &Place| match closed_loop.has_parameter {
            true => format!(" at parameter {}", about(closed_loop.parameter(place.middle))),
            false => String::new(),
        };
        let (verdict, margin, detail, place) = match attempt {
            Attempt::Proved(margin) => {
                (Verdict::Proved, margin, format!("relative margin {}, {cells} cells", at_least(margin)), None)
            }
            Attempt::Refuted { place, rate, value, .. } => {
                let rate = if rate == 0.0 { String::new() } else { format!(" with rate {}", about(rate)) };
                (Verdict::Undecided, value, format!("its condition fails{}{rate}", at(&place)), Some(place))
            }
            Attempt::Open { place } => {
                let detail = format!(
                    "open{} on a cell of {} of a grid step: too close to the edge to be told",
                    at(&place),
                    about(2.0 * place.half)
                );
                (Verdict::Undecided, f64::NAN, detail, Some(place))
            }
        };
        let at = place.filter(|_| closed_loop.has_parameter).map(|place| closed_loop.parameter(place.middle));
        let claim = Claim::new(kind, Of::Model, self).decided(verdict, margin, detail);
        Claim { at, cells, seconds: started.elapsed().as_secs_f64(), ..claim }
    }
}

pub(super) fn definite(closed_loop: &ClosedLoop, words: &Words) -> Claim {
    let started = Instant::now();
    let mut cells = Cells::new(closed_loop.pieces, 1, |place: &Place| closed_loop.bordered(place, None));
    let attempt = cells.prove(LEAST_HALF, &|matrix: &CellMatrix, half| vec![(0.0, matrix.is_positive(half))]);
    let attempt = if mutant::is("definiteness-assumed") { Attempt::Proved(0.5) } else { attempt };
    let witness = closed_loop.witness(&attempt);
    words.claim(ClaimKind::LyapunovDefinite, attempt, closed_loop, cells.len(), started).refuted_by(witness)
}

/// The claim that no limited input saturates on the set of level γ, asked for or found, and of the level that is proved; it is
/// added to `claims`, and a second one where less than was asked for is proved. The level of the set that further claims are about:
/// `None` where nothing can saturate and they hold everywhere.
pub(super) fn unsaturated(
    closed_loop: &ClosedLoop,
    words: &Words,
    asked: Option<f64>,
    is_claimed: bool,
    claims: &mut Vec<Claim>,
) -> Option<f64> {
    let rows = closed_loop.limited_rows();
    if rows.is_empty() {
        return None;
    }
    let gamma = asked.unwrap_or_else(|| closed_loop.unsaturated_level());
    let started = Instant::now();
    if let Some(&stuck) = rows.iter().find(|&&i| closed_loop.sigma[i] <= 0.0) {
        let kind = ClaimKind::Unsaturated { level: gamma };
        let detail =
            format!("input {} has no room on one side of its operating value, and its gain is not zero", stuck + 1);
        let claim = Claim::new(kind, Of::Model, words).decided(Verdict::Undecided, f64::NAN, detail);
        claims.push(claim.resting_on(&["lyapunov-definite"]));
        return Some(gamma);
    }
    let attempt = |level: f64| {
        let mut cells = Cells::new(closed_loop.pieces, rows.len(), |place: &Place| {
            closed_loop.bordered(place, Some((Row::Limited(rows[place.variant]), Interval::point(1.0) / level)))
        });
        let attempt = cells.prove(LEAST_HALF, &|matrix: &CellMatrix, half| vec![(0.0, matrix.is_positive(half))]);
        let attempt = if mutant::is("level-unchecked") { Attempt::Proved(0.5) } else { attempt };
        (level, attempt, cells.len())
    };
    let mut attempts = LEVELS.into_iter().map(|factor| attempt(factor * gamma));
    let first = attempts.next().expect("there are levels");
    let (level, attempt, cells) = match first.1 {
        Attempt::Proved(_) => first,
        _ => attempts.find(|(_, attempt, _)| matches!(attempt, Attempt::Proved(_))).unwrap_or(first),
    };
    let level = if mutant::is("level-not-lowered") { gamma } else { level };
    let is_proved = matches!(attempt, Attempt::Proved(_));
    let witness = closed_loop.saturates(&attempt, &rows);
    let kind = ClaimKind::Unsaturated { level };
    let claim = words.claim(kind, attempt, closed_loop, cells, started).resting_on(&["lyapunov-definite"]);
    claims.push(claim.refuted_by(witness));
    if let Some(asked) = asked.filter(|asked| is_claimed && is_proved && *asked != level) {
        let kind = ClaimKind::AsAsked { what: "level", asked, proved: Some(level) };
        claims.push(Claim::new(kind, Of::Model, words));
    }
    Some(level)
}
