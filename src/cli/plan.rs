//! `donut plan`: plans a task and executes it in simulation.
//!
//! A task or a description and, where it needs one, a language model's answer come in; a run directory and a table
//! go out.
//! Imports everything below.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, ensure};
use clap::Args;
use comfy_table::{Table, presets};
use tracing::{debug, warn};

use super::ask::{AskArgs, quoted};
use super::engine::Engine;
use super::memory::MemoryArgs;
use super::overrides::OverrideArgs;
use super::progress::ProgressLine;
use super::record::{RunInputs, record};
use super::said::{Said, asked_or_recorded, given};
use super::stdout;
use super::wanted::{Planned, Wanted, WantedArgs};
use crate::plan::settings::{Effort, Method, SearchSettings};
use crate::sim::{Options, SimdLevel};
use crate::store::atomic::RunDir;
use crate::store::record::Summary;
use crate::store::run_dir::write_and_commit;
use crate::task::run::{Planning, run_task};
use crate::view::report;

/// Plans a task and executes the plan in simulation.
#[derive(Args)]
#[command(after_help = "Exit status: 0 the task's threshold was reached, 1 it was not, 2 an error.\n\n\
    Examples:\n  \
    donut plan --task donut                             with a recorded answer, no network\n  \
    donut plan --task donut --response answer.md        with an answer of your own\n  \
    donut plan --task donut --llm openai:gpt-5          with a live model (OPENAI_API_KEY)\n  \
    donut plan --task donut --llm openai:qwen3 --llm-url http://127.0.0.1:11434/v1\n  \
    donut plan --task donut --llm record:said=anthropic:claude-sonnet-4-5\n  \
    donut plan --task donut --llm replay:said           what was recorded, without network\n  \
    donut plan --describe 'The dough is a ball with radius 1. Make a bagel.' --llm openai:gpt-5\n  \
    donut plan --task my-task.toml --out runs/mine      a task of your own (see `donut tasks --show donut`)")]
pub struct PlanArgs {
    #[command(flatten)]
    wanted: WantedArgs,
    /// A language model's answer to take the stages from.
    #[arg(long, value_name = "RESPONSE.md", conflicts_with_all = ["answer", "llm", "without_volume_reasoning"])]
    response: Option<PathBuf>,
    /// Which of the task's recorded answers to take the stages from, from 1.
    #[arg(long, value_name = "K", default_value_t = 1, conflicts_with = "llm")]
    answer: usize,
    /// What runs the answer's code.
    #[arg(long, value_enum, default_value_t)]
    engine: Engine,
    /// Which of the task's generated targets to aim at, from 0, where the task generates them.
    #[arg(long, value_name = "I", default_value_t = 0)]
    target: u64,
    /// Seed of the particles, the samples of the goal, and generated targets.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Where the run goes; `runs/TASK` if not given. An earlier run there is replaced.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the summary as JSON on standard output instead of a table.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overrides: OverrideArgs,
    /// How stages are planned.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// How long the method `donut` may search.
    #[arg(long, value_enum, default_value_t)]
    effort: Effort,
    /// Threads; the result does not depend on them. All processors if not given.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Instructions to use instead of the fastest that the machine has: `scalar` gives the same bits on
    /// every machine; the others give the same bits as one another.
    #[arg(long, value_enum)]
    simd: Option<SimdLevel>,
    #[command(flatten)]
    memory: MemoryArgs,
    // The last one: its heading holds for all that follow.
    #[command(flatten)]
    asking: AskArgs,
}

