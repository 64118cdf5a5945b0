//! Sixteen f32 as two 256-bit vectors.
//!
//! Every operation rounds as IEEE 754 says (division and square root are not approximated), so that two
//! x86-64 machines give the same bits. Imports the traits only.

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Neg, Sub};

use super::{Kernel, LANES, Lanes, Real};

/// Whether this machine has all that [`run`] switches on.
pub fn is_available() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

/// Runs a kernel with AVX2 and FMA switched on.
#[target_feature(enable = "avx2,fma")]
pub fn run<T: Real, L: Lanes<Real = T>, K: Kernel<T>>(kernel: K) -> K::Output {
    kernel.run::<L>()
}

/// Lanes 0 to 7 and 8 to 15.
///
/// Only code reached through [`run`] makes one: that is why the `unsafe` blocks below are sound.
#[derive(Clone, Copy, Debug)]
pub struct F32x16(__m256, __m256);

macro_rules! both {
    ($f:ident, $($x:expr),+) => {
        // SAFETY: AVX2 and FMA are on wherever an `F32x16` exists (see its documentation).
        unsafe { F32x16($f($($x.0),+), $f($($x.1),+)) }
    };
}

impl Add for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        both!(_mm256_add_ps, self, b)
    }
}
impl Sub for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        both!(_mm256_sub_ps, self, b)
    }
}
impl Mul for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        both!(_mm256_mul_ps, self, b)
    }
}
impl Neg for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let sign = Self::splat(-0.0);
        both!(_mm256_xor_ps, self, sign)
    }
}

impl Lanes for F32x16 {
    type Real = f32;
    type Mask = F32x16;

    #[inline(always)]
    fn splat(v: f32) -> Self {
        // SAFETY: see `F32x16`.
        unsafe { Self(_mm256_set1_ps(v), _mm256_set1_ps(v)) }
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let from = &from[..LANES];
        // SAFETY: the slice holds 16 numbers; the loads need no alignment.
        unsafe { Self(_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from.as_ptr().add(8))) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to = &mut to[..LANES];
        // SAFETY: the slice holds 16 numbers; the stores need no alignment.
        unsafe {
            _mm256_storeu_ps(to.as_mut_ptr(), self.0);
            _mm256_storeu_ps(to.as_mut_ptr().add(8), self.1);
        }
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        both!(_mm256_fmadd_ps, self, b, c)
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        both!(_mm256_div_ps, self, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        both!(_mm256_sqrt_ps, self)
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        both!(_mm256_max_ps, self, b)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        both!(_mm256_min_ps, self, b)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let sign = Self::splat(-0.0);
        both!(_mm256_andnot_ps, sign, self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        both!(_mm256_floor_ps, self)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let bit = Self::splat(-0.0);
        let (magnitude, sign) = (both!(_mm256_andnot_ps, bit, self), both!(_mm256_and_ps, bit, sign));
        both!(_mm256_or_ps, magnitude, sign)
    }
    #[inline(always)]
    fn gt(self, b: Self) -> Self {
        // SAFETY: see `F32x16`.
        unsafe { Self(_mm256_cmp_ps::<_CMP_GT_OQ>(self.0, b.0), _mm256_cmp_ps::<_CMP_GT_OQ>(self.1, b.1)) }
    }
    #[inline(always)]
    fn select(mask: Self, a: Self, b: Self) -> Self {
        both!(_mm256_blendv_ps, b, a, mask)
    }
    #[inline(always)]
    fn and(a: Self, b: Self) -> Self {
        both!(_mm256_and_ps, a, b)
    }
    #[inline(always)]
    fn bits(mask: Self) -> u16 {
        // SAFETY: see `F32x16`.
        unsafe { (_mm256_movemask_ps(mask.0) | (_mm256_movemask_ps(mask.1) << 8)) as u16 }
    }
    #[inline(always)]
    fn exp2i(self) -> Self {
        // SAFETY: see `F32x16`.
        unsafe {
            let bias = _mm256_set1_epi32(127);
            let one = |n| {
                let biased = _mm256_add_epi32(_mm256_cvtps_epi32(n), bias);
                _mm256_castsi256_ps(_mm256_slli_epi32::<23>(biased))
            };
            Self(one(self.0), one(self.1))
        }
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        // SAFETY: see `F32x16`.
        let (e, m) = unsafe {
            let one = |v| {
                let bits = _mm256_castps_si256(v);
                let e = _mm256_sub_epi32(_mm256_srli_epi32::<23>(bits), _mm256_set1_epi32(126));
                let m = _mm256_or_si256(
                    _mm256_and_si256(bits, _mm256_set1_epi32(0x007f_ffff)),
                    _mm256_set1_epi32(126 << 23),
                );
                (_mm256_cvtepi32_ps(e), _mm256_castsi256_ps(m))
            };
            let ((e0, m0), (e1, m1)) = (one(self.0), one(self.1));
            (Self(e0, e1), Self(m0, m1))
        };
        // The mantissa is in [0.5, 1); move the lower part up, so that it is centred on 1.
        let low = Self::splat(std::f32::consts::FRAC_1_SQRT_2).gt(m);
        (Self::select(low, e - Self::splat(1.0), e), Self::select(low, m + m, m))
    }
    #[inline(always)]
    fn repeat4(q: &[f32]) -> Self {
        let q = &q[..4];
        // SAFETY: the slice holds 4 numbers; the load needs no alignment.
        unsafe {
            let v = _mm_loadu_ps(q.as_ptr());
            let v = _mm256_set_m128(v, v);
            Self(v, v)
        }
    }
    #[inline(always)]
    fn spread4(q: &[f32]) -> Self {
        let q = &q[..4];
        // SAFETY: the slice holds 4 numbers; the load needs no alignment.
        unsafe {
            let v = _mm_loadu_ps(q.as_ptr());
            let v = _mm256_set_m128(v, v);
            Self(
                _mm256_permutevar_ps(v, _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1)),
                _mm256_permutevar_ps(v, _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3)),
            )
        }
    }
    #[inline(always)]
    fn sum_nodes(a: Self, b: Self, c: Self, d: Self) -> Self {
        // SAFETY: see `F32x16`.
        unsafe {
            let pair = |x: Self, y: Self| {
                let (x, y) = (_mm256_add_ps(x.0, x.1), _mm256_add_ps(y.0, y.1));
                _mm256_add_ps(_mm256_permute2f128_ps::<0x20>(x, y), _mm256_permute2f128_ps::<0x31>(x, y))
            };
            Self(pair(a, b), pair(c, d))
        }
    }
    #[inline(always)]
    fn sum_components(self) -> Self {
        let pairs = self + both!(swap_neighbours, self);
        pairs + both!(swap_pairs, pairs)
    }
    #[inline(always)]
    fn transpose(m: &mut [Self; LANES]) {
        let mut quarter = [[Self::splat(0.0).0; 8]; 4];
        for i in 0..8 {
            quarter[0][i] = m[i].0;
            quarter[1][i] = m[i].1;
            quarter[2][i] = m[i + 8].0;
            quarter[3][i] = m[i + 8].1;
        }
        for q in &mut quarter {
            transpose8(q);
        }
        for i in 0..8 {
            m[i] = Self(quarter[0][i], quarter[2][i]);
            m[i + 8] = Self(quarter[1][i], quarter[3][i]);
        }
    }
}

