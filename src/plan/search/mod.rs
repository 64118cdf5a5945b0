//! The method `donut`: stroke after stroke, each found by a search with few particles and executed with all.
//!
//! A stroke puts the tool on the dough, moves it along a smooth path and withdraws it; the dough settles
//! before it is judged, so that thrown dough wins nothing. Imports sim and emd.

pub mod coarse;
pub mod even_subset;
pub mod evolve;
pub mod seeds;
pub mod stirring;
pub mod stroke;

use super::optimize::Horizon;
use super::placement::Placement;
use super::settings::StartScore;
use super::stage::{Progress, SegmentTrace, StageProblem, StageTrace, StopReason};
use crate::math::cloud::Point;
use crate::math::rng::{Pcg64, seeded};
use crate::sim::lanes::Real;
use crate::sim::{Batch, Options, Params, ParticleState, SimError, Simulator, ToolPose};
use coarse::{Coarse, Cost, Crumbs, NearTarget, Weights};
use evolve::{NUDGES, Search, Tried, are_kin, come_to_rest};
use seeds::Seed;
use stroke::Stroke;

/// A stroke that gains at least this share of the objective is tried beside its place with all particles too, and
/// compared with others by what can follow it.
const LARGE_GAIN: f64 = 0.1;

/// A stage ends after so many searches that found nothing: what one misses another may find.
const FAILURES: usize = 2;

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
    let near_target = NearTarget::new(problem.target, problem.with_holes);
    let weights = Weights { stray: search.stray_weight, gap: 0.0 };
    let mut planner = Planner {
        problem,
        near_target: &near_target,
        judge: Coarse::new(
            &near_target,
            problem.active,
            start,
            &start.x,
            start.len(),
            Crumbs::ByChance,
            weights,
        ),
        home: &start.x,
        scouts: Batch::<T>::new(&for_search(problem.params), tool, &forward_only),
        batch: Batch::<T>::new(problem.params, tool, &forward_only),
        rng: seeded(problem.seed, "search"),
    };
    let mut state = start.clone();
    let Cost { objective: mut objective_now, emd: emd_initial, .. } = planner.judge.cost_of_all(&state.x);
    let mut emd_now = emd_initial;
    let mut failures = 0;
    // What looking ahead has found for the dough as it is.
    let mut known: Vec<Tried> = Vec::new();
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
        if failures == FAILURES {
            break StopReason::Stuck;
        }
        objective_now = planner.weigh_gaps(objective_now, &state, failures > 0);
        let resets = usize::max(strokes, 1) - 1;
        let on_searched = |searched| {
            let horizon = search.lengths.iter().copied().max().unwrap_or(0);
            observe(Progress { step: steps, searched, horizon, emd: emd_now, resets });
        };
        let pool = std::mem::take(&mut known);
        // A search that fails may have failed for a crumb that cannot be moved: the next one does not know of it.
        let crumbs = if failures == 0 { Crumbs::Chosen } else { Crumbs::ByChance };
        let found = planner.explore(&state, steps_left, crumbs, pool, on_searched);
        if found.is_empty() {
            break StopReason::NoPlace;
        }
        let outcomes = planner.outcomes(objective_now, &state, found);
        let Some((best, next)) = planner.best_to_go_on(objective_now, steps_left, outcomes) else {
            failures += 1;
            continue;
        };
        let Outcome { tried, objective, emd, mut horizon, settled, settling } = best;
        horizon.losses = vec![objective_now, tried.objective, objective];
        let accepted = search.is_gain(objective_now, objective);
        segments.push(SegmentTrace {
            placed: true,
            start_pose: tried.pose,
            horizon,
            emd_before: emd_now,
            emd_after: emd,
            accepted,
            reachable: Vec::new(),
            settling,
        });
        if !accepted {
            failures += 1;
            continue;
        }
        state = settled;
        (emd_now, objective_now) = (emd, objective);
        steps += tried.stroke.steps;
        strokes += 1;
        known = next;
    };
    let resets = usize::max(strokes, 1) - 1;
    StageTrace { segments, end: state, steps, resets, emd_initial, emd_final: emd_now, stop }
}

