//! 3x3 matrices of lanes: sixteen matrices at once.
//!
//! Row-major arrays and the handful of products that the kernels need. Imports the traits only.

use super::Lanes;

/// Sixteen 3x3 matrices, `m[row][column]`.
pub type M3<L> = [[L; 3]; 3];

/// Every entry equal to `v`.
#[inline(always)]
pub fn splat_m3<L: Lanes>(v: f64) -> M3<L> {
    [[L::constant(v); 3]; 3]
}

/// The identity.
#[inline(always)]
pub fn identity<L: Lanes>() -> M3<L> {
    let (o, z) = (L::constant(1.0), L::constant(0.0));
    [[o, z, z], [z, o, z], [z, z, o]]
}

/// `a b`.
#[inline(always)]
pub fn mul<L: Lanes>(a: &M3<L>, b: &M3<L>) -> M3<L> {
    let mut r = *a;
    for i in 0..3 {
        for j in 0..3 {
            r[i][j] = a[i][2].mul_add(b[2][j], a[i][1].mul_add(b[1][j], a[i][0] * b[0][j]));
        }
    }
    r
}

/// `a^T b`.
#[inline(always)]
pub fn t_mul<L: Lanes>(a: &M3<L>, b: &M3<L>) -> M3<L> {
    let mut r = *a;
    for i in 0..3 {
        for j in 0..3 {
            r[i][j] = a[2][i].mul_add(b[2][j], a[1][i].mul_add(b[1][j], a[0][i] * b[0][j]));
        }
    }
    r
}

/// `a b^T`.
#[inline(always)]
pub fn mul_t<L: Lanes>(a: &M3<L>, b: &M3<L>) -> M3<L> {
    let mut r = *a;
    for i in 0..3 {
        for j in 0..3 {
            r[i][j] = a[i][2].mul_add(b[j][2], a[i][1].mul_add(b[j][1], a[i][0] * b[j][0]));
        }
    }
    r
}

/// Determinant.
#[inline(always)]
pub fn det<L: Lanes>(a: &M3<L>) -> L {
    a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0])
        + a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0])
}

/// `a diag(d) a^T`.
#[inline(always)]
pub fn congruence<L: Lanes>(a: &M3<L>, d: &[L; 3]) -> M3<L> {
    let mut ad = *a;
    for row in &mut ad {
        for (entry, s) in row.iter_mut().zip(d) {
            *entry = *entry * *s;
        }
    }
    mul_t(&ad, a)
}
