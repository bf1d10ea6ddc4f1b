//! Numbers of the thesis beside the recomputed ones.

use lpv::math::decimal::{Rounding, fixed, fixed_toward};
use serde::Serialize;

/// A number of a table, as printed and as it is.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// The row of the thesis.
    pub row: String,
    /// Which quantity: guaranteed or actual cost.
    pub quantity: &'static str,
    /// What the thesis printed.
    pub printed: Option<f64>,
    /// What is right; none where no value is.
    pub value: Option<f64>,
    /// Decimals that are worth showing.
    #[serde(skip)]
    pub decimals: usize,
    /// What the value is worth.
    pub standing: Standing,
    /// Why the two differ, or what the value rests on.
    pub reason: String,
}

/// What a number is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Standing {
    /// A bound that was checked in floating point, not proved.
    BoundNumerical,
    /// No bound for this initial state or this motion of the parameter.
    NoBound,
    /// A cost by integration, converged to the digits shown.
    Integrated,
    /// The least cost of any controller.
    Floor,
    /// Computed in floating point from the design or the model.
    Computed,
    /// Proved, for every parameter and with rounding accounted for.
    Proved,
    /// From elsewhere, not recomputed.
    Quoted,
    /// No solution exists: the number belongs to the witness.
    Refuted,
}

impl Standing {
    /// What the report prints.
    pub fn words(self) -> &'static str {
        match self {
            Standing::BoundNumerical => "bound (numerical)",
            Standing::NoBound => "no bound",
            Standing::Integrated => "integrated",
            Standing::Floor => "floor",
            Standing::Computed => "computed",
            Standing::Proved => "proved",
            Standing::Quoted => "quoted",
            Standing::Refuted => "refuted",
        }
    }
}

impl Entry {
    /// The recomputed number with its decimals; of a bound rounded to the safe side: costs up, rates, margins and regions down.
    pub fn shown(&self) -> String {
        let rounding = match self.standing {
            Standing::BoundNumerical if self.quantity.contains("cost") => Rounding::Up,
            Standing::BoundNumerical | Standing::Proved => Rounding::Down,
            _ => Rounding::Nearest,
        };
        self.value.map_or("–".into(), |value| fixed_toward(value, self.decimals, rounding))
    }

    /// The printed number, with the decimals of the thesis.
    pub fn shown_printed(&self) -> String {
        self.printed.map_or("–".into(), |value| fixed(value, 4))
    }

    /// Whether the two agree to the four decimals of the thesis.
    pub fn agrees(&self) -> Option<bool> {
        Some((self.printed? - self.value?).abs() < 1e-4)
    }
}

/// A table of the thesis.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    /// Its number.
    pub number: &'static str,
    /// What it is.
    pub title: String,
    /// Setting of the computation.
    pub setting: String,
    /// Its numbers.
    pub entries: Vec<Entry>,
}
