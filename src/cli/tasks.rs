//! `donut tasks`: lists the tasks in the binary, a line each.
//!
//! At most a task's name comes in; a table, or that task's file, goes to standard output. Imports the task
//! module.

use anyhow::Result;
use clap::Args;
use comfy_table::{Table, presets};

use super::stdout;
use crate::task::{TaskSource, built_in_names, load_scene};

/// Lists the tasks that donut knows by name.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    donut tasks                     a line for each\n  \
    donut tasks --show donut        the file of one; `donut new-task NAME` makes one to edit")]
pub struct TasksArgs {
    /// Print this task's file instead, to copy and change; the one of `donut` explains every key.
    #[arg(long, value_name = "NAME")]
    show: Option<String>,
}

/// Prints the list, or one file.
pub fn run(args: TasksArgs) -> Result<()> {
    if let Some(task) = args.show {
        return Ok(stdout::text(TaskSource::find(&task)?.text)?);
    }
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    for name in built_in_names() {
        let scene = load_scene(name)?;
        table.add_row([scene.name, scene.description]);
    }
    Ok(stdout::line(table.trim_fmt())?)
}
