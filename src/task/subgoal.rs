//! From stages to subgoals: a plan's clouds in the world, and what a stage asks of the particles at hand.
//!
//! Stages in a language model's own coordinates come in; a [`StagePlan`] goes out, checked as a whole before
//! anything is simulated, and from it a [`Subgoal`] a stage and the cloud of the final goal. Imports math
//! and llm's stage type.

use super::error::StageError;
use super::measures::connected;
use super::pieces::{Piece, PieceId, Pieces, weights};
use super::resample::{resample, shares};
use crate::llm::lineage::LivePieces;
use crate::llm::stage::{NamedCloud, Stage};
use crate::math::cloud::{Bounds, Point};
use crate::math::volume::measure_volume;

/// Share of a piece's points that may lie below the table's surface: where a cloud ends must not hang on
/// its single lowest point.
const RESTING_QUANTILE: f64 = 0.005;

/// Share of what hangs together that must be matched with one piece for all of it to belong to that.
const VERDICT: f64 = 0.8;

/// How a language model's coordinates lie in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Length of the model's unit, m.
    pub unit_m: f64,
    /// Where the model's origin is in x and z, m. Heights follow from resting on the table.
    pub center_xz: [f64; 2],
}

/// A plan in the world: what to make of what, with which tool.
#[derive(Clone, Debug, PartialEq)]
pub struct StagePlan {
    /// Every piece that ever exists. The first is the initial dough.
    pub pieces: Vec<Piece>,
    /// The stages that use a tool, in order.
    pub stages: Vec<PlannedStage>,
    /// The pieces that exist at the end.
    pub last: Vec<PieceId>,
}

/// One stage of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedStage {
    /// The step's number in the answer.
    pub step: u32,
    pub title: String,
    pub tool: String,
    /// Pieces that the stage uses up, and those that it makes of them.
    pub inputs: Vec<PieceId>,
    pub outputs: Vec<PieceId>,
}

/// What one stage asks of the particles at hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Subgoal {
    pub tool: String,
    pub title: String,
    /// Particles that the stage is about, in increasing order. All others should stay where they are.
    pub active: Vec<usize>,
    /// Where dough should be, m: as many points as active particles, in no particular order.
    pub target: Vec<Point>,
    /// The piece that each target point belongs to.
    pub piece_of_target: Vec<PieceId>,
}

impl Subgoal {
    /// After the stage: each active particle goes to the piece of the target point that it is matched with, but dough
    /// that hangs together, where particles are about `spacing` apart, m, and by [`VERDICT`] belongs to one piece, goes to
    /// that as a whole: unequal halves stay two halves, and no later stage drags a part of one to the other.
    /// `positions` are of all particles, m. `target_of` is for each active particle the index of its target point;
    /// exact assignment is meant.
    pub fn relabel(&self, pieces: &mut Pieces, positions: &[Point], spacing: f64, target_of: &[usize]) {
        let active: Vec<Point> = self.active.iter().map(|&i| positions[i]).collect();
        let matched: Vec<PieceId> = target_of.iter().map(|&t| self.piece_of_target[t]).collect();
        // The target lists one piece after the other.
        let mut outputs = self.piece_of_target.clone();
        outputs.dedup();
        let mut voted = matched.clone();
        for members in connected(&active, spacing) {
            let votes = |piece: PieceId| members.iter().filter(|&&i| matched[i] == piece).count();
            let verdict = outputs.iter().copied().max_by_key(|&piece| votes(piece));
            if let Some(piece) = verdict.filter(|&p| votes(p) as f64 >= VERDICT * members.len() as f64) {
                members.iter().for_each(|&i| voted[i] = piece);
            }
        }
        let count = |of: &[PieceId], piece: PieceId| of.iter().filter(|&&p| p == piece).count();
        // A piece that did not come off has no dough of its own: then the match decides.
        let has_its_dough = |&p: &PieceId| 2 * count(&voted, p) >= count(&matched, p);
        let of = if outputs.iter().all(has_its_dough) { voted } else { matched };
        for (&particle, &piece) in self.active.iter().zip(&of) {
            pieces.assign(particle, piece);
        }
    }
}

/// Volumes may differ by this share before there is a warning: twice what a measurement may be off.
const VOLUME_TOLERANCE: f64 = 0.2;

