//! exp, ln and sinh(x)/x for any vector type, from one polynomial text.
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
    for k in (1..=count).rev() {
        inverse_factorial *= k as f64;
        p = p.mul_add(r, L::constant(inverse_factorial));
    }
    p * n.exp2i()
}

/// Natural logarithm of positive normal numbers.
#[inline(always)]
pub fn ln<L: Lanes>(x: L) -> L {
    let (e, m) = x.split_exponent();
    let one = L::constant(1.0);
    // ln m = 2 artanh z with z = (m - 1) / (m + 1), |z| <= 0.172.
    let z = (m - one).div(m + one);
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
}
