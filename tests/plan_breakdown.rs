//! Planning in a world whose tool is so fast that it tears the simulation apart: iterations are rejected, runs
//! go on.

use donut::math::cloud::Point;
use donut::plan::losses::{Aim, Goal};
use donut::plan::optimize::optimize;
use donut::plan::settings::{Effort, Method, SearchSettings};
use donut::plan::{StageProblem, StopReason, plan_stage};
use donut::sim::{Options, ParticleState, Shape, SimError, Simulator, ToolPose};
use donut::task::{Scene, load_scene};

/// The task `donut` with few particles, a pole that crosses a cell in a substep, and an optimiser that uses all of
/// its speed at once.
struct World {
    scene: Scene,
    start: ParticleState,
    target: Vec<Point>,
}

/// The pole among the tools of the task.
const POLE: usize = 3;
const STEPS: usize = 4;

fn world() -> World {
    let mut scene = load_scene("donut").unwrap();
    assert_eq!(scene.tools[POLE].tool.name, "pole");
    // Thick enough that it tears the dough and does not just pass through.
    scene.tools[POLE].tool.shape = Shape::Capsule { radius: 0.03, length: 0.2 };
    scene.tools[POLE].tool.lower_bound[1] = 0.13;
    scene.tools[POLE].tool.action_scale = vec![0.4; 3];
    scene.planner.learning_rate = 1.0;
    scene.planner.horizon = STEPS;
    scene.planner.iterations = 3;
    scene.planner.max_steps = 3 * STEPS;
    let dough = scene.dough.solid.fill(scene.dough.center, 300, 0);
    let target = dough.iter().map(|p| [p[0] + 0.05, 0.5 * p[1], p[2]]).collect();
    World { scene, start: ParticleState::at_rest(dough), target }
}

/// The pole above the middle of the dough, its tip half a cell away.
fn above(world: &World) -> ToolPose {
    let top = world.start.x.iter().map(|p| p[1]).fold(0.0, f64::max);
    ToolPose { position: [0.5, top + 0.138, 0.5], ..world.scene.tools[POLE].rest }
}

#[test]
fn an_iteration_that_breaks_down_is_rejected_and_the_last_good_actions_are_kept() {
    let world = world();
    let scene = &world.scene;
    let mut sim =
        Simulator::<f32>::new(scene.params.clone(), vec![scene.tools[POLE].tool.clone()], Options::default());
    let pose = above(&world);
    // Full speed downwards does break the simulation: otherwise nothing is tested here.
    let error = sim.rollout(&world.start, &[pose], &vec![vec![0.0, -1.0, 0.0]; STEPS]).unwrap_err();
    assert!(matches!(error, SimError::Inverted { .. } | SimError::NonFinite { .. }), "{error}");

    let active: Vec<usize> = (0..world.start.len()).collect();
    let goal = Goal { aim: Aim::Points(&world.target), active: &active, weights: scene.planner.loss_weights };
    let mut heard = 0;
    let horizon = optimize(&mut sim, &world.start, &pose, &goal, &scene.planner, |_| heard += 1).unwrap();
    assert!(horizon.fault.is_some(), "a step at rate 1 is full speed");
    assert!((1..scene.planner.iterations).contains(&heard), "{heard}");
    assert_eq!(horizon.losses.len(), heard);
    sim.rollout(&world.start, &[pose], &horizon.actions).expect("the actions that are kept worked");
    assert_eq!(sim.state(STEPS), horizon.end);
}

fn plan(method: Method) {
    let world = world();
    let scene = &world.scene;
    let active: Vec<usize> = (0..world.start.len()).collect();
    let search = SearchSettings {
        first_population: 6,
        population: 6,
        generations: 2,
        ..SearchSettings::of(Effort::Quick)
    };
    let problem = StageProblem {
        params: &scene.params,
        options: &Options::default(),
        method,
        settings: &scene.planner,
        search: &search,
        seed: 0,
        tool: &scene.tools[POLE].tool,
        rest: &scene.tools[POLE].rest,
        active: &active,
        target: &world.target,
        with_holes: &[],
    };
    let trace = plan_stage::<f32>(&problem, &world.start, |_| {});
    assert!(!matches!(trace.stop, StopReason::Diverged(_)), "{}", trace.stop);
    assert!(trace.emd_final.is_finite() && trace.emd_final <= trace.emd_initial, "{trace:?}");
    assert!(trace.end.x.as_flattened().iter().all(|v| v.is_finite()));
    if method == Method::Paper {
        assert!(trace.segments.iter().any(|s| s.horizon.fault.is_some()), "an iteration broke down");
        assert!(trace.segments.len() > 1, "the run went on after it");
    }
}

#[test]
fn algorithm_1_goes_on_after_iterations_that_break_down() {
    plan(Method::Paper);
}

#[test]
fn the_search_goes_on_after_strokes_that_break_down() {
    plan(Method::Donut);
}
