//! The grid update: from momentum to velocity, with gravity, tools and walls, and its adjoint.
//!
//! The parts' shares of momentum and mass come in and are summed in a fixed order; velocities go out. All nodes
//! move freely first, in the particles' precision and many at once; those that a tool or a wall may touch are
//! then taken one by one, in f64. Imports contact, boundary and layout.
//!
//! ```text
//! v_i = boundary(contact(.. contact((m v)_i / m_i + dt g)))         contacts in the order of the tools
//! ```
//!
//! *The adjoint* goes back through walls and tools ([`boundary`], [`contact`](super::contact)) and ends with
//! `(m v)_i_adj = v_adj / m_i` and `m_i_adj = - v . v_adj / m_i`, v the velocity before gravity. Nodes without mass have
//! no velocity and no adjoint.

use std::ops::Range;

use nalgebra::Vector3;

use super::boundary;
use super::contact::{Contact, ContactAdj};
use super::lanes::{Kernel, LANES, Lanes, Real, SimdLevel};
use super::layout::{Layout, Pencil};
use super::params::Params;
use super::transfer::NODE;

/// Nodes lighter than this stay at rest.
const MASS_MIN: f64 = 1e-12;

/// What the update of a range of pencils needs to know.
pub struct GridUpdate<'a, T> {
    pub params: &'a Params,
    pub simd: SimdLevel,
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

/// Numbers for the components of each node of a row.
#[inline(always)]
fn each_node<L: Lanes>(v: [L::Real; NODE]) -> L {
    L::repeat4(&v)
}

/// The nodes' mass in all their components, and whether it is enough.
#[inline(always)]
fn mass<L: Lanes>(q: L) -> (L, L::Mask) {
    let t = L::Real::from_f64;
    let mass = (q * each_node([t(0.0), t(0.0), t(0.0), t(1.0)])).sum_components();
    (mass, mass.gt(L::constant(MASS_MIN)))
}

/// Momentum to velocity, and gravity: what happens at every node.
struct FreeMotion<'a, T> {
    /// Velocity gained in a substep.
    kick: [T; 3],
    momentum: &'a [T],
    velocity: &'a mut [T],
}

impl<T: Real> Kernel<T> for FreeMotion<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Real = T>>(self) {
        let (t, zero) = (T::from_f64, L::constant(0.0));
        let kick = each_node::<L>([self.kick[0], self.kick[1], self.kick[2], t(0.0)]);
        let moves = each_node::<L>([t(1.0), t(1.0), t(1.0), t(0.0)]).gt(zero);
        let (rows, rest) = self.momentum.as_chunks::<LANES>();
        let (out, out_rest) = self.velocity.as_chunks_mut::<LANES>();
        let mut last = [T::default(); LANES];
        last[..rest.len()].copy_from_slice(rest);
        let mut out_last = last;
        for (q, out) in rows.iter().chain([&last]).zip(out.iter_mut().chain([&mut out_last])) {
            let q = L::load(q);
            let (mass, enough) = mass(q);
            let v = q.mul_add(L::constant(1.0).div(mass), kick);
            L::select(L::and(enough, moves), v, zero).store(out);
        }
        out_rest.copy_from_slice(&out_last[..out_rest.len()]);
    }
}

/// Adjoint of [`FreeMotion`], in place.
struct FreeMotionAdj<'a, T> {
    momentum: &'a [T],
    /// In: the adjoint of the velocity, with anything as fourth component. Out: that of momentum and mass.
    adj: &'a mut [T],
}

impl<T: Real> Kernel<T> for FreeMotionAdj<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Real = T>>(self) {
        let (t, zero) = (T::from_f64, L::constant(0.0));
        let moves = each_node::<L>([t(1.0), t(1.0), t(1.0), t(0.0)]).gt(zero);
        let (rows, rest) = self.momentum.as_chunks::<LANES>();
        let (adj, adj_rest) = self.adj.as_chunks_mut::<LANES>();
        let (mut last, mut adj_last) = ([T::default(); LANES], [T::default(); LANES]);
        last[..rest.len()].copy_from_slice(rest);
        adj_last[..rest.len()].copy_from_slice(adj_rest);
        for (q, adj) in rows.iter().chain([&last]).zip(adj.iter_mut().chain([&mut adj_last])) {
            let q = L::load(q);
            let (mass, enough) = mass(q);
            let inverse = L::constant(1.0).div(mass);
            let q_adj = L::select(moves, L::load(adj) * inverse, zero);
            let mass_adj = -(q_adj * q * inverse).sum_components();
            L::select(enough, L::select(moves, q_adj, mass_adj), zero).store(adj);
        }
        adj_rest.copy_from_slice(&adj_last[..adj_rest.len()]);
    }
}

