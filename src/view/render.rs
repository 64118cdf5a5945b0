//! Pictures of a run without a GPU: the same scene gives the same bytes.
//!
//! A [`RenderScene`] or a whole run comes in, a [`Picture`] goes out. Imports the rest of `view` and
//! `store`'s record types.

use rayon::prelude::*;

use super::camera::{Camera, V};
use super::field::Field;
use super::light::{self, Disc, Shadow};
use super::picture::Picture;
use super::scene::{self, Material, RenderScene};
use super::surface::{Surface, Texel, Thing};
use crate::store::record::RunRecord;

/// Samples per pixel along each axis.
const OVERSAMPLING: usize = 2;

/// Shades of dough by piece, linear RGB: cream, then tints that tell pieces apart.
pub(super) const DOUGH: [[f32; 3]; 5] =
    [[0.85, 0.66, 0.40], [0.80, 0.47, 0.28], [0.63, 0.64, 0.36], [0.78, 0.52, 0.50], [0.58, 0.56, 0.62]];
const TABLE: [f32; 3] = [0.47, 0.50, 0.53];
const BACKDROP: [f32; 3] = [0.80, 0.84, 0.88];
const WOOD: [f32; 3] = [0.50, 0.25, 0.10];
const METAL: [f32; 3] = [0.42, 0.45, 0.49];
/// How much of a metal tool's own light is seen.
const METAL_OPACITY: f32 = 0.6;
pub(super) const CAPTION: [u8; 3] = [40, 44, 52];

/// A picture of a scene, `width` x `height` pixels.
pub fn render(scene: &RenderScene, width: usize, height: usize) -> Picture {
    let (fine_width, fine_height) = (width * OVERSAMPLING, height * OVERSAMPLING);
    let camera = Camera::framing(&scene.bounds, fine_width, fine_height);
    let field = Field::of(&scene.dough, scene.spacing);
    let surface = Surface::seen(scene, &field, &camera, [fine_width, fine_height]);
    let (shadow, disc) = (Shadow::cast(scene, &field), Disc::new());
    let mut light = light_of(scene, &surface, &camera, (&shadow, &disc), |_| true);
    let see_through = |i: usize| surface.texels[i].thing == Thing::Tool(Material::Metal);
    if (0..light.len()).any(see_through) {
        // A gripper's plates would hide what they hold: show it through them.
        let bare = RenderScene { tools: Vec::new(), ..scene.clone() };
        let behind = Surface::seen(&bare, &field, &camera, [fine_width, fine_height]);
        let dim = light_of(&bare, &behind, &camera, (&shadow, &disc), see_through);
        for i in (0..light.len()).filter(|&i| see_through(i)) {
            light[i] = mix(light[i], dim[i], 1.0 - METAL_OPACITY);
        }
    }
    let pixels = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % width * OVERSAMPLING, i / width * OVERSAMPLING);
            let samples = (0..OVERSAMPLING * OVERSAMPLING)
                .map(|k| light[(y + k / OVERSAMPLING) * fine_width + x + k % OVERSAMPLING]);
            developed(samples)
        })
        .collect();
    Picture { width, height, pixels }
}

