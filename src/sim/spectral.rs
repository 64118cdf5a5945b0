//! The eigen-decomposition of the left Cauchy-Green tensor, and what goes back through it.
//!
//! Stress and return mapping of an isotropic material are functions of b = F F^T alone, so no SVD of F is
//! needed: F's left singular vectors are b's eigenvectors, its singular values the square roots of b's
//! eigenvalues. Lanes in, lanes out; imports lanes.
//!
//! ```text
//! b = F F^T = U diag(q^2) U^T,      ln q_i = ln(q_i^2) / 2
//! G(b) = U diag(g_1, g_2, g_3) U^T  an isotropic function: g_i depends on the eigenvalues of b alone
//! ```
//!
//! *Eigenvectors* come from cyclic Jacobi rotations (Golub and Van Loan, section 8.5): each turns one pair of axes so that
//! the entry between them vanishes, with `t = tan` of the angle the smaller root of
//! `t^2 + t (a_qq - a_pp) / a_pq - 1 = 0`. A sweep over the three pairs roughly squares what is left off the diagonal. It
//! has no branches, which suits lanes, and a U that is orthogonal to rounding also where eigenvalues coincide.
//!
//! Two things make it 2.4 times as fast without changing a bit of U. What is left off the diagonal soon has squares and
//! products below the smallest normal f32, each of which costs some processors a hundred cycles: so the matrix
//! is scaled by a power of two, and what is still too small counts as zero ([`SCALE`], [`NEGLIGIBLE`]). And a rotation
//! waits for two roots and a quotient, one after the other: another block's fill that time.
//!
//! *The derivative* of G (Daleckii and Krein), in the basis U, for a change `B` of b:
//!
//! ```text
//! dG_ii = sum_j (dg_i / d q_j^2) B_jj
//! dG_ij = (g_i - g_j) / (q_i^2 - q_j^2) B_ij      i /= j
//! ```
//!
//! U itself is not differentiated: where eigenvalues coincide it has no derivative, but the quotient has a limit, and
//! [`constitutive`](super::constitutive) writes it so that nothing cancels. The adjoint of a symmetric G
//! is the same with the roles of dG and B exchanged.

use super::lanes::{Lanes, M3, congruence, identity, ln_1p, mul, mul_t, t_mul};

/// Eigen-decomposition of b = F F^T, sixteen at once.
#[derive(Clone, Copy)]
pub struct Spectrum<L> {
    /// Eigenvectors as columns: F's left singular vectors.
    pub u: M3<L>,
    /// `U^T F`: row i has length s_i, the singular value of F.
    pub turned: M3<L>,
    /// Singular values less 1, `s_i - 1`.
    pub elongation: [L; 3],
    /// Hencky strains `ln s_i`.
    pub log: [L; 3],
}

impl<L: Lanes> Spectrum<L> {
    /// Singular values s_i.
    #[inline(always)]
    pub fn stretch(&self) -> [L; 3] {
        let (one, e) = (L::constant(1.0), &self.elongation);
        [one + e[0], one + e[1], one + e[2]]
    }
}

/// Sweeps of cyclic Jacobi rotations; each squares the off-diagonal part.
const SWEEPS: (usize, usize) = (3, 7);
/// What b - I is multiplied by for the rotations: a power of two, so that every rounding stays what it is. Squares
/// of its entries overflow for strains beyond 1e4; such a deformation is no number then, which the next substep reports.
const SCALE: f64 = (1u64 << 48) as f64;
/// Entry off the diagonal of b - I that counts as zero. Where strains differ by 1e-3 it would turn axes by 1e-21, and the last
/// digit of an axis in f32 is 6e-8.
const NEGLIGIBLE: f64 = 1e-24;
/// Added to the square of the difference of two eigenvalues, so that a quotient exists where they are equal.
const TINY: f64 = 1e-36;
/// Smallest eigenvalue of b - I: b's are positive, and told from zero.
const STRAIN_MIN: f64 = -1.0 + 1e-7;

/// `b - I = H + H^T + H H^T` with F = I + H. It has the eigenvectors of b, and strains of dough are a few hundredths,
/// of which b itself would have lost the last digits to the 1.
#[inline(always)]
fn strain<L: Lanes>(h: &M3<L>) -> M3<L> {
    let mut a = mul_t(h, h);
    for i in 0..3 {
        for j in i..3 {
            a[i][j] = a[i][j] + (h[i][j] + h[j][i]);
            a[j][i] = a[i][j];
        }
    }
    a
}

