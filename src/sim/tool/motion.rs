//! How an action moves a tool during one substep, and the adjoint of that.
//!
//! A pose and the substep's share of the action come in, the next pose goes out (PlasticineLab's
//! kinematics). Imports quaternions.
//!
//! An action `a` in [-1, 1] moves a tool for a control step of N substeps; each substep gets
//!
//! ```text
//! u = clip(a, -1, 1) scale / N
//! ```
//!
//! With position p, orientation q (a unit quaternion; `exp(w)` is that of the axis-angle w), R(q) its matrix, y the unit
//! vector upward, and `[.]` the clamp to the tool's bounds:
//!
//! ```text
//! rolling pin   d = y x (R(q) (-y))                            across the pin
//!               p <- [p + d (0.03 u_roll + u_slide) + y u_rise]
//!               q <- exp(-u_yaw y) q exp(u_roll y)             yaw in the world, roll about its own axis
//! translation   p <- [p + u]
//! rigid         p <- [p + u_xyz],  q <- exp(w) q               turns about the world's axes
//! gripper       p <- [p + u_xyz],  q <- q exp(w),  gap <- [gap - u_gap]
//! ```
//!
//! and q is normalised. Where a clamp or a clip holds, the derivative is zero.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{PoseAdj, Tool, ToolPose};
use crate::math::quaternion::{
    IDENTITY, Quaternion, from_axis_angle, from_axis_angle_adj, normalize, normalize_adj, product,
    product_adj, turning_matrix, turning_matrix_adj,
};

/// How an action moves a tool, and how many components it has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Motion {
    /// (roll, yaw, rise, slide).
    RollingPin,
    /// (x, y, z).
    Translation,
    /// (x, y, z, axis-angle about the world axes).
    Rigid,
    /// (x, y, z, axis-angle in the tool's frame, gap): two copies of the shape at -gap/2 and +gap/2
    /// along the tool's x axis. The gap stays in `[minimal_gap, maximal_gap]`; a positive action closes.
    Gripper { minimal_gap: f64, maximal_gap: f64 },
}

/// Sideways travel of a rolling pin per radian of roll, m: PlasticineLab's constant, whatever the radius.
const ROLL_TRAVEL: f64 = 0.03;

/// Most components an action has.
pub const ACTION_MAX: usize = 7;

impl Motion {
    /// Components of an action.
    pub fn action_len(&self) -> usize {
        match self {
            Self::RollingPin => 4,
            Self::Translation => 3,
            Self::Rigid => 6,
            Self::Gripper { .. } => ACTION_MAX,
        }
    }
}

impl Motion {
    /// The action component that moves the tool up.
    pub fn rise(&self) -> usize {
        match self {
            Self::RollingPin => 2,
            Self::Translation | Self::Rigid | Self::Gripper { .. } => 1,
        }
    }

    /// The action components that shift the tool along x and along z; none for a rolling pin, which goes where it
    /// rolls.
    pub fn sideways(&self) -> Option<[usize; 2]> {
        match self {
            Self::RollingPin => None,
            Self::Translation | Self::Rigid | Self::Gripper { .. } => Some([0, 2]),
        }
    }
}

/// The tool's displacement before clamping, and the two rotations around its orientation: the next one
/// is `before q after`.
struct Increment {
    shift: Vector3<f64>,
    before: Quaternion,
    after: Quaternion,
}

/// An action's share of one substep: clipped to [-1, 1], scaled, divided.
pub fn substep_share(tool: &Tool, action: &[f64], substeps: usize) -> [f64; ACTION_MAX] {
    let mut u = [0.0; ACTION_MAX];
    for (i, (a, scale)) in action.iter().zip(&tool.action_scale).enumerate() {
        u[i] = a.clamp(-1.0, 1.0) * scale / substeps as f64;
    }
    u
}

/// Adjoint of [`substep_share`], added into `action_adj`; zero where the action is clipped.
pub fn substep_share_adj(
    tool: &Tool,
    action: &[f64],
    substeps: usize,
    u_adj: &[f64; ACTION_MAX],
    action_adj: &mut [f64],
) {
    for (i, (a, scale)) in action.iter().zip(&tool.action_scale).enumerate() {
        if a.abs() <= 1.0 {
            action_adj[i] += u_adj[i] * scale / substeps as f64;
        }
    }
}

