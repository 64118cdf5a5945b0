//! Affine scatter, gather and weight gradient between particles and grid nodes.
//!
//! All transfers of MLS-MPM and their adjoints are these three: scattering gives each of a particle's 27
//! nodes `w (q + o_x a_x + o_y a_y + o_z a_z)`, gathering returns the sums of `w g` and `w o g`, and the
//! weight gradient returns `sum dw/df (g . Q)`. Nodes have four components (momentum and mass), rows are
//! four nodes along z. Imports layout and lanes.

use super::kernel::cell;
use super::lanes::{LANES, Lanes, Real};
use super::layout::{Layout, Part, Stencil};

/// Components of a node.
pub const NODE: usize = 4;

/// 0, 1, 2, 3 for the four nodes of a row.
#[inline(always)]
fn node_index<L: Lanes>() -> L {
    let t = L::Real::from_f64;
    L::spread4(&[t(0.0), t(1.0), t(2.0), t(3.0)])
}

/// Adds particles' contributions to a part's share of the grid, cell by cell: nodes are written only when
/// the cell changes, which is rare among sorted particles.
pub struct Scatter<'a, L: Lanes> {
    layout: &'a Layout,
    part: &'a Part,
    grid: &'a mut [L::Real],
    cell: [i32; 3],
    stencil: Stencil,
    sums: [L; 9],
}

/// No particle has this cell.
const NOWHERE: [i32; 3] = [-1; 3];

impl<'a, L: Lanes> Scatter<'a, L> {
    /// Starts with `grid`, the part's nodes, as it is.
    #[inline(always)]
    pub fn new(layout: &'a Layout, part: &'a Part, grid: &'a mut [L::Real]) -> Self {
        Self { layout, part, grid, cell: NOWHERE, stencil: [0; 9], sums: [L::constant(0.0); 9] }
    }

    /// Adds one particle: `w` is a row of weights, `q` holds q, a_x, a_y, a_z. Returns false if the
    /// particle has left the layout.
    #[inline(always)]
    pub fn add(&mut self, w: &[L::Real; LANES], q: &[L::Real; LANES]) -> bool {
        let cell = cell(w);
        if cell != self.cell {
            self.flush();
            let Some(stencil) = self.layout.stencil(self.part, cell) else { return false };
            (self.cell, self.stencil) = (cell, stencil);
        }
        let (ax, ay) = (L::repeat4(&q[4..8]), L::repeat4(&q[8..12]));
        let mut q_b = L::repeat4(&q[12..16]).mul_add(node_index::<L>(), L::repeat4(&q[..4]));
        let wz = L::spread4(&w[8..12]);
        let (wx0, wx1, wx2) = (L::splat(w[0]), L::splat(w[1]), L::splat(w[2]));
        for b in 0..3 {
            let wyz = L::splat(w[4 + b]) * wz;
            let (r0, slope) = (q_b * wyz, ax * wyz);
            let r1 = r0 + slope;
            self.sums[b] = wx0.mul_add(r0, self.sums[b]);
            self.sums[3 + b] = wx1.mul_add(r1, self.sums[3 + b]);
            self.sums[6 + b] = wx2.mul_add(r1 + slope, self.sums[6 + b]);
            q_b = q_b + ay;
        }
        true
    }

    /// Writes the sums of the current cell to the grid.
    #[inline(always)]
    pub fn flush(&mut self) {
        if self.cell == NOWHERE {
            return;
        }
        for (row, sum) in self.stencil.iter().zip(&mut self.sums) {
            let at = (*row as usize - self.part.nodes.start) * NODE;
            let nodes = &mut self.grid[at..at + LANES];
            (L::load(nodes) + *sum).store(nodes);
            *sum = L::constant(0.0);
        }
        self.cell = NOWHERE;
    }
}

/// Reads the 27 nodes around particles, cell by cell.
pub struct Gather<'a, L: Lanes> {
    layout: &'a Layout,
    part: &'a Part,
    grid: &'a [L::Real],
    cell: [i32; 3],
    rows: [L; 9],
}

