//! From the LPV model to the nonlinear plant: what linearisation leaves out, enclosed over a box of states.
//!
//! Let e = x − x_ref, and x* the operating point at the parameter ρ that the state has, so that x − x* is e without its
//! component of the parameter (and without those that the equations do not contain). By the mean value theorem in integral
//! form, first along x at u*, then along u,
//!
//! ```text
//! f(x, u) = A_Δ (x − x*) + B_Δ (u − u*),
//! A_Δ = ∫₀¹ ∂f/∂x(x* + s(x − x*), u*) ds,    B_Δ = ∫₀¹ ∂f/∂u(x, u* + s(u − u*)) ds.
//! ```
//!
//! Both are enclosed over the box around {V ≤ c}, and their differences to A(ρ) and B(ρ) are what the decrease of V has to
//! bear. A difference Δᵢⱼ with |Δᵢⱼ| ≤ d adds d (τ aaᵀ + bbᵀ/τ) ⪰ ±d (abᵀ + baᵀ) for any τ > 0, with a column a of P and a
//! unit vector b (or of I and Y). The parameter's rate is enclosed over the box as well: none is assumed.
//!
//! The inputs are taken along the right singular vectors of B, the columns of M, along which the equations decouple: four
//! rotors that tilt the thrust do so by their sum. M is rounded, so that B_ΔS = (B_ΔM)(MᵀS) + B_Δ(I − MMᵀ)S.

use super::cells::{Attempt, Cells, LEAST_HALF, LEAST_HALF_OF_SEARCH};
use super::closed_loop::{ClosedLoop, Decrease, Parts, Row};
use super::difference::{Balance, Difference};
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix};
use super::place::Place;
use super::sought::COST_INFLATION;
use crate::certificate::claim::{Claim, ClaimKind, Motion, Of, Verdict, Words};
use crate::math::Mat;
use crate::math::decimal::at_most;
use crate::math::eigen::symmetric_eigenvectors;
use crate::math::interval::Interval;
use crate::math::matrix::{identity, quadratic_form};
use crate::math::taylor::Taylor;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::time::Instant;

/// Parts of a piece on each of which what linearisation leaves out is enclosed once.
const PARTS: usize = 4;
/// Pieces of the way from x* to x over which the Jacobian is averaged: a term that grows with e along the way counts half.
const WAY: usize = 8;
/// The box is this much larger than what P at sampled parameters gives.
const BOX_SLACK: f64 = 1.001;
/// Parameter values at which the size of the box is computed before it is proved.
const BOX_SAMPLES: usize = 256;
/// Levels are found to this factor.
const LEVEL_RATIO: f64 = 1.05;
/// Levels outside are not sought, relative to the largest.
const LEAST_LEVEL: f64 = 1e-8;
/// Largest level for a design without limits.
const MOST_LEVEL: f64 = 1e8;
/// f(x*, u*) may be this far from zero: x* and u* are rounded.
const TRIM_TOLERANCE: f64 = 1e-12;

/// What is proved of the nonlinear plant.
#[derive(Clone, Debug)]
pub struct NonlinearProof {
    /// The set {V ≤ level} is invariant under the saturated controller, and V falls along every motion in it.
    pub level: f64,
    /// (state, radius): on the set |eᵢ| is at most the radius.
    pub radii: Vec<(usize, f64)>,
    /// Largest rate of the parameter on the set.
    pub rate: f64,
}

/// The decrease on a cell, and what the nonlinearity takes from it.
struct NonlinearCell {
    decrease: Decrease,
    /// Σ d (τ aaᵀ + bbᵀ/τ)
    spread: CellMatrix,
    /// ρ̇
    rate: Interval,
}

/// The claim whose decrease κ V̇ + c (eᵀQe + uᵀRu) < 0 is looked at.
#[derive(Clone, Copy)]
struct Decreases {
    factor: f64,
    cost: f64,
}

