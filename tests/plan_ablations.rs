//! Every ablation of Algorithm 1 changes the one thing that it is named for.

use clap::ValueEnum;
use donut::emd::exact::assign;
use donut::llm::recorded::recorded;
use donut::llm::stages_from_answer;
use donut::math::cloud::Point;
use donut::plan::settings::{Effort, Method, SearchSettings};
use donut::plan::{SegmentTrace, StageProblem, StageTrace, plan_stage};
use donut::sim::{Options, ParticleState, Simulator};
use donut::task::run::{Planning, TaskRun, run_task};
use donut::task::{Scene, load_scene};

const PARTICLES: usize = 150;

/// The task `cut` with few particles and short horizons; only the first loss counts.
fn bar() -> (Scene, Vec<Point>) {
    let mut scene = load_scene("cut").unwrap();
    scene.planner.horizon = 5;
    scene.planner.max_steps = 10;
    scene.planner.iterations = 2;
    scene.planner.loss_weights = [1.0, 0.0, 0.0];
    let dough = scene.dough.solid.fill(scene.dough.center, PARTICLES, 0);
    (scene, dough)
}

/// The bar's right half slid away, which wants the knife in the middle or right of it.
fn slid(dough: &[Point]) -> Vec<Point> {
    dough.iter().map(|p| [p[0] + if p[0] > 0.5 { 0.11 } else { 0.0 }, p[1], p[2]]).collect()
}

fn plan(scene: &Scene, dough: &[Point], target: &[Point], method: Method) -> StageTrace {
    let active: Vec<usize> = (0..dough.len()).collect();
    let problem = StageProblem {
        params: &scene.params,
        options: &Options::default(),
        method,
        settings: &scene.planner,
        search: &SearchSettings::of(Effort::Quick),
        seed: 0,
        tool: &scene.tools[0].tool,
        rest: &scene.tools[0].rest,
        active: &active,
        target,
        with_holes: &[],
    };
    plan_stage::<f32>(&problem, &ParticleState::at_rest(dough.to_vec()), |_| {})
}

/// Where the dough is after a horizon of standing still, which is what the first gradient iteration sees.
fn after_standing_still(scene: &Scene, dough: &[Point], trace: &StageTrace) -> Vec<Point> {
    let tool = &scene.tools[0].tool;
    let steps = trace.segments[0].horizon.actions.len();
    let mut sim = Simulator::<f32>::new(scene.params.clone(), vec![tool.clone()], Options::default());
    let start = ParticleState::at_rest(dough.to_vec());
    sim.rollout(&start, &[trace.segments[0].start_pose], &vec![vec![0.0; 3]; steps]).unwrap();
    sim.positions(steps)
}

