//! Vectors as plain arrays: the reference on every machine, and all of f64.
//!
//! Imports the traits only. A fused multiply-add is deliberately two roundings here, so that the bits
//! are the same whatever the processor.

use std::ops::{Add, Mul, Neg, Sub};

use super::{LANES, Lanes};

/// Sixteen numbers in an array.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Portable<T>(pub [T; LANES]);

macro_rules! lanewise {
    ($a:ident, $b:ident, $e:expr) => {{
        let mut r = $a;
        for i in 0..LANES {
            let ($a, $b) = ($a.0[i], $b.0[i]);
            r.0[i] = $e;
        }
        r
    }};
    ($a:ident, $e:expr) => {{
        let mut r = $a;
        for i in 0..LANES {
            let $a = $a.0[i];
            r.0[i] = $e;
        }
        r
    }};
}

macro_rules! portable {
    ($t:ty, $bits:ty, $mantissa_bits:expr, $bias:expr) => {
        impl Add for Portable<$t> {
            type Output = Self;
            #[inline(always)]
            fn add(self, b: Self) -> Self {
                let a = self;
                lanewise!(a, b, a + b)
            }
        }
        impl Sub for Portable<$t> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, b: Self) -> Self {
                let a = self;
                lanewise!(a, b, a - b)
            }
        }
        impl Mul for Portable<$t> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, b: Self) -> Self {
                let a = self;
                lanewise!(a, b, a * b)
            }
        }
        impl Neg for Portable<$t> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                let a = self;
                lanewise!(a, -a)
            }
        }
        impl Lanes for Portable<$t> {
            type Real = $t;
            type Mask = [bool; LANES];

            #[inline(always)]
            fn splat(v: $t) -> Self {
                Self([v; LANES])
            }
            #[inline(always)]
            fn load(from: &[$t]) -> Self {
                let mut r = Self([0.0; LANES]);
                r.0.copy_from_slice(&from[..LANES]);
                r
            }
            #[inline(always)]
            fn store(self, to: &mut [$t]) {
                to[..LANES].copy_from_slice(&self.0);
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                self * b + c
            }
            #[inline(always)]
            fn div(self, b: Self) -> Self {
                let a = self;
                lanewise!(a, b, a / b)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                let a = self;
                lanewise!(a, a.sqrt())
            }
            #[inline(always)]
            fn max(self, b: Self) -> Self {
                let a = self;
                lanewise!(a, b, if a > b { a } else { b })
            }
            #[inline(always)]
            fn min(self, b: Self) -> Self {
                let a = self;
                lanewise!(a, b, if a < b { a } else { b })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                let a = self;
                lanewise!(a, a.abs())
            }
            #[inline(always)]
            fn floor(self) -> Self {
                let a = self;
                lanewise!(a, a.floor())
            }
            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                let a = self;
                lanewise!(a, sign, a.copysign(sign))
            }
            #[inline(always)]
            fn gt(self, b: Self) -> [bool; LANES] {
                let mut m = [false; LANES];
                for i in 0..LANES {
                    m[i] = self.0[i] > b.0[i];
                }
                m
            }
            #[inline(always)]
            fn select(mask: [bool; LANES], a: Self, b: Self) -> Self {
                let mut r = b;
                for i in 0..LANES {
                    r.0[i] = if mask[i] { a.0[i] } else { b.0[i] };
                }
                r
            }
            #[inline(always)]
            fn and(a: [bool; LANES], b: [bool; LANES]) -> [bool; LANES] {
                let mut m = a;
                for i in 0..LANES {
                    m[i] &= b[i];
                }
                m
            }
            #[inline(always)]
            fn bits(mask: [bool; LANES]) -> u16 {
                let mut bits = 0;
                for (i, m) in mask.iter().enumerate() {
                    bits |= u16::from(*m) << i;
                }
                bits
            }
            #[inline(always)]
            fn exp2i(self) -> Self {
                let a = self;
                lanewise!(a, <$t>::from_bits(((a as i64 + $bias) as $bits) << $mantissa_bits))
            }
            #[inline(always)]
            fn split_exponent(self) -> (Self, Self) {
                let (mut e, mut m) = (self, self);
                for i in 0..LANES {
                    let bits = self.0[i].to_bits();
                    let half = bits & ((1 << $mantissa_bits) - 1) | (($bias - 1) << $mantissa_bits);
                    let (mut mantissa, mut exponent) =
                        (<$t>::from_bits(half), (bits >> $mantissa_bits) as $t - ($bias - 1) as $t);
                    // The mantissa is in [0.5, 1); move the lower part up, so that it is centred on 1.
                    if mantissa < std::f64::consts::FRAC_1_SQRT_2 as $t {
                        mantissa += mantissa;
                        exponent -= 1.0;
                    }
                    (e.0[i], m.0[i]) = (exponent, mantissa);
                }
                (e, m)
            }
            #[inline(always)]
            fn repeat4(q: &[$t]) -> Self {
                let mut r = Self([0.0; LANES]);
                for node in r.0.chunks_exact_mut(4) {
                    node.copy_from_slice(&q[..4]);
                }
                r
            }
            #[inline(always)]
            fn spread4(q: &[$t]) -> Self {
                let mut r = Self([0.0; LANES]);
                for (node, v) in r.0.chunks_exact_mut(4).zip(&q[..4]) {
                    node.fill(*v);
                }
                r
            }
            #[inline(always)]
            fn sum_nodes(a: Self, b: Self, c: Self, d: Self) -> Self {
                let mut r = a;
                let rows = [a, b, c, d];
                for q in 0..4 {
                    for k in 0..4 {
                        let v = &rows[q].0;
                        r.0[4 * q + k] = (v[k] + v[4 + k]) + (v[8 + k] + v[12 + k]);
                    }
                }
                r
            }
            #[inline(always)]
            fn sum_components(self) -> Self {
                let mut r = self;
                for node in r.0.chunks_exact_mut(4) {
                    let sum = (node[0] + node[1]) + (node[2] + node[3]);
                    node.fill(sum);
                }
                r
            }
            #[inline(always)]
            fn transpose(m: &mut [Self; LANES]) {
                for i in 0..LANES {
                    for j in 0..i {
                        let t = m[i].0[j];
                        m[i].0[j] = m[j].0[i];
                        m[j].0[i] = t;
                    }
                }
            }
        }
    };
}

portable!(f32, u32, 23, 127);
portable!(f64, u64, 52, 1023);
