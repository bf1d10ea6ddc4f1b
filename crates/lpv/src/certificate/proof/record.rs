//! Records of proofs: everything that another program needs to check them, with no number rounded.
//!
//! A record is lines of JSON. The first says the format, how many lines follow and the SHA-256 of their bytes. Then come designs,
//! then claims, each numbered from 0 in its kind; a claim names its design and, as `premises`, the claims that it rests on. Numbers
//! are hexadecimal floating point, `0x1.8000000000000p+1`, as C's `%a` and Python's `float.hex` write them: exactly the doubles of
//! the proof. A claim over a range of the parameter carries the cells on which it was proved, without factors and margins: who
//! checks makes his own. `docs/proved.md` has the format; `validation/checker` reads it.
//!
//! Only what is proved is recorded. The proof of each claim is found again from the widest cells, so that the record has as few as can be.

mod sha256;

use super::cells::{Attempt, Cells, LEAST_HALF};
use super::closed_loop::Unprovable;
use super::closed_loop::{ByRows, ClosedLoop, Form, Row};
use super::decrease::{DecreaseProof, Found};
use super::matrix::CellMatrix;
use super::place::Place;
use super::polytopic::{PolytopicClaim, PolytopicLyapunov};
use super::proofs::Proofs;
use super::sampled_constant;
use super::sampled_saturated::{self, SaturatedCell, Times};
use crate::certificate::{Claim, ClaimKind, Motion, Of, SupervisedProofs, Verdict};
use crate::math::Mat;
use crate::math::eigen::smallest_eigenvalue;
use crate::math::interval::Interval;
use crate::math::matrix::to_rows;
use crate::plant::Plant;
use crate::synthesis::Design;
use serde::Serialize;
use serde_json::{Map, Value, json};

/// What the first line names.
const FORMAT: &str = "lpv proof record 1";
/// Share of the least eigenvalues that is claimed as a bound on them.
const EIGENVALUE_SHARE: f64 = 0.5;
/// Parameter values at which they are looked for.
const EIGENVALUE_SAMPLES: usize = 128;
/// Keys of a design at a grid point, and of a whole one, that the theorems speak of.
const POINT_KEYS: [&str; 4] = ["rho", "gain", "auxiliary_gain", "p"];
const DESIGN_KEYS: [&str; 8] =
    ["name", "convention", "plant", "weights", "sample_time_s", "controller", "points", "rate_bounded"];
const GOVERNOR_KEYS: [&str; 4] = ["set_point_states", "operating_state", "parameter_rate", "motion"];

/// Why there is no record.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RecordError {
    /// Nothing can be proved of the design.
    #[error(transparent)]
    Unprovable(#[from] Unprovable),
    /// The proof was not found again.
    #[error("the proof was not found again from the widest cells: {0}")]
    NotFound(&'static str),
    /// A number that is none, or a design that is no JSON.
    #[error("cannot be written: {0}")]
    Unwritable(String),
}

/// A record in the making.
#[derive(Clone, Debug, Default)]
pub struct Record {
    designs: Vec<Value>,
    claims: Vec<Value>,
}

/// Kinds of claims of the record, and the names of the certificate's claims that they hold.
const DEFINITE: (&str, &[&str]) = ("definite", &["lyapunov-definite"]);
const UNSATURATED: (&str, &[&str]) = ("unsaturated", &["unsaturated"]);
const DECREASE: (&str, &[&str]) = ("decrease", &["decrease", "invariance"]);
const COST: (&str, &[&str]) = ("cost", &["cost"]);
const SAMPLED: (&str, &[&str]) = ("sampled", &["sampled-stability"]);
const KEPT: (&str, &[&str]) = ("kept", &["sampled-invariance"]);
const SAMPLED_COST: (&str, &[&str]) = ("sampled-cost", &["sampled-cost"]);

/// The proved claim of this kind about the model.
fn proved<'c>(claims: &'c [Claim], (_, names): (&str, &[&str])) -> Option<&'c Claim> {
    let is_it = |claim: &&Claim| names.contains(&claim.id.name) && claim.of == Of::Model;
    claims.iter().filter(is_it).find(|claim| claim.verdict == Verdict::Proved)
}

