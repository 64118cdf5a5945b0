//! Whether the gradient of a rollout is right: the adjoint against finite differences of the forward pass.
//!
//! A [`Case`] (a world, a start, actions, where the particles should end) comes in; [`Entry`]s, one for each
//! tried component of an action, and their [`Summary`] go out. The loss is linear, the slope of the L1
//! distance to the target at the unperturbed end: so only the simulator is judged, not the loss's kinks.
//! Imports rollout and math.
//!
//! ```text
//! L(a)       = sum_p g_p . x_p(a),                  g_p = sign(x_p(a_0) - target_p), held fixed
//! D_h        = (L(a + h) - L(a - h)) / 2h           h = 1e-6 and 3e-7
//! converged    |D_1e-6 - D_3e-7| <= 1e-4 scale      else a jump lies within h, and there is nothing to compare with
//! error        |adjoint - D_1e-6| / scale,          scale = max(|D_1e-6|, 1e-6 of the largest gradient entry)
//! ```
//!
//! The truncation error of D_h is of order h^2, its rounding of order 1e-16 / h times what the dough amplifies: at 1e-6
//! both are near 1e-9 where contact does not switch.

use rayon::prelude::*;

use super::error::SimError;
use super::lanes::Real;
use super::params::Params;
use super::particles::ParticleState;
use super::rollout::{Options, Simulator, StepSeed};
use super::tool::{Tool, ToolPose};
use crate::math::cloud::Point;
use crate::math::rng::{sample_indices, seeded, uniform};

/// Step sizes of the two central differences. Contact switches on by a jump (influence 0.1): a node that
/// crosses it within the larger step makes the two disagree.
pub const STEPS: [f64; 2] = [1e-6, 3e-7];
/// A finite difference has converged when its two values agree to this share.
pub const CONVERGED: f64 = 1e-4;
/// Entries this much smaller than the gradient's largest are compared with that much: their relative error
/// would be that of rounding.
const FLOOR: f64 = 1e-6;
/// Control steps over which single precision is compared with double: a horizon of the planner.
pub const HORIZON: usize = 40;
/// Share by which start coordinates are moved to see what rounding them to f32 would do: 2^-24, the most that
/// rounding to the nearest f32 can move a number.
pub const ROUNDING: f64 = 1.0 / (1 << 24) as f64;
/// What a correct adjoint keeps: the bounds of median and 95th percentile.
pub const BOUNDS: [f64; 2] = [1e-6, 1e-3];

/// A rollout whose gradient is to be checked.
#[derive(Clone, Debug)]
pub struct Case {
    pub params: Params,
    pub tools: Vec<Tool>,
    /// Start poses, one a tool.
    pub poses: Vec<ToolPose>,
    pub start: ParticleState,
    /// Control steps x components of all tools.
    pub actions: Vec<Vec<f64>>,
    /// Where the loss wants the particles.
    pub target: Vec<Point>,
}

/// One tried component of one action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    pub step: usize,
    /// Counted within the tool's own action.
    pub component: usize,
    pub adjoint: f64,
    /// The central differences of [`STEPS`].
    pub difference: [f64; 2],
    /// What errors are relative to.
    pub scale: f64,
}

impl Entry {
    /// Whether the entry changes nothing at all, and the adjoint knows.
    pub fn is_idle(&self) -> bool {
        self.adjoint == 0.0 && self.difference == [0.0; 2]
    }

    /// Whether the finite difference is worth comparing with.
    pub fn has_converged(&self) -> bool {
        (self.difference[0] - self.difference[1]).abs() <= CONVERGED * self.scale
    }

    /// Error of the adjoint; of the two finite differences the one with less rounding counts.
    pub fn error(&self) -> f64 {
        (self.adjoint - self.difference[0]).abs() / self.scale
    }
}

/// What the entries of one tool say together.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Entries tried.
    pub entries: usize,
    /// Those that change nothing, such as a tool's motion after it has left the dough; they count for
    /// nothing below.
    pub idle: usize,
    /// Those whose finite difference has not converged, as (step, component), in this order.
    pub unconverged: Vec<(usize, usize)>,
    /// Median and 95th percentile of the others' errors; none if there are no others.
    pub median: Option<f64>,
    pub percentile_95: Option<f64>,
}

