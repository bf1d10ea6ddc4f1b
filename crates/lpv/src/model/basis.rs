//! Matrices as functions of scheduling parameters: M(ρ) = Σ fᵢ(ρ) Mᵢ with textbook basis functions fᵢ.
//!
//! This is how a parameter-dependent Lyapunov matrix is carried to every parameter value (Wu, Yang, Packard and Becker,
//! "Induced L2-norm control for LPV systems with bounded parameter variation rates", 1996). The functions are evaluated
//! over any [`Scalar`], so that values, derivatives (dual numbers) and enclosures come from the one formula.

use crate::math::Mat;
use crate::math::matrix::rows_list;
use crate::math::scalar::{Dual, Scalar, derivative, dual};
use serde::{Deserialize, Serialize};

/// A function of the scheduling parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "function", rename_all = "kebab-case")]
pub enum BasisFunction {
    /// 1
    Constant,
    /// ρ_p^k
    Power {
        /// p
        parameter: usize,
        /// k
        exponent: u32,
    },
    /// cos kρ_p
    Cos {
        /// p
        parameter: usize,
        /// k
        harmonic: u32,
    },
    /// sin kρ_p
    Sin {
        /// p
        parameter: usize,
        /// k
        harmonic: u32,
    },
}

impl BasisFunction {
    /// The value at parameters `rho`.
    ///
    /// # Panics
    /// If the function's parameter is not in `rho`.
    pub fn at<S: Scalar>(&self, rho: &[S]) -> S {
        match *self {
            BasisFunction::Constant => S::from(1.0),
            BasisFunction::Power { parameter, exponent } => {
                (0..exponent).fold(S::from(1.0), |power, _| power * rho[parameter])
            }
            BasisFunction::Cos { parameter, harmonic } => (rho[parameter] * f64::from(harmonic)).sin_cos().1,
            BasisFunction::Sin { parameter, harmonic } => (rho[parameter] * f64::from(harmonic)).sin_cos().0,
        }
    }

    /// p; `None` for the constant.
    pub fn parameter(&self) -> Option<usize> {
        match *self {
            BasisFunction::Constant => None,
            BasisFunction::Power { parameter, .. }
            | BasisFunction::Cos { parameter, .. }
            | BasisFunction::Sin { parameter, .. } => Some(parameter),
        }
    }

    /// 1, cos ρ, sin ρ, …, cos kρ, sin kρ of parameter `parameter`, for one that is periodic with 2π.
    pub fn harmonics(parameter: usize, order: u32) -> Vec<Self> {
        let pair = |harmonic| [Self::Cos { parameter, harmonic }, Self::Sin { parameter, harmonic }];
        std::iter::once(Self::Constant).chain((1..=order).flat_map(pair)).collect()
    }

    /// 1, ρ, …, ρ^k of parameter `parameter`.
    pub fn powers(parameter: usize, degree: u32) -> Vec<Self> {
        let power = |exponent| Self::Power { parameter, exponent };
        std::iter::once(Self::Constant).chain((1..=degree).map(power)).collect()
    }
}

/// M(ρ) = Σ fᵢ(ρ) Mᵢ.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MatrixFunction {
    /// fᵢ
    pub basis: Vec<BasisFunction>,
    /// Mᵢ, all of one size, as many as functions and at least one.
    #[serde(with = "rows_list")]
    pub coefficients: Vec<Mat<f64>>,
}

impl MatrixFunction {
    /// The function that is `matrix` everywhere.
    pub fn constant(matrix: Mat<f64>) -> Self {
        Self { basis: vec![BasisFunction::Constant], coefficients: vec![matrix] }
    }

    /// (rows, columns)
    pub fn shape(&self) -> (usize, usize) {
        (self.coefficients[0].nrows(), self.coefficients[0].ncols())
    }

