//! The order in which a cloud is packed: neighbours in space stand near one another.
//!
//! Points come in, a permutation of their indices goes out. Imports [`crate::math`] and the sizes of a pack.

use super::packed::{BLOCK, CLUSTER};
use crate::math::cloud::{Bounds, Point};

/// An order in which every run of [`BLOCK`] points, and in it of [`CLUSTER`], is compact: halve the cloud across its longest
/// side, again and again. Ties are broken by index, so the order depends on nothing but the points.
pub fn compact_order(points: &[Point]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let mut parts = vec![&mut order[..]];
    while let Some(part) = parts.pop() {
        if part.len() <= CLUSTER {
            continue;
        }
        let axis = longest_side(points, part);
        let unit = if part.len() > BLOCK { BLOCK } else { CLUSTER };
        let middle = (part.len() / 2).next_multiple_of(unit);
        part.select_nth_unstable_by(middle, |&i, &j| {
            points[i as usize][axis].total_cmp(&points[j as usize][axis]).then(i.cmp(&j))
        });
        let (left, right) = part.split_at_mut(middle);
        parts.extend([left, right]);
    }
    order
}

fn longest_side(points: &[Point], part: &[u32]) -> usize {
    let first = points[part[0] as usize];
    let mut bounds = Bounds { min: first, max: first };
    for &i in part {
        for axis in 0..3 {
            bounds.min[axis] = bounds.min[axis].min(points[i as usize][axis]);
            bounds.max[axis] = bounds.max[axis].max(points[i as usize][axis]);
        }
    }
    let size = bounds.size();
    (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng;

    #[test]
    fn the_order_is_a_permutation() {
        let mut rng = rng::seeded(5, "packed");
        let points: Vec<Point> = (0..333).map(|_| std::array::from_fn(|_| rng::uniform(&mut rng))).collect();
        let mut order = compact_order(&points);
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(k, &i)| k == i as usize));
    }
}
