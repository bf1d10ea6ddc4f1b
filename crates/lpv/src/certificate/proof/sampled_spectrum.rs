//! Is the sampled loop stable at one value of the parameter? Proved or refuted, however close the eigenvalues are to the circle.
//!
//! - An X with −(EᵀX + XE + TEᵀXE) ≻ 0 and zᵀzX < 0 at some z refutes: along the motion from z xᵀXx falls, and x does not come to
//!   rest. X comes from eigenvectors, with weights of the sign that the moduli ask for.
//! - Else I + TE is computed in balls of hundreds of bits and the recursion of Schur and Cohn tells (`math::schur_cohn`): that all
//!   eigenvalues are inside, or that one is outside, for every A, B and K of the enclosures. The state that is shown is then the real part of
//!   the eigenvector that numbers give.
//! - A state that the loop leaves where it is, Ax = 0 and Kx = 0, refutes.

use super::closed_loop::ClosedLoop;
use super::matrix::{TaylorMatrix, middle};
use super::place::Place;
use super::sampled_loop::{decrease, increment, scaling};
use super::witness::{form, is_positive, values};
use crate::certificate::claim::Witness;
use crate::math::Mat;
use crate::math::ball::BallMatrix;
use crate::math::eigen::{growing_direction, spectral_radius};
use crate::math::interval::Interval;
use crate::math::matrix::identity;
use crate::math::schur_cohn::{Spectrum, characteristic_polynomial, scaled, zeros};
use crate::math::stein;
use crate::math::taylor::Taylor;

/// Bits of the first attempt, and for each state.
const BITS: u64 = 256;
const BITS_PER_STATE: u64 = 16;
/// Attempts, each with twice the bits of the one before, and bits beyond which none is made.
const ATTEMPTS: usize = 3;
const MOST_BITS: u64 = 8192;
/// The series of balls is for ‖AT‖ ≤ 2⁻⁴, reached by at most so many halvings.
const SMALL: u64 = 4;
const MOST_HALVINGS: u64 = 64;
/// Positions in each piece of which the one with the largest eigenvalue is looked at.
const SAMPLES_PER_PIECE: usize = 8;

/// What is known of the eigenvalues.
pub(super) enum Decision {
    /// Inside the circle: there is no parameter, and this is the whole claim.
    Stable {
        /// 1 − |κ| of the reflection coefficients.
        margin: f64,
        /// Bits that it took.
        bits: u64,
    },
    /// At the parameter of the witness one is not inside.
    Unstable {
        /// Of the claim.
        witness: Witness,
        /// What was shown.
        reason: String,
    },
    /// Neither is shown.
    Open {
        /// Why.
        reason: String,
    },
}

/// Decide at the middle of `place`, and where there is a parameter also where numbers give the largest eigenvalue.
pub(super) fn decide(closed_loop: &ClosedLoop, place: &Place, sample_time_s: f64) -> Decision {
    if !(sample_time_s.is_finite() && sample_time_s > 0.0) {
        return Decision::Open { reason: "the sample time is not positive".into() };
    }
    let at = |position: f64| {
        let piece = (position as usize).min(closed_loop.pieces - 1);
        let exponents = scaling(closed_loop, position, sample_time_s);
        Sampled { closed_loop, position, piece, sample_time_s, exponents }.decide()
    };
    if !closed_loop.has_parameter {
        return at(place.middle);
    }
    let count = SAMPLES_PER_PIECE * closed_loop.pieces;
    let radius = |position: f64| Sampled::about(closed_loop, position, sample_time_s);
    let positions = (0..count).map(|k| (k as f64 + 0.5) / SAMPLES_PER_PIECE as f64);
    let largest = positions.map(|t| (t, radius(t))).filter(|(_, r)| r.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1));
    let candidates = std::iter::once(place.middle).chain(largest.map(|(t, _)| t));
    let mut reason = "the loop is too close to the edge of stability".to_owned();
    for position in candidates {
        match at(position) {
            Decision::Stable { .. } => {}
            Decision::Open { reason: found } => reason = found,
            refuted => return refuted,
        }
    }
    Decision::Open { reason }
}

/// The sampled loop at one position.
struct Sampled<'a> {
    closed_loop: &'a ClosedLoop<'a>,
    position: f64,
    piece: usize,
    sample_time_s: f64,
    exponents: Vec<i32>,
}

