//! The closed LPV loop and its Lyapunov function over the continuous range of the parameter, as enclosures on cells.

use super::matrix::{CellMatrix, TaylorMatrix};
use crate::controller::{InputLimits, Schedule};
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::matrix::{inverse_spd, quadratic_form};
use crate::math::taylor::Taylor;
use crate::model::MatrixFunction;
use crate::plant::{Description, Plant};
use crate::synthesis::{CostWeights, Design};

/// Pieces that the circle is cut into where the gain is one formula everywhere.
const PIECES: usize = 16;
/// Harmonics of P smaller than this, against its largest entry, are rounding errors.
const HARMONIC_TOLERANCE: f64 = 1e-12;

/// Parameter values at which a level is guessed, for each piece.
const LEVEL_SAMPLES_PER_PIECE: usize = 4;

/// V(x, ρ) in one of its two forms.
#[derive(Clone, Debug)]
pub(super) enum Form {
    /// xᵀP(ρ)x
    Direct(MatrixFunction),
    /// xᵀY(ρ)⁻¹x
    Inverse(MatrixFunction),
}

/// Why nothing can be proved of a design.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unprovable {
    /// A frozen design has matrices P at grid points only, and only periodic ones can be joined.
    #[error("its P is given at grid points of a parameter that is not periodic with 2π")]
    NotPeriodic,
    /// The design carries nothing between its grid points that could be proved.
    #[error("its auxiliary gain is missing between the grid points")]
    NoAuxiliaryGain,
}

/// Everything that the claims are about.
pub(super) struct ClosedLoop<'a> {
    pub plant: &'a dyn Plant,
    schedule: &'a Schedule,
    pub weights: &'a CostWeights,
    pub limits: &'a InputLimits,
    pub form: Form,
    /// F(ρ) that stays unsaturated; in the inverse form L = FY.
    pub auxiliary: Option<MatrixFunction>,
    /// ρ = low + t · step.
    low: f64,
    step: Interval,
    /// t runs over [0, pieces].
    pub pieces: usize,
    /// The parameter can move at all.
    pub has_parameter: bool,
}

/// Which row borders P or Y, see [`ClosedLoop::bordered`].
#[derive(Clone, Copy, Debug)]
pub(super) enum Row {
    /// Of the unsaturated gain, of input `i`.
    Input(usize),
    /// The unit vector of state `i`.
    State(usize),
}

/// A cell: |t − middle| ≤ half within [piece, piece + 1], of one variant of a claim (mixture of rows, input).
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub piece: usize,
    pub variant: usize,
    pub middle: f64,
    pub half: f64,
}

/// The three parts of the decrease on a cell: κ(constant + ρ̇ rate) + c cost ≻ 0 is V̇ < −(c/κ)(xᵀQx + uᵀRu).
pub(super) struct Decrease {
    pub constant: CellMatrix,
    pub rate: CellMatrix,
    pub cost: CellMatrix,
}

/// The matrices of the claims as functions of the cell's variable, for one mixture of rows.
pub(super) struct Parts {
    /// −(P(A − BS) + ·ᵀ), or −((AY − BSY) + ·ᵀ)
    pub constant: TaylorMatrix,
    /// What ρ̇ multiplies.
    pub rate: TaylorMatrix,
    /// −(Q + SᵀRS), or the same between Y.
    pub cost: TaylorMatrix,
    /// P or Y.
    pub lyapunov: TaylorMatrix,
    /// S or SY.
    pub gain: TaylorMatrix,
}

impl<'a> ClosedLoop<'a> {
    /// Of a design, for the plant that it names.
    pub fn new(design: &'a Design, plant: &'a dyn Plant) -> Result<Self, Unprovable> {
        let schedule = &design.controller.schedule;
        let scheduling = plant.description().scheduling.as_ref();
        let first = design.points[0].rho;
        let auxiliary_points: Option<Vec<Mat<f64>>> =
            design.points.iter().map(|point| point.auxiliary_gain.clone()).collect();
        let (form, auxiliary) = match (&design.rate_bounded, scheduling) {
            (Some(bounded), _) => {
                // without high gain the scheduled K is what has to stay unsaturated
                let auxiliary = auxiliary_points.and(bounded.l.clone());
                (Form::Inverse(bounded.y.clone()), auxiliary)
            }
            (None, None) => {
                let constant = |matrix: &Mat<f64>| MatrixFunction::constant(matrix.clone());
                let auxiliary = auxiliary_points.map(|points| constant(&points[0]));
                (Form::Direct(constant(&design.points[0].p)), auxiliary)
            }
            (None, Some(scheduling)) => {
                if !scheduling.periodic {
                    return Err(Unprovable::NotPeriodic);
                }
                // of P and of Y = P⁻¹ the one with fewer harmonics
                let p: Vec<Mat<f64>> = design.points.iter().map(|point| point.p.clone()).collect();
                let trigonometric =
                    |samples: &[Mat<f64>]| MatrixFunction::trigonometric(first, samples, HARMONIC_TOLERANCE);
                let auxiliary = auxiliary_points.map(|points| trigonometric(&points));
                (Form::Direct(trigonometric(&p)), auxiliary)
            }
        };
        let pieces = match (scheduling, schedule.pieces()) {
            (None, _) => 1,
            (Some(_), 1) => PIECES,
            (Some(_), pieces) => pieces,
        };
        let (low, step) = match scheduling {
            None => (0.0, Interval::point(0.0)),
            Some(scheduling) => {
                let [low, high] = scheduling.range;
                if scheduling.periodic && (high - low - std::f64::consts::TAU).abs() > 1e-12 {
                    return Err(Unprovable::NotPeriodic);
                }
                let length = match scheduling.periodic {
                    true => Interval::tau(),
                    false => Interval::point(high) - low,
                };
                (low, length / pieces as f64)
            }
        };
        let weights = &design.weights;
        let has_parameter = scheduling.is_some();
        let limits = &design.controller.limits;
        Ok(Self { plant, schedule, weights, limits, form, auxiliary, low, step, pieces, has_parameter })
    }

