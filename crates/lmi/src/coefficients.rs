//! The coefficients of an expression, scalar unknown by scalar unknown.

use crate::Mat;
use crate::expression::{Expr, Shape};
use crate::lowering::Layout;

impl Expr {
    /// Gives parts of the coefficients of the symmetric part, lower triangle, as (row, column, unknown or known part, value): those of one entry
    /// and unknown add up to its coefficient. Every part is rounded once or twice, and none is left out unless it is zero.
    pub(crate) fn coefficients(&self, layout: &Layout, sink: &mut dyn FnMut(usize, usize, Option<usize>, f64)) {
        // The symmetric part of an entry above the diagonal and its mirror image is half their sum.
        let mut part = |i: usize, j: usize, unknown: Option<usize>, value: f64| {
            let value = if i == j { value } else { 0.5 * value };
            sink(i.max(j), i.min(j), unknown, value);
        };
        nonzeros(&self.constant).for_each(|(i, j, value)| part(i, j, None, value));
        for term in self.terms.iter() {
            match &term.shape {
                Shape::Product { left, transposed, right } => {
                    let right: Vec<(usize, usize, f64)> = nonzeros(right).collect();
                    for (i, k, u) in nonzeros(left) {
                        for &(l, j, v) in &right {
                            let (row, column) = if *transposed { (l, k) } else { (k, l) };
                            part(i, j, Some(layout.position(term.unknown, row, column)), u * v);
                        }
                    }
                }
                Shape::Scaled { weights, matrix } => {
                    let matrix: Vec<(usize, usize, f64)> = nonzeros(matrix).collect();
                    for (k, l, weight) in nonzeros(weights) {
                        let unknown = Some(layout.position(term.unknown, k, l));
                        matrix.iter().for_each(|&(i, j, value)| part(i, j, unknown, weight * value));
                    }
                }
            }
        }
    }
}

fn nonzeros(m: &Mat<f64>) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
    (0..m.ncols()).flat_map(move |j| {
        let column = m.col_as_slice(j).iter().enumerate();
        column.filter(|(_, value)| **value != 0.0).map(move |(i, value)| (i, j, *value))
    })
}
