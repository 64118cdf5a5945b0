//! The suite `volume`: the paper's table of volume change.
//!
//! Recorded answers are run, not plans: a second's work, done anew each time. Imports the task module and `store`.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::EvalArgs;
use crate::cli::stdout;
use crate::eval::results::RESULTS;
use crate::store::{StoreError, atomic, run_dir};
use crate::task::volume_suite::{VolumeRow, VolumeTrial, prompt_name, volume_rows, volume_trials};

/// summary.json of this suite.
#[derive(Debug, Serialize, Deserialize)]
pub struct VolumeSummary {
    suite: Volume,
    rows: Vec<VolumeRow>,
}

/// The name of the suite, so that no other summary is taken for one of volumes.
#[derive(Debug, Serialize, Deserialize)]
enum Volume {
    #[serde(rename = "volume")]
    Volume,
}

/// Runs the suite. Nothing in it is random or worth dividing, so that most flags do not matter.
pub fn run(args: &EvalArgs) -> Result<ExitCode> {
    ensure!(args.shard.is_none(), "the suite `volume` takes a second; run it whole, without --shard");
    let tasks = args.tasks(super::Suite::Volume)?;
    let methods: BTreeSet<&str> = args.method.iter().map(String::as_str).collect();
    if let Some(name) = methods.iter().find(|m| ![prompt_name(true), prompt_name(false)].contains(*m)) {
        anyhow::bail!(
            "`{name}` does not compete in the suite `volume`; possible are {}, {}",
            prompt_name(true),
            prompt_name(false)
        );
    }
    let most = args.trials.map_or(usize::MAX, |n| n as usize);
    let mut trials = volume_trials();
    trials.retain(|t| {
        let asked_for = methods.is_empty() || methods.contains(prompt_name(t.guidelines));
        tasks.contains(&t.task) && asked_for && t.answer <= most
    });
    for trial in &trials {
        if let Err(reason) = &trial.made {
            eprintln!("warning: {} {} {}: {reason}", trial.task, prompt_name(trial.guidelines), trial.answer);
        }
    }
    let summary = VolumeSummary { suite: Volume::Volume, rows: volume_rows(&trials) };
    if let Some(out) = &args.out {
        write(out, &trials, &summary)?;
    }
    if args.json {
        stdout::line(serde_json::to_string_pretty(&summary)?)?;
    } else {
        stdout::text(summary.table())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn write(out: &Path, trials: &[VolumeTrial], summary: &VolumeSummary) -> Result<()> {
    std::fs::create_dir_all(out).map_err(StoreError::write(out))?;
    let lines: String = trials.iter().map(|trial| trial_json(trial).to_string() + "\n").collect();
    let results = out.join(RESULTS);
    let ours = |text: String| text.lines().all(|line| line.starts_with("{\"suite\":\"volume\""));
    let free = std::fs::read_to_string(&results).map_or(true, ours);
    ensure!(free, "{} holds the results of another suite; choose another --out", out.display());
    atomic::write(&results, lines.as_bytes())?;
    atomic::write(&out.join("table.md"), summary.table().as_bytes())?;
    run_dir::write_json(&out.join("summary.json"), summary)?;
    Ok(())
}

fn trial_json(trial: &VolumeTrial) -> Value {
    json!({
        "suite": "volume",
        "task": trial.task,
        "method": prompt_name(trial.guidelines),
        "trial": trial.answer,
        "volume_of_dough": trial.dough,
        "volume_made": trial.made.as_ref().ok(),
        "volume_change": trial.change(),
        "error": trial.made.as_ref().err(),
    })
}

impl VolumeSummary {
    /// The table beside the paper's figures.
    pub fn table(&self) -> String {
        let mut text = String::from(
            "| task | prompt | answers | volume change | the paper's |\n|---|---|---|---|---|\n",
        );
        for row in &self.rows {
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
}
