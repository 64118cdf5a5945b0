//! Tasks: files, checked scenes, pieces of dough, and subgoals in the simulator's world.
//!
//! A `--task` argument, or a [`Description`] and an answer to it, becomes a [`Scene`]; a language model's stages
//! become a [`StagePlan`], and that, stage by stage, a [`Subgoal`] for the particles at hand. Imports math, sim,
//! llm's stage type and the planner's settings.

pub mod describe;
pub mod error;
pub mod file;
pub mod generate;
pub mod gradcheck;
pub mod measures;
pub mod overrides;
pub mod pieces;
pub mod resample;
pub mod run;
pub mod scene;
pub mod shapes;
pub mod source;
pub mod subgoal;
pub mod template;
pub mod tools;
mod values;
pub mod volume_suite;
mod words;

pub use describe::Description;
pub use error::{StageError, TaskError};
pub use overrides::Overrides;
pub use pieces::{Piece, PieceId, Pieces};
pub use scene::{Scene, Target};
pub use shapes::{Dough, Solid};
pub use source::{TaskSource, built_in_names, load_scene};
pub use subgoal::{Frame, PlannedStage, StagePlan, Subgoal, World, low_quantile};
pub use tools::ToolSetup;

#[cfg(test)]
mod tests;
