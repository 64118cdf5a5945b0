//! Tests of the path from a task file to subgoals, over made-up plans and files with one mistake each.
//!
//! Nothing comes in but the task files of the binary. Imports the task module.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::*;
use crate::llm::stage::{NamedCloud, Stage};
use crate::math::cloud::{Bounds, Point, centroid, distance};

const FLOOR: f64 = 0.0385;

fn stage(step: u32, tool: &str, inputs: &[&str], outputs: &[(&str, Solid, Point)]) -> Stage {
    let cloud = |(i, (name, solid, center)): (usize, &(&str, Solid, Point))| NamedCloud {
        name: (*name).to_string(),
        points: solid.fill(*center, 800, i as u64),
    };
    Stage {
        step,
        title: format!("step {step}"),
        tool: (!tool.is_empty()).then(|| tool.to_string()),
        inputs: inputs.iter().map(|s| (*s).to_string()).collect(),
        outputs: outputs.iter().enumerate().map(cloud).collect(),
        stated_location: BTreeMap::new(),
        stated_volume: BTreeMap::new(),
        code: String::new(),
    }
}

/// Cut the bar into a third and two thirds, then roll each part.
fn two_pancakes() -> Vec<Stage> {
    let bar = |length: f64| Solid::Box { size: [length, 0.4, 0.4] };
    let pancake = |volume: f64| Solid::Disc { radius: (volume / (0.1 * PI)).sqrt(), height: 0.1 };
    vec![
        stage(0, "", &[], &[("dough", bar(1.0), [0.0; 3])]),
        stage(
            1,
            "knife",
            &["dough"],
            &[("small", bar(1.0 / 3.0), [-0.8, 0.0, 0.0]), ("large", bar(2.0 / 3.0), [0.6, 0.3, 0.0])],
        ),
        stage(2, "rolling pin", &["small"], &[("small_cake", pancake(0.0533), [-0.8, 0.0, 0.0])]),
        stage(3, "rolling pin", &["large"], &[("large_cake", pancake(0.1067), [0.6, 0.0, 0.0])]),
    ]
}

fn scene(name: &str) -> Scene {
    load_scene(name).unwrap()
}

fn plan(stages: &[Stage]) -> Result<StagePlan, StageError> {
    let scene = scene("two-pancakes");
    StagePlan::new(stages, &scene.frame(), &scene.world(FLOOR))
}

/// Each point in turn takes the nearest target that is left.
fn greedy(source: &[Point], target: &[Point]) -> Vec<usize> {
    let mut free: Vec<usize> = (0..target.len()).collect();
    let mut pick = |p: &Point| {
        let near =
            |&a: &usize, &b: &usize| distance(*p, target[free[a]]).total_cmp(&distance(*p, target[free[b]]));
        let best = (0..free.len()).min_by(near).unwrap();
        free.swap_remove(best)
    };
    source.iter().map(&mut pick).collect()
}

#[test]
fn every_task_in_the_binary_parses_and_fits() {
    for name in built_in_names() {
        let scene = scene(name);
        assert_eq!(scene.name, name);
        let particles = scene.particles(1);
        assert_eq!(particles.len(), scene.dough.particles);
        assert!((low_quantile(&particles) - FLOOR).abs() < 0.01, "{name} does not rest");
        match &scene.target {
            Target::Stages { recorded_answers, .. } => {
                assert_eq!(recorded_answers.as_deref(), Some(name));
                assert!(!scene.task_line.is_empty());
                assert_eq!(scene.tools.len(), 4, "a model may choose any of the four tools");
            }
            Target::Generated { tool, .. } => {
                assert!(scene.tool(tool).is_some());
                for index in 0..5 {
                    let stages = scene.generated_stages(0, index).unwrap();
                    let plan = StagePlan::new(&stages, &scene.frame(), &scene.world(FLOOR)).unwrap();
                    assert_eq!(plan.goal_cloud(300, 0).len(), 300);
                }
            }
        }
    }
}

#[test]
fn a_horizon_chain_reaches_the_farthest_target_of_arrange() {
    let planner = scene("arrange").planner;
    let horizons = (planner.max_steps / planner.horizon) as f64;
    assert!(horizons * planner.emd_steps as f64 * planner.emd_step_length_m > 0.35f64.hypot(0.2));
}

