//! PASTA's knife: a box whose lower edge a prism sharpens to a wedge.
//!
//! A point in the knife's frame comes in; distance and gradient go out.
//!
//! With g the point in the prism's frame (turned by the knife's quaternion) and sizes (a, b):
//!
//! ```text
//! d_tri   = max(0.866025 |g_x| + g_y / 2, -g_y) - a / 2      an equilateral triangle in x and y
//! d_prism = max(|g_z| - b, d_tri)
//! d       = max(d_prism, d_box)                              what both share
//! ```
//!
//! The maximum of two distances is exact inside and next to faces, and too small beyond edges. The gradient is that of
//! the larger of the two.

use nalgebra::Vector3;

use super::cuboid;
use crate::math::quaternion::{Quaternion, rotation_matrix};

/// cos 30 degrees, to the digits that PlasticineLab uses.
const COS_30: f64 = 0.866025;

/// Which of the prism's faces is nearest, its distance, and its outward normal in the prism's frame.
fn prism(size: &[f64; 2], g: Vector3<f64>) -> (f64, Vector3<f64>) {
    let slanted = COS_30 * g.x.abs() + 0.5 * g.y;
    let side = if g.x < 0.0 { -COS_30 } else { COS_30 };
    let (triangle, normal) = if slanted >= -g.y {
        (slanted - 0.5 * size[0], Vector3::new(side, 0.5, 0.0))
    } else {
        (-g.y - 0.5 * size[0], Vector3::new(0.0, -1.0, 0.0))
    };
    let end = g.z.abs() - size[1];
    if end > triangle { (end, Vector3::new(0.0, 0.0, g.z.signum())) } else { (triangle, normal) }
}

pub fn distance(half_extents: &[f64; 3], size: &[f64; 2], rotation: Quaternion, p: Vector3<f64>) -> f64 {
    let g = rotation_matrix(rotation).tr_mul(&p);
    prism(size, g).0.max(cuboid::distance(half_extents, p))
}

pub fn gradient(
    half_extents: &[f64; 3],
    size: &[f64; 2],
    rotation: Quaternion,
    p: Vector3<f64>,
) -> Vector3<f64> {
    let r = rotation_matrix(rotation);
    let (d, normal) = prism(size, r.tr_mul(&p));
    if d > cuboid::distance(half_extents, p) { r * normal } else { cuboid::gradient(half_extents, p) }
}
