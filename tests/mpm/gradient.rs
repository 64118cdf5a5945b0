//! Gradients of whole rollouts against central finite differences of the forward pass, and f32 against f64.

use donut::math::rng::{sample_indices, seeded};
use donut::sim::lanes::Real;
use donut::sim::{Options, Simulator, StepSeed};
use donut::store::sim_scene::SimScene;
use ndarray::Ix2;

use crate::{TOOL_SCENES, expected, scene};

/// Entries of the actions that are tried in each scene; `donut gradcheck` tries as many as one likes.
const ENTRIES: usize = 14;

/// L1 loss of the end positions, and its gradient by the actions.
fn loss<T: Real>(sim: &mut Simulator<T>, scene: &SimScene, actions: &[Vec<f64>]) -> f64 {
    sim.rollout(&scene.start, &scene.poses, actions).unwrap();
    let target = scene.target.as_ref().unwrap();
    let x = sim.positions(sim.steps());
    x.as_flattened().iter().zip(target.as_flattened()).map(|(x, t)| (x - t).abs()).sum()
}

fn gradient<T: Real>(scene: &SimScene) -> (Simulator<T>, Vec<Vec<f64>>) {
    let mut sim = Simulator::<T>::new(scene.params.clone(), scene.tools.clone(), Options::default());
    loss(&mut sim, scene, &scene.actions);
    let steps = sim.steps();
    let target = scene.target.as_ref().unwrap();
    let mut seeds = vec![StepSeed::default(); steps + 1];
    seeds[steps].positions = sim
        .positions(steps)
        .iter()
        .zip(target)
        .map(|(x, t)| std::array::from_fn(|a| (x[a] - t[a]).signum()))
        .collect();
    let gradient = sim.rollout_adj(&seeds).unwrap().actions;
    (sim, gradient)
}

#[test]
fn actions_agree_with_finite_differences_of_the_forward_pass() {
    for name in TOOL_SCENES {
        let scene = scene(name);
        let (mut sim, gradient) = gradient::<f64>(&scene);
        let width = scene.actions[0].len();
        let count = scene.actions.len() * width;
        let mut errors = Vec::new();
        for entry in sample_indices(&mut seeded(1, name), count, ENTRIES) {
            let (step, c) = (entry / width, entry % width);
            let mut fd = |h: f64| {
                let mut actions = scene.actions.clone();
                actions[step][c] += h;
                let up = loss(&mut sim, &scene, &actions);
                actions[step][c] -= 2.0 * h;
                (up - loss(&mut sim, &scene, &actions)) / (2.0 * h)
            };
            let (coarse, fine) = (fd(1e-6), fd(3e-7));
            let scale = fine.abs().max(1e-6);
            // A node that crosses the contact threshold within the step makes the quotient meaningless.
            if (coarse - fine).abs() > 1e-4 * scale {
                continue;
            }
            errors.push((gradient[step][c] - coarse).abs() / scale);
        }
        errors.sort_by(f64::total_cmp);
        assert!(errors.len() * 2 >= ENTRIES.min(count), "{name}: only {} converged", errors.len());
        let (median, worst) = (errors[errors.len() / 2], errors[errors.len() - 1]);
        assert!(median < 2e-6 && worst < 1e-3, "{name}: median {median:e}, worst {worst:e}");
    }
}

#[test]
fn actions_agree_with_the_reference_implementation() {
    // Its own adjoint clamps the SVD, so it is right only where deformation is generic: hence the bound.
    for name in TOOL_SCENES {
        let (_, gradient) = gradient::<f64>(&scene(name));
        let reference = expected(name).array::<Ix2>("grad_actions_reference").unwrap();
        let scale = reference.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let off = crate::worst(gradient.iter().flatten(), &reference) / scale;
        assert!(off < 1e-5, "{name}: {off:e} off");
    }
}

#[test]
fn single_precision_gradients_follow_double() {
    for name in TOOL_SCENES {
        let scene = scene(name);
        let (_, single) = gradient::<f32>(&scene);
        let (_, double) = gradient::<f64>(&scene);
        let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
        let size = norm(&mut double.iter().flatten().copied());
        let pairs = single.iter().flatten().zip(double.iter().flatten());
        let off = norm(&mut pairs.map(|(a, b)| a - b)) / size;
        assert!(off < 2e-3, "{name}: {off:e} off");
    }
}
