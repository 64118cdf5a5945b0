//! Fixed corotated elasticity in principal stretches, and its adjoint.
//!
//! Elastic elongations come in, principal Kirchhoff stresses go out (Stomakhin et al. 2012):
//! `tau_i = 2 mu q_i (q_i - 1) + lambda J (J - 1)` with stretches `q_i` and `J` their product. Lanes
//! throughout.
//!
//! The fixed corotated model has the energy per undeformed volume, Pa,
//!
//! ```text
//! Psi(F) = mu sum_i (q_i - 1)^2 + lambda / 2 (J - 1)^2
//! ```
//!
//! with q_i the singular values of F. Its first Piola-Kirchhoff stress is
//! `P = dPsi/dF = 2 mu (F - R) + lambda (J - 1) J F^-T`, and the Kirchhoff stress that acts on the deformed dough is
//!
//! ```text
//! tau = P F^T = 2 mu (F - R) F^T + lambda J (J - 1) I
//! ```
//!
//! In the frame of F's left singular vectors `R F^T` is diag(q), which gives the tau_i above. As a function of the
//! Hencky strains `e_i = ln q_i`, with `dq_i = q_i de_i` and `dJ = J (de_1 + de_2 + de_3)`:
//!
//! ```text
//! d tau_i / d e_j = 2 mu q_i (2 q_i - 1) [i = j] + lambda J (2 J - 1)
//! ```
//!
//! Near q = 1 it is Hooke's law: tau = 2 mu e + lambda tr(e) I.

use super::lanes::{Lanes, Real};
use super::params::Params;

/// Principal stretches and stresses of sixteen particles.
#[derive(Clone, Copy)]
pub struct Principal<L> {
    /// Elastic stretches q_i.
    pub stretch: [L; 3],
    /// Their product J, less 1.
    growth: L,
    /// Kirchhoff stresses, Pa.
    pub stress: [L; 3],
}

/// Principal stresses from elastic elongations `e_i = q_i - 1`.
#[inline(always)]
pub fn stress<L: Lanes>(params: &Params, e: [L; 3]) -> Principal<L> {
    let one = L::constant(1.0);
    let two_mu = L::splat(L::Real::from_f64(2.0 * params.mu()));
    let lambda = L::splat(L::Real::from_f64(params.lambda()));
    // e and J - 1 without the 1, which would cost them their last digits.
    let area = e[0].mul_add(e[1], e[0] + e[1]);
    let growth = area.mul_add(e[2], area + e[2]);
    let pressure = lambda * (growth + one) * growth;
    let (mut q, mut tau) = (e, e);
    for i in 0..3 {
        q[i] = e[i] + one;
        tau[i] = (two_mu * q[i]).mul_add(e[i], pressure);
    }
    Principal { stretch: q, growth, stress: tau }
}

/// Adjoint of [`stress`]: adjoint of the strains `ln q_i`.
#[inline(always)]
pub fn stress_adj<L: Lanes>(params: &Params, p: &Principal<L>, stress_adj: &[L; 3]) -> [L; 3] {
    let one = L::constant(1.0);
    let two_mu = L::splat(L::Real::from_f64(2.0 * params.mu()));
    let lambda = L::splat(L::Real::from_f64(params.lambda()));
    let total = stress_adj[0] + stress_adj[1] + stress_adj[2];
    // d pressure / d ln J = lambda J (2 J - 1), and ln J is the sum of the strains.
    let volume = p.growth + one;
    let through_volume = total * lambda * volume * (volume + p.growth);
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
