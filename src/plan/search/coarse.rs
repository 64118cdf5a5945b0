//! Fewer particles to search with: an even subset of the dough and of its target.
//!
//! A stage's problem and the dough come in, a [`Coarse`] copy and its objective go out. Imports emd.

use super::even_subset::even_subset;
use crate::emd::exact::{Assignment, Target};
use crate::math::cloud::{Bounds, Point, distance, sub};
use crate::math::hull::HullFromAbove;
use crate::math::kd_tree::KdTree;
use crate::math::neighbours::Neighbours;
use crate::sim::ParticleState;

/// The dough of a stage, by fewer particles.
#[derive(Clone, Debug)]
pub struct Coarse<'a> {
    pub state: ParticleState,
    /// Which of `state` the stage is about.
    pub active: Vec<usize>,
    /// So many of `active` stand for their neighbours too, those from here on for themselves alone.
    evenly: usize,
    /// What a particle that stands for itself alone counts, against one that does not.
    lone_part: f64,
    /// All others: they should stay.
    pub others: Vec<usize>,
    /// Where all others should stay, m: places of the same particles as `state`.
    home: Vec<Point>,
    /// Which particles of the whole dough `state` has.
    ids: Vec<usize>,
    /// As many points as `active`, m.
    target: Target,
    /// The whole target.
    near_target: &'a NearTarget<'a>,
    /// What dough costs that strays or is in a gap.
    pub weights: Weights,
    /// By how much the EMD may be missed, m.
    tolerance: f64,
}

/// What dough costs where it is.
#[derive(Clone, Debug)]
pub struct Cost {
    /// What a stage wants small, m: the EMD of the active dough to its target, what it costs that some of it strays from
    /// the target's neighbourhood or is in its gaps, and the way that the other dough has gone; by their shares.
    pub objective: f64,
    /// The EMD of the active dough to its target, m.
    pub emd: f64,
    /// The objective's gradient by the positions.
    pub positions_adj: Vec<Point>,
    /// For every active particle the index of the target point that it is matched with.
    pub target_of: Vec<usize>,
}

/// Whether dough that is deeper in a gap of the target than all that an even choice shows is among the few particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crumbs {
    /// It is, and counts as the little that it is: a search would never know of a crumb in a hole.
    Chosen,
    /// It is not.
    ByChance,
}

/// What dough costs that is where none should be, against a way of the same length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Dough that is far from every point of the target.
    pub stray: f64,
    /// Dough in the gaps of the target, its holes as seen from above, by how deep in it is.
    pub gap: f64,
}

/// The tolerance of the EMD, as a part of the distance between points: strokes that differ by less are as good as each
/// other, and a nearly optimal matching is found in a fraction of the time.
const TOLERANCE: f64 = 0.01;

/// Dough that is farther than this from every point of the whole target strays, in spacings of the target.
const STRAY_FROM: f64 = 2.0;
/// Dough that is farther than this from every point of the target as seen from above, and yet within the hull of a piece
/// that has a hole, is in a gap.
const GAP_FROM: f64 = 1.0;
/// So far beyond that, a particle costs half of what it may cost at most, in spacings.
const HALFWAY: f64 = 3.0;

/// What straying costs, m, and the derivative, `beyond` the distance at which it begins (Geman and McClure's function):
/// as good as nothing for a rim that is a millimetre too wide, most for dough in the middle of a hole, and no more than
/// `scale` for dough that is still to be moved, which the EMD takes care of.
fn stray_cost(beyond: f64, scale: f64) -> (f64, f64) {
    let sum = beyond * beyond + scale * scale;
    (scale * beyond * beyond / sum, 2.0 * scale.powi(3) * beyond / (sum * sum))
}

/// The whole target of a stage, sorted to find what strays from it.
#[derive(Clone, Debug)]
pub struct NearTarget<'a> {
    points: &'a [Point],
    tree: KdTree,
    /// The points as seen from above, and the hulls of the pieces that have holes.
    shadow: KdTree,
    hulls: Vec<HullFromAbove>,
    /// Mean distance of a point to the next, m.
    spacing: f64,
}

/// A point as seen from above.
fn flat(p: Point) -> Point {
    [p[0], 0.0, p[2]]
}

impl<'a> NearTarget<'a> {
    /// Sorts the points, m; some of their pieces may have holes.
    pub fn new(points: &'a [Point], with_holes: &[Vec<Point>]) -> Self {
        let shadow: Vec<Point> = points.iter().map(|p| flat(*p)).collect();
        Self {
            points,
            tree: KdTree::new(points),
            shadow: KdTree::new(&shadow),
            hulls: with_holes.iter().map(|piece| HullFromAbove::of(piece)).collect(),
            spacing: spacing(points),
        }
    }

