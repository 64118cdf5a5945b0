//! What an experiment leaves beside its trials: summary, tables, chart.
//!
//! A directory of results comes in; its summary goes into it and to standard output. Imports eval and store.

use anyhow::Result;

use crate::cli::stdout;
use crate::eval::{ResultsDir, Suite, Summary, chart, table};
use crate::store::{atomic, run_dir};

/// Writes summary.json, table.md, results.csv and chart.svg from all trials of the directory, and prints one of
/// them.
pub fn finish(suite: Suite, dir: &ResultsDir, json: bool) -> Result<()> {
    let summary = Summary::of(suite, &dir.read()?);
    let at = |name: &str| dir.path().join(name);
    let markdown = table::markdown(&summary);
    atomic::write(&at("table.md"), markdown.as_bytes())?;
    atomic::write(&at("results.csv"), table::csv(&summary.rows).as_bytes())?;
    atomic::write(&at("chart.svg"), chart::svg(&summary.rows).as_bytes())?;
    run_dir::write_json(&at("summary.json"), &summary)?;
    if json {
        stdout::line(serde_json::to_string_pretty(&summary)?)?;
    } else {
        stdout::text(markdown)?;
    }
    Ok(())
}
