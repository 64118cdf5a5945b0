//! Tools: a rigid shape, how an action moves it, and what it does to a grid velocity.
//!
//! A [`Tool`] never changes; where it is stands in a [`ToolPose`].

use serde::{Deserialize, Serialize};

/// The rigid shape of a tool in its own frame. Lengths in m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Shape {
    /// Segment of `length` along local y, thickened by `radius`.
    Capsule { radius: f64, length: f64 },
    /// Box of the given half-extents.
    Box { half_extents: [f64; 3] },
    /// PASTA's knife: a triangular prism (apothem-like size, half-depth), turned by a quaternion
    /// (w, x, y, z), intersected with a box of the same frame.
    Knife { half_extents: [f64; 3], prism_size: [f64; 2], prism_rotation: [f64; 4] },
    /// Ball.
    Sphere { radius: f64 },
}

/// How an action moves a tool, and how many components it has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Motion {
    /// (roll, yaw, rise, slide).
    RollingPin,
    /// (x, y, z).
    Translation,
    /// (x, y, z, axis-angle about the world axes).
    Rigid,
    /// (x, y, z, axis-angle in the tool's frame, gap): two copies of the shape at -gap/2 and +gap/2
    /// along the tool's x axis. The gap stays in `[minimal_gap, maximal_gap]`.
    Gripper { minimal_gap: f64, maximal_gap: f64 },
}

/// One tool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tool {
    /// What a language model and a task file call it: "rolling pin", "knife", "gripper", "pole", ..
    pub name: String,
    pub shape: Shape,
    pub motion: Motion,
    /// Coulomb friction of its surface.
    pub friction: f64,
    /// Displacement (m or rad) per control step at an action of 1, per action component.
    pub action_scale: Vec<f64>,
    /// The position stays at or above this, m.
    pub lower_bound: [f64; 3],
    /// The position stays at or below this, m.
    pub upper_bound: [f64; 3],
}

/// Where a tool is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToolPose {
    /// Position of its frame's origin, m.
    pub position: [f64; 3],
    /// Orientation, quaternion (w, x, y, z); used normalised.
    pub rotation: [f64; 4],
    /// Distance between a gripper's plate centres, m; 0 for other tools.
    pub gap: f64,
}

impl Tool {
    /// Components of this tool's action.
    pub fn action_len(&self) -> usize {
        match self.motion {
            Motion::RollingPin => 4,
            Motion::Translation => 3,
            Motion::Rigid => 6,
            Motion::Gripper { .. } => 7,
        }
    }
}
