//! Particles to grid (P2G) with the constitutive update before it, and the adjoint of both.
//!
//! A part's particles come in; their mass and momentum on the part's nodes and their new deformation go
//! out (\[MLS-MPM], with the affine matrix of \[APIC]). Imports the transfers.
//!
//! ```text
//! m_i     = sum_p w_ip m
//! (m v)_i = sum_p w_ip (m v_p + A_p (x_i - x_p)),      A_p = m C_p - dt V 4/dx^2 tau_p
//! ```
//!
//! A_p is what makes MLS-MPM short: the stress's force on a node, `- V tau grad w_ip`, has with quadratic weights the form
//! `- V 4/dx^2 w_ip tau (x_i - x_p)`, and so joins the affine momentum. *The adjoint* gathers: with `g_i` the adjoint
//! of (m v)_i and m_i as four components,
//!
//! ```text
//! (m v_p)_adj = sum_i w_ip g_i
//! A_p_adj     = sum_i w_ip g_i (x_i - x_p)^T
//! x_p_adj     = sum_i (grad w_ip) g_i . (m v_p + A_p (x_i - x_p), m)  -  A_p^T sum_i w_ip g_i
//! ```
//!
//! Weights move with particles, and the first term of x_p_adj says how: leaving it out, as some do, gives gradients that
//! are wrong by as much as dough moves across cells.

use super::block::{AXES, load_anchors, load_axes, load_m3, load3, store_axes, store_m3, store3};
use super::constitutive::{inverted, trial, trial_adj, update, update_adj};
use super::kernel::{ParticleRows, no_rows, to_lanes, to_particles, weights};
use super::lanes::{Kernel, LANES, Lanes, M3, Real, prefetch, splat_m3};
use super::layout::{Layout, Part};
use super::params::Params;
use super::particles::{ANCHORS, BLOCK, C, F, V, X};
use super::spectral::eigenvectors;
use super::transfer::{Gather, Scatter};

/// How a part's P2G ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All particles were scattered.
    Done,
    /// A particle has left the region that the layout covers: build a new one and try again.
    Escaped,
    /// The deformation of the particle in this slot inverted or is not a number.
    BadDeformation { slot: usize },
}

/// Constitutive update and P2G of one part.
pub struct ParticlesToGrid<'a, T> {
    pub params: &'a Params,
    pub layout: &'a Layout,
    pub part: &'a Part,
    /// The part's packed particles at the substep's start.
    pub state: &'a [T],
    /// The nodes that all particles' positions are measured from.
    pub anchors: &'a [T],
    /// The part's particles at its end: receives the new F.
    pub next: &'a mut [T],
    /// The part's axes: receives the eigenvectors of the trial's F F^T.
    pub axes: &'a mut [T],
    /// The part's nodes: momentum and mass.
    pub grid: &'a mut [T],
}

/// The affine momentum matrix, `A = -dt Vol 4/dx^2 tau + m C`, times dx.
#[inline(always)]
fn affine<L: Lanes>(params: &Params, tau: &M3<L>, c: &M3<L>) -> M3<L> {
    let stress = L::constant(params.stress_factor() * params.dx());
    let mass = L::constant(params.particle_mass() * params.dx());
    let mut a = *c;
    for i in 0..3 {
        for j in 0..3 {
            a[i][j] = stress.mul_add(tau[i][j], mass * c[i][j]);
        }
    }
    a
}

/// Adjoint of [`affine`]: adjoints of tau and C.
#[inline(always)]
fn affine_adj<L: Lanes>(params: &Params, a_adj: &M3<L>) -> (M3<L>, M3<L>) {
    let stress = L::constant(params.stress_factor() * params.dx());
    let mass = L::constant(params.particle_mass() * params.dx());
    let (mut tau_adj, mut c_adj) = (*a_adj, *a_adj);
    for i in 0..3 {
        for j in 0..3 {
            tau_adj[i][j] = stress * a_adj[i][j];
            c_adj[i][j] = mass * a_adj[i][j];
        }
    }
    (tau_adj, c_adj)
}

/// What a node at offset o receives: `m v + A (o - f)` and m, as a polynomial in o.
#[inline(always)]
fn contribution<L: Lanes>(mass: L, v: &[L; 3], a: &M3<L>, f: &[L; 3], rows: &mut ParticleRows<L::Real>) {
    let mut q = [L::constant(0.0); LANES];
    for i in 0..3 {
        let at_f = a[i][2].mul_add(f[2], a[i][1].mul_add(f[1], a[i][0] * f[0]));
        q[i] = mass * v[i] - at_f;
        for j in 0..3 {
            q[4 + 4 * j + i] = a[i][j];
        }
    }
    q[3] = mass;
    to_particles(q, rows);
}

