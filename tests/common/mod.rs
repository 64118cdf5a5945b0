//! The program as a user calls it, and a made-up run, so that files and pictures can be tested without the simulator: a
//! ball of dough is squashed into a disc under a rolling pin in 80 control steps of two segments, the second after
//! a reset. Imports donut's store and plan types.

pub mod cut_bar;

use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use donut::math::cloud::Point;
use donut::math::rng::{seeded, uniform};
use donut::plan::settings::{PlannerSettings, Reach, StartScore};
use donut::sim::params::Params;
use donut::sim::tool::{Motion, Shape, Tool, ToolPose};
use donut::store::record::{PlanFile, RunRecord, Segment, StagePlan, StageSummary, Summary};
use donut::store::trajectory::{Step, Trajectory};

/// The program.
pub fn donut() -> Command {
    Command::cargo_bin("donut").unwrap()
}

/// What the program makes of `args` in a folder.
pub fn donut_in(folder: &Path, args: &[&str]) -> Output {
    donut().args(args).current_dir(folder).output().unwrap()
}

pub const STEPS: usize = 80;
const TABLE: f64 = 0.047;
const RADIUS: f64 = 0.06;

/// Points of a ball on the table.
fn ball(n: usize) -> Vec<Point> {
    let mut rng = seeded(7, "synthetic ball");
    let mut points = Vec::new();
    while points.len() < n {
        let p: Point = std::array::from_fn(|_| 2.0 * uniform(&mut rng) - 1.0);
        if p.iter().map(|v| v * v).sum::<f64>() <= 1.0 {
            points.push([0.5 + RADIUS * p[0], TABLE + RADIUS * (1.0 + p[1]), 0.5 + RADIUS * p[2]]);
        }
    }
    points
}

/// The ball pressed to a fraction of its height at constant volume.
fn pressed(ball: &[Point], height: f64) -> Vec<Point> {
    let wider = height.powf(-0.5);
    ball.iter()
        .map(|p| [0.5 + (p[0] - 0.5) * wider, TABLE + (p[1] - TABLE) * height, 0.5 + (p[2] - 0.5) * wider])
        .collect()
}

pub fn rolling_pin() -> Tool {
    Tool {
        name: "rolling pin".into(),
        shape: Shape::Capsule { radius: 0.03, length: 0.3 },
        motion: Motion::RollingPin,
        friction: 0.9,
        action_scale: vec![0.7, 0.005, 0.005, 0.005],
        lower_bound: [0.0; 3],
        upper_bound: [1.0; 3],
    }
}

/// The run, with `n` particles.
pub fn squashed_ball(n: usize) -> RunRecord {
    let initial = ball(n);
    let target = pressed(&initial, 0.25);
    let mut trajectory = Trajectory::new(initial.clone(), target.clone(), vec![target]);
    let mut segments = Vec::new();
    for (first_frame, placed) in [(0, true), (STEPS / 2, true)] {
        segments.push(Segment {
            placed,
            start_pose: pose(first_frame),
            first_frame,
            accepted: true,
            actions: (first_frame..first_frame + STEPS / 2).map(action).collect(),
            emd_before: emd(first_frame),
            emd_after: emd(first_frame + STEPS / 2),
            losses: (0..20).map(|i| 0.02 * (-0.15 * f64::from(i)).exp() + 0.01).collect(),
        });
    }
    for t in 1..=STEPS {
        trajectory.push(Step {
            positions: &pressed(&initial, height(t)),
            tool: 0,
            tool_pose: pose(t),
            stage: 0,
            action: &action(t - 1),
            emd: emd(t),
        });
    }
    trajectory.emd[0] = emd(0);
    RunRecord { summary: summary(n), plan: plan(segments), trajectory }
}

/// The same run, given up before its first step.
pub fn without_steps(n: usize) -> RunRecord {
    let mut run = squashed_ball(n);
    let Trajectory { initial, target, subgoals, .. } = run.trajectory;
    run.trajectory = Trajectory::new(initial, target, subgoals);
    run.plan.stages[0].segments.clear();
    run
}

fn height(t: usize) -> f64 {
    1.0 - 0.72 * (t as f64 / STEPS as f64)
}

fn pose(t: usize) -> ToolPose {
    let swing = 0.1 * (t as f64 * 0.25).sin();
    let y = TABLE + 2.0 * RADIUS * height(t) + 0.03;
    let h = std::f64::consts::FRAC_1_SQRT_2;
    ToolPose { position: [0.5 + swing, y, 0.5], rotation: [h, h, 0.0, 0.0], gap: 0.0 }
}

fn action(t: usize) -> Vec<f64> {
    vec![(t as f64 * 0.25).cos(), 0.0, -0.4, 0.1 * (t as f64 * 0.1).sin()]
}

fn emd(t: usize) -> f64 {
    0.05 * (1.0 - t as f64 / (STEPS as f64 + 5.0))
}

fn summary(n: usize) -> Summary {
    Summary {
        task: "spread".into(),
        seed: 3,
        method: "make-a-donut".into(),
        score: 1.0 - emd(STEPS) / emd(0),
        threshold: 0.4,
        success: true,
        emd_initial: emd(0),
        emd_final: emd(STEPS),
        seconds: 12.5,
        particles: n,
        stages: vec![StageSummary {
            tool: "rolling pin".into(),
            steps: STEPS,
            resets: 1,
            score: 1.0 - emd(STEPS) / emd(0),
            emd_initial: emd(0),
            emd_final: emd(STEPS),
            rollouts: 42,
            gradient_iterations: 40,
            seconds: 12.0,
            stop: "reached".into(),
        }],
        score_ceiling: Some(0.98),
        shape: None,
        estimator: "made up".into(),
        version: "0.1.0".into(),
        model: None,
        answers: None,
    }
}

fn plan(segments: Vec<Segment>) -> PlanFile {
    PlanFile {
        version: "0.1.0".into(),
        command: "donut plan --task spread --seed 3".into(),
        task: "spread".into(),
        seed: 3,
        method: "make-a-donut".into(),
        task_file: "name = \"spread\"\n# </script><script>alert(1)</script>\n".into(),
        response: None,
        conversation: None,
        params: Params::default(),
        planner: settings(),
        search: None,
        tools: vec![rolling_pin()],
        stages: vec![StagePlan {
            title: "Flatten the ball into a disc <b>\"gently\"</b> & evenly".into(),
            tool: 0,
            code: "import numpy as np\n# </script><script>alert(2)</script>\nr = 1.0 if 1 < 2 else 0\n"
                .into(),
            segments,
        }],
    }
}

fn settings() -> PlannerSettings {
    PlannerSettings {
        emd_steps: 20,
        emd_step_length_m: 0.002,
        reach: Reach::Exact,
        horizon: 40,
        iterations: 20,
        max_steps: 200,
        learning_rate: 0.02,
        loss_weights: [1.0, 1.0, 0.02],
        start_score: StartScore::Nearness,
        start_turns: 1,
        pose_delta_m: 0.001,
        emd_tolerance_m: 0.002,
        reset_below_gain: 0.0,
        max_failures: 3,
    }
}
