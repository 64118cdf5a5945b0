//! `donut eval table`: tables of results in a document, generated, not typed.
//!
//! Directories of results come in and a table goes out; or a document, whose marked places get theirs. Imports eval
//! and store.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, bail, ensure};
use clap::Args;

use super::volume::VolumeSummary;
use crate::cli::stdout;
use crate::eval::results::RESULTS;
use crate::eval::{ResultsDir, Summary, table};
use crate::store::{StoreError, atomic, run_dir};

/// Where a table begins; the directories of results follow, relative to the document.
const BEGIN: &str = "<!-- donut eval table ";
const BEGIN_END: &str = " -->";
/// Where it ends.
const END: &str = "<!-- end of table -->";

/// Prints the table of some results, or brings the tables of a document up to date: whatever stands between
/// `<!-- donut eval table DIR.. -->` and `<!-- end of table -->`.
#[derive(Args)]
pub struct TableArgs {
    /// Directories of results; their rows become one table.
    #[arg(value_name = "DIR", required_unless_present_any = ["update", "check"])]
    results: Vec<PathBuf>,
    /// The document. The directories stand in it, relative to it.
    #[arg(long, value_name = "FILE.md", conflicts_with = "results")]
    update: Option<PathBuf>,
    /// Only say whether the document is up to date: an error if it is not.
    #[arg(long, value_name = "FILE.md", conflicts_with_all = ["results", "update"])]
    check: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &TableArgs) -> Result<ExitCode> {
    let Some(document) = args.update.as_ref().or(args.check.as_ref()) else {
        stdout::text(table_of(&args.results)?)?;
        return Ok(ExitCode::SUCCESS);
    };
    let text = std::fs::read_to_string(document).map_err(StoreError::read(document))?;
    let (updated, tables) = with_tables(document, &text)?;
    let name = document.display();
    ensure!(
        tables > 0,
        "{name} has no place for a table; put `{BEGIN}DIR{BEGIN_END}` and `{END}` on lines of their own"
    );
    if updated != text {
        ensure!(
            args.check.is_none(),
            "the tables in {name} are not those of its results; run `donut eval table --update {name}`"
        );
        atomic::write(document, updated.as_bytes())?;
    }
    eprintln!("{tables} tables are up to date");
    Ok(ExitCode::SUCCESS)
}

/// The document with its tables made anew, and how many there are.
fn with_tables(document: &Path, text: &str) -> Result<(String, usize)> {
    let folder = document.parent().unwrap_or(Path::new(""));
    let mut out = String::new();
    let mut tables = 0;
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        out += line;
        out.push('\n');
        let Some(dirs) = line.strip_prefix(BEGIN).and_then(|rest| rest.strip_suffix(BEGIN_END)) else {
            continue;
        };
        let dirs: Vec<PathBuf> = dirs.split_whitespace().map(|dir| folder.join(dir)).collect();
        out += &table_of(&dirs)?;
        tables += 1;
        if !lines.any(|line| line == END) {
            bail!("{}: the table after `{line}` has no end; put `{END}` behind it", document.display());
        }
        out += END;
        out.push('\n');
    }
    Ok((out, tables))
}

/// The table of some directories of results.
fn table_of(dirs: &[PathBuf]) -> Result<String> {
    let mut rows = Vec::new();
    for dir in dirs {
        let summary = dir.join("summary.json");
        if let Ok(volume) = run_dir::read_json::<VolumeSummary>(&summary) {
            ensure!(dirs.len() == 1, "{} has another kind of table; give it alone", dir.display());
            return Ok(volume.table());
        }
        let trials = ResultsDir::existing(dir)?.read()?;
        let Some(first) = trials.first() else { bail!("{} has no trial in {RESULTS}", dir.display()) };
        rows.extend(Summary::of(first.suite, &trials).rows);
    }
    Ok(table::scores(&rows))
}