fn mean_l1(a: &[Point], b: &[Point]) -> f64 {
    let one = |(p, q): (&Point, &Point)| (0..3).map(|k| (p[k] - q[k]).abs()).sum::<f64>();
    a.iter().zip(b).map(one).sum::<f64>() / a.len() as f64
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

#[test]
fn without_p2p_the_loss_is_the_emd_to_the_subgoal() {
    let (scene, dough) = bar();
    let target = slid(&dough);
    let [with, without] = [Method::Paper, Method::PaperNoP2p].map(|m| plan(&scene, &dough, &target, m));
    let x = after_standing_still(&scene, &dough, &with);
    let loss = |trace: &StageTrace| trace.segments[0].horizon.losses[0];
    assert!(close(loss(&with), mean_l1(&x, &with.segments[0].reachable)), "{}", loss(&with));
    assert!(close(loss(&without), assign(&x, &target).mean_distance), "{}", loss(&without));
    // Everything else is the same: where it starts, how long a segment is.
    assert_eq!(with.segments[0].start_pose, without.segments[0].start_pose);
    assert_eq!(with.segments[0].horizon.actions.len(), without.segments[0].horizon.actions.len());
    assert_ne!(with.segments[0].horizon.actions, without.segments[0].horizon.actions);
}

#[test]
fn without_placement_the_tool_starts_over_the_dough_where_it_waits() {
    let (scene, dough) = bar();
    let target = slid(&dough);
    let [with, without] = [Method::Paper, Method::PaperNoPlacement].map(|m| plan(&scene, &dough, &target, m));
    let start = |trace: &StageTrace| trace.segments[0].start_pose;
    let rest = scene.tools[0].rest;
    let [x, y, z] = start(&without).position;
    assert_eq!(([x, z], start(&without).rotation), ([rest.position[0], rest.position[2]], rest.rotation));
    assert!(y < rest.position[1], "lowered on the dough: {y}");
    assert_ne!(start(&with).position, start(&without).position);
    let x = after_standing_still(&scene, &dough, &without);
    let loss = without.segments[0].horizon.losses[0];
    assert!(close(loss, mean_l1(&x, &without.segments[0].reachable)), "still point to point: {loss}");
}

#[test]
fn without_reset_a_segment_that_made_it_worse_is_kept_and_the_tool_goes_on() {
    let (mut scene, dough) = bar();
    // Dough where it should be, but for a hair, under a knife that is made to move: it can only get worse.
    let target: Vec<Point> = dough.iter().map(|p| [p[0] + 0.001, p[1], p[2]]).collect();
    scene.planner.emd_tolerance_m = 0.0;
    scene.planner.learning_rate = 1.0;
    scene.planner.reset_below_gain = 0.0;
    scene.planner.max_steps = 15;
    let worse = |trace: &StageTrace| trace.segments.iter().filter(|s| s.emd_after > s.emd_before).count();
    let with = plan(&scene, &dough, &target, Method::Paper);
    assert!(worse(&with) > 1 && with.resets > 0, "{} {}", worse(&with), with.resets);
    // The first segment has nothing to be compared with.
    assert!(with.segments[1..].iter().filter(|s| s.emd_after > s.emd_before).all(|s| !s.accepted));

    let without = plan(&scene, &dough, &target, Method::PaperNoReset);
    assert_eq!((without.resets, without.steps), (0, 15));
    assert!(worse(&without) > 0 && without.segments.iter().all(|s| s.accepted));
    let placed: Vec<bool> = without.segments.iter().map(|s| s.placed).collect();
    assert_eq!(placed, [true, false, false]);
    let end = without.segments[0].horizon.poses.last().unwrap();
    assert_eq!(without.segments[1].start_pose, *end);
    // Until the first segment is over there is no difference.
    assert_eq!(without.segments[0].horizon.actions, with.segments[0].horizon.actions);
}

#[test]
fn where_no_gain_is_enough_every_segment_begins_anew() {
    let (mut scene, dough) = bar();
    let target = slid(&dough);
    scene.planner.learning_rate = 0.3;
    scene.planner.max_steps = 15;
    scene.planner.reset_below_gain = 1.0;
    let anew = plan(&scene, &dough, &target, Method::Paper);
    assert!(anew.segments.len() >= 3 && anew.segments.iter().all(|s| s.placed));
    assert_eq!(anew.resets, anew.segments.len() - 1);
    assert_ne!(anew.segments[1].start_pose, anew.segments[0].start_pose);

    scene.planner.reset_below_gain = 0.0;
    let on = plan(&scene, &dough, &target, Method::Paper);
    let goes_on = |pair: &[SegmentTrace]| pair[0].accepted && pair[0].emd_after <= pair[0].emd_before;
    assert!(on.segments.windows(2).any(goes_on), "no segment gains");
    for pair in on.segments.windows(2) {
        assert_eq!(pair[1].placed, !goes_on(pair));
        let end = pair[0].horizon.poses.last().unwrap();
        assert_eq!(pair[1].start_pose == *end, goes_on(pair));
    }
}

fn run(method: Method) -> TaskRun {
    let mut scene = load_scene("donut").unwrap();
    scene.dough.particles = PARTICLES;
    scene.planner.horizon = 2;
    scene.planner.max_steps = 2;
    scene.planner.iterations = 1;
    let search = SearchSettings {
        first_population: 4,
        population: 4,
        generations: 1,
        ..SearchSettings::of(Effort::Quick)
    };
    let stages = stages_from_answer(recorded("donut", 1).unwrap()).unwrap().stages;
    run_task(&scene, &stages, &Planning { method, search }, 0, &Options::default(), |_| {}).unwrap()
}

#[test]
fn without_stages_every_tool_of_the_plan_aims_at_the_last_goal() {
    for (with, without) in [(Method::Paper, Method::PaperNoStages), (Method::Donut, Method::DonutNoStages)] {
        let [with, without] = [with, without].map(run);
        let tools = |run: &TaskRun| run.stages.iter().map(|s| s.tool).collect::<Vec<_>>();
        assert_eq!(tools(&with), tools(&without));
        assert_eq!(with.goal, without.goal);
        assert_ne!(with.stages[0].subgoal.target, with.goal, "a disc is no ring");
        for stage in &without.stages {
            assert_eq!((&stage.subgoal.target, stage.subgoal.active.len()), (&without.goal, PARTICLES));
            assert!(stage.trace.steps <= 2, "the same budget");
        }
    }
}

#[test]
fn diff_physics_optimises_all_actions_of_a_tool_at_once() {
    let (scene, dough) = bar();
    let target = slid(&dough);
    let trace = plan(&scene, &dough, &target, Method::DiffPhysics);
    let fixed = plan(&scene, &dough, &target, Method::PaperNoPlacement).segments[0].start_pose;
    assert_eq!(trace.segments.len(), 1);
    let only = &trace.segments[0];
    assert_eq!((only.horizon.actions.len(), only.horizon.losses.len()), (10, 2));
    assert_eq!(only.start_pose, fixed);
    let x = after_standing_still(&scene, &dough, &trace);
    assert!(close(only.horizon.losses[0], assign(&x, &target).mean_distance));
    assert!(!Method::DiffPhysics.switches().stages);
}

#[test]
fn methods_are_called_what_they_leave_out() {
    let names: Vec<String> = Method::value_variants().iter().map(|m| m.name()).collect();
    let expected = [
        "donut",
        "donut-no-stages",
        "paper",
        "paper-no-p2p",
        "paper-no-placement",
        "paper-no-reset",
        "paper-no-stages",
        "diff-physics",
    ];
    assert_eq!(names, expected);
    for (method, name) in Method::value_variants().iter().zip(expected) {
        assert_eq!(serde_json::to_value(method).unwrap(), name, "results and plans agree");
    }
}
