//! Rollouts: from a start state and actions to a trajectory, and from a loss back to the actions.
//!
//! [`Simulator::rollout`] runs the substeps and keeps what the backward pass needs;
//! [`Simulator::rollout_adj`] takes the loss's derivatives at the ends of control steps and returns the
//! gradient. Everything is allocated once and reused. Imports the rest of sim.
//!
//! With s_t the state and P_t the tools' poses at the start of substep t, N substeps to a control step and S control
//! steps, a rollout is
//!
//! ```text
//! P_{t+1} = advance(P_t, a_k)                for k = floor(t / N)        tool::path
//! s_{t+1} = substep(s_t, P_t, P_{t+1})                                  substep
//! L       = L(s_0, s_N, s_2N, .., s_SN; P_0, P_N, ..)                   any loss of the ends of control steps
//! ```
//!
//! and its gradient, for t from SN - 1 down to 0 (reverse accumulation; Griewank and Walther, chapter 3):
//!
//! ```text
//! s_adj <- dL/ds_SN                          the loss's own derivatives, called seeds
//! (s_adj, P_t_adj, P_{t+1}_adj) <- substep_adj(s_t, s_adj),   P_adj carried back by advance_adj, which adds to a_k_adj
//! s_adj += dL/ds_t                           where t is the start of a control step
//! ```
//!
//! `substep_adj` needs s_t. All SN states are kept while they fit into the memory limit; control steps
//! beyond it keep their first state alone, and run again before their adjoint (checkpointing with one level; Griewank
//! and Walther, chapter 12). That adds one forward pass to what was about four, and changes no bit.

use super::epoch::{Epoch, RUNNING, Trace};
use super::error::SimError;
use super::input::check;
use super::lanes::Real;
use super::layout::Layout;
use super::options::Options;
use super::params::Params;
use super::particles::{Packed, ParticleState, pack_adj, permute_adj};
use super::seed::StepSeed;
use super::substep::{Deformed, Fault, Substep, SubstepAdj, Workspace};
use super::tool::path::ToolPath;
use super::tool::{PoseAdj, Tool, ToolPose};
use crate::math::cloud::Point;

/// What the backward pass returns.
#[derive(Clone, Debug)]
pub struct RolloutGradient {
    /// By the actions: control steps x components of all tools in order.
    pub actions: Vec<Vec<f64>>,
    /// By the tools' start poses.
    pub start_poses: Vec<PoseAdj>,
    /// By the start state.
    pub start_state: ParticleState,
}

/// One simulated world with room for a rollout and its gradient.
pub struct Simulator<T: Real> {
    params: Params,
    tools: Vec<Tool>,
    options: Options,
    pool: Option<rayon::ThreadPool>,
    particles: usize,
    steps: usize,
    path: ToolPath,
    /// Epochs; those from `used` on are spare.
    epochs: Vec<Epoch<T>>,
    used: usize,
    /// Substeps of an epoch that is not kept.
    scratch: Trace<T>,
    /// Packed state at the end of the rollout so far.
    end: Packed<T>,
    workspace: Workspace<T>,
}

impl<T: Real> Simulator<T> {
    /// A world with the given tools, in the order in which they act and in which actions list them.
    pub fn new(params: Params, tools: Vec<Tool>, options: Options) -> Self {
        let pool = (options.threads > 1).then(|| {
            let builder = rayon::ThreadPoolBuilder::new().num_threads(options.threads);
            builder.build().expect("threads can be started")
        });
        Self {
            params,
            tools,
            options,
            pool,
            particles: 0,
            steps: 0,
            path: ToolPath::default(),
            epochs: Vec::new(),
            used: 0,
            scratch: Trace::default(),
            end: Packed::default(),
            workspace: Workspace::default(),
        }
    }

    /// The world's parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// The world's tools.
    pub fn tools(&self) -> &[Tool] {
        &self.tools
    }

    /// Exchanges the world's tools. The last rollout is forgotten.
    pub fn set_tools(&mut self, tools: Vec<Tool>) {
        self.tools = tools;
        self.used = 0;
        self.steps = 0;
    }

