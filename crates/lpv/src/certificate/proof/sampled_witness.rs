//! A refutation of the saturated sampled loop's invariance: a state of the set whose own next sample is outside.
//!
//! At a fixed ρ the sample after x is x₊ = x + Tφ(T)(Ax − Bv), where vᵢ is kᵢx between u*ᵢ − maxᵢ and u*ᵢ − minᵢ: the limits themselves,
//! not the room σ that is the same to both sides. V(x) ≤ γ < V(x₊), evaluated in interval arithmetic, refutes; no premise is needed.
//!
//! Where to look is found by numbers. Between the kinks x₊ is affine, x₊ = Jx + constant, and V(x₊) is convex: its maximum is on the edge of the
//! set or on a kink. From eigenvectors of JᵀPJ against P, x ← √γ P⁻¹g/√(gᵀP⁻¹g) with the gradient g = JᵀPx₊ climbs along the edge (the
//! maximum of the linear form gᵀx); and every state that is met is also tried where it comes to a limit.

use super::closed_loop::{ClosedLoop, Form};
use super::matrix::TaylorMatrix;
use super::place::Place;
use super::sampled_loop::hold;
use super::witness::{form, image, inverse, values};
use crate::certificate::claim::Witness;
use crate::math::Mat;
use crate::math::eigen::symmetric_eigenvectors;
use crate::math::hold::discretize;
use crate::math::interval::Interval;
use crate::math::matrix::{cholesky_inverse, is_finite, quadratic_form, symmetric_part};
use crate::math::taylor::Taylor;
use crate::model::linearize;

/// Steps of each climb.
const CLIMBS: usize = 12;
/// Positions in each piece at which states are sought, and how many of those found are tried in interval arithmetic.
const SAMPLES_PER_PIECE: usize = 8;
const MOST_TRIED: usize = 4;
/// By how much states are taken into the set, until V(x) ≤ γ is proved.
const SHARES: [f64; 5] = [0.0, 1e-15, 1e-13, 1e-11, 1e-8];

/// A state that may leave the set.
struct Candidate {
    position: f64,
    state: Vec<f64>,
    /// V(x₊) in floating point.
    next: f64,
}

/// A state of {V ≤ `level`} whose next sample is proved to be outside, if one is found; `place` is where the proof failed.
pub(super) fn leaves_when_sampled(
    closed_loop: &ClosedLoop,
    place: Option<Place>,
    level: f64,
    sample_time_s: f64,
) -> Option<Witness> {
    let is_usable = |x: f64| x.is_finite() && x > 0.0;
    if !is_usable(level) || !is_usable(sample_time_s) {
        return None;
    }
    let count = if closed_loop.has_parameter { SAMPLES_PER_PIECE * closed_loop.pieces } else { 1 };
    let sampled = (0..count).map(|k| (k as f64 + 0.5) * closed_loop.pieces as f64 / count as f64);
    let positions = place.map(|place| place.middle).into_iter().chain(sampled);
    let mut found: Vec<Candidate> = positions
        .filter_map(|position| Numbers::new(closed_loop, position, sample_time_s)?.farthest(level))
        .filter(|candidate| candidate.next > level)
        .collect();
    found.sort_by(|a, b| b.next.total_cmp(&a.next));
    found.iter().take(MOST_TRIED).find_map(|candidate| proved(closed_loop, candidate, level, sample_time_s))
}

/// The witness, where interval arithmetic agrees.
fn proved(closed_loop: &ClosedLoop, candidate: &Candidate, level: f64, sample_time_s: f64) -> Option<Witness> {
    let piece = (candidate.position as usize).min(closed_loop.pieces - 1);
    let t = Taylor::variable_of_first_order(Interval::point(candidate.position));
    let (a, b, k) = closed_loop.model_and_gain(piece, t);
    let phi = values(&hold(&a, sample_time_s));
    let [a, b, k] = [a, b, k].map(|matrix| values(&matrix));
    let lyapunov = values(&closed_loop.lyapunov(t));
    let p = match closed_loop.form {
        Form::Direct(_) => lyapunov,
        Form::Inverse(_) => inverse(&lyapunov)?,
    };
    SHARES.into_iter().find_map(|share| {
        let state: Vec<f64> = candidate.state.iter().map(|x| (1.0 - share) * x).collect();
        if form(&p, &state).hi() > level {
            return None;
        }
        let inputs: Vec<Interval> = image(&k, &state).into_iter().zip(removable(closed_loop)).map(clipped).collect();
        let flow = image(&a, &state).into_iter().zip(image_of(&b, &inputs)).map(|(ax, bv)| ax - bv);
        let moved = image_of(&phi, &flow.collect::<Vec<Interval>>());
        let next: Vec<Interval> = state.iter().zip(moved).map(|(&x, by)| by * sample_time_s + x).collect();
        let size = next.iter().zip(image_of(&p, &next)).fold(Interval::point(0.0), |sum, (&x, px)| sum + x * px);
        let value = (Interval::point(level) - size).hi();
        let parameter = closed_loop.parameter(candidate.position);
        (value < 0.0).then(|| Witness { parameter, state, value, ..Witness::default() })
    })
}

/// Mx for an enclosed x.
fn image_of(matrix: &TaylorMatrix, x: &[Interval]) -> Vec<Interval> {
    let row = |i: usize| (0..x.len()).fold(Interval::point(0.0), |sum, j| sum + matrix.at(i, j).value * x[j]);
    (0..matrix.shape().0).map(row).collect()
}

