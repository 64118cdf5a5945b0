//! Same bits whatever the threads and the memory, on a rerun and in a fresh simulator.

use donut::sim::lanes::Real;
use donut::sim::{Options, ParticleState, SimdLevel, Simulator, StepSeed};
use donut::store::sim_scene::SimScene;

use super::scene;

/// End state, gradient by the actions, gradient by the start state.
fn bits<T: Real>(scene: &SimScene, options: Options, reruns: usize) -> Vec<u64> {
    let mut sim = Simulator::<T>::new(scene.params.clone(), scene.tools.clone(), options);
    let mut out = Vec::new();
    for _ in 0..=reruns {
        sim.rollout(&scene.start, &scene.poses, &scene.actions).unwrap();
        let steps = sim.steps();
        let mut seeds = vec![StepSeed::default(); steps + 1];
        seeds[steps].positions = vec![[1.0, -0.5, 0.25]; scene.start.len()];
        let gradient = sim.rollout_adj(&seeds).unwrap();
        let all = |s: &ParticleState| {
            [s.x.as_flattened(), s.v.as_flattened(), s.c.as_flattened(), s.f.as_flattened()].concat()
        };
        let numbers =
            [all(&sim.state(steps)), gradient.actions.concat(), all(&gradient.start_state)].concat();
        out = numbers.iter().map(|v| v.to_bits()).collect();
    }
    out
}

/// A scene large enough to be split into several parts.
fn large() -> SimScene {
    let mut scene = scene("s2-pin");
    let start = scene.start.clone();
    for k in 1..4 {
        let shift = f64::from(k) * 1.3e-3;
        scene.start.x.extend(start.x.iter().map(|p| [p[0] + shift, p[1], p[2] - shift]));
        scene.start.v.extend(&start.v);
        scene.start.c.extend(&start.c);
        scene.start.f.extend(&start.f);
    }
    scene.actions.truncate(4);
    scene
}

fn check<T: Real>() {
    let scene = large();
    let options = |threads, memory_limit| Options { threads, memory_limit, ..Options::default() };
    let reference = bits::<T>(&scene, options(1, 1 << 30), 0);
    for (threads, memory) in [(1, 1 << 30), (2, 1 << 30), (4, 1 << 30), (2, 0), (1, 30 << 20)] {
        assert!(
            bits::<T>(&scene, options(threads, memory), 1) == reference,
            "{threads} threads, {memory} bytes"
        );
    }
}

#[test]
fn threads_memory_and_reruns_do_not_change_a_bit_in_f32() {
    check::<f32>();
}

#[test]
fn threads_memory_and_reruns_do_not_change_a_bit_in_f64() {
    check::<f64>();
}

#[test]
fn a_long_horizon_has_the_same_bits_with_little_memory() {
    let mut scene = scene("s2-pin");
    scene.params.substeps = 4;
    for state in [&mut scene.start.x, &mut scene.start.v] {
        state.truncate(60);
    }
    scene.start.c.truncate(60);
    scene.start.f.truncate(60);
    let few = scene.actions.clone();
    scene.actions = (0..400).map(|step| few[step % few.len()].iter().map(|a| 0.2 * a).collect()).collect();
    let with = |memory_limit| bits::<f32>(&scene, Options { memory_limit, ..Options::default() }, 0);
    let reference = with(usize::MAX);
    // Room for the substeps of a few of the 400 control steps only, and for none.
    assert!(with(1 << 20) == reference);
    assert!(with(0) == reference);
}

#[test]
fn double_precision_has_the_same_bits_with_all_instructions() {
    let scene = scene("s4-gripper");
    let with = |simd| bits::<f64>(&scene, Options { simd, ..Options::default() }, 0);
    let reference = with(SimdLevel::Scalar);
    for level in SimdLevel::available() {
        assert!(with(level) == reference, "{level:?}");
    }
}

#[test]
fn single_precision_has_the_same_bits_with_all_fused_instructions() {
    let scene = scene("s4-gripper");
    let with = |simd| bits::<f32>(&scene, Options { simd, ..Options::default() }, 0);
    let fused: Vec<_> = SimdLevel::available().filter(|level| *level != SimdLevel::Scalar).collect();
    for pair in fused.windows(2) {
        assert!(with(pair[0]) == with(pair[1]), "{pair:?}");
    }
}