    /// How deep in a gap of the target `x` is, m; 0 if it is in none.
    fn depth(&self, x: Point) -> f64 {
        self.in_gap(x).map_or(0.0, |(_, depth)| depth)
    }

    /// If `x` is in a gap of the target, the nearest place out of it at the same height, and how far in it is, m.
    fn in_gap(&self, x: Point) -> Option<(Point, f64)> {
        if self.hulls.is_empty() {
            return None;
        }
        let nearest = self.shadow.nearest(flat(x))?;
        let depth = nearest.distance - GAP_FROM * self.spacing;
        let [out_x, _, out_z] = self.points[nearest.index];
        let is_in_gap = depth > 0.0 && self.hulls.iter().any(|hull| hull.contains(x));
        is_in_gap.then_some(([out_x, x[1], out_z], depth))
    }

    /// The nearest point, and how far beyond the neighbourhood of the target `x` is, m; none if there is no point.
    fn beyond(&self, x: Point) -> Option<(Point, f64)> {
        let nearest = self.tree.nearest(x)?;
        Some((self.points[nearest.index], (nearest.distance - STRAY_FROM * self.spacing).max(0.0)))
    }
}

impl<'a> Coarse<'a> {
    /// An even choice of about `count` of all particles, of which a stage is about those in `active`, and of the target in
    /// proportion.
    ///
    /// MPM's accelerations do not depend on the mass of a particle, so that fewer of them are the same dough. `home`
    /// are the places of the whole dough that particles which the stage is not about should keep.
    pub fn new(
        near_target: &'a NearTarget<'a>,
        active: &[usize],
        state: &ParticleState,
        home: &[Point],
        count: usize,
        crumbs: Crumbs,
        weights: Weights,
    ) -> Self {
        let n = state.len();
        let share = (count as f64 / n as f64).min(1.0);
        let mut is_active = vec![false; n];
        active.iter().for_each(|&i| is_active[i] = true);
        let choose = |wanted: bool, lone: &[usize]| {
            let ids: Vec<usize> = (0..n).filter(|i| is_active[*i] == wanted && !lone.contains(i)).collect();
            let places: Vec<Point> = ids.iter().map(|&i| state.x[i]).collect();
            let all = ids.len() + lone.len();
            let m = ((share * all as f64).round() as usize).clamp(usize::from(all > 0), all);
            let even = even_subset(&places, m.saturating_sub(lone.len()));
            even.into_iter().map(|k| ids[k]).chain(lone.iter().copied()).collect::<Vec<_>>()
        };
        let (mut few, others) = (choose(true, &[]), choose(false, &[]));
        let mut lone = Vec::new();
        if crumbs == Crumbs::Chosen {
            let depth = |i: &usize| near_target.depth(state.x[*i]);
            let shown = few.iter().map(depth).fold(0.0, f64::max);
            lone = active.iter().copied().filter(|i| depth(i) > shown).collect();
            if !lone.is_empty() {
                few = choose(true, &lone);
            }
        }
        let ids: Vec<usize> = few.iter().chain(&others).copied().collect();
        let target: Vec<Point> =
            even_subset(near_target.points, few.len()).into_iter().map(|k| near_target.points[k]).collect();
        Self {
            tolerance: if ids.len() < n { TOLERANCE * spacing(&target) } else { 0.0 },
            near_target,
            weights,
            state: state.select(&ids),
            evenly: few.len() - lone.len(),
            lone_part: ids.len() as f64 / n as f64,
            active: (0..few.len()).collect(),
            others: (few.len()..ids.len()).collect(),
            home: ids.iter().map(|&i| home[i]).collect(),
            ids,
            target: Target::new(target),
        }
    }

    /// [`Cost::objective`] alone.
    pub fn objective(&self, x: &[Point]) -> f64 {
        self.cost(x).objective
    }

