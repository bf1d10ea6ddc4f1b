//! Loops that are proved: a linear plant, one whose matrices are functions of a parameter, and polytopes; as what the
//! prover takes, as exact points, and as numbers to fly.

use crate::conditions::Point;
use crate::exact::{Dyadic, Exact};
use crate::flight::Frozen;
use crate::numbers::Numbers;
use lpv::certificate::{PolytopicClaim, PolytopicLyapunov, Witness, lyapunov_matrix};
use lpv::controller::{Controller, InputLimits, Schedule};
use lpv::math::Mat;
use lpv::math::matrix::{inverse_spd, quadratic_form, symmetric_part, to_row_vec, to_rows};
use lpv::math::scalar::Scalar;
use lpv::math::taylor::Taylor;
use lpv::model::{BasisFunction, MatrixFunction};
use lpv::plant::{Description, LinearParameters, OperatingPoint, Plant, PlantSpec, Scheduling, Signal};
use lpv::synthesis::{CostWeights, Design, FrozenDesign, HighGainOptions, Method, RateBounded};

/// A plant ẋ = A(ρ)x + B(ρ)u whose parameter is no state: it rests at x = 0, and ρ comes with the operating point.
pub struct Family {
    pub a: MatrixFunction,
    pub b: MatrixFunction,
    description: Description,
}

impl Family {
    pub fn new(a: MatrixFunction, b: MatrixFunction, range: [f64; 2], periodic: bool) -> Self {
        let list = |symbol: &str, count: usize| {
            (1..=count).map(|i| Signal { name: format!("{symbol}_{i}"), unit: "-".into(), wraps: false }).collect()
        };
        let ((n, m), scheduling) = (b.shape(), "rho".to_owned());
        let scheduling = Scheduling {
            parameter: scheduling,
            unit: "-".into(),
            state: 0,
            range,
            rate: [-1.0, 1.0],
            periodic,
            features: Vec::new(),
        };
        let description = Description {
            name: "family".into(),
            states: list("x", n),
            inputs: list("u", m),
            disturbances: Vec::new(),
            outputs: Vec::new(),
            scheduling: Some(scheduling),
            state_limits: vec![None; n],
            scene: None,
        };
        Self { a, b, description }
    }

    fn sizes(&self) -> (usize, usize) {
        self.b.shape()
    }
}

/// Σ fₖ(ρ)Mₖ in row order.
fn entries<S: Scalar>(function: &MatrixFunction, rho: S) -> Vec<S> {
    let factors = function.factors(&[rho]);
    let (rows, columns) = function.shape();
    let entry = |at: usize| {
        factors
            .iter()
            .zip(&function.coefficients)
            .fold(S::from(0.0), |sum, (&factor, matrix)| sum + factor * matrix[(at / columns, at % columns)])
    };
    (0..rows * columns).map(entry).collect()
}

/// M(ρ) and ∂M/∂ρ exactly; `None` of what is no polynomial.
pub fn polynomial(function: &MatrixFunction, rho: f64) -> Option<[Exact; 2]> {
    let (rows, columns) = function.shape();
    let mut sums = [Exact::zeros(rows, columns), Exact::zeros(rows, columns)];
    for (basis, coefficient) in function.basis.iter().zip(&function.coefficients) {
        let exponent = match *basis {
            BasisFunction::Constant => 0,
            BasisFunction::Power { exponent, .. } => exponent,
            _ => return None,
        };
        let power = |exponent: u32| (0..exponent).fold(Dyadic::from(1.0), |power, _| &power * &Dyadic::from(rho));
        let coefficient = Exact::of(coefficient);
        sums[0] = sums[0].plus(&coefficient.scaled(&power(exponent)));
        if exponent > 0 {
            let slope = &power(exponent - 1) * &Dyadic::from(f64::from(exponent));
            sums[1] = sums[1].plus(&coefficient.scaled(&slope));
        }
    }
    Some(sums)
}

