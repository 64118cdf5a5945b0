//! The shapes a tool may have: signed distance, its gradient, and the normal that contact uses.
//!
//! A point in the shape's own frame comes in. Distances are PlasticineLab's; box and knife normals are its
//! central differences, so that results agree with it; all other normals are exact. Imports the shapes' own files.
//!
//! A signed distance d(p) is the distance to the surface, negative inside; its gradient has length 1 and points
//! outward. Formulas stand in each shape's file. Every length is softened, `|u| = sqrt(u . u + 1e-14)`, so that it
//! can be differentiated at 0, and so
//!
//! ```text
//! n = u / |u|:     u_adj = n_adj / |u| - u (u . n_adj) / |u|^3
//! ```
//!
//! The central difference of step h = 1e-4 m, `g_a = (d(p + h e_a) - d(p - h e_a)) / 2h`, rounds edges off over 2h.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{capsule, cuboid, cylinder, knife, sphere, torus};

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
    /// Cylinder of `length` along local y with flat ends.
    Cylinder { radius: f64, length: f64 },
    /// Ring of `radius` around local y, thickened by `tube_radius`.
    Torus { radius: f64, tube_radius: f64 },
}

/// Added under every root of a length, so that its derivative exists at zero.
const LENGTH_EPS: f64 = 1e-14;

/// Step of the numerical normals: 1e-4 rounded to f32, as PlasticineLab has it.
const NORMAL_STEP: f64 = 9.999_999_747_378_75e-5;

/// `sqrt(u.u + 1e-14)`.
pub(super) fn length(u: Vector3<f64>) -> f64 {
    (u.norm_squared() + LENGTH_EPS).sqrt()
}

/// Adjoint of `u / length(u)`.
pub(super) fn direction_adj(u: Vector3<f64>, n_adj: Vector3<f64>) -> Vector3<f64> {
    let len = length(u);
    n_adj / len - u * (u.dot(&n_adj) / (len * len * len))
}

impl Shape {
    /// Signed distance from `p` to the surface, negative inside.
    pub fn distance(&self, p: Vector3<f64>) -> f64 {
        match self {
            Self::Capsule { radius, length } => capsule::distance(*radius, *length, p),
            Self::Box { half_extents } => cuboid::distance(half_extents, p),
            Self::Knife { half_extents, prism_size, prism_rotation } => {
                knife::distance(half_extents, prism_size, *prism_rotation, p)
            }
            Self::Sphere { radius } => sphere::distance(*radius, p),
            Self::Cylinder { radius, length } => cylinder::distance(*radius, *length, p),
            Self::Torus { radius, tube_radius } => torus::distance(*radius, *tube_radius, p),
        }
    }

