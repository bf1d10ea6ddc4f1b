//! What a solve may take and how far it has to get.

use crate::{Mat, verification};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Settings of one solve. `Options::default()` is meant to be right for control problems.
#[derive(Clone, Debug)]
pub struct Options {
    /// Interior-point iterations at most (default 150).
    pub max_iterations: usize,
    /// Relative duality gap |p − d| / (1 + |p| + |d|) to aim for (default 1e-8).
    ///
    /// When rounding stops the iteration earlier, [`Outcome::Solved`](crate::Outcome::Solved) is still given for a
    /// gap of at most 1e-7, never for a larger one.
    pub gap_tolerance: f64,
    /// Relative residual of the equations of the problem and its dual for
    /// [`Outcome::Solved`](crate::Outcome::Solved) (default 1e-7).
    pub feasibility_tolerance: f64,
    /// Default margin of strict inequalities, relative to the block's scale (default 1e-12).
    ///
    /// `F(x) ≻ 0` is posed as `F(x) ⪰ margin · s · I`, where s is the smallest absolute diagonal entry of the block's
    /// known part that is not zero (its largest entry when the diagonal is zero, 1 when the known part is).
    pub margin: f64,
    /// Solve in two stages (default `None`: in one). After the optimum p*, the point with the largest margins is taken whose objective is
    /// within this of it, relative to 1 + |p*|: 10⁻³ costs a thousandth of the objective and often gains orders of magnitude in the
    /// conditioning. The dual objective stays that of the optimum, so that [`Answer::gap`](crate::Answer::gap) shows what was given up.
    pub back_off: Option<f64>,
    /// Largest singular value of every unknown (default `None`: unbounded), imposed as inequalities named `bound on …`. Keeps problems
    /// whose optimum lies at infinity finite; when a bound is active the optimum is that of the bounded problem.
    pub bound: Option<f64>,
    /// Stops the solve soon after it becomes true, with [`Outcome::Inaccurate`](crate::Outcome::Inaccurate).
    pub cancel: Option<Arc<AtomicBool>>,
    /// Stops the solve soon after this time, with [`Outcome::Inaccurate`](crate::Outcome::Inaccurate).
    pub time_limit: Option<Duration>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            max_iterations: 150,
            gap_tolerance: 1e-8,
            feasibility_tolerance: 1e-7,
            margin: 1e-12,
            back_off: None,
            bound: None,
            cancel: None,
            time_limit: None,
        }
    }
}

impl Options {
    /// The margin of a strict inequality with this known part, relative to its smallest diagonal entry that is not zero.
    ///
    /// The largest entry would not do: in `diag(Q⁻¹, R⁻¹)` with Q⁻¹ = 1 and R⁻¹ = 10¹² a margin of 10⁻¹² · 10¹² leaves no solution.
    pub(crate) fn default_margin(&self, constant: &Mat<f64>) -> f64 {
        let diagonal = (0..constant.nrows()).map(|i| constant[(i, i)].abs()).filter(|c| *c > 0.0);
        let smallest = diagonal.fold(f64::INFINITY, f64::min);
        let largest = verification::largest_entry(constant);
        let scale = match (smallest.is_finite(), largest > 0.0) {
            (true, _) => smallest,
            (false, true) => largest,
            (false, false) => 1.0,
        };
        self.margin * scale
    }

    pub(crate) fn check(&self) -> Result<(), crate::Error> {
        let tolerance = |option, value: f64| {
            if value > 0.0 && value < 1.0 {
                return Ok(());
            }
            Err(crate::Error::BadOption { option, value, allowed: "a tolerance lies between 0 and 1" })
        };
        tolerance("gap_tolerance", self.gap_tolerance)?;
        tolerance("feasibility_tolerance", self.feasibility_tolerance)?;
        if !(0.0..1.0).contains(&self.margin) {
            return Err(crate::Error::BadOption {
                option: "margin",
                value: self.margin,
                allowed: "a relative margin is at least 0 and less than 1",
            });
        }
        if let Some(room) = self.back_off {
            tolerance("back_off", room)?;
        }
        if let Some(bound) = self.bound.filter(|bound| !(*bound > 0.0 && bound.is_finite())) {
            return Err(crate::Error::BadOption {
                option: "bound",
                value: bound,
                allowed: "a bound on the unknowns is positive and finite",
            });
        }
        Ok(())
    }
}
