//! Where a search begins: places from which a tool would push dough the way it should go.
//!
//! Dough, its desired motion and a tool come in; a few different places go out, best first, each with the
//! direction in the space of actions that pushes best. Imports placement.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::math::cloud::{Point, distance};
use crate::plan::placement::{Placement, same_surface};
use crate::plan::search::stroke::{Stroke, free_components};
use crate::sim::ToolPose;
use crate::sim::tool::Tool;
use crate::sim::tool::path::ToolPath;

/// Turns about the vertical that are tried: a full circle, because a tool need not be symmetric.
const YAWS: usize = 8;
/// Seeds differ in place by at least this, m, or in yaw.
const APART: f64 = 0.02;
/// Which share of the strokes from seeds inside the dough only stir, and of those that go by the strays alone.
const STIRRING: f64 = 0.3;
const CLEARING: f64 = 0.9;
/// Dough farther from the tool than this does not say where to push, m.
const NEAR: f64 = 0.03;

/// A place to begin from.
#[derive(Clone, Debug)]
pub struct Seed {
    /// Place, yaw and gap; no knots yet.
    pub stroke: Stroke,
    /// How far the tool first goes down into the dough, m.
    pub dive: f64,
    /// Which share of the strokes from here only stir.
    pub stirring: f64,
    /// Where it should go then: a direction in the space of actions, whose largest component is 1 or -1, or all
    /// are 0.
    pub lean: Vec<f64>,
}

/// Up to `count` places, best first.
///
/// A tool may push from where it touches the dough, or from inside, as low as it can go: a knife that stands
/// on a bar pushes nothing apart, but one that has gone through it does. Some of the latter go by the `strays` alone,
/// particles that are where no dough should be: what is left of a hole, or between two halves. A gripper may also stand on
/// the dough or beside it, and push like any other tool: closing its plates makes dough higher, and nothing else lowers it.
pub fn seeds(
    place: &Placement<'_>,
    substeps: usize,
    motion: &[Point],
    strays: &[usize],
    count: usize,
) -> Vec<Seed> {
    let mut all = Kinds::default();
    let by_yaw: Vec<Kinds> = (0..YAWS).into_par_iter().map(|k| Kinds::at_yaw(place, strays, k)).collect();
    for Kinds { touching, inside, clearing, outside } in by_yaw {
        all.touching.extend(touching);
        all.inside.extend(inside);
        all.clearing.extend(clearing);
        all.outside.extend(outside);
    }
    // Scores of the kinds do not compare: inside, the tool is near to far more dough.
    let mut chosen = apart(place.tool, all.inside, count / 3);
    chosen.extend(apart(place.tool, all.clearing, count / 5));
    chosen.extend(apart(place.tool, all.outside, count / 3));
    let rest = count - chosen.len();
    chosen.extend(apart(place.tool, all.touching, rest));
    let lean = |pose: &ToolPose| lean(place, substeps, motion, pose);
    let seed = |s: Scored| Seed { lean: lean(&s.pose), stroke: s.stroke, dive: s.dive, stirring: s.stirring };
    chosen.into_iter().map(seed).collect()
}

/// A place and what it promises.
struct Scored {
    score: f64,
    stroke: Stroke,
    pose: ToolPose,
    dive: f64,
    stirring: f64,
}

/// The places that a tool may push from: where it touches the dough, as low in it as it can go, there for the sake of the
/// strays alone, and on the dough or beside it for a gripper.
#[derive(Default)]
struct Kinds {
    touching: Vec<Scored>,
    inside: Vec<Scored>,
    clearing: Vec<Scored>,
    outside: Vec<Scored>,
}

impl Kinds {
    /// The places of a tool that is turned by `k` of [`YAWS`] parts of a circle.
    fn at_yaw(place: &Placement<'_>, strays: &[usize], k: usize) -> Self {
        let mut kinds = Self::default();
        let lowest = place.tool.lower_bound[1];
        let yaw = TAU * k as f64 / YAWS as f64;
        let turned = Stroke { x: 0.0, z: 0.0, yaw, gap: 0.0, steps: 0, knots: Vec::new(), stir: 0.0 };
        let begun_at = |pose: &ToolPose| Stroke {
            x: pose.position[0],
            z: pose.position[2],
            gap: pose.gap,
            ..turned.clone()
        };
        let rotation = turned.pose_above(place.rest).rotation;
        for pose in place.candidates(rotation) {
            let stroke = begun_at(&pose);
            let dive = pose.position[1] - lowest;
            if dive > 0.0 {
                let [x, _, z] = pose.position;
                let pose = ToolPose { position: [x, lowest, z], ..pose };
                let score = place.score(&pose);
                kinds.inside.push(Scored { score, stroke: stroke.clone(), pose, dive, stirring: STIRRING });
                let score = place.score_of(&pose, strays);
                if score > 0.0 {
                    kinds.clearing.push(Scored {
                        score,
                        stroke: stroke.clone(),
                        pose,
                        dive,
                        stirring: CLEARING,
                    });
                }
            }
            kinds.touching.push(Scored { score: place.score(&pose), stroke, pose, dive: 0.0, stirring: 0.0 });
        }
        for pose in place.candidates_outside(rotation) {
            let score = place.pushing_score(&pose, place.active);
            kinds.outside.push(Scored { score, stroke: begun_at(&pose), pose, dive: 0.0, stirring: 0.0 });
        }
        kinds
    }
}

/// The best `count` that differ from one another.
fn apart(tool: &Tool, mut scored: Vec<Scored>, count: usize) -> Vec<Scored> {
    scored.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut chosen: Vec<Scored> = Vec::new();
    for next in scored {
        let is_new = |other: &Scored| {
            distance(other.pose.position, next.pose.position) > APART
                || (other.stroke.yaw != next.stroke.yaw && !same_surface(tool, &other.pose, &next.pose))
        };
        if chosen.len() < count && chosen.iter().all(is_new) {
            chosen.push(next);
        }
    }
    chosen
}

/// Which way each action should go, to first order: an action that brings the tool's surface nearer to dough
/// pushes that dough along the surface's normal, which is good as far as the dough should go there.
fn lean(place: &Placement<'_>, substeps: usize, motion: &[Point], pose: &ToolPose) -> Vec<f64> {
    let tool = place.tool;
    let here = tool.at(pose);
    let near: Vec<(Point, f64, f64)> = place
        .active
        .iter()
        .filter_map(|&i| {
            let p = place.positions[i];
            let d = here.distance(p);
            if d > NEAR {
                return None;
            }
            let along: f64 = motion[i].iter().zip(here.distance_and_outward(p).1).map(|(m, n)| m * n).sum();
            Some((p, d, along / (d.max(0.0) + place.delta)))
        })
        .collect();
    let mut lean = vec![0.0; tool.action_len()];
    for c in free_components(tool) {
        let mut action = vec![0.0; tool.action_len()];
        action[c] = 1.0;
        let path = ToolPath::new(std::slice::from_ref(tool), substeps, &[*pose], &[action]);
        let moved = tool.at(&path.after_step(1)[0]);
        lean[c] = near.iter().map(|(p, d, worth)| worth * (d - moved.distance(*p))).sum();
    }
    let most = lean.iter().map(|g: &f64| g.abs()).fold(0.0, f64::max);
    if most > 0.0 {
        lean.iter_mut().for_each(|g| *g /= most);
    }
    lean
}
