//! Algorithm 1 of the paper.

pub mod settings;
