//! Is a pair (A, B) of doubles stabilisable, a pair (A, C) detectable? Decided exactly.
//!
//! What no input moves are the w with wᵀAᵏB = 0 for all k, the orthogonal complement of the controllable subspace. With a basis of them
//! as the rows of W, WB = 0 and WA = A_u W: the uncontrolled part ż = A_u z, z = Wx, goes on by itself, and (A, B) is stabilisable
//! if and only if A_u has all eigenvalues in Re λ < 0 (R. E. Kalman 1963; W. M. Wonham 1967). A double is an integer times a power of
//! two, so that all of this can be calculated without rounding:
//!
//! 1. full rank of [B, AB, …] modulo one prime proves controllability, which is the common case and takes microseconds;
//! 2. else W is found modulo primes and turned into fractions (`residue.rs`); that WB = 0 and WA = A_u W is then checked on integers,
//!    and that there are no more rows is what the rank modulo a prime proves;
//! 3. the eigenvalues of A_u are counted by Hermite's criterion (`hurwitz.rs`).
//!
//! Floating point takes part only in the words about a mode that was found: its eigenvalue and the shares of the states.
//! The answer is about the doubles as they are. A coupling of 10⁻³⁰⁰ controls; that a gain for it would be of no use is another matter.

use super::Mat;
use super::balance::balance;
use super::decimal::about;
use super::definite::parts;
use super::eigen::{eigenvalues, smallest_singular_vector};
use super::hurwitz::{Integers, characteristic_polynomial, is_hurwitz, product, reachability};
use super::residue::{Residues, Subspace, primes, residue};
use num_bigint::{BigInt, Sign};

/// Whether some input u = −Kx makes A − BK stable; by duality, whether some output injection does so.
#[derive(Clone, Debug, PartialEq)]
pub enum Stabilizability {
    /// Proved: there is one.
    Stabilizable,
    /// Proved: there is none, because of this mode.
    Unstabilizable(Mode),
    /// Too large to be decided exactly.
    Undecided,
}

/// A mode w*x that no input moves and that does not decay, w*A = λw*, w*B = 0, Re λ ≥ 0; of an undetectable pair a motion v e^{λt} that no
/// output shows, Av = λv, Cv = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// Re λ and Im λ. That Re λ ≥ 0 is proved, the numbers are rounded.
    pub eigenvalue: [f64; 2],
    /// Re w, or Re v, rounded, its largest entry ±1. States that take no part have zeros.
    pub direction: Vec<f64>,
    /// Im w, or Im v; empty where λ is real.
    pub direction_imaginary: Vec<f64>,
    /// Proved: Re λ = 0.
    pub is_on_axis: bool,
}

impl Mode {
    /// w*x in the names of the states, `x3` where there is none: `yaw`, or `1 x1 - 0.5 x2`. Shares are rounded.
    pub fn combination(&self, names: &[String]) -> String {
        let mut words = String::new();
        let name = |i: usize| names.get(i).cloned().unwrap_or_else(|| format!("x{}", i + 1));
        let imaginary = |i: usize| self.direction_imaginary.get(i).copied().unwrap_or(0.0);
        let moving = self.states();
        for &i in &moving {
            let (re, im) = (self.direction[i], imaginary(i));
            let (sign, share) = match () {
                () if moving.len() == 1 => (" + ", String::new()),
                () if im == 0.0 => (if re < 0.0 { " - " } else { " + " }, format!("{} ", about(re.abs()))),
                () if re == 0.0 => (if im < 0.0 { " - " } else { " + " }, format!("{}i ", about(im.abs()))),
                () => (" + ", format!("({} {} {}i) ", about(re), if im < 0.0 { "-" } else { "+" }, about(im.abs()))),
            };
            words += match (words.is_empty(), sign) {
                (false, sign) => sign,
                (true, " - ") => "-",
                (true, _) => "",
            };
            words += &format!("{share}{}", name(i));
        }
        words
    }

