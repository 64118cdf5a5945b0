//! Algorithm 1 of the paper: closed-loop planning of one stage with one tool.
//!
//! A [`StageProblem`] comes in: the dough, where it should be, a tool. A [`StageTrace`] goes out: every
//! segment that was tried, with its actions and what they did. Imports sim and emd.

use super::losses::{Aim, Goal};
use super::optimize::optimize;
use super::placement::Placement;
use super::stage::{Progress, SegmentTrace, StageProblem, StageTrace, StopReason, stage_emd};
use crate::emd::reach::next_reachable;
use crate::math::cloud::Point;
use crate::sim::lanes::Real;
use crate::sim::{ParticleState, Simulator};

/// Plans and executes one stage. `observe` hears of every gradient step. The margin has the line numbers of
/// Algorithm 1.
pub fn plan_stage<T: Real>(
    problem: &StageProblem<'_>,
    start: &ParticleState,
    mut observe: impl FnMut(Progress),
) -> StageTrace {
    let switches = problem.method.switches();
    let settings = &switches.applied_to(problem.settings);
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
                    turns: settings.start_turns,
                };
                let found = if switches.placement { place.best(&failed) } else { Some(place.fixed()) };
                let Some(best) = found else { break StopReason::NoPlace };
                placements += 1;
                best // 8-12
            }
        };
        let aim = if switches.p2p {
            Aim::Points(&reachable)
        } else {
            Aim::Emd { start: &state.x, target: problem.target, estimator: settings.reach }
        };
        let goal = Goal { aim, active: problem.active, weights: settings.loss_weights };
        let resets = placements - 1;
        let planned = optimize(&mut sim, &state, &start_pose, &goal, settings, |iteration| {
            let searched = iteration as f64 / settings.iterations as f64;
            observe(Progress { step: t, searched, horizon: settings.horizon, emd: emd_now, resets });
        });
        let horizon = match planned {
            Ok(horizon) => horizon, // 13-17
            Err(error) => break StopReason::Diverged(error),
        };
        let emd_after = stage_emd(problem, &horizon.end.x); // 18
        let accepted = !switches.reset || emd_after <= emd_last; // 19
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
            settling: Vec::new(),
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
