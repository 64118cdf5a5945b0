//! Physical and numerical parameters of the simulator, and everything derived from them, in one place.
//!
//! Comes in from a checked task file or scene file; goes out to every kernel. Imports nothing.

use serde::{Deserialize, Serialize};

/// Parameters of one simulated world: the unit cube, y up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Params {
    /// Grid nodes per axis; the cell size is `1 / nodes`.
    pub nodes: usize,
    /// Length of one substep, s.
    pub dt: f64,
    /// Substeps per control step.
    pub substeps: usize,
    /// Young's modulus E, Pa.
    pub youngs_modulus: f64,
    /// Poisson's ratio nu.
    pub poisson_ratio: f64,
    /// von Mises yield stress, Pa.
    pub yield_stress: f64,
    /// Acceleration that the grid really applies, m/s^2.
    pub gravity: [f64; 3],
    /// Friction of the floor: 0 slips, >= 10 sticks.
    pub ground_friction: f64,
    /// Particles are clamped to at least this many cells from the lower walls.
    pub lower_bound: f64,
    /// Softness of tool contact, 1/m; 0 is hard contact.
    pub softness: f64,
}

impl Default for Params {
    /// PASTA's CutRearrange world.
    fn default() -> Self {
        Self {
            nodes: 64,
            dt: 1e-4,
            substeps: 20,
            youngs_modulus: 5000.0,
            poisson_ratio: 0.15,
            yield_stress: 150.0,
            gravity: [0.0, -300.0, 0.0],
            ground_friction: 0.5,
            lower_bound: 1.0,
            softness: 666.0,
        }
    }
}
