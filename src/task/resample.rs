//! Brings a cloud to a wanted number of evenly spread points.
//!
//! A cloud of any size comes in; exactly `count` points of the same solid go out, the same for the same
//! seed. More points than wanted are thinned, fewer are first multiplied between near neighbours. Imports
//! point clouds and random numbers.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::neighbours::{Neighbours, spacing};
use super::volume::measure_volume;
use crate::math::cloud::Point;
use crate::math::rng::{Pcg64, sample_indices, seeded, uniform};

/// Candidates per wanted point: with three, thinning finds an even subset of even a clumpy cloud.
const CANDIDATES: usize = 3;

/// A new point lies between a point and one of this many nearest neighbours.
const PARENTS: usize = 6;

/// Exactly `count` points, evenly spread over the solid that `cloud` fills. Every point is one of the
/// cloud or lies between near neighbours, so nothing leaves the solid and no hole is bridged that is wider
/// than the points are apart. An empty cloud stays empty.
pub fn resample(cloud: &[Point], count: usize, seed: u64) -> Vec<Point> {
    if cloud.is_empty() || count == 0 {
        return Vec::new();
    }
    let mut rng = seeded(seed, "resample");
    let mut pool = cloud.to_vec();
    while pool.len() < CANDIDATES * count {
        multiply(&mut pool, CANDIDATES * count, &mut rng);
    }
    // A cloud far larger than needed would make every neighbourhood huge.
    if pool.len() > 4 * CANDIDATES * count {
        let kept = sample_indices(&mut rng, pool.len(), 4 * CANDIDATES * count);
        pool = kept.into_iter().map(|i| pool[i]).collect();
    }
    thin(&pool, count)
}

/// Adds points between near neighbours until the pool has doubled or holds `wanted` points.
fn multiply(pool: &mut Vec<Point>, wanted: usize, rng: &mut Pcg64) {
    let parents = pool.clone();
    let grid = Neighbours::new(&parents, spacing(measure_volume(&parents), parents.len()));
    let missing = (wanted - parents.len()).min(parents.len());
    for i in sample_indices(rng, parents.len(), missing) {
        let a = parents[i];
        let near = grid.nearest(a, PARENTS + 1);
        let other = (uniform(rng) * near.len() as f64) as usize;
        let b = parents[near[other].index];
        let t = uniform(rng);
        pool.push(std::array::from_fn(|k| a[k] + t * (b[k] - a[k])));
    }
}

/// Sample elimination: removes, one by one, the point that is most crowded. (Yuksel 2015, "Sample
/// elimination for generating Poisson disk sample sets", with its weight function.)
fn thin(pool: &[Point], count: usize) -> Vec<Point> {
    // The largest possible distance between `count` points that are spread evenly: twice the radius of
    // the densest packing of balls.
    let volume = measure_volume(pool);
    let reach = 2.0 * (volume / (4.0 * 2f64.sqrt() * count as f64)).cbrt();
    let crowding = |distance: f64| (1.0 - distance / reach).max(0.0).powi(8);
    let grid = Neighbours::new(pool, reach);
    let near: Vec<Vec<(usize, f64)>> = (0..pool.len())
        .map(|i| {
            let others = grid.within(pool[i], reach).into_iter().filter(|n| n.index != i);
            others.map(|n| (n.index, if reach > 0.0 { crowding(n.distance) } else { 1.0 })).collect()
        })
        .collect();

    let mut weight: Vec<f64> = near.iter().map(|n| n.iter().map(|(_, w)| w).sum()).collect();
    let mut alive = vec![true; pool.len()];
    // Non-negative floats order like their bits. Entries go stale when a weight falls; the true one
    // follows in the heap. Equal weights: the later point goes first.
    let mut queue: BinaryHeap<(u64, usize)> = weight.iter().map(|w| w.to_bits()).zip(0..).collect();
    let mut left = pool.len();
    while left > count {
        let Some((bits, i)) = queue.pop() else { break };
        if !alive[i] || bits != weight[i].to_bits() {
            continue;
        }
        alive[i] = false;
        left -= 1;
        for &(j, w) in near[i].iter().filter(|(j, _)| alive[*j]) {
            weight[j] = (weight[j] - w).max(0.0);
            queue.push((weight[j].to_bits(), j));
        }
    }
    let survivors = pool.iter().zip(&alive).filter(|(_, alive)| **alive);
    survivors.map(|(p, _)| *p).collect()
}

