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
/// Rings of a quarter of a circle.
const RINGS: u32 = 10;

impl Mesh {
    /// The surface of a shape in its own frame.
    pub fn of(shape: &Shape) -> Self {
        match *shape {
            Shape::Capsule { radius, length } => capsule(radius, length),
            Shape::Sphere { radius } => capsule(radius, 0.0),
            Shape::Cylinder { radius, length } => cylinder(radius, length),
            Shape::Torus { radius, tube_radius } => torus(radius, tube_radius),
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

/// A point of a round surface's outline: distance from the y axis and height, and the normal's two parts.
type Outline = (f64, f64, f64, f64);

/// An arc of a circle of `radius` around (`from_axis`, `height`), angles from straight up towards outside.
fn arc(radius: f64, from_axis: f64, height: f64, from: f64, to: f64, steps: u32) -> Vec<Outline> {
    (0..=steps)
        .map(|k| {
            let (sin, cos) = (from + (to - from) * f64::from(k) / f64::from(steps)).sin_cos();
            (from_axis + radius * sin, height + radius * cos, sin, cos)
        })
        .collect()
}

/// A capsule around the y axis from -length/2 to length/2.
fn capsule(radius: f64, length: f64) -> Mesh {
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut outline = arc(radius, 0.0, 0.5 * length, 0.0, quarter, RINGS);
    outline.extend(arc(radius, 0.0, -0.5 * length, quarter, 2.0 * quarter, RINGS));
    revolved(&[outline])
}

/// A cylinder around the y axis from -length/2 to length/2: its wall and its ends meet at an edge.
fn cylinder(radius: f64, length: f64) -> Mesh {
    let h = 0.5 * length;
    revolved(&[
        vec![(0.0, h, 0.0, 1.0), (radius, h, 0.0, 1.0)],
        vec![(radius, h, 1.0, 0.0), (radius, -h, 1.0, 0.0)],
        vec![(radius, -h, 0.0, -1.0), (0.0, -h, 0.0, -1.0)],
    ])
}

/// A torus around the y axis.
fn torus(radius: f64, tube_radius: f64) -> Mesh {
    revolved(&[arc(tube_radius, radius, 0.0, 0.0, std::f64::consts::TAU, 2 * RINGS)])
}

/// Outlines turned around the y axis; a surface is smooth along each. They run from top to bottom as seen
/// from outside.
fn revolved(outlines: &[Vec<Outline>]) -> Mesh {
    let mut mesh = Mesh::default();
    for outline in outlines {
        let first = mesh.positions.len() as u32;
        for &(from_axis, height, out, up) in outline {
            for k in 0..AROUND {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
                mesh.vertex(
                    V::new(from_axis * cos, height, from_axis * sin),
                    V::new(out * cos, up, out * sin),
                );
            }
        }
        for ring in 0..outline.len() as u32 - 1 {
            for k in 0..AROUND {
                let (a, b) = (first + ring * AROUND + k, first + ring * AROUND + (k + 1) % AROUND);
                mesh.triangles.extend([[a, b, a + AROUND], [b, b + AROUND, a + AROUND]]);
            }
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
        for (shape, size) in [
            (Shape::Capsule { radius: 0.03, length: 0.3 }, [0.06, 0.36, 0.06]),
            (Shape::Box { half_extents: [0.1, 0.2, 0.3] }, [0.2, 0.4, 0.6]),
            (Shape::Sphere { radius: 0.05 }, [0.1, 0.1, 0.1]),
            (Shape::Cylinder { radius: 0.04, length: 0.2 }, [0.08, 0.2, 0.08]),
            (Shape::Torus { radius: 0.08, tube_radius: 0.02 }, [0.2, 0.04, 0.2]),
        ] {
            let found = bounds(shape.clone()).size();
            for (found, expected) in found.into_iter().zip(size) {
                assert!((found - expected).abs() < 1e-6, "{shape:?}: {found:?}");
            }
        }
    }

    #[test]
    fn vertices_lie_on_the_shape_and_normals_are_its() {
        for shape in [
            Shape::Capsule { radius: 0.03, length: 0.3 },
            Shape::Cylinder { radius: 0.04, length: 0.2 },
            Shape::Torus { radius: 0.08, tube_radius: 0.02 },
        ] {
            let mesh = Mesh::of(&shape);
            for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
                let (p, n) = (V::from(p.map(f64::from)), V::from(n.map(f64::from)));
                assert!(shape.distance(p).abs() < 1e-6, "{shape:?} at {p}");
                assert!((shape.distance(p + n * 1e-3) - 1e-3).abs() < 1e-5, "{shape:?} at {p}");
            }
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
