//! The grid update: from momentum to velocity, with gravity, tools and walls, and its adjoint.
//!
//! The parts' shares of momentum and mass come in and are summed in a fixed order; velocities go out. Nodes
//! that neither a tool nor a wall can touch stay in the particles' precision, the others are handled in
//! f64. Imports contact, boundary and layout.

use std::ops::Range;

use nalgebra::Vector3;

use super::boundary;
use super::contact::{Contact, ContactAdj};
use super::lanes::Real;
use super::layout::{Layout, Pencil};
use super::params::Params;
use super::transfer::NODE;

/// Nodes lighter than this stay at rest.
const MASS_MIN: f64 = 1e-12;

/// What the update of a range of pencils needs to know.
pub struct GridUpdate<'a, T> {
    pub params: &'a Params,
    pub layout: &'a Layout,
    /// The parts' shares: for each part its nodes' four components.
    pub shares: &'a [Vec<T>],
    pub contacts: &'a [Contact<'a>],
    /// The pencils to update.
    pub pencils: Range<usize>,
}

/// Which contacts may touch a pencil, as bits.
type ContactBits = u64;

/// Most parts that all tools of a world may have together: one bit each.
pub const PARTS_MAX: usize = ContactBits::BITS as usize;

impl<T: Real> GridUpdate<'_, T> {
    /// Sums the shares into `momentum` and writes the velocities after forces, tools and walls into
    /// `velocity`; both hold the pencils' nodes, four components each.
    pub fn run(&self, momentum: &mut [T], velocity: &mut [T]) {
        momentum.fill(T::default());
        velocity.fill(T::default());
        let origin = self.layout.nodes_of(&self.pencils).start;
        self.sum_shares(origin, momentum);
        let kick = self.kick();
        for pencil in &self.layout.pencils[self.pencils.clone()] {
            let near = self.contacts_near(pencil);
            for k in 0..pencil.len as usize {
                let at = (pencil.start as usize - origin + k) * NODE;
                let q = &momentum[at..at + NODE];
                if q[3].to_f64() <= MASS_MIN {
                    continue;
                }
                let inverse = T::from_f64(1.0) / q[3];
                let v: [T; 3] = std::array::from_fn(|c| q[c] * inverse + kick[c]);
                let node = [pencil.i as usize, pencil.j as usize, pencil.k as usize + k];
                let out = if near == 0 && !boundary::is_near_wall(self.params.nodes, node) {
                    v
                } else {
                    let touched = self.touch(node, near, v.map(T::to_f64)).0;
                    boundary::apply(self.params, node, touched).map(T::from_f64)
                };
                velocity[at..at + 3].copy_from_slice(&out);
            }
        }
    }

    /// Adjoint of [`GridUpdate::run`]: sums the shares of the velocities' adjoint and writes the adjoint
    /// of momentum and mass into `momentum_adj`; returns the adjoint of each contact's frames.
    pub fn run_adj(&self, momentum: &[T], momentum_adj: &mut [T]) -> Vec<ContactAdj> {
        let mut frames_adj = vec![ContactAdj::default(); self.contacts.len()];
        momentum_adj.fill(T::default());
        let origin = self.layout.nodes_of(&self.pencils).start;
        self.sum_shares(origin, momentum_adj);
        let kick = self.kick();
        for pencil in &self.layout.pencils[self.pencils.clone()] {
            let near = self.contacts_near(pencil);
            for k in 0..pencil.len as usize {
                let at = (pencil.start as usize - origin + k) * NODE;
                let q = &momentum[at..at + NODE];
                let out: &mut [T] = &mut momentum_adj[at..at + NODE];
                if q[3].to_f64() <= MASS_MIN {
                    out.fill(T::default());
                    continue;
                }
                let inverse = T::from_f64(1.0) / q[3];
                let node = [pencil.i as usize, pencil.j as usize, pencil.k as usize + k];
                let mut v_adj = [out[0], out[1], out[2]];
                if near != 0 || boundary::is_near_wall(self.params.nodes, node) {
                    let v = std::array::from_fn(|c| (q[c] * inverse + kick[c]).to_f64());
                    let wide = v_adj.map(T::to_f64);
                    v_adj = self.node_adj(node, near, v, wide, &mut frames_adj).map(T::from_f64);
                }
                let mut mass_adj = T::default();
                for c in 0..3 {
                    out[c] = v_adj[c] * inverse;
                    mass_adj -= out[c] * q[c] * inverse;
                }
                out[3] = mass_adj;
            }
        }
        frames_adj
    }

    /// Adds, part by part, what the parts hold of these pencils' nodes.
    fn sum_shares(&self, origin: usize, sum: &mut [T]) {
        let nodes = origin..origin + sum.len() / NODE;
        for (part, share) in self.layout.parts.iter().zip(self.shares) {
            let (lo, hi) = (part.nodes.start.max(nodes.start), part.nodes.end.min(nodes.end));
            if lo >= hi {
                continue;
            }
            let from = &share[(lo - part.nodes.start) * NODE..(hi - part.nodes.start) * NODE];
            let to = &mut sum[(lo - nodes.start) * NODE..(hi - nodes.start) * NODE];
            for (to, from) in to.iter_mut().zip(from) {
                *to += *from;
            }
        }
    }

    /// Velocity gained from gravity in one substep.
    fn kick(&self) -> [T; 3] {
        self.params.gravity.map(|g| T::from_f64(g * self.params.dt))
    }

    fn position(&self, node: [usize; 3]) -> [f64; 3] {
        node.map(|k| k as f64 * self.params.dx())
    }

    /// The contacts whose box a pencil meets.
    fn contacts_near(&self, pencil: &Pencil) -> ContactBits {
        let last = pencil.k + pencil.len - 1;
        let ends = [pencil.k, last].map(|k| self.position([pencil.i.into(), pencil.j.into(), k.into()]));
        self.contacts
            .iter()
            .enumerate()
            .filter(|(_, contact)| contact.meets(ends[0], ends[1]))
            .fold(0, |bits, (i, _)| bits | 1 << i)
    }

    /// The velocity after the tools in turn, and before each of them.
    fn touch(
        &self,
        node: [usize; 3],
        near: ContactBits,
        v: [f64; 3],
    ) -> ([f64; 3], Vec<(usize, Vector3<f64>)>) {
        let mut v = Vector3::from(v);
        let mut before = Vec::new();
        if near != 0 {
            let p = Vector3::from(self.position(node));
            for (i, contact) in self.contacts.iter().enumerate() {
                if near & 1 << i != 0 && contact.is_near(p.into()) {
                    before.push((i, v));
                    v = contact.apply(p, v);
                }
            }
        }
        (v.into(), before)
    }

    /// Adjoint of tools and walls at one node.
    fn node_adj(
        &self,
        node: [usize; 3],
        near: ContactBits,
        v: [f64; 3],
        out_adj: [f64; 3],
        frames_adj: &mut [ContactAdj],
    ) -> [f64; 3] {
        let (touched, before) = self.touch(node, near, v);
        let mut adj = Vector3::from(boundary::apply_adj(self.params, node, touched, out_adj));
        let p = Vector3::from(self.position(node));
        for (i, v) in before.into_iter().rev() {
            adj = self.contacts[i].apply_adj(p, v, adj, &mut frames_adj[i]);
        }
        adj.into()
    }
}