/// What a plan must fit: the tools at hand and the room.
#[derive(Clone, Debug)]
pub struct World<'a> {
    /// Names of the tools.
    pub tools: Vec<&'a str>,
    /// Where dough may be, m.
    pub workspace: Bounds,
    /// Height at which dough rests, m: where the settled initial dough has its lowest points.
    pub floor_y: f64,
}

impl Frame {
    /// Coordinates that are the world's already.
    pub const WORLD: Self = Self { unit_m: 1.0, center_xz: [0.0, 0.0] };

    /// The cloud in the world, put down so that its low quantile rests at `floor_y`.
    pub fn place(&self, cloud: &[Point], floor_y: f64) -> Vec<Point> {
        let [cx, cz] = self.center_xz;
        let mut placed: Vec<Point> = cloud
            .iter()
            .map(|p| [cx + self.unit_m * p[0], self.unit_m * p[1], cz + self.unit_m * p[2]])
            .collect();
        let lift = floor_y - low_quantile(&placed);
        for p in &mut placed {
            p[1] += lift;
        }
        placed
    }
}

/// The height that all but [`RESTING_QUANTILE`] of the points reach; 0 for an empty cloud. Tells where settled
/// dough rests.
pub fn low_quantile(cloud: &[Point]) -> f64 {
    let mut heights: Vec<f64> = cloud.iter().map(|p| p[1]).collect();
    heights.sort_by(f64::total_cmp);
    heights.get((RESTING_QUANTILE * heights.len() as f64) as usize).copied().unwrap_or(0.0)
}

impl StagePlan {
    /// Resolves names, places every cloud and checks tools and room. A step without tool before the first
    /// with one only builds the initial dough: its outputs are names for it.
    pub fn new(stages: &[Stage], frame: &Frame, world: &World) -> Result<Self, StageError> {
        let first = stages.iter().position(|s| s.tool.is_some()).ok_or(StageError::Empty)?;
        let dough_name = stages[..first].iter().flat_map(|s| &s.outputs).next_back();
        let dough_name = dough_name.map_or("dough", |cloud| cloud.name.as_str());
        let dough = Piece {
            name: dough_name.to_string(),
            points: Vec::new(),
            stated_volume: None,
            measured_volume: 0.0,
        };
        let mut plan = Self { pieces: vec![dough], stages: Vec::new(), last: Vec::new() };
        let mut live = LivePieces::initial(dough_name);
        for stage in &stages[first..] {
            plan.add_stage(stage, &mut live, frame, world)?;
        }
        plan.last = live.ids();
        Ok(plan)
    }

    /// What to say if the first stage makes much more or less of the dough than the `volume`, m^3, that there is.
    pub fn volume_warning(&self, volume: f64) -> Option<String> {
        let first = self.stages.first().filter(|stage| stage.inputs == [0])?;
        let made: f64 = first.outputs.iter().map(|&id| self.pieces[id].measured_volume).sum();
        let is_off = made > 0.0 && (made - volume).abs() > VOLUME_TOLERANCE * made.max(volume);
        is_off.then(|| {
            format!(
                "step {} makes {made:.3e} m^3 of the dough, of which there are {volume:.3e}; a llm_unit_m of {:.3} times \
                 this one's would fit, or else the dough's size or the answer has to change",
                first.step,
                (volume / made).cbrt()
            )
        })
    }

    fn add_stage(
        &mut self,
        stage: &Stage,
        live: &mut LivePieces,
        frame: &Frame,
        world: &World,
    ) -> Result<(), StageError> {
        let step = stage.step;
        let tool = known_tool(stage, &world.tools)?;
        let inputs = live.take(step, &stage.inputs)?;
        let mut outputs = Vec::new();
        for cloud in &stage.outputs {
            let piece = placed_piece(stage, cloud, frame, world)?;
            // A piece that the stage lists though it neither takes nor changes it stays what it is.
            if live.named(&piece.name).is_some_and(|id| self.pieces[id].points == piece.points) {
                continue;
            }
            live.add(self.pieces.len(), &piece.name);
            outputs.push(self.pieces.len());
            self.pieces.push(piece);
        }
        if outputs.is_empty() {
            return Err(StageError::NoOutput { step });
        }
        self.stages.push(PlannedStage { step, title: stage.title.clone(), tool, inputs, outputs });
        Ok(())
    }

