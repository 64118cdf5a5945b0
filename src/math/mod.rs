//! Small mathematics that every layer shares.

pub mod check;
pub mod cloud;
pub mod neighbours;
pub mod quaternion;
pub mod rng;
