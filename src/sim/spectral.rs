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
/// Loan, section 8.5).
#[inline(always)]
pub fn eigenvectors<L: Lanes>(h: &M3<L>) -> M3<L> {
    let mut a = strain(h);
    let mut u = identity::<L>();
    let sweeps = if size_of::<L::Real>() == 4 { SWEEPS.0 } else { SWEEPS.1 };
    for _ in 0..sweeps {
        rotate(&mut a, &mut u, 0, 1, 2);
        rotate(&mut a, &mut u, 0, 2, 1);
        rotate(&mut a, &mut u, 1, 2, 0);
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
