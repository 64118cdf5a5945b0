//! Where a tool starts (lines 8 to 12 of Algorithm 1).
//!
//! The dough, the motion that it should make and a tool come in; the pose of the highest score goes out:
//! `argmax_x sum_i |p'_i - p_i|_1 / (d(p_i, x) + delta)` (paper, section III-B). Candidates stand over the
//! active dough and are lowered until they almost touch it. Imports sim's tools.

use super::settings::StartScore;
use crate::math::cloud::{Bounds, Point, centroid, distance, sub};
use crate::math::quaternion::{from_axis_angle, product};
use crate::sim::{Motion, Tool, ToolPose};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Distance to keep from the dough at the start, m: contact begins at less than that.
const CLEARANCE: f64 = 0.004;
/// How far candidates reach beyond the dough's bounds, m.
const MARGIN: f64 = 0.01;
/// Candidates along x and along z.
const GRID: usize = 9;
/// Gaps that are tried for a gripper around the dough, and every how many of them for one that comes down on it.
const GAPS: usize = 12;
const COARSE_GAPS: usize = 4;
/// Steps in which a candidate is lowered, m: coarse, then fine.
const DESCENT: [f64; 4] = [0.008, 0.002, 0.0005, 0.0001];
/// Candidates whose scores are this close, as a share, are told apart by their distance from the middle.
const TIE: f64 = 0.02;
/// A start this close to a failed one, and turned alike, is the same start, m.
const SAME_PLACE: f64 = 0.012;

/// What the placement of a tool depends on.
#[derive(Clone, Copy, Debug)]
pub struct Placement<'a> {
    pub tool: &'a Tool,
    /// Gives orientation and, for a gripper, nothing else: height and gap follow from the dough.
    pub rest: &'a ToolPose,
    /// All particles, m.
    pub positions: &'a [Point],
    /// Particles that the stage is about.
    pub active: &'a [usize],
    /// Next reachable place of every particle, m.
    pub reachable: &'a [Point],
    /// delta, m.
    pub delta: f64,
    pub score: StartScore,
    /// Orientations that are tried: the rest pose's, turned about the vertical in so many equal parts of a circle.
    pub turns: usize,
}