    /// Changes [`Options::memory_limit`] for the rollouts to come: with 0 a rollout keeps no substeps, which is
    /// fastest where no gradient is wanted.
    pub fn set_memory_limit(&mut self, bytes: usize) {
        self.options.memory_limit = bytes;
    }

    /// Runs `actions` (control steps x components of all tools in order) from a start state and poses.
    ///
    /// # Errors
    /// [`SimError`] where the arrays do not fit together, a particle starts outside the box, or the
    /// simulation breaks down; the trajectory is then unusable, the simulator is not.
    pub fn rollout(
        &mut self,
        start: &ParticleState,
        poses: &[ToolPose],
        actions: &[Vec<f64>],
    ) -> Result<(), SimError> {
        check(&self.params, &self.tools, start, poses, actions)?;
        self.options.tally.count_rollout();
        self.particles = start.len();
        self.steps = actions.len();
        self.used = 0;
        self.path = ToolPath::new(&self.tools, self.params.substeps, poses, actions);
        self.end.pack(start, self.params.nodes);
        let mut ids: Vec<u32> = (0..start.len() as u32).collect();
        let mut memory = self.options.memory_limit;
        let substeps = self.params.substeps;
        for step in 0..self.steps {
            let mut done = 0;
            while done < substeps {
                let run = self.run_epoch(step * substeps + done, substeps - done, &mut ids, memory);
                let (count, bytes) = match run {
                    Ok(run) => run,
                    Err(error) => {
                        // What is there is no rollout: a backward pass must not start from it.
                        self.used = 0;
                        return Err(error);
                    }
                };
                memory = memory.saturating_sub(bytes);
                done += count;
            }
        }
        // One more sort, so that the last state has a place like all others.
        self.open_epoch(self.steps * substeps, &mut ids);
        Ok(())
    }

    /// What substep `t` of the rollout needs to know.
    fn substep<'a>(&'a self, layout: &'a Layout, t: usize) -> Substep<'a> {
        Substep {
            params: &self.params,
            simd: self.options.simd,
            parallel: self.options.threads > 1,
            tools: &self.tools,
            layout,
            start: self.path.at(t),
            end: self.path.at(t + 1),
        }
    }

    /// Runs `work` on the simulator's threads.
    fn on_threads<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    /// Sorts the current state into a fresh epoch.
    fn open_epoch(&mut self, first: usize, ids: &mut Vec<u32>) {
        if self.used == self.epochs.len() {
            self.epochs.push(Epoch::default());
        }
        let epoch = &mut self.epochs[self.used];
        self.used += 1;
        let (layout, from_slot) = Layout::build(self.params.nodes, self.particles, &self.end);
        *ids = from_slot.iter().map(|&s| ids[s as usize]).collect();
        epoch.first = first;
        epoch.count = 0;
        epoch.kept = true;
        epoch.start.take_sorted(&self.end, &from_slot);
        self.end.anchors.clone_from(&epoch.start.anchors);
        epoch.ids = ids.clone();
        epoch.from_slot = from_slot;
        epoch.layout = layout;
    }

    /// Runs up to `wanted` substeps on one layout; returns how many, and the bytes kept of them.
    fn run_epoch(
        &mut self,
        first: usize,
        wanted: usize,
        ids: &mut Vec<u32>,
        memory: usize,
    ) -> Result<(usize, usize), SimError> {
        self.open_epoch(first, ids);
        let at = self.used - 1;
        let bytes = Trace::<T>::bytes(wanted, self.particles, self.epochs[at].layout.len);
        let kept = bytes <= memory;
        let mut epoch = std::mem::take(&mut self.epochs[at]);
        epoch.kept = kept;
        let mut trace =
            if kept { std::mem::take(&mut epoch.trace) } else { std::mem::take(&mut self.scratch) };
        let outcome = self.run_substeps(&mut epoch, &mut trace, wanted, kept);
        if outcome.is_ok() {
            self.end.fields.copy_from_slice(&trace.states[if kept { epoch.count } else { 0 }]);
        }
        if kept {
            epoch.trace = trace;
        } else {
            self.scratch = trace;
        }
        let count = epoch.count;
        self.epochs[at] = epoch;
        outcome.map(|()| (count, if kept { bytes } else { 0 }))
    }

