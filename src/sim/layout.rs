//! The sparse grid: which nodes exist, where they stand in memory, and in which order particles lie.
//!
//! Built from the particles' cells (once per control step, and again in between if a particle outruns
//! its margin); used by every grid kernel. Nodes are stored as *pencils*: for each (i, j) that some
//! particle may touch, a contiguous run of nodes along z. Imports lanes and particles.

use std::ops::Range;

use super::lanes::{LANES, Real};
use super::particles::{Packed, blocks_for};

/// Cells a particle may drift from where it was sorted before the layout must be rebuilt.
const MARGIN: usize = 1;
/// No particle's base cell may be at this (i, j).
const NO_COLUMN: u32 = u32::MAX;
/// Particles that one part should have at least: below that, splitting costs more than it gains.
const PART_MIN: usize = 1024;
/// Most parts a layout is split into. A fixed number, never the number of threads, so that sums are
/// taken in the same order whatever the machine.
const PARTS_MAX: usize = 8;

/// A run of nodes along z at one (i, j).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pencil {
    /// Node indices on the x and y axes.
    pub i: u16,
    pub j: u16,
    /// First node index on the z axis.
    pub k: u16,
    /// Number of nodes.
    pub len: u16,
    /// Where its first node stands in a node array.
    pub start: u32,
}

/// Particles that are scattered by one worker, and the nodes they can reach.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Part {
    /// Blocks of particles.
    pub blocks: Range<usize>,
    /// Nodes (whole slabs of constant i) that these particles can touch.
    pub nodes: Range<usize>,
    /// Columns of base cells that these particles may have.
    pub columns: Range<usize>,
}

/// The base cells at one (i, j) that particles may have.
#[derive(Clone, Debug)]
struct Column {
    /// First and last k of the base cells.
    base: (i32, i32),
    /// The nine pencils around them: where node k = 0 of each would stand.
    origin: Stencil,
}

/// The sparse grid of one epoch.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// Nodes per axis of the whole grid.
    nodes: usize,
    /// Number of particles.
    pub particles: usize,
    /// Total number of stored nodes, padding included.
    pub len: usize,
    /// i of all base cells that particles may have before the next build.
    slabs: Range<usize>,
    /// For each (i, j): the number of its column of base cells, or [`NO_COLUMN`].
    column_at: Vec<u32>,
    /// All columns of base cells, i-major.
    columns: Vec<Column>,
    /// All pencils, i-major.
    pub pencils: Vec<Pencil>,
    /// First pencil of each slab i, and the end.
    slab: Vec<u32>,
    /// Workers' shares of particles.
    pub parts: Vec<Part>,
    /// Workers' shares of pencils.
    pub pencil_parts: Vec<Range<usize>>,
}

/// The nine pencils around a base cell: where node k of each would stand.
pub type Stencil = [i32; 9];

impl Layout {
    /// Sorts packed particles by cell and lays out the grid around them.
    ///
    /// Returns the layout and, for each new slot, the old slot. The order is stable, so it depends on
    /// the particles alone.
    pub fn build<T: Real>(nodes: usize, particles: usize, packed: &Packed<T>) -> (Self, Vec<u32>) {
        let cell = |slot: usize, axis: usize| -> usize {
            let base = (packed.cells(slot, axis) - 0.5) as i64;
            base.clamp(0, nodes as i64 - 3) as usize
        };
        let keys: Vec<u32> =
            (0..particles).map(|s| ((cell(s, 0) * nodes + cell(s, 1)) * nodes + cell(s, 2)) as u32).collect();
        let order = stable_order(&keys, nodes.pow(3));
        let sorted: Vec<[i32; 3]> = order
            .iter()
            .map(|&s| {
                let key = keys[s as usize] as usize;
                [key / (nodes * nodes), key / nodes % nodes, key % nodes].map(|v| v as i32)
            })
            .collect();

        let mut layout = Self { nodes, particles, slabs: slabs_of(&sorted, nodes), ..Self::default() };
        let base = layout.mark_bases(&sorted);
        let origin = layout.lay_pencils(&base);
        layout.list_columns(&base, &origin);
        layout.split(&sorted);
        (layout, order)
    }

