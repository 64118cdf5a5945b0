//! What every planning method takes and returns: a stage's problem, its trace, progress on the way.
//!
//! Imports sim and emd.

use super::optimize::Horizon;
use super::settings::{Method, PlannerSettings, SearchSettings};
use crate::emd::exact::assign;
use crate::math::cloud::Point;
use crate::sim::{Options, Params, ParticleState, SimError, Tool, ToolPose};

/// What a stage asks for.
#[derive(Clone, Debug)]
pub struct StageProblem<'a> {
    pub params: &'a Params,
    pub options: &'a Options,
    pub method: Method,
    /// Parameters of Algorithm 1; the method `donut` takes the number of control steps and the tolerance from it.
    pub settings: &'a PlannerSettings,
    /// Parameters of the method `donut`.
    pub search: &'a SearchSettings,
    /// Seed of whatever is drawn.
    pub seed: u64,
    pub tool: &'a Tool,
    pub rest: &'a ToolPose,
    /// Particles that the stage is about; all others should stay where they are.
    pub active: &'a [usize],
    /// Where the active dough should be, m: as many points as active particles, in any order.
    pub target: &'a [Point],
    /// The target's pieces that have holes, m: these should be clear.
    pub with_holes: &'a [Vec<Point>],
}

/// One horizon that was planned and tried.
#[derive(Clone, Debug)]
pub struct SegmentTrace {
    /// Whether the tool was put at a new start before it.
    pub placed: bool,
    pub start_pose: ToolPose,
    pub horizon: Horizon,
    /// Exact EMD between active particles and target before and after, m.
    pub emd_before: f64,
    pub emd_after: f64,
    /// Whether it was executed, or taken back because the EMD grew.
    pub accepted: bool,
    /// The next reachable cloud that it aimed at, all particles, m.
    pub reachable: Vec<Point>,
    /// Positions after each free control step that followed with the tool withdrawn; none if it stayed.
    pub settling: Vec<Vec<Point>>,
}

/// Why a stage ended.
#[derive(Clone, Debug, PartialEq)]
pub enum StopReason {
    /// The EMD is below tau.
    Reached,
    /// All control steps are used.
    Budget,
    /// Too many segments in a row brought nothing.
    Stuck,
    /// The tool fits nowhere.
    NoPlace,
    /// The simulation broke down even with the tool standing still.
    Diverged(SimError),
}

impl std::fmt::Display for StopReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Reached => f.write_str("target reached"),
            Self::Budget => f.write_str("all control steps used"),
            Self::Stuck => f.write_str("no further progress"),
            Self::NoPlace => f.write_str("the tool fits nowhere"),
            Self::Diverged(error) => write!(f, "simulation broke down: {error}"),
        }
    }
}

/// How a stage went.
#[derive(Clone, Debug)]
pub struct StageTrace {
    pub segments: Vec<SegmentTrace>,
    /// State after the last accepted segment.
    pub end: ParticleState,
    /// Control steps that were executed.
    pub steps: usize,
    /// How often the tool was put at a new start after the first.
    pub resets: usize,
    pub emd_initial: f64,
    pub emd_final: f64,
    pub stop: StopReason,
}

/// What a stage reports while it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Control steps executed so far.
    pub step: usize,
    /// How much of the search for the current segment is done, 0 to 1.
    pub searched: f64,
    /// Control steps that the current segment will take.
    pub horizon: usize,
    /// EMD now, m.
    pub emd: f64,
    pub resets: usize,
}

/// Exact EMD between the active particles and the target, m.
pub fn stage_emd(problem: &StageProblem<'_>, x: &[Point]) -> f64 {
    let active: Vec<Point> = problem.active.iter().map(|&i| x[i]).collect();
    assign(&active, problem.target).mean_distance
}
