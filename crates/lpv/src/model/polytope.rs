//! LPV models over a polytope, by their vertex matrices alone: A(ρ) = Σ ρᵢAᵢ, B(ρ) = Σ ρᵢBᵢ with ρᵢ ≥ 0, Σρᵢ = 1 (4.2).

use super::FrozenModel;
use crate::math::Mat;
use crate::plant::OperatingPoint;

/// The vertices of an LPV model.
#[derive(Clone, Debug)]
pub struct Polytope {
    /// Aᵢ, n × n.
    a: Vec<Mat<f64>>,
    /// Bᵢ, n × m, as many.
    b: Vec<Mat<f64>>,
}

/// Why matrices are no polytope.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolytopeError {
    /// No vertex at all.
    #[error("there is no vertex: give at least one matrix A")]
    Empty,
    /// Different numbers of Aᵢ and Bᵢ.
    #[error("there are {a} matrices A and {b} matrices B: give one B, or one for each A")]
    Count {
        /// Matrices A.
        a: usize,
        /// Matrices B.
        b: usize,
    },
    /// Aᵢ is not n × n or Bᵢ not n × m.
    #[error("{matrix} of vertex {vertex} is {rows} × {columns}: it has to be {expected_rows} × {expected_columns}")]
    Shape {
        /// "A" or "B".
        matrix: char,
        /// Counted from 1.
        vertex: usize,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// Rows that it has to have.
        expected_rows: usize,
        /// Columns that it has to have.
        expected_columns: usize,
    },
}

impl Polytope {
    /// Vertices Aᵢ with the Bᵢ; one B is the same at every vertex, one A too.
    ///
    /// # Errors
    /// Sizes that do not fit.
    pub fn new(mut a: Vec<Mat<f64>>, mut b: Vec<Mat<f64>>) -> Result<Self, PolytopeError> {
        let (Some(first_a), Some(first_b)) = (a.first().cloned(), b.first().cloned()) else {
            return Err(PolytopeError::Empty);
        };
        if b.len() == 1 {
            b = vec![first_b.clone(); a.len()];
        } else if a.len() == 1 {
            a = vec![first_a.clone(); b.len()];
        }
        if a.len() != b.len() {
            return Err(PolytopeError::Count { a: a.len(), b: b.len() });
        }
        let (n, m) = (first_a.nrows(), first_b.ncols());
        let misfit = |matrix, expected: (usize, usize), vertices: &[Mat<f64>]| {
            let vertex = vertices.iter().position(|v| (v.nrows(), v.ncols()) != expected)?;
            Some(PolytopeError::Shape {
                matrix,
                vertex: vertex + 1,
                rows: vertices[vertex].nrows(),
                columns: vertices[vertex].ncols(),
                expected_rows: expected.0,
                expected_columns: expected.1,
            })
        };
        match misfit('A', (n, n), &a).or_else(|| misfit('B', (n, m), &b)) {
            Some(error) => Err(error),
            None => Ok(Self { a, b }),
        }
    }

    /// The hull of linearisations.
    ///
    /// # Panics
    /// If there are none.
    pub fn hull(models: &[FrozenModel]) -> Self {
        assert!(!models.is_empty(), "a hull of no models");
        let (a, b) = models.iter().map(|model| (model.a.clone(), model.b.clone())).unzip();
        Self { a, b }
    }

    /// N
    pub fn len(&self) -> usize {
        self.a.len()
    }

    /// A fingerprint of the matrices: 16 hexadecimal digits, the same exactly for the same numbers in the same order. Two models
    /// share one by chance only (FNV-1a, 64 bits).
    pub fn fingerprint(&self) -> String {
        let sizes = [self.len(), self.states(), self.inputs()].map(|size| size as u64);
        let entries = self.a.iter().chain(&self.b).flat_map(|matrix| {
            // −0 is 0
            let entry = |at: usize| (matrix[(at / matrix.ncols(), at % matrix.ncols())] + 0.0).to_bits();
            (0..matrix.nrows() * matrix.ncols()).map(entry).collect::<Vec<u64>>()
        });
        let hash = sizes
            .into_iter()
            .chain(entries)
            .flat_map(u64::to_le_bytes)
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
        format!("{hash:016x}")
    }

    /// Never: there is at least one vertex.
    pub fn is_empty(&self) -> bool {
        self.a.is_empty()
    }

    /// n, the number of states.
    pub fn states(&self) -> usize {
        self.a[0].nrows()
    }

    /// m, the number of inputs.
    pub fn inputs(&self) -> usize {
        self.b[0].ncols()
    }

    /// Aᵢ
    pub fn a(&self, vertex: usize) -> &Mat<f64> {
        &self.a[vertex]
    }

    /// Bᵢ
    pub fn b(&self, vertex: usize) -> &Mat<f64> {
        &self.b[vertex]
    }

    /// Whether every vertex has the same B, which Corollary 4.1 asks for.
    pub fn has_constant_b(&self) -> bool {
        self.b.iter().all(|b| *b == self.b[0])
    }

    /// (A(ρ), B(ρ)) at the convex weights `rho`, as a model whose deviations are from the origin.
    pub fn at(&self, rho: &[f64]) -> FrozenModel {
        let combine = |matrices: &[Mat<f64>]| {
            Mat::from_fn(matrices[0].nrows(), matrices[0].ncols(), |i, j| {
                rho.iter().zip(matrices).map(|(weight, matrix)| weight * matrix[(i, j)]).sum()
            })
        };
        self.model(combine(&self.a), combine(&self.b), 0.0)
    }

    /// Vertex `vertex` as a model; its parameter is its number.
    pub fn vertex(&self, vertex: usize) -> FrozenModel {
        self.model(self.a[vertex].clone(), self.b[vertex].clone(), vertex as f64)
    }

    fn model(&self, a: Mat<f64>, b: Mat<f64>, rho: f64) -> FrozenModel {
        let operating_point = OperatingPoint { state: vec![0.0; self.states()], input: vec![0.0; self.inputs()] };
        FrozenModel { rho, a, b, operating_point }
    }
}
