//! What a command line may change in a task: sizes for a quick look or a closer one.
//!
//! Numbers come in and go into a checked [`Scene`]. Imports scenes.

use std::fmt;

use serde::Serialize;

use super::scene::Scene;

/// Numbers that stand in for those of a task file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Overrides {
    pub particles: Option<usize>,
    /// J of Algorithm 1.
    pub iterations: Option<usize>,
    /// Control steps that a stage may take.
    pub max_steps: Option<usize>,
}

impl Overrides {
    /// Puts them into the scene.
    pub fn apply(&self, scene: &mut Scene) {
        if let Some(particles) = self.particles {
            scene.dough.particles = particles;
        }
        if let Some(iterations) = self.iterations {
            scene.planner.iterations = iterations;
        }
        if let Some(max_steps) = self.max_steps {
            scene.planner.max_steps = max_steps;
            scene.planner.horizon = scene.planner.horizon.min(max_steps);
        }
    }
}

impl fmt::Display for Overrides {
    /// As flags of a command line, each with a space before it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let flags =
            [("particles", self.particles), ("iterations", self.iterations), ("max-steps", self.max_steps)];
        flags.into_iter().try_for_each(|(name, value)| value.map_or(Ok(()), |v| write!(f, " --{name} {v}")))
    }
}
