//! `donut subgoals`: parses an answer, runs its code, writes the stages and their clouds.
//!
//! An answer's file and a directory come in; `stages.json` and `clouds.npz` go out, both or neither.
//! Imports `llm`.

use std::fs;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use comfy_table::Table;
use ndarray::Array2;
use ndarray_npy::NpzWriter;
use serde_json::{Value, json};

use crate::llm::stage::Stage;
use crate::llm::{Answer, AnswerError, stages_from_answer};
use crate::math::cloud::{Bounds, centroid};

/// Runs the code of a language model's answer and writes its stages and clouds.
#[derive(Args)]
pub struct SubgoalsArgs {
    /// The language model's answer, in markdown
    response: PathBuf,
    /// Directory for stages.json and clouds.npz; made if it is not there
    #[arg(long)]
    out: PathBuf,
    /// Print the stages as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(flags: &SubgoalsArgs) -> Result<ExitCode> {
    let file = flags.response.display();
    let text = fs::read_to_string(&flags.response).with_context(|| format!("{file} cannot be read"))?;
    let answer = stages_from_answer(&text).map_err(|error| explained(&file.to_string(), &error))?;
    for warning in &answer.warnings {
        eprintln!("warning: {file}: {warning}");
    }
    let stages = Value::Array(answer.stages.iter().map(as_json).collect());
    write(&flags.out, &stages, &answer)
        .with_context(|| format!("{} cannot be written", flags.out.display()))?;
    if flags.json {
        println!("{}", serde_json::to_string_pretty(&stages)?);
    } else {
        println!("{}", table(&answer.stages));
    }
    Ok(ExitCode::SUCCESS)
}

/// The error as `main` prints it: the file, the place, and the way out on a line of its own.
pub(super) fn explained(file: &str, error: &AnswerError) -> anyhow::Error {
    match error.hint() {
        Some(hint) => anyhow!("{file}: {error}\nhint: {hint}"),
        None => anyhow!("{file}: {error}"),
    }
}

fn as_json(stage: &Stage) -> Value {
    json!({
        "step": stage.step,
        "title": stage.title,
        "tool": stage.tool,
        "inputs": stage.inputs,
        "outputs": stage.outputs.iter().map(|o| &o.name).collect::<Vec<_>>(),
        "stated_location": stage.stated_location,
        "stated_volume": stage.stated_volume,
        "code": stage.code,
    })
}

/// The bytes of `clouds.npz`: one array `step<N>/<name>` for each output.
fn npz(stages: &[Stage]) -> Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = NpzWriter::new_compressed(&mut bytes);
    let mut written = std::collections::HashSet::new();
    for stage in stages {
        for output in &stage.outputs {
            let name = format!("step{}/{}", stage.step, output.name);
            // Of two steps with one number the first keeps the plain name.
            let copies = (2..).map(|n| format!("{name}_{n}"));
            let name = std::iter::once(name.clone()).chain(copies).find(|n| written.insert(n.clone()));
            let array = Array2::from_shape_vec((output.points.len(), 3), output.points.concat())?;
            writer.add_array(name.unwrap_or_default(), &array)?;
        }
    }
    writer.finish()?;
    Ok(bytes.into_inner())
}

/// Writes both files under temporary names and renames them only when both are complete.
fn write(directory: &Path, stages: &Value, answer: &Answer) -> Result<()> {
    let contents =
        [("stages.json", serde_json::to_vec_pretty(stages)?), ("clouds.npz", npz(&answer.stages)?)];
    fs::create_dir_all(directory)?;
    let temporary = |name: &str| directory.join(format!(".{name}.{}", std::process::id()));
    let written = contents.iter().try_for_each(|(name, bytes)| {
        let mut file = fs::File::create(temporary(name))?;
        file.write_all(bytes)?;
        file.sync_all()
    });
    let finished = written.and_then(|()| {
        contents.iter().try_for_each(|(name, _)| fs::rename(temporary(name), directory.join(name)))
    });
    if finished.is_err() {
        // Whatever is left of the temporary files goes; that it cannot go is no second error.
        contents.iter().for_each(|(name, _)| drop(fs::remove_file(temporary(name))));
    }
    Ok(finished?)
}

fn table(stages: &[Stage]) -> Table {
    let mut table = Table::new();
    table.set_header(["step", "tool", "piece", "points", "centre", "size", "stated volume"]);
    for stage in stages {
        for output in &stage.outputs {
            let shown = |p: [f64; 3]| format!("{:.3} {:.3} {:.3}", p[0], p[1], p[2]);
            table.add_row([
                stage.step.to_string(),
                stage.tool.clone().unwrap_or_else(|| "none".into()),
                output.name.clone(),
                output.points.len().to_string(),
                shown(centroid(&output.points)),
                Bounds::of(&output.points).map(|b| shown(b.size())).unwrap_or_default(),
                stage.stated_volume.get(&output.name).map(|v| format!("{v:.5}")).unwrap_or_default(),
            ]);
        }
    }
    table
}
