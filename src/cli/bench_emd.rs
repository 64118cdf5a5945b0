//! The earth mover's distance on fixed work, for `donut bench`.
//!
//! A case and the number of runs come in, seconds go out. The work: a ball of points and a ring, in the
//! four ways in which clouds are compared and moved. Imports math and emd.

use std::hint::black_box;
use std::time::Instant;

use serde::Serialize;

use crate::emd::exact::{assign, assign_within};
use crate::emd::reach::{Method, next_reachable};
use crate::emd::schedule::Settings;
use crate::emd::sinkhorn::divergence;
use crate::emd::{EmdError, Measure};
use crate::math::cloud::{Point, norm};
use crate::math::rng::{normal, seeded, uniform};

/// The tolerance of the auction's cases, as a part of the exact distance.
const TOLERANCE: f64 = 2e-4;
/// Steps toward the goal, and their length, of the cases of [`Operation::Reach`].
const REACH: (usize, f64) = (20, 0.005);

/// What is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Operation {
    /// The exact matching.
    Exact,
    /// A matching within 0.02 % of the exact distance.
    Auction,
    /// The next reachable cloud along a matching, 20 steps.
    Reach,
    /// The Sinkhorn divergence with its gradient, the paper's settings, in single precision.
    Sinkhorn,
}

/// Name, operation, points per cloud.
pub const CASES: [(&str, Operation, usize); 8] = [
    ("E1", Operation::Exact, 1000),
    ("E2", Operation::Exact, 5000),
    ("E3", Operation::Auction, 1000),
    ("E4", Operation::Auction, 5000),
    ("E5", Operation::Reach, 1000),
    ("E6", Operation::Reach, 5000),
    ("E7", Operation::Sinkhorn, 1000),
    ("E8", Operation::Sinkhorn, 5000),
];

/// What a case took.
#[derive(Serialize)]
pub struct EmdResult {
    pub name: String,
    pub points: usize,
    /// Of the fastest run.
    pub seconds: f64,
    pub method: Operation,
}

/// Times one of [`CASES`], on the current threads; the first run warms up.
pub fn time_case(
    &(name, method, points): &(&str, Operation, usize),
    runs: u16,
) -> Result<EmdResult, EmdError> {
    let (source, target) = (ball(points), ring(points));
    let tolerance = match method {
        Operation::Auction => TOLERANCE * assign(&source, &target).mean_distance,
        _ => 0.0,
    };
    let mut seconds = f64::INFINITY;
    for _ in 0..=runs {
        let begin = Instant::now();
        match method {
            Operation::Exact => drop(black_box(assign(&source, &target))),
            Operation::Auction => drop(black_box(assign_within(&source, &target, tolerance))),
            Operation::Reach => {
                drop(black_box(next_reachable(&source, &target, REACH.0, REACH.1, Method::Exact)?));
            }
            Operation::Sinkhorn => {
                let measures = [&source, &target].map(|cloud| Measure::uniform(cloud));
                drop(black_box(divergence::<f32>(measures[0], measures[1], &Settings::default())?));
            }
        }
        seconds = seconds.min(begin.elapsed().as_secs_f64());
    }
    Ok(EmdResult { name: name.into(), points, seconds, method })
}

/// Uniform in a ball of radius 0.12.
fn ball(n: usize) -> Vec<Point> {
    let mut rng = seeded(1, "bench ball");
    let point = |_| {
        let d: Point = std::array::from_fn(|_| normal(&mut rng));
        let stretch = 0.12 * uniform(&mut rng).cbrt() / norm(d);
        d.map(|v| 0.5 + stretch * v)
    };
    (0..n).map(point).collect()
}

/// In a ring of radii 0.15 and 0.05 about the vertical axis.
fn ring(n: usize) -> Vec<Point> {
    let mut rng = seeded(2, "bench ring");
    let point = |_| {
        let [around, across] = [0, 1].map(|_| std::f64::consts::TAU * uniform(&mut rng));
        let r = 0.05 * uniform(&mut rng).sqrt();
        let out = 0.15 + r * across.cos();
        [0.5 + out * around.cos(), 0.5 + r * across.sin(), 0.5 + out * around.sin()]
    };
    (0..n).map(point).collect()
}
