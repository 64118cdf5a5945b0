//! The next reachable cloud: a ball on its way to a ring.

use donut::emd::EmdError;
use donut::emd::exact::assign;
use donut::emd::reach::{Method, next_reachable};
use donut::math::cloud::{Point, distance};

use super::clouds::{ball, torus};

/// Points within a radius of the vertical axis through the middle.
fn in_the_hole(cloud: &[Point], radius: f64) -> usize {
    cloud.iter().filter(|p| (p[0] - 0.5).hypot(p[2] - 0.5) < radius).count()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn spacing(cloud: &[Point]) -> f64 {
    let nearest = |i: usize| {
        let others = cloud.iter().enumerate().filter(|&(j, _)| j != i);
        others.map(|(_, &q)| distance(cloud[i], q)).fold(f64::INFINITY, f64::min)
    };
    median((0..cloud.len()).map(nearest).collect())
}

fn ball_and_ring() -> (Vec<Point>, Vec<Point>) {
    (ball(1000, 0.12, 1), torus(1000, 0.15, 0.05, 2))
}

#[test]
fn exact_matching_opens_the_hole_and_keeps_the_spacing() {
    let (x, y) = ball_and_ring();
    let before = assign(&x, &y).mean_distance;
    let found = next_reachable(&x, &y, 20, 0.005, Method::Exact).unwrap();
    let after = assign(&found.cloud, &y).mean_distance;
    assert!(in_the_hole(&x, 0.06) > 150, "{}", in_the_hole(&x, 0.06));
    assert!(in_the_hole(&found.cloud, 0.06) < in_the_hole(&x, 0.06) / 10);
    assert!(after < 0.2 * before, "{after} of {before} left");
    assert!(spacing(&found.cloud) > 0.85 * spacing(&x), "{} of {}", spacing(&found.cloud), spacing(&x));
    // Symmetry: the hole opens about the axis it is to have.
    let center = donut::math::cloud::centroid(&found.cloud);
    let goal = donut::math::cloud::centroid(&y);
    assert!(distance(center, goal) < 0.01, "{center:?}, {goal:?}");
}

#[test]
fn one_matching_serves_all_steps() {
    let (x, y) = ball_and_ring();
    let before = assign(&x, &y).mean_distance;
    let found = next_reachable(&x, &y, 20, 0.002, Method::Exact).unwrap();
    let moved: f64 = x.iter().zip(&found.cloud).map(|(&p, &q)| distance(p, q)).sum::<f64>() / 1000.0;
    let after = assign(&found.cloud, &y).mean_distance;
    // Straight moves along an optimal matching: what the points moved is what the distance fell.
    assert!((before - moved - after).abs() < 1e-4, "{before} - {moved} = {after}");
    let target_of = found.target_of.unwrap();
    for (k, &p) in found.cloud.iter().enumerate() {
        assert!(distance(x[k], p) <= 0.04 + 1e-12);
        let straight = distance(x[k], p) + distance(p, y[target_of[k]]) - distance(x[k], y[target_of[k]]);
        assert!(straight.abs() < 1e-12);
    }
}

#[test]
fn sinkhorn_steps_approach_the_goal() {
    let (x, y) = ball_and_ring();
    let before = assign(&x, &y).mean_distance;
    let found = next_reachable(&x, &y, 20, 0.005, Method::Sinkhorn).unwrap();
    let after = assign(&found.cloud, &y).mean_distance;
    assert!(after < 0.7 * before, "{after} of {before} left");
    assert!(in_the_hole(&found.cloud, 0.06) < in_the_hole(&x, 0.06) / 2);
    assert!(x.iter().zip(&found.cloud).all(|(&p, &q)| distance(p, q) <= 0.1 + 1e-9));
    assert_eq!(found.target_of, None);
}

#[test]
fn a_cloud_at_its_goal_stays() {
    let (x, _) = ball_and_ring();
    for method in [Method::Exact, Method::Sinkhorn] {
        let found = next_reachable(&x, &x, 5, 0.005, method).unwrap();
        assert_eq!(found.cloud, x, "{method:?}");
        assert_eq!(found.emd, 0.0);
    }
}

#[test]
fn what_cannot_be_reached_is_refused() {
    let (x, y) = ball_and_ring();
    let unequal = next_reachable(&x, &y[1..], 1, 0.1, Method::Exact);
    assert_eq!(unequal, Err(EmdError::Unequal { source_points: 1000, target_points: 999 }));
    assert!(next_reachable(&x, &y[1..], 1, 0.1, Method::Sinkhorn).is_ok());
    assert_eq!(next_reachable(&[], &[], 1, 0.1, Method::Exact), Err(EmdError::Empty));
    assert_eq!(next_reachable(&x, &y, 1, -0.1, Method::Exact), Err(EmdError::StepLength(-0.1)));
}
