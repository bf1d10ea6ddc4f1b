//! Gaussian noise from counter-based streams: the same (seed, run, channel) gives the same numbers on any thread.

use crate::math::Mat;
use crate::math::matrix::semidefinite_factor;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};

/// What a stream is for. Streams of different channels are independent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Process noise w.
    Process,
    /// Measurement noise v.
    Measurement,
}

/// A stream of independent Gaussian vectors with covariance `scale`·C.
pub struct NoiseStream {
    generator: ChaCha12Rng,
    /// G with G Gᵀ = scale · C, rows in order.
    factor: Vec<Vec<f64>>,
    normal: Vec<f64>,
}

impl NoiseStream {
    /// The stream of `channel` in run `run` of `seed`; `covariance` is symmetric positive semidefinite.
    pub fn new(seed: u64, run: u64, channel: Channel, covariance: &Mat<f64>, scale: f64) -> Self {
        let n = covariance.nrows();
        let mut generator = ChaCha12Rng::seed_from_u64(seed);
        generator.set_stream(run << 1 | u64::from(channel == Channel::Measurement));
        let root = scale.sqrt();
        let factor = match semidefinite_factor(covariance) {
            Some(factor) => (0..n).map(|i| (0..n).map(|j| factor[(i, j)] * root).collect()).collect(),
            None => vec![vec![f64::NAN; n]; n],
        };
        Self { generator, factor, normal: vec![0.0; n] }
    }

    /// The next vector.
    pub fn next(&mut self, noise: &mut [f64]) {
        for normal in &mut self.normal {
            *normal = standard_normal(&mut self.generator);
        }
        for (value, row) in noise.iter_mut().zip(&self.factor) {
            *value = row.iter().zip(&self.normal).map(|(g, n)| g * n).sum();
        }
    }
}

fn standard_normal(generator: &mut impl Rng) -> f64 {
    StandardNormal.sample(generator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrix::from_rows;

    #[test]
    fn covariance_is_the_one_asked_for() {
        let covariance = from_rows(&[vec![2.0, 0.6], vec![0.6, 0.5]]);
        let mut stream = NoiseStream::new(7, 0, Channel::Process, &covariance, 3.0);
        let (mut sum, count) = ([[0.0; 2]; 2], 100_000);
        let mut v = [0.0; 2];
        for _ in 0..count {
            stream.next(&mut v);
            for i in 0..2 {
                for j in 0..2 {
                    sum[i][j] += v[i] * v[j] / count as f64;
                }
            }
        }
        for i in 0..2 {
            for j in 0..2 {
                // four standard deviations of a sample covariance of 10⁵ draws are below 0.12 here
                assert!((sum[i][j] - 3.0 * covariance[(i, j)]).abs() < 0.12);
            }
        }
    }

    #[test]
    fn streams_repeat_and_differ() {
        let draw = |seed, run, channel| {
            let mut v = [0.0; 1];
            NoiseStream::new(seed, run, channel, &from_rows(&[vec![1.0]]), 1.0).next(&mut v);
            v[0]
        };
        assert_eq!(draw(1, 0, Channel::Process), draw(1, 0, Channel::Process));
        let draws = [
            draw(1, 0, Channel::Process),
            draw(1, 0, Channel::Measurement),
            draw(1, 1, Channel::Process),
            draw(2, 0, Channel::Process),
        ];
        assert!((0..4).all(|i| (0..i).all(|j| draws[i] != draws[j])));
    }
}
