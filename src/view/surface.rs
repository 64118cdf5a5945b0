//! What the camera sees at each pixel: depth, normal, and what it belongs to.
//!
//! A scene and a camera come in; a [`Surface`] goes out, for `light` and `render` to shade. Imports
//! `view`'s camera, scene and mesh.
//!
//! Dough is drawn as overlapping balls whose depth is then smoothed, so that thousands of particles
//! read as one soft body with an edge where it ends.

use rayon::prelude::*;

use super::camera::{Camera, V};
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

/// What the camera sees.
pub struct Surface {
    pub width: usize,
    pub height: usize,
    pub texels: Vec<Texel>,
}

impl Surface {
    /// Draws the scene's dough, tools and table.
    pub fn seen(scene: &RenderScene, camera: &Camera, width: usize, height: usize) -> Self {
        let mut surface = Self { width, height, texels: vec![NOTHING; width * height] };
        surface.draw_dough(scene, camera);
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

    fn draw_dough(&mut self, scene: &RenderScene, camera: &Camera) {
        for (p, &piece) in scene.dough.iter().zip(&scene.piece) {
            if p.iter().all(|v| v.is_finite()) {
                self.draw_ball(V::from(*p), scene.radius, Thing::Dough(piece), camera);
            }
        }
        let depths: Vec<f32> = self.texels.iter().map(|t| t.depth).collect();
        let smooth = smoothed(depths, self.width, self.height, scene.radius, camera);
        let normals: Vec<V> = (0..smooth.len())
            .into_par_iter()
            .map(|i| normal_at(&smooth, self.width, self.height, i, scene.radius, camera))
            .collect();
        for ((texel, depth), normal) in self.texels.iter_mut().zip(smooth).zip(normals) {
            (texel.depth, texel.normal) = (depth, normal);
        }
    }

    /// A ball, seen straight on: exact enough for balls much smaller than their distance.
    fn draw_ball(&mut self, center: V, radius: f32, thing: Thing, camera: &Camera) {
        let [cx, cy, depth] = camera.project(center);
        let size = radius * camera.pixels_per_metre(depth);
        let (left, right) = span(cx - size, cx + size, self.width);
        let (top, bottom) = span(cy - size, cy + size, self.height);
        for y in top..bottom {
            for x in left..right {
                let (dx, dy) = ((x as f32 + 0.5 - cx) / size, (y as f32 + 0.5 - cy) / size);
                let inside = 1.0 - dx * dx - dy * dy;
                let texel = &mut self.texels[y * self.width + x];
                if inside > 0.0 && depth - radius * inside.sqrt() < texel.depth {
                    *texel = Texel { depth: depth - radius * inside.sqrt(), normal: V::y(), thing };
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

/// Rounds of smoothing along rows, then columns.
const ROUNDS: usize = 3;

/// The depth of the dough averaged over about a particle's size, across the body but not over its edge.
fn smoothed(mut depths: Vec<f32>, width: usize, height: usize, radius: f32, camera: &Camera) -> Vec<f32> {
    for step in [(1, 0), (0, 1)].repeat(ROUNDS) {
        depths = (0..depths.len())
            .into_par_iter()
            .map(|i| {
                let depth = depths[i];
                if !depth.is_finite() {
                    return depth;
                }
                let reach = (1.1 * radius * camera.pixels_per_metre(depth)).ceil().min(60.0) as isize;
                let (mut sum, mut weights) = (0.0, 0.0);
                for k in -reach..=reach {
                    let x = (i % width) as isize + k * step.0;
                    let y = (i / width) as isize + k * step.1;
                    if x < 0 || y < 0 || x >= width as isize || y >= height as isize {
                        continue;
                    }
                    let other = depths[y as usize * width + x as usize];
                    let jump = (other - depth) / (2.0 * radius);
                    let away = k as f32 / (0.6 * reach as f32);
                    if other.is_finite() && jump.abs() < 3.0 {
                        let weight = (-away * away - jump * jump).exp();
                        sum += weight * other;
                        weights += weight;
                    }
                }
                sum / weights
            })
            .collect();
    }
    depths
}

/// The normal of a depth map, from the neighbours that are nearer in depth.
fn normal_at(depths: &[f32], width: usize, height: usize, i: usize, radius: f32, camera: &Camera) -> V {
    let (x, y, depth) = (i % width, i / width, depths[i]);
    if !depth.is_finite() || x < 1 || y < 1 || x + 1 >= width || y + 1 >= height {
        return V::y();
    }
    let point = |x: usize, y: usize| camera.unproject(x as f32 + 0.5, y as f32 + 0.5, depths[y * width + x]);
    let here = point(x, y);
    let slope = |(xa, ya): (usize, usize), (xb, yb): (usize, usize)| {
        let (a, b) = (depths[ya * width + xa], depths[yb * width + xb]);
        let (near_a, near_b) = ((a - depth).abs() < radius, (b - depth).abs() < radius);
        match (near_a, near_b) {
            (true, true) => point(xb, yb) - point(xa, ya),
            (true, false) => here - point(xa, ya),
            (false, true) => point(xb, yb) - here,
            (false, false) => V::zeros(),
        }
    };
    let across = slope((x - 1, y), (x + 1, y));
    let down = slope((x, y - 1), (x, y + 1));
    let normal = down.cross(&across);
    if normal.norm_squared() > 0.0 { normal.normalize() } else { (camera.eye() - here).normalize() }
}