impl<'a, L: Lanes> Gather<'a, L> {
    /// Reads from `grid`, all nodes of the layout.
    #[inline(always)]
    pub fn new(layout: &'a Layout, part: &'a Part, grid: &'a [L::Real]) -> Self {
        Self { layout, part, grid, cell: NOWHERE, rows: [L::constant(0.0); 9] }
    }

    /// Moves to the cell of a particle that the layout holds.
    ///
    /// # Panics
    /// If it does not: the scatter before it has found every particle, so this is a bug.
    #[inline(always)]
    pub fn move_to(&mut self, w: &[L::Real; LANES]) {
        let cell = cell(w);
        if cell == self.cell {
            return;
        }
        let stencil = self.layout.stencil(self.part, cell).expect("scattered before it is gathered");
        self.cell = cell;
        for (row, at) in self.rows.iter_mut().zip(stencil) {
            *row = L::load(&self.grid[at as usize * NODE..]);
        }
    }

    /// `[sum w g | sum w o_x g | sum w o_y g | sum w o_z g]`, four components each.
    #[inline(always)]
    pub fn moments(&self, w: &[L::Real; LANES]) -> L {
        let wz = L::spread4(&w[8..12]);
        let (wx0, wx1, wx2) = (L::splat(w[0]), L::splat(w[1]), L::splat(w[2]));
        let zero = L::constant(0.0);
        let (mut sum, mut by_x, mut by_y) = (zero, zero, zero);
        for b in 0..3 {
            let far = wx2 * self.rows[6 + b];
            let near = wx1.mul_add(self.rows[3 + b], far);
            let wyz = L::splat(w[4 + b]) * wz;
            let row = wyz * wx0.mul_add(self.rows[b], near);
            sum = sum + row;
            by_x = wyz.mul_add(near + far, by_x);
            if b == 1 {
                by_y = row;
            } else if b == 2 {
                by_y = by_y + (row + row);
            }
        }
        L::sum_nodes(sum, by_x, by_y, node_index::<L>() * sum)
    }

    /// `sum dw/df_k (g . Q)` with `Q = q + o_x a_x + ..`, before the last sum: four numbers for each of
    /// x, y, z, and four zeros.
    #[inline(always)]
    pub fn weight_gradient(&self, w: &[L::Real; LANES], dw: &[L::Real; LANES], q: &[L::Real; LANES]) -> L {
        let (ax, ay) = (L::repeat4(&q[4..8]), L::repeat4(&q[8..12]));
        let mut q_b = L::repeat4(&q[12..16]).mul_add(node_index::<L>(), L::repeat4(&q[..4]));
        let (wx0, wx1, wx2) = (L::splat(w[0]), L::splat(w[1]), L::splat(w[2]));
        let (dx0, dx1, dx2) = (L::splat(dw[0]), L::splat(dw[1]), L::splat(dw[2]));
        let zero = L::constant(0.0);
        let (mut by_x, mut by_y, mut by_z) = (zero, zero, zero);
        for b in 0..3 {
            let q1 = q_b + ax;
            let t0 = q_b * self.rows[b];
            let t1 = q1 * self.rows[3 + b];
            let t2 = (q1 + ax) * self.rows[6 + b];
            let (wy, dy) = (L::splat(w[4 + b]), L::splat(dw[4 + b]));
            let along = wx0.mul_add(t0, wx1.mul_add(t1, wx2 * t2));
            let across = dx0.mul_add(t0, dx1.mul_add(t1, dx2 * t2));
            by_x = wy.mul_add(across, by_x);
            by_y = dy.mul_add(along, by_y);
            by_z = wy.mul_add(along, by_z);
            q_b = q_b + ay;
        }
        let (wz, dz) = (L::spread4(&w[8..12]), L::spread4(&dw[8..12]));
        L::sum_nodes(wz * by_x, wz * by_y, dz * by_z, zero)
    }
}
