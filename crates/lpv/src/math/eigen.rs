//! Eigenvalues: of symmetric matrices, of pencils of definite ones, and of general real matrices.

use super::Mat;
use faer::linalg::solvers::DenseSolveCore;
use faer::{Side, c64};

/// The eigenvalues of a symmetric matrix in ascending order (the lower triangle is read).
/// A matrix with a non-finite entry has none: the result holds NaN.
pub fn symmetric_eigenvalues(matrix: &Mat<f64>) -> Vec<f64> {
    matrix.self_adjoint_eigenvalues(Side::Lower).unwrap_or_else(|_| vec![f64::NAN; matrix.nrows()])
}

/// λ_min of a symmetric matrix.
pub fn smallest_eigenvalue(matrix: &Mat<f64>) -> f64 {
    symmetric_eigenvalues(matrix).first().copied().unwrap_or(f64::NAN)
}

/// A unit eigenvector of λ_min of a symmetric matrix; `None` for a matrix with a non-finite entry.
pub fn smallest_eigenvector(matrix: &Mat<f64>) -> Option<Vec<f64>> {
    let eigen = matrix.self_adjoint_eigen(Side::Lower).ok()?;
    Some((0..matrix.nrows()).map(|i| eigen.U()[(i, 0)]).collect())
}

/// Eigenvalues in ascending order and eigenvectors, as columns, of a symmetric matrix; `None` for one with a non-finite entry.
pub fn symmetric_eigenvectors(matrix: &Mat<f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    let eigen = matrix.self_adjoint_eigen(Side::Lower).ok()?;
    let n = matrix.nrows();
    Some(((0..n).map(|i| eigen.S()[i]).collect(), eigen.U().to_owned()))
}

/// A unit vector w with ‖wᵀM‖ = σ_min(M) of a matrix with no more rows than columns, its largest entry positive; `None` for
/// a matrix with a non-finite entry.
pub fn smallest_singular_vector(matrix: &Mat<f64>) -> Option<Vec<f64>> {
    let svd = matrix.svd().ok()?;
    let (rows, last) = (matrix.nrows(), matrix.nrows() - 1);
    let w: Vec<f64> = (0..rows).map(|i| svd.U()[(i, last)]).collect();
    let largest = w.iter().copied().fold(0.0, |most: f64, entry| if entry.abs() > most.abs() { entry } else { most });
    Some(w.iter().map(|entry| entry * largest.signum()).collect())
}

/// The eigenvalues (re, im) of a real square matrix, in no particular order.
pub fn eigenvalues(matrix: &Mat<f64>) -> Vec<(f64, f64)> {
    match matrix.eigenvalues() {
        Ok(values) => values.into_iter().map(|value: c64| (value.re, value.im)).collect(),
        Err(_) => vec![(f64::NAN, f64::NAN); matrix.nrows()],
    }
}

/// max Re λ(M): negative exactly when ẋ = Mx is asymptotically stable.
pub fn spectral_abscissa(matrix: &Mat<f64>) -> f64 {
    eigenvalues(matrix).into_iter().map(|(re, _)| re).fold(f64::NEG_INFINITY, nan_max)
}

/// max |λ(M)|: below one exactly when x₊ = Mx is asymptotically stable.
pub fn spectral_radius(matrix: &Mat<f64>) -> f64 {
    eigenvalues(matrix).into_iter().map(|(re, im)| re.hypot(im)).fold(0.0, nan_max)
}

/// Eigenvalues (re, im) of a real square matrix with eigenvectors as columns of real and imaginary parts, and the inverse V⁻¹ of these in
/// the same form; `None` where numbers do not tell them.
pub fn eigenvectors(matrix: &Mat<f64>) -> Option<Eigenvectors> {
    let n = matrix.nrows();
    let eigen = matrix.eigen().ok()?;
    let v = Mat::<c64>::from_fn(n, n, |i, j| eigen.U()[(i, j)]);
    let inverse = v.partial_piv_lu().inverse();
    let parts = |m: &Mat<c64>| [Mat::from_fn(n, n, |i, j| m[(i, j)].re), Mat::from_fn(n, n, |i, j| m[(i, j)].im)];
    let values = (0..n).map(|i| (eigen.S()[i].re, eigen.S()[i].im)).collect();
    Some(Eigenvectors { values, vectors: parts(&v), inverse: parts(&inverse) })
}

/// Of a real matrix, see [`eigenvectors`].
pub struct Eigenvectors {
    /// (re, im)
    pub values: Vec<(f64, f64)>,
    /// Re V, Im V
    pub vectors: [Mat<f64>; 2],
    /// Re V⁻¹, Im V⁻¹
    pub inverse: [Mat<f64>; 2],
}

/// The real part (or the imaginary, if larger) of an eigenvector of the eigenvalue of largest modulus.
pub fn growing_direction(matrix: &Mat<f64>) -> Option<Vec<f64>> {
    let Eigenvectors { values, vectors, .. } = eigenvectors(matrix)?;
    let modulus = |k: &usize| values[*k].0.hypot(values[*k].1);
    let largest = (0..values.len()).max_by(|a, b| modulus(a).total_cmp(&modulus(b)))?;
    let parts = vectors.map(|part| (0..values.len()).map(|i| part[(i, largest)]).collect::<Vec<f64>>());
    let size = |part: &[f64]| part.iter().map(|x| x * x).sum::<f64>();
    let direction = if size(&parts[0]) >= size(&parts[1]) { &parts[0] } else { &parts[1] };
    (size(direction) > 0.0 && size(direction).is_finite()).then(|| direction.clone())
}

/// The larger of two numbers, NaN if either is: an eigenvalue that could not be computed must not pass for stable.
fn nan_max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// √λ_max(KKᵀ), the largest singular value of K.
pub fn largest_singular_value(k: &Mat<f64>) -> f64 {
    symmetric_eigenvalues(&(k * k.transpose())).into_iter().fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::from_rows;

    #[test]
    fn rotation_has_imaginary_eigenvalues() {
        let a = from_rows(&[vec![0.0, 2.0], vec![-2.0, 0.0]]);
        assert!(spectral_abscissa(&a).abs() < 1e-14);
        assert!((spectral_radius(&a) - 2.0).abs() < 1e-14);
    }
}