    /// For each base cell (i, j): the range of k that a particle may have before the next build, empty where
    /// none is.
    fn mark_bases(&self, sorted: &[[i32; 3]]) -> Vec<(i16, i16)> {
        let last = self.nodes as i32 - 3;
        let m = MARGIN as i32;
        let mut base = vec![(i16::MAX, i16::MIN); self.nodes * self.nodes];
        let mut previous = [-1; 3];
        for &cell in sorted {
            if cell == previous {
                continue;
            }
            previous = cell;
            let (lo, hi) = ((cell[2] - m).max(0) as i16, (cell[2] + m).min(last) as i16);
            for i in (cell[0] - m).max(0)..=(cell[0] + m).min(last) {
                for j in (cell[1] - m).max(0)..=(cell[1] + m).min(last) {
                    let range = &mut base[i as usize * self.nodes + j as usize];
                    *range = (range.0.min(lo), range.1.max(hi));
                }
            }
        }
        base
    }

    /// Gives every (i, j) within two nodes of a base cell a pencil long enough for all of them; returns for each
    /// (i, j) where node k = 0 would stand, meaningless where no pencil is.
    fn lay_pencils(&mut self, base: &[(i16, i16)]) -> Vec<i32> {
        let n = self.nodes;
        let mut range = vec![(i16::MAX, i16::MIN); n * n];
        for i in self.slabs.clone() {
            for j in 0..n - 2 {
                let (lo, hi) = base[i * n + j];
                if lo > hi {
                    continue;
                }
                for a in 0..3 {
                    for b in 0..3 {
                        let r = &mut range[(i + a) * n + j + b];
                        *r = (r.0.min(lo), r.1.max(hi + 2));
                    }
                }
            }
        }
        let mut origin = vec![0; n * n];
        let mut start = 0usize;
        for i in 0..n {
            self.slab.push(self.pencils.len() as u32);
            if !(self.slabs.start..self.slabs.end + 2).contains(&i) {
                continue;
            }
            for j in 0..n {
                let (lo, hi) = range[i * n + j];
                if lo > hi {
                    continue;
                }
                let len = (hi - lo + 1) as usize;
                let (i16, j16, k16) = (i as u16, j as u16, lo as u16);
                self.pencils.push(Pencil { i: i16, j: j16, k: k16, len: len as u16, start: start as u32 });
                origin[i * n + j] = start as i32 - i32::from(lo);
                // One node of padding, because rows are read four nodes at a time.
                start += len + 1;
            }
        }
        self.slab.push(self.pencils.len() as u32);
        self.len = start;
        origin
    }

    /// Lists the columns of base cells with the pencils around them.
    fn list_columns(&mut self, base: &[(i16, i16)], origin: &[i32]) {
        self.column_at = vec![NO_COLUMN; base.len()];
        for at in self.slabs.start * self.nodes..self.slabs.end * self.nodes {
            let (lo, hi) = base[at];
            if lo <= hi {
                self.column_at[at] = self.columns.len() as u32;
                self.columns.push(Column {
                    base: (lo.into(), hi.into()),
                    origin: std::array::from_fn(|k| origin[at + k / 3 * self.nodes + k % 3]),
                });
            }
        }
    }

    /// Splits particles and pencils into shares of about equal size.
    fn split(&mut self, sorted: &[[i32; 3]]) {
        let blocks = blocks_for(self.particles);
        let parts = (self.particles / PART_MIN).clamp(1, PARTS_MAX);
        for p in 0..parts {
            let range = p * blocks / parts..(p + 1) * blocks / parts;
            let slots = range.start * LANES..(range.end * LANES).min(self.particles);
            let (first, last) = (sorted[slots.start][0], sorted[slots.end - 1][0]);
            let lo = (first - MARGIN as i32).max(0);
            let hi = (last + MARGIN as i32).min(self.nodes as i32 - 3);
            let nodes = self.slab_start(lo as usize)..self.slab_start(hi as usize + 3);
            let columns = self.first_column(lo as usize)..self.first_column(hi as usize + 1);
            self.parts.push(Part { blocks: range, nodes, columns });
        }
        let count = self.pencils.len();
        self.pencil_parts = (0..parts).map(|p| p * count / parts..(p + 1) * count / parts).collect();
    }

    /// The first column of base cells whose i is at least this.
    fn first_column(&self, i: usize) -> usize {
        let later = self.column_at[i * self.nodes..].iter().find(|&&c| c != NO_COLUMN);
        later.map_or(self.columns.len(), |&c| c as usize)
    }

    /// Where slab `i` starts in a node array.
    fn slab_start(&self, i: usize) -> usize {
        self.pencils.get(self.slab[i] as usize).map_or(self.len, |p| p.start as usize)
    }

    /// The nodes of a range of pencils.
    pub fn nodes_of(&self, pencils: &Range<usize>) -> Range<usize> {
        let start = |p: usize| self.pencils.get(p).map_or(self.len, |p| p.start as usize);
        start(pencils.start)..start(pencils.end)
    }

