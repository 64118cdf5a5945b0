//! Seeds: the derivatives of a loss by what a rollout passes, from which its backward pass starts.
//!
//! A loss's derivatives at the end of a control step come in, in the caller's order; they are added to the adjoints of
//! the sorted particles. Imports particles and tool.

use super::lanes::Real;
use super::particles::{C, F, V, X, index};
use super::tool::PoseAdj;
use crate::math::cloud::Point;

/// Derivatives of a loss at the end of one control step (entry 0: at the start). An empty vector stands
/// for zeros.
#[derive(Clone, Debug, Default)]
pub struct StepSeed {
    /// By the particles' positions, caller's order.
    pub positions: Vec<Point>,
    /// By their velocities.
    pub velocities: Vec<Point>,
    /// By their affine velocity matrices, row-major.
    pub affine: Vec<[f64; 9]>,
    /// By their deformation gradients, row-major.
    pub deformation: Vec<[f64; 9]>,
    /// By the tools' poses.
    pub poses: Vec<PoseAdj>,
}

impl StepSeed {
    /// Whether it is about so many particles and tools; an empty vector fits any number.
    pub(super) fn fits(&self, particles: usize, tools: usize) -> bool {
        let of_particles =
            [self.positions.len(), self.velocities.len(), self.affine.len(), self.deformation.len()];
        let fits = |len: usize, want: usize| len == 0 || len == want;
        of_particles.into_iter().all(|len| fits(len, particles)) && fits(self.poses.len(), tools)
    }

    /// Adds it to the adjoints of particles that are packed in the order of `ids`, and of the tools' poses. Packed
    /// positions are in cells of size `dx`.
    pub(super) fn add_to<T: Real>(&self, dx: f64, ids: &[u32], adj: &mut [T], poses_adj: &mut [PoseAdj]) {
        let mut add = |field: usize, slot: usize, values: &[f64]| {
            for (k, v) in values.iter().enumerate() {
                adj[index(slot, field + k)] += T::from_f64(*v);
            }
        };
        for (slot, &id) in ids.iter().enumerate() {
            let id = id as usize;
            // An empty vector has no entry: zeros.
            self.positions.get(id).into_iter().for_each(|v| add(X, slot, &v.map(|d| d * dx)));
            self.velocities.get(id).into_iter().for_each(|v| add(V, slot, v));
            self.affine.get(id).into_iter().for_each(|v| add(C, slot, v));
            self.deformation.get(id).into_iter().for_each(|v| add(F, slot, v));
        }
        for (total, pose) in poses_adj.iter_mut().zip(&self.poses) {
            total.add(pose);
        }
    }
}
