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

/// How far a cloud is from the same one turned about the vertical axis through the middle, or mirrored, at most.
fn asymmetry(cloud: &[Point]) -> f64 {
    let image = |turn: f64, mirror: f64| -> Vec<Point> {
        let (sin, cos) = turn.to_radians().sin_cos();
        let turned = |p: &Point| {
            let (x, z) = (mirror * (p[0] - 0.5), p[2] - 0.5);
            [0.5 + cos * x - sin * z, p[1], 0.5 + sin * x + cos * z]
        };
        cloud.iter().map(turned).collect()
    };
    let ways = [(45.0, 1.0), (90.0, 1.0), (180.0, 1.0), (0.0, -1.0)];
    ways.map(|(turn, mirror)| assign(cloud, &image(turn, mirror)).mean_distance)
        .into_iter()
        .fold(0.0, f64::max)
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
    // The hole opens about the axis it is to have.
    let center = donut::math::cloud::centroid(&found.cloud);
    let goal = donut::math::cloud::centroid(&y);
    assert!(distance(center, goal) < 0.01, "{center:?}, {goal:?}");
}

#[test]
fn the_hole_opens_alike_on_all_sides() {
    let (x, y) = ball_and_ring();
    // No sample is wholly symmetric: the moved cloud may be no less so than the two that it lies between.
    let sampled = f64::max(asymmetry(&x), asymmetry(&y));
    for method in [Method::Exact, Method::Sinkhorn] {
        let cloud = next_reachable(&x, &y, 20, 0.005, method).unwrap().cloud;
        let moved = asymmetry(&cloud);
        assert!(moved < 1.1 * sampled, "{method:?}: {moved}, {sampled} before and in the goal");
        let mut free = [f64::INFINITY; 8];
        for p in &cloud {
            let (east, south) = (p[0] - 0.5, p[2] - 0.5);
            let sector = (south.atan2(east).to_degrees().rem_euclid(360.0) / 45.0) as usize % 8;
            free[sector] = free[sector].min(east.hypot(south));
        }
        // The ring leaves 0.1 free; no eighth of the hole may be much narrower.
        assert!(free.iter().all(|r| (0.08..0.11).contains(r)), "{method:?}: {free:?}");
    }
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
