//! `donut view`: pictures, a film, PLY files and the report of a stored run.
//!
//! A run directory and flags come in; PNG, GIF, PLY or HTML files go out. Imports `store` and `view`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::ensure;
use clap::{ArgGroup, Args};
use tracing::debug;

use crate::cli::progress::counting;
use crate::store::record::RunRecord;
use crate::store::{atomic, run_dir};
use crate::view::film::{self, Film};
use crate::view::{Picture, key_frames, ply, render, report, scene};

/// Pictures that a film has by default, at most.
const FILM_FRAMES: usize = 100;

/// Draws a stored run: pictures (PNG), a film (GIF), PLY files, or its report (HTML).
#[derive(Args)]
#[command(
    group(ArgGroup::new("what").required(true).multiple(true).args(["png", "gif", "ply", "html"])),
    after_help = "Examples:\n  \
    donut view runs/donut --png donut.png                  before, after each stage, goal\n  \
    donut view runs/donut --png last.png --frame 200       one frame, with its tool\n  \
    donut view runs/donut --gif donut.gif                  the whole run, with its tools\n  \
    donut view runs/donut --gif small.gif --width 240 --height 180 --every 8\n  \
    donut view runs/donut --ply frames --every 10          for Blender, MeshLab, ParaView\n  \
    donut view runs/donut --html report.html               the interactive report again"
)]
pub struct ViewArgs {
    /// Run directory, as `donut plan --out` makes it.
    run_dir: PathBuf,
    /// Draw a picture into this file: the key frames, or the frame of --frame.
    #[arg(long, value_name = "OUT.png")]
    png: Option<PathBuf>,
    /// Draw the run as an animated picture into this file.
    #[arg(long, value_name = "OUT.gif")]
    gif: Option<PathBuf>,
    /// Write the frames into this directory, which must be absent or empty: dough_NNNN.ply with the particles (x, y, z
    /// in m, piece, colour), tool_NNNN.ply with the tool's triangles, target.ply. Binary, little-endian.
    #[arg(long, value_name = "DIR")]
    ply: Option<PathBuf>,
    /// Write the report into this file.
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    /// Draw, or write as PLY, this frame only; 0 is the initial state.
    #[arg(long, value_name = "N", conflicts_with_all = ["gif", "html"])]
    frame: Option<usize>,
    /// For --gif and --ply: every so many control steps; a film shows a third as many while no tool is in use. If not
    /// given, all of them for --ply, and as many as make at most 100 pictures for --gif.
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "frame")]
    every: Option<u32>,
    /// For --gif: pictures a second.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..=50))]
    fps: u16,
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
    let steps = record.trajectory.steps();
    if let Some(frame) = args.frame {
        ensure!(frame <= steps, "--frame {frame} is not in this run, whose frames are 0 to {steps}");
    }
    if let Some(path) = &args.png {
        args.picture(&record).write_png(path)?;
    }
    if let Some(path) = &args.gif {
        let film = args.film(&record);
        debug!("a picture of every {} control steps with a tool", film.every);
        let bar = counting("picture");
        let bytes = film::gif(&record, &film, |drawn, count| {
            bar.set_length(count as u64);
            bar.set_position(drawn as u64);
        });
        bar.finish_and_clear();
        atomic::write(path, &bytes)?;
    }
    if let Some(path) = &args.ply {
        let every = args.every.map_or(1, |every| every as usize);
        let all = || (0..steps).step_by(every).chain([steps]).collect();
        let frames = args.frame.map_or_else(all, |frame| vec![frame]);
        atomic::write_directory(path, ply::files(&record, &frames))?;
    }
    if let Some(path) = &args.html {
        atomic::write(path, report::html(&record).as_bytes())?;
    }
    Ok(ExitCode::SUCCESS)
}

impl ViewArgs {
    fn picture(&self, record: &RunRecord) -> Picture {
        let (width, height) = (usize::from(self.width), usize::from(self.height));
        match self.frame.and_then(|frame| scene::of_frame(record, frame)) {
            Some(scene) => render(&scene, width, height),
            None => key_frames(record, width, height),
        }
    }

    fn film(&self, record: &RunRecord) -> Film {
        let every = self.every.map_or_else(|| film::every_for(record, FILM_FRAMES), |every| every as usize);
        Film { width: self.width, height: self.height, every, fps: self.fps }
    }
}