/// Trial deformations and the eigenvectors of their F F^T, block by block; they are found for two blocks at a
/// time ([`spectral`](super::spectral) says why).
pub struct Trials<L> {
    /// Displacement gradients of a block with an even number and of the next.
    h: [M3<L>; 2],
    u: [M3<L>; 2],
}

impl<L: Lanes> Trials<L> {
    #[inline(always)]
    #[allow(
        clippy::new_without_default,
        reason = "a default could be called where the vectors are not switched on"
    )]
    pub fn new() -> Self {
        let zero = [splat_m3(0.0); 2];
        Self { h: zero, u: zero }
    }

    /// Those of block `k`. Blocks are asked for in order, from 0.
    #[inline(always)]
    pub fn of(&mut self, params: &Params, blocks: &[[L::Real; BLOCK]], k: usize) -> (M3<L>, M3<L>) {
        if k.is_multiple_of(2) {
            let (one, other) = (&blocks[k], blocks.get(k + 1).unwrap_or(&blocks[k]));
            // Written twice: in a closure the vectors would not be switched on.
            self.h = [
                trial(params.dt, &load_m3(one, C), &load_m3(one, F)),
                trial(params.dt, &load_m3(other, C), &load_m3(other, F)),
            ];
            self.u = eigenvectors(&self.h);
        }
        (self.h[k % 2], self.u[k % 2])
    }
}

/// Real particles in block `b`; the rest of its lanes is padding.
#[inline(always)]
pub(super) fn particles_in(layout: &Layout, b: usize) -> usize {
    (layout.particles - b * LANES).min(LANES)
}

impl<T: Real> Kernel<T> for ParticlesToGrid<'_, T> {
    type Output = Outcome;

    #[inline(always)]
    fn run<L: Lanes<Real = T>>(self) -> Outcome {
        let params = self.params;
        self.grid.fill(T::default());
        let mut scatter = Scatter::<L>::new(self.layout, self.part, self.grid);
        let blocks = self.state.as_chunks::<BLOCK>().0;
        let anchors = &self.anchors.as_chunks::<ANCHORS>().0[self.part.blocks.clone()];
        let next = self.next.as_chunks_mut::<BLOCK>().0;
        let axes = self.axes.as_chunks_mut::<AXES>().0;
        let (mut w, mut q) = (no_rows(), no_rows());
        let mut trials = Trials::new();
        for (k, (((block, anchors), next), axes)) in
            blocks.iter().zip(anchors).zip(next).zip(axes).enumerate()
        {
            let b = self.part.blocks.start + k;
            let count = particles_in(self.layout, b);
            let (x, v) = (load3::<L>(block, X), load3::<L>(block, V));
            let c = load_m3::<L>(block, C);
            let (h_trial, u) = trials.of(params, blocks, k);
            let up = update(params, h_trial, u);
            let bad = inverted(&up.h_trial);
            if bad != 0 && bad.trailing_zeros() < count as u32 {
                return Outcome::BadDeformation { slot: b * LANES + bad.trailing_zeros() as usize };
            }
            store_m3(next, F, &up.h_new);
            store_axes(axes, &up.spectrum.u);
            let f = weights(params.nodes, &load_anchors(anchors), &x, &mut w);
            let a = affine(params, &up.tau, &c);
            contribution(L::constant(params.particle_mass()), &v, &a, &f, &mut q);
            for lane in 0..count {
                if !scatter.add(&w[lane], &q[lane]) {
                    return Outcome::Escaped;
                }
            }
        }
        scatter.flush();
        Outcome::Done
    }
}

/// Adjoint of [`ParticlesToGrid`] for one part.
pub struct ParticlesToGridAdj<'a, T> {
    pub params: &'a Params,
    pub layout: &'a Layout,
    pub part: &'a Part,
    /// All packed particles at the substep's start, and their anchors.
    pub state: &'a [T],
    pub anchors: &'a [T],
    /// All axes, from [`ParticlesToGrid`].
    pub axes: &'a [T],
    /// Adjoint of momentum and mass, all nodes.
    pub grid_adj: &'a [T],
    /// The part's particles. In: the adjoint of the new F, and in x what came through G2P. Out: the
    /// adjoint of the whole state at the substep's start.
    pub adj: &'a mut [T],
}

