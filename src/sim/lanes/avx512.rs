//! Sixteen f32 as one 512-bit vector, masks in mask registers.
//!
//! Every operation rounds as IEEE 754 says, and sums are taken in the order of [`super::avx2`]: so the two
//! levels give the same bits. Imports the traits only.

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Neg, Sub};

use super::{Kernel, LANES, Lanes, Real};

/// Whether this machine has all that [`run`] switches on: what every AVX-512 processor since 2017 has
/// (x86-64-v4).
pub fn is_available() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512cd")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
}

/// Runs a kernel with AVX-512, AVX2 and FMA switched on.
///
/// The vectors below need AVX-512 F alone; the rest is for the compiler, which makes plain arrays of f64
/// into vectors.
#[target_feature(enable = "avx512f,avx512bw,avx512cd,avx512dq,avx512vl,avx2,fma")]
pub fn run<T: Real, L: Lanes<Real = T>, K: Kernel<T>>(kernel: K) -> K::Output {
    kernel.run::<L>()
}

/// Sixteen lanes in one register.
///
/// Only code reached through [`run`] makes one: that is why the `unsafe` blocks below are sound.
#[derive(Clone, Copy, Debug)]
pub struct F32x16(__m512);

macro_rules! op {
    ($f:ident, $($x:expr),+) => {
        // SAFETY: AVX-512 F is on wherever an `F32x16` exists (see its documentation).
        unsafe { F32x16($f($($x.0),+)) }
    };
}

/// The floats' bits, for operations that AVX-512 F has for integers only.
macro_rules! bitwise {
    ($f:expr, $($x:expr),+) => {
        // SAFETY: see `F32x16`.
        unsafe { F32x16(_mm512_castsi512_ps($f($(_mm512_castps_si512($x.0)),+))) }
    };
}

impl Add for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        op!(_mm512_add_ps, self, b)
    }
}
impl Sub for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        op!(_mm512_sub_ps, self, b)
    }
}
impl Mul for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        op!(_mm512_mul_ps, self, b)
    }
}
impl Neg for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        bitwise!(_mm512_xor_si512, self, Self::splat(-0.0))
    }
}

impl Lanes for F32x16 {
    type Real = f32;
    type Mask = __mmask16;

