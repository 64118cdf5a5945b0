//! Physical and numerical parameters of the simulator, and everything derived from them, in one place.
//!
//! Comes in from a checked task file or scene file; goes out to every kernel. Imports only point clouds.
//!
//! ```text
//! dx     = 1 / nodes                               cell, m
//! mu     = E / (2 (1 + nu))                        Lame's parameters, Pa
//! lambda = E nu / ((1 + nu) (1 - 2 nu))
//! V      = (dx / 2)^2,  m = rho V                  a particle's "volume" and mass (PlasticineLab)
//! c      = sqrt((lambda + 2 mu) / rho)             speed of a pressure wave, m/s
//! C      = dt c / dx                               Courant number; stable below about 1
//! e_Y    = sigma_Y / (2 mu)                        norm of the deviatoric Hencky strain at yield
//! s      = -dt V 4 / dx^2                          from Kirchhoff stress to affine momentum (MLS-MPM, eq. 29)
//! reach  = ln(10) / softness                       how far from its surface a tool is felt, m
//! ```
//!
//! V and m cancel in the motion of free dough but for the ratio V / m = 1 / rho: gravity and stress accelerate as if
//! particles filled the volume that they stand for. So resting dough does not feel how many particles it has, as long
//! as there are some in every cell.

use serde::{Deserialize, Serialize};

use crate::math::cloud::{Bounds, Point};

/// Nodes next to each wall in which nothing moves outward, and so the cells the dough keeps clear of.
pub const WALL_NODES: usize = 3;

/// Mass per volume of the dough, kg/m^3. The reference world fixes it to 1.
pub const DENSITY: f64 = 1.0;

/// The largest [`Params::courant`] number that a task may have. At 1 an elastic wave crosses a whole cell
/// in one substep and explicit integration breaks down; the margin is for dough that is squeezed, whose
/// waves are faster.
pub const COURANT_LIMIT: f64 = 0.9;

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
    /// Edge of a grid cell, m.
    pub fn dx(&self) -> f64 {
        1.0 / self.nodes as f64
    }

    /// "Volume" of a particle: `(dx / 2)^2`. Squared in three dimensions too: that is the reference
    /// world's definition, and masses, stresses and recorded results rest on it.
    pub fn particle_volume(&self) -> f64 {
        (0.5 * self.dx()).powi(2)
    }

    /// Mass of a particle: density times [`Params::particle_volume`].
    pub fn particle_mass(&self) -> f64 {
        DENSITY * self.particle_volume()
    }

    /// First Lame parameter (shear modulus), Pa: `E / (2 (1 + nu))`.
    pub fn mu(&self) -> f64 {
        self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// Second Lame parameter, Pa: `E nu / ((1 + nu) (1 - 2 nu))`.
    pub fn lambda(&self) -> f64 {
        let nu = self.poisson_ratio;
        self.youngs_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    }

    /// Speed of a pressure wave in undeformed dough, m/s: `sqrt((lambda + 2 mu) / density)`.
    pub fn wave_speed(&self) -> f64 {
        ((self.lambda() + 2.0 * self.mu()) / DENSITY).sqrt()
    }

    /// Cells that a pressure wave crosses in one substep: `dt c / dx`. See [`COURANT_LIMIT`].
    pub fn courant(&self) -> f64 {
        self.dt * self.wave_speed() / self.dx()
    }

    /// The longest substep that keeps [`COURANT_LIMIT`], s.
    pub fn stable_dt(&self) -> f64 {
        COURANT_LIMIT * self.dx() / self.wave_speed()
    }

    /// What is wrong with the length of a substep and what helps, if the Courant number is above
    /// [`COURANT_LIMIT`].
    pub fn instability(&self) -> Option<String> {
        let courant = self.courant();
        (courant > COURANT_LIMIT).then(|| {
            format!(
                "in a substep of {:e} s an elastic wave ({:.1} m/s) would cross {courant:.2} grid cells, and above \
                 {COURANT_LIMIT} the simulation explodes; make dt at most {:.2e} s, or lower youngs_modulus or nodes",
                self.dt,
                self.wave_speed(),
                self.stable_dt()
            )
        })
    }

    /// Length of a control step, s.
    pub fn control_step(&self) -> f64 {
        self.dt * self.substeps as f64
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

    /// Lowest and highest coordinate a particle may have, in cells.
    pub fn cell_bounds(&self) -> (f64, f64) {
        (self.lower_bound, (self.nodes - WALL_NODES) as f64)
    }

    /// Lowest and highest coordinate a particle may have, m.
    pub fn position_bounds(&self) -> (f64, f64) {
        let (lo, hi) = self.cell_bounds();
        (lo * self.dx(), hi * self.dx())
    }

    /// Where dough may be: [`WALL_NODES`] cells from the walls and the ceiling. Below, it is the height to
    /// which particles are clamped, because resting dough sinks a little into the floor's nodes.
    pub fn workspace(&self) -> Bounds {
        let wall = WALL_NODES as f64 * self.dx();
        let min: Point = [wall, self.lower_bound * self.dx(), wall];
        Bounds { min, max: [1.0 - wall; 3] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn derived_numbers_of_the_default_world() {
        let p = Params::default();
        assert_eq!(p.dx(), 1.0 / 64.0);
        assert_eq!(p.particle_volume(), (1.0f64 / 128.0).powi(2));
        assert_eq!(p.particle_mass(), p.particle_volume());
        assert_relative_eq!(p.mu(), 5000.0 / 2.3);
        assert_relative_eq!(p.lambda(), 750.0 / (1.15 * 0.7));
        assert_relative_eq!(p.wave_speed(), 72.66, epsilon = 0.01);
        assert_relative_eq!(p.control_step(), 2e-3);
    }

    #[test]
    fn courant_number_passes_for_the_default_world_and_grows_with_dt_and_nodes() {
        let p = Params::default();
        assert_relative_eq!(p.courant(), 0.465, epsilon = 1e-3);
        assert!(p.courant() < COURANT_LIMIT);
        let finer = Params { nodes: 128, ..p.clone() };
        assert_relative_eq!(finer.courant(), 2.0 * p.courant());
        let slower = Params { dt: 3e-4, ..p.clone() };
        assert!(slower.courant() > COURANT_LIMIT);
        assert_eq!(p.instability(), None);
        let problem = slower.instability().unwrap();
        assert!(problem.contains("1.40 grid cells") && problem.contains("1.94e-4 s"), "{problem}");
    }

    #[test]
    fn workspace_keeps_clear_of_the_walls() {
        let w = Params::default().workspace();
        assert_eq!(w.min, [3.0 / 64.0, 1.0 / 64.0, 3.0 / 64.0]);
        assert_eq!(w.max, [1.0 - 3.0 / 64.0; 3]);
    }
}
