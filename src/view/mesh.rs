//! Triangle meshes of tools, for the picture renderer and for the report's viewer alike.
//!
//! A tool's shape comes in, triangles in its own frame go out; poses turn them into bodies in the world.
//! Imports `sim`'s tool types.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::sim::tool::{Motion, Shape, Tool, ToolPose};

type V = Vector3<f64>;

/// A triangle mesh: one normal per vertex, corners shared only where the surface is smooth. Lengths in m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

/// Segments around a round shape.
const AROUND: u32 = 40;
/// Rings of a hemisphere, the pole included.
const RINGS: u32 = 10;

impl Mesh {
    /// The surface of a shape in its own frame.
    pub fn of(shape: &Shape) -> Self {
        match *shape {
            Shape::Capsule { radius, length } => capsule(radius, length),
            Shape::Sphere { radius } => capsule(radius, 0.0),
            Shape::Box { half_extents } => convex(&box_planes(half_extents)),
            Shape::Knife { half_extents, prism_size, prism_rotation } => {
                let mut planes = box_planes(half_extents);
                planes.extend(prism_planes(prism_size, rotation(prism_rotation)));
                convex(&planes)
            }
        }
    }

    /// The mesh moved into the world.
    pub fn moved(&self, to_world: &Isometry3<f64>) -> Self {
        let turn = |v: &[f32; 3]| to_world.rotation * V::from(v.map(f64::from));
        let single = |v: V| [v.x as f32, v.y as f32, v.z as f32];
        Self {
            positions: self.positions.iter().map(|p| single(turn(p) + to_world.translation.vector)).collect(),
            normals: self.normals.iter().map(|n| single(turn(n))).collect(),
            triangles: self.triangles.clone(),
        }
    }

    fn vertex(&mut self, position: V, normal: V) -> u32 {
        self.positions.push([position.x as f32, position.y as f32, position.z as f32]);
        self.normals.push([normal.x as f32, normal.y as f32, normal.z as f32]);
        self.positions.len() as u32 - 1
    }
}

/// Where the copies of a tool's shape are: one, or a gripper's two plates at -gap/2 and +gap/2 along its x.
pub fn bodies(tool: &Tool, pose: &ToolPose) -> Vec<Isometry3<f64>> {
    let turn = rotation(pose.rotation);
    let at =
        |x: f64| Isometry3::from_parts(Translation3::from(V::from(pose.position) + turn * V::x() * x), turn);
    match tool.motion {
        Motion::Gripper { .. } => vec![at(-0.5 * pose.gap), at(0.5 * pose.gap)],
        _ => vec![at(0.0)],
    }
}

