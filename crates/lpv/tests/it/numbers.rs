//! Random numbers of the tests that make loops.

use lpv::math::Mat;

/// A stream of numbers in (−1, 1) from a seed.
pub struct Numbers(pub u64);

impl Numbers {
    /// The next of them.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as f64) / f64::from(1_u32 << 30) - 1.0
    }

    /// A matrix of the next of them, by columns.
    pub fn matrix(&mut self, rows: usize, columns: usize) -> Mat<f64> {
        Mat::from_fn(rows, columns, |_, _| self.next())
    }
}
