//! A checked task: everything that a run needs to know, in SI units.
//!
//! A [`TaskFile`] comes in; a [`Scene`] goes out, or the first [`Complaint`] about a value. Below this
//! border nobody checks again. Imports math, sim and the planner's settings.

use super::error::Complaint;
use super::file::{
    DoughShape, DoughTable, TargetTable, TaskFile, ToolMotion, ToolShape, ToolTable, WorldTable,
};
use super::generate::{Generator, generate};
use super::shapes::Solid;
use super::subgoal::{Frame, World};
use crate::llm::stage::Stage;
use crate::math::cloud::{Bounds, Point};
use crate::plan::settings::PlannerSettings;
use crate::sim::params::{COURANT_LIMIT, Params};
use crate::sim::tool::{Motion, Shape, Tool, ToolPose};

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

/// The piece of dough that a task starts with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dough {
    pub solid: Solid,
    pub center: Point,
    /// How many particles it is made of.
    pub particles: usize,
}

/// A tool and where it waits.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolSetup {
    pub tool: Tool,
    pub rest: ToolPose,
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
        self.dough.solid.fill(self.dough.center, self.dough.particles, seed)
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

/// `value` if it is finite and `fits`; `want` completes "must be ..".
fn number(key: &str, value: f64, fits: impl Fn(f64) -> bool, want: &str) -> Result<f64, Complaint> {
    if value.is_finite() && fits(value) {
        return Ok(value);
    }
    Err(Complaint::new(key, format!("is {value}, but must be {want}")))
}

fn positive(key: &str, value: f64) -> Result<f64, Complaint> {
    number(key, value, |x| x > 0.0, "a positive number")
}

fn not_negative(key: &str, value: f64) -> Result<f64, Complaint> {
    number(key, value, |x| x >= 0.0, "a number that is not negative")
}

fn all_finite<const N: usize>(key: &str, values: [f64; N]) -> Result<[f64; N], Complaint> {
    values.iter().try_for_each(|v| number(key, *v, |_| true, "finite numbers").map(drop))?;
    Ok(values)
}

fn all_positive<const N: usize>(key: &str, values: [f64; N]) -> Result<[f64; N], Complaint> {
    values.iter().try_for_each(|v| positive(key, *v).map(drop))?;
    Ok(values)
}

fn at_least(key: &str, value: usize, least: usize) -> Result<usize, Complaint> {
    if value >= least {
        return Ok(value);
    }
    Err(Complaint::new(key, format!("is {value}, but must be at least {least}")))
}

fn unit_quaternion(key: &str, q: [f64; 4]) -> Result<[f64; 4], Complaint> {
    let length = all_finite(key, q)?.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length < 1e-6 {
        return Err(Complaint::new(key, "is zero, but must be a rotation; [1, 0, 0, 0] turns nothing"));
    }
    Ok(q)
}

/// A range `[low, high]` within the limits.
pub(super) fn range(key: &str, [low, high]: [f64; 2], limits: [f64; 2]) -> Result<[f64; 2], Complaint> {
    if low <= high && low >= limits[0] && high <= limits[1] {
        return Ok([low, high]);
    }
    let problem = format!(
        "is [{low}, {high}], but must be [low, high] with {} <= low <= high <= {}",
        limits[0], limits[1]
    );
    Err(Complaint::new(key, problem))
}

