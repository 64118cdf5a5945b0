//! A stroke: the tool is put somewhere, moves along a smooth path, and is withdrawn.
//!
//! What a search varies about a stroke, and the start pose and actions that come of it. Imports sim's tools.

use crate::math::quaternion::{from_axis_angle, from_axis_angle_adj, product, product_adj};
use crate::math::rng::{Pcg64, normal, uniform};
use crate::sim::tool::PoseAdj;
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
    /// Stirring: how far the tool swings to and fro once it has gone down, as a share of its largest step.
    ///
    /// Contact acts on velocities only, so that dough which a tool has gone into stays in it: a pole leaves a quarter
    /// of the dough in its hole, however fast it dives. Swings of a centimetre in two directions and the two between
    /// carry all of it to the wall.
    pub stir: f64,
}

/// What a variable of 1 is for a gradient descent: m of place and gap, rad of yaw.
const PLACE_UNIT: f64 = 0.03;
const YAW_UNIT: f64 = 0.6;

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

    /// Adjoint of [`Stroke::pose_above`] by x, z, yaw and gap.
    pub fn pose_above_adj(&self, rest: &ToolPose, pose_adj: &PoseAdj) -> [f64; 4] {
        let axis = Vector3::new(0.0, self.yaw, 0.0);
        let (turn_adj, _) = product_adj(from_axis_angle(axis), rest.rotation, pose_adj.rotation);
        let [x_adj, _, z_adj] = pose_adj.position;
        [x_adj, z_adj, from_axis_angle_adj(axis, turn_adj).y, pose_adj.gap]
    }

    /// What a gradient descent varies: the knots, and in a last row x, z, yaw and gap in units in which a step of one
    /// weighs as much as a step of the others.
    pub fn variables(&self) -> Vec<Vec<f64>> {
        let mut rows = self.knots.clone();
        // Relative to where the stroke is: variables stay within [-1, 1].
        rows.push(vec![0.0; 4]);
        rows
    }

    /// This stroke with other [`Stroke::variables`].
    pub fn with_variables(&self, tool: &Tool, rows: &[Vec<f64>]) -> Self {
        let [knots @ .., place] = rows else { return self.clone() };
        Self {
            x: self.x + PLACE_UNIT * place[0],
            z: self.z + PLACE_UNIT * place[1],
            yaw: self.yaw + YAW_UNIT * place[2],
            gap: clamp_gap(tool, self.gap + PLACE_UNIT * place[3]),
            knots: knots.to_vec(),
            ..self.clone()
        }
    }

    /// Adjoint of [`Stroke::with_variables`], [`Stroke::pose_above`] and [`Stroke::actions`] taken together, at this
    /// stroke.
    pub fn variables_adj(
        &self,
        tool: &Tool,
        rest: &ToolPose,
        pose_adj: &PoseAdj,
        actions_adj: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        let mut rows = self.actions_adj(tool, actions_adj);
        let [x, z, yaw, gap] = self.pose_above_adj(rest, pose_adj);
        // As in `clamp_gap`.
        let gap = if matches!(tool.motion, Motion::Gripper { .. }) { gap } else { 0.0 };
        rows.push(vec![PLACE_UNIT * x, PLACE_UNIT * z, YAW_UNIT * yaw, PLACE_UNIT * gap]);
        rows
    }

    /// The action of every control step: straight lines between the knots, and what stirring adds.
    pub fn actions(&self, tool: &Tool) -> Vec<Vec<f64>> {
        (0..self.steps)
            .map(|step| {
                let (k, s) = self.between_knots(step);
                let mut action: Vec<f64> =
                    self.knots[k].iter().zip(&self.knots[k + 1]).map(|(a, b)| a + s * (b - a)).collect();
                for (c, swing) in self.swing(tool, step) {
                    action[c] = (action[c] + swing).clamp(-1.0, 1.0);
                }
                action
            })
            .collect()
    }

    /// Adjoint of [`Stroke::actions`]: the knots' share of a gradient by the actions.
    pub fn actions_adj(&self, tool: &Tool, actions_adj: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut knots_adj = vec![vec![0.0; self.knots[0].len()]; self.knots.len()];
        for (step, row) in actions_adj.iter().enumerate() {
            let (k, s) = self.between_knots(step);
            let mut row = row.clone();
            for (c, swing) in self.swing(tool, step) {
                let action = self.knots[k][c] + s * (self.knots[k + 1][c] - self.knots[k][c]) + swing;
                if action.abs() > 1.0 {
                    row[c] = 0.0;
                }
            }
            for (c, g) in row.iter().enumerate() {
                knots_adj[k][c] += (1.0 - s) * g;
                knots_adj[k + 1][c] += s * g;
            }
        }
        knots_adj
    }

    /// The knot before the middle of a control step, and which share of the way to the next one has been gone.
    fn between_knots(&self, step: usize) -> (usize, f64) {
        let last = self.knots.len() - 1;
        let t = last as f64 * (step as f64 + 0.5) / self.steps as f64;
        let k = (t as usize).min(last - 1);
        (k, t - k as f64)
    }

    /// This stroke, begun so far to each side, m.
    pub fn nudged(&self, way: f64) -> [Self; 4] {
        [[way, 0.0], [-way, 0.0], [0.0, way], [0.0, -way]].map(|[x, z]| Self {
            x: self.x + x,
            z: self.z + z,
            ..self.clone()
        })
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
        if next.stir > 0.0 {
            next.stir = (next.stir + spread.knot * 0.5 * normal(rng)).clamp(0.0, 1.0);
        }
        next
    }

    /// Root mean square of the actions at the knots.
    fn vigour(&self, tool: &Tool) -> f64 {
        let squares: Vec<f64> = free_components(tool)
            .flat_map(|c| self.knots.iter().map(move |knot| knot[c] * knot[c]))
            .collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }

    /// Draws `count` knots: the tool first goes down by `dive`, in half of the time if it can, and then around
    /// `lean`, a direction in the space of actions.
    pub fn with_random_knots(
        mut self,
        tool: &Tool,
        dive: f64,
        lean: &[f64],
        count: usize,
        rng: &mut Pcg64,
    ) -> Self {
        // From a nudge to full speed: what is left to do may be small.
        let vigour = LEAST_VIGOUR.powf(uniform(rng));
        self.knots = vec![vec![0.0; tool.action_len()]; count];
        for c in free_components(tool) {
            let mean = lean[c] + 0.5 * normal(rng);
            for knot in &mut self.knots {
                knot[c] = (vigour * (mean + 0.5 * normal(rng))).clamp(-1.0, 1.0);
            }
        }
        let c = tool.motion.rise();
        if dive > 0.0 && tool.action_scale[c] > 0.0 {
            let down = dive / (tool.action_scale[c] * 0.5 * self.steps as f64) * (0.7 + 0.6 * uniform(rng));
            for (k, knot) in self.knots.iter_mut().enumerate() {
                if 2 * k < count {
                    // Straight down: where a knife enters is where it cuts.
                    knot.iter_mut().for_each(|a| *a *= 0.05);
                    knot[c] -= down;
                } else {
                    knot[c] *= 0.3;
                }
                knot[c] = knot[c].clamp(-1.0, 1.0);
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
        // Other tools have none.
        _ => 0.0,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::math::check::{Tolerance, directional};
    use crate::math::rng::seeded;
    use crate::sim::Shape;

    pub fn pole() -> Tool {
        Tool {
            name: "pole".into(),
            shape: Shape::Capsule { radius: 0.03, length: 0.2 },
            motion: Motion::Translation,
            friction: 0.9,
            action_scale: vec![0.01, 0.01, 0.0],
            lower_bound: [0.0; 3],
            upper_bound: [1.0; 3],
        }
    }

    pub fn stroke(steps: usize, rng: &mut Pcg64) -> Stroke {
        let begin = Stroke { x: 0.5, z: 0.4, yaw: 0.3, gap: 0.0, steps, knots: Vec::new(), stir: 0.0 };
        begin.with_random_knots(&pole(), 0.0, &[1.0, -0.5, 0.0], 4, rng)
    }

    #[test]
    fn actions_pass_through_the_knots_and_their_adjoint_agrees_with_finite_differences() {
        let mut rng = seeded(1, "stroke");
        for (steps, stir) in [(1, 0.0), (2, 0.4), (7, 0.0), (40, 0.5), (40, 1.0)] {
            let stroke = Stroke { stir, ..stroke(steps, &mut rng) };
            let actions = stroke.actions(&pole());
            assert_eq!(actions.len(), steps);
            let (low, high) =
                (stroke.knots[0][0].min(stroke.knots[1][0]), stroke.knots[0][0].max(stroke.knots[1][0]));
            assert!(steps < 7 || (low..=high).contains(&actions[0][0]));
            let flat: Vec<f64> = stroke.knots.concat();
            let forward = |x: &[f64]| {
                let knots = x.chunks(3).map(<[f64]>::to_vec).collect();
                Stroke { knots, ..stroke.clone() }.actions(&pole()).concat()
            };
            let adjoint = |_: &[f64], y: &[f64]| {
                let rows: Vec<Vec<f64>> = y.chunks(3).map(<[f64]>::to_vec).collect();
                stroke.actions_adj(&pole(), &rows).concat()
            };
            let tolerance = Tolerance { relative: 1e-7, absolute: 1e-9 };
            directional(&mut rng, &flat, forward, adjoint, tolerance);
        }
    }

    #[test]
    fn the_start_pose_s_adjoint_agrees_with_finite_differences() {
        let mut rng = seeded(6, "stroke");
        let rest = ToolPose { position: [0.5, 0.3, 0.5], rotation: [0.707, 0.707, 0.0, 0.0], gap: 0.1 };
        let flat = |p: &ToolPose| [&p.position[..], &p.rotation, &[p.gap]].concat();
        for yaw in [0.0, 0.3, -2.0] {
            let stroke = Stroke { yaw, ..stroke(10, &mut rng) };
            let forward = |x: &[f64]| {
                let moved = Stroke { x: x[0], z: x[1], yaw: x[2], gap: x[3], ..stroke.clone() };
                flat(&moved.pose_above(&rest))
            };
            let adjoint = |x: &[f64], y: &[f64]| {
                let at = Stroke { x: x[0], z: x[1], yaw: x[2], gap: x[3], ..stroke.clone() };
                let adj =
                    PoseAdj { position: [y[0], y[1], y[2]], rotation: [y[3], y[4], y[5], y[6]], gap: y[7] };
                at.pose_above_adj(&rest, &adj).to_vec()
            };
            let tolerance = Tolerance { relative: 1e-7, absolute: 1e-9 };
            directional(&mut rng, &[0.5, 0.4, yaw, 0.12], forward, adjoint, tolerance);
        }
    }

    #[test]
    fn the_variables_adjoint_agrees_with_finite_differences() {
        let mut rng = seeded(7, "stroke");
        let rest = ToolPose { position: [0.5, 0.3, 0.5], rotation: [0.707, 0.707, 0.0, 0.0], gap: 0.1 };
        let gripper = Tool {
            motion: Motion::Gripper { minimal_gap: 0.08, maximal_gap: 0.3 },
            action_scale: vec![0.01; 7],
            ..pole()
        };
        // Only one of them has a gap to vary.
        for tool in [pole(), gripper] {
            let n = tool.action_len();
            let begin = Stroke { gap: 0.2, stir: 0.4, ..stroke(20, &mut rng) };
            let stroke = begin.with_random_knots(&tool, 0.0, &vec![0.5; n], 4, &mut rng);
            let rows = |x: &[f64]| -> Vec<Vec<f64>> {
                let (knots, place) = x.split_at(x.len() - 4);
                knots.chunks(n).chain([place]).map(<[f64]>::to_vec).collect()
            };
            let forward = |x: &[f64]| {
                let moved = stroke.with_variables(&tool, &rows(x));
                let pose = moved.pose_above(&rest);
                let actions = moved.actions(&tool).concat();
                [&pose.position[..], &pose.rotation, &[pose.gap], &actions].concat()
            };
            let adjoint = |x: &[f64], y: &[f64]| {
                let pose_adj =
                    PoseAdj { position: [y[0], y[1], y[2]], rotation: [y[3], y[4], y[5], y[6]], gap: y[7] };
                let actions_adj: Vec<Vec<f64>> = y[8..].chunks(n).map(<[f64]>::to_vec).collect();
                let moved = stroke.with_variables(&tool, &rows(x));
                moved.variables_adj(&tool, &rest, &pose_adj, &actions_adj).concat()
            };
            let tolerance = Tolerance { relative: 1e-7, absolute: 1e-9 };
            directional(&mut rng, &stroke.variables().concat(), forward, adjoint, tolerance);
        }
    }

    #[test]
    fn a_component_that_does_nothing_stays_zero_and_all_stay_within_bounds() {
        let mut rng = seeded(2, "stroke");
        let spread = Spread { place: 0.01, yaw: 0.2, gap: 0.01, knot: 0.8, length: 0.5 };
        let mut now = stroke(20, &mut rng);
        for _ in 0..50 {
            now = now.varied(&pole(), &spread, &[10, 40], &mut rng);
            assert!(now.knots.iter().all(|k| k[2] == 0.0 && k.iter().all(|a| a.abs() <= 1.0)));
            assert!([10, 20, 40].contains(&now.steps));
        }
    }

    #[test]
    fn a_dive_takes_the_tool_down_by_about_its_depth_in_the_first_half() {
        let mut rng = seeded(3, "stroke");
        let begin = Stroke { x: 0.5, z: 0.5, yaw: 0.0, gap: 0.0, steps: 40, knots: Vec::new(), stir: 0.0 };
        for _ in 0..20 {
            let dived = begin.clone().with_random_knots(&pole(), 0.1, &[1.0, 0.0, 0.0], 4, &mut rng);
            let down: f64 = dived.actions(&pole())[..20].iter().map(|a| 0.01 * a[1]).sum();
            assert!((-0.2..-0.03).contains(&down), "{down}");
        }
    }
}
