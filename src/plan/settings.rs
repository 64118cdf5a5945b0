//! The planner's parameters: what a task file's `[planner]` table holds.

use serde::{Deserialize, Serialize};

pub use crate::emd::reach::Method as Reach;

/// Parameters of Algorithm 1. Symbols are the paper's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannerSettings {
    /// K: steps of the move in EMD space.
    pub emd_steps: usize,
    /// alpha: how far a particle moves in one of those steps, m.
    pub emd_step_length_m: f64,
    /// How the move is computed: `exact` matching or `sinkhorn` gradients.
    pub reach: Reach,
    /// L: control steps that are optimised and executed together.
    pub horizon: usize,
    /// J: gradient iterations per horizon.
    pub iterations: usize,
    /// Control steps a stage may take.
    pub max_steps: usize,
    /// Adam's learning rate on the actions (which lie in [-1, 1]).
    pub learning_rate: f64,
    /// Weights of the losses: point to point, tool distance, velocity.
    pub loss_weights: [f64; 3],
    /// How start poses are scored: `nearness` as in the paper, or `direction`.
    pub start_score: StartScore,
    /// delta: keeps the start-pose score finite at contact, m.
    pub pose_delta_m: f64,
    /// tau: the stage is done when its EMD is below this, m.
    pub emd_tolerance_m: f64,
    /// A segment that lowers the EMD by less than this share is followed by a new start; 0 as in the paper.
    pub reset_below_gain: f64,
    /// Failed segments in a row after which a stage gives up.
    pub max_failures: usize,
}

/// What makes a start pose good.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StartScore {
    /// Near the dough that should move most: the paper's formula.
    Nearness,
    /// Near dough that should move away from the tool. A gripper, which acts by holding, still goes by
    /// nearness.
    Direction,
}