impl Summary {
    /// Sums up entries.
    pub fn of(entries: &[Entry]) -> Self {
        let moving = || entries.iter().filter(|e| !e.is_idle());
        let mut errors: Vec<f64> = moving().filter(|e| e.has_converged()).map(Entry::error).collect();
        errors.sort_by(f64::total_cmp);
        // The smallest error that the given share of all errors does not exceed.
        let rank = |share: f64| (share * errors.len() as f64).ceil() as usize;
        let quantile = |share: f64| errors.get(rank(share).saturating_sub(1)).copied();
        let mut unconverged: Vec<(usize, usize)> =
            moving().filter(|e| !e.has_converged()).map(|e| (e.step, e.component)).collect();
        unconverged.sort_unstable();
        Self {
            entries: entries.len(),
            idle: entries.len() - moving().count(),
            unconverged,
            median: quantile(0.5),
            percentile_95: quantile(0.95),
        }
    }

    /// Whether the adjoint keeps [`BOUNDS`]. Entries that cannot be judged do not pass for right ones: at
    /// least one must have been judged.
    pub fn passes(&self) -> bool {
        let [median, percentile_95] = BOUNDS;
        self.median.is_some_and(|e| e < median) && self.percentile_95.is_some_and(|e| e < percentile_95)
    }
}

impl Case {
    /// The same case over `steps` control steps; its actions repeat if there are fewer.
    pub fn over(&self, steps: usize) -> Self {
        let actions = self.actions.iter().cycle().take(steps).cloned().collect();
        Self { actions, ..self.clone() }
    }

    /// Where the components of tool number `tool` stand in an action.
    fn columns(&self, tool: usize) -> std::ops::Range<usize> {
        let before = |count: usize| self.tools[..count].iter().map(Tool::action_len).sum::<usize>();
        before(tool)..before(tool + 1)
    }

    fn simulator<T: Real>(&self, memory_limit: usize) -> Simulator<T> {
        let options = Options { memory_limit, ..Options::default() };
        Simulator::new(self.params.clone(), self.tools.clone(), options)
    }

    /// End positions under other actions.
    fn end<T: Real>(&self, sim: &mut Simulator<T>, actions: &[Vec<f64>]) -> Result<Vec<Point>, SimError> {
        sim.rollout(&self.start, &self.poses, actions)?;
        Ok(sim.positions(actions.len()))
    }

    /// Derivative of the L1 distance to the target by the end positions.
    fn slope(&self) -> Result<Vec<Point>, SimError> {
        let end = self.end(&mut self.simulator::<f64>(0), &self.actions)?;
        let toward = |x: &Point, t: &Point| {
            std::array::from_fn(|a| if x[a] == t[a] { 0.0 } else { (x[a] - t[a]).signum() })
        };
        Ok(end.iter().zip(&self.target).map(|(x, t)| toward(x, t)).collect())
    }

    /// Gradient of the loss by the actions, in the precision of `T`.
    ///
    /// # Errors
    /// The simulator's.
    pub fn gradient<T: Real>(&self) -> Result<Vec<Vec<f64>>, SimError> {
        self.gradient_of::<T>(&self.slope()?)
    }

    /// Gradient of the loss whose derivative by the end positions is `slope`.
    fn gradient_of<T: Real>(&self, slope: &[Point]) -> Result<Vec<Vec<f64>>, SimError> {
        let mut sim = self.simulator::<T>(Options::default().memory_limit);
        self.end(&mut sim, &self.actions)?;
        let mut seeds = vec![StepSeed::default(); self.actions.len() + 1];
        seeds[self.actions.len()].positions = slope.to_vec();
        Ok(sim.rollout_adj(&seeds)?.actions)
    }

    /// Tries `count` random entries of one tool's actions, or all if there are fewer, on all cores.
    /// Components that do not move the tool (scale 0) are left out.
    ///
    /// # Errors
    /// The simulator's.
    pub fn entries(&self, tool: usize, count: usize, seed: u64) -> Result<Vec<Entry>, SimError> {
        let slope = self.slope()?;
        let gradient = self.gradient::<f64>()?;
        let columns = self.columns(tool);
        let largest = gradient
            .iter()
            .flat_map(|row| &row[columns.clone()])
            .fold(f64::MIN_POSITIVE, |most, g| g.abs().max(most));
        let moves = |c: &usize| self.tools[tool].action_scale[*c] != 0.0;
        let components: Vec<usize> = (0..columns.len()).filter(moves).collect();
        let all = self.actions.len() * components.len();
        let drawn = sample_indices(&mut seeded(seed, "gradient check"), all, count);
        let try_one = |sim: &mut Simulator<f64>, index: usize| {
            let (step, component) = (index / components.len(), components[index % components.len()]);
            let column = columns.start + component;
            let mut difference = [0.0; 2];
            for (difference, h) in difference.iter_mut().zip(STEPS) {
                *difference = self.central_difference(sim, &slope, (step, column), h)?;
            }
            let scale = difference[0].abs().max(FLOOR * largest);
            Ok(Entry { step, component, adjoint: gradient[step][column], difference, scale })
        };
        drawn.into_par_iter().map_init(|| self.simulator::<f64>(0), try_one).collect()
    }

