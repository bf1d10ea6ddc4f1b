//! Memory that begins with a cache line, so that no vector register is loaded from two.

use std::ops::{Deref, DerefMut};

/// Bytes of a cache line, and of the widest vector register.
const LINE: usize = 64;

/// A slice of numbers that begins with a cache line. (Where the allocator's address says nothing, anywhere: only speed depends on it.)
#[derive(Debug, Default)]
pub(crate) struct Aligned {
    all: Vec<f64>,
    first: usize,
    len: usize,
}

impl Aligned {
    /// So many zeros.
    pub fn zeros(len: usize) -> Self {
        let spare = LINE / size_of::<f64>() - 1;
        let all = vec![0.0; len + spare];
        let first = all.as_ptr().align_offset(LINE).min(spare);
        Self { all, first, len }
    }
}

impl Deref for Aligned {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.all[self.first..self.first + self.len]
    }
}

impl DerefMut for Aligned {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.all[self.first..self.first + self.len]
    }
}