    /// Runs up to `wanted` substeps from the epoch's start; `epoch.count` says how many the layout allowed. If `kept`,
    /// `trace` has all of them in the end, else only the last state, at place 0: the next substep finds what it reads
    /// still in the cache then.
    fn run_substeps(
        &mut self,
        epoch: &mut Epoch<T>,
        trace: &mut Trace<T>,
        wanted: usize,
        kept: bool,
    ) -> Result<(), SimError> {
        trace.resize(if kept { wanted } else { 1 }, self.particles, epoch.layout.len);
        trace.states[0].copy_from_slice(&epoch.start.fields);
        let mut workspace = std::mem::take(&mut self.workspace);
        let Trace { states, axes, momentum, velocity } = trace;
        let (anchors, layout) = (&epoch.start.anchors, &epoch.layout);
        let count = self.on_threads(|| {
            let located = |t, fault: Fault| fault.locate(t, self.params.substeps, &epoch.ids);
            let first = self.substep(layout, epoch.first);
            let (state, rest) = states.split_at_mut(1);
            let deformed = Deformed { next: &mut rest[0], axes: &mut axes[0] };
            let begun = first
                .begin(&state[0], anchors, deformed, &mut workspace)
                .map_err(|fault| located(epoch.first, fault))?;
            assert!(begun, "a fresh layout holds every particle");
            for k in 0..wanted {
                let t = epoch.first + k;
                let (at, ahead_at) = if kept { (k, k + 1) } else { (0, 0) };
                let [state, next, rest @ ..] = &mut states[at..] else {
                    unreachable!("one more than substeps")
                };
                let ahead =
                    (k + 1 < wanted).then(|| Deformed { next: &mut rest[0], axes: &mut axes[ahead_at] });
                let (momentum, velocity) = (&mut momentum[at], &mut velocity[at]);
                let go_on = self
                    .substep(layout, t)
                    .run(state, anchors, next, momentum, velocity, ahead, &mut workspace)
                    .map_err(|fault| located(t, fault))?;
                if !kept {
                    states[..RUNNING].rotate_left(1);
                }
                if !go_on {
                    return Ok(k + 1);
                }
            }
            Ok(wanted)
        });
        self.workspace = workspace;
        epoch.count = count?;
        Ok(())
    }

    /// The gradient of a loss whose derivatives at the ends of control steps are `seeds` (at most one more
    /// than control steps; missing ones are zero).
    ///
    /// # Errors
    /// [`SimError::Shape`] if a seed does not fit the rollout. Simulation errors cannot occur: the forward
    /// pass went through.
    pub fn rollout_adj(&mut self, seeds: &[StepSeed]) -> Result<RolloutGradient, SimError> {
        self.check_seeds(seeds)?;
        self.options.tally.count_gradient();
        let width: usize = self.tools.iter().map(Tool::action_len).sum();
        let mut actions_adj = vec![vec![0.0; width]; self.steps];
        let mut poses_adj = vec![PoseAdj::default(); self.tools.len()];
        let mut adj = vec![T::default(); self.end.fields.len()];
        let mut before = adj.clone();
        let substeps = self.params.substeps;
        let mut workspace = std::mem::take(&mut self.workspace);
        for at in (0..self.used).rev() {
            let epoch = std::mem::take(&mut self.epochs[at]);
            self.ensure_trace(&epoch)?;
            let trace = if epoch.kept { &epoch.trace } else { &self.scratch };
            let substep_adj = |k: usize| SubstepAdj {
                substep: self.substep(&epoch.layout, epoch.first + k),
                state: &trace.states[k],
                next: &trace.states[k + 1],
                axes: &trace.axes[k],
                anchors: &epoch.start.anchors,
                momentum: &trace.momentum[k],
                velocity: &trace.velocity[k],
            };
            let chain: Vec<_> = (0..epoch.count).map(substep_adj).collect();
            self.on_threads(|| {
                if let Some(last) = chain.last() {
                    last.begin(&mut adj, &mut workspace);
                }
                for k in (0..epoch.count).rev() {
                    let before = k.checked_sub(1).map(|k| &chain[k]);
                    let (start_adj, end_adj) = chain[k].run(&mut adj, before, &mut workspace);
                    poses_adj.iter_mut().zip(&end_adj).for_each(|(total, end)| total.add(end));
                    self.path.substep_adj(&self.tools, epoch.first + k, &mut poses_adj, &mut actions_adj);
                    poses_adj.iter_mut().zip(&start_adj).for_each(|(total, start)| total.add(start));
                }
            });
            if epoch.first.is_multiple_of(substeps)
                && let Some(seed) = seeds.get(epoch.first / substeps)
            {
                seed.add_to(self.params.dx(), &epoch.ids, &mut adj, &mut poses_adj);
            }
            permute_adj(&epoch.from_slot, &adj, &mut before);
            std::mem::swap(&mut adj, &mut before);
            self.epochs[at] = epoch;
        }
        self.workspace = workspace;
        let identity: Vec<u32> = (0..self.particles as u32).collect();
        Ok(RolloutGradient {
            actions: actions_adj,
            start_poses: poses_adj,
            start_state: pack_adj(&adj, self.params.nodes, &identity),
        })
    }

