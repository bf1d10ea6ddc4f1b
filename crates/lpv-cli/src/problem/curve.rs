//! A problem solved with the curve of gain against optimum.

use super::plan::ProblemPlan;
use super::solve::{INACCURATE, Report, judged, objective, solve_from};
use super::stages::Stages;
use super::trade_off::{SHARES, TradeOffCurve, TradeOffRow};
use super::verdict::failure_at;
use crate::certify::polytopic::SOLVED;
use crate::failure::Failure;
use lpv::synthesis::polytopic::{BackOff, FirstStage, PolytopicDesign, TradeOff};
use std::path::Path;

/// As `solve`, with the curve of gain against optimum, where there is an optimum.
pub fn solve_with_trade_off(plan: &ProblemPlan, path: &Path) -> Result<Report, Failure> {
    let stages = Stages::new(plan, path)?;
    let mut report = solve_from(&stages)?;
    if matches!(report.status, SOLVED | INACCURATE) {
        report.trade_off = Some(curve(&stages, &report)?);
    }
    Ok(report)
}

/// What an answer with `back_off` at each share would say, and `report`, the answer, at its own.
fn curve(stages: &Stages, report: &Report) -> Result<TradeOffCurve, Failure> {
    let plan = stages.plan;
    let chosen = report.chosen_share();
    let mut shares = SHARES.to_vec();
    if let Some(share) = chosen.filter(|share| !SHARES.contains(share)) {
        shares.push(share);
        shares.sort_by(f64::total_cmp);
    }
    let failed = |error| failure_at(plan, stages.path, error);
    let curve_of = |stage: &FirstStage| stage.trade_off(&shares).map_err(failed);
    let curves: Vec<TradeOff> = stages.each.iter().map(curve_of).collect::<Result<_, _>>()?;
    let row = |(k, &share): (usize, &f64)| -> Result<TradeOffRow, Failure> {
        if chosen == Some(share) {
            return Ok(report.row(share));
        }
        let designs = curves.iter().map(|curve| curve.points[k].design.clone());
        let Some(designs) = designs.collect::<Option<Vec<PolytopicDesign>>>() else {
            return Ok(TradeOffRow::without_design(share));
        };
        let back_off = if share > 0.0 { BackOff::Share(share) } else { BackOff::Nothing };
        Ok(judged(stages, designs, back_off)?.0.row(share))
    };
    let points = shares.iter().enumerate().map(row).collect::<Result<_, _>>()?;
    let (optimum, objective_is) = objective(plan, curves.iter().map(|curve| curve.optimum));
    Ok(TradeOffCurve {
        optimum: optimum.unwrap_or(f64::NAN),
        optimum_is_attained: curves.iter().all(|curve| curve.is_attained),
        is_cost_bound: report.is_cost_bound,
        objective_is,
        chosen,
        chosen_by: if plan.back_off == BackOff::Knee { "the knee" } else { "as the file asks" },
        points,
    })
}
