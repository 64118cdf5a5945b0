//! The frames of a run, and their arrays in trajectory.npz.
//!
//! The executed states come in one control step at a time ([`Trajectory::push`]); arrays go out, and back
//! in. Imports `sim`'s tool pose and `store::npz`.

use std::path::Path;

use ndarray::{Array1, Array2, Array3, Axis, Ix1, Ix2, Ix3};

use super::error::StoreError;
use super::npz;
use crate::math::cloud::Point;
use crate::sim::tool::ToolPose;

/// A frame: the positions of all n particles, m.
pub type Frame = Vec<[f32; 3]>;

/// T + 1 frames of n particles and what led from one to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// T + 1 frames of n positions, m.
    pub positions: Vec<Frame>,
    /// T + 1 poses of the tool in use.
    pub tool_pose: Vec<ToolPose>,
    /// T + 1 indices into the plan's tools; -1 where no tool is in use.
    pub tool: Vec<i32>,
    /// T + 1 stage indices, from 0: the stage whose step led to the frame. Frame 0 belongs to stage 0.
    pub stage: Vec<i32>,
    /// T + 1 EMDs between the frame and its stage's subgoal, m; NaN where it was not computed.
    pub emd: Vec<f64>,
    /// T actions, each as long as its tool's action.
    pub actions: Vec<Vec<f64>>,
    /// n: the piece of dough that a particle belongs to, from 0.
    pub piece: Vec<i32>,
    /// The initial state, n points.
    pub initial: Vec<Point>,
    /// The target of the whole task.
    pub target: Vec<Point>,
    /// The subgoal of each stage.
    pub subgoals: Vec<Vec<Point>>,
    /// What the accepted segments aimed at, in order.
    pub reachable: Vec<Reachable>,
}

/// Where a segment wanted every particle to go.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reachable {
    /// The frame that the segment began with; it counts from there to the next segment.
    pub frame: usize,
    /// n places in the order of the particles, m: the next reachable cloud of Algorithm 1, or, where the method has
    /// none, each particle's match in the subgoal.
    pub cloud: Frame,
}

/// What one control step adds to a trajectory.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// The positions after the step, m.
    pub positions: &'a [Point],
    /// Index of the tool in use.
    pub tool: usize,
    /// Its pose after the step.
    pub tool_pose: ToolPose,
    /// Index of the stage, from 0.
    pub stage: usize,
    /// The action.
    pub action: &'a [f64],
    /// EMD to the stage's subgoal after the step, m; NaN if it was not computed.
    pub emd: f64,
}

const NO_POSE: ToolPose = ToolPose { position: [0.0; 3], rotation: [1.0, 0.0, 0.0, 0.0], gap: 0.0 };

impl Trajectory {
    /// A trajectory of one frame, the initial state, with no tool in use and one piece of dough.
    pub fn new(initial: Vec<Point>, target: Vec<Point>, subgoals: Vec<Vec<Point>>) -> Self {
        Self {
            positions: vec![frame(&initial)],
            tool_pose: vec![NO_POSE],
            tool: vec![-1],
            stage: vec![0],
            emd: vec![f64::NAN],
            actions: Vec::new(),
            piece: vec![0; initial.len()],
            initial,
            target,
            subgoals,
            reachable: Vec::new(),
        }
    }

    /// Appends the frame that a control step led to.
    pub fn push(&mut self, step: Step<'_>) {
        self.positions.push(frame(step.positions));
        self.tool_pose.push(step.tool_pose);
        self.tool.push(step.tool as i32);
        self.stage.push(step.stage as i32);
        self.emd.push(step.emd);
        self.actions.push(step.action.to_vec());
    }

    /// Appends the frame that a control step without tool led to.
    pub fn push_free(&mut self, positions: &[Point], stage: usize, emd: f64) {
        let step = Step { positions, tool: 0, tool_pose: NO_POSE, stage, action: &[], emd };
        self.push(step);
        if let Some(tool) = self.tool.last_mut() {
            *tool = -1;
        }
    }

    /// T, the number of control steps.
    pub fn steps(&self) -> usize {
        self.actions.len()
    }

    /// n, the number of particles.
    pub fn particles(&self) -> usize {
        self.initial.len()
    }

    /// The tool in use at a frame: its index and pose.
    pub fn tool_at(&self, frame: usize) -> Option<(usize, ToolPose)> {
        usize::try_from(self.tool[frame]).ok().map(|tool| (tool, self.tool_pose[frame]))
    }

    /// The last frame of a stage; `None` if the stage made no step.
    pub fn last_frame_of(&self, stage: usize) -> Option<usize> {
        // Frame 0 is nobody's step.
        (1..self.stage.len()).rev().find(|&t| self.stage[t] == stage as i32)
    }

