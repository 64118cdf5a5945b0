//! Which points of a cloud are near a place: a grid over the cloud.
//!
//! A cloud and a cell size come in; neighbours with their distances go out, in a fixed order. Imports
//! point clouds.

use std::ops::Range;

use crate::math::cloud::{Point, distance};

/// A point near the place asked about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Its index in the cloud.
    pub index: usize,
    /// How far it is.
    pub distance: f64,
}

/// A cloud sorted into cubic cells. Most useful when a cell holds a few points.
pub struct Neighbours<'a> {
    cloud: &'a [Point],
    cell: f64,
    /// The points by their cells, those of a cell in the order of the cloud.
    sorted: Vec<Entry>,
    /// Every x and y of a cell that holds a point, in order, with the points above it.
    columns: Vec<([i64; 2], Range<usize>)>,
}

/// A point in its cell.
struct Entry {
    cell: [i64; 3],
    index: usize,
    at: Point,
}

/// Edge of the cube that each of `n` points has to itself in a volume.
pub fn spacing(volume: f64, n: usize) -> f64 {
    (volume / n.max(1) as f64).cbrt()
}

impl<'a> Neighbours<'a> {
    /// Sorts a cloud of finite points into cells of edge `cell` (made positive if it is not).
    pub fn new(cloud: &'a [Point], cell: f64) -> Self {
        let cell = if cell > 0.0 && cell.is_finite() { cell } else { 1.0 };
        let entry = |(index, &at): (usize, &Point)| Entry { cell: cell_of(at, cell), index, at };
        let mut sorted: Vec<Entry> = cloud.iter().enumerate().map(entry).collect();
        sorted.sort_by_key(|e| e.cell);
        let mut columns: Vec<([i64; 2], Range<usize>)> = Vec::new();
        for (k, Entry { cell: [x, y, _], .. }) in sorted.iter().enumerate() {
            match columns.last_mut() {
                Some((column, range)) if *column == [*x, *y] => range.end = k + 1,
                _ => columns.push(([*x, *y], k..k + 1)),
            }
        }
        Self { cloud, cell, sorted, columns }
    }

    /// All points within `radius` of `place` (the place itself too, if it is in the cloud), in the order
    /// of the cells and of the cloud.
    pub fn within(&self, place: Point, radius: f64) -> Vec<Neighbour> {
        let low = cell_of(place.map(|x| x - radius), self.cell);
        let high = cell_of(place.map(|x| x + radius), self.cell);
        let mut found = Vec::new();
        let mut columns = &self.columns[..];
        for x in low[0]..=high[0] {
            let first = columns.partition_point(|(column, _)| *column < [x, low[1]]);
            columns = &columns[first..];
            for (_, range) in columns.iter().take_while(|(column, _)| *column <= [x, high[1]]) {
                let column = &self.sorted[range.clone()];
                let first = column.partition_point(|e| e.cell[2] < low[2]);
                for e in column[first..].iter().take_while(|e| e.cell[2] <= high[2]) {
                    let d = distance(place, e.at);
                    if d <= radius {
                        found.push(Neighbour { index: e.index, distance: d });
                    }
                }
            }
        }
        found
    }

    /// The `k` points nearest to `place` (fewer if the cloud is smaller), nearest first.
    pub fn nearest(&self, place: Point, k: usize) -> Vec<Neighbour> {
        let k = k.min(self.cloud.len());
        let mut radius = 1.5 * self.cell;
        // A far outlier: looking at everything is cheaper than ever wider shells of empty cells.
        let widest = 12.0 * self.cell;
        loop {
            let mut found = if radius > widest {
                let all = self.cloud.iter().enumerate();
                all.map(|(index, p)| Neighbour { index, distance: distance(place, *p) }).collect()
            } else {
                self.within(place, radius)
            };
            if found.len() >= k {
                found.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.index.cmp(&b.index)));
                found.truncate(k);
                return found;
            }
            radius *= 2.0;
        }
    }

    /// The connected pieces of the cloud: indices of the points of each, where points closer than `link` belong
    /// together. In the order of their first points.
    pub fn pieces(&self, link: f64) -> Vec<Vec<usize>> {
        let mut seen = vec![false; self.cloud.len()];
        let mut pieces = Vec::new();
        for first in 0..self.cloud.len() {
            if std::mem::replace(&mut seen[first], true) {
                continue;
            }
            let mut piece = vec![first];
            let mut next = 0;
            while let Some(&i) = piece.get(next) {
                next += 1;
                for near in self.within(self.cloud[i], link) {
                    if !std::mem::replace(&mut seen[near.index], true) {
                        piece.push(near.index);
                    }
                }
            }
            pieces.push(piece);
        }
        pieces
    }
}

fn cell_of(p: Point, cell: f64) -> [i64; 3] {
    p.map(|x| (x / cell).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{seeded, uniform};

    #[test]
    fn agrees_with_looking_at_every_point() {
        let mut rng = seeded(1, "neighbours");
        let mut cloud: Vec<Point> =
            (0..200).map(|_| std::array::from_fn(|_| uniform(&mut rng) - 0.5)).collect();
        cloud.push([9.0, 9.0, 9.0]);
        let grid = Neighbours::new(&cloud, 0.15);
        for place in [cloud[3], cloud[200], [0.1, 0.2, -0.3]] {
            let mut all: Vec<f64> = cloud.iter().map(|p| distance(*p, place)).collect();
            all.sort_by(f64::total_cmp);
            let near: Vec<f64> = grid.nearest(place, 5).iter().map(|n| n.distance).collect();
            assert_eq!(near, all[..5]);
            assert_eq!(grid.within(place, 0.3).len(), all.iter().filter(|d| **d <= 0.3).count());
        }
    }

    #[test]
    fn pieces_are_what_hangs_together_by_short_links() {
        // Two rows with points 1 apart, 3 from one another, and one point by itself.
        let cloud: Vec<Point> = [0.0, 10.0, 1.0, 5.0, 2.0, 6.0].map(|x| [x, 0.0, 0.0]).into_iter().collect();
        let pieces = Neighbours::new(&cloud, 1.5).pieces(1.5);
        assert_eq!(pieces, [vec![0, 2, 4], vec![1], vec![3, 5]]);
        assert_eq!(Neighbours::new(&cloud, 1.5).pieces(3.5).len(), 2);
    }
}