impl<T: Real> GridUpdate<'_, T> {
    /// Sums the shares into `momentum` and writes the velocities after forces, tools and walls into
    /// `velocity`; both hold the pencils' nodes, four components each.
    pub fn run(&self, momentum: &mut [T], velocity: &mut [T]) {
        let origin = self.layout.nodes_of(&self.pencils).start;
        self.sum_shares(origin, momentum);
        T::dispatch(self.simd, FreeMotion { kick: self.kick(), momentum, velocity });
        self.at_obstacles(origin, momentum, |node, near, at| {
            let v: &mut [T] = &mut velocity[at..at + 3];
            let free = Vector3::from_fn(|c, _| v[c].to_f64());
            let touched = self.touch(node, near, free, |_, _| {});
            let out = boundary::apply(self.params, node, touched.into());
            v.copy_from_slice(&out.map(T::from_f64));
        });
    }

    /// Adjoint of [`GridUpdate::run`]: sums the shares of the velocities' adjoint and writes the adjoint
    /// of momentum and mass into `momentum_adj`; returns the adjoint of each contact's frames.
    pub fn run_adj(&self, momentum: &[T], momentum_adj: &mut [T]) -> Vec<ContactAdj> {
        let mut frames_adj = vec![ContactAdj::default(); self.contacts.len()];
        let origin = self.layout.nodes_of(&self.pencils).start;
        self.sum_shares(origin, momentum_adj);
        let kick = self.kick();
        let mut before = Vec::new();
        self.at_obstacles(origin, momentum, |node, near, at| {
            let q = &momentum[at..at + NODE];
            let inverse = T::from_f64(1.0) / q[3];
            let v = Vector3::from_fn(|c, _| (q[c] * inverse + kick[c]).to_f64());
            before.clear();
            let touched = self.touch(node, near, v, |i, v| before.push((i, v)));
            let v_adj: &mut [T] = &mut momentum_adj[at..at + 3];
            let out_adj = std::array::from_fn(|c| v_adj[c].to_f64());
            let mut adj = Vector3::from(boundary::apply_adj(self.params, node, touched.into(), out_adj));
            let p = Vector3::from(self.position(node));
            for &(i, v) in before.iter().rev() {
                adj = self.contacts[i].apply_adj(p, v, adj, &mut frames_adj[i]);
            }
            for c in 0..3 {
                v_adj[c] = T::from_f64(adj[c]);
            }
        });
        T::dispatch(self.simd, FreeMotionAdj { momentum, adj: momentum_adj });
        frames_adj
    }

    /// Calls `work` for every node with mass that a tool or a wall may touch: with its indices, the contacts
    /// near it and where its components stand.
    fn at_obstacles(
        &self,
        origin: usize,
        momentum: &[T],
        mut work: impl FnMut([usize; 3], ContactBits, usize),
    ) {
        for pencil in &self.layout.pencils[self.pencils.clone()] {
            let near = self.contacts_near(pencil);
            let node = |k: usize| [pencil.i as usize, pencil.j as usize, pencil.k as usize + k];
            let at_wall = |k: usize| boundary::is_near_wall(self.params.nodes, node(k));
            let last = pencil.len as usize - 1;
            if near == 0 && !at_wall(0) && !at_wall(last) {
                continue;
            }
            for k in 0..=last {
                let at = (pencil.start as usize - origin + k) * NODE;
                if momentum[at + 3].to_f64() > MASS_MIN && (near != 0 || at_wall(k)) {
                    work(node(k), near, at);
                }
            }
        }
    }

    /// Adds, part by part, what the parts hold of these pencils' nodes.
    fn sum_shares(&self, origin: usize, sum: &mut [T]) {
        sum.fill(T::default());
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

    /// The velocity after the tools in turn; `each` is told every tool and the velocity before it.
    fn touch(
        &self,
        node: [usize; 3],
        near: ContactBits,
        mut v: Vector3<f64>,
        mut each: impl FnMut(usize, Vector3<f64>),
    ) -> Vector3<f64> {
        if near == 0 {
            return v;
        }
        let p = Vector3::from(self.position(node));
        for (i, contact) in self.contacts.iter().enumerate() {
            if near & 1 << i != 0 && contact.is_near(p.into()) {
                each(i, v);
                v = contact.apply(p, v);
            }
        }
        v
    }
}
