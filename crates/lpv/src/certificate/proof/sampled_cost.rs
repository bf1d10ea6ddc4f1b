//! The cost of the saturated loop with zero-order hold, as it flies: at most κ V(x(0)), V = xᵀPx, without a parameter.
//!
//! After a sample at x the inputs are held, u = u* − v with vᵢ = sat(kᵢx), and the motion and its cost over the period are
//!
//! ```text
//! z(τ) = e^{Gτ}z,  z = (x, v),  G = [A, −B; 0, 0],      ∫₀ᵀ xᵀQx + vᵀRv dτ = T zᵀWz,
//! W = (1/T) ∫₀ᵀ e^{Gᵀτ}Ce^{Gτ} dτ,  C = [Q, 0; 0, R].
//! ```
//!
//! To be shown is κ(V(x) − V(x(T))) ≥ T zᵀWz. Summed over the samples it bounds the cost by κ(V(x(0)) − V(x(NT))) ≤ κ V(x(0)), and as W ⪰ 0
//! the samples stay in {V ≤ γ}. Where they do, the row fᵢ of the low gain does not saturate, so that vᵢ lies between fᵢx and kᵢx. The left side
//! less the right one is concave in v (P ≻ 0, W ⪰ 0), and least at a corner: v = Sx for a mixture S of rows of F and K (of a low gain there is
//! one). With x(T) = x + TNx, N = φ(T)(A − BS), it is T times the form of
//!
//! ```text
//! κD(S) − W(S) ≻ 0,    D(S) = −(NᵀP + PN + TNᵀPN),    W(S) = [I; S]ᵀW[I; S].
//! ```
//!
//! The least κ of every mixture is the largest eigenvalue of D⁻¹W, in floating point; a little more is then proved in interval arithmetic.
//! It is below 1 where V is more than the cost, and above where holding the input costs more than moving it all the time.
//!
//! **W.** With X = GT and the operator L(M) = XᵀM + MX, W = Σ_{k≥0} Lᵏ(C)/(k + 1)!. In the largest entry |L(M)| ≤ 2‖X‖₁|M|, so that for
//! 2‖X‖₁ ≤ 1 what follows after N terms is at most 2|C|/(N + 2)!. A longer period is doubled up: W(2h) = ½(W(h) + e^{Gᵀh}W(h)e^{Gh}).
//!
//! All of it is computed in coordinates of the state and units of the inputs that are balanced by powers of two, which is exact.

use super::claims::{definite, unsaturated, words};
use super::closed_loop::Unprovable;
use super::closed_loop::{ClosedLoop, Form};
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix, middle as middle_of};
use super::rowwise::mixed;
use super::sampled_loop::hold;
use super::weights;
use crate::certificate::claim::{Claim, ClaimKind, Of, Verdict, Words, settle};
use crate::math::Mat;
use crate::math::balance::balance;
use crate::math::decimal::at_least;
use crate::math::eigen::symmetric_eigenvalues;
use crate::math::interval::Interval;
use crate::math::matrix::{cholesky_inverse, identity, symmetric_part};
use crate::math::taylor::Taylor;
use crate::plant::Plant;
use crate::synthesis::Design;
use std::time::Instant;

/// Terms of the series of W.
const TERMS: usize = 26;
/// Doublings of the period beyond which nothing is computed.
const MOST_DOUBLINGS: f64 = 40.0;
/// Inputs that may saturate, up to which mixtures are taken one by one.
const MOST_MIXED: usize = 10;
/// By how much more than the least κ is tried to be proved, one after the other.
const MORE: [f64; 5] = [1e-7, 1e-6, 1e-4, 1e-2, 0.1];

/// What is proved of the cost of the loop that flies.
#[derive(Clone, Debug)]
pub struct SampledCost {
    /// The cost bound, and before it what it rests on.
    pub claims: Vec<Claim>,
    /// κ, where it is proved.
    pub factor: Option<f64>,
    /// The level of the set from which it holds; `None`: from everywhere.
    pub level: Option<f64>,
}