/// The eigenvectors of `b = F F^T`, F = I + H, as columns, a rotation, by cyclic Jacobi rotations (Golub and Van
/// Loan, section 8.5). N blocks go rotation by rotation together; none has a part in another's bits.
#[inline(always)]
pub fn eigenvectors<L: Lanes, const N: usize>(h: &[M3<L>; N]) -> [M3<L>; N] {
    let scale = L::constant(SCALE);
    let mut a = *h;
    for k in 0..N {
        a[k] = strain(&h[k]);
        for entry in a[k].iter_mut().flatten() {
            *entry = scale * *entry;
        }
    }
    let mut u = [identity::<L>(); N];
    let sweeps = if size_of::<L::Real>() == 4 { SWEEPS.0 } else { SWEEPS.1 };
    for sweep in 1..=sweeps {
        for k in 0..N {
            rotate(&mut a[k], &mut u[k], 0, 1, 2);
        }
        for k in 0..N {
            rotate(&mut a[k], &mut u[k], 0, 2, 1);
        }
        if sweep < sweeps {
            for k in 0..N {
                rotate(&mut a[k], &mut u[k], 1, 2, 0);
            }
        }
    }
    // Of the last rotation, nobody asks what it leaves of b.
    for k in 0..N {
        Rotation::zeroing(&a[k], 1, 2).turn_axes(&mut u[k], 1, 2);
    }
    u
}

/// The spectrum of `b = F F^T`, F = I + H, given its eigenvectors. The eigenvalues are the Rayleigh quotients of b - I,
/// so an error of the eigenvectors enters them squared.
#[inline(always)]
pub fn spectrum<L: Lanes>(h: &M3<L>, u: M3<L>) -> Spectrum<L> {
    let half = L::constant(0.5);
    let one = L::constant(1.0);
    let a = strain(h);
    let au = mul(&a, &u);
    let mut turned = t_mul(&u, h);
    let (mut elongation, mut log) = (turned[0], turned[0]);
    for i in 0..3 {
        let quotient = u[0][i].mul_add(au[0][i], u[1][i].mul_add(au[1][i], u[2][i] * au[2][i]));
        let quotient = quotient.max(L::constant(STRAIN_MIN));
        elongation[i] = quotient.div(one + (one + quotient).sqrt());
        log[i] = half * ln_1p(quotient);
        for j in 0..3 {
            turned[i][j] = turned[i][j] + u[j][i];
        }
    }
    Spectrum { u, turned, elongation, log }
}

/// A rotation of one pair of axes.
struct Rotation<L> {
    cos: L,
    sin: L,
    /// What the smaller diagonal entry loses to the larger one.
    shift: L,
}

impl<L: Lanes> Rotation<L> {
    /// The one that zeroes entry (p, q), p < q, of the symmetric, scaled `a`.
    #[inline(always)]
    fn zeroing(a: &M3<L>, p: usize, q: usize) -> Self {
        let d = a[q][q] - a[p][p];
        let o = a[p][q] + a[p][q];
        let o = L::select(o.abs().gt(L::constant(NEGLIGIBLE * SCALE)), o, L::constant(0.0));
        // The smaller angle has (cos, sin) in the direction of (|d| + h, sign(d) o), h = sqrt(d^2 + o^2); the
        // tiny term keeps 0/0 away.
        let h = d.mul_add(d, o.mul_add(o, L::constant(TINY * SCALE * SCALE))).sqrt();
        let w = d.abs() + h;
        let n = L::constant(1.0).div(w.mul_add(w, o * o).sqrt());
        let sin = o * n.copysign(d);
        // tan a_pq = h sin^2, written without a quotient.
        Self { cos: w * n, sin, shift: (h * sin) * (o * n) }
    }

    /// What becomes of two components along the pair of axes.
    #[inline(always)]
    fn turn(&self, x: L, y: L) -> (L, L) {
        (self.cos.mul_add(x, -self.sin * y), self.sin.mul_add(x, self.cos * y))
    }

    #[inline(always)]
    fn turn_axes(&self, u: &mut M3<L>, p: usize, q: usize) {
        for row in u.iter_mut() {
            (row[p], row[q]) = self.turn(row[p], row[q]);
        }
    }
}

/// One Jacobi rotation of `a` and the axes; `r` is the third index. Only the upper triangle of `a` is kept.
#[inline(always)]
fn rotate<L: Lanes>(a: &mut M3<L>, u: &mut M3<L>, p: usize, q: usize, r: usize) {
    let rotation = Rotation::zeroing(a, p, q);
    a[p][p] = a[p][p] - rotation.shift;
    a[q][q] = a[q][q] + rotation.shift;
    a[p][q] = L::constant(0.0);
    let (pr, qr) = ((p.min(r), p.max(r)), (q.min(r), q.max(r)));
    (a[pr.0][pr.1], a[qr.0][qr.1]) = rotation.turn(a[pr.0][pr.1], a[qr.0][qr.1]);
    rotation.turn_axes(u, p, q);
}

