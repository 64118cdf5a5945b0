//! The body of dough that particles stand for: a smooth density on a grid, and where a ray enters it.
//!
//! A cloud and its spacing come in; densities, normals and entry depths go out. Imports `math` and
//! `view::camera`'s vector type.

use super::camera::V;

/// A density that is about 1 well inside the dough and 0 away from it.
pub struct Field {
    origin: V,
    /// Edge of a grid cell, m.
    cell: f32,
    dims: [usize; 3],
    values: Vec<f32>,
}

/// Reach of a particle's kernel in spacings: large enough to hide the sampling, small enough to keep
/// holes and edges.
const REACH: f32 = 3.3;
/// The density at the surface.
const SURFACE: f32 = 0.42;
/// Grid cells at most; a wider cloud gets a coarser grid.
const MOST_CELLS: f32 = 6e6;

impl Field {
    /// The body of a cloud whose neighbours are about `spacing` apart, m.
    pub fn of(cloud: &[[f32; 3]], spacing: f32) -> Self {
        let reach = REACH * spacing;
        let finite = || cloud.iter().map(|p| V::from(*p)).filter(|p| p.iter().all(|c| c.is_finite()));
        let low = finite().fold(V::repeat(f32::INFINITY), |a, p| a.inf(&p));
        let high = finite().fold(V::repeat(f32::NEG_INFINITY), |a, p| a.sup(&p));
        if low.x > high.x {
            return Self { origin: V::zeros(), cell: 1.0, dims: [0; 3], values: Vec::new() };
        }
        let size = (high - low).add_scalar(2.0 * reach);
        let cell = (0.5 * spacing).max((size.product() / MOST_CELLS).cbrt());
        let dims = [size.x, size.y, size.z].map(|s| (s / cell).ceil() as usize + 2);
        let values = vec![0.0; dims.iter().product()];
        let mut field = Self { origin: low.add_scalar(-reach), cell, dims, values };
        // The integral of (1 - (r / h)^2)^3 over its ball is 64 pi / 315 h^3: inside, the sum is 1.
        let weight = 315.0 / (64.0 * std::f32::consts::PI) * (spacing / reach).powi(3);
        finite().for_each(|p| field.add(p, reach, weight));
        field
    }

    fn add(&mut self, p: V, reach: f32, weight: f32) {
        let at = (p - self.origin) / self.cell;
        let size = reach / self.cell;
        let range = |a: usize| {
            ((at[a] - size).ceil().max(0.0) as usize)..((at[a] + size).floor() as usize + 1).min(self.dims[a])
        };
        let (xs, ys, zs) = (range(0), range(1), range(2));
        for z in zs {
            for y in ys.clone() {
                let (dy, dz) = (y as f32 - at.y, z as f32 - at.z);
                let row = (z * self.dims[1] + y) * self.dims[0];
                for x in xs.clone() {
                    let dx = x as f32 - at.x;
                    let inside = (1.0 - (dx * dx + dy * dy + dz * dz) / (size * size)).max(0.0);
                    self.values[row + x] += weight * inside * inside * inside;
                }
            }
        }
    }

    /// The density at a point.
    pub fn density(&self, p: V) -> f32 {
        let at = (p - self.origin) / self.cell;
        if (0..3).any(|a| at[a] < 0.0 || at[a] >= self.dims[a] as f32 - 1.0) || self.values.is_empty() {
            return 0.0;
        }
        let base = at.map(|c| c as usize);
        let f = at - base.map(|c| c as f32);
        let row = |y: usize, z: usize| {
            let i = ((base.z + z) * self.dims[1] + base.y + y) * self.dims[0] + base.x;
            self.values[i] + (self.values[i + 1] - self.values[i]) * f.x
        };
        let plane = |z: usize| row(0, z) + (row(1, z) - row(0, z)) * f.y;
        plane(0) + (plane(1) - plane(0)) * f.z
    }

    /// The outward normal at a point near the surface.
    pub fn normal(&self, p: V) -> V {
        // Over a few cells, so that the light runs smoothly over the particles' grain.
        let h = 2.0 * self.cell;
        let gradient = V::from_fn(|a, _| {
            let step = V::ith(a, h);
            self.density(p - step) - self.density(p + step)
        });
        if gradient.norm_squared() > 0.0 { gradient.normalize() } else { V::y() }
    }

    /// The first distance between `near` and `far` at which a ray is inside the dough.
    pub fn entry(&self, eye: V, ray: V, near: f32, far: f32) -> Option<f32> {
        let step = self.cell / ray.norm();
        let mut outside = near;
        while outside < far {
            let mut inside = outside + step;
            if self.density(eye + ray * inside) >= SURFACE {
                for _ in 0..6 {
                    let middle = 0.5 * (outside + inside);
                    let deep = self.density(eye + ray * middle) >= SURFACE;
                    *(if deep { &mut inside } else { &mut outside }) = middle;
                }
                return Some(inside);
            }
            outside = inside;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_is_a_body_of_density_one_with_outward_normals() {
        let spacing = 0.01;
        let axis = || (0..12).map(|k| k as f32 * spacing);
        let cloud: Vec<[f32; 3]> =
            axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| [x, y, z]))).collect();
        let field = Field::of(&cloud, spacing);
        assert!((field.density(V::repeat(0.055)) - 1.0).abs() < 0.1);
        assert_eq!(field.density(V::repeat(0.5)), 0.0);
        let depth = field.entry(V::new(0.055, 1.0, 0.055), -V::y(), 0.5, 1.5).unwrap();
        let top = 1.0 - depth;
        assert!((0.105..0.13).contains(&top), "{top}");
        assert!(field.normal(V::new(0.055, top, 0.055)).y > 0.95);
        assert!(field.entry(V::new(0.5, 1.0, 0.5), -V::y(), 0.5, 1.5).is_none());
    }

    #[test]
    fn nothing_makes_no_body() {
        let field = Field::of(&[[f32::NAN; 3]], 0.01);
        assert!(field.entry(V::zeros(), V::y(), 0.0, 1.0).is_none());
    }
}
