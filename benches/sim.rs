//! Times of the simulator and of a gradient iteration: `cargo bench --bench sim [FILTER]`.
//!
//! `iteration` is what Algorithm 1 does J times for a segment: 40 control steps, the loss, and the gradient by the
//! actions. `operation` is one substep taken apart, on one thread, each operation with its adjoint: P2G with and the
//! constitutive update (stress and return mapping) without its scatter, the grid without and with contact, G2P. 5000 particles
//! pressed by a rolling pin. Set DONUT_THREADS for the iteration's threads. Imports the library.

use std::time::Duration;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use donut::emd::reach::{Method, next_reachable};
use donut::math::cloud::Point;
use donut::plan::losses::{Aim, Goal, evaluate};
use donut::sim::block::{AXES, load_axes, load_m3, store_axes, store_m3};
use donut::sim::constitutive::{trial, trial_adj, update, update_adj};
use donut::sim::contact::{Contact, contacts};
use donut::sim::g2p::{GridToParticles, GridToParticlesAdj};
use donut::sim::grid::GridUpdate;
use donut::sim::lanes::{Kernel, Lanes, M3, Real};
use donut::sim::layout::Layout;
use donut::sim::p2g::{ParticlesToGrid, ParticlesToGridAdj, Trials};
use donut::sim::particles::{BLOCK, C, F, Packed};
use donut::sim::transfer::NODE;
use donut::sim::{Options, Params, ParticleState, SimdLevel, Simulator, Tool, ToolPose};
use donut::task::load_scene;

const PARTICLES: usize = 5000;
const STEPS: usize = 40;

/// Dough, a pin just above it, and where the dough should go.
struct World {
    params: Params,
    pin: Tool,
    start: ParticleState,
    pose: ToolPose,
    goal: Vec<Point>,
}

fn world() -> World {
    let scene = load_scene("spread").expect("the task is in the binary");
    let x = scene.dough.solid.fill(scene.dough.center, PARTICLES, 1);
    let top = x.iter().map(|p| p[1]).fold(0.0, f64::max);
    let pose = ToolPose { position: [0.5, top + 0.031, 0.5], ..scene.tools[0].rest };
    let goal = x.iter().map(|p| [0.5 + 1.4 * (p[0] - 0.5), 0.5 * p[1], 0.5 + 1.4 * (p[2] - 0.5)]).collect();
    World {
        params: scene.params.clone(),
        pin: scene.tools[0].tool.clone(),
        start: ParticleState::at_rest(x),
        pose,
        goal,
    }
}

fn actions() -> Vec<Vec<f64>> {
    (0..STEPS).map(|i| vec![if i / 5 % 2 == 1 { 0.1 } else { -0.1 }, 0.05, -0.3, 0.0]).collect()
}

fn iteration(criterion: &mut Criterion) {
    let w = world();
    let threads = std::env::var("DONUT_THREADS").ok().and_then(|t| t.parse().ok()).unwrap_or(1);
    let options = Options { threads, ..Options::default() };
    let mut sim = Simulator::<f32>::new(w.params.clone(), vec![w.pin.clone()], options);
    let (actions, active) = (actions(), (0..PARTICLES).collect::<Vec<_>>());
    let reach = || next_reachable(&w.start.x, &w.goal, 20, 0.005, Method::Exact).expect("clouds of one size");
    let reachable = reach().cloud;
    let goal = Goal { aim: Aim::Points(&reachable), active: &active, weights: [1.0, 1.0, 0.02] };

    let mut group = criterion.benchmark_group("iteration");
    group.bench_function("reachable", |b| b.iter(reach));
    group.bench_function("forward", |b| b.iter(|| sim.rollout(&w.start, &[w.pose], &actions)));
    group.bench_function("gradient", |b| {
        b.iter(|| {
            sim.rollout(&w.start, &[w.pose], &actions).expect("a gentle press");
            let (loss, seeds) = evaluate(&sim, &goal);
            (loss, sim.rollout_adj(&seeds).expect("seeds of this rollout").actions)
        });
    });
    group.finish();
}

/// A substep in the middle of a press, taken apart: what each operation reads.
struct Middle {
    w: World,
    simd: SimdLevel,
    layout: Layout,
    sorted: Packed<f32>,
    poses: [ToolPose; 2],
}

impl Middle {
    fn new() -> Self {
        let w = world();
        let mut sim = Simulator::<f32>::new(w.params.clone(), vec![w.pin.clone()], Options::default());
        sim.rollout(&w.start, &[w.pose], &actions()).expect("a gentle press");
        let mut packed = Packed::default();
        packed.pack(&sim.state(STEPS), w.params.nodes);
        let (layout, order) = Layout::build(w.params.nodes, PARTICLES, &packed);
        let mut sorted = Packed::default();
        sorted.take_sorted(&packed, &order);
        let poses = [STEPS - 1, STEPS].map(|step| sim.poses(step)[0]);
        Self { w, simd: SimdLevel::best(), layout, sorted, poses }
    }