impl Placement<'_> {
    /// The best start pose that is not near one of `failed`; the best of all if that leaves none. `None` if
    /// the tool fits nowhere.
    pub fn best(&self, failed: &[ToolPose]) -> Option<ToolPose> {
        let scored: Vec<(f64, ToolPose)> = self
            .orientations()
            .into_iter()
            .flat_map(|rotation| self.candidates(rotation))
            .map(|pose| (self.score(&pose), pose))
            .collect();
        let is_same = |a: &ToolPose, b: &ToolPose| {
            distance(a.position, b.position) <= SAME_PLACE
                && same_surface(self.tool, a, &ToolPose { rotation: b.rotation, ..*a })
        };
        let is_new = |pose: &ToolPose| failed.iter().all(|f| !is_same(f, pose));
        let middle = self.middle();
        let best = |fresh: bool| {
            let pool = || scored.iter().filter(|(_, pose)| !fresh || is_new(pose));
            let highest = pool().map(|c| c.0).fold(f64::NEG_INFINITY, f64::max);
            let off = |pose: &ToolPose| (pose.position[0] - middle[0]).hypot(pose.position[2] - middle[2]);
            pool()
                .filter(|c| c.0 >= highest - TIE * highest.abs())
                .min_by(|a, b| off(&a.1).total_cmp(&off(&b.1)))
                .map(|c| c.1)
        };
        best(true).or_else(|| best(false))
    }

    /// The start without a choice: where the tool waits, lowered until it almost touches the dough if it can be.
    pub fn fixed(&self) -> ToolPose {
        self.lowered(*self.rest).unwrap_or(*self.rest)
    }

    /// The orientations that are tried, those of which the tool looks the same once: a pole has one, a rolling pin
    /// the half of its turns.
    fn orientations(&self) -> Vec<[f64; 4]> {
        let mut kept: Vec<ToolPose> = Vec::new();
        for k in 0..self.turns {
            let turn = from_axis_angle(Vector3::new(0.0, TAU * k as f64 / self.turns as f64, 0.0));
            let pose = ToolPose { rotation: product(turn, self.rest.rotation), ..*self.rest };
            if kept.iter().all(|other| !same_surface(self.tool, other, &pose)) {
                kept.push(pose);
            }
        }
        kept.into_iter().map(|pose| pose.rotation).collect()
    }

    /// Centre of the active dough.
    fn middle(&self) -> Point {
        let active: Vec<Point> = self.active.iter().map(|&i| self.positions[i]).collect();
        centroid(&active)
    }

    /// How well the dough near `pose` should go where the tool there would push it.
    pub fn score(&self, pose: &ToolPose) -> f64 {
        self.score_of(pose, self.active)
    }

    /// [`Placement::score`] by these particles only.
    pub fn score_of(&self, pose: &ToolPose, particles: &[usize]) -> f64 {
        if self.score == StartScore::Direction && !self.is_gripper() {
            return self.pushing_score(pose, particles);
        }
        let tool = self.tool.at(pose);
        self.sum_near(particles, |motion, p| (motion.iter().map(|m| m.abs()).sum(), tool.distance(p)))
    }

    /// How well these particles should go where the tool at `pose` pushes them: away from it.
    pub fn pushing_score(&self, pose: &ToolPose, particles: &[usize]) -> f64 {
        let tool = self.tool.at(pose);
        self.sum_near(particles, |motion, p| {
            let (distance, outward) = tool.distance_and_outward(p);
            (motion.iter().zip(outward).map(|(m, n)| m * n).sum(), distance)
        })
    }

    /// The sum of what particles are worth, the more the nearer the tool is: `worth` of their motion and place, and the
    /// distance to the tool.
    fn sum_near(&self, particles: &[usize], worth: impl Fn(Point, Point) -> (f64, f64)) -> f64 {
        let one = |&i: &usize| {
            let p = self.positions[i];
            let (worth, distance) = worth(sub(self.reachable[i], p), p);
            worth / (distance.abs() + self.delta)
        };
        particles.iter().map(one).sum()
    }

    fn is_gripper(&self) -> bool {
        matches!(self.tool.motion, Motion::Gripper { .. })
    }

    /// Poses of this orientation over a grid on the active dough, as low as the dough lets them.
    pub fn candidates(&self, rotation: [f64; 4]) -> Vec<ToolPose> {
        self.grid(rotation, &self.gaps()).into_iter().filter_map(|pose| self.lowered(pose)).collect()
    }

    /// Poses over the same grid in which a gripper stands on the dough or beside it; none for other tools.
    pub fn candidates_outside(&self, rotation: [f64; 4]) -> Vec<ToolPose> {
        if !self.is_gripper() {
            return Vec::new();
        }
        let gaps: Vec<f64> = self.gaps().into_iter().step_by(COARSE_GAPS).collect();
        let lowered = self.grid(rotation, &gaps).into_iter().map(|pose| self.lowered_anyhow(pose));
        lowered.filter(|pose| !self.holds(pose)).collect()
    }

    /// Poses of this orientation over a grid on the active dough, at no height yet.
    fn grid(&self, rotation: [f64; 4], gaps: &[f64]) -> Vec<ToolPose> {
        let active: Vec<Point> = self.active.iter().map(|&i| self.positions[i]).collect();
        let Some(bounds) = Bounds::of(&active) else { return Vec::new() };
        let at = |axis: usize, k: usize| {
            let (lo, hi) = (bounds.min[axis] - MARGIN, bounds.max[axis] + MARGIN);
            let v = lo + (hi - lo) * k as f64 / (GRID - 1) as f64;
            v.clamp(self.tool.lower_bound[axis], self.tool.upper_bound[axis])
        };
        let pose =
            |i: usize, k: usize, gap: f64| ToolPose { position: [at(0, i), 0.0, at(2, k)], rotation, gap };
        let row = |i: usize| (0..GRID).flat_map(move |k| gaps.iter().map(move |&gap| (i, k, gap)));
        (0..GRID).flat_map(row).map(|(i, k, gap)| pose(i, k, gap)).collect()
    }

    fn gaps(&self) -> Vec<f64> {
        match self.tool.motion {
            Motion::Gripper { minimal_gap, maximal_gap } => (0..GAPS)
                .map(|k| minimal_gap + (maximal_gap - minimal_gap) * k as f64 / (GAPS - 1) as f64)
                .collect(),
            _ => vec![self.rest.gap],
        }
    }

    /// Lowers a pose from above the dough until it almost touches it, or to the tool's lowest height.
    ///
    /// A gripper works from the sides: a pose in which it comes down on the dough, or in which no dough
    /// is between its plates, is none.
    pub fn lowered(&self, pose: ToolPose) -> Option<ToolPose> {
        let pose = self.lowered_anyhow(pose);
        (!self.is_gripper() || self.holds(&pose)).then_some(pose)
    }

    /// [`Placement::lowered`], but a gripper may come down on the dough or beside it.
    pub fn lowered_anyhow(&self, mut pose: ToolPose) -> ToolPose {
        let lowest = self.tool.lower_bound[1];
        pose.position[1] = 0.0;
        let mut near: Vec<Point> = self.under(&pose);
        // Above this height the tool touches nothing.
        let (min, _) = self.tool.bounds(&pose);
        let top = near.iter().map(|p| p[1]).fold(0.0, f64::max);
        let mut y = (top + CLEARANCE - min[1] + DESCENT[0]).clamp(lowest, self.tool.upper_bound[1]);
        let at = |y: f64| ToolPose { position: [pose.position[0], y, pose.position[2]], ..pose };
        for step in DESCENT {
            let below = |y: f64| at((y - step).max(lowest));
            while y > lowest && self.is_free(&below(y), &near) {
                y = (y - step).max(lowest);
            }
            // There is no room for another such step: dough that is farther than that does not matter to smaller ones.
            let tool = self.tool.at(&at(y));
            near.retain(|p| tool.distance(*p) < CLEARANCE + 2.0 * step);
        }
        pose.position[1] = y;
        pose
    }

    /// Whether the tool keeps its distance from all of the particles.
    fn is_free(&self, pose: &ToolPose, particles: &[Point]) -> bool {
        let tool = self.tool.at(pose);
        particles.iter().all(|p| tool.distance(*p) >= CLEARANCE)
    }

    /// Whether a gripper is as low as it goes and around the dough, and touches it nowhere.
    fn holds(&self, pose: &ToolPose) -> bool {
        pose.position[1] <= self.tool.lower_bound[1]
            && self.is_free(pose, &self.under(pose))
            && self.straddles(pose)
    }

    /// Particles that the tool can meet on its way down: those near its outline seen from above.
    fn under(&self, pose: &ToolPose) -> Vec<Point> {
        let (min, max) = self.tool.bounds(pose);
        let inside = |p: &Point, a: usize| p[a] > min[a] - CLEARANCE && p[a] < max[a] + CLEARANCE;
        self.positions.iter().filter(|p| inside(p, 0) && inside(p, 2)).copied().collect()
    }

    /// Whether most of the active dough in reach of the plates is between them.
    fn straddles(&self, pose: &ToolPose) -> bool {
        let frame = self.tool.frame(pose, 0.0);
        let half = self.tool.shape.half_extents();
        let (mut between, mut beyond) = (0, 0);
        for &i in self.active {
            let local = frame.to_local(self.positions[i].into());
            if local.z.abs() <= half[2] {
                if local.x.abs() < 0.5 * pose.gap { between += 1 } else { beyond += 1 }
            }
        }
        between > beyond
    }
}

