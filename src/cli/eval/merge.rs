//! `donut eval merge`: the parts of an experiment joined.
//!
//! Directories of results come in, one with all of them goes out. Imports eval and store.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use clap::Args;

use super::output::finish;
use crate::eval::results::RESULTS;
use crate::eval::targets::{FOLDER, TARGETS};
use crate::eval::{Contender, ResultsDir, ResultsError, Suite, Trial};
use crate::store::{StoreError, atomic, run_dir};

/// Joins the parts of an experiment that were run with --shard, on one machine or several.
#[derive(Args)]
pub struct MergeArgs {
    /// Directories that `donut eval --out` has made.
    #[arg(required = true, value_name = "DIR")]
    parts: Vec<PathBuf>,
    /// Directory for all results; it must not hold any yet.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print the summary as JSON on standard output instead of a table.
    #[arg(long)]
    json: bool,
}

/// Runs the subcommand.
pub fn run(args: &MergeArgs) -> Result<ExitCode> {
    let (suite, trials) = joined(&args.parts)?;
    let place = args.out.join(RESULTS);
    ensure!(!place.exists(), "{} exists; choose another --out, or remove it", place.display());
    let out = ResultsDir::open(&args.out, false)?;
    let mut text = String::new();
    for trial in &trials {
        text += &serde_json::to_string(trial)?;
        text.push('\n');
    }
    atomic::write(&place, text.as_bytes())?;
    join_targets(&args.parts, &args.out)?;
    out.tidy();
    finish(suite, &out, args.json)?;
    Ok(ExitCode::SUCCESS)
}

/// The trials of all parts in the order of tables, each once.
fn joined(parts: &[PathBuf]) -> Result<(Suite, Vec<Trial>), ResultsError> {
    let mut all: BTreeMap<(usize, usize, usize), (Trial, &Path)> = BTreeMap::new();
    let mut configs: BTreeMap<(String, String), (String, &Path)> = BTreeMap::new();
    let mut suite: Option<(Suite, &Path)> = None;
    for part in parts {
        let dir = ResultsDir::existing(part)?;
        for trial in dir.read()? {
            let conflict = |first: &Path, reason: String| {
                Err(ResultsError::Conflict { first: first.to_owned(), second: part.clone(), reason })
            };
            let (first, place) = *suite.get_or_insert((trial.suite, part));
            if first != trial.suite {
                return conflict(place, format!("suite {} and {}", first.name(), trial.suite.name()));
            }
            let own = (trial.task.clone(), trial.method.clone());
            let (config, place) = configs.entry(own).or_insert_with(|| (trial.config.clone(), part));
            if *config != trial.config {
                let reason = format!(
                    "{} {} with configuration {config} and {}",
                    trial.task, trial.method, trial.config
                );
                return conflict(place, reason);
            }
            let key = order(&trial);
            if let Some((other, place)) = all.get(&key) {
                if !other.same_outcome(&trial) {
                    let reason = format!(
                        "{} {} trial {} came out twice, and differently",
                        trial.task, trial.method, trial.trial
                    );
                    return conflict(place, reason);
                }
                continue;
            }
            all.insert(key, (trial, part));
        }
    }
    let Some((suite, _)) = suite else {
        return Err(ResultsError::None { path: parts[0].clone() });
    };
    Ok((suite, all.into_values().map(|(trial, _)| trial).collect()))
}

/// Where a trial stands: task, method, number.
fn order(trial: &Trial) -> (usize, usize, usize) {
    let task = trial.suite.tasks().iter().position(|t| *t == trial.task);
    let method = Contender::all().iter().position(|c| c.name() == trial.method);
    (task.unwrap_or(usize::MAX), method.unwrap_or(usize::MAX), trial.trial)
}

/// The targets of all parts.
fn join_targets(parts: &[PathBuf], out: &Path) -> Result<()> {
    let mut all: BTreeMap<String, BTreeMap<String, serde_json::Value>> = BTreeMap::new();
    for part in parts {
        let file = part.join(TARGETS);
        if file.is_file() {
            let tasks: BTreeMap<String, BTreeMap<String, serde_json::Value>> = run_dir::read_json(&file)?;
            for (task, targets) in tasks {
                all.entry(task).or_default().extend(targets);
            }
        }
        let Ok(clouds) = fs::read_dir(part.join(FOLDER)) else { continue };
        for cloud in clouds {
            let from = cloud.map_err(StoreError::read(part))?.path();
            let bytes = fs::read(&from).map_err(StoreError::read(&from))?;
            let folder = out.join(FOLDER);
            fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
            atomic::write(&folder.join(from.file_name().unwrap_or_default()), &bytes)?;
        }
    }
    if !all.is_empty() {
        run_dir::write_json(&out.join(TARGETS), &all)?;
    }
    Ok(())
}