    /// Runs an epoch again whose substeps were not kept.
    fn ensure_trace(&mut self, epoch: &Epoch<T>) -> Result<(), SimError> {
        if epoch.kept || epoch.count == 0 {
            return Ok(());
        }
        let mut again = Epoch { kept: false, ..epoch.clone() };
        let mut scratch = std::mem::take(&mut self.scratch);
        let outcome = self.run_substeps(&mut again, &mut scratch, epoch.count, true);
        self.scratch = scratch;
        outcome
    }

    fn check_seeds(&self, seeds: &[StepSeed]) -> Result<(), SimError> {
        if self.used == 0 || seeds.len() > self.steps + 1 {
            return Err(SimError::Shape(format!(
                "{} seeds for a rollout of {} control steps (one more is allowed)",
                seeds.len(),
                self.steps
            )));
        }
        let (n, tools) = (self.particles, self.tools.len());
        match seeds.iter().position(|seed| !seed.fits(n, tools)) {
            Some(step) => Err(SimError::Shape(format!(
                "the seed of control step {step} does not have {n} particles and {tools} tools"
            ))),
            None => Ok(()),
        }
    }

    /// The epoch whose start is the end of control step `step` (0: the start).
    fn epoch_at(&self, step: usize) -> &Epoch<T> {
        let first = step * self.params.substeps;
        self.epochs[..self.used]
            .iter()
            .find(|e| e.first == first)
            .expect("asked for a control step of the last rollout")
    }

    /// Positions at the end of control step `step` (0: the start), caller's order.
    ///
    /// # Panics
    /// If the last rollout was shorter.
    pub fn positions(&self, step: usize) -> Vec<Point> {
        let epoch = self.epoch_at(step);
        let mut x = vec![[0.0; 3]; self.particles];
        for (slot, &id) in epoch.ids.iter().enumerate() {
            x[id as usize] =
                std::array::from_fn(|axis| epoch.start.cells(slot, axis) / self.params.nodes as f64);
        }
        x
    }

    /// The whole state at the end of control step `step` (0: the start), caller's order.
    ///
    /// # Panics
    /// If the last rollout was shorter.
    pub fn state(&self, step: usize) -> ParticleState {
        let epoch = self.epoch_at(step);
        epoch.start.unpack(self.params.nodes, &epoch.ids)
    }

    /// The tools' poses at the end of control step `step` (0: the start).
    ///
    /// # Panics
    /// If the last rollout was shorter.
    pub fn poses(&self, step: usize) -> &[ToolPose] {
        self.path.after_step(step)
    }

    /// Control steps of the last rollout.
    pub fn steps(&self) -> usize {
        self.steps
    }
}
