//! What a run is, as plain data: the summary, the plan that replays it, and the frames.
//!
//! The planner's caller fills these types in; `run_dir` writes and reads them, `view` draws them. Imports
//! `sim`'s tool and parameter types, `llm`'s conversation, `plan`'s settings and `task`'s runs.
//!
//! A **frame** is the state after a control step; frame 0 is the initial state, so T steps make T + 1
//! frames. A **segment** is what is optimised and executed together (at most the horizon L); a
//! **stage** is one subgoal with one tool. Distances are in m, times in s.

use serde::{Deserialize, Serialize};

use super::trajectory::Trajectory;
use crate::llm::repair::Conversation;
use crate::plan::settings::{PlannerSettings, SearchSettings};
use crate::sim::params::Params;
use crate::sim::tool::{Tool, ToolPose};
use crate::task::Scene;
use crate::task::measures::ShapeMeasures;
use crate::task::run::{StageRun, normalised_decrease};

/// Everything that a run leaves on disk.
#[derive(Clone, Debug, PartialEq)]
pub struct RunRecord {
    /// summary.json.
    pub summary: Summary,
    /// plan.json.
    pub plan: PlanFile,
    /// trajectory.npz.
    pub trajectory: Trajectory,
}

/// summary.json: how well the run went.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    pub task: String,
    pub seed: u64,
    pub method: String,
    /// Normalised decrease of the EMD to the target: 1 is perfect, 0 no better than the initial state.
    #[serde(with = "not_a_number_as_null")]
    pub score: f64,
    /// Score from which the run counts as a success.
    pub threshold: f64,
    pub success: bool,
    /// EMD between the initial state and the target, m.
    #[serde(with = "not_a_number_as_null")]
    pub emd_initial: f64,
    /// EMD between the final state and the target, m.
    #[serde(with = "not_a_number_as_null")]
    pub emd_final: f64,
    /// Wall time of the whole run, s.
    pub seconds: f64,
    pub particles: usize,
    pub stages: Vec<StageSummary>,
    /// The best score that the target allows (its cloud's own distance from what dough can do), if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub score_ceiling: Option<f64>,
    /// Pieces and holes of the dough at the end, beside the goal's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeMeasures>,
    /// How the EMDs here were computed, for people: "exact assignment, all particles".
    #[serde(default)]
    pub estimator: String,
    /// Version of donut.
    #[serde(default)]
    pub version: String,
    /// The language model that was asked, `PROVIDER:MODEL`, if one was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// How often it answered until an answer could be used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answers: Option<usize>,
}

/// How well one stage went.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageSummary {
    pub tool: String,
    /// Control steps executed.
    pub steps: usize,
    /// How often the tool was taken off and placed anew.
    pub resets: usize,
    /// Normalised decrease of the EMD to the stage's subgoal.
    #[serde(with = "not_a_number_as_null")]
    pub score: f64,
    /// EMD to the subgoal before the stage, m.
    #[serde(with = "not_a_number_as_null")]
    pub emd_initial: f64,
    /// EMD to the subgoal after the stage, m.
    #[serde(with = "not_a_number_as_null")]
    pub emd_final: f64,
    /// Forward passes of the simulator that planning and executing took.
    #[serde(default)]
    pub rollouts: u64,
    /// Backward passes.
    #[serde(default)]
    pub gradient_iterations: u64,
    pub seconds: f64,
    /// Why the stage ended: "reached", "stuck", "budget", ..
    #[serde(default)]
    pub stop: String,
}

impl StageSummary {
    /// The summary of a stage that was run in `scene`.
    pub fn of(scene: &Scene, run: &StageRun) -> Self {
        Self {
            tool: scene.tools[run.tool].tool.name.clone(),
            steps: run.trace.steps,
            resets: run.trace.resets,
            score: normalised_decrease(run.emd_initial, run.emd_final),
            emd_initial: run.emd_initial,
            emd_final: run.emd_final,
            rollouts: run.work.rollouts,
            gradient_iterations: run.work.gradients,
            seconds: run.seconds,
            stop: run.trace.stop.to_string(),
        }
    }
}

