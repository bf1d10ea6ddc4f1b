//! The polytopic LPV model: A(ρ) = Σ wᵢ(ρ) Aᵢ over the corners of the box that the features of ρ live in.
//!
//! For the quadrotor the features are sin ψ and cos ψ, the box is [−1, 1]², and the four weights are (3.36)-(3.39).

use super::{GridModel, linearize};
use crate::math::Mat;
use crate::math::matrix::{least_squares, rows, rows_list};
use crate::math::scalar::Scalar;
use crate::plant::{Feature, Plant};
use serde::{Deserialize, Serialize};

/// Convex weights of the corners of [−1, 1]^k for k features:
/// wᵢ(ρ) = Π_k (1 + c_{ik} f_k(ρ))/2 with corner cᵢ ∈ {−1, 1}^k; wᵢ ≥ 0, Σ wᵢ = 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoxWeights {
    /// f_k
    pub features: Vec<Feature>,
    /// cᵢ, one for each weight.
    pub corners: Vec<Vec<f64>>,
}

impl BoxWeights {
    /// All 2^k corners, numbered as in the thesis: the first feature falls slowest and from +1, the others rise from −1
    /// (a₁: sin = 1, cos = −1; a₂: 1, 1; a₃: −1, −1; a₄: −1, 1).
    pub fn new(features: &[Feature]) -> Self {
        let k = features.len();
        let sign = |bit: bool| if bit { 1.0 } else { -1.0 };
        let corners =
            (0..1usize << k).map(|i| (0..k).map(|j| sign((i >> (k - 1 - j) & 1 == 1) != (j == 0))).collect()).collect();
        Self { features: features.to_vec(), corners }
    }

    /// The weights at parameter `rho`.
    pub fn at<S: Scalar>(&self, rho: S) -> Vec<S> {
        (0..self.corners.len()).map(|i| self.weight(i, rho)).collect()
    }

    /// Weight `i` at parameter `rho`; allocates nothing.
    pub fn weight<S: Scalar>(&self, i: usize, rho: S) -> S {
        let factors = self.corners[i].iter().zip(&self.features);
        factors.fold(S::from(1.0), |product, (&c, feature)| product * ((feature.value(rho) * c + 1.0) / 2.0))
    }

    /// The vertex matrices Mᵢ with Σ wᵢ(ρ_k) Mᵢ closest to the `samples` at `parameters`, entry by entry in the
    /// least-squares sense, and the largest error of an entry. Of several such the smallest is taken: four samples at
    /// multiples of 90° cannot tell sin·cos from zero.
    pub fn fit(&self, parameters: &[f64], samples: &[&Mat<f64>]) -> (Vec<Mat<f64>>, f64) {
        let (rows, cols) = (samples[0].nrows(), samples[0].ncols());
        let weights: Vec<Vec<f64>> = parameters.iter().map(|&rho| self.at(rho)).collect();
        let design = Mat::from_fn(samples.len(), self.corners.len(), |k, i| weights[k][i]);
        let stacked = Mat::from_fn(samples.len(), rows * cols, |k, e| samples[k][(e / cols, e % cols)]);
        let unsolved = || Mat::from_fn(self.corners.len(), rows * cols, |_, _| f64::NAN);
        let solution = least_squares(&design, &stacked).unwrap_or_else(unsolved);
        let error = (&design * &solution - &stacked).norm_max();
        let vertices = (0..self.corners.len()).map(|i| Mat::from_fn(rows, cols, |r, c| solution[(i, r * cols + c)]));
        (vertices.collect(), error)
    }
}

/// An LPV model over the corners of a box of features.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PolytopicModel {
    /// Weights of the vertices as functions of the parameter.
    pub weights: BoxWeights,
    /// Aᵢ
    #[serde(with = "rows_list")]
    pub a: Vec<Mat<f64>>,
    /// B, the same at every vertex of the plants here.
    #[serde(with = "rows")]
    pub b: Mat<f64>,
    /// Largest error of an entry of A and B at the points it was made from.
    pub error: f64,
}

impl PolytopicModel {
    /// The polytope of a plant's features; `None` for a plant without a scheduling parameter or one whose B varies.
    pub fn of_plant(plant: &dyn Plant) -> Option<Self> {
        let scheduling = plant.description().scheduling.as_ref()?;
        let weights = BoxWeights::new(&scheduling.features);
        let grid = GridModel::of_plant(plant, 4 * weights.corners.len());
        let parameters: Vec<f64> = grid.points.iter().map(|point| point.rho).collect();
        let (a, a_error) = weights.fit(&parameters, &grid.points.iter().map(|point| &point.a).collect::<Vec<_>>());
        let b = linearize(plant, parameters[0]).b;
        let b_error = grid.points.iter().map(|point| (&point.b - &b).norm_max()).fold(0.0, f64::max);
        (b_error == 0.0).then_some(Self { weights, a, b, error: a_error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Quadrotor, QuadrotorParameters};

    /// a₁ … a₄ of thesis 3.3 stand at rows φ, θ and columns p, q.
    #[test]
    fn quadrotor_vertices_are_the_thesis_ones() {
        let model = PolytopicModel::of_plant(&Quadrotor::new(QuadrotorParameters::default())).unwrap();
        let printed = [[-1., -1., 1., -1.], [1., -1., 1., 1.], [-1., 1., -1., -1.], [1., 1., -1., 1.]];
        assert!(model.error < 1e-14);
        for (a, block) in model.a.iter().zip(printed) {
            let found = [a[(9, 6)], a[(9, 7)], a[(10, 6)], a[(10, 7)]];
            assert!(found.iter().zip(block).all(|(f, p)| (f - p).abs() < 1e-13), "{found:?} is not {block:?}");
        }
    }

    /// (3.36)-(3.39)
    #[test]
    fn weights_are_the_thesis_ones_and_convex() {
        let weights = BoxWeights::new(&[Feature::Sin, Feature::Cos]);
        for k in 0..100 {
            let psi = -3.2 + 0.064 * k as f64;
            let (s, c) = psi.sin_cos();
            let thesis = [(1. + s) * (1. - c), (1. + s) * (1. + c), (1. - s) * (1. - c), (1. - s) * (1. + c)];
            let found = weights.at(psi);
            assert!(found.iter().zip(thesis).all(|(f, t)| (f - t / 4.0).abs() < 1e-15 && *f >= 0.0));
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
    }
}
