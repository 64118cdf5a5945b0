//! Fixed corotated elasticity in principal stretches, and its adjoint.
//!
//! Elastic stretches come in, principal Kirchhoff stresses go out (Stomakhin et al. 2012):
//! `tau_i = 2 mu q_i (q_i - 1) + lambda J (J - 1)` with stretches `q_i` and `J` their product. Lanes
//! throughout.

use super::lanes::{Lanes, Real};
use super::params::Params;

/// Principal stretches and stresses of sixteen particles.
#[derive(Clone, Copy)]
pub struct Principal<L> {
    /// Elastic stretches q_i.
    pub stretch: [L; 3],
    /// Their product J.
    volume: L,
    /// Kirchhoff stresses, Pa.
    pub stress: [L; 3],
}

/// Principal stresses from elastic stretches.
#[inline(always)]
pub fn stress<L: Lanes>(params: &Params, q: [L; 3]) -> Principal<L> {
    let one = L::constant(1.0);
    let two_mu = L::splat(L::Real::from_f64(2.0 * params.mu()));
    let lambda = L::splat(L::Real::from_f64(params.lambda()));
    let volume = q[0] * q[1] * q[2];
    let pressure = lambda * volume * (volume - one);
    let mut tau = q;
    for i in 0..3 {
        tau[i] = (two_mu * q[i]).mul_add(q[i] - one, pressure);
    }
    Principal { stretch: q, volume, stress: tau }
}

/// Adjoint of [`stress`]: adjoint of the strains `ln q_i`.
#[inline(always)]
pub fn stress_adj<L: Lanes>(params: &Params, p: &Principal<L>, stress_adj: &[L; 3]) -> [L; 3] {
    let one = L::constant(1.0);
    let two_mu = L::splat(L::Real::from_f64(2.0 * params.mu()));
    let lambda = L::splat(L::Real::from_f64(params.lambda()));
    let total = stress_adj[0] + stress_adj[1] + stress_adj[2];
    // d pressure / d ln J = lambda J (2 J - 1), and ln J is the sum of the strains.
    let through_volume = total * lambda * p.volume * (p.volume + p.volume - one);
    let mut strain_adj = *stress_adj;
    for i in 0..3 {
        let q = p.stretch[i];
        strain_adj[i] = (stress_adj[i] * two_mu * q).mul_add(q + q - one, through_volume);
    }
    strain_adj
}

/// Divided difference of the stretches, `(q_i - q_j) / (s_i^2 - s_j^2)`, turned into that of the stresses:
/// the pressure is common to both and drops out.
#[inline(always)]
pub fn stress_difference<L: Lanes>(params: &Params, p: &Principal<L>, i: usize, j: usize, stretch: L) -> L {
    let two_mu = L::splat(L::Real::from_f64(2.0 * params.mu()));
    two_mu * stretch * (p.stretch[i] + p.stretch[j] - L::constant(1.0))
}
