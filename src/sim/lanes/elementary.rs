//! exp, ln, their variants near 0 and 1, and sinh(x)/x for any vector type, from one polynomial text.
//!
//! Takes and returns [`Lanes`]; accurate to about one unit in the last place of the lane type. Written
//! here and not taken from a library because the result must not depend on the machine's libm.

use super::{Lanes, Real};

/// Terms of a series that are enough for the precision of `T`.
#[inline(always)]
fn terms<T: Real>(f32_terms: usize, f64_terms: usize) -> usize {
    if size_of::<T>() == 4 { f32_terms } else { f64_terms }
}

/// `e^x`; the argument is clamped to the range of normal f32 exponents (or f64's).
#[inline(always)]
pub fn exp<L: Lanes>(x: L) -> L {
    let (scale, rest) = split_exp(x);
    scale.mul_add(rest, scale)
}

/// `e^x - 1`, accurate also where x is small.
#[inline(always)]
pub fn exp_m1<L: Lanes>(x: L) -> L {
    let (scale, rest) = split_exp(x);
    // The scale is 1 where |x| < ln(2)/2: nothing cancels.
    scale.mul_add(rest, scale - L::constant(1.0))
}

/// `(2^n, e^r - 1)` with x = n ln 2 + r, |r| <= ln(2)/2.
#[inline(always)]
fn split_exp<L: Lanes>(x: L) -> (L, L) {
    let limit = if size_of::<L::Real>() == 4 { 87.0 } else { 708.0 };
    let x = x.max(L::constant(-limit)).min(L::constant(limit));
    let n = x.mul_add(L::constant(std::f64::consts::LOG2_E), L::constant(0.5)).floor();
    // ln 2 in two parts (Cody and Waite): n times the first is exact.
    let (hi, lo) = if size_of::<L::Real>() == 4 {
        (0.693_145_751_953_125, 1.428_606_820_309_417_2e-6)
    } else {
        (0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10)
    };
    let r = n.mul_add(L::constant(-lo), n.mul_add(L::constant(-hi), x));
    let count = terms::<L::Real>(7, 13);
    let mut inverse_factorial = 1.0;
    for k in 2..=count {
        inverse_factorial /= k as f64;
    }
    let mut p = L::constant(inverse_factorial);
    for k in (2..=count).rev() {
        inverse_factorial *= k as f64;
        p = p.mul_add(r, L::constant(inverse_factorial));
    }
    (n.exp2i(), p * r)
}

/// Natural logarithm of positive normal numbers.
#[inline(always)]
pub fn ln<L: Lanes>(x: L) -> L {
    let (e, m) = x.split_exponent();
    ln_from(e, m - L::constant(1.0))
}

/// `ln(1 + x)`, accurate also where x is small; from `LEAST - 1` down as if `1 + x` were [`LEAST`].
#[inline(always)]
pub fn ln_1p<L: Lanes>(x: L) -> L {
    let one = L::constant(1.0);
    let (e, m) = (one + x).max(L::constant(LEAST)).split_exponent();
    // Where 1 + x needs no scaling, x itself has the digits that the sum lost.
    let scaled = e.abs().gt(L::constant(0.5));
    ln_from(e, L::select(scaled, m - one, x))
}

/// The smallest number that [`ln_1p`] takes the logarithm of.
const LEAST: f64 = 1e-30;

/// `e ln 2 + ln(1 + y)` for 1 + y in [sqrt(1/2), sqrt(2)).
#[inline(always)]
fn ln_from<L: Lanes>(e: L, y: L) -> L {
    // ln(1 + y) = 2 artanh z with z = y / (2 + y), |z| <= 0.172.
    let z = y.div(y + L::constant(2.0));
    let z2 = z * z;
    let count = terms::<L::Real>(5, 11);
    let mut p = L::constant(2.0 / (2 * count + 1) as f64);
    for k in (1..count).rev() {
        p = p.mul_add(z2, L::constant(2.0 / (2 * k + 1) as f64));
    }
    let tail = p * z2 * z;
    e.mul_add(L::constant(std::f64::consts::LN_2), tail + (z + z))
}