    /// Gradient of [`Shape::distance`]. On an edge, where it jumps, the gradient of one side.
    pub fn gradient(&self, p: Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Capsule { length, .. } => capsule::gradient(*length, p),
            Self::Box { half_extents } => cuboid::gradient(half_extents, p),
            Self::Knife { half_extents, prism_size, prism_rotation } => {
                knife::gradient(half_extents, prism_size, *prism_rotation, p)
            }
            Self::Sphere { .. } => sphere::gradient(p),
            Self::Cylinder { radius, length } => cylinder::gradient(*radius, *length, p),
            Self::Torus { radius, .. } => torus::gradient(*radius, p),
        }
    }

    /// Outward normal at `p`.
    pub fn normal(&self, p: Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Capsule { .. } | Self::Sphere { .. } | Self::Cylinder { .. } | Self::Torus { .. } => {
                self.gradient(p)
            }
            Self::Box { .. } | Self::Knife { .. } => {
                let g = self.central_difference(p);
                g / length(g)
            }
        }
    }

    /// Adjoint of [`Shape::normal`].
    pub fn normal_adj(&self, p: Vector3<f64>, n_adj: Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Capsule { length, .. } => capsule::gradient_adj(*length, p, n_adj),
            Self::Sphere { .. } => sphere::gradient_adj(p, n_adj),
            Self::Cylinder { radius, length } => cylinder::gradient_adj(*radius, *length, p, n_adj),
            Self::Torus { radius, .. } => torus::gradient_adj(*radius, p, n_adj),
            Self::Box { .. } | Self::Knife { .. } => {
                let g_adj = direction_adj(self.central_difference(p), n_adj);
                let mut p_adj = Vector3::zeros();
                for a in 0..3 {
                    let step = Vector3::ith(a, NORMAL_STEP);
                    let scale = g_adj[a] / (2.0 * NORMAL_STEP);
                    p_adj += (self.gradient(p + step) - self.gradient(p - step)) * scale;
                }
                p_adj
            }
        }
    }

    fn central_difference(&self, p: Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|a, _| {
            let step = Vector3::ith(a, NORMAL_STEP);
            (self.distance(p + step) - self.distance(p - step)) / (2.0 * NORMAL_STEP)
        })
    }

    /// Half the edge lengths of a box around the shape in its own frame.
    pub fn half_extents(&self) -> [f64; 3] {
        match self {
            Self::Capsule { radius, length } => [*radius, 0.5 * length + radius, *radius],
            Self::Box { half_extents } | Self::Knife { half_extents, .. } => *half_extents,
            Self::Sphere { radius } => [*radius; 3],
            Self::Cylinder { radius, length } => [*radius, 0.5 * length, *radius],
            Self::Torus { radius, tube_radius } => [radius + tube_radius, *tube_radius, radius + tube_radius],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::check::{Tolerance, directional};
    use crate::math::rng::{normal, seeded};

    fn shapes() -> Vec<Shape> {
        let half_extents = [0.025, 0.2, 0.06];
        vec![
            Shape::Capsule { radius: 0.03, length: 0.15 },
            Shape::Box { half_extents },
            Shape::Knife { half_extents, prism_size: [0.15, 0.15], prism_rotation: [1.0, 0.0, 0.0, 0.58] },
            Shape::Sphere { radius: 0.05 },
            Shape::Cylinder { radius: 0.05, length: 0.12 },
            Shape::Torus { radius: 0.08, tube_radius: 0.02 },
        ]
    }

    #[test]
    fn gradients_and_normal_adjoints_agree_with_finite_differences() {
        let mut rng = seeded(1, "shapes");
        let v3 = |x: &[f64]| Vector3::new(x[0], x[1], x[2]);
        for shape in shapes() {
            for _ in 0..40 {
                let p: Vec<f64> = (0..3).map(|_| 0.1 * normal(&mut rng)).collect();
                let tolerance = Tolerance { relative: 1e-5, absolute: 1e-8 };
                directional(
                    &mut rng,
                    &p,
                    |p| vec![shape.distance(v3(p))],
                    |p, y| (shape.gradient(v3(p)) * y[0]).as_slice().to_vec(),
                    tolerance,
                );
                directional(
                    &mut rng,
                    &p,
                    |p| shape.normal(v3(p)).as_slice().to_vec(),
                    |p, y| shape.normal_adj(v3(p), v3(y)).as_slice().to_vec(),
                    Tolerance { relative: 1e-4, absolute: 1e-5 },
                );
            }
        }
    }

    #[test]
    fn distances_of_the_round_primitives_at_points_that_can_be_checked_by_hand() {
        let at = |shape: &Shape, p: [f64; 3]| shape.distance(p.into());
        let cylinder = Shape::Cylinder { radius: 0.05, length: 0.12 };
        for (p, expected) in [
            ([0.07, 0.0, 0.0], 0.02),
            ([0.0, -0.09, 0.0], 0.03),
            ([0.0, 0.10, 0.08], 0.05),
            ([0.0, 0.05, 0.0], -0.01),
            ([0.0, 0.0, 0.0], -0.05),
        ] {
            assert!((at(&cylinder, p) - expected).abs() < 2e-7, "cylinder at {p:?}");
        }
        let torus = Shape::Torus { radius: 0.08, tube_radius: 0.02 };
        for (p, expected) in [
            ([0.0, 0.0, 0.13], 0.03),
            ([0.08, 0.0, 0.0], -0.02),
            ([0.0, 0.0, 0.0], 0.06),
            ([-0.08, 0.05, 0.0], 0.03),
            ([0.11, 0.04, 0.0], 0.03),
        ] {
            assert!((at(&torus, p) - expected).abs() < 2e-7, "torus at {p:?}");
        }
    }

    #[test]
    fn exact_normals_have_unit_length_and_are_finite_at_the_awkward_points() {
        for shape in shapes() {
            let half = shape.half_extents();
            for p in [[0.0; 3], [half[0], half[1], 0.0], [0.0, half[1], 0.0], [0.0, 0.0, half[2]]] {
                let n = shape.normal(p.into());
                let adj = shape.normal_adj(p.into(), Vector3::new(1.0, -0.5, 0.3));
                assert!(n.norm() < 1.0 + 1e-9 && adj.iter().all(|v| v.is_finite()), "{shape:?} at {p:?}");
            }
        }
        let mut rng = seeded(2, "unit normals");
        for shape in
            [Shape::Cylinder { radius: 0.05, length: 0.12 }, Shape::Torus { radius: 0.08, tube_radius: 0.02 }]
        {
            for _ in 0..100 {
                let n = shape.normal(Vector3::from_fn(|_, _| 0.1 * normal(&mut rng)));
                assert!((n.norm() - 1.0).abs() < 1e-6, "{shape:?}: {n}");
            }
        }
    }
}
