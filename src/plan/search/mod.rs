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
use super::settings::{SearchLevel, StartScore};
use super::stage::{Progress, SegmentTrace, StageProblem, StageTrace, StopReason, stage_emd};
use crate::math::cloud::Point;
use crate::math::rng::{Pcg64, seeded};
use crate::sim::lanes::Real;
use crate::sim::{Batch, Options, Params, ParticleState, SimError, Simulator, ToolPose};
use coarse::Coarse;
use evolve::{Search, Tried, are_kin, come_to_rest};
use std::ops::Range;

/// A best stroke that gains less than this share of the objective is taken without looking further ahead.
const LOOK_AHEAD_FROM: f64 = 0.1;

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
        home: &start.x,
        level: search.levels[0],
        scouts: Batch::<T>::new(&for_search(problem.params), tool, &forward_only),
        batch: Batch::<T>::new(problem.params, tool, &forward_only),
        rng: seeded(problem.seed, "search"),
    };
    let mut state = start.clone();
    let emd_initial = stage_emd(problem, &state.x);
    let mut emd_now = emd_initial;
    let mut levels = search.levels[1..].iter();
    let mut judge = planner.coarse(start, start.len());
    let mut objective_now = judge.objective_of_all(&state.x);
    let (mut steps, mut strokes, mut failures) = (0, 0, 0);
    let mut segments: Vec<SegmentTrace> = Vec::new();
    // What looking ahead has found for the dough as it is.
    let mut known: Option<Vec<Tried>> = None;
    let stop = loop {
        let steps_left = settings.max_steps - steps;
        if steps_left == 0 {
            break StopReason::Budget;
        }
        if emd_now < settings.emd_tolerance_m {
            break StopReason::Reached;
        }
        if failures > search.max_failures {
            let Some(level) = levels.next() else { break StopReason::Stuck };
            planner.level = *level;
            judge = planner.coarse(start, start.len());
            objective_now = judge.objective_of_all(&state.x);
            failures = 0;
        }
        let resets = usize::max(strokes, 1) - 1;
        let on_searched = |searched| {
            let horizon = search.lengths.iter().copied().max().unwrap_or(0);
            observe(Progress { step: steps, searched, horizon, emd: emd_now, resets });
        };
        let done = if known.is_some() { search.lookahead } else { 0 };
        let pool = known.take().unwrap_or_default();
        let found = planner.explore(&state, steps_left, pool, done..search.generations, true, on_searched);
        if found.is_empty() {
            break StopReason::NoPlace;
        }
        let outcomes = planner.outcomes(&judge, objective_now, &state, found);
        let Some((outcome, next)) = planner.best_to_go_on(objective_now, steps_left, outcomes) else {
            failures += 1;
            continue;
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
        if accepted {
            state = settled;
            (emd_now, objective_now) = (emd_after, objective);
            steps += tried.stroke.steps;
            strokes += 1;
            failures = 0;
            known = next;
        } else {
            failures += 1;
        }
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
    /// Where the dough was when the stage began, m.
    home: &'a [Point],
    level: SearchLevel,
    /// Simulators to search with, and those in which strokes are executed.
    scouts: Batch<T>,
    batch: Batch<T>,
    rng: Pcg64,
}

impl<T: Real> Planner<'_, T> {
    /// The dough by about `count` particles, judged as the level says.
    fn coarse(&self, state: &ParticleState, count: usize) -> Coarse {
        Coarse::new(self.problem, state, self.home, count, self.level.stray_weight)
    }

    /// The best strokes that generations of a search with few particles find, best first. `pool` is what the
    /// generations before have found.
    fn explore(
        &mut self,
        state: &ParticleState,
        steps_left: usize,
        pool: Vec<Tried>,
        generations: Range<usize>,
        refine: bool,
        on_searched: impl FnMut(f64),
    ) -> Vec<Tried> {
        let coarse = self.coarse(state, self.level.particles);
        let Self { problem, scouts, rng, .. } = self;
        let search = problem.search;
        let motion = coarse.motion();
        let reachable: Vec<Point> =
            coarse.state.x.iter().zip(&motion).map(|(p, m)| std::array::from_fn(|a| p[a] + m[a])).collect();
        let place = placement(problem, &coarse.state.x, &coarse.active, &reachable);
        let seeds = if pool.is_empty() {
            seeds::seeds(
                &place,
                problem.params.substeps,
                &motion,
                &coarse.strays(),
                search.first_population / 3,
            )
        } else {
            Vec::new()
        };
        if seeds.is_empty() && pool.is_empty() {
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
        let found = finder.run(&seeds, pool, generations, rng, on_searched);
        if refine { finder.refined(found) } else { found }
    }

    /// What the best strokes do with all particles, best first: few particles do not tell everything, above all of a
    /// knife.
    fn outcomes(
        &mut self,
        judge: &Coarse,
        objective_now: f64,
        state: &ParticleState,
        mut found: Vec<Tried>,
    ) -> Vec<Outcome> {
        let Self { problem, batch, .. } = self;
        let search = problem.search;
        let merit = |o: &Outcome| search.merit(objective_now - o.objective, o.tried.stroke.steps);
        found.truncate(search.finalists);
        let tried = batch.run(&found, |sim, tried| execute(sim, problem, judge, state, tried).ok());
        let mut outcomes: Vec<Outcome> = tried.into_iter().flatten().collect();
        // A stable sort: of equal ones first the one that is better with few particles.
        outcomes.sort_by(|a, b| merit(b).total_cmp(&merit(a)));
        outcomes
    }

    /// The stroke after which, with the best stroke that was found to follow it, most is gained; and what was found to
    /// follow it.
    fn best_to_go_on(
        &mut self,
        objective_now: f64,
        steps_left: usize,
        outcomes: Vec<Outcome>,
    ) -> Option<(Outcome, Option<Vec<Tried>>)> {
        let search = self.problem.search;
        let gain = |o: &Outcome| objective_now - o.objective;
        let is_clear = outcomes.first().is_none_or(|o| gain(o) < LOOK_AHEAD_FROM * objective_now);
        if is_clear || search.beam < 2 {
            return outcomes.into_iter().next().map(|o| (o, None));
        }
        let mut best: Option<(f64, Outcome, Option<Vec<Tried>>)> = None;
        for outcome in of_different_kinds(outcomes, search.beam, objective_now) {
            let steps = outcome.tried.stroke.steps;
            let left = steps_left - steps;
            let (mut merit, mut follow) = (search.merit(gain(&outcome), steps), None);
            if left > 0 && gain(&outcome) > 0.0 {
                let state = &outcome.settled;
                let next = self.explore(state, left, Vec::new(), 0..search.lookahead, false, |_| {});
                let coarse = self.coarse(state, self.level.particles);
                let before = coarse.objective(&coarse.state.x);
                let total = |t: &Tried| {
                    let gain = gain(&outcome) + before - t.objective;
                    search.merit(gain, steps + t.stroke.steps)
                };
                merit = next.iter().map(total).fold(merit, f64::max);
                follow = (!next.is_empty()).then_some(next);
            }
            if best.as_ref().is_none_or(|b| merit > b.0) {
                best = Some((merit, outcome, follow));
            }
        }
        best.map(|(_, outcome, follow)| (outcome, follow))
    }
}

/// The first of the outcomes, and the first that leave other dough: strokes of a kind have the same future.
fn of_different_kinds(outcomes: Vec<Outcome>, most: usize, objective_now: f64) -> Vec<Outcome> {
    let mut kept: Vec<Outcome> = Vec::new();
    for outcome in outcomes {
        let is_kin = |other: &Outcome| are_kin(&other.settled.x, &outcome.settled.x, objective_now);
        if kept.len() < most && !kept.iter().any(is_kin) {
            kept.push(outcome);
        }
    }
    kept
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