impl Plant for Family {
    fn description(&self) -> &Description {
        &self.description
    }

    fn trim(&self, rho: f64) -> OperatingPoint {
        let (n, m) = self.sizes();
        let mut state = vec![0.0; n];
        state.push(rho);
        OperatingPoint { state, input: vec![0.0; m] }
    }

    fn dynamics(&self, _: &[f64], _: &[f64], _: &[f64], dx: &mut [f64]) {
        dx.fill(0.0);
    }

    fn measurement(&self, _: &[f64], _: &[f64], _: &mut [f64]) {}

    fn dynamics_by_state(&self, x: &[f64], _: &[f64], _: &[f64], a: &mut [f64]) {
        a.copy_from_slice(&entries(&self.a, x[self.sizes().0]));
    }

    fn dynamics_by_input(&self, x: &[f64], _: &[f64], _: &[f64], b: &mut [f64]) {
        b.copy_from_slice(&entries(&self.b, x[self.sizes().0]));
    }

    fn dynamics_by_disturbance(&self, _: &[f64], _: &[f64], _: &[f64], _: &mut [f64]) {}

    fn measurement_by_state(&self, _: &[f64], _: &[f64], _: &mut [f64]) {}

    fn trim_over(&self, rho: Taylor) -> (Vec<Taylor>, Vec<Taylor>) {
        let (n, m) = self.sizes();
        let mut state = vec![Taylor::from(0.0); n];
        state.push(rho);
        (state, vec![Taylor::from(0.0); m])
    }

    fn dynamics_over(&self, _: &[Taylor], _: &[Taylor]) -> Vec<Taylor> {
        vec![Taylor::from(0.0); self.sizes().0]
    }

    fn jacobians_over(&self, x: &[Taylor], _: &[Taylor]) -> (Vec<Taylor>, Vec<Taylor>) {
        let rho = x[self.sizes().0];
        (entries(&self.a, rho), entries(&self.b, rho))
    }

    fn input_derivative_over(&self, x: &[Taylor], _: &[Taylor], direction: &[f64]) -> Vec<Taylor> {
        let ((n, m), b) = (self.sizes(), entries(&self.b, x[self.sizes().0]));
        (0..n).map(|i| (0..m).fold(Taylor::from(0.0), |sum, j| sum + b[i * m + j] * direction[j])).collect()
    }

    fn measurement_by_noise(&self, _: &[f64], _: &[f64], _: &mut [f64]) {}
}

/// A design and its plant.
pub struct Loop {
    pub plant: Box<dyn Plant>,
    pub design: Design,
    /// A(ρ) and B(ρ).
    pub family: Option<[MatrixFunction; 2]>,
}

/// What a design without a parameter is made of.
#[derive(Clone, Debug)]
pub struct Linear {
    pub a: Mat<f64>,
    pub b: Mat<f64>,
    pub weights: CostWeights,
    pub p: Mat<f64>,
    pub k: Mat<f64>,
    pub f: Option<Mat<f64>>,
    pub limits: InputLimits,
    pub operating: Vec<f64>,
    pub gamma: Option<f64>,
    pub sample_time_s: f64,
}

/// The method that a level and a second gain belong to.
pub fn method(gamma: Option<f64>, high: bool) -> Method {
    match (gamma, high) {
        (None, _) => Method::Lpvqr,
        (Some(gamma), false) => Method::Slpvqr { gamma },
        (Some(gamma), true) => Method::HighGainSlpvqr { gamma, high_gain: HighGainOptions::default() },
    }
}

impl Linear {
    pub fn spec(&self) -> PlantSpec {
        PlantSpec::Linear(LinearParameters { a: to_rows(&self.a), b: to_rows(&self.b), c: None })
    }