/// Runs the subcommand.
pub fn run(args: &PlanArgs) -> anyhow::Result<ExitCode> {
    let wanted = args.wanted.find()?;
    let out = args.out.clone().unwrap_or_else(|| Path::new("runs").join(wanted.name()));
    // Before a model is asked: an answer may cost something.
    let dir = RunDir::claim(&out)?;
    let options = args.options()?;
    let (Planned { source, mut scene, stages, warnings }, said) = args.planned(&wanted, &out)?;
    for warning in &warnings {
        warn!("{warning}");
    }
    args.overrides.overrides().apply(&mut scene);

    let mut progress = ProgressLine::new(scene.planner.max_steps);
    let planning = Planning { method: args.method, search: SearchSettings::of(args.effort) };
    // Matchings and the choice of start places take the threads of the pool that they are called on.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build()?;
    let run = pool.install(|| {
        run_task(&scene, &stages, &planning, args.seed, &options, |event| progress.show(&event))
    })?;
    progress.finish();

    let inputs = RunInputs {
        scene: &scene,
        task_file: &source.text,
        stages: &stages,
        planning: &planning,
        response: said.response.as_deref(),
        conversation: said.conversation.as_ref(),
        seed: args.seed,
        command: args.command_line(),
    };
    let (record, report) = pool.install(|| {
        let record = record(&inputs, &run);
        let report = report::html(&record);
        (record, report)
    });
    write_and_commit(dir, &record, &report)?;
    debug!("wrote {}", out.display());
    let summary = &record.summary;
    if args.json {
        stdout::line(serde_json::to_string_pretty(summary)?)?;
    } else {
        print_summary(summary, &out)?;
    }
    Ok(if summary.success { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

impl PlanArgs {
    fn options(&self) -> anyhow::Result<Options> {
        let simd = self.simd.unwrap_or_else(SimdLevel::best);
        ensure!(simd.is_available(), "this machine has no {simd:?} instructions; leave --simd away");
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        Ok(Options {
            threads: self.threads.map_or_else(all, usize::from),
            simd,
            memory_limit: self.memory.memory_limit,
            ..Options::default()
        })
    }

    /// The task with its stages, and the answer they came from if there is one.
    fn planned(&self, wanted: &Wanted, out: &Path) -> anyhow::Result<(Planned, Said)> {
        if let Some(path) = &self.response {
            wanted.line("--response")?;
            let text = std::fs::read_to_string(path)
                .with_context(|| format!("cannot read the answer {}", path.display()))?;
            return given(wanted, self.engine, &text, &path.display().to_string());
        }
        if self.asking.llm.is_empty()
            && let Wanted::Task { source, scene } = wanted
            && let Some(stages) = scene.generated_stages(self.seed, self.target)
        {
            let (source, scene) = (source.clone(), (**scene).clone());
            return Ok((Planned { source, scene, stages, warnings: Vec::new() }, Said::default()));
        }
        asked_or_recorded(wanted, self.engine, &self.asking, self.answer, out, "--response FILE.md")
    }

    /// The command that makes the same run.
    fn command_line(&self) -> String {
        let mut line = "donut plan".to_owned();
        let mut add = |flag: &str, value: Option<String>| {
            if let Some(value) = value {
                line += &format!(" --{flag} {}", quoted(&value));
            }
        };
        add("task", self.wanted.task.clone());
        add("describe", self.wanted.describe.clone());
        add("seed", Some(self.seed.to_string()));
        add("response", self.response.as_ref().map(|p| p.display().to_string()));
        add("answer", (self.answer != 1).then(|| self.answer.to_string()));
        add("engine", (self.engine == Engine::Python).then(|| "python".to_owned()));
        add("target", (self.target != 0).then(|| self.target.to_string()));
        add("method", (self.method != Method::default()).then(|| self.method.name()));
        add(
            "effort",
            (self.effort != Effort::default()).then(|| format!("{:?}", self.effort).to_lowercase()),
        );
        line + &self.overrides.overrides().to_string() + &self.asking.command_line()
    }
}

fn print_summary(summary: &Summary, out: &Path) -> std::io::Result<()> {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header(["stage", "tool", "steps", "resets", "EMD m", "score", "seconds", "ended"]);
    for (k, s) in summary.stages.iter().enumerate() {
        table.add_row([
            (k + 1).to_string(),
            s.tool.clone(),
            s.steps.to_string(),
            s.resets.to_string(),
            format!("{:.4} -> {:.4}", s.emd_initial, s.emd_final),
            format!("{:.3}", s.score),
            format!("{:.0}", s.seconds),
            s.stop.clone(),
        ]);
    }
    stdout::line(table)?;
    let verdict = if summary.success { "reached" } else { "not reached" };
    let ceiling =
        summary.score_ceiling.map_or(String::new(), |c| format!(", a perfect shape would score {c:.3}"));
    stdout::line(format_args!(
        "{}: score {:.3} (threshold {} {verdict}{ceiling}), EMD {:.4} -> {:.4} m, {:.0} s",
        summary.task,
        summary.score,
        summary.threshold,
        summary.emd_initial,
        summary.emd_final,
        summary.seconds
    ))?;
    stdout::line(format_args!("see it move: {}", out.join("report.html").display()))
}
