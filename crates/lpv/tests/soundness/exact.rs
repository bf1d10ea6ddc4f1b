//! Exact arithmetic on doubles: numbers m·2ᵉ with integers of any size, and matrices of them. Nothing here is shared
//! with the prover.

use lpv::math::Mat;
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// m·2ᵉ
#[derive(Clone, Debug)]
pub struct Dyadic {
    m: BigInt,
    e: i64,
}

impl Dyadic {
    pub fn zero() -> Self {
        Self { m: BigInt::from(0), e: 0 }
    }

    /// −1, 0 or 1.
    pub fn sign(&self) -> i32 {
        match self.m.sign() {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }

    pub fn abs(&self) -> Self {
        if self.sign() < 0 { -self } else { self.clone() }
    }

    pub fn square(&self) -> Self {
        self * self
    }

    pub fn exceeds(&self, other: &Self) -> bool {
        (self - other).sign() > 0
    }

    /// Both over the smaller power of two.
    fn aligned(&self, other: &Self) -> (BigInt, BigInt, i64) {
        if self.sign() == 0 || other.sign() == 0 {
            // the exponent of zero means nothing
            let e = if self.sign() == 0 { other.e } else { self.e };
            return (self.m.clone(), other.m.clone(), e);
        }
        let e = self.e.min(other.e);
        (&self.m << (self.e - e), &other.m << (other.e - e), e)
    }
}

impl From<f64> for Dyadic {
    /// # Panics
    /// If `x` is not finite.
    fn from(x: f64) -> Self {
        assert!(x.is_finite(), "{x} is no number");
        let bits = x.to_bits();
        let (exponent, fraction) = ((bits >> 52 & 0x7ff) as i64, (bits & 0x000f_ffff_ffff_ffff) as i64);
        let m = if exponent == 0 { fraction } else { fraction | 1 << 52 };
        Self { m: BigInt::from(if x.is_sign_negative() { -m } else { m }), e: exponent.max(1) - 1075 }
    }
}

impl Add for &Dyadic {
    type Output = Dyadic;
    fn add(self, other: &Dyadic) -> Dyadic {
        let (a, b, e) = self.aligned(other);
        Dyadic { m: a + b, e }
    }
}

impl Sub for &Dyadic {
    type Output = Dyadic;
    fn sub(self, other: &Dyadic) -> Dyadic {
        let (a, b, e) = self.aligned(other);
        Dyadic { m: a - b, e }
    }
}

impl Mul for &Dyadic {
    type Output = Dyadic;
    fn mul(self, other: &Dyadic) -> Dyadic {
        Dyadic { m: &self.m * &other.m, e: self.e + other.e }
    }
}

impl Neg for &Dyadic {
    type Output = Dyadic;
    fn neg(self) -> Dyadic {
        Dyadic { m: -&self.m, e: self.e }
    }
}

impl PartialEq for Dyadic {
    fn eq(&self, other: &Self) -> bool {
        (self - other).sign() == 0
    }
}

impl PartialOrd for Dyadic {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some((self - other).sign().cmp(&0))
    }
}

/// A matrix of exact numbers, in row order.
#[derive(Clone, Debug)]
pub struct Exact {
    pub rows: usize,
    pub columns: usize,
    entries: Vec<Dyadic>,
}

impl Exact {
    pub fn from_fn(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> Dyadic) -> Self {
        Self { rows, columns, entries: (0..rows * columns).map(|at| entry(at / columns, at % columns)).collect() }
    }