/// Splits `total` into whole shares in proportion to positive `weights`, by largest remainder; every share
/// is at least 1 if `total` allows.
pub fn shares(total: usize, weights: &[f64]) -> Vec<usize> {
    let sum: f64 = weights.iter().sum();
    let exact: Vec<f64> = weights.iter().map(|w| total as f64 * w / sum).collect();
    let mut whole: Vec<usize> = exact.iter().map(|e| e.floor() as usize).collect();
    let mut by_remainder: Vec<usize> = (0..weights.len()).collect();
    by_remainder.sort_by_key(|&i| (Reverse(((exact[i].fract()) * 1e12) as u64), i));
    let missing = total.saturating_sub(whole.iter().sum());
    for &i in by_remainder.iter().cycle().take(missing) {
        whole[i] += 1;
    }
    while total >= weights.len()
        && let Some(empty) = whole.iter().position(|w| *w == 0)
    {
        let Some(richest) = (0..whole.len()).max_by_key(|&i| (whole[i], Reverse(i))) else { break };
        whole[richest] -= 1;
        whole[empty] += 1;
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::cloud::{Bounds, centroid, distance};
    use crate::task::shapes::Solid;

    fn random_ball(n: usize) -> Vec<Point> {
        let mut rng = seeded(9, "random ball");
        let mut points: Vec<Point> = Vec::new();
        while points.len() < n {
            let p: Point = std::array::from_fn(|_| 2.0 * uniform(&mut rng) - 1.0);
            if distance(p, [0.0; 3]) <= 1.0 {
                points.push(p);
            }
        }
        points
    }

    #[test]
    fn up_and_down_keep_count_bounds_and_spread() {
        let cloud = random_ball(2000);
        let around = Bounds::of(&cloud).unwrap();
        for count in [700, 2000, 5000] {
            let even = resample(&cloud, count, 3);
            assert_eq!(even.len(), count);
            assert_eq!(Bounds::of(&even).unwrap().union(&around), around);
            assert!(distance(centroid(&even), centroid(&cloud)) < 0.03);
            // A solid ball has mean squared radius 0.6: thinning may favour the rim only a little.
            let spread = even.iter().map(|p| distance(*p, [0.0; 3]).powi(2)).sum::<f64>() / count as f64;
            println!("{count}: mean squared radius {spread:.4}");
            assert!((spread - 0.6).abs() < 0.03, "{count}: {spread}");
            let s = spacing(4.19, count);
            let grid = Neighbours::new(&even, s);
            let near: Vec<f64> = even.iter().map(|p| grid.nearest(*p, 2)[1].distance / s).collect();
            let mean = near.iter().sum::<f64>() / count as f64;
            println!("{count}: mean nearest {mean:.3} spacings");
            assert!(mean > 0.72, "{count}: mean nearest neighbour at {mean} spacings");
        }
    }

    #[test]
    fn a_hole_stays_open() {
        let ring: Vec<Point> = Solid::Disc { radius: 1.3, height: 0.8 }
            .fill([0.0; 3], 3000, 1)
            .into_iter()
            .filter(|p| p[0] * p[0] + p[2] * p[2] > 0.43 * 0.43)
            .collect();
        let closest = |cloud: &[Point]| {
            cloud.iter().map(|p| (p[0] * p[0] + p[2] * p[2]).sqrt()).fold(f64::INFINITY, f64::min)
        };
        assert!(closest(&resample(&ring, 5000, 1)) > 0.9 * 0.43);
    }

    #[test]
    fn few_equal_and_no_points() {
        assert!(resample(&[], 5, 0).is_empty());
        assert_eq!(resample(&[[1.0, 2.0, 3.0]], 4, 0), vec![[1.0, 2.0, 3.0]; 4]);
        assert_eq!(resample(&[[1.0; 3]; 30], 7, 0).len(), 7);
        let flat: Vec<Point> = (0..400).map(|i| [(i % 20) as f64, 0.0, (i / 20) as f64]).collect();
        assert_eq!(resample(&flat, 900, 0).len(), 900);
    }

    #[test]
    fn repeats_by_seed() {
        let cloud = random_ball(300);
        assert_eq!(resample(&cloud, 500, 1), resample(&cloud, 500, 1));
        assert_ne!(resample(&cloud, 500, 1), resample(&cloud, 500, 2));
    }

    #[test]
    fn shares_sum_up_and_leave_none_out() {
        assert_eq!(shares(10, &[1.0, 1.0]), [5, 5]);
        assert_eq!(shares(7, &[1.0, 1.0]), [4, 3]);
        assert_eq!(shares(100, &[1e-9, 1.0]), [1, 99]);
        assert_eq!(shares(1, &[1.0, 1.0]).iter().sum::<usize>(), 1);
    }
}
