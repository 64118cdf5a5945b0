//! The point of a cloud that is nearest to a place: a k-d tree.
//!
//! For one nearest point, also from far away; [`Neighbours`](super::neighbours::Neighbours) finds all within a radius.
//! Bentley 1975, "Multidimensional binary search trees used for associative searching". Imports point clouds.

use super::cloud::{Bounds, Point, distance};
use super::neighbours::Neighbour;

/// Points that are not divided further.
const LEAF: usize = 8;

/// A cloud that was halved along its longest side again and again.
#[derive(Clone, Debug)]
pub struct KdTree {
    /// The points in the order of the leaves, with their indices in the cloud.
    points: Vec<(Point, usize)>,
    /// The planes of the halvings, in the order of a walk that takes the lower half first.
    planes: Vec<Plane>,
}

#[derive(Clone, Copy, Debug)]
struct Plane {
    axis: usize,
    at: f64,
    /// Planes within the lower half.
    below: usize,
}

impl KdTree {
    /// Sorts a cloud of finite points.
    pub fn new(cloud: &[Point]) -> Self {
        let mut points: Vec<(Point, usize)> = cloud.iter().copied().zip(0..).collect();
        let mut planes = Vec::new();
        halve(&mut points, &mut planes);
        Self { points, planes }
    }

    /// The point nearest to `place`, of equally near ones the one that comes first in the cloud; `None` in an empty
    /// cloud.
    pub fn nearest(&self, place: Point) -> Option<Neighbour> {
        let mut best: Option<Neighbour> = None;
        search(&self.points, &self.planes, place, &mut best);
        best
    }
}

fn halve(points: &mut [(Point, usize)], planes: &mut Vec<Plane>) {
    if points.len() <= LEAF {
        return;
    }
    let places: Vec<Point> = points.iter().map(|p| p.0).collect();
    let size = Bounds::of(&places).expect("there are points").size();
    let axis = (0..3).fold(0, |best, a| if size[a] > size[best] { a } else { best });
    let middle = points.len() / 2;
    // Ties by index: the tree must not hang on the order that a selection leaves.
    points.select_nth_unstable_by(middle, |p, q| p.0[axis].total_cmp(&q.0[axis]).then(p.1.cmp(&q.1)));
    let plane = planes.len();
    planes.push(Plane { axis, at: points[middle].0[axis], below: 0 });
    let (low, high) = points.split_at_mut(middle);
    halve(low, planes);
    planes[plane].below = planes.len() - plane - 1;
    halve(high, planes);
}

fn search(points: &[(Point, usize)], planes: &[Plane], place: Point, best: &mut Option<Neighbour>) {
    if points.len() <= LEAF {
        for &(p, index) in points {
            let next = Neighbour { index, distance: distance(place, p) };
            let is_nearer = |b: &Neighbour| (next.distance, index) < (b.distance, b.index);
            if best.as_ref().is_none_or(is_nearer) {
                *best = Some(next);
            }
        }
        return;
    }
    let Plane { axis, at, below } = planes[0];
    let (low, high) = points.split_at(points.len() / 2);
    let (low_planes, high_planes) = planes[1..].split_at(below);
    let beyond = place[axis] - at;
    let (near, far) = if beyond < 0.0 {
        ((low, low_planes), (high, high_planes))
    } else {
        ((high, high_planes), (low, low_planes))
    };
    search(near.0, near.1, place, best);
    if best.as_ref().is_none_or(|b| beyond.abs() <= b.distance) {
        search(far.0, far.1, place, best);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{seeded, uniform};

    #[test]
    fn agrees_with_looking_at_every_point() {
        let mut rng = seeded(1, "k-d tree");
        for n in [1, 7, 8, 9, 100, 1000] {
            // Coarse coordinates, so that there are ties.
            let mut draw = || -> Point { std::array::from_fn(|_| (20.0 * uniform(&mut rng)).floor() / 20.0) };
            let cloud: Vec<Point> = (0..n).map(|_| draw()).collect();
            let tree = KdTree::new(&cloud);
            for k in 0..200 {
                // Some of the places are far away.
                let place = draw().map(|x| if k % 5 == 0 { 7.0 * x - 3.0 } else { x + 0.003 });
                let all = cloud.iter().enumerate().map(|(index, p)| (distance(place, *p), index));
                let (d, index) = all.min_by(|a, b| a.partial_cmp(b).unwrap()).unwrap();
                assert_eq!(tree.nearest(place), Some(Neighbour { index, distance: d }));
            }
        }
        assert_eq!(KdTree::new(&[]).nearest([0.0; 3]), None);
    }
}
