//! A task file as written: the keys of `tasks/*.toml`, units in their names, unknown keys refused.
//!
//! TOML text comes in; [`TaskFile`] goes out, complete but unchecked: `scene` judges the values. Imports
//! only the planner's settings.

use serde::Deserialize;

use crate::plan::settings::PlannerSettings;

/// A whole task file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskFile {
    pub name: String,
    pub description: String,
    /// What a language model is told; needed only when stages come from one.
    pub task_line: Option<String>,
    pub world: WorldTable,
    pub dough: DoughTable,
    pub tools: Vec<ToolTable>,
    pub target: TargetTable,
    pub score: ScoreTable,
    pub planner: PlannerSettings,
}

/// `[world]`: grid, time, material, floor and contact.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldTable {
    pub nodes: usize,
    pub dt_s: f64,
    pub substeps: usize,
    pub youngs_modulus_pa: f64,
    pub poisson_ratio: f64,
    pub yield_stress_pa: f64,
    pub gravity_m_s2: [f64; 3],
    pub ground_friction: f64,
    pub lower_bound_cells: f64,
    pub contact_softness_per_m: f64,
}

/// `[dough]`: the piece that a task starts with.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DoughTable {
    pub shape: DoughShape,
    pub center_m: [f64; 3],
    pub particles: usize,
}

/// `[dough] shape`: exactly one of these tables.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum DoughShape {
    Ball { radius_m: f64 },
    Box { size_m: [f64; 3] },
    Disc { radius_m: f64, height_m: f64 },
}

/// One `[[tools]]` table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolTable {
    pub name: String,
    pub shape: ToolShape,
    pub motion: ToolMotion,
    pub friction: f64,
    pub action_scale: Vec<f64>,
    pub lower_bound_m: [f64; 3],
    pub upper_bound_m: [f64; 3],
    pub rest: RestTable,
}

/// `[[tools]] shape`: exactly one of these tables.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ToolShape {
    Capsule { radius_m: f64, length_m: f64 },
    Box { half_extents_m: [f64; 3] },
    Knife { half_extents_m: [f64; 3], prism_size_m: [f64; 2], prism_rotation_wxyz: [f64; 4] },
    Sphere { radius_m: f64 },
    Cylinder { radius_m: f64, length_m: f64 },
    Torus { radius_m: f64, tube_radius_m: f64 },
}

/// `[[tools]] motion`: a word, or a table for the gripper.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ToolMotion {
    RollingPin,
    Translation,
    Rigid,
    Gripper { minimal_gap_m: f64, maximal_gap_m: f64 },
}

/// `[[tools]] rest`: where a tool waits out of the dough's way.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RestTable {
    pub position_m: [f64; 3],
    pub rotation_wxyz: [f64; 4],
    /// Distance between a gripper's plates; other tools have none.
    pub gap_m: Option<f64>,
}

/// `[target]`: exactly one of these tables.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum TargetTable {
    /// A language model's answer says the stages and the goal.
    Stages {
        /// The set of answers in the binary that is used when the user names no other.
        recorded_answers: Option<String>,
        llm_unit_m: f64,
        center_xz_m: [f64; 2],
    },
    /// A generator draws one target for one tool.
    Generated { tool: String, shape: GeneratorTable },
}

/// `[target.generated] shape`: exactly one of these tables; pairs are ranges `[low, high]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum GeneratorTable {
    Flatten { height_m: [f64; 2], shift_m: [f64; 2] },
    Cut { cut_x_m: [f64; 2], slide_m: [f64; 2] },
    Move { x_m: [f64; 2], z_offset_m: [f64; 2] },
}

/// `[score]`: when a run counts as a success.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScoreTable {
    pub threshold: f64,
}
