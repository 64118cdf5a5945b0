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
use super::contact::{Contact, ContactAdj, Touch};
use super::lanes::{Kernel, LANES, Lanes, Real, SimdLevel};
use super::layout::Layout;
use super::params::Params;
use super::transfer::NODE;

/// Nodes lighter than this stay at rest.
const MASS_MIN: f64 = 1e-12;

/// What the update of a range of pencils needs to know.
pub struct GridUpdate<'a, T> {
    pub params: &'a Params,
    pub simd: SimdLevel,
    pub layout: &'a Layout,
    /// The parts' shares: for each part its nodes' four components. None if they are summed already.
    pub shares: &'a [Vec<T>],
    pub contacts: &'a [Contact<'a>],
    /// The pencils to update.
    pub pencils: Range<usize>,
}

/// A contact that may touch nodes of a pencil.
struct Near {
    /// Index of the contact.
    contact: usize,
    /// k of the nodes that it may touch, as far as that is known.
    nodes: Range<usize>,
}

/// A node that a tool or a wall may touch.
struct Site {
    node: [usize; 3],
    /// Where its components stand.
    at: usize,
    at_wall: bool,
}

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
            // Much of the grid is margin around the dough.
            if L::bits(enough) == 0 {
                zero.store(out);
                continue;
            }
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
            if L::bits(enough) == 0 {
                zero.store(adj);
                continue;
            }
            let inverse = L::constant(1.0).div(mass);
            let q_adj = L::select(moves, L::load(adj) * inverse, zero);
            let mass_adj = -(q_adj * q * inverse).sum_components();
            L::select(enough, L::select(moves, q_adj, mass_adj), zero).store(adj);
        }
        adj_rest.copy_from_slice(&adj_last[..adj_rest.len()]);
    }
}

