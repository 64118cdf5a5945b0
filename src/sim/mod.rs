//! The differentiable MLS-MPM simulator.

pub mod params;
pub mod tool;
