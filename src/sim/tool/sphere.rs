//! A ball.
//!
//! A point in the ball's frame comes in; distance `|p| - radius` and its derivatives go out.

use nalgebra::Vector3;

use super::shape::{direction_adj, length};

pub fn distance(radius: f64, p: Vector3<f64>) -> f64 {
    length(p) - radius
}

pub fn gradient(p: Vector3<f64>) -> Vector3<f64> {
    p / length(p)
}

pub fn gradient_adj(p: Vector3<f64>, n_adj: Vector3<f64>) -> Vector3<f64> {
    direction_adj(p, n_adj)
}
