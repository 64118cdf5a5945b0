//! Times of the earth mover's distance on three pairs of shapes: `cargo bench --bench emd [FILTER]`.
//!
//! Set RAYON_NUM_THREADS for the number of threads. `benches/compare_emd.py` puts other libraries' times
//! beside these. Imports the library and the tests' clouds.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use donut::emd::Measure;
use donut::emd::exact::{assign, assign_within};
use donut::emd::reach::{Method, next_reachable};
use donut::emd::schedule::Settings;
use donut::emd::sinkhorn::divergence;
use donut::math::cloud::Point;

#[path = "../tests/emd/clouds.rs"]
mod clouds;

/// The tolerance of the auction's case, as a part of the exact distance.
const TOLERANCE: f64 = 2e-4;

fn all(criterion: &mut Criterion) {
    for n in [500, 1000, 2000, 5000] {
        for (shapes, x, y) in pairs(n) {
            let mut group = criterion.benchmark_group(shapes);
            let tolerance = TOLERANCE * assign(&x, &y).mean_distance;
            group.bench_function(BenchmarkId::new("exact", n), |b| b.iter(|| assign(&x, &y)));
            group.bench_function(BenchmarkId::new("auction", n), |b| {
                b.iter(|| assign_within(&x, &y, tolerance));
            });
            group.bench_function(BenchmarkId::new("reach", n), |b| {
                b.iter(|| next_reachable(&x, &y, 20, 0.005, Method::Exact).map(|reached| reached.emd));
            });
            group.bench_function(BenchmarkId::new("sinkhorn", n), |b| {
                let (x, y) = (Measure::uniform(&x), Measure::uniform(&y));
                b.iter(|| divergence::<f32>(x, y, &Settings::default()).map(|found| found.value));
            });
            group.finish();
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

criterion_group! {
    name = emd;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1));
    targets = all
}
criterion_main!(emd);
