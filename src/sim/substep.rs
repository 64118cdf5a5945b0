//! One substep, forward and backward: the list of its operations.
//!
//! A packed state and the tools' poses at both ends come in, the next state goes out; the adjoint is the
//! same list upside down. Work is split over the layout's parts, whose number does not depend on the
//! threads, and sums are taken in the order of the parts: so results do not depend on them either.
//!
//! Threads meet where the grid is summed and where its velocities are read, twice a substep: G2P and the next substep's
//! P2G need of a particle only itself and follow one another part by part, while the part is in the cache.
//!
//! ```text
//! P2G_0 | grid_0 | G2P_0, P2G_1 | grid_1 | G2P_1, P2G_2 | .. | grid_N-1 | G2P_N-1
//! ```

use std::ops::Range;

use rayon::prelude::*;

use super::block::AXES;
use super::contact::{Contact, ContactAdj, contacts};
use super::error::{Operation, SimError};
use super::g2p::{GridToParticles, GridToParticlesAdj};
use super::grid::GridUpdate;
use super::lanes::{Kernel, LANES, Real, SimdLevel};
use super::layout::{Layout, Part};
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
    /// Whether it was the following substep's P2G.
    ahead: bool,
}

impl Fault {
    /// Names the particle and its substep, if it was substep `t` that ran.
    pub fn locate(self, t: usize, substeps: usize, ids: &[u32]) -> SimError {
        let t = t + usize::from(self.ahead);
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

/// Where a part's particles stand in a packed state.
fn packed(part: &Part) -> Range<usize> {
    part.blocks.start * BLOCK..part.blocks.end * BLOCK
}

/// What P2G of one part writes to.
struct ScatterJob<'a, T> {
    part: &'a Part,
    next: &'a mut [T],
    axes: &'a mut [T],
    grid: &'a mut Vec<T>,
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

/// The shares that are still to be summed: none if there is but one, which is the `sum` and is exchanged for it.
fn unsummed<'a, T>(shares: &'a mut [Vec<T>], sum: &mut Vec<T>) -> &'a [Vec<T>] {
    match shares {
        [whole] => {
            std::mem::swap(whole, sum);
            &[]
        }
        shares => shares,
    }
}

/// Where P2G writes: the deformation at the substep's end, and the eigenvectors that the constitutive update found.
pub struct Deformed<'a, T> {
    pub next: &'a mut [T],
    pub axes: &'a mut [T],
}

