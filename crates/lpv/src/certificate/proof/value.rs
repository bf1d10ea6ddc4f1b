//! V at a state, bounded from above.

use super::closed_loop::Form;
use super::matrix::{CellMatrix, Definiteness, TaylorMatrix};
use crate::math::interval::Interval;
use crate::math::matrix::quadratic_form;
use crate::math::taylor::Taylor;

/// By how much more than eᵀY⁻¹e in floating point is tried to be proved, one after the other.
const MORE: [f64; 6] = [1e-14, 1e-13, 1e-12, 1e-10, 1e-8, 1e-5];

impl Form {
    /// A bound on V(e, ρ) from above that holds for every e of the enclosures `error`; `None` where none is proved.
    ///
    /// eᵀPe is summed up in interval arithmetic; eᵀY⁻¹e < b is [b, eᵀ; e, Y] ≻ 0.
    pub fn at_most(&self, rho: f64, error: &[Interval]) -> Option<f64> {
        let n = error.len();
        let bound = match self {
            Form::Direct(p) => {
                let p = TaylorMatrix::of_function(p, Taylor::from(rho));
                let product = |i: usize, j: usize| if i == j { error[i].square() } else { error[i] * error[j] };
                let terms = (0..n * n).map(|at| product(at / n, at % n) * p.at(at / n, at % n).value);
                terms.fold(Interval::point(0.0), |sum, term| sum + term).hi()
            }
            Form::Inverse(y) => {
                let y = TaylorMatrix::of_function(y, Taylor::from(rho));
                let middle: Vec<f64> = error.iter().map(|e| e.middle()).collect();
                let about = quadratic_form(&self.p(rho)?, &middle);
                let holds = |bound: &f64| {
                    let bordered = TaylorMatrix::from_fn(n + 1, n + 1, |i, j| match (i, j) {
                        (0, 0) => Taylor::from(*bound),
                        (0, k) | (k, 0) => Taylor::constant(error[k - 1]),
                        (i, j) => y.at(i - 1, j - 1),
                    });
                    matches!(CellMatrix::new(&bordered, &bordered).is_positive(0.0), Definiteness::Proved(_))
                };
                MORE.iter().map(|more| about * (1.0 + more)).find(holds)?
            }
        };
        bound.is_finite().then_some(bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::{from_rows, inverse_spd};
    use crate::model::MatrixFunction;

    /// Both forms bound the same V from above, and closely; the enclosure of the error counts.
    #[test]
    fn bounds_are_above_and_close() {
        let p = from_rows(&[vec![1e8, 3.0, -1e3], vec![3.0, 1e-4, 1e-5], vec![-1e3, 1e-5, 7.0]]);
        let y = inverse_spd(&p).unwrap();
        let direct = Form::Direct(MatrixFunction::constant(p.clone()));
        let inverse = Form::Inverse(MatrixFunction::constant(y));
        // 1e8 + 0.25e-4 + 4·7 + 2(0.5·3 − 2·1e3 − 1e-5): every term but the sum is exact in integers times 1e-5
        let exact = 1e8 + 0.25e-4 + 28.0 + 2.0 * (1.5 - 2000.0 - 1e-5);
        let error = [1.0, 0.5, 2.0].map(Interval::point);
        for form in [&direct, &inverse] {
            let bound = form.at_most(0.0, &error).unwrap();
            assert!(bound >= exact && bound <= exact * (1.0 + 1e-7), "{bound} {exact}");
        }
        let wide = [Interval::new(1.0, 1.1), error[1], error[2]];
        for form in [&direct, &inverse] {
            assert!(form.at_most(0.0, &wide).is_none_or(|bound| bound >= 1.21e8 - 5e3), "{form:?}");
        }
    }

    #[test]
    fn what_is_not_definite_or_not_known_has_no_bound() {
        let of = |entry: f64| Form::Inverse(MatrixFunction::constant(from_rows(&[vec![entry]])));
        let (one, unknown) = ([Interval::point(1.0)], [Interval::ENTIRE]);
        assert_eq!(of(-1.0).at_most(0.0, &one), None);
        assert_eq!(of(1.0).at_most(0.0, &unknown), None);
        let direct = Form::Direct(MatrixFunction::constant(from_rows(&[vec![1.0]])));
        assert_eq!(direct.at_most(0.0, &unknown), None);
        let nine = direct.at_most(0.0, &[Interval::point(-3.0)]).unwrap();
        assert!((9.0..9.0 + 1e-13).contains(&nine), "{nine}");
    }
}
