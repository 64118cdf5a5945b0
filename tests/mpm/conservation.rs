//! Closed forms and conservation laws.

use donut::math::cloud::Point;
use donut::math::rng::{normal, seeded, uniform};
use donut::sim::{Options, Params, ParticleState, SimError, Simulator};

pub fn block(n: usize, at: Point, spacing: f64) -> Vec<Point> {
    let mut rng = seeded(1, "block");
    let mut jitter = move || 0.2 * spacing * (uniform(&mut rng) - 0.5);
    (0..n * n * n)
        .map(|i| {
            let k = [i % n, i / n % n, i / n / n];
            std::array::from_fn(|a| at[a] + spacing * k[a] as f64 + jitter())
        })
        .collect()
}

pub fn weightless() -> Params {
    Params { gravity: [0.0; 3], substeps: 10, ..Params::default() }
}

fn run(params: &Params, start: &ParticleState, steps: usize) -> ParticleState {
    let mut sim = Simulator::<f64>::new(params.clone(), vec![], Options::default());
    sim.rollout(start, &[], &vec![vec![]; steps]).unwrap();
    sim.state(steps)
}

/// Sum of positions x velocities plus what APIC keeps in C: sum over axes of x_i v_j - x_j v_i and
/// (dx^2/4) (C_ji - C_ij).
fn angular_momentum(params: &Params, s: &ParticleState) -> Point {
    let spread = params.dx() * params.dx() / 4.0;
    let mut total = [0.0; 3];
    for p in 0..s.len() {
        for (axis, (i, j)) in [(1, 2), (2, 0), (0, 1)].into_iter().enumerate() {
            total[axis] += s.x[p][i] * s.v[p][j] - s.x[p][j] * s.v[p][i]
                + spread * (s.c[p][3 * j + i] - s.c[p][3 * i + j]);
        }
    }
    total
}

#[test]
fn momentum_and_angular_momentum_are_kept_away_from_walls() {
    let params = weightless();
    let mut start = ParticleState::at_rest(block(6, [0.45; 3], 0.008));
    let mut rng = seeded(2, "momentum");
    for p in 0..start.len() {
        start.v[p] = std::array::from_fn(|_| normal(&mut rng));
        start.c[p] = std::array::from_fn(|_| 5.0 * normal(&mut rng));
        start.f[p].iter_mut().for_each(|f| *f += 0.02 * normal(&mut rng));
    }
    let end = run(&params, &start, 3);
    let momentum = |s: &ParticleState| donut::math::cloud::centroid(&s.v);
    let (before, after) = (momentum(&start), momentum(&end));
    let (turn_before, turn_after) = (angular_momentum(&params, &start), angular_momentum(&params, &end));
    for a in 0..3 {
        assert!((before[a] - after[a]).abs() < 1e-12, "momentum {before:?} {after:?}");
        assert!((turn_before[a] - turn_after[a]).abs() < 1e-9, "turn {turn_before:?} {turn_after:?}");
    }
}

#[test]
fn free_fall_is_a_parabola() {
    let params = Params { gravity: [0.0, -30.0, 0.0], ..Params::default() };
    let start = ParticleState::at_rest(block(5, [0.45, 0.6, 0.45], 0.008));
    let steps = 10;
    let end = run(&params, &start, steps);
    let (n, dt) = ((steps * params.substeps) as f64, params.dt);
    // Symplectic Euler: v grows before x moves.
    let drop = 30.0 * dt * dt * n * (n + 1.0) / 2.0;
    for (a, b) in start.x.iter().zip(&end.x) {
        assert!((a[1] - b[1] - drop).abs() < 1e-10 && (a[0] - b[0]).abs() < 1e-10);
    }
    for v in &end.v {
        assert!((v[1] + 30.0 * dt * n).abs() < 1e-9);
    }
}