    /// What dough at `x` costs. The matching changes at a kink of the EMD only, so that the gradient may take it for fixed
    /// (envelope theorem).
    pub fn cost(&self, x: &[Point]) -> Cost {
        let active: Vec<Point> = self.active.iter().map(|&i| x[i]).collect();
        let matching = self.matching(&active);
        let share = 1.0 / x.len() as f64;
        let mut sum = 0.0;
        let mut adj = vec![[0.0; 3]; x.len()];
        // What a distance costs has a value and a slope.
        let mut pull = |i: usize, to: Point, (value, slope): (f64, f64)| {
            sum += value;
            let d = distance(x[i], to);
            if d > 0.0 {
                for a in 0..3 {
                    adj[i][a] += share * slope * (x[i][a] - to[a]) / d;
                }
            }
        };
        for (&i, &t) in self.active.iter().zip(&matching.target_of) {
            let to = self.target.points()[t];
            let way = distance(x[i], to);
            let part = self.part(i);
            pull(i, to, (part * way, part));
            let Weights { stray, gap } = self.weights;
            let (stray, gap) = (part * stray, part * gap);
            // What is near to its match does not stray.
            if way > STRAY_FROM * self.near_target.spacing
                && let Some((out, beyond)) = self.near_target.beyond(x[i])
            {
                let (value, slope) = stray_cost(beyond, HALFWAY * self.near_target.spacing);
                pull(i, out, (stray * value, stray * slope));
            }
            if gap > 0.0
                && let Some((out, depth)) = self.near_target.in_gap(x[i])
            {
                pull(i, out, (gap * depth, gap));
            }
        }
        for &i in &self.others {
            pull(i, self.home[i], (distance(x[i], self.home[i]), 1.0));
        }
        let Assignment { target_of, mean_distance: emd } = matching;
        Cost { objective: sum * share, emd, positions_adj: adj, target_of }
    }

    /// What active particle `i` counts.
    fn part(&self, i: usize) -> f64 {
        if i < self.evenly { 1.0 } else { self.lone_part }
    }

    /// The matching of the active dough's points with the target's.
    fn matching(&self, active: &[Point]) -> Assignment {
        match self.tolerance {
            0.0 => self.target.assign(active),
            tolerance => self.target.assign_within(active, tolerance),
        }
    }

    /// What dough in gaps costs by a weight of 1, m: its depth in them as a mean over all dough, which is at `x`.
    pub fn gap_cost_of_all(&self, x: &[Point]) -> f64 {
        let depth = |&i: &usize| self.part(i) * self.near_target.depth(x[self.ids[i]]);
        self.active.iter().map(depth).sum::<f64>() / self.ids.len() as f64
    }

    /// [`Coarse::cost`] where the whole dough is at `x`; the gradient is by the places of the chosen particles.
    pub fn cost_of_all(&self, x: &[Point]) -> Cost {
        let own: Vec<Point> = self.ids.iter().map(|&i| x[i]).collect();
        self.cost(&own)
    }

    /// Active particles that are where they cost most: in a gap of the target if that is what counts, or far from every
    /// point of it.
    pub fn strays(&self) -> Vec<usize> {
        let near = self.near_target;
        let is_stray = |x: Point| match self.weights.gap {
            0.0 => near.beyond(x).is_some_and(|(_, beyond)| beyond > 0.0),
            _ => near.in_gap(x).is_some(),
        };
        self.active.iter().copied().filter(|&i| is_stray(self.state.x[i])).collect()
    }

    /// For every particle the way that it should go, m: active ones to `target_of`, others nowhere.
    pub fn motion(&self, target_of: &[usize]) -> Vec<Point> {
        let mut motion = vec![[0.0; 3]; self.state.len()];
        for (&i, &t) in self.active.iter().zip(target_of) {
            motion[i] = sub(self.target.points()[t], self.state.x[i]);
        }
        motion
    }
}