impl Record {
    /// Add what is proved of a design and its inner members.
    ///
    /// # Errors
    /// A proof that is not found again.
    pub fn add_design(
        &mut self,
        design: &Design,
        plant: &dyn Plant,
        proofs: &SupervisedProofs,
    ) -> Result<(), RecordError> {
        let outer = self.designs.len();
        let mut costs = Vec::new();
        for (k, (member, proofs)) in std::iter::once(design).chain(&design.inner).zip(&proofs.members).enumerate() {
            let closed_loop = ClosedLoop::new(member, plant)?;
            let mut value = of_design(member, &closed_loop)?;
            value.insert("inner_of".into(), if k == 0 { Value::Null } else { json!(outer) });
            self.add("design", value)?;
            costs.extend(self.add_member(&closed_loop, member, proofs)?);
        }
        let is_moving = proofs.motion.as_ref().is_some_and(|motion| motion.claim.verdict == Verdict::Proved);
        if is_moving && costs.len() == proofs.members.len() {
            let bounds: Vec<Value> = std::iter::once(design)
                .chain(&design.inner)
                .map(|member| Ok(least_eigenvalues(&ClosedLoop::new(member, plant)?)))
                .collect::<Result<_, Unprovable>>()?;
            let value =
                json!({"design": outer, "kind": "motion", "premises": costs, "bounds": bounds, "farthest": 1000.0});
            self.add("claim", object(value))?;
        }
        Ok(())
    }

    /// Add the claims of one member; the number of its cost claim, if that is proved.
    fn add_member(
        &mut self,
        closed_loop: &ClosedLoop,
        design: &Design,
        proofs: &Proofs,
    ) -> Result<Option<usize>, RecordError> {
        let at = self.designs.len() - 1;
        let claim = |kind: &str, premises: &[usize], groups: Vec<Value>| {
            object(json!({"design": at, "kind": kind, "premises": premises, "groups": groups}))
        };
        let mut premises = Vec::new();
        if proved(&proofs.claims, DEFINITE).is_some() {
            premises.push(self.add("claim", claim(DEFINITE.0, &[], definite(closed_loop)?))?);
        }
        if let (Some(level), Some(_)) = (proofs.level, proved(&proofs.claims, UNSATURATED)) {
            let mut value = claim(UNSATURATED.0, &premises, unsaturated(closed_loop, level)?);
            value.insert("level".into(), json!(level));
            premises.push(self.add("claim", value)?);
        }
        let needed = 1 + usize::from(proofs.level.is_some());
        let founded = premises.clone();
        let mut cost = None;
        for (place, kind) in [DECREASE, COST].into_iter().enumerate() {
            let Some(found) = proved(&proofs.claims, kind).filter(|_| premises.len() == needed + place) else { break };
            let (rate, factor) = match found.kind {
                ClaimKind::Decrease { motion } | ClaimKind::Invariance { motion, .. } => (rate_of(motion), None),
                ClaimKind::Cost { motion, factor, .. } => (rate_of(motion), Some(factor)),
                _ => break,
            };
            let mut value = claim(kind.0, &premises, falling(closed_loop, rate, factor)?);
            value.extend(object(json!({"rate": rate, "level": proofs.level})));
            if let Some(factor) = factor {
                value.insert("factor".into(), json!(factor));
            }
            let number = self.add("claim", value)?;
            premises.push(number);
            cost = factor.map(|_| number);
        }
        let (mut kept, time) = (None, design.sample_time_s);
        if let (Some(level), Some(_), true) = (proofs.level, proved(&proofs.claims, KEPT), founded.len() == needed) {
            // one that takes mixtures is not recorded
            if let Some((times, cells)) = kept_cells(closed_loop, time) {
                let mut value = claim(KEPT.0, &founded, cells);
                value.extend(object(json!({"level": level, "sample_time_s": time, "between": times == Times::All})));
                kept = Some(self.add("claim", value)?);
            }
        }
        if proved(&proofs.claims, SAMPLED).is_some() {
            // V that falls under every mixture falls under K; one that is proved by other means than a matrix for each cell is not recorded
            let cells = kept.map_or_else(|| sampled_cells(closed_loop, time), |_| Ok(Vec::new()));
            if let Ok(cells) = cells {
                let mut value = claim(SAMPLED.0, &kept.into_iter().collect::<Vec<usize>>(), cells);
                value.insert("sample_time_s".into(), json!(time));
                self.add("claim", value)?;
            }
        }
        if let (Some(found), true) = (proved(&proofs.claims, SAMPLED_COST), founded.len() == needed)
            && let ClaimKind::SampledCost { factor, level, sample_time_s } = found.kind
        {
            let mut value = claim(SAMPLED_COST.0, &founded, mixtures(&closed_loop.saturating()));
            value.extend(object(json!({"factor": factor, "level": level, "sample_time_s": sample_time_s})));
            self.add("claim", value)?;
        }
        Ok(cost)
    }

