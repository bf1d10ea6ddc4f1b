//! Small helpers around the dense matrix type: construction from rows, symmetric parts, inverses, and the plain
//! nested-row form in which matrices are stored in files.

use super::Mat;
use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{MatRef, Side};

/// Matrix from its rows. All rows must have the same length.
pub fn from_rows(rows: &[Vec<f64>]) -> Mat<f64> {
    Mat::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |i, j| rows[i][j])
}

/// Matrix from `rows` × `cols` entries in row order.
pub fn from_row_slice(rows: usize, cols: usize, entries: &[f64]) -> Mat<f64> {
    assert_eq!(entries.len(), rows * cols, "a {rows} × {cols} matrix needs {} entries", rows * cols);
    Mat::from_fn(rows, cols, |i, j| entries[i * cols + j])
}

/// The rows of a matrix.
pub fn to_rows(matrix: &Mat<f64>) -> Vec<Vec<f64>> {
    (0..matrix.nrows()).map(|i| (0..matrix.ncols()).map(|j| matrix[(i, j)]).collect()).collect()
}

/// The entries of a matrix in row order.
pub fn to_row_vec(matrix: &Mat<f64>) -> Vec<f64> {
    (0..matrix.nrows()).flat_map(|i| (0..matrix.ncols()).map(move |j| matrix[(i, j)])).collect()
}

/// Diagonal matrix.
pub fn diagonal(entries: &[f64]) -> Mat<f64> {
    Mat::from_fn(entries.len(), entries.len(), |i, j| if i == j { entries[i] } else { 0.0 })
}

/// Identity matrix of size `n`.
pub fn identity(n: usize) -> Mat<f64> {
    Mat::identity(n, n)
}

/// tr X
pub fn trace(matrix: &Mat<f64>) -> f64 {
    (0..matrix.nrows()).map(|i| matrix[(i, i)]).sum()
}

/// (X + Xᵀ)/2, exactly symmetric.
pub fn symmetric_part(matrix: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| 0.5 * (matrix[(i, j)] + matrix[(j, i)]))
}

/// Whether X = Xᵀ to the relative tolerance `tolerance`.
pub fn is_symmetric(matrix: &Mat<f64>, tolerance: f64) -> bool {
    matrix.nrows() == matrix.ncols()
        && (matrix - matrix.transpose()).norm_max() <= tolerance * matrix.norm_max().max(f64::MIN_POSITIVE)
}

/// Whether every entry off the diagonal is zero.
pub fn is_diagonal(matrix: &Mat<f64>) -> bool {
    (0..matrix.nrows()).all(|i| (0..matrix.ncols()).all(|j| i == j || matrix[(i, j)] == 0.0))
}

/// Whether every entry is finite.
pub fn is_finite(matrix: &Mat<f64>) -> bool {
    (0..matrix.ncols()).all(|j| (0..matrix.nrows()).all(|i| matrix[(i, j)].is_finite()))
}

/// X⁻¹ of a symmetric positive definite matrix, exactly symmetric; `None` when the Cholesky factorisation fails.
pub fn inverse_spd(matrix: &Mat<f64>) -> Option<Mat<f64>> {
    let inverse = matrix.llt(Side::Lower).ok()?.inverse();
    Some(symmetric_part(&inverse))
}

/// L⁻¹ of the Cholesky factorisation X = LLᵀ of a symmetric positive definite matrix; `None` when it fails.
pub fn cholesky_inverse(matrix: &Mat<f64>) -> Option<Mat<f64>> {
    let n = matrix.nrows();
    let factorisation = matrix.llt(Side::Lower).ok()?;
    let l = factorisation.L();
    let mut inverse = Mat::<f64>::identity(n, n);
    for j in 0..n {
        for i in j..n {
            let sum: f64 = (j..i).map(|k| l[(i, k)] * inverse[(k, j)]).sum();
            inverse[(i, j)] = (inverse[(i, j)] - sum) / l[(i, i)];
        }
    }
    is_finite(&inverse).then_some(inverse)
}

/// X⁻¹ of a general square matrix by LU with partial pivoting. A singular X gives non-finite entries.
pub fn inverse(matrix: &Mat<f64>) -> Mat<f64> {
    matrix.partial_piv_lu().inverse()
}

