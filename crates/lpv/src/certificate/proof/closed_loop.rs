//! The closed LPV loop and its Lyapunov function over the continuous range of the parameter, as enclosures on cells.

use super::matrix::{CellMatrix, TaylorMatrix};
use super::place::Place;
use super::rowwise::{self, Balanced, Rows, mixed, multipliers, shares};
use crate::certificate::claim::Motion;
use crate::controller::{InputLimits, Schedule};
use crate::math::Mat;
use crate::math::definite::asymmetry;
use crate::math::interval::Interval;
use crate::math::matrix::{inverse_spd, quadratic_form};
use crate::math::taylor::Taylor;
use crate::model::MatrixFunction;
use crate::mutant;
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
pub(in super::super) enum Form {
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
    /// V is not a quadratic form of the numbers given.
    #[error("its P or Y is not symmetric to the last digit")]
    NotSymmetric,
    /// The saturated input is never u*, and x* no point of rest.
    #[error("the limits of input {input} do not enclose its operating value")]
    OutsideLimits {
        /// From 1.
        input: usize,
    },
}

/// Everything that the claims are about.
pub(super) struct ClosedLoop<'a> {
    pub plant: &'a dyn Plant,
    schedule: &'a Schedule,
    pub weights: &'a CostWeights,
    pub limits: &'a InputLimits,
    /// u* of the controller.
    pub operating_input: &'a [f64],
    /// σᵢ: how far each input may go to either side of its operating value, rounded down; infinite where it is not limited.
    pub sigma: Vec<f64>,
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
    /// Of the low gain, of input `i`: F where a high gain may saturate, else K.
    Input(usize),
    /// The same over σᵢ.
    Limited(usize),
    /// The unit vector of state `i`.
    State(usize),
}

/// The three parts of the decrease on a cell: κ(constant + ρ̇ rate) + c cost ≻ 0 is V̇ < −(c/κ)(xᵀQx + uᵀRu).
pub(super) struct Decrease {
    pub constant: CellMatrix,
    pub rate: CellMatrix,
    pub cost: CellMatrix,
}

