//! Clouds to test on.

use donut::math::cloud::Point;
use donut::math::rng::{normal, seeded, uniform};

/// Uniform in the unit cube.
pub fn cube(n: usize, seed: u64) -> Vec<Point> {
    let mut rng = seeded(seed, "cube");
    (0..n).map(|_| std::array::from_fn(|_| uniform(&mut rng))).collect()
}

/// Uniform in a ball about (0.5, 0.5, 0.5).
pub fn ball(n: usize, radius: f64, seed: u64) -> Vec<Point> {
    let mut rng = seeded(seed, "ball");
    (0..n)
        .map(|_| {
            let d: Point = std::array::from_fn(|_| normal(&mut rng));
            let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            let r = radius * uniform(&mut rng).cbrt();
            d.map(|v| 0.5 + r * v / length)
        })
        .collect()
}

/// A ring about the vertical axis through (0.5, 0.5, 0.5), uniform enough for a test.
pub fn torus(n: usize, major: f64, minor: f64, seed: u64) -> Vec<Point> {
    let mut rng = seeded(seed, "torus");
    (0..n)
        .map(|_| {
            let around = std::f64::consts::TAU * uniform(&mut rng);
            let across = std::f64::consts::TAU * uniform(&mut rng);
            let r = minor * uniform(&mut rng).sqrt();
            let out = major + r * across.cos();
            [0.5 + out * around.cos(), 0.5 + r * across.sin(), 0.5 + out * around.sin()]
        })
        .collect()
}