/// The direction a rolling pin travels in when it rolls: `(0,1,0) x (q (0,-1,0) q^-1)`.
fn roll_direction(rotation: Quaternion) -> Vector3<f64> {
    let y_dir = -turning_matrix(rotation).column(1);
    Vector3::y().cross(&y_dir)
}

fn increment(motion: &Motion, pose: &ToolPose, u: &[f64; ACTION_MAX]) -> Increment {
    let turn = || from_axis_angle(Vector3::new(u[3], u[4], u[5]));
    let shift = Vector3::new(u[0], u[1], u[2]);
    match motion {
        Motion::RollingPin => {
            let mut shift = roll_direction(pose.rotation) * (ROLL_TRAVEL * u[0] + u[3]);
            shift.y = u[2];
            Increment {
                shift,
                before: from_axis_angle(Vector3::new(0.0, -u[1], 0.0)),
                after: from_axis_angle(Vector3::new(0.0, u[0], 0.0)),
            }
        }
        Motion::Translation => Increment { shift, before: IDENTITY, after: IDENTITY },
        Motion::Rigid => Increment { shift, before: turn(), after: IDENTITY },
        Motion::Gripper { .. } => Increment { shift, before: IDENTITY, after: turn() },
    }
}

/// Adjoint of [`increment`]: adjoint of u, and of the rotation through the roll direction.
fn increment_adj(
    motion: &Motion,
    pose: &ToolPose,
    u: &[f64; ACTION_MAX],
    adj: &Increment,
) -> ([f64; ACTION_MAX], Quaternion) {
    let mut u_adj = [0.0; ACTION_MAX];
    let mut q_adj = [0.0; 4];
    if *motion == Motion::RollingPin {
        let mut shift_adj = adj.shift;
        u_adj[2] = shift_adj.y;
        shift_adj.y = 0.0;
        let travel = ROLL_TRAVEL * u[0] + u[3];
        let travel_adj = roll_direction(pose.rotation).dot(&shift_adj);
        u_adj[0] = ROLL_TRAVEL * travel_adj;
        u_adj[3] = travel_adj;
        // roll_direction = -y x R e_y, so R e_y receives y x (adjoint of the direction).
        let mut r_adj = nalgebra::Matrix3::zeros();
        r_adj.set_column(1, &Vector3::y().cross(&(shift_adj * travel)));
        q_adj = turning_matrix_adj(pose.rotation, &r_adj);
        u_adj[1] = -from_axis_angle_adj(Vector3::new(0.0, -u[1], 0.0), adj.before).y;
        u_adj[0] += from_axis_angle_adj(Vector3::new(0.0, u[0], 0.0), adj.after).y;
        return (u_adj, q_adj);
    }
    u_adj[..3].copy_from_slice(adj.shift.as_slice());
    let turn_adj = match motion {
        Motion::Rigid => adj.before,
        Motion::Gripper { .. } => adj.after,
        Motion::RollingPin | Motion::Translation => return (u_adj, q_adj),
    };
    let a_adj = from_axis_angle_adj(Vector3::new(u[3], u[4], u[5]), turn_adj);
    u_adj[3..6].copy_from_slice(a_adj.as_slice());
    (u_adj, q_adj)
}

/// The pose after one substep.
pub fn advance(tool: &Tool, pose: &ToolPose, u: &[f64; ACTION_MAX]) -> ToolPose {
    let inc = increment(&tool.motion, pose, u);
    let position = std::array::from_fn(|a| {
        (pose.position[a] + inc.shift[a]).clamp(tool.lower_bound[a], tool.upper_bound[a])
    });
    let rotation = normalize(product(inc.before, product(pose.rotation, inc.after)));
    let gap = match tool.motion {
        Motion::Gripper { minimal_gap, maximal_gap } => (pose.gap - u[6]).clamp(minimal_gap, maximal_gap),
        _ => pose.gap,
    };
    ToolPose { position, rotation, gap }
}

