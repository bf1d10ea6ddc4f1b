//! The sampled loop I + TE at a fixed parameter, as a function of that parameter: see `sampled` for its equations.

use super::closed_loop::ClosedLoop;
use super::matrix::TaylorMatrix;
use crate::math::Mat;
use crate::math::balance::balance;
use crate::math::hold::discretize;
use crate::math::interval::Interval;
use crate::math::matrix::identity;
use crate::math::taylor::Taylor;
use crate::model::linearize;

/// Terms of the series after which the rest is bounded; it is if ‖AT‖ is at most half of this.
const TERMS: usize = 20;
/// log₂‖AT‖ beyond which nothing is computed.
const MOST_SQUARINGS: f64 = 40.0;

/// −(EᵀX + XE + TEᵀXE).
pub(super) fn decrease(x: &TaylorMatrix, e: &TaylorMatrix, sample_time_s: f64) -> TaylorMatrix {
    let xe = x.times(e);
    let second = e.transpose().times(&xe).scaled(sample_time_s);
    xe.plus(&xe.transpose()).plus(&second).negated()
}

/// Exponents of a diagonal similarity that balances the sampled loop, from numbers.
pub(super) fn scaling(closed_loop: &ClosedLoop, t: f64, sample_time_s: f64) -> Vec<i32> {
    let model = linearize(closed_loop.plant, closed_loop.parameter(t));
    let (a, b) = discretize(&model.a, &model.b, sample_time_s);
    let n = a.nrows();
    let sampled = a - b * closed_loop.gain(t);
    // with A itself, whose powers are to be small
    balance(&Mat::from_fn(n, n, |i, j| sampled[(i, j)].abs() / sample_time_s + model.a[(i, j)].abs()))
}

/// E = Φ(A − BK) as a function of `t`, in coordinates x = 2^e x̃.
pub(super) fn increment(
    closed_loop: &ClosedLoop,
    piece: usize,
    t: Taylor,
    sample_time_s: f64,
    exponents: &[i32],
) -> TaylorMatrix {
    let (a, b, gain) = closed_loop.model_and_gain(piece, t);
    let [a, b, gain] = balanced([&a, &b, &gain], exponents);
    hold(&a, sample_time_s).times(&a.minus(&b.times(&gain)))
}

/// D⁻¹AD, D⁻¹B and KD.
fn balanced([a, b, gain]: [&TaylorMatrix; 3], exponents: &[i32]) -> [TaylorMatrix; 3] {
    let power = |e: i32| 2.0_f64.powi(e);
    let scaled = |matrix: &TaylorMatrix, row: bool, column: bool| {
        let (rows, columns) = matrix.shape();
        TaylorMatrix::from_fn(rows, columns, |i, j| {
            let exponent = if column { exponents[j] } else { 0 } - if row { exponents[i] } else { 0 };
            if exponent == 0 { matrix.at(i, j) } else { matrix.at(i, j) * power(exponent) }
        })
    };
    [scaled(a, true, true), scaled(b, true, false), scaled(gain, false, true)]
}

/// Φ = Σ_{k≥0} (AT)ᵏ/(k + 1)!, by its series for h = 2⁻ˢT with ‖Ah‖ ≤ 1, and Φ₂ₕ = Φₕ + ½GₕΦₕ, G₂ₕ = 2Gₕ + Gₕ² for
/// Gₕ = e^{Ah} − I = AhΦₕ.
pub(super) fn hold(a: &TaylorMatrix, sample_time_s: f64) -> TaylorMatrix {
    let n = a.shape().0;
    let at = a.scaled(sample_time_s);
    let squarings = norm(&at, |entry| entry.value).hi().log2().ceil().max(0.0);
    if squarings.is_nan() || squarings > MOST_SQUARINGS {
        return TaylorMatrix::from_fn(n, n, |_, _| unknown(at.at(0, 0).bend.is_some()));
    }
    let short = if squarings == 0.0 { at } else { at.scaled(2.0_f64.powi(-(squarings as i32))) };
    let mut phi = series(&short);
    let mut growth = short.times(&phi);
    for _ in 0..squarings as usize {
        phi = phi.plus(&growth.times(&phi).scaled(0.5));
        growth = growth.scaled(2.0).plus(&growth.times(&growth));
    }
    phi
}

/// Σ_{k≥0} Xᵏ/(k + 1)!
fn series(x: &TaylorMatrix) -> TaylorMatrix {
    let n = x.shape().0;
    let mut power = TaylorMatrix::constant(&identity(n));
    let mut series = power.clone();
    for k in 1..=if crate::mutant::is("sampled-series-cut") { 1 } else { TERMS } {
        power = power.times(x);
        power = TaylorMatrix::from_fn(n, n, |i, j| power.at(i, j) / (k + 1) as f64);
        // of a nilpotent A the series ends
        if (0..n * n).all(|entry| power.at(entry / n, entry % n).is_zero()) {
            return series;
        }
        series = series.plus(&power);
    }
    let rest = rest(x, TERMS);
    TaylorMatrix::from_fn(n, n, |i, j| series.at(i, j) + rest)
}

/// A bound on the row sums of one part of the entries.
fn norm(matrix: &TaylorMatrix, of: impl Fn(Taylor) -> Interval) -> Interval {
    let (rows, columns) = matrix.shape();
    let row = |i: usize| (0..columns).fold(Interval::point(0.0), |sum, j| sum + of(matrix.at(i, j)).magnitude());
    Interval::point((0..rows).map(|i| row(i).hi()).fold(0.0, f64::max))
}

/// Of which nothing is known.
fn unknown(has_bend: bool) -> Taylor {
    Taylor { value: Interval::ENTIRE, slope: Interval::ENTIRE, bend: has_bend.then_some(Interval::ENTIRE) }
}

/// A bound on every entry of Σ_{k>N} Xᵏ/(k + 1)! after N = `terms` terms, and on its first two derivatives. With μ, μ′, μ″ the row-sum
/// norms of X and of its derivatives, and sums that fall at least by halves for μ ≤ N/2, they are at most
/// 2μᴺ⁺¹/(N + 2)!, 2μ′μᴺ/(N + 1)! and 2μ′²μᴺ⁻¹/N! + 2μ″μᴺ/(N + 1)!.
pub(super) fn rest(x: &TaylorMatrix, terms: usize) -> Taylor {
    let has_bend = x.at(0, 0).bend.is_some();
    let value = norm(x, |entry| entry.value);
    let slope = norm(x, |entry| entry.slope);
    let bend = norm(x, |entry| entry.bend.unwrap_or(Interval::point(0.0)));
    if !(value.hi() <= 0.5 * terms as f64 && slope.hi().is_finite() && bend.hi().is_finite()) {
        return unknown(has_bend);
    }
    // 2 μᵏ/(k + ...)!
    let ratio = |power: usize, factorial: usize| {
        let powers = (0..power).fold(Interval::point(2.0), |product, _| product * value);
        (1..=factorial).fold(powers, |product, k| product / k as f64)
    };
    let around = |bound: Interval| Interval::new(-bound.hi(), bound.hi());
    Taylor {
        value: around(ratio(terms + 1, terms + 2)),
        slope: around(slope * ratio(terms, terms + 1)),
        bend: has_bend.then(|| around(slope.square() * ratio(terms - 1, terms) + bend * ratio(terms, terms + 1))),
    }
}
