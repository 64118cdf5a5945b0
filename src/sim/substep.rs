//! One substep, forward and backward: the list of its operations.
//!
//! A packed state and the tools' poses at both ends come in, the next state goes out; the adjoint is the
//! same list upside down. Work is split over the layout's parts, whose number does not depend on the
//! threads, and sums are taken in the order of the parts: so results do not depend on them either.

use rayon::prelude::*;

use super::block::AXES;
use super::contact::{Contact, ContactAdj, contacts};
use super::error::{Operation, SimError};
use super::g2p::{GridToParticles, GridToParticlesAdj};
use super::grid::GridUpdate;
use super::lanes::{Kernel, Real, SimdLevel};
use super::layout::Layout;
use super::p2g::{Outcome, ParticlesToGrid, ParticlesToGridAdj};
use super::params::Params;
use super::particles::BLOCK;
use super::tool::{PoseAdj, Tool, ToolPose};
use super::transfer::NODE;

/// Buffers that a substep needs for its duration.
#[derive(Clone, Debug, Default)]
pub struct Workspace<T> {
    /// The parts' shares of the grid.
    shares: Vec<Vec<T>>,
    /// Adjoint of momentum and mass of all nodes.
    momentum_adj: Vec<T>,
}

impl<T: Real> Workspace<T> {
    fn fit(&mut self, layout: &Layout) {
        self.shares.resize_with(layout.parts.len(), Vec::new);
        for (share, part) in self.shares.iter_mut().zip(&layout.parts) {
            share.resize(part.nodes.len() * NODE, T::default());
        }
        self.momentum_adj.resize(layout.len * NODE, T::default());
    }
}

/// What broke, before it is known when and which particle of the caller's.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    operation: Operation,
    slot: usize,
    finite: bool,
}

impl Fault {
    /// Names substep and particle.
    pub fn locate(self, t: usize, substeps: usize, ids: &[u32]) -> SimError {
        let (step, substep, particle) = (t / substeps, t % substeps, ids[self.slot] as usize);
        if self.finite {
            SimError::Inverted { step, substep, particle }
        } else {
            SimError::NonFinite { operation: self.operation, step, substep, particle }
        }
    }
}

/// Everything that does not change during a substep.
pub struct Substep<'a> {
    pub params: &'a Params,
    pub simd: SimdLevel,
    pub parallel: bool,
    pub tools: &'a [Tool],
    pub layout: &'a Layout,
    /// The tools' poses at the substep's start and end.
    pub start: &'a [ToolPose],
    pub end: &'a [ToolPose],
}

/// Maps over the parts in parallel or in turn; the results come in the order of the parts either way.
fn over_parts<I: Send, R: Send>(
    parallel: bool,
    items: Vec<I>,
    work: impl Fn(I) -> R + Sync + Send,
) -> Vec<R> {
    if parallel && items.len() > 1 {
        items.into_par_iter().with_max_len(1).map(work).collect()
    } else {
        items.into_iter().map(work).collect()
    }
}

/// Cuts a slice into consecutive pieces of the given lengths.
fn cut<T>(mut slice: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    lengths
        .map(|len| {
            let (piece, rest) = std::mem::take(&mut slice).split_at_mut(len);
            slice = rest;
            piece
        })
        .collect()
}

