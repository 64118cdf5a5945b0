//! Where all tools of a world are at every substep of a rollout, and the adjoint of that.
//!
//! Start poses and actions come in, poses go out; adjoints of poses come in, those of the actions go out.
//! Imports motion.
//!
//! Tools feel nothing of the dough, so their paths are known before the first substep: `P_{t+1} = advance(P_t, a_s)`
//! for substep t of control step s. Backwards, contact in substep t adds to the adjoints of P_t and P_{t+1}, in this
//! order:
//!
//! ```text
//! P_{t+1}_adj += contact's share at the substep's end
//! (P_t_adj, a_s_adj) = advance_adj(P_{t+1}_adj),  a_s_adj added up over the control step
//! P_t_adj     += contact's share at its start
//! ```

use super::motion::{advance, advance_adj, substep_share, substep_share_adj};
use super::{PoseAdj, Tool, ToolPose};

/// The poses of all tools at every substep.
#[derive(Clone, Debug, Default)]
pub struct ToolPath {
    /// Control steps x components of all tools in order.
    actions: Vec<Vec<f64>>,
    substeps: usize,
    /// One more than substeps, all tools each.
    poses: Vec<Vec<ToolPose>>,
}

impl ToolPath {
    /// Moves `tools` from `start` through `actions`, `substeps` to a control step.
    pub fn new(tools: &[Tool], substeps: usize, start: &[ToolPose], actions: &[Vec<f64>]) -> Self {
        let mut poses = Vec::with_capacity(actions.len() * substeps + 1);
        poses.push(start.to_vec());
        let mut now = start.to_vec();
        for row in actions {
            for _ in 0..substeps {
                let mut rest = row.as_slice();
                for (pose, tool) in now.iter_mut().zip(tools) {
                    let (action, others) = rest.split_at(tool.action_len());
                    *pose = advance(tool, pose, &substep_share(tool, action, substeps));
                    rest = others;
                }
                poses.push(now.clone());
            }
        }
        Self { actions: actions.to_vec(), substeps, poses }
    }

    /// The poses at the start of substep `t`.
    pub fn at(&self, t: usize) -> &[ToolPose] {
        &self.poses[t]
    }

    /// The poses at the end of control step `step` (0: the start).
    pub fn after_step(&self, step: usize) -> &[ToolPose] {
        &self.poses[step * self.substeps]
    }

    /// Adjoint of substep `t` of the motion: turns the adjoint of the poses at its end into that at its
    /// start and adds the action's to `actions_adj`.
    pub fn substep_adj(
        &self,
        tools: &[Tool],
        t: usize,
        poses_adj: &mut [PoseAdj],
        actions_adj: &mut [Vec<f64>],
    ) {
        let step = t / self.substeps;
        let (row, row_adj) = (&self.actions[step], &mut actions_adj[step]);
        let mut from = 0;
        for (i, tool) in tools.iter().enumerate() {
            let range = from..from + tool.action_len();
            let action = &row[range.clone()];
            let u = substep_share(tool, action, self.substeps);
            let (pose_adj, u_adj) = advance_adj(tool, &self.poses[t][i], &u, &poses_adj[i]);
            poses_adj[i] = pose_adj;
            substep_share_adj(tool, action, self.substeps, &u_adj, &mut row_adj[range.clone()]);
            from = range.end;
        }
    }
}
