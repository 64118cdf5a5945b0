//! `donut new-task`: a commented task file to edit.
//!
//! A name comes in; `NAME.toml` appears in the current directory, unless there is one. Imports task and `store`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::stdout;
use crate::store::atomic;
use crate::task::template::new_task;
use crate::task::{Target, TaskSource};

/// Writes a commented task file to edit.
#[derive(Args)]
#[command(
    after_help = "The file is a valid task at once: it is the one that it was made from, under another name.\n\n\
    Examples:\n  \
    donut new-task bagel                     bagel.toml, with every key explained\n  \
    donut new-task squash --from spread      with a generated target: needs no language model\n  \
    donut check --task bagel.toml            is it valid, and what follows from it"
)]
pub struct NewTaskArgs {
    /// What the task is called: small letters, digits and hyphens. The file is NAME.toml.
    name: String,
    /// The task to start from (see `donut tasks`); the file of `donut` explains every key.
    #[arg(long, value_name = "TASK", default_value = "donut")]
    from: String,
}

/// Writes the file.
pub fn run(args: &NewTaskArgs) -> Result<()> {
    let text = new_task(&args.name, &args.from)?;
    let path = PathBuf::from(format!("{}.toml", args.name));
    let file = path.display().to_string();
    let source = TaskSource { label: file.clone(), text };
    let scene = source.scene()?;
    atomic::write_new(&path, source.text.as_bytes())?;
    stdout::line(format_args!("{file} is a task now. Edit it, and then:\n  donut check --task {file}"))?;
    match scene.target {
        Target::Stages { .. } => stdout::line(format_args!(
            "  donut prompt --task {file}                      what to ask a language model\n  \
             donut plan --task {file} --llm PROVIDER:MODEL   or --response ANSWER.md"
        ))?,
        Target::Generated { .. } => stdout::line(format_args!("  donut plan --task {file}"))?,
    }
    Ok(())
}