/// A stroke with all particles.
struct Outcome {
    tried: Tried,
    /// The objective and the EMD after it, of all particles, m.
    objective: f64,
    emd: f64,
    /// What the tool did.
    horizon: Horizon,
    /// The dough after it has settled, and how it settled.
    settled: ParticleState,
    settling: Vec<Vec<Point>>,
}

/// What a stage's search carries from stroke to stroke.
struct Planner<'a, T: Real> {
    problem: &'a StageProblem<'a>,
    near_target: &'a NearTarget<'a>,
    /// The objective of all particles.
    judge: Coarse<'a>,
    /// Where the dough was when the stage began, m.
    home: &'a [Point],
    /// Simulators to search with, and those in which strokes are executed.
    scouts: Batch<T>,
    batch: Batch<T>,
    rng: Pcg64,
}

impl<T: Real> Planner<'_, T> {
    /// Gives dough in gaps its weight, and returns the objective with it, `objective_now` so far. Until a search has
    /// found nothing (`has_failed`), all of it costs no more than everything else does: a hole is not cleared for its
    /// own sake while most of the dough is elsewhere.
    fn weigh_gaps(&mut self, objective_now: f64, state: &ParticleState, has_failed: bool) -> f64 {
        let most = self.most_for_gaps();
        let gap = self.judge.gap_cost_of_all(&state.x);
        let weight = self.judge.weights.gap;
        let rest = objective_now - weight * gap;
        let balanced = if has_failed || rest >= most * gap { most } else { rest / gap };
        self.judge.weights.gap = weight.max(balanced);
        rest + self.judge.weights.gap * gap
    }

    /// The weight of gaps at last.
    fn most_for_gaps(&self) -> f64 {
        if self.problem.with_holes.is_empty() { 0.0 } else { self.problem.search.gap_weight }
    }

    /// The best strokes that a search with few particles finds, best first. `pool` is what a first look has found.
    fn explore(
        &mut self,
        state: &ParticleState,
        steps_left: usize,
        crumbs: Crumbs,
        pool: Vec<Tried>,
        on_searched: impl FnMut(f64),
    ) -> Vec<Tried> {
        self.search(state, steps_left, crumbs, |search, seeds, rng| {
            let pool = if pool.is_empty() { search.first(&seeds(), rng) } else { search.judged_anew(pool) };
            let found = search.run(pool, rng, on_searched);
            search.refined(found)
        })
    }

    /// The best strokes of a first generation, which looks everywhere, best first; and the objective before them, m.
    fn first_look(&mut self, state: &ParticleState, steps_left: usize) -> (Vec<Tried>, f64) {
        self.search(state, steps_left, Crumbs::Chosen, |search, seeds, rng| {
            (search.first(&seeds(), rng), search.before)
        })
    }

    /// Gives `run` a search for strokes on few of the particles, and the seeds for it.
    fn search<R>(
        &mut self,
        state: &ParticleState,
        steps_left: usize,
        crumbs: Crumbs,
        run: impl FnOnce(&mut Search<'_, T>, &dyn Fn() -> Vec<Seed>, &mut Pcg64) -> R,
    ) -> R {
        let Self { problem, near_target, judge, home, scouts, rng, .. } = self;
        let (problem, particles) = (*problem, problem.search.particles);
        let coarse = Coarse::new(near_target, problem.active, state, home, particles, crumbs, judge.weights);
        // The executed tool must clear every particle, not just those that the search goes by.
        let all = placement(problem, &state.x, problem.active, &[]);
        let lowered = |pose: ToolPose| all.lowered_anyhow(pose);
        let now = coarse.cost(&coarse.state.x);
        let mut search = Search {
            settings: problem.search,
            tool: problem.tool,
            rest: problem.rest,
            coarse: &coarse,
            before: now.objective,
            lowered: &lowered,
            batch: scouts,
            gradient_memory: problem.options.memory_limit / problem.options.threads.max(1),
            steps_left,
        };
        run(&mut search, &|| seeds_on(problem, &coarse, &coarse.motion(&now.target_of)), rng)
    }

    /// What the best strokes do with all particles, best first: few do not tell everything, above all of a knife. If much
    /// is to be gained, the best one is tried beside its place as well.
    fn outcomes(&mut self, objective_now: f64, state: &ParticleState, mut found: Vec<Tried>) -> Vec<Outcome> {
        let Self { problem, batch, judge, .. } = self;
        let (problem, judge, search) = (*problem, &*judge, problem.search);
        let all = placement(problem, &state.x, problem.active, &[]);
        let mut outcomes: Vec<Outcome> = Vec::new();
        let mut add = |outcomes: &mut Vec<Outcome>, strokes: &[Tried]| {
            let length = |tried: &Tried| tried.stroke.steps;
            let run = |sim: &mut Simulator<T>, tried: &Tried| execute(sim, problem, judge, state, tried).ok();
            outcomes.extend(batch.run(strokes, length, run).into_iter().flatten());
            let merit = |o: &Outcome| search.merit(objective_now - o.objective, o.tried.stroke.steps);
            // A stable sort: of equal ones first the one that is better with few particles.
            outcomes.sort_by(|a, b| merit(b).total_cmp(&merit(a)));
        };
        found.truncate(search.finalists);
        add(&mut outcomes, &found);
        for way in NUDGES {
            let Some(best) = outcomes.first().filter(|o| is_large(objective_now, o)) else { break };
            let beside = |stroke: Stroke| {
                let pose = all.lowered_anyhow(stroke.pose_above(problem.rest));
                Tried { stroke, pose, ..best.tried.clone() }
            };
            let near: Vec<Tried> = best.tried.stroke.nudged(way).into_iter().map(beside).collect();
            add(&mut outcomes, &near);
        }
        outcomes
    }

    /// The stroke after which, with the best stroke that a first look finds to follow it, most is gained; and what was
    /// found to follow it.
    fn best_to_go_on(
        &mut self,
        objective_now: f64,
        steps_left: usize,
        mut outcomes: Vec<Outcome>,
    ) -> Option<(Outcome, Vec<Tried>)> {
        let search = self.problem.search;
        if search.beam < 2 || outcomes.first().is_none_or(|o| !is_large(objective_now, o)) {
            return outcomes.into_iter().next().map(|o| (o, Vec::new()));
        }
        // One that gains next to nothing would not be accepted, whatever could follow it.
        outcomes.retain(|o| search.is_gain(objective_now, o.objective));
        let mut best: Option<(f64, Outcome, Vec<Tried>)> = None;
        for outcome in of_different_kinds(outcomes, search.beam, objective_now) {
            let gain = objective_now - outcome.objective;
            let steps = outcome.tried.stroke.steps;
            let (mut merit, mut follow) = (search.merit(gain, steps), Vec::new());
            if steps < steps_left {
                let (next, before) = self.first_look(&outcome.settled, steps_left - steps);
                let total = |t: &Tried| search.merit(gain + before - t.objective, steps + t.stroke.steps);
                merit = next.iter().map(total).fold(merit, f64::max);
                follow = next;
            }
            if best.as_ref().is_none_or(|b| merit > b.0) {
                best = Some((merit, outcome, follow));
            }
        }
        best.map(|(_, outcome, follow)| (outcome, follow))
    }
}

/// Whether a stroke gains much of what is left.
fn is_large(objective_now: f64, outcome: &Outcome) -> bool {
    objective_now - outcome.objective >= LARGE_GAIN * objective_now
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

/// Places from which strokes on the dough may begin that should go by `motion`, m.
fn seeds_on(problem: &StageProblem<'_>, coarse: &Coarse<'_>, motion: &[Point]) -> Vec<Seed> {
    let reachable: Vec<Point> =
        coarse.state.x.iter().zip(motion).map(|(p, m)| std::array::from_fn(|a| p[a] + m[a])).collect();
    let place = placement(problem, &coarse.state.x, &coarse.active, &reachable);
    let count = problem.search.first_population / 3;
    seeds::seeds(&place, problem.params.substeps, motion, &coarse.strays(), count)
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
        // The search turns the tool itself.
        turns: 1,
    }
}

fn execute<T: Real>(
    sim: &mut Simulator<T>,
    problem: &StageProblem<'_>,
    judge: &Coarse<'_>,
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
    let Cost { objective, emd, .. } = judge.cost_of_all(&settled.x);
    Ok(Outcome { tried: tried.clone(), objective, emd, horizon, settled, settling })
}
