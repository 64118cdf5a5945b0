//! The exact assignment against POT, brute force and arithmetic.

use donut::emd::exact::{Assignment, assign, assign_within};
use donut::math::cloud::{Point, distance};
use proptest::prelude::*;

use super::clouds::{ball, cube, torus};
use super::golden::Golden;

fn is_permutation(assignment: &Assignment) -> bool {
    let mut seen = assignment.target_of.clone();
    seen.sort_unstable();
    seen.iter().enumerate().all(|(k, &j)| k == j)
}

#[test]
fn assignments_cost_what_pot_says() {
    let mut compared = 0;
    for mut case in Golden::all() {
        let (x, y) = (case.cloud("x"), case.cloud("y"));
        if x.len() != y.len() || case.is_weighted() || case.p() != 1 {
            continue;
        }
        let expected = case.number("exact_emd");
        let found = assign(&x, &y);
        let error = (found.mean_distance - expected).abs();
        assert!(error < 1e-9, "{}: {} for {expected}", case.name, found.mean_distance);
        assert!(is_permutation(&found), "{}", case.name);
        compared += 1;
    }
    assert!(compared >= 12, "{compared} cases compared");
}

#[test]
fn a_tolerance_is_kept() {
    let (x, y) = (ball(1000, 0.2, 1), torus(1000, 0.3, 0.1, 2));
    let exact = assign(&x, &y).mean_distance;
    for tolerance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-7, 0.0, -1.0, f64::NAN] {
        let found = assign_within(&x, &y, tolerance);
        assert!(is_permutation(&found));
        let excess = found.mean_distance - exact;
        assert!(excess > -1e-12 && excess <= tolerance.max(1e-12), "{tolerance}: {excess}");
    }
}

#[test]
fn translation_permutation_and_coincidence() {
    let x = cube(500, 1);
    let shift = [0.3, -0.2, 0.6];
    let moved: Vec<Point> = x.iter().map(|p| std::array::from_fn(|a| p[a] + shift[a])).collect();
    assert!((assign(&x, &moved).mean_distance - 0.7).abs() < 1e-12);

    let reversed: Vec<Point> = x.iter().rev().copied().collect();
    let found = assign(&x, &reversed);
    assert_eq!(found.mean_distance, 0.0);
    assert!(found.target_of.iter().enumerate().all(|(i, &j)| i + j == 499));

    let heap = vec![[0.1, 0.2, 0.3]; 300];
    assert_eq!(assign(&heap, &heap).mean_distance, 0.0);
    let far = vec![[0.1, 1.2, 0.3]; 300];
    let found = assign(&heap, &far);
    assert!((found.mean_distance - 1.0).abs() < 1e-12 && is_permutation(&found));
}

#[test]
fn heaps_of_equal_points_go_to_the_right_heaps() {
    // 200 points on each of three sites to 300 on each of two: 2 x 200 stay, the rest moves by one.
    let site = |x: f64, n: usize| vec![[x, 0.0, 0.0]; n];
    let source = [site(0.0, 200), site(1.0, 200), site(2.0, 200)].concat();
    let target = [site(0.0, 300), site(2.0, 300)].concat();
    let found = assign(&source, &target);
    assert!((found.mean_distance - 200.0 / 600.0).abs() < 1e-12 && is_permutation(&found));
}

#[test]
fn tiny_and_extreme_clouds() {
    assert_eq!(assign(&[], &[]), Assignment { target_of: vec![], mean_distance: 0.0 });
    assert_eq!(assign(&[[1.0; 3]], &[[1.0; 3]]).target_of, [0]);
    assert_eq!(assign(&[[0.0; 3]], &[[0.0, 3.0, 4.0]]).mean_distance, 5.0);
    for unit in [1e-30, 1e30] {
        let scaled =
            |cloud: Vec<Point>| -> Vec<Point> { cloud.iter().map(|p| p.map(|v| v * unit)).collect() };
        let found = assign(&scaled(cube(100, 1)), &scaled(cube(100, 2))).mean_distance / unit;
        let expected = assign(&cube(100, 1), &cube(100, 2)).mean_distance;
        assert!((found - expected).abs() < 1e-12, "unit {unit}");
    }
}

/// The least mean distance over all permutations, by recursion.
fn brute_force(source: &[Point], free: &mut Vec<Point>) -> f64 {
    let Some((first, rest)) = source.split_first() else { return 0.0 };
    let mut least = f64::INFINITY;
    for k in 0..free.len() {
        let target = free.swap_remove(k);
        least = least.min(distance(*first, target) + brute_force(rest, free));
        free.push(target);
        let last = free.len() - 1;
        free.swap(k, last);
    }
    least
}

/// Coordinates on a coarse lattice make ties and coincident points; the others make none.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![(0..3i32).prop_map(f64::from), -1.0..3.0f64]
}

proptest! {
    #[test]
    fn brute_force_agrees(pairs in prop::collection::vec(
        (prop::array::uniform3(coordinate()), prop::array::uniform3(coordinate())), 1..=7)) {
        let (x, mut y): (Vec<Point>, Vec<Point>) = pairs.into_iter().unzip();
        let found = assign(&x, &y);
        prop_assert!(is_permutation(&found));
        let least = brute_force(&x, &mut y) / x.len() as f64;
        prop_assert!((found.mean_distance - least).abs() < 1e-12, "{} for {least}", found.mean_distance);
    }
}