    /// The pencils around a base cell (`column = i nodes + j`, and k) for a particle of `part`, or `None` if the
    /// particle has left the region the layout was built for.
    #[inline(always)]
    pub fn stencil<T: Real>(&self, part: &Part, [column, z]: [T; 2]) -> Option<Stencil> {
        let number = *self.column_at.get(column.to_f64() as usize)? as usize;
        let z = z.to_f64() as i32;
        if !part.columns.contains(&number) {
            return None;
        }
        let Column { base: (lo, hi), origin } = &self.columns[number];
        if z < *lo || z > *hi {
            return None;
        }
        Some(origin.map(|row| row + z))
    }
}

/// i of the base cells that particles may have before the next build, where they have the cells `sorted` now.
fn slabs_of(sorted: &[[i32; 3]], nodes: usize) -> Range<usize> {
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else { return 0..0 };
    (first[0] as usize).saturating_sub(MARGIN)..(last[0] as usize + MARGIN).min(nodes - 3) + 1
}

/// The order in which keys below `bound` rise; equal ones stay in their order. Counts digits, the lower half first.
fn stable_order(keys: &[u32], bound: usize) -> Vec<u32> {
    let bits = bound.next_power_of_two().trailing_zeros().div_ceil(2);
    let digit_mask = (1u32 << bits) - 1;
    let mut order: Vec<u32> = (0..keys.len() as u32).collect();
    let mut next = order.clone();
    for shift in [0, bits] {
        let digit = |s: u32| (keys[s as usize] >> shift & digit_mask) as usize;
        let mut place = vec![0u32; 1 << bits];
        order.iter().for_each(|&s| place[digit(s)] += 1);
        let mut before = 0;
        for count in &mut place {
            before += std::mem::replace(count, before);
        }
        for &s in &order {
            let place = &mut place[digit(s)];
            next[*place as usize] = s;
            *place += 1;
        }
        std::mem::swap(&mut order, &mut next);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::super::particles::ParticleState;
    use super::*;
    use crate::math::rng::{seeded, uniform};

    fn layout(n: usize) -> (Layout, Packed<f64>) {
        let mut rng = seeded(1, "layout");
        let x = (0..n).map(|_| std::array::from_fn(|_| 0.3 + 0.2 * uniform(&mut rng))).collect();
        let state = ParticleState::at_rest(x);
        let mut packed = Packed::default();
        packed.pack(&state, 64);
        let (layout, order) = Layout::build(64, n, &packed);
        let mut sorted = Packed::default();
        sorted.take_sorted(&packed, &order);
        (layout, sorted)
    }

    #[test]
    fn every_particle_finds_its_nodes_even_after_a_cell_of_drift() {
        let (layout, sorted) = layout(3000);
        for part in &layout.parts {
            for slot in part.blocks.start * LANES..(part.blocks.end * LANES).min(3000) {
                let cell: [f64; 3] = std::array::from_fn(|a| (sorted.cells(slot, a) - 0.5).floor());
                for drift in [[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [-1.0, 1.0, 1.0]] {
                    let moved: [f64; 3] = std::array::from_fn(|a| cell[a] + drift[a]);
                    let column = moved[0] * 64.0 + moved[1];
                    let rows = layout.stencil(part, [column, moved[2]]).expect("within the margin");
                    for row in rows {
                        let row = row as usize;
                        assert!(part.nodes.contains(&row) && row + 4 <= layout.len + 1);
                    }
                }
            }
        }
    }

    #[test]
    fn keys_are_sorted_and_equal_ones_stay_in_order() {
        let mut rng = seeded(3, "keys");
        for (count, bound) in [(0, 1), (5, 1), (1000, 7), (1000, 4096), (1000, 4097), (300, 256 * 256 * 256)]
        {
            let keys: Vec<u32> = (0..count).map(|_| (uniform(&mut rng) * f64::from(bound)) as u32).collect();
            let mut expected: Vec<u32> = (0..count as u32).collect();
            expected.sort_by_key(|&s| keys[s as usize]);
            assert_eq!(stable_order(&keys, bound as usize), expected, "{count} below {bound}");
        }
    }

    #[test]
    fn pencils_tile_the_node_array() {
        let (layout, _) = layout(500);
        let mut next = 0;
        for p in &layout.pencils {
            assert_eq!(p.start, next);
            next += u32::from(p.len) + 1;
        }
        assert_eq!(next as usize, layout.len);
    }
}
