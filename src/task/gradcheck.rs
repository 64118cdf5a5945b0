//! Rollouts for checking gradients with the tools of a task: each tool pressed into a small piece of its dough.
//!
//! A scene comes in; one [`Case`] a tool goes out, the tool placed as the planner would place it, with
//! actions that press and wobble but never touch their limits of 1. Imports plan's settling and placement,
//! and sim's gradient check.

use std::f64::consts::TAU;

use super::scene::Scene;
use super::tools::ToolSetup;
use crate::math::cloud::{Point, centroid};
use crate::math::rng::{Pcg64, seeded, uniform};
use crate::plan::placement::Placement;
use crate::plan::settings::StartScore;
use crate::plan::settle::settle;
use crate::sim::gradcheck::{Case, HORIZON};
use crate::sim::{Motion, Options, ParticleState, SimError};

/// Particles of the dough unless one says otherwise: few, so that hundreds of rollouts take seconds.
pub const PARTICLES: u32 = 600;
/// Control steps of a rollout that is checked by finite differences: rounding, which contact amplifies from
/// step to step, must not drown them.
pub const STEPS: usize = 10;
/// Free control steps before the tool comes.
const SETTLE_STEPS: usize = 40;
/// The action that presses is `MEAN + SWING cos(2 pi step / PERIOD)`, and all wobble by up to `WOBBLE`.
const MEAN: f64 = 0.2;
const SWING: f64 = 0.5;
const PERIOD: f64 = 20.0;
const WOBBLE: f64 = 0.2;

/// A case that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The dough broke down before a tool came.
    #[error("the dough does not come to rest: {0}")]
    Settling(#[from] SimError),
    /// No pose next to the dough suits the tool.
    #[error(
        "the tool `{0}` fits nowhere next to the dough; widen its bounds, or its gap if it is a gripper, \
         in the task file"
    )]
    NoRoom(String),
}

/// A case of [`HORIZON`] control steps with dough of `particles` particles for each tool that `wanted`
/// accepts, with the tool's name.
///
/// # Errors
/// [`CaseError`], if the dough or a tool does not allow it.
pub fn cases(
    scene: &Scene,
    particles: usize,
    seed: u64,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<(String, Case)>, CaseError> {
    let dough = scene.dough.solid.fill(scene.dough.center, particles, seed);
    let start = ParticleState::at_rest(dough);
    let (settled, _) = settle::<f64>(&scene.params, &Options::default(), &start, SETTLE_STEPS)?;
    let tools = scene.tools.iter().filter(|t| wanted(&t.tool.name));
    tools.map(|setup| Ok((setup.tool.name.clone(), case(scene, setup, &settled, seed)?))).collect()
}

fn case(scene: &Scene, setup: &ToolSetup, settled: &ParticleState, seed: u64) -> Result<Case, CaseError> {
    let target = pressed(&settled.x);
    let all: Vec<usize> = (0..settled.len()).collect();
    let placement = Placement {
        tool: &setup.tool,
        rest: &setup.rest,
        positions: &settled.x,
        active: &all,
        reachable: &target,
        delta: scene.planner.pose_delta_m,
        score: StartScore::Nearness,
        turns: 1,
    };
    let pose = placement.best(&[]).ok_or_else(|| CaseError::NoRoom(setup.tool.name.clone()))?;
    let mut rng = seeded(seed, &setup.tool.name);
    Ok(Case {
        params: scene.params.clone(),
        tools: vec![setup.tool.clone()],
        poses: vec![pose],
        start: settled.clone(),
        actions: (0..HORIZON).map(|step| action(&setup.tool.motion, step, &mut rng)).collect(),
        target,
    })
}

/// The dough at half its height and as much wider, so that every particle has somewhere to go.
fn pressed(x: &[Point]) -> Vec<Point> {
    let center = centroid(x);
    let floor = x.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let wider = |p: &Point, a: usize| center[a] + (p[a] - center[a]) * 2f64.sqrt();
    x.iter().map(|p| [wider(p, 0), floor + 0.5 * (p[1] - floor), wider(p, 2)]).collect()
}

/// A wobbling action that presses: down, or a gripper's plates together.
fn action(motion: &Motion, step: usize, rng: &mut Pcg64) -> Vec<f64> {
    let (presses, sign) = match motion {
        Motion::RollingPin => (2, -1.0),
        Motion::Translation | Motion::Rigid => (1, -1.0),
        Motion::Gripper { .. } => (6, 1.0),
    };
    let mut action: Vec<f64> =
        (0..motion.action_len()).map(|_| WOBBLE * (2.0 * uniform(rng) - 1.0)).collect();
    action[presses] += sign * (MEAN + SWING * (TAU * step as f64 / PERIOD).cos());
    action
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::load_scene;

    #[test]
    fn every_tool_of_the_donut_task_presses_its_dough_within_the_limits_of_actions() {
        let scene = load_scene("donut").unwrap();
        let cases = cases(&scene, 400, 0, |_| true).unwrap();
        assert_eq!(cases.len(), scene.tools.len());
        for (name, case) in cases {
            assert!(case.actions.iter().flatten().all(|a| a.abs() < 0.95), "{name}");
            let gradient = case.over(STEPS).gradient::<f64>().unwrap();
            assert!(gradient.iter().flatten().any(|g| g.abs() > 1e-3), "{name} does not touch the dough");
        }
    }
}
