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

/// Weights of a block's particles.
pub struct Weights<L: Lanes> {
    /// Per particle: `[wx0 wx1 wx2 cell_x | wy0 wy1 wy2 cell_y | wz0 wz1 wz2 0 | cell_z 0 0 0]`.
    pub rows: ParticleRows<L::Real>,
    /// Position within the base cell, in cells, in [0.5, 1.5).
    pub f: [L; 3],
}

/// From lanes (16 quantities of 16 particles) to particles.
#[inline(always)]
pub fn to_particles<L: Lanes>(mut m: [L; LANES]) -> ParticleRows<L::Real> {
    L::transpose(&mut m);
    let mut rows = [[L::Real::default(); LANES]; LANES];
    for (lanes, row) in m.iter().zip(&mut rows) {
        lanes.store(row);
    }
    rows
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

/// The base cell that a row of [`Weights`] names.
#[inline(always)]
pub fn cell<T: Real>(row: &[T; LANES]) -> [i32; 3] {
    [row[3].to_f64() as i32, row[7].to_f64() as i32, row[12].to_f64() as i32]
}

/// Base cells (`trunc(x/dx - 0.5)`) and weights `(1.5-f)^2/2, 3/4-(f-1)^2, (f-0.5)^2/2` on each axis. `x` is in
/// cells from the node `anchors`.
#[inline(always)]
pub fn weights<L: Lanes>(anchors: &[L; 3], x: &[L; 3]) -> Weights<L> {
    let half = L::constant(0.5);
    let zero = L::constant(0.0);
    let mut m = [zero; LANES];
    let mut f = *x;
    for axis in 0..3 {
        // The base cell counted from the anchor: small integers, so that f is exact.
        let from_anchor = (x[axis] - half).floor().max(-anchors[axis]);
        let base = anchors[axis] + from_anchor;
        f[axis] = x[axis] - from_anchor;
        let (q, s, w) = (L::constant(1.5) - f[axis], f[axis] - L::constant(1.0), f[axis] - half);
        m[4 * axis] = half * q * q;
        m[4 * axis + 1] = L::constant(0.75) - s * s;
        m[4 * axis + 2] = half * w * w;
        m[if axis == 2 { 12 } else { 4 * axis + 3 }] = base;
    }
    Weights { rows: to_particles(m), f }
}

/// Derivatives of the weights by f, in the same places as the weights.
#[inline(always)]
pub fn weight_derivatives<L: Lanes>(f: &[L; 3]) -> ParticleRows<L::Real> {
    let mut m = [L::constant(0.0); LANES];
    for axis in 0..3 {
        m[4 * axis] = f[axis] - L::constant(1.5);
        m[4 * axis + 1] = L::constant(2.0) - (f[axis] + f[axis]);
        m[4 * axis + 2] = f[axis] - L::constant(0.5);
    }
    to_particles(m)
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
            let anchor = (self.0 * 64.0).round();
            let w = weights(&[L::constant(anchor); 3], &[L::constant(self.0 * 64.0 - anchor); 3]);
            (w.rows[3], weight_derivatives(&w.f)[3])
        }
    }

    #[test]
    fn weights_are_a_partition_of_unity_and_their_derivatives_sum_to_zero() {
        // Includes a particle exactly on a cell edge: x/dx = 20.5.
        for x in [0.3, 0.312_345, 20.5 / 64.0, 20.0 / 64.0] {
            let (w, dw) = f64::dispatch(SimdLevel::best(), WeightsOf(x));
            let base = cell(&w);
            for axis in 0..3 {
                let (w, dw) = (&w[4 * axis..4 * axis + 3], &dw[4 * axis..4 * axis + 3]);
                approx::assert_relative_eq!(w.iter().sum::<f64>(), 1.0, epsilon = 1e-14);
                assert!(dw.iter().sum::<f64>().abs() < 1e-14);
                let mean: f64 = (0..3).map(|k| w[k] * f64::from(base[axis] + k as i32)).sum();
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