/// A box that holds the set.
struct Bounds {
    /// Of |eᵢ|.
    radii: Vec<f64>,
    /// Components that the equations do not contain: their reference may have any value.
    absent: Vec<bool>,
    /// The component that is the parameter: it may have any value, whatever its error.
    parameter: Option<usize>,
    /// Of |uᵢ − u*ᵢ|.
    inputs: Vec<f64>,
}

/// What linearisation leaves out, on the whole range of the parameter.
struct Remainder {
    /// Of each part of each piece.
    differences: Vec<Difference>,
    /// [Mᵀ; I] of each piece, 2m × m.
    directions: Vec<Mat<f64>>,
}

/// The claims about the nonlinear plant, for the largest level up to `most` that can be proved, and what is proved; the cost is
/// at most [`COST_INFLATION`] V(x(0)).
pub(super) fn prove(
    closed_loop: &ClosedLoop,
    words: &Words,
    most: Option<f64>,
) -> (Vec<Claim>, Option<NonlinearProof>) {
    let started = Instant::now();
    let undecided = |reason: &str| {
        let kind = ClaimKind::Invariance { level: 0.0, motion: Motion::None };
        (vec![Claim::new(kind, Of::Plant, words).decided(Verdict::Undecided, f64::NAN, reason)], None)
    };
    if !closed_loop.rests_at_every_parameter() {
        return undecided("the operating point moves with the parameter, or is not at rest");
    }
    let Some(mixtures) = closed_loop.mixtures() else {
        return undecided("too many inputs may saturate for all mixtures of their rows to be tried");
    };
    let Some(unit) = closed_loop.unit_bounds() else { return undecided("the box around the set could not be proved") };
    let decreases = |level: f64, what: Decreases, least: f64| {
        let Some(remainder) = closed_loop.remainder(&unit.times(level.sqrt())) else {
            let place = Place { piece: 0, variant: 0, middle: 0.5, half: 0.5 };
            return (Attempt::Open { place }, 0, f64::INFINITY);
        };
        let enclose = |place: &Place| closed_loop.nonlinear(place, &remainder, what);
        let judge = |cell: &NonlinearCell, half: f64| cell.is_decreasing(what, half);
        let mut cells = Cells::new(closed_loop.pieces, mixtures, enclose);
        let attempt = cells.prove(least, &judge);
        let rate = remainder.differences.iter().map(|difference| difference.rate.magnitude()).fold(0.0, f64::max);
        (attempt, cells.len(), rate)
    };
    let invariant = Decreases { factor: 1.0, cost: 0.0 };
    let unsaturated = if mixtures > 1 { f64::INFINITY } else { closed_loop.level_within_limits(&unit) };
    let most_is_unsaturated = most.is_some();
    let most = most.unwrap_or(MOST_LEVEL).min(unit.most_level()).min(unsaturated);
    let proved =
        |level: f64, what: Decreases| matches!(decreases(level, what, LEAST_HALF_OF_SEARCH).0, Attempt::Proved(_));
    let Some(level) = largest_level(most, |level| proved(level, invariant)) else {
        return undecided("what linearisation leaves out is too much even for a small set");
    };
    let (attempt, cells, rate) = decreases(level, invariant, LEAST_HALF);
    let proof = NonlinearProof { level, radii: unit.times(level.sqrt()).finite(), rate };
    let names = &closed_loop.description().states;
    let sizes =
        proof.radii.iter().map(|&(i, radius)| format!("|{}| <= {} {}", names[i].name, at_most(radius), names[i].unit));
    let mut sizes: Vec<String> = sizes.collect();
    if closed_loop.has_parameter {
        sizes.push(format!("|d{}/dt| <= {} {}/s", words.parameter, at_most(rate), words.unit));
    }
    // of the plant's own parameter: whatever it does in the set
    let motion = Motion::None;
    let mut premises = vec!["lyapunov-definite"];
    if most_is_unsaturated {
        premises.push("unsaturated");
    }
    let decided = |kind, attempt, cells, started| {
        let claim = words.claim(kind, attempt, closed_loop, cells, started).resting_on(&premises);
        // the statement is about the plant
        Claim { claim: Claim::new(claim.kind.clone(), Of::Plant, words).claim, ..claim.of_plant() }
    };
    let invariance = ClaimKind::Invariance { level, motion };
    let mut claims = vec![decided(invariance, attempt, cells, started)];
    claims[0].detail = format!("{}; {}", sizes.join(", "), claims[0].detail);

    let started = Instant::now();
    let cost = Decreases { factor: COST_INFLATION, cost: 1.0 };
    let within = largest_level(level, |level| proved(level, cost)).unwrap_or(LEAST_LEVEL * level);
    let (attempt, cells, _) = decreases(within, cost, LEAST_HALF);
    let kind = ClaimKind::Cost { factor: COST_INFLATION, level: Some(within), motion };
    claims.push(decided(kind, attempt, cells, started).resting_on(&["weights"]));
    (claims, Some(proof))
}