    #[inline(always)]
    fn splat(v: f32) -> Self {
        // SAFETY: see `F32x16`.
        unsafe { Self(_mm512_set1_ps(v)) }
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let from = &from[..LANES];
        // SAFETY: the slice holds 16 numbers; the load needs no alignment.
        unsafe { Self(_mm512_loadu_ps(from.as_ptr())) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to = &mut to[..LANES];
        // SAFETY: the slice holds 16 numbers; the store needs no alignment.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        op!(_mm512_fmadd_ps, self, b, c)
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        op!(_mm512_div_ps, self, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        op!(_mm512_sqrt_ps, self)
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        op!(_mm512_max_ps, self, b)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        op!(_mm512_min_ps, self, b)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        bitwise!(_mm512_andnot_si512, Self::splat(-0.0), self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
        // SAFETY: see `F32x16`.
        unsafe { Self(_mm512_roundscale_ps::<DOWN>(self.0)) }
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        // 0xca is "where the first has a one the second, else the third".
        bitwise!(_mm512_ternarylogic_epi32::<0xca>, Self::splat(-0.0), sign, self)
    }
    #[inline(always)]
    fn gt(self, b: Self) -> __mmask16 {
        // SAFETY: see `F32x16`.
        unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, b.0) }
    }
    #[inline(always)]
    fn select(mask: __mmask16, a: Self, b: Self) -> Self {
        // SAFETY: see `F32x16`.
        unsafe { Self(_mm512_mask_blend_ps(mask, b.0, a.0)) }
    }
    #[inline(always)]
    fn and(a: __mmask16, b: __mmask16) -> __mmask16 {
        // SAFETY: see `F32x16`.
        unsafe { _mm512_kand(a, b) }
    }
    #[inline(always)]
    fn bits(mask: __mmask16) -> u16 {
        mask
    }
    #[inline(always)]
    fn exp2i(self) -> Self {
        // SAFETY: see `F32x16`.
        unsafe {
            let biased = _mm512_add_epi32(_mm512_cvtps_epi32(self.0), _mm512_set1_epi32(127));
            Self(_mm512_castsi512_ps(_mm512_slli_epi32::<23>(biased)))
        }
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        // SAFETY: see `F32x16`.
        let (e, m) = unsafe {
            let bits = _mm512_castps_si512(self.0);
            let e = _mm512_sub_epi32(_mm512_srli_epi32::<23>(bits), _mm512_set1_epi32(126));
            let m = _mm512_or_si512(
                _mm512_and_si512(bits, _mm512_set1_epi32(0x007f_ffff)),
                _mm512_set1_epi32(126 << 23),
            );
            (Self(_mm512_cvtepi32_ps(e)), Self(_mm512_castsi512_ps(m)))
        };
        // The mantissa is in [0.5, 1); move the lower part up, so that it is centred on 1.
        let low = Self::splat(std::f32::consts::FRAC_1_SQRT_2).gt(m);
        (Self::select(low, e - Self::splat(1.0), e), Self::select(low, m + m, m))
    }
    #[inline(always)]
    fn repeat4(q: &[f32]) -> Self {
        let q = &q[..4];
        // SAFETY: the slice holds 4 numbers; the load needs no alignment.
        unsafe { Self(_mm512_broadcast_f32x4(_mm_loadu_ps(q.as_ptr()))) }
    }
    #[inline(always)]
    fn spread4(q: &[f32]) -> Self {
        // SAFETY: see `F32x16`.
        unsafe {
            let node = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
            Self(_mm512_permutevar_ps(Self::repeat4(q).0, node))
        }
    }
    #[inline(always)]
    fn sum_nodes(a: Self, b: Self, c: Self, d: Self) -> Self {
        // SAFETY: see `F32x16`.
        unsafe {
            // Nodes 0 + 2 and 1 + 3 of x, then of y.
            let pair = |x: Self, y: Self| {
                _mm512_add_ps(
                    _mm512_shuffle_f32x4::<0b_01_00_01_00>(x.0, y.0),
                    _mm512_shuffle_f32x4::<0b_11_10_11_10>(x.0, y.0),
                )
            };
            let (ab, cd) = (pair(a, b), pair(c, d));
            Self(_mm512_add_ps(
                _mm512_shuffle_f32x4::<0b_10_00_10_00>(ab, cd),
                _mm512_shuffle_f32x4::<0b_11_01_11_01>(ab, cd),
            ))
        }
    }
    #[inline(always)]
    fn sum_components(self) -> Self {
        // SAFETY: see `F32x16`.
        unsafe {
            let pairs = _mm512_add_ps(self.0, _mm512_permute_ps::<0b10_11_00_01>(self.0));
            Self(_mm512_add_ps(pairs, _mm512_permute_ps::<0b01_00_11_10>(pairs)))
        }
    }
    /// Four steps, of which the first two work within quarters (four lanes) and the others move quarters.
    #[inline(always)]
    fn transpose(m: &mut [Self; LANES]) {
        // SAFETY: see `F32x16`.
        unsafe {
            // After it, quarter q of t[4 g + c] is column 4 q + c of rows 4 g to 4 g + 3.
            let mut t = *m;
            for g in 0..4 {
                let [r0, r1, r2, r3] = [m[4 * g].0, m[4 * g + 1].0, m[4 * g + 2].0, m[4 * g + 3].0];
                let (low01, high01) = (_mm512_unpacklo_ps(r0, r1), _mm512_unpackhi_ps(r0, r1));
                let (low23, high23) = (_mm512_unpacklo_ps(r2, r3), _mm512_unpackhi_ps(r2, r3));
                t[4 * g] = Self(_mm512_shuffle_ps::<0x44>(low01, low23));
                t[4 * g + 1] = Self(_mm512_shuffle_ps::<0xee>(low01, low23));
                t[4 * g + 2] = Self(_mm512_shuffle_ps::<0x44>(high01, high23));
                t[4 * g + 3] = Self(_mm512_shuffle_ps::<0xee>(high01, high23));
            }
            // The same with quarters in place of lanes.
            for c in 0..4 {
                let [g0, g1, g2, g3] = [t[c].0, t[4 + c].0, t[8 + c].0, t[12 + c].0];
                let even = |x, y| _mm512_shuffle_f32x4::<0b_10_00_10_00>(x, y);
                let odd = |x, y| _mm512_shuffle_f32x4::<0b_11_01_11_01>(x, y);
                let (even01, odd01) = (even(g0, g1), odd(g0, g1));
                let (even23, odd23) = (even(g2, g3), odd(g2, g3));
                m[c] = Self(even(even01, even23));
                m[4 + c] = Self(even(odd01, odd23));
                m[8 + c] = Self(odd(even01, even23));
                m[12 + c] = Self(odd(odd01, odd23));
            }
        }
    }
}
