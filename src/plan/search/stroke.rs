//! A stroke: the tool is put somewhere, moves along a smooth path, and is withdrawn.
//!
//! What a search varies about a stroke, and the start pose and actions that come of it. Imports sim's tools.

use crate::math::quaternion::{from_axis_angle, product};
use crate::math::rng::{Pcg64, normal, uniform};
use crate::sim::{Motion, Tool, ToolPose};
use nalgebra::Vector3;

/// Actions of this size are the smallest that a search draws or varies.
const LEAST_VIGOUR: f64 = 0.1;

/// Place and path of a tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Where the tool is put, m.
    pub x: f64,
    pub z: f64,
    /// Turn about the vertical against the tool's orientation at rest, rad.
    pub yaw: f64,
    /// Distance of a gripper's plates, m.
    pub gap: f64,
    /// Control steps.
    pub steps: usize,
    /// Actions at evenly spread times, in [-1, 1]: knots x components of the tool's action.
    pub knots: Vec<Vec<f64>>,
}

/// How far a search goes from a stroke to the next: standard deviations.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    /// Of x and z, m.
    pub place: f64,
    /// rad
    pub yaw: f64,
    /// m
    pub gap: f64,
    /// Of a knot's component.
    pub knot: f64,
    /// Probability of another length.
    pub length: f64,
}

impl Stroke {
    /// Where the tool is before it is lowered onto the dough.
    pub fn pose_above(&self, rest: &ToolPose) -> ToolPose {
        let turn = from_axis_angle(Vector3::new(0.0, self.yaw, 0.0));
        ToolPose {
            position: [self.x, rest.position[1], self.z],
            rotation: product(turn, rest.rotation),
            gap: self.gap,
        }
    }

    /// The action of every control step: straight lines between the knots.
    pub fn actions(&self) -> Vec<Vec<f64>> {
        let last = (self.knots.len() - 1) as f64;
        (0..self.steps)
            .map(|step| {
                let t = last * (step as f64 + 0.5) / self.steps as f64;
                let k = (t as usize).min(self.knots.len() - 2);
                let s = t - k as f64;
                self.knots[k].iter().zip(&self.knots[k + 1]).map(|(a, b)| a + s * (b - a)).collect()
            })
            .collect()
    }

    /// Adjoint of [`Stroke::actions`]: the knots' share of a gradient by the actions.
    pub fn actions_adj(&self, actions_adj: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut knots_adj = vec![vec![0.0; self.knots[0].len()]; self.knots.len()];
        let last = (self.knots.len() - 1) as f64;
        for (step, row) in actions_adj.iter().enumerate() {
            let t = last * (step as f64 + 0.5) / self.steps as f64;
            let k = (t as usize).min(self.knots.len() - 2);
            let s = t - k as f64;
            for (c, g) in row.iter().enumerate() {
                knots_adj[k][c] += (1.0 - s) * g;
                knots_adj[k + 1][c] += s * g;
            }
        }
        knots_adj
    }

    /// A stroke near this one.
    pub fn varied(&self, tool: &Tool, spread: &Spread, lengths: &[usize], rng: &mut Pcg64) -> Self {
        let mut next = self.clone();
        next.x += spread.place * normal(rng);
        next.z += spread.place * normal(rng);
        next.yaw += spread.yaw * normal(rng);
        next.gap = clamp_gap(tool, next.gap + spread.gap * normal(rng));
        // A shift of the whole path and of every knot, in proportion to how far the tool moves.
        let noise = spread.knot * self.vigour(tool).max(LEAST_VIGOUR);
        for c in free_components(tool) {
            let shift = noise * normal(rng);
            for knot in &mut next.knots {
                knot[c] = (knot[c] + 0.6 * shift + 0.8 * noise * normal(rng)).clamp(-1.0, 1.0);
            }
        }
        if uniform(rng) < spread.length {
            next.steps = pick(lengths, rng);
        }
        next
    }

    /// Root mean square of the actions at the knots.
    fn vigour(&self, tool: &Tool) -> f64 {
        let squares: Vec<f64> =
            free_components(tool).flat_map(|c| self.knots.iter().map(move |knot| knot[c] * knot[c])).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }

    /// Draws new knots around `lean`, a direction in the space of actions.
    pub fn with_random_knots(mut self, tool: &Tool, lean: &[f64], count: usize, rng: &mut Pcg64) -> Self {
        // From a nudge to full speed: what is left to do may be small.
        let vigour = LEAST_VIGOUR.powf(uniform(rng));
        self.knots = vec![vec![0.0; tool.action_len()]; count];
        for c in free_components(tool) {
            let mean = lean[c] + 0.5 * normal(rng);
            for knot in &mut self.knots {
                knot[c] = (vigour * (mean + 0.5 * normal(rng))).clamp(-1.0, 1.0);
            }
        }
        self
    }
}

/// The action components that do anything.
pub fn free_components(tool: &Tool) -> impl Iterator<Item = usize> + use<'_> {
    (0..tool.action_len()).filter(|&c| tool.action_scale[c] != 0.0)
}

/// One of `options`.
pub fn pick(options: &[usize], rng: &mut Pcg64) -> usize {
    options[((uniform(rng) * options.len() as f64) as usize).min(options.len() - 1)]
}

fn clamp_gap(tool: &Tool, gap: f64) -> f64 {
    match tool.motion {
        Motion::Gripper { minimal_gap, maximal_gap } => gap.clamp(minimal_gap, maximal_gap),
        _ => gap,
    }
}