impl Substep<'_> {
    /// P2G of the first substep on a layout, the start of a chain of [`Substep::run`]. Returns false, with nothing to be
    /// used, if a particle has left the layout.
    pub fn begin<T: Real>(
        &self,
        state: &[T],
        anchors: &[T],
        deformed: Deformed<'_, T>,
        workspace: &mut Workspace<T>,
    ) -> Result<bool, Fault> {
        workspace.fit(self.layout);
        let states = self.layout.parts.iter().map(|part| &state[packed(part)]);
        let items = states.zip(self.scatters(deformed, &mut workspace.shares)).collect();
        let outcomes = over_parts(self.parallel, items, |(state, job)| self.scatter(state, anchors, job));
        self.all_scattered(&outcomes, state, false)
    }

    /// Runs the substep from `state` to `next`, both measured from `anchors`, once its P2G has been done, and P2G of the
    /// substep after it, if there is one to be `ahead`; `momentum` and `velocity` receive the grid before and after its update.
    /// Returns false if a particle has left the layout, so that P2G of the substep after has to begin on another;
    /// `next` is right all the same.
    #[expect(clippy::too_many_arguments, reason = "one for each array that a substep reads or writes")]
    pub fn run<T: Real>(
        &self,
        state: &[T],
        anchors: &[T],
        next: &mut [T],
        momentum: &mut Vec<T>,
        velocity: &mut [T],
        ahead: Option<Deformed<'_, T>>,
        workspace: &mut Workspace<T>,
    ) -> Result<bool, Fault> {
        let contacts = contacts(self.params, self.tools, self.start, self.end);
        self.update_grid(&contacts, &mut workspace.shares, momentum, velocity);
        let velocity = &*velocity;
        let jobs: Vec<_> = match ahead {
            Some(deformed) => self.scatters(deformed, &mut workspace.shares).map(Some).collect(),
            None => self.layout.parts.iter().map(|_| None).collect(),
        };
        let pieces = cut(next, self.block_lengths());
        let items = self.layout.parts.iter().zip(pieces).zip(jobs).collect();
        let outcomes = over_parts(self.parallel, items, |((part, next), job)| {
            match self.gather(part, state, anchors, velocity, next) {
                Some(slot) => Err(Fault { operation: Operation::G2p, slot, finite: false, ahead: false }),
                None => Ok(job.map_or(Outcome::Done, |job| self.scatter(next, anchors, job))),
            }
        });
        let outcomes = outcomes.into_iter().collect::<Result<Vec<_>, _>>()?;
        self.all_scattered(&outcomes, next, true)
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

    /// What P2G of each part works on.
    fn scatters<'a, T: Real>(
        &'a self,
        deformed: Deformed<'a, T>,
        shares: &'a mut [Vec<T>],
    ) -> impl Iterator<Item = ScatterJob<'a, T>> {
        let next = cut(deformed.next, self.block_lengths());
        let axes = cut(deformed.axes, self.layout.parts.iter().map(|p| p.blocks.len() * AXES));
        let items = self.layout.parts.iter().zip(next).zip(axes).zip(shares);
        items.map(|(((part, next), axes), grid)| ScatterJob { part, next, axes, grid })
    }

    /// P2G of one part, whose packed particles are `state`.
    fn scatter<T: Real>(&self, state: &[T], anchors: &[T], job: ScatterJob<'_, T>) -> Outcome {
        let ScatterJob { part, next, axes, grid } = job;
        let (params, layout) = (self.params, self.layout);
        self.dispatch(ParticlesToGrid { params, layout, part, state, anchors, next, axes, grid })
    }

    /// G2P of one part; returns the first slot whose new position is not a number.
    fn gather<T: Real>(
        &self,
        part: &Part,
        state: &[T],
        anchors: &[T],
        velocity: &[T],
        next: &mut [T],
    ) -> Option<usize> {
        let (params, layout) = (self.params, self.layout);
        self.dispatch(GridToParticles { params, layout, part, state, anchors, velocity, next })
    }

    /// Whether every particle of `state` was scattered.
    fn all_scattered<T: Real>(&self, outcomes: &[Outcome], state: &[T], ahead: bool) -> Result<bool, Fault> {
        for outcome in outcomes {
            if let Outcome::BadDeformation { slot } = *outcome {
                let block = &state[slot / LANES * BLOCK..];
                let finite =
                    (0..BLOCK / LANES).all(|field| block[field * LANES + slot % LANES].to_f64().is_finite());
                return Err(Fault { operation: Operation::Constitutive, slot, finite, ahead });
            }
        }
        Ok(outcomes.iter().all(|o| *o == Outcome::Done))
    }

    fn update_grid<T: Real>(
        &self,
        contacts: &[Contact<'_>],
        shares: &mut [Vec<T>],
        momentum: &mut Vec<T>,
        velocity: &mut [T],
    ) {
        let shares = unsummed(shares, momentum);
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
    /// The adjoint of G2P of the last substep on a layout, the start of a chain of [`SubstepAdj::run`].
    pub fn begin(&self, adj: &mut [T], workspace: &mut Workspace<T>) {
        let s = &self.substep;
        workspace.fit(s.layout);
        let adj = cut(adj, s.block_lengths());
        let items = s.layout.parts.iter().zip(adj).zip(&mut workspace.shares).collect();
        over_parts(s.parallel, items, |((part, adj), grid_adj)| self.gather_adj(part, adj, grid_adj));
    }

    /// Turns the adjoint of the state at the end into that at the start, in place, once the adjoint of its G2P has been
    /// done, and does that of G2P of the substep `before`, if there is one on this layout. Returns the adjoints of the
    /// tools' poses at the start and at the end, as far as contact knows them.
    pub fn run(
        &self,
        adj: &mut [T],
        before: Option<&Self>,
        workspace: &mut Workspace<T>,
    ) -> (Vec<PoseAdj>, Vec<PoseAdj>) {
        let s = &self.substep;
        let contacts = contacts(s.params, s.tools, s.start, s.end);
        let Workspace { shares, momentum_adj } = workspace;
        let frames_adj = self.update_grid_adj(&contacts, shares, momentum_adj);
        let momentum_adj = &momentum_adj[..];
        let adj = cut(adj, s.block_lengths());
        let items = s.layout.parts.iter().zip(adj).zip(shares).collect();
        over_parts(s.parallel, items, |((part, adj), grid_adj)| {
            self.scatter_adj(part, momentum_adj, adj);
            if let Some(before) = before {
                before.gather_adj(part, adj, grid_adj);
            }
        });
        self.contacts_adj(&contacts, &frames_adj)
    }

    /// Adjoint of G2P of one part.
    fn gather_adj(&self, part: &Part, adj: &mut [T], grid_adj: &mut [T]) {
        let s = &self.substep;
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
    }

    /// Adjoint of P2G of one part.
    fn scatter_adj(&self, part: &Part, grid_adj: &[T], adj: &mut [T]) {
        let s = &self.substep;
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
    }

    fn update_grid_adj(
        &self,
        contacts: &[Contact<'_>],
        shares: &mut [Vec<T>],
        momentum_adj: &mut Vec<T>,
    ) -> Vec<ContactAdj> {
        let s = &self.substep;
        let shares = unsummed(shares, momentum_adj);
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
