//! `donut tasks`: lists the tasks in the binary, a line each.
//!
//! Nothing comes in; a table goes to standard output. Imports the task module.

use anyhow::Result;
use clap::Args;
use comfy_table::{Table, presets};

use crate::task::{built_in_names, load_scene};

/// List the tasks that donut knows by name.
#[derive(Args)]
pub struct TasksArgs {}

/// Prints the list.
pub fn run(_: TasksArgs) -> Result<()> {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    for name in built_in_names() {
        let scene = load_scene(name)?;
        table.add_row([scene.name, scene.description]);
    }
    println!("{table}");
    Ok(())
}