/// The largest level up to `most` of which `is_proved`, to a factor; `None` if not even a tiny one is.
fn largest_level(most: f64, is_proved: impl Fn(f64) -> bool) -> Option<f64> {
    let (mut good, mut bad) = (most, f64::INFINITY);
    while !is_proved(good) {
        (good, bad) = (good / 8.0, good);
        if good < LEAST_LEVEL * most {
            return None;
        }
    }
    while bad.is_finite() && bad / good > LEVEL_RATIO {
        let middle = (good * bad).sqrt();
        if is_proved(middle) { good = middle } else { bad = middle }
    }
    Some(good)
}

impl Bounds {
    fn times(&self, factor: f64) -> Self {
        // the product is rounded: a little more than that
        let times = |values: &[f64]| values.iter().map(|value| value * factor * (1.0 + 1e-12)).collect();
        Self { radii: times(&self.radii), inputs: times(&self.inputs), absent: self.absent.clone(), ..*self }
    }

    /// The largest level of which the parameter's error is less than half a turn, so that it is not wrapped.
    fn most_level(&self) -> f64 {
        self.parameter.map_or(f64::INFINITY, |parameter| (0.999 * PI / self.radii[parameter]).powi(2))
    }

    fn finite(&self) -> Vec<(usize, f64)> {
        self.radii.iter().copied().enumerate().filter(|&(_, radius)| radius.is_finite()).collect()
    }

    /// x* + the box, times `fraction`.
    fn around(&self, operating: &[Taylor], fraction: f64) -> Vec<Taylor> {
        let around = |(i, (&x, &radius)): (usize, (&Taylor, &f64))| {
            if Some(i) == self.parameter {
                return x;
            }
            if self.absent[i] {
                return Taylor::constant(Interval::ENTIRE);
            }
            let radius = (Interval::point(radius) * fraction).hi();
            x + Taylor::constant(Interval::new(-radius, radius))
        };
        operating.iter().zip(&self.radii).enumerate().map(around).collect()
    }

    /// What the inputs can be around u*, within their limits where there are any.
    fn inputs_around(&self, operating: &[Taylor], limits: &crate::controller::InputLimits) -> Vec<Taylor> {
        let around = |(i, u): (usize, &Taylor)| {
            let range = u.value + Interval::new(-self.inputs[i], self.inputs[i]);
            let lo = limits.min[i].map_or(range.lo(), |min| range.lo().max(min.min(u.value.lo())));
            let hi = limits.max[i].map_or(range.hi(), |max| range.hi().min(max.max(u.value.hi())));
            Taylor::constant(Interval::new(lo, hi))
        };
        operating.iter().enumerate().map(around).collect()
    }
}

impl Remainder {
    /// Bounds on a cell.
    fn on(&self, place: &Place) -> Difference {
        let part = |t: f64| t * PARTS as f64;
        // cells overlap a little; a neighbouring piece covers its own
        let [begin, end] = [place.piece * PARTS, (place.piece + 1) * PARTS];
        let first = (part(place.middle - place.half).floor() as usize).clamp(begin, end - 1);
        let last = (part(place.middle + place.half).ceil() as usize).clamp(first + 1, end);
        let rest = &self.differences[first..last];
        rest[1..].iter().fold(rest[0].clone(), Difference::hull)
    }
}