    /// Add what is proved over a polytope: `claims` is what `prove_polytopic` says of `claim`.
    ///
    /// # Errors
    /// A number that is none.
    pub fn add_polytopic(&mut self, claim: &PolytopicClaim, claims: &[Claim]) -> Result<(), RecordError> {
        let polytope = &claim.polytope;
        let each = |of: &dyn Fn(usize) -> Value| (0..polytope.len()).map(of).collect::<Vec<Value>>();
        let all = |matrices: &[Mat<f64>]| matrices.iter().map(to_rows).collect::<Vec<_>>();
        let mut value = object(json!({
            "A": each(&|i| json!(to_rows(polytope.a(i)))),
            "B": each(&|i| json!(to_rows(polytope.b(i)))),
            "F": claim.auxiliary_gain.as_deref().map(all),
            "weights": claim.weights.as_ref().map(plain).transpose()?,
            "sigma": claim.saturation.as_ref().map(|bounds| &bounds.sigma),
        }));
        match &claim.lyapunov {
            PolytopicLyapunov::Common { p, gain } => {
                value.extend(object(json!({"P": to_rows(p), "K": all(gain)})));
            }
            PolytopicLyapunov::ParameterDependent { y, l, rate_vertices } => {
                value.extend(object(json!({"Y": all(y), "L": all(l), "rate_vertices": rate_vertices})));
            }
        }
        let at = self.add("polytope", value)?;
        let mut premises: Vec<usize> = Vec::new();
        let is_claimed = |kind: &(&str, &[&str])| claims.iter().any(|claim| kind.1.contains(&claim.id.name));
        for kind in [DEFINITE, UNSATURATED, DECREASE, COST].into_iter().filter(is_claimed) {
            let Some(found) = proved(claims, kind) else { break };
            let mut value = object(json!({"design": at, "kind": kind.0, "premises": premises}));
            let (level, factor) = match found.kind {
                ClaimKind::Unsaturated { level } | ClaimKind::Invariance { level, .. } => (Some(level), None),
                ClaimKind::Cost { level, factor, .. } => (level, Some(factor)),
                _ => (None, None),
            };
            if kind != DEFINITE {
                value.insert("level".into(), json!(level));
            }
            if let Some(factor) = factor {
                value.insert("factor".into(), json!(factor));
            }
            premises.push(self.add("claim", value)?);
        }
        Ok(())
    }

    /// Whether nothing is recorded.
    pub fn is_empty(&self) -> bool {
        self.claims.is_empty()
    }

    /// The file.
    pub fn text(&self) -> String {
        let mut body = String::new();
        for line in self.designs.iter().chain(&self.claims) {
            body.push_str(&line.to_string());
            body.push('\n');
        }
        let lines = self.designs.len() + self.claims.len();
        let head = json!({"format": FORMAT, "lines": lines, "sha256": sha256::sha256(body.as_bytes())});
        format!("{head}\n{body}")
    }

    /// Add a design, polytope or claim; its number.
    fn add(&mut self, what: &str, mut value: Map<String, Value>) -> Result<usize, RecordError> {
        let list = if what == "claim" { &mut self.claims } else { &mut self.designs };
        let number = list.len();
        value.insert(what.into(), json!(number));
        list.push(exact(Value::Object(value))?);
        Ok(number)
    }
}

/// Largest rate of the parameter.
fn rate_of(motion: Motion) -> f64 {
    match motion {
        Motion::Bounded { rate } => rate,
        _ => 0.0,
    }
}

fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

/// The entries with these keys.
fn picked(value: Value, keys: &[&str]) -> Map<String, Value> {
    object(value).into_iter().filter(|(key, _)| keys.contains(&key.as_str())).collect()
}

fn plain(value: impl Serialize) -> Result<Value, RecordError> {
    serde_json::to_value(value).map_err(|error| RecordError::Unwritable(error.to_string()))
}

/// Every number that is no integer as hexadecimal floating point.
fn exact(value: Value) -> Result<Value, RecordError> {
    Ok(match value {
        Value::Number(number) if number.is_f64() => {
            Value::String(hexadecimal(number.as_f64().ok_or_else(|| RecordError::Unwritable(number.to_string()))?))
        }
        Value::Array(items) => Value::Array(items.into_iter().map(exact).collect::<Result<_, _>>()?),
        Value::Object(map) => Value::Object(
            map.into_iter().map(|(key, value)| Ok((key, exact(value)?))).collect::<Result<_, RecordError>>()?,
        ),
        other => other,
    })
}

