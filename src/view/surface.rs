//! What the camera sees at each pixel: depth, normal, and what it belongs to.
//!
//! A scene and a camera come in; a [`Surface`] goes out, for `light` and `render` to shade. Imports
//! `view`'s camera, field, scene and mesh.
//!
//! Dough is drawn as balls around the particles, which say where along each pixel's ray to look for the
//! body that the particles stand for.

use rayon::prelude::*;

use super::camera::{Camera, V};
use super::field::Field;
use super::mesh::Mesh;
use super::scene::{Material, RenderScene};

/// What a pixel belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thing {
    Background,
    Table,
    /// Dough of a piece.
    Dough(i32),
    Tool(Material),
}

/// One pixel.
#[derive(Clone, Copy, Debug)]
pub struct Texel {
    /// Distance along the view direction, m.
    pub depth: f32,
    /// Outward unit normal.
    pub normal: V,
    pub thing: Thing,
}

const NOTHING: Texel =
    Texel { depth: f32::INFINITY, normal: V::new(0.0, 1.0, 0.0), thing: Thing::Background };

/// Between which depths a pixel's ray may meet dough, and the piece of the particle in front.
#[derive(Clone, Copy)]
struct Hull {
    near: f32,
    far: f32,
    front: f32,
    piece: i32,
}

/// Further behind than any particle, m: for where no half-size ball is.
const LAST_RESORT: f32 = 100.0;
const NO_HULL: Hull = Hull { near: f32::INFINITY, far: f32::NEG_INFINITY, front: f32::INFINITY, piece: 0 };

/// What the camera sees.
pub struct Surface {
    pub width: usize,
    pub height: usize,
    pub texels: Vec<Texel>,
}

impl Surface {
    /// Draws the scene's dough, whose body is `field`, its tools and the table, `width` x `height` pixels.
    pub fn seen(scene: &RenderScene, field: &Field, camera: &Camera, [width, height]: [usize; 2]) -> Self {
        let mut surface = Self { width, height, texels: vec![NOTHING; width * height] };
        surface.draw_dough(scene, field, camera);
        for (mesh, material) in &scene.tools {
            surface.draw_mesh(mesh, Thing::Tool(*material), camera);
        }
        surface.draw_table(scene.table, camera);
        surface
    }

    /// The pixel in column `x` of row `y`.
    pub fn at(&self, x: usize, y: usize) -> &Texel {
        &self.texels[y * self.width + x]
    }

    fn draw_dough(&mut self, scene: &RenderScene, field: &Field, camera: &Camera) {
        let mut hulls = vec![NO_HULL; self.texels.len()];
        for (p, &piece) in scene.dough.iter().zip(&scene.piece) {
            if p.iter().all(|v| v.is_finite()) {
                self.cover(&mut hulls, V::from(*p), 2.0 * scene.spacing, piece, camera);
            }
        }
        let width = self.width;
        self.texels.par_iter_mut().zip(hulls).enumerate().for_each(|(i, (texel, hull))| {
            let ray = camera.ray((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            if let Some(depth) = field.entry(camera.eye(), ray, hull.near, hull.far) {
                let normal = field.normal(camera.eye() + ray * depth);
                *texel = Texel { depth, normal, thing: Thing::Dough(hull.piece) };
            }
        });
    }

    /// Widens the hulls of the pixels that a ball covers.
    fn cover(&self, hulls: &mut [Hull], center: V, radius: f32, piece: i32, camera: &Camera) {
        let [cx, cy, depth] = camera.project(center);
        let size = radius * camera.pixels_per_metre(depth);
        let (left, right) = span(cx - size, cx + size, self.width);
        let (top, bottom) = span(cy - size, cy + size, self.height);
        for y in top..bottom {
            for x in left..right {
                let (dx, dy) = ((x as f32 + 0.5 - cx) / size, (y as f32 + 0.5 - cy) / size);
                let half = radius * (1.0 - dx * dx - dy * dy).max(0.0).sqrt();
                let hull = &mut hulls[y * self.width + x];
                if half > 0.0 {
                    hull.near = hull.near.min(depth - half);
                    hull.far = hull.far.max(depth + half);
                    // Which particle is in front is asked of half-size balls, as wide as their spacing:
                    // wider ones would bulge over a neighbouring piece.
                    let front = depth + if half > 0.87 * radius { -0.5 * half } else { LAST_RESORT };
                    if front < hull.front {
                        (hull.front, hull.piece) = (front, piece);
                    }
                }
            }
        }
    }

    fn draw_mesh(&mut self, mesh: &Mesh, thing: Thing, camera: &Camera) {
        let seen: Vec<[f32; 3]> = mesh.positions.iter().map(|&p| camera.project(V::from(p))).collect();
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(|k| seen[k as usize]);
            let normals = corners.map(|k| V::from(mesh.normals[k as usize]));
            if [a, b, c].iter().all(|p| p[2] > 0.0) {
                self.draw_triangle([a, b, c], normals, thing);
            }
        }
    }

    fn draw_triangle(&mut self, [a, b, c]: [[f32; 3]; 3], normals: [V; 3], thing: Thing) {
        let area = edge(a, b, c[0], c[1]);
        let (left, right) = span(a[0].min(b[0]).min(c[0]), a[0].max(b[0]).max(c[0]), self.width);
        let (top, bottom) = span(a[1].min(b[1]).min(c[1]), a[1].max(b[1]).max(c[1]), self.height);
        for y in top..bottom {
            for x in left..right {
                let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
                let w = [edge(b, c, px, py) / area, edge(c, a, px, py) / area, edge(a, b, px, py) / area];
                // Depth is linear in the picture as 1 / depth.
                let depth = 1.0 / (w[0] / a[2] + w[1] / b[2] + w[2] / c[2]);
                let texel = &mut self.texels[y * self.width + x];
                if w.iter().all(|&w| w >= 0.0) && depth < texel.depth {
                    let normal = normals[0] * w[0] + normals[1] * w[1] + normals[2] * w[2];
                    *texel = Texel { depth, normal: normal.normalize(), thing };
                }
            }
        }
    }

    fn draw_table(&mut self, table: f32, camera: &Camera) {
        let width = self.width;
        self.texels.par_iter_mut().enumerate().for_each(|(i, texel)| {
            let ray = camera.ray((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            let depth = (table - camera.eye().y) / ray.y;
            if depth > 0.0 && depth < texel.depth {
                *texel = Texel { depth, normal: V::y(), thing: Thing::Table };
            }
        });
    }
}

/// Twice the signed area of (a, b, p) in the picture.
fn edge(a: [f32; 3], b: [f32; 3], px: f32, py: f32) -> f32 {
    (b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])
}

/// The pixels between two coordinates, within the picture.
fn span(from: f32, to: f32, size: usize) -> (usize, usize) {
    (from.floor().clamp(0.0, size as f32) as usize, (to.ceil() + 1.0).clamp(0.0, size as f32) as usize)
}
