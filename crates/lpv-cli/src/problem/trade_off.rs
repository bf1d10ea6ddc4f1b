//! `lpv design --trade-off`: what each share of the optimum that is given back buys, as a table, as data and as a picture.

use super::plan::{ProblemPlan, Scope};
use crate::certify::polytopic::SOLVED;
use crate::failure::Failure;
use crate::figure::{Axis, Dash, Figure, Panel, Style};
use crate::scenario::door::Door;
use lpv::certificate::Verdict;
use lpv::math::decimal::{about, at_least, at_most};
use lpv::synthesis::polytopic::Objective;
use serde::Serialize;
use std::path::Path;

/// The shares that are tried; 0 is the bare optimum.
pub const SHARES: [f64; 9] = [0.0, 0.001, 0.003, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4];

/// Gain against optimum.
#[derive(Clone, Serialize)]
pub struct TradeOffCurve {
    /// The best possible value of `objective`; of an optimum that is not attained what the solver came to.
    pub optimum: f64,
    /// Whether the optimum is attained, to the solver's tolerance.
    pub optimum_is_attained: bool,
    /// Whether the objective is a cost bound, the smaller the better.
    #[serde(skip)]
    pub(super) is_cost_bound: bool,
    /// What the values of the objective are.
    pub objective_is: &'static str,
    /// The share that the design of the answer has given back; null where the answer holds no design.
    pub chosen: Option<f64>,
    /// What chose it.
    pub chosen_by: &'static str,
    /// One for each share, ascending.
    pub points: Vec<TradeOffRow>,
}

/// What one share buys.
#[derive(Clone, Serialize)]
pub struct TradeOffRow {
    /// The share of the optimum that is given back; 0: the bare optimum.
    pub back_off: f64,
    /// `solved`: proved, as an answer with this back-off would be; `inaccurate`: found and not proved; `none`: no design was found.
    pub status: &'static str,
    /// What is known of the design.
    pub verdict: Verdict,
    /// The objective that it has.
    pub achieved: Option<f64>,
    /// √τ: the largest √(uᵀRu) on {V ≤ 1}.
    pub effort: Option<f64>,
    /// Largest singular value of the Kᵢ. Of a design that is not proved a number for the picture, and no answer.
    pub largest_gain: Option<f64>,
}

impl TradeOffRow {
    pub(super) fn without_design(back_off: f64) -> Self {
        let verdict = Verdict::Undecided;
        Self { back_off, status: "none", verdict, achieved: None, effort: None, largest_gain: None }
    }

    fn is_proved(&self) -> bool {
        self.status == SOLVED && self.verdict >= Verdict::Numerical
    }
}

/// Refuse a problem that has nothing to trade.
pub fn check(plan: &ProblemPlan, file: &Path) -> Result<(), Failure> {
    let is_single = matches!(plan.scope, Scope::Frozen) || plan.models.len() == 1;
    let is_riccati =
        plan.weights.is_some() && plan.saturation.is_none() && matches!(plan.objective, Objective::Trace) && is_single;
    match is_riccati {
        true => refuse(
            file,
            "is for designs that give a part of an optimum back; the regulator of one model without limits attains its own, by the Riccati equation",
        ),
        false => Ok(()),
    }
}

/// Refuse a file that the option is not for.
pub fn refuse<T>(file: &Path, message: &str) -> Result<T, Failure> {
    Door { file }.refuse("--trade-off", message)
}

impl TradeOffCurve {
    /// The table, as text.
    pub fn text(&self) -> String {
        let number = |value: Option<f64>| value.filter(|value| value.is_finite()).map_or("-".to_owned(), about);
        // a cost bound is rounded up, what is maximised down
        let toward = if self.is_cost_bound { at_most } else { at_least };
        let mut rows = vec![["given back", "achieved", "effort", "largest gain", ""].map(str::to_owned)];
        for row in &self.points {
            let share = if row.back_off > 0.0 { percent(row.back_off) } else { "nothing".into() };
            let mut notes = Vec::new();
            if row.back_off == 0.0 && !self.optimum_is_attained {
                notes.push("the optimum is not attained".to_owned());
            }
            match row.status {
                "none" => notes.push("no design".to_owned()),
                SOLVED if !row.is_proved() => notes.push(row.verdict.word().to_owned()),
                SOLVED => {}
                _ => notes.push("not proved".to_owned()),
            }
            if self.chosen == Some(row.back_off) {
                notes.push(format!("<- {}", self.chosen_by));
            }
            rows.push([
                share,
                row.achieved.map_or("-".into(), toward),
                number(row.effort),
                number(row.largest_gain),
                notes.join(", "),
            ]);
        }
        let width = |j: usize| rows.iter().map(|row| row[j].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..4).map(width).collect();
        let line = |row: &[String; 5]| {
            let cells: String =
                (0..4).map(|j| format!("{}{}  ", " ".repeat(widths[j] - row[j].chars().count()), row[j])).collect();
            format!("{}\n", (cells + &row[4]).trim_end())
        };
        format!("\ngain against the optimum ({})\n", self.objective_is) + &rows.iter().map(line).collect::<String>()
    }