/// plan.json: everything needed to replay the run, and the story of how it was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanFile {
    /// Version of donut that made the plan.
    pub version: String,
    /// The command line that makes it again, starting with `donut`.
    pub command: String,
    pub task: String,
    pub seed: u64,
    pub method: String,
    /// The effective task file, TOML.
    pub task_file: String,
    /// The language model's answer that the stages came from, if one did.
    pub response: Option<String>,
    /// Everything that was said, if a language model was asked for this run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub conversation: Option<Conversation>,
    pub params: Params,
    pub planner: PlannerSettings,
    /// Parameters of the method `donut`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub search: Option<SearchSettings>,
    /// The tools; stages and frames name them by index.
    pub tools: Vec<Tool>,
    pub stages: Vec<StagePlan>,
}

/// One stage: what the language model said, and what was done.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StagePlan {
    /// The model's one-line explanation.
    pub title: String,
    /// Index into [`PlanFile::tools`].
    pub tool: usize,
    /// The model's Python code for the stage's subgoal; empty if no model was asked.
    #[serde(default)]
    pub code: String,
    /// In the order they were tried, those that were not accepted included.
    pub segments: Vec<Segment>,
}

/// One try: a start, optimised actions, and what came of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// The tool was taken off and placed anew at `start_pose` (true for a stage's first segment, which
    /// is not counted as a reset); otherwise it went on from where it was.
    pub placed: bool,
    /// Where the tool was at the segment's start.
    pub start_pose: ToolPose,
    /// The frame from which the segment started.
    pub first_frame: usize,
    /// Whether its steps were kept; if not, the state went back to `first_frame`.
    pub accepted: bool,
    /// The optimised actions, (steps, components), each in [-1, 1].
    pub actions: Vec<Vec<f64>>,
    /// EMD to the subgoal before, m.
    #[serde(with = "not_a_number_as_null")]
    pub emd_before: f64,
    /// EMD to the subgoal after, m.
    #[serde(with = "not_a_number_as_null")]
    pub emd_after: f64,
    /// Weighted loss at each gradient iteration.
    #[serde(with = "not_a_number_as_null")]
    pub losses: Vec<f64>,
}

impl Segment {
    /// The frame that the segment ended in: `first_frame` itself if it was not accepted.
    pub fn last_frame(&self) -> usize {
        self.first_frame + if self.accepted { self.actions.len() } else { 0 }
    }
}

/// JSON has no NaN or infinity: they are written as null and read as NaN.
mod not_a_number_as_null {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// A number or a list of numbers.
    pub trait Nullable: Sized {
        type Json: Serialize + for<'a> Deserialize<'a>;
        fn to_json(&self) -> Self::Json;
        fn from_json(json: Self::Json) -> Self;
    }

    impl Nullable for f64 {
        type Json = Option<f64>;
        fn to_json(&self) -> Option<f64> {
            self.is_finite().then_some(*self)
        }
        fn from_json(json: Option<f64>) -> f64 {
            json.unwrap_or(f64::NAN)
        }
    }

    impl Nullable for Vec<f64> {
        type Json = Vec<Option<f64>>;
        fn to_json(&self) -> Vec<Option<f64>> {
            self.iter().map(Nullable::to_json).collect()
        }
        fn from_json(json: Vec<Option<f64>>) -> Self {
            json.into_iter().map(f64::from_json).collect()
        }
    }

    pub fn serialize<T: Nullable, S: Serializer>(value: &T, s: S) -> Result<S::Ok, S::Error> {
        value.to_json().serialize(s)
    }

    pub fn deserialize<'de, T: Nullable, D: Deserializer<'de>>(d: D) -> Result<T, D::Error> {
        T::Json::deserialize(d).map(T::from_json)
    }
}
