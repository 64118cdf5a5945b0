//! `donut gradcheck`: checks the simulator's gradients against finite differences of its own forward pass.
//!
//! A task's tools or a scene come in; a table, a line a tool, or JSON goes to standard output. Exit code 0 if
//! every tool keeps the bounds, 1 if not, or if nothing could be judged. Imports the task module, store's scenes and sim's check.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use comfy_table::{Table, presets};
use serde::Serialize;

use super::stdout;
use super::warn_of;
use crate::sim::gradcheck::{BOUNDS, CONVERGED, Case, HORIZON, STEPS, Summary};
use crate::store::sim_scene;
use crate::task::{gradcheck, load_scene};

/// Checks the adjoint of whole rollouts against central finite differences in double precision.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    donut gradcheck                                 the tools of the task `donut`\n  \
    donut gradcheck --task my-task.toml --tool pole\n  \
    donut gradcheck --scene scene.json --json")]
pub struct GradcheckArgs {
    /// Press each tool of this task into its dough: a task's name or the path of a task file.
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "donut")]
    task: String,
    /// Check a scene of `donut simulate` with an array `target` instead.
    #[arg(long, value_name = "SCENE.json", conflicts_with = "task")]
    scene: Option<PathBuf>,
    /// Only the tool of this name (in a scene: of this kind).
    #[arg(long)]
    tool: Option<String>,
    /// Random action entries that are tried for each tool; all, if there are fewer.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    entries: u32,
    /// Control steps of the rollout whose entries are tried, instead of a task's 10 or a scene's own. The actions
    /// repeat after a task's 40 or a scene's last.
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..=1000))]
    steps: Option<u32>,
    /// Particles of a task's dough; a scene brings its own.
    #[arg(long, default_value_t = gradcheck::PARTICLES, value_parser = clap::value_parser!(u32).range(16..=1_000_000))]
    particles: u32,
    /// Seed of the entries, and of a task's dough and actions.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// What was found for one tool.
#[derive(Serialize)]
struct Row {
    tool: String,
    entries: usize,
    idle: usize,
    /// (step, component).
    unconverged: Vec<(usize, usize)>,
    median: Option<f64>,
    percentile_95: Option<f64>,
    doubt: Option<f64>,
    single_precision: f64,
    sensitivity: f64,
    passes: bool,
}

impl Row {
    fn verdict(&self) -> &'static str {
        match (self.passes, self.median) {
            (true, _) => "ok",
            (false, None) => "NOT JUDGED",
            (false, Some(_)) => "FAILED",
        }
    }

    /// Why a check that did not pass need not mean a wrong gradient.
    fn why_undecided(&self) -> Option<String> {
        let [bound, _] = BOUNDS;
        match (self.median, self.doubt) {
            _ if self.passes => None,
            (None, _) if self.idle == self.entries => Some(
                "nothing to judge: in these control steps the tool changes nothing; take more --steps, or a scene in which \
                 it touches the dough"
                    .to_string(),
            ),
            (None, _) => {
                Some("nothing to judge: no finite difference has converged; take more --entries or fewer --steps".to_string())
            }
            (Some(_), Some(doubt)) if doubt > bound => Some(format!(
                "the differences themselves are known to {doubt:.0e} only, as where the tool moves next to nothing; take more \
                 --steps, or a scene in which it touches more of the dough"
            )),
            _ => None,
        }
    }
}

/// One tool of a case, and the rollout over which precisions are compared.
struct Job {
    tool: String,
    index: usize,
    short: Case,
    long: Case,
}

/// Runs the subcommand.
pub fn run(args: &GradcheckArgs) -> Result<ExitCode> {
    let jobs = match &args.scene {
        Some(path) => of_scene(path, args)?,
        None => of_task(args)?,
    };
    let rows: Vec<Row> = jobs.iter().map(|job| check(job, args)).collect::<Result<_>>()?;
    if args.json {
        stdout::line(serde_json::to_string_pretty(&rows)?)?;
    } else {
        print_table(&rows)?;
    }
    Ok(if rows.iter().all(|row| row.passes) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn of_scene(path: &std::path::Path, args: &GradcheckArgs) -> Result<Vec<Job>> {
    let scene = sim_scene::read(path)?;
    let Some(case) = scene.gradient_case() else {
        bail!("{}: a check needs an array `target` (n, 3) among the scene's arrays", path.display());
    };
    let names: Vec<String> = scene.tools.iter().map(|t| t.name.clone()).collect();
    let wanted = wanted(args, &names)?;
    warn_of(path, &scene);
    let steps = args.steps.map_or(case.actions.len(), |steps| steps as usize);
    let job = |(index, tool): (usize, String)| Job {
        tool,
        index,
        short: case.over(steps),
        long: case.over(HORIZON),
    };
    Ok(names.into_iter().enumerate().filter(|(_, name)| wanted(name)).map(job).collect())
}

fn of_task(args: &GradcheckArgs) -> Result<Vec<Job>> {
    let scene = load_scene(&args.task)?;
    let names: Vec<String> = scene.tools.iter().map(|t| t.tool.name.clone()).collect();
    let cases = gradcheck::cases(&scene, args.particles as usize, args.seed, wanted(args, &names)?)?;
    let steps = args.steps.map_or(gradcheck::STEPS, |steps| steps as usize);
    let job = |(tool, long): (String, Case)| Job { tool, index: 0, short: long.over(steps), long };
    Ok(cases.into_iter().map(job).collect())
}

/// Which tools are asked for; an error if none is.
fn wanted<'a>(args: &'a GradcheckArgs, names: &[String]) -> Result<impl Fn(&str) -> bool + 'a> {
    match &args.tool {
        Some(tool) if !names.contains(tool) => {
            bail!("there is no tool `{tool}`; the tools are {}", names.join(", "))
        }
        None if names.is_empty() => bail!("the scene has no tool, so there is no gradient to check"),
        tool => Ok(move |name: &str| tool.as_deref().is_none_or(|t| t == name)),
    }
}