/// The light of the fine pixels that are wanted; the others stay black.
fn light_of(
    scene: &RenderScene,
    surface: &Surface,
    camera: &Camera,
    lamp: (&Shadow, &Disc),
    wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<[f32; 3]> {
    let dark = [0.0; 3];
    (0..surface.texels.len())
        .into_par_iter()
        .map(|i| if wanted(i) { shade(scene, surface, camera, lamp, i) } else { dark })
        .collect()
}

/// Before, after each stage, and the goal, side by side with captions; each panel `width` x `height`.
pub fn key_frames(run: &RunRecord, width: usize, height: usize) -> Picture {
    let mut panels = vec![("before".to_owned(), scene::of_dough(run, 0))];
    for (k, stage) in run.plan.stages.iter().enumerate() {
        if let Some(frame) = run.trajectory.last_frame_of(k) {
            let tool = run.plan.tools.get(stage.tool).map_or("no tool", |tool| tool.name.as_str());
            panels.push((format!("{}: {tool}", k + 1), scene::of_frame(run, frame)));
        }
    }
    let last = run.trajectory.positions.len().saturating_sub(1);
    let shown = run.plan.stages.len().checked_sub(1).and_then(|k| run.trajectory.last_frame_of(k));
    // Where the tool is away at the end, the last stage's panel is what it looks like after all.
    if shown != Some(last) || run.trajectory.tool_at(last).is_some() {
        panels.push(("after".to_owned(), scene::of_dough(run, last)));
    }
    panels.push(("goal".to_owned(), Some(scene::of_target(run))));
    let pictures: Vec<Picture> = panels
        .into_iter()
        .filter_map(|(caption, scene)| {
            let mut picture = render(&scene?, width, height);
            picture.caption(&caption, CAPTION);
            Some(picture)
        })
        .collect();
    Picture::side_by_side(&pictures, 4)
}

/// The light that comes from a fine pixel, linear RGB.
fn shade(
    scene: &RenderScene,
    surface: &Surface,
    camera: &Camera,
    (shadow, disc): (&Shadow, &Disc),
    i: usize,
) -> [f32; 3] {
    let (x, y) = (i % surface.width, i / surface.width);
    let Texel { depth, normal, thing } = *surface.at(x, y);
    let color = match thing {
        Thing::Background => return BACKDROP,
        Thing::Table => TABLE,
        Thing::Dough(piece) => DOUGH[piece.rem_euclid(DOUGH.len() as i32) as usize],
        Thing::Tool(Material::Wood) => WOOD,
        Thing::Tool(Material::Metal) => METAL,
    };
    let p = camera.unproject(x as f32 + 0.5, y as f32 + 0.5, depth);
    let disc = disc.turned(noise(x, y));
    let lit = shadow.lit(p + normal * scene.spacing, &disc);
    let open = light::openness(surface, camera, p, normal, 6.0 * scene.spacing, &disc);
    let towards_eye = (camera.eye() - p).normalize();
    let light = reflected(thing, color, normal, towards_eye, lit, open);
    if thing == Thing::Table {
        // The table fades into the backdrop away from the dough.
        let away = (p - V::from(scene.bounds.center().map(|c| c as f32))).norm();
        let fade = (away / (2.6 * scene.bounds.diagonal() as f32)).clamp(0.0, 1.0).powi(2);
        return mix(light, BACKDROP, fade);
    }
    light
}

/// From `a` at 0 to `b` at 1.
fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
}

/// Lamp, sky and a highlight on a surface.
fn reflected(thing: Thing, color: [f32; 3], normal: V, towards_eye: V, lit: f32, open: f32) -> [f32; 3] {
    let lamp = light::lamp();
    let facing = normal.dot(&lamp);
    // Light enters dough and comes out beyond the terminator, warmer.
    let wrap = if matches!(thing, Thing::Dough(_)) { 0.35 } else { 0.0 };
    let diffuse = ((facing + wrap) / (1.0 + wrap)).max(0.0);
    let beyond = if facing < wrap { wrap * 0.25 } else { 0.0 };
    let warm = [1.0 + beyond, 1.0, 1.0 - beyond];
    let (sharpness, strength) = match thing {
        Thing::Tool(Material::Metal) => (60.0, 0.7),
        Thing::Tool(Material::Wood) => (24.0, 0.14),
        Thing::Dough(_) => (14.0, 0.05),
        _ => (1.0, 0.0),
    };
    let highlight = strength * normal.dot(&(lamp + towards_eye).normalize()).max(0.0).powf(sharpness);
    let sky = (0.30 + 0.14 * normal.y) * open * open;
    std::array::from_fn(|c| {
        let sun = 0.92 * diffuse * lit * (0.55 + 0.45 * open);
        color[c] * (sun * warm[c] + sky * [0.94, 1.0, 1.08][c]) + highlight * lit
    })
}

/// The mean of some samples as 8-bit sRGB, bright light compressed softly.
fn developed(samples: impl ExactSizeIterator<Item = [f32; 3]>) -> [u8; 3] {
    let count = samples.len() as f32;
    let sum = samples.fold([0.0; 3], |sum: [f32; 3], s| std::array::from_fn(|c| sum[c] + s[c]));
    sum.map(|v| {
        let v = v / count;
        let film = if v > 0.7 { 0.7 + 0.3 * (1.0 - (-(v - 0.7) / 0.3).exp()) } else { v };
        let srgb = if film <= 0.003_130_8 { 12.92 * film } else { 1.055 * film.powf(1.0 / 2.4) - 0.055 };
        (srgb * 255.0 + 0.5) as u8
    })
}

/// An angle for each pixel, spread evenly over any small neighbourhood (interleaved gradient noise).
fn noise(x: usize, y: usize) -> f32 {
    let v = 0.067_110_56 * x as f32 + 0.005_837_15 * y as f32;
    (52.982_918 * v.fract()).fract() * std::f32::consts::TAU
}
