//! The Sinkhorn divergence against GeomLoss, arithmetic and finite differences.

use donut::emd::schedule::{Power, Settings};
use donut::emd::sinkhorn::{Divergence, divergence};
use donut::emd::{EmdError, Measure, Real};
use donut::math::cloud::{Point, norm};

use super::clouds::{ball, cube, torus};
use super::golden::Golden;

fn of<T: Real>(x: &[Point], y: &[Point], settings: &Settings) -> Divergence {
    divergence::<T>(Measure::uniform(x), Measure::uniform(y), settings).unwrap()
}

fn settings_of(case: &mut Golden, debias: bool) -> Settings {
    let given = case.number("diameter_given");
    Settings {
        power: if case.p() == 1 { Power::One } else { Power::Two },
        blur: case.number("blur"),
        scaling: case.number("scaling"),
        diameter: (!given.is_nan()).then_some(given),
        debias,
    }
}

fn length(rows: impl Iterator<Item = f64>) -> f64 {
    rows.map(|v| v * v).sum::<f64>().sqrt()
}

/// Compares every case, debiased and biased; returns the worst relative errors of value and gradient.
fn compare<T: Real>(value_floor: f64, gradient_floor: f64, tolerance: f64) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for mut case in Golden::all() {
        let (x, y) = (case.cloud("x"), case.cloud("y"));
        let (a, b) = (case.array("a"), case.array("b"));
        for (debias, name) in [(true, "debiased"), (false, "biased")] {
            let settings = settings_of(&mut case, debias);
            let source = Measure { points: &x, weights: Some(&a) };
            let target = Measure { points: &y, weights: Some(&b) };
            let found = divergence::<T>(source, target, &settings).unwrap();
            let value = case.number(&format!("value_{name}"));
            let gradient = case.array(&format!("grad_x_{name}"));

            let error = (found.value - value).abs();
            let label = format!("{} {name}", case.name);
            assert!(error <= value_floor + tolerance * value.abs(), "{label}: {} for {value}", found.value);
            let size = length(gradient.iter().copied());
            let difference = length(found.gradient.iter().flatten().zip(&gradient).map(|(f, g)| f - g));
            assert!(
                difference <= gradient_floor + tolerance * size,
                "{label}: gradient off by {difference} of {size}"
            );
            worst[0] = worst[0].max(error / value.abs().max(value_floor / tolerance));
            worst[1] = worst[1].max(difference / size.max(gradient_floor / tolerance));
        }
    }
    worst
}

#[test]
fn f64_agrees_with_geomloss() {
    let worst = compare::<f64>(1e-9, 1e-12, 1e-6);
    println!("worst relative error of value {:.1e}, of gradient {:.1e}", worst[0], worst[1]);
}

#[test]
fn f32_agrees_with_geomloss() {
    let worst = compare::<f32>(1e-6, 1e-6, 1e-4);
    println!("worst relative error of value {:.1e}, of gradient {:.1e}", worst[0], worst[1]);
}

#[test]
fn two_diracs_are_their_distance_apart() {
    let (x, y) = ([[0.1, 0.2, 0.3]], [[0.4, 0.6, 0.3]]);
    let found = of::<f64>(&x, &y, &Settings::default());
    assert!((found.value - (0.5 - 1e-4)).abs() < 1e-12);
    assert!(found.gradient[0].iter().zip([-0.6, -0.8, 0.0]).all(|(g, e)| (g - e).abs() < 1e-12));
    assert!(found.image[0].iter().zip(y[0]).all(|(i, e)| (i - e).abs() < 1e-12));
    assert!(found.converged && found.marginal_error < 1e-12);
    let biased = of::<f64>(&x, &y, &Settings { debias: false, ..Settings::default() });
    assert!((biased.value - 0.5).abs() < 1e-12);
    let squared = of::<f64>(&x, &y, &Settings { power: Power::Two, ..Settings::default() });
    assert!((squared.value - 0.125).abs() < 1e-12);
}

