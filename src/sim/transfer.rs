//! Affine scatter, gather and weight gradient between particles and grid nodes.
//!
//! All transfers of MLS-MPM and their adjoints are these three: scattering gives each of a particle's 27
//! nodes `w (q + o_x a_x + o_y a_y + o_z a_z)`, gathering returns the sums of `w g` and `w o g`, and the
//! weight gradient returns `sum dw/df (g . Q)`. Nodes have four components (momentum and mass), rows are
//! four nodes along z. Imports layout and lanes.

use super::kernel::{cell, derivatives};
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
    cell: [L::Real; 2],
    stencil: Stencil,
    sums: [L; 9],
}

/// No particle has this cell.
#[inline(always)]
fn nowhere<T: Real>() -> [T; 2] {
    [T::from_f64(-1.0); 2]
}

impl<'a, L: Lanes> Scatter<'a, L> {
    /// Starts with `grid`, the part's nodes, as it is.
    #[inline(always)]
    pub fn new(layout: &'a Layout, part: &'a Part, grid: &'a mut [L::Real]) -> Self {
        Self { layout, part, grid, cell: nowhere(), stencil: [0; 9], sums: [L::constant(0.0); 9] }
    }

    /// Adds one particle: `w` is a row of weights, `q` holds q, a_x, a_y, a_z. Returns false if the
    /// particle has left the layout.
    #[inline(always)]
    pub fn add(&mut self, w: &[L::Real; LANES], q: &[L::Real; LANES]) -> bool {
        if cell(w) != self.cell && self.move_to(cell(w)).is_none() {
            return false;
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

    /// Writes the sums of the current cell and turns to another, if the layout holds it.
    #[inline(always)]
    fn move_to(&mut self, cell: [L::Real; 2]) -> Option<()> {
        self.flush();
        self.stencil = self.layout.stencil(self.part, cell)?;
        self.cell = cell;
        Some(())
    }

    /// Writes the sums of the current cell to the grid.
    #[inline(always)]
    pub fn flush(&mut self) {
        if self.cell == nowhere() {
            return;
        }
        for (row, sum) in self.stencil.iter().zip(&mut self.sums) {
            let at = (*row as usize - self.part.nodes.start) * NODE;
            let nodes = &mut self.grid[at..at + LANES];
            (L::load(nodes) + *sum).store(nodes);
            *sum = L::constant(0.0);
        }
        self.cell = nowhere();
    }
}

/// Reads the 27 nodes around particles, cell by cell.
pub struct Gather<'a, L: Lanes> {
    layout: &'a Layout,
    part: &'a Part,
    grid: &'a [L::Real],
    cell: [L::Real; 2],
    rows: [L; 9],
}

impl<'a, L: Lanes> Gather<'a, L> {
    /// Reads from `grid`, all nodes of the layout.
    #[inline(always)]
    pub fn new(layout: &'a Layout, part: &'a Part, grid: &'a [L::Real]) -> Self {
        Self { layout, part, grid, cell: nowhere(), rows: [L::constant(0.0); 9] }
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
        self.load(cell, &stencil);
    }

    #[inline(always)]
    fn load(&mut self, cell: [L::Real; 2], stencil: &Stencil) {
        self.cell = cell;
        for (row, at) in self.rows.iter_mut().zip(stencil) {
            *row = L::load(&self.grid[*at as usize * NODE..]);
        }
    }

    /// Sums over the nodes of row b of each of the three planes of constant x: with the weights `x`, and with
    /// these times o_x.
    #[inline(always)]
    fn along_x(&self, x: &[L; 3], b: usize) -> [L; 2] {
        let far = x[2] * self.rows[6 + b];
        let near = x[1].mul_add(self.rows[3 + b], far);
        [x[0].mul_add(self.rows[b], near), near + far]
    }

    /// `[sum w g | sum w o_x g | sum w o_y g | sum w o_z g]`, four components each.
    #[inline(always)]
    pub fn moments(&self, w: &[L::Real; LANES]) -> L {
        let (x, y) = (splat3::<L>(&w[..3]), splat3::<L>(&w[4..7]));
        let along = [self.along_x(&x, 0), self.along_x(&x, 1), self.along_x(&x, 2)];
        along_y(&along, &y).moments(L::spread4(&w[8..12]))
    }

