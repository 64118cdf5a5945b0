//! Carrying out a task: settle the dough, plan and execute each stage, measure what came of it.
//!
//! A scene and its stages come in; a [`TaskRun`] with every frame goes out. Scores are exact EMDs over all
//! particles of resting dough. Imports plan, sim, emd and this module's pieces and subgoals.

use std::time::Instant;

use super::error::StageError;
use super::measures::{ShapeMeasures, pieces_with_holes};
use super::pieces::{PieceId, Pieces};
use super::scene::Scene;
use super::subgoal::{StagePlan, Subgoal, low_quantile};
use crate::emd::exact::{Assignment, assign};
use crate::llm::stage::Stage;
use crate::math::cloud::Point;
use crate::math::neighbours::spacing;
use crate::math::volume::measure_volume;
use crate::plan::settings::{Method, SearchSettings};
use crate::plan::settle::settle;
use crate::plan::{Progress, StageProblem, StageTrace, plan_stage};
use crate::sim::{Options, ParticleState, SimError, Work};

/// Free control steps after each stage, at least: what a tool has thrown must land before it is measured.
const SETTLE_STEPS: usize = 20;
/// .. and before the first stage, where the dough slumps under its own weight.
const SETTLE_STEPS_FIRST: usize = 40;

/// A run that could not begin.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The stages do not fit the scene.
    #[error(transparent)]
    Stages(#[from] StageError),
    /// The dough does not even rest.
    #[error("the dough does not come to rest: {0}")]
    Settling(#[from] SimError),
}

/// How one stage of a run went.
#[derive(Clone, Debug)]
pub struct StageRun {
    pub title: String,
    /// Index of its tool in the scene.
    pub tool: usize,
    pub subgoal: Subgoal,
    pub trace: StageTrace,
    /// Positions while the dough settled afterwards.
    pub settling: Vec<Vec<Point>>,
    /// Exact EMD between the stage's particles and its target before, and after settling, m.
    pub emd_initial: f64,
    pub emd_final: f64,
    /// Rollouts and gradients that planning it took.
    pub work: Work,
    pub seconds: f64,
}

/// How a run went.
#[derive(Clone, Debug)]
pub struct TaskRun {
    /// Settled dough at the start, m.
    pub initial: Vec<Point>,
    /// The final goal, as many points as particles, m.
    pub goal: Vec<Point>,
    /// Height at which the dough rests, m.
    pub floor_y: f64,
    pub stages: Vec<StageRun>,
    /// Dough at the end, m.
    pub last: Vec<Point>,
    /// The piece that each particle belongs to at the end, counted among the pieces that exist then.
    pub piece: Vec<i32>,
    /// Exact EMD to the goal, all particles, before and after, m.
    pub emd_initial: f64,
    pub emd_final: f64,
    /// Exact EMD between the goal and a second sample of it: what perfect dough would score.
    pub emd_of_perfect: f64,
    /// Pieces and holes of the dough at the end, beside the goal's.
    pub shape: ShapeMeasures,
    pub seconds: f64,
}

impl TaskRun {
    /// Normalised decrease of the EMD: 1 at the goal, 0 if nothing was gained.
    pub fn score(&self) -> f64 {
        normalised_decrease(self.emd_initial, self.emd_final)
    }

    /// The score that a second sample of the goal itself would get.
    pub fn ceiling(&self) -> f64 {
        normalised_decrease(self.emd_initial, self.emd_of_perfect)
    }
}

/// The paper's score, `(emd_0 - emd_T) / emd_0`; 0 where there was nothing to gain.
pub fn normalised_decrease(initial: f64, last: f64) -> f64 {
    if initial > 0.0 { (initial - last) / initial } else { 0.0 }
}

/// How stages are planned.
#[derive(Clone, Debug, PartialEq)]
pub struct Planning {
    pub method: Method,
    /// Parameters of the method `donut`; those of `paper` stand in the task file.
    pub search: SearchSettings,
}

/// What a run reports while it goes on.
#[derive(Clone, Debug)]
pub enum RunEvent<'a> {
    /// A stage begins.
    Stage { index: usize, count: usize, tool: &'a str, title: &'a str },
    /// A gradient step was done.
    Progress(Progress),
    /// A stage ended.
    StageDone { index: usize, run: &'a StageRun },
}

/// Runs all stages. The same arguments give the same run, whatever the number of threads.
///
/// # Errors
/// [`RunError`] before anything is planned; once it has begun, a run always ends with a result.
pub fn run_task(
    scene: &Scene,
    stages: &[Stage],
    planning: &Planning,
    seed: u64,
    options: &Options,
    mut observe: impl FnMut(RunEvent<'_>),
) -> Result<TaskRun, RunError> {
    let begin = Instant::now();
    let start = ParticleState::at_rest(scene.particles(seed));
    // Names, tools and room are checked against the nominal floor, before anything is simulated.
    StagePlan::new(stages, &scene.frame(), &scene.world(scene.nominal_floor()))?;
    let (mut state, _) = settle::<f32>(&scene.params, options, &start, SETTLE_STEPS_FIRST)?;
    let floor_y = low_quantile(&state.x);
    let plan = StagePlan::new(stages, &scene.frame(), &scene.world(floor_y))?;
    let goal_by = |seed: u64| plan.goal_cloud(state.len(), seed);
    let (goal, perfect) = rayon::join(|| goal_by(seed), || goal_by(seed.wrapping_add(1)));
    let initial = state.x.clone();
    let emd_initial = assign(&initial, &goal).mean_distance;

    let apart = spacing(measure_volume(&initial), initial.len());
    let mut pieces = Pieces::initial(state.len());
    let mut runs = Vec::new();
    for (index, stage) in plan.stages.iter().enumerate() {
        let (count, tool) = (plan.stages.len(), stage.tool.as_str());
        observe(RunEvent::Stage { index, count, tool, title: &stage.title });
        let subgoal = if planning.method.switches().stages {
            plan.subgoal(index, &pieces, seed)
        } else {
            plan.last_goal(index, state.len(), seed)
        };
        let (run, matched) = run_stage(scene, subgoal, &mut state, planning, seed, options, |p| {
            observe(RunEvent::Progress(p))
        });
        run.subgoal.relabel(&mut pieces, &state.x, apart, &matched);
        observe(RunEvent::StageDone { index, run: &run });
        runs.push(run);
    }
    let to_goal = |x: &[Point]| assign(x, &goal).mean_distance;
    let (emd_final, (emd_of_perfect, shape)) =
        rayon::join(|| to_goal(&state.x), || (to_goal(&perfect), ShapeMeasures::of(&state.x, &goal, apart)));
    Ok(TaskRun {
        emd_of_perfect,
        shape,
        initial,
        goal,
        floor_y,
        stages: runs,
        piece: live_index(&pieces, &plan.last),
        last: state.x,
        emd_initial,
        emd_final,
        seconds: begin.elapsed().as_secs_f64(),
    })
}

/// For each particle, where its piece stands among the live ones.
fn live_index(pieces: &Pieces, live: &[PieceId]) -> Vec<i32> {
    let index = |piece: &PieceId| live.iter().position(|p| p == piece).unwrap_or(0) as i32;
    pieces.of_particles().iter().map(index).collect()
}

/// Plans and executes one stage, then lets the dough settle with the tool away. Returns the matching of what came of it
/// as well: for each active particle the index of its target point.
fn run_stage(
    scene: &Scene,
    subgoal: Subgoal,
    state: &mut ParticleState,
    planning: &Planning,
    seed: u64,
    options: &Options,
    observe: impl FnMut(Progress),
) -> (StageRun, Vec<usize>) {
    let begin = Instant::now();
    let tool = scene
        .tools
        .iter()
        .position(|t| t.tool.name == subgoal.tool)
        .expect("the plan was checked against the scene's tools");
    let apart = spacing(measure_volume(&subgoal.target), subgoal.target.len());
    let problem = StageProblem {
        params: &scene.params,
        options,
        method: planning.method,
        settings: &scene.planner,
        search: &planning.search,
        seed,
        tool: &scene.tools[tool].tool,
        rest: &scene.tools[tool].rest,
        active: &subgoal.active,
        target: &subgoal.target,
        with_holes: &pieces_with_holes(&subgoal.target, apart),
    };
    let before = options.tally.work();
    let trace = plan_stage::<f32>(&problem, state, observe);
    let work = options.tally.work() - before;
    *state = trace.end.clone();
    let settling = match settle::<f32>(&scene.params, options, state, SETTLE_STEPS) {
        Ok((settled, frames)) => {
            *state = settled;
            frames
        }
        // Dough that breaks down by itself stays as the stage left it; the score says what that is worth.
        Err(_) => Vec::new(),
    };
    let active: Vec<Point> = subgoal.active.iter().map(|&i| state.x[i]).collect();
    let Assignment { target_of, mean_distance: emd_final } = assign(&active, &subgoal.target);
    let run = StageRun {
        title: subgoal.title.clone(),
        tool,
        emd_initial: trace.emd_initial,
        emd_final,
        subgoal,
        trace,
        settling,
        work,
        seconds: begin.elapsed().as_secs_f64(),
    };
    (run, target_of)
}
