//! What a rollout begins with, checked once.
//!
//! A start state, the tools' poses and actions come in; nothing goes out, or a [`SimError`] that names what does not fit. The
//! operations below check nothing again. Imports particles, tools and parameters.

use super::error::{Operation, SimError};
use super::params::Params;
use super::particles::ParticleState;
use super::tool::{Tool, ToolPose};

/// Whether a rollout can start: the arrays fit together, and every particle is in the box and finite.
pub fn check(
    params: &Params,
    tools: &[Tool],
    start: &ParticleState,
    poses: &[ToolPose],
    actions: &[Vec<f64>],
) -> Result<(), SimError> {
    let shape = |text: String| Err(SimError::Shape(text));
    let n = start.len();
    if n == 0 || start.v.len() != n || start.c.len() != n || start.f.len() != n {
        return shape(format!("a state needs x, v, C and F of the same particles, at least one; x has {n}"));
    }
    if poses.len() != tools.len() {
        return shape(format!("{} tools need as many poses, not {}", tools.len(), poses.len()));
    }
    let width: usize = tools.iter().map(Tool::action_len).sum();
    if let Some((step, row)) = actions.iter().enumerate().find(|(_, row)| row.len() != width) {
        return shape(format!("action {step} has {} components, the tools take {width}", row.len()));
    }
    let top = params.position_bounds().1;
    for i in 0..n {
        if start.fields(i).iter().any(|v| !v.is_finite()) {
            return Err(SimError::NonFinite {
                operation: Operation::Start,
                step: 0,
                substep: 0,
                particle: i,
            });
        }
        if start.x[i].iter().any(|v| *v < 0.0 || *v > top) {
            return shape(format!("particle {i} starts outside the box [0, {top}] at {:?}", start.x[i]));
        }
    }
    Ok(())
}
