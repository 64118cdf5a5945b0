//! A rollout and its gradient: `cargo run --release --example gradient`.
//!
//! A rolling pin presses a ball of dough for ten control steps. The loss is the mean distance of the particles to a
//! flatter ball; the backward pass says how every action changes it, and a step against the gradient lowers it.

use anyhow::Result;
use donut::math::cloud::{Point, distance};
use donut::sim::{Options, ParticleState, Simulator, StepSeed, ToolPose};
use donut::task::load_scene;

const PARTICLES: usize = 1000;
const STEPS: usize = 10;

fn main() -> Result<()> {
    // Material, grid and tools of a task; everything here can be built by hand as well.
    let scene = load_scene("donut")?;
    let pin = scene.tool("rolling pin").expect("the task has a rolling pin").tool.clone();
    let dough = scene.dough.solid.fill(scene.dough.center, PARTICLES, 0);
    let target: Vec<Point> = dough.iter().map(|p| [p[0], 0.0385 + 0.6 * (p[1] - 0.0385), p[2]]).collect();

    // The pin lies along z, right above the ball; an action is (roll, yaw, rise, slide), each in [-1, 1].
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let pose = ToolPose { position: [0.5, 0.21, 0.5], rotation: [half, half, 0.0, 0.0], gap: 0.0 };
    let mut actions = vec![vec![0.0, 0.0, -0.5, 0.0]; STEPS];

    let mut sim = Simulator::<f32>::new(scene.params.clone(), vec![pin], Options::default());
    let start = ParticleState::at_rest(dough);
    for iteration in 0..5 {
        sim.rollout(&start, &[pose], &actions)?;
        let (loss, gradient) = loss(&sim.positions(STEPS), &target);

        // The loss's derivatives at the ends of control steps; those that are left empty are zero.
        let mut seeds = vec![StepSeed::default(); STEPS + 1];
        seeds[STEPS].positions = gradient;
        let gradient = sim.rollout_adj(&seeds)?.actions;

        let norm = gradient.iter().flatten().map(|g| g * g).sum::<f64>().sqrt();
        let rise: Vec<String> = gradient.iter().map(|g| format!("{:+.1e}", g[2])).collect();
        println!("{iteration}: loss {:.3} mm, |gradient| {:.2e} m", 1e3 * loss, norm);
        println!("   d loss / d rise, step by step, m: {}", rise.join(" "));
        for (action, g) in actions.iter_mut().zip(&gradient) {
            for (a, g) in action.iter_mut().zip(g) {
                *a = (*a - 0.5 * g / norm).clamp(-1.0, 1.0);
            }
        }
    }
    Ok(())
}

/// Mean distance to the target, m, and its gradient by the positions.
fn loss(x: &[Point], target: &[Point]) -> (f64, Vec<Point>) {
    let share = 1.0 / x.len() as f64;
    let mut sum = 0.0;
    let gradient = x.iter().zip(target).map(|(x, t)| {
        let d = distance(*x, *t);
        sum += share * d;
        std::array::from_fn(|a| if d > 0.0 { share * (x[a] - t[a]) / d } else { 0.0 })
    });
    let gradient = gradient.collect();
    (sum, gradient)
}