    pub fn of(matrix: &Mat<f64>) -> Self {
        Self::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)].into())
    }

    pub fn column(x: &[f64]) -> Self {
        Self::from_fn(x.len(), 1, |i, _| x[i].into())
    }

    pub fn identity(size: usize) -> Self {
        Self::from_fn(size, size, |i, j| f64::from(u8::from(i == j)).into())
    }

    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self::from_fn(rows, columns, |_, _| Dyadic::zero())
    }

    pub fn at(&self, i: usize, j: usize) -> &Dyadic {
        &self.entries[i * self.columns + j]
    }

    pub fn t(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self.at(j, i).clone())
    }

    pub fn times(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, other.columns, |i, j| {
            (0..self.columns).fold(Dyadic::zero(), |sum, k| &sum + &(self.at(i, k) * other.at(k, j)))
        })
    }

    pub fn plus(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| self.at(i, j) + other.at(i, j))
    }

    pub fn minus(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| self.at(i, j) - other.at(i, j))
    }

    pub fn scaled(&self, factor: &Dyadic) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| self.at(i, j) * factor)
    }

    pub fn by(&self, factor: f64) -> Self {
        self.scaled(&factor.into())
    }

    /// MᵀDM
    pub fn quadratic(&self, weight: &Self) -> Self {
        self.t().times(&weight.times(self))
    }

    /// M + Mᵀ
    pub fn with_transpose(&self) -> Self {
        self.plus(&self.t())
    }

    /// The only entry.
    pub fn scalar(&self) -> Dyadic {
        assert_eq!((self.rows, self.columns), (1, 1));
        self.at(0, 0).clone()
    }

    /// xᵀMx for a column x.
    pub fn form(&self, x: &Self) -> Dyadic {
        x.quadratic(self).scalar()
    }

    pub fn is_symmetric(&self) -> bool {
        self.rows == self.columns && (0..self.rows).all(|i| (0..i).all(|j| self.at(i, j) == self.at(j, i)))
    }

    /// The rows `rows` and columns `rows`.
    fn principal(&self, rows: &[usize]) -> Self {
        Self::from_fn(rows.len(), rows.len(), |i, j| self.at(rows[i], rows[j]).clone())
    }

    /// Over one power of two: integers, and the exponent.
    fn integers(&self) -> (Vec<Vec<BigInt>>, i64) {
        let e = self.entries.iter().filter(|x| x.sign() != 0).map(|x| x.e).min().unwrap_or(0);
        let integer = |x: &Dyadic| if x.sign() == 0 { BigInt::from(0) } else { &x.m << (x.e - e) };
        ((0..self.rows).map(|i| (0..self.columns).map(|j| integer(self.at(i, j))).collect()).collect(), e)
    }

    /// Whether a symmetric matrix is positive definite: all leading minors are positive (Sylvester), which
    /// elimination without fractions and without pivots gives one after the other.
    pub fn is_positive(&self) -> bool {
        let (mut m, _) = self.integers();
        let (n, zero) = (self.rows, BigInt::from(0));
        let mut before = BigInt::from(1);
        for k in 0..n {
            if m[k][k] <= zero {
                return false;
            }
            for i in k + 1..n {
                for j in k + 1..n {
                    m[i][j] = (&m[k][k] * &m[i][j] - &m[i][k] * &m[k][j]) / &before;
                }
            }
            before = m[k][k].clone();
        }
        true
    }

    /// Whether a symmetric matrix is positive semidefinite: all principal minors are at least zero. For a few rows.
    pub fn is_semidefinite(&self) -> bool {
        (1..1_usize << self.rows).all(|bits| {
            let rows: Vec<usize> = (0..self.rows).filter(|i| bits >> i & 1 == 1).collect();
            self.principal(&rows).determinant().sign() >= 0
        })
    }

    /// det M
    pub fn determinant(&self) -> Dyadic {
        self.solve(&Self::zeros(self.rows, 1)).1
    }

    /// N and d with M N = d B, d = det M; zero where M is singular (then N means nothing).
    pub fn solve(&self, right: &Self) -> (Self, Dyadic) {
        let n = self.rows;
        let ((mut m, e), (b, f)) = (self.integers(), right.integers());
        m.iter_mut().zip(b).for_each(|(row, b)| row.extend(b));
        let width = n + right.columns;
        let (mut before, mut negative) = (BigInt::from(1), false);
        for k in 0..n {
            let Some(pivot) = (k..n).find(|&i| m[i][k].sign() != Sign::NoSign) else {
                return (right.clone(), Dyadic::zero());
            };
            negative ^= pivot != k;
            m.swap(k, pivot);
            for i in (0..n).filter(|&i| i != k) {
                for j in (0..width).filter(|&j| j != k) {
                    m[i][j] = (&m[k][k] * &m[i][j] - &m[i][k] * &m[k][j]) / &before;
                }
                m[i][k] = BigInt::from(0);
            }
            before = m[k][k].clone();
        }
        // of the integers: N = m, d = before; rows that changed places turn the sign of both
        let turned = |x: &BigInt| if negative { -x } else { x.clone() };
        let power = e * n as i64;
        let numerator = Self::from_fn(n, right.columns, |i, j| Dyadic { m: turned(&m[i][n + j]), e: f - e + power });
        (numerator, Dyadic { m: turned(&before), e: power })
    }
}

