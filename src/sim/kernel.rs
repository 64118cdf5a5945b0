//! Quadratic B-spline weights, and the turn between lanes and particles.
//!
//! A particle at x acts on the 3 x 3 x 3 nodes around it. On each axis, with the coordinate measured in cells,
//!
//! ```text
//! base = floor(x / dx - 1/2)              the lowest of the three nodes
//! f    = x / dx - base                    in [1/2, 3/2)
//! w_0  = (3/2 - f)^2 / 2                  w_0' = f - 3/2
//! w_1  = 3/4 - (f - 1)^2                  w_1' = 2 - 2 f
//! w_2  = (f - 1/2)^2 / 2                  w_2' = f - 1/2
//! ```
//!
//! and a node's weight is the product over the axes (B-splines). The weights are positive, continuous with their
//! first derivatives as a particle changes cells, and have the moments
//!
//! ```text
//! sum_k w_k = 1,   sum_k w_k k = f,   sum_k w_k (k - f)^2 = 1/4
//! ```
//!
//! The first makes transfers keep mass and momentum, the second lets a linear velocity field pass unchanged, the
//! third is the `dx^2 / 4` whose inverse stands in MLS-MPM's affine matrices. `w'` is by f; by x it is `w' / dx`.
//!
//! Positions of a block come in, measured from the particles' anchors; for each particle its base cell, its nine
//! weights and their derivatives go out (Steffen et al. 2008). Imports lanes.

use super::lanes::{LANES, Lanes, Real};

/// Sixteen numbers for each of a block's sixteen particles.
pub type ParticleRows<T> = [[T; LANES]; LANES];

/// A buffer for [`ParticleRows`]. Kernels make it once and not for every block: clearing it costs as much as
/// filling it.
#[inline(always)]
pub fn no_rows<T: Real>() -> ParticleRows<T> {
    [[T::default(); LANES]; LANES]
}

/// From lanes (16 quantities of 16 particles) to particles.
#[inline(always)]
pub fn to_particles<L: Lanes>(mut m: [L; LANES], rows: &mut ParticleRows<L::Real>) {
    L::transpose(&mut m);
    for (lanes, row) in m.iter().zip(rows) {
        lanes.store(row);
    }
}

/// From particles to lanes.
#[inline(always)]
pub fn to_lanes<L: Lanes>(rows: &ParticleRows<L::Real>) -> [L; LANES] {
    let mut m = [L::constant(0.0); LANES];
    for (lanes, row) in m.iter_mut().zip(rows) {
        *lanes = L::load(row);
    }
    L::transpose(&mut m);
    m
}

/// The base cell that a row of [`weights`] names: column and z.
#[inline(always)]
pub fn cell<T: Real>(row: &[T; LANES]) -> [T; 2] {
    [row[3], row[7]]
}

/// Base cells (`trunc(x/dx - 0.5)`) and weights `(1.5-f)^2/2, 3/4-(f-1)^2, (f-0.5)^2/2` on each axis. `x` is in
/// cells from the node `anchors`.
///
/// Returns f, the position within the base cell, in cells, in [0.5, 1.5). Writes for each particle
/// `[wx0 wx1 wx2 column | wy0 wy1 wy2 cell_z | wz0 wz1 wz2 0 | dx dy dz 0]`. The base cell is
/// `column = cell_x nodes + cell_y` and `cell_z`, both exact; dx, dy, dz are the derivatives of the first
/// weights, from which the others follow ([`derivatives`]).
#[inline(always)]
pub fn weights<L: Lanes>(
    nodes: usize,
    anchors: &[L; 3],
    x: &[L; 3],
    rows: &mut ParticleRows<L::Real>,
) -> [L; 3] {
    let (scale, half) = (L::constant(nodes as f64), L::constant(0.5));
    let zero = L::constant(0.0);
    let mut m = [zero; LANES];
    let (mut f, mut base) = (*x, *x);
    for axis in 0..3 {
        // The base cell counted from the anchor: small integers, so that f is exact.
        let from_anchor = (x[axis] - half).floor().max(-anchors[axis]);
        base[axis] = anchors[axis] + from_anchor;
        f[axis] = x[axis] - from_anchor;
        let (d, s, w) = (f[axis] - L::constant(1.5), f[axis] - L::constant(1.0), f[axis] - half);
        m[4 * axis] = half * d * d;
        m[4 * axis + 1] = L::constant(0.75) - s * s;
        m[4 * axis + 2] = half * w * w;
        m[12 + axis] = d;
    }
    m[3] = base[0].mul_add(scale, base[1]);
    m[7] = base[2];
    to_particles(m, rows);
    f
}

/// Derivatives of an axis's three weights by f, from that of the first: they sum to zero, and the last is
/// one more than the first.
#[inline(always)]
pub fn derivatives<L: Lanes>(first: L) -> [L; 3] {
    let last = first + L::constant(1.0);
    [first, -(first + last), last]
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{Kernel, SimdLevel};
    use super::*;

    /// Weights at this coordinate of a grid of 64 nodes.
    struct WeightsOf(f64);
    impl Kernel<f64> for WeightsOf {
        type Output = ([f64; LANES], [f64; LANES]);
        #[inline(always)]
        fn run<L: Lanes<Real = f64>>(self) -> Self::Output {
            let mut rows = no_rows();
            let anchor = (self.0 * 64.0).round();
            weights(64, &[L::constant(anchor); 3], &[L::constant(self.0 * 64.0 - anchor); 3], &mut rows);
            let row = rows[3];
            let mut dw = [0.0; LANES];
            for axis in 0..3 {
                for (k, d) in derivatives(L::splat(row[12 + axis])).into_iter().enumerate() {
                    let mut lanes = [0.0; LANES];
                    d.store(&mut lanes);
                    dw[4 * axis + k] = lanes[0];
                }
            }
            (row, dw)
        }
    }

    #[test]
    fn weights_are_a_partition_of_unity_and_their_derivatives_sum_to_zero() {
        // Includes a particle exactly on a cell edge: x/dx = 20.5.
        for x in [0.3, 0.312_345, 20.5 / 64.0, 20.0 / 64.0] {
            let (w, dw) = f64::dispatch(SimdLevel::best(), WeightsOf(x));
            let [column, z] = cell(&w);
            let base = [(column / 64.0).floor(), column % 64.0, z];
            for axis in 0..3 {
                let (w, dw) = (&w[4 * axis..4 * axis + 3], &dw[4 * axis..4 * axis + 3]);
                approx::assert_relative_eq!(w.iter().sum::<f64>(), 1.0, epsilon = 1e-14);
                assert!(dw.iter().sum::<f64>().abs() < 1e-14);
                let mean: f64 = (0..3).map(|k| w[k] * (base[axis] + k as f64)).sum();
                approx::assert_relative_eq!(mean, x * 64.0, epsilon = 1e-12);
            }
        }
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let h = 1e-6;
        for x in [0.31, 0.3199] {
            let (_, dw) = f64::dispatch(SimdLevel::best(), WeightsOf(x));
            let (up, _) = f64::dispatch(SimdLevel::best(), WeightsOf(x + h / 64.0));
            let (down, _) = f64::dispatch(SimdLevel::best(), WeightsOf(x - h / 64.0));
            for k in [0, 1, 2, 4, 5, 6, 8, 9, 10] {
                approx::assert_relative_eq!(dw[k], (up[k] - down[k]) / (2.0 * h), epsilon = 1e-8);
            }
        }
    }
}
