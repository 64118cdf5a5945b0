//! The three losses of the paper and their derivatives at the ends of control steps.
//!
//! A finished rollout comes in; the weighted loss and the seeds of its backward pass go out: point to point
//! (eq. 2), distance of the tool to the dough, and speed at the end (section III-C, weights (1, 1, 0.02)).
//! Without point-to-point correspondence the EMD itself stands in for the first. Imports sim and emd.

use super::settings::Reach;
use crate::emd::Measure;
use crate::emd::exact::assign;
use crate::emd::schedule::Settings as SinkhornSettings;
use crate::emd::sinkhorn::divergence;
use crate::math::cloud::{Point, distance};
use crate::sim::lanes::Real;
use crate::sim::tool::PoseAdj;
use crate::sim::{Simulator, StepSeed};

/// Where particles should be at the end of the horizon.
#[derive(Clone, Copy, Debug)]
pub struct Goal<'a> {
    pub aim: Aim<'a>,
    /// The particles that the tool should come near.
    pub active: &'a [usize],
    /// Weights of the three losses.
    pub weights: [f64; 3],
}

/// What the first loss measures.
#[derive(Clone, Copy, Debug)]
pub enum Aim<'a> {
    /// The way of every particle to its next reachable place, m, in the particles' order.
    Points(&'a [Point]),
    /// The EMD between the active particles and the `target`, m; the others' way to where they were at the `start`.
    Emd { start: &'a [Point], target: &'a [Point], estimator: Reach },
}

/// The loss of the last rollout of `sim`, and its derivatives.
///
/// Point to point is a mean over particles, not the paper's sum, so that its weight against the other two
/// does not depend on how many particles the dough is made of. The EMD is one by nature.
pub fn evaluate<T: Real>(sim: &Simulator<T>, goal: &Goal<'_>) -> (f64, Vec<StepSeed>) {
    let steps = sim.steps();
    let mut seeds = vec![StepSeed::default(); steps + 1];
    let [point_weight, distance_weight, speed_weight] = goal.weights;
    let end = sim.state(steps);
    let positions = &mut seeds[steps].positions;
    let mut loss = match goal.aim {
        Aim::Points(reachable) => point_to_point(&end.x, reachable, point_weight, positions),
        Aim::Emd { start, target, estimator } => {
            emd(&end.x, start, goal.active, target, estimator, point_weight, positions)
        }
    };
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

/// The EMD of the active particles to the target, weighted with their share of all particles; the others are pulled
/// to where they were. The gradient is that of the optimal plan, held fixed (the envelope theorem): exact where the
/// optimal matching is unique.
fn emd(
    x: &[Point],
    start: &[Point],
    active: &[usize],
    target: &[Point],
    estimator: Reach,
    weight: f64,
    seed: &mut Vec<Point>,
) -> f64 {
    let mut places = start.to_vec();
    for &i in active {
        places[i] = x[i];
    }
    let mut loss = point_to_point(x, &places, weight, seed);
    let points: Vec<Point> = active.iter().map(|&i| x[i]).collect();
    let (value, gradient) = emd_and_gradient(&points, target, estimator);
    let scale = weight * active.len() as f64 / x.len() as f64;
    loss += scale * value;
    for (&i, g) in active.iter().zip(&gradient) {
        seed[i] = g.map(|g| scale * g);
    }
    loss
}

/// Distance of two clouds of equal size, m, and its derivative by the points of the first.
fn emd_and_gradient(points: &[Point], target: &[Point], estimator: Reach) -> (f64, Vec<Point>) {
    match estimator {
        Reach::Exact => {
            let matching = assign(points, target);
            let pull = |(p, &j): (&Point, &usize)| {
                let length = points.len() as f64 * distance(*p, target[j]);
                let along = |a: usize| if length > 0.0 { (p[a] - target[j][a]) / length } else { 0.0 };
                std::array::from_fn(along)
            };
            (matching.mean_distance, points.iter().zip(&matching.target_of).map(pull).collect())
        }
        Reach::Sinkhorn => {
            let (source, target) = (Measure::uniform(points), Measure::uniform(target));
            let found = divergence::<f32>(source, target, &SinkhornSettings::default());
            let found = found.expect("a rollout that went through has finite positions");
            (found.value, found.gradient)
        }
    }
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
            let here = tool.at(pose);
            let nearest = active.iter().map(|&i| (i, here.distance(x[i]))).min_by(|a, b| a.1.total_cmp(&b.1));
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
        let target: Vec<Point> = reachable.iter().rev().map(|p| [p[0], p[1] - 0.003, 1.02 * p[2]]).collect();
        let aims = [
            (Aim::Points(&reachable), 1e-5),
            (Aim::Emd { start: &x, target: &target, estimator: Reach::Exact }, 1e-5),
        ];
        for (aim, tolerance) in aims {
            let goal = Goal { aim, active: &active, weights: [1.0, 1.0, 0.02] };
            check(&params, &tool, &pose, &x, &goal, tolerance);
        }
    }

    #[test]
    fn the_divergence_s_gradient_agrees_with_finite_differences() {
        use crate::math::rng::{seeded, uniform};
        let mut rng = seeded(3, "losses");
        let mut cloud = |at: f64| -> Vec<Point> {
            (0..60).map(|_| std::array::from_fn(|_| at + 0.1 * uniform(&mut rng))).collect()
        };
        let (x, target, way) = (cloud(0.4), cloud(0.45), cloud(0.0));
        let active: Vec<usize> = (0..60).collect();
        let value = |h: f64, seed: &mut Vec<Point>| {
            let moved: Vec<Point> =
                x.iter().zip(&way).map(|(p, w)| std::array::from_fn(|a| p[a] + h * w[a])).collect();
            emd(&moved, &x, &active, &target, Reach::Sinkhorn, 2.0, seed)
        };
        let mut seed = vec![[0.0; 3]; 60];
        value(0.0, &mut seed);
        let along: f64 = seed.as_flattened().iter().zip(way.as_flattened()).map(|(g, w)| g * w).sum();
        let h = 1e-3;
        let fd = (value(h, &mut vec![[0.0; 3]; 60]) - value(-h, &mut vec![[0.0; 3]; 60])) / (2.0 * h);
        // GeomLoss's gradient takes the potentials for converged, which its schedule does not make them: 5 % here.
        assert!((along - fd).abs() <= 0.1 * fd.abs(), "{along:e} {fd:e}");
    }

    fn check(params: &Params, tool: &Tool, pose: &ToolPose, x: &[Point], goal: &Goal<'_>, tolerance: f64) {
        let mut sim = Simulator::<f64>::new(params.clone(), vec![tool.clone()], Options::default());
        let start = ParticleState::at_rest(x.to_vec());
        let actions = vec![vec![0.1, -0.2, 0.05]; 3];
        let mut loss = |actions: &[Vec<f64>]| {
            sim.rollout(&start, &[*pose], actions).unwrap();
            let (value, seeds) = evaluate(&sim, goal);
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
                let close = (g - fd).abs() <= tolerance * fd.abs() + 1e-9;
                assert!(close, "{:?}: [{step}][{c}]: {g:e} {fd:e}", goal.aim);
            }
        }
    }
}
