//! Times of the earth mover's distance on three pairs of shapes: `cargo bench --bench emd [FILTER]`.
//!
//! Prints the median and the best of some repetitions; a filter picks the lines whose name contains
//! it. Set RAYON_NUM_THREADS for the number of threads. Imports the library and the tests' clouds.

use std::hint::black_box;
use std::time::Instant;

use donut::emd::exact::{assign, assign_within};
use donut::emd::reach::{Method, next_reachable};
use donut::emd::schedule::{Power, Settings};
use donut::emd::sinkhorn::divergence;
use donut::emd::transport::transport;
use donut::emd::{Measure, Real};
use donut::math::cloud::Point;

#[path = "../tests/emd/clouds.rs"]
mod clouds;

const REPETITIONS: usize = 11;
/// The tolerance of the auction's case, as a part of the exact distance.
const TOLERANCE: f64 = 2e-4;

fn main() {
    let filter = std::env::args().skip(1).find(|a| !a.starts_with('-')).unwrap_or_default();
    for n in [500, 1000, 2000, 5000] {
        for (shapes, x, y) in pairs(n) {
            let time = |name: &str, work: &dyn Fn()| {
                let name = format!("{shapes}/{n}/{name}");
                if name.contains(&filter) {
                    report(&name, work);
                }
            };
            let exact = assign(&x, &y).mean_distance;
            time("sinkhorn-f32", &|| sinkhorn::<f32>(&x, &y));
            time("sinkhorn-f64", &|| sinkhorn::<f64>(&x, &y));
            time("exact", &|| drop(black_box(assign(&x, &y))));
            time("within-0.02%", &|| drop(black_box(assign_within(&x, &y, TOLERANCE * exact))));
            time("reach-exact", &|| drop(black_box(next_reachable(&x, &y, 20, 0.005, Method::Exact))));
            if n <= 1000 {
                let less = Measure::uniform(&y[..n * 4 / 5]);
                time("transport", &|| drop(black_box(transport(Measure::uniform(&x), less, Power::One))));
                time("reach-sinkhorn", &|| {
                    drop(black_box(next_reachable(&x, &y, 20, 0.005, Method::Sinkhorn)));
                });
            }
        }
    }
}

fn pairs(n: usize) -> [(&'static str, Vec<Point>, Vec<Point>); 3] {
    let bar = |middle: f64, half: f64, seed: u64| {
        let size = [half, 0.05, 0.05];
        let place = |p: Point| {
            std::array::from_fn(|a| if a == 0 { middle } else { 0.5 } + size[a] * (2.0 * p[a] - 1.0))
        };
        clouds::cube(n, seed).into_iter().map(place).collect::<Vec<Point>>()
    };
    let two_bars = [bar(0.3, 0.1, 4), bar(0.7, 0.1, 5)].concat().into_iter().step_by(2).collect();
    let disc = clouds::ball(n, 0.2, 6).into_iter().map(|p| [p[0], 0.3 + 0.1 * p[1], p[2]]).collect();
    [
        ("ball-torus", clouds::ball(n, 0.12, 1), clouds::torus(n, 0.15, 0.05, 2)),
        ("bar-bars", bar(0.5, 0.2, 3), two_bars),
        ("ball-disc", clouds::ball(n, 0.12, 1), disc),
    ]
}

fn sinkhorn<T: Real>(x: &[Point], y: &[Point]) {
    let _ = black_box(divergence::<T>(Measure::uniform(x), Measure::uniform(y), &Settings::default()));
}

fn report(name: &str, work: &dyn Fn()) {
    work();
    let mut milliseconds: Vec<f64> = (0..REPETITIONS)
        .map(|_| {
            let start = Instant::now();
            work();
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    milliseconds.sort_by(f64::total_cmp);
    println!("{name:<34} median {:9.3} ms   best {:9.3} ms", milliseconds[REPETITIONS / 2], milliseconds[0]);
}
