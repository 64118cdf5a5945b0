//! What a shape is like beyond its distance to another: how many pieces, which holes, what closes them.
//!
//! A cloud comes in, a [`ShapeMeasures`] goes out. The EMD hardly tells an open hole from one with a thin
//! membrane, nor two pieces from two that touch; people do. Imports point clouds.

use serde::{Deserialize, Serialize};

use crate::math::cloud::{Bounds, Point};
use crate::math::kd_tree::KdTree;
use crate::math::neighbours::Neighbours;

/// Particles nearer than this belong together, in spacings: in an even cloud the nearest are 1 apart, in a
/// random one hardly ever more than 2.
const LINK: f64 = 2.0;
/// Pieces smaller than this share of all particles are crumbs.
const CRUMB: f64 = 0.01;
/// Seen from above, a place farther than this from all particles is free, in spacings.
const FREE: f64 = 1.0;
/// Raster cells per spacing.
const CELLS_PER_SPACING: f64 = 3.0;
/// A free place of the goal counts as a hole from this radius on, in spacings: smaller ones are chance. A thin sheet of
/// 3000 random points, as models make them, has free places of 1.7 spacings of 5000 particles; a recorded pizza base, two
/// spacings thin, one of 2.06. Holes as wide as the pole have more than three.
const LEAST_HOLE: f64 = 2.5;
/// The membrane is what is within this share of a hole's radius.
const INNER: f64 = 0.6;

/// A vertical hole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hole {
    /// Its middle in x and z, m.
    pub center: [f64; 2],
    /// Radius of the largest upright cylinder, from the table up, in which there is no particle, m.
    pub radius: f64,
}

/// Pieces and holes of one cloud, beside those of its goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShapeMeasures {
    /// Connected pieces of at least 1 % of the dough.
    pub pieces: usize,
    pub pieces_of_goal: usize,
    /// Share of the dough in crumbs, smaller than that.
    pub crumbs: f64,
    /// For every hole of the goal, largest first.
    pub holes: Vec<HoleMeasures>,
}

/// What became of one hole of the goal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HoleMeasures {
    /// Free radius in the goal, m.
    pub goal_radius: f64,
    /// Free radius in the dough, m; 0 if no hole there is open from top to bottom.
    pub radius: f64,
    /// Share of the dough that is within 0.6 of the goal's radius around the hole's middle.
    pub membrane: f64,
}

impl ShapeMeasures {
    /// Measures `cloud` against `goal`, both with particles about `spacing` apart, m.
    pub fn of(cloud: &[Point], goal: &[Point], spacing: f64) -> Self {
        let sizes: Vec<usize> = connected(cloud, spacing).iter().map(Vec::len).collect();
        let (pieces, crumbs): (Vec<usize>, Vec<usize>) =
            sizes.into_iter().partition(|size| is_piece(*size, cloud.len()));
        let mut open = holes(cloud, spacing);
        let measured = wanted_holes(goal, spacing).into_iter().map(|wanted| {
            // The dough's hole that is nearest to the goal's; each serves once.
            let off = |h: &Hole| (h.center[0] - wanted.center[0]).hypot(h.center[1] - wanted.center[1]);
            let near = (0..open.len())
                .filter(|&k| off(&open[k]) < wanted.radius + open[k].radius)
                .min_by(|&a, &b| off(&open[a]).total_cmp(&off(&open[b])));
            let found = near.map(|k| open.remove(k));
            let center = found.map_or(wanted.center, |h| h.center);
            let inside = |p: &&Point| (p[0] - center[0]).hypot(p[2] - center[1]) < INNER * wanted.radius;
            HoleMeasures {
                goal_radius: wanted.radius,
                radius: found.map_or(0.0, |h| h.radius),
                membrane: cloud.iter().filter(inside).count() as f64 / cloud.len() as f64,
            }
        });
        Self {
            holes: measured.collect(),
            pieces: pieces.len(),
            pieces_of_goal: count_pieces(goal, spacing),
            crumbs: crumbs.iter().sum::<usize>() as f64 / cloud.len() as f64,
        }
    }
}

/// The pieces of a goal that have holes.
pub fn pieces_with_holes(goal: &[Point], spacing: f64) -> Vec<Vec<Point>> {
    let pieces = connected(goal, spacing).into_iter().filter(|part| is_piece(part.len(), goal.len()));
    let pieces = pieces.map(|part| part.into_iter().map(|i| goal[i]).collect::<Vec<Point>>());
    pieces.filter(|piece| !wanted_holes(piece, spacing).is_empty()).collect()
}

/// What hangs together: indices of the particles of each part of a cloud whose particles are about `spacing` apart, m.
pub fn connected(cloud: &[Point], spacing: f64) -> Vec<Vec<usize>> {
    let link = LINK * spacing;
    Neighbours::new(cloud, link).pieces(link)
}

/// Number of connected pieces, crumbs left out.
fn count_pieces(cloud: &[Point], spacing: f64) -> usize {
    connected(cloud, spacing).iter().filter(|part| is_piece(part.len(), cloud.len())).count()
}

/// Whether so many particles are no crumb.
fn is_piece(size: usize, all: usize) -> bool {
    size as f64 >= CRUMB * all as f64
}

/// The holes of a goal.
fn wanted_holes(goal: &[Point], spacing: f64) -> Vec<Hole> {
    holes(goal, spacing).into_iter().filter(|h| h.radius >= LEAST_HOLE * spacing).collect()
}