/// `x` as hexadecimal floating point, as Python's `float.hex` writes it.
fn hexadecimal(x: f64) -> String {
    let bits = x.to_bits();
    let sign = if x.is_sign_negative() { "-" } else { "" };
    let (exponent, fraction) = (bits >> 52 & 0x7ff, bits & ((1 << 52) - 1));
    match (exponent, fraction) {
        (0, 0) => format!("{sign}0x0.0p+0"),
        (0, _) => format!("{sign}0x0.{fraction:013x}p-1022"),
        _ => format!("{sign}0x1.{fraction:013x}p{:+}", exponent as i64 - 1023),
    }
}

/// The data of a design that its claims are about; P(ρ) of a frozen one as it was joined.
fn of_design(design: &Design, closed_loop: &ClosedLoop) -> Result<Map<String, Value>, RecordError> {
    let mut value = picked(plain(design)?, &DESIGN_KEYS);
    if let Some(Value::Array(points)) = value.get_mut("points") {
        points.iter_mut().for_each(|point| *point = Value::Object(picked(point.take(), &POINT_KEYS)));
    }
    // of a family and a governor, what flies and how references move
    if let Some(supervisor) = value.get_mut("controller").and_then(|controller| controller.get_mut("supervisor"))
        && supervisor.is_object()
    {
        if let Some(Value::Array(inner)) = supervisor.get_mut("inner") {
            inner.iter_mut().for_each(|member| *member = Value::Object(picked(member.take(), &["schedule"])));
        }
        if let Some(governor) = supervisor.get_mut("governor").filter(|governor| governor.is_object()) {
            *governor = Value::Object(picked(governor.take(), &GOVERNOR_KEYS));
        }
        *supervisor = Value::Object(picked(supervisor.take(), &["inner", "governor"]));
    }
    if let (Form::Direct(p), true) = (&closed_loop.form, closed_loop.has_parameter) {
        value.insert("joined".into(), json!({"p": plain(p)?, "auxiliary": plain(&closed_loop.auxiliary)?}));
    }
    value.insert("pieces".into(), json!(closed_loop.pieces));
    Ok(value)
}

/// The cells of one group: without gaps, each ends where the next one begins.
fn group<M>(cells: &[super::cells::Cell<M>], more: impl Fn(&M, &mut Vec<Value>)) -> Vec<Value> {
    let begin = |k: usize| match cells.get(k).map(|cell| cell.place) {
        None => cells[0].place.piece as f64 + 1.0,
        Some(place) if k == 0 => place.piece as f64,
        Some(place) => place.middle - place.half,
    };
    let cell = |k: usize| {
        let mut value = vec![json!(begin(k)), json!(begin(k + 1))];
        more(&cells[k].matrix, &mut value);
        Value::Array(value)
    };
    (0..cells.len()).map(cell).collect()
}

fn groups<M>(cells: &Cells<M>, variant: impl Fn(&Place) -> Value, more: impl Fn(&M, &mut Vec<Value>)) -> Vec<Value> {
    let of_group = |cells: &Vec<super::cells::Cell<M>>| {
        let place = cells[0].place;
        json!({"piece": place.piece, "variant": variant(&place), "cells": group(cells, &more)})
    };
    cells.groups.iter().map(of_group).collect()
}

fn found(attempt: &Attempt, claim: &'static str) -> Result<(), RecordError> {
    match attempt {
        Attempt::Proved(_) => Ok(()),
        _ => Err(RecordError::NotFound(claim)),
    }
}

fn definite(closed_loop: &ClosedLoop) -> Result<Vec<Value>, RecordError> {
    let mut cells = Cells::new(closed_loop.pieces, 1, |place: &Place| closed_loop.bordered(place, None));
    let attempt = cells.prove(LEAST_HALF, &|matrix: &CellMatrix, half| vec![(0.0, matrix.is_positive(half))]);
    found(&attempt, "P is positive definite")?;
    Ok(groups(&cells, |_| Value::Null, |_, _| ()))
}

fn unsaturated(closed_loop: &ClosedLoop, level: f64) -> Result<Vec<Value>, RecordError> {
    let rows = closed_loop.limited_rows();
    let mut cells = Cells::new(closed_loop.pieces, rows.len(), |place: &Place| {
        closed_loop.bordered(place, Some((Row::Limited(rows[place.variant]), Interval::point(1.0) / level)))
    });
    let attempt = cells.prove(LEAST_HALF, &|matrix: &CellMatrix, half| vec![(0.0, matrix.is_positive(half))]);
    found(&attempt, "the low gain does not saturate")?;
    Ok(groups(&cells, |place| json!(rows[place.variant]), |_, _| ()))
}

