//! The earth mover's distance.

pub mod exact;