    /// f₁(ρ), f₂(ρ), …; sine and cosine of a harmonic that stand side by side are computed together.
    ///
    /// # Panics
    /// If a function's parameter is not in `rho`.
    pub fn factors<S: Scalar + Copy>(&self, rho: &[S]) -> Vec<S> {
        let mut last: Option<((usize, u32), (S, S))> = None;
        let mut sin_cos = |parameter: usize, harmonic: u32| match last {
            Some((known, values)) if known == (parameter, harmonic) => values,
            _ => {
                let values = (rho[parameter] * f64::from(harmonic)).sin_cos();
                last = Some(((parameter, harmonic), values));
                values
            }
        };
        let mut factor = |function: &BasisFunction| match *function {
            BasisFunction::Sin { parameter, harmonic } => sin_cos(parameter, harmonic).0,
            BasisFunction::Cos { parameter, harmonic } => sin_cos(parameter, harmonic).1,
            _ => function.at(rho),
        };
        self.basis.iter().map(&mut factor).collect()
    }

    /// M(ρ).
    pub fn at(&self, rho: &[f64]) -> Mat<f64> {
        self.combine(|function| function.at(rho))
    }

    /// ∂M/∂ρ_p, by dual numbers.
    pub fn derivative(&self, rho: &[f64], parameter: usize) -> Mat<f64> {
        let seeded: Vec<Dual> =
            rho.iter().enumerate().map(|(p, &value)| dual(value, (p == parameter).then_some(0))).collect();
        self.combine(|function| derivative(&function.at(&seeded), 0))
    }

    /// Add M(ρ) of a single parameter to `sum`, in row order; allocates nothing.
    pub fn add_to(&self, rho: f64, sum: &mut [f64]) {
        for (function, coefficient) in self.basis.iter().zip(&self.coefficients) {
            let factor = function.at(&[rho]);
            let columns = coefficient.ncols();
            for j in 0..columns {
                for i in 0..coefficient.nrows() {
                    sum[i * columns + j] += factor * coefficient[(i, j)];
                }
            }
        }
    }

    /// Add `scale` M(ρ)z of a single parameter to `sum`; allocates nothing.
    pub fn add_product(&self, rho: f64, z: &[f64], scale: f64, sum: &mut [f64]) {
        for (function, coefficient) in self.basis.iter().zip(&self.coefficients) {
            let factor = scale * function.at(&[rho]);
            if factor != 0.0 {
                for (i, sum) in sum.iter_mut().enumerate() {
                    *sum += factor * row_product(coefficient, i, z);
                }
            }
        }
    }

    /// A bound on |(M(ρ)z)ᵢ| over all values of a single parameter, for constants and harmonics: |c₀| + Σₖ √(cₖ² + sₖ²) of the
    /// coefficients of the row's product with z. Infinite if there is a power.
    pub fn bound_of_product(&self, z: &[f64], row: usize) -> f64 {
        let product = |k: usize| row_product(&self.coefficients[k], row, z);
        let sine = |harmonic: u32| {
            let is_sine = |f: &BasisFunction| matches!(*f, BasisFunction::Sin { harmonic: h, .. } if h == harmonic);
            self.basis.iter().position(is_sine).map_or(0.0, product)
        };
        let cosine = |harmonic: u32| {
            let is_cosine = |f: &BasisFunction| matches!(*f, BasisFunction::Cos { harmonic: h, .. } if h == harmonic);
            self.basis.iter().any(is_cosine)
        };
        let terms = self.basis.iter().enumerate().map(|(k, function)| match *function {
            BasisFunction::Constant => product(k).abs(),
            BasisFunction::Cos { harmonic, .. } => product(k).hypot(sine(harmonic)),
            BasisFunction::Sin { harmonic, .. } if cosine(harmonic) => 0.0,
            BasisFunction::Sin { .. } => product(k).abs(),
            BasisFunction::Power { .. } if product(k) == 0.0 => 0.0,
            BasisFunction::Power { .. } => f64::INFINITY,
        });
        terms.sum()
    }

    fn combine(&self, factor: impl Fn(&BasisFunction) -> f64) -> Mat<f64> {
        let (rows, columns) = self.shape();
        let mut sum = Mat::zeros(rows, columns);
        for (function, coefficient) in self.basis.iter().zip(&self.coefficients) {
            let factor = factor(function);
            sum = Mat::from_fn(rows, columns, |i, j| sum[(i, j)] + factor * coefficient[(i, j)]);
        }
        sum
    }