    /// [`Gather::moments`], and `sum dw/df_k (g . Q)` with `Q = q + o_x a_x + ..` before the last sum: four numbers
    /// for each of x, y, z, and four zeros.
    ///
    /// Q is linear in o, so the gradient takes the same three sums as the moments, once more with the
    /// derivatives of the weights along x and once more with those along y.
    #[inline(always)]
    pub fn moments_and_gradient(&self, w: &[L::Real; LANES], q: &[L::Real; LANES]) -> (L, L) {
        let (x, y) = (splat3::<L>(&w[..3]), splat3::<L>(&w[4..7]));
        let (dx, dy) = (derivatives(L::splat(w[12])), derivatives(L::splat(w[13])));
        let along = [self.along_x(&x, 0), self.along_x(&x, 1), self.along_x(&x, 2)];
        let by_dx = [self.along_x(&dx, 0), self.along_x(&dx, 1), self.along_x(&dx, 2)];
        let (plain, by_dx, by_dy) = (along_y(&along, &y), along_y(&by_dx, &y), along_y(&along, &dy));

        let (ax, ay) = (L::repeat4(&q[4..8]), L::repeat4(&q[8..12]));
        let q = L::repeat4(&q[12..16]).mul_add(node_index::<L>(), L::repeat4(&q[..4]));
        let (wz, dwz) = (L::spread4(&w[8..12]), derivatives_along_z::<L>(w[14]));
        let gradient = [wz * by_dx.dot(q, ax, ay), wz * by_dy.dot(q, ax, ay), dwz * plain.dot(q, ax, ay)];
        let zero = L::constant(0.0);
        (plain.moments(wz), L::sum_nodes(gradient[0], gradient[1], gradient[2], zero))
    }
}

/// Scatters a particle and takes the weight gradient from its nodes at once: `scatter` and `gather` must have been
/// led through the same particles. Returns what [`Gather::moments_and_gradient`] calls the gradient.
///
/// # Panics
/// If the layout does not hold the particle: the scatter of the forward pass has found every particle.
#[inline(always)]
pub fn scatter_and_gradient<L: Lanes>(
    scatter: &mut Scatter<'_, L>,
    gather: &mut Gather<'_, L>,
    w: &[L::Real; LANES],
    q: &[L::Real; LANES],
) -> L {
    if cell(w) != gather.cell {
        scatter.move_to(cell(w)).expect("scattered in the forward pass");
        gather.load(cell(w), &scatter.stencil);
    }
    let (x, y) = (splat3::<L>(&w[..3]), splat3::<L>(&w[4..7]));
    let (dx, dy) = (derivatives(L::splat(w[12])), derivatives(L::splat(w[13])));
    let (wz, dwz) = (L::spread4(&w[8..12]), derivatives_along_z::<L>(w[14]));
    let (ax, ay) = (L::repeat4(&q[4..8]), L::repeat4(&q[8..12]));
    let mut q0 = L::repeat4(&q[12..16]).mul_add(node_index::<L>(), L::repeat4(&q[..4]));
    let zero = L::constant(0.0);
    let (mut by_x, mut by_y, mut by_z) = (zero, zero, zero);
    for b in 0..3 {
        let q1 = q0 + ax;
        let q2 = q1 + ax;
        let wyz = y[b] * wz;
        scatter.sums[b] = x[0].mul_add(wyz * q0, scatter.sums[b]);
        scatter.sums[3 + b] = x[1].mul_add(wyz * q1, scatter.sums[3 + b]);
        scatter.sums[6 + b] = x[2].mul_add(wyz * q2, scatter.sums[6 + b]);
        let (t0, t1, t2) = (q0 * gather.rows[b], q1 * gather.rows[3 + b], q2 * gather.rows[6 + b]);
        let along = x[0].mul_add(t0, x[1].mul_add(t1, x[2] * t2));
        let across = dx[0].mul_add(t0, dx[1].mul_add(t1, dx[2] * t2));
        by_x = y[b].mul_add(across, by_x);
        by_y = dy[b].mul_add(along, by_y);
        by_z = y[b].mul_add(along, by_z);
        q0 = q0 + ay;
    }
    L::sum_nodes(wz * by_x, wz * by_y, dwz * by_z, zero)
}

/// Three weights, each in all lanes.
#[inline(always)]
fn splat3<L: Lanes>(w: &[L::Real]) -> [L; 3] {
    [L::splat(w[0]), L::splat(w[1]), L::splat(w[2])]
}

/// The derivatives of the three weights along z, each for its node of a row.
#[inline(always)]
fn derivatives_along_z<L: Lanes>(first: L::Real) -> L {
    let t = L::Real::from_f64;
    let slope = L::spread4(&[t(1.0), t(-2.0), t(1.0), t(0.0)]);
    let offset = L::spread4(&[t(0.0), t(-1.0), t(1.0), t(0.0)]);
    slope.mul_add(L::splat(first), offset)
}

/// A particle's nodes summed over x and y, still apart along z: plain, times o_x, times o_y.
struct Row<L> {
    sum: L,
    by_x: L,
    by_y: L,
}

/// Sums what [`Gather::along_x`] gave over y with the weights `y`.
#[inline(always)]
fn along_y<L: Lanes>(along_x: &[[L; 2]; 3], y: &[L; 3]) -> Row<L> {
    let [[s0, x0], [s1, x1], [s2, x2]] = *along_x;
    let far = y[2] * s2;
    let near = y[1].mul_add(s1, far);
    Row { sum: y[0].mul_add(s0, near), by_x: y[0].mul_add(x0, y[1].mul_add(x1, y[2] * x2)), by_y: near + far }
}

impl<L: Lanes> Row<L> {
    /// Moments by the weights along z.
    #[inline(always)]
    fn moments(&self, wz: L) -> L {
        let sum = wz * self.sum;
        L::sum_nodes(sum, wz * self.by_x, wz * self.by_y, node_index::<L>() * sum)
    }

    /// `g . (q + o_x a_x + o_y a_y)`, component by component.
    #[inline(always)]
    fn dot(&self, q: L, ax: L, ay: L) -> L {
        self.by_y.mul_add(ay, self.by_x.mul_add(ax, self.sum * q))
    }
}