impl Sampled<'_> {
    /// The spectral radius in floating point.
    fn about(closed_loop: &ClosedLoop, position: f64, sample_time_s: f64) -> f64 {
        let model = crate::model::linearize(closed_loop.plant, closed_loop.parameter(position));
        let (a, b) = crate::math::hold::discretize(&model.a, &model.b, sample_time_s);
        spectral_radius(&(a - b * closed_loop.gain(position)))
    }

    fn variable(&self) -> Taylor {
        Taylor::variable_of_first_order(Interval::point(self.position))
    }

    fn decide(&self) -> Decision {
        let e = values(&increment(self.closed_loop, self.piece, self.variable(), self.sample_time_s, &self.exponents));
        if let Some(refuted) = self.rests().or_else(|| self.inertia(&e)) {
            return refuted;
        }
        self.by_balls(&middle(&e))
    }

    fn unstable(&self, direction: &[f64], value: f64, reason: String) -> Decision {
        // powers of two: no digit is lost
        let state = direction.iter().zip(&self.exponents).map(|(z, &e)| z * 2.0_f64.powi(e)).collect();
        let parameter = self.closed_loop.parameter(self.position);
        Decision::Unstable { witness: Witness { parameter, state, value, ..Witness::default() }, reason }
    }

    /// A state xᵢ = 1 with Ax = 0 and Kx = 0, exactly.
    fn rests(&self) -> Option<Decision> {
        let (a, _, k) = self.closed_loop.model_and_gain(self.piece, self.variable());
        let is_zero = |matrix: &TaylorMatrix, j: usize| (0..matrix.shape().0).all(|i| matrix.at(i, j).value.is_zero());
        let at = (0..a.shape().1).find(|&j| is_zero(&a, j) && is_zero(&k, j))?;
        let direction: Vec<f64> = (0..a.shape().1).map(|j| f64::from(u8::from(j == at))).collect();
        Some(self.unstable(&direction, 0.0, "the loop leaves this state where it is".into()))
    }

    /// X of eigenvectors, with which the motion of a state is shown not to come to rest.
    fn inertia(&self, e: &TaylorMatrix) -> Option<Decision> {
        let (x, direction) = stein::indefinite(&middle(e), self.sample_time_s)?;
        let x = TaylorMatrix::constant(&x);
        let value = form(&x, &direction).hi();
        let holds = value < 0.0 && is_positive(&decrease(&x, e, self.sample_time_s));
        holds.then(|| self.unstable(&direction, value, "an indefinite quadratic form falls along it".into()))
    }

    fn by_balls(&self, about: &Mat<f64>) -> Decision {
        let n = about.nrows();
        let about = identity(n) + self.sample_time_s * about;
        let mut bits = BITS + BITS_PER_STATE * n as u64;
        for _ in 0..ATTEMPTS {
            let Some(mut sampled) = self.sampled(bits) else { break };
            // large entries take bits in each of the products
            let extra = 2 * n as u64 * sampled.whole_bits();
            if bits + extra > MOST_BITS {
                break;
            }
            if extra > 0 {
                bits += extra;
                let Some(finer) = self.sampled(bits) else { break };
                sampled = finer;
            }
            let polynomial = characteristic_polynomial(&sampled);
            let mut found = zeros(polynomial.clone(), bits);
            let radius = spectral_radius(&about);
            if let (Spectrum::Unknown { .. }, true) = (found, radius > 1.0 && radius.is_finite()) {
                // the product of the eigenvalues may have modulus 1
                let q = 1.0 / (1.0 + 0.5 * (radius - 1.0));
                if let outside @ Spectrum::Outside { .. } = zeros(scaled(&polynomial, q.min(1.0), bits), bits) {
                    found = outside;
                }
            }
            match found {
                Spectrum::Inside { margin } => return Decision::Stable { margin, bits },
                Spectrum::Outside { excess } => {
                    let direction = growing_direction(&about).unwrap_or_else(|| vec![1.0; n]);
                    let reason = format!("an eigenvalue is outside the unit circle, shown with {bits} bits");
                    return self.unstable(&direction, -excess, reason);
                }
                Spectrum::Unknown { is_open: false } => break,
                Spectrum::Unknown { is_open: true } => bits *= 2,
            }
        }
        if crate::mutant::is("sampled-edge-stable") {
            return Decision::Stable { margin: 0.5, bits };
        }
        Decision::Open { reason: format!("an eigenvalue is too close to the unit circle to be told with {bits} bits") }
    }

    /// I + TΦ(A − BK) in balls, in balanced coordinates.
    fn sampled(&self, bits: u64) -> Option<BallMatrix> {
        let (a, b, k) = self.closed_loop.model_and_gain(self.piece, self.variable());
        let exponent = |i: usize| i64::from(self.exponents[i]);
        let ball = |matrix: &TaylorMatrix, shift: &dyn Fn(usize, usize) -> i64| {
            let (rows, columns) = matrix.shape();
            BallMatrix::new(rows, columns, bits, |i, j| matrix.at(i, j).value, shift)
        };
        let a = ball(&a, &|i, j| exponent(j) - exponent(i))?;
        let b = ball(&b, &|i, _| -exponent(i))?;
        let k = ball(&k, &|_, j| exponent(j))?;
        let flow = a.minus(&b.times(&k));
        let phi = hold(&a.times_number(self.sample_time_s))?;
        let increment = phi.times(&flow).times_number(self.sample_time_s);
        Some(BallMatrix::identity(flow.size(), bits).plus(&increment))
    }
}

/// Σ_{k≥0} Xᵏ/(k + 1)! in balls, as `sampled::hold` does it; `None` where X is too large.
fn hold(x: &BallMatrix) -> Option<BallMatrix> {
    let (n, bits) = (x.size(), x.bits());
    let halvings = if x.is_at_most(-(SMALL as i64)) { 0 } else { x.whole_bits() + SMALL };
    if halvings > MOST_HALVINGS {
        return None;
    }
    let short = x.times_number(2.0_f64.powi(-(halvings as i32)));
    if !short.is_at_most(-(SMALL as i64)) {
        return None;
    }
    let mut term = BallMatrix::identity(n, bits);
    let mut phi = term.clone();
    for k in 1..=(bits / SMALL) as usize {
        term = term.times(&short).over(k + 1);
        phi = phi.plus(&term);
        if term.is_at_most(SMALL as i64 + 8 - bits as i64) {
            break;
        }
    }
    // terms fall by 2⁻⁴ and more, so that all that follow are together less than the last
    phi = phi.widened_by(&term);
    let mut growth = short.times(&phi);
    for _ in 0..halvings {
        phi = phi.plus(&growth.times(&phi).times_number(0.5));
        growth = growth.plus(&growth).plus(&growth.times(&growth));
    }
    Some(phi)
}