/// The least κ for which the cost of the saturated loop of `design`, sampled with zero-order hold at the design's sample time, is proved to be at
/// most κ V(x(0)), from {V ≤ γ} where inputs are limited. Of the LPV model, which of a linear plant is the plant.
///
/// # Errors
/// See [`Unprovable`].
pub fn prove_sampled_cost(design: &Design, plant: &dyn Plant) -> Result<SampledCost, Unprovable> {
    let closed_loop = ClosedLoop::new(design, plant)?;
    let words = words(plant);
    let mut claims = vec![weights::claim(&design.weights, &words), definite(&closed_loop, &words)];
    let level = unsaturated(&closed_loop, &words, design.method.gamma(), true, &mut claims);
    claims.push(claim(&closed_loop, &words, level, design.sample_time_s));
    settle(&mut claims);
    let factor = claims.iter().find_map(|claim| match claim.kind {
        ClaimKind::SampledCost { factor, .. } if claim.verdict == Verdict::Proved => Some(factor),
        _ => None,
    });
    Ok(SampledCost { claims, factor, level })
}

/// The claim that the cost of the sampled loop is at most κ V(x(0)), for the least κ that is found.
pub(super) fn claim(closed_loop: &ClosedLoop, words: &Words, level: Option<f64>, sample_time_s: f64) -> Claim {
    let started = Instant::now();
    let (factor, margin, reason) = match bound(closed_loop, sample_time_s) {
        Ok((factor, margin)) => (factor, margin, None),
        Err(reason) => (f64::INFINITY, f64::NAN, Some(reason)),
    };
    let kind = ClaimKind::SampledCost { factor, level, sample_time_s };
    let premises: &[&'static str] = match level {
        None => &["weights", "lyapunov-definite"],
        Some(_) => &["weights", "lyapunov-definite", "unsaturated"],
    };
    let claim = Claim::new(kind, Of::Model, words).resting_on(premises);
    let claim = match reason {
        None => claim.decided(Verdict::Proved, margin, format!("relative margin {}", at_least(margin))),
        Some(reason) => claim.decided(Verdict::Undecided, f64::NAN, reason),
    };
    Claim { seconds: started.elapsed().as_secs_f64(), ..claim }
}

/// κ and the margin with which it is proved, or why none is.
fn bound(closed_loop: &ClosedLoop, sample_time_s: f64) -> Result<(f64, f64), String> {
    if !(sample_time_s.is_finite() && sample_time_s > 0.0) {
        return Err("the sample time is not positive".into());
    }
    if closed_loop.has_parameter {
        return Err("the plant has a parameter".into());
    }
    let saturating = closed_loop.saturating();
    if saturating.len() > MOST_MIXED {
        return Err(format!("{} inputs may saturate, too many for all mixtures of their rows", saturating.len()));
    }
    let Some(held) = Held::new(closed_loop, sample_time_s) else {
        return Err("its V is not given by P".into());
    };
    let mixtures: Vec<Mixture> = (0..1_usize << saturating.len()).map(|k| held.mixture(k, &saturating)).collect();
    let least = mixtures.iter().map(Mixture::least_factor).try_fold(0.0, |most: f64, factor| Some(most.max(factor?)));
    let Some(least) = least.filter(|least| least.is_finite() && *least > 0.0) else {
        return Err("V does not decrease from sample to sample, or not by the cost".into());
    };
    let proved = |factor: f64| {
        mixtures.iter().try_fold(f64::INFINITY, |margin: f64, mixture| Some(margin.min(mixture.margin(factor)?)))
    };
    let found = MORE.iter().map(|more| least * (1.0 + more)).find_map(|factor| Some((factor, proved(factor)?)));
    found.ok_or_else(|| "too close to the edge to be told, or rounding is too much".into())
}

/// The loop over one period, in balanced coordinates.
struct Held {
    sample_time_s: f64,
    p: TaylorMatrix,
    a: TaylorMatrix,
    b: TaylorMatrix,
    /// φ(T)
    phi: TaylorMatrix,
    /// K and F.
    gains: [TaylorMatrix; 2],
    /// W
    cost: TaylorMatrix,
}

/// D(S) and W(S).
struct Mixture {
    decrease: TaylorMatrix,
    cost: TaylorMatrix,
}

