//! The two floating-point types the kernels are written for.
//!
//! Everything numeric in this layer is generic over [`Real`], so that `f32` and `f64` run from one
//! text; the operations are the ones LLVM turns into vector instructions when they stand in a loop.
//! Imports nothing.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// `f32` or `f64`, with the few operations that the kernels need.
///
/// No operation is reassociated, and none but [`Real::mul_add`] fused: a kernel without it gives the same bits
/// with all instruction sets.
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
    /// `self * b + c`, rounded once if `FUSED`. Without an instruction for it that is slow, so it
    /// has to come from [`super::wide::Kernel::run`].
    fn mul_add<const FUSED: bool>(self, b: Self, c: Self) -> Self;
    /// 2^self for exponents between `NEGLIGIBLE` and 100, to about the last bit; wrong outside.
    fn exp2<const FUSED: bool>(self) -> Self;

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

/// The polynomial in `$x` with these coefficients, highest first.
macro_rules! horner {
    ($x:ident, $first:expr $(, $coefficient:expr)*) => {{
        let mut sum: Self = const { $first as Self };
        $(sum = Real::mul_add::<FUSED>(sum, $x, const { $coefficient as Self });)*
        sum
    }};
}

/// `Real` for one type. Adding `1.5 * 2^mantissa` rounds to an integer and leaves it in the low
/// bits, where a shift makes it the exponent of a power of two; what remains of the argument, `$r`, lies in
/// [-1/2, 1/2], where `$polynomial` is near to 2^r.
macro_rules! impl_real {
    ($t:ident, $mantissa:expr, $negligible:expr, $r:ident => $polynomial:expr) => {
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
            fn mul_add<const FUSED: bool>(self, b: Self, c: Self) -> Self {
                if FUSED { $t::mul_add(self, b, c) } else { self * b + c }
            }
            #[inline(always)]
            fn exp2<const FUSED: bool>(self) -> Self {
                const ROUNDER: $t = 1.5 * (1u64 << $mantissa) as $t;
                let shifted = self + ROUNDER;
                let $r = self - (shifted - ROUNDER);
                let power =
                    $t::from_bits((shifted.to_bits() << $mantissa).wrapping_add((1.0 as $t).to_bits()));
                power * $polynomial
            }
        }
    };
}

/// (ln 2)^k / k!, the Taylor coefficient of 2^r.
const fn taylor(k: u32) -> f64 {
    let mut c = 1.0;
    let mut i = 1;
    while i <= k {
        c *= std::f64::consts::LN_2 / i as f64;
        i += 1;
    }
    c
}

/// Coefficients of r^5 to r of the polynomial for f32.
#[expect(clippy::approx_constant, reason = "the slope of the fit lies near ln 2 and is not it")]
const FITTED: [f32; 5] = [1.326_472_7e-3, 9.671_513e-3, 5.550_733_6e-2, 2.402_224_2e-1, 6.931_47e-1];

// What is negligible: with 20000 terms of 2^-40 or 2^-66 left out the sum is still right to the type's precision.
// The polynomial for f32 has the least largest relative error of all of its degree that are 1 at 0: 9.1e-8,
// rounding apart (fitted by Lawson's reweighted least squares on Chebyshev nodes); that for f64 is the Taylor
// series of exp(r ln 2), even and odd terms apart, so that two chains of operations run side by side.
impl_real!(f32, 23, -40.0, r => horner!(r, FITTED[0], FITTED[1], FITTED[2], FITTED[3], FITTED[4], 1.0));
impl_real!(f64, 52, -66.0, r => {
    let square = r * r;
    let even = horner!(square, taylor(12), taylor(10), taylor(8), taylor(6), taylor(4), taylor(2), 1.0);
    let odd = horner!(square, taylor(11), taylor(9), taylor(7), taylor(5), taylor(3), taylor(1));
    Real::mul_add::<FUSED>(r, odd, even)
});

#[cfg(test)]
mod tests {
    use super::*;

    fn worst_relative_error<T: Real, const FUSED: bool>() -> f64 {
        let lowest = T::NEGLIGIBLE.wide();
        (0..=100_000)
            .map(|k| {
                let t = T::of(lowest + (1.0 - lowest) * f64::from(k) / 100_000.0);
                (t.exp2::<FUSED>().wide() / t.wide().exp2() - 1.0).abs()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn exp2_is_right_to_the_last_bits() {
        for error in [worst_relative_error::<f32, false>(), worst_relative_error::<f32, true>()] {
            assert!(error < 3e-7, "{error}");
        }
        for error in [worst_relative_error::<f64, false>(), worst_relative_error::<f64, true>()] {
            assert!(error < 1e-15, "{error}");
        }
        assert_eq!(Real::exp2::<true>(0.0_f32), 1.0);
        assert_eq!(Real::exp2::<false>(0.0_f64), 1.0);
    }
}