#[test]
fn a_rigid_rotation_keeps_its_momentum_and_hardly_strains() {
    let params = weightless();
    let mut start = ParticleState::at_rest(block(6, [0.478; 3], 0.008));
    let center = donut::math::cloud::centroid(&start.x);
    let spin = 20.0;
    for p in 0..start.len() {
        let r = donut::math::cloud::sub(start.x[p], center);
        start.v[p] = [-spin * r[2], 0.0, spin * r[0]];
        start.c[p] = [0.0, 0.0, -spin, 0.0, 0.0, 0.0, spin, 0.0, 0.0];
    }
    let end = run(&params, &start, 5);
    let (before, after) = (angular_momentum(&params, &start)[1], angular_momentum(&params, &end)[1]);
    // What is lost sits on nodes lighter than 1e-12, which the grid update leaves at rest.
    assert!((after / before - 1.0).abs() < 1e-6, "{before} {after}");
    for f in &end.f {
        let f = nalgebra::Matrix3::from_row_slice(f);
        let strain = (f.transpose() * f - nalgebra::Matrix3::identity()).norm();
        assert!(strain < 0.02, "strain {strain}");
    }
}

#[test]
fn dough_at_rest_gains_no_energy() {
    let params = Params::default();
    let start = ParticleState::at_rest(block(7, [0.47, 0.0385, 0.47], 0.008));
    let mut sim = Simulator::<f64>::new(params, vec![], Options::default());
    let energy = |s: &ParticleState| -> f64 { s.v.as_flattened().iter().map(|v| v * v).sum::<f64>() };
    sim.rollout(&start, &[], &vec![vec![]; 60]).unwrap();
    let early = energy(&sim.state(5));
    let late = energy(&sim.state(60));
    assert!(late < 0.05 * early, "{early} {late}");
}

#[test]
fn an_error_names_the_substep_that_it_happened_in() {
    let error = |substeps: usize| {
        let params = Params { substeps, ..weightless() };
        let mut start = ParticleState::at_rest(block(3, [0.5; 3], 0.004));
        // So fast towards the middle that the second substep turns the dough inside out.
        start.v = start.x.iter().map(|x| x.map(|x| -1e5 * (x - 0.504))).collect();
        let mut sim = Simulator::<f64>::new(params, vec![], Options::default());
        sim.rollout(&start, &[], &vec![vec![]; 3]).unwrap_err()
    };
    assert!(matches!(error(10), SimError::Inverted { step: 0, substep: 1, .. }), "{}", error(10));
    assert!(matches!(error(1), SimError::Inverted { step: 1, substep: 0, .. }), "{}", error(1));
}

#[test]
fn errors_name_operation_step_and_particle() {
    let params = Params::default();
    let mut sim = Simulator::<f64>::new(params.clone(), vec![], Options::default());
    let mut start = ParticleState::at_rest(block(3, [0.5; 3], 0.008));
    start.f[7] = [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let error = sim.rollout(&start, &[], &[vec![]]).unwrap_err();
    assert_eq!(error, SimError::Inverted { step: 0, substep: 0, particle: 7 });
    start.f[7] = [f64::NAN; 9];
    let error = sim.rollout(&start, &[], &[vec![]]).unwrap_err();
    assert!(matches!(error, SimError::NonFinite { particle: 7, .. }), "{error}");
    // What broke down has no gradient; the simulator is usable afterwards.
    assert!(matches!(sim.rollout_adj(&[]), Err(SimError::Shape(_))));
    start.f[7] = start.f[6];
    sim.rollout(&start, &[], &[vec![]]).unwrap();
    // A particle at a speed that outruns its layout only costs a new layout.
    start.v[3] = [200.0, 0.0, 0.0];
    sim.rollout(&start, &[], &[vec![]]).unwrap();
    // Arrays that do not fit.
    start.v.pop();
    assert!(matches!(sim.rollout(&start, &[], &[vec![]]), Err(SimError::Shape(_))));
}
