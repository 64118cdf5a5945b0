//! Letting the dough come to rest without a tool.
//!
//! A state comes in, the state after some free control steps goes out, with what happened in between.
//! Scores are taken of resting dough only: thrown dough can game the EMD. Imports sim.

use crate::math::cloud::{Point, norm};
use crate::sim::lanes::Real;
use crate::sim::{Options, Params, ParticleState, SimError, Simulator};

/// Control steps that are run at once.
const STRIDE: usize = 10;
/// Most control steps to wait.
const LIMIT: usize = 80;
/// Mean speed below which the dough is at rest, m/s: a hundredth of a cell in ten control steps.
const RESTING_SPEED: f64 = 0.01;

/// Runs free control steps until the dough rests; `at_least` of them in any case. The end state has no
/// velocity left. Returns it with the positions after each step.
///
/// # Errors
/// The simulator's, if the dough breaks down by itself.
pub fn settle<T: Real>(
    params: &Params,
    options: &Options,
    state: &ParticleState,
    at_least: usize,
) -> Result<(ParticleState, Vec<Vec<Point>>), SimError> {
    // Nothing is differentiated here: keep no substeps.
    let options = Options { memory_limit: 0, ..options.clone() };
    let mut sim = Simulator::<T>::new(params.clone(), Vec::new(), options);
    let mut state = state.clone();
    let mut frames = Vec::new();
    while frames.len() < LIMIT {
        sim.rollout(&state, &[], &vec![Vec::new(); STRIDE])?;
        frames.extend((1..=STRIDE).map(|s| sim.positions(s)));
        state = sim.state(STRIDE);
        if mean_speed(&state) < RESTING_SPEED && frames.len() >= at_least {
            break;
        }
    }
    state.v.fill([0.0; 3]);
    state.c.fill([0.0; 9]);
    Ok((state, frames))
}

/// Mean speed of the particles, m/s.
pub fn mean_speed(state: &ParticleState) -> f64 {
    state.v.iter().map(|v| norm(*v)).sum::<f64>() / state.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dropped_block_comes_to_rest_on_the_floor() {
        let params = Params::default();
        let x = (0..343)
            .map(|i| [i % 7, i / 7 % 7, i / 49].map(|k| f64::from(k) * 0.008))
            .map(|p| [0.47 + p[0], 0.05 + p[1], 0.47 + p[2]])
            .collect();
        let (state, frames) =
            settle::<f32>(&params, &Options::default(), &ParticleState::at_rest(x), 10).unwrap();
        assert!(frames.len() >= 10 && frames.len() <= LIMIT);
        let low = state.x.iter().map(|p| p[1]).fold(1.0, f64::min);
        // The floor acts up to three cells, 0.047; heavy dough sinks in, a light block hardly.
        assert!((0.035..0.05).contains(&low), "{low}");
        assert!(state.v.iter().all(|v| *v == [0.0; 3]));
    }
}
