//! Brings a cloud to a wanted number of evenly spread points.
//!
//! A cloud of any size comes in; exactly `count` points of the same solid go out, the same for the same
//! seed. More points than wanted are thinned, fewer are first multiplied between near neighbours. Imports
//! point clouds and random numbers.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};

use rayon::prelude::*;

use crate::math::cloud::Point;
use crate::math::neighbours::{Neighbours, spacing};
use crate::math::rng::{Pcg64, sample_indices, seeded, uniform};
use crate::math::volume::measure_volume;

/// Candidates per wanted point: with three, thinning finds an even subset of even a clumpy cloud.
const CANDIDATES: usize = 3;

/// A new point lies between points out of this many nearest neighbours: enough that the voids of a random
/// cloud get filled.
const CORNERS: usize = 12;

/// Exactly `count` points, evenly spread over the solid that `cloud` fills. Every point is one of the
/// cloud or lies between near neighbours, so nothing leaves the solid and no hole is bridged that is wider
/// than the points are apart. An empty cloud stays empty.
pub fn resample(cloud: &[Point], count: usize, seed: u64) -> Vec<Point> {
    if cloud.is_empty() || count == 0 {
        return Vec::new();
    }
    let mut rng = seeded(seed, "resample");
    let distinct = distinct(cloud);
    let volume = measure_volume(&distinct);
    // At least as many new ones as are wanted: another seed must be another sample of a large cloud too.
    let wanted = usize::max(CANDIDATES * count, distinct.len() + count);
    let mut pool = multiplied(&distinct, wanted, volume, &mut rng);
    if volume == 0.0 {
        pool.truncate(count);
        return pool;
    }
    // A cloud far larger than needed would make every neighbourhood huge.
    if pool.len() > 4 * CANDIDATES * count {
        let kept = sample_indices(&mut rng, pool.len(), 4 * CANDIDATES * count);
        pool = kept.into_iter().map(|i| pool[i]).collect();
    }
    thin(&pool, count, volume)
}

/// The points without repetitions, in order: repeated ones would crowd each other without end.
fn distinct(cloud: &[Point]) -> Vec<Point> {
    let mut seen = HashSet::new();
    cloud.iter().filter(|p| seen.insert(p.map(f64::to_bits))).copied().collect()
}

/// At least `wanted` points: the cloud and random places between its near neighbours. All corners are
/// points of the cloud itself, so that clumps do not breed.
fn multiplied(cloud: &[Point], wanted: usize, volume: f64, rng: &mut Pcg64) -> Vec<Point> {
    let grid = Neighbours::new(cloud, spacing(volume, cloud.len()));
    let mut pool = cloud.to_vec();
    let order = sample_indices(rng, cloud.len(), cloud.len());
    for &i in order.iter().cycle().take(wanted.saturating_sub(cloud.len())) {
        let near = grid.nearest(cloud[i], CORNERS);
        // Exponential numbers, normalised: uniform over the tetrahedron.
        let corners: [Point; 4] =
            std::array::from_fn(|_| cloud[near[(uniform(rng) * near.len() as f64) as usize].index]);
        let share = corners.map(|_| -(1.0 - uniform(rng)).ln() + f64::MIN_POSITIVE);
        let sum: f64 = share.iter().sum();
        pool.push(std::array::from_fn(|k| {
            // Rounding must not carry a point over the cloud's edge.
            let values = corners.map(|c| c[k]);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            values.iter().zip(&share).map(|(v, w)| v * w / sum).sum::<f64>().clamp(low, high)
        }));
    }
    pool
}

/// Sample elimination: removes, one by one, the point that is most crowded. (Yuksel 2015, "Sample
/// elimination for generating Poisson disk sample sets", with its weight function.) Unlike there, crowding
/// is the mean over the neighbours, not the sum: the sum favours the surface, where neighbours are fewer.
fn thin(pool: &[Point], count: usize, volume: f64) -> Vec<Point> {
    // The largest possible distance between `count` points that are spread evenly: twice the radius of
    // the densest packing of balls.
    let reach = 2.0 * (volume / (4.0 * 2f64.sqrt() * count as f64)).cbrt();
    let near = crowding(pool, reach);
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
        for &(j, _) in near[i].iter().filter(|(j, _)| alive[*j]) {
            let own = near[j].iter().find(|(k, _)| *k == i).map_or(0.0, |(_, w)| *w);
            weight[j] = (weight[j] - own).max(0.0);
            queue.push((weight[j].to_bits(), j));
        }
    }
    let survivors = pool.iter().zip(&alive).filter(|(_, alive)| **alive);
    survivors.map(|(p, _)| *p).collect()
}

/// For each point its neighbours within `reach`, each with its part in how crowded the point is.
fn crowding(pool: &[Point], reach: f64) -> Vec<Vec<(usize, f64)>> {
    let grid = Neighbours::new(pool, reach);
    let neighbours = |(i, p): (usize, &Point)| {
        let mut near = grid.within(*p, reach);
        near.retain(|n| n.index != i);
        let share = 1.0 / near.len().max(1) as f64;
        near.iter().map(|n| (n.index, share * (1.0 - n.distance / reach).powi(8))).collect()
    };
    pool.par_iter().enumerate().map(neighbours).collect()
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
            // A solid ball has mean squared radius 0.6: neither the rim nor the middle may be favoured much.
            let spread = even.iter().map(|p| distance(*p, [0.0; 3]).powi(2)).sum::<f64>() / count as f64;
            assert!((spread - 0.6).abs() < 0.03, "{count}: {spread}");
            let s = spacing(4.19, count);
            let grid = Neighbours::new(&even, s);
            let near: Vec<f64> = even.iter().map(|p| grid.nearest(*p, 2)[1].distance / s).collect();
            // 0.554 for independent uniform points, of which the cloud is made.
            let mean = near.iter().sum::<f64>() / count as f64;
            assert!(mean > 0.64, "{count}: mean nearest neighbour at {mean} spacings");
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
        // Of few points, and of more than enough: what a perfect shape scores is measured by two samples.
        assert_ne!(resample(&cloud, 500, 1), resample(&cloud, 500, 2));
        assert_ne!(resample(&cloud, 50, 1), resample(&cloud, 50, 2));
    }

    #[test]
    fn shares_sum_up_and_leave_none_out() {
        assert_eq!(shares(10, &[1.0, 1.0]), [5, 5]);
        assert_eq!(shares(7, &[1.0, 1.0]), [4, 3]);
        assert_eq!(shares(100, &[1e-9, 1.0]), [1, 99]);
        assert_eq!(shares(1, &[1.0, 1.0]).iter().sum::<usize>(), 1);
    }
}