/// `U diag(d) U^T`.
#[inline(always)]
pub fn compose<L: Lanes>(spectrum: &Spectrum<L>, d: &[L; 3]) -> M3<L> {
    congruence(&spectrum.u, d)
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{Kernel, LANES, Real, SimdLevel, splat_m3};
    use super::*;
    use crate::math::rng::{normal, seeded};

    /// Eigenvectors of blocks of displacement gradients, by row: two blocks together, or one by one.
    struct Axes<'a> {
        h: &'a [[[f64; 9]; LANES]; 2],
        together: bool,
    }

    impl<T: Real> Kernel<T> for Axes<'_> {
        type Output = [[[f64; 9]; LANES]; 2];

        #[inline(always)]
        fn run<L: Lanes<Real = T>>(self) -> Self::Output {
            let mut h = [splat_m3::<L>(0.0); 2];
            for (h, from) in h.iter_mut().zip(self.h) {
                for (k, entry) in h.iter_mut().flatten().enumerate() {
                    let mut lanes = [T::default(); LANES];
                    for (to, from) in lanes.iter_mut().zip(from) {
                        *to = T::from_f64(from[k]);
                    }
                    *entry = L::load(&lanes);
                }
            }
            let u = if self.together {
                eigenvectors(&h)
            } else {
                let ([first], [second]) = (eigenvectors(&[h[0]]), eigenvectors(&[h[1]]));
                [first, second]
            };
            let mut out = [[[0.0; 9]; LANES]; 2];
            for (to, u) in out.iter_mut().zip(&u) {
                for (k, entry) in u.iter().flatten().enumerate() {
                    let mut lanes = [T::default(); LANES];
                    entry.store(&mut lanes);
                    for (to, from) in to.iter_mut().zip(lanes) {
                        to[k] = from.to_f64();
                    }
                }
            }
            out
        }
    }

    /// Largest entry of `U^T U - I`; and of `U^T (b - I) U` off the diagonal, beyond what [`TINY`] lets pass, as a
    /// share of the largest of b - I.
    fn errors(h: &[f64; 9], u: &[f64; 9]) -> (f64, f64) {
        let m = |v: &[f64; 9]| nalgebra::Matrix3::from_row_slice(v);
        let (h, u) = (m(h), m(u));
        let strain = h + h.transpose() + h * h.transpose();
        let mut left = u.transpose() * strain * u;
        left.fill_diagonal(0.0);
        let left = (left.abs().max() - TINY.sqrt()).max(0.0) / strain.abs().max().max(TINY);
        ((u.transpose() * u - nalgebra::Matrix3::identity()).abs().max(), left)
    }

    /// Strains from those of resting dough, and far below, to those of torn dough; some with zeros, equal stretches, or
    /// entries that are smaller than others by up to thirty digits.
    fn gradients() -> Vec<[[[f64; 9]; LANES]; 2]> {
        let mut rng = seeded(5, "spectral");
        let mut one = |size: f64, kind: usize| -> [f64; 9] {
            let mut h: [f64; 9] = std::array::from_fn(|_| size * normal(&mut rng));
            match kind {
                0 | 1 => {}
                2 => h = std::array::from_fn(|k| if k % 4 == 0 { size } else { 0.0 }),
                3 => h = std::array::from_fn(|k| if k == 1 { size } else { 0.0 }),
                _ => h.iter_mut().enumerate().for_each(|(k, h)| *h *= 10f64.powi(-((k * kind) as i32 % 31))),
            }
            h
        };
        [1e-20, 1e-12, 1e-7, 1e-3, 3e-2, 0.5, 30.0]
            .map(|size| std::array::from_fn(|_| std::array::from_fn(|lane| one(size, lane))))
            .to_vec()
    }

    #[test]
    fn axes_are_a_rotation_that_leaves_little_off_the_diagonal() {
        for h in gradients() {
            for level in SimdLevel::available() {
                for (u, bound) in [
                    (f32::dispatch(level, Axes { h: &h, together: true }), 1e-5),
                    (f64::dispatch(level, Axes { h: &h, together: true }), 1e-13),
                ] {
                    for (h, u) in h.iter().flatten().zip(u.iter().flatten()) {
                        let (skew, left) = errors(h, u);
                        assert!(skew < bound, "{level:?}: {u:?} is off a rotation by {skew:e}");
                        assert!(left < bound, "{level:?}: {left:e} of the strain of {h:?} is left");
                    }
                }
            }
        }
    }

    #[test]
    fn two_blocks_together_have_the_bits_of_one_by_one() {
        for h in gradients() {
            for level in SimdLevel::available() {
                let by = |together| f32::dispatch(level, Axes { h: &h, together });
                assert_eq!(by(true), by(false), "{level:?}");
            }
        }
    }
}
