//! Whether the gradient of a rollout is right: the adjoint against finite differences of the forward pass.
//!
//! A [`Case`] (a world, a start, actions, where the particles should end) comes in; [`Entry`]s, one for each
//! tried component of an action, and their [`Summary`] go out. The loss is linear, the slope of the L1
//! distance to the target at the unperturbed end: so only the simulator is judged, not the loss's kinks.
//! Imports rollout and math.
//!
//! ```text
//! L(a)       = sum_p g_p . x_p(a),                  g_p = sign(x_p(a_0) - target_p), held fixed
//! D_h        = (L(a + h) - L(a - h)) / 2h           the central difference
//! B_h        = D+_h - D-_h                          the bend: how far the two one-sided differences are apart
//! doubt_h    = |D_h - D_H| + |B_h - B_H h / H| / 2  H the next larger step
//! difference   the D_h with the least doubt
//! converged    doubt <= 1e-4 scale                  else there is nothing to compare with
//! error        |adjoint - difference| / scale       scale = max(|difference|, 1e-6 of the largest gradient entry)
//! ```
//!
//! D_h has a truncation error of order h^2 and a rounding error of order 1e-16 / h times what the dough amplifies: at
//! 1e-6 both are near 1e-9 where nothing switches. Two things do switch: contact sets in with a jump at influence 0.1,
//! and friction and yielding have kinks. A jump within h makes two central differences disagree. A kink at a distance
//! d < h does not: D_h is then off by (1 - d / h) / 2 of the change in slope, which for h well above d is the same for
//! all h. The bend tells: it falls in proportion to h where the loss is smooth, and stays where there is a kink. Smaller
//! steps leave kinks outside, down to where rounding takes over.

use rayon::prelude::*;

use super::error::SimError;
use super::lanes::Real;
use super::options::Options;
use super::params::Params;
use super::particles::ParticleState;
use super::rollout::Simulator;
use super::seed::StepSeed;
use super::tool::{Tool, ToolPose};
use crate::math::cloud::Point;
use crate::math::rng::{sample_indices, seeded, uniform};

/// Step sizes of the differences, the largest first. The third and later ones are tried only where the larger ones leave
/// a doubt above [`SETTLED`].
pub const STEPS: [f64; 5] = [1e-6, 3e-7, 1e-7, 3e-8, 1e-8];
/// A doubt that no smaller step could lower, as a share of the scale: rounding.
const SETTLED: f64 = 1e-7;
/// A finite difference has converged when its doubt is below this share of the scale.
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
    /// The central difference with the least doubt.
    pub difference: f64,
    /// How far that may be off, judged from differences alone.
    pub doubt: f64,
    /// What errors are relative to.
    pub scale: f64,
}

impl Entry {
    /// Whether the entry changes nothing at all, and the adjoint knows.
    pub fn is_idle(&self) -> bool {
        self.adjoint == 0.0 && self.difference == 0.0 && self.doubt == 0.0
    }

    /// Whether the finite difference is worth comparing with.
    pub fn has_converged(&self) -> bool {
        self.doubt <= CONVERGED * self.scale
    }

    /// Error of the adjoint against the difference.
    pub fn error(&self) -> f64 {
        (self.adjoint - self.difference).abs() / self.scale
    }
}

/// What a step of one size to either side finds.
#[derive(Clone, Copy, Debug)]
struct Sides {
    /// The step size.
    h: f64,
    /// The central difference.
    central: f64,
    /// The right-hand difference less the left-hand one.
    bend: f64,
}

impl Sides {
    /// How far the central difference may be off, `larger` being what a larger step found.
    fn doubt(&self, larger: &Self) -> f64 {
        let smooth = larger.bend * self.h / larger.h;
        (self.central - larger.central).abs() + 0.5 * (self.bend - smooth).abs()
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
    /// Median of the others' doubt, as a share of their scale: what no error below it can tell.
    pub doubt: Option<f64>,
}

impl Summary {
    /// Sums up entries.
    pub fn of(entries: &[Entry]) -> Self {
        let moving = || entries.iter().filter(|e| !e.is_idle());
        let sorted = |of: fn(&Entry) -> f64| {
            let mut all: Vec<f64> = moving().filter(|e| e.has_converged()).map(of).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let (errors, doubts) = (sorted(Entry::error), sorted(|e| e.doubt / e.scale));
        let mut unconverged: Vec<(usize, usize)> =
            moving().filter(|e| !e.has_converged()).map(|e| (e.step, e.component)).collect();
        unconverged.sort_unstable();
        Self {
            entries: entries.len(),
            idle: entries.len() - moving().count(),
            unconverged,
            median: quantile(&errors, 0.5),
            percentile_95: quantile(&errors, 0.95),
            doubt: quantile(&doubts, 0.5),
        }
    }

    /// Whether the adjoint keeps [`BOUNDS`]. Entries that cannot be judged do not pass for right ones: at
    /// least one must have been judged.
    pub fn passes(&self) -> bool {
        let [median, percentile_95] = BOUNDS;
        self.median.is_some_and(|e| e < median) && self.percentile_95.is_some_and(|e| e < percentile_95)
    }
}

/// The smallest of the values, sorted, that the given share of all does not exceed.
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied()
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
        let base = self.end(&mut self.simulator::<f64>(0), &self.actions)?;
        let floor = FLOOR * largest;
        let try_one = |sim: &mut Simulator<f64>, index: usize| {
            let (step, component) = (index / components.len(), components[index % components.len()]);
            let column = columns.start + component;
            let found = |h| self.sides(sim, &slope, &base, (step, column), h);
            let (difference, doubt) = least_doubt(found, floor)?;
            let scale = difference.abs().max(floor);
            Ok(Entry { step, component, adjoint: gradient[step][column], difference, doubt, scale })
        };
        drawn.into_par_iter().map_init(|| self.simulator::<f64>(0), try_one).collect()
    }

