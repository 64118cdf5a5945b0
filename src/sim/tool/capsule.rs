//! A capsule: rolling pin and pole.
//!
//! A point in the capsule's frame comes in (axis along y, centred); distance and derivatives go out.
//!
//! ```text
//! c(p) = (0, clamp(p_y, -length/2, length/2), 0)     nearest point of the axis
//! d    = |p - c| - radius
//! grad = (p - c) / |p - c|                           c moves along y only, where p - c is zero beside the axis
//! ```

use nalgebra::Vector3;

use super::shape::{direction_adj, length};

/// From the nearest point of the axis to `p`.
fn from_axis(axis_length: f64, p: Vector3<f64>) -> Vector3<f64> {
    let y = p.y + 0.5 * axis_length;
    Vector3::new(p.x, y - y.clamp(0.0, axis_length), p.z)
}

pub fn distance(radius: f64, axis_length: f64, p: Vector3<f64>) -> f64 {
    length(from_axis(axis_length, p)) - radius
}

/// Beside the axis the vector has no y component, so this is right beyond its ends and between them.
pub fn gradient(axis_length: f64, p: Vector3<f64>) -> Vector3<f64> {
    let u = from_axis(axis_length, p);
    u / length(u)
}

pub fn gradient_adj(axis_length: f64, p: Vector3<f64>, n_adj: Vector3<f64>) -> Vector3<f64> {
    let u = from_axis(axis_length, p);
    let mut u_adj = direction_adj(u, n_adj);
    if u.y == 0.0 {
        u_adj.y = 0.0;
    }
    u_adj
}
