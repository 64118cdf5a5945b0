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
    /// Orientations tried for a start pose: the rest pose's, turned about the vertical in so many equal parts of a circle.
    #[serde(default = "rest_only")]
    pub start_turns: usize,
    /// delta: keeps the start-pose score finite at contact, m.
    pub pose_delta_m: f64,
    /// tau: the stage is done when its EMD is below this, m.
    pub emd_tolerance_m: f64,
    /// A segment that lowers the EMD by less than this share is followed by a new start: none with 0, as in the
    /// paper, all with 1.
    pub reset_below_gain: f64,
    /// Failed segments in a row after which a stage gives up.
    pub max_failures: usize,
}

/// `start_turns` where a task file does not say.
fn rest_only() -> usize {
    1
}

/// How a stage is planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// A search over strokes, coarse to fine, refined by gradients.
    #[default]
    Donut,
    /// `donut` without the language model's subgoals: the last goal for every tool of the plan in turn.
    DonutNoStages,
    /// Algorithm 1 of the paper.
    Paper,
    /// `paper` with the EMD to the subgoal as loss, instead of DiffPhysics-P2P.
    PaperNoP2p,
    /// `paper` without initial position selection: the tool starts over the dough where it waits.
    PaperNoPlacement,
    /// `paper` without tool reset.
    PaperNoReset,
    /// `paper` without the language model's subgoals.
    PaperNoStages,
    /// The paper's baseline: gradients of the EMD to the last goal, all actions of a tool at once.
    DiffPhysics,
}

impl Method {
    /// What `--method` and results call it.
    pub fn name(self) -> String {
        let value = clap::ValueEnum::to_possible_value(&self).expect("no variant is skipped");
        value.get_name().to_owned()
    }

    /// The method of that name.
    pub fn named(name: &str) -> Option<Self> {
        clap::ValueEnum::from_str(name, false).ok()
    }
}

/// How much a search may cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// For a first look.
    Quick,
    /// What the published scores were made with.
    #[default]
    Normal,
    /// Some three times as long.
    Thorough,
}

/// Parameters of the method `donut`: the same for all tasks and tools.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchSettings {
    /// Particles to search with.
    pub particles: usize,
    /// What dough costs that is far from every point of the target, against a way of the same length.
    pub stray_weight: f64,
    /// What dough costs that is in a hole of the target, against a way as long as it is deep in it: the EMD alone hardly
    /// feels a thin membrane.
    pub gap_weight: f64,
    /// Strokes that the first generation tries: it is the only one that looks everywhere.
    pub first_population: usize,
    /// Strokes that every other generation tries.
    pub population: usize,
    /// Generations a stroke is searched for.
    pub generations: usize,
    /// The best strokes so far, from which a generation descends.
    pub parents: usize,
    /// Points between which a stroke's actions are interpolated.
    pub knots: usize,
    /// Lengths that a stroke may have, control steps.
    pub lengths: Vec<usize>,
    /// A stroke's worth is what it gains divided by its length to this power.
    pub length_exponent: f64,
    /// The best strokes that are tried with all particles.
    pub finalists: usize,
    /// Gradient steps that refine the best stroke.
    pub gradient_steps: usize,
    /// Learning rate of these steps, on the knots.
    pub learning_rate: f64,
    /// The best outcomes that differ in kind, so many, are judged by the best stroke that a first look finds to follow each.
    pub beam: usize,
    /// Free control steps after each stroke, with the tool withdrawn, at most: fewer if the dough rests before.
    pub settle_steps: usize,
    /// A stroke must lower the objective by this share, or nothing more is found.
    pub least_gain: f64,
}

impl SearchSettings {
    /// The worth of what lowers the objective by `gain` within `steps` control steps.
    pub fn merit(&self, gain: f64, steps: usize) -> f64 {
        gain / (steps as f64).powf(self.length_exponent)
    }

    /// Whether an objective has been lowered by enough to go on.
    pub fn is_gain(&self, before: f64, after: f64) -> bool {
        after < before * (1.0 - self.least_gain)
    }

    /// The settings of an effort.
    pub fn of(effort: Effort) -> Self {
        let (particles, population, generations) = match effort {
            Effort::Quick => (800, 12, 3),
            Effort::Normal => (1000, 24, 5),
            Effort::Thorough => (2000, 40, 8),
        };
        Self {
            particles,
            stray_weight: 2.0,
            gap_weight: 100.0,
            first_population: 64,
            population,
            generations,
            parents: 6,
            knots: 4,
            lengths: vec![10, 20, 40],
            length_exponent: 0.2,
            finalists: 4,
            gradient_steps: 9,
            learning_rate: 0.05,
            beam: 3,
            settle_steps: 30,
            least_gain: 0.01,
        }
    }
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
