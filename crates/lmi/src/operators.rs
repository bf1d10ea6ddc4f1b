//! Arithmetic of expressions, for owned and borrowed operands.

use crate::Mat;
use crate::expression::{Expr, Shape, Term};
use std::ops::{Add, Mul, Neg, Sub};

fn sum(a: &Expr, b: &Expr, sign: f64) -> Expr {
    assert!(
        a.nrows() == b.nrows() && a.ncols() == b.ncols(),
        "{} of a {} × {} and a {} × {} expression",
        if sign > 0.0 { "sum" } else { "difference" },
        a.nrows(),
        a.ncols(),
        b.nrows(),
        b.ncols()
    );
    let mut terms = (*a.terms).clone();
    if sign > 0.0 {
        terms.extend(b.terms.iter().cloned());
        return Expr::new(&*a.constant + &*b.constant, terms);
    }
    terms.extend(scaled(b, -1.0).terms.iter().cloned());
    Expr::new(&*a.constant - &*b.constant, terms)
}

fn scaled(a: &Expr, factor: f64) -> Expr {
    let terms = a.terms.iter().map(|term| {
        let shape = match &term.shape {
            Shape::Product { left, transposed, right } => {
                Shape::Product { left: factor * left, transposed: *transposed, right: right.clone() }
            }
            Shape::Scaled { weights, matrix } => Shape::Scaled { weights: weights.clone(), matrix: factor * matrix },
        };
        Term { unknown: term.unknown, shape }
    });
    Expr::new(factor * &*a.constant, terms.collect())
}

fn product_from_left(a: &Mat<f64>, b: &Expr) -> Expr {
    check_product((a.nrows(), a.ncols()), (b.nrows(), b.ncols()));
    b.map_left(&|m| a * m)
}

fn product_from_right(a: &Expr, b: &Mat<f64>) -> Expr {
    check_product((a.nrows(), a.ncols()), (b.nrows(), b.ncols()));
    a.map_right(&|m| m * b)
}

fn check_product(a: (usize, usize), b: (usize, usize)) {
    assert_eq!(a.1, b.0, "product of a {} × {} and a {} × {} matrix", a.0, a.1, b.0, b.1);
}

/// Writes one operator for the four combinations of owned and borrowed operands.
macro_rules! binary {
    ($trait:ident, $method:ident, $left:ty, $right:ty, |$a:ident, $b:ident| $body:expr) => {
        impl $trait<&$right> for &$left {
            type Output = Expr;
            fn $method(self, right: &$right) -> Expr {
                let ($a, $b) = (self, right);
                $body
            }
        }
        impl $trait<$right> for &$left {
            type Output = Expr;
            fn $method(self, right: $right) -> Expr {
                self.$method(&right)
            }
        }
        impl $trait<&$right> for $left {
            type Output = Expr;
            fn $method(self, right: &$right) -> Expr {
                (&self).$method(right)
            }
        }
        impl $trait<$right> for $left {
            type Output = Expr;
            fn $method(self, right: $right) -> Expr {
                (&self).$method(&right)
            }
        }
    };
}

binary!(Add, add, Expr, Expr, |a, b| sum(a, b, 1.0));
binary!(Sub, sub, Expr, Expr, |a, b| sum(a, b, -1.0));
binary!(Add, add, Expr, Mat<f64>, |a, b| sum(a, &Expr::from(b), 1.0));
binary!(Sub, sub, Expr, Mat<f64>, |a, b| sum(a, &Expr::from(b), -1.0));
binary!(Add, add, Mat<f64>, Expr, |a, b| sum(&Expr::from(a), b, 1.0));
binary!(Sub, sub, Mat<f64>, Expr, |a, b| sum(&Expr::from(a), b, -1.0));
binary!(Mul, mul, Mat<f64>, Expr, |a, b| product_from_left(a, b));
binary!(Mul, mul, Expr, Mat<f64>, |a, b| product_from_right(a, b));

macro_rules! scaling {
    ($expr:ty) => {
        impl Mul<$expr> for f64 {
            type Output = Expr;
            fn mul(self, right: $expr) -> Expr {
                scaled(&right, self)
            }
        }
        impl Mul<f64> for $expr {
            type Output = Expr;
            fn mul(self, right: f64) -> Expr {
                scaled(&self, right)
            }
        }
        impl Neg for $expr {
            type Output = Expr;
            fn neg(self) -> Expr {
                scaled(&self, -1.0)
            }
        }
    };
}

scaling!(Expr);
scaling!(&Expr);
