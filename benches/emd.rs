use donut::emd::exact::{assign, assign_within};
use std::time::Instant;
#[path = "../tests/emd/clouds.rs"]
#[allow(dead_code)]
mod clouds;
fn time<R>(name: &str, n: usize, mut f: impl FnMut() -> R) {
    let mut t: Vec<f64> = (0..7)
        .map(|_| {
            let s = Instant::now();
            std::hint::black_box(f());
            s.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    t.sort_by(f64::total_cmp);
    println!("{name:<40} n={n:<6} median {:8.3} ms  best {:8.3} ms", t[3], t[0]);
}
fn main() {
    if std::env::var("SK").is_ok() {
        let n = 2000;
        let x = clouds::ball(n, 0.2, 1);
        let y = clouds::torus(n, 0.22, 0.08, 2);
        let m = donut::emd::Measure::uniform;
        let st = donut::emd::schedule::Settings::default();
        time("sinkhorn f32", n, || donut::emd::sinkhorn::divergence::<f32>(m(&x), m(&y), &st));
        return;
    }
    if std::env::var("STAT").is_ok() {
        for n in [1000, 5000] {
            let x = clouds::ball(n, 0.2, 1);
            let y = clouds::torus(n, 0.22, 0.08, 2);
            assign(&x, &y);
        }
        return;
    }
    for n in [500, 1000, 2000, 5000] {
        let x = clouds::ball(n, 0.2, 1);
        let y = clouds::torus(n, 0.22, 0.08, 2);
        time("exact", n, || assign(&x, &y));
        let m = donut::emd::Measure::uniform;
        let st = donut::emd::schedule::Settings::default();
        time("sinkhorn f32", n, || donut::emd::sinkhorn::divergence::<f32>(m(&x), m(&y), &st));
        time("sinkhorn f64", n, || donut::emd::sinkhorn::divergence::<f64>(m(&x), m(&y), &st));
        let e = assign(&x, &y).mean_distance;
        for tol in [2e-4, 1e-4] {
            let w = assign_within(&x, &y, e * tol).mean_distance;
            time(&format!("within {tol} (got {:.1e})", w / e - 1.0), n, || assign_within(&x, &y, e * tol));
        }
        let w = assign_within(&x, &y, 1e-4).mean_distance;
        time(&format!("within 1e-4 abs (got {:.1e})", w / e - 1.0), n, || assign_within(&x, &y, 1e-4));
    }
}
