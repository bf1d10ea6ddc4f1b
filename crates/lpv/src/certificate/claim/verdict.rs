//! What can be known of a claim.

use serde::{Deserialize, Serialize};

/// What is known of a claim, from worst to best.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// False, with a witness.
    Refuted,
    /// Neither shown nor refuted; the detail says why.
    Undecided,
    /// Holds at the points checked, in floating point; not proved.
    Numerical,
    /// Holds for all parameters, with rounding accounted for.
    Proved,
}

impl Verdict {
    /// The word that reports print.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Proved => "proved",
            Verdict::Numerical => "numerical",
            Verdict::Refuted => "refuted",
            Verdict::Undecided => "undecided",
        }
    }
}