/// The decrease under saturation on a cell: still + κρ̇ rate ≻ 0, with κ and c within `still`.
pub(super) struct ByRows {
    pub still: CellMatrix,
    pub rate: CellMatrix,
    /// cᵢ
    pub multipliers: Vec<f64>,
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
        refuse_unusable(design)?;
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
        let operating_input = &design.controller.operating_input;
        let mut sigma = limits.room(operating_input);
        if mutant::is("one-free-frees-all") && sigma.contains(&f64::INFINITY) {
            sigma.fill(f64::INFINITY);
        }
        Ok(Self {
            plant,
            schedule,
            weights,
            limits,
            operating_input,
            sigma,
            form,
            auxiliary,
            low,
            step,
            pieces,
            has_parameter,
        })
    }

    /// Whether the gain that flies may saturate on the set, so that input `i` lies between rows of F and K.
    pub fn may_saturate(&self, i: usize) -> bool {
        self.auxiliary.is_some() && self.sigma[i].is_finite()
    }

    /// The inputs that may.
    pub fn saturating(&self) -> Vec<usize> {
        (0..self.inputs()).filter(|&i| self.may_saturate(i)).collect()
    }

    /// Number of mixtures of the rows of K and F: two for each input that may saturate; `None` where there are too many to enumerate.
    pub fn mixtures(&self) -> Option<usize> {
        rowwise::mixtures(self.saturating().len())
    }

    /// Whether the mixture is K itself.
    pub fn is_all_of_k(&self, mixture: usize) -> bool {
        mixture == rowwise::ALL_HIGH || Some(mixture + 1) == self.mixtures()
    }

    /// How the parameter moves at up to `rate`.
    pub fn motion(&self, rate: f64) -> Motion {
        match (self.has_parameter, rate) {
            (false, _) => Motion::None,
            (true, 0.0) => Motion::AtRest,
            (true, rate) => Motion::Bounded { rate },
        }
    }

    /// The inputs that are limited and that the low gain moves: rows of zeros never reach a limit.
    pub fn limited_rows(&self) -> Vec<usize> {
        let moves = |i: usize| {
            (0..self.pieces).any(|piece| {
                let t = Taylor::variable(Interval::new(piece as f64, piece as f64 + 1.0));
                self.low_row(piece, i, t).iter().any(|entry| !entry.is_zero())
            })
        };
        (0..self.inputs()).filter(|&i| self.sigma[i].is_finite() && moves(i)).collect()
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

    /// The position of ρ, as a number; 0 where there is no parameter.
    pub fn position(&self, rho: f64) -> f64 {
        if self.has_parameter { (rho - self.low) / self.step.middle() } else { 0.0 }
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
        let (a, b, k) = self.model_and_gain(piece, t);
        self.parts_of(&a, &b, &self.gains(k, mixture, t), &self.weights.r, t)
    }

    /// S of a mixture, and K; in the inverse form SY and KY.
    pub fn gains(&self, k: TaylorMatrix, mixture: usize, t: Taylor) -> [TaylorMatrix; 2] {
        let rho = self.rho(t);
        let high = match &self.form {
            Form::Direct(_) => k,
            Form::Inverse(y) => k.times(&TaylorMatrix::of_function(y, rho)),
        };
        // an input that is not limited is always the one of K
        let low = self.auxiliary.as_ref().map(|f| TaylorMatrix::of_function(f, rho));
        let s = low.map(|low| mixed(mixture, &self.saturating(), &low, &high));
        [s.unwrap_or_else(|| high.clone()), high]
    }

    /// The parts of the decrease with the gain S = `gains[0]` (or SY), and with `r` for R.
    fn parts_of(
        &self,
        a: &TaylorMatrix,
        b: &TaylorMatrix,
        [s, _]: &[TaylorMatrix; 2],
        r: &Mat<f64>,
        t: Taylor,
    ) -> Parts {
        let (rho, q) = (self.rho(t), &self.weights.q);
        let forgotten = mutant::is("input-cost-forgotten").then(|| Mat::zeros(r.nrows(), r.ncols()));
        let r = forgotten.as_ref().unwrap_or(r);
        match &self.form {
            Form::Direct(p) => {
                let [p, p_rate] = TaylorMatrix::of_function_and_derivative(p, rho);
                let flow = p.times(&b.times(s).minus(a));
                Parts {
                    constant: flow.plus(&flow.transpose()),
                    rate: p_rate.negated(),
                    cost: s.quadratic(r).plus(&TaylorMatrix::constant(q)).negated(),
                    lyapunov: p,
                    gain: s.clone(),
                }
            }
            Form::Inverse(y) => {
                let [y, y_rate] = TaylorMatrix::of_function_and_derivative(y, rho);
                let flow = b.times(s).minus(&a.times(&y));
                let cost = s.quadratic(r).plus(&y.quadratic(q)).negated();
                Parts { constant: flow.plus(&flow.transpose()), rate: y_rate, cost, lyapunov: y, gain: s.clone() }
            }
        }
    }

    /// The decrease with weights κ and c under saturation of all inputs that may saturate, by rows (see [`rowwise`]).
    pub fn by_rows(&self, place: &Place, weights: [f64; 2], r: &Mat<f64>) -> ByRows {
        let Place { piece, middle, half, .. } = *place;
        let over =
            self.parts_and_rows(piece, Taylor::variable(Interval::new(middle - half, middle + half)), weights, r);
        let middle = self.parts_and_rows(piece, Taylor::variable_of_first_order(Interval::point(middle)), weights, r);
        let decrease = Decrease::new(&over.0, &middle.0);
        let [factor, cost] = weights;
        let unsaturated = CellMatrix::combination(&[(factor, &decrease.constant), (cost, &decrease.cost)]);
        let [gradient, difference] = middle.1.middle();
        let multipliers = multipliers(&[Balanced { base: unsaturated.middle(), gradient, difference }]);
        let (moving, shares) = (over.1.moving(), shares(&multipliers));
        let lost = |rows: &Rows| rows.deltas(&multipliers, &moving).quadratic(&shares);
        let lost = CellMatrix::new(&lost(&middle.1), &lost(&over.1));
        let still = CellMatrix::combination(&[(1.0, &unsaturated), (-1.0, &lost)]);
        ByRows { still, rate: decrease.rate, multipliers }
    }

    /// The parts of the decrease with the low gain, and what saturation adds to it.
    fn parts_and_rows(&self, piece: usize, t: Taylor, weights: [f64; 2], r: &Mat<f64>) -> (Parts, Rows) {
        let (a, b, k) = self.model_and_gain(piece, t);
        let gains = self.gains(k, 0, t);
        let parts = self.parts_of(&a, &b, &gains, r, t);
        let input = match &self.form {
            Form::Direct(_) => b.transpose().times(&parts.lyapunov),
            Form::Inverse(_) => b.transpose(),
        };
        let rows = Rows::new(&self.saturating(), &input, [&gains[0], &gains[1]], r, weights);
        (parts, rows)
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

    /// P or Y.
    pub fn lyapunov(&self, t: Taylor) -> TaylorMatrix {
        let (Form::Direct(function) | Form::Inverse(function)) = &self.form;
        TaylorMatrix::of_function(function, self.rho(t))
    }

    /// P or Y on the cell; bordered by a row f and a bound b² where one is asked for (5.21): its positivity is (fx)² < b²
    /// on V ≤ 1.
    pub fn bordered(&self, place: &Place, border: Option<(Row, Interval)>) -> CellMatrix {
        let Place { piece, middle, half, .. } = *place;
        let over = self.bordered_at(piece, border, Taylor::variable(Interval::new(middle - half, middle + half)));
        let middle = self.bordered_at(piece, border, Taylor::variable_of_first_order(Interval::point(middle)));
        CellMatrix::new(&middle, &over)
    }

    /// P or Y in the middle of a place.
    pub fn bordered_at_middle(&self, place: &Place) -> TaylorMatrix {
        self.bordered_at(place.piece, None, Taylor::variable_of_first_order(Interval::point(place.middle)))
    }

    fn bordered_at(&self, piece: usize, border: Option<(Row, Interval)>, t: Taylor) -> TaylorMatrix {
        let n = self.weights.q.nrows();
        let matrix = self.lyapunov(t);
        let Some((row, bound)) = border else { return matrix };
        let row: Vec<Taylor> = match row {
            Row::Input(i) => self.low_row(piece, i, t),
            Row::Limited(i) => {
                let sigma = Interval::point(self.sigma[i]);
                self.low_row(piece, i, t).into_iter().map(|entry| entry / Taylor::constant(sigma)).collect()
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

    /// Row `i` of the low gain: of F where input `i` may saturate, else of K; in the inverse form of FY or KY.
    fn low_row(&self, piece: usize, i: usize, t: Taylor) -> Vec<Taylor> {
        let rho = self.rho(t);
        let (n, m) = (self.weights.q.nrows(), self.inputs());
        let row = |gain: &TaylorMatrix| TaylorMatrix::from_fn(1, n, |_, j| gain.at(i, j));
        let gain = match (&self.auxiliary, &self.form) {
            (Some(auxiliary), _) if self.may_saturate(i) => row(&TaylorMatrix::of_function(auxiliary, rho)),
            (_, form) => {
                let k = row(&TaylorMatrix::new(m, n, self.schedule.gain_on_piece(piece, t, rho)));
                match form {
                    Form::Direct(_) => k,
                    Form::Inverse(y) => k.times(&TaylorMatrix::of_function(y, rho)),
                }
            }
        };
        (0..n).map(|j| gain.at(0, j)).collect()
    }

    /// P⁻¹ and the gain that stays unsaturated at position `t`, as numbers; `None` where P is not definite.
    pub fn inverse_and_gain(&self, t: f64) -> Option<(Mat<f64>, Mat<f64>)> {
        let rho = self.parameter(t);
        let y = match &self.form {
            Form::Direct(p) => inverse_spd(&p.at(&[rho]))?,
            Form::Inverse(y) => y.at(&[rho]),
        };
        let k = self.schedule.gain_matrix(rho);
        let f = match (&self.auxiliary, &self.form) {
            (None, _) => return Some((y, k)),
            (Some(f), Form::Direct(_)) => f.at(&[rho]),
            (Some(l), Form::Inverse(_)) => l.at(&[rho]) * inverse_spd(&y)?,
        };
        let low = Mat::from_fn(k.nrows(), k.ncols(), |i, j| if self.may_saturate(i) { f[(i, j)] } else { k[(i, j)] });
        Some((y, low))
    }

    /// Least level over sampled positions on which the low gain reaches the limits, as numbers: a guess to be proved. Infinite where no
    /// input is limited.
    pub fn unsaturated_level(&self) -> f64 {
        let samples = LEVEL_SAMPLES_PER_PIECE * self.pieces;
        let level = |k: usize| {
            let t = k as f64 / LEVEL_SAMPLES_PER_PIECE as f64;
            let (y, gain) = self.inverse_and_gain(t)?;
            let of_input = |i: usize| {
                let row: Vec<f64> = (0..gain.ncols()).map(|j| gain[(i, j)]).collect();
                let size = quadratic_form(&y, &row).sqrt();
                if size == 0.0 { f64::INFINITY } else { (self.sigma[i] / size).powi(2) }
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

/// What no file that was validated has, and a design made in memory might.
fn refuse_unusable(design: &Design) -> Result<(), Unprovable> {
    let y = design.rate_bounded.iter().flat_map(|bounded| &bounded.y.coefficients);
    let mut matrices = design.points.iter().map(|point| &point.p).chain(y);
    if matrices.any(|matrix| asymmetry(matrix).is_some()) && !mutant::is("asymmetry-tolerated") {
        return Err(Unprovable::NotSymmetric);
    }
    let (limits, operating) = (&design.controller.limits, &design.controller.operating_input);
    let encloses = |i: usize| {
        limits.min[i].is_none_or(|min| min <= operating[i]) && limits.max[i].is_none_or(|max| max >= operating[i])
    };
    match (0..operating.len()).find(|&i| !encloses(i)) {
        Some(i) => Err(Unprovable::OutsideLimits { input: i + 1 }),
        None => Ok(()),
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
