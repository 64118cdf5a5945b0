//! The three losses of the paper and their derivatives at the ends of control steps.
//!
//! A finished rollout comes in; the weighted loss and the seeds of its backward pass go out: point to point
//! (eq. 2), distance of the tool to the dough, and speed at the end (section III-C, weights (1, 1, 0.02)).
//! Imports sim.

use crate::math::cloud::Point;
use crate::sim::lanes::Real;
use crate::sim::tool::PoseAdj;
use crate::sim::{Simulator, StepSeed};

/// Where particles should be at the end of the horizon.
#[derive(Clone, Copy, Debug)]
pub struct Goal<'a> {
    /// The next reachable place of every particle, m, in the particles' order.
    pub reachable: &'a [Point],
    /// The particles that the tool should come near.
    pub active: &'a [usize],
    /// Weights of the three losses.
    pub weights: [f64; 3],
}

/// The loss of the last rollout of `sim`, and its derivatives.
///
/// Point to point is a mean over particles, not the paper's sum, so that its weight against the other two
/// does not depend on how many particles the dough is made of.
pub fn evaluate<T: Real>(sim: &Simulator<T>, goal: &Goal<'_>) -> (f64, Vec<StepSeed>) {
    let steps = sim.steps();
    let mut seeds = vec![StepSeed::default(); steps + 1];
    let [point_weight, distance_weight, speed_weight] = goal.weights;
    let end = sim.state(steps);
    let mut loss = point_to_point(&end.x, goal.reachable, point_weight, &mut seeds[steps].positions);
    loss += speed(&end.v, speed_weight, &mut seeds[steps].velocities);
    if distance_weight > 0.0 {
        loss += tool_distance(sim, goal.active, distance_weight, &mut seeds);
    }
    (loss, seeds)
}

/// Mean over particles of the L1 distance to their reachable place (eq. 2). At zero distance on an axis the
/// derivative is 0.
fn point_to_point(x: &[Point], reachable: &[Point], weight: f64, seed: &mut Vec<Point>) -> f64 {
    let scale = weight / x.len() as f64;
    let mut sum = 0.0;
    *seed = x
        .iter()
        .zip(reachable)
        .map(|(x, r)| {
            std::array::from_fn(|a| {
                let d = x[a] - r[a];
                sum += d.abs();
                if d == 0.0 { 0.0 } else { scale * d.signum() }
            })
        })
        .collect();
    scale * sum
}

/// Squared mean velocity at the end.
fn speed(v: &[Point], weight: f64, seed: &mut Vec<Point>) -> f64 {
    let mean = crate::math::cloud::centroid(v);
    *seed = vec![mean.map(|m| weight * 2.0 * m / v.len() as f64); v.len()];
    weight * mean.iter().map(|m| m * m).sum::<f64>()
}

/// Mean over control steps of the distance between the tool and its nearest active particle, where positive.
fn tool_distance<T: Real>(sim: &Simulator<T>, active: &[usize], weight: f64, seeds: &mut [StepSeed]) -> f64 {
    let steps = sim.steps();
    let scale = weight / steps as f64;
    let mut loss = 0.0;
    for (step, seed) in seeds.iter_mut().enumerate().skip(1) {
        let x = sim.positions(step);
        let mut poses_adj = vec![PoseAdj::default(); sim.tools().len()];
        for ((tool, pose), pose_adj) in sim.tools().iter().zip(sim.poses(step)).zip(&mut poses_adj) {
            let nearest =
                active.iter().map(|&i| (i, tool.distance(pose, x[i]))).min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((i, d)) = nearest
                && d > 0.0
            {
                loss += scale * d;
                let by_particle = tool.distance_adj(pose, x[i], scale, pose_adj);
                seed.positions.resize(x.len(), [0.0; 3]);
                seed.positions[i].iter_mut().zip(by_particle).for_each(|(a, b)| *a += b);
            }
        }
        seed.poses = poses_adj;
    }
    loss
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::tool::{Motion, Shape, Tool, ToolPose};
    use crate::sim::{Options, Params, ParticleState};

    #[test]
    fn the_gradient_of_all_three_losses_agrees_with_finite_differences() {
        let params = Params { substeps: 5, ..Params::default() };
        let x: Vec<Point> = (0..64)
            .map(|i| {
                let at =
                    |k: usize| 0.48 + 0.01 * (i >> (2 * k) & 3) as f64 + 1e-4 * ((7 * i + k) % 11) as f64;
                [at(0), at(1) - 0.42, at(2)]
            })
            .collect();
        let reachable: Vec<Point> = x.iter().map(|p| [p[0] + 0.004, p[1] - 0.01, p[2] - 0.003]).collect();
        let tool = Tool {
            name: "pole".into(),
            shape: Shape::Capsule { radius: 0.03, length: 0.1 },
            motion: Motion::Translation,
            friction: 0.9,
            action_scale: vec![0.015; 3],
            lower_bound: [0.0; 3],
            upper_bound: [1.0; 3],
        };
        let pose = ToolPose { position: [0.51, 0.178, 0.5], rotation: [1.0, 0.0, 0.0, 0.0], gap: 0.0 };
        let active: Vec<usize> = (0..x.len()).collect();
        let goal = Goal { reachable: &reachable, active: &active, weights: [1.0, 1.0, 0.02] };
        let mut sim = Simulator::<f64>::new(params, vec![tool], Options::default());
        let start = ParticleState::at_rest(x);
        let actions = vec![vec![0.1, -0.2, 0.05]; 3];
        let mut loss = |actions: &[Vec<f64>]| {
            sim.rollout(&start, &[pose], actions).unwrap();
            let (value, seeds) = evaluate(&sim, &goal);
            (value, sim.rollout_adj(&seeds).unwrap().actions)
        };
        let (_, gradient) = loss(&actions);
        for step in 0..3 {
            for c in 0..3 {
                let h = 1e-6;
                let mut moved = actions.clone();
                moved[step][c] += h;
                let up = loss(&moved).0;
                moved[step][c] -= 2.0 * h;
                let fd = (up - loss(&moved).0) / (2.0 * h);
                let g = gradient[step][c];
                assert!((g - fd).abs() <= 1e-5 * fd.abs() + 1e-9, "[{step}][{c}]: {g:e} {fd:e}");
            }
        }
    }
}
