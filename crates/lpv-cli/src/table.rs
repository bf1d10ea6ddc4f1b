//! The table that ends a run.

use crate::designs::{CheckedDesign, Undesigned};
use crate::flown::Flown;
use crate::report::{bound_note, system_word};
use crate::scenario::Scenario;
use lpv::certificate::BoundOf;
use lpv::math::decimal::{at_most, fixed};
use lpv::sim::Outcome;

const HEADER: [&str; 8] =
    ["controller", "design", "cost bound (verdict)", "actual cost", "settling", "peak input", "saturated", "flight"];

/// All controllers side by side.
pub fn comparison(
    scenario: &Scenario,
    designs: &[CheckedDesign],
    undesigned: &[Undesigned],
    flights: &[Flown],
) -> String {
    let description = scenario.plant.description();
    let unit = description.inputs.first().map_or("", |signal| signal.unit.as_str());
    let mut rows = vec![HEADER.map(str::to_owned).to_vec()];
    for ((plan, checked), flown) in scenario.controllers.iter().zip(designs).zip(flights) {
        let performance = &flown.performance;
        let number = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |value| fixed(value, digits));
        let note = bound_note(scenario, flown);
        let verdict = flown.bound_verdict().word();
        let worth = if note.is_empty() { format!("({verdict})") } else { format!("({verdict}: {note})") };
        let bounds = [
            (BoundOf::Plant, flown.guaranteed_cost()),
            (BoundOf::PlantInContinuousTime, flown.plant_cost_bound()),
            (BoundOf::Model, flown.model_cost_bound()),
        ];
        let bound =
            bounds.into_iter().find_map(|(of, bound)| Some(format!("{} {} {worth}", system_word(of), at_most(bound?))));
        let bound = bound.unwrap_or(note);
        rows.push(vec![
            plan.label.clone(),
            checked.verdict().word().to_owned(),
            bound,
            number(performance.actual_cost, 4),
            performance.settling_time_s.map_or("-".into(), |time| format!("{time:.2} s")),
            format!("{} {unit}", fixed(performance.peak_input, 2)),
            format!("{} %", fixed(100.0 * performance.saturated_share, 1)),
            match flown.flight.outcome {
                Outcome::Completed => "completed".to_owned(),
                Outcome::EstimatorDiverged { time_s } => format!("DIVERGED at {time_s:.2} s (estimate)"),
                Outcome::Diverged { time_s, state, .. } => {
                    format!("DIVERGED at {time_s:.2} s ({})", description.states[state].name)
                }
            },
        ]);
    }
    for Undesigned { place, label, .. } in undesigned {
        let mut row = vec![label.clone(), "none".into()];
        row.resize(HEADER.len() - 1, "-".into());
        row.push("not designed".into());
        // where it stands in the file, after the header
        rows.insert(place + 1, row);
    }
    let reason = |Undesigned { label, source, .. }: &Undesigned| format!("{label}: {source}\n");
    let reasons: String = undesigned.iter().map(reason).collect();
    format_rows(&rows) + &reasons
}

/// Rows with columns aligned: the first three and the last to the left, numbers to the right.
fn format_rows(rows: &[Vec<String>]) -> String {
    let columns = rows[0].len();
    let width = |j: usize| rows.iter().map(|row| row[j].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        let cells: Vec<String> = (row.iter().enumerate())
            .map(|(j, cell)| {
                let padding = " ".repeat(widths[j] - cell.chars().count());
                if (3..columns - 1).contains(&j) { padding + cell } else { cell.clone() + &padding }
            })
            .collect();
        text.push_str(cells.join("  ").trim_end());
        text.push('\n');
        if i == 0 {
            text.push_str(&"-".repeat(widths.iter().sum::<usize>() + 2 * (columns - 1)));
            text.push('\n');
        }
    }
    text
}
