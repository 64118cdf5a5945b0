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
use crate::math::rng::{Pcg64, seeded};
use crate::sim::lanes::Real;
use crate::sim::{Batch, Options, Params, ParticleState, SimError, Simulator, ToolPose};
use coarse::Coarse;
use evolve::{NUDGES, Search, Tried, come_to_rest};
use stroke::Stroke;

/// A stroke that gains at least this share of the objective is tried beside its place with all particles too.
const NUDGE_FROM: f64 = 0.1;

/// Courant number of the searching simulators at most: somewhat below where substeps break down.
const SEARCH_COURANT: f64 = 0.75;

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
    let mut planner = Planner {
        problem,
        judge: Coarse::new(problem, start, &start.x, start.len()),
        home: &start.x,
        scouts: Batch::<T>::new(&for_search(problem.params), tool, &forward_only),
        batch: Batch::<T>::new(problem.params, tool, &forward_only),
        rng: seeded(problem.seed, "search"),
    };
    let mut state = start.clone();
    let emd_initial = stage_emd(problem, &state.x);
    let mut emd_now = emd_initial;
    let mut objective_now = planner.judge.objective_of_all(&state.x);
    let (mut steps, mut strokes) = (0, 0);
    let mut segments: Vec<SegmentTrace> = Vec::new();
    let stop = loop {
        let steps_left = settings.max_steps - steps;
        if steps_left == 0 {
            break StopReason::Budget;
        }
        if emd_now < settings.emd_tolerance_m {
            break StopReason::Reached;
        }
        let resets = usize::max(strokes, 1) - 1;
        let on_searched = |searched| {
            let horizon = search.lengths.iter().copied().max().unwrap_or(0);
            observe(Progress { step: steps, searched, horizon, emd: emd_now, resets });
        };
        let found = planner.explore(&state, steps_left, on_searched);
        if found.is_empty() {
            break StopReason::NoPlace;
        }
        let Some(outcome) = planner.best(objective_now, &state, found) else {
            break StopReason::Stuck;
        };
        let Outcome { tried, objective, mut horizon, settled, settling } = outcome;
        horizon.losses = vec![objective_now, tried.objective, objective];
        let emd_after = stage_emd(problem, &settled.x);
        let accepted = objective < objective_now * (1.0 - search.least_gain);
        segments.push(SegmentTrace {
            placed: true,
            start_pose: tried.pose,
            horizon,
            emd_before: emd_now,
            emd_after,
            accepted,
            reachable: Vec::new(),
            settling,
        });
        if !accepted {
            break StopReason::Stuck;
        }
        state = settled;
        (emd_now, objective_now) = (emd_after, objective);
        steps += tried.stroke.steps;
        strokes += 1;
    };
    let resets = usize::max(strokes, 1) - 1;
    StageTrace { segments, end: state, steps, resets, emd_initial, emd_final: emd_now, stop }
}

/// A stroke with all particles.
struct Outcome {
    tried: Tried,
    /// The objective after it, of all particles, m.
    objective: f64,
    /// What the tool did.
    horizon: Horizon,
    /// The dough after it has settled, and how it settled.
    settled: ParticleState,
    settling: Vec<Vec<Point>>,
}

/// What a stage's search carries from stroke to stroke.
struct Planner<'a, T: Real> {
    problem: &'a StageProblem<'a>,
    /// The objective of all particles.
    judge: Coarse,
    /// Where the dough was when the stage began, m.
    home: &'a [Point],
    /// Simulators to search with, and those in which strokes are executed.
    scouts: Batch<T>,
    batch: Batch<T>,
    rng: Pcg64,
}