impl<T: Real> GridUpdate<'_, T> {
    /// Sums the shares, if there are any, into `momentum` and writes the velocities after forces, tools and walls into
    /// `velocity`; both hold the pencils' nodes, four components each.
    pub fn run(&self, momentum: &mut [T], velocity: &mut [T]) {
        let origin = self.layout.nodes_of(&self.pencils).start;
        self.sum_shares(origin, momentum);
        T::dispatch(self.simd, FreeMotion { kick: self.kick(), momentum, velocity });
        self.at_obstacles(origin, momentum, |site, near| {
            let v: &mut [T] = &mut velocity[site.at..site.at + 3];
            let free = Vector3::from_fn(|c, _| v[c].to_f64());
            let mut out = self.touch(site, near, free, |_, _| {}).into();
            if site.at_wall {
                out = boundary::apply(self.params, site.node, out);
            }
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
        let mut touches = Vec::new();
        self.at_obstacles(origin, momentum, |site, near| {
            let q = &momentum[site.at..site.at + NODE];
            let inverse = T::from_f64(1.0) / q[3];
            let v = Vector3::from_fn(|c, _| (q[c] * inverse + kick[c]).to_f64());
            touches.clear();
            let touched = self.touch(site, near, v, |i, touch| touches.push((i, touch)));
            let v_adj: &mut [T] = &mut momentum_adj[site.at..site.at + 3];
            let mut adj = std::array::from_fn(|c| v_adj[c].to_f64());
            if site.at_wall {
                adj = boundary::apply_adj(self.params, site.node, touched.into(), adj);
            }
            for (i, touch) in touches.iter().rev() {
                adj = self.contacts[*i].touch_adj(touch, adj.into(), &mut frames_adj[*i]).into();
            }
            v_adj.copy_from_slice(&adj.map(T::from_f64));
        });
        T::dispatch(self.simd, FreeMotionAdj { momentum, adj: momentum_adj });
        frames_adj
    }

    /// Calls `work` for every node with mass that a tool or a wall may touch, with the contacts near its pencil.
    fn at_obstacles(&self, origin: usize, momentum: &[T], mut work: impl FnMut(&Site, &mut [Near])) {
        let mut near = Vec::new();
        for pencil in &self.layout.pencils[self.pencils.clone()] {
            let (i, j, first) = (pencil.i as usize, pencil.j as usize, pencil.k as usize);
            let nodes = first..first + pencil.len as usize;
            self.contacts_near(i, j, &nodes, &mut near);
            let at_wall = |k: usize| boundary::is_near_wall(self.params.nodes, [i, j, k]);
            if near.is_empty() && !at_wall(nodes.start) && !at_wall(nodes.end - 1) {
                continue;
            }
            for k in nodes {
                let at_wall = at_wall(k);
                if !at_wall && !near.iter().any(|near| near.nodes.contains(&k)) {
                    continue;
                }
                let at = (pencil.start as usize - origin + k - first) * NODE;
                if momentum[at + 3].to_f64() > MASS_MIN {
                    work(&Site { node: [i, j, k], at, at_wall }, &mut near);
                }
            }
        }
    }

    /// Adds up, part by part, what the parts hold of these pencils' nodes.
    fn sum_shares(&self, origin: usize, sum: &mut [T]) {
        if self.shares.is_empty() {
            return;
        }
        let nodes = origin..origin + sum.len() / NODE;
        // Numbers up to here are written: parts follow one another, and each has nodes in common with the next.
        let mut written = 0;
        for (part, share) in self.layout.parts.iter().zip(self.shares) {
            let (lo, hi) = (part.nodes.start.max(nodes.start), part.nodes.end.min(nodes.end));
            if lo >= hi {
                continue;
            }
            let from = &share[(lo - part.nodes.start) * NODE..(hi - part.nodes.start) * NODE];
            let (start, end) = ((lo - nodes.start) * NODE, (hi - nodes.start) * NODE);
            if start > written {
                sum[written..start].fill(T::default());
                written = start;
            }
            let (common, new) = from.split_at(written.min(end) - start);
            for (to, from) in sum[start..].iter_mut().zip(common) {
                *to += *from;
            }
            sum[end - new.len()..end].copy_from_slice(new);
            written = written.max(end);
        }
        sum[written..].fill(T::default());
    }

    /// Velocity gained from gravity in one substep.
    fn kick(&self) -> [T; 3] {
        self.params.gravity.map(|g| T::from_f64(g * self.params.dt))
    }

    fn position(&self, node: [usize; 3]) -> [f64; 3] {
        node.map(|k| k as f64 * self.params.dx())
    }

    /// Lists the contacts that may touch the nodes (i, j, k), for k of a pencil, in `near`.
    fn contacts_near(&self, i: usize, j: usize, pencil: &Range<usize>, near: &mut Vec<Near>) {
        let all = self.contacts.iter().enumerate();
        let each = all.map(|(contact, c)| Near { contact, nodes: c.reachable(i, j, pencil) });
        near.clear();
        near.extend(each.filter(|near| !near.nodes.is_empty()));
    }

    /// The velocity of a node after the tools in turn; `each` is told every contact that touches it, and how.
    #[inline(always)]
    fn touch(
        &self,
        site: &Site,
        near: &mut [Near],
        mut v: Vector3<f64>,
        mut each: impl FnMut(usize, Touch),
    ) -> Vector3<f64> {
        let p = Vector3::from(self.position(site.node));
        for Near { contact: i, nodes } in near {
            let k = site.node[2];
            if !nodes.contains(&k) {
                continue;
            }
            let contact = &self.contacts[*i];
            let place = contact.place(p);
            let beyond = contact.beyond_reach(&place);
            if beyond > 0.0 {
                nodes.start = k + 1 + (beyond / self.params.dx()) as usize;
            } else if let Some(touch) = contact.touch(place, v) {
                v = touch.velocity();
                each(*i, touch);
            }
        }
        v
    }
}
