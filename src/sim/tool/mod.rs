//! Tools: a rigid shape, how an action moves it, and what it does to a grid velocity.
//!
//! A [`Tool`] never changes; where it is stands in a [`ToolPose`]. Shapes and motions have a file each.
//! Imports math.
//!
//! With pose (position p, unit quaternion q, gap g) and R the rotation of q, a rigid part at side `s` (0; for a gripper's
//! two plates -1/2 and 1/2) has the frame
//!
//! ```text
//! origin  o = p + s g R e_x
//! local   l(x) = R^T (x - o)              a world point in the part's coordinates
//! d(x)    = shape.distance(l),  N(x) = R shape.normal(l)
//! ```
//!
//! and carries the point x during a substep to `o' + R' l(x)`, with o', R' from the pose at its end: this is
//! how contact knows the velocity of the tool's surface (PlasticineLab).

mod capsule;
mod cuboid;
mod cylinder;
mod knife;
pub mod motion;
pub mod path;
mod placed;
pub mod shape;
mod sphere;
mod torus;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::math::cloud::Point;
use crate::math::quaternion::{rotation_matrix, rotation_matrix_adj, turning_matrix, turning_matrix_adj};

pub use motion::Motion;
pub use placed::PlacedTool;
pub use shape::Shape;

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

/// Adjoint of a [`ToolPose`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseAdj {
    pub position: [f64; 3],
    pub rotation: [f64; 4],
    pub gap: f64,
}

impl PoseAdj {
    /// Adds `other`.
    pub fn add(&mut self, other: &Self) {
        self.position.iter_mut().zip(other.position).for_each(|(a, b)| *a += b);
        self.rotation.iter_mut().zip(other.rotation).for_each(|(a, b)| *a += b);
        self.gap += other.gap;
    }
}

/// Where one rigid part of a tool is: its frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Origin, m.
    pub origin: Vector3<f64>,
    /// Columns are the part's axes in the world; a rotation.
    pub rotation: Matrix3<f64>,
    /// What turns normals and plate offsets: equal to `rotation` where the pose's quaternion has unit
    /// length, see [`turning_matrix`].
    pub turning: Matrix3<f64>,
}

impl Frame {
    /// A world point in the frame's coordinates.
    pub fn to_local(&self, p: Vector3<f64>) -> Vector3<f64> {
        self.rotation.tr_mul(&(p - self.origin))
    }
}

/// Adjoint of a [`Frame`].
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameAdj {
    pub origin: Vector3<f64>,
    pub rotation: Matrix3<f64>,
    pub turning: Matrix3<f64>,
}

impl Tool {
    /// Components of this tool's action.
    pub fn action_len(&self) -> usize {
        self.motion.action_len()
    }

    /// The sides on which its parts stand: a gripper has a plate at -gap/2 and one at +gap/2 along its
    /// x axis, in this order; every other tool is one part.
    pub fn sides(&self) -> &'static [f64] {
        match self.motion {
            Motion::Gripper { .. } => &[-0.5, 0.5],
            _ => &[0.0],
        }
    }

    /// The frame of the part at `side` when the tool is at `pose`.
    pub fn frame(&self, pose: &ToolPose, side: f64) -> Frame {
        let turning = turning_matrix(pose.rotation);
        let origin = Vector3::from(pose.position) + turning.column(0) * (side * pose.gap);
        Frame { origin, rotation: rotation_matrix(pose.rotation), turning }
    }

    /// Adjoint of [`Tool::frame`], added into `pose_adj`.
    pub fn frame_adj(&self, pose: &ToolPose, side: f64, frame_adj: &FrameAdj, pose_adj: &mut PoseAdj) {
        let mut turning_adj = frame_adj.turning;
        let mut x_axis = turning_adj.column_mut(0);
        x_axis += frame_adj.origin * (side * pose.gap);
        pose_adj.add(&PoseAdj {
            position: frame_adj.origin.into(),
            rotation: rotation_matrix_adj(pose.rotation, &frame_adj.rotation),
            gap: side * frame_adj.origin.dot(&turning_matrix(pose.rotation).column(0)),
        });
        let rotation = turning_matrix_adj(pose.rotation, &turning_adj);
        pose_adj.add(&PoseAdj { rotation, ..PoseAdj::default() });
    }

    /// Signed distance from `point` to the tool's surface (negative inside), m.
    pub fn distance(&self, pose: &ToolPose, point: Point) -> f64 {
        self.at(pose).distance(point)
    }

    /// Adjoint of [`Tool::distance`] with respect to the pose, and the gradient with respect to the point.
    pub fn distance_adj(
        &self,
        pose: &ToolPose,
        point: Point,
        distance_adj: f64,
        pose_adj: &mut PoseAdj,
    ) -> Point {
        let placed = self.at(pose);
        let (side, frame, _) = placed.nearest_part(point);
        let offset = Vector3::from(point) - frame.origin;
        let local_adj = self.shape.gradient(frame.to_local(point.into())) * distance_adj;
        let point_adj = frame.rotation * local_adj;
        let rotation = offset * local_adj.transpose();
        let frame_adj = FrameAdj { origin: -point_adj, rotation, ..FrameAdj::default() };
        self.frame_adj(pose, side, &frame_adj, pose_adj);
        point_adj.into()
    }

    /// The world box around the tool, as (min, max), m.
    pub fn bounds(&self, pose: &ToolPose) -> (Point, Point) {
        let half = self.shape.half_extents();
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &side in self.sides() {
            let frame = self.frame(pose, side);
            for a in 0..3 {
                let reach: f64 = (0..3).map(|k| frame.rotation[(a, k)].abs() * half[k]).sum();
                min[a] = min[a].min(frame.origin[a] - reach);
                max[a] = max[a].max(frame.origin[a] + reach);
            }
        }
        (min, max)
    }
}
