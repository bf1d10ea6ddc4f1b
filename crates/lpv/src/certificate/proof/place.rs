//! Where in the range of the parameter, and for which variant of a claim.

/// A cell: |t − middle| ≤ half within [piece, piece + 1], of one variant of a claim (mixture of rows, input).
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub piece: usize,
    pub variant: usize,
    pub middle: f64,
    pub half: f64,
}
