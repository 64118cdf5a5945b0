//! Solids filled with evenly spread, seeded points: a ball, a box, a disc.
//!
//! Lengths and a centre come in; points go out, the same for the same seed. Imports point clouds and
//! random numbers.

use crate::math::cloud::{Bounds, Point};
use crate::math::rng::{seeded, uniform};

/// A solid around its centre. Lengths in m, all positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solid {
    /// Ball of a radius.
    Ball { radius: f64 },
    /// Axis-aligned box of full edge lengths.
    Box { size: [f64; 3] },
    /// Cylinder with its axis along y.
    Disc { radius: f64, height: f64 },
}

/// Steps of the R3 low-discrepancy sequence: 1/g, 1/g^2, 1/g^3 with g^4 = g + 1. (Roberts 2018, "The
/// unreasonable effectiveness of quasirandom sequences".)
const R3: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3];

/// Up to this aspect ratio points are drawn in a cube around the solid, so that they are equally even on
/// all axes; a thinner solid is drawn in its own box, or most draws would miss.
const MAX_ASPECT: f64 = 32.0;

impl Solid {
    /// Full edge lengths of the box around the solid, m.
    pub fn size(&self) -> [f64; 3] {
        match *self {
            Solid::Ball { radius } => [2.0 * radius; 3],
            Solid::Box { size } => size,
            Solid::Disc { radius, height } => [2.0 * radius, height, 2.0 * radius],
        }
    }

    /// The box around the solid at `center`.
    pub fn bounds(&self, center: Point) -> Bounds {
        let size = self.size();
        Bounds {
            min: std::array::from_fn(|a| center[a] - 0.5 * size[a]),
            max: std::array::from_fn(|a| center[a] + 0.5 * size[a]),
        }
    }

    /// Volume, m^3.
    pub fn volume(&self) -> f64 {
        use std::f64::consts::PI;
        match *self {
            Solid::Ball { radius } => 4.0 / 3.0 * PI * radius.powi(3),
            Solid::Box { size } => size.iter().product(),
            Solid::Disc { radius, height } => PI * radius * radius * height,
        }
    }

    /// `n` points that fill the solid at `center` evenly. The seed shifts the pattern.
    pub fn fill(&self, center: Point, n: usize, seed: u64) -> Vec<Point> {
        let mut rng = seeded(seed, "fill a solid");
        let mut u: [f64; 3] = std::array::from_fn(|_| uniform(&mut rng));
        let size = self.size();
        let longest = size.iter().fold(0.0f64, |m, s| m.max(*s));
        let drawn = size.map(|s| if s * MAX_ASPECT >= longest { longest } else { s });

        let mut points = Vec::with_capacity(n);
        while points.len() < n {
            u = std::array::from_fn(|a| (u[a] + R3[a]).fract());
            let p: Point = std::array::from_fn(|a| (u[a] - 0.5) * drawn[a]);
            if self.contains(p) {
                points.push(std::array::from_fn(|a| center[a] + p[a]));
            }
        }
        points
    }

    /// Whether the solid around the origin holds `p`.
    pub fn contains(&self, p: Point) -> bool {
        match *self {
            Solid::Ball { radius } => p.iter().map(|x| x * x).sum::<f64>() <= radius * radius,
            Solid::Box { size } => (0..3).all(|a| 2.0 * p[a].abs() <= size[a]),
            Solid::Disc { radius, height } => {
                p[0] * p[0] + p[2] * p[2] <= radius * radius && 2.0 * p[1].abs() <= height
            }
        }
    }
}

/// The piece of dough that a task starts with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dough {
    pub solid: Solid,
    pub center: Point,
    /// How many particles it is made of.
    pub particles: usize,
}

impl Dough {
    /// Its particles, evenly spread.
    pub fn fill(&self, seed: u64) -> Vec<Point> {
        self.solid.fill(self.center, self.particles, seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::cloud::centroid;
    use crate::math::neighbours::{Neighbours, spacing};

    const CENTER: Point = [0.5, 0.2, 0.4];
    const SOLIDS: [Solid; 3] = [
        Solid::Ball { radius: 0.07 },
        Solid::Box { size: [0.2, 0.08, 0.06] },
        Solid::Disc { radius: 0.15, height: 0.02 },
    ];

    #[test]
    fn fillings_stay_inside_and_centred() {
        for solid in SOLIDS {
            let points = solid.fill(CENTER, 3000, 4);
            assert_eq!(points.len(), 3000);
            let b = solid.bounds(CENTER);
            assert!(points.iter().all(|p| (0..3).all(|a| p[a] >= b.min[a] && p[a] <= b.max[a])));
            let c = centroid(&points);
            for a in 0..3 {
                assert!((c[a] - CENTER[a]).abs() < 0.01 * solid.size()[a], "{solid:?} {c:?}");
            }
        }
    }

    #[test]
    fn fillings_are_more_even_than_chance() {
        for solid in SOLIDS {
            let points = solid.fill(CENTER, 2000, 1);
            let s = spacing(solid.volume(), points.len());
            let grid = Neighbours::new(&points, s);
            let nearest: Vec<f64> =
                (0..points.len()).map(|i| grid.nearest(points[i], 2)[1].distance).collect();
            let mean = nearest.iter().sum::<f64>() / nearest.len() as f64;
            // Independent uniform points: mean 0.554 spacings, smallest near 0.
            assert!(mean > 0.75 * s, "{solid:?}: mean {}", mean / s);
            let least = nearest.iter().fold(f64::INFINITY, |m, d| m.min(*d));
            assert!(least > 0.3 * s, "{solid:?}: least {}", least / s);
        }
    }

    #[test]
    fn seeds_shift_the_pattern_and_repeat() {
        let solid = SOLIDS[0];
        assert_eq!(solid.fill(CENTER, 10, 1), solid.fill(CENTER, 10, 1));
        assert_ne!(solid.fill(CENTER, 10, 1), solid.fill(CENTER, 10, 2));
    }

    #[test]
    fn an_absurdly_thin_solid_is_filled_too() {
        let foil = Solid::Box { size: [1.0, 1e-7, 1.0] };
        assert_eq!(foil.fill(CENTER, 100, 0).len(), 100);
    }
}
