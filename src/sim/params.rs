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

/// Influence of a tool below which a grid node is left alone (PlasticineLab).
pub const CONTACT_THRESHOLD: f64 = 0.1;

impl Params {
    /// Cell size, m.
    pub fn dx(&self) -> f64 {
        1.0 / self.nodes as f64
    }

    /// Volume of a particle, `(dx/2)^2`: PlasticineLab's value, squared also in 3-D.
    pub fn particle_volume(&self) -> f64 {
        let half = 0.5 * self.dx();
        half * half
    }

    /// Mass of a particle: density 1 times its volume.
    pub fn particle_mass(&self) -> f64 {
        self.particle_volume()
    }

    /// Shear modulus, Pa.
    pub fn mu(&self) -> f64 {
        self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// First Lame parameter, Pa.
    pub fn lambda(&self) -> f64 {
        let nu = self.poisson_ratio;
        self.youngs_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    }

    /// Norm of the deviatoric Hencky strain at which the dough yields.
    pub fn yield_strain(&self) -> f64 {
        self.yield_stress / (2.0 * self.mu())
    }

    /// Distance from a tool's surface within which it acts on a grid node, m.
    pub fn contact_reach(&self) -> f64 {
        if self.softness > 0.0 { -CONTACT_THRESHOLD.ln() / self.softness } else { 0.0 }
    }

    /// Factor of the stress in the affine momentum, `-dt Vol 4/dx^2` (MLS-MPM, Hu et al. 2018, eq. 29).
    pub fn stress_factor(&self) -> f64 {
        -self.dt * self.particle_volume() * 4.0 / (self.dx() * self.dx())
    }

    /// Lowest and highest coordinate a particle may have, m.
    pub fn position_bounds(&self) -> (f64, f64) {
        (self.lower_bound * self.dx(), 1.0 - 3.0 * self.dx())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derived_numbers_of_pasta() {
        let p = Params::default();
        approx::assert_relative_eq!(p.mu(), 2173.913_043_478_261);
        approx::assert_relative_eq!(p.lambda(), 931.677_018_633_540_4, max_relative = 1e-12);
        approx::assert_relative_eq!(p.particle_volume(), 1.0 / 16384.0);
        approx::assert_relative_eq!(p.stress_factor(), -p.dt, max_relative = 1e-12);
    }
}
