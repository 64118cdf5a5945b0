//! `donut bench`: the simulator and the earth mover's distance on fixed work, for comparing machines and
//! versions.
//!
//! Flags come in; tables or JSON go out. The work is in [`super::bench_sim`] and [`super::bench_emd`]. Imports sim.

use std::process::ExitCode;

use clap::Args;
use comfy_table::Table;
use serde::Serialize;

use super::bench_emd::{self, EmdResult};
use super::bench_sim::{self, BatchResult, CaseResult};
use super::memory::MemoryArgs;
use super::stdout;
use crate::sim::{Options, SimdLevel};

/// Times the simulator and the earth mover's distance on fixed work.
#[derive(Args)]
#[command(after_help = "Cases:\n  \
    A, B, C, D  one rollout and its gradient on all threads: 5000 particles, 30000, 5000 on a finer grid, 100000\n  \
    R1, R2      32 independent rollouts side by side, of 300 and of 1000 particles\n  \
    E1 .. E8    the earth mover's distance\n\n\
    All run but D, which needs 3 GB: ask for it with --case D.\n\n\
    Examples:\n  \
    donut bench\n  \
    donut bench --case A --threads 2\n  \
    donut bench --case A --memory-limit 100MiB      most control steps run twice\n  \
    donut bench --case E1 --json")]
pub struct BenchArgs {
    /// Threads that share a rollout, a batch of rollouts or a distance.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// Only this case.
    #[arg(long)]
    case: Option<String>,
    /// Instructions the simulator uses, instead of the fastest that the machine has.
    #[arg(long, value_enum)]
    simd: Option<SimdLevel>,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Runs of each case; the fastest counts.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    runs: u16,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct BenchResult {
    cases: Vec<CaseResult>,
    batches: Vec<BatchResult>,
    emd: Vec<EmdResult>,
    threads: u16,
    simd: String,
}

/// Runs the subcommand.
pub fn run(args: &BenchArgs) -> anyhow::Result<ExitCode> {
    let simd = args.simd.unwrap_or_else(SimdLevel::best);
    anyhow::ensure!(simd.is_available(), "this machine has no {simd:?} instructions; leave --simd away");
    let options = Options {
        threads: args.threads.into(),
        simd,
        memory_limit: args.memory.memory_limit,
        ..Options::default()
    };
    let wanted = |name: &str, by_default: bool| args.case.as_deref().map_or(by_default, |c| c == name);
    let cases: Vec<_> = bench_sim::CASES.iter().filter(|c| wanted(c.name, c.by_default)).collect();
    let batches: Vec<_> = bench_sim::BATCH_CASES.iter().filter(|c| wanted(c.0, true)).collect();
    let emd: Vec<_> = bench_emd::CASES.iter().filter(|c| wanted(c.0, true)).collect();
    anyhow::ensure!(
        cases.len() + batches.len() + emd.len() > 0,
        "there is no case `{}`; the cases are A to D, R1, R2 and E1 to E8",
        args.case.as_deref().unwrap_or_default()
    );
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads.into()).build()?;
    let distances = || emd.iter().map(|c| bench_emd::time_case(c, args.runs)).collect::<Result<_, _>>();
    let result = BenchResult {
        cases: cases.iter().map(|c| c.time(args.runs, &options)).collect::<Result<_, _>>()?,
        batches: batches
            .iter()
            .map(|c| bench_sim::time_batch(c, args.runs, &options))
            .collect::<Result<_, _>>()?,
        emd: pool.install(distances)?,
        threads: args.threads,
        simd: format!("{simd:?}").to_lowercase(),
    };
    if args.json {
        stdout::line(serde_json::to_string_pretty(&result)?)?;
    } else {
        print_tables(&result)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn print_tables(result: &BenchResult) -> std::io::Result<()> {
    if !result.cases.is_empty() {
        stdout::line(simulator_table(&result.cases))?;
    }
    if !result.batches.is_empty() {
        stdout::line(batch_table(&result.batches))?;
    }
    if !result.emd.is_empty() {
        stdout::line(emd_table(&result.emd))?;
    }
    stdout::line(format_args!("{} thread(s), {}", result.threads, result.simd))
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

fn batch_table(results: &[BatchResult]) -> Table {
    let mut table = Table::new();
    table.set_header(["case", "particles", "substeps", "rollouts/s", "gradients/s"]);
    for r in results {
        table.add_row([
            r.name.to_owned(),
            r.particles.to_string(),
            r.substeps.to_string(),
            format!("{:.1}", r.rollouts_per_second),
            format!("{:.1}", r.gradients_per_second),
        ]);
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
            c.name.to_owned(),
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
