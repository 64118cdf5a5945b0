//! Optimising a horizon of actions through the simulator (lines 13 to 16 of Algorithm 1).
//!
//! A start state, a pose and a goal come in; the actions after J Adam steps and the trajectory they give go
//! out. Imports losses and sim.

use super::adam::Adam;
use super::losses::{Goal, evaluate};
use super::settings::PlannerSettings;
use crate::math::cloud::Point;
use crate::sim::lanes::Real;
use crate::sim::{ParticleState, SimError, Simulator, ToolPose};

/// Actions and what executing them does.
#[derive(Clone, Debug)]
pub struct Horizon {
    /// Control steps x action components.
    pub actions: Vec<Vec<f64>>,
    /// Positions after each control step, m.
    pub frames: Vec<Vec<Point>>,
    /// The tool's pose after each control step.
    pub poses: Vec<ToolPose>,
    /// State at the end.
    pub end: ParticleState,
    /// Loss before each gradient step.
    pub losses: Vec<f64>,
    /// The error that ended the optimisation early, if one did.
    pub fault: Option<SimError>,
}

/// J gradient steps from actions of zero, then the rollout of what came out. `on_iteration` hears of each
/// step.
///
/// An iteration whose rollout breaks down is rejected: the optimisation ends with the last actions that
/// worked.
///
/// # Errors
/// The simulator's error if not even standing still works.
pub fn optimize<T: Real>(
    sim: &mut Simulator<T>,
    start: &ParticleState,
    pose: &ToolPose,
    goal: &Goal<'_>,
    settings: &PlannerSettings,
    mut on_iteration: impl FnMut(usize),
) -> Result<Horizon, SimError> {
    let width = sim.tools()[0].action_len();
    let mut actions = vec![vec![0.0; width]; settings.horizon];
    let mut adam = Adam::new(&actions);
    let mut losses = Vec::new();
    let mut fault = None;
    let mut last_good = actions.clone();
    for iteration in 0..settings.iterations {
        let outcome = sim.rollout(start, &[*pose], &actions).and_then(|()| {
            let (loss, seeds) = evaluate(sim, goal);
            Ok((loss, sim.rollout_adj(&seeds)?.actions))
        });
        match outcome {
            Ok((loss, gradient)) => {
                losses.push(loss);
                last_good.clone_from(&actions);
                if gradient.iter().flatten().all(|g| g.is_finite()) {
                    adam.step(settings.learning_rate, &gradient, &mut actions);
                }
            }
            Err(error) if iteration == 0 => return Err(error),
            Err(error) => {
                fault = Some(error);
                actions.clone_from(&last_good);
                break;
            }
        }
        on_iteration(iteration + 1);
    }
    if let Err(error) = sim.rollout(start, &[*pose], &actions) {
        fault = Some(error);
        actions = last_good;
        sim.rollout(start, &[*pose], &actions)?;
    }
    let steps = sim.steps();
    Ok(Horizon {
        actions,
        frames: (1..=steps).map(|s| sim.positions(s)).collect(),
        poses: (1..=steps).map(|s| sim.poses(s)[0]).collect(),
        end: sim.state(steps),
        losses,
        fault,
    })
}
