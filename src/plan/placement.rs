//! Where a tool starts (lines 8 to 12 of Algorithm 1).
//!
//! The dough, the motion that it should make and a tool come in; the pose of the highest score goes out:
//! `argmax_x sum_i |p'_i - p_i|_1 / (d(p_i, x) + delta)` (paper, section III-B). Candidates stand over the
//! active dough and are lowered until they almost touch it. Imports sim's tools.

use super::settings::StartScore;
use crate::math::cloud::{Bounds, Point, centroid, distance, sub};
use crate::sim::tool::PoseAdj;
use crate::sim::{Motion, Tool, ToolPose};

/// Distance to keep from the dough at the start, m: contact begins at less than that.
const CLEARANCE: f64 = 0.004;
/// How far candidates reach beyond the dough's bounds, m.
const MARGIN: f64 = 0.01;
/// Candidates along x and along z.
const GRID: usize = 9;
/// Gaps that are tried for a gripper.
const GAPS: usize = 12;
/// Steps in which a candidate is lowered, m: coarse, then fine.
const DESCENT: [f64; 4] = [0.008, 0.002, 0.0005, 0.0001];
/// Candidates whose scores are this close, as a share, are told apart by their distance from the middle.
const TIE: f64 = 0.02;
/// A start this close to a failed one is the same start, m.
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
}

impl Placement<'_> {
    /// The best start pose that is not near one of `failed`; the best of all if that leaves none. `None` if
    /// the tool fits nowhere.
    pub fn best(&self, failed: &[ToolPose]) -> Option<ToolPose> {
        let scored: Vec<(f64, ToolPose)> =
            self.candidates(self.rest.rotation).into_iter().map(|pose| (self.score(&pose), pose)).collect();
        let is_new =
            |pose: &ToolPose| failed.iter().all(|f| distance(f.position, pose.position) > SAME_PLACE);
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
        let by_direction =
            self.score == StartScore::Direction && !matches!(self.tool.motion, Motion::Gripper { .. });
        particles
            .iter()
            .map(|&i| {
                let (p, r) = (self.positions[i], self.reachable[i]);
                let motion = sub(r, p);
                let worth = if by_direction {
                    // Positive where the tool pushes the way the dough should go.
                    let away = self.tool.distance_adj(pose, p, 1.0, &mut PoseAdj::default());
                    motion.iter().zip(away).map(|(m, n)| m * n).sum()
                } else {
                    motion.iter().map(|m| m.abs()).sum::<f64>()
                };
                worth / (self.tool.distance(pose, p).abs() + self.delta)
            })
            .sum()
    }

    /// Poses of this orientation over a grid on the active dough, as low as the dough lets them.
    pub fn candidates(&self, rotation: [f64; 4]) -> Vec<ToolPose> {
        let active: Vec<Point> = self.active.iter().map(|&i| self.positions[i]).collect();
        let Some(bounds) = Bounds::of(&active) else { return Vec::new() };
        let at = |axis: usize, k: usize| {
            let (lo, hi) = (bounds.min[axis] - MARGIN, bounds.max[axis] + MARGIN);
            let v = lo + (hi - lo) * k as f64 / (GRID - 1) as f64;
            v.clamp(self.tool.lower_bound[axis], self.tool.upper_bound[axis])
        };
        let mut poses = Vec::new();
        for i in 0..GRID {
            for k in 0..GRID {
                for gap in self.gaps() {
                    let pose = ToolPose { position: [at(0, i), 0.0, at(2, k)], rotation, gap };
                    poses.extend(self.lowered(pose));
                }
            }
        }
        poses
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
    pub fn lowered(&self, mut pose: ToolPose) -> Option<ToolPose> {
        let lowest = self.tool.lower_bound[1];
        pose.position[1] = 0.0;
        let near: Vec<Point> = self.under(&pose);
        // Above this height the tool touches nothing.
        let (min, _) = self.tool.bounds(&pose);
        let top = near.iter().map(|p| p[1]).fold(0.0, f64::max);
        let mut y = (top + CLEARANCE - min[1] + DESCENT[0]).clamp(lowest, self.tool.upper_bound[1]);
        let is_free = |y: f64, pose: &mut ToolPose| {
            pose.position[1] = y;
            near.iter().all(|p| self.tool.distance(pose, *p) >= CLEARANCE)
        };
        for step in DESCENT {
            while y > lowest && is_free((y - step).max(lowest), &mut pose) {
                y = (y - step).max(lowest);
            }
        }
        pose.position[1] = y;
        match self.tool.motion {
            Motion::Gripper { .. } => {
                (y <= lowest && is_free(y, &mut pose) && self.straddles(&pose)).then_some(pose)
            }
            _ => Some(pose),
        }
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
