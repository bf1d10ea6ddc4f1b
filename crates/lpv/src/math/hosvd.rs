//! The higher-order singular value decomposition F = S ×₁ U₁ ×₂ U₂ … of chosen modes (De Lathauwer, De Moor and
//! Vandewalle 2000): Uₙ holds the left singular vectors of the unfolding F₍ₙ₎.

use super::Mat;
use super::tensor::Tensor;

/// The singular value decomposition of one unfolding, F₍ₙ₎ = U diag(σ) Vᵀ.
#[derive(Clone, Debug)]
pub struct ModeDecomposition {
    /// All min(Iₙ, columns) singular values σ in descending order.
    pub singular_values: Vec<f64>,
    /// U, Iₙ × min(Iₙ, columns), orthonormal columns; each has its entry of largest magnitude positive.
    pub left: Mat<f64>,
    /// V, columns × min(Iₙ, columns), orthonormal columns.
    pub right: Mat<f64>,
}

/// The decomposition of the unfolding in `mode` (from 0); `None` if it does not converge (entries that are not finite).
///
/// # Panics
/// If there is no such mode.
pub fn decompose_mode(tensor: &Tensor, mode: usize) -> Option<ModeDecomposition> {
    // the transpose is tall; a Gram matrix would be cheaper, but would lose singular values below √ε σ₁
    // scaled to entries of at most one, whose squares do not overflow
    let largest = tensor.norm_max();
    let scale = if largest > 0.0 { largest } else { 1.0 };
    let original = tensor.unfolding_transposed(mode);
    let unfolding = Mat::from_fn(original.nrows(), original.ncols(), |i, j| original[(i, j)] / scale);
    let svd = unfolding.thin_svd().ok()?;
    let count = unfolding.nrows().min(unfolding.ncols());
    let singular_values: Vec<f64> = (0..count).map(|k| scale * svd.S()[k]).collect();
    let vectors = svd.V();
    let sign = |k: usize| {
        let largest = (0..vectors.nrows()).map(|i| vectors[(i, k)]).fold(0.0, largest_magnitude);
        if largest < 0.0 { -1.0 } else { 1.0 }
    };
    let signs: Vec<f64> = (0..count).map(sign).collect();
    let left = Mat::from_fn(vectors.nrows(), count, |i, k| signs[k] * vectors[(i, k)]);
    let right = Mat::from_fn(unfolding.nrows(), count, |i, k| signs[k] * svd.U()[(i, k)]);
    singular_values.iter().all(|value| value.is_finite()).then_some(ModeDecomposition { singular_values, left, right })
}

/// The one of larger magnitude; of two that differ by rounding only, the first.
fn largest_magnitude(a: f64, b: f64) -> f64 {
    if b.abs() > a.abs() * (1.0 + 1e-9) { b } else { a }
}

/// Thin singular value decomposition (σ, V) of M: the right singular vectors of M as columns of V; `None` if it does not
/// converge.
pub fn right_singular(matrix: &Mat<f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    let svd = matrix.thin_svd().ok()?;
    let values = (0..matrix.nrows().min(matrix.ncols())).map(|k| svd.S()[k]).collect();
    Some((values, svd.V().to_owned()))
}
