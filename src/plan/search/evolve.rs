//! The search for one stroke: an evolution strategy over places and paths, by coarse rollouts.
//!
//! Coarse dough and seeds come in, the best stroke found goes out. Imports sim's batches.

use rayon::prelude::*;

use super::coarse::{Coarse, Cost};
use super::seeds::Seed;
use super::stroke::{Spread, Stroke, pick};
use crate::math::cloud::{Point, distance};
use crate::math::rng::Pcg64;
use crate::plan::adam::Adam;
use crate::plan::settings::SearchSettings;
use crate::plan::settle::mean_speed;
use crate::sim::lanes::Real;
use crate::sim::{Batch, ParticleState, SimError, Simulator, StepSeed, Tool, ToolPose};

/// A stroke that was tried.
#[derive(Clone, Debug)]
pub struct Tried {
    pub stroke: Stroke,
    /// Where the tool began.
    pub pose: ToolPose,
    /// The coarse objective after it, m.
    pub objective: f64,
    /// The coarse dough after it, m.
    pub(super) end: Vec<Point>,
}

/// Standard deviations of the first generation that descends, and of the last.
const WIDE: Spread = Spread { place: 0.015, yaw: 0.3, gap: 0.015, knot: 0.6, length: 0.3 };
const NARROW: Spread = Spread { place: 0.003, yaw: 0.06, gap: 0.004, knot: 0.12, length: 0.1 };

/// Free control steps that are run at once.
const STRIDE: usize = 5;
/// Below this mean speed dough has nearly come to rest, m/s: friction stops it within a millimetre.
const RESTING_SPEED: f64 = 0.1;

/// Every so many gradient steps the stroke is tried.
const EVERY: usize = 3;
/// How many strokes are refined by gradients.
const REFINED: usize = 4;

/// How far the best strokes are put beside their place, to see whether they are better there, m. Where a knife comes
/// down decides which dough goes which way, and no gradient tells of that.
pub const NUDGES: [f64; 3] = [0.008, 0.004, 0.002];
/// How many strokes the search shifts so.
const NUDGED: usize = 2;

/// Two strokes are of a kind if the dough that they leave differs by less than this share of the objective before them.
const KIN: f64 = 0.1;
/// So many strokes of a kind may have descendants: the best stroke by itself need not be the best to go on from.
const OF_A_KIND: usize = 2;

/// What a search needs to know.
pub struct Search<'a, T: Real> {
    pub settings: &'a SearchSettings,
    pub tool: &'a Tool,
    pub rest: &'a ToolPose,
    pub coarse: &'a Coarse<'a>,
    /// Its objective before any stroke, m.
    pub before: f64,
    /// Brings a tool down onto the dough.
    pub lowered: &'a (dyn Fn(ToolPose) -> ToolPose + Sync),
    pub batch: &'a mut Batch<T>,
    /// Memory for a simulator's substeps where gradients are wanted, bytes.
    pub gradient_memory: usize,
    /// Control steps that are left.
    pub steps_left: usize,
}

