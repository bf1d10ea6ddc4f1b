//! Memory that begins with a cache line, so that no vector register is loaded from two.

use std::ops::{Deref, DerefMut};

/// Numbers in a cache line and in the widest vector register: rows and columns are padded to a multiple of this.
pub(crate) const PADDING: usize = 8;

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
        let spare = PADDING - 1;
        let all = vec![0.0; len + spare];
        let first = all.as_ptr().align_offset(PADDING * size_of::<f64>()).min(spare);
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