fn rotation([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// A capsule around the y axis from -length/2 to length/2.
fn capsule(radius: f64, length: f64) -> Mesh {
    let mut mesh = Mesh::default();
    // Rings from the top pole to the bottom pole; the equator twice, once at each end of the axis.
    let polar = |ring: u32| std::f64::consts::FRAC_PI_2 * f64::from(ring) / f64::from(RINGS);
    let rings: Vec<(f64, f64)> = (0..=RINGS)
        .map(|r| (polar(r), 0.5 * length))
        .chain((0..=RINGS).map(|r| (std::f64::consts::FRAC_PI_2 + polar(r), -0.5 * length)))
        .collect();
    for &(angle, offset) in &rings {
        for k in 0..AROUND {
            let turn = std::f64::consts::TAU * f64::from(k) / f64::from(AROUND);
            let normal = V::new(angle.sin() * turn.cos(), angle.cos(), angle.sin() * turn.sin());
            mesh.vertex(radius * normal + V::y() * offset, normal);
        }
    }
    for ring in 0..rings.len() as u32 - 1 {
        for k in 0..AROUND {
            let next = (k + 1) % AROUND;
            let (a, b) = (ring * AROUND + k, ring * AROUND + next);
            mesh.triangles.extend([[a, b, a + AROUND], [b, b + AROUND, a + AROUND]]);
        }
    }
    mesh
}

/// A half-space: the points p with n . p <= d.
type Plane = (V, f64);

fn box_planes(half_extents: [f64; 3]) -> Vec<Plane> {
    (0..3).flat_map(|a| [1.0, -1.0].map(|s| (V::ith(a, s), half_extents[a]))).collect()
}

/// PASTA's triangular prism, the half-spaces of its signed distance.
fn prism_planes([size, half_depth]: [f64; 2], turn: UnitQuaternion<f64>) -> Vec<Plane> {
    let half_root_3 = 0.866_025;
    [
        (V::z(), half_depth),
        (-V::z(), half_depth),
        (V::new(half_root_3, 0.5, 0.0), 0.5 * size),
        (V::new(-half_root_3, 0.5, 0.0), 0.5 * size),
        (-V::y(), 0.5 * size),
    ]
    .map(|(n, d)| (turn * n, d))
    .to_vec()
}

/// The polyhedron that is common to all half-spaces: each plane's face is a large square cut by all others.
fn convex(planes: &[Plane]) -> Mesh {
    let mut mesh = Mesh::default();
    for (i, &(normal, d)) in planes.iter().enumerate() {
        let u = normal.cross(&if normal.x.abs() < 0.9 { V::x() } else { V::y() }).normalize();
        let v = normal.cross(&u);
        let mut face: Vec<V> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(a, b)| normal * d + u * a + v * b)
            .to_vec();
        for (j, plane) in planes.iter().enumerate() {
            if j != i {
                face = cut(&face, plane);
            }
        }
        if face.len() >= 3 {
            let corners: Vec<u32> = face.iter().map(|&p| mesh.vertex(p, normal)).collect();
            mesh.triangles.extend(corners.windows(2).skip(1).map(|w| [corners[0], w[0], w[1]]));
        }
    }
    mesh
}

/// The part of a convex polygon inside a half-space (Sutherland and Hodgman).
fn cut(polygon: &[V], &(normal, d): &Plane) -> Vec<V> {
    let mut kept = Vec::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (out_a, out_b) = (normal.dot(&a) - d, normal.dot(&b) - d);
        if out_a <= 0.0 {
            kept.push(a);
        }
        if (out_a < 0.0 && out_b > 0.0) || (out_a > 0.0 && out_b < 0.0) {
            kept.push(a + (b - a) * (out_a / (out_a - out_b)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::cloud::Bounds;

    fn bounds(shape: Shape) -> Bounds {
        let points: Vec<_> = Mesh::of(&shape).positions.iter().map(|p| p.map(f64::from)).collect();
        Bounds::of(&points).unwrap()
    }

    #[test]
    fn meshes_have_the_size_of_their_shapes() {
        let capsule = bounds(Shape::Capsule { radius: 0.03, length: 0.3 }).size();
        for (found, expected) in capsule.into_iter().zip([0.06, 0.36, 0.06]) {
            assert!((found - expected).abs() < 1e-6, "{capsule:?}");
        }
        let cuboid = bounds(Shape::Box { half_extents: [0.1, 0.2, 0.3] }).size();
        for (found, expected) in cuboid.into_iter().zip([0.2, 0.4, 0.6]) {
            assert!((found - expected).abs() < 1e-6, "{cuboid:?}");
        }
    }

    #[test]
    fn the_knife_is_a_wedge_inside_its_box() {
        let knife = Shape::Knife {
            half_extents: [0.025, 0.2, 0.06],
            prism_size: [0.15, 0.15],
            prism_rotation: [1.0, 0.0, 0.0, 0.58],
        };
        let mesh = Mesh::of(&knife);
        assert!(mesh.triangles.len() > 8, "more faces than a box cut once");
        for p in &mesh.positions {
            assert!(p[0].abs() <= 0.025 + 1e-6 && p[1].abs() <= 0.2 + 1e-6 && p[2].abs() <= 0.06 + 1e-6);
        }
    }

    #[test]
    fn a_gripper_has_two_bodies_a_gap_apart() {
        let tool = Tool {
            name: "gripper".into(),
            shape: Shape::Box { half_extents: [0.015, 0.1, 0.06] },
            motion: Motion::Gripper { minimal_gap: 0.08, maximal_gap: 0.2 },
            friction: 10.0,
            action_scale: vec![0.015; 7],
            lower_bound: [0.0; 3],
            upper_bound: [1.0; 3],
        };
        let h = std::f64::consts::FRAC_1_SQRT_2;
        let pose = ToolPose { position: [0.5; 3], rotation: [h, 0.0, h, 0.0], gap: 0.18 };
        let [a, b] = bodies(&tool, &pose)[..] else { panic!("two plates") };
        let apart = b.translation.vector - a.translation.vector;
        assert!((apart - V::new(0.0, 0.0, -0.18)).norm() < 1e-9, "{apart}");
    }
}
