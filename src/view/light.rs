//! How much light reaches a point: soft shadows from a lamp, and the darkening of corners.
//!
//! A scene and what the camera sees come in; factors between 0 (dark) and 1 (lit) go out. Imports
//! `view`'s camera, field, scene and surface.

use rayon::prelude::*;

use super::camera::{Camera, V};
use super::field::Field;
use super::scene::RenderScene;
use super::surface::{Surface, Thing};

/// Towards the lamp.
pub fn lamp() -> V {
    V::new(-0.55, 1.0, 0.35).normalize()
}

/// Pixels along each side of the lamp's view.
const SIZE: usize = 900;
/// Half the width of the lamp as seen from the dough, as a tangent: how soft shadows are.
const SOFTNESS: f32 = 0.16;

/// Radius around particles, in spacings, outside of which there is no dough.
const HULL: f32 = 2.0;

/// What the lamp sees: heights along its direction on a square around the scene.
pub struct Shadow {
    u: V,
    v: V,
    corner: [f32; 2],
    /// Metres per pixel.
    cell: f32,
    /// The largest coordinate along the lamp's direction at each pixel.
    tops: Vec<f32>,
    /// Below this difference a point does not shade itself, m.
    slack: f32,
}

impl Shadow {
    /// The lamp's view of the dough, whose body is `field`, and the tools.
    pub fn cast(scene: &RenderScene, field: &Field) -> Self {
        let u = lamp().cross(&V::x()).normalize();
        let v = lamp().cross(&u);
        let middle = V::from(scene.bounds.center().map(|c| c as f32));
        let reach = 0.75 * scene.bounds.diagonal() as f32 + 0.25;
        let mut shadow = Self {
            u,
            v,
            corner: [middle.dot(&u) - reach, middle.dot(&v) - reach],
            cell: 2.0 * reach / SIZE as f32,
            tops: vec![f32::NEG_INFINITY; SIZE * SIZE],
            slack: 1.5 * scene.spacing,
        };
        for p in scene.dough.iter().filter(|p| p.iter().all(|c| c.is_finite())) {
            shadow.stamp(V::from(*p), HULL * scene.spacing);
        }
        shadow.lower_to(field, HULL * scene.spacing, 2.0 * reach);
        for (mesh, _) in &scene.tools {
            for corners in &mesh.triangles {
                shadow.stamp_triangle(corners.map(|k| V::from(mesh.positions[k as usize])));
            }
        }
        shadow
    }

    fn pixel(&self, p: V) -> [f32; 2] {
        [(p.dot(&self.u) - self.corner[0]) / self.cell, (p.dot(&self.v) - self.corner[1]) / self.cell]
    }

    /// Takes the hull of the particles, which is `margin` too high, down to the body within it.
    fn lower_to(&mut self, field: &Field, margin: f32, deepest: f32) {
        let (u, v, corner, cell) = (self.u, self.v, self.corner, self.cell);
        self.tops.par_iter_mut().enumerate().filter(|(_, top)| top.is_finite()).for_each(|(i, top)| {
            let across =
                u * (corner[0] + (i % SIZE) as f32 * cell) + v * (corner[1] + (i / SIZE) as f32 * cell);
            let start = across + lamp() * (*top + margin);
            *top = field
                .entry(start, -lamp(), 0.0, deepest)
                .map_or(f32::NEG_INFINITY, |depth| *top + margin - depth);
        });
    }

    fn stamp(&mut self, p: V, radius: f32) {
        let ([x, y], top, size) = (self.pixel(p), p.dot(&lamp()), radius / self.cell);
        let range = |c: f32| {
            let clamp = |v: f32| v.clamp(0.0, SIZE as f32) as usize;
            clamp((c - size).ceil())..clamp((c + size).floor() + 1.0)
        };
        for row in range(y) {
            for column in range(x) {
                let (dx, dy) = (column as f32 - x, row as f32 - y);
                if dx * dx + dy * dy <= size * size {
                    let cell = &mut self.tops[row * SIZE + column];
                    *cell = cell.max(top);
                }
            }
        }
    }

