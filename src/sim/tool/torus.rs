//! A torus, a plain primitive.
//!
//! A point in the torus's frame comes in (axis along y, centred); distance, gradient and the gradient's
//! adjoint go out. In the half-plane of the point and the axis a torus is a circle around the ring.
//!
//! ```text
//! c = (sqrt(p_x^2 + p_z^2) - radius, p_y),   d = |c| - tube_radius
//! ```

use nalgebra::Vector3;

use super::cylinder::across;
use super::shape::{direction_adj, length};

/// From the nearest point of the ring to `p`, as (away from the axis, along the axis, 0).
fn from_ring(radius: f64, p: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(length(across(p)) - radius, p.y, 0.0)
}

pub fn distance(radius: f64, tube_radius: f64, p: Vector3<f64>) -> f64 {
    length(from_ring(radius, p)) - tube_radius
}

pub fn gradient(radius: f64, p: Vector3<f64>) -> Vector3<f64> {
    let q = from_ring(radius, p);
    let g = q / length(q);
    let u = across(p);
    u / length(u) * g.x + Vector3::y() * g.y
}

pub fn gradient_adj(radius: f64, p: Vector3<f64>, n_adj: Vector3<f64>) -> Vector3<f64> {
    let q = from_ring(radius, p);
    let u = across(p);
    let radial = u / length(u);
    let q_adj = direction_adj(q, Vector3::new(radial.dot(&n_adj), n_adj.y, 0.0));
    let mut p_adj = direction_adj(u, across(n_adj) * (q.x / length(q)));
    p_adj += radial * q_adj.x;
    p_adj.y += q_adj.y;
    p_adj
}
