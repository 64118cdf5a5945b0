//! `donut simulate`: runs a scene's fixed actions, and the gradient of its loss.
//!
//! A scene file comes in, an `.npz` of positions, poses, velocities and the gradient goes out. Imports sim
//! and store.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use ndarray::Array2;

use super::memory::MemoryArgs;
use super::warn_of;
use crate::math::cloud::Point;
use crate::sim::lanes::Real;
use crate::sim::{Options, SimdLevel, Simulator, StepSeed, Tool};
use crate::store::sim_scene::{self, SimResult, SimScene};

/// Runs the simulator on a scene and its action sequence.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    donut simulate scene.json --out out.npz\n  \
    donut simulate scene.json --out out.npz --gradient      and the gradient of the loss by the actions\n  \
    donut simulate scene.json --out out.npz --precision f32 --threads 2")]
pub struct SimulateArgs {
    /// Scene file (JSON); its arrays stand beside it.
    scene: PathBuf,
    /// Where the result goes (.npz).
    #[arg(long, value_name = "OUT.npz")]
    out: PathBuf,
    /// Also write the loss (sum of L1 distances to `target` at the end) and its gradient by the actions.
    #[arg(long)]
    gradient: bool,
    /// Precision of the particles and the grid.
    #[arg(long, value_enum, default_value = "f64")]
    precision: Precision,
    /// Threads; the result does not depend on them.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// Instructions to use instead of the fastest that the machine has: `scalar` gives the same bits on
    /// every machine; the others give the same bits as one another.
    #[arg(long, value_enum)]
    simd: Option<SimdLevel>,
    #[command(flatten)]
    memory: MemoryArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum Precision {
    F32,
    F64,
}

/// Runs the subcommand.
pub fn run(args: &SimulateArgs) -> anyhow::Result<ExitCode> {
    let scene = sim_scene::read(&args.scene)?;
    if args.gradient && scene.target.is_none() {
        bail!("--gradient needs an array `target` (n, 3) among the scene's arrays");
    }
    let canonical = |path: &Path| path.canonicalize().ok();
    let out = canonical(&args.out);
    if out.is_some() && [&args.scene, &scene.arrays].into_iter().any(|path| canonical(path) == out) {
        bail!("--out {} is the scene's own file, which would be lost; take another name", args.out.display());
    }
    warn_of(&args.scene, &scene);
    let simd = args.simd.unwrap_or_else(SimdLevel::best);
    if !simd.is_available() {
        bail!("this machine has no {simd:?} instructions; leave --simd away");
    }
    let options = Options {
        threads: args.threads.into(),
        simd,
        memory_limit: args.memory.memory_limit,
        ..Options::default()
    };
    let result = match args.precision {
        Precision::F32 => simulate::<f32>(&scene, options, args.gradient),
        Precision::F64 => simulate::<f64>(&scene, options, args.gradient),
    };
    let result = result.with_context(|| format!("{}", args.scene.display()))?;
    sim_scene::write_result(&args.out, &result)?;
    Ok(ExitCode::SUCCESS)
}

/// Sum of L1 distances, and its derivative by the positions.
fn l1_loss(x: &[Point], target: &[Point]) -> (f64, Vec<Point>) {
    let mut loss = 0.0;
    let gradient = x
        .iter()
        .zip(target)
        .map(|(x, t)| {
            std::array::from_fn(|a| {
                let d = x[a] - t[a];
                loss += d.abs();
                if d == 0.0 { 0.0 } else { d.signum() }
            })
        })
        .collect();
    (loss, gradient)
}

/// Runs a scene in the precision of `T`.
fn simulate<T: Real>(scene: &SimScene, options: Options, gradient: bool) -> anyhow::Result<SimResult> {
    let mut sim = Simulator::<T>::new(scene.params.clone(), scene.tools.clone(), options);
    sim.rollout(&scene.start, &scene.poses, &scene.actions)?;
    let steps = sim.steps();
    let positions: Vec<Vec<Point>> = (0..=steps).map(|s| sim.positions(s)).collect();
    let gradient = match &scene.target {
        Some(target) if gradient => {
            let (loss, by_position) = l1_loss(&positions[steps], target);
            let mut seeds = vec![StepSeed::default(); steps + 1];
            seeds[steps].positions = by_position;
            let by_action = sim.rollout_adj(&seeds)?.actions;
            let width = scene.tools.iter().map(Tool::action_len).sum();
            let rows = Array2::from_shape_fn((steps, width), |(t, k)| by_action[t][k]);
            Some((loss, rows))
        }
        _ => None,
    };
    Ok(SimResult {
        positions,
        poses: (0..=steps).map(|s| sim.poses(s).to_vec()).collect(),
        velocities: sim.state(steps).v,
        gradient,
    })
}