fn check_world(world: &WorldTable) -> Result<Params, Complaint> {
    let params = Params {
        nodes: at_least("world.nodes", world.nodes, 16)?,
        dt: positive("world.dt_s", world.dt_s)?,
        substeps: at_least("world.substeps", world.substeps, 1)?,
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
    if world.nodes > 512 {
        return Err(Complaint::new("world.nodes", format!("is {}, but must be at most 512", world.nodes)));
    }
    let courant = params.courant();
    if courant > COURANT_LIMIT {
        let allowed = COURANT_LIMIT * params.dx() / params.wave_speed();
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
    Ok(Dough { solid, center, particles: at_least("dough.particles", dough.particles, 16)? })
}

fn check_tools(tables: &[ToolTable]) -> Result<Vec<ToolSetup>, Complaint> {
    if tables.is_empty() {
        return Err(Complaint::new("tools", "is empty; a task needs at least one [[tools]] table"));
    }
    let mut tools: Vec<ToolSetup> = Vec::new();
    for (i, table) in tables.iter().enumerate() {
        let setup = check_tool(&format!("tools.{i}"), table)?;
        if tools.iter().any(|t| t.tool.name == setup.tool.name) {
            let problem = format!("is `{}` a second time; give each tool its own name", table.name);
            return Err(Complaint::new(format!("tools.{i}.name"), problem));
        }
        tools.push(setup);
    }
    Ok(tools)
}

fn check_tool(key: &str, table: &ToolTable) -> Result<ToolSetup, Complaint> {
    let at = |name: &str| format!("{key}.{name}");
    if table.name.trim().is_empty() {
        return Err(Complaint::new(at("name"), "is empty; give the tool a name"));
    }
    let motion = check_motion(key, &table.motion)?;
    let tool = Tool {
        name: table.name.clone(),
        shape: check_shape(key, &table.shape)?,
        motion,
        friction: not_negative(&at("friction"), table.friction)?,
        action_scale: table.action_scale.clone(),
        lower_bound: all_finite(&at("lower_bound_m"), table.lower_bound_m)?,
        upper_bound: all_finite(&at("upper_bound_m"), table.upper_bound_m)?,
    };
    for scale in &tool.action_scale {
        not_negative(&at("action_scale"), *scale)?;
    }
    if tool.action_scale.len() != tool.action_len() {
        let problem = format!(
            "has {} numbers, but this motion has {} action components",
            tool.action_scale.len(),
            tool.action_len()
        );
        return Err(Complaint::new(at("action_scale"), problem));
    }
    if (0..3).any(|a| tool.lower_bound[a] > tool.upper_bound[a]) {
        return Err(Complaint::new(at("lower_bound_m"), "is above upper_bound_m; swap them"));
    }
    let rest = check_rest(key, table, &tool)?;
    Ok(ToolSetup { tool, rest })
}

fn check_motion(key: &str, motion: &ToolMotion) -> Result<Motion, Complaint> {
    Ok(match *motion {
        ToolMotion::RollingPin => Motion::RollingPin,
        ToolMotion::Translation => Motion::Translation,
        ToolMotion::Rigid => Motion::Rigid,
        ToolMotion::Gripper { minimal_gap_m, maximal_gap_m } => {
            let minimal_gap = not_negative(&format!("{key}.motion.gripper.minimal_gap_m"), minimal_gap_m)?;
            let key = format!("{key}.motion.gripper.maximal_gap_m");
            let maximal_gap = number(&key, maximal_gap_m, |g| g >= minimal_gap, "at least minimal_gap_m")?;
            Motion::Gripper { minimal_gap, maximal_gap }
        }
    })
}

fn check_shape(key: &str, shape: &ToolShape) -> Result<Shape, Complaint> {
    let at = |name: &str| format!("{key}.shape.{name}");
    Ok(match *shape {
        ToolShape::Capsule { radius_m, length_m } => Shape::Capsule {
            radius: positive(&at("capsule.radius_m"), radius_m)?,
            length: positive(&at("capsule.length_m"), length_m)?,
        },
        ToolShape::Box { half_extents_m } => {
            Shape::Box { half_extents: all_positive(&at("box.half_extents_m"), half_extents_m)? }
        }
        ToolShape::Knife { half_extents_m, prism_size_m, prism_rotation_wxyz } => Shape::Knife {
            half_extents: all_positive(&at("knife.half_extents_m"), half_extents_m)?,
            prism_size: all_positive(&at("knife.prism_size_m"), prism_size_m)?,
            prism_rotation: unit_quaternion(&at("knife.prism_rotation_wxyz"), prism_rotation_wxyz)?,
        },
        ToolShape::Sphere { radius_m } => {
            Shape::Sphere { radius: positive(&at("sphere.radius_m"), radius_m)? }
        }
    })
}

fn check_rest(key: &str, table: &ToolTable, tool: &Tool) -> Result<ToolPose, Complaint> {
    let at = |name: &str| format!("{key}.rest.{name}");
    let position = all_finite(&at("position_m"), table.rest.position_m)?;
    if (0..3).any(|a| position[a] < tool.lower_bound[a] || position[a] > tool.upper_bound[a]) {
        return Err(Complaint::new(
            at("position_m"),
            "is outside the tool's own bounds; move it or widen them",
        ));
    }
    let gap = match (&tool.motion, table.rest.gap_m) {
        (Motion::Gripper { minimal_gap, maximal_gap }, Some(gap)) => {
            let want = format!("between {minimal_gap} and {maximal_gap}, the gripper's limits");
            number(&at("gap_m"), gap, |g| g >= *minimal_gap && g <= *maximal_gap, &want)?
        }
        (Motion::Gripper { .. }, None) => {
            return Err(Complaint::new(at("gap_m"), "is missing; a gripper needs one"));
        }
        (_, Some(_)) => return Err(Complaint::new(at("gap_m"), "is only for a gripper; remove it")),
        (_, None) => 0.0,
    };
    let rotation = unit_quaternion(&at("rotation_wxyz"), table.rest.rotation_wxyz)?;
    Ok(ToolPose { position, rotation, gap })
}

fn check_target(target: &TargetTable, tools: &[ToolSetup], dough: &Dough) -> Result<Target, Complaint> {
    match target {
        TargetTable::Stages { recorded_answers, llm_unit_m, center_xz_m } => {
            let frame = Frame {
                unit_m: positive("target.stages.llm_unit_m", *llm_unit_m)?,
                center_xz: all_finite("target.stages.center_xz_m", *center_xz_m)?,
            };
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
    at_least("planner.emd_steps", planner.emd_steps, 1)?;
    positive("planner.emd_step_length_m", planner.emd_step_length_m)?;
    at_least("planner.horizon", planner.horizon, 1)?;
    at_least("planner.iterations", planner.iterations, 1)?;
    at_least("planner.max_steps", planner.max_steps, planner.horizon)?;
    positive("planner.learning_rate", planner.learning_rate)?;
    for weight in planner.loss_weights {
        not_negative("planner.loss_weights", weight)?;
    }
    positive("planner.pose_delta_m", planner.pose_delta_m)?;
    not_negative("planner.emd_tolerance_m", planner.emd_tolerance_m)?;
    at_least("planner.max_failures", planner.max_failures, 1)?;
    Ok(())
}
