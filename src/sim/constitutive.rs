//! From velocity gradient and deformation to the next deformation and the stress, and back.
//!
//! The one place where elasticity and plasticity meet: trial deformation, return mapping, Kirchhoff
//! stress, each an isotropic function of the trial's b = F F^T. No SVD: F_new = K F_trial with
//! `K = U diag(q_i / s_i) U^T`. Derivatives of the isotropic maps are divided differences in closed form,
//! right also where stretches coincide (as they do at every start, F = I). Lanes throughout.
//!
//! ```text
//! F     = (I + dt C) F_old                          trial (MLS-MPM)
//! b     = F F^T = U diag(s^2) U^T                   spectral
//! e     = return_map(ln s)                          plasticity; q = exp(e), the elastic stretches
//! F_new = K F,  K = U diag(q / s) U^T               K is I where nothing flows
//! tau   = U diag(tau_1, tau_2, tau_3) U^T           elasticity, of q
//! ```
//!
//! That F_new has the singular values q and tau is the stress of F_new is seen with `F = U diag(s) W^T`:
//! `K F = U diag(q) W^T`.
//!
//! *The adjoint*, with A = dL/dF_new and T = dL/dtau; K_adj and T stand for their symmetric parts in the basis U:
//!
//! ```text
//! K_adj      = A F^T
//! e_adj_i    = sum_k (d tau_k / d e_i) T_kk + K_adj_ii q_i / s_i [yields]
//! (ln s)_adj = return_map_adj(e_adj) - K_adj_ii q_i / s_i [yields]
//! b_adj_ii   = (ln s)_adj_i / (2 s_i^2)
//! b_adj_ij   = K[i,j] K_adj_ij + tau[i,j] T_ij          divided differences, see below
//! F_adj      = K^T A + 2 b_adj F
//! C_adj      = dt F_adj F_old^T,   F_old_adj = (I + dt C)^T F_adj
//! ```
//!
//! where `g[i,j] = (g_i - g_j) / (s_i^2 - s_j^2)`. With `D = ln s_i - ln s_j`, `s_i^2 - s_j^2 = 2 s_i s_j sinh D`, and with
//! rho the slope of the return mapping, `e_i - e_j = rho D`:
//!
//! ```text
//! q[i,j]   = sqrt(q_i q_j) rho sinhc(rho D / 2) / (2 s_i s_j sinhc D)          sinhc x = sinh(x) / x
//! K[i,j]   = sqrt(K_i K_j) (rho - 1) sinhc((rho - 1) D / 2) / (2 s_i s_j sinhc D)
//! tau[i,j] = 2 mu q[i,j] (q_i + q_j - 1)
//! ```
//!
//! None of these divides by D: at D = 0, F = I above all, they are as accurate as anywhere. An adjoint of the singular
//! vectors would divide by it; clamping the divisor, as is often done, gives finite but wrong gradients.
//!
//! A deformation gradient F = I + H is given by its displacement gradient H, and K by K - I: dough yields at strains
//! of a few hundredths, and what one substep adds is smaller by another two orders. Stored with the 1, each
//! step would lose those digits; U with its rounding would not even leave an F alone that hardly flows.

use super::elasticity::{self, Principal, stress, stress_adj};
use super::lanes::{Lanes, M3, det, exp_m1, mul, mul_t, sinhc, t_mul};
use super::params::Params;
use super::plasticity::{Return, return_map, return_map_adj};
use super::spectral::{Spectrum, compose, spectrum};

/// What the constitutive update found for sixteen particles.
pub struct Update<L: Lanes> {
    /// Displacement gradient of the trial, `(I + dt C) F - I`.
    pub h_trial: M3<L>,
    /// .. after plastic flow.
    pub h_new: M3<L>,
    /// Kirchhoff stress, Pa.
    pub tau: M3<L>,
    /// Eigen-decomposition of the trial's F F^T.
    pub spectrum: Spectrum<L>,
    ret: Return<L>,
    principal: Principal<L>,
    /// Eigenvalues of K - I: K is what plastic flow multiplies each stretch by.
    flow: [L; 3],
}

