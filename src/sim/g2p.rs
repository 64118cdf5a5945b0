//! Grid to particles (G2P) with advection, and the adjoint of both.
//!
//! Grid velocities come in; a part's new velocities, affine matrices and positions go out (\[APIC]). Imports the
//! transfers.
//!
//! ```text
//! v_p = sum_i w_ip v_i
//! C_p = 4/dx^2 sum_i w_ip v_i (x_i - x_p)^T            4/dx^2: inverse of APIC's D_p, quadratic weights
//! x_p <- clamp(x_p + dt v_p)
//! ```
//!
//! *The adjoint* scatters; with x_adj that of the new position (zero where it was clamped) and `u = v_adj + dt x_adj`:
//!
//! ```text
//! v_i_adj = sum_p w_ip (u + 4/dx^2 C_adj (x_i - x_p))
//! x_p_adj = x_adj + sum_i (grad w_ip) v_i . (u + 4/dx^2 C_adj (x_i - x_p))  -  4/dx^2 C_adj^T v_p
//! ```

use super::block::{load_anchors, load_m3, load3, store_m3, store3};
use super::kernel::{ParticleRows, no_rows, to_lanes, to_particles, weights};
use super::lanes::{Kernel, LANES, Lanes, M3, Real, prefetch, splat_m3};
use super::layout::{Layout, Part};
use super::p2g::particles_in;
use super::params::Params;
use super::particles::{ANCHORS, BLOCK, C, V, X};
use super::transfer::{Gather, Scatter, scatter_and_gradient};

/// G2P of one part.
pub struct GridToParticles<'a, T> {
    pub params: &'a Params,
    pub layout: &'a Layout,
    pub part: &'a Part,
    /// All packed particles at the substep's start, and their anchors.
    pub state: &'a [T],
    pub anchors: &'a [T],
    /// Velocities, all nodes.
    pub velocity: &'a [T],
    /// The part's particles at its end: receives x, v and C.
    pub next: &'a mut [T],
}

impl<T: Real> Kernel<T> for GridToParticles<'_, T> {
    /// The first slot whose new position is not a number.
    type Output = Option<usize>;

    #[inline(always)]
    fn run<L: Lanes<Real = T>>(self) -> Option<usize> {
        let params = self.params;
        let zero = L::constant(0.0);
        // Cells that a velocity of 1 m/s crosses.
        let dt = L::constant(params.dt * params.nodes as f64);
        let per_cell = L::constant(4.0 / params.dx());
        let (lo, hi) = params.cell_bounds();
        let (lo, hi) = (L::constant(lo), L::constant(hi));
        let mut gather = Gather::<L>::new(self.layout, self.part, self.velocity);
        let blocks = &self.state.as_chunks::<BLOCK>().0[self.part.blocks.clone()];
        let anchors = &self.anchors.as_chunks::<ANCHORS>().0[self.part.blocks.clone()];
        let next = self.next.as_chunks_mut::<BLOCK>().0;
        let (mut w, mut moments) = (no_rows(), no_rows());
        for (k, ((block, anchors), next)) in blocks.iter().zip(anchors).zip(next).enumerate() {
            let b = self.part.blocks.start + k;
            let count = particles_in(self.layout, b);
            let x = load3::<L>(block, X);
            let anchors = load_anchors::<L>(anchors);
            let f = weights(params.nodes, &anchors, &x, &mut w);
            for lane in 0..count {
                gather.move_to(&w[lane]);
                gather.moments(&w[lane]).store(&mut moments[lane]);
            }
            let p = to_lanes::<L>(&moments);
            let v = [p[0], p[1], p[2]];
            let mut c = splat_m3::<L>(0.0);
            let mut moved = x;
            let mut finite = zero;
            for i in 0..3 {
                for j in 0..3 {
                    c[i][j] = per_cell * (p[4 + 4 * j + i] - v[i] * f[j]);
                }
                let to = dt.mul_add(v[i], x[i]);
                // Stays 0 for numbers, turns NaN for NaN and infinity.
                finite = finite + to * zero;
                moved[i] = to.max(lo - anchors[i]).min(hi - anchors[i]);
            }
            store3(next, X, &moved);
            store3(next, V, &v);
            store_m3(next, C, &c);
            let bad = !L::bits(L::constant(1.0).gt(finite));
            if bad != 0 && bad.trailing_zeros() < count as u32 {
                return Some(b * LANES + bad.trailing_zeros() as usize);
            }
        }
        None
    }
}

