//! Reading and writing the fields of a packed block.
//!
//! A block is 24 fields of 16 lanes; these helpers name the vector and matrix fields. Imports lanes.

use super::lanes::{LANES, Lanes, M3};
use super::particles::{ANCHORS, BLOCK};

/// Three consecutive fields.
#[inline(always)]
pub fn load3<L: Lanes>(block: &[L::Real; BLOCK], field: usize) -> [L; 3] {
    let at = |k: usize| L::load(&block[(field + k) * LANES..(field + k + 1) * LANES]);
    [at(0), at(1), at(2)]
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
