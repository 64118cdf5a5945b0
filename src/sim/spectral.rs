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

use super::lanes::{Lanes, M3, congruence, identity, ln_1p, mul, mul_t};

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

/// The spectrum of `b = F F^T` with F = I + H, by cyclic Jacobi rotations (Golub and Van Loan, section 8.5) of
/// `b - I = H + H^T + H H^T`: b has the same eigenvectors, and strains of dough are a few hundredths, of which
/// b itself would have lost the last digits to the 1.
#[inline(always)]
pub fn spectrum<L: Lanes>(h: &M3<L>) -> Spectrum<L> {
    let mut a = mul_t(h, h);
    for i in 0..3 {
        for j in i..3 {
            a[i][j] = a[i][j] + (h[i][j] + h[j][i]);
        }
    }
    let mut u = identity::<L>();
    let sweeps = if size_of::<L::Real>() == 4 { SWEEPS.0 } else { SWEEPS.1 };
    for _ in 0..sweeps {
        rotate(&mut a, &mut u, 0, 1, 2);
        rotate(&mut a, &mut u, 0, 2, 1);
        rotate(&mut a, &mut u, 1, 2, 0);
    }
    let half = L::constant(0.5);
    let log = [half * ln_1p(a[0][0]), half * ln_1p(a[1][1]), half * ln_1p(a[2][2])];
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