    /// Number of mixtures of the rows of K and F: 2^m with an auxiliary gain, else K alone.
    pub fn mixtures(&self) -> usize {
        if self.auxiliary.is_some() { 1 << self.weights.r.nrows() } else { 1 }
    }

    /// What the plant is.
    pub fn description(&self) -> &Description {
        self.plant.description()
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.weights.r.nrows()
    }

    /// ρ at position `t`, as a number.
    pub fn parameter(&self, t: f64) -> f64 {
        self.low + t * self.step.middle()
    }

    /// ρ as a function of `t`.
    pub fn rho(&self, t: Taylor) -> Taylor {
        t * Taylor::constant(self.step) + self.low
    }

    /// The gain that flies at position `t`, as numbers.
    pub fn gain(&self, t: f64) -> Mat<f64> {
        self.schedule.gain_matrix(self.parameter(t))
    }

    /// A, B and the gain that flies, over `t` of piece `piece`.
    pub fn model_and_gain(&self, piece: usize, t: Taylor) -> (TaylorMatrix, TaylorMatrix, TaylorMatrix) {
        let rho = self.rho(t);
        let (n, m) = (self.weights.q.nrows(), self.inputs());
        let (x, u) = self.plant.trim_over(rho);
        let (a, b) = self.plant.jacobians_over(&x, &u);
        let k = self.schedule.gain_on_piece(piece, t, rho);
        (TaylorMatrix::new(n, n, a), TaylorMatrix::new(n, m, b), TaylorMatrix::new(m, n, k))
    }

    /// The parts of the decrease with the mixture number `mixture`, over `t` of piece `piece`.
    pub fn parts(&self, piece: usize, mixture: usize, t: Taylor) -> Parts {
        let rho = self.rho(t);
        let (n, m) = (self.weights.q.nrows(), self.inputs());
        let (a, b, k) = self.model_and_gain(piece, t);
        let CostWeights { q, r } = self.weights;
        let mixed = |k: TaylorMatrix, f: Option<TaylorMatrix>| match f {
            None => k,
            Some(f) => TaylorMatrix::from_fn(m, n, |i, j| if mixture >> i & 1 == 1 { k.at(i, j) } else { f.at(i, j) }),
        };
        let auxiliary = self.auxiliary.as_ref().map(|f| TaylorMatrix::of_function(f, rho));
        match &self.form {
            Form::Direct(p) => {
                let [p, p_rate] = TaylorMatrix::of_function_and_derivative(p, rho);
                let s = mixed(k, auxiliary);
                let flow = p.times(&b.times(&s).minus(&a));
                Parts {
                    constant: flow.plus(&flow.transpose()),
                    rate: p_rate.negated(),
                    cost: s.quadratic(r).plus(&TaylorMatrix::constant(q)).negated(),
                    lyapunov: p,
                    gain: s,
                }
            }
            Form::Inverse(y) => {
                let [y, y_rate] = TaylorMatrix::of_function_and_derivative(y, rho);
                let sy = mixed(k.times(&y), auxiliary);
                let flow = b.times(&sy).minus(&a.times(&y));
                let cost = sy.quadratic(r).plus(&y.quadratic(q)).negated();
                Parts { constant: flow.plus(&flow.transpose()), rate: y_rate, cost, lyapunov: y, gain: sy }
            }
        }
    }

    /// The parts over the whole cell, and their values and slopes in its middle.
    pub fn parts_on(&self, place: &Place) -> [Parts; 2] {
        let Place { piece, variant: mixture, middle, half } = *place;
        let over = self.parts(piece, mixture, Taylor::variable(Interval::new(middle - half, middle + half)));
        [over, self.parts(piece, mixture, Taylor::variable_of_first_order(Interval::point(middle)))]
    }

    /// [`Decrease`] on the cell.
    pub fn decrease(&self, place: &Place) -> Decrease {
        let [over, middle] = self.parts_on(place);
        Decrease::new(&over, &middle)
    }