/// Mean distance of a point to the next.
fn spacing(cloud: &[Point]) -> f64 {
    let Some(bounds) = Bounds::of(cloud) else { return 0.0 };
    let near = Neighbours::new(cloud, bounds.diagonal() / (cloud.len() as f64).cbrt());
    let second = |p: &Point| near.nearest(*p, 2).last().map_or(0.0, |n| n.distance);
    cloud.iter().map(second).sum::<f64>() / cloud.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{seeded, uniform};

    #[test]
    fn a_gap_is_a_hole_at_any_height_and_neither_rim_nor_bump_nor_what_is_between_pieces_is_one() {
        let disc = |x: f64, hole: f64| -> Vec<Point> {
            let grid = (0..41 * 41 * 4).map(|i| {
                let [a, b, c] = [i % 41, i / 41 % 41, i / 1681].map(|k| 0.005 * k as f64);
                [x + a - 0.1, 0.04 + c, 0.5 + b - 0.1]
            });
            grid.filter(|p| (hole..0.08).contains(&(p[0] - x).hypot(p[2] - 0.5))).collect()
        };
        let ring = disc(0.5, 0.03);
        let near = NearTarget::new(&ring, std::slice::from_ref(&ring));
        for y in [0.041, 0.09] {
            let (out, depth) = near.in_gap([0.505, y, 0.5]).expect("in the hole");
            assert!((depth - (0.025 - near.spacing)).abs() < 0.003, "{depth}");
            assert!(out[1] == y && (out[0] - 0.5).hypot(out[2] - 0.5) < 0.035, "{out:?}");
            assert!(near.in_gap([0.6, y, 0.5]).is_none(), "beyond the rim");
            assert!(near.in_gap([0.55, y, 0.5]).is_none(), "in the ring or above it");
        }
        let mut two = disc(0.65, 0.0);
        two.extend(&ring);
        let near = NearTarget::new(&two, std::slice::from_ref(&ring));
        assert!(near.in_gap([0.505, 0.05, 0.5]).is_some() && near.in_gap([0.575, 0.05, 0.52]).is_none());
    }

    #[test]
    fn a_crumb_in_the_middle_of_a_hole_is_among_the_few_and_counts_for_itself_alone() {
        let grid =
            (0..41 * 41).map(|i| [0.3 + 0.01 * f64::from(i % 41), 0.05, 0.3 + 0.01 * f64::from(i / 41)]);
        let ring: Vec<Point> =
            grid.filter(|p| (0.05..0.15).contains(&(p[0] - 0.5).hypot(p[2] - 0.5))).collect();
        let (rim, crumb) = ([0.545, 0.05, 0.5], [0.53, 0.05, 0.5]);
        let active: Vec<usize> = (0..ring.len()).collect();
        let near_target = NearTarget::new(&ring, std::slice::from_ref(&ring));
        let weights = Weights { stray: 0.0, gap: 1.0 };
        // The dough is the ring, but for one particle.
        let few_of = |odd: Point, count: usize, crumbs: Crumbs| {
            let mut dough = ring.clone();
            dough[100] = odd;
            let state = ParticleState::at_rest(dough);
            Coarse::new(&near_target, &active, &state, &state.x, count, crumbs, weights)
        };
        let without = few_of(rim, 60, Crumbs::Chosen);
        assert!(!without.ids.contains(&100) && without.active.len() == 60);
        let with = few_of(crumb, 60, Crumbs::Chosen);
        assert!(with.ids.contains(&100) && with.active.len() == 60 && with.target.points().len() == 60);
        let depth = near_target.in_gap(crumb).unwrap().1;
        let (gap, expected) = (
            with.gap_cost_of_all(&few_of(crumb, ring.len(), Crumbs::ByChance).state.x),
            depth / ring.len() as f64,
        );
        assert!((gap - expected).abs() < 1e-12, "{gap} {expected}");
    }

    #[test]
    fn the_objective_is_zero_at_the_target_and_its_gradient_agrees_with_finite_differences() {
        let mut rng = seeded(5, "coarse");
        let mut cloud = |n: usize, at: f64| -> Vec<Point> {
            (0..n).map(|_| std::array::from_fn(|_| at + 0.1 * uniform(&mut rng))).collect()
        };
        let (x, target) = (cloud(40, 0.44), cloud(30, 0.45));
        // So close that most of the dough strays.
        let near_target =
            NearTarget { spacing: 0.004, ..NearTarget::new(&target, std::slice::from_ref(&target)) };
        let coarse = Coarse {
            near_target: &near_target,
            weights: Weights { stray: 20.0, gap: 30.0 },
            tolerance: 0.0,
            state: ParticleState::at_rest(x.clone()),
            active: (0..30).collect(),
            evenly: 28,
            lone_part: 0.3,
            others: (30..40).collect(),
            home: x.clone(),
            ids: (0..40).collect(),
            target: Target::new(target.clone()),
        };
        let mut there = x.clone();
        there[..30].copy_from_slice(&target);
        assert!(coarse.objective(&there) < 1e-12);
        // The others have left their place, or the distance would have a kink there.
        let away: Vec<Point> = x.iter().map(|p| [p[0] + 0.01, p[1], p[2] - 0.005]).collect();
        let adj = coarse.cost(&away).positions_adj;
        let in_gaps = (0..30).filter(|&i| near_target.in_gap(away[i]).is_some()).count();
        assert!((3..27).contains(&in_gaps), "{in_gaps} of 30 are in a gap");
        let without = Coarse { weights: Weights { gap: 0.0, ..coarse.weights }, ..coarse.clone() };
        let by_gaps = coarse.objective(&away) - without.objective(&away);
        assert!((by_gaps - 30.0 * coarse.gap_cost_of_all(&away)).abs() < 1e-12, "{by_gaps}");
        for i in 0..40 {
            for a in 0..3 {
                let h = 1e-7;
                let moved = |by: f64| {
                    let mut y = away.clone();
                    y[i][a] += by;
                    coarse.objective(&y)
                };
                let fd = (moved(h) - moved(-h)) / (2.0 * h);
                assert!((adj[i][a] - fd).abs() < 1e-6, "{i} {a}: {} {fd}", adj[i][a]);
            }
        }
    }
}