    /// `None` where the plant cannot be built.
    pub fn build(&self) -> Option<Loop> {
        let spec = self.spec();
        let plant = spec.build().ok()?;
        let point = FrozenDesign {
            rho: 0.0,
            gain: self.k.clone(),
            auxiliary_gain: self.f.clone(),
            trace_y: 0.0,
            p: self.p.clone(),
            riccati_difference: None,
            iterations: 0,
        };
        let controller = Controller {
            schedule: Schedule::Constant { gain: self.k.clone() },
            scheduling_state: None,
            operating_input: self.operating.clone(),
            limits: self.limits.clone(),
            supervisor: None,
        };
        let design = Design {
            name: "case".into(),
            convention: String::new(),
            plant: spec,
            model_hash: None,
            method: method(self.gamma, self.f.is_some()),
            weights: self.weights.clone(),
            sample_time_s: self.sample_time_s,
            controller,
            schedule_error: 0.0,
            back_off: 0.0,
            points: vec![point],
            rate_bounded: None,
            inner: Vec::new(),
        };
        Some(Loop { plant, design, family: None })
    }
}

/// The parts of a design for a parameter.
pub struct Scheduled {
    pub weights: CostWeights,
    pub schedule: Schedule,
    /// P at the grid points of a frozen design.
    pub points: Vec<(f64, Mat<f64>, Option<Mat<f64>>)>,
    pub rate_bounded: Option<RateBounded>,
    pub limits: InputLimits,
    pub gamma: Option<f64>,
    pub high: bool,
    pub sample_time_s: f64,
}

impl Scheduled {
    pub fn build(self, plant: Family) -> Loop {
        let inputs = self.weights.r.nrows();
        let point = |(rho, p, f): (f64, Mat<f64>, Option<Mat<f64>>)| FrozenDesign {
            rho,
            gain: self.schedule.gain_matrix(rho),
            auxiliary_gain: f,
            trace_y: 0.0,
            p,
            riccati_difference: None,
            iterations: 0,
        };
        let controller = Controller {
            schedule: self.schedule.clone(),
            scheduling_state: Some(0),
            operating_input: vec![0.0; inputs],
            limits: self.limits,
            supervisor: None,
        };
        let design = Design {
            name: "case".into(),
            convention: String::new(),
            plant: PlantSpec::DoubleIntegrator {},
            model_hash: None,
            method: method(self.gamma, self.high),
            weights: self.weights,
            sample_time_s: self.sample_time_s,
            controller,
            schedule_error: 0.0,
            back_off: 0.0,
            points: self.points.into_iter().map(point).collect(),
            rate_bounded: self.rate_bounded,
            inner: Vec::new(),
        };
        let family = Some([plant.a.clone(), plant.b.clone()]);
        Loop { plant: Box::new(plant), design, family }
    }
}

impl Loop {
    pub fn sizes(&self) -> (usize, usize) {
        (self.design.weights.q.nrows(), self.design.weights.r.nrows())
    }

    pub fn model(&self, rho: f64) -> (Mat<f64>, Mat<f64>) {
        let (n, m) = self.sizes();
        let at = self.plant.trim(rho);
        let (mut a, mut b) = (vec![0.0; n * n], vec![0.0; n * m]);
        let w = vec![0.0; self.plant.description().disturbances.len()];
        self.plant.dynamics_by_state(&at.state, &at.input, &w, &mut a);
        self.plant.dynamics_by_input(&at.state, &at.input, &w, &mut b);
        (Mat::from_fn(n, n, |i, j| a[i * n + j]), Mat::from_fn(n, m, |i, j| b[i * m + j]))
    }

