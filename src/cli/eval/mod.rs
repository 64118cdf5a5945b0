//! `donut eval`: the paper's tables.
//!
//! The name of a suite comes in; trials run, and a table goes to standard output and with everything else into a
//! directory. Imports eval and the task module.

mod merge;
mod output;
mod progress;
mod table;
mod volume;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, bail, ensure};
use clap::{Args, Subcommand};

use super::overrides::OverrideArgs;
use crate::eval::schedule::Schedule;
use crate::eval::targets::write_targets;
use crate::eval::{Config, Contender, ResultsDir, Spec, Suite};
use crate::plan::settings::Effort;
use crate::sim::SimdLevel;
use output::finish;
use progress::Progress;

/// Runs a suite of the paper's experiments and puts the results beside the paper's.
#[derive(Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "DIR gets results.jsonl (a line for each trial, there as soon as the trial is done), summary.json, table.md, \
    results.csv, chart.svg and, where targets are generated, targets.json and targets/.\n\nExamples:\n  \
    donut eval --suite single-tool --method donut,paper --out results/single\n  \
    donut eval --suite multi-tool --jobs 4 --out results/multi --resume     go on after an interruption\n  \
    donut eval --suite multi-tool-ablation --reuse results/multi            what both have is not run again\n  \
    donut eval --suite multi-tool --shard 2/8 --out part-2                  the second of eight parts\n  \
    donut eval merge part-* --out results/multi                             all parts\n  \
    donut eval table --update README.md                                     the tables in a document"
)]
pub struct EvalArgs {
    #[command(subcommand)]
    command: Option<EvalCommand>,
    /// Which experiment.
    #[arg(long, value_enum, required = true)]
    suite: Option<Suite>,
    /// What competes: methods of `donut plan`, and `paper-no-volume-reasoning` and `donut-no-volume-reasoning` in the
    /// multi-tool suites. Several with commas or by repetition; the suite's own if not given.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    method: Vec<String>,
    /// Only these of the suite's tasks.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    task: Vec<String>,
    /// Trials of each task and method; the paper's number if not given: 5 targets, or 4 answers with 5 seeds.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    trials: Option<u32>,
    /// The first seed.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Trials at once; they share the threads.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: u16,
    /// Threads, all jobs together; results do not depend on them. All processors if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// How long the method `donut` may search.
    #[arg(long, value_enum, default_value_t)]
    effort: Effort,
    #[command(flatten)]
    overrides: OverrideArgs,
    /// Instructions to use instead of the fastest that the machine has: `scalar` gives the same bits on
    /// every machine; the others give the same bits as one another.
    #[arg(long, value_enum)]
    simd: Option<SimdLevel>,
    /// Directory for the results; `runs/eval-SUITE` if not given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Go on with the results that DIR holds. Their configuration must be this one.
    #[arg(long)]
    resume: bool,
    /// Take over the trials of another experiment that are the same, instead of running them again: those of `paper` in
    /// multi-tool and multi-tool-ablation, for example. Several with commas or by repetition.
    #[arg(long, value_name = "DIR", value_delimiter = ',')]
    reuse: Vec<PathBuf>,
    /// Only part K of N, for several machines: every N-th trial. `donut eval merge` joins the parts.
    #[arg(long, value_name = "K/N")]
    shard: Option<String>,
    /// Print the summary as JSON on standard output instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Subcommand)]
enum EvalCommand {
    Merge(merge::MergeArgs),
    Table(table::TableArgs),
}

/// Runs the subcommand.
pub fn run(args: &EvalArgs) -> Result<ExitCode> {
    match (&args.command, args.suite) {
        (Some(EvalCommand::Merge(args)), _) => merge::run(args),
        (Some(EvalCommand::Table(args)), _) => table::run(args),
        (None, Some(Suite::Volume)) => volume::run(args),
        (None, Some(suite)) => args.run(suite),
        (None, None) => bail!("give --suite NAME"),
    }
}

impl EvalArgs {
    fn run(&self, suite: Suite) -> Result<ExitCode> {
        let simd = self.simd.unwrap_or_else(SimdLevel::best);
        ensure!(simd.is_available(), "this machine has no {simd:?} instructions; leave --simd away");
        let config =
            Config { seed: self.seed, effort: self.effort, overrides: self.overrides.overrides(), simd };
        let trials = self.trials.map_or(suite.trials(), |n| n as usize);
        let all = Spec::all(suite, &self.tasks(suite)?, &self.contenders(suite)?, trials, &config);
        let mine = self.shard_of(&all)?;

        let out =
            self.out.clone().unwrap_or_else(|| Path::new("runs").join(format!("eval-{}", suite.name())));
        let others: Vec<ResultsDir> =
            self.reuse.iter().map(|path| ResultsDir::existing(path)).collect::<Result<_, _>>()?;
        let dir = ResultsDir::open(&out, self.resume)?;
        dir.check_config(&dir.read()?, &all)?;
        write_targets(&out, &mine, &config)?;
        for other in &others {
            let count = dir.take_over(other, &mine)?;
            eprintln!("{count} trials are taken over from {}", other.path().display());
        }
        let before = dir.read()?;
        let pending: Vec<Spec> =
            mine.into_iter().filter(|spec| !before.iter().any(|trial| spec.is(trial))).collect();
        if !before.is_empty() {
            eprintln!("{} trials are done, {} to go", before.len(), pending.len());
        }
        let threads = self
            .threads
            .map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from);
        let schedule =
            Schedule { specs: &pending, config: &config, dir: Some(&dir), jobs: self.jobs.into(), threads };
        let progress = Progress::new(&pending, &config);
        schedule.run(&|event| progress.show(&event))?;
        progress.finish();
        dir.tidy();
        finish(suite, &dir, self.json)?;
        Ok(ExitCode::SUCCESS)
    }

    fn tasks(&self, suite: Suite) -> Result<Vec<&'static str>> {
        for task in &self.task {
            ensure!(
                suite.tasks().contains(&task.as_str()),
                "the suite `{}` has no task `{task}`; its tasks are {}",
                suite.name(),
                suite.tasks().join(", ")
            );
        }
        let wanted = |task: &&&str| self.task.is_empty() || self.task.iter().any(|t| t == **task);
        Ok(suite.tasks().iter().filter(wanted).copied().collect())
    }

    fn contenders(&self, suite: Suite) -> Result<Vec<Contender>> {
        if self.method.is_empty() {
            return Ok(suite.contenders());
        }
        let possible = || Contender::all().into_iter().filter(|c| suite.has_answers() || !c.needs_answers());
        let mut wanted: Vec<Contender> = Vec::new();
        for name in &self.method {
            let Some(contender) = possible().find(|c| c.name() == *name) else {
                let names: Vec<String> = possible().map(|c| c.name()).collect();
                bail!(
                    "`{name}` does not compete in the suite `{}`; possible are {}",
                    suite.name(),
                    names.join(", ")
                );
            };
            if !wanted.contains(&contender) {
                wanted.push(contender);
            }
        }
        Ok(wanted)
    }

    /// Every N-th trial, from the K-th on.
    fn shard_of(&self, all: &[Spec]) -> Result<Vec<Spec>> {
        let Some(text) = &self.shard else { return Ok(all.to_vec()) };
        let parts = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        let Some((k, n)) = parts.filter(|(k, n): &(usize, usize)| (1..=*n).contains(k)) else {
            bail!("--shard is `{text}`; it must be K/N with K from 1 to N, for example 2/8");
        };
        Ok(all.iter().skip(k - 1).step_by(n).cloned().collect())
    }
}