    /// P or Y on the cell; bordered by a row f and a bound b² where one is asked for (5.21): its positivity is (fx)² < b²
    /// on V ≤ 1.
    pub fn bordered(&self, place: &Place, border: Option<(Row, Interval)>) -> CellMatrix {
        let Place { piece, middle, half, .. } = *place;
        let over = self.bordered_at(piece, border, Taylor::variable(Interval::new(middle - half, middle + half)));
        let middle = self.bordered_at(piece, border, Taylor::variable_of_first_order(Interval::point(middle)));
        CellMatrix::new(&middle, &over)
    }

    fn bordered_at(&self, piece: usize, border: Option<(Row, Interval)>, t: Taylor) -> TaylorMatrix {
        let rho = self.rho(t);
        let (n, m) = (self.weights.q.nrows(), self.inputs());
        let (Form::Direct(function) | Form::Inverse(function)) = &self.form;
        let matrix = TaylorMatrix::of_function(function, rho);
        let Some((row, bound)) = border else { return matrix };
        let row: Vec<Taylor> = match row {
            Row::Input(i) => {
                // that row alone
                let row = |gain: &TaylorMatrix| TaylorMatrix::from_fn(1, n, |_, j| gain.at(i, j));
                let gain = match &self.auxiliary {
                    Some(auxiliary) => row(&TaylorMatrix::of_function(auxiliary, rho)),
                    None => {
                        let k = row(&TaylorMatrix::new(m, n, self.schedule.gain_on_piece(piece, t, rho)));
                        match self.form {
                            Form::Direct(_) => k,
                            Form::Inverse(_) => k.times(&matrix),
                        }
                    }
                };
                (0..n).map(|j| gain.at(0, j)).collect()
            }
            Row::State(i) => match self.form {
                Form::Direct(_) => (0..n).map(|j| Taylor::from(if i == j { 1.0 } else { 0.0 })).collect(),
                Form::Inverse(_) => (0..n).map(|j| matrix.at(i, j)).collect(),
            },
        };
        TaylorMatrix::from_fn(n + 1, n + 1, |i, j| match (i, j) {
            (0, 0) => Taylor::constant(bound),
            (0, j) => row[j - 1],
            (i, 0) => row[i - 1],
            (i, j) => matrix.at(i - 1, j - 1),
        })
    }

    /// P⁻¹ and the gain that stays unsaturated at position `t`, as numbers; `None` where P is not definite.
    pub fn inverse_and_gain(&self, t: f64) -> Option<(Mat<f64>, Mat<f64>)> {
        let rho = self.parameter(t);
        let y = match &self.form {
            Form::Direct(p) => inverse_spd(&p.at(&[rho]))?,
            Form::Inverse(y) => y.at(&[rho]),
        };
        let gain = match (&self.auxiliary, &self.form) {
            (None, _) => self.schedule.gain_matrix(rho),
            (Some(f), Form::Direct(_)) => f.at(&[rho]),
            (Some(l), Form::Inverse(_)) => l.at(&[rho]) * inverse_spd(&y)?,
        };
        Some((y, gain))
    }

    /// Least level over sampled positions on which the gain that stays unsaturated reaches the bounds σ, as numbers: a guess
    /// to be proved.
    pub fn unsaturated_level(&self, sigma: &[f64]) -> f64 {
        let samples = LEVEL_SAMPLES_PER_PIECE * self.pieces;
        let level = |k: usize| {
            let t = k as f64 / LEVEL_SAMPLES_PER_PIECE as f64;
            let (y, gain) = self.inverse_and_gain(t)?;
            let of_input = |i: usize| {
                let row: Vec<f64> = (0..gain.ncols()).map(|j| gain[(i, j)]).collect();
                sigma[i] * sigma[i] / quadratic_form(&y, &row)
            };
            Some((0..gain.nrows()).map(of_input).fold(f64::INFINITY, f64::min))
        };
        (0..samples).map(|k| level(k).unwrap_or(0.0)).fold(f64::INFINITY, f64::min)
    }

    /// The state that a direction of the decrease's matrix stands for at position `t`: itself, or Yz.
    pub fn state(&self, t: f64, direction: &[f64]) -> Vec<f64> {
        match &self.form {
            Form::Direct(_) => direction.to_vec(),
            Form::Inverse(y) => {
                let y = y.at(&[self.parameter(t)]);
                (0..y.nrows()).map(|i| (0..y.ncols()).map(|j| y[(i, j)] * direction[j]).sum()).collect()
            }
        }
    }
}

impl Decrease {
    /// From the parts over a cell and in its middle.
    pub fn new(over: &Parts, middle: &Parts) -> Self {
        Self {
            constant: CellMatrix::new(&middle.constant, &over.constant),
            rate: CellMatrix::new(&middle.rate, &over.rate),
            cost: CellMatrix::new(&middle.cost, &over.cost),
        }
    }
}

impl Form {
    /// P(ρ) as numbers; `None` where it is not definite.
    pub fn p(&self, rho: f64) -> Option<Mat<f64>> {
        match self {
            Form::Direct(p) => Some(p.at(&[rho])),
            Form::Inverse(y) => inverse_spd(&y.at(&[rho])),
        }
    }
}