/// Adjoint of [`GridToParticles`] for one part.
pub struct GridToParticlesAdj<'a, T> {
    pub params: &'a Params,
    pub layout: &'a Layout,
    pub part: &'a Part,
    /// All packed particles at the substep's start ..
    pub state: &'a [T],
    /// .. and at its end, and their anchors.
    pub next: &'a [T],
    pub anchors: &'a [T],
    /// Velocities, all nodes.
    pub velocity: &'a [T],
    /// The part's particles. In: the adjoint of the state at the substep's end. Out: x holds the adjoint
    /// of the position at its start as far as G2P knows it; v and C are used up.
    pub adj: &'a mut [T],
    /// The part's nodes: receives the adjoint of the velocities.
    pub grid_adj: &'a mut [T],
}

/// What scattering to a node at offset o adds to its velocity's adjoint: `v_adj + 4/dx C_adj (o - f)`.
#[inline(always)]
fn contribution_adj<L: Lanes>(v_adj: &[L; 3], c_adj: &M3<L>, f: &[L; 3], rows: &mut ParticleRows<L::Real>) {
    let mut q = [L::constant(0.0); LANES];
    for i in 0..3 {
        let at_f = c_adj[i][2].mul_add(f[2], c_adj[i][1].mul_add(f[1], c_adj[i][0] * f[0]));
        q[i] = v_adj[i] - at_f;
        for j in 0..3 {
            q[4 + 4 * j + i] = c_adj[i][j];
        }
    }
    to_particles(q, rows);
}

impl<T: Real> Kernel<T> for GridToParticlesAdj<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Real = T>>(self) {
        let params = self.params;
        let zero = L::constant(0.0);
        let dt = L::constant(params.dt * params.nodes as f64);
        let per_cell = L::constant(4.0 / params.dx());
        let (lo, hi) = params.cell_bounds();
        let (lo, hi) = (L::constant(lo), L::constant(hi));
        self.grid_adj.fill(T::default());
        let mut scatter = Scatter::<L>::new(self.layout, self.part, self.grid_adj);
        let mut gather = Gather::<L>::new(self.layout, self.part, self.velocity);
        let range = self.part.blocks.clone();
        let blocks = &self.state.as_chunks::<BLOCK>().0[range.clone()];
        let nexts = &self.next.as_chunks::<BLOCK>().0[range.clone()];
        let anchors = &self.anchors.as_chunks::<ANCHORS>().0[range.clone()];
        let adj = self.adj.as_chunks_mut::<BLOCK>().0;
        let (mut w, mut q, mut gradient) = (no_rows(), no_rows(), no_rows());
        for (k, (((block, next), anchors), adj)) in blocks.iter().zip(nexts).zip(anchors).zip(adj).enumerate()
        {
            let anchors = load_anchors::<L>(anchors);
            let count = particles_in(self.layout, range.start + k);
            prefetch(blocks.get(k + 1).map_or(&[], |soon| &soon[X * LANES..V * LANES]));
            prefetch(nexts.get(k + 1).map_or(&[], |soon| &soon[X * LANES..C * LANES]));
            let (moved, v) = (load3::<L>(next, X), load3::<L>(next, V));
            let (mut x_adj, mut v_adj) = (load3::<L>(adj, X), load3::<L>(adj, V));
            let mut c_adj = load_m3::<L>(adj, C);
            for i in 0..3 {
                // A clamped position does not depend on anything.
                let free = L::and(moved[i].gt(lo - anchors[i]), (hi - anchors[i]).gt(moved[i]));
                x_adj[i] = L::select(free, x_adj[i], zero);
                v_adj[i] = dt.mul_add(x_adj[i], v_adj[i]);
                for j in 0..3 {
                    c_adj[i][j] = per_cell * c_adj[i][j];
                }
            }
            let f = weights(params.nodes, &anchors, &load3::<L>(block, X), &mut w);
            contribution_adj(&v_adj, &c_adj, &f, &mut q);
            for lane in 0..count {
                scatter_and_gradient(&mut scatter, &mut gather, &w[lane], &q[lane])
                    .store(&mut gradient[lane]);
            }
            let d = to_lanes::<L>(&gradient);
            for j in 0..3 {
                let through_weights = (d[4 * j] + d[4 * j + 1]) + (d[4 * j + 2] + d[4 * j + 3]);
                let through_offset = c_adj[0][j].mul_add(v[0], c_adj[1][j].mul_add(v[1], c_adj[2][j] * v[2]));
                x_adj[j] = (through_weights - through_offset) + x_adj[j];
            }
            store3(adj, X, &x_adj);
        }
        scatter.flush();
    }
}
