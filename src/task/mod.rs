//! Tasks: files, checked scenes, pieces of dough, and subgoals in the simulator's world.
//!
//! A `--task` argument becomes a [`Scene`]; a language model's stages become a [`StagePlan`], and that, stage
//! by stage, a [`Subgoal`] for the particles at hand. Imports math, sim, llm's stage type and the planner's
//! settings.

pub mod error;
pub mod file;
pub mod generate;
mod names;
pub mod neighbours;
pub mod pieces;
pub mod resample;
pub mod scene;
pub mod shapes;
pub mod source;
pub mod subgoal;
mod tools;
mod values;
pub mod volume;

pub use error::TaskError;
pub use pieces::{Piece, PieceId, Pieces};
pub use scene::{Scene, ToolSetup};
pub use source::{TaskSource, built_in_names, load_scene};
pub use subgoal::{Frame, PlannedStage, StageError, StagePlan, Subgoal, World, low_quantile};

#[cfg(test)]
mod tests;
