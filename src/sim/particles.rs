//! Particle states: the plain form that callers see and the packed form that kernels run on.
//!
//! Plain: one entry a particle, f64, original order. Packed: blocks of sixteen particles, 24 fields of
//! 16 lanes each, in the order of the current layout. Imports lanes.
//!
//! A packed position is measured in cells from the particle's *anchor*, the grid node nearest to it when it was
//! last sorted. A step of dt v is some 1e-5 m; added to a coordinate of 0.5 m in f32 it would be rounded to
//! 6e-8 m, 800 times in a horizon of 40 control steps, and the gradient would feel it (GUIDE, "Precision").
//! Within a cell of the anchor the rounding is 32 times finer or better, and no weight loses digits to a
//! difference of large numbers. For the same reason a packed deformation gradient is F - I
//! ([`constitutive`](super::constitutive)).

use super::lanes::{LANES, Real};
use crate::math::cloud::Point;

/// Fields of a packed particle: x, v, C, F.
pub const FIELDS: usize = 24;
/// Index of the first component of the position in a packed particle, in cells from the anchor.
pub const X: usize = 0;
/// .. of the velocity.
pub const V: usize = 3;
/// .. of the affine matrix, row-major.
pub const C: usize = 6;
/// .. of the deformation gradient less the identity, F - I, row-major.
pub const F: usize = 15;
/// Numbers in a packed block.
pub const BLOCK: usize = FIELDS * LANES;
/// Numbers in a block's anchors: three coordinates of 16 lanes each.
pub const ANCHORS: usize = 3 * LANES;

/// State of `n` particles in the caller's order.
#[derive(Clone, Debug, PartialEq)]
pub struct ParticleState {
    /// Positions, m.
    pub x: Vec<Point>,
    /// Velocities, m/s.
    pub v: Vec<Point>,
    /// Affine velocity matrices (APIC's C), 1/s, row-major.
    pub c: Vec<[f64; 9]>,
    /// Elastic deformation gradients, row-major.
    pub f: Vec<[f64; 9]>,
}

/// The identity matrix, row-major.
pub const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

impl ParticleState {
    /// Particles at rest, undeformed, at the given positions.
    pub fn at_rest(x: Vec<Point>) -> Self {
        let n = x.len();
        Self { x, v: vec![[0.0; 3]; n], c: vec![[0.0; 9]; n], f: vec![IDENTITY; n] }
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// The particles `ids` alone, in that order.
    pub fn select(&self, ids: &[usize]) -> Self {
        Self {
            x: ids.iter().map(|&i| self.x[i]).collect(),
            v: ids.iter().map(|&i| self.v[i]).collect(),
            c: ids.iter().map(|&i| self.c[i]).collect(),
            f: ids.iter().map(|&i| self.f[i]).collect(),
        }
    }

    /// All numbers of particle `i`, in packed order.
    pub(crate) fn fields(&self, i: usize) -> [f64; FIELDS] {
        let mut out = [0.0; FIELDS];
        out[X..V].copy_from_slice(&self.x[i]);
        out[V..C].copy_from_slice(&self.v[i]);
        out[C..F].copy_from_slice(&self.c[i]);
        out[F..].copy_from_slice(&self.f[i]);
        out
    }

    /// The same four quantities of `n` particles, all zero: where adjoints accumulate.
    pub(crate) fn zeros(n: usize) -> Self {
        Self { x: vec![[0.0; 3]; n], v: vec![[0.0; 3]; n], c: vec![[0.0; 9]; n], f: vec![[0.0; 9]; n] }
    }

    pub(crate) fn set_fields(&mut self, i: usize, from: &[f64; FIELDS]) {
        self.x[i].copy_from_slice(&from[X..V]);
        self.v[i].copy_from_slice(&from[V..C]);
        self.c[i].copy_from_slice(&from[C..F]);
        self.f[i].copy_from_slice(&from[F..]);
    }
}

/// Blocks needed for `n` particles.
pub fn blocks_for(n: usize) -> usize {
    n.div_ceil(LANES)
}

/// Where field `field` of packed particle `slot` stands.
#[inline(always)]
pub fn index(slot: usize, field: usize) -> usize {
    (slot / LANES) * BLOCK + field * LANES + slot % LANES
}

/// Where coordinate `axis` of the anchor of packed particle `slot` stands.
#[inline(always)]
pub fn anchor_index(slot: usize, axis: usize) -> usize {
    (slot / LANES) * ANCHORS + axis * LANES + slot % LANES
}

/// Particles in blocks, with the anchors that their positions are measured from.
#[derive(Clone, Debug, Default)]
pub struct Packed<T> {
    pub fields: Vec<T>,
    /// Indices of grid nodes, three a particle: integers.
    pub anchors: Vec<T>,
}

impl<T: Real> Packed<T> {
    /// Makes room for `n` particles; unused lanes of the last block become undeformed particles at rest on
    /// node 0, which no kernel scatters.
    fn fit(&mut self, n: usize) {
        self.fields.resize(blocks_for(n) * BLOCK, T::default());
        self.anchors.resize(blocks_for(n) * ANCHORS, T::default());
        for slot in n..blocks_for(n) * LANES {
            for field in 0..FIELDS {
                self.fields[index(slot, field)] = T::default();
            }
            for axis in 0..3 {
                self.anchors[anchor_index(slot, axis)] = T::default();
            }
        }
    }