#[test]
fn pieces_are_followed_by_name_through_a_plan() {
    let plan = plan(&two_pancakes()).unwrap();
    let names: Vec<&str> = plan.pieces.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["dough", "small", "large", "small_cake", "large_cake"]);
    assert_eq!(plan.last, [3, 4]);

    let bar = Solid::Box { size: [0.2, 0.08, 0.08] }.fill([0.5, 0.0785, 0.5], 300, 1);
    let mut pieces = Pieces::initial(300);
    let cut = plan.subgoal(0, &pieces, 1);
    assert_eq!((cut.tool.as_str(), cut.active.len(), cut.target.len()), ("knife", 300, 300));
    let small = cut.piece_of_target.iter().filter(|p| **p == 1).count();
    assert!((95..=105).contains(&small), "a third of the volume, {small} of 300 points");

    cut.relabel(&mut pieces, &bar, 0.005, &greedy(&bar, &cut.target));
    let in_small = pieces.members(&[1]);
    assert_eq!(in_small.len(), small);
    let mean_x = |ix: &[usize]| ix.iter().map(|&i| bar[i][0]).sum::<f64>() / ix.len() as f64;
    assert!(mean_x(&in_small) < mean_x(&pieces.members(&[2])), "the small piece is the left one");

    let roll = plan.subgoal(1, &pieces, 1);
    assert_eq!(roll.active, in_small, "the large piece stays where it is");
    assert!(roll.piece_of_target.iter().all(|p| *p == 3));
    let rolled: Vec<Point> = roll.active.iter().map(|&i| bar[i]).collect();
    roll.relabel(&mut pieces, &bar, 0.005, &greedy(&rolled, &roll.target));
    assert_eq!(plan.subgoal(2, &pieces, 1).active.len(), 300 - small);
    assert_eq!(pieces.members(&[2]).len() + pieces.members(&[3]).len(), 300);
}

#[test]
fn what_hangs_together_stays_one_piece_whatever_its_size() {
    let plan = plan(&two_pancakes()).unwrap();
    // Cut at two fifths instead of a third, into parts that are 0.2 m apart: the match alone would give a sixth of
    // the left part to the right piece.
    let row = |from: usize, to: usize, x: f64| (from..to).map(move |i| [x + 0.002 * i as f64, 0.05, 0.5]);
    let cut_bar: Vec<Point> = row(0, 120, 0.2).chain(row(120, 300, 0.4)).collect();
    let cut = plan.subgoal(0, &Pieces::initial(300), 1);
    let mut pieces = Pieces::initial(300);
    cut.relabel(&mut pieces, &cut_bar, 0.005, &greedy(&cut_bar, &cut.target));
    assert_eq!(pieces.members(&[1]), (0..120).collect::<Vec<_>>());
    assert_eq!(plan.subgoal(1, &pieces, 1).target.len(), 120);
    // In one piece still: the match decides.
    let bar: Vec<Point> = row(0, 300, 0.2).collect();
    cut.relabel(&mut pieces, &bar, 0.005, &greedy(&bar, &cut.target));
    assert!((95..=105).contains(&pieces.members(&[1]).len()));
}

#[test]
fn clouds_are_scaled_centred_and_put_on_the_table() {
    let plan = plan(&two_pancakes()).unwrap();
    for piece in &plan.pieces[1..] {
        assert!((low_quantile(&piece.points) - FLOOR).abs() < 1e-12, "{} does not rest", piece.name);
    }
    let large = &plan.pieces[2];
    let size = Bounds::of(&large.points).unwrap().size();
    assert!((size[0] - 0.2 * 2.0 / 3.0).abs() < 0.01 && (size[1] - 0.08).abs() < 0.01, "{size:?}");
    let c = centroid(&large.points);
    assert!((c[0] - 0.62).abs() < 1e-3 && (c[2] - 0.5).abs() < 1e-3, "{c:?}");
    assert!((large.measured_volume / (0.2f64.powi(3) * 0.16 * 2.0 / 3.0) - 1.0).abs() < 0.1);
}

#[test]
fn stated_volumes_decide_if_all_are_stated() {
    let mut stages = two_pancakes();
    stages[1].stated_volume = [("small".to_string(), 1.0), ("large".to_string(), 1.0)].into();
    let count = |stages: &[Stage]| {
        let subgoal = plan(stages).unwrap().subgoal(0, &Pieces::initial(300), 0);
        subgoal.piece_of_target.iter().filter(|p| **p == 1).count()
    };
    assert_eq!(count(&stages), 150);
    stages[1].stated_volume.remove("large");
    assert!(count(&stages) < 110);
}