/// Places that are free from the table up and closed in by dough all around, largest first.
pub fn holes(cloud: &[Point], spacing: f64) -> Vec<Hole> {
    let flat: Vec<Point> = cloud.iter().map(|p| [p[0], 0.0, p[2]]).collect();
    let Some(bounds) = Bounds::of(&flat) else { return Vec::new() };
    let tree = KdTree::new(&flat);
    let edge = spacing / CELLS_PER_SPACING;
    // A free rim all around, so that the outside is one region.
    let rim = (2.0 * FREE * CELLS_PER_SPACING).ceil() as usize;
    let size = |a: usize| (bounds.size()[a] / edge).ceil() as usize + 2 * rim + 1;
    let (nx, nz) = (size(0), size(2));
    let at = |k: usize, a: usize| bounds.min[a] + (k as f64 - rim as f64) * edge;
    let free: Vec<f64> = (0..nx * nz)
        .map(|c| {
            let place = [at(c / nz, 0), 0.0, at(c % nz, 2)];
            let d = tree.nearest(place).expect("a cloud with bounds has points").distance;
            if d > FREE * spacing { d } else { 0.0 }
        })
        .collect();
    let mut seen: Vec<bool> = free.iter().map(|d| *d == 0.0).collect();
    let mut found = Vec::new();
    for first in 0..nx * nz {
        if seen[first] {
            continue;
        }
        seen[first] = true;
        let (mut outside, mut best) = (false, first);
        let mut open = vec![first];
        while let Some(c) = open.pop() {
            let (i, k) = (c / nz, c % nz);
            outside |= i == 0 || k == 0 || i == nx - 1 || k == nz - 1;
            if free[c] > free[best] {
                best = c;
            }
            let around = [(i.wrapping_sub(1), k), (i + 1, k), (i, k.wrapping_sub(1)), (i, k + 1)];
            for (i, k) in around.into_iter().filter(|&(i, k)| i < nx && k < nz) {
                if !std::mem::replace(&mut seen[i * nz + k], true) {
                    open.push(i * nz + k);
                }
            }
        }
        if !outside {
            found.push(Hole { center: [at(best / nz, 0), at(best % nz, 2)], radius: free[best] });
        }
    }
    found.sort_by(|a, b| b.radius.total_cmp(&a.radius));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{seeded, uniform};

    /// An even block of points on a lattice of this spacing, by a rule.
    fn lattice(spacing: f64, half: i32, inside: impl Fn(Point) -> bool) -> Vec<Point> {
        let mut cloud = Vec::new();
        for i in -half..=half {
            for j in 0..5 {
                for k in -half..=half {
                    let p = [i, j, k].map(|c| f64::from(c) * spacing);
                    if inside(p) {
                        cloud.push(p);
                    }
                }
            }
        }
        cloud
    }

    #[test]
    fn a_ring_has_a_hole_and_a_membrane_closes_it() {
        let r = |p: Point| p[0].hypot(p[2]);
        let ring = lattice(0.005, 20, |p| r(p) > 0.03 && r(p) < 0.08);
        let same = ShapeMeasures::of(&ring, &ring, 0.005);
        assert_eq!((same.pieces, same.holes.len()), (1, 1));
        // Beside a block that has none.
        let mut two = ring.clone();
        two.extend(lattice(0.005, 4, |_| true).iter().map(|p| [p[0] + 0.2, p[1], p[2]]));
        let with_holes = pieces_with_holes(&two, 0.005);
        assert!(with_holes.len() == 1 && with_holes[0].len() == ring.len());
        assert!((same.holes[0].radius - 0.03).abs() < 0.003 && same.holes[0].membrane == 0.0, "{same:?}");
        let closed = lattice(0.005, 20, |p| r(p) < 0.08 && (r(p) > 0.03 || p[1] == 0.0));
        let hole = ShapeMeasures::of(&closed, &ring, 0.005).holes[0];
        assert!(hole.radius == 0.0 && hole.membrane > 0.005, "{hole:?}");
        let narrow = lattice(0.005, 20, |p| r(p) < 0.08 && r(p) > 0.02);
        let hole = ShapeMeasures::of(&narrow, &ring, 0.005).holes[0];
        assert!((hole.radius - 0.02).abs() < 0.003 && hole.membrane == 0.0, "{hole:?}");
    }

    #[test]
    fn a_thin_sheet_of_random_points_has_no_holes() {
        let mut rng = seeded(1, "measures");
        // Of 3000 points 0.005 m apart, 1.5 of these thick; 5000 particles will fill it.
        let (apart, n) = (0.005, 3000);
        let side = apart * (f64::from(n) / 1.5).sqrt();
        for _ in 0..4 {
            let size = [side, 1.5 * apart, side];
            let sheet: Vec<Point> = (0..n).map(|_| size.map(|s| s * uniform(&mut rng))).collect();
            assert!(pieces_with_holes(&sheet, apart * 0.6f64.cbrt()).is_empty());
        }
    }

    #[test]
    fn two_blocks_are_two_pieces_and_a_bridge_makes_them_one() {
        let apart = lattice(0.005, 20, |p| p[0].abs() > 0.02);
        let joined = lattice(0.005, 20, |p| p[0].abs() > 0.02 || (p[1] == 0.0 && p[2] == 0.0));
        assert_eq!(ShapeMeasures::of(&apart, &apart, 0.005).pieces, 2);
        let measured = ShapeMeasures::of(&joined, &apart, 0.005);
        assert_eq!((measured.pieces, measured.pieces_of_goal), (1, 2));
        assert!(measured.holes.is_empty());
        let mut crumb = apart;
        crumb.push([0.0, 0.0, 0.0]);
        let measured = ShapeMeasures::of(&crumb, &crumb, 0.005);
        assert!(measured.pieces == 2 && measured.crumbs > 0.0);
    }
}
