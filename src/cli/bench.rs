//! `donut bench`: the simulator and the earth mover's distance on fixed work, for comparing machines and
//! versions.
//!
//! Flags come in; a table or JSON goes out. The work: a ball of dough pressed by a rolling pin for 40
//! control steps, and the gradient of its end positions by the actions; and [`super::bench_emd`].
//! Imports sim.

use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use comfy_table::Table;
use serde::Serialize;

use super::bench_emd::{self, EmdResult};
use crate::sim::tool::{Motion, Shape, Tool, ToolPose};
use crate::sim::{Options, Params, ParticleState, SimdLevel, Simulator, StepSeed};
use crate::task::shapes::Solid;

/// Times the simulator and the earth mover's distance on fixed work.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    donut bench\n  \
    donut bench --case A --threads 2\n  \
    donut bench --case E1 --json")]
pub struct BenchArgs {
    /// Threads that share a rollout or a distance.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// Only this case (A to C: simulator; E1 to E8: earth mover's distance).
    #[arg(long)]
    case: Option<String>,
    /// Instructions the simulator uses, instead of the fastest that the machine has.
    #[arg(long, value_enum)]
    simd: Option<SimdLevel>,
    /// Runs of each case; the fastest counts.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    runs: u16,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Name, particles, nodes per axis.
const CASES: [(&str, usize, usize); 3] = [("A", 5000, 64), ("B", 30_000, 64), ("C", 5000, 80)];
/// Control steps of each case.
const STEPS: usize = 40;

#[derive(Serialize)]
struct CaseResult {
    name: String,
    particles: usize,
    grid_nodes: usize,
    substeps: usize,
    forward_seconds: f64,
    forward_backward_seconds: f64,
    forward_ns_per_particle_substep: f64,
    forward_backward_ns_per_particle_substep: f64,
}

#[derive(Serialize)]
struct BenchResult {
    cases: Vec<CaseResult>,
    emd: Vec<EmdResult>,
    threads: u16,
    simd: String,
}

/// Runs the subcommand.
pub fn run(args: &BenchArgs) -> anyhow::Result<ExitCode> {
    let simd = args.simd.unwrap_or_else(SimdLevel::best);
    anyhow::ensure!(simd.is_available(), "this machine has no {simd:?} instructions; leave --simd away");
    if let Some(name) = &args.case {
        anyhow::ensure!(
            CASES.iter().any(|c| c.0 == name) || bench_emd::CASES.iter().any(|c| c.0 == name),
            "there is no case `{name}`; the cases are A, B, C and E1 to E8"
        );
    }
    let wanted = |name: &str| args.case.as_deref().is_none_or(|c| c == name);
    let cases =
        CASES.iter().filter(|c| wanted(c.0)).map(|c| time_case(c, args, simd)).collect::<Result<_, _>>()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads.into()).build()?;
    let emd = bench_emd::CASES.iter().filter(|c| wanted(c.0));
    let emd = pool.install(|| emd.map(|c| bench_emd::time_case(c, args.runs)).collect::<Result<_, _>>())?;
    let result = BenchResult { cases, emd, threads: args.threads, simd: format!("{simd:?}").to_lowercase() };
    if args.json {
        println!("{}", serde_json::to_string_pretty(&result)?);
    } else {
        print_table(&result);
    }
    Ok(ExitCode::SUCCESS)
}

/// A pin above a ball, pressing and rolling to and fro.
fn press(params: &Params, particles: usize) -> (ParticleState, Tool, ToolPose, Vec<Vec<f64>>) {
    let (radius, floor) = (0.07, 3.0 * params.dx());
    let ball = Solid::Ball { radius };
    let x = ball.fill([0.5, floor + radius, 0.5], particles, 1);
    let tool = Tool {
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
    let actions =
        (0..STEPS).map(|i| vec![if (i / 5) % 2 == 1 { 0.1 } else { -0.1 }, 0.05, -0.3, 0.0]).collect();
    (ParticleState::at_rest(x), tool, pose, actions)
}

fn time_case(
    &(name, particles, nodes): &(&str, usize, usize),
    args: &BenchArgs,
    simd: SimdLevel,
) -> anyhow::Result<CaseResult> {
    let dt = if nodes == 80 { 8e-5 } else { 1e-4 };
    let params = Params { nodes, dt, ..Params::default() };
    let substeps = params.substeps * STEPS;
    let (start, tool, pose, actions) = press(&params, particles);
    let options = Options { threads: args.threads.into(), simd, ..Options::default() };
    let mut sim = Simulator::<f32>::new(params, vec![tool], options);
    let mut seeds = vec![StepSeed::default(); STEPS + 1];
    seeds[STEPS].positions = vec![[1.0 / particles as f64, 0.0, 0.0]; particles];
    let (mut forward, mut both) = (f64::INFINITY, f64::INFINITY);
    // The first run warms up: it allocates.
    for _ in 0..=args.runs {
        let begin = Instant::now();
        sim.rollout(&start, &[pose], &actions)?;
        forward = forward.min(begin.elapsed().as_secs_f64());
        sim.rollout_adj(&seeds)?;
        both = both.min(begin.elapsed().as_secs_f64());
    }
    let per = 1e9 / (particles * substeps) as f64;
    Ok(CaseResult {
        name: name.into(),
        particles,
        grid_nodes: nodes,
        substeps,
        forward_seconds: forward,
        forward_backward_seconds: both,
        forward_ns_per_particle_substep: forward * per,
        forward_backward_ns_per_particle_substep: both * per,
    })
}

fn print_table(result: &BenchResult) {
    if !result.cases.is_empty() {
        println!("{}", simulator_table(&result.cases));
    }
    if !result.emd.is_empty() {
        println!("{}", emd_table(&result.emd));
    }
    println!("{} thread(s), {}", result.threads, result.simd);
}

fn emd_table(results: &[EmdResult]) -> Table {
    let mut table = Table::new();
    table.set_header(["case", "distance", "points", "ms"]);
    for r in results {
        let method = format!("{:?}", r.method).to_lowercase();
        table.add_row([r.name.clone(), method, r.points.to_string(), format!("{:.2}", 1e3 * r.seconds)]);
    }
    table
}

fn simulator_table(cases: &[CaseResult]) -> Table {
    let mut table = Table::new();
    table.set_header([
        "case",
        "particles",
        "nodes",
        "forward s",
        "+ backward s",
        "ns/p/substep",
        "+ backward",
    ]);
    for c in cases {
        table.add_row([
            c.name.clone(),
            c.particles.to_string(),
            c.grid_nodes.to_string(),
            format!("{:.3}", c.forward_seconds),
            format!("{:.3}", c.forward_backward_seconds),
            format!("{:.1}", c.forward_ns_per_particle_substep),
            format!("{:.1}", c.forward_backward_ns_per_particle_substep),
        ]);
    }
    table
}
