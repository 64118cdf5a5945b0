//! Small mathematics that every layer shares.

pub mod cloud;
pub mod rng;
