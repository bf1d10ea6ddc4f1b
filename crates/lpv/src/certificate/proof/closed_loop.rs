//! The closed LPV loop and its Lyapunov function over the continuous range of the parameter, as enclosures on cells.

use super::matrix::{CellMatrix, TaylorMatrix};
use crate::controller::Schedule;
use crate::math::Mat;
use crate::math::interval::Interval;
use crate::math::matrix::inverse_spd;
use crate::math::taylor::{Taylor, TaylorDual};
use crate::model::MatrixFunction;
use crate::plant::Plant;
use crate::synthesis::{CostWeights, Design};

/// Pieces that the circle is cut into where the gain is one formula everywhere.
const PIECES: usize = 16;
/// Harmonics of P smaller than this, against its largest entry, are rounding errors.
const HARMONIC_TOLERANCE: f64 = 1e-12;

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
    plant: &'a dyn Plant,
    schedule: &'a Schedule,
    weights: &'a CostWeights,
    pub form: Form,
    /// F(ρ) that stays unsaturated; in the inverse form L = FY.
    auxiliary: Option<MatrixFunction>,
    /// ρ = low + t · step.
    low: f64,
    step: Interval,
    /// t runs over [0, pieces].
    pub pieces: usize,
    /// The parameter can move at all.
    pub has_parameter: bool,
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
        Ok(Self { plant, schedule, weights, form, auxiliary, low, step, pieces, has_parameter })
    }

    /// Number of mixtures of the rows of K and F: 2^m with an auxiliary gain, else K alone.
    pub fn mixtures(&self) -> usize {
        if self.auxiliary.is_some() { 1 << self.weights.r.nrows() } else { 1 }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.weights.r.nrows()
    }

    /// ρ at position `t`, as a number.
    pub fn parameter(&self, t: f64) -> f64 {
        self.low + t * self.step.middle()
    }

    fn rho(&self, t: Taylor) -> Taylor {
        t * Taylor::constant(self.step) + self.low
    }

    fn function(&self, function: &MatrixFunction, rho: Taylor) -> TaylorMatrix {
        let factors: Vec<Taylor> = function.basis.iter().map(|basis| basis.at(&[rho])).collect();
        combine(function, &factors)
    }

    /// ∂/∂ρ, by dual numbers.
    fn derivative(&self, function: &MatrixFunction, rho: Taylor) -> TaylorMatrix {
        let rho = TaylorDual::new(rho, true);
        let factors: Vec<Taylor> = function.basis.iter().map(|basis| basis.at(&[rho]).derivative).collect();
        combine(function, &factors)
    }

    /// The parts of the decrease with the mixture number `mixture`, over `t` of piece `piece`.
    fn parts(&self, piece: usize, mixture: usize, t: Taylor) -> [TaylorMatrix; 3] {
        let rho = self.rho(t);
        let (n, m) = (self.weights.q.nrows(), self.inputs());
        let (a, b) = self.plant.linearization_over(rho);
        let (a, b) = (TaylorMatrix::new(n, n, a), TaylorMatrix::new(n, m, b));
        let k = TaylorMatrix::new(m, n, self.schedule.gain_on_piece(piece, t, rho));
        let CostWeights { q, r } = self.weights;
        let mixed = |k: TaylorMatrix, f: Option<TaylorMatrix>| match f {
            None => k,
            Some(f) => TaylorMatrix::from_fn(m, n, |i, j| if mixture >> i & 1 == 1 { k.at(i, j) } else { f.at(i, j) }),
        };
        let auxiliary = self.auxiliary.as_ref().map(|f| self.function(f, rho));
        match &self.form {
            Form::Direct(p) => {
                let (p_rate, p) = (self.derivative(p, rho), self.function(p, rho));
                let s = mixed(k, auxiliary);
                let flow = p.times(&b.times(&s).minus(&a));
                [
                    flow.plus(&flow.transpose()),
                    p_rate.negated(),
                    s.quadratic(r).plus(&TaylorMatrix::constant(q)).negated(),
                ]
            }
            Form::Inverse(y) => {
                let (y_rate, y) = (self.derivative(y, rho), self.function(y, rho));
                let sy = mixed(k.times(&y), auxiliary);
                let flow = b.times(&sy).minus(&a.times(&y));
                let cost = sy.quadratic(r).plus(&y.quadratic(q));
                [flow.plus(&flow.transpose()), y_rate, cost.negated()]
            }
        }
    }

    /// [`Decrease`] on the cell |t − `middle`| ≤ `half`, within the cell of `outer` if there is one.
    pub fn decrease(&self, place: &Place, outer: Option<&Decrease>) -> Decrease {
        let Place { piece, variant: mixture, middle, half } = *place;
        let over = match outer {
            None => Some(self.parts(piece, mixture, Taylor::variable(Interval::new(middle - half, middle + half)))),
            Some(_) => None,
        };
        let middle = self.parts(piece, mixture, Taylor::variable_of_first_order(Interval::point(middle)));
        let part = |i: usize, of: fn(&Decrease) -> &CellMatrix| match (&over, outer) {
            (Some(over), _) => CellMatrix::new(&middle[i], Ok(&over[i])),
            (None, Some(outer)) => CellMatrix::new(&middle[i], Err(of(outer))),
            (None, None) => CellMatrix::new(&middle[i], Ok(&middle[i])),
        };
        Decrease { constant: part(0, |d| &d.constant), rate: part(1, |d| &d.rate), cost: part(2, |d| &d.cost) }
    }

    /// P or Y on the cell; bordered by row `variant` of the unsaturated gain and `bound` = σ²/γ where one is asked for (5.21):
    /// its positivity is |fx| < σ on V ≤ γ.
    pub fn bordered(&self, place: &Place, bound: Option<Interval>, outer: Option<&CellMatrix>) -> CellMatrix {
        let Place { piece, variant: input, middle, half } = *place;
        let at = |t: Taylor| self.bordered_at(piece, bound.map(|bound| (input, bound)), t);
        let middle_form = at(Taylor::variable_of_first_order(Interval::point(middle)));
        match outer {
            Some(outer) => CellMatrix::new(&middle_form, Err(outer)),
            None => {
                let over = at(Taylor::variable(Interval::new(middle - half, middle + half)));
                CellMatrix::new(&middle_form, Ok(&over))
            }
        }
    }

    fn bordered_at(&self, piece: usize, input: Option<(usize, Interval)>, t: Taylor) -> TaylorMatrix {
        let rho = self.rho(t);
        let (n, m) = (self.weights.q.nrows(), self.inputs());
        let (Form::Direct(function) | Form::Inverse(function)) = &self.form;
        let matrix = self.function(function, rho);
        let Some((input, bound)) = input else { return matrix };
        let gain = match &self.auxiliary {
            Some(auxiliary) => self.function(auxiliary, rho),
            None => {
                let k = TaylorMatrix::new(m, n, self.schedule.gain_on_piece(piece, t, rho));
                match self.form {
                    Form::Direct(_) => k,
                    Form::Inverse(_) => k.times(&matrix),
                }
            }
        };
        TaylorMatrix::from_fn(n + 1, n + 1, |i, j| match (i, j) {
            (0, 0) => Taylor::constant(bound),
            (0, j) => gain.at(input, j - 1),
            (i, 0) => gain.at(input, i - 1),
            (i, j) => matrix.at(i - 1, j - 1),
        })
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

impl Form {
    /// P(ρ) as numbers; `None` where it is not definite.
    pub fn p(&self, rho: f64) -> Option<Mat<f64>> {
        match self {
            Form::Direct(p) => Some(p.at(&[rho])),
            Form::Inverse(y) => inverse_spd(&y.at(&[rho])),
        }
    }
}

pub(super) fn combine(function: &MatrixFunction, factors: &[Taylor]) -> TaylorMatrix {
    let (rows, columns) = function.shape();
    TaylorMatrix::from_fn(rows, columns, |i, j| {
        let terms = factors.iter().zip(&function.coefficients).filter(|(_, m)| m[(i, j)] != 0.0);
        terms.fold(Taylor::from(0.0), |sum, (&factor, m)| sum + factor * m[(i, j)])
    })
}
