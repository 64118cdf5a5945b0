//! Particle states: the plain form that callers see and the packed form that kernels run on.
//!
//! Plain: one entry a particle, f64, original order. Packed: blocks of sixteen particles, 24 fields of
//! 16 lanes each, in the order of the current layout. Imports lanes.

use super::lanes::{LANES, Real};
use crate::math::cloud::Point;

/// Fields of a packed particle: x, v, C, F.
pub const FIELDS: usize = 24;
/// Index of the first component of the position in a packed particle.
pub const X: usize = 0;
/// .. of the velocity.
pub const V: usize = 3;
/// .. of the affine matrix, row-major.
pub const C: usize = 6;
/// .. of the deformation gradient, row-major.
pub const F: usize = 15;
/// Numbers in a packed block.
pub const BLOCK: usize = FIELDS * LANES;

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

/// Packs particle `order[slot]` into `slot`, for every slot; unused lanes of the last block become
/// undeformed particles at rest in the middle of the world, which no kernel scatters.
pub fn pack<T: Real>(state: &ParticleState, order: &[u32], packed: &mut [T]) {
    pad(state.len(), packed);
    for (slot, &i) in order.iter().enumerate() {
        for (field, v) in state.fields(i as usize).into_iter().enumerate() {
            packed[index(slot, field)] = T::from_f64(v);
        }
    }
}

/// Writes harmless particles into the unused lanes.
fn pad<T: Real>(n: usize, packed: &mut [T]) {
    let idle = ParticleState::at_rest(vec![[0.5; 3]]).fields(0);
    for slot in n..blocks_for(n) * LANES {
        for (field, v) in idle.into_iter().enumerate() {
            packed[index(slot, field)] = T::from_f64(v);
        }
    }
}

/// The inverse of [`pack`].
pub fn unpack<T: Real>(packed: &[T], order: &[u32]) -> ParticleState {
    let mut state = ParticleState::zeros(order.len());
    for (slot, &i) in order.iter().enumerate() {
        let fields = std::array::from_fn(|field| packed[index(slot, field)].to_f64());
        state.set_fields(i as usize, &fields);
    }
    state
}

/// Moves packed particles: slot `s` of `to` is slot `from_slot[s]` of `from`.
pub fn permute<T: Real>(from: &[T], from_slot: &[u32], to: &mut [T]) {
    pad(from_slot.len(), to);
    for (slot, &old) in from_slot.iter().enumerate() {
        for field in 0..FIELDS {
            to[index(slot, field)] = from[index(old as usize, field)];
        }
    }
}

/// The adjoint of [`permute`]: slot `from_slot[s]` of `from_adj` is slot `s` of `to_adj`.
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

    #[test]
    fn packing_and_permuting_are_inverse() {
        let mut state = ParticleState::at_rest((0..19).map(|i| [f64::from(i), 0.5, 0.25]).collect());
        state.c[3][4] = 7.0;
        let order: Vec<u32> = (0..19).rev().collect();
        let mut packed = vec![0.0f64; blocks_for(19) * BLOCK];
        pack(&state, &order, &mut packed);
        assert_eq!(unpack(&packed, &order), state);

        let from_slot: Vec<u32> = (0..19).map(|i| (i * 7) % 19).collect();
        let mut moved = vec![0.0; packed.len()];
        permute(&packed, &from_slot, &mut moved);
        let mut back = vec![0.0; packed.len()];
        permute_adj(&from_slot, &moved, &mut back);
        assert_eq!(unpack(&back, &order), state);
    }
}