impl<T: Real> Planner<'_, T> {
    /// The best strokes that a search with few particles finds, best first.
    fn explore(
        &mut self,
        state: &ParticleState,
        steps_left: usize,
        on_searched: impl FnMut(f64),
    ) -> Vec<Tried> {
        let Self { problem, scouts, rng, .. } = self;
        let search = problem.search;
        let coarse = Coarse::new(problem, state, self.home, search.particles);
        let motion = coarse.motion();
        let reachable: Vec<Point> =
            coarse.state.x.iter().zip(&motion).map(|(p, m)| std::array::from_fn(|a| p[a] + m[a])).collect();
        let place = placement(problem, &coarse.state.x, &coarse.active, &reachable);
        let count = search.first_population / 3;
        let seeds = seeds::seeds(&place, problem.params.substeps, &motion, &coarse.strays(), count);
        if seeds.is_empty() {
            return Vec::new();
        }
        // The executed tool must clear every particle, not just those that the search goes by.
        let all = placement(problem, &state.x, problem.active, &[]);
        let lowered = |pose: ToolPose| all.lowered(pose);
        let mut finder = Search {
            settings: search,
            tool: problem.tool,
            rest: problem.rest,
            coarse: &coarse,
            before: coarse.objective(&coarse.state.x),
            lowered: &lowered,
            batch: scouts,
            gradient_memory: problem.options.memory_limit / problem.options.threads.max(1),
            steps_left,
        };
        let found = finder.run(&seeds, rng, on_searched);
        finder.refined(found)
    }

    /// The best of the strokes with all particles: few do not tell everything, above all of a knife. If much is to be
    /// gained, the best one is tried beside its place as well.
    fn best(&mut self, objective_now: f64, state: &ParticleState, mut found: Vec<Tried>) -> Option<Outcome> {
        let Self { problem, batch, judge, .. } = self;
        let (problem, judge, search) = (*problem, &*judge, problem.search);
        let all = placement(problem, &state.x, problem.active, &[]);
        let mut better_of = |best: Option<Outcome>, strokes: &[Tried]| {
            let tried = batch.run(strokes, |sim, tried| execute(sim, problem, judge, state, tried).ok());
            let merit = |o: &Outcome| search.merit(objective_now - o.objective, o.tried.stroke.steps);
            // Of equal ones the first: it is the better one with few particles.
            let better = |best: Outcome, next: Outcome| if merit(&next) > merit(&best) { next } else { best };
            best.into_iter().chain(tried.into_iter().flatten()).reduce(better)
        };
        found.truncate(search.finalists);
        let mut best = better_of(None, &found)?;
        for way in NUDGES {
            if objective_now - best.objective < NUDGE_FROM * objective_now {
                break;
            }
            let beside = |stroke: Stroke| {
                let pose = all.lowered(stroke.pose_above(problem.rest))?;
                Some(Tried { stroke, pose, ..best.tried.clone() })
            };
            let near: Vec<Tried> = best.tried.stroke.nudged(way).into_iter().filter_map(beside).collect();
            best = better_of(Some(best), &near)?;
        }
        Some(best)
    }
}

/// The same world with control steps of as few substeps as [`SEARCH_COURANT`] lets pass.
fn for_search(params: &Params) -> Params {
    let longest = SEARCH_COURANT / params.courant() * params.dt;
    let substeps = ((params.control_step() / longest).ceil() as usize).clamp(1, params.substeps);
    Params { substeps, dt: params.control_step() / substeps as f64, ..params.clone() }
}

/// Where the tool may be put on dough that is at `positions` and should go to `reachable`.
fn placement<'a>(
    problem: &StageProblem<'a>,
    positions: &'a [Point],
    active: &'a [usize],
    reachable: &'a [Point],
) -> Placement<'a> {
    Placement {
        tool: problem.tool,
        rest: problem.rest,
        positions,
        active,
        reachable,
        delta: problem.settings.pose_delta_m,
        score: StartScore::Direction,
    }
}

fn execute<T: Real>(
    sim: &mut Simulator<T>,
    problem: &StageProblem<'_>,
    judge: &Coarse,
    start: &ParticleState,
    tried: &Tried,
) -> Result<Outcome, SimError> {
    let actions = tried.stroke.actions(problem.tool);
    sim.set_tools(vec![problem.tool.clone()]);
    sim.rollout(start, &[tried.pose], &actions)?;
    let steps = sim.steps();
    let horizon = Horizon {
        frames: (1..=steps).map(|s| sim.positions(s)).collect(),
        poses: (1..=steps).map(|s| sim.poses(s)[0]).collect(),
        end: sim.state(steps),
        losses: Vec::new(),
        fault: None,
        actions,
    };
    let mut settling = Vec::new();
    let settled =
        come_to_rest(sim, horizon.end.clone(), problem.search.settle_steps, |frame| settling.push(frame))?;
    let objective = judge.objective_of_all(&settled.x);
    Ok(Outcome { tried: tried.clone(), objective, horizon, settled, settling })
}