/// Lanes 1 0 3 2 of each four.
#[inline(always)]
unsafe fn swap_neighbours(v: __m256) -> __m256 {
    // SAFETY: as for the caller, AVX is on.
    unsafe { _mm256_permute_ps::<0b10_11_00_01>(v) }
}

/// Lanes 2 3 0 1 of each four.
#[inline(always)]
unsafe fn swap_pairs(v: __m256) -> __m256 {
    // SAFETY: as for the caller, AVX is on.
    unsafe { _mm256_permute_ps::<0b01_00_11_10>(v) }
}

/// Asks for every cache line of `soon`.
#[inline(always)]
pub fn prefetch<T>(soon: &[T]) {
    let bytes = size_of_val(soon);
    for line in (0..bytes).step_by(64) {
        // SAFETY: a prefetch reads nothing that the program sees, and the address lies within the slice; SSE
        // is part of x86-64.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(soon.as_ptr().cast::<i8>().add(line)) };
    }
}

/// Transposes 8 vectors of 8 lanes: pairs, quadruples, halves.
#[inline(always)]
fn transpose8(r: &mut [__m256; 8]) {
    // SAFETY: reached from `Lanes::transpose` of `F32x16` only, where AVX2 is on.
    unsafe {
        let mut t = *r;
        for i in 0..4 {
            t[2 * i] = _mm256_unpacklo_ps(r[2 * i], r[2 * i + 1]);
            t[2 * i + 1] = _mm256_unpackhi_ps(r[2 * i], r[2 * i + 1]);
        }
        let mut s = t;
        for i in 0..2 {
            let (a, b, c, d) = (t[4 * i], t[4 * i + 1], t[4 * i + 2], t[4 * i + 3]);
            s[4 * i] = _mm256_shuffle_ps::<0x44>(a, c);
            s[4 * i + 1] = _mm256_shuffle_ps::<0xee>(a, c);
            s[4 * i + 2] = _mm256_shuffle_ps::<0x44>(b, d);
            s[4 * i + 3] = _mm256_shuffle_ps::<0xee>(b, d);
        }
        for i in 0..4 {
            r[i] = _mm256_permute2f128_ps::<0x20>(s[i], s[i + 4]);
            r[i + 4] = _mm256_permute2f128_ps::<0x31>(s[i], s[i + 4]);
        }
    }
}