impl<T: Real> Search<'_, T> {
    /// The best strokes of a first generation, which looks everywhere: from every seed some. None if none could be
    /// carried out.
    pub fn first(&mut self, seeds: &[Seed], rng: &mut Pcg64) -> Vec<Tried> {
        let s = self.settings;
        let lengths = self.lengths();
        let longest = lengths.iter().copied().max().unwrap_or(1);
        let count = if seeds.is_empty() { 0 } else { s.first_population };
        let strokes: Vec<Stroke> = (0..count)
            .map(|k| {
                let seed = &seeds[k % seeds.len()];
                let begin = Stroke { steps: pick(&lengths, rng), ..seed.stroke.clone() };
                begin.with_random_knots(self.tool, seed.dive, &seed.lean, s.knots, rng).perhaps_stirring(
                    self.tool,
                    seed.dive,
                    seed.stirring,
                    longest,
                    rng,
                )
            })
            .collect();
        let pool = self.try_all(&strokes);
        self.fittest(pool)
    }

    /// The best strokes that further generations find, best first. `pool` is what the first one has found; `on_searched`
    /// hears which share of the search is done.
    pub fn run(
        &mut self,
        mut pool: Vec<Tried>,
        rng: &mut Pcg64,
        mut on_searched: impl FnMut(f64),
    ) -> Vec<Tried> {
        let s = self.settings;
        let lengths = self.lengths();
        for generation in 1..s.generations {
            if pool.is_empty() {
                break;
            }
            let t = (generation - 1) as f64 / (s.generations - 1).max(2) as f64;
            let spread = WIDE.towards(&NARROW, t);
            let strokes: Vec<Stroke> = (0..s.population)
                .map(|k| pool[k % pool.len()].stroke.varied(self.tool, &spread, &lengths, rng))
                .collect();
            pool.extend(self.try_all(&strokes));
            pool = self.fittest(pool);
            on_searched((generation + 1) as f64 / s.generations as f64);
        }
        pool
    }

    /// The strokes by the objective as it is now: gaps may weigh more than when they were found.
    pub fn judged_anew(&self, mut pool: Vec<Tried>) -> Vec<Tried> {
        let coarse = self.coarse;
        pool.par_iter_mut().for_each(|t| t.objective = coarse.objective(&t.end));
        pool
    }

    /// Lengths that a stroke may have now, control steps.
    fn lengths(&self) -> Vec<usize> {
        self.settings.lengths.iter().map(|&l| l.min(self.steps_left)).collect()
    }

    /// The best strokes, best first, not too many of a kind.
    fn fittest(&self, mut pool: Vec<Tried>) -> Vec<Tried> {
        let before = self.before;
        let merit = |t: &Tried| self.settings.merit(before - t.objective, t.stroke.steps);
        pool.sort_by(|a, b| merit(b).total_cmp(&merit(a)));
        let mut kept: Vec<Tried> = Vec::new();
        for tried in pool {
            let is_kin = |other: &&Tried| are_kin(&other.end, &tried.end, before);
            if kept.iter().filter(is_kin).count() < OF_A_KIND {
                kept.push(tried);
            }
            if kept.len() == self.settings.parents {
                break;
            }
        }
        kept
    }

    /// The best of the strokes and of what gradient steps, and then small shifts of the place, make of the first of them.
    pub fn refined(&mut self, mut pool: Vec<Tried>) -> Vec<Tried> {
        for (count, steps) in
            [(REFINED, self.settings.gradient_steps), (REFINED / 2, 2 * self.settings.gradient_steps)]
        {
            let descent = Descent {
                tool: self.tool,
                rest: self.rest,
                coarse: self.coarse,
                lowered: self.lowered,
                rate: self.settings.learning_rate,
                memory: self.gradient_memory,
            };
            let best = &pool[..pool.len().min(count)];
            let paths =
                self.batch.run(best, |tried| tried.stroke.steps, |sim, tried| descent.run(sim, tried, steps));
            pool.extend(self.settled(paths.into_iter().flatten().collect()));
            pool = self.fittest(pool);
        }
        for way in NUDGES {
            let strokes: Vec<Stroke> = pool.iter().take(NUDGED).flat_map(|t| t.stroke.nudged(way)).collect();
            pool.extend(self.try_all(&strokes));
            pool = self.fittest(pool);
        }
        pool
    }

    /// Those of the strokes that can be carried out and promise most, with what they lead to.
    fn try_all(&mut self, strokes: &[Stroke]) -> Vec<Tried> {
        let (lowered, rest, tool, coarse) = (self.lowered, self.rest, self.tool, self.coarse);
        let try_one = |sim: &mut Simulator<T>, stroke: &Stroke| {
            sim.set_tools(vec![tool.clone()]);
            Left::of(sim, stroke, lowered(stroke.pose_above(rest)), tool, coarse).map(|(left, _)| left)
        };
        let left = self.batch.run(strokes, |stroke| stroke.steps, try_one);
        self.settled(left)
    }

    /// What comes of the strokes that promise most, of all that were tried: none where a rollout broke down.
    ///
    /// Half of the time would go into dough that comes to rest after strokes that nobody wants: only the better half of
    /// the strokes, judged by the dough as the tool leaves it, is followed to its end.
    fn settled(&mut self, left: Vec<Option<Left>>) -> Vec<Tried> {
        let (coarse, settle_steps) = (self.coarse, self.settings.settle_steps);
        let half = left.len().div_ceil(2);
        let mut left: Vec<Left> = left.into_iter().flatten().filter(|l| l.objective.is_finite()).collect();
        let merit = |l: &Left| self.settings.merit(self.before - l.objective, l.stroke.steps);
        left.sort_by(|a, b| merit(b).total_cmp(&merit(a)));
        left.truncate(half);
        let settle = |sim: &mut Simulator<T>, l: &Left| {
            let end = come_to_rest(sim, l.state.clone(), settle_steps, |_| {}).ok()?;
            let objective = coarse.objective(&end.x);
            Some(Tried { stroke: l.stroke.clone(), pose: l.pose, objective, end: end.x })
        };
        // Nobody knows how long dough takes to come to rest.
        let results = self.batch.run(&left, |_| 0, settle);
        results.into_iter().flatten().filter(|t| t.objective.is_finite()).collect()
    }
}

