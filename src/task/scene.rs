//! A checked task: everything that a run needs to know, in SI units.
//!
//! A [`TaskFile`] comes in; a [`Scene`] goes out, or the first [`Complaint`] about a value. Below this
//! border nobody checks again. Imports math, sim and the planner's settings.

use super::error::Complaint;
use super::file::{DoughShape, DoughTable, TargetTable, TaskFile, WorldTable};
use super::generate::{Generator, generate};
use super::shapes::{Dough, Solid};
use super::subgoal::{Frame, World};
use super::tools::{ToolSetup, check_tools};
use super::values::{all_finite, all_positive, count, not_negative, number, positive};
use crate::llm::recorded;
use crate::llm::stage::Stage;
use crate::math::cloud::{Bounds, Point};
use crate::plan::settings::PlannerSettings;
use crate::sim::params::{COURANT_LIMIT, Params};

/// The most of anything countable: beyond it a slip of the keyboard is likelier than an intention.
const MOST: usize = 1_000_000;

/// A checked task.
#[derive(Clone, Debug)]
pub struct Scene {
    pub name: String,
    /// One line for people.
    pub description: String,
    /// One line for a language model; empty if stages never come from one.
    pub task_line: String,
    pub params: Params,
    pub dough: Dough,
    /// The tools that a plan may use; names are distinct.
    pub tools: Vec<ToolSetup>,
    pub target: Target,
    /// Score from which a run is a success.
    pub threshold: f64,
    pub planner: PlannerSettings,
}

/// Where stages and the final goal come from.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// From a language model's answer.
    Stages {
        /// The set of recorded answers to fall back on.
        recorded_answers: Option<String>,
        frame: Frame,
    },
    /// From a generator: one stage with one tool.
    Generated { tool: String, generator: Generator },
}

impl Scene {
    /// The dough's particles, evenly spread. The seed shifts their pattern.
    pub fn particles(&self, seed: u64) -> Vec<Point> {
        self.dough.fill(seed)
    }

    /// The tool of that name.
    pub fn tool(&self, name: &str) -> Option<&ToolSetup> {
        self.tools.iter().find(|t| t.tool.name == name)
    }

    /// The stages of target number `index` under `seed`, if this task's targets are generated; stages from
    /// a language model's answer come from elsewhere.
    pub fn generated_stages(&self, seed: u64, index: u64) -> Option<Vec<Stage>> {
        match &self.target {
            Target::Stages { .. } => None,
            Target::Generated { tool, generator } => {
                Some(vec![generate(generator, tool, &self.dough, seed, index)])
            }
        }
    }

    /// How clouds of this task's stages lie in the world.
    pub fn frame(&self) -> Frame {
        match self.target {
            Target::Stages { frame, .. } => frame,
            Target::Generated { .. } => Frame::WORLD,
        }
    }

    /// What a plan for this task must fit, with dough that rests at `floor_y` (m).
    pub fn world(&self, floor_y: f64) -> World<'_> {
        let tools = self.tools.iter().map(|t| t.tool.name.as_str()).collect();
        World { tools, workspace: self.params.workspace(), floor_y }
    }

    /// The dough's lowest point as the task file puts it, m.
    pub fn nominal_floor(&self) -> f64 {
        self.dough.solid.bounds(self.dough.center).min[1]
    }

    /// Judges every value of a task file.
    pub fn check(file: TaskFile) -> Result<Self, Complaint> {
        if file.name.trim().is_empty() {
            return Err(Complaint::new("name", "is empty; give the task a name"));
        }
        // Runs are called so.
        if file.name.starts_with('.')
            || file.name.contains(['/', '\\'])
            || file.name.contains(char::is_control)
        {
            let problem = format!(
                "is {:?}, which is no name for a directory; leave out dots in front and slashes",
                file.name
            );
            return Err(Complaint::new("name", problem));
        }
        let params = check_world(&file.world)?;
        let dough = check_dough(&file.dough, &params.workspace())?;
        let tools = check_tools(&file.tools)?;
        let target = check_target(&file.target, &tools, &dough)?;
        if matches!(target, Target::Stages { .. }) && file.task_line.is_none() {
            return Err(Complaint::new(
                "task_line",
                "is missing; a task with [target.stages] says there what to tell the language model",
            ));
        }
        check_planner(&file.planner)?;
        let threshold =
            number("score.threshold", file.score.threshold, |x| x > 0.0 && x <= 1.0, "in (0, 1]")?;
        Ok(Self {
            name: file.name,
            description: file.description,
            task_line: file.task_line.unwrap_or_default(),
            params,
            dough,
            tools,
            target,
            threshold,
            planner: file.planner,
        })
    }
}

