//! `donut plan`: plans a task and executes it in simulation.
//!
//! A task and, where it needs one, a language model's answer come in; a run directory and a table go out.
//! Imports everything below.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail, ensure};
use clap::Args;
use comfy_table::{Table, presets};

use super::engine::Engine;
use super::progress::ProgressLine;
use super::record::{RunInputs, record};
use crate::llm::recorded::recorded;
use crate::llm::stage::Stage;
use crate::sim::{Options, SimdLevel};
use crate::store::atomic::RunDir;
use crate::store::record::Summary;
use crate::store::run_dir::write_and_commit;
use crate::task::run::run_task;
use crate::task::source::TaskSource;
use crate::task::{Scene, Target};
use crate::view::report;

/// Plans a task and executes the plan in simulation.
#[derive(Args)]
#[command(after_help = "Exit status: 0 the task's threshold was reached, 1 it was not, 2 an error.\n\n\
    Examples:\n  \
    donut plan --task donut                             with a recorded answer, no network\n  \
    donut plan --task donut --response answer.md        with an answer of your own\n  \
    donut plan --task my-task.toml --out runs/mine      a task of your own (see `donut tasks --show donut`)")]
pub struct PlanArgs {
    /// A task's name (see `donut tasks`) or the path of a task file.
    #[arg(long, value_name = "NAME|FILE.toml")]
    task: String,
    /// A language model's answer to take the stages from.
    #[arg(long, value_name = "RESPONSE.md", conflicts_with = "answer")]
    response: Option<PathBuf>,
    /// Which of the task's recorded answers to take the stages from, from 1.
    #[arg(long, value_name = "K", default_value_t = 1)]
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
    /// Particles, instead of the task's number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(50..=200_000))]
    particles: Option<u32>,
    /// Gradient steps per horizon (J), instead of the task's number.
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    iterations: Option<u32>,
    /// Control steps a stage may take, instead of the task's number.
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    max_steps: Option<u32>,
    /// Threads; the result does not depend on them. All processors if not given.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Instructions to use: `scalar` gives the same bits on every machine.
    #[arg(long, value_enum)]
    simd: Option<SimdLevel>,
}

/// Runs the subcommand.
pub fn run(args: &PlanArgs) -> anyhow::Result<ExitCode> {
    let source = TaskSource::find(&args.task)?;
    let mut scene = source.scene()?;
    args.override_scene(&mut scene);
    let (stages, response) = args.stages(&scene)?;
    let out = args.out.clone().unwrap_or_else(|| Path::new("runs").join(&scene.name));
    let dir = RunDir::create(&out)?;
    let options = args.options()?;

    let mut progress = ProgressLine::new(scene.planner.max_steps, scene.planner.iterations);
    let run = run_task(&scene, &stages, args.seed, &options, |event| progress.show(&event))?;
    progress.finish();

    let inputs = RunInputs {
        scene: &scene,
        task_file: &source.text,
        stages: &stages,
        response: response.as_deref(),
        seed: args.seed,
        command: args.command_line(),
    };
    let record = record(&inputs, &run);
    write_and_commit(dir, &record, &report::html(&record))?;
    let summary = &record.summary;
    if args.json {
        println!("{}", serde_json::to_string_pretty(summary)?);
    } else {
        print_summary(summary, &out);
    }
    Ok(if summary.success { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

impl PlanArgs {
    fn override_scene(&self, scene: &mut Scene) {
        if let Some(n) = self.particles {
            scene.dough.particles = n as usize;
        }
        if let Some(j) = self.iterations {
            scene.planner.iterations = j as usize;
        }
        if let Some(steps) = self.max_steps {
            scene.planner.max_steps = steps as usize;
            scene.planner.horizon = scene.planner.horizon.min(steps as usize);
        }
    }

    fn options(&self) -> anyhow::Result<Options> {
        let simd = self.simd.unwrap_or_else(SimdLevel::best);
        ensure!(simd.is_available(), "this machine has no {simd:?} instructions; leave --simd away");
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        Ok(Options { threads: self.threads.map_or_else(all, usize::from), simd, ..Options::default() })
    }

    /// The stages, and the answer they came from if there is one.
    fn stages(&self, scene: &Scene) -> anyhow::Result<(Vec<Stage>, Option<String>)> {
        if let Some(path) = &self.response {
            ensure!(
                matches!(scene.target, Target::Stages { .. }),
                "the task `{}` generates its target; --response is for tasks with [target.stages]",
                scene.name
            );
            let text = std::fs::read_to_string(path)
                .with_context(|| format!("cannot read the answer {}", path.display()))?;
            let stages = self.engine.answered(&text, &path.display().to_string())?.stages;
            return Ok((stages, Some(text)));
        }
        if let Some(stages) = scene.generated_stages(self.seed, self.target) {
            return Ok((stages, None));
        }
        let Target::Stages { recorded_answers: Some(set), .. } = &scene.target else {
            bail!("the task `{}` has no recorded answer; give one with --response FILE.md", scene.name);
        };
        let Some(text) = recorded(set, self.answer) else {
            bail!("the set `{set}` has no recorded answer {}; --answer counts from 1", self.answer);
        };
        let name = format!("recorded answer {} of `{set}`", self.answer);
        let stages = self.engine.answered(text, &name)?.stages;
        Ok((stages, Some(text.to_owned())))
    }

    /// The command that makes the same run.
    fn command_line(&self) -> String {
        let mut line = format!("donut plan --task {} --seed {}", self.task, self.seed);
        let mut add = |flag: &str, value: Option<String>| {
            if let Some(value) = value {
                line += &format!(" --{flag} {value}");
            }
        };
        add("response", self.response.as_ref().map(|p| p.display().to_string()));
        add("answer", (self.answer != 1).then(|| self.answer.to_string()));
        add("engine", (self.engine == Engine::Python).then(|| "python".to_owned()));
        add("target", (self.target != 0).then(|| self.target.to_string()));
        add("particles", self.particles.map(|n| n.to_string()));
        add("iterations", self.iterations.map(|n| n.to_string()));
        add("max-steps", self.max_steps.map(|n| n.to_string()));
        line
    }
}

fn print_summary(summary: &Summary, out: &Path) {
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
    println!("{table}");
    let verdict = if summary.success { "reached" } else { "not reached" };
    let ceiling =
        summary.score_ceiling.map_or(String::new(), |c| format!(", a perfect shape would score {c:.3}"));
    println!(
        "{}: score {:.3} (threshold {} {verdict}{ceiling}), EMD {:.4} -> {:.4} m, {:.0} s",
        summary.task,
        summary.score,
        summary.threshold,
        summary.emd_initial,
        summary.emd_final,
        summary.seconds
    );
    println!("see it move: {}", out.join("report.html").display());
}
