//! The eigen-decomposition of the left Cauchy-Green tensor, and what goes back through it.
//!
//! Stress and return mapping of an isotropic material are functions of b = F F^T alone, so no SVD of F is
//! needed: F's left singular vectors are b's eigenvectors, its singular values the square roots of b's
//! eigenvalues. Lanes in, lanes out; imports lanes.

use super::lanes::{Lanes, M3, congruence, identity, ln, mul_t, t_mul};

/// Eigen-decomposition of b = F F^T, sixteen at once.
#[derive(Clone, Copy)]
pub struct Spectrum<L> {
    /// Eigenvectors as columns: F's left singular vectors.
    pub u: M3<L>,
    /// `U^T F`: row i has length s_i, the singular value of F.
    pub turned: M3<L>,
    /// Singular values s_i.
    pub stretch: [L; 3],
    /// Hencky strains `ln s_i`.
    pub log: [L; 3],
}

/// Sweeps of cyclic Jacobi rotations; each squares the off-diagonal part.
const SWEEPS: (usize, usize) = (3, 7);
/// Smallest eigenvalue that is told from zero.
const EIGENVALUE_MIN: f64 = 1e-30;

/// The eigenvectors of `f f^T` as columns, a rotation, by cyclic Jacobi rotations (Golub and Van Loan,
/// section 8.5).
#[inline(always)]
pub fn eigenvectors<L: Lanes>(f: &M3<L>) -> M3<L> {
    let mut a = mul_t(f, f);
    let mut u = identity::<L>();
    let sweeps = if size_of::<L::Real>() == 4 { SWEEPS.0 } else { SWEEPS.1 };
    for _ in 0..sweeps {
        rotate(&mut a, &mut u, 0, 1, 2);
        rotate(&mut a, &mut u, 0, 2, 1);
        rotate(&mut a, &mut u, 1, 2, 0);
    }
    u
}

/// The spectrum of `f f^T`, given its eigenvectors. The eigenvalues are the squared lengths of the rows of `U^T F`
/// (Rayleigh quotients), so an error of the eigenvectors enters them squared.
#[inline(always)]
pub fn spectrum<L: Lanes>(f: &M3<L>, u: M3<L>) -> Spectrum<L> {
    let half = L::constant(0.5);
    let turned = t_mul(&u, f);
    let (mut stretch, mut log) = (turned[0], turned[0]);
    for (i, r) in turned.iter().enumerate() {
        let eigenvalue = r[0].mul_add(r[0], r[1].mul_add(r[1], r[2] * r[2])).max(L::constant(EIGENVALUE_MIN));
        stretch[i] = eigenvalue.sqrt();
        log[i] = half * ln(eigenvalue);
    }
    Spectrum { u, turned, stretch, log }
}

/// One Jacobi rotation that zeroes entry (p, q), p < q, of the symmetric `a`; `r` is the third index. Only
/// the upper triangle of `a` is kept.
#[inline(always)]
fn rotate<L: Lanes>(a: &mut M3<L>, u: &mut M3<L>, p: usize, q: usize, r: usize) {
    let d = a[q][q] - a[p][p];
    let o = a[p][q] + a[p][q];
    // The smaller angle has (cos, sin) in the direction of (|d| + h, sign(d) o), h = sqrt(d^2 + o^2); the
    // tiny term keeps 0/0 away.
    let h = d.mul_add(d, o.mul_add(o, L::constant(1e-36))).sqrt();
    let w = d.abs() + h;
    let n = L::constant(1.0).div(w.mul_add(w, o * o).sqrt());
    let c = w * n;
    let s = o * n.copysign(d);
    let minus_s = -s;
    // tan a_pq = h sin^2, written without a quotient.
    let shift = (h * s) * (o * n);
    a[p][p] = a[p][p] - shift;
    a[q][q] = a[q][q] + shift;
    a[p][q] = L::constant(0.0);
    let (pr, qr) = ((p.min(r), p.max(r)), (q.min(r), q.max(r)));
    let (x, y) = (a[pr.0][pr.1], a[qr.0][qr.1]);
    a[pr.0][pr.1] = c.mul_add(x, minus_s * y);
    a[qr.0][qr.1] = s.mul_add(x, c * y);
    for row in u.iter_mut() {
        let (x, y) = (row[p], row[q]);
        row[p] = c.mul_add(x, minus_s * y);
        row[q] = s.mul_add(x, c * y);
    }
}

/// `U diag(d) U^T`.
#[inline(always)]
pub fn compose<L: Lanes>(spectrum: &Spectrum<L>, d: &[L; 3]) -> M3<L> {
    congruence(&spectrum.u, d)
}
