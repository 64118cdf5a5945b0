//! Sixteen particles at once: the vector type that every kernel is written against.
//!
//! A kernel is one text, generic over [`Lanes`]; [`Real::dispatch`] runs it with the widest vectors that
//! the machine has, or with plain arrays. Intrinsics live in `avx2`, `avx512` and `neon` and nowhere
//! else; imports nothing of donut.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod elementary;
mod matrix;
#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
mod neon;
mod portable;
#[cfg(test)]
mod tests;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

pub use elementary::{exp, exp_m1, ln, ln_1p, sinhc};
pub use matrix::{M3, congruence, det, identity, mul, mul_t, splat_m3, t_mul};
pub use portable::Portable;

/// Particles in a block, and lanes in a vector.
pub const LANES: usize = 16;

/// The scalar type of a simulation: `f32` for speed, `f64` as the reference.
pub trait Real:
    Copy
    + PartialOrd
    + Default
    + Send
    + Sync
    + Debug
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// Rounds to this precision.
    fn from_f64(v: f64) -> Self;
    /// Widens; exact.
    fn to_f64(self) -> f64;
    /// Runs `kernel` with the vectors of `level`.
    ///
    /// # Panics
    /// If the machine has no such instructions.
    fn dispatch<K: Kernel<Self>>(level: SimdLevel, kernel: K) -> K::Output;
}

/// A piece of work that can be compiled for any vector type.
///
/// Implementations of [`Kernel::run`] must be `#[inline(always)]`, and so must all they call: only then
/// does the code land inside the function that has the instruction set switched on. Closures over lanes, and with
/// them `array::map` and `from_fn`, may stay outside it, and then each operation is a call.
pub trait Kernel<T: Real> {
    /// What the work returns.
    type Output;
    /// Does the work.
    fn run<L: Lanes<Real = T>>(self) -> Self::Output;
}

/// Which instructions the kernels use.
///
/// In f64 all levels give the same bits. In f32 all vector levels do; plain arrays give others, because
/// they round a product before they add to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum SimdLevel {
    /// Plain arrays, no fused multiply-add: the same bits on every machine.
    Scalar,
    /// AVX2 with FMA (x86-64).
    Avx2,
    /// AVX-512 F, BW, CD, DQ and VL (x86-64).
    Avx512,
    /// NEON (aarch64).
    Neon,
}

impl SimdLevel {
    /// The levels of this machine, the fastest last.
    pub fn available() -> impl DoubleEndedIterator<Item = Self> {
        [Self::Scalar, Self::Avx2, Self::Avx512, Self::Neon].into_iter().filter(|level| level.is_available())
    }

    /// The fastest level of this machine.
    pub fn best() -> Self {
        Self::available().next_back().unwrap_or(Self::Scalar)
    }

    /// Whether this machine has the instructions.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::is_available(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => avx512::is_available(),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
            Self::Neon => cfg!(all(target_arch = "aarch64", target_feature = "neon")),
        }
    }
}

impl Real for f32 {
    #[inline(always)]
    fn from_f64(v: f64) -> Self {
        v as f32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn dispatch<K: Kernel<Self>>(level: SimdLevel, kernel: K) -> K::Output {
        assert!(level.is_available(), "this machine has no {level:?}");
        match level {
            SimdLevel::Scalar => kernel.run::<Portable<f32>>(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the instructions were just found to exist.
            SimdLevel::Avx2 => unsafe { avx2::run::<f32, avx2::F32x16, K>(kernel) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: likewise.
            SimdLevel::Avx512 => unsafe { avx512::run::<f32, avx512::F32x16, K>(kernel) },
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            SimdLevel::Neon => kernel.run::<neon::F32x16>(),
            _ => unreachable!("the levels of other machines were just refused"),
        }
    }
}

impl Real for f64 {
    #[inline(always)]
    fn from_f64(v: f64) -> Self {
        v
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    /// In f64 the vectors are always plain arrays, so that its bits do not depend on the machine; the
    /// level only tells the compiler how wide it may make them.
    #[inline]
    fn dispatch<K: Kernel<Self>>(level: SimdLevel, kernel: K) -> K::Output {
        assert!(level.is_available(), "this machine has no {level:?}");
        match level {
            SimdLevel::Scalar => kernel.run::<Portable<f64>>(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the instructions were just found to exist.
            SimdLevel::Avx2 => unsafe { avx2::run::<f64, Portable<f64>, K>(kernel) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: likewise.
            SimdLevel::Avx512 => unsafe { avx512::run::<f64, Portable<f64>, K>(kernel) },
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            SimdLevel::Neon => kernel.run::<Portable<f64>>(),
            _ => unreachable!("the levels of other machines were just refused"),
        }
    }
}

/// Asks for the memory that will be read soon. A hint: it changes no result.
#[inline(always)]
pub fn prefetch<T>(soon: &[T]) {
    #[cfg(target_arch = "x86_64")]
    avx2::prefetch(soon);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = soon;
}

/// Sixteen numbers that are computed with as one.
///
/// The transfers read the same sixteen as a *row*: four grid nodes along z with four components each
/// (momentum and mass).
pub trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + 'static
{
    /// Type of one lane.
    type Real: Real;
    /// One truth value per lane.
    type Mask: Copy;

    /// All lanes equal.
    fn splat(v: Self::Real) -> Self;
    /// Reads the first 16 numbers of `from`; panics if there are fewer.
    fn load(from: &[Self::Real]) -> Self;
    /// Writes the first 16 numbers of `to`; panics if there are fewer.
    fn store(self, to: &mut [Self::Real]);
    /// `self * b + c`, fused where the machine can.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self / b`.
    fn div(self, b: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Lane-wise maximum.
    fn max(self, b: Self) -> Self;
    /// Lane-wise minimum.
    fn min(self, b: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Largest integer not above.
    fn floor(self) -> Self;
    /// Magnitude of `self`, sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// `self > b`; false for NaN.
    fn gt(self, b: Self) -> Self::Mask;
    /// `a` where the mask holds, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// Both masks.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// The lanes of the mask as bits, lane 0 lowest.
    fn bits(mask: Self::Mask) -> u16;
    /// `2^n` for integral lanes within the exponent range.
    fn exp2i(self) -> Self;
    /// (exponent, mantissa) of positive normal lanes, the mantissa in `[sqrt(1/2), sqrt(2))`.
    fn split_exponent(self) -> (Self, Self);

    /// The four numbers, four times: one component vector for each node of a row.
    fn repeat4(q: &[Self::Real]) -> Self;
    /// Each of the four numbers four times in a row: one weight for each node of a row.
    fn spread4(q: &[Self::Real]) -> Self;
    /// Sums each row over its nodes: `[sum a, sum b, sum c, sum d]`, four components each.
    fn sum_nodes(a: Self, b: Self, c: Self, d: Self) -> Self;
    /// Each node's four components summed, in all four of its places.
    fn sum_components(self) -> Self;
    /// Transposes 16 vectors of 16 lanes in place.
    fn transpose(m: &mut [Self; LANES]);

    /// All lanes equal to a constant.
    #[inline(always)]
    fn constant(v: f64) -> Self {
        Self::splat(Self::Real::from_f64(v))
    }
}