    /// The loop at ρ; exactly where everything is a polynomial of ρ and the gain does not depend on it, else to a
    /// relative 10⁻⁹.
    pub fn point(&self, rho: f64) -> Point {
        let (n, _) = self.sizes();
        let design = &self.design;
        let mut is_exact = matches!(design.controller.schedule, Schedule::Constant { .. });
        let mut of = |function: &MatrixFunction| {
            polynomial(function, rho).unwrap_or_else(|| {
                is_exact = false;
                [Exact::of(&function.at(&[rho])), Exact::of(&function.derivative(&[rho], 0))]
            })
        };
        let [a, b] = match &self.family {
            Some(functions) => functions.each_ref().map(|function| {
                let [value, _] = of(function);
                value
            }),
            None => {
                let (a, b) = self.model(rho);
                [Exact::of(&a), Exact::of(&b)]
            }
        };
        let low = design.points[0].auxiliary_gain.as_ref();
        let (inverse, [v, slope], low) = match &design.rate_bounded {
            Some(bounded) => {
                let l = bounded.l.as_ref().filter(|_| low.is_some()).map(|l| {
                    let [value, _] = of(l);
                    value
                });
                (true, of(&bounded.y), l)
            }
            None if self.family.is_none() => {
                (false, [Exact::of(&design.points[0].p), Exact::zeros(n, n)], low.map(Exact::of))
            }
            // the harmonics through the points, which the prover's own function gives
            None => {
                let p = |rho: f64| lyapunov_matrix(design, &*self.plant, rho).unwrap_or_else(|| Mat::zeros(n, n));
                // the difference of an analytic function, by Richardson
                let difference = |h: f64| (1.0 / (2.0 * h)) * (p(rho + h) - p(rho - h));
                let slope = (1.0 / 3.0) * (4.0 * difference(5e-4) - difference(1e-3));
                is_exact = false;
                (false, [Exact::of(&p(rho)), Exact::of(&symmetric_part(&slope))], None)
            }
        };
        let k = Exact::of(&design.controller.schedule.gain_matrix(rho));
        let high = if inverse { k.times(&v) } else { k };
        Point { a, b, inverse, v, slope, turns: Vec::new(), high, low, slack: if is_exact { 0.0 } else { 1e-9 } }
    }

    pub fn frozen(&self, rho: f64) -> Option<Frozen> {
        let (a, b) = self.model(rho);
        let p = match &self.design.rate_bounded {
            Some(bounded) => bounded.p(rho)?,
            None => lyapunov_matrix(&self.design, &*self.plant, rho)?,
        };
        Some(Frozen::new(&a, &b, &self.design.controller.schedule.gain_matrix(rho), &p))
    }
}

/// The exact point of a polytope at convex weights, with the turning of each rate vertex, or of the rates given.
pub fn polytope_point(claim: &PolytopicClaim, weights: &[f64], rates: Option<&[f64]>) -> Point {
    let mean = |matrix: &dyn Fn(usize) -> Exact| {
        let first = matrix(0);
        let terms = (0..claim.polytope.len()).map(|i| matrix(i).by(weights[i]));
        terms.fold(Exact::zeros(first.rows, first.columns), |sum, term| sum.plus(&term))
    };
    let a = mean(&|i| Exact::of(claim.polytope.a(i)));
    let b = mean(&|i| Exact::of(claim.polytope.b(i)));
    let (inverse, v, high, turns, low) = match &claim.lyapunov {
        PolytopicLyapunov::Common { p, gain } => {
            let low = claim.auxiliary_gain.as_ref().map(|f| mean(&|i| Exact::of(&f[i])));
            (false, Exact::of(p), mean(&|i| Exact::of(&gain[i])), Vec::new(), low)
        }
        PolytopicLyapunov::ParameterDependent { y, l, rate_vertices } => {
            let n = y[0].nrows();
            let turn = |rates: &[f64]| {
                (0..y.len()).fold(Exact::zeros(n, n), |sum, i| sum.plus(&Exact::of(&y[i]).by(rates[i])))
            };
            let turns = match rates {
                Some(rates) => vec![turn(rates)],
                None => rate_vertices.iter().map(|rates| turn(rates)).collect(),
            };
            let low = claim.auxiliary_gain.as_ref().map(|f| mean(&|i| Exact::of(&f[i]).times(&Exact::of(&y[i]))));
            (true, mean(&|i| Exact::of(&y[i])), mean(&|i| Exact::of(&l[i])), turns, low)
        }
    };
    let n = a.rows;
    Point { a, b, inverse, v, slope: Exact::zeros(n, n), turns, high, low, slack: 0.0 }
}