/// Whether a tool looks the same from all sides at both poses: at points around it, it is as far away.
pub fn same_surface(tool: &Tool, a: &ToolPose, b: &ToolPose) -> bool {
    let (min, max) = tool.bounds(a);
    (0..8).all(|corner| {
        let p = std::array::from_fn(|k| {
            let t = if corner >> k & 1 == 1 { 0.9 } else { 0.2 };
            min[k] + t * (max[k] - min[k])
        });
        (tool.distance(a, p) - tool.distance(b, p)).abs() < 1e-3
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Shape;

    /// Two plates of 0.2 by 0.2 m, 0.03 m thick, that face each other along x.
    fn gripper() -> Tool {
        Tool {
            name: "gripper".into(),
            shape: Shape::Box { half_extents: [0.015, 0.1, 0.1] },
            motion: Motion::Gripper { minimal_gap: 0.08, maximal_gap: 0.3 },
            friction: 10.0,
            action_scale: vec![0.015; 7],
            lower_bound: [0.0, 0.12, 0.0],
            upper_bound: [1.0; 3],
        }
    }

    const REST: ToolPose = ToolPose { position: [0.5, 0.35, 0.5], rotation: [1.0, 0.0, 0.0, 0.0], gap: 0.3 };

    /// Points on a grid, so many along each axis.
    fn block(counts: [usize; 3], low: Point, size: Point) -> Vec<Point> {
        let [nx, ny, nz] = counts;
        let at = |a: usize, k: usize| low[a] + size[a] * k as f64 / (counts[a] - 1) as f64;
        (0..nx * ny * nz).map(|i| [at(0, i % nx), at(1, i / nx % ny), at(2, i / (nx * ny))]).collect()
    }

    /// A slab on the table, 0.16 m wide along x and z and 0.06 m high.
    fn slab() -> Vec<Point> {
        block([17, 7, 17], [0.42, 0.04, 0.42], [0.16, 0.06, 0.16])
    }

    fn flattened(dough: &[Point]) -> Vec<Point> {
        dough.iter().map(|p| [p[0], 0.5 * p[1], p[2]]).collect()
    }

    /// Dough, all of which a tool that waits at [`REST`] should move.
    fn place<'a>(tool: &'a Tool, dough: &'a [Point], all: &'a [usize], to: &'a [Point]) -> Placement<'a> {
        Placement {
            tool,
            rest: &REST,
            positions: dough,
            active: all,
            reachable: to,
            delta: 0.01,
            score: StartScore::Direction,
            turns: 1,
        }
    }

    #[test]
    fn a_gripper_holds_the_dough_or_stands_on_it() {
        let (tool, slab) = (gripper(), slab());
        let active: Vec<usize> = (0..slab.len()).collect();
        let flattened = flattened(&slab);
        let place = place(&tool, &slab, &active, &flattened);
        let around = place.candidates(REST.rotation);
        assert!(!around.is_empty());
        for pose in &around {
            assert_eq!(pose.position[1], tool.lower_bound[1]);
            assert!(pose.gap > 0.16 + 0.03, "the plates would be in the dough: {pose:?}");
        }
        let outside = place.candidates_outside(REST.rotation);
        assert!(!outside.is_empty());
        for pose in &outside {
            let nearest = slab.iter().map(|p| tool.distance(pose, *p)).fold(f64::INFINITY, f64::min);
            assert!((CLEARANCE..CLEARANCE + 0.001).contains(&nearest), "{nearest}: {pose:?}");
        }
        // From there a plate pushes flat what is to become flat.
        assert!(outside.iter().all(|pose| place.pushing_score(pose, &active) > 0.0));
    }

    #[test]
    fn a_tool_comes_down_until_a_tenth_of_a_millimetre_more_would_be_too_much() {
        let shapes = [
            Shape::Capsule { radius: 0.03, length: 0.3 },
            Shape::Box { half_extents: [0.02, 0.1, 0.06] },
            Shape::Knife {
                half_extents: [0.025, 0.2, 0.06],
                prism_size: [0.15, 0.15],
                prism_rotation: [1.0, 0.0, 0.0, 0.58],
            },
        ];
        // A heap: what the tool meets first depends on where it comes down.
        let heap: Vec<Point> =
            slab().into_iter().filter(|p| p[1] < 0.1 - 0.5 * (p[0] - 0.45).hypot(p[2] - 0.48)).collect();
        let active: Vec<usize> = (0..heap.len()).collect();
        let mut lowered = 0;
        for shape in shapes {
            let tool = Tool { shape, motion: Motion::Translation, action_scale: vec![0.015; 3], ..gripper() };
            let place = place(&tool, &heap, &active, &heap);
            for yaw in [0.0, 0.4, 1.1] {
                let turn = from_axis_angle(Vector3::new(0.2, yaw, 0.0));
                for pose in place.candidates(product(turn, REST.rotation)) {
                    if pose.position[1] <= tool.lower_bound[1] {
                        continue;
                    }
                    lowered += 1;
                    assert!(place.is_free(&pose, &heap), "{tool:?} {pose:?}");
                    let [x, y, z] = pose.position;
                    let below = ToolPose { position: [x, y - DESCENT[3], z], ..pose };
                    assert!(!place.is_free(&below, &place.under(&below)), "{tool:?} {pose:?}");
                }
            }
        }
        assert!(lowered > 100, "{lowered}");
    }

    #[test]
    fn other_tools_have_no_poses_outside() {
        let tool = Tool { motion: Motion::Translation, action_scale: vec![0.015; 3], ..gripper() };
        let slab = slab();
        let active: Vec<usize> = (0..slab.len()).collect();
        let place = place(&tool, &slab, &active, &slab);
        assert!(place.candidates_outside(REST.rotation).is_empty());
        assert_eq!(place.candidates(REST.rotation).len(), GRID * GRID);
    }

    #[test]
    fn a_rolling_pin_starts_along_the_bar_it_should_flatten() {
        let pin = Tool {
            shape: Shape::Capsule { radius: 0.03, length: 0.3 },
            motion: Motion::RollingPin,
            action_scale: vec![0.005; 4],
            lower_bound: [0.0, 0.06, 0.0],
            ..gripper()
        };
        // The pin waits along z; the bar lies along x.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let rest = ToolPose { rotation: [half, half, 0.0, 0.0], gap: 0.0, ..REST };
        let bar = block([31, 7, 7], [0.35, 0.04, 0.47], [0.3, 0.06, 0.06]);
        let active: Vec<usize> = (0..bar.len()).collect();
        let flattened = flattened(&bar);
        let fixed = Placement { rest: &rest, ..place(&pin, &bar, &active, &flattened) };
        let turned = Placement { turns: 8, ..fixed };
        assert_eq!(turned.orientations().len(), 4, "a pin looks the same from both ends");
        let across = fixed.best(&[]).unwrap();
        assert_eq!(across.rotation, rest.rotation);
        let along = turned.best(&[]).unwrap();
        let (min, max) = pin.bounds(&along);
        assert!(max[0] - min[0] > 0.3 && max[2] - min[2] < 0.1, "{along:?}");
        assert!(turned.score(&along) > turned.score(&across));
        // A failed start is not taken again, but one at its place that is turned otherwise may be.
        assert_ne!(turned.best(&[along]), Some(along));
        let failed = ToolPose { rotation: rest.rotation, ..along };
        assert_eq!(turned.best(&[failed]), Some(along));
    }

    #[test]
    fn a_pole_has_one_orientation() {
        let pole = Tool {
            shape: Shape::Capsule { radius: 0.02, length: 0.2 },
            motion: Motion::Translation,
            action_scale: vec![0.01; 3],
            ..gripper()
        };
        let place = Placement { turns: 8, ..place(&pole, &[], &[], &[]) };
        assert_eq!(place.orientations(), [REST.rotation]);
        assert_eq!(Placement { tool: &gripper(), ..place }.orientations().len(), 4);
    }
}
