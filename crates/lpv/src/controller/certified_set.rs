//! Certified sets {V ≤ γ}, V(x, ρ) = xᵀY(ρ)⁻¹x, evaluated while the controller runs.

use crate::model::MatrixFunction;
use serde::{Deserialize, Serialize};

/// The set {xᵀY(ρ)⁻¹x ≤ γ} of errors from which a design is certified.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CertifiedSet {
    /// γ > 0
    pub level: f64,
    /// Y(ρ) ≻ 0, n × n.
    pub y: MatrixFunction,
}

/// Work space for V and the form xᵀY(ρ)⁻¹z at one parameter value: the Cholesky factor Y(ρ) = LLᵀ.
#[derive(Clone, Debug)]
pub struct SetEvaluator {
    states: usize,
    /// L, in row order, its lower triangle.
    factor: Vec<f64>,
    /// L⁻¹x and L⁻¹z.
    solved: [Vec<f64>; 2],
}

impl SetEvaluator {
    /// For errors of `states` components.
    pub fn new(states: usize) -> Self {
        Self { states, factor: vec![0.0; states * states], solved: [vec![0.0; states], vec![0.0; states]] }
    }

    /// Factorise Y at parameter `rho`; false where it is not positive definite, and V is then infinite.
    pub fn at(&mut self, set: &CertifiedSet, rho: f64) -> bool {
        let n = self.states;
        self.factor.fill(0.0);
        set.y.add_to(rho, &mut self.factor);
        for j in 0..n {
            for i in j..n {
                let sum: f64 = (0..j).map(|k| self.factor[i * n + k] * self.factor[j * n + k]).sum();
                let rest = self.factor[i * n + j] - sum;
                self.factor[i * n + j] = match i == j {
                    true if rest > 0.0 => rest.sqrt(),
                    true => {
                        self.factor.fill(f64::NAN);
                        return false;
                    }
                    false => rest / self.factor[j * n + j],
                };
            }
        }
        true
    }

    /// V(x) = xᵀY⁻¹x at the parameter of [`SetEvaluator::at`]; infinite where Y was not definite there.
    pub fn value(&mut self, x: &[f64]) -> f64 {
        let [v, _, _] = self.forms(x, x);
        v
    }

    /// [xᵀY⁻¹x, xᵀY⁻¹z, zᵀY⁻¹z]
    pub fn forms(&mut self, x: &[f64], z: &[f64]) -> [f64; 3] {
        let n = self.states;
        for (solved, right) in self.solved.iter_mut().zip([x, z]) {
            for i in 0..n {
                let sum: f64 = (0..i).map(|k| self.factor[i * n + k] * solved[k]).sum();
                solved[i] = (right[i] - sum) / self.factor[i * n + i];
            }
        }
        let [a, b] = &self.solved;
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let finite = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
        [finite(product(a, a)), finite(product(a, b)), finite(product(b, b))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::{from_rows, inverse_spd, quadratic_form};
    use crate::model::BasisFunction;

    #[test]
    fn forms_are_those_of_the_inverse() {
        let y0 = from_rows(&[vec![4.0, 1.0, 0.5], vec![1.0, 3.0, -0.2], vec![0.5, -0.2, 2.0]]);
        let y1 = from_rows(&[vec![0.3, 0.1, 0.0], vec![0.1, -0.4, 0.2], vec![0.0, 0.2, 0.1]]);
        let y = MatrixFunction {
            basis: vec![BasisFunction::Constant, BasisFunction::Cos { parameter: 0, harmonic: 2 }],
            coefficients: vec![y0, y1],
        };
        let set = CertifiedSet { level: 1.0, y };
        let mut evaluator = SetEvaluator::new(3);
        let (x, z) = ([1.0, -2.0, 0.3], [0.2, 0.7, -1.1]);
        for rho in [-2.0, 0.0, 0.9] {
            assert!(evaluator.at(&set, rho));
            let p = inverse_spd(&set.y.at(&[rho])).unwrap();
            let sum: Vec<f64> = x.iter().zip(&z).map(|(a, b)| a + b).collect();
            let [a, b, c] = evaluator.forms(&x, &z);
            assert!((a - quadratic_form(&p, &x)).abs() < 1e-13 && (c - quadratic_form(&p, &z)).abs() < 1e-13);
            assert!((a + 2.0 * b + c - quadratic_form(&p, &sum)).abs() < 1e-13);
        }
    }

    #[test]
    fn what_is_not_definite_holds_nothing() {
        let set =
            CertifiedSet { level: 1.0, y: MatrixFunction::constant(from_rows(&[vec![1.0, 2.0], vec![2.0, 1.0]])) };
        let mut evaluator = SetEvaluator::new(2);
        assert!(!evaluator.at(&set, 0.0));
        assert_eq!(evaluator.value(&[0.1, 0.0]), f64::INFINITY);
    }
}