/// What u* − u of each input can be: [u* − max, u* − min], both ends enclosed.
fn removable(closed_loop: &ClosedLoop) -> Vec<[Interval; 2]> {
    let limits = closed_loop.limits;
    let operating = closed_loop.operating_input;
    let side = |limit: Option<f64>, i: usize, none: f64| match limit.filter(|limit| limit.is_finite()) {
        Some(limit) => Interval::point(operating[i]) - limit,
        None => Interval::point(none),
    };
    let both = |i: usize| [side(limits.max[i], i, f64::NEG_INFINITY), side(limits.min[i], i, f64::INFINITY)];
    (0..operating.len()).map(both).collect()
}

/// An input between its ends, each of which it grows with.
fn clipped((input, [least, most]): (Interval, [Interval; 2])) -> Interval {
    Interval::new(input.lo().max(least.lo()).min(most.lo()), input.hi().max(least.hi()).min(most.hi()))
}

/// The sampled loop at one parameter in floating point.
struct Numbers {
    position: f64,
    /// e^{AT} and what multiplies v.
    a: Mat<f64>,
    b: Mat<f64>,
    gain: Mat<f64>,
    p: Mat<f64>,
    /// L⁻¹ of P = LLᵀ.
    factor: Mat<f64>,
    /// Least and largest v.
    ends: Vec<[f64; 2]>,
}

impl Numbers {
    fn new(closed_loop: &ClosedLoop, position: f64, sample_time_s: f64) -> Option<Self> {
        let rho = closed_loop.parameter(position);
        let model = linearize(closed_loop.plant, rho);
        let (a, b) = discretize(&model.a, &model.b, sample_time_s);
        let p = symmetric_part(&closed_loop.form.p(rho)?);
        let gain = closed_loop.gain(position);
        let factor = cholesky_inverse(&p)?;
        let ends = removable(closed_loop).into_iter().map(|ends| ends.map(|end| end.lo())).collect();
        let are_finite = [&a, &b, &gain, &factor].into_iter().all(is_finite);
        are_finite.then_some(Self { position, a, b, gain, p, factor, ends })
    }

    fn inputs(&self, x: &[f64]) -> Vec<f64> {
        (0..self.gain.nrows()).map(|i| (0..x.len()).map(|j| self.gain[(i, j)] * x[j]).sum()).collect()
    }

    /// x₊, and J.
    fn step(&self, x: &[f64]) -> (Vec<f64>, Mat<f64>) {
        let free = self.inputs(x);
        let held: Vec<f64> = free.iter().zip(&self.ends).map(|(v, [least, most])| v.max(*least).min(*most)).collect();
        let n = x.len();
        let row = |i: usize| {
            let moved: f64 = (0..n).map(|j| self.a[(i, j)] * x[j]).sum();
            moved - held.iter().enumerate().map(|(l, v)| self.b[(i, l)] * v).sum::<f64>()
        };
        let acting = Mat::from_fn(free.len(), n, |i, j| if held[i] == free[i] { self.gain[(i, j)] } else { 0.0 });
        ((0..n).map(row).collect(), &self.a - &self.b * acting)
    }

    /// A state of the set with a large V(x₊).
    fn farthest(&self, level: f64) -> Option<Candidate> {
        let n = self.p.nrows();
        let mut best = Candidate { position: self.position, state: vec![0.0; n], next: 0.0 };
        let unsaturated = self.step(&vec![0.0; n]).1;
        let none = self.a.clone();
        for flow in [unsaturated, none] {
            // of L⁻¹JᵀPJL⁻ᵀ, whose largest eigenvalue is the most that V is multiplied by
            let turned = &flow * self.factor.transpose();
            let (_, vectors) = symmetric_eigenvectors(&symmetric_part(&(turned.transpose() * &self.p * &turned)))?;
            for start in 0..n {
                let direction: Vec<f64> = (0..n).map(|i| vectors[(i, start)]).collect();
                self.climb(&direction, level, &mut best);
            }
        }
        Some(best)
    }

    /// Along the edge of the set, from the state L⁻ᵀ`direction`.
    fn climb(&self, direction: &[f64], level: f64, best: &mut Candidate) {
        let n = direction.len();
        let mut direction = direction.to_vec();
        for _ in 0..CLIMBS {
            let size = direction.iter().map(|z| z * z).sum::<f64>().sqrt();
            let scale = level.sqrt() / size;
            if !scale.is_finite() {
                return;
            }
            let state: Vec<f64> =
                (0..n).map(|j| scale * (0..n).map(|i| self.factor[(i, j)] * direction[i]).sum::<f64>()).collect();
            self.try_kinks(&state, best);
            let (next, jacobian) = self.step(&state);
            let weighted: Vec<f64> = (0..n).map(|i| (0..n).map(|j| self.p[(i, j)] * next[j]).sum()).collect();
            let gradient: Vec<f64> = (0..n).map(|j| (0..n).map(|i| jacobian[(i, j)] * weighted[i]).sum()).collect();
            direction = (0..n).map(|i| (0..n).map(|j| self.factor[(i, j)] * gradient[j]).sum()).collect();
        }
    }

    /// ±x, and the parts of it at which an input comes to a limit.
    fn try_kinks(&self, state: &[f64], best: &mut Candidate) {
        let kinks = self.inputs(state).into_iter().zip(&self.ends).flat_map(|(v, ends)| ends.map(|end| end / v));
        let parts = kinks.filter(|part| part.is_finite() && part.abs() < 1.0).chain([1.0, -1.0]);
        for part in parts {
            let state: Vec<f64> = state.iter().map(|x| part * x).collect();
            let next = quadratic_form(&self.p, &self.step(&state).0);
            if next > best.next {
                *best = Candidate { position: self.position, state, next };
            }
        }
    }
}
