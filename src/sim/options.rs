//! How a simulator runs: threads, instructions, memory.
//!
//! A caller's choices come in, a [`Simulator`](super::Simulator) keeps them. Imports lanes and the tally.

use std::sync::Arc;

use super::lanes::SimdLevel;
use super::work::Tally;

/// How a simulator runs; none of it changes results beyond rounding.
#[derive(Clone, Debug)]
pub struct Options {
    /// Threads that share a rollout's work. The result does not depend on it.
    pub threads: usize,
    /// Instructions to use.
    pub simd: SimdLevel,
    /// Memory for the substeps that the backward pass needs, bytes. What does not fit is run again from
    /// the start of its control step.
    pub memory_limit: usize,
    /// Where rollouts and gradients are counted; clones of the options share it.
    pub tally: Arc<Tally>,
}

impl Default for Options {
    fn default() -> Self {
        Self { threads: 1, simd: SimdLevel::best(), memory_limit: 4 << 30, tally: Arc::default() }
    }
}
