//! Small mathematics that every layer shares.

pub mod check;
pub mod cloud;
pub mod hollow;
pub mod hull;
pub mod kd_tree;
pub mod neighbours;
pub mod quaternion;
pub mod rng;
pub mod volume;
