//! From a run in memory to the record that is written to disk.
//!
//! A [`TaskRun`] and what it was made from come in, a [`RunRecord`] goes out. Imports task and store.

use rayon::prelude::*;

use crate::emd::exact::assign_within;
use crate::llm::repair::Conversation;
use crate::llm::stage::Stage;
use crate::math::cloud::Point;
use crate::store::record::{PlanFile, RunRecord, Segment, StagePlan, StageSummary, Summary};
use crate::store::trajectory::{Reachable, Step, Trajectory};
use crate::task::run::{Planning, StageRun, TaskRun};
use crate::task::{Scene, Subgoal};

/// How EMDs are computed, as results name it.
const ESTIMATOR: &str = "exact assignment, all particles, settled dough";

/// How much farther than necessary the matches that are drawn may be on average, m.
const MATCHING_SLACK: f64 = 1e-4;

/// What a run was made from.
pub struct RunInputs<'a> {
    pub scene: &'a Scene,
    pub task_file: &'a str,
    pub stages: &'a [Stage],
    pub planning: &'a Planning,
    pub response: Option<&'a str>,
    pub conversation: Option<&'a Conversation>,
    pub seed: u64,
    pub command: String,
}

/// The record of a run.
pub fn record(inputs: &RunInputs<'_>, run: &TaskRun) -> RunRecord {
    let mut trajectory = Trajectory::new(run.initial.clone(), run.goal.clone(), Vec::new());
    trajectory.piece.clone_from(&run.piece);
    let mut stages = Vec::new();
    let mut aims = Vec::new();
    for (index, stage) in run.stages.iter().enumerate() {
        trajectory.subgoals.push(stage.subgoal.target.clone());
        let segments = push_segments(&mut trajectory, index, stage, &mut aims);
        push_free(&mut trajectory, index, &stage.settling, stage.emd_final);
        stages.push(StagePlan {
            title: stage.title.clone(),
            tool: stage.tool,
            code: code_of(inputs.stages, index),
            segments,
        });
    }
    let reachable = |aim: &Aim<'_>| aim.reachable(&trajectory);
    trajectory.reachable = aims.par_iter().map(reachable).collect();
    let scene = inputs.scene;
    let version = env!("CARGO_PKG_VERSION").to_owned();
    RunRecord {
        summary: summary(inputs, run, &version),
        plan: PlanFile {
            version,
            command: inputs.command.clone(),
            task: scene.name.clone(),
            seed: inputs.seed,
            method: inputs.planning.method.name(),
            task_file: inputs.task_file.to_owned(),
            response: inputs.response.map(str::to_owned),
            conversation: inputs.conversation.cloned(),
            params: scene.params.clone(),
            planner: scene.planner.clone(),
            search: Some(inputs.planning.search.clone()),
            tools: scene.tools.iter().map(|t| t.tool.clone()).collect(),
            stages,
        },
        trajectory,
    }
}

/// The code of the stage number `index` among those with a tool.
fn code_of(stages: &[Stage], index: usize) -> String {
    stages.iter().filter(|s| s.tool.is_some()).nth(index).map_or_else(String::new, |s| s.code.clone())
}

/// Adds the executed steps of a stage, and to `aims` what each of its segments went for.
fn push_segments<'a>(
    trajectory: &mut Trajectory,
    index: usize,
    stage: &'a StageRun,
    aims: &mut Vec<Aim<'a>>,
) -> Vec<Segment> {
    let mut segments = Vec::new();
    for s in &stage.trace.segments {
        segments.push(Segment {
            placed: s.placed,
            start_pose: s.start_pose,
            first_frame: trajectory.positions.len() - 1,
            accepted: s.accepted,
            actions: s.horizon.actions.clone(),
            emd_before: s.emd_before,
            emd_after: s.emd_after,
            losses: s.horizon.losses.clone(),
        });
        if !s.accepted {
            continue;
        }
        aims.push(Aim {
            frame: trajectory.positions.len() - 1,
            subgoal: &stage.subgoal,
            cloud: &s.reachable,
        });
        let last = s.horizon.frames.len() - 1;
        for (k, frame) in s.horizon.frames.iter().enumerate() {
            trajectory.push(Step {
                positions: frame,
                tool: stage.tool,
                tool_pose: s.horizon.poses[k],
                stage: index,
                action: &s.horizon.actions[k],
                emd: if k == last && s.settling.is_empty() { s.emd_after } else { f64::NAN },
            });
        }
        push_free(trajectory, index, &s.settling, s.emd_after);
    }
    segments
}

/// What a segment went for.
struct Aim<'a> {
    /// The frame at which it begins.
    frame: usize,
    subgoal: &'a Subgoal,
    /// The next reachable cloud; empty where the method has none.
    cloud: &'a [Point],
}

impl Aim<'_> {
    /// Where every particle should go: to the next reachable cloud, or else to its match in the stage's subgoal.
    fn reachable(&self, trajectory: &Trajectory) -> Reachable {
        let single = |p: &Point| p.map(|v| v as f32);
        let now = &trajectory.positions[self.frame];
        let cloud = if self.cloud.len() == now.len() {
            self.cloud.iter().map(single).collect()
        } else {
            let Subgoal { active, target, .. } = self.subgoal;
            let from: Vec<Point> = active.iter().map(|&i| now[i].map(f64::from)).collect();
            let mut cloud = now.clone();
            for (&i, &match_of) in active.iter().zip(&assign_within(&from, target, MATCHING_SLACK).target_of)
            {
                cloud[i] = single(&target[match_of]);
            }
            cloud
        };
        Reachable { frame: self.frame, cloud }
    }
}

/// Adds free steps, after which the EMD is `emd`.
fn push_free(trajectory: &mut Trajectory, index: usize, frames: &[Vec<Point>], emd: f64) {
    let last = frames.len().saturating_sub(1);
    for (k, frame) in frames.iter().enumerate() {
        trajectory.push_free(frame, index, if k == last { emd } else { f64::NAN });
    }
}

fn summary(inputs: &RunInputs<'_>, run: &TaskRun, version: &str) -> Summary {
    let scene = inputs.scene;
    let stages = run.stages.iter().map(|stage| StageSummary::of(scene, stage)).collect();
    let score = run.score();
    Summary {
        task: scene.name.clone(),
        seed: inputs.seed,
        method: inputs.planning.method.name(),
        score,
        threshold: scene.threshold,
        success: score >= scene.threshold,
        emd_initial: run.emd_initial,
        emd_final: run.emd_final,
        seconds: run.seconds,
        particles: run.initial.len(),
        stages,
        score_ceiling: Some(run.ceiling()),
        shape: Some(run.shape.clone()),
        estimator: ESTIMATOR.to_owned(),
        version: version.to_owned(),
        model: inputs.conversation.map(|c| c.model.clone()),
        answers: inputs.conversation.map(|c| c.attempts.len()),
    }
}