pub fn polytope_witness(claim: &PolytopicClaim, witness: &Witness) -> Point {
    let rates = (!witness.vertex_rates.is_empty()).then_some(&witness.vertex_rates[..]);
    polytope_point(claim, &witness.vertex_weights, rates)
}

/// The polytope at convex weights, in numbers.
pub fn polytope_frozen(claim: &PolytopicClaim, weights: &[f64]) -> Option<Frozen> {
    let mean = |of: &dyn Fn(usize) -> Mat<f64>| {
        let first = of(0);
        let sum = |i: usize, j: usize| (0..weights.len()).map(|v| weights[v] * of(v)[(i, j)]).sum();
        Mat::from_fn(first.nrows(), first.ncols(), sum)
    };
    let (a, b) = (mean(&|i| claim.polytope.a(i).clone()), mean(&|i| claim.polytope.b(i).clone()));
    match &claim.lyapunov {
        PolytopicLyapunov::Common { p, gain } => Some(Frozen::new(&a, &b, &mean(&|i| gain[i].clone()), p)),
        PolytopicLyapunov::ParameterDependent { y, l, .. } => {
            let p = inverse_spd(&mean(&|i| y[i].clone()))?;
            Some(Frozen::new(&a, &b, &(mean(&|i| l[i].clone()) * &p), &p))
        }
    }
}

/// Limits of one input around its operating value: none, infinite, one-sided, zero room, lopsided.
pub fn limit(numbers: &mut Numbers, operating: f64) -> (Option<f64>, Option<f64>) {
    let size = 2.0_f64.powf(2.0 * numbers.next());
    match numbers.below(10) {
        0 => (None, None),
        1 => (Some(f64::NEG_INFINITY), Some(f64::INFINITY)),
        2 => (None, Some(operating + size)),
        3 => (Some(operating - size), Some(f64::INFINITY)),
        4 => (Some(operating), Some(operating + size)),
        5 => (Some(operating - size), Some(operating + 3.0 * size)),
        _ => (Some(operating - size), Some(operating + size)),
    }
}

pub fn limits(numbers: &mut Numbers, operating: &[f64]) -> InputLimits {
    // often one kind for all
    let (min, max) = match numbers.below(6) {
        0 => (vec![None; operating.len()], vec![None; operating.len()]),
        1 => operating.iter().map(|u| (Some(u - 1.0), Some(u + 1.0))).unzip(),
        _ => operating.iter().map(|&u| limit(numbers, u)).unzip(),
    };
    InputLimits { min, max }
}

/// How far sat(Kx) goes down and up: u = u* − s.
pub fn sides(limits: &InputLimits, operating: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let below = (0..operating.len()).map(|i| limits.max[i].map_or(f64::INFINITY, |max| max - operating[i]));
    let above = (0..operating.len()).map(|i| limits.min[i].map_or(f64::INFINITY, |min| operating[i] - min));
    (below.collect(), above.collect())
}

/// The largest level up to which rows of `gain` stay within σ, in numbers.
pub fn level(p: &Mat<f64>, gain: &Mat<f64>, sigma: &[f64]) -> Option<f64> {
    let y = inverse_spd(p)?;
    let of = |i: usize| {
        let row: Vec<f64> = to_row_vec(&Mat::from_fn(1, gain.ncols(), |_, j| gain[(i, j)]));
        sigma[i] * sigma[i] / quadratic_form(&y, &row)
    };
    let least = (0..gain.nrows()).filter(|&i| sigma[i].is_finite()).map(of).fold(f64::INFINITY, f64::min);
    (least.is_finite() && least > 0.0).then_some(least)
}
