//! Reading and writing the fields of a packed block.
//!
//! A block is 24 fields of 16 lanes; these helpers name the vector and matrix fields. Beside it stand the
//! *axes* of its particles, kept for the backward pass. Imports lanes.

use super::lanes::{LANES, Lanes, M3};
use super::particles::{ANCHORS, BLOCK};

/// Three consecutive fields.
#[inline(always)]
pub fn load3<L: Lanes>(block: &[L::Real; BLOCK], field: usize) -> [L; 3] {
    let fields = &block.as_chunks::<LANES>().0[field..field + 3];
    [L::load(&fields[0]), L::load(&fields[1]), L::load(&fields[2])]
}

/// The anchors of a block's particles.
#[inline(always)]
pub fn load_anchors<L: Lanes>(anchors: &[L::Real; ANCHORS]) -> [L; 3] {
    let at = |k: usize| L::load(&anchors[k * LANES..(k + 1) * LANES]);
    [at(0), at(1), at(2)]
}

/// Nine consecutive fields, row-major.
#[inline(always)]
pub fn load_m3<L: Lanes>(block: &[L::Real; BLOCK], field: usize) -> M3<L> {
    [load3(block, field), load3(block, field + 3), load3(block, field + 6)]
}

/// Writes three consecutive fields.
#[inline(always)]
pub fn store3<L: Lanes>(block: &mut [L::Real; BLOCK], field: usize, v: &[L; 3]) {
    for (k, lanes) in v.iter().enumerate() {
        lanes.store(&mut block[(field + k) * LANES..(field + k + 1) * LANES]);
    }
}

/// Writes nine consecutive fields.
#[inline(always)]
pub fn store_m3<L: Lanes>(block: &mut [L::Real; BLOCK], field: usize, m: &M3<L>) {
    for (k, row) in m.iter().enumerate() {
        store3(block, field + 3 * k, row);
    }
}

/// Numbers of a block's axes: two columns of a rotation for each particle.
pub const AXES: usize = 6 * LANES;

/// Writes the first two columns of rotations.
#[inline(always)]
pub fn store_axes<L: Lanes>(axes: &mut [L::Real; AXES], u: &M3<L>) {
    for (k, to) in axes.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        u[k / 2][k % 2].store(to);
    }
}

/// Reads rotations back; the third column is the cross product of the two that are kept.
#[inline(always)]
pub fn load_axes<L: Lanes>(axes: &[L::Real; AXES]) -> M3<L> {
    let mut u = [[L::constant(0.0); 3]; 3];
    for (k, from) in axes.as_chunks::<LANES>().0.iter().enumerate() {
        u[k / 2][k % 2] = L::load(from);
    }
    for i in 0..3 {
        let (j, k) = (u[(i + 1) % 3], u[(i + 2) % 3]);
        u[i][2] = j[0].mul_add(k[1], -(k[0] * j[1]));
    }
    u
}
