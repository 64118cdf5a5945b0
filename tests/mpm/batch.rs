//! Rollouts side by side are the rollouts one by one, bit for bit.

use donut::sim::{Batch, Motion, Options, Params, ParticleState, Shape, Simulator, StepSeed, Tool, ToolPose};

fn world() -> (Params, Tool, ParticleState) {
    let tool = Tool {
        name: "pole".into(),
        shape: Shape::Capsule { radius: 0.03, length: 0.1 },
        motion: Motion::Translation,
        friction: 0.9,
        action_scale: vec![0.01; 3],
        lower_bound: [0.0; 3],
        upper_bound: [1.0; 3],
    };
    let x = (0..216).map(|i| [i % 6, i / 6 % 6, i / 36].map(|k| 0.008 * f64::from(k)));
    let x = x.map(|p| [0.48 + p[0], 0.05 + p[1], 0.48 + p[2]]).collect();
    (Params::default(), tool, ParticleState::at_rest(x))
}

/// End positions and gradient of a few control steps that begin at `x`.
fn job(
    sim: &mut Simulator<f32>,
    tool: &Tool,
    start: &ParticleState,
    x: f64,
) -> (Vec<[f64; 3]>, Vec<Vec<f64>>) {
    sim.set_tools(vec![tool.clone()]);
    let pose = ToolPose { position: [x, 0.175, 0.5], rotation: [1.0, 0.0, 0.0, 0.0], gap: 0.0 };
    let steps = 2 + (1000.0 * x) as usize % 3;
    sim.rollout(start, &[pose], &vec![vec![0.1, -0.6, 0.2]; steps]).unwrap();
    let end = sim.positions(steps);
    let mut seeds = vec![StepSeed::default(); steps + 1];
    seeds[steps].positions = vec![[1.0, 0.5, -0.3]; end.len()];
    (end, sim.rollout_adj(&seeds).unwrap().actions)
}

#[test]
fn a_batch_gives_the_bits_of_one_by_one_whatever_the_number_of_threads() {
    let (params, tool, start) = world();
    let places: Vec<f64> = (0..7).map(|k| 0.48 + 0.007 * f64::from(k)).collect();
    let one_by_one: Vec<_> = places
        .iter()
        .map(|&x| job(&mut Simulator::new(params.clone(), Vec::new(), Options::default()), &tool, &start, x))
        .collect();
    assert!(one_by_one.windows(2).all(|w| w[0].0 != w[1].0), "the jobs differ");
    for threads in [1, 2, 3] {
        let options = Options { threads, ..Options::default() };
        let mut batch = Batch::new(&params, &[], &options);
        for _ in 0..2 {
            // Neither first nor last begins first.
            let length = |&x: &f64| (1e3 * (x - 0.5).abs()) as usize;
            let together = batch.run(&places, length, |sim, &x| job(sim, &tool, &start, x));
            assert_eq!(together, one_by_one, "{threads} threads");
        }
    }
}