    /// Packs `state` in the caller's order, for a grid of `nodes` nodes an axis.
    pub fn pack(&mut self, state: &ParticleState, nodes: usize) {
        self.fit(state.len());
        for slot in 0..state.len() {
            let mut fields = state.fields(slot);
            fields[F..].iter_mut().zip(IDENTITY).for_each(|(f, one)| *f -= one);
            for (field, v) in fields.into_iter().enumerate() {
                self.fields[index(slot, field)] = T::from_f64(v);
            }
            for axis in 0..3 {
                let cells = state.x[slot][axis] * nodes as f64;
                let anchor = cells.round();
                self.anchors[anchor_index(slot, axis)] = T::from_f64(anchor);
                self.fields[index(slot, X + axis)] = T::from_f64(cells - anchor);
            }
        }
    }

    /// Coordinate `axis` of packed particle `slot`, in cells.
    #[inline(always)]
    pub fn cells(&self, slot: usize, axis: usize) -> f64 {
        self.anchors[anchor_index(slot, axis)].to_f64() + self.fields[index(slot, X + axis)].to_f64()
    }

    /// The inverse of [`Packed::pack`]; packed particle `slot` is the caller's `ids[slot]`.
    pub fn unpack(&self, nodes: usize, ids: &[u32]) -> ParticleState {
        let mut state = unpack_fields(&self.fields, ids);
        for (slot, &i) in ids.iter().enumerate() {
            let i = i as usize;
            state.x[i] = std::array::from_fn(|axis| self.cells(slot, axis) / nodes as f64);
            state.f[i].iter_mut().zip(IDENTITY).for_each(|(f, one)| *f += one);
        }
        state
    }

    /// Takes the particles of `from` in a new order: slot `s` receives slot `from_slot[s]`. Each gets the node
    /// that is nearest now for its anchor; no position is rounded, for the distance to a nearer node is a
    /// multiple of the old distance's last digit.
    pub fn take_sorted(&mut self, from: &Self, from_slot: &[u32]) {
        self.fit(from_slot.len());
        let blocks = self.fields.as_chunks_mut::<BLOCK>().0;
        for (block, olds) in blocks.iter_mut().zip(from_slot.chunks(LANES)) {
            let mut starts = [0; LANES];
            starts.iter_mut().zip(olds).for_each(|(start, &old)| *start = index(old as usize, 0));
            for (field, row) in block.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
                for (to, start) in row[..olds.len()].iter_mut().zip(starts) {
                    *to = from.fields[start + field * LANES];
                }
            }
        }
        for (slot, &old) in from_slot.iter().enumerate() {
            for axis in 0..3 {
                let x = &mut self.fields[index(slot, X + axis)];
                let cells = x.to_f64();
                // Most are still nearest to the anchor that they have.
                let shift = T::from_f64(if cells.abs() < 0.5 { 0.0 } else { cells.round() });
                *x -= shift;
                self.anchors[anchor_index(slot, axis)] =
                    from.anchors[anchor_index(old as usize, axis)] + shift;
            }
        }
    }
}

