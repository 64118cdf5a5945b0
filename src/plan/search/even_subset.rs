//! A few of many points that lie like all of them.
//!
//! A cloud comes in, indices go out. Imports `math` only.

use crate::math::cloud::{Bounds, Point};

/// Indices of `m` of the points, spread like all of them: the cloud is halved along its longest side again
/// and again, and each part gives as many as its share.
pub fn even_subset(points: &[Point], m: usize) -> Vec<usize> {
    let mut ids: Vec<usize> = (0..points.len()).collect();
    let mut chosen = Vec::with_capacity(m);
    halve(points, &mut ids, m.min(points.len()), &mut chosen);
    chosen.sort_unstable();
    chosen
}

fn halve(points: &[Point], ids: &mut [usize], m: usize, chosen: &mut Vec<usize>) {
    if m == 0 {
        return;
    }
    if m == ids.len() {
        chosen.extend_from_slice(ids);
        return;
    }
    let part: Vec<Point> = ids.iter().map(|&i| points[i]).collect();
    let bounds = Bounds::of(&part).expect("fewer points are wanted than there are");
    let size = bounds.size();
    let axis = (0..3).fold(0, |best, a| if size[a] > size[best] { a } else { best });
    // Ties by index: the choice must not hang on the order that a sort leaves.
    let middle = if m == 1 { ids.len() / 2 } else { ids.len() * (m / 2) / m };
    ids.select_nth_unstable_by(middle, |&i, &k| points[i][axis].total_cmp(&points[k][axis]).then(i.cmp(&k)));
    if m == 1 {
        chosen.push(ids[middle]);
        return;
    }
    let (low, high) = ids.split_at_mut(middle);
    halve(points, low, m / 2, chosen);
    halve(points, high, m - m / 2, chosen);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_subset_keeps_the_shape_and_every_corner_of_it() {
        let grid: Vec<Point> =
            (0..1000).map(|i| [i % 10, i / 10 % 10, i / 100].map(|k| f64::from(k) / 9.0)).collect();
        let chosen = even_subset(&grid, 125);
        assert_eq!(chosen.len(), 125);
        assert!(chosen.windows(2).all(|w| w[0] < w[1]));
        // Every eighth of the cube has its share.
        for corner in 0..8 {
            let side = |a: usize| corner >> a & 1 == 1;
            let inside = chosen.iter().filter(|&&i| (0..3).all(|a| (grid[i][a] > 0.5) == side(a))).count();
            assert!((13..=18).contains(&inside), "{corner}: {inside}");
        }
        assert_eq!(even_subset(&grid, 1000), (0..1000).collect::<Vec<_>>());
        assert!(even_subset(&grid, 0).is_empty());
    }
}