    /// Writes trajectory.npz.
    pub fn write(&self, path: &Path) -> Result<(), StoreError> {
        let frames = self.positions.len();
        let width = self.actions.iter().map(Vec::len).max().unwrap_or(0);
        let mut npz = npz::Writer::new(path);
        let positions =
            Array3::from_shape_fn((frames, self.particles(), 3), |(t, i, a)| self.positions[t][i][a]);
        npz.add("positions", &positions)?;
        let poses = Array2::from_shape_fn((frames, 8), |(t, c)| pose_components(&self.tool_pose[t])[c]);
        npz.add("tool_pose", &poses)?;
        npz.add("tool", &Array1::from(self.tool.clone()))?;
        npz.add("stage", &Array1::from(self.stage.clone()))?;
        npz.add("emd", &Array1::from(self.emd.clone()))?;
        let action = |(t, c): (usize, usize)| self.actions[t].get(c).copied().unwrap_or(0.0);
        npz.add("actions", &Array2::from_shape_fn((self.steps(), width), action))?;
        npz.add("piece", &Array1::from(self.piece.clone()))?;
        npz.add("initial", &npz::cloud_array(&self.initial))?;
        npz.add("target", &npz::cloud_array(&self.target))?;
        for (k, subgoal) in self.subgoals.iter().enumerate() {
            npz.add(&format!("subgoal_{k}"), &npz::cloud_array(subgoal))?;
        }
        if !self.reachable.is_empty() {
            let frames = self.reachable.iter().map(|r| r.frame as i32);
            npz.add("reachable_frame", &Array1::from_iter(frames))?;
        }
        for (k, reachable) in self.reachable.iter().enumerate() {
            let rows = Array2::from_shape_fn((reachable.cloud.len(), 3), |(i, a)| reachable.cloud[i][a]);
            npz.add(&format!("reachable_{k}"), &rows)?;
        }
        npz.finish()
    }

    /// Reads trajectory.npz. Actions keep their padding.
    pub fn read(path: &Path) -> Result<Self, StoreError> {
        let mut npz = npz::Reader::open(path)?;
        let positions = npz.array::<Ix3>("positions")?;
        let (frames, particles) = (positions.shape()[0], positions.shape()[1]);
        if positions.shape()[2] != 3 || frames == 0 {
            let reason = format!("its shape is {:?}, but it has to be (frames, n, 3)", positions.shape());
            return Err(npz.entry_error("positions", reason));
        }
        let poses = npz.array::<Ix2>("tool_pose")?;
        let actions = npz.array::<Ix2>("actions")?;
        let count = npz.names().iter().filter(|name| name.starts_with("subgoal_")).count();
        let trajectory = Self {
            positions: positions
                .axis_iter(Axis(0))
                .map(|f| f.rows().into_iter().map(|p| [p[0] as f32, p[1] as f32, p[2] as f32]).collect())
                .collect(),
            tool_pose: poses.rows().into_iter().map(|row| pose_of(&row.to_vec())).collect(),
            tool: integers(npz.array::<Ix1>("tool")?),
            stage: integers(npz.array::<Ix1>("stage")?),
            emd: npz.array::<Ix1>("emd")?.to_vec(),
            actions: actions.rows().into_iter().map(|row| row.to_vec()).collect(),
            piece: integers(npz.array::<Ix1>("piece")?),
            initial: npz.cloud("initial")?,
            target: npz.cloud("target")?,
            subgoals: (0..count).map(|k| npz.cloud(&format!("subgoal_{k}"))).collect::<Result<_, _>>()?,
            reachable: read_reachable(&mut npz)?,
        };
        for (k, reachable) in trajectory.reachable.iter().enumerate() {
            if reachable.frame >= frames || reachable.cloud.len() != particles {
                let reason = format!("it must have {particles} rows, and a `reachable_frame` below {frames}");
                return Err(npz.entry_error(&format!("reachable_{k}"), reason));
            }
        }
        for (entry, found, expected) in [
            ("tool_pose", trajectory.tool_pose.len(), frames),
            ("tool", trajectory.tool.len(), frames),
            ("stage", trajectory.stage.len(), frames),
            ("emd", trajectory.emd.len(), frames),
            ("actions", trajectory.actions.len(), frames - 1),
            ("piece", trajectory.piece.len(), particles),
            ("initial", trajectory.initial.len(), particles),
        ] {
            if found != expected {
                let reason = format!("it has {found} rows, but `positions` calls for {expected}");
                return Err(npz.entry_error(entry, reason));
            }
        }
        Ok(trajectory)
    }
}

/// The clouds that segments aimed at; runs of earlier versions have none.
fn read_reachable(npz: &mut npz::Reader) -> Result<Vec<Reachable>, StoreError> {
    if !npz.has("reachable_frame") {
        return Ok(Vec::new());
    }
    let frames = integers(npz.array::<Ix1>("reachable_frame")?);
    let frames = frames.into_iter().map(|f| usize::try_from(f).unwrap_or(usize::MAX)).enumerate();
    frames
        .map(|(k, at)| Ok(Reachable { frame: at, cloud: frame(&npz.cloud(&format!("reachable_{k}"))?) }))
        .collect()
}

/// A cloud in single precision.
fn frame(cloud: &[Point]) -> Frame {
    cloud.iter().map(|p| p.map(|v| v as f32)).collect()
}

/// (position, rotation, gap).
fn pose_components(pose: &ToolPose) -> [f64; 8] {
    let ([x, y, z], [qw, qx, qy, qz]) = (pose.position, pose.rotation);
    [x, y, z, qw, qx, qy, qz, pose.gap]
}

/// The inverse of [`pose_components`]; a short row is filled up with zeros.
fn pose_of(row: &[f64]) -> ToolPose {
    let at = |c: usize| row.get(c).copied().unwrap_or(0.0);
    ToolPose { position: [at(0), at(1), at(2)], rotation: [at(3), at(4), at(5), at(6)], gap: at(7) }
}

fn integers(array: Array1<f64>) -> Vec<i32> {
    array.into_iter().map(|v| v as i32).collect()
}
