//! A second made-up run, of two stages: a knife cuts a bar in two, a gripper carries one half away.
//! Comes in: a particle count. Imports donut's store and plan types and the first made-up run.

use donut::math::cloud::Point;
use donut::math::rng::{seeded, uniform};
use donut::sim::tool::{Motion, Shape, Tool, ToolPose};
use donut::store::record::{RunRecord, Segment, StagePlan, StageSummary};
use donut::store::trajectory::{Reachable, Step, Trajectory};

const TABLE: f64 = 0.047;
const CUT: usize = 20;
const CARRIED: usize = 40;

fn bar(n: usize) -> Vec<Point> {
    let mut rng = seeded(8, "synthetic bar");
    let mut within = |low: f64, size: f64| low + size * uniform(&mut rng);
    (0..n).map(|_| [within(0.4, 0.2), within(TABLE, 0.08), within(0.46, 0.08)]).collect()
}

/// Halves moved apart along x by `gap`, the right one along z by `away`.
fn halves(bar: &[Point], gap: f64, away: f64) -> Vec<Point> {
    bar.iter()
        .map(
            |p| {
                if p[0] < 0.5 {
                    [p[0] - gap / 2.0, p[1], p[2]]
                } else {
                    [p[0] + gap / 2.0, p[1], p[2] + away]
                }
            },
        )
        .collect()
}

fn tool(name: &str, shape: Shape, motion: Motion, components: usize) -> Tool {
    Tool {
        name: name.into(),
        shape,
        motion,
        friction: 0.0,
        action_scale: vec![0.015; components],
        lower_bound: [0.0; 3],
        upper_bound: [1.0; 3],
    }
}

fn knife() -> Tool {
    let shape = Shape::Knife {
        half_extents: [0.025, 0.2, 0.06],
        prism_size: [0.15, 0.15],
        prism_rotation: [1.0, 0.0, 0.0, 0.58],
    };
    tool("knife", shape, Motion::Translation, 3)
}

fn gripper() -> Tool {
    let motion = Motion::Gripper { minimal_gap: 0.08, maximal_gap: 0.2 };
    tool("gripper", Shape::Box { half_extents: [0.015, 0.1, 0.06] }, motion, 7)
}

/// What frame `t` looks like: the dough, the tool and its pose, the stage, and the action to it.
fn state(bar: &[Point], t: usize) -> (Vec<Point>, usize, ToolPose, Vec<f64>) {
    if t <= CUT {
        let done = t as f64 / CUT as f64;
        let pose = ToolPose {
            position: [0.5, TABLE + 0.1 + 0.15 * (1.0 - done), 0.5],
            rotation: [1.0, 0.0, 0.0, 0.0],
            gap: 0.0,
        };
        (halves(bar, 0.05 * done, 0.0), 0, pose, vec![0.0, -0.5, 0.0])
    } else {
        let away = 0.12 * (t - CUT) as f64 / (CARRIED - CUT) as f64;
        let h = std::f64::consts::FRAC_1_SQRT_2;
        let pose =
            ToolPose { position: [0.575, TABLE + 0.1, 0.5 + away], rotation: [h, 0.0, h, 0.0], gap: 0.11 };
        (halves(bar, 0.05, away), 1, pose, vec![0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 0.1])
    }
}

/// The run, with `n` particles.
pub fn cut_bar(n: usize) -> RunRecord {
    let initial = bar(n);
    let subgoals = vec![halves(&initial, 0.05, 0.0), halves(&initial, 0.05, 0.13)];
    let mut trajectory = Trajectory::new(initial.clone(), subgoals[1].clone(), subgoals);
    trajectory.piece = initial.iter().map(|p| i32::from(p[0] >= 0.5)).collect();
    for t in 1..=CARRIED {
        let (positions, tool, tool_pose, action) = state(&initial, t);
        let emd = 0.03 * (1.0 - (t - 1) as f64 % CUT as f64 / CUT as f64);
        trajectory.push(Step { positions: &positions, tool, tool_pose, stage: tool, action: &action, emd });
    }
    for (frame, k) in [(0, 0), (CUT, 1)] {
        let cloud = trajectory.subgoals[k].iter().map(|p| p.map(|v| v as f32)).collect();
        trajectory.reachable.push(Reachable { frame, cloud });
    }
    let stage = |title: &str, tool: usize, from: usize, to: usize| StagePlan {
        title: title.into(),
        tool,
        code: format!("# stage {tool}\n"),
        segments: [false, true]
            .map(|accepted| Segment {
                placed: true,
                start_pose: state(&initial, from + 1).2,
                first_frame: from,
                accepted,
                actions: (from + 1..=to).map(|t| state(&initial, t).3).collect(),
                emd_before: 0.03,
                emd_after: 0.002,
                losses: (0..20).map(|i| 0.03 / (1.0 + f64::from(i))).collect(),
            })
            .to_vec(),
    };
    let mut run = super::squashed_ball(10);
    run.summary.task = "cut-and-carry".into();
    run.summary.success = false;
    run.summary.particles = n;
    run.summary.stages = ["knife", "gripper"]
        .map(|tool| StageSummary {
            tool: tool.into(),
            steps: CUT,
            stop: "budget".into(),
            ..Default::default()
        })
        .to_vec();
    run.plan.tools = vec![knife(), gripper()];
    run.plan.stages =
        vec![stage("Cut the bar in two", 0, 0, CUT), stage("Carry one half away", 1, CUT, CARRIED)];
    RunRecord { trajectory, ..run }
}
