//! Symmetric matrices over cells of several parameters, and the proof that they are positive definite on every cell of a box.
//!
//! On a cell with the middle c the mean value theorem, one parameter after the other, gives
//!
//! ```text
//! M(ρ) ∈ M(c) + Σₖ (ρₖ − cₖ) ∂M/∂ρₖ(c₁, …, cₖ₋₁, [ρₖ], [ρₖ₊₁], …),
//! ```
//!
//! each slope by a Taylor form of first order whose variable is ρₖ, the parameters after it over the cell. With T ≈ L⁻ᵀ for M(c) ≈ LLᵀ every
//! row of TᵀM(ρ)T − I sums to less than 1 (Gershgorin), or the cell is bisected along the parameter that takes most. Cells share their ends,
//! which are doubles: nothing is left between them.

use super::enclosed::Enclosed;
use super::matrix::TaylorMatrix;
use crate::math::Mat;
use crate::math::eigen::{smallest_eigenvalue, smallest_eigenvector};
use crate::math::interval::Interval;
use crate::math::matrix::cholesky_inverse;
use crate::math::taylor::Taylor;
use crate::mutant;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// How often a cell of the grid is bisected at most.
const MOST_BISECTIONS: usize = 18;

/// A cell of the box, within one cell of the grid.
#[derive(Clone, Debug)]
pub(super) struct BoxCell {
    /// The cell of each parameter's grid, from 0.
    pub grid: Vec<usize>,
    /// Its ends.
    pub ends: Vec<[f64; 2]>,
}

impl BoxCell {
    /// All cells of the product of `grids`.
    pub fn all(grids: &[&[f64]]) -> Vec<Self> {
        let cells = grids.iter().fold(vec![Self { grid: Vec::new(), ends: Vec::new() }], |cells, points| {
            let with = |cell: &Self, k: usize| {
                let mut cell = cell.clone();
                cell.grid.push(k);
                cell.ends.push([points[k], points[k + 1]]);
                cell
            };
            cells.iter().flat_map(|cell| (0..points.len() - 1).map(|k| with(cell, k)).collect::<Vec<_>>()).collect()
        });
        let count = if mutant::is("box-cell-skipped") { cells.len() - 1 } else { cells.len() };
        cells.into_iter().take(count).collect()
    }

    /// c
    pub fn middle(&self) -> Vec<f64> {
        self.ends.iter().map(|&[low, high]| Interval::new(low, high).middle()).collect()
    }

    /// Of each parameter the largest |ρₖ − cₖ|.
    pub fn halves(&self) -> Vec<f64> {
        let share = if mutant::is("box-cells-by-their-middle") { 0.0 } else { 1.0 };
        self.ends.iter().map(|&[low, high]| share * Interval::new(low, high).middle_and_radius().1).collect()
    }

    /// Its corners, as cells of no width.
    fn corners(&self) -> Vec<Self> {
        (0..self.ends.len()).fold(vec![self.clone()], |cells, k| {
            let at = |cell: &Self, end: usize| {
                let mut cell = cell.clone();
                cell.ends[k] = [self.ends[k][end]; 2];
                cell
            };
            cells.iter().flat_map(|cell| [at(cell, 0), at(cell, 1)]).collect()
        })
    }

    /// Two halves along parameter `k`.
    pub fn bisected(&self, k: usize) -> [Self; 2] {
        let middle = self.middle()[k];
        let [mut left, mut right] = [self.clone(), self.clone()];
        left.ends[k][1] = middle;
        right.ends[k][0] = middle;
        [left, right]
    }

    /// c as Taylor forms.
    fn at_middle(&self) -> Vec<Taylor> {
        self.middle().into_iter().map(|c| Taylor::constant(Interval::point(c))).collect()
    }

    /// The parameters for the slope along `k`.
    fn along(&self, k: usize) -> Vec<Taylor> {
        let of = |(j, &[low, high]): (usize, &[f64; 2])| {
            let over = Interval::new(low, high);
            match j.cmp(&k) {
                std::cmp::Ordering::Less => Taylor::constant(Interval::point(over.middle())),
                std::cmp::Ordering::Equal => Taylor::variable_of_first_order(over),
                std::cmp::Ordering::Greater => Taylor::constant(over),
            }
        };
        self.ends.iter().enumerate().map(of).collect()
    }

    /// M in the middle, and its slope along each parameter.
    pub fn enclosed(&self, of: &dyn Fn(&[Taylor]) -> TaylorMatrix) -> (TaylorMatrix, Vec<TaylorMatrix>) {
        (of(&self.at_middle()), (0..self.ends.len()).map(|k| of(&self.along(k))).collect())
    }
}

/// M(ρ) on a cell, n × n; the symmetric part is taken.
pub(super) struct MeanValueMatrix {
    n: usize,
    middle: Enclosed,
    slopes: Vec<Enclosed>,
}

/// What is known of a matrix on a cell.
pub(super) enum Judged {
    /// Positive definite on the whole cell, with this relative margin.
    Proved(f64),
    /// Not positive definite in the middle; the direction z with zᵀMz < 0, where that is proved, and the bound on it.
    FailsInMiddle(Option<(Vec<f64>, f64)>),
    /// Narrower cells may tell: this parameter takes most.
    Open(usize),
}

impl MeanValueMatrix {
    /// Of the function `of` the parameters.
    pub fn new(cell: &BoxCell, of: &dyn Fn(&[Taylor]) -> TaylorMatrix) -> Self {
        let (middle, slopes) = cell.enclosed(of);
        let n = middle.shape().0;
        let symmetric = |matrix: &TaylorMatrix, part: fn(&Taylor) -> Interval| {
            Enclosed::new(n, |i, j| (part(&matrix.at(i, j)) + part(&matrix.at(j, i))) * 0.5)
        };
        Self {
            n,
            middle: symmetric(&middle, |entry| entry.value),
            slopes: slopes.iter().map(|slope| symmetric(slope, |entry| entry.slope)).collect(),
        }
    }

