//! The von Mises return mapping on the Hencky strain, and its adjoint.
//!
//! Trial strains `ln s_i` come in, elastic strains after plastic flow go out: a radial return in the
//! deviatoric plane (PlasticineLab, Huang et al. 2021, appendix; Gao et al. 2017). Lanes throughout.
//!
//! With `t` the trial strain of one particle (three numbers), floored at ln 0.05:
//!
//! ```text
//! e_i   = max(t_i, ln 0.05)
//! m     = (e_1 + e_2 + e_3) / 3                     the mean: a change of volume
//! d_i   = e_i - m                                   the deviator: a change of shape
//! n     = sqrt(d . d + 1e-8)                        softened, so that its derivative exists at d = 0
//! e_Y   = sigma_Y / (2 mu)
//! n > e_Y:  e_new = m + (e_Y / n) d                 plastic: back to the yield surface, at the same volume
//! else:     e_new = t                               elastic
//! ```
//!
//! The plastic branch flows by `e_new - t = ((e_Y - n) / n) d`, which is computed like this and not as a
//! difference of the two: it is what F is multiplied by.
//!
//! Adjoint of the plastic branch, with s the adjoint of e_new and `r = e_Y / n`:
//!
//! ```text
//! d_adj = r s - r (s . d) / n^2 d                   the factor, and the norm in it
//! m_adj = s_1 + s_2 + s_3
//! t_adj = d_adj + (m_adj - (d_adj_1 + d_adj_2 + d_adj_3)) / 3,   0 below the floor
//! ```

use super::lanes::{Lanes, Real};
use super::params::Params;

/// Singular values are floored at this before the logarithm.
pub const STRETCH_MIN: f64 = 0.05;
/// Softening of the deviatoric norm.
const NORM_EPS: f64 = 1e-8;

/// Result of the return mapping of sixteen particles.
#[derive(Clone, Copy)]
pub struct Return<L: Lanes> {
    /// Elastic strains after the return.
    pub strain: [L; 3],
    /// What the return has added to the trial strains, without the rounding of the sums.
    pub flow: [L; 3],
    /// Where the trial state was outside the yield surface.
    pub yields: L::Mask,
    /// Factor by which the deviator shrinks (1 where elastic).
    pub ratio: L,
    /// Deviator of the floored trial strain.
    deviator: [L; 3],
    /// Its softened norm.
    norm: L,
    /// Where the trial strain is above the floor.
    pub above: [L::Mask; 3],
}

/// Maps trial strains back to the yield surface. Where the state is elastic they come out unchanged, even
/// below the floor.
#[inline(always)]
pub fn return_map<L: Lanes>(params: &Params, trial: &[L; 3]) -> Return<L> {
    let floor = L::constant(STRETCH_MIN.ln());
    let above = [trial[0].gt(floor), trial[1].gt(floor), trial[2].gt(floor)];
    let e = [trial[0].max(floor), trial[1].max(floor), trial[2].max(floor)];
    let mean = (e[0] + e[1] + e[2]) * L::constant(1.0 / 3.0);
    let d = [e[0] - mean, e[1] - mean, e[2] - mean];
    let n2 = d[0].mul_add(d[0], d[1].mul_add(d[1], d[2].mul_add(d[2], L::constant(NORM_EPS))));
    let norm = n2.sqrt();
    let limit = L::splat(L::Real::from_f64(params.yield_strain()));
    let yields = norm.gt(limit);
    let one = L::constant(1.0);
    let inverse_norm = one.div(norm);
    let ratio = L::select(yields, limit * inverse_norm, one);
    let shrink = (limit - norm) * inverse_norm;
    let (mut strain, mut flow) = (*trial, *trial);
    for i in 0..3 {
        // Below the floor the strain is raised to it as well.
        flow[i] = L::select(yields, shrink.mul_add(d[i], e[i] - trial[i]), L::constant(0.0));
        strain[i] = trial[i] + flow[i];
    }
    Return { strain, flow, yields, ratio, deviator: d, norm, above }
}

/// Adjoint of [`return_map`]. On the yield surface itself the elastic side is taken.
#[inline(always)]
pub fn return_map_adj<L: Lanes>(ret: &Return<L>, strain_adj: &[L; 3]) -> [L; 3] {
    let zero = L::constant(0.0);
    let third = L::constant(1.0 / 3.0);
    let s = strain_adj;
    let ratio_adj = s[0].mul_add(ret.deviator[0], s[1].mul_add(ret.deviator[1], s[2] * ret.deviator[2]));
    // ratio = limit / norm, norm = sqrt(d.d + eps)
    let per_deviator = -(ratio_adj * ret.ratio).div(ret.norm * ret.norm);
    let mut d_adj = *s;
    for i in 0..3 {
        d_adj[i] = per_deviator.mul_add(ret.deviator[i], ret.ratio * s[i]);
    }
    let spread = ((s[0] + s[1] + s[2]) - (d_adj[0] + d_adj[1] + d_adj[2])) * third;
    let mut trial_adj = *s;
    for i in 0..3 {
        let flowing = L::select(ret.above[i], d_adj[i] + spread, zero);
        trial_adj[i] = L::select(ret.yields, flowing, s[i]);
    }
    trial_adj
}