fn check_world(world: &WorldTable) -> Result<Params, Complaint> {
    let params = Params {
        nodes: count("world.nodes", world.nodes, 16..=512)?,
        dt: positive("world.dt_s", world.dt_s)?,
        substeps: count("world.substeps", world.substeps, 1..=MOST)?,
        youngs_modulus: positive("world.youngs_modulus_pa", world.youngs_modulus_pa)?,
        poisson_ratio: number(
            "world.poisson_ratio",
            world.poisson_ratio,
            |x| x > 0.0 && x < 0.5,
            "between 0 and 0.5",
        )?,
        yield_stress: positive("world.yield_stress_pa", world.yield_stress_pa)?,
        gravity: all_finite("world.gravity_m_s2", world.gravity_m_s2)?,
        ground_friction: not_negative("world.ground_friction", world.ground_friction)?,
        lower_bound: number(
            "world.lower_bound_cells",
            world.lower_bound_cells,
            |x| (1.0..=3.0).contains(&x),
            "between 1 and 3",
        )?,
        softness: not_negative("world.contact_softness_per_m", world.contact_softness_per_m)?,
    };
    let courant = params.courant();
    if courant > COURANT_LIMIT {
        let allowed = params.stable_dt();
        let problem = format!(
            "is {:e}: an elastic wave ({:.1} m/s) would cross {courant:.2} grid cells in a substep, and above \
             {COURANT_LIMIT} the simulation explodes; make dt_s at most {allowed:.2e}, or lower \
             youngs_modulus_pa or nodes",
            params.dt,
            params.wave_speed()
        );
        return Err(Complaint::new("world.dt_s", problem));
    }
    Ok(params)
}

fn check_dough(dough: &DoughTable, workspace: &Bounds) -> Result<Dough, Complaint> {
    let solid = match dough.shape {
        DoughShape::Ball { radius_m } => {
            Solid::Ball { radius: positive("dough.shape.ball.radius_m", radius_m)? }
        }
        DoughShape::Box { size_m } => Solid::Box { size: all_positive("dough.shape.box.size_m", size_m)? },
        DoughShape::Disc { radius_m, height_m } => Solid::Disc {
            radius: positive("dough.shape.disc.radius_m", radius_m)?,
            height: positive("dough.shape.disc.height_m", height_m)?,
        },
    };
    let center = all_finite("dough.center_m", dough.center_m)?;
    let bounds = solid.bounds(center);
    for (a, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let [low, high] = [workspace.min[a], workspace.max[a]];
        if bounds.min[a] < low || bounds.max[a] > high {
            let problem = format!(
                "puts the dough at {axis} from {:.4} to {:.4} m, outside the workspace, {low:.4} to {high:.4} m; \
                 move or shrink it",
                bounds.min[a], bounds.max[a]
            );
            return Err(Complaint::new("dough.center_m", problem));
        }
    }
    Ok(Dough { solid, center, particles: count("dough.particles", dough.particles, 16..=MOST)? })
}

fn check_target(target: &TargetTable, tools: &[ToolSetup], dough: &Dough) -> Result<Target, Complaint> {
    match target {
        TargetTable::Stages { recorded_answers, llm_unit_m, center_xz_m } => {
            let frame = Frame {
                unit_m: positive("target.stages.llm_unit_m", *llm_unit_m)?,
                center_xz: all_finite("target.stages.center_xz_m", *center_xz_m)?,
            };
            if let Some(set) = recorded_answers
                && !recorded::sets().contains(&set.as_str())
            {
                let problem = format!(
                    "is `{set}`, and there are no such answers, only {}; leave it out",
                    recorded::sets().join(", ")
                );
                return Err(Complaint::new("target.stages.recorded_answers", problem));
            }
            Ok(Target::Stages { recorded_answers: recorded_answers.clone(), frame })
        }
        TargetTable::Generated { tool, shape } => {
            if !tools.iter().any(|t| t.tool.name == *tool) {
                let names: Vec<&str> = tools.iter().map(|t| t.tool.name.as_str()).collect();
                let problem = format!("is `{tool}`, which is no tool of this task: {}", names.join(", "));
                return Err(Complaint::new("target.generated.tool", problem));
            }
            Ok(Target::Generated { tool: tool.clone(), generator: Generator::check(shape, dough)? })
        }
    }
}

fn check_planner(planner: &PlannerSettings) -> Result<(), Complaint> {
    count("planner.emd_steps", planner.emd_steps, 1..=MOST)?;
    positive("planner.emd_step_length_m", planner.emd_step_length_m)?;
    count("planner.horizon", planner.horizon, 1..=MOST)?;
    count("planner.iterations", planner.iterations, 1..=MOST)?;
    count("planner.max_steps", planner.max_steps, planner.horizon..=MOST)?;
    positive("planner.learning_rate", planner.learning_rate)?;
    for weight in planner.loss_weights {
        not_negative("planner.loss_weights", weight)?;
    }
    count("planner.start_turns", planner.start_turns, 1..=360)?;
    positive("planner.pose_delta_m", planner.pose_delta_m)?;
    not_negative("planner.emd_tolerance_m", planner.emd_tolerance_m)?;
    number("planner.reset_below_gain", planner.reset_below_gain, |x| (0.0..=1.0).contains(&x), "in [0, 1]")?;
    count("planner.max_failures", planner.max_failures, 1..=MOST)?;
    Ok(())
}