impl<T: Real> Kernel<T> for ParticlesToGridAdj<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Real = T>>(self) {
        let params = self.params;
        let mass = L::constant(params.particle_mass());
        let mut gather = Gather::<L>::new(self.layout, self.part, self.grid_adj);
        let blocks = &self.state.as_chunks::<BLOCK>().0[self.part.blocks.clone()];
        let anchors = &self.anchors.as_chunks::<ANCHORS>().0[self.part.blocks.clone()];
        let adj = self.adj.as_chunks_mut::<BLOCK>().0;
        let mut rows = AdjointRows { w: no_rows(), q: no_rows(), moments: no_rows(), gradient: no_rows() };
        let all_axes = &self.axes.as_chunks::<AXES>().0[self.part.blocks.clone()];
        for (k, (((block, anchors), axes), adj)) in
            blocks.iter().zip(anchors).zip(all_axes).zip(adj).enumerate()
        {
            let count = particles_in(self.layout, self.part.blocks.start + k);
            prefetch(blocks.get(k + 1).map_or(&[], |soon| &soon[..]));
            prefetch(all_axes.get(k + 1).map_or(&[], |soon| &soon[..]));
            let (x, v) = (load3::<L>(block, X), load3::<L>(block, V));
            let (c, h) = (load_m3::<L>(block, C), load_m3::<L>(block, F));
            let up = update(params, trial(params.dt, &c, &h), load_axes(axes));
            let a = affine(params, &up.tau, &c);
            let offset = weights(params.nodes, &load_anchors(anchors), &x, &mut rows.w);
            contribution(mass, &v, &a, &offset, &mut rows.q);

            let (v_adj, a_adj, x_adj) = scatter_adj(&mut gather, &mut rows, &offset, &a, count);
            let (tau_adj, c_adj) = affine_adj(params, &a_adj);
            let f_trial_adj = update_adj(params, &up, &load_m3(adj, F), &tau_adj);
            let (c_trial_adj, f_adj) = trial_adj(params.dt, &c, &h, &f_trial_adj);

            let through_g2p = load3::<L>(adj, X);
            let mut x_total = x_adj;
            let mut v_total = v_adj;
            let mut c_total = c_adj;
            for i in 0..3 {
                x_total[i] = x_adj[i] + through_g2p[i];
                v_total[i] = mass * v_adj[i];
                for j in 0..3 {
                    c_total[i][j] = c_adj[i][j] + c_trial_adj[i][j];
                }
            }
            store3(adj, X, &x_total);
            store3(adj, V, &v_total);
            store_m3(adj, C, &c_total);
            store_m3(adj, F, &f_adj);
        }
    }
}

/// What the adjoint needs of each particle: weights and contribution come in, moments and weight gradient go out.
struct AdjointRows<T> {
    w: ParticleRows<T>,
    q: ParticleRows<T>,
    moments: ParticleRows<T>,
    gradient: ParticleRows<T>,
}

/// Adjoint of the scatter of a block: of m v, of A dx, and of f (by the weights and by `o - f`).
#[inline(always)]
fn scatter_adj<L: Lanes>(
    gather: &mut Gather<'_, L>,
    rows: &mut AdjointRows<L::Real>,
    f: &[L; 3],
    a: &M3<L>,
    count: usize,
) -> ([L; 3], M3<L>, [L; 3]) {
    for lane in 0..count {
        gather.move_to(&rows.w[lane]);
        let (moments, gradient) = gather.moments_and_gradient(&rows.w[lane], &rows.q[lane]);
        moments.store(&mut rows.moments[lane]);
        gradient.store(&mut rows.gradient[lane]);
    }
    let (p, d) = (to_lanes::<L>(&rows.moments), to_lanes::<L>(&rows.gradient));
    let v_adj = [p[0], p[1], p[2]];
    let mut a_adj = splat_m3::<L>(0.0);
    let mut f_adj = v_adj;
    for j in 0..3 {
        for i in 0..3 {
            a_adj[i][j] = p[4 + 4 * j + i] - v_adj[i] * f[j];
        }
        let through_weights = (d[4 * j] + d[4 * j + 1]) + (d[4 * j + 2] + d[4 * j + 3]);
        let through_offset = a[0][j].mul_add(v_adj[0], a[1][j].mul_add(v_adj[1], a[2][j] * v_adj[2]));
        f_adj[j] = through_weights - through_offset;
    }
    (v_adj, a_adj, f_adj)
}