    /// Differences of the loss for steps of `h` to either side, `base` being the unperturbed end; subtracted particle by
    /// particle, because the sums themselves would lose the digits in question.
    fn sides(
        &self,
        sim: &mut Simulator<f64>,
        slope: &[Point],
        base: &[Point],
        (step, column): (usize, usize),
        h: f64,
    ) -> Result<Sides, SimError> {
        let own = self.actions[step][column];
        let mut actions = self.actions.clone();
        // The steps as they are after rounding `own + h`.
        let mut one_side = |value: f64| {
            actions[step][column] = value;
            let end = self.end(sim, &actions)?;
            let pairs = end.as_flattened().iter().zip(base.as_flattened());
            let change: f64 = pairs.zip(slope.as_flattened()).map(|((a, b), s)| s * (a - b)).sum();
            Ok((change, value - own))
        };
        let ((up, forth), (down, back)) = (one_side(own + h)?, one_side(own - h)?);
        Ok(Sides { h, central: (up - down) / (forth - back), bend: up / forth - down / back })
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

/// The central difference with the least doubt among those of [`STEPS`], and that doubt. `sides` takes a step of one size;
/// `floor` is the least scale.
fn least_doubt(
    mut sides: impl FnMut(f64) -> Result<Sides, SimError>,
    floor: f64,
) -> Result<(f64, f64), SimError> {
    let mut larger = sides(STEPS[0])?;
    let mut best = (larger.central, f64::INFINITY);
    for h in &STEPS[1..] {
        let here = sides(*h)?;
        let doubt = here.doubt(&larger);
        if doubt < best.1 {
            best = (here.central, doubt);
        }
        if best.1 <= SETTLED * best.0.abs().max(floor) {
            break;
        }
        larger = here;
    }
    Ok(best)
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

    fn entry(adjoint: f64, difference: f64, doubt: f64) -> Entry {
        Entry { step: 1, component: 2, adjoint, difference, doubt, scale: difference.abs().max(1e-6) }
    }

    #[test]
    fn a_summary_tells_idle_unconverged_right_and_wrong_apart() {
        let right = entry(1.0, 1.0, 0.0);
        let jump = entry(1.0, 5.0, 9.0);
        let idle = entry(0.0, 0.0, 0.0);
        let summary = Summary::of(&[right, jump, idle, right]);
        assert_eq!((summary.entries, summary.idle), (4, 1));
        assert_eq!(summary.unconverged, [(1, 2)]);
        assert!(summary.passes());
        let wrong = entry(1.1, 1.0, 0.0);
        assert!(!Summary::of(&[right, right, right, wrong]).passes(), "the 95th percentile sees it");
        assert!(!Summary::of(&[jump, idle]).passes(), "nothing was judged");
    }

    /// What [`least_doubt`] makes of a function around 0.
    fn difference_of(f: impl Fn(f64) -> f64) -> (f64, f64) {
        let sides = |h: f64| {
            let (up, down) = (f(h) - f(0.0), f(-h) - f(0.0));
            Ok(Sides { h, central: (up - down) / (2.0 * h), bend: up / h + down / h })
        };
        least_doubt(sides, 1e-6).unwrap()
    }

    #[test]
    fn differences_of_smooth_functions_bear_no_doubt() {
        let (value, doubt) = difference_of(|x| 2.0 * x + 5.0 * x * x);
        assert!((value - 2.0).abs() < 1e-7 && doubt < 1e-6, "{value} {doubt}");
    }

    #[test]
    fn a_kink_near_by_is_left_outside_by_a_smaller_step() {
        // The central differences of 1e-6 and 3e-7 are 2.005 and nearly agree; the slope at 0 is 2.
        let kink = |x: f64| 2.0 * x + 0.01 * (x - 5e-8).max(0.0);
        let (value, doubt) = difference_of(kink);
        assert!((value - 2.0).abs() < 1e-6 && doubt < 1e-4, "{value} {doubt}");
    }

    #[test]
    fn a_kink_on_the_spot_and_a_jump_are_not_converged() {
        for f in [(|x| 2.0 * x + 0.01 * x.max(0.0)) as fn(f64) -> f64, |x| {
            2.0 * x + if x > 2e-9 { 1e-3 } else { 0.0 }
        }] {
            let (value, doubt) = difference_of(f);
            assert!(doubt > CONVERGED * value.abs(), "{value} {doubt}");
        }
    }
}
