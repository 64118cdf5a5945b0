//! Stirring: once a tool is down in the dough, it swings to and fro in one direction after the other.
//!
//! A stroke comes in; what its swings add to the actions, or a stroke that only stirs, goes out. Imports strokes.

use super::stroke::Stroke;
use crate::math::rng::{Pcg64, uniform};
use crate::sim::Tool;

/// Directions of the swings, one after the other: cosine and sine.
const SWINGS: [[f64; 2]; 4] = [
    [1.0, 0.0],
    [0.0, 1.0],
    [std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2],
    [-std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2],
];
/// The control steps of a swing: out, back, to the other side and back.
const SWING: [f64; 4] = [1.0, -1.0, -1.0, 1.0];
/// The share of a stroke before its swings. What can be reached in it is the depth of a hole, and what is left for eight
/// swings clears it: with half of the stroke for each, some dough remained under the tool's edge.
const BEFORE_SWINGS: f64 = 0.2;

impl Stroke {
    /// What stirring adds to the action components of a control step.
    pub fn swing(&self, tool: &Tool, step: usize) -> impl Iterator<Item = (usize, f64)> {
        let first = (BEFORE_SWINGS * self.steps as f64) as usize;
        let since = step.checked_sub(first).filter(|_| self.stir > 0.0);
        let swing = tool.motion.sideways().zip(since).map(|(components, since)| {
            let direction = SWINGS[since / SWING.len() % SWINGS.len()];
            let way = self.stir * SWING[since % SWING.len()];
            components.into_iter().zip(direction.map(|d| way * d))
        });
        swing
            .into_iter()
            .flatten()
            .filter(|&(c, _)| tool.action_scale[c] != 0.0)
            .collect::<Vec<_>>()
            .into_iter()
    }

    /// A share of the strokes from inside the dough only stir there, for `steps` control steps: drawn after
    /// [`Stroke::with_random_knots`].
    pub fn perhaps_stirring(
        mut self,
        tool: &Tool,
        dive: f64,
        share: f64,
        steps: usize,
        rng: &mut Pcg64,
    ) -> Self {
        let c = tool.motion.rise();
        let can_stir = tool.action_scale[c] > 0.0 && uniform(rng) < share;
        let Some(sideways) = tool.motion.sideways().filter(|_| can_stir) else { return self };
        self.steps = steps;
        self.stir = 0.2 + 0.8 * uniform(rng);
        // As many knots go down as the depth needs at full speed, the last of them fading out until the next one.
        let between = tool.action_scale[c] * steps as f64 / (self.knots.len() - 1) as f64;
        let diving = ((dive / between + 0.5).ceil() as usize).clamp(1, self.knots.len() / 2);
        let down = (dive / (between * (diving as f64 - 0.5))).min(1.0);
        for (k, knot) in self.knots.iter_mut().enumerate() {
            sideways.iter().for_each(|&c| knot[c] *= 0.05);
            knot[c] = if k < diving { -down } else { 0.0 };
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::super::stroke::tests::{pole, stroke};
    use super::*;
    use crate::math::rng::seeded;

    #[test]
    fn stirring_swings_to_both_sides_and_ends_where_it_began() {
        let tool = Tool { action_scale: vec![0.01; 3], ..pole() };
        let still = Stroke { knots: vec![vec![0.0; 3]; 4], ..stroke(40, &mut seeded(4, "stroke")) };
        let stirring = Stroke { stir: 0.7, ..still };
        let actions = stirring.actions(&tool);
        assert!(actions[..8].iter().flatten().all(|a| *a == 0.0), "first the tool goes in");
        let mut at = [0.0; 2];
        let (mut low, mut high) = ([0.0f64; 2], [0.0f64; 2]);
        for action in &actions[8..] {
            for (k, c) in [0, 2].into_iter().enumerate() {
                at[k] += action[c];
                (low[k], high[k]) = (low[k].min(at[k]), high[k].max(at[k]));
            }
            assert_eq!(action[1], 0.0);
        }
        assert!(at.iter().all(|x| x.abs() < 1e-12), "{at:?}");
        assert!(low.iter().all(|x| (x + 0.7).abs() < 1e-12), "{low:?}");
        assert!(high.iter().all(|x| (x - 0.7).abs() < 1e-12), "{high:?}");
    }

    #[test]
    fn a_stirring_stroke_goes_down_to_its_depth_or_as_far_as_half_of_it_lets() {
        let tool = Tool { action_scale: vec![0.01; 3], ..pole() };
        let mut rng = seeded(8, "stroke");
        for (dive, reached) in [(0.03, 0.03), (0.06, 0.06), (0.12, 0.12), (0.5, 0.2)] {
            let stirring = stroke(40, &mut rng).perhaps_stirring(&tool, dive, 1.0, 40, &mut rng);
            assert!(stirring.stir >= 0.2);
            let down: f64 = stirring.actions(&tool).iter().map(|a| -0.01 * a[1]).sum();
            assert!((down - reached).abs() < 0.01, "{dive}: {down}");
        }
        assert_eq!(stroke(40, &mut rng).perhaps_stirring(&tool, 0.1, 0.0, 40, &mut rng).stir, 0.0);
        // A tool that cannot go down does not stir.
        let level = Tool { action_scale: vec![0.01, 0.0, 0.01], ..pole() };
        assert_eq!(stroke(40, &mut rng).perhaps_stirring(&level, 0.1, 1.0, 40, &mut rng).stir, 0.0);
    }
}