/// N and d with Aᵀ(N/d) + (N/d)A + W = 0; d is zero where there is no one solution.
pub fn lyapunov(a: &Exact, w: &Exact) -> (Exact, Dyadic) {
    let n = a.rows;
    let pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i..n).map(move |j| (i, j))).collect();
    let position = |i: usize, j: usize| pairs.iter().position(|&pair| pair == (i.min(j), i.max(j))).expect("a pair");
    let count = pairs.len();
    let mut equations = vec![vec![Dyadic::zero(); count]; count];
    for (row, &(i, j)) in pairs.iter().enumerate() {
        // (AᵀX)ᵢⱼ + (XA)ᵢⱼ
        for k in 0..n {
            let (left, right) = (position(k, j), position(i, k));
            equations[row][left] = &equations[row][left] + a.at(k, i);
            equations[row][right] = &equations[row][right] + a.at(k, j);
        }
    }
    let matrix = Exact::from_fn(count, count, |i, j| equations[i][j].clone());
    let right = Exact::from_fn(count, 1, |row, _| -w.at(pairs[row].0, pairs[row].1));
    let (numerator, d) = matrix.solve(&right);
    (Exact::from_fn(n, n, |i, j| numerator.at(position(i, j), 0).clone()), d)
}

/// The arithmetic itself, on cases with known answers.
pub fn check() {
    let of = |rows: &[&[f64]]| Exact::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j].into());
    assert_eq!(&Dyadic::from(0.1) + &Dyadic::from(-0.1), Dyadic::zero());
    assert!(Dyadic::from(0.1_f64.next_up()).exceeds(&Dyadic::from(0.1)));
    assert_eq!(Dyadic::from(f64::from_bits(1)).sign(), 1);
    let m = of(&[&[0.0, 2.0, 1.0], &[1.0, 1.0, 0.5], &[0.25, 0.0, 3.0]]);
    let (n, d) = m.solve(&Exact::identity(3));
    assert_eq!(d, Dyadic::from(-6.0));
    let product = m.times(&n);
    assert!((0..3).all(|i| (0..3).all(|j| *product.at(i, j) == if i == j { d.clone() } else { Dyadic::zero() })));
    assert!(of(&[&[1.0, 1.0], &[1.0, 1.0_f64.next_up()]]).is_positive());
    assert!(!of(&[&[1.0, 1.0], &[1.0, 1.0]]).is_positive() && of(&[&[1.0, 1.0], &[1.0, 1.0]]).is_semidefinite());
    assert!(!of(&[&[1.0, 1.0], &[1.0, 1.0_f64.next_down()]]).is_semidefinite());
    assert!(!of(&[&[0.0, 1.0], &[1.0, 5.0]]).is_semidefinite());
    // ẋ = −x/2: the integral of x² is x(0)²
    let (x, d) = lyapunov(&of(&[&[-0.5]]), &of(&[&[1.0]]));
    assert_eq!(x.scalar(), d);
}