/// The dough as a stroke leaves it, before it rests.
struct Left {
    stroke: Stroke,
    pose: ToolPose,
    objective: f64,
    state: ParticleState,
}

impl Left {
    /// What `stroke` leaves, from `pose`, and the gradient of the objective by its positions; none if the rollout breaks
    /// down.
    fn of<T: Real>(
        sim: &mut Simulator<T>,
        stroke: &Stroke,
        pose: ToolPose,
        tool: &Tool,
        coarse: &Coarse<'_>,
    ) -> Option<(Self, Vec<Point>)> {
        sim.rollout(&coarse.state, &[pose], &stroke.actions(tool)).ok()?;
        let state = sim.state(stroke.steps);
        let Cost { objective, positions_adj, .. } = coarse.cost(&state.x);
        Some((Self { stroke: stroke.clone(), pose, objective, state }, positions_adj))
    }
}

/// A gradient descent on the objective at the end of a stroke, by its path and by where it begins.
struct Descent<'a> {
    tool: &'a Tool,
    rest: &'a ToolPose,
    coarse: &'a Coarse<'a>,
    lowered: &'a (dyn Fn(ToolPose) -> ToolPose + Sync),
    rate: f64,
    /// Bytes for substeps.
    memory: usize,
}

impl Descent<'_> {
    /// What some of the strokes leave that the descent from `tried` passes.
    fn run<T: Real>(&self, sim: &mut Simulator<T>, tried: &Tried, steps: usize) -> Vec<Option<Left>> {
        let from = &tried.stroke;
        let mut variables = from.variables();
        let mut adam = Adam::new(&variables);
        let mut path = Vec::new();
        sim.set_tools(vec![self.tool.clone()]);
        for k in 0..=steps {
            let is_last = k == steps;
            sim.set_memory_limit(if is_last { 0 } else { self.memory });
            let stroke = from.with_variables(self.tool, &variables);
            let pose = (self.lowered)(stroke.pose_above(self.rest));
            let (left, positions_adj) = Left::of(sim, &stroke, pose, self.tool, self.coarse).unzip();
            if k > 0 && k % EVERY == 0 {
                path.push(left);
            }
            if is_last {
                break;
            }
            let gradient = positions_adj.and_then(|adj| self.gradient(sim, &stroke, adj));
            let Some(gradient) = gradient else { break };
            adam.step(self.rate, &gradient, &mut variables);
        }
        sim.set_memory_limit(0);
        path
    }

    /// By the stroke's variables, where that by the positions it has led to is known. The height at which the tool
    /// touches the dough is taken for fixed.
    fn gradient<T: Real>(
        &self,
        sim: &mut Simulator<T>,
        stroke: &Stroke,
        positions_adj: Vec<Point>,
    ) -> Option<Vec<Vec<f64>>> {
        let mut seeds = vec![StepSeed::default(); stroke.steps + 1];
        seeds[stroke.steps].positions = positions_adj;
        let gradient = sim.rollout_adj(&seeds).ok()?;
        let rows = stroke.variables_adj(self.tool, self.rest, &gradient.start_poses[0], &gradient.actions);
        rows.iter().flatten().all(|g| g.is_finite()).then_some(rows)
    }
}

/// The dough after it has moved freely until it nearly rests, or for `most` control steps. `each` gets the positions
/// after every one of them.
pub fn come_to_rest<T: Real>(
    sim: &mut Simulator<T>,
    mut state: ParticleState,
    most: usize,
    mut each: impl FnMut(Vec<Point>),
) -> Result<ParticleState, SimError> {
    sim.set_tools(Vec::new());
    let mut done = 0;
    while done < most {
        let steps = STRIDE.min(most - done);
        sim.rollout(&state, &[], &vec![Vec::new(); steps])?;
        (1..=steps).for_each(|s| each(sim.positions(s)));
        state = sim.state(steps);
        done += steps;
        if mean_speed(&state) < RESTING_SPEED {
            break;
        }
    }
    Ok(state)
}

/// Whether two strokes are of a kind, which have brought the same particles to `a` and `b` from an objective of `before`.
pub fn are_kin(a: &[Point], b: &[Point], before: f64) -> bool {
    let apart = a.iter().zip(b).map(|(p, q)| distance(*p, *q)).sum::<f64>() / a.len() as f64;
    apart < KIN * before
}

impl Spread {
    /// Geometric interpolation: this one at t = 0, `other` at t = 1.
    fn towards(&self, other: &Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| a * (b / a).powf(t);
        Self {
            place: mix(self.place, other.place),
            yaw: mix(self.yaw, other.yaw),
            gap: mix(self.gap, other.gap),
            knot: mix(self.knot, other.knot),
            length: mix(self.length, other.length),
        }
    }
}
