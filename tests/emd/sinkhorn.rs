//! The Sinkhorn divergence against GeomLoss, arithmetic and finite differences.

use donut::emd::schedule::{Power, Settings};
use donut::emd::sinkhorn::{Divergence, divergence};
use donut::emd::{Measure, Real};
use donut::math::cloud::{Point, norm};

use crate::clouds::{ball, cube, torus};
use crate::golden::Golden;

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