/// `sinh(x) / x`, 1 at x = 0; the series below 1, exponentials above.
#[inline(always)]
pub fn sinhc<L: Lanes>(x: L) -> L {
    let x2 = x * x;
    let count = terms::<L::Real>(5, 9);
    let mut p = L::constant(1.0);
    for k in (1..=count).rev() {
        // Horner: 1 + x^2/(2k (2k+1)) * (...)
        p = (p * x2).mul_add(L::constant(1.0 / (2 * k * (2 * k + 1)) as f64), L::constant(1.0));
    }
    let big = x2.gt(L::constant(1.0));
    if L::bits(big) == 0 {
        return p;
    }
    let ax = x.abs().max(L::constant(0.5));
    let e = exp(ax);
    let far = (e - L::constant(1.0).div(e)).div(ax + ax);
    L::select(big, far, p)
}

#[cfg(test)]
mod tests {
    use super::super::{Kernel, LANES, SimdLevel};
    use super::*;

    struct Table<'a, T>(&'a [T; LANES]);

    impl<T: Real> Kernel<T> for Table<'_, T> {
        type Output = [[T; LANES]; 3];
        #[inline(always)]
        fn run<L: Lanes<Real = T>>(self) -> Self::Output {
            let x = L::load(self.0);
            let mut out = [[T::default(); LANES]; 3];
            exp(x).store(&mut out[0]);
            ln(x.abs().max(L::constant(1e-30))).store(&mut out[1]);
            sinhc(x).store(&mut out[2]);
            out
        }
    }

    fn worst<T: Real>(level: SimdLevel) -> f64 {
        let mut worst = 0.0f64;
        for k in 0..40 {
            let x: [T; LANES] =
                std::array::from_fn(|i| T::from_f64((i as f64 - 7.3) * 0.05 * f64::from(k) + 1e-3));
            let got = T::dispatch(level, Table(&x));
            for i in 0..LANES {
                let v = x[i].to_f64();
                let sinhc = if v == 0.0 { 1.0 } else { v.sinh() / v };
                for (g, want) in [(got[0][i], v.exp()), (got[2][i], sinhc)] {
                    worst = worst.max((g.to_f64() / want - 1.0).abs());
                }
                worst = worst.max((got[1][i].to_f64() - v.abs().ln()).abs());
            }
        }
        worst
    }

    #[test]
    fn agree_with_the_standard_library() {
        for level in SimdLevel::available() {
            let (single, double) = (worst::<f32>(level), worst::<f64>(level));
            assert!(single < 2e-6, "f32 {level:?}: {single:e}");
            assert!(double < 5e-15, "f64 {level:?}: {double:e}");
        }
    }

    struct NearZero<'a, T>(&'a [T; LANES]);

    impl<T: Real> Kernel<T> for NearZero<'_, T> {
        type Output = [[T; LANES]; 2];
        #[inline(always)]
        fn run<L: Lanes<Real = T>>(self) -> Self::Output {
            let x = L::load(self.0);
            let mut out = [[T::default(); LANES]; 2];
            exp_m1(x).store(&mut out[0]);
            ln_1p(x).store(&mut out[1]);
            out
        }
    }

    /// The largest relative error over small and large arguments of either sign.
    fn worst_near_zero<T: Real>(level: SimdLevel) -> f64 {
        let mut worst = 0.0f64;
        for k in 0..60 {
            let size = 0.9 * 0.6f64.powi(k);
            let x: [T; LANES] = std::array::from_fn(|i| T::from_f64((i as f64 - 7.3) / 8.0 * size));
            let got = T::dispatch(level, NearZero(&x));
            for i in 0..LANES {
                let v = x[i].to_f64();
                for (g, want) in [(got[0][i], v.exp_m1()), (got[1][i], v.ln_1p())] {
                    worst = worst.max((g.to_f64() / want - 1.0).abs());
                }
            }
        }
        worst
    }

    #[test]
    fn keep_their_relative_accuracy_near_zero() {
        for level in [SimdLevel::Scalar, SimdLevel::best()] {
            let (single, double) = (worst_near_zero::<f32>(level), worst_near_zero::<f64>(level));
            assert!(single < 4e-7, "f32 {level:?}: {single:e}");
            assert!(double < 1e-15, "f64 {level:?}: {double:e}");
        }
        assert!(f64::dispatch(SimdLevel::best(), NearZero(&[-1.0; LANES]))[1][0] < -60.0);
    }
}