/// Index pairs of the off-diagonal entries.
const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// `(I + dt C) F - I = H + dt (C + C H)`.
#[inline(always)]
pub fn trial<L: Lanes>(dt: f64, c: &M3<L>, h: &M3<L>) -> M3<L> {
    let dt = L::constant(dt);
    let ch = mul(c, h);
    let mut out = *h;
    for i in 0..3 {
        for j in 0..3 {
            out[i][j] = dt.mul_add(c[i][j] + ch[i][j], h[i][j]);
        }
    }
    out
}

/// `m F^T` for F = I + H.
#[inline(always)]
fn mul_f_t<L: Lanes>(m: &M3<L>, h: &M3<L>) -> M3<L> {
    let mut out = mul_t(m, h);
    for i in 0..3 {
        for j in 0..3 {
            out[i][j] = out[i][j] + m[i][j];
        }
    }
    out
}

/// Adjoint of [`trial`]: adjoints of C and F.
#[inline(always)]
pub fn trial_adj<L: Lanes>(dt: f64, c: &M3<L>, h: &M3<L>, trial_adj: &M3<L>) -> (M3<L>, M3<L>) {
    let dt = L::constant(dt);
    let (mut c_adj, ctf) = (mul_f_t(trial_adj, h), t_mul(c, trial_adj));
    let mut f_adj = *trial_adj;
    for i in 0..3 {
        for j in 0..3 {
            c_adj[i][j] = dt * c_adj[i][j];
            f_adj[i][j] = dt.mul_add(ctf[i][j], trial_adj[i][j]);
        }
    }
    (c_adj, f_adj)
}

/// Return mapping and stress of a trial deformation, given the eigenvectors of its F F^T.
#[inline(always)]
pub fn update<L: Lanes>(params: &Params, h_trial: M3<L>, u: M3<L>) -> Update<L> {
    let spectrum = spectrum(&h_trial, u);
    let ret = return_map(params, &spectrum.log);
    let mut flow = [L::constant(0.0); 3];
    let mut h_new = h_trial;
    let mut elongation = spectrum.elongation;
    if L::bits(ret.yields) != 0 {
        let mut scaled = spectrum.turned;
        for i in 0..3 {
            // Exactly zero where nothing flows.
            flow[i] = exp_m1(ret.flow[i]);
            elongation[i] = elongation[i].mul_add(flow[i], elongation[i] + flow[i]);
            for entry in &mut scaled[i] {
                *entry = flow[i] * *entry;
            }
        }
        // F_new - I = H + (K - I) F = H + U diag(flow) U^T F
        let flowed = mul(&u, &scaled);
        for i in 0..3 {
            for j in 0..3 {
                h_new[i][j] = h_trial[i][j] + flowed[i][j];
            }
        }
    }
    let principal = stress(params, elongation);
    let tau = compose(&spectrum, &principal.stress);
    Update { h_trial, h_new, tau, spectrum, ret, principal, flow }
}

/// Lanes whose deformation has turned inside out.
#[inline(always)]
pub fn inverted<L: Lanes>(h_trial: &M3<L>) -> u16 {
    let mut f = *h_trial;
    for (i, row) in f.iter_mut().enumerate() {
        row[i] = row[i] + L::constant(1.0);
    }
    !L::bits(det(&f).gt(L::constant(0.0)))
}

