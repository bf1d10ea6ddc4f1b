//! Random numbers of a case: the same seed, the same case, on every machine.

use lpv::math::Mat;

/// A stream of numbers from a seed (SplitMix64; Steele, Lea and Flood 2014).
pub struct Numbers(u64);

impl Numbers {
    /// The stream of case `case` of the kind number `kind`.
    pub fn new(kind: usize, case: u64) -> Self {
        let mut numbers = Self((kind as u64) << 48 ^ case);
        // neighbouring seeds part after one step
        numbers.bits();
        numbers
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// In (−1, 1).
    pub fn next(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * 0.5_f64.powi(53)
    }

    /// From 0 to `count` − 1.
    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    /// True once in `count`.
    pub fn once_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    /// One of them.
    pub fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    /// In (−1, 1), every entry.
    pub fn matrix(&mut self, rows: usize, columns: usize) -> Mat<f64> {
        Mat::from_fn(rows, columns, |_, _| self.next())
    }

    /// Exactly symmetric, entries in (−1, 1).
    pub fn symmetric(&mut self, size: usize) -> Mat<f64> {
        let square = self.matrix(size, size);
        Mat::from_fn(size, size, |i, j| square[(i.min(j), i.max(j))])
    }
}