impl Substep<'_> {
    /// Runs the substep from `state` to `next`, both measured from `anchors`; `axes` receives the eigenvectors that
    /// the constitutive update found, `momentum` and `velocity` the grid before and after its update. Returns
    /// false, with nothing to be used, if a particle has left the layout.
    #[expect(clippy::too_many_arguments, reason = "one for each array that a substep reads or writes")]
    pub fn run<T: Real>(
        &self,
        state: &[T],
        anchors: &[T],
        next: &mut [T],
        axes: &mut [T],
        momentum: &mut [T],
        velocity: &mut [T],
        workspace: &mut Workspace<T>,
    ) -> Result<bool, Fault> {
        workspace.fit(self.layout);
        let contacts = contacts(self.params, self.tools, self.start, self.end);
        if !self.particles_to_grid(state, anchors, next, axes, &mut workspace.shares)? {
            return Ok(false);
        }
        self.update_grid(&contacts, &workspace.shares, momentum, velocity);
        self.grid_to_particles(state, anchors, velocity, next)?;
        Ok(true)
    }

    /// Packed numbers of each part's particles.
    fn block_lengths(&self) -> impl Iterator<Item = usize> {
        self.layout.parts.iter().map(|p| p.blocks.len() * BLOCK)
    }

    /// Grid numbers of each range of pencils.
    fn pencil_lengths(&self) -> impl Iterator<Item = usize> {
        self.layout.pencil_parts.iter().map(|p| self.layout.nodes_of(p).len() * NODE)
    }

    fn dispatch<T: Real, K: Kernel<T>>(&self, kernel: K) -> K::Output {
        T::dispatch(self.simd, kernel)
    }

    fn particles_to_grid<T: Real>(
        &self,
        state: &[T],
        anchors: &[T],
        next: &mut [T],
        axes: &mut [T],
        shares: &mut [Vec<T>],
    ) -> Result<bool, Fault> {
        let next = cut(next, self.block_lengths());
        let axes = cut(axes, self.layout.parts.iter().map(|p| p.blocks.len() * AXES));
        let items = self.layout.parts.iter().zip(next).zip(axes).zip(shares).collect();
        let outcomes = over_parts(self.parallel, items, |(((part, next), axes), grid)| {
            self.dispatch(ParticlesToGrid {
                params: self.params,
                layout: self.layout,
                part,
                state,
                anchors,
                next,
                axes,
                grid,
            })
        });
        for outcome in &outcomes {
            if let Outcome::BadDeformation { slot } = *outcome {
                let block = &state[slot / super::lanes::LANES * BLOCK..];
                let lane = slot % super::lanes::LANES;
                let finite = (0..BLOCK / super::lanes::LANES)
                    .all(|field| block[field * super::lanes::LANES + lane].to_f64().is_finite());
                return Err(Fault { operation: Operation::Constitutive, slot, finite });
            }
        }
        Ok(outcomes.iter().all(|o| *o == Outcome::Done))
    }

    fn update_grid<T: Real>(
        &self,
        contacts: &[Contact<'_>],
        shares: &[Vec<T>],
        momentum: &mut [T],
        velocity: &mut [T],
    ) {
        let momentum = cut(momentum, self.pencil_lengths());
        let velocity = cut(velocity, self.pencil_lengths());
        let items = self.layout.pencil_parts.iter().zip(momentum).zip(velocity).collect();
        over_parts(self.parallel, items, |((pencils, momentum), velocity)| {
            let pencils = pencils.clone();
            GridUpdate {
                params: self.params,
                simd: self.simd,
                layout: self.layout,
                shares,
                contacts,
                pencils,
            }
            .run(momentum, velocity);
        });
    }

    fn grid_to_particles<T: Real>(
        &self,
        state: &[T],
        anchors: &[T],
        velocity: &[T],
        next: &mut [T],
    ) -> Result<(), Fault> {
        let next = cut(next, self.block_lengths());
        let items = self.layout.parts.iter().zip(next).collect();
        let bad = over_parts(self.parallel, items, |(part, next)| {
            self.dispatch(GridToParticles {
                params: self.params,
                layout: self.layout,
                part,
                state,
                anchors,
                velocity,
                next,
            })
        });
        match bad.into_iter().flatten().next() {
            Some(slot) => Err(Fault { operation: Operation::G2p, slot, finite: false }),
            None => Ok(()),
        }
    }
}

