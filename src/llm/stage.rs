//! A stage of a plan as the language model stated it, with the clouds that its code built.
//!
//! Made by parsing an answer and running its code; consumed by `task`, which turns it into subgoals.

use std::collections::BTreeMap;

use crate::math::cloud::Point;
use crate::math::volume::measure_volume;

/// A named point cloud in the language model's own coordinates and units.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCloud {
    /// The variable's name in the answer.
    pub name: String,
    /// Its points, exactly as the code built them.
    pub points: Vec<Point>,
}

impl NamedCloud {
    /// The volume that the points fill, in the cloud's own unit cubed, to within about 10 %; see
    /// [`measure_volume`]. Of points that only cover a surface it means nothing.
    pub fn measured_volume(&self) -> f64 {
        measure_volume(&self.points)
    }
}

/// One step of the answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// The step's number as the answer gives it (0 is the given dough, if the answer builds it).
    pub step: u32,
    /// The one-line explanation.
    pub title: String,
    /// Canonical tool name ("rolling pin", "knife", "gripper", "pole"), or `None` for step 0.
    pub tool: Option<String>,
    /// Names of the pieces that go in.
    pub inputs: Vec<String>,
    /// The pieces that come out, in the order the answer names them.
    pub outputs: Vec<NamedCloud>,
    /// Locations as stated, by name.
    pub stated_location: BTreeMap<String, Point>,
    /// Volumes as stated, by name.
    pub stated_volume: BTreeMap<String, f64>,
    /// The Python code of the step.
    pub code: String,
}