#[test]
fn identical_clouds_are_at_zero_exactly() {
    let x = cube(300, 1);
    let copies = vec![[0.25; 3]; 40];
    for cloud in [&x, &copies] {
        for power in [Power::One, Power::Two] {
            let settings = Settings { power, ..Settings::default() };
            for found in [of::<f64>(cloud, cloud, &settings), of::<f32>(cloud, cloud, &settings)] {
                assert_eq!(found.value, 0.0);
                assert!(found.gradient.iter().flatten().all(|&g| g == 0.0));
            }
        }
    }
    let reversed: Vec<Point> = x.iter().rev().copied().collect();
    assert!(of::<f64>(&x, &reversed, &Settings::default()).value.abs() < 1e-12);
}

#[test]
fn a_translation_costs_its_length() {
    let x = ball(400, 0.1, 1);
    let moved: Vec<Point> = x.iter().map(|p| [p[0] + 0.4, p[1], p[2]]).collect();
    let settings = Settings { scaling: 0.9, ..Settings::default() };
    let found = of::<f64>(&x, &moved, &settings);
    assert!((found.value - 0.4).abs() < 0.01, "{}", found.value);
    let squared = of::<f64>(&x, &moved, &Settings { power: Power::Two, ..settings });
    assert!((squared.value - 0.08).abs() < 1e-3, "{}", squared.value);
    for g in &squared.gradient {
        assert!((g[0] * 400.0 + 0.4).abs() < 0.1, "{g:?}");
    }
}

#[test]
fn convergence_is_told() {
    let (x, y) = (ball(300, 0.2, 1), torus(300, 0.3, 0.1, 2));
    let paper = of::<f64>(&x, &y, &Settings::default());
    assert!(!paper.converged && paper.marginal_error > 0.05 && paper.marginal_error <= 2.0);
    let careful = of::<f64>(&x, &y, &Settings { blur: 0.2, scaling: 0.99, ..Settings::default() });
    assert!(careful.converged, "{}", careful.marginal_error);
    assert!(careful.iterations > paper.iterations);
}

#[test]
fn a_converged_gradient_is_that_of_the_value() {
    let (x, y) = (ball(40, 0.2, 1), torus(40, 0.3, 0.1, 2));
    let settings = Settings { blur: 0.2, scaling: 0.99, diameter: Some(1.0), ..Settings::default() };
    let found = of::<f64>(&x, &y, &settings);
    for k in [0, 7, 39] {
        for axis in 0..3 {
            let at = |by: f64| {
                let mut moved = x.clone();
                moved[k][axis] += by;
                of::<f64>(&moved, &y, &settings).value
            };
            let difference = (at(1e-4) - at(-1e-4)) / 2e-4;
            let gradient = found.gradient[k][axis];
            assert!(
                (gradient - difference).abs() < 0.01 * norm(found.gradient[k]),
                "{gradient}, {difference}"
            );
        }
    }
}

#[test]
fn what_leaves_the_range_of_numbers_is_refused() {
    let (x, y) = (cube(20, 1), cube(20, 2));
    let of = |x: &[Point], settings: Settings| {
        divergence::<f32>(Measure::uniform(x), Measure::uniform(&y), &settings)
    };
    let squared = Settings { power: Power::Two, blur: 1e-200, ..Settings::default() };
    assert_eq!(of(&x, squared), Err(EmdError::OutOfRange));
    let slow = of(&x, Settings { scaling: 1.0 - 1e-9, ..Settings::default() });
    assert!(matches!(slow, Err(EmdError::Temperatures { .. })));
    let far: Vec<Point> = x.iter().map(|p| p.map(|v| v * 1e300)).collect();
    assert!(matches!(of(&far, Settings::default()), Err(EmdError::TooFar { .. })));
    // So cold that rounding leaves a row no target, and a little warmer, where it sends columns far off:
    // then the error of the marginals is still a number that means something.
    let cold = |blur| of(&x, Settings { blur, ..Settings::default() });
    assert_eq!(cold(1e-10), Err(EmdError::OutOfRange));
    let cold = cold(3e-8).unwrap();
    assert!(!cold.converged && cold.marginal_error <= 2.0, "{}", cold.marginal_error);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let (x, y) = (ball(700, 0.2, 1), torus(500, 0.3, 0.1, 2));
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (of::<f32>(&x, &y, &Settings::default()), of::<f64>(&x, &y, &Settings::default())))
    };
    let one = with_threads(1);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(4));
}