/// The backward pass of one substep.
pub struct SubstepAdj<'a, T> {
    pub substep: Substep<'a>,
    /// Packed states at its start and end, their anchors, the axes, and the grid before and after its update.
    pub state: &'a [T],
    pub next: &'a [T],
    pub anchors: &'a [T],
    pub axes: &'a [T],
    pub momentum: &'a [T],
    pub velocity: &'a [T],
}

impl<T: Real> SubstepAdj<'_, T> {
    /// Turns the adjoint of the state at the end into that at the start, in place; returns the adjoints
    /// of the tools' poses at the start and at the end, as far as contact knows them.
    pub fn run(&self, adj: &mut [T], workspace: &mut Workspace<T>) -> (Vec<PoseAdj>, Vec<PoseAdj>) {
        let s = &self.substep;
        workspace.fit(s.layout);
        let contacts = contacts(s.params, s.tools, s.start, s.end);
        self.grid_to_particles_adj(adj, &mut workspace.shares);
        let frames_adj = self.update_grid_adj(&contacts, &workspace.shares, &mut workspace.momentum_adj);
        self.particles_to_grid_adj(&workspace.momentum_adj, adj);
        self.contacts_adj(&contacts, &frames_adj)
    }

    fn grid_to_particles_adj(&self, adj: &mut [T], shares: &mut [Vec<T>]) {
        let s = &self.substep;
        let adj = cut(adj, s.block_lengths());
        let items = s.layout.parts.iter().zip(adj).zip(shares).collect();
        over_parts(s.parallel, items, |((part, adj), grid_adj)| {
            s.dispatch(GridToParticlesAdj {
                params: s.params,
                layout: s.layout,
                part,
                state: self.state,
                next: self.next,
                anchors: self.anchors,
                velocity: self.velocity,
                adj,
                grid_adj,
            });
        });
    }

    fn update_grid_adj(
        &self,
        contacts: &[Contact<'_>],
        shares: &[Vec<T>],
        momentum_adj: &mut [T],
    ) -> Vec<ContactAdj> {
        let s = &self.substep;
        let out = cut(momentum_adj, s.pencil_lengths());
        let items = s.layout.pencil_parts.iter().zip(out).collect();
        let partial = over_parts(s.parallel, items, |(pencils, out)| {
            let nodes = s.layout.nodes_of(pencils);
            let momentum = &self.momentum[nodes.start * NODE..nodes.end * NODE];
            let pencils = pencils.clone();
            GridUpdate { params: s.params, simd: s.simd, layout: s.layout, shares, contacts, pencils }
                .run_adj(momentum, out)
        });
        let mut total = vec![ContactAdj::default(); contacts.len()];
        for part in partial {
            for (sum, one) in total.iter_mut().zip(&part) {
                sum.add(one);
            }
        }
        total
    }

    fn particles_to_grid_adj(&self, grid_adj: &[T], adj: &mut [T]) {
        let s = &self.substep;
        let adj = cut(adj, s.block_lengths());
        let items = s.layout.parts.iter().zip(adj).collect();
        over_parts(s.parallel, items, |(part, adj)| {
            s.dispatch(ParticlesToGridAdj {
                params: s.params,
                layout: s.layout,
                part,
                state: self.state,
                anchors: self.anchors,
                axes: self.axes,
                grid_adj,
                adj,
            });
        });
    }

    fn contacts_adj(
        &self,
        contacts: &[Contact<'_>],
        frames_adj: &[ContactAdj],
    ) -> (Vec<PoseAdj>, Vec<PoseAdj>) {
        let s = &self.substep;
        let mut start_adj = vec![PoseAdj::default(); s.tools.len()];
        let mut end_adj = start_adj.clone();
        for (contact, frames) in contacts.iter().zip(frames_adj) {
            let i = contact.tool_index;
            contact.poses_adj(frames, &s.start[i], &s.end[i], &mut start_adj[i], &mut end_adj[i]);
        }
        (start_adj, end_adj)
    }
}