    fn stamp_triangle(&mut self, corners: [V; 3]) {
        let [a, b, c] = corners.map(|p| self.pixel(p));
        let tops = corners.map(|p| p.dot(&lamp()));
        // Twice the signed area of (p, q, r); the lamp is far away, so that heights are linear over the triangle.
        let area = |p: [f32; 2], q: [f32; 2], r: [f32; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let whole = area(a, b, c);
        if whole.abs() < 1e-4 {
            // Seen from its edge; its neighbours cover what it does.
            return;
        }
        let range = |k: usize| {
            let clamp = |v: f32| v.clamp(0.0, SIZE as f32) as usize;
            clamp(a[k].min(b[k]).min(c[k]).ceil())..clamp(a[k].max(b[k]).max(c[k]).floor() + 1.0)
        };
        for row in range(1) {
            for column in range(0) {
                let p = [column as f32, row as f32];
                let shares = [area(p, b, c), area(p, c, a), area(p, a, b)].map(|part| part / whole);
                if shares.iter().all(|&share| share >= -1e-3) {
                    let top = (0..3).map(|k| shares[k] * tops[k]).sum();
                    let cell = &mut self.tops[row * SIZE + column];
                    *cell = cell.max(top);
                }
            }
        }
    }

    /// The part of the lamp that a point sees. Shadows are sharp at contact and soften with the
    /// distance to what casts them.
    pub fn lit(&self, p: V, disc: &Disc) -> f32 {
        let ([x, y], height) = (self.pixel(p), p.dot(&lamp()));
        let above = |size: f32, [dx, dy]: [f32; 2]| {
            let (column, row) = ((x + size * dx).round(), (y + size * dy).round());
            let inside = (0.0..SIZE as f32).contains(&column) && (0.0..SIZE as f32).contains(&row);
            let top =
                if inside { self.tops[row as usize * SIZE + column as usize] } else { f32::NEG_INFINITY };
            (top > height + self.slack).then_some(top - height)
        };
        let search = (SOFTNESS * 0.15 / self.cell).max(2.0);
        let (mut gap, mut found) = (0.0, 0);
        for rise in disc.0.iter().filter_map(|&d| above(search, d)) {
            gap += rise;
            found += 1;
        }
        if found == 0 {
            return 1.0;
        }
        let size = (SOFTNESS * gap / found as f32).max(0.5 * self.slack) / self.cell;
        1.0 - disc.0.iter().filter(|&&d| above(size, d).is_some()).count() as f32 / Disc::POINTS as f32
    }
}

/// How open the surroundings of a pixel are: 1 on a free surface, less in corners and near the dough.
pub fn openness(surface: &Surface, camera: &Camera, p: V, normal: V, reach: f32, disc: &Disc) -> f32 {
    let side = normal.cross(&if normal.x.abs() < 0.9 { V::x() } else { V::z() }).normalize();
    let other = normal.cross(&side);
    let mut hidden = 0.0;
    for (k, &[a, b]) in disc.0.iter().enumerate() {
        let rise = (1.0 - a * a - b * b).max(0.0).sqrt();
        let length = reach * (0.25 + 0.75 * ((k * 7 % Disc::POINTS) as f32 / Disc::POINTS as f32));
        let sample = p + (side * a + other * b + normal * (rise + 0.1)) * length;
        let [x, y, depth] = camera.project(sample);
        if x < 0.0 || y < 0.0 || x >= surface.width as f32 || y >= surface.height as f32 {
            continue;
        }
        let seen = surface.at(x as usize, y as usize);
        let over = depth - seen.depth;
        // What is far in front of the sample does not stand near the point.
        if over > 0.02 * reach && seen.thing != Thing::Background {
            hidden += (1.0 - over / (3.0 * reach)).clamp(0.0, 1.0);
        }
    }
    1.0 - hidden / Disc::POINTS as f32
}

/// Directions to look into: points spread evenly over the unit disc.
pub struct Disc([[f32; 2]; Disc::POINTS]);

impl Disc {
    const POINTS: usize = 24;

    /// The points of a sunflower.
    pub fn new() -> Self {
        const GOLDEN_ANGLE: f32 = 2.399_963_2;
        Self(std::array::from_fn(|k| {
            let radius = ((k as f32 + 0.5) / Self::POINTS as f32).sqrt();
            let angle = k as f32 * GOLDEN_ANGLE;
            [radius * angle.cos(), radius * angle.sin()]
        }))
    }

    /// The points turned by an angle, rad: neighbouring pixels look into different directions.
    pub fn turned(&self, angle: f32) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self(self.0.map(|[a, b]| [cos * a - sin * b, sin * a + cos * b]))
    }
}

impl Default for Disc {
    fn default() -> Self {
        Self::new()
    }
}
