//! Planning one stage: dough, a tool and a target cloud come in, a trace of what was done goes out.
//!
//! Two methods: [`algorithm1`] is the paper's, [`search`] is ours; [`switches`] takes parts away from them. Knows
//! nothing of language models or files. Imports sim and emd.

mod adam;
pub mod algorithm1;
pub mod losses;
pub mod optimize;
pub mod placement;
pub mod search;
pub mod settings;
pub mod settle;
pub mod stage;
pub mod switches;

use crate::sim::ParticleState;
use crate::sim::lanes::Real;
use settings::Method;
pub use stage::{Progress, SegmentTrace, StageProblem, StageTrace, StopReason};

/// Plans and executes one stage with the method of the problem. `observe` hears of the progress.
pub fn plan_stage<T: Real>(
    problem: &StageProblem<'_>,
    start: &ParticleState,
    observe: impl FnMut(Progress),
) -> StageTrace {
    match problem.method {
        Method::Donut | Method::DonutNoStages => search::plan_stage::<T>(problem, start, observe),
        _ => algorithm1::plan_stage::<T>(problem, start, observe),
    }
}
