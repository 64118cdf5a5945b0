//! A tool at a pose: how far points are from its surface, for one pose and many points.
//!
//! A tool and its pose come in, signed distances and normals go out. Imports tools.

use nalgebra::Vector3;

use super::{Frame, Tool, ToolPose};
use crate::math::cloud::Point;

/// A tool that stands somewhere.
pub struct PlacedTool<'a> {
    tool: &'a Tool,
    /// Its parts' sides and frames.
    parts: Vec<(f64, Frame)>,
}

impl Tool {
    /// This tool at `pose`.
    pub fn at(&self, pose: &ToolPose) -> PlacedTool<'_> {
        let parts = self.sides().iter().map(|&side| (side, self.frame(pose, side))).collect();
        PlacedTool { tool: self, parts }
    }
}

impl PlacedTool<'_> {
    /// Signed distance from `point` to the tool's surface (negative inside), m.
    pub fn distance(&self, point: Point) -> f64 {
        self.nearest_part(point).2
    }

    /// [`PlacedTool::distance`] and its gradient: the direction in which the tool pushes what is at `point`.
    pub fn distance_and_outward(&self, point: Point) -> (f64, Point) {
        let (_, frame, distance) = self.nearest_part(point);
        let local = frame.to_local(point.into());
        (distance, (frame.rotation * self.tool.shape.gradient(local)).into())
    }

    /// The part whose surface is nearest: its side and frame, and the signed distance to it.
    pub(super) fn nearest_part(&self, point: Point) -> (f64, &Frame, f64) {
        let p = Vector3::from(point);
        let (side, frame) = &self.parts[0];
        let mut best = (*side, frame, self.tool.shape.distance(frame.to_local(p)));
        for (side, frame) in &self.parts[1..] {
            let d = self.tool.shape.distance(frame.to_local(p));
            if d < best.2 {
                best = (*side, frame, d);
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::check::{Tolerance, directional};
    use crate::math::rng::{normal, seeded};
    use crate::sim::{Motion, Shape};

    #[test]
    fn outward_is_the_gradient_of_the_distance_to_the_nearest_plate() {
        let tool = Tool {
            name: "gripper".into(),
            shape: Shape::Box { half_extents: [0.015, 0.1, 0.06] },
            motion: Motion::Gripper { minimal_gap: 0.0, maximal_gap: 1.0 },
            friction: 10.0,
            action_scale: vec![0.015; 7],
            lower_bound: [0.0; 3],
            upper_bound: [1.0; 3],
        };
        let pose = ToolPose { position: [0.5; 3], rotation: [1.0, 0.1, -0.2, 0.3], gap: 0.2 };
        let placed = tool.at(&pose);
        let mut rng = seeded(4, "placed");
        for _ in 0..50 {
            let p: Vec<f64> = (0..3).map(|_| 0.5 + 0.15 * normal(&mut rng)).collect();
            let point = |p: &[f64]| [p[0], p[1], p[2]];
            let least = tool.sides().iter().map(|&side| {
                let frame = tool.frame(&pose, side);
                tool.shape.distance(frame.to_local(point(&p).into()))
            });
            assert_eq!(placed.distance(point(&p)), least.fold(f64::INFINITY, f64::min));
            directional(
                &mut rng,
                &p,
                |p| vec![placed.distance(point(p))],
                |p, y| placed.distance_and_outward(point(p)).1.map(|g| g * y[0]).to_vec(),
                Tolerance { relative: 1e-5, absolute: 1e-8 },
            );
        }
    }
}