    /// Is M positive definite wherever |ρₖ − cₖ| ≤ `halves[k]`?
    pub fn is_positive(&self, halves: &[f64]) -> Judged {
        let (n, middle) = (self.n, self.middle.middle());
        let Some(inverse) = cholesky_inverse(&middle) else { return Judged::FailsInMiddle(self.refutation(&middle)) };
        // Tᵀ = L⁻¹, row order
        let factor: Vec<f64> = (0..n * n).map(|at| inverse[(at / n, at % n)]).collect();
        let constant = self.middle.row_sums_of_congruence(&factor, 1.0);
        let linear: Vec<Vec<f64>> = self.slopes.iter().map(|s| s.row_sums_of_congruence(&factor, 0.0)).collect();
        let excess = |i: usize| {
            let rows = (0..linear.len()).map(|k| Interval::point(halves[k]) * linear[k][i]);
            rows.fold(Interval::point(constant[i]), |sum, row| sum + row).hi()
        };
        let rows: Vec<f64> = (0..n).map(excess).collect();
        // NaN is no proof
        if rows.iter().all(|row| *row < 1.0) {
            let largest = rows.into_iter().fold(0.0, f64::max);
            return Judged::Proved((1.0 - largest).next_down());
        }
        let taken = |k: usize| halves[k] * linear[k].iter().copied().fold(0.0, f64::max);
        let widest = (0..linear.len()).max_by(|&j, &k| taken(j).total_cmp(&taken(k))).unwrap_or(0);
        Judged::Open(widest)
    }

    fn refutation(&self, middle: &Mat<f64>) -> Option<(Vec<f64>, f64)> {
        let direction = smallest_eigenvector(middle).filter(|_| smallest_eigenvalue(middle) < 0.0)?;
        let form = (0..self.n * self.n).fold(Interval::point(0.0), |sum, at| {
            let (i, j) = (at / self.n, at % self.n);
            sum + self.middle.at(i, j) * (Interval::point(direction[i]) * direction[j])
        });
        (form.hi() < 0.0).then_some((direction, form.hi()))
    }
}

/// How a proof over the box ended.
pub(super) enum BoxOutcome {
    /// With the least margin.
    Proved(f64),
    /// The matrix is not positive definite here: for this direction, where that is proved.
    Fails { at: Vec<f64>, broken: Option<(Vec<f64>, f64)> },
    /// Here.
    Open { at: Vec<f64> },
}

/// Prove that all matrices that `conditions` gives are positive definite on all `cells`, with at most `most` cells; with the number that it took.
pub(super) fn prove_on_box(
    cells: Vec<BoxCell>,
    most: usize,
    conditions: impl Fn(&BoxCell) -> Vec<MeanValueMatrix> + Sync,
) -> (BoxOutcome, usize) {
    // what fails does so at the edge of the box or in wide regions, as a rule: narrow cells would take long to find that
    let fails_at = |cell: &BoxCell| {
        conditions(cell).iter().find_map(|matrix| match matrix.is_positive(&vec![0.0; cell.ends.len()]) {
            Judged::FailsInMiddle(broken) => Some(BoxOutcome::Fails { at: cell.middle(), broken }),
            _ => None,
        })
    };
    let fails = cells.par_iter().find_map_any(|cell| cell.corners().iter().chain([cell]).find_map(fails_at));
    if let Some(fails) = fails {
        return (fails, 0);
    }
    let (stopped, count) = (AtomicBool::new(false), AtomicUsize::new(0));
    let of_grid_cell = |cell: BoxCell| {
        let (mut margin, mut open) = (f64::INFINITY, vec![(cell, 0)]);
        while let Some((cell, depth)) = open.pop() {
            if stopped.load(Ordering::Relaxed) {
                // another cell has the reason; this one says no more than that it is not proved
                return BoxOutcome::Open { at: cell.middle() };
            }
            let halves = cell.halves();
            let stop = |outcome: BoxOutcome| {
                stopped.store(true, Ordering::Relaxed);
                outcome
            };
            let mut bisect = None;
            for matrix in conditions(&cell) {
                match matrix.is_positive(&halves) {
                    Judged::Proved(found) => margin = margin.min(found),
                    Judged::FailsInMiddle(broken) => {
                        return stop(BoxOutcome::Fails { at: cell.middle(), broken });
                    }
                    Judged::Open(widest) => bisect = Some(widest),
                }
            }
            let done = count.fetch_add(1, Ordering::Relaxed);
            if let Some(widest) = bisect {
                if depth >= MOST_BISECTIONS || done >= most {
                    return stop(BoxOutcome::Open { at: cell.middle() });
                }
                open.extend(cell.bisected(widest).map(|half| (half, depth + 1)));
            }
        }
        BoxOutcome::Proved(margin)
    };
    let worse = |a: BoxOutcome, b: BoxOutcome| match (a, b) {
        (fails @ BoxOutcome::Fails { .. }, _) | (_, fails @ BoxOutcome::Fails { .. }) => fails,
        (open @ BoxOutcome::Open { .. }, _) | (_, open @ BoxOutcome::Open { .. }) => open,
        (BoxOutcome::Proved(a), BoxOutcome::Proved(b)) => BoxOutcome::Proved(a.min(b)),
    };
    let outcome = cells.into_par_iter().map(of_grid_cell).reduce(|| BoxOutcome::Proved(f64::INFINITY), worse);
    (outcome, count.into_inner())
}
