//! Whole trajectories of the reference scenes.

use donut::sim::lanes::Real;
use donut::sim::{Options, Simulator};
use donut::store::sim_scene::SimScene;
use ndarray::{Ix2, Ix3};

use super::{SCENES, expected, scene, worst};

fn run<T: Real>(scene: &SimScene, options: Options) -> Simulator<T> {
    let mut sim = Simulator::<T>::new(scene.params.clone(), scene.tools.clone(), options);
    sim.rollout(&scene.start, &scene.poses, &scene.actions).unwrap();
    sim
}

#[test]
fn positions_poses_and_velocities_agree() {
    for name in SCENES {
        let scene = scene(name);
        let sim = run::<f64>(&scene, Options::default());
        let mut expected = expected(name);
        let positions = expected.array::<Ix3>("positions").unwrap();
        let poses = expected.array::<Ix3>("tool_poses").unwrap();
        let steps = sim.steps();
        assert_eq!(positions.shape()[0], steps + 1, "{name}");
        for step in 0..=steps {
            let x = sim.positions(step);
            let off = worst(x.as_flattened(), positions.index_axis(ndarray::Axis(0), step));
            // The bound asked for is 1e-6; rounding noise stays far below it.
            assert!(off < 1e-9, "{name}: positions after step {step} are {off:e} off");
            let flat: Vec<f64> = sim
                .poses(step)
                .iter()
                .flat_map(|p| [&p.position[..], &p.rotation, &[p.gap]].concat())
                .collect();
            let off = worst(&flat, poses.index_axis(ndarray::Axis(0), step));
            assert!(off < 1e-12, "{name}: poses after step {step} are {off:e} off");
        }
        let end = sim.state(steps);
        let off = worst(end.v.as_flattened(), &expected.array::<Ix2>("velocities").unwrap());
        assert!(off < 1e-7, "{name}: velocities are {off:e} off");
        let off = worst(end.f.as_flattened(), &expected.array::<Ix3>("F").unwrap());
        assert!(off < 1e-8, "{name}: deformation gradients are {off:e} off");
        let off = worst(end.c.as_flattened(), &expected.array::<Ix3>("C").unwrap());
        assert!(off < 1e-5, "{name}: affine matrices are {off:e} off");
    }
}

#[test]
fn single_precision_stays_within_a_thousandth_of_double() {
    for name in SCENES {
        let scene = scene(name);
        let (single, double) =
            (run::<f32>(&scene, Options::default()), run::<f64>(&scene, Options::default()));
        let steps = double.steps().min(10);
        for step in 0..=steps {
            let (a, b) = (single.positions(step), double.positions(step));
            let off = worst(a.as_flattened(), b.as_flattened());
            assert!(off < 1e-3, "{name}: step {step} is {off:e} off");
        }
    }
}