    /// Interpolation of `samples` at the equidistant points ρ_k = `first` + 2πk/N of a parameter with period 2π, by
    /// harmonics up to ⌊(N − 1)/2⌋: exact for functions with no higher ones. Harmonics whose coefficients are all below
    /// `tolerance` times the largest entry of the samples are left out.
    ///
    /// # Panics
    /// If there are no samples.
    pub fn trigonometric(first: f64, samples: &[Mat<f64>], tolerance: f64) -> Self {
        let count = samples.len();
        let (rows, columns) = (samples[0].nrows(), samples[0].ncols());
        let scale = samples.iter().map(|m| m.norm_max()).fold(0.0, f64::max);
        let fitted = |function: &BasisFunction| {
            let weight = if *function == BasisFunction::Constant { 1.0 } else { 2.0 } / count as f64;
            let mut sum = Mat::<f64>::zeros(rows, columns);
            for (k, sample) in samples.iter().enumerate() {
                let rho = first + std::f64::consts::TAU * k as f64 / count as f64;
                let factor = weight * function.at(&[rho]);
                sum = Mat::from_fn(rows, columns, |i, j| sum[(i, j)] + factor * sample[(i, j)]);
            }
            sum
        };
        let order = u32::try_from(count.saturating_sub(1) / 2).unwrap_or(u32::MAX);
        let (basis, coefficients) = BasisFunction::harmonics(0, order)
            .into_iter()
            .map(|function| (function, fitted(&function)))
            .filter(|(function, m)| *function == BasisFunction::Constant || m.norm_max() > tolerance * scale)
            .unzip();
        Self { basis, coefficients }
    }
}

/// (Mz)ᵢ
fn row_product(matrix: &Mat<f64>, row: usize, z: &[f64]) -> f64 {
    z.iter().enumerate().map(|(j, z)| matrix[(row, j)] * z).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_bounded_over_the_circle() {
        let basis = BasisFunction::harmonics(0, 2);
        let coefficients: Vec<_> =
            (0..5).map(|k| Mat::from_fn(2, 3, |i, j| ((k * 7 + 3 * i + 2 * j) as f64).sin())).collect();
        let function = MatrixFunction { basis, coefficients };
        let z = [0.3, -1.2, 0.8];
        for row in 0..2 {
            let bound = function.bound_of_product(&z, row);
            let mut most = 0.0f64;
            for k in 0..1000 {
                let (mut sum, mut entries) = ([0.0; 2], [0.0; 6]);
                let rho = 0.00628 * f64::from(k);
                function.add_product(rho, &z, 2.0, &mut sum);
                function.add_to(rho, &mut entries);
                let product: f64 = (0..3).map(|j| entries[3 * row + j] * z[j]).sum();
                assert!((sum[row] - 2.0 * product).abs() < 1e-13);
                most = most.max(product.abs());
            }
            assert!(most <= bound && bound < 2.0 * most, "{most} {bound}");
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let basis = [BasisFunction::harmonics(0, 2), BasisFunction::powers(1, 3)].concat();
        let coefficients =
            (0..basis.len()).map(|k| Mat::from_fn(2, 3, |i, j| 1.0 + (k * 6 + 3 * i + j) as f64)).collect();
        let function = MatrixFunction { basis, coefficients };
        for parameter in 0..2 {
            let at = |offset: f64| {
                let mut rho = [0.4, -1.3];
                rho[parameter] += offset;
                function.at(&rho)
            };
            let h = 1e-6;
            let (up, down) = (at(h), at(-h));
            let difference = Mat::from_fn(2, 3, |i, j| (up[(i, j)] - down[(i, j)]) / (2.0 * h));
            let derivative = function.derivative(&[0.4, -1.3], parameter);
            assert!((difference - &derivative).norm_max() < 1e-7 * derivative.norm_max());
        }
    }

    #[test]
    fn trigonometric_interpolation_finds_the_harmonics() {
        let value = |rho: f64| Mat::from_fn(1, 2, |_, j| 2.0 + rho.cos() - 3.0 * (2.0 * rho).sin() * j as f64);
        let first = -std::f64::consts::PI;
        let samples: Vec<_> = (0..8).map(|k| value(first + std::f64::consts::TAU * k as f64 / 8.0)).collect();
        let function = MatrixFunction::trigonometric(first, &samples, 1e-12);
        assert_eq!(function.basis.len(), 3);
        for rho in [-3.0, 0.1, 1.7] {
            assert!((function.at(&[rho]) - value(rho)).norm_max() < 1e-13);
        }
    }
}