    /// λ, rounded: `0`, `2.5`, `0 ± 3i`.
    pub fn eigenvalue_words(&self) -> String {
        match self.eigenvalue {
            [re, 0.0] => about(re),
            [re, im] => format!("{} ± {}i", about(re), about(im.abs())),
        }
    }

    /// The states that take part.
    pub fn states(&self) -> Vec<usize> {
        let takes_part =
            |&i: &usize| self.direction[i] != 0.0 || self.direction_imaginary.get(i).is_some_and(|&share| share != 0.0);
        (0..self.direction.len()).filter(takes_part).collect()
    }
}

impl std::fmt::Display for Mode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (λ = {})", self.combination(&[]), self.eigenvalue_words())
    }
}

/// Entries below this times the largest, in balanced coordinates, are rounding.
const ROUNDING: f64 = 1e-9;
/// Primes after which fractions are given up: 61 bits each.
const MOST_PRIMES: usize = 128;
/// Bits of an entry times n².
const MOST_BITS: i64 = 20_000_000;

/// Whether (A, B), n × n and n × m, is stabilisable.
///
/// # Panics
/// If A is not square or B has another number of rows.
pub fn stabilizability(a: &Mat<f64>, b: &Mat<f64>) -> Stabilizability {
    decide(a, b)
}

/// Whether (A, C), n × n and k × n, is detectable: every motion that C does not show decays.
///
/// # Panics
/// If A is not square or C has another number of columns.
pub fn detectability(a: &Mat<f64>, c: &Mat<f64>) -> Stabilizability {
    let mut found = stabilizability(&a.transpose().to_owned(), &c.transpose().to_owned());
    if let Stabilizability::Unstabilizable(mode) = &mut found {
        // w*Aᵀ = λw* is Av = λv for the conjugate v
        mode.direction_imaginary.iter_mut().for_each(|x| *x = -*x);
    }
    found
}

fn decide(a: &Mat<f64>, b: &Mat<f64>) -> Stabilizability {
    let n = a.nrows();
    assert_eq!((a.ncols(), b.nrows()), (n, n), "A is n × n and B n × m");
    let exponents = balance(a);
    let exponent = |i: usize| i64::from(exponents[i]);
    let Some((a_integers, scale)) = integers(a, |i, j| exponent(j) - exponent(i)) else {
        return Stabilizability::Undecided;
    };
    // columns of B may be scaled one by one
    let mut b_integers = vec![Vec::with_capacity(b.ncols()); n];
    for j in 0..b.ncols() {
        let column = Mat::from_fn(n, 1, |i, _| b[(i, j)]);
        let Some((column, _)) = integers(&column, |i, _| -exponent(i)) else { return Stabilizability::Undecided };
        b_integers.iter_mut().zip(column).for_each(|(row, entry)| row.extend(entry));
    }
    let Some(uncontrolled) = Uncontrolled::of(&a_integers, &b_integers) else { return Stabilizability::Undecided };
    match uncontrolled.first_mode() {
        Found::None => Stabilizability::Stabilizable,
        Found::Unknown => Stabilizability::Undecided,
        Found::States { all, block } => {
            Stabilizability::Unstabilizable(uncontrolled.mode(&all, &block, scale, |i| exponents[i]))
        }
    }
}