fn check(job: &Job, args: &GradcheckArgs) -> Result<Row> {
    let at = || format!("the rollout of the {}", job.tool);
    let entries = job.short.entries(job.index, args.entries as usize, args.seed).with_context(at)?;
    let single_precision = job.long.single_precision_error(job.index).with_context(at)?;
    let sensitivity = job.long.sensitivity(job.index, args.seed).with_context(at)?;
    let summary = Summary::of(&entries);
    Ok(Row {
        tool: job.tool.clone(),
        passes: summary.passes(),
        entries: summary.entries,
        idle: summary.idle,
        unconverged: summary.unconverged,
        median: summary.median,
        percentile_95: summary.percentile_95,
        doubt: summary.doubt,
        single_precision,
        sensitivity,
    })
}

/// More entries than this are counted only.
const LISTED: usize = 8;

fn print_table(rows: &[Row]) -> std::io::Result<()> {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["tool", "entries", "idle", "not converged", "median", "95th", "f32", "start", ""]);
    let figure = |v: Option<f64>| v.map_or("-".to_string(), |v| format!("{v:.1e}"));
    for row in rows {
        table.add_row([
            row.tool.clone(),
            row.entries.to_string(),
            row.idle.to_string(),
            row.unconverged.len().to_string(),
            figure(row.median),
            figure(row.percentile_95),
            figure(Some(row.single_precision)),
            figure(Some(row.sensitivity)),
            row.verdict().to_string(),
        ]);
    }
    stdout::line(table.trim_fmt())?;
    for row in rows.iter().filter(|r| (1..=LISTED).contains(&r.unconverged.len())) {
        let list: Vec<String> = row.unconverged.iter().map(|(s, c)| format!("{s}/{c}")).collect();
        stdout::line(format_args!("{}: not converged at step/component {}", row.tool, list.join(", ")))?;
    }
    for row in rows {
        if let Some(reason) = row.why_undecided() {
            stdout::line(format_args!("{}: {reason}", row.tool))?;
        }
    }
    let ([largest, .., smallest], [median, percentile]) = (STEPS, BOUNDS);
    stdout::line(format_args!(
        "median, 95th: relative error of the adjoint against central differences of steps from {largest:e} to \
         {smallest:e},\nwhere those agree and show no kink to {CONVERGED:e}; they must be below {median:e} and \
         {percentile:e}. idle: entries \
         that\nchange nothing. f32: how far the gradient over {HORIZON} control steps in single precision is from \
         that in\ndouble, as a share of its norm. start: how far the latter moves when the start positions do by as \
         much as\nrounding them to f32 can."
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_that_proves_nothing_says_why() {
        let [bound, _] = BOUNDS;
        let row = |idle, median: Option<f64>, doubt| Row {
            tool: "pole".into(),
            entries: 10,
            idle,
            unconverged: Vec::new(),
            median,
            percentile_95: median,
            doubt,
            single_precision: 0.0,
            sensitivity: 0.0,
            passes: median.is_some_and(|e| e < bound),
        };
        for (row, verdict, reason) in [
            (row(3, Some(0.1 * bound), Some(10.0 * bound)), "ok", None),
            (row(10, None, None), "NOT JUDGED", Some("the tool changes nothing")),
            (row(3, None, None), "NOT JUDGED", Some("no finite difference has converged")),
            (row(3, Some(2.0 * bound), Some(3.0 * bound)), "FAILED", Some("are known to 3e-6 only")),
            (row(3, Some(2.0 * bound), Some(0.1 * bound)), "FAILED", None),
        ] {
            assert_eq!(row.verdict(), verdict);
            let why = row.why_undecided();
            assert!(why.as_deref().unwrap_or("-").contains(reason.unwrap_or("-")), "{why:?}");
            assert_eq!(why.is_some(), reason.is_some());
        }
    }
}
