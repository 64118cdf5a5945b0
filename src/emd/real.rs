//! The two floating-point types the kernels are written for.
//!
//! Everything numeric in this layer is generic over [`Real`], so that `f32` and `f64` run from one
//! text; the operations are the ones LLVM turns into vector instructions when they stand in a loop.
//! Imports nothing.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// `f32` or `f64`, with the few operations that the kernels need.
///
/// No operation is fused and none is reassociated, so a kernel gives the same bits whether it runs
/// with AVX2 or without.
pub trait Real:
    Copy
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + 'static
{
    const ZERO: Self;
    const ONE: Self;
    const INFINITY: Self;
    /// Stands for a cost that is never worth paying, where an infinity would make a NaN.
    const FAR: Self;
    /// More than rounding adds up to in a few dozen operations on numbers below 10.
    const SLACK: Self;
    /// Base-2 exponent below which a term of a sum of exponentials is left out.
    const NEGLIGIBLE: Self;

    /// Rounds to this type.
    fn of(value: f64) -> Self;
    /// Widens, without loss.
    fn wide(self) -> f64;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// 2^self for exponents between `NEGLIGIBLE` and 100, to about the last bit; wrong outside.
    fn exp2(self) -> Self;

    /// The smaller of two; `other` if one is NaN. Compiles to one vector instruction.
    #[inline(always)]
    fn least(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    /// The larger of two; `other` if one is NaN.
    #[inline(always)]
    fn most(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
}

/// The polynomial in `$x` whose coefficients are those of 2^r at the given powers, highest first.
macro_rules! horner {
    ($x:ident, $first:expr $(, $power:expr)*) => {{
        let mut sum = const { coefficient($first) as Self };
        $(sum = sum * $x + const { coefficient($power) as Self };)*
        sum
    }};
}

/// `Real` for one type. Adding `1.5 * 2^mantissa` rounds to an integer and leaves it in the low
/// bits, where a shift makes it the exponent of a power of two; what remains of the argument lies in
/// [-1/2, 1/2], where the Taylor series of 2^r = exp(r ln 2) converges in a few terms; even and odd ones apart, so
/// that two chains of operations run side by side.
macro_rules! impl_real {
    ($t:ident, $bits:ident, $mantissa:expr, $negligible:expr, [$($even:expr),+], [$($odd:expr),+]) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const INFINITY: Self = $t::INFINITY;
            const FAR: Self = 1e30;
            const SLACK: Self = 64.0 * $t::EPSILON;
            const NEGLIGIBLE: Self = $negligible;

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $t
            }
            #[inline(always)]
            fn wide(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $t::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $t::abs(self)
            }
            #[inline(always)]
            fn ln(self) -> Self {
                $t::ln(self)
            }
            #[inline(always)]
            fn exp2(self) -> Self {
                const ROUNDER: $t = 1.5 * (1u64 << $mantissa) as $t;
                let shifted = self + ROUNDER;
                let r = self - (shifted - ROUNDER);
                let power = $t::from_bits((shifted.to_bits() << $mantissa).wrapping_add((1.0 as $t).to_bits()));
                let square = r * r;
                let even = horner!(square, $($even),+);
                let odd = horner!(square, $($odd),+);
                power * (even + r * odd)
            }
        }
    };
}

/// (ln 2)^k / k!, the Taylor coefficient of 2^r.
const fn coefficient(k: u32) -> f64 {
    let mut c = 1.0;
    let mut i = 1;
    while i <= k {
        c *= std::f64::consts::LN_2 / i as f64;
        i += 1;
    }
    c
}

// 2^-36 and 2^-66: with 20000 terms left out the sum is still right to the type's precision.
impl_real!(f32, u32, 23, -40.0, [6, 4, 2, 0], [5, 3, 1]);
impl_real!(f64, u64, 52, -66.0, [12, 10, 8, 6, 4, 2, 0], [11, 9, 7, 5, 3, 1]);

#[cfg(test)]
mod tests {
    use super::*;

    fn worst_relative_error<T: Real>() -> f64 {
        let lowest = T::NEGLIGIBLE.wide();
        (0..=100_000)
            .map(|k| {
                let t = T::of(lowest + (1.0 - lowest) * f64::from(k) / 100_000.0);
                (t.exp2().wide() / t.wide().exp2() - 1.0).abs()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn exp2_is_right_to_the_last_bits() {
        assert!(worst_relative_error::<f32>() < 3e-7, "{}", worst_relative_error::<f32>());
        assert!(worst_relative_error::<f64>() < 1e-15, "{}", worst_relative_error::<f64>());
        assert_eq!(0.0_f32.exp2(), 1.0);
        assert_eq!(0.0_f64.exp2(), 1.0);
    }
}