/// The matrix 2^s (m_ij 2^shift(i, j)) of integers, and s; `None` where an entry is not finite, or the integers would be too long.
pub(super) fn integers(m: &Mat<f64>, shift: impl Fn(usize, usize) -> i64) -> Option<(Integers, i64)> {
    let (rows, columns) = (m.nrows(), m.ncols());
    let entry = |i: usize, j: usize| {
        let (mantissa, exponent) = parts(m[(i, j)]);
        (mantissa, exponent + shift(i, j))
    };
    let all = || (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    if all().any(|(i, j)| !m[(i, j)].is_finite()) {
        return None;
    }
    let exponents = || {
        all()
            .map(|(i, j)| entry(i, j))
            .filter(|(mantissa, _)| *mantissa != 0)
            .map(|(mantissa, exponent)| (exponent + i64::from(mantissa.trailing_zeros()), exponent))
    };
    let least = exponents().map(|(least, _)| least).min().unwrap_or(0);
    let most = exponents().map(|(_, most)| most).max().unwrap_or(0);
    if (most - least + 53) * (rows * rows) as i64 > MOST_BITS {
        return None;
    }
    let integer = |(mantissa, exponent): (i64, i64)| match exponent - least {
        _ if mantissa == 0 => BigInt::from(0),
        e if e >= 0 => BigInt::from(mantissa) << e,
        e => BigInt::from(mantissa >> -e),
    };
    let rows = (0..rows).map(|i| (0..columns).map(|j| integer(entry(i, j))).collect()).collect();
    Some((rows, -least))
}

/// The uncontrolled part ż = A_u z, z = Wx.
struct Uncontrolled {
    /// qW
    w: Integers,
    /// q A_u, of the integers that A was scaled to.
    a: Integers,
    /// q > 0
    q: BigInt,
}

/// What is uncontrolled and does not decay.
enum Found {
    None,
    Unknown,
    /// Rows of W, closed under A_u, with exactly one irreducible block that has eigenvalues in Re λ ≥ 0.
    States {
        all: Vec<usize>,
        block: Vec<usize>,
    },
}

impl Uncontrolled {
    fn of(a: &Integers, b: &Integers) -> Option<Self> {
        let n = a.len();
        let columns = b.first().map_or(0, Vec::len);
        let mut joined: Option<(Vec<usize>, Residues)> = None;
        let mut attempt_at = 1;
        for (count, p) in primes().take(MOST_PRIMES).enumerate() {
            let a_residues: Vec<Vec<u64>> =
                a.iter().map(|row| row.iter().map(|entry| residue(entry, p)).collect()).collect();
            let b_columns = (0..columns).map(|j| b.iter().map(|row| residue(&row[j], p)).collect()).collect();
            let subspace = Subspace::invariant(&a_residues, b_columns, p);
            if subspace.dimension() == n {
                return Some(Self { w: Vec::new(), a: Vec::new(), q: BigInt::from(1) });
            }
            let (pivots, rows) = subspace.reduced();
            let free: Vec<usize> = (0..n).filter(|i| !pivots.contains(i)).collect();
            let entries: Vec<u64> = free.iter().flat_map(|&f| rows.iter().map(move |row| row[f])).collect();
            match &mut joined {
                Some((known, residues)) if *known == pivots => residues.join(&entries, p),
                // a prime that divides what it should not makes the rank smaller or the pivots later
                Some((known, _)) if (pivots.len(), &*known) < (known.len(), &pivots) => continue,
                _ => joined = Some((pivots, Residues::new(&entries, p))),
            }
            if count + 1 < attempt_at {
                continue;
            }
            attempt_at = 2 * (count + 1);
            let Some((pivots, residues)) = &joined else { continue };
            let Some((numerators, q)) = residues.fractions() else { continue };
            let free: Vec<usize> = (0..n).filter(|i| !pivots.contains(i)).collect();
            // wᵀs = 0 for the reduced basis s: w = e_f − Σ s_f e_pivot
            let mut w = vec![vec![BigInt::from(0); n]; free.len()];
            for (k, &f) in free.iter().enumerate() {
                w[k][f] = q.clone();
                for (l, &pivot) in pivots.iter().enumerate() {
                    w[k][pivot] = -&numerators[k * pivots.len() + l];
                }
            }
            let image = product(&w, a);
            let of_free: Integers = image.iter().map(|row| free.iter().map(|&f| row[f].clone()).collect()).collect();
            let is_unmoved = product(&w, b).iter().flatten().all(|entry| entry.sign() == Sign::NoSign);
            let closed = product(&of_free, &w);
            let is_closed = image.iter().zip(&closed).all(|(x, y)| x.iter().zip(y).all(|(x, y)| x * &q == *y));
            if is_unmoved && is_closed {
                return Some(Self { w, a: of_free, q });
            }
        }
        None
    }

    fn first_mode(&self) -> Found {
        let d = self.a.len();
        let reaches = reachability(&self.a);
        let mut found = Found::None;
        let mut fewest = usize::MAX;
        for (i, from_here) in reaches.iter().enumerate() {
            let block: Vec<usize> = (0..d).filter(|&j| from_here[j] && reaches[j][i]).collect();
            if block[0] != i {
                continue;
            }
            let entries = block.iter().map(|&i| block.iter().map(|&j| self.a[i][j].clone()).collect()).collect();
            match is_hurwitz(&entries) {
                Some(true) => {}
                None => {
                    if matches!(found, Found::None) {
                        found = Found::Unknown;
                    }
                }
                Some(false) => {
                    // yᵀA_u = λyᵀ for a y on those that the block leads to; with the fewest of them no other such block is among them
                    let all: Vec<usize> = (0..d).filter(|&j| from_here[j]).collect();
                    if all.len() < fewest {
                        fewest = all.len();
                        found = Found::States { all, block };
                    }
                }
            }
        }
        found
    }

    /// Whether a block is seen to have an eigenvalue on the imaginary axis: λ = 0, or the pair of a matrix of two rows without trace.
    fn has_zero_on_axis(&self, block: &[usize]) -> bool {
        let entries = block.iter().map(|&i| block.iter().map(|&j| self.a[i][j].clone()).collect()).collect();
        match characteristic_polynomial(&entries).as_slice() {
            [constant, ..] if constant.sign() == Sign::NoSign => true,
            [constant, linear, _] => linear.sign() == Sign::NoSign && constant.sign() == Sign::Plus,
            _ => false,
        }
    }

    /// The companion matrix of a block's characteristic polynomial.
    fn companion(&self, block: &[usize], scale: i64) -> Mat<f64> {
        let entries = block.iter().map(|&i| block.iter().map(|&j| self.a[i][j].clone()).collect()).collect();
        let coefficients = characteristic_polynomial(&entries);
        let d = block.len();
        let mut divisor = BigInt::from(1);
        let mut last_row: Vec<f64> = (1..=d)
            .map(|k| {
                divisor *= &self.q;
                -quotient(&coefficients[d - k], &divisor, -scale * k as i64)
            })
            .collect();
        last_row.reverse();
        Mat::from_fn(d, d, |i, j| if i + 1 == d { last_row[j] } else { f64::from(u8::from(j == i + 1)) })
    }

    /// The mode of a block, in floating point. A was scaled by 2^scale, state i by 2^exponent(i).
    fn mode(&self, all: &[usize], block: &[usize], scale: i64, exponent: impl Fn(usize) -> i32) -> Mode {
        let entry = |i: usize, j: usize| quotient(&self.a[i][j], &self.q, -scale);
        let of_block = Mat::from_fn(block.len(), block.len(), |i, j| entry(block[i], block[j]));
        // of a small block the coefficients of its polynomial say more than its rounded entries
        let alike = if block.len() <= 4 { self.companion(block, scale) } else { of_block };
        let (re, im) =
            eigenvalues(&alike).into_iter().max_by(|x, y| x.0.total_cmp(&y.0)).unwrap_or((f64::NAN, f64::NAN));
        // proved not to be negative
        let (re, im) = (if re < 0.0 { 0.0 } else { re }, im.abs());
        let (d, n) = (all.len(), self.w.first().map_or(0, Vec::len));
        let of_all = Mat::from_fn(d, d, |i, j| entry(all[i], all[j]));
        let y = smallest_singular_vector(&pencil(&of_all, &Mat::zeros(d, 0), [re, im])).unwrap_or_default();
        let combined = |y: &[f64]| -> Vec<f64> {
            let of_state = |i: usize| y.iter().zip(all).map(|(y, &k)| y * quotient(&self.w[k][i], &self.q, 0)).sum();
            (0..n).map(of_state).collect()
        };
        let (real, imaginary) = y.split_at(d.min(y.len()));
        let mut parts = [combined(real), if im == 0.0 { Vec::new() } else { combined(imaginary) }];
        let largest = |parts: &[Vec<f64>; 2]| parts.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let rounding = ROUNDING * largest(&parts);
        for part in &mut parts {
            for (i, x) in part.iter_mut().enumerate() {
                *x = if x.abs() > rounding { *x * 2.0_f64.powi(-exponent(i)) } else { 0.0 };
            }
        }
        let is_negative = parts[0].iter().fold(0.0_f64, |most, &x| if x.abs() > most.abs() { x } else { most }) < 0.0;
        let size = if is_negative { -largest(&parts) } else { largest(&parts) };
        parts.iter_mut().flatten().for_each(|x| *x /= size);
        let [direction, direction_imaginary] = parts;
        Mode { eigenvalue: [re, im], direction, direction_imaginary, is_on_axis: self.has_zero_on_axis(block) }
    }
}

/// x/q · 2^e in floating point, to within a few units of the last place.
pub(super) fn quotient(x: &BigInt, q: &BigInt, e: i64) -> f64 {
    let leading = |x: &BigInt| {
        let shift = x.bits() as i64 - 62;
        let digits = if shift >= 0 { x >> shift } else { x << -shift };
        (i64::try_from(digits).unwrap_or(0) as f64, shift)
    };
    let ((x, x_shift), (q, q_shift)) = (leading(x), leading(q));
    let exponent = (x_shift - q_shift + e).clamp(-2000, 2000) as i32;
    // in two steps: 2^exponent alone may be out of range
    x / q * 2.0_f64.powi(exponent / 2) * 2.0_f64.powi(exponent - exponent / 2)
}

/// [A − λI, B]; for complex λ = μ + iν the real [A − μI, νI, B, 0; −νI, A − μI, 0, B], which (Re w, Im w) is multiplied with from the left.
pub fn pencil(a: &Mat<f64>, b: &Mat<f64>, [re, im]: [f64; 2]) -> Mat<f64> {
    let (n, m) = (a.nrows(), b.ncols());
    let shifted = |i: usize, j: usize| a[(i, j)] - if i == j { re } else { 0.0 };
    if im == 0.0 {
        return Mat::from_fn(n, n + m, |i, j| if j < n { shifted(i, j) } else { b[(i, j - n)] });
    }
    Mat::from_fn(2 * n, 2 * (n + m), |i, j| {
        let (lower, i) = (i >= n, i % n);
        match j {
            _ if j < 2 * n && (j >= n) == lower => shifted(i, j % n),
            _ if j < 2 * n && i == j % n => {
                if lower {
                    -im
                } else {
                    im
                }
            }
            _ if j >= 2 * n && (j - 2 * n >= m) == lower => b[(i, (j - 2 * n) % m)],
            _ => 0.0,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::{diagonal, from_rows, identity};
    use Stabilizability::Stabilizable;
    use proptest::prelude::*;

    fn of(a: &[&[f64]], b: &[&[f64]]) -> Stabilizability {
        let matrix = |rows: &[&[f64]]| from_rows(&rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>());
        stabilizability(&matrix(a), &matrix(b))
    }

    fn mode(found: Stabilizability) -> Mode {
        match found {
            Stabilizability::Unstabilizable(mode) => mode,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn one_state() {
        assert_eq!(of(&[&[1e300]], &[&[f64::from_bits(1)]]), Stabilizable);
        assert_eq!(of(&[&[-1e-300]], &[&[0.0]]), Stabilizable);
        let zero = mode(of(&[&[0.0]], &[&[0.0]]));
        assert_eq!((zero.eigenvalue, zero.direction), ([0.0, 0.0], vec![1.0]));
        assert_eq!(mode(of(&[&[2.5]], &[&[-0.0]])).eigenvalue, [2.5, 0.0]);
        assert_eq!(stabilizability(&Mat::zeros(0, 0), &Mat::zeros(0, 3)), Stabilizable);
        assert_eq!(of(&[&[f64::NAN]], &[&[1.0]]), Stabilizability::Undecided);
        assert_eq!(stabilizability(&identity(1), &Mat::zeros(1, 0)), of(&[&[1.0]], &[&[0.0]]), "no inputs");
    }

    #[test]
    fn any_coupling_controls() {
        for coupling in [1e-300, f64::from_bits(1), 1e300] {
            let chain = [[0.0, 1.0].as_slice(), &[0.0, 0.0]];
            assert_eq!(of(&chain, &[&[0.0], &[coupling]]), Stabilizable);
            assert_eq!(of(&[&[1.0, coupling], &[0.0, 2.0]], &[&[0.0], &[1.0]]), Stabilizable);
            let mode = mode(of(&[&[1.0, 0.0], &[coupling, 2.0]], &[&[0.0], &[1.0]]));
            assert_eq!((mode.eigenvalue, mode.direction), ([1.0, 0.0], vec![1.0, 0.0]), "{coupling}");
        }
        // twice the same mode and one input, and then not quite the same
        assert_eq!(mode(of(&[&[1.0, 0.0], &[0.0, 1.0]], &[&[1.0], &[1.0]])).direction, [1.0, -1.0]);
        assert_eq!(of(&[&[1.0, 0.0], &[0.0, 1.0_f64.next_up()]], &[&[1.0], &[1.0]]), Stabilizable);
    }

    /// COMPleib's PAS: stiff and slow states, and an integrator behind another.
    #[test]
    fn badly_scaled_pair() {
        let a: [&[f64]; 5] = [
            &[0.0, 1.0, 0.0, 0.0, 0.0],
            &[-274921.63, -73.2915, -274921.63, 0.0, 0.0],
            &[0.0, 0.0, -0.9597, 0.0, 0.0],
            &[1.0, 0.0, 0.0, 0.0, 0.0],
            &[0.0, 0.0, 0.0, 1.0, 0.0],
        ];
        assert_eq!(of(&a, &[&[0.0], &[0.12841], &[-3.39561e-07], &[0.0], &[0.0]]), Stabilizable);
        assert_eq!(of(&a, &[&[0.0], &[0.0], &[0.0], &[1.0], &[0.0]]), Stabilizable, "the rest decays");
        let found = mode(of(&a, &[&[0.0], &[0.0], &[0.0], &[0.0], &[1.0]]));
        assert_eq!((found.eigenvalue, found.direction[4]), ([0.0, 0.0], 0.0));
        assert!((found.direction[3] / found.direction[2] + 0.9597).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn uncontrolled_modes_on_either_side_and_on_the_axis() {
        let turning = |decay: f64| from_rows(&[vec![decay, 3.0, 1.0], vec![-3.0, decay, 0.0], vec![0.0, 0.0, 5.0]]);
        let b = from_rows(&[vec![0.0], vec![0.0], vec![1.0]]);
        assert_eq!(stabilizability(&turning(-1e-12).transpose().to_owned(), &b), Stabilizable);
        for growth in [0.0, f64::from_bits(1), 1e-12, 2.0] {
            let found = mode(stabilizability(&turning(growth).transpose().to_owned(), &b));
            assert!(
                (found.eigenvalue[0] - growth).abs() < 1e-12 && (found.eigenvalue[1] - 3.0).abs() < 1e-12,
                "{found:?}"
            );
            assert_eq!((found.direction.len(), found.direction_imaginary.len()), (3, 3));
            assert_eq!(found.is_on_axis, growth == 0.0);
            // the third state feels the two, and moves none of them
            assert_eq!((found.direction[2], found.direction_imaginary[2]), (0.0, 0.0));
        }
        assert_eq!(stabilizability(&turning(-1.0), &b), Stabilizable, "controlled through the first");
    }

    #[test]
    fn a_motion_without_output_is_named() {
        let a = from_rows(&[vec![0.0, 1.0, 0.0], vec![0.0, 0.0, 0.0], vec![0.0, 0.0, -1.0]]);
        let of = |q: &[f64]| detectability(&a, &diagonal(q));
        assert_eq!(of(&[1.0, 0.0, 0.0]), Stabilizable);
        assert_eq!(mode(of(&[0.0, 1.0, 0.0])).direction, [1.0, 0.0, 0.0]);
        assert_eq!(mode(of(&[0.0, 0.0, 1.0])).direction, [1.0, 0.0, 0.0]);
    }

    /// x = Tz with T and T⁻¹ of integers, T = LU with ones on both diagonals.
    fn transformed(a: &Mat<f64>, b: &Mat<f64>, entries: &[i8]) -> (Mat<f64>, Mat<f64>) {
        let n = a.nrows();
        let (mut a, mut b) = (a.clone(), b.clone());
        let mut entry = entries.iter().cycle().map(|&e| f64::from(e));
        // x_i ← x_i + e x_j
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).filter(|(i, j)| i != j) {
            let e = entry.next().unwrap();
            (0..n).for_each(|k| a[(i, k)] += e * a[(j, k)]);
            (0..b.ncols()).for_each(|k| b[(i, k)] += e * b[(j, k)]);
            (0..n).for_each(|k| a[(k, j)] -= e * a[(k, i)]);
        }
        (a, b)
    }

    fn is_exact(m: &Mat<f64>) -> bool {
        m.norm_max() < 2.0_f64.powi(50)
    }

    proptest! {
        /// In coordinates in which nothing shows: the truth is that of the blocks.
        #[test]
        fn coordinates_do_not_matter(
            controlled in proptest::collection::vec(-3i8..4, 9),
            uncontrolled in proptest::collection::vec(-3i8..2, 3),
            turning in proptest::option::of((-2i8..2, 1i8..4)),
            coupling in proptest::collection::vec(-2i8..3, 15),
            entries in proptest::collection::vec(-1i8..2, 30),
        ) {
            let extra = uncontrolled.len() + if turning.is_some() { 2 } else { 0 };
            let n = 3 + extra;
            let mut a = Mat::zeros(n, n);
            // a companion matrix is controlled by its last state
            for i in 0..3 {
                a[(2, i)] = f64::from(controlled[i]);
                if i < 2 { a[(i, i + 1)] = 1.0; }
                (0..extra).for_each(|j| a[(i, 3 + j)] = f64::from(coupling[3 * j + i]));
            }
            for (k, &eigenvalue) in uncontrolled.iter().enumerate() {
                a[(3 + k, 3 + k)] = f64::from(eigenvalue);
            }
            if let Some((re, im)) = turning {
                let k = n - 2;
                (a[(k, k)], a[(k + 1, k + 1)], a[(k, k + 1)], a[(k + 1, k)]) = (f64::from(re), f64::from(re), f64::from(im), -f64::from(im));
            }
            let b = Mat::from_fn(n, 1, |i, _| if i == 2 { 1.0 } else { 0.0 });
            let decays = uncontrolled.iter().all(|&e| e < 0) && turning.is_none_or(|(re, _)| re < 0);
            let (a, b) = transformed(&a, &b, &entries);
            prop_assume!(is_exact(&a) && is_exact(&b));
            let found = stabilizability(&a, &b);
            prop_assert_eq!(found == Stabilizable, decays, "{:?}", found);
            if let Stabilizability::Unstabilizable(mode) = found {
                // (u − iv)A = λ(u − iv) to rounding
                let part = |i: usize| (mode.direction[i], mode.direction_imaginary.get(i).copied().unwrap_or(0.0));
                let [re, im] = mode.eigenvalue;
                for j in 0..n {
                    let (x, y) = (0..n).fold((0.0, 0.0), |sum, i| (sum.0 + part(i).0 * a[(i, j)], sum.1 + part(i).1 * a[(i, j)]));
                    let (u, v) = part(j);
                    let scale = 1e-7 * (1.0 + a.norm_max()) * n as f64;
                    prop_assert!((x - re * u - im * v).abs() + (y - re * v + im * u).abs() < scale, "{mode:?}");
                }
            } else {
                prop_assert_eq!(found, Stabilizable);
            }
        }
    }

    #[test]
    fn words() {
        let names = ["roll".to_owned(), "yaw".to_owned()];
        let mode = |direction: &[f64], imaginary: &[f64], eigenvalue| Mode {
            eigenvalue,
            direction: direction.to_vec(),
            direction_imaginary: imaginary.to_vec(),
            is_on_axis: false,
        };
        assert_eq!(mode(&[0.0, 1.0], &[], [0.0, 0.0]).combination(&names), "yaw");
        assert_eq!(mode(&[-0.5, 1.0, 0.25], &[], [0.0, 0.0]).combination(&names), "-0.5 roll + 1 yaw + 0.25 x3");
        let turning = mode(&[1.0, 0.0, 0.5], &[0.0, -1.0, 2.0], [0.0, 3.0]);
        assert_eq!(turning.to_string(), "1 x1 - 1i x2 + (0.5 + 2i) x3 (λ = 0 ± 3i)");
    }

    #[test]
    fn forty_states() {
        let mut state = 1u64;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
        };
        let mut a = Mat::from_fn(40, 40, |_, _| draw());
        let b = Mat::from_fn(40, 2, |_, _| draw());
        assert_eq!(stabilizability(&a, &b), Stabilizable);
        // twenty states that nothing leads to
        let own = |i: usize| (20..40).contains(&i);
        for (i, j) in (20..40).flat_map(|i| (0..20).map(move |j| (i, j))) {
            a[(i, j)] = 0.0;
        }
        let b = Mat::from_fn(40, 2, |i, j| if own(i) { 0.0 } else { b[(i, j)] });
        let found = mode(stabilizability(&a, &b));
        assert!(
            (0..40).all(|i| own(i)
                || (found.direction[i], found.direction_imaginary.get(i).copied().unwrap_or(0.0)) == (0.0, 0.0))
        );
        (20..40).for_each(|i| a[(i, i)] -= 40.0);
        assert_eq!(stabilizability(&a, &b), Stabilizable, "they decay");
    }

    /// Uncontrolled, dense and in coordinates that need more than one prime.
    #[test]
    fn long_fractions() {
        let entry = |i: usize, j: usize| ((i * 7919 + j * 104_729 + i * j * 31) % 65_521) as f64 - 32_760.0;
        let mut a = Mat::from_fn(6, 6, |i, j| if i >= 4 && j < 4 { 0.0 } else { entry(i, j) });
        (a[(4, 5)], a[(5, 4)], a[(4, 4)], a[(5, 5)]) = (0.0, 0.0, -1.0, 2.0);
        let b = Mat::from_fn(6, 1, |i, _| if i >= 4 { 0.0 } else { entry(i, 11) });
        // x_5 and x_6 gain shares of the others
        for i in 4..6 {
            for j in 0..4 {
                let e = ((i + 3 * j) * 911) as f64;
                (0..6).for_each(|k| a[(i, k)] += e * a[(j, k)]);
                (0..6).for_each(|k| a[(k, j)] -= e * a[(k, i)]);
            }
        }
        let b = Mat::from_fn(6, 1, |i, _| {
            b[(i, 0)] + if i >= 4 { (0..4).map(|j| ((i + 3 * j) * 911) as f64 * b[(j, 0)]).sum() } else { 0.0 }
        });
        assert!(is_exact(&a));
        let found = mode(stabilizability(&a, &b));
        assert!((found.eigenvalue[0] - 2.0).abs() < 1e-6, "{found:?}");
    }
}
