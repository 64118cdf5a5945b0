//! The stretch of substeps that share one layout, and what is kept of it for the backward pass.
//!
//! A rollout is a list of epochs: one for each control step, and more where a particle outruns its layout.
//! An epoch keeps the packed state at every substep, the eigenvectors of each particle's deformation, and the
//! grid's momentum and velocity; or, when memory is short, only the state at its start, from which the backward pass runs it again. Imports layout and
//! particles.
//!
//! # How memory grows
//!
//! With n particles on a layout of m nodes, a kept substep takes `30 n + 8 m` numbers: x, v, C, F and eigenvectors of
//! each particle, momentum, mass and velocity of each node. In f32 with 5000 particles in one ball (m about 3600)
//! that is 0.7 MB a substep, 15 MB a control step of 20, and 0.59 GB a horizon of 40: the peak of `donut bench
//! --case A`, all included, is 559 MiB. It grows in proportion to control steps, substeps, and particles (m follows
//! the volume that dough occupies, not n), and doubles in f64.
//!
//! It stops growing at [`memory_limit`](super::Options): control steps beyond it keep 24 n numbers each (0.5 MB
//! in the example) and are run a second time in the backward pass, which makes a gradient about a third slower.
//! The bits of the result are the same.

use super::block::AXES;
use super::lanes::Real;
use super::layout::Layout;
use super::particles::{BLOCK, Packed, blocks_for};
use super::transfer::NODE;

/// States that a substep reads or writes: its own, the next, and the deformation of the one after that.
pub const RUNNING: usize = 3;

/// Everything the backward pass needs of an epoch's substeps. Reused from rollout to rollout, so that the
/// steady state does not allocate.
#[derive(Clone, Debug, Default)]
pub struct Trace<T> {
    /// Packed states, one more than substeps, but [`RUNNING`] at least.
    pub states: Vec<Vec<T>>,
    /// Eigenvectors of each particle's trial deformation, [`AXES`] numbers a block.
    pub axes: Vec<Vec<T>>,
    /// Momentum and mass of the nodes at each substep.
    pub momentum: Vec<Vec<T>>,
    /// Velocity of the nodes at each substep.
    pub velocity: Vec<Vec<T>>,
}

impl<T: Real> Trace<T> {
    /// Makes room for `substeps` substeps of `particles` particles on a grid of `nodes` nodes.
    pub fn resize(&mut self, substeps: usize, particles: usize, nodes: usize) {
        let fit = |arrays: &mut Vec<Vec<T>>, count: usize, len: usize| {
            if arrays.len() < count {
                arrays.resize_with(count, Vec::new);
            }
            for array in &mut arrays[..count] {
                array.resize(len, T::default());
            }
        };
        fit(&mut self.states, RUNNING.max(substeps + 1), blocks_for(particles) * BLOCK);
        fit(&mut self.axes, substeps, blocks_for(particles) * AXES);
        fit(&mut self.momentum, substeps, nodes * NODE);
        fit(&mut self.velocity, substeps, nodes * NODE);
    }

    /// Bytes that [`Trace::resize`] asks for.
    pub fn bytes(substeps: usize, particles: usize, nodes: usize) -> usize {
        let state = blocks_for(particles) * (BLOCK * (substeps + 1) + AXES * substeps);
        (state + 2 * nodes * NODE * substeps) * size_of::<T>()
    }
}

/// A stretch of substeps on one layout.
#[derive(Clone, Debug, Default)]
pub struct Epoch<T> {
    /// First substep, counted over the rollout.
    pub first: usize,
    /// Substeps that were done on this layout.
    pub count: usize,
    pub layout: Layout,
    /// For each slot, the particle's index in the caller's order.
    pub ids: Vec<u32>,
    /// For each slot, its slot at the end of the epoch before (for the first: the caller's order).
    pub from_slot: Vec<u32>,
    /// The packed state at the start, with the anchors of all its substeps.
    pub start: Packed<T>,
    /// The substeps, if they were kept.
    pub trace: Trace<T>,
    /// Whether they were.
    pub kept: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_horizon_of_5000_particles_in_single_precision_takes_less_than_600_megabytes() {
        let nodes = 3600;
        let bytes = 40 * Trace::<f32>::bytes(20, 5000, nodes);
        assert!((400_000_000..600_000_000).contains(&bytes), "{bytes}");
        assert_eq!(Trace::<f64>::bytes(20, 5000, nodes), bytes / 20);
    }
}
