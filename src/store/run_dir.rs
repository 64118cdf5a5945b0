//! A run directory: summary.json, plan.json, trajectory.npz, report.html, and conversation.txt if a language
//! model was asked.
//!
//! A [`RunRecord`] and its report (from `view::report`, a layer above) come in, these files go out, and the
//! record comes back from three of them. Imports `store`'s other files.

use std::fs;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::atomic::{self, COMPLETION_MARK, OPTIONAL, RUN_MARK, RunDir};
use super::error::StoreError;
use super::record::RunRecord;
use super::trajectory::Trajectory;

const SUMMARY: &str = COMPLETION_MARK;
const PLAN: &str = RUN_MARK;
const TRAJECTORY: &str = "trajectory.npz";
const REPORT: &str = "report.html";
const CONVERSATION: &str = OPTIONAL[0];

/// Writes a run's files into `dir`, which has to exist. For a run directory that appears whole, pass
/// [`RunDir::stage`] and commit afterwards, or call [`write_and_commit`].
pub fn write_run(dir: &Path, run: &RunRecord, report: &str) -> Result<(), StoreError> {
    run.trajectory.write(&dir.join(TRAJECTORY))?;
    write_json(&dir.join(PLAN), &run.plan)?;
    if let Some(conversation) = &run.plan.conversation {
        atomic::write(&dir.join(CONVERSATION), conversation.to_text().as_bytes())?;
    }
    atomic::write(&dir.join(REPORT), report.as_bytes())?;
    write_json(&dir.join(SUMMARY), &run.summary)
}

/// Fills a claimed run directory and puts it in place.
pub fn write_and_commit(mut dir: RunDir, run: &RunRecord, report: &str) -> Result<(), StoreError> {
    write_run(dir.stage()?, run, report)?;
    dir.commit()
}

/// Reads what [`write_run`] wrote.
pub fn read_run(dir: &Path) -> Result<RunRecord, StoreError> {
    for missing in [SUMMARY, PLAN, TRAJECTORY] {
        if !dir.join(missing).is_file() {
            return Err(StoreError::Incomplete { path: dir.to_owned(), missing });
        }
    }
    let mut run = RunRecord {
        summary: read_json(&dir.join(SUMMARY))?,
        plan: read_json(&dir.join(PLAN))?,
        trajectory: Trajectory::read(&dir.join(TRAJECTORY))?,
    };
    check_consistent(&run).map_err(|reason| StoreError::Format { path: dir.join(PLAN), reason })?;
    // The file's rows are as wide as the widest action.
    let RunRecord { plan, trajectory, .. } = &mut run;
    for (action, &tool) in trajectory.actions.iter_mut().zip(&trajectory.tool[1..]) {
        action.truncate(usize::try_from(tool).map_or(0, |tool| plan.tools[tool].action_len()));
    }
    Ok(run)
}

/// Refuses files of different runs: whoever draws or replays a run may then index freely.
fn check_consistent(run: &RunRecord) -> Result<(), String> {
    let RunRecord { plan, trajectory, .. } = run;
    let tool = trajectory.tool.iter().copied().max().unwrap_or(-1);
    if tool >= plan.tools.len() as i32 {
        return Err(format!("trajectory.npz uses tool {tool}, but the plan lists {}", plan.tools.len()));
    }
    let segments = plan.stages.iter().flat_map(|stage| &stage.segments);
    let last = segments.map(|segment| segment.last_frame()).max().unwrap_or(0);
    if last > trajectory.steps() {
        return Err(format!("the plan goes to step {last}, but trajectory.npz to {}", trajectory.steps()));
    }
    Ok(())
}

/// Writes a value as indented JSON with a final newline.
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<(), StoreError> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|reason| StoreError::Json { path: path.to_owned(), reason })?;
    text.push('\n');
    atomic::write(path, text.as_bytes())
}

/// Reads a JSON file.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, StoreError> {
    let text = fs::read_to_string(path).map_err(StoreError::read(path))?;
    serde_json::from_str(&text).map_err(|reason| StoreError::Json { path: path.to_owned(), reason })
}
