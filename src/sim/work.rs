//! How much was simulated: counters that all simulators of one set of options share.
//!
//! Simulators count, whoever holds the options reads. Wall time depends on the machine; these do not. Imports
//! nothing of donut.

use std::ops::{Add, Sub};
use std::sync::atomic::{AtomicU64, Ordering};

use serde::{Deserialize, Serialize};

/// Counters that several threads add to.
#[derive(Debug, Default)]
pub struct Tally {
    rollouts: AtomicU64,
    gradients: AtomicU64,
}

/// What was counted up to now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Forward passes, with and without tools.
    pub rollouts: u64,
    /// Backward passes.
    pub gradients: u64,
}

impl Tally {
    /// The counts so far.
    pub fn work(&self) -> Work {
        Work {
            rollouts: self.rollouts.load(Ordering::Relaxed),
            gradients: self.gradients.load(Ordering::Relaxed),
        }
    }

    pub(super) fn count_rollout(&self) {
        self.rollouts.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn count_gradient(&self) {
        self.gradients.fetch_add(1, Ordering::Relaxed);
    }
}

impl Sub for Work {
    type Output = Self;

    fn sub(self, before: Self) -> Self {
        Self { rollouts: self.rollouts - before.rollouts, gradients: self.gradients - before.gradients }
    }
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { rollouts: self.rollouts + other.rollouts, gradients: self.gradients + other.gradients }
    }
}
