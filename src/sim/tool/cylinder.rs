//! A cylinder with flat ends, a plain primitive.
//!
//! A point in the cylinder's frame comes in (axis along y, centred); distance, gradient and the gradient's
//! adjoint go out. In the half-plane of the point and the axis a cylinder is a rectangle, whose exact
//! distance has three regions: beside the wall, above an end, and beyond the rim.
//!
//! ```text
//! c = (sqrt(p_x^2 + p_z^2) - radius, |p_y| - length/2)
//! d = |c| if both are positive (beyond the rim), else max(c)
//! ```

use nalgebra::{Vector2, Vector3};

use super::shape::{direction_adj, length};

/// The part of `p` across the axis.
pub(super) fn across(p: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(p.x, 0.0, p.z)
}

/// How far `p` is beyond the wall, and beyond the end on its side.
fn beyond(radius: f64, axis_length: f64, p: Vector3<f64>) -> Vector2<f64> {
    Vector2::new(length(across(p)) - radius, p.y.abs() - 0.5 * axis_length)
}

/// Whether the rim is the nearest part of the surface.
fn nearest_is_rim(c: Vector2<f64>) -> bool {
    c.x > 0.0 && c.y > 0.0
}

/// The gradient in the half-plane: away from the wall, and away from the end.
fn outward(c: Vector2<f64>) -> Vector2<f64> {
    if nearest_is_rim(c) {
        c.normalize()
    } else if c.x > c.y {
        Vector2::x()
    } else {
        Vector2::y()
    }
}

pub fn distance(radius: f64, axis_length: f64, p: Vector3<f64>) -> f64 {
    let c = beyond(radius, axis_length, p);
    if nearest_is_rim(c) { c.norm() } else { c.max() }
}

pub fn gradient(radius: f64, axis_length: f64, p: Vector3<f64>) -> Vector3<f64> {
    let g = outward(beyond(radius, axis_length, p));
    let u = across(p);
    u / length(u) * g.x + Vector3::y() * (g.y * 1f64.copysign(p.y))
}

/// Beside the wall only the direction across the axis turns with `p`, above an end nothing does; beyond the
/// rim the gradient `c / |c|` turns too.
pub fn gradient_adj(radius: f64, axis_length: f64, p: Vector3<f64>, n_adj: Vector3<f64>) -> Vector3<f64> {
    let c = beyond(radius, axis_length, p);
    let g = outward(c);
    let u = across(p);
    let mut p_adj = direction_adj(u, across(n_adj) * g.x);
    if nearest_is_rim(c) {
        let side = 1f64.copysign(p.y);
        let radial = u / length(u);
        let g_adj = Vector2::new(radial.dot(&n_adj), side * n_adj.y);
        let c_adj = (g_adj - g * g.dot(&g_adj)) / c.norm();
        p_adj += radial * c_adj.x;
        p_adj.y += side * c_adj.y;
    }
    p_adj
}
