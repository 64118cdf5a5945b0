//! `donut subgoals`: parses an answer, runs its code, writes the stages and their clouds.
//!
//! An answer's file, or a task and perhaps a model to ask, and a directory come in; `stages.json`, `clouds.npz` and
//! `clouds.png` go out, all or none. Imports `llm`, task and `view`.

use std::fs;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Args;
use ndarray::Array2;
use ndarray_npy::NpzWriter;
use serde_json::{Value, json};
use tracing::warn;

use super::ask::AskArgs;
use super::engine::Engine;
use super::pieces_table::pieces_table;
use super::said::{Said, asked_or_recorded};
use super::stdout;
use super::wanted::WantedArgs;
use crate::llm::stage::Stage;
use crate::store::atomic;
use crate::view::Picture;
use crate::view::clouds::{Panel, picture};

/// Runs the code of a language model's answer and writes its stages and clouds.
#[derive(Args)]
#[command(
    override_usage = "donut subgoals <RESPONSE.md> --out <DIR>\n       \
        donut subgoals --task <NAME|FILE.toml> [--llm <PROVIDER:MODEL>] --out <DIR>\n       \
        donut subgoals --describe <TEXT> [--llm <PROVIDER:MODEL>] --out <DIR>",
    after_help = "Examples:\n  \
    donut subgoals answer.md --out clouds                    an answer in a file\n  \
    donut subgoals --task donut --out clouds                 a recorded answer\n  \
    donut subgoals --task donut --llm openai:gpt-5 --out clouds\n  \
    donut subgoals --describe 'The dough is a ball with radius 1. Make a bagel.' --llm openai:gpt-5 --out clouds"
)]
pub struct SubgoalsArgs {
    /// A language model's answer, in markdown.
    #[arg(required_unless_present_any = ["task", "describe"], conflicts_with_all = ["task", "describe", "llm"])]
    response: Option<PathBuf>,
    /// Take or ask for an answer for this task: a name (see `donut tasks`) or the path of a task file. The answer must
    /// fit it.
    #[arg(long, value_name = "NAME|FILE.toml", conflicts_with = "describe")]
    task: Option<String>,
    /// The same for a new task in one line: the dough and what to make of it, in units of your own.
    #[arg(long, value_name = "TEXT")]
    describe: Option<String>,
    /// Which of the task's recorded answers to take, from 1.
    #[arg(long, value_name = "K", default_value_t = 1, conflicts_with_all = ["llm", "response"])]
    answer: usize,
    /// Directory for stages.json, clouds.npz and clouds.png, and for answer.md and conversation.txt if a model was
    /// asked; made if it is not there.
    #[arg(long)]
    out: PathBuf,
    /// File for the picture of the clouds, instead of clouds.png in the directory.
    #[arg(long, value_name = "OUT.png")]
    png: Option<PathBuf>,
    /// What runs the answer's code.
    #[arg(long, value_enum, default_value_t)]
    engine: Engine,
    /// Print the stages as JSON on standard output.
    #[arg(long)]
    json: bool,
    // The last one: its heading holds for all that follow.
    #[command(flatten)]
    asking: AskArgs,
}

/// Runs the command.
pub fn run(flags: &SubgoalsArgs) -> Result<ExitCode> {
    let (stages, said) = flags.stages()?;
    let listed = Value::Array(stages.iter().map(as_json).collect());
    let png = drawn(&stages).to_png();
    let mut files = vec![("stages.json", serde_json::to_vec_pretty(&listed)?), ("clouds.npz", npz(&stages)?)];
    if flags.png.is_none() {
        files.push(("clouds.png", png.clone()));
    }
    if let Some(conversation) = &said.conversation {
        files.push(("conversation.txt", conversation.to_text().into_bytes()));
        files.extend(said.response.map(|text| ("answer.md", text.into_bytes())));
    }
    write(&flags.out, &files).with_context(|| format!("{} cannot be written", flags.out.display()))?;
    if let Some(path) = &flags.png {
        atomic::write(path, &png)?;
    }
    if flags.json {
        stdout::line(serde_json::to_string_pretty(&listed)?)?;
    } else {
        stdout::line(pieces_table(&stages))?;
    }
    Ok(ExitCode::SUCCESS)
}

impl SubgoalsArgs {
    /// The stages of the answer in the file, or of one for the task.
    fn stages(&self) -> Result<(Vec<Stage>, Said)> {
        if let Some(path) = &self.response {
            let file = path.display();
            let text = fs::read_to_string(path).with_context(|| format!("{file} cannot be read"))?;
            return Ok((self.engine.answered(&text, &file.to_string())?.stages, Said::default()));
        }
        let wanted = WantedArgs { task: self.task.clone(), describe: self.describe.clone() }.find()?;
        wanted.line("`donut subgoals`")?;
        let otherwise = "`donut subgoals RESPONSE.md --out DIR`";
        let (planned, said) =
            asked_or_recorded(&wanted, self.engine, &self.asking, self.answer, &self.out, otherwise)?;
        for warning in &planned.warnings {
            warn!("{warning}");
        }
        Ok((planned.stages, said))
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
fn write(directory: &Path, contents: &[(&str, Vec<u8>)]) -> Result<()> {
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