impl NonlinearCell {
    /// Of κ(constant + ρ̇ rate − spread) + c cost, at both ends of the rates. That this bound is not definite refutes nothing.
    fn is_decreasing(&self, what: Decreases, half: f64) -> Vec<(f64, Definiteness)> {
        let Decreases { factor, cost } = what;
        let ends = [self.rate.lo(), self.rate.hi()];
        let of_end = |end: f64| {
            let Decrease { constant, rate, cost: stage } = &self.decrease;
            let terms = [(factor, constant), (factor * end, rate), (-factor, &self.spread), (cost, stage)];
            (end, CellMatrix::combination(&terms).is_positive(half))
        };
        ends.into_iter().take(if self.rate.is_zero() { 1 } else { 2 }).map(of_end).collect()
    }
}

impl ClosedLoop<'_> {
    /// Whether x*(ρ) and u*(ρ) are constant but for the parameter itself, and at rest.
    fn rests_at_every_parameter(&self) -> bool {
        (0..self.pieces).all(|piece| {
            let t = Interval::new(piece as f64, piece as f64 + 1.0);
            let (x, u) = self.plant.trim_over(self.rho(Taylor::variable(t)));
            let parameter = self.parameter_state();
            let is_fixed = |value: &Taylor| value.slope.is_zero();
            let at_rest = self.plant.dynamics_over(&x, &u).iter().all(|dx| dx.value.magnitude() < TRIM_TOLERANCE);
            let states = x.iter().enumerate().filter(|&(i, _)| Some(i) != parameter).all(|(_, x)| is_fixed(x));
            states && u.iter().all(is_fixed) && at_rest
        })
    }

    /// The level up to which the gain that flies stays within the limits.
    fn level_within_limits(&self, unit: &Bounds) -> f64 {
        let (_, u) = self.plant.trim_over(self.rho(Taylor::from(0.0)));
        let level = |(i, u): (usize, &Taylor)| {
            let below = self.limits.min[i].map_or(f64::INFINITY, |min| u.value.lo() - min);
            let above = self.limits.max[i].map_or(f64::INFINITY, |max| max - u.value.hi());
            0.999 * (below.min(above).max(0.0) / unit.inputs[i]).powi(2)
        };
        u.iter().enumerate().map(level).fold(f64::INFINITY, f64::min)
    }

    fn parameter_state(&self) -> Option<usize> {
        self.description().scheduling.as_ref().map(|scheduling| scheduling.state)
    }

    /// Components whose value no equation contains.
    fn absent_states(&self) -> Vec<bool> {
        let t = Taylor::variable(Interval::new(0.0, self.pieces as f64));
        let (x, u) = self.plant.trim_over(self.rho(t));
        let n = x.len();
        let is_absent = |j: usize| {
            let mut x = x.clone();
            x[j] = Taylor::constant(Interval::ENTIRE);
            let (a, _) = self.plant.jacobians_over(&x, &u);
            (0..n).all(|i| a[i * n + j].is_zero())
        };
        (0..n).map(is_absent).collect()
    }

    /// The box around {V ≤ 1}, proved; `None` if it is not.
    fn unit_bounds(&self) -> Option<Bounds> {
        let absent = self.absent_states();
        let parameter = self.parameter_state();
        let (n, m) = (absent.len(), self.inputs());
        let rows: Vec<Row> = (0..n).map(Row::State).chain((0..m).map(Row::Input)).collect();
        let mut squares = vec![0.0_f64; n + m];
        for k in 0..BOX_SAMPLES {
            let t = self.pieces as f64 * k as f64 / BOX_SAMPLES as f64;
            let (y, f) = self.inverse_and_gain(t)?;
            for (square, row) in squares.iter_mut().zip(&rows) {
                let value = match *row {
                    Row::State(i) => y[(i, i)],
                    Row::Input(i) | Row::Limited(i) => {
                        quadratic_form(&y, &(0..n).map(|j| f[(i, j)]).collect::<Vec<f64>>())
                    }
                };
                *square = square.max(value);
            }
        }
        let bound = |(row, square): (&Row, &f64)| match *row {
            // the gain that flies is another
            Row::Input(i) if self.may_saturate(i) => f64::INFINITY,
            _ => BOX_SLACK * square.sqrt(),
        };
        let bounds: Vec<f64> = rows.iter().zip(&squares).map(bound).collect();
        let bounded: Vec<usize> = (0..rows.len()).filter(|&i| bounds[i].is_finite()).collect();
        let mut cells = Cells::new(self.pieces, bounded.len(), |place: &Place| {
            let at = bounded[place.variant];
            self.bordered(place, Some((rows[at], Interval::point(bounds[at]).square())))
        });
        let attempt = cells.prove(LEAST_HALF, &|matrix: &CellMatrix, half| vec![(0.0, matrix.is_positive(half))]);
        drop(cells);
        let (radii, inputs) = bounds.split_at(n);
        let bounds = Bounds { radii: radii.to_vec(), absent, parameter, inputs: inputs.to_vec() };
        matches!(attempt, Attempt::Proved(_)).then_some(bounds)
    }

    fn nonlinear(&self, place: &Place, remainder: &Remainder, what: Decreases) -> NonlinearCell {
        let [over, middle] = self.parts_on(place);
        let decrease = Decrease::new(&over, &middle);
        let difference = remainder.on(place);
        let directions = TaylorMatrix::constant(&remainder.directions[place.piece]);
        let [over, middle] = [over, middle].map(|parts| Parts { gain: directions.times(&parts.gain), ..parts });
        let size = difference.state.norm_max() + difference.input.norm_max();
        let inverse = (CellMatrix::combination(&[(what.factor, &decrease.constant), (what.cost, &decrease.cost)]))
            .middle_inverse()
            .filter(|_| size.is_finite());
        let spread = match inverse {
            Some(inverse) => {
                let weights = Balance::new(&self.form, &middle, &difference, &inverse);
                CellMatrix::new(&weights.spread(&self.form, &middle), &weights.spread(&self.form, &over))
            }
            None => CellMatrix::unbounded(self.weights.q.nrows()),
        };
        NonlinearCell { decrease, spread, rate: difference.rate }
    }

    /// What linearisation leaves out within `bounds`; `None` where the box leaves the domain of the equations.
    fn remainder(&self, bounds: &Bounds) -> Option<Remainder> {
        let limits = &self.description().state_limits;
        let leaves = |(limit, radius): (&Option<f64>, &f64)| limit.is_some_and(|limit| *radius >= limit);
        if limits.iter().zip(&bounds.radii).any(leaves) {
            return None;
        }
        let directions: Vec<Mat<f64>> =
            (0..self.pieces).map(|piece| self.input_directions(piece)).collect::<Option<_>>()?;
        let differences = (0..self.pieces * PARTS)
            .into_par_iter()
            .map(|part| {
                let middle = (part as f64 + 0.5) / PARTS as f64;
                self.difference(middle, 0.5 / PARTS as f64, bounds, &directions[part / PARTS])
            })
            .collect();
        Some(Remainder { differences, directions })
    }

    /// [Mᵀ; I] with the right singular vectors of B, rounded, in the columns of M.
    fn input_directions(&self, piece: usize) -> Option<Mat<f64>> {
        let model = crate::model::linearize(self.plant, self.parameter(piece as f64 + 0.5));
        let (_, vectors) = symmetric_eigenvectors(&(model.b.transpose() * &model.b))?;
        let m = self.inputs();
        Some(Mat::from_fn(2 * m, m, |i, j| match i < m {
            true => vectors[(j, i)],
            false => f64::from(u8::from(i - m == j)),
        }))
    }

    /// Bounds on A_Δ − A(ρ), B_Δ − B(ρ) and ρ̇ over the box, for |t − middle| ≤ half.
    fn difference(&self, middle: f64, half: f64, bounds: &Bounds, directions: &Mat<f64>) -> Difference {
        let over = Taylor::variable(Interval::new(middle - half, middle + half));
        let at_middle = Taylor::variable_of_first_order(Interval::point(middle));
        let [value, bend] = [at_middle, over].map(|t| self.deviation(t, bounds, directions));
        let half = Interval::point(half);
        let bound = |value: &Taylor, over: &Taylor| {
            let bend = over.bend.unwrap_or(Interval::ENTIRE).magnitude();
            let sum = Interval::point(value.value.magnitude()) + half * value.slope.magnitude();
            (sum + half.square() * 0.5 * bend).hi()
        };
        let (n, m) = (self.weights.q.nrows(), self.inputs());
        let state = Mat::from_fn(n, n, |i, j| {
            let bound = bound(&value.0.at(i, j), &bend.0.at(i, j));
            match bounds.absent[j] {
                // x − x* has no component of the parameter
                _ if Some(j) == bounds.parameter => 0.0,
                // one that the equations do not contain at the operating points must not matter in the box either
                true if bound > 0.0 => f64::INFINITY,
                _ => bound,
            }
        });
        let along = Mat::from_fn(n, 2 * m, |i, j| bound(&value.1.at(i, j), &bend.1.at(i, j)));
        // |I − MMᵀ|
        let orthogonal = Mat::from_fn(m, m, |i, j| {
            let product = (0..m)
                .fold(Interval::point(0.0), |sum, k| sum + Interval::point(directions[(k, i)]) * directions[(k, j)]);
            (product - identity(m)[(i, j)]).magnitude()
        });
        let rest = |i: usize, j: usize| {
            (0..m)
                .fold(Interval::point(0.0), |sum, k| sum + Interval::point(along[(i, m + k)]) * orthogonal[(k, j)])
                .hi()
        };
        let input = Mat::from_fn(n, 2 * m, |i, j| if j < m { along[(i, j)] } else { rest(i, j - m) });
        let rate = match bounds.parameter {
            None => Interval::point(0.0),
            Some(parameter) => {
                let (x, u) = self.plant.trim_over(self.rho(over));
                let u = bounds.inputs_around(&u, self.limits);
                self.plant.dynamics_over(&bounds.around(&x, 1.0), &u)[parameter].value
            }
        };
        Difference { state, input, rate }
    }

    /// A_Δ − A(ρ), and B_Δ − B(ρ) along each of the directions, over the box, as functions of `t`.
    fn deviation(&self, t: Taylor, bounds: &Bounds, directions: &Mat<f64>) -> (TaylorMatrix, TaylorMatrix) {
        let n = self.weights.q.nrows();
        let (x, u) = self.plant.trim_over(self.rho(t));
        let states = |x: &[Taylor]| TaylorMatrix::new(n, n, self.plant.jacobians_over(x, &u).0);
        let along = |k: usize| states(&bounds.around(&x, (k + 1) as f64 / WAY as f64));
        let sum = (1..WAY).fold(along(0), |sum, k| sum.plus(&along(k)));
        let mean = TaylorMatrix::from_fn(n, n, |i, j| sum.at(i, j) / WAY as f64);
        let inputs = |x: &[Taylor], u: &[Taylor]| {
            let column = |k: usize| {
                let direction: Vec<f64> = (0..directions.ncols()).map(|j| directions[(k, j)]).collect();
                self.plant.input_derivative_over(x, u, &direction)
            };
            let columns: Vec<Vec<Taylor>> = (0..directions.nrows()).map(column).collect();
            TaylorMatrix::from_fn(n, columns.len(), |i, j| columns[j][i])
        };
        let over = inputs(&bounds.around(&x, 1.0), &bounds.inputs_around(&u, self.limits));
        (mean.minus(&states(&x)), over.minus(&inputs(&x, &u)))
    }
}