/// A factor G of a symmetric positive semidefinite C = G Gᵀ; C may be singular. `None` for a non-finite C.
pub fn semidefinite_factor(c: &Mat<f64>) -> Option<Mat<f64>> {
    // eigenvalues, not Cholesky: a covariance may be singular
    let eigen = c.self_adjoint_eigen(Side::Lower).ok()?;
    Some(Mat::from_fn(c.nrows(), c.nrows(), |i, j| eigen.U()[(i, j)] * eigen.S()[j].max(0.0).sqrt()))
}

/// The least-squares solution X of M X ≈ N of least norm. Singular values below 10⁻¹² of the largest count as zero, so that
/// M may lack full column rank; `None` if the decomposition fails.
pub fn least_squares(m: &Mat<f64>, n: &Mat<f64>) -> Option<Mat<f64>> {
    let svd = m.thin_svd().ok()?;
    let singular: Vec<f64> = (0..m.ncols().min(m.nrows())).map(|k| svd.S()[k]).collect();
    let threshold = 1e-12 * singular.first().copied().unwrap_or(0.0);
    let projected = svd.U().transpose() * n;
    let scaled = Mat::from_fn(projected.nrows(), projected.ncols(), |k, j| {
        if singular[k] > threshold { projected[(k, j)] / singular[k] } else { 0.0 }
    });
    Some(svd.V() * scaled)
}

/// The solution X of M X = N for square M.
pub fn solve(m: &Mat<f64>, n: &Mat<f64>) -> Mat<f64> {
    m.partial_piv_lu().solve(n)
}

/// xᵀ M x
pub fn quadratic_form(matrix: &Mat<f64>, x: &[f64]) -> f64 {
    (0..matrix.nrows()).map(|i| x[i] * (0..matrix.ncols()).map(|j| matrix[(i, j)] * x[j]).sum::<f64>()).sum()
}

/// [[a, b], [c, d]] from four blocks of matching sizes.
pub fn blocks_2x2(a: MatRef<f64>, b: MatRef<f64>, c: MatRef<f64>, d: MatRef<f64>) -> Mat<f64> {
    let (n, m) = (a.nrows(), a.ncols());
    Mat::from_fn(n + c.nrows(), m + b.ncols(), |i, j| match (i < n, j < m) {
        (true, true) => a[(i, j)],
        (true, false) => b[(i, j - m)],
        (false, true) => c[(i - n, j)],
        (false, false) => d[(i - n, j - m)],
    })
}

/// Serialisation of a matrix as nested rows, for `#[serde(with = "rows")]`.
pub mod rows {
    use super::{Mat, from_rows, to_rows};
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    /// Write the rows.
    pub fn serialize<S: Serializer>(matrix: &Mat<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        to_rows(matrix).serialize(serializer)
    }

    /// Read the rows; rows of different lengths are an error.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Mat<f64>, D::Error> {
        let rows = Vec::<Vec<f64>>::deserialize(deserializer)?;
        let width = rows.first().map_or(0, Vec::len);
        match rows.iter().position(|row| row.len() != width) {
            Some(i) => Err(D::Error::custom(format!(
                "row {} of the matrix has {} entries, row 1 has {width}",
                i + 1,
                rows[i].len()
            ))),
            None => Ok(from_rows(&rows)),
        }
    }
}

/// Serialisation of a list of matrices, for `#[serde(with = "rows_list")]`.
pub mod rows_list {
    use super::{Mat, rows};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Rows(#[serde(with = "rows")] Mat<f64>);

    /// Write each matrix as its rows.
    pub fn serialize<S: Serializer>(matrices: &[Mat<f64>], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(matrices.iter().map(|matrix| Rows(matrix.clone())))
    }

    /// Read each matrix from its rows.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Mat<f64>>, D::Error> {
        Ok(Vec::<Rows>::deserialize(deserializer)?.into_iter().map(|Rows(matrix)| matrix).collect())
    }
}

/// Serialisation of an optional matrix, for `#[serde(with = "rows_option")]`.
pub mod rows_option {
    use super::{Mat, rows};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Rows(#[serde(with = "rows")] Mat<f64>);

    /// Write the rows, or null.
    pub fn serialize<S: Serializer>(matrix: &Option<Mat<f64>>, serializer: S) -> Result<S::Ok, S::Error> {
        matrix.clone().map(Rows).serialize(serializer)
    }

    /// Read the rows, or null.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Mat<f64>>, D::Error> {
        Ok(Option::<Rows>::deserialize(deserializer)?.map(|Rows(matrix)| matrix))
    }
}
