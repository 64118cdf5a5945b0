//! `donut subgoals`: parses an answer, runs its code, writes the stages and their clouds.
//!
//! An answer's file and a directory come in; `stages.json`, `clouds.npz` and `clouds.png` go out, all or none.
//! Imports `llm` and `view`.

use std::fs;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Args;
use ndarray::Array2;
use ndarray_npy::NpzWriter;
use serde_json::{Value, json};

use super::engine::Engine;
use super::pieces_table::pieces_table;
use crate::llm::Answer;
use crate::llm::stage::Stage;
use crate::store::atomic;
use crate::view::Picture;
use crate::view::clouds::{Panel, picture};

/// Runs the code of a language model's answer and writes its stages and clouds.
#[derive(Args)]
pub struct SubgoalsArgs {
    /// The language model's answer, in markdown
    response: PathBuf,
    /// Directory for stages.json, clouds.npz and clouds.png; made if it is not there
    #[arg(long)]
    out: PathBuf,
    /// File for the picture of the clouds, instead of clouds.png in the directory
    #[arg(long, value_name = "OUT.png")]
    png: Option<PathBuf>,
    /// What runs the answer's code
    #[arg(long, value_enum, default_value_t)]
    engine: Engine,
    /// Print the stages as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(flags: &SubgoalsArgs) -> Result<ExitCode> {
    let file = flags.response.display();
    let text = fs::read_to_string(&flags.response).with_context(|| format!("{file} cannot be read"))?;
    let answer = flags.engine.answered(&text, &file.to_string())?;
    let stages = Value::Array(answer.stages.iter().map(as_json).collect());
    let png = drawn(&answer.stages).to_png();
    let beside = flags.png.is_none().then_some(&png[..]);
    write(&flags.out, &stages, &answer, beside)
        .with_context(|| format!("{} cannot be written", flags.out.display()))?;
    if let Some(path) = &flags.png {
        atomic::write(path, &png)?;
    }
    if flags.json {
        println!("{}", serde_json::to_string_pretty(&stages)?);
    } else {
        println!("{}", pieces_table(&answer.stages));
    }
    Ok(ExitCode::SUCCESS)
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
        "measured_volume": stage
            .outputs
            .iter()
            .map(|o| (o.name.clone(), json!(o.measured_volume())))
            .collect::<serde_json::Map<_, _>>(),
    })
}

/// A panel for each cloud; pieces of one step have different colours.
fn drawn(stages: &[Stage]) -> Picture {
    let mut panels = Vec::new();
    for stage in stages {
        for (color, output) in stage.outputs.iter().enumerate() {
            let tool = stage.tool.as_deref().unwrap_or("no tool");
            let mut volume = format!("volume {:.4} measured", output.measured_volume());
            if let Some(stated) = stage.stated_volume.get(&output.name) {
                volume += &format!(", {stated:.4} stated");
            }
            let made = match &stage.inputs[..] {
                [] => format!("{} points", output.points.len()),
                inputs => format!("of {}, {} points", inputs.join(" and "), output.points.len()),
            };
            let captions = vec![format!("{} {}: {}", stage.step, tool, output.name), made, volume];
            panels.push(Panel { captions, points: &output.points, color });
        }
    }
    picture(&panels)
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

/// Writes all files under temporary names and renames them only when all are complete.
fn write(directory: &Path, stages: &Value, answer: &Answer, png: Option<&[u8]>) -> Result<()> {
    let mut contents =
        vec![("stages.json", serde_json::to_vec_pretty(stages)?), ("clouds.npz", npz(&answer.stages)?)];
    contents.extend(png.map(|bytes| ("clouds.png", bytes.to_vec())));
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
