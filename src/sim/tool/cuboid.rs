//! A box: gripper plates and pusher.
//!
//! A point in the box's frame and the half-extents h come in; distance and gradient go out.
//!
//! ```text
//! c = |p| - h                                        component by component
//! d = |max(c, 0)| + min(max(c_x, c_y, c_z), 0)       outside: to the nearest point; inside: to the nearest face
//! ```
//!
//! The gradient is `sign(p) max(c, 0) / |max(c, 0)|` outside, the normal of the nearest face inside.

use nalgebra::Vector3;

use super::shape::length;

/// How far `p` is beyond each pair of faces.
fn beyond(half_extents: &[f64; 3], p: Vector3<f64>) -> Vector3<f64> {
    p.abs() - Vector3::from(*half_extents)
}

pub fn distance(half_extents: &[f64; 3], p: Vector3<f64>) -> f64 {
    let c = beyond(half_extents, p);
    length(c.sup(&Vector3::zeros())) + c.max().min(0.0)
}

pub fn gradient(half_extents: &[f64; 3], p: Vector3<f64>) -> Vector3<f64> {
    let c = beyond(half_extents, p);
    let outside = c.sup(&Vector3::zeros());
    let mut g = outside / length(outside);
    if c.max() < 0.0 {
        g[c.imax()] = 1.0;
    }
    Vector3::from_fn(|a, _| g[a] * if p[a] < 0.0 { -1.0 } else { 1.0 })
}