/// Plain numbers from packed fields, positions as they stand there.
fn unpack_fields<T: Real>(fields: &[T], ids: &[u32]) -> ParticleState {
    let mut state = ParticleState::zeros(ids.len());
    for (slot, &i) in ids.iter().enumerate() {
        let one = std::array::from_fn(|field| fields[index(slot, field)].to_f64());
        state.set_fields(i as usize, &one);
    }
    state
}

/// The adjoint of [`Packed::pack`]: a position's adjoint is per m in the plain state, per cell in the packed.
pub fn pack_adj<T: Real>(packed_adj: &[T], nodes: usize, ids: &[u32]) -> ParticleState {
    let mut state_adj = unpack_fields(packed_adj, ids);
    state_adj.x.as_flattened_mut().iter_mut().for_each(|v| *v *= nodes as f64);
    state_adj
}

/// The adjoint of [`Packed::take_sorted`]: slot `from_slot[s]` of `from_adj` is slot `s` of `to_adj`.
pub fn permute_adj<T: Real>(from_slot: &[u32], to_adj: &[T], from_adj: &mut [T]) {
    from_adj.fill(T::default());
    for (slot, &old) in from_slot.iter().enumerate() {
        for field in 0..FIELDS {
            from_adj[index(old as usize, field)] = to_adj[index(slot, field)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(n: u32) -> ParticleState {
        let x = |i: u32| [0.1 + 0.04 * f64::from(i), 0.5, 0.25];
        let mut state = ParticleState::at_rest((0..n).map(x).collect());
        state.c[3][4] = 7.0;
        state
    }

    fn mixed(n: u32) -> Vec<u32> {
        (0..n).map(|i| (i * 7) % n).collect()
    }

    #[test]
    fn packing_and_sorting_lose_nothing_in_double_precision() {
        let state = state(19);
        let (mut packed, mut sorted) = (Packed::<f64>::default(), Packed::default());
        packed.pack(&state, 64);
        sorted.take_sorted(&packed, &mixed(19));
        // Sorting a caller's order gives the order itself.
        assert_eq!(sorted.unpack(64, &mixed(19)), state);

        let mut back = vec![0.0; sorted.fields.len()];
        permute_adj(&mixed(19), &sorted.fields, &mut back);
        assert_eq!(back, packed.fields);
        let identity: Vec<u32> = (0..19).collect();
        let adj = pack_adj(&back, 64, &identity);
        assert_eq!((adj.x[3][0], adj.c[3][4]), (64.0 * packed.fields[index(3, X)], 7.0));
    }

    #[test]
    fn single_precision_keeps_positions_to_a_thirtieth_of_a_millionth_of_a_cell() {
        let state = state(19);
        let mut packed = Packed::<f32>::default();
        packed.pack(&state, 50);
        let identity: Vec<u32> = (0..19).collect();
        let worst = |packed: &Packed<f32>, ids: &[u32], shift: f64| {
            let back = packed.unpack(50, ids);
            let pairs = back.x.as_flattened().iter().zip(state.x.as_flattened());
            pairs.map(|(a, b)| (a - b - shift).abs() * 50.0).fold(0.0, f64::max)
        };
        assert!(worst(&packed, &identity, 0.0) <= 0.5f64.powi(25));
        // Particles drift by 1.25 cells; new anchors add no rounding.
        for slot in 0..19 {
            for axis in 0..3 {
                packed.fields[index(slot, X + axis)] += 1.25;
            }
        }
        let before = worst(&packed, &identity, 1.25 / 50.0);
        let mut sorted = Packed::default();
        sorted.take_sorted(&packed, &mixed(19));
        assert_eq!(worst(&sorted, &mixed(19), 1.25 / 50.0), before);
        assert!((0..19).all(|slot| sorted.fields[index(slot, X)].abs() <= 0.5));
    }
}
