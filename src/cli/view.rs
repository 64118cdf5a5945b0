//! `donut view`: pictures and the report of a stored run.
//!
//! A run directory and flags come in; a PNG or HTML file goes out. Imports `store` and `view`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::ensure;
use clap::Args;

use crate::store::record::RunRecord;
use crate::store::{atomic, run_dir};
use crate::view::{key_frames, render, report, scene};

/// Draws a stored run: key frames or one frame as PNG, or its report as HTML.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    donut view runs/donut --png donut.png            before, after each stage, goal\n  \
    donut view runs/donut --png last.png --frame 200 one frame, with its tool\n  \
    donut view runs/donut --html report.html         the interactive report again")]
pub struct ViewArgs {
    /// Run directory, as `donut plan --out` makes it.
    run_dir: PathBuf,
    /// Draw a picture into this file: the key frames, or the frame of --frame.
    #[arg(long, value_name = "OUT.png", required_unless_present = "html")]
    png: Option<PathBuf>,
    /// Write the report into this file.
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    /// Draw this frame only; 0 is the initial state.
    #[arg(long, value_name = "N", requires = "png")]
    frame: Option<usize>,
    /// Pixels across; for key frames, across each of them.
    #[arg(long, default_value_t = 480, value_parser = clap::value_parser!(u16).range(16..=8192))]
    width: u16,
    /// Pixels down.
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u16).range(16..=8192))]
    height: u16,
}

/// Runs the command.
pub fn run(args: &ViewArgs) -> anyhow::Result<ExitCode> {
    let record = run_dir::read_run(&args.run_dir)?;
    if let Some(path) = &args.png {
        picture(&record, args)?.write_png(path)?;
    }
    if let Some(path) = &args.html {
        atomic::write(path, report::html(&record).as_bytes())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn picture(record: &RunRecord, args: &ViewArgs) -> anyhow::Result<crate::view::Picture> {
    let (width, height) = (usize::from(args.width), usize::from(args.height));
    let Some(frame) = args.frame else { return Ok(key_frames(record, width, height)) };
    let steps = record.trajectory.steps();
    ensure!(frame <= steps, "--frame {frame} is not in this run, whose frames are 0 to {steps}");
    let scene = scene::of_frame(record, frame).expect("the frame was just checked");
    Ok(render(&scene, width, height))
}