    /// The picture: gain and effort over the share that is given back, all logarithmic; nothing given back stands beside the scale.
    pub fn figure(&self, title: &str) -> Figure {
        let gain = |row: &TradeOffRow| row.largest_gain;
        let effort = |row: &TradeOffRow| row.effort;
        let chosen = match self.chosen {
            Some(share) if share > 0.0 => format!("the design: {} ({})", percent(share), self.chosen_by),
            Some(_) => format!("the design: nothing ({})", self.chosen_by),
            None => String::new(),
        };
        let mut legend = vec![("proved".to_owned(), PROVED), ("not proved".to_owned(), OPEN), (chosen, CHOSEN)];
        legend.retain(|(label, style)| match *style {
            PROVED => self.points.iter().any(TradeOffRow::is_proved),
            OPEN => self.points.iter().any(|row| !row.is_proved() && row.largest_gain.is_some()),
            _ => !label.is_empty(),
        });
        Figure {
            number: "",
            title: format!("{title}: gain against optimum"),
            caption: self.text(),
            columns: 2,
            aspect: 0.8,
            panels: vec![
                self.panel("largest gain, ‖K‖", &gain),
                self.panel("effort, largest √(uᵀRu) on V ≤ 1", &effort),
            ],
            legend,
        }
    }

    fn panel(&self, title: &str, of: &dyn Fn(&TradeOffRow) -> Option<f64>) -> Panel {
        let least = self.points.iter().map(|row| row.back_off).filter(|&share| share > 0.0).fold(1.0, f64::min);
        let nothing = least.log10() - BESIDE;
        let x = |row: &TradeOffRow| if row.back_off > 0.0 { row.back_off.log10() } else { nothing };
        let y = |row: &TradeOffRow| of(row).filter(|value| *value > 0.0).map_or(f64::NAN, f64::log10);
        let points = |rows: &dyn Fn(&TradeOffRow) -> bool| -> Vec<[f64; 2]> {
            self.points.iter().filter(|row| rows(row)).map(|row| [x(row), y(row)]).collect()
        };
        let ticks = SHARES.iter().filter(|share| **share == 0.0 || **share >= least);
        let label = |share: f64| if share > 0.0 { about(100.0 * share) } else { "0".into() };
        let place = |share: f64| if share > 0.0 { share.log10() } else { nothing };
        let last = self.points.last().map_or(0.0, x);
        let x_axis = Axis {
            range: Some([nothing - MARGIN, last + MARGIN]),
            ticks: ticks.map(|&share| (place(share), label(share))).collect(),
            ..Axis::new("share of the optimum that is given back / %")
        };
        let values = self.points.iter().filter_map(of).filter(|value| value.is_finite());
        let y_axis = Axis::logarithmic("", values);
        let bottom = y_axis.range.map_or(0.0, |[low, high]| low + 0.05 * (high - low));
        // what stands beside the scale is not joined to it
        let is_joined = |row: &TradeOffRow| row.is_proved() && row.back_off > 0.0;
        let mut panel = Panel::new(title, x_axis, y_axis)
            .line(points(&|_| true), Style::with(PROVED.color, Dash::Dotted))
            .line(
                self.points.iter().map(|row| [x(row), if is_joined(row) { y(row) } else { f64::NAN }]),
                Style::solid(0),
            )
            .line(points(&TradeOffRow::is_proved), PROVED)
            .line(points(&|row| !row.is_proved()), OPEN)
            .line(points(&|row| self.chosen == Some(row.back_off)), CHOSEN);
        for row in self.points.iter().filter(|row| of(row).is_none()) {
            panel.labels.push(([x(row), bottom], "none".into()));
        }
        if let Some(row) = self.points.iter().find(|row| row.back_off == 0.0 && !self.optimum_is_attained)
            && y(row).is_finite()
        {
            panel.notes.push(([x(row), y(row)], "optimum, not attained".into()));
        }
        panel
    }
}

const PROVED: Style = Style::with(0, Dash::Dots);
const OPEN: Style = Style::with(4, Dash::Crosses);
const CHOSEN: Style = Style::with(1, Dash::Rings);
/// How far beside the least share nothing stands, and room at both ends, in decades.
const BESIDE: f64 = 0.6;
const MARGIN: f64 = 0.2;

/// A share in per cent.
pub fn percent(share: f64) -> String {
    format!("{} %", about(100.0 * share))
}
