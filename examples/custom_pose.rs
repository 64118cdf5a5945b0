//! Planning with a tool pose of one's own: `cargo run --release --example custom_pose`.
//!
//! A rolling pin shall flatten a ball of dough. Actions are optimised twice through the simulator, from the start pose
//! that the planner would choose, and from one that is given: the pin turned by 45 degrees. The exact EMD of settled dough
//! says what each is worth.

use anyhow::{Context, Result};
use donut::emd::exact::assign;
use donut::math::cloud::Point;
use donut::plan::losses::{Aim, Goal};
use donut::plan::optimize::optimize;
use donut::plan::placement::Placement;
use donut::plan::settings::PlannerSettings;
use donut::plan::settle::settle;
use donut::sim::{Options, ParticleState, Simulator, ToolPose};
use donut::task::load_scene;

const PARTICLES: usize = 1000;
/// Control steps for the dough to come to rest.
const SETTLE_STEPS: usize = 20;

fn main() -> Result<()> {
    let scene = load_scene("donut")?;
    let pin = scene.tool("rolling pin").context("the task has a rolling pin")?;
    let dough = ParticleState::at_rest(scene.dough.solid.fill(scene.dough.center, PARTICLES, 0));
    let (start, _) = settle::<f32>(&scene.params, &Options::default(), &dough, SETTLE_STEPS)?;

    // The goal: 70 % of the height, and wider by as much as keeps the volume. Particles keep their order, so that it is
    // the next reachable cloud as it stands.
    let goal: Vec<Point> = start.x.iter().map(|p| flattened(*p, 0.7)).collect();
    let active: Vec<usize> = (0..PARTICLES).collect();
    let settings =
        PlannerSettings { horizon: 30, iterations: 12, learning_rate: 0.05, ..scene.planner.clone() };

    let placement = Placement {
        tool: &pin.tool,
        rest: &pin.rest,
        positions: &start.x,
        active: &active,
        reachable: &goal,
        delta: settings.pose_delta_m,
        score: settings.start_score,
        turns: settings.start_turns,
    };
    let chosen = placement.best(&[]).context("the pin fits nowhere")?;
    // Over the middle, turned about the vertical, and lowered until it almost touches. (w, x, y, z): lying along z,
    // then by 45 degrees about y.
    let given = ToolPose {
        position: [0.5, 0.3, 0.5],
        rotation: [0.653_281_5, 0.653_281_5, 0.270_598_1, -0.270_598_1],
        gap: 0.0,
    };
    let given = placement.lowered(given).context("the pin does not fit there")?;

    println!("EMD before: {:.3} mm", 1e3 * assign(&start.x, &goal).mean_distance);
    for (whose, pose) in [("the planner's", chosen), ("a given", given)] {
        let mut sim = Simulator::<f32>::new(scene.params.clone(), vec![pin.tool.clone()], Options::default());
        let aim = Goal { aim: Aim::Points(&goal), active: &active, weights: settings.loss_weights };
        let horizon = optimize(&mut sim, &start, &pose, &aim, &settings, |_| {})?;
        let (settled, _) = settle::<f32>(&scene.params, &Options::default(), &horizon.end, SETTLE_STEPS)?;
        let [x, y, z] = pose.position;
        println!(
            "from {whose} start at ({x:.3}, {y:.3}, {z:.3}): loss {:.4} -> {:.4}, EMD after: {:.3} mm",
            horizon.losses[0],
            horizon.losses[horizon.losses.len() - 1],
            1e3 * assign(&settled.x, &goal).mean_distance
        );
    }
    Ok(())
}

/// Where a point goes when the dough on the table is pressed to a share of its height.
fn flattened(p: Point, share: f64) -> Point {
    const TABLE: f64 = 0.0385;
    let wider = share.powf(-0.5);
    [0.5 + wider * (p[0] - 0.5), TABLE + share * (p[1] - TABLE), 0.5 + wider * (p[2] - 0.5)]
}