/// Adjoint of [`update`]: from the adjoints of the new deformation and of the stress to that of the trial.
///
/// All is done in the eigenbasis, with `F' = U^T F_trial` and `G' = U^T F_new_adj`. The adjoint of an isotropic
/// function of b goes back through the divided differences of its eigenvalues (Daleckii and Krein; Higham,
/// Functions of Matrices, theorem 3.11).
#[inline(always)]
pub fn update_adj<L: Lanes>(params: &Params, up: &Update<L>, f_new_adj: &M3<L>, tau_adj: &M3<L>) -> M3<L> {
    let (zero, one) = (L::constant(0.0), L::constant(1.0));
    let (u, f) = (&up.spectrum.u, &up.spectrum.turned);
    let g = t_mul(u, f_new_adj);
    // The adjoints of K and tau, symmetric.
    let gf = mul_t(&g, f);
    let t_adj = to_eigenbasis(u, tau_adj);

    let mut strain_adj = stress_adj(params, &up.principal, &[t_adj[0][0], t_adj[1][1], t_adj[2][2]]);
    let mut flow_adj = [zero; 3];
    for i in 0..3 {
        flow_adj[i] = L::select(up.ret.yields, up.flow[i].mul_add(gf[i][i], gf[i][i]), zero);
        strain_adj[i] = strain_adj[i] + flow_adj[i];
    }
    let log_adj = return_map_adj(&up.ret, &strain_adj);

    let s = up.spectrum.stretch();
    let inverse_stretch = [one.div(s[0]), one.div(s[1]), one.div(s[2])];
    // Twice the adjoint of b, symmetric.
    let mut b_adj = gf;
    for i in 0..3 {
        // d ln s / d lambda = 1 / (2 s^2)
        b_adj[i][i] = (log_adj[i] - flow_adj[i]) * inverse_stretch[i] * inverse_stretch[i];
    }
    for (i, j) in PAIRS {
        let (flow, stretch) = differences(up, &inverse_stretch, i, j);
        let stress = elasticity::stress_difference(params, &up.principal, i, j, stretch);
        b_adj[i][j] = flow.mul_add(gf[i][j] + gf[j][i], (stress + stress) * t_adj[i][j]);
        b_adj[j][i] = b_adj[i][j];
    }

    // F_new = F + (K - I) F, b = F F^T. The first term does not pass through U, whose rounding would add up.
    let mut change = mul(&b_adj, f);
    for i in 0..3 {
        for j in 0..3 {
            change[i][j] = up.flow[i].mul_add(g[i][j], change[i][j]);
        }
    }
    let mut out = mul(u, &change);
    for i in 0..3 {
        for j in 0..3 {
            out[i][j] = f_new_adj[i][j] + out[i][j];
        }
    }
    out
}

/// `U^T sym(m) U`.
#[inline(always)]
fn to_eigenbasis<L: Lanes>(u: &M3<L>, m: &M3<L>) -> M3<L> {
    let half = L::constant(0.5);
    let mut sym = *m;
    for (i, j) in PAIRS {
        sym[i][j] = half * (m[i][j] + m[j][i]);
        sym[j][i] = sym[i][j];
    }
    t_mul(u, &mul(&sym, u))
}

/// Divided differences of K's eigenvalues and of the new stretches with respect to b's eigenvalues.
///
/// With D = ln s_i - ln s_j and rho the slope of the return mapping between the two strains,
/// `q_i - q_j = 2 sqrt(q_i q_j) sinh(rho D / 2)` and `s_i^2 - s_j^2 = 2 s_i s_j sinh D`; so for K with
/// rho - 1. Both quotients are smooth at D = 0 when written with sinh(x)/x. Where nothing yields, q = s.
#[inline(always)]
fn differences<L: Lanes>(up: &Update<L>, inverse_stretch: &[L; 3], i: usize, j: usize) -> (L, L) {
    let (one, half, zero) = (L::constant(1.0), L::constant(0.5), L::constant(0.0));
    let s = up.spectrum.stretch();
    if L::bits(up.ret.yields) == 0 {
        return (zero, one.div(s[i] + s[j]));
    }
    let d = up.spectrum.log[i] - up.spectrum.log[j];
    let rho = slope(up, i, j, d);
    let scale = half * (inverse_stretch[i] * inverse_stretch[j]).div(sinhc(d));
    let q = &up.principal.stretch;
    let half_d = half * d;
    let stretch = (q[i] * q[j]).sqrt() * scale * (rho * sinhc(rho * half_d));
    let rest = rho - one;
    let flow = ((one + up.flow[i]) * (one + up.flow[j])).sqrt() * scale * (rest * sinhc(rest * half_d));
    (L::select(up.ret.yields, flow, zero), stretch)
}

