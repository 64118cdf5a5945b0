//! The eigen-decomposition of the left Cauchy-Green tensor, and what goes back through it.
//!
//! Stress and return mapping of an isotropic material are functions of b = F F^T alone, so no SVD of F is
//! needed: F's left singular vectors are b's eigenvectors, its singular values the square roots of b's
//! eigenvalues. Lanes in, lanes out; imports lanes.

use super::lanes::{Lanes, M3, congruence, identity, ln, mul, mul_t};

/// Eigen-decomposition of b = F F^T, sixteen at once.
#[derive(Clone, Copy)]
pub struct Spectrum<L> {
    /// Eigenvectors as columns: F's left singular vectors.
    pub u: M3<L>,
    /// Hencky strains `ln s_i`, s_i the singular values of F.
    pub log: [L; 3],
}

/// Sweeps of cyclic Jacobi rotations; each squares the off-diagonal part.
const SWEEPS: (usize, usize) = (4, 7);
/// Smallest eigenvalue that is told from zero.
const EIGENVALUE_MIN: f64 = 1e-30;

/// The spectrum of `f f^T`, by cyclic Jacobi rotations (Golub and Van Loan, section 8.5).
#[inline(always)]
pub fn spectrum<L: Lanes>(f: &M3<L>) -> Spectrum<L> {
    let mut a = mul_t(f, f);
    let mut u = identity::<L>();
    let sweeps = if size_of::<L::Real>() == 4 { SWEEPS.0 } else { SWEEPS.1 };
    for _ in 0..sweeps {
        rotate(&mut a, &mut u, 0, 1, 2);
        rotate(&mut a, &mut u, 0, 2, 1);
        rotate(&mut a, &mut u, 1, 2, 0);
    }
    let half = L::constant(0.5);
    let tiny = L::constant(EIGENVALUE_MIN);
    let log = [half * ln(a[0][0].max(tiny)), half * ln(a[1][1].max(tiny)), half * ln(a[2][2].max(tiny))];
    Spectrum { u, log }
}

/// One Jacobi rotation that zeroes entry (p, q), p < q, of the symmetric `a`; `r` is the third index. Only
/// the upper triangle of `a` is kept.
#[inline(always)]
fn rotate<L: Lanes>(a: &mut M3<L>, u: &mut M3<L>, p: usize, q: usize, r: usize) {
    let one = L::constant(1.0);
    let d = a[q][q] - a[p][p];
    let o = a[p][q] + a[p][q];
    // tan of the smaller angle: o / (d + sign(d) sqrt(d^2 + o^2)); the tiny term keeps 0/0 away.
    let root = d.mul_add(d, o.mul_add(o, L::constant(1e-36))).sqrt();
    let t = o.div(d + root.copysign(d));
    let c = one.div(t.mul_add(t, one).sqrt());
    let s = t * c;
    let shift = t * a[p][q];
    a[p][p] = a[p][p] - shift;
    a[q][q] = a[q][q] + shift;
    a[p][q] = L::constant(0.0);
    let (pr, qr) = ((p.min(r), p.max(r)), (q.min(r), q.max(r)));
    let (x, y) = (a[pr.0][pr.1], a[qr.0][qr.1]);
    a[pr.0][pr.1] = c * x - s * y;
    a[qr.0][qr.1] = s * x + c * y;
    for row in u.iter_mut() {
        let (x, y) = (row[p], row[q]);
        row[p] = c * x - s * y;
        row[q] = s * x + c * y;
    }
}

/// Adjoint of a spectral function of b: from the adjoints of the Hencky strains and the off-diagonal
/// entries in the eigenbasis (divided differences times the adjoint's entries, (0,1), (0,2), (1,2)) to
/// the adjoint of b, symmetric (Daleckii and Krein; Higham, Functions of Matrices, theorem 3.11).
#[inline(always)]
pub fn spectral_adj<L: Lanes>(
    spectrum: &Spectrum<L>,
    inverse_stretch: &[L; 3],
    log_adj: &[L; 3],
    off: &[L; 3],
) -> M3<L> {
    let half = L::constant(0.5);
    let mut m = identity::<L>();
    for i in 0..3 {
        // d ln s / d lambda = 1 / (2 s^2)
        m[i][i] = half * log_adj[i] * inverse_stretch[i] * inverse_stretch[i];
    }
    (m[0][1], m[1][0]) = (off[0], off[0]);
    (m[0][2], m[2][0]) = (off[1], off[1]);
    (m[1][2], m[2][1]) = (off[2], off[2]);
    mul_t(&mul(&spectrum.u, &m), &spectrum.u)
}

/// `U diag(d) U^T`.
#[inline(always)]
pub fn compose<L: Lanes>(spectrum: &Spectrum<L>, d: &[L; 3]) -> M3<L> {
    congruence(&spectrum.u, d)
}
