//! The method `donut`: stroke after stroke, each found by a search with few particles and executed with all.
//!
//! A stroke puts the tool on the dough, moves it along a smooth path and withdraws it; the dough settles
//! before it is judged, so that thrown dough wins nothing. Imports sim and emd.

pub mod coarse;
pub mod evolve;
pub mod seeds;
pub mod stroke;

use super::optimize::Horizon;
use super::placement::Placement;
use super::settings::StartScore;
use super::stage::{Progress, SegmentTrace, StageProblem, StageTrace, StopReason, stage_emd};
use crate::math::cloud::Point;
use crate::math::rng::seeded;
use crate::sim::lanes::Real;
use crate::sim::{Batch, Options, ParticleState, SimError, Simulator, ToolPose};
use coarse::Coarse;
use evolve::Search;

/// Plans and executes one stage.
pub fn plan_stage<T: Real>(
    problem: &StageProblem<'_>,
    start: &ParticleState,
    mut observe: impl FnMut(Progress),
) -> StageTrace {
    let (settings, search) = (problem.settings, problem.search);
    let tool = std::slice::from_ref(problem.tool);
    // Nothing is differentiated with all particles: keep no substeps.
    let forward_only = Options { memory_limit: 0, ..problem.options.clone() };
    let mut sim = Simulator::<T>::new(problem.params.clone(), tool.to_vec(), forward_only.clone());
    let mut batch = Batch::<T>::new(problem.params, tool, &forward_only);
    let mut rng = seeded(problem.seed, "search");
    let mut state = start.clone();
    let emd_initial = stage_emd(problem, &state.x);
    let mut emd_now = emd_initial;
    let (mut steps, mut strokes, mut failures) = (0, 0, 0);
    let mut segments: Vec<SegmentTrace> = Vec::new();
    let stop = loop {
        let steps_left = settings.max_steps - steps;
        if steps_left == 0 {
            break StopReason::Budget;
        }
        if emd_now < settings.emd_tolerance_m {
            break StopReason::Reached;
        }
        if failures > search.max_failures {
            break StopReason::Stuck;
        }
        let coarse = Coarse::new(problem, &state, search.particles);
        let motion = coarse.motion();
        let reachable: Vec<Point> =
            coarse.state.x.iter().zip(&motion).map(|(p, m)| std::array::from_fn(|a| p[a] + m[a])).collect();
        let place = Placement {
            tool: problem.tool,
            rest: problem.rest,
            positions: &coarse.state.x,
            active: &coarse.active,
            reachable: &reachable,
            delta: settings.pose_delta_m,
            score: StartScore::Direction,
        };
        let seeds = seeds::seeds(&place, problem.params.substeps, &motion, search.population / 2);
        if seeds.is_empty() {
            break StopReason::NoPlace;
        }
        // The executed tool must clear every particle, not just those that the search goes by.
        let all = Placement { positions: &state.x, active: problem.active, ..place };
        let lowered = |pose: ToolPose| all.lowered(pose);
        let mut finder = Search {
            settings: search,
            tool: problem.tool,
            rest: problem.rest,
            coarse: &coarse,
            lowered: &lowered,
            batch: &mut batch,
            gradient_memory: problem.options.memory_limit / problem.options.threads.max(1),
            steps_left,
        };
        let resets = usize::max(strokes, 1) - 1;
        let found = finder.run(&seeds, &mut rng, |searched| {
            let horizon = search.lengths.iter().copied().max().unwrap_or(0);
            observe(Progress { step: steps, searched, horizon, emd: emd_now, resets });
        });
        let Some(found) = found else { break StopReason::NoPlace };
        let actions = found.stroke.actions();
        let done = execute(&mut sim, problem, &state, &found.pose, actions, search.settle_steps);
        let (mut horizon, settled, settling) = match done {
            Ok(done) => done,
            Err(_) => {
                failures += 1;
                continue;
            }
        };
        horizon.losses = vec![coarse.objective(&coarse.state.x), found.objective];
        let emd_after = stage_emd(problem, &settled.x);
        let accepted = emd_after < emd_now * (1.0 - search.least_gain);
        segments.push(SegmentTrace {
            placed: true,
            start_pose: found.pose,
            horizon,
            emd_before: emd_now,
            emd_after,
            accepted,
            reachable: Vec::new(),
            settling,
        });
        if accepted {
            state = settled;
            emd_now = emd_after;
            steps += found.stroke.steps;
            strokes += 1;
            failures = 0;
        } else {
            failures += 1;
        }
    };
    let resets = usize::max(strokes, 1) - 1;
    StageTrace { segments, end: state, steps, resets, emd_initial, emd_final: emd_now, stop }
}

/// A stroke with all particles: what the tool did, the dough after it has settled, and how it settled.
type Executed = (Horizon, ParticleState, Vec<Vec<Point>>);

fn execute<T: Real>(
    sim: &mut Simulator<T>,
    problem: &StageProblem<'_>,
    start: &ParticleState,
    pose: &ToolPose,
    actions: Vec<Vec<f64>>,
    settle_steps: usize,
) -> Result<Executed, SimError> {
    sim.set_tools(vec![problem.tool.clone()]);
    sim.rollout(start, &[*pose], &actions)?;
    let steps = sim.steps();
    let horizon = Horizon {
        frames: (1..=steps).map(|s| sim.positions(s)).collect(),
        poses: (1..=steps).map(|s| sim.poses(s)[0]).collect(),
        end: sim.state(steps),
        losses: Vec::new(),
        fault: None,
        actions,
    };
    sim.set_tools(Vec::new());
    sim.rollout(&horizon.end, &[], &vec![Vec::new(); settle_steps])?;
    let settling = (1..=settle_steps).map(|s| sim.positions(s)).collect();
    Ok((horizon, sim.state(settle_steps), settling))
}