#[test]
fn the_goal_is_the_last_clouds_in_proportion() {
    let goal = plan(&two_pancakes()).unwrap().goal_cloud(600, 2);
    assert_eq!(goal.len(), 600);
    let left = goal.iter().filter(|p| p[0] < 0.5).count();
    assert!((185..=215).contains(&left), "{left}");
}

#[test]
fn unknown_inputs_mean_the_only_piece_or_are_refused() {
    let mut stages = two_pancakes();
    stages[1].inputs = vec!["whatever the model calls it".to_string()];
    assert_eq!(plan(&stages).unwrap().stages[0].inputs, [0]);

    stages[2].inputs = vec!["left".to_string()];
    let message = plan(&stages).unwrap_err().to_string();
    assert!(message.starts_with("step 2 takes `left`"), "{message}");
    assert!(message.contains("`small`, `large`"), "{message}");
}

#[test]
fn a_piece_may_keep_its_name() {
    let disc = Solid::Disc { radius: 0.5, height: 0.2 };
    let stages = [
        stage(1, "rolling pin", &["dough"], &[("dough", disc, [0.0; 3])]),
        stage(2, "rolling pin", &["dough"], &[("dough", disc, [0.2, 0.0, 0.0])]),
    ];
    let plan = plan(&stages).unwrap();
    assert_eq!((plan.stages[1].inputs.as_slice(), plan.last.as_slice()), (&[1][..], &[2][..]));
}

#[test]
fn plans_that_do_not_fit_the_world_are_refused() {
    let message = |change: &dyn Fn(&mut Vec<Stage>)| {
        let mut stages = two_pancakes();
        change(&mut stages);
        plan(&stages).unwrap_err().to_string()
    };
    let tool = message(&|s| s[2].tool = Some("whisk".to_string()));
    assert!(tool.contains("step 2") && tool.contains("`whisk`") && tool.contains("`gripper`"), "{tool}");

    let far = message(&|s| s[3].outputs[0].points.iter_mut().for_each(|p| p[0] += 2.0));
    assert!(far.contains("step 3 puts `large_cake`") && far.contains("x = 1.1"), "{far}");

    let nothing = message(&|s| s[1].outputs.clear());
    assert!(nothing.contains("step 1 makes no piece"), "{nothing}");

    let nan = message(&|s| s[1].outputs[1].points[0][2] = f64::NAN);
    assert!(nan.contains("`large`") && nan.contains("not finite"), "{nan}");

    assert_eq!(plan(&two_pancakes()[..1]).unwrap_err(), StageError::Empty);
}

/// The message for the task file `donut` with one text replaced, and the line where it stands.
fn mistake(old: &str, new: &str) -> (String, usize) {
    let donut = TaskSource::find("donut").unwrap().text;
    assert!(donut.contains(old), "{old}");
    let line = 1 + donut[..donut.find(old).unwrap()].matches('\n').count();
    let source = TaskSource { label: "my.toml".to_string(), text: donut.replacen(old, new, 1) };
    (source.scene().unwrap_err().to_string(), line)
}

#[test]
fn mistakes_name_file_line_and_key() {
    let cases = [
        ("ball = { radius_m = 0.07 }", "ball = { radius_m = -0.07 }", "dough.shape.ball.radius_m"),
        ("threshold = 0.3", "treshold = 0.3", "treshold"),
        ("dt_s = 1e-4", "dt_s = \"fast\"", "dt_s"),
        ("dt_s = 1e-4", "dt_s = 3e-4", "make dt_s at most 1.9"),
        ("nodes = 64", "nodes = 8", "from 16 to 512"),
        ("poisson_ratio = 0.15", "poisson_ratio = 0.5", "between 0 and 0.5"),
        ("center_m = [0.5, 0.1085, 0.5]", "center_m = [0.5, 0.1085, 0.95]", "outside the workspace"),
        ("name = \"knife\"", "name = \"rolling pin\"", "second time"),
        ("action_scale = [0.01, 0.01, 0.01]", "action_scale = [0.01]", "3 action components"),
        ("horizon = 40", "horizon = 0", "planner.horizon"),
        ("llm_unit_m = 0.07", "llm_unit_m = nan", "target.stages.llm_unit_m"),
    ];
    for (old, new, expected) in cases {
        let (message, line) = mistake(old, new);
        assert!(message.contains(&format!("my.toml, line {line}")), "{message} (line {line})");
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn a_missing_file_is_named() {
    let message = load_scene("no/such.toml").unwrap_err().to_string();
    assert!(message.contains("no/such.toml"), "{message}");
}