impl Held {
    /// `None` where V is given by Y = P⁻¹.
    fn new(closed_loop: &ClosedLoop, sample_time_s: f64) -> Option<Self> {
        let t = Taylor::from(0.5);
        let (a, b, high) = closed_loop.model_and_gain(0, t);
        let Form::Direct(p) = &closed_loop.form else { return None };
        let p = TaylorMatrix::of_function(p, closed_loop.rho(t));
        let low = closed_loop.auxiliary.as_ref().map(|f| TaylorMatrix::of_function(f, closed_loop.rho(t)));
        let low = low.unwrap_or_else(|| high.clone());
        let (n, m) = b.shape();
        let (state, input) = exponents([&a, &b, &high]);
        let [of_state, of_input] = [&state, &input].map(|e| e.iter().map(|&e| 2.0_f64.powi(e)).collect::<Vec<f64>>());
        let scaled = |matrix: &TaylorMatrix, left: &dyn Fn(usize) -> f64, right: &[f64]| {
            let (rows, columns) = matrix.shape();
            // one after the other: a product of both powers might leave the range of numbers
            TaylorMatrix::from_fn(rows, columns, |i, j| matrix.at(i, j) * left(i) * right[j])
        };
        let (up, down, per_input) =
            (|i: usize| of_state[i], |i: usize| 1.0 / of_state[i], |i: usize| 1.0 / of_input[i]);
        let constant = TaylorMatrix::constant;
        let q = scaled(&constant(&closed_loop.weights.q), &up, &of_state);
        let r = scaled(&constant(&closed_loop.weights.r), &|i: usize| of_input[i], &of_input);
        let (a, b) = (scaled(&a, &down, &of_state), scaled(&b, &down, &of_input));
        let zero = Taylor::from(0.0);
        let flow = TaylorMatrix::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
            (true, true) => a.at(i, j),
            (true, false) => -b.at(i, j - n),
            _ => zero,
        });
        let stage = TaylorMatrix::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
            (true, true) => q.at(i, j),
            (false, false) => r.at(i - n, j - n),
            _ => zero,
        });
        Some(Self {
            sample_time_s,
            p: scaled(&p, &up, &of_state),
            phi: hold(&a, sample_time_s),
            gains: [high, low].map(|gain| scaled(&gain, &per_input, &of_state)),
            cost: mean_cost(&flow.scaled(sample_time_s), &stage),
            a,
            b,
        })
    }

    fn mixture(&self, number: usize, saturating: &[usize]) -> Mixture {
        let [high, low] = &self.gains;
        let s = mixed(number, saturating, low, high);
        let (m, n) = s.shape();
        let increment = self.phi.times(&self.a.minus(&self.b.times(&s)));
        let fall = self.p.times(&increment);
        let second = increment.transpose().times(&fall).scaled(self.sample_time_s);
        let decrease = fall.plus(&fall.transpose()).plus(&second).negated();
        let unit = |i: usize, j: usize| Taylor::from(if i == j { 1.0 } else { 0.0 });
        let both = TaylorMatrix::from_fn(n + m, n, |i, j| if i < n { unit(i, j) } else { s.at(i - n, j) });
        let cost = both.transpose().times(&self.cost.times(&both));
        Mixture { decrease, cost }
    }
}

impl Mixture {
    /// The largest eigenvalue of D⁻¹W, in floating point; `None` where D is not definite.
    fn least_factor(&self) -> Option<f64> {
        let [decrease, cost] = [&self.decrease, &self.cost].map(|matrix| symmetric_part(&middle_of(matrix)));
        let factor = cholesky_inverse(&decrease)?;
        symmetric_eigenvalues(&symmetric_part(&(&factor * cost * factor.transpose()))).last().copied()
    }

    /// The margin of κD − W ≻ 0, where that is proved.
    fn margin(&self, factor: f64) -> Option<f64> {
        let left = self.decrease.scaled(factor).minus(&self.cost);
        match CellMatrix::new(&left, &left).is_positive(0.0) {
            Definiteness::Proved(margin) => Some(margin),
            _ => None,
        }
    }
}

/// Exponents of the coordinates of the state and the units of the inputs, from numbers.
fn exponents([a, b, k]: [&TaylorMatrix; 3]) -> (Vec<i32>, Vec<i32>) {
    let [a, b, k] = [a, b, k].map(middle_of);
    let (n, m) = (b.nrows(), b.ncols());
    let all = Mat::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => a[(i, j)],
        (true, false) => b[(i, j - n)],
        (false, true) => k[(i - n, j)],
        (false, false) => 0.0,
    });
    let exponents = balance(&all);
    (exponents[..n].to_vec(), exponents[n..].to_vec())
}

