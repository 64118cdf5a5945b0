//! The simulator on fixed work, for `donut bench`.
//!
//! A case and how to run it come in, seconds go out. The work: a ball of dough pressed by a rolling pin, and the
//! gradient of its end positions by the actions; one rollout on all threads, or many rollouts side by side, as the
//! search over strokes runs them. Imports sim.

use std::time::Instant;

use serde::Serialize;

use crate::sim::tool::{Motion, Shape, Tool, ToolPose};
use crate::sim::{Batch, Options, Params, ParticleState, SimError, Simulator, StepSeed};
use crate::task::shapes::Solid;

/// One rollout at a time.
pub struct Case {
    pub name: &'static str,
    particles: usize,
    /// Grid nodes per axis.
    nodes: usize,
    control_steps: usize,
    /// Whether it runs without being asked for by name.
    pub by_default: bool,
}

/// The last has twenty times the particles of the first, to see whether time grows in proportion. It runs when asked
/// for: it needs 3 GB with a quarter of the others' control steps.
pub const CASES: [Case; 4] = [
    Case { name: "A", particles: 5000, nodes: 64, control_steps: 40, by_default: true },
    Case { name: "B", particles: 30_000, nodes: 64, control_steps: 40, by_default: true },
    Case { name: "C", particles: 5000, nodes: 80, control_steps: 40, by_default: true },
    Case { name: "D", particles: 100_000, nodes: 64, control_steps: 10, by_default: false },
];

/// Many rollouts side by side: name and particles.
pub const BATCH_CASES: [(&str, usize); 2] = [("R1", 300), ("R2", 1000)];
/// Rollouts of a batch, and control steps of each: a stroke.
const BATCH: (usize, usize) = (32, 20);

/// What a case took.
#[derive(Serialize)]
pub struct CaseResult {
    pub name: &'static str,
    pub particles: usize,
    pub grid_nodes: usize,
    substeps: usize,
    pub forward_seconds: f64,
    pub forward_backward_seconds: f64,
    pub forward_ns_per_particle_substep: f64,
    pub forward_backward_ns_per_particle_substep: f64,
}

/// How many rollouts a second a batch made.
#[derive(Serialize)]
pub struct BatchResult {
    pub name: &'static str,
    pub particles: usize,
    /// Substeps of each rollout.
    pub substeps: usize,
    pub rollouts_per_second: f64,
    /// Rollouts with their gradients.
    pub gradients_per_second: f64,
}

/// Dough, a pin and what it does.
struct Press {
    params: Params,
    start: ParticleState,
    pin: Tool,
    pose: ToolPose,
    actions: Vec<Vec<f64>>,
    /// Derivatives of the mean position along x at the end.
    seeds: Vec<StepSeed>,
}

impl Press {
    /// A pin above a ball, pressing and rolling to and fro.
    fn new(particles: usize, nodes: usize, control_steps: usize) -> Self {
        let dt = if nodes == 80 { 8e-5 } else { 1e-4 };
        let params = Params { nodes, dt, ..Params::default() };
        let (radius, floor) = (0.07, 3.0 * params.dx());
        let x = Solid::Ball { radius }.fill([0.5, floor + radius, 0.5], particles, 1);
        let pin = Tool {
            name: "rolling pin".into(),
            shape: Shape::Capsule { radius: 0.03, length: 0.3 },
            motion: Motion::RollingPin,
            friction: 0.9,
            action_scale: vec![0.7, 0.005, 0.005, 0.005],
            lower_bound: [0.0; 3],
            upper_bound: [1.0; 3],
        };
        let height = floor + 2.0 * radius + 0.032;
        let pose = ToolPose { position: [0.5, height, 0.5], rotation: [0.707, 0.707, 0.0, 0.0], gap: 0.0 };
        let roll = |step: usize| if step / 5 % 2 == 1 { 0.1 } else { -0.1 };
        let actions = (0..control_steps).map(|i| vec![roll(i), 0.05, -0.3, 0.0]).collect();
        let mut seeds = vec![StepSeed::default(); control_steps + 1];
        seeds[control_steps].positions = vec![[1.0 / particles as f64, 0.0, 0.0]; particles];
        Self { params, start: ParticleState::at_rest(x), pin, pose, actions, seeds }
    }

    fn substeps(&self) -> usize {
        self.params.substeps * self.actions.len()
    }
}

impl Case {
    /// Times the case; the fastest of `runs` counts, after one that warms up: it allocates.
    pub fn time(&self, runs: u16, options: &Options) -> Result<CaseResult, SimError> {
        let press = Press::new(self.particles, self.nodes, self.control_steps);
        let mut sim = Simulator::<f32>::new(press.params.clone(), vec![press.pin.clone()], options.clone());
        let (mut forward, mut both) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..=runs {
            let begin = Instant::now();
            sim.rollout(&press.start, &[press.pose], &press.actions)?;
            forward = forward.min(begin.elapsed().as_secs_f64());
            sim.rollout_adj(&press.seeds)?;
            both = both.min(begin.elapsed().as_secs_f64());
        }
        let substeps = press.substeps();
        let per = 1e9 / (self.particles * substeps) as f64;
        Ok(CaseResult {
            name: self.name,
            particles: self.particles,
            grid_nodes: self.nodes,
            substeps,
            forward_seconds: forward,
            forward_backward_seconds: both,
            forward_ns_per_particle_substep: forward * per,
            forward_backward_ns_per_particle_substep: both * per,
        })
    }
}

/// Times one of [`BATCH_CASES`]: rollouts whose pins begin at places of their own, without and with gradients.
pub fn time_batch(
    &(name, particles): &(&'static str, usize),
    runs: u16,
    options: &Options,
) -> Result<BatchResult, SimError> {
    let (count, control_steps) = BATCH;
    let press = Press::new(particles, Params::default().nodes, control_steps);
    let poses: Vec<ToolPose> = (0..count)
        .map(|k| {
            let [x, y, z] = press.pose.position;
            // The pin touches from the first control step on, as the search places it.
            ToolPose { position: [x + 1e-3 * k as f64, y - 0.004, z], ..press.pose }
        })
        .collect();
    let mut batch = Batch::<f32>::new(&press.params, std::slice::from_ref(&press.pin), options);
    let mut fastest = |gradient: bool| {
        let limit = if gradient { options.memory_limit / options.threads.max(1) } else { 0 };
        let mut seconds = f64::INFINITY;
        for _ in 0..=runs {
            let begin = Instant::now();
            let press_once = |sim: &mut Simulator<f32>, &pose: &ToolPose| {
                sim.set_memory_limit(limit);
                sim.rollout(&press.start, &[pose], &press.actions)?;
                if gradient { sim.rollout_adj(&press.seeds).map(drop) } else { Ok(()) }
            };
            let outcomes = batch.run(&poses, |_| 0, press_once);
            outcomes.into_iter().collect::<Result<(), SimError>>()?;
            seconds = seconds.min(begin.elapsed().as_secs_f64());
        }
        Ok(count as f64 / seconds)
    };
    Ok(BatchResult {
        name,
        particles,
        substeps: press.substeps(),
        rollouts_per_second: fastest(false)?,
        gradients_per_second: fastest(true)?,
    })
}