/// Adjoint of [`advance`]: the adjoints of the pose and of u. Zero through a clamp that acts.
pub fn advance_adj(
    tool: &Tool,
    pose: &ToolPose,
    u: &[f64; ACTION_MAX],
    next_adj: &PoseAdj,
) -> (PoseAdj, [f64; ACTION_MAX]) {
    let inc = increment(&tool.motion, pose, u);
    let mut shift_adj = Vector3::zeros();
    for a in 0..3 {
        let moved = pose.position[a] + inc.shift[a];
        if moved >= tool.lower_bound[a] && moved <= tool.upper_bound[a] {
            shift_adj[a] = next_adj.position[a];
        }
    }
    let turned = product(pose.rotation, inc.after);
    let whole = product(inc.before, turned);
    let whole_adj = normalize_adj(whole, next_adj.rotation);
    let (before_adj, turned_adj) = product_adj(inc.before, turned, whole_adj);
    let (mut q_adj, after_adj) = product_adj(pose.rotation, inc.after, turned_adj);
    let inc_adj = Increment { shift: shift_adj, before: before_adj, after: after_adj };
    let (mut u_adj, extra) = increment_adj(&tool.motion, pose, u, &inc_adj);
    q_adj.iter_mut().zip(extra).for_each(|(a, b)| *a += b);
    let mut gap_adj = next_adj.gap;
    if let Motion::Gripper { minimal_gap, maximal_gap } = tool.motion {
        let moved = pose.gap - u[6];
        if moved < minimal_gap || moved > maximal_gap {
            gap_adj = 0.0;
        }
        u_adj[6] = -gap_adj;
    }
    (PoseAdj { position: shift_adj.into(), rotation: q_adj, gap: gap_adj }, u_adj)
}

#[cfg(test)]
mod tests {
    use super::super::Shape;
    use super::*;
    use crate::math::check::{Tolerance, directional};
    use crate::math::rng::{normal, seeded};

    fn tool(motion: Motion) -> Tool {
        let action_scale = vec![1.0; motion.action_len()];
        Tool {
            name: "test".into(),
            shape: Shape::Sphere { radius: 0.1 },
            motion,
            friction: 0.5,
            action_scale,
            lower_bound: [-10.0; 3],
            upper_bound: [10.0; 3],
        }
    }

    fn split(x: &[f64]) -> (ToolPose, [f64; ACTION_MAX]) {
        let pose = ToolPose { position: [x[0], x[1], x[2]], rotation: [x[3], x[4], x[5], x[6]], gap: x[7] };
        (pose, std::array::from_fn(|i| x[8 + i]))
    }

    #[test]
    fn advance_adj_agrees_with_finite_differences() {
        let mut rng = seeded(1, "motion");
        let gripper = Motion::Gripper { minimal_gap: -50.0, maximal_gap: 50.0 };
        for motion in [Motion::RollingPin, Motion::Translation, Motion::Rigid, gripper] {
            let tool = tool(motion);
            for round in 0..20 {
                let mut x: Vec<f64> = (0..15).map(|_| normal(&mut rng)).collect();
                if round == 0 {
                    // No motion at all: the awkward point of the axis-angle map.
                    x[8..].fill(0.0);
                }
                directional(
                    &mut rng,
                    &x,
                    |x| {
                        let (pose, u) = split(x);
                        let next = advance(&tool, &pose, &u);
                        [&next.position[..], &next.rotation, &[next.gap]].concat()
                    },
                    |x, y| {
                        let (pose, u) = split(x);
                        let (adj, _) = split(&[y, &[0.0; 7]].concat());
                        let next_adj =
                            PoseAdj { position: adj.position, rotation: adj.rotation, gap: adj.gap };
                        let (pose_adj, u_adj) = advance_adj(&tool, &pose, &u, &next_adj);
                        [&pose_adj.position[..], &pose_adj.rotation, &[pose_adj.gap], &u_adj].concat()
                    },
                    Tolerance { relative: 1e-6, absolute: 1e-7 },
                );
            }
        }
    }

    #[test]
    fn clamps_stop_the_motion_and_its_gradient() {
        let mut tool = tool(Motion::Translation);
        tool.upper_bound = [0.5; 3];
        let pose = ToolPose { position: [0.4; 3], rotation: IDENTITY, gap: 0.0 };
        let u = [0.3, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(advance(&tool, &pose, &u).position, [0.5, 0.45, 0.4]);
        let next_adj = PoseAdj { position: [1.0; 3], ..PoseAdj::default() };
        let (pose_adj, u_adj) = advance_adj(&tool, &pose, &u, &next_adj);
        assert_eq!(pose_adj.position, [0.0, 1.0, 1.0]);
        assert_eq!(u_adj[..3], [0.0, 1.0, 1.0]);
        let mut action_adj = [0.0; 3];
        substep_share_adj(&tool, &[2.0, 0.5, -1.0], 20, &[1.0; ACTION_MAX], &mut action_adj);
        assert_eq!(action_adj, [0.0, 0.05, 0.05]);
    }
}