    fn contacts(&self) -> Vec<Contact<'_>> {
        contacts(&self.w.params, std::slice::from_ref(&self.w.pin), &self.poses[..1], &self.poses[1..])
    }

    fn shares(&self) -> Vec<Vec<f32>> {
        self.layout.parts.iter().map(|p| vec![0.0; p.nodes.len() * NODE]).collect()
    }

    fn p2g(&self, next: &mut [f32], axes: &mut [f32], shares: &mut [Vec<f32>]) {
        for (part, grid) in self.layout.parts.iter().zip(shares) {
            let own = |unit: usize| part.blocks.start * unit..part.blocks.end * unit;
            let (next, axes) = (&mut next[own(BLOCK)], &mut axes[own(AXES)]);
            let (state, anchors) = (&self.sorted.fields[own(BLOCK)], &self.sorted.anchors[..]);
            let (params, layout) = (&self.w.params, &self.layout);
            let kernel = ParticlesToGrid { params, layout, part, state, anchors, next, axes, grid };
            f32::dispatch(self.simd, kernel);
        }
    }

    fn p2g_adj(&self, axes: &[f32], grid_adj: &[f32], adj: &mut [f32]) {
        for part in &self.layout.parts {
            let adj = &mut adj[part.blocks.start * BLOCK..part.blocks.end * BLOCK];
            let (state, anchors) = (&self.sorted.fields[..], &self.sorted.anchors[..]);
            let (params, layout) = (&self.w.params, &self.layout);
            let kernel = ParticlesToGridAdj { params, layout, part, state, anchors, axes, grid_adj, adj };
            f32::dispatch(self.simd, kernel);
        }
    }

    fn g2p(&self, velocity: &[f32], next: &mut [f32]) {
        for part in &self.layout.parts {
            let next = &mut next[part.blocks.start * BLOCK..part.blocks.end * BLOCK];
            let (state, anchors) = (&self.sorted.fields[..], &self.sorted.anchors[..]);
            let (params, layout) = (&self.w.params, &self.layout);
            let kernel = GridToParticles { params, layout, part, state, anchors, velocity, next };
            f32::dispatch(self.simd, kernel);
        }
    }

    fn g2p_adj(&self, velocity: &[f32], next: &[f32], adj: &mut [f32], shares: &mut [Vec<f32>]) {
        for (part, grid_adj) in self.layout.parts.iter().zip(shares) {
            let adj = &mut adj[part.blocks.start * BLOCK..part.blocks.end * BLOCK];
            let (state, anchors) = (&self.sorted.fields[..], &self.sorted.anchors[..]);
            let (params, layout) = (&self.w.params, &self.layout);
            let kernel =
                GridToParticlesAdj { params, layout, part, state, next, anchors, velocity, adj, grid_adj };
            f32::dispatch(self.simd, kernel);
        }
    }

    /// Grid update with or without the pin: the difference is contact.
    fn grid(
        &self,
        contacts: &[Contact<'_>],
        shares: &[Vec<f32>],
        momentum: &mut [f32],
        velocity: &mut [f32],
    ) {
        for pencils in &self.layout.pencil_parts {
            let nodes = self.layout.nodes_of(pencils);
            let own = nodes.start * NODE..nodes.end * NODE;
            self.update(contacts, shares, pencils.clone())
                .run(&mut momentum[own.clone()], &mut velocity[own]);
        }
    }

    fn grid_adj(&self, contacts: &[Contact<'_>], shares: &[Vec<f32>], momentum: &[f32], adj: &mut [f32]) {
        for pencils in &self.layout.pencil_parts {
            let nodes = self.layout.nodes_of(pencils);
            let own = nodes.start * NODE..nodes.end * NODE;
            self.update(contacts, shares, pencils.clone()).run_adj(&momentum[own.clone()], &mut adj[own]);
        }
    }

    fn update<'a>(
        &'a self,
        contacts: &'a [Contact<'a>],
        shares: &'a [Vec<f32>],
        pencils: std::ops::Range<usize>,
    ) -> GridUpdate<'a, f32> {
        let (params, simd, layout) = (&self.w.params, self.simd, &self.layout);
        GridUpdate { params, simd, layout, shares, contacts, pencils }
    }
}

/// The constitutive update of all particles, without the scatter that shares a kernel with it.
struct Constitutive<'a> {
    params: &'a Params,
    state: &'a [f32],
    next: &'a mut [f32],
    axes: &'a mut [f32],
    /// Where a part of the stress goes, so that it is computed.
    stress: &'a mut [f32],
}