/// `(strain_i - strain_j) / (ln s_i - ln s_j)`: the return mapping's ratio, unless one of the two trial
/// stretches lies below the floor.
#[inline(always)]
fn slope<L: Lanes>(up: &Update<L>, i: usize, j: usize, d: L) -> L {
    let ret = &up.ret;
    if L::bits(L::and(ret.above[i], ret.above[j])) == u16::MAX {
        return ret.ratio;
    }
    let tiny = L::constant(1e-30);
    let safe = d.abs().max(tiny).copysign(d);
    let quotient = (ret.strain[i] - ret.strain[j]).div(safe);
    L::select(L::and(ret.above[i], ret.above[j]), ret.ratio, quotient)
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{Kernel, LANES, Real, SimdLevel};
    use super::super::particles::IDENTITY;
    use super::super::spectral::eigenvectors;
    use super::*;
    use crate::math::check::{Tolerance, directional_scaled};
    use crate::math::rng::{Pcg64, normal, seeded};

    /// Runs update, or its adjoint, on one deformation (9 numbers) in every lane.
    struct One<'a> {
        params: &'a Params,
        f: &'a [f64],
        /// Adjoints of F_new and tau (18 numbers).
        adj: Option<&'a [f64]>,
    }

    impl<T: Real> Kernel<T> for One<'_> {
        type Output = Vec<f64>;
        #[inline(always)]
        fn run<L: Lanes<Real = T>>(self) -> Vec<f64> {
            let m = |x: &[f64]| -> M3<L> {
                std::array::from_fn(|i| std::array::from_fn(|j| L::constant(x[3 * i + j])))
            };
            let less_identity: Vec<f64> = self.f.iter().zip(IDENTITY).map(|(f, one)| f - one).collect();
            let mut out = Vec::new();
            let mut push = |m: &M3<L>| {
                let mut lanes = [T::default(); LANES];
                for v in m.as_flattened() {
                    v.store(&mut lanes);
                    out.push(lanes[5].to_f64());
                }
            };
            let h = m(&less_identity);
            let [u] = eigenvectors(&[h]);
            let up = update(self.params, h, u);
            match self.adj {
                None => {
                    push(&up.h_new);
                    push(&up.tau);
                    out.iter_mut().zip(IDENTITY).for_each(|(f, one)| *f += one);
                }
                Some(adj) => push(&update_adj(self.params, &up, &m(adj), &m(&adj[9..]))),
            }
            out
        }
    }

    fn run<T: Real>(params: &Params, f: &[f64], adj: Option<&[f64]>) -> Vec<f64> {
        T::dispatch(SimdLevel::best(), One { params, f, adj })
    }

    /// `reach` scales the finite difference's step of 1e-6.
    fn check(rng: &mut Pcg64, params: &Params, f: &[f64], reach: f64) {
        // Stresses are thousands of pascals: scale them so that both outputs weigh alike.
        let scaled = |v: Vec<f64>| -> Vec<f64> {
            v.iter().enumerate().map(|(i, v)| if i < 9 { *v } else { v * 1e-3 }).collect()
        };
        directional_scaled(
            rng,
            f,
            &[reach; 9],
            |f| scaled(run::<f64>(params, f, None)),
            |f, y| run::<f64>(params, f, Some(&scaled(y.to_vec()))),
            Tolerance { relative: 2e-6, absolute: 2e-7 },
        );
    }

    fn near_identity(rng: &mut Pcg64, size: f64) -> Vec<f64> {
        let mut f = vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        f.iter_mut().for_each(|v| *v += size * normal(rng));
        f
    }

    #[test]
    fn adjoint_at_random_elastic_and_yielding_states() {
        let mut rng = seeded(1, "constitutive");
        for yield_stress in [50.0, 150.0, 1e9] {
            let params = Params { yield_stress, ..Params::default() };
            for size in [1e-4, 1e-2, 0.1, 0.2] {
                for _ in 0..10 {
                    let f = near_identity(&mut rng, size);
                    check(&mut rng, &params, &f, 1.0);
                }
            }
        }
    }

    #[test]
    fn adjoint_where_stretches_coincide() {
        let mut rng = seeded(2, "constitutive");
        for (yield_stress, reach) in [(0.1, 0.03), (150.0, 1.0), (1e9, 1.0)] {
            // At yield 0.1 the limit lies below the softening's 1e-4: even F = I yields, on a curve of
            // that radius, so the step must be far smaller.
            let params = Params { yield_stress, ..Params::default() };
            for f in [
                [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
                [0.8, 0.0, 0.0, 0.0, 0.8, 0.0, 0.0, 0.0, 0.8],
                [1.2, 0.0, 0.0, 0.0, 1.2, 0.0, 0.0, 0.0, 0.9],
                // A rotation by a quarter turn: U^T F is not near the identity.
                [0.0, -1.1, 0.0, 1.1, 0.0, 0.0, 0.0, 0.0, 1.0],
            ] {
                for _ in 0..5 {
                    check(&mut rng, &params, &f, reach);
                }
            }
        }
    }

    #[test]
    fn adjoint_close_to_the_yield_surface_on_both_sides() {
        let mut rng = seeded(3, "constitutive");
        let params = Params::default();
        // Pure deviator of norm sqrt(2) e; the surface is at norm^2 + 1e-8 = yield_strain^2.
        let e = ((params.yield_strain().powi(2) - 1e-8) / 2.0).sqrt();
        for offset in [1e-3, -1e-3, 1e-5, -1e-5_f64] {
            let s = e * (1.0 + offset);
            let f = [s.exp(), 0.0, 0.0, 0.0, (-s).exp(), 0.0, 0.0, 0.0, 1.0];
            // The step must not cross the surface, which is |offset| e away.
            check(&mut rng, &params, &f, (2e3 * offset.abs()).min(1.0));
        }
        // Exactly on it the derivative is one-sided; it must still be finite.
        let f = [e.exp(), 0.0, 0.0, 0.0, (-e).exp(), 0.0, 0.0, 0.0, 1.0];
        assert!(run::<f64>(&params, &f, Some(&[1.0; 18])).iter().all(|v| v.is_finite()));
    }

    #[test]
    fn adjoint_below_the_stretch_floor() {
        let mut rng = seeded(4, "constitutive");
        let params = Params::default();
        for f in [
            [0.03, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.1],
            [0.03, 0.001, 0.0, 0.0, 0.04, 0.0, 0.0, 0.0, 1.1],
        ] {
            for _ in 0..5 {
                check(&mut rng, &params, &f, 1.0);
            }
        }
    }

    #[test]
    fn plastic_flow_keeps_the_volume() {
        let mut rng = seeded(5, "constitutive");
        let params = Params::default();
        let det = |f: &[f64]| nalgebra::Matrix3::from_row_slice(f).determinant();
        for _ in 0..50 {
            let f = near_identity(&mut rng, 0.2);
            let out = run::<f64>(&params, &f, None);
            approx::assert_relative_eq!(det(&out[..9]), det(&f), max_relative = 1e-11);
        }
    }

    #[test]
    fn uniaxial_stretch_has_its_closed_form() {
        let params = Params { yield_stress: 1e9, ..Params::default() };
        let q: f64 = 1.1;
        let out = run::<f64>(&params, &[q, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], None);
        let pressure = params.lambda() * q * (q - 1.0);
        approx::assert_relative_eq!(
            out[9],
            2.0 * params.mu() * q * (q - 1.0) + pressure,
            max_relative = 1e-12
        );
        approx::assert_relative_eq!(out[13], pressure, max_relative = 1e-12);
    }

    #[test]
    fn single_precision_follows_double() {
        let mut rng = seeded(6, "constitutive");
        let params = Params::default();
        for _ in 0..20 {
            let f: Vec<f64> = near_identity(&mut rng, 0.1).iter().map(|v| f64::from(*v as f32)).collect();
            let (single, double) = (run::<f32>(&params, &f, None), run::<f64>(&params, &f, None));
            for i in 0..18 {
                let scale = if i < 9 { 1.0 } else { params.youngs_modulus };
                assert!((single[i] - double[i]).abs() < 3e-6 * scale, "{i}: {} {}", single[i], double[i]);
            }
        }
    }
}