/// W = Σ_{k≥0} Lᵏ(C)/(k + 1)!, L(M) = XᵀM + MX.
fn mean_cost(x: &TaylorMatrix, stage: &TaylorMatrix) -> TaylorMatrix {
    let n = x.shape().0;
    let entire = || TaylorMatrix::from_fn(n, n, |_, _| Taylor::constant(Interval::ENTIRE));
    // 2‖X‖₁ ≤ 1 after so many halvings, also where it is a power of two and rounded up
    let halvings = (2.0 * column_sums(x) * (1.0 + 1e-9)).log2().ceil().max(0.0);
    if halvings.is_nan() || halvings > MOST_DOUBLINGS {
        return entire();
    }
    let short = if halvings == 0.0 { x.clone() } else { x.scaled(2.0_f64.powi(-(halvings as i32))) };
    if column_sums(&short) > 0.5 {
        return entire();
    }
    let mut term = stage.clone();
    let mut sum = stage.clone();
    for k in 1..=TERMS {
        let product = term.times(&short);
        let both = product.plus(&product.transpose());
        term = TaylorMatrix::from_fn(n, n, |i, j| both.at(i, j) / Taylor::from((k + 1) as f64));
        sum = sum.plus(&term);
    }
    let largest = (0..n * n).map(|at| stage.at(at / n, at % n).value.magnitude()).fold(0.0, f64::max);
    let rest = (3..=TERMS + 2).fold(Interval::point(largest), |bound, k| bound / k as f64).hi();
    let rest = Taylor::constant(Interval::new(-rest, rest));
    let mut mean = TaylorMatrix::from_fn(n, n, |i, j| sum.at(i, j) + rest);
    // e^X = I + Xφ(X)
    let mut motion = TaylorMatrix::constant(&identity(n)).plus(&short.times(&hold(&short, 1.0)));
    for _ in 0..halvings as usize {
        mean = mean.plus(&motion.transpose().times(&mean.times(&motion))).scaled(0.5);
        motion = motion.times(&motion);
    }
    mean
}

/// ‖X‖₁, rounded up.
fn column_sums(x: &TaylorMatrix) -> f64 {
    let (rows, columns) = x.shape();
    let column = |j: usize| {
        (0..rows).fold(Interval::point(0.0), |sum, i| sum + Interval::from(x.at(i, j).value.magnitude())).hi()
    };
    (0..columns).map(column).fold(0.0, |most, sum| if sum.is_nan() { f64::NAN } else { most.max(sum) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::from_rows;

    /// ∫₀¹ e^{2aτ} dτ = (e^{2a} − 1)/(2a), short and doubled up.
    #[test]
    fn mean_cost_of_one_state() {
        for a in [-30.0, -1.0, -1e-3, 0.1, 5.0_f64] {
            let mean =
                mean_cost(&TaylorMatrix::constant(&from_rows(&[vec![a]])), &TaylorMatrix::constant(&identity(1)));
            let (exact, found) = ((2.0 * a).exp_m1() / (2.0 * a), mean.at(0, 0).value);
            assert!((found.middle() / exact - 1.0).abs() < 1e-12, "{a}: {found:?} {exact}");
            assert!(found.hi() - found.lo() < 1e-10 * exact && found.hi() >= exact * (1.0 - 1e-15), "{a}: {found:?}");
        }
        let unbounded =
            mean_cost(&TaylorMatrix::constant(&from_rows(&[vec![1e20]])), &TaylorMatrix::constant(&identity(1)));
        assert_eq!(unbounded.at(0, 0).value, Interval::ENTIRE);
    }

    /// Of the double integrator with input v held, W by hand: x₁ = a + bτ − vτ²/2, x₂ = b − vτ.
    #[test]
    fn mean_cost_of_the_double_integrator() {
        let t = 0.5;
        let flow = from_rows(&[vec![0.0, t, 0.0], vec![0.0, 0.0, -t], vec![0.0; 3]]);
        let stage = from_rows(&[vec![1.0, 0.0, 0.0], vec![0.0, 2.0, 0.0], vec![0.0, 0.0, 3.0]]);
        let mean = mean_cost(&TaylorMatrix::constant(&flow), &TaylorMatrix::constant(&stage));
        let exact = [
            [1.0, t / 2.0, -t * t / 6.0],
            [t / 2.0, t * t / 3.0 + 2.0, -t.powi(3) / 8.0 - t],
            [-t * t / 6.0, -t.powi(3) / 8.0 - t, t.powi(4) / 20.0 + 2.0 * t * t / 3.0 + 3.0],
        ];
        for (i, row) in exact.iter().enumerate() {
            for (j, exact) in row.iter().enumerate() {
                let found = mean.at(i, j).value;
                assert!((found.middle() - exact).abs() < 1e-14, "{i} {j}: {found:?} {exact}");
            }
        }
    }
}
