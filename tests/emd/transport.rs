//! Exact transport against POT and against the assignment.

use donut::emd::schedule::Power;
use donut::emd::transport::transport;
use donut::emd::{EmdError, Measure, exact::assign};

use super::clouds::{ball, cube, torus};
use super::golden::Golden;

#[test]
fn every_golden_case_costs_what_pot_says() {
    for mut case in Golden::all() {
        let (x, y) = (case.cloud("x"), case.cloud("y"));
        let (a, b) = (case.array("a"), case.array("b"));
        let weighted = case.is_weighted();
        let source = Measure { points: &x, weights: weighted.then_some(&a) };
        let target = Measure { points: &y, weights: weighted.then_some(&b) };
        let power = if case.p() == 1 { Power::One } else { Power::Two };
        let expected = case.number("exact_emd");
        let found = transport(source, target, power).unwrap();
        let error = (found.value - expected).abs();
        assert!(found.optimal && error < 1e-9, "{}: {} for {expected}", case.name, found.value);
        for (k, &w) in a.iter().enumerate() {
            let sent: f64 = found.plan.iter().filter(|s| s.source == k).map(|s| s.mass).sum();
            assert!((sent - w).abs() < 1e-12, "{}: row {k} sends {sent} of {w}", case.name);
        }
        for (k, &w) in b.iter().enumerate() {
            let got: f64 = found.plan.iter().filter(|s| s.target == k).map(|s| s.mass).sum();
            assert!((got - w).abs() < 1e-12, "{}: column {k} gets {got} of {w}", case.name);
        }
    }
}

#[test]
fn equal_sizes_agree_with_the_assignment() {
    let (x, y) = (ball(300, 0.2, 1), torus(300, 0.3, 0.1, 2));
    let found = transport(Measure::uniform(&x), Measure::uniform(&y), Power::One).unwrap();
    assert!((found.value - assign(&x, &y).mean_distance).abs() < 1e-12);
    assert_eq!(found.plan.len(), 300);
}

#[test]
fn every_point_counted_twice_changes_nothing() {
    let (x, y) = (cube(60, 1), cube(90, 2));
    let once = transport(Measure::uniform(&x), Measure::uniform(&y), Power::One).unwrap();
    let doubled = [x.clone(), x].concat();
    let twice = transport(Measure::uniform(&doubled), Measure::uniform(&y), Power::One).unwrap();
    assert!((once.value - twice.value).abs() < 1e-12);
}

#[test]
fn too_many_pairs_are_refused() {
    let (x, y) = (vec![[0.0; 3]; 20_000], vec![[1.0; 3]; 6000]);
    let refused = transport(Measure::uniform(&x), Measure::uniform(&y), Power::One);
    assert!(matches!(refused, Err(EmdError::TooLarge { .. })));
}
