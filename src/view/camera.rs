//! A pinhole camera that frames a box, for the picture renderer.
//!
//! Bounds and a picture size come in; projections between the world and pixels go out. Imports `math`.

use nalgebra::Vector3;

use crate::math::cloud::Bounds;

/// A vector in the world, m, y up.
pub type V = Vector3<f32>;

/// Tangent of half the vertical field of view (about 26 degrees): long enough to look natural.
const HALF_VIEW: f32 = 0.23;

/// Free space around the bounds, as a factor.
const MARGIN: f32 = 1.05;

/// Where pictures are taken from.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    eye: V,
    right: V,
    up: V,
    forward: V,
    /// Pixels per unit of tangent.
    focal: f32,
    /// The middle of the picture, pixels.
    center: [f32; 2],
}

impl Camera {
    /// A camera that looks down at the middle of `bounds` and has all of it in the picture.
    pub fn framing(bounds: &Bounds, width: usize, height: usize) -> Self {
        let forward = -V::new(0.45, 0.62, 1.0).normalize();
        let right = forward.cross(&V::y()).normalize();
        let middle = V::from(bounds.center().map(|v| v as f32));
        let mut camera = Self {
            eye: middle,
            right,
            up: right.cross(&forward),
            forward,
            focal: 0.5 * height as f32 / HALF_VIEW,
            center: [0.5 * width as f32, 0.5 * height as f32],
        };
        // Step back until every corner is seen, with a margin.
        let across = HALF_VIEW * width as f32 / height as f32;
        let distance = corners(bounds)
            .map(|p| {
                let p = p - middle;
                let (x, y) = (p.dot(&right).abs(), p.dot(&camera.up).abs());
                MARGIN * (x / across).max(y / HALF_VIEW) - p.dot(&forward)
            })
            .fold(0.0, f32::max);
        camera.eye = middle - forward * distance.max(0.05);
        camera
    }

    /// Column and row in pixels, and the distance along the view direction in m.
    pub fn project(&self, p: V) -> [f32; 3] {
        let from_eye = p - self.eye;
        let depth = from_eye.dot(&self.forward);
        let scale = self.focal / depth;
        let [cx, cy] = self.center;
        [cx + scale * from_eye.dot(&self.right), cy - scale * from_eye.dot(&self.up), depth]
    }

    /// The direction through a pixel, one unit long along the view direction.
    pub fn ray(&self, x: f32, y: f32) -> V {
        let [cx, cy] = self.center;
        self.forward + self.right * ((x - cx) / self.focal) - self.up * ((y - cy) / self.focal)
    }

    /// The point seen at a pixel at a depth along the view direction.
    pub fn unproject(&self, x: f32, y: f32, depth: f32) -> V {
        self.eye + self.ray(x, y) * depth
    }

    /// Where the camera stands.
    pub fn eye(&self) -> V {
        self.eye
    }

    /// Pixels that one metre takes at a depth.
    pub fn pixels_per_metre(&self, depth: f32) -> f32 {
        self.focal / depth
    }
}

/// The eight corners of a box.
fn corners(bounds: &Bounds) -> impl Iterator<Item = V> {
    let (min, max) = (bounds.min, bounds.max);
    (0..8).map(move |k| V::from_fn(|a, _| (if k >> a & 1 == 1 { max[a] } else { min[a] }) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_the_bounds_are_in_the_picture_and_come_back() {
        let bounds = Bounds { min: [0.3, 0.0, 0.4], max: [0.7, 0.1, 0.6] };
        let camera = Camera::framing(&bounds, 320, 240);
        for p in corners(&bounds) {
            let [x, y, depth] = camera.project(p);
            assert!((0.0..320.0).contains(&x) && (0.0..240.0).contains(&y), "{x} {y}");
            assert!((camera.unproject(x, y, depth) - p).norm() < 1e-5);
        }
    }
}
