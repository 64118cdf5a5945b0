//! Sixteen f32 as four 128-bit vectors of aarch64, where every processor has them.
//!
//! Every operation rounds as IEEE 754 says, and sums are taken in the order of the x86-64 levels: so it
//! gives their bits. Imports the traits only.

use std::arch::aarch64::*;
use std::ops::{Add, Mul, Neg, Sub};

use super::{LANES, Lanes};

/// Lanes 0 to 3, 4 to 7, 8 to 11 and 12 to 15.
#[derive(Clone, Copy, Debug)]
pub struct F32x16([float32x4_t; 4]);

/// All ones in the lanes where it holds.
#[derive(Clone, Copy, Debug)]
pub struct Mask([uint32x4_t; 4]);

macro_rules! each {
    ($to:ident, $f:ident, $($x:expr),+) => {
        // SAFETY: this file is compiled only where NEON is on everywhere.
        unsafe { $to([$f($($x.0[0]),+), $f($($x.0[1]),+), $f($($x.0[2]),+), $f($($x.0[3]),+)]) }
    };
}

impl Add for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        each!(F32x16, vaddq_f32, self, b)
    }
}
impl Sub for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        each!(F32x16, vsubq_f32, self, b)
    }
}
impl Mul for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        each!(F32x16, vmulq_f32, self, b)
    }
}
impl Neg for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        each!(F32x16, vnegq_f32, self)
    }
}

impl Lanes for F32x16 {
    type Real = f32;
    type Mask = Mask;

    #[inline(always)]
    fn splat(v: f32) -> Self {
        // SAFETY: see `each`.
        unsafe { Self([vdupq_n_f32(v); 4]) }
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let from = from[..LANES].as_ptr();
        // SAFETY: the slice holds 16 numbers; the loads need the alignment of one.
        unsafe {
            Self([vld1q_f32(from), vld1q_f32(from.add(4)), vld1q_f32(from.add(8)), vld1q_f32(from.add(12))])
        }
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let (to, [a, b, c, d]) = (to[..LANES].as_mut_ptr(), self.0);
        // SAFETY: the slice holds 16 numbers; the stores need the alignment of one.
        unsafe {
            vst1q_f32(to, a);
            vst1q_f32(to.add(4), b);
            vst1q_f32(to.add(8), c);
            vst1q_f32(to.add(12), d);
        }
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        each!(F32x16, vfmaq_f32, c, self, b)
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        each!(F32x16, vdivq_f32, self, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        each!(F32x16, vsqrtq_f32, self)
    }
    /// NEON's own maximum is NaN where either is; the other levels then take `b`.
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self::select(self.gt(b), self, b)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self::select(b.gt(self), self, b)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        each!(F32x16, vabsq_f32, self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        each!(F32x16, vrndmq_f32, self)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        // SAFETY: see `each`.
        let bit = unsafe { Mask([vdupq_n_u32(1 << 31); 4]) };
        Self::select(bit, sign, self)
    }
    #[inline(always)]
    fn gt(self, b: Self) -> Mask {
        each!(Mask, vcgtq_f32, self, b)
    }
    #[inline(always)]
    fn select(mask: Mask, a: Self, b: Self) -> Self {
        each!(F32x16, vbslq_f32, mask, a, b)
    }
    #[inline(always)]
    fn and(a: Mask, b: Mask) -> Mask {
        each!(Mask, vandq_u32, a, b)
    }
    #[inline(always)]
    fn bits(mask: Mask) -> u16 {
        // SAFETY: the array holds 4 numbers.
        unsafe {
            let place = vld1q_u32([1, 2, 4, 8].as_ptr());
            let quarter = |q: usize| vaddvq_u32(vandq_u32(mask.0[q], place)) << (4 * q);
            (quarter(0) | quarter(1) | quarter(2) | quarter(3)) as u16
        }
    }
    #[inline(always)]
    fn exp2i(self) -> Self {
        // SAFETY: see `each`.
        Self(self.0.map(|n| unsafe {
            let biased = vaddq_s32(vcvtnq_s32_f32(n), vdupq_n_s32(127));
            vreinterpretq_f32_s32(vshlq_n_s32::<23>(biased))
        }))
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        // SAFETY: see `each`.
        let e = Self(self.0.map(|v| unsafe {
            let e = vshrq_n_u32::<23>(vreinterpretq_u32_f32(v));
            vcvtq_f32_s32(vsubq_s32(vreinterpretq_s32_u32(e), vdupq_n_s32(126)))
        }));
        // SAFETY: see `each`.
        let m = Self(self.0.map(|v| unsafe {
            let fraction = vandq_u32(vreinterpretq_u32_f32(v), vdupq_n_u32(0x007f_ffff));
            vreinterpretq_f32_u32(vorrq_u32(fraction, vdupq_n_u32(126 << 23)))
        }));
        // The mantissa is in [0.5, 1); move the lower part up, so that it is centred on 1.
        let low = Self::splat(std::f32::consts::FRAC_1_SQRT_2).gt(m);
        (Self::select(low, e - Self::splat(1.0), e), Self::select(low, m + m, m))
    }
    #[inline(always)]
    fn repeat4(q: &[f32]) -> Self {
        // SAFETY: the slice holds 4 numbers; the load needs the alignment of one.
        Self([unsafe { vld1q_f32(q[..4].as_ptr()) }; 4])
    }
    #[inline(always)]
    fn spread4(q: &[f32]) -> Self {
        let q = &q[..4];
        // SAFETY: see `each`.
        unsafe { Self([vdupq_n_f32(q[0]), vdupq_n_f32(q[1]), vdupq_n_f32(q[2]), vdupq_n_f32(q[3])]) }
    }
    #[inline(always)]
    fn sum_nodes(a: Self, b: Self, c: Self, d: Self) -> Self {
        // SAFETY: see `each`.
        let sum = |Self([n0, n1, n2, n3])| unsafe { vaddq_f32(vaddq_f32(n0, n2), vaddq_f32(n1, n3)) };
        Self([sum(a), sum(b), sum(c), sum(d)])
    }
    #[inline(always)]
    fn sum_components(self) -> Self {
        // SAFETY: see `each`.
        Self(self.0.map(|n| unsafe {
            let pairs = vpaddq_f32(n, n);
            vpaddq_f32(pairs, pairs)
        }))
    }
    #[inline(always)]
    fn transpose(m: &mut [Self; LANES]) {
        let before = *m;
        for row in 0..4 {
            for column in 0..4 {
                let block = std::array::from_fn(|i| before[4 * row + i].0[column]);
                for (i, v) in transpose4(block).into_iter().enumerate() {
                    m[4 * column + i].0[row] = v;
                }
            }
        }
    }
}

/// Transposes 4 vectors of 4 lanes: pairs, halves.
#[inline(always)]
fn transpose4([r0, r1, r2, r3]: [float32x4_t; 4]) -> [float32x4_t; 4] {
    // SAFETY: see `each`.
    unsafe {
        let pairs = |v| vreinterpretq_f64_f32(v);
        let (even01, odd01) = (pairs(vtrn1q_f32(r0, r1)), pairs(vtrn2q_f32(r0, r1)));
        let (even23, odd23) = (pairs(vtrn1q_f32(r2, r3)), pairs(vtrn2q_f32(r2, r3)));
        [
            vreinterpretq_f32_f64(vtrn1q_f64(even01, even23)),
            vreinterpretq_f32_f64(vtrn1q_f64(odd01, odd23)),
            vreinterpretq_f32_f64(vtrn2q_f64(even01, even23)),
            vreinterpretq_f32_f64(vtrn2q_f64(odd01, odd23)),
        ]
    }
}