impl Kernel<f32> for Constitutive<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Real = f32>>(self) {
        let blocks = self.state.as_chunks::<BLOCK>().0;
        let next = self.next.as_chunks_mut::<BLOCK>().0;
        let axes = self.axes.as_chunks_mut::<AXES>().0;
        let mut trials = Trials::<L>::new();
        for (k, (next, axes)) in next.iter_mut().zip(axes).enumerate() {
            let (h_trial, u) = trials.of(self.params, blocks, k);
            let up = update(self.params, h_trial, u);
            store_m3::<L>(next, F, &up.h_new);
            store_axes(axes, &up.spectrum.u);
            up.tau[0][0].store(self.stress);
            up.tau[1][2].store(self.stress);
        }
    }
}

/// Adjoint of [`Constitutive`].
struct ConstitutiveAdj<'a> {
    params: &'a Params,
    state: &'a [f32],
    axes: &'a [f32],
    adj: &'a mut [f32],
}

impl Kernel<f32> for ConstitutiveAdj<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<Real = f32>>(self) {
        let blocks = self.state.as_chunks::<BLOCK>().0.iter();
        let axes = self.axes.as_chunks::<AXES>().0;
        for ((block, axes), adj) in blocks.zip(axes).zip(self.adj.as_chunks_mut::<BLOCK>().0) {
            let (c, h): (M3<L>, M3<L>) = (load_m3(block, C), load_m3(block, F));
            let up = update(self.params, trial(self.params.dt, &c, &h), load_axes(axes));
            // Any numbers do for the stress's adjoint.
            let f_trial_adj = update_adj(self.params, &up, &load_m3(adj, F), &load_m3(adj, C));
            let (c_adj, f_adj) = trial_adj(self.params.dt, &c, &h, &f_trial_adj);
            store_m3(adj, C, &c_adj);
            store_m3(adj, F, &f_adj);
        }
    }
}

fn constitutive(criterion: &mut Criterion) {
    let m = Middle::new();
    let (params, state) = (&m.w.params, &m.sorted.fields[..]);
    let (mut next, mut stress) = (vec![0.0; state.len()], [0.0; 16]);
    let mut axes = vec![0.0; state.len() / BLOCK * AXES];
    let mut group = criterion.benchmark_group("operation");
    group.bench_function("constitutive", |b| {
        b.iter(|| {
            let (next, axes, stress) = (&mut next[..], &mut axes[..], &mut stress[..]);
            f32::dispatch(m.simd, Constitutive { params, state, next, axes, stress });
        });
    });
    let ones = vec![1e-3; state.len()];
    group.bench_function("constitutive_adj", |b| {
        let axes = &axes[..];
        b.iter_batched_ref(
            || ones.clone(),
            |adj| f32::dispatch(m.simd, ConstitutiveAdj { params, state, axes, adj }),
            BatchSize::LargeInput,
        );
    });
    group.finish();
}

fn operation(criterion: &mut Criterion) {
    let m = Middle::new();
    let blocks = m.sorted.fields.len() / BLOCK;
    let mut next = vec![0.0; blocks * BLOCK];
    let mut axes = vec![0.0; blocks * AXES];
    let mut shares = m.shares();
    let mut momentum = vec![0.0; m.layout.len * NODE];
    let mut velocity = momentum.clone();
    let contacts = m.contacts();
    let mut group = criterion.benchmark_group("operation");
    // Constitutive update and scatter are one kernel.
    group.bench_function("p2g", |b| b.iter(|| m.p2g(&mut next, &mut axes, &mut shares)));
    group.bench_function("grid", |b| b.iter(|| m.grid(&[], &shares, &mut momentum, &mut velocity)));
    group.bench_function("grid with contact", |b| {
        b.iter(|| m.grid(&contacts, &shares, &mut momentum, &mut velocity));
    });
    group.bench_function("g2p", |b| b.iter(|| m.g2p(&velocity, &mut next)));

    let ones = vec![1e-3; blocks * BLOCK];
    let mut shares_adj = m.shares();
    let mut grid_adj = vec![0.0; m.layout.len * NODE];
    group.bench_function("g2p_adj", |b| {
        let adj = || ones.clone();
        b.iter_batched_ref(
            adj,
            |adj| m.g2p_adj(&velocity, &next, adj, &mut shares_adj),
            BatchSize::LargeInput,
        );
    });
    group.bench_function("grid_adj", |b| b.iter(|| m.grid_adj(&[], &shares_adj, &momentum, &mut grid_adj)));
    group.bench_function("grid_adj with contact", |b| {
        b.iter(|| m.grid_adj(&contacts, &shares_adj, &momentum, &mut grid_adj));
    });
    group.bench_function("p2g_adj", |b| {
        let adj = || ones.clone();
        b.iter_batched_ref(adj, |adj| m.p2g_adj(&axes, &grid_adj, adj), BatchSize::LargeInput);
    });
    group.finish();
}

criterion_group! {
    name = sim;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(5));
    targets = constitutive, operation, iteration
}
criterion_main!(sim);