    /// `(loss(a + h) - loss(a - h)) / 2h`, subtracted particle by particle: the sums themselves would lose
    /// the digits in question.
    fn central_difference(
        &self,
        sim: &mut Simulator<f64>,
        slope: &[Point],
        (step, column): (usize, usize),
        h: f64,
    ) -> Result<f64, SimError> {
        let mut actions = self.actions.clone();
        actions[step][column] = self.actions[step][column] + h;
        let up = self.end(sim, &actions)?;
        actions[step][column] = self.actions[step][column] - h;
        let down = self.end(sim, &actions)?;
        let change = |a: &[Point], b: &[Point]| -> f64 {
            let pairs = a.as_flattened().iter().zip(b.as_flattened());
            pairs.zip(slope.as_flattened()).map(|((a, b), s)| s * (a - b)).sum()
        };
        Ok(change(&up, &down) / (2.0 * h))
    }

    /// How far one tool's gradient in single precision is from that in double, as a share of its norm.
    ///
    /// # Errors
    /// The simulator's.
    pub fn single_precision_error(&self, tool: usize) -> Result<f64, SimError> {
        let (single, double) = (self.gradient::<f32>()?, self.gradient::<f64>()?);
        Ok(relative_distance(&self.of_tool(tool, &single), &self.of_tool(tool, &double)))
    }

    /// How far one tool's gradient in double precision moves, as a share of its norm, when every start coordinate is
    /// moved by a random share up to [`ROUNDING`]: what no arithmetic that rounds its input to f32 can do better than.
    ///
    /// # Errors
    /// The simulator's.
    pub fn sensitivity(&self, tool: usize, seed: u64) -> Result<f64, SimError> {
        let mut rng = seeded(seed, "sensitivity");
        let mut moved = self.clone();
        for x in moved.start.x.as_flattened_mut() {
            *x *= 1.0 + ROUNDING * (2.0 * uniform(&mut rng) - 1.0);
        }
        let slope = self.slope()?;
        let (moved, own) = (moved.gradient_of::<f64>(&slope)?, self.gradient_of::<f64>(&slope)?);
        Ok(relative_distance(&self.of_tool(tool, &moved), &self.of_tool(tool, &own)))
    }

    /// The components of one tool, row by row.
    fn of_tool(&self, tool: usize, rows: &[Vec<f64>]) -> Vec<f64> {
        rows.iter().flat_map(|row| row[self.columns(tool)].to_vec()).collect()
    }
}

/// `|a - b| / |b|`, 0 if both are the same.
fn relative_distance(a: &[f64], b: &[f64]) -> f64 {
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
    let off = norm(&mut a.iter().zip(b).map(|(a, b)| a - b));
    if off == 0.0 { 0.0 } else { off / norm(&mut b.iter().copied()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(adjoint: f64, coarse: f64, fine: f64) -> Entry {
        Entry { step: 1, component: 2, adjoint, difference: [coarse, fine], scale: coarse.abs().max(1e-6) }
    }

    #[test]
    fn a_summary_tells_idle_unconverged_right_and_wrong_apart() {
        let right = entry(1.0, 1.0, 1.0);
        let jump = entry(1.0, 5.0, 14.0);
        let idle = entry(0.0, 0.0, 0.0);
        let summary = Summary::of(&[right, jump, idle, right]);
        assert_eq!((summary.entries, summary.idle), (4, 1));
        assert_eq!(summary.unconverged, [(1, 2)]);
        assert!(summary.passes());
        let wrong = entry(1.1, 1.0, 1.0);
        assert!(!Summary::of(&[right, right, right, wrong]).passes(), "the 95th percentile sees it");
        assert!(!Summary::of(&[jump, idle]).passes(), "nothing was judged");
    }
}
