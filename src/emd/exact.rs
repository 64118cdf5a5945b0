//! Exact optimal assignment between two clouds of equal size.

use crate::math::cloud::Point;

/// A one-to-one correspondence and its cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    /// For every source point, the index of its target point.
    pub target_of: Vec<usize>,
    /// Mean Euclidean distance between matched points: the exact W1 for uniform weights.
    pub mean_distance: f64,
}

/// The assignment of least total Euclidean distance. `source` and `target` have equal length.
pub fn assign(_source: &[Point], _target: &[Point]) -> Assignment {
    unimplemented!("lands with the emd module")
}
