//! Optimising a horizon of actions through the simulator (lines 13 to 16 of Algorithm 1).
//!
//! A start state, a pose and a goal come in; the actions after J Adam steps and the trajectory they give go
//! out. Imports losses and sim.

use super::losses::{Goal, evaluate};
use super::settings::PlannerSettings;
use crate::math::cloud::Point;
use crate::sim::lanes::Real;
use crate::sim::{ParticleState, SimError, Simulator, ToolPose};

/// Adam's decay rates and floor (Kingma and Ba 2015).
const BETA1: f64 = 0.9;
const BETA2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

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

/// First and second moments of the gradient.
struct Adam {
    m: Vec<Vec<f64>>,
    v: Vec<Vec<f64>>,
    t: i32,
}

impl Adam {
    fn new(actions: &[Vec<f64>]) -> Self {
        let zero: Vec<Vec<f64>> = actions.iter().map(|row| vec![0.0; row.len()]).collect();
        Self { m: zero.clone(), v: zero, t: 0 }
    }

    /// One step on `actions`, which stay within [-1, 1].
    fn step(&mut self, rate: f64, gradient: &[Vec<f64>], actions: &mut [Vec<f64>]) {
        self.t += 1;
        let (c1, c2) = (1.0 - BETA1.powi(self.t), 1.0 - BETA2.powi(self.t));
        for (row, action) in actions.iter_mut().enumerate() {
            for (k, a) in action.iter_mut().enumerate() {
                let g = gradient[row][k];
                let (m, v) = (&mut self.m[row][k], &mut self.v[row][k]);
                *m = BETA1 * *m + (1.0 - BETA1) * g;
                *v = BETA2 * *v + (1.0 - BETA2) * g * g;
                *a = (*a - rate * (*m / c1) / ((*v / c2).sqrt() + EPSILON)).clamp(-1.0, 1.0);
            }
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adam_walks_down_a_bowl_and_stays_in_its_bounds() {
        let mut actions = vec![vec![0.0, 0.0]];
        let mut adam = Adam::new(&actions);
        for _ in 0..400 {
            let gradient = vec![vec![2.0 * (actions[0][0] - 0.3), 2.0 * (actions[0][1] - 5.0)]];
            adam.step(0.02, &gradient, &mut actions);
        }
        assert!((actions[0][0] - 0.3).abs() < 1e-2 && actions[0][1] == 1.0, "{actions:?}");
    }
}
