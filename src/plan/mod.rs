//! Algorithm 1 of the paper: closed-loop planning of one stage with one tool.
//!
//! A [`StageProblem`] comes in: the dough, where it should be, a tool. A [`StageTrace`] goes out: every
//! segment that was tried, with its actions and what they did. Knows nothing of language models or files.
//! Imports sim and emd.

pub mod losses;
pub mod optimize;
pub mod placement;
pub mod settings;
pub mod settle;

use crate::emd::exact::assign;
use crate::emd::reach::next_reachable;
use crate::math::cloud::Point;
use crate::sim::lanes::Real;
use crate::sim::{Options, Params, ParticleState, SimError, Simulator, Tool, ToolPose};
use losses::Goal;
use optimize::{Horizon, optimize};
use placement::Placement;
use settings::PlannerSettings;

/// What a stage asks for.
#[derive(Clone, Debug)]
pub struct StageProblem<'a> {
    pub params: &'a Params,
    pub options: &'a Options,
    pub settings: &'a PlannerSettings,
    pub tool: &'a Tool,
    pub rest: &'a ToolPose,
    /// Particles that the stage is about; all others should stay where they are.
    pub active: &'a [usize],
    /// Where the active dough should be, m: as many points as active particles, in any order.
    pub target: &'a [Point],
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
    /// Gradient steps done in the current segment.
    pub iteration: usize,
    /// Control steps that the current segment will take.
    pub horizon: usize,
    /// EMD now, m.
    pub emd: f64,
    pub resets: usize,
}

/// Plans and executes one stage. `observe` hears of every gradient step. The margin has the line numbers of
/// Algorithm 1.
pub fn plan_stage<T: Real>(
    problem: &StageProblem<'_>,
    start: &ParticleState,
    mut observe: impl FnMut(Progress),
) -> StageTrace {
    let settings = problem.settings;
    let mut sim =
        Simulator::<T>::new(problem.params.clone(), vec![problem.tool.clone()], problem.options.clone());
    let mut state = start.clone();
    let emd_initial = stage_emd(problem, &state.x);
    let mut emd_now = emd_initial;
    let mut emd_last = f64::INFINITY; // 1
    let mut pose = None; // 1: a reset is needed where there is none
    let mut failed = Vec::new();
    let mut failures = 0;
    let mut placements = 0;
    let mut t = 0; // 1
    let mut segments = Vec::new();
    let stop = loop {
        if t >= settings.max_steps {
            break StopReason::Budget; // 2
        }
        let reachable = reachable_cloud(problem, &state.x); // 3-7
        let placed = pose.is_none();
        let start_pose = match pose {
            Some(pose) => pose,
            None => {
                let place = Placement {
                    tool: problem.tool,
                    rest: problem.rest,
                    positions: &state.x,
                    active: problem.active,
                    reachable: &reachable,
                    delta: settings.pose_delta_m,
                    score: settings.start_score,
                };
                let Some(best) = place.best(&failed) else { break StopReason::NoPlace };
                placements += 1;
                best // 8-12
            }
        };
        let goal = Goal { reachable: &reachable, active: problem.active, weights: settings.loss_weights };
        let resets = placements - 1;
        let planned = optimize(&mut sim, &state, &start_pose, &goal, settings, |iteration| {
            observe(Progress { step: t, iteration, horizon: settings.horizon, emd: emd_now, resets });
        });
        let horizon = match planned {
            Ok(horizon) => horizon, // 13-17
            Err(error) => break StopReason::Diverged(error),
        };
        let emd_after = stage_emd(problem, &horizon.end.x); // 18
        let accepted = emd_after <= emd_last;
        if accepted {
            state = horizon.end.clone(); // 26
            t += settings.horizon;
            let gain = (emd_now - emd_after) / emd_now.max(f64::MIN_POSITIVE);
            if gain >= settings.reset_below_gain {
                pose = horizon.poses.last().copied();
                failed.clear();
            } else {
                // Stagnation: not in the paper, whose reset waits until the EMD grows.
                pose = None;
                failed.push(start_pose);
            }
            failures = 0;
        } else {
            pose = None; // 20
            failed.push(start_pose);
            failures += 1;
        }
        let emd_before = emd_now;
        segments.push(SegmentTrace {
            placed,
            start_pose,
            horizon,
            emd_before,
            emd_after,
            accepted,
            reachable,
        });
        if accepted {
            (emd_now, emd_last) = (emd_after, emd_after); // 26
            if emd_after < settings.emd_tolerance_m {
                break StopReason::Reached; // 23-25
            }
        } else if failures > settings.max_failures {
            break StopReason::Stuck;
        }
    };
    let resets = usize::max(placements, 1) - 1;
    StageTrace { segments, end: state, steps: t, resets, emd_initial, emd_final: emd_now, stop }
}

/// Exact EMD between the active particles and the target, m.
fn stage_emd(problem: &StageProblem<'_>, x: &[Point]) -> f64 {
    let active: Vec<Point> = problem.active.iter().map(|&i| x[i]).collect();
    assign(&active, problem.target).mean_distance
}

/// The next reachable place of every particle: active ones move towards the target, the others stay.
fn reachable_cloud(problem: &StageProblem<'_>, x: &[Point]) -> Vec<Point> {
    let settings = problem.settings;
    let active: Vec<Point> = problem.active.iter().map(|&i| x[i]).collect();
    let moved = next_reachable(
        &active,
        problem.target,
        settings.emd_steps,
        settings.emd_step_length_m,
        settings.reach,
    )
    .expect("the target has as many points as the stage has particles, all finite");
    let mut reachable = x.to_vec();
    for (&i, p) in problem.active.iter().zip(&moved.cloud) {
        reachable[i] = *p;
    }
    reachable
}
