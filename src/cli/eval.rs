//! `donut eval`: the paper's tables.
//!
//! The name of a suite comes in; a table goes to standard output, and with --out `results.jsonl`, `summary.json`
//! and `table.md` into a directory. Imports the task module and `store`.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use crate::store::atomic;
use crate::task::volume_suite::{VolumeRow, VolumeTrial, volume_rows, volume_trials};

/// A table of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Suite {
    /// How much the volume of the goal differs from the dough's, with and without the prompt's guidelines.
    Volume,
}

/// Computes a table of the paper, beside the paper's figures.
#[derive(Args)]
pub struct EvalArgs {
    /// Which table.
    #[arg(long, value_enum)]
    suite: Suite,
    /// Directory for results.jsonl, summary.json and table.md; made if it is not there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the summary as JSON on standard output instead of a table.
    #[arg(long)]
    json: bool,
}

/// Runs the subcommand.
pub fn run(args: &EvalArgs) -> Result<ExitCode> {
    match args.suite {
        Suite::Volume => volume(args),
    }
}

fn volume(args: &EvalArgs) -> Result<ExitCode> {
    let mut results = args.out.as_deref().map(results_file).transpose()?;
    let mut failed = None;
    let trials = volume_trials(|trial| {
        if let Some(file) = &mut results {
            // One line a trial, there as soon as the trial is done.
            let line = trial_json(trial).to_string() + "\n";
            failed = file.write_all(line.as_bytes()).and_then(|()| file.flush()).err().or(failed.take());
        }
    });
    if let Some(error) = failed {
        return Err(error).context("results.jsonl cannot be written");
    }
    for trial in &trials {
        if let Err(reason) = &trial.made {
            eprintln!("warning: {} {} {}: {reason}", trial.task, method(trial.guidelines), trial.answer);
        }
    }
    let rows = volume_rows(&trials);
    let summary = json!({ "suite": "volume", "rows": rows.iter().map(row_json).collect::<Vec<_>>() });
    let table = markdown(&rows);
    if let Some(out) = &args.out {
        atomic::write(&out.join("summary.json"), serde_json::to_string_pretty(&summary)?.as_bytes())?;
        atomic::write(&out.join("table.md"), table.as_bytes())?;
    }
    if args.json {
        println!("{}", serde_json::to_string_pretty(&summary)?);
    } else {
        print!("{table}");
    }
    Ok(ExitCode::SUCCESS)
}

fn results_file(out: &Path) -> Result<fs::File> {
    let open = || {
        fs::create_dir_all(out)?;
        fs::File::create(out.join("results.jsonl"))
    };
    open().with_context(|| format!("{} cannot be written", out.display()))
}

/// What results call the prompt.
fn method(guidelines: bool) -> &'static str {
    if guidelines { "full" } else { "without-volume-reasoning" }
}

fn trial_json(trial: &VolumeTrial) -> Value {
    json!({
        "suite": "volume",
        "task": trial.task,
        "method": method(trial.guidelines),
        "trial": trial.answer,
        "volume_of_dough": trial.dough,
        "volume_made": trial.made.as_ref().ok(),
        "volume_change": trial.change(),
        "error": trial.made.as_ref().err(),
    })
}

fn row_json(row: &VolumeRow) -> Value {
    json!({
        "task": row.task,
        "method": method(row.guidelines),
        "trials": row.trials,
        "failed": row.failed,
        "volume_change_mean": row.change_mean,
        "volume_change_std": row.change_std,
        "paper_volume_change": row.paper_change,
    })
}

fn markdown(rows: &[VolumeRow]) -> String {
    let mut text =
        String::from("| task | prompt | answers | volume change | the paper's |\n|---|---|---|---|---|\n");
    for row in rows {
        let prompt = if row.guidelines { "full" } else { "without VP and CR" };
        let failed = if row.failed > 0 { format!(" ({} failed)", row.failed) } else { String::new() };
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let _ = writeln!(
            text,
            "| {} | {prompt} | {}{failed} | {} ± {} | {} |",
            row.task,
            row.trials,
            percent(row.change_mean),
            percent(row.change_std),
            percent(row.paper_change)
        );
    }
    text + "\nMean and standard deviation of |made - dough| / dough over the recorded answers; VP: volume-preserving, CR: \
            chain reasoning. The volume made is measured from the final clouds, which is good to about 10 %.\n"
}