/// Of the decrease, or with a factor of the cost. The variant is "rows" where the saturation is taken row by row, each cell with α/κ of
/// the inputs that may saturate; else the list of those that fly K, the others flying F.
fn falling(closed_loop: &ClosedLoop, rate: f64, factor: Option<f64>) -> Result<Vec<Value>, RecordError> {
    let weights = [factor.unwrap_or(1.0), if factor.is_some() { 1.0 } else { 0.0 }];
    let mut proof = DecreaseProof::new(closed_loop);
    found(&proof.at(rate, weights), "V decreases")?;
    let saturating = closed_loop.saturating();
    match proof.found() {
        Found::ByRows(cells) => {
            let multipliers = |cell: &ByRows, value: &mut Vec<Value>| {
                value.push(json!(cell.multipliers.iter().map(|c| c / weights[0]).collect::<Vec<f64>>()));
            };
            Ok(groups(cells, |_| json!("rows"), multipliers))
        }
        Found::ByMixtures(cells) => {
            let cells = cells.ok_or(RecordError::NotFound("V decreases"))?;
            Ok(groups(cells, |place| flying(place.variant, &saturating), |_, _| ()))
        }
    }
}

/// The inputs of a mixture that fly K, of those that may saturate; null where none may.
fn flying(mixture: usize, saturating: &[usize]) -> Value {
    match saturating.is_empty() {
        true => Value::Null,
        false => {
            json!((0..saturating.len()).filter(|i| mixture >> i & 1 == 1).map(|i| saturating[i]).collect::<Vec<_>>())
        }
    }
}

/// The one cell that there is without a parameter, of every mixture. Their matrices follow from the design, and are not recorded.
fn mixtures(saturating: &[usize]) -> Vec<Value> {
    let group = |mixture| json!({"piece": 0, "variant": flying(mixture, saturating), "cells": [[0.0, 1.0]]});
    (0..1_usize << saturating.len()).map(group).collect()
}

/// Each with its X.
fn sampled_cells(closed_loop: &ClosedLoop, sample_time_s: f64) -> Result<Vec<Value>, RecordError> {
    let (cells, attempt) = sampled_constant::prove_cells(closed_loop, sample_time_s);
    found(&attempt, "the sampled loop is stable")?;
    Ok(groups(&cells, |_| Value::Null, |cell, value| value.push(json!(to_rows(&cell.x.middle())))))
}

/// Each with the cᵢ of its inputs that may saturate, and whether between the samples too; `None` where they prove nothing.
fn kept_cells(closed_loop: &ClosedLoop, sample_time_s: f64) -> Option<(Times, Vec<Value>)> {
    [Times::All, Times::Samples].into_iter().find_map(|times| {
        let (cells, attempt) = sampled_saturated::prove_cells(closed_loop, sample_time_s, times);
        let by_rows = cells.groups.iter().flatten().all(|cell| cell.matrix.multipliers.is_some());
        let multipliers = |cell: &SaturatedCell, value: &mut Vec<Value>| value.push(json!(cell.multipliers));
        let is_proved = by_rows && matches!(attempt, Attempt::Proved(_));
        is_proved.then(|| (times, groups(&cells, |_| Value::Null, multipliers)))
    })
}

/// q and y with Q ⪰ qI and Y(ρ) ⪰ yI, as guesses.
fn least_eigenvalues(closed_loop: &ClosedLoop) -> Value {
    let of_form = |k: usize| {
        let t = closed_loop.pieces as f64 * k as f64 / EIGENVALUE_SAMPLES as f64;
        closed_loop.inverse_and_gain(t).map_or(0.0, |(y, _)| smallest_eigenvalue(&y))
    };
    let y = (0..EIGENVALUE_SAMPLES).map(of_form).fold(f64::INFINITY, f64::min);
    let q = smallest_eigenvalue(&closed_loop.weights.q);
    json!({"q": EIGENVALUE_SHARE * q, "y": EIGENVALUE_SHARE * y})
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As Python writes them: `[x.hex() for x in (0.0, -0.0, 3.0, -0.1, 5e-324, 1.7976931348623157e308)]`.
    #[test]
    fn numbers_are_written_as_python_does() {
        assert_eq!(hexadecimal(0.0), "0x0.0p+0");
        assert_eq!(hexadecimal(-0.0), "-0x0.0p+0");
        assert_eq!(hexadecimal(3.0), "0x1.8000000000000p+1");
        assert_eq!(hexadecimal(-0.1), "-0x1.999999999999ap-4");
        assert_eq!(hexadecimal(5e-324), "0x0.0000000000001p-1022");
        assert_eq!(hexadecimal(f64::MAX), "0x1.fffffffffffffp+1023");
    }
}
