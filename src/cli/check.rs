//! `donut check`: validates a task, and an answer for it, and prints the numbers that follow.
//!
//! A task's name or file comes in, and perhaps an answer; tables go to standard output, or one error. Imports the
//! task module and the simulator's parameters.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Args;
use comfy_table::{Table, presets};
use tracing::warn;

use super::engine::Engine;
use super::pieces_table::pieces_table;
use super::stdout;
use crate::llm::recorded::recorded;
use crate::llm::stage::Stage;
use crate::math::neighbours::spacing;
use crate::sim::params::{COURANT_LIMIT, Params};
use crate::task::{Scene, StagePlan, Target, load_scene};

/// Generated targets that are tried for room: as many as a benchmark draws.
const TARGETS: u64 = 5;

/// Checks a task file and prints the numbers derived from it.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    donut check --task donut\n  \
    donut check --task my-task.toml\n  \
    donut check --task my-task.toml --response answer.md     does this answer fit the task?")]
pub struct CheckArgs {
    /// A task's name (see `donut tasks`) or the path of a task file.
    #[arg(long, value_name = "NAME|FILE.toml")]
    task: String,
    /// Seed of the generated targets that are tried.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// A language model's answer to check too: its code, its volumes, whether its clouds fit the workspace.
    #[arg(long, value_name = "RESPONSE.md")]
    response: Option<PathBuf>,
    /// What runs the answer's code.
    #[arg(long, value_enum, default_value_t)]
    engine: Engine,
}

/// Checks the task and prints its table.
pub fn run(args: CheckArgs) -> Result<()> {
    let scene = load_scene(&args.task)?;
    check_targets(&scene, args.seed)?;
    let stages = args.stages(&scene)?;
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.add_rows(world_rows(&scene.params).into_iter().chain(task_rows(&scene)));
    stdout::line(table.trim_fmt())?;
    if !stages.is_empty() {
        stdout::line(pieces_table(&stages))?;
    }
    Ok(stdout::line(format_args!("{} is a valid task.", scene.name))?)
}

impl CheckArgs {
    /// The stages of the answer that is given, or of the first recorded one, if they fit the task.
    fn stages(&self, scene: &Scene) -> Result<Vec<Stage>> {
        let Target::Stages { recorded_answers, .. } = &scene.target else {
            ensure!(
                self.response.is_none(),
                "the task `{}` generates its target; --response is for tasks with [target.stages]",
                scene.name
            );
            return Ok(Vec::new());
        };
        let set = recorded_answers.as_deref().unwrap_or("");
        let (text, name) = match (&self.response, recorded(set, 1)) {
            (Some(path), _) => {
                let name = path.display().to_string();
                (
                    std::fs::read_to_string(path)
                        .with_context(|| format!("cannot read the answer {name}"))?,
                    name,
                )
            }
            (None, Some(text)) => (text.to_owned(), format!("recorded answer 1 of `{set}`")),
            (None, None) => return Ok(Vec::new()),
        };
        let stages = self.engine.answered(&text, &name)?.stages;
        let plan = StagePlan::new(&stages, &scene.frame(), &scene.world(scene.nominal_floor()))
            .with_context(|| name.clone())?;
        if let Some(warning) = plan.volume_warning(scene.dough.solid.volume()) {
            warn!("{name}: {warning}");
        }
        Ok(stages)
    }
}

/// Whether the generated targets use a known tool and stay in the workspace.
fn check_targets(scene: &Scene, seed: u64) -> Result<()> {
    for index in 0..TARGETS {
        if let Some(stages) = scene.generated_stages(seed, index) {
            StagePlan::new(&stages, &scene.frame(), &scene.world(scene.nominal_floor()))
                .with_context(|| format!("{}: generated target {index} of seed {seed}", scene.name))?;
        }
    }
    Ok(())
}

type Row = [String; 3];

fn row(what: &str, value: String, how: &str) -> Row {
    [what.to_string(), value, how.to_string()]
}

fn world_rows(p: &Params) -> Vec<Row> {
    let workspace = p.workspace();
    vec![
        row("grid cell dx", format!("{:.6} m", p.dx()), "1 / nodes"),
        row("control step", format!("{:.4} s, {} substeps", p.control_step(), p.substeps), "dt * substeps"),
        row("shear modulus mu", format!("{:.2} Pa", p.mu()), "E / (2 (1 + nu))"),
        row("Lame parameter lambda", format!("{:.2} Pa", p.lambda()), "E nu / ((1 + nu) (1 - 2 nu))"),
        row("particle volume", format!("{:.4e}", p.particle_volume()), "(dx / 2)^2"),
        row("particle mass", format!("{:.4e} kg", p.particle_mass()), "density * volume"),
        row("wave speed c", format!("{:.2} m/s", p.wave_speed()), "sqrt((lambda + 2 mu) / density)"),
        row("Courant number", format!("{:.3} of {COURANT_LIMIT}", p.courant()), "dt c / dx"),
        row(
            "workspace",
            format!(
                "x, z {:.4} to {:.4} m; y from {:.4} m",
                workspace.min[0], workspace.max[0], workspace.min[1]
            ),
            "3 dx from the walls",
        ),
    ]
}

fn task_rows(scene: &Scene) -> Vec<Row> {
    let dough = &scene.dough;
    let gap = spacing(dough.solid.volume(), dough.particles);
    let planner = &scene.planner;
    let reach = planner.emd_steps as f64 * planner.emd_step_length_m;
    let tools: Vec<&str> = scene.tools.iter().map(|t| t.tool.name.as_str()).collect();
    let target = match &scene.target {
        Target::Stages { frame, .. } => format!("a language model's stages, unit {} m", frame.unit_m),
        Target::Generated { tool, .. } => format!("generated, for the {tool}"),
    };
    vec![
        row("dough", format!("{:.4e} m^3", dough.solid.volume()), "volume of its shape"),
        row("particles", format!("{}, {gap:.5} m apart", dough.particles), "(volume / particles)^(1/3)"),
        row("tools", tools.join(", "), ""),
        row("target", target, ""),
        row("reach of a horizon", format!("{reach:.3} m"), "K alpha"),
        row("horizons a stage", format!("{}", planner.max_steps.div_ceil(planner.horizon)), "max_steps / L"),
        row("threshold", format!("{}", scene.threshold), "normalised decrease of the EMD"),
    ]
}