    /// What stage number `k` asks of particles that belong to `pieces` now. The seed decides between
    /// equally even samples of the target.
    pub fn subgoal(&self, k: usize, pieces: &Pieces, seed: u64) -> Subgoal {
        let stage = &self.stages[k];
        let active = pieces.members(&stage.inputs);
        let (target, piece_of_target) = self.sample(&stage.outputs, active.len(), seed);
        Subgoal { tool: stage.tool.clone(), title: stage.title.clone(), active, target, piece_of_target }
    }

    /// The last goal for the tool of stage number `k`, with all `n` particles: a stage without a subgoal of its own.
    pub fn last_goal(&self, k: usize, n: usize, seed: u64) -> Subgoal {
        let stage = &self.stages[k];
        let (target, piece_of_target) = self.sample(&self.last, n, seed);
        let (tool, title) = (stage.tool.clone(), stage.title.clone());
        Subgoal { tool, title, active: (0..n).collect(), target, piece_of_target }
    }

    /// The final goal: `n` evenly spread points over the pieces that exist at the end, in proportion to
    /// their volumes.
    pub fn goal_cloud(&self, n: usize, seed: u64) -> Vec<Point> {
        self.sample(&self.last, n, seed).0
    }

    /// `n` points over some pieces, and the piece of each.
    fn sample(&self, ids: &[PieceId], n: usize, seed: u64) -> (Vec<Point>, Vec<PieceId>) {
        let chosen: Vec<&Piece> = ids.iter().map(|&id| &self.pieces[id]).collect();
        let counts = shares(n, &weights(&chosen));
        let mut points = Vec::with_capacity(n);
        let mut piece_of = Vec::with_capacity(n);
        for ((&id, piece), count) in ids.iter().zip(chosen).zip(counts) {
            points.extend(resample(&piece.points, count, seed));
            piece_of.resize(points.len(), id);
        }
        (points, piece_of)
    }
}

fn known_tool(stage: &Stage, tools: &[&str]) -> Result<String, StageError> {
    let known = || tools.iter().map(|t| format!("`{t}`")).collect::<Vec<_>>().join(", ");
    match &stage.tool {
        None => Err(StageError::NoTool { step: stage.step, known: known() }),
        Some(tool) if !tools.contains(&tool.as_str()) => {
            Err(StageError::UnknownTool { step: stage.step, tool: tool.clone(), known: known() })
        }
        Some(tool) => Ok(tool.clone()),
    }
}

/// A stage's output as a piece in the world, if it can be one.
fn placed_piece(
    stage: &Stage,
    cloud: &NamedCloud,
    frame: &Frame,
    world: &World,
) -> Result<Piece, StageError> {
    let (step, name) = (stage.step, cloud.name.clone());
    let bad = |problem: &str| StageError::BadCloud { step, name: name.clone(), problem: problem.to_string() };
    if cloud.points.is_empty() {
        return Err(bad("no points"));
    }
    if cloud.points.iter().flatten().any(|x| !x.is_finite()) {
        return Err(bad("coordinates that are not finite numbers"));
    }
    let points = frame.place(&cloud.points, world.floor_y);
    if let Some(error) = outside(&points, step, &cloud.name, &world.workspace) {
        return Err(error);
    }
    let stated = stage.stated_volume.get(&cloud.name).filter(|v| **v > 0.0 && v.is_finite());
    let stated_volume = stated.map(|v| v * frame.unit_m.powi(3));
    let measured_volume = measure_volume(&points);
    Ok(Piece { name, points, stated_volume, measured_volume })
}

/// The error for the wall that `points` pass farthest, if they pass one.
fn outside(points: &[Point], step: u32, name: &str, workspace: &Bounds) -> Option<StageError> {
    let reached = Bounds::of(points)?;
    let mut worst = None;
    let mut most = 0.0;
    for (a, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
        let low = (reached.min[a], workspace.min[a], workspace.min[a] - reached.min[a]);
        let high = (reached.max[a], workspace.max[a], reached.max[a] - workspace.max[a]);
        for (reach_m, limit_m, excess_m) in [low, high] {
            if excess_m > most {
                most = excess_m;
                let name = name.to_string();
                worst = Some(StageError::OutsideWorkspace { step, name, axis, reach_m, limit_m, excess_m });
            }
        }
    }
    worst
}
