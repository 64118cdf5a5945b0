//! The tools of a task, and the checks of `[[tools]]` tables.
//!
//! Tables as written come in; tools of the simulator with their rest poses go out, or the first complaint.
//! Imports sim's tools and this module's file types.

use super::error::Complaint;
use super::file::{ToolMotion, ToolShape, ToolTable};
use super::values::{all_finite, all_positive, not_negative, number, positive, quaternion};
use crate::sim::tool::{Motion, Shape, Tool, ToolPose};

/// A tool and where it waits.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolSetup {
    pub tool: Tool,
    pub rest: ToolPose,
}

/// Judges all `[[tools]]` tables.
pub fn check_tools(tables: &[ToolTable]) -> Result<Vec<ToolSetup>, Complaint> {
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
            prism_rotation: quaternion(&at("knife.prism_rotation_wxyz"), prism_rotation_wxyz)?,
        },
        ToolShape::Sphere { radius_m } => {
            Shape::Sphere { radius: positive(&at("sphere.radius_m"), radius_m)? }
        }
        ToolShape::Cylinder { radius_m, length_m } => Shape::Cylinder {
            radius: positive(&at("cylinder.radius_m"), radius_m)?,
            length: positive(&at("cylinder.length_m"), length_m)?,
        },
        ToolShape::Torus { radius_m, tube_radius_m } => Shape::Torus {
            radius: positive(&at("torus.radius_m"), radius_m)?,
            tube_radius: positive(&at("torus.tube_radius_m"), tube_radius_m)?,
        },
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
    let rotation = quaternion(&at("rotation_wxyz"), table.rest.rotation_wxyz)?;
    Ok(ToolPose { position, rotation, gap })
}
